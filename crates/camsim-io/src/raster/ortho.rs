//! The ortho-image on the terrain.

use std::path::{Path, PathBuf};

use camsim_core::{
    scenario::{Beyond, FileList, TerrainSpec},
    scene::{Encoding, Texture, linear_from_srgb, srgb_from_linear},
};

use super::{
    TerrainFileError,
    crs::Crs,
    decoded::{Raster, is_tiff},
    dem::Dem,
    files,
    geo_tags::{GeoKeys, GeoTags},
    georeference::Affine,
    grid_tiles, sidecar,
    stated_crs::StatedCrs,
    tiff_file::gdal_translate,
    tile::read_georeference,
};
use crate::{
    raster::pictures::{PictureError, StoredPicture, read_stored},
    text::wording::joined_notes,
};

/// An ortho-image.
pub(super) struct Ortho {
    /// The file, or its tiles in words.
    pub path: PathBuf,
    pub texture: Texture,
    /// `None` for an image that covers the DEM's extent.
    pub georeference: Option<OrthoGeoreference>,
    /// Whether each pixel has colour; `None` if all have.
    valid: Option<Vec<bool>>,
    /// Whether the image contains the whole DEM.
    contains_dem: bool,
    /// Notes for the user.
    pub notes: Vec<String>,
}

/// Width of the grey margin around an image that does not contain the DEM, pixels. Up to this many texels per
/// screen pixel, mip levels keep the image's border exact to a texel.
const MARGIN_PX: u32 = 64;

/// Largest logarithm of the ratio of two shapes, width over height, that are taken for the same.
const LIKE_SHAPE: f64 = 0.05;

/// Georeference of an ortho-image.
pub(super) struct OrthoGeoreference {
    pixel_from_model: Affine,
    crs: Crs,
    /// Whether the DEM has the same coordinate system.
    has_dem_crs: bool,
    /// Size without margin, pixels.
    size: [f64; 2],
    /// x of its centre in its coordinate system.
    centre_x: f64,
    /// Margin on each side, pixels.
    margin_px: f64,
}

impl OrthoGeoreference {
    /// Pixel coordinates of a post in the stored image.
    fn pixel(&self, dem: &Dem, post: [u32; 2]) -> [f64; 2] {
        let model = if self.has_dem_crs {
            Some(dem.model(post))
        } else {
            dem.geodetic_rad(post).and_then(|point| self.crs.model_from_geodetic(point))
        };
        // 190 degrees east is 170 degrees west.
        let model = model.map(|[x, y]| {
            [x - self.crs.period().map_or(0.0, |period| period * ((x - self.centre_x) / period).round()), y]
        });
        // A point outside of the image's projection is outside of the image.
        model.map_or([-1.0, -1.0], |model| self.pixel_from_model.apply(model))
    }

    fn is_inside(&self, pixel: [f64; 2]) -> bool {
        (0..2).all(|k| (0.0..=self.size[k]).contains(&pixel[k]))
    }

    /// Texture coordinates of a post, with margin.
    pub fn uv(&self, dem: &Dem, post: [u32; 2]) -> [f32; 2] {
        let pixel = self.pixel(dem, post);
        [0, 1].map(|k: usize| ((pixel[k] + self.margin_px) / (self.size[k] + 2.0 * self.margin_px)) as f32)
    }
}

impl Ortho {
    /// Reads `scene.terrain.ortho`.
    pub fn read(files: &FileList, spec: &TerrainSpec, dem: &Dem) -> Result<Self, TerrainFileError> {
        let paths = files::ortho_files(files)?;
        match &paths[..] {
            [path] => Self::of_picture(path.clone(), Picture::read(path, spec)?, spec, dem),
            paths => Self::of_picture(files::label(paths), joined(paths, spec, dem)?, spec, dem),
        }
    }

