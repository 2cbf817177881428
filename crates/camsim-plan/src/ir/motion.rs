//! What moves within a frame: bounds that the choices rest on.

use serde::Serialize;

/// How far the camera gets from a pose, and what that moves in the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Departure {
    /// Farthest the optical centre gets, metres.
    pub travel_m: f64,
    /// Largest rotation, radians.
    pub rotation_rad: f64,
    /// Bound on the parallax of any pixel, ideal pixels.
    pub parallax_px: f64,
    /// Bound on the displacement by rotation, ideal pixels.
    pub rotation_px: f64,
}

/// What moves within the frame: bounds that the choices rest on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Motion {
    /// Nearest surface in view of the key camera, planar depth, a lower bound, metres; infinite with nothing
    /// in view.
    pub nearest_m: f64,
    /// Farthest the optical centre gets from the key position in the frame's window, metres.
    pub travel_m: f64,
    /// Largest rotation from the key attitude, radians.
    pub rotation_rad: f64,
    /// Bound on the parallax of any pixel, ideal pixels.
    pub parallax_px: f64,
    /// Bound on the displacement by rotation, ideal pixels.
    pub rotation_px: f64,
    /// Longest blur path found, ideal pixels.
    pub blur_px: f64,
    /// Bound on how far a straight path misses the curved one, ideal pixels.
    pub blur_sagitta_px: f64,
    /// From the first instant of the frame, where the others are from the key pose, which several frames may share.
    pub own: Departure,
}

impl Motion {
    /// Bounds on both; the frame itself stays the first.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            nearest_m: self.nearest_m.min(other.nearest_m),
            travel_m: self.travel_m.max(other.travel_m),
            rotation_rad: self.rotation_rad.max(other.rotation_rad),
            parallax_px: self.parallax_px.max(other.parallax_px),
            rotation_px: self.rotation_px.max(other.rotation_px),
            blur_px: self.blur_px.max(other.blur_px),
            blur_sagitta_px: self.blur_sagitta_px.max(other.blur_sagitta_px),
            own: self.own,
        }
    }
}
