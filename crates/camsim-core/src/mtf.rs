//! The modulation transfer function of a picture, from a slanted edge in it: the method e-SFR of ISO 12233.
//!
//! Each row's derivative has a centroid, and a curve through these is the edge. All pixels are sorted by
//! their distance from it into bins of a quarter pixel; the derivative of their means is the line spread
//! function, whose transform is the transfer function. Beside the standard's correction of the discrete
//! derivative, that of the width of the bins is applied, and the edge may be bent (a parabola), as lenses
//! bend it.

mod camera;
mod edge;

pub use camera::{CameraMtf, ChannelMtf, EdgePicture, MtfPoint, camera_mtf, picture_mtf, slanted_edge};

use std::f64::consts::{PI, TAU};

use glam::DVec2;

use crate::{camera::CameraError, mount::MountError, reference::ReferenceError, transfer::sinc};

/// Bins a pixel.
const BINS: f64 = 4.0;

/// Why there is no transfer function.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EdgeError {
    /// Few pixels.
    #[error("the region is {0} x {1} pixels; an edge needs {least} x {least}", least = edge::LEAST_SIDE)]
    Small(usize, usize),
    /// No step, or values that are no numbers.
    #[error(
        "there is no edge: its sides differ by less than a hundredth of the brighter one; choose another region"
    )]
    Flat,
    /// The edge is parallel to the pixels.
    #[error(
        "the edge is {0:.2} degrees off the pixels' axes, and crosses too few columns; turn it by 2 to 10 \
         degrees, or choose a longer region"
    )]
    Parallel(f64),
    /// The edge leaves the region.
    #[error(
        "the edge comes within {0:.1} px of the region's sides; choose a region with the edge in its middle"
    )]
    AtBorder(f64),
    /// Pixels that lie too unevenly about the edge.
    #[error("some quarters of a pixel about the edge have no pixel; choose a longer region")]
    Gaps,
    /// The camera.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The mount.
    #[error(transparent)]
    Mount(#[from] MountError),
    /// The reference renderer.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// Nothing to render the edge in.
    #[error("there is no square of {0} x {0} pixels with rays in the middle of the picture")]
    NoRays(u32),
}

/// What an edge tells of a picture.
#[derive(Clone, Debug)]
pub struct EdgeMtf {
    /// Angle between the edge and the nearer axis of the picture, degrees.
    pub angle_deg: f64,
    /// Direction across the edge, x right and y down, of length 1: that of the frequencies.
    pub normal: DVec2,
    /// Line spread function in a window, one value a bin.
    line_spread: Vec<f64>,
}

impl EdgeMtf {
    /// Transfer function at a frequency across the edge, cycles per pixel up to 1.
    #[must_use]
    pub fn at(&self, cycles_px: f64) -> f64 {
        let middle = 0.5 * (self.line_spread.len() as f64 - 1.0);
        let (mut re, mut im) = (0.0, 0.0);
        for (i, value) in self.line_spread.iter().enumerate() {
            let (sin, cos) = (TAU * cycles_px * (i as f64 - middle) / BINS).sin_cos();
            re += value * cos;
            im += value * sin;
        }
        let sum: f64 = self.line_spread.iter().sum();
        // Of the difference of two bins with one between them, and of the mean over a bin.
        let angle = TAU * cycles_px / BINS;
        let of_derivative = if angle == 0.0 { 1.0 } else { angle.sin() / angle };
        re.hypot(im) / (sum.abs() * of_derivative * sinc(cycles_px / BINS))
    }

    /// The frequency at which the transfer function is a half, below 1 cycle per pixel.
    #[must_use]
    pub fn mtf50(&self) -> Option<f64> {
        half_of(|cycles_px| self.at(cycles_px))
    }
}

/// Where a transfer function falls to a half first, between steps of 0.005 cycles per pixel.
fn half_of(at: impl Fn(f64) -> f64) -> Option<f64> {
    const STEP: f64 = 0.005;
    let values = (0..200).map(|i| at(STEP * f64::from(i)));
    let mut before = f64::INFINITY;
    for (i, value) in (0_u32..).zip(values) {
        if value < 0.5 {
            let fraction = (before - 0.5) / (before - value);
            return Some(STEP * (f64::from(i) - 1.0 + fraction));
        }
        before = value;
    }
    None
}

/// The transfer function of a part of a picture with one straight or slightly bent edge, which leans by some
/// degrees. `values` are linear light, row by row; the sides of the edge are even.
///
/// # Errors
/// The part has no such edge.
pub fn edge_mtf(values: &[f64], size: [usize; 2]) -> Result<EdgeMtf, EdgeError> {
    let region = edge::Region::upright(values, size)?;
    let curve = region.fit()?;
    let spread = region.edge_spread(&curve)?;
    let count = spread.len() - 2;
    let line_spread = (0..count)
        .map(|i| {
            let window = 0.54 + 0.46 * (TAU * ((i as f64 + 0.5) / count as f64 - 0.5)).cos();
            0.5 * window * (spread[i + 2] - spread[i])
        })
        .collect();
    let normal = region.in_picture(DVec2::new(1.0, -curve.slope)).normalize();
    Ok(EdgeMtf { angle_deg: curve.slope.abs().atan() * 180.0 / PI, normal, line_spread })
}

#[cfg(test)]
mod tests;
