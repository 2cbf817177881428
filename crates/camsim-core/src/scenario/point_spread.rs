//! `[camera.point_spread]`: what the lens makes of a point of light.

use serde::{Deserialize, Serialize};

use super::PerChannel;
use crate::imaging::KernelFile;

/// Blur and veil of the lens. What is given acts one after the other, so that transfer functions multiply.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PointSpreadSpec {
    /// Standard deviation of a Gaussian.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma_px: Option<f64>,
    /// Focal length over aperture: diffraction by a circular aperture, an Airy pattern.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub f_number: Option<f64>,
    /// Side of a pixel, for `f_number`; else that of `camera.sensor`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pixel_um: Option<f64>,
    /// Wavelength of the light, for `f_number`: one number, or those of red, green and blue.
    pub wavelength_nm: PerChannel,
    /// Diameter of an even disc: a lens out of focus.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub defocus_px: Option<f64>,
    /// Picture or CSV of a measured kernel: the light of a point, without the pixel's own area.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kernel: Option<KernelFile>,
    /// Values of `kernel` along the side of a pixel.
    pub kernel_oversampling: u32,
    /// Share of the light that is spread evenly over the picture.
    pub glare: f64,
}

/// Middles of what the colours of usual sensors see.
const RED_GREEN_BLUE_NM: [f64; 3] = [610.0, 540.0, 465.0];

impl Default for PointSpreadSpec {
    fn default() -> Self {
        Self {
            sigma_px: None,
            f_number: None,
            pixel_um: None,
            wavelength_nm: PerChannel::Each(RED_GREEN_BLUE_NM.into()),
            defocus_px: None,
            kernel: None,
            kernel_oversampling: 1,
            glare: 0.0,
        }
    }
}
