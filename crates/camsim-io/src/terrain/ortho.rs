//! The picture on the ground.

use std::path::Path;

use camsim_core::{
    scenario::{Beyond, TerrainSpec},
    scene::{Encoding, Texture, linear_from_srgb, srgb_from_linear},
};

use super::{
    TerrainFileError, beside,
    crs::Crs,
    dem::{Dem, georeference_of},
    geo_tags::GeoTags,
    georeference::Affine,
    raster::{Raster, is_tiff},
    systems::Stated,
    tiff_file::gdal_translate,
};
use crate::pictures::{PictureError, StoredPicture, read_stored};

/// A picture of the ground.
pub(super) struct Ortho {
    pub texture: Texture,
    /// `None`: it covers the DEM's extent.
    pub place: Option<OrthoPlace>,
    /// Whether there is something at its pixels, where it does not cover all of them.
    content: Option<Vec<bool>>,
    /// Whether it reaches as far as the ground does.
    holds_ground: bool,
    /// What there is to say about it.
    pub notes: Vec<String>,
}

/// Pixels of grey around a picture that ends before the ground does: as many as a screen's pixel may cover
/// before the colours at the picture's very border are drawn less exactly than to a texel.
const MARGIN_PX: u32 = 64;

/// Where a picture lies.
pub(super) struct OrthoPlace {
    pixel_from_model: Affine,
    crs: Crs,
    /// Whether that is the DEM's own.
    is_of_dem: bool,
    size: [f64; 2],
    /// Its middle, in its own coordinates.
    middle_x: f64,
    /// Pixels that it was made larger on each side.
    margin_px: f64,
}

impl OrthoPlace {
    /// Pixel coordinates of a height on the picture as it is stored.
    fn pixel(&self, dem: &Dem, at: [u32; 2]) -> [f64; 2] {
        let model = if self.is_of_dem {
            Some(dem.model(at))
        } else {
            dem.geodetic_rad(at).and_then(|place| self.crs.model_from_geodetic(place))
        };
        // 190 degrees east are 170 degrees west.
        let model = model.map(|[x, y]| {
            [x - self.crs.period().map_or(0.0, |period| period * ((x - self.middle_x) / period).round()), y]
        });
        // A point that the picture's projection does not reach is outside of the picture.
        model.map_or([-1.0, -1.0], |model| self.pixel_from_model.apply(model))
    }

    fn is_inside(&self, pixel: [f64; 2]) -> bool {
        (0..2).all(|k| (0.0..=self.size[k]).contains(&pixel[k]))
    }

    /// Texture coordinates.
    pub fn uv(&self, dem: &Dem, at: [u32; 2]) -> [f32; 2] {
        let pixel = self.pixel(dem, at);
        [0, 1].map(|k: usize| ((pixel[k] + self.margin_px) / (self.size[k] + 2.0 * self.margin_px)) as f32)
    }
}

impl Ortho {
    pub fn read(path: &Path, spec: &TerrainSpec, dem: &Dem) -> Result<Self, TerrainFileError> {
        let (mut texture, geo, mut notes) = picture(path, spec)?;
        let (found, more) = georeference_of(path, geo.model_from_pixel)?;
        notes.extend(more);
        let Some(model_from_pixel) = found else {
            if let Some(orientation) = geo.orientation {
                texture = crate::pictures::oriented(texture, orientation);
            }
            notes.extend(geo.notes);
            let content = content_of(&texture);
            finish(&mut texture, None, spec.beyond);
            return Ok(Self {
                texture,
                place: None,
                content,
                holds_ground: true,
                notes: with_name(path, notes),
            });
        };
        notes.extend(geo.notes.iter().cloned());
        if let Some(orientation) = geo.orientation {
            notes.push(format!("its orientation (EXIF or tag 274: {orientation}) is not used: its rows lie where its georeference says"));
        }
        let stated = Stated::of(path, &geo)?;
        // A world file states no coordinate system: then it is the DEM's.
        let assumed = (stated.horizontal.is_none() && stated.own.is_none()).then_some(dem.crs.epsg);
        let crs = stated.crs(path, &geo, assumed)?;
        let pixel_from_model = model_from_pixel
            .inverse()
            .ok_or_else(|| TerrainFileError::DegenerateGeoreference { path: path.into() })?;
        let size = texture.size_px.map(f64::from);
        let content = content_of(&texture);
        let over_voids = over_voids(&texture, dem, &model_from_pixel);
        finish(&mut texture, over_voids.as_deref(), spec.beyond);
        let middle_x = model_from_pixel.apply(size.map(|n| 0.5 * n))[0];
        let mut place = OrthoPlace {
            pixel_from_model,
            is_of_dem: crs.epsg == dem.crs.epsg,
            crs,
            size,
            middle_x,
            margin_px: 0.0,
        };
        // What holds the border of the ground holds the ground.
        let holds_ground = dem.border().all(|at| place.is_inside(place.pixel(dem, at)));
        if spec.beyond == Beyond::Grey && !holds_ground {
            texture = texture.padded(MARGIN_PX, [GREY, GREY, GREY, 255]);
            place.margin_px = f64::from(MARGIN_PX);
        }
        Ok(Self { texture, place: Some(place), content, holds_ground, notes: with_name(path, notes) })
    }

