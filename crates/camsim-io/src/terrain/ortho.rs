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
};
use crate::pictures::{PictureError, read_stored};

/// A picture of the ground.
pub(super) struct Ortho {
    pub texture: Texture,
    /// `None`: it covers the DEM's extent.
    pub place: Option<OrthoPlace>,
    /// What there is to say about it.
    pub notes: Vec<String>,
}

/// Where a picture lies.
pub(super) struct OrthoPlace {
    pixel_from_model: Affine,
    crs: Crs,
    /// Whether that is the DEM's own.
    is_of_dem: bool,
    size: [f64; 2],
    /// Its middle, in its own coordinates.
    middle_x: f64,
}

impl OrthoPlace {
    pub fn uv(&self, dem: &Dem, at: [u32; 2]) -> [f32; 2] {
        let model =
            if self.is_of_dem { Some(dem.model(at)) } else { dem.geodetic_rad(at).and_then(|place| self.crs.model_from_geodetic(place)) };
        // 190 degrees east are 170 degrees west.
        let model = model.map(|[x, y]| [x - self.crs.period().map_or(0.0, |period| period * ((x - self.middle_x) / period).round()), y]);
        // A point that the picture's projection does not reach is outside of the picture.
        let pixel = model.map_or([-1.0, -1.0], |model| self.pixel_from_model.apply(model));
        [(pixel[0] / self.size[0]) as f32, (pixel[1] / self.size[1]) as f32]
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
            finish(&mut texture, None, spec.beyond);
            return Ok(Self { texture, place: None, notes: with_name(path, notes) });
        };
        notes.extend(geo.notes.iter().cloned());
        if let Some(orientation) = geo.orientation {
            notes.push(format!("its orientation (EXIF or tag 274: {orientation}) is not used: its rows lie where its georeference says"));
        }
        let stated = Stated::of(path, &geo)?;
        // A world file states no coordinate system: then it is the DEM's.
        let assumed = (stated.horizontal.is_none() && stated.own.is_none()).then_some(dem.crs.epsg);
        let crs = stated.crs(path, &geo, assumed)?;
        let pixel_from_model = model_from_pixel.inverse().ok_or_else(|| TerrainFileError::DegenerateGeoreference { path: path.into() })?;
        let size = texture.size_px.map(f64::from);
        let over_voids = over_voids(&texture, dem, &model_from_pixel);
        finish(&mut texture, over_voids.as_deref(), spec.beyond);
        let middle_x = model_from_pixel.apply(size.map(|n| 0.5 * n))[0];
        let place = OrthoPlace { pixel_from_model, is_of_dem: crs.epsg == dem.crs.epsg, crs, size, middle_x };
        Ok(Self { texture, place: Some(place), notes: with_name(path, notes) })
    }
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
        return Err(failed(PictureError::decode(path, "scene.terrain.ortho_white is for TIFF files: leave it out")));
    }
    let (texture, orientation) = read_stored(path, Encoding::Srgb).map_err(failed)?;
    let mut geo = GeoTags { orientation, ..GeoTags::default() };
    beside::read_tags(path, &mut geo)?;
    Ok((texture, geo, Vec::new()))
}

/// Neutral, and as bright as a card of 18 % looks: sRGB.
pub(super) const GREY: u8 = 118;

/// Colours of pixels without content. Over ground they are what lies beyond the picture is; where there is no ground they are those of their
/// neighbours, which they would darken.
fn finish(texture: &mut Texture, over_voids: Option<&[bool]>, beyond: Beyond) {
    let light = |byte: u8| linear_from_srgb(f32::from(byte) / 255.0);
    if beyond == Beyond::Grey {
        for (index, pixel) in texture.rgba8.chunks_exact_mut(4).enumerate() {
            if pixel[3] < 255 && over_voids.is_none_or(|voids| !voids[index]) {
                let [share, grey] = [f32::from(pixel[3]) / 255.0, light(GREY)];
                for byte in &mut pixel[..3] {
                    *byte = (255.0 * srgb_from_linear(light(*byte) * share + grey * (1.0 - share))).round() as u8;
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

/// Which pixels lie over voids of a DEM on the same grid: black there is no content, and would darken the rim of what is.
fn over_voids(texture: &Texture, dem: &Dem, ortho_from_pixel: &Affine) -> Option<Vec<bool>> {
    if texture.size_px != dem.size || *ortho_from_pixel != dem.model_from_pixel {
        return None;
    }
    Some((0..dem.points() as usize).map(|index| dem.height_m(dem.column_and_row(index)).is_nan()).collect())
}
