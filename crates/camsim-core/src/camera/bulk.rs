//! The inverse of a camera for many pixels at once.

use glam::{DVec2, DVec3};

use super::{CameraModel, image_corners};
use crate::lens::{BLOCK, Block, Bulk};

/// How far beside the picture points are still fast, as a fraction of its size.
const BESIDE: f64 = 0.05;

/// So few pixels are solved sooner one by one: less than twice the nodes of a grid of starts.
const FEW: u64 = 32_768;

/// [`CameraModel::unproject`] and [`CameraModel::ray`] for many pixels: the same pixels have an inverse, and the
/// same one but for rounding, in a fraction of the time. It takes milliseconds to prepare.
#[derive(Clone, Debug)]
pub struct BulkInverse {
    camera: CameraModel,
    bulk: Bulk,
}

impl BulkInverse {
    /// Prepares a camera for pixels of its picture; pixels elsewhere take longer.
    #[must_use]
    pub fn new(camera: CameraModel) -> Self {
        let [first, .., last] = image_corners(camera.size_px);
        let beside = (last - first) * BESIDE;
        let low = camera.distorted_from_pixel(first - beside);
        let high = camera.distorted_from_pixel(last + beside);
        let bulk = Bulk::new(&camera.lens, low, high);
        Self { camera, bulk }
    }

    /// For the pixels of the picture alone: what is prepared is worth it where these are many.
    pub(super) fn of_picture(camera: CameraModel) -> Self {
        let [width, height] = camera.size_px;
        if u64::from(width) * u64::from(height) < FEW {
            return Self { bulk: Bulk::Singly, camera };
        }
        Self::new(camera)
    }

    /// Ideal points of as many pixels; NaN where the lens has no inverse.
    pub fn unproject(&self, pixels: &[[f64; 2]], ideal: &mut [[f64; 2]]) {
        let singly = |pixel| self.camera.unproject(pixel).unwrap_or(DVec2::NAN).to_array();
        self.solve(pixels, ideal, |block| self.bulk.ideal(&self.camera.lens, block), singly);
    }

    /// Unit rays of as many pixels; NaN where the lens has no inverse.
    pub fn rays(&self, pixels: &[[f64; 2]], rays: &mut [[f64; 3]]) {
        let singly = |pixel| self.camera.ray(pixel).unwrap_or(DVec3::NAN).to_array();
        self.solve(pixels, rays, |block| self.bulk.rays(&self.camera.lens, block), singly);
    }

    fn solve<const N: usize>(
        &self,
        pixels: &[[f64; 2]],
        solved: &mut [[f64; N]],
        of_block: impl Fn(&mut Block),
        singly: impl Fn(DVec2) -> [f64; N],
    ) {
        let mut block = Block::default();
        for (pixels, solved) in pixels.chunks(BLOCK).zip(solved.chunks_mut(BLOCK)) {
            for (i, pixel) in pixels.iter().enumerate() {
                let at = self.camera.distorted_from_pixel(DVec2::from_array(*pixel));
                (block.image[0][i], block.image[1][i]) = (at.x, at.y);
            }
            of_block(&mut block);
            for (i, (solved, pixel)) in solved.iter_mut().zip(pixels).enumerate() {
                *solved = std::array::from_fn(|n| block.solved[n][i]);
                if solved[0].is_nan() {
                    *solved = singly(DVec2::from_array(*pixel));
                } else if solved[0].is_infinite() {
                    *solved = [f64::NAN; N];
                }
            }
        }
    }
}
