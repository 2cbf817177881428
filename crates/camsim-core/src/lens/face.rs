//! A lens as one of several cameras sees it that share its optical centre: its faces.
//!
//! A flat ideal frame holds less than a half sphere. A wider field is divided among the six sides of a cube
//! about the camera, of which the front one looks along the optical axis. A face's camera is turned, and its
//! lens is the whole lens in the face's axes: the output pixels stay those of the whole camera.

use std::f64::consts::PI;

use glam::{DMat3, DVec2, DVec3};

use super::{FoldCurve, Lens, class::LensClass};
use crate::scenario::Face;

/// Largest tangent at which a face is used: it holds tangents of 1, and what is about a pixel at its border.
const MOST_TANGENT: f64 = 1.5;

/// A lens seen by the camera of one of its faces: `distorted = whole(R ray)` with the rotation R from the
/// face's axes to the camera's.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceLens {
    whole: Lens,
    face: Face,
    whole_from_face: DMat3,
}

impl FaceLens {
    pub(super) fn new(whole: Lens, face: Face) -> Self {
        Self { whole, face, whole_from_face: DMat3::from_quat(face.camera_from_face()) }
    }

    /// Which face this is.
    #[must_use]
    pub fn face(&self) -> Face {
        self.face
    }

    /// The lens of the whole camera.
    #[must_use]
    pub fn whole(&self) -> &Lens {
        &self.whole
    }

    /// Ideal point of a ray of the whole camera that this face is made from.
    pub(crate) fn held(&self, whole: DVec3) -> Option<DVec2> {
        if whole.is_nan() || Face::of(whole) != self.face { None } else { self.ideal(whole) }
    }

    fn ideal(&self, whole: DVec3) -> Option<DVec2> {
        let ray = self.whole_from_face.transpose() * whole;
        let uv = ray.truncate() / ray.z;
        (ray.z > 0.0 && uv.abs().max_element() <= MOST_TANGENT).then_some(uv)
    }

    /// Whether this is the face that an output pixel is made from.
    pub(super) fn holds(&self, distorted: DVec2) -> bool {
        self.whole.ray(distorted).is_some_and(|ray| Face::of(ray) == self.face)
    }
}

impl LensClass for FaceLens {
    fn altered(&self) -> Option<&Lens> {
        Some(&self.whole)
    }

    /// `None` for points that other faces hold, but for those near the border.
    fn undistort(&self, distorted: DVec2) -> Option<DVec2> {
        self.ideal(self.whole.ray(distorted)?)
    }

    fn image(&self, ray: DVec3) -> DVec2 {
        self.whole.image(self.whole_from_face * ray)
    }

    fn gradient(&self, ray: DVec3) -> [DVec2; 3] {
        let [x, y, z] = self.whole.gradient(self.whole_from_face * ray);
        let along = |axis: DVec3| x * axis.x + y * axis.y + z * axis.z;
        [self.whole_from_face.x_axis, self.whole_from_face.y_axis, self.whole_from_face.z_axis].map(along)
    }

    fn ray(&self, distorted: DVec2) -> Option<DVec3> {
        Some(self.whole_from_face.transpose() * self.whole.ray(distorted)?)
    }

    fn contains_ray(&self, ray: DVec3) -> bool {
        self.whole.contains_ray(self.whole_from_face * ray)
    }

    /// Measured from the axis of the face.
    fn angle_max_rad(&self) -> f64 {
        PI
    }

    fn fold_curve(&self) -> Option<&FoldCurve> {
        None
    }
}
