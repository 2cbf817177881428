//! What cannot be planned.

use camsim_core::{camera::CameraError, shutter::ShutterError};

use super::limits::MAX_IDEAL_PX;

/// Errors of planning.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// The camera cannot be used.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The shutter cannot be used.
    #[error(transparent)]
    Shutter(#[from] ShutterError),
    /// No pixel has a pre-image.
    #[error(
        "no pixel of the camera has an ideal ray: check camera.lens.coefficients and camera.focal_px (`camsim lens SCENARIO.toml check`)"
    )]
    NoRay,
    /// A wide field has no ideal frame that `coords` could refer to.
    #[error(
        "output.channels: \"coords\" gives rays and sources in one flat ideal frame, which cannot hold this lens's \
         field; leave it out (depth, range, normal, flow, object have all that is true of the pixels)"
    )]
    CoordsOfFaces,
    /// The ideal frame would have too many pixels for any memory, though its sides fit.
    #[error(
        "frame {frame} needs an ideal frame of {width}x{height} px, {:.0} million pixels, more than {:.0} million: the field of view is too wide for a \
         flat ideal frame, or the motion within one frame too large; reduce camera.size_px, camera.shutter times or the field of view",
        (.width * .height) as f64 * 1e-6, MAX_IDEAL_PX as f64 * 1e-6
    )]
    IdealOfTooManyPixels {
        /// Frame number.
        frame: u64,
        /// Needed width.
        width: u64,
        /// Needed height.
        height: u64,
    },
    /// A side of the ideal frame would be too long.
    #[error(
        "frame {frame} needs an ideal frame of {width}x{height} px, more than {limit} px a side: the field of view is too wide for a flat ideal frame, or the motion within one frame too large; reduce camera.size_px, camera.shutter times or the field of view"
    )]
    IdealTooLarge {
        /// Frame number.
        frame: u64,
        /// Needed width.
        width: u64,
        /// Needed height.
        height: u64,
        /// Largest side.
        limit: u32,
    },
}
