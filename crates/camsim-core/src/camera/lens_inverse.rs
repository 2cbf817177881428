//! The lens map on the CPU: f64 twin of the GPU stage `lens_inverse`.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{BulkInverse, CameraModel};
use crate::lens::Lens;

/// `u = v = INVALID_UV` marks a pixel of a lens map without an ideal ray. The value is finite, because
/// shaders may assume that infinities do not occur.
pub const INVALID_UV: f32 = 1e30;

impl CameraModel {
    /// Ideal `[u, v]` at the centre of every pixel, row-major, solved in f64; [`INVALID_UV`] twice where
    /// there is none.
    pub fn lens_inverse(&self) -> Vec<[f32; 2]> {
        match &self.lens {
            // All faces ask the same rays, so that each pixel is on exactly one.
            Lens::Face(lens) => {
                let whole = Self { lens: lens.whole().clone(), ..self.clone() };
                let of_ray = |ray: [f64; 3]| lens.held(DVec3::from_array(ray));
                map_of(&BulkInverse::of_picture(whole), self.size_px, BulkInverse::rays, of_ray)
            }
            _ => map_of(
                &BulkInverse::of_picture(self.clone()),
                self.size_px,
                BulkInverse::unproject,
                |ideal| Some(DVec2::from_array(ideal)).filter(|ideal| !ideal.is_nan()),
            ),
        }
    }
}

/// Solves each row of a picture, and maps what comes out.
fn map_of<const N: usize>(
    inverse: &BulkInverse,
    size_px: [u32; 2],
    solve: impl Fn(&BulkInverse, &[[f64; 2]], &mut [[f64; N]]) + Sync,
    ideal: impl Fn([f64; N]) -> Option<DVec2> + Sync,
) -> Vec<[f32; 2]> {
    let [width, height] = size_px.map(|side| side as usize);
    let mut map = vec![[INVALID_UV; 2]; width * height];
    map.par_chunks_mut(width.max(1)).enumerate().for_each_init(
        || (vec![[0.0; 2]; width], vec![[0.0; N]; width]),
        |(pixels, solved), (y, row)| {
            pixels.iter_mut().enumerate().for_each(|(x, pixel)| *pixel = [x as f64, y as f64]);
            solve(inverse, pixels, solved);
            for (uv, solved) in row.iter_mut().zip(&*solved) {
                if let Some(ideal) = ideal(*solved) {
                    *uv = ideal.as_vec2().to_array();
                }
            }
        },
    );
    map
}