    fn of_picture(
        path: PathBuf,
        picture: Picture,
        spec: &TerrainSpec,
        dem: &Dem,
    ) -> Result<Self, TerrainFileError> {
        let Picture { mut texture, geo, model_from_pixel, mut notes } = picture;
        let path = path.as_path();
        let Some(model_from_pixel) = model_from_pixel else {
            if let Some(orientation) = geo.orientation {
                texture = crate::raster::pictures::oriented(texture, orientation);
            }
            notes.extend(geo.notes);
            notes.extend(stretched(texture.size_px, dem));
            let valid = valid_pixels(&texture);
            fill_invalid(&mut texture, None, spec.beyond);
            return Ok(Self {
                path: path.into(),
                texture,
                georeference: None,
                valid,
                contains_dem: true,
                notes: with_path(path, notes),
            });
        };
        notes.extend(geo.notes.iter().cloned());
        if let Some(orientation) = geo.orientation {
            notes.push(format!(
                "its orientation (EXIF or tag 274: {orientation}) is ignored: its georeference defines rows \
                 and columns"
            ));
        }
        let crs = picture_crs(path, &geo, dem)?;
        let pixel_from_model = model_from_pixel
            .inverse()
            .ok_or_else(|| TerrainFileError::DegenerateGeoreference { path: path.into() })?;
        let size = texture.size_px.map(f64::from);
        let valid = valid_pixels(&texture);
        let over_voids = over_voids(&texture, dem, &model_from_pixel);
        fill_invalid(&mut texture, over_voids.as_deref(), spec.beyond);
        let centre_x = model_from_pixel.apply(size.map(|n| 0.5 * n))[0];
        let mut georeference = OrthoGeoreference {
            pixel_from_model,
            has_dem_crs: crs.epsg == dem.crs.epsg,
            crs,
            size,
            centre_x,
            margin_px: 0.0,
        };
        // An image that contains the border of the DEM contains all of it.
        let contains_dem = dem.border().all(|post| georeference.is_inside(georeference.pixel(dem, post)));
        if spec.beyond == Beyond::Grey && !contains_dem {
            texture = texture.padded(MARGIN_PX, [GREY, GREY, GREY, 255]);
            georeference.margin_px = f64::from(MARGIN_PX);
        }
        Ok(Self {
            path: path.into(),
            texture,
            georeference: Some(georeference),
            valid,
            contains_dem,
            notes: with_path(path, notes),
        })
    }

    /// Colour of the margin, if there is one.
    pub fn margin_color(&self) -> Option<[u8; 4]> {
        self.georeference
            .as_ref()
            .filter(|georeference| georeference.margin_px > 0.0)
            .map(|_| [GREY, GREY, GREY, 255])
    }

    /// Texture coordinates of the image's corners, without margin.
    pub fn image_uv(&self) -> [[f64; 2]; 2] {
        let Some(OrthoGeoreference { size, margin_px, .. }) = &self.georeference else {
            return [[0.0; 2], [1.0; 2]];
        };
        let fraction = size.map(|side| margin_px / (side + 2.0 * margin_px));
        [fraction, fraction.map(|fraction| 1.0 - fraction)]
    }

    /// Whether the image has colour at a post.
    pub fn covers(&self, dem: &Dem, post: [u32; 2]) -> bool {
        if self.contains_dem && self.valid.is_none() {
            return true;
        }
        let pixel = match &self.georeference {
            Some(georeference) => georeference.pixel(dem, post),
            None => [0, 1].map(|k: usize| {
                (f64::from(post[k]) + 0.5) / f64::from(dem.size[k]) * f64::from(self.texture.size_px[k])
            }),
        };
        if self.georeference.as_ref().is_some_and(|georeference| !georeference.is_inside(pixel)) {
            return false;
        }
        let Some(valid) = &self.valid else { return true };
        let size = self
            .georeference
            .as_ref()
            .map_or(self.texture.size_px.map(f64::from), |georeference| georeference.size);
        let [x, y] = [0, 1].map(|k: usize| pixel[k].min(size[k] - 1.0) as usize);
        valid[y * size[0] as usize + x]
    }
}

/// A picture with what its file and sidecar files state.
struct Picture {
    texture: Texture,
    geo: GeoTags,
    model_from_pixel: Option<Affine>,
    notes: Vec<String>,
}

