//! Ideal rays of output pixels and how they change from pixel to pixel. Twin of
//! `camsim-gpu/shaders/reverse/ray`.

use camsim_core::{
    camera::{CameraModel, INVALID_UV},
    lens::paper::gauss_newton,
};
use camsim_plan::RayStage;
use glam::DVec2;

/// Entries of a lens map above this mean that the pixel has no ray.
const INVALID_ABOVE: f32 = 0.1 * INVALID_UV;

/// Ideal ray of a pixel's centre.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ray {
    pub uv: DVec2,
    /// Change per output pixel along x and along y.
    pub d_uv: [DVec2; 2],
}

/// The lens inverse of a plan.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rays<'a> {
    camera: &'a CameraModel,
    stage: RayStage,
    map: &'a [[f32; 2]],
}

impl<'a> Rays<'a> {
    /// # Panics
    /// If the stage reads a lens map and `map` has another size than the camera.
    pub fn new(camera: &'a CameraModel, stage: RayStage, map: &'a [[f32; 2]]) -> Self {
        let [width, height] = camera.size_px.map(|side| side as usize);
        assert!(stage != RayStage::LensMap || map.len() == width * height, "a lens map of the camera's size");
        Self { camera, stage, map }
    }

    /// The ray of a pixel; `None` where the lens has none.
    pub fn ray(&self, pixel: [u32; 2]) -> Option<Ray> {
        let position_px = DVec2::new(pixel[0].into(), pixel[1].into());
        let undistorted = || self.camera.distorted_from_pixel(position_px);
        match self.stage {
            RayStage::Pinhole => {
                let pixel_size = 1.0 / self.camera.focal_px;
                let d_uv = [DVec2::new(pixel_size.x, 0.0), DVec2::new(0.0, pixel_size.y)];
                Some(Ray { uv: undistorted(), d_uv })
            }
            RayStage::GaussNewton => {
                let uv = gauss_newton(&self.camera.lens, undistorted(), self.camera.size_px)?;
                Some(Ray { uv, d_uv: [DVec2::ZERO; 2] })
            }
            RayStage::LensMap => {
                let uv = self.map_entry(pixel)?;
                Some(Ray { uv, d_uv: [0, 1].map(|axis| self.difference(pixel, axis, uv)) })
            }
        }
    }

    fn map_entry(&self, [x, y]: [u32; 2]) -> Option<DVec2> {
        let [u, v] = self.map[y as usize * self.camera.size_px[0] as usize + x as usize];
        (u < INVALID_ABOVE).then(|| DVec2::new(u.into(), v.into()))
    }

    /// Central difference of the map along an axis; one-sided at borders and beside pixels without a ray.
    fn difference(&self, pixel: [u32; 2], axis: usize, centre: DVec2) -> DVec2 {
        let beside = |position: u32| {
            let mut pixel = pixel;
            pixel[axis] = position;
            self.map_entry(pixel)
        };
        let before = pixel[axis].checked_sub(1).and_then(beside);
        let after = (pixel[axis] + 1 < self.camera.size_px[axis]).then(|| beside(pixel[axis] + 1)).flatten();
        match (before, after) {
            (Some(before), Some(after)) => 0.5 * (after - before),
            (None, Some(after)) => after - centre,
            (Some(before), None) => centre - before,
            (None, None) => DVec2::ZERO,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use camsim_core::lens::LensModel;

    use super::*;

    #[test]
    fn rays_of_a_map_change_from_pixel_to_pixel_as_the_lens_says() {
        let coefficients = [-0.3, 0.09, 0.001, -0.002];
        let camera =
            CameraModel::new([48, 36], [42.0, 40.0], None, LensModel::BrownConrady, &coefficients).unwrap();
        let mut map = camera.lens_inverse();
        let without_ray = [20, 11];
        map[11 * 48 + 20] = [INVALID_UV; 2];
        let rays = Rays::new(&camera, RayStage::LensMap, &map);
        assert!(rays.ray(without_ray).is_none());
        for [x, y] in [[0, 0], [47, 35], [10, 20], [47, 3], [19, 11], [20, 12], [30, 0]] {
            let ray = rays.ray([x, y]).unwrap();
            let center = DVec2::new(x.into(), y.into());
            assert!(ray.uv.distance(camera.unproject(center).unwrap()) < 1e-7);
            for (found, step) in ray.d_uv.into_iter().zip([DVec2::X, DVec2::Y]) {
                let [before, after] = [-0.5, 0.5].map(|k| camera.unproject(center + k * step).unwrap());
                let exact = after - before;
                // One-sided at borders and beside pixels without a ray.
                assert!(found.distance(exact) < 0.05 * exact.length(), "({x}, {y}): {found} {exact}");
            }
        }
    }
}