    /// The colour of ground beyond it, if that is one.
    pub fn color_beyond(&self) -> Option<[u8; 4]> {
        self.place.as_ref().filter(|place| place.margin_px > 0.0).map(|_| [GREY, GREY, GREY, 255])
    }

    /// Texture coordinates of its own corners.
    pub fn own_uv(&self) -> [[f64; 2]; 2] {
        let Some(OrthoPlace { size, margin_px, .. }) = &self.place else { return [[0.0; 2], [1.0; 2]] };
        let share = size.map(|side| margin_px / (side + 2.0 * margin_px));
        [share, share.map(|share| 1.0 - share)]
    }

    /// Whether it shows something at a height.
    pub fn shows(&self, dem: &Dem, at: [u32; 2]) -> bool {
        if self.holds_ground && self.content.is_none() {
            return true;
        }
        let pixel = match &self.place {
            Some(place) => place.pixel(dem, at),
            None => [0, 1].map(|k: usize| {
                (f64::from(at[k]) + 0.5) / f64::from(dem.size[k]) * f64::from(self.texture.size_px[k])
            }),
        };
        if self.place.as_ref().is_some_and(|place| !place.is_inside(pixel)) {
            return false;
        }
        let Some(content) = &self.content else { return true };
        let size = self.place.as_ref().map_or(self.texture.size_px.map(f64::from), |place| place.size);
        let [x, y] = [0, 1].map(|k: usize| pixel[k].min(size[k] - 1.0) as usize);
        content[y * size[0] as usize + x]
    }
}

fn content_of(texture: &Texture) -> Option<Vec<bool>> {
    let content: Vec<bool> = texture.rgba8.chunks_exact(4).map(|pixel| pixel[3] > 0).collect();
    content.contains(&false).then_some(content)
}

fn with_name(path: &Path, notes: Vec<String>) -> Vec<String> {
    notes.into_iter().map(|note| format!("{}: {note}", path.display())).collect()
}

/// With what a file and those beside it say about its place.
fn picture(path: &Path, spec: &TerrainSpec) -> Result<(Texture, GeoTags, Vec<String>), TerrainFileError> {
    let failed = TerrainFileError::of_ortho;
    if is_tiff(path).map_err(failed)? {
        let mut raster = Raster::read(path).map_err(failed)?;
        beside::read_tags(path, &mut raster.geo)?;
        beside::read_mask(path, &mut raster).map_err(failed)?;
        let (texture, notes) = raster.to_picture(path, Encoding::Srgb, spec.ortho_white).map_err(failed)?;
        return Ok((texture, raster.geo, notes));
    }
    if spec.ortho_white.is_some() {
        return Err(failed(PictureError::decode(
            path,
            "scene.terrain.ortho_white is for TIFF files: leave it out",
        )));
    }
    let StoredPicture { texture, orientation, largest_of_16_bits } =
        read_stored(path, Encoding::Srgb).map_err(failed)?;
    let mut geo = GeoTags { orientation, ..GeoTags::default() };
    beside::read_tags(path, &mut geo)?;
    let dark = largest_of_16_bits.filter(|largest| (1..1 << 14).contains(largest)).map(|largest| {
        let white = (1_u32 << (u16::BITS - largest.leading_zeros())) - 1;
        let command = gdal_translate(&format!("-ot Byte -scale 0 {white} 0 255"), path);
        format!(
            "its values of 16 bits end at {largest} of 65535: the picture is nearly black. If white is {white}, convert it with `{command}`"
        )
    });
    Ok((texture, geo, dark.into_iter().collect()))
}

/// Neutral, and as bright as a card of 18 % looks: sRGB.
pub(super) const GREY: u8 = 118;

/// Colours of pixels without content. Over ground they are what lies beyond the picture is; where there is no
/// ground they are those of their neighbours, which they would darken.
fn finish(texture: &mut Texture, over_voids: Option<&[bool]>, beyond: Beyond) {
    let light = |byte: u8| linear_from_srgb(f32::from(byte) / 255.0);
    if beyond == Beyond::Grey {
        for (index, pixel) in texture.rgba8.chunks_exact_mut(4).enumerate() {
            if pixel[3] < 255 && over_voids.is_none_or(|voids| !voids[index]) {
                let [share, grey] = [f32::from(pixel[3]) / 255.0, light(GREY)];
                for byte in &mut pixel[..3] {
                    *byte =
                        (255.0 * srgb_from_linear(light(*byte) * share + grey * (1.0 - share))).round() as u8;
                }
                pixel[3] = 255;
            }
        }
    }
    if let Some(voids) = over_voids {
        for (pixel, is_void) in texture.rgba8.chunks_exact_mut(4).zip(voids) {
            if *is_void && pixel[..3] == [0, 0, 0] {
                pixel[3] = 0;
            }
        }
    }
    texture.bleed_into_transparent();
}

/// Which pixels lie over voids of a DEM on the same grid: black there is no content, and would darken the rim
/// of what is.
fn over_voids(texture: &Texture, dem: &Dem, ortho_from_pixel: &Affine) -> Option<Vec<bool>> {
    if texture.size_px != dem.size || *ortho_from_pixel != dem.model_from_pixel {
        return None;
    }
    Some((0..dem.points() as usize).map(|index| dem.height_m(dem.column_and_row(index)).is_nan()).collect())
}
