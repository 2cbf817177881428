//! The plane that is nearest to what a camera sees: look-ups of depth begin there, and so find what they look
//! for with fewer of them.
//!
//! In the camera's axes a point X is on the plane if `n . X = 1`. Towards (u, v, 1) the plane has the inverse
//! planar depth `n . (u, v, 1)`: it is linear in the picture, and an ideal frame over flat ground needs no
//! second look-up whatever the parallax.

use camsim_core::pose::CameraPose;
use glam::DVec3;

/// Part of its distance to the plane that another camera keeps at least.
const NEAREST: f64 = 1e-3;

/// A plane in the axes of a camera; with a normal of 0 it is infinitely far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenPlane {
    /// Whose axes these are.
    pub camera: CameraPose,
    /// `n` above, 1/m.
    pub normal_per_m: DVec3,
}

impl SeenPlane {
    /// `n` in the axes of another camera, 1/m; 0 if that is not before the plane.
    #[must_use]
    pub fn seen_from(&self, camera: &CameraPose) -> DVec3 {
        let (rotation, shift) = camera.relative_to(&self.camera);
        let before = 1.0 - self.normal_per_m.dot(shift);
        if before > NEAREST { rotation.transpose() * self.normal_per_m / before } else { DVec3::ZERO }
    }
}