impl Picture {
    fn read(path: &Path, spec: &TerrainSpec) -> Result<Self, TerrainFileError> {
        let (texture, geo, mut notes) = read_image(path, spec)?;
        let (model_from_pixel, georeference_notes) = read_georeference(path, geo.model_from_pixel)?;
        notes.extend(georeference_notes);
        Ok(Self { texture, geo, model_from_pixel, notes })
    }
}

/// The coordinate system of a picture. With a world file alone it is the DEM's.
fn picture_crs(path: &Path, geo: &GeoTags, dem: &Dem) -> Result<Crs, TerrainFileError> {
    let stated = StatedCrs::read(path, geo)?;
    let assumed = (stated.horizontal.is_none() && stated.user_defined.is_none()).then_some(dem.crs.epsg);
    stated.crs(path, geo, assumed)
}

/// Several pictures as tiles of one. Holes between them are transparent. Where they overlap, the first from the
/// north with colour counts.
fn joined(paths: &[PathBuf], spec: &TerrainSpec, dem: &Dem) -> Result<Picture, TerrainFileError> {
    let mut pictures = Vec::new();
    for path in paths {
        let mut picture = Picture::read(path, spec)?;
        let Some(model_from_pixel) = &mut picture.model_from_pixel else {
            return Err(TerrainFileError::Meaning {
                path: path.clone(),
                problem: "has no georeference, which a tile of an ortho-image needs: give it a world file"
                    .into(),
            });
        };
        // Tiles have rows from the north, as the joined picture.
        if model_from_pixel.row[1] > 0.0 {
            *model_from_pixel = model_from_pixel.with_rows_reversed(f64::from(picture.texture.size_px[1]));
            reverse_rows(&mut picture.texture);
        }
        let crs = picture_crs(path, &picture.geo, dem)?;
        pictures.push((path, crs, picture));
    }
    let grid = grid_tiles::join(pictures.iter().map(|(path, crs, picture)| {
        let affine = picture.model_from_pixel.unwrap_or(dem.model_from_pixel);
        grid_tiles::Placed::new(path, picture.texture.size_px, affine, crs)
    }))?;
    let notes = joined_notes(pictures.iter().map(|(path, _, picture)| (path.as_path(), &picture.notes[..])));
    let [width, height] = grid.size.map(|side| side as usize);
    let mut rgba8 = vec![0; 4 * width * height];
    let mut geo = GeoTags::default();
    let mut in_order: Vec<_> = pictures.into_iter().map(Some).collect();
    for (&index, &[x, y]) in grid.order.iter().zip(&grid.offsets) {
        let Some((_, crs, picture)) = in_order.get_mut(index).and_then(Option::take) else { continue };
        geo.keys = GeoKeys { projected: Some(crs.epsg), ..GeoKeys::default() };
        let row_bytes = 4 * picture.texture.size_px[0] as usize;
        for (row, bytes) in picture.texture.rgba8.chunks_exact(row_bytes).enumerate() {
            let start = 4 * ((y as usize + row) * width + x as usize);
            let target = rgba8[start..start + row_bytes].chunks_exact_mut(4);
            for (pixel, tile) in target.zip(bytes.chunks_exact(4)).filter(|(pixel, _)| pixel[3] == 0) {
                pixel.copy_from_slice(tile);
            }
        }
    }
    Ok(Picture {
        texture: Texture { size_px: grid.size, rgba8, encoding: Encoding::Srgb },
        geo,
        model_from_pixel: Some(grid.model_from_pixel),
        notes,
    })
}

fn reverse_rows(texture: &mut Texture) {
    let row_bytes = 4 * texture.size_px[0] as usize;
    let rows: Vec<&[u8]> = texture.rgba8.chunks_exact(row_bytes).rev().collect();
    texture.rgba8 = rows.concat();
}

/// Says that a picture without georeference has neither the shape of the DEM's ground nor that of its grid.
fn stretched(size_px: [u32; 2], dem: &Dem) -> Option<String> {
    let aspect = |[width, height]: [f64; 2]| width / height;
    let of_picture = aspect(size_px.map(f64::from));
    let of_ground = aspect(dem.ground_size_m()?);
    let is_like = |other: f64| (of_picture / other).ln().abs() < LIKE_SHAPE;
    (!is_like(of_ground) && !is_like(aspect(dem.size.map(f64::from)))).then(|| {
        format!(
            "it has no georeference and is spread over the DEM, which makes it {:.2} times as wide for its height: \
             if it shows other ground, give it a world file, or cut it to the DEM's extent",
            of_ground / of_picture
        )
    })
}

