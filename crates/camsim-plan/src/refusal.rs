//! What cannot be planned.

use camsim_core::{camera::CameraError, shutter::ShutterError};

/// Most pixels of the ideal frames of one output frame: at 12 bytes a pixel, for colour and depth, 0.8 GB.
/// What silhouettes take besides has a bound of its own.
pub const MAX_IDEAL_PX: u64 = 1 << 26;

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

/// Refuses an ideal frame that no renderer could hold.
pub(super) fn check_size(
    frame: u64,
    size_px: [u32; 2],
    max_side_px: u32,
    max_ideal_px: u64,
) -> Result<(), PlanError> {
    let [width, height] = size_px.map(u64::from);
    if width.max(height) > u64::from(max_side_px) {
        return Err(PlanError::IdealTooLarge { frame, width, height, limit: max_side_px });
    }
    if width * height > max_ideal_px {
        return Err(PlanError::IdealOfTooManyPixels { frame, width, height });
    }
    Ok(())
}
