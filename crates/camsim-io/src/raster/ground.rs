//! Heights of the ground by latitude and longitude, before there is a local frame: for logs whose heights are above
//! it.

use std::fmt;

use camsim_core::{geodesy::Geodetic, scenario::TerrainSpec};

use super::{TerrainFileError, dem::Dem, georeference::Affine};

/// The heights of `scene.terrain.dem`, above its own vertical datum.
pub struct Ground {
    dem: Dem,
    pixel_from_model: Affine,
    /// Of the middle, in units of the coordinate system.
    centre_x: f64,
}

impl fmt::Debug for Ground {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Ground").field("dem", &self.dem.path).finish_non_exhaustive()
    }
}

impl Ground {
    /// Reads the elevation model.
    ///
    /// # Errors
    /// As [`super::read_terrain`], of the elevation model.
    pub fn read(spec: &TerrainSpec) -> Result<Self, TerrainFileError> {
        let dem = Dem::read(spec, false)?;
        let degenerate = || TerrainFileError::DegenerateGeoreference { path: dem.path.clone() };
        let pixel_from_model = dem.model_from_pixel.inverse().ok_or_else(degenerate)?;
        let centre_x = dem.model_from_pixel.apply(dem.size.map(|n| 0.5 * f64::from(n)))[0];
        Ok(Self { dem, pixel_from_model, centre_x })
    }

    /// Height at the latitude and longitude of a point, metres: linear in the triangles that the terrain is drawn
    /// with, up to the Earth's curvature within a cell (a millimetre for cells of 200 m). `None` beyond the posts and
    /// where a post of the triangle has no height.
    #[must_use]
    pub fn height_m(&self, at: Geodetic) -> Option<f64> {
        let crs = &self.dem.crs;
        let [x, y] = crs.model_from_geodetic([at.lat_rad, at.lon_rad])?;
        // 190 degrees east is 170 degrees west.
        let turns = crs.period().map_or(0.0, |period| period * ((x - self.centre_x) / period).round());
        // Posts are at the centres of pixels.
        let position = self.pixel_from_model.apply([x - turns, y]).map(|n| n - 0.5);
        let [(column, u), (row, v)] = [0, 1].map(|axis| {
            let last_cell = f64::from(self.dem.size[axis]) - 2.0;
            let cell = position[axis].floor().clamp(0.0, last_cell);
            (cell as u32, position[axis] - cell)
        });
        // Within rounding of the projections.
        let is_inside = |fraction: f64| (-1e-6..=1.0 + 1e-6).contains(&fraction);
        if !(is_inside(u) && is_inside(v)) {
            return None;
        }
        let post = |right: u32, down: u32| self.dem.height_m([column + right, row + down]);
        // The diagonal runs from north-west to south-east.
        let height_m = match u > v {
            true => post(0, 0) + u * (post(1, 0) - post(0, 0)) + v * (post(1, 1) - post(1, 0)),
            false => post(0, 0) + v * (post(0, 1) - post(0, 0)) + u * (post(1, 1) - post(0, 1)),
        };
        (!height_m.is_nan()).then_some(height_m)
    }
}