/// Whether each pixel has an alpha above 0; `None` if all have.
fn valid_pixels(texture: &Texture) -> Option<Vec<bool>> {
    let valid: Vec<bool> = texture.rgba8.chunks_exact(4).map(|pixel| pixel[3] > 0).collect();
    valid.contains(&false).then_some(valid)
}

/// Prefixes notes with the path.
fn with_path(path: &Path, notes: Vec<String>) -> Vec<String> {
    notes.into_iter().map(|note| format!("{}: {note}", path.display())).collect()
}

/// The image with the tags of its file and sidecar files, and notes.
fn read_image(path: &Path, spec: &TerrainSpec) -> Result<(Texture, GeoTags, Vec<String>), TerrainFileError> {
    let ortho_error = TerrainFileError::ortho;
    if is_tiff(path).map_err(ortho_error)? {
        let mut raster = Raster::read(path).map_err(ortho_error)?;
        sidecar::read_sidecar_tags(path, &mut raster.geo)?;
        sidecar::read_sidecar_mask(path, &mut raster).map_err(ortho_error)?;
        let (texture, notes) =
            raster.to_picture(path, Encoding::Srgb, spec.ortho_white).map_err(ortho_error)?;
        return Ok((texture, raster.geo, notes));
    }
    if spec.ortho_white.is_some() {
        return Err(ortho_error(PictureError::decode(
            path,
            "scene.terrain.ortho_white is for TIFF files: leave it out",
        )));
    }
    let StoredPicture { texture, orientation, largest_of_16_bits } =
        read_stored(path, Encoding::Srgb).map_err(ortho_error)?;
    let mut geo = GeoTags { orientation, ..GeoTags::default() };
    sidecar::read_sidecar_tags(path, &mut geo)?;
    let dark_note = largest_of_16_bits.filter(|largest| (1..1 << 14).contains(largest)).map(|largest| {
        let white = (1_u32 << (u16::BITS - largest.leading_zeros())) - 1;
        let command = gdal_translate(&format!("-ot Byte -scale 0 {white} 0 255"), path);
        format!(
            "its 16 bit values reach only {largest} of 65535: the picture is nearly black. If white is \
             {white}, convert it with `{command}`"
        )
    });
    Ok((texture, geo, dark_note.into_iter().collect()))
}

/// sRGB of a neutral grey of 18 % reflectance.
pub(super) const GREY: u8 = 118;

/// Fills pixels without colour: grey over ground if `beyond` is grey, else the colours of neighbours.
fn fill_invalid(texture: &mut Texture, over_voids: Option<&[bool]>, beyond: Beyond) {
    let linear = |byte: u8| linear_from_srgb(f32::from(byte) / 255.0);
    if beyond == Beyond::Grey {
        for (index, pixel) in texture.rgba8.chunks_exact_mut(4).enumerate() {
            if pixel[3] < 255 && over_voids.is_none_or(|voids| !voids[index]) {
                let [alpha, grey] = [f32::from(pixel[3]) / 255.0, linear(GREY)];
                for byte in &mut pixel[..3] {
                    *byte = (255.0 * srgb_from_linear(linear(*byte) * alpha + grey * (1.0 - alpha))).round()
                        as u8;
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

/// Pixels over voids of a DEM on the same grid; black pixels there have no colour and would darken the border
/// of the ground.
fn over_voids(texture: &Texture, dem: &Dem, ortho_from_pixel: &Affine) -> Option<Vec<bool>> {
    if texture.size_px != dem.size || *ortho_from_pixel != dem.model_from_pixel {
        return None;
    }
    Some(
        (0..dem.post_count() as usize)
            .map(|index| dem.height_m(dem.column_and_row(index)).is_nan())
            .collect(),
    )
}
