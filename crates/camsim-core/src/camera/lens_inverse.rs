//! The lens map on the CPU: f64 twin of the GPU stage `lens_inverse`.

use rayon::prelude::*;

use super::CameraModel;

/// `u = v = INVALID_UV` marks a pixel of a lens map without an ideal ray. The value is finite, because
/// shaders may assume that infinities do not occur.
pub const INVALID_UV: f32 = 1e30;

impl CameraModel {
    /// Ideal `[u, v]` at the centre of every pixel, row-major, solved in f64; [`INVALID_UV`] twice where
    /// there is none.
    pub fn lens_inverse(&self) -> Vec<[f32; 2]> {
        let [width, height] = self.size_px;
        let row = |y: u32| {
            (0..width).map(move |x| {
                let ideal = self.unproject_pixel([x, y]);
                ideal.map_or([INVALID_UV; 2], |ideal| ideal.as_vec2().to_array())
            })
        };
        (0..height).into_par_iter().flat_map_iter(row).collect()
    }
}
