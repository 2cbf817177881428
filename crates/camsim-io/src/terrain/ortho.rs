//! The picture on the ground.

use std::path::Path;

use camsim_core::scene::{Encoding, Texture};

use super::{
    TerrainFileError,
    crs::Crs,
    dem::{Dem, georeference_of},
    georeference::Affine,
    raster::{self, GeoTags, Raster},
};
use crate::pictures::{PictureError, read_texture};

/// A picture of the ground.
pub(super) struct Ortho {
    pub texture: Texture,
    /// `None`: it covers the DEM's extent.
    pub place: Option<OrthoPlace>,
}

/// Where a picture lies.
pub(super) struct OrthoPlace {
    pixel_from_model: Affine,
    /// `None` for the DEM's own.
    crs: Option<Crs>,
    size: [f64; 2],
}

impl OrthoPlace {
    pub fn uv(&self, dem: &Dem, at: [u32; 2]) -> [f32; 2] {
        let model = match &self.crs {
            None => Some(dem.model(at)),
            Some(crs) => dem.geodetic_rad(at).and_then(|place| crs.model_from_geodetic(place)),
        };
        // A point that the picture's projection does not reach is outside of the picture.
        let pixel = model.map_or([-1.0, -1.0], |model| self.pixel_from_model.apply(model));
        [(pixel[0] / self.size[0]) as f32, (pixel[1] / self.size[1]) as f32]
    }
}

impl Ortho {
    pub fn read(path: &Path, dem: &Dem) -> Result<Self, TerrainFileError> {
        let (mut texture, geo) = picture(path).map_err(TerrainFileError::of_ortho)?;
        let Some(model_from_pixel) = georeference_of(path, geo.as_ref().and_then(|geo| geo.model_from_pixel))? else {
            texture.bleed_into_transparent();
            return Ok(Self { texture, place: None });
        };
        // A world file states no coordinate system: then it is the DEM's.
        let epsg = geo.as_ref().and_then(|geo| geo.epsg).unwrap_or(dem.crs.epsg);
        let crs = Crs::new(epsg).ok_or_else(|| TerrainFileError::UnsupportedCrs { path: path.into(), epsg })?;
        let pixel_from_model = model_from_pixel.inverse().ok_or_else(|| TerrainFileError::DegenerateGeoreference { path: path.into() })?;
        let crs = (crs.epsg != dem.crs.epsg).then_some(crs);
        let size = texture.size_px.map(f64::from);
        mark_void_pixels(&mut texture, dem, &model_from_pixel);
        texture.bleed_into_transparent();
        Ok(Self { texture, place: Some(OrthoPlace { pixel_from_model, crs, size }) })
    }
}

/// With what a TIFF file says about its place.
fn picture(path: &Path) -> Result<(Texture, Option<GeoTags>), PictureError> {
    if !raster::is_tiff(path)? {
        return Ok((read_texture(path, Encoding::Srgb)?, None));
    }
    let raster = Raster::read(path)?;
    Ok((raster.to_texture(path, Encoding::Srgb)?, Some(raster.geo)))
}

/// Black pixels over voids of a DEM on the same grid are no content: otherwise they would darken the rim of what is there.
fn mark_void_pixels(texture: &mut Texture, dem: &Dem, ortho_from_pixel: &Affine) {
    if texture.size_px != dem.size || *ortho_from_pixel != dem.model_from_pixel {
        return;
    }
    for (index, pixel) in texture.rgba8.chunks_exact_mut(4).enumerate() {
        if pixel[..3] == [0, 0, 0] && dem.height_m(dem.column_and_row(index)).is_nan() {
            pixel[3] = 0;
        }
    }
}
