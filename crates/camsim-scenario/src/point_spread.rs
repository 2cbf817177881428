//! `[camera.point_spread]`: what the lens makes of a point of light.

use serde::{Deserialize, Serialize};

use super::{LoadedFile, PerChannel, keys::Table};

/// Middles of what the colours of usual sensors see.
const RED_GREEN_BLUE_NM: [f64; 3] = [610.0, 540.0, 465.0];
/// Widest blur; one as wide as a large picture.
const MAX_SPREAD_PX: f64 = 4096.0;
/// Most values of a kernel along a pixel.
const MAX_OVERSAMPLING: u32 = 64;

/// Blur of the lens, after the vignette and before noise; what is given acts together (docs/reference/IMAGING.md).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct PointSpreadSpec {
    /// Standard deviation of the lens's Gaussian blur. Omitted: none.
    #[key(
        unit = "px",
        step = 0.01,
        min = 0.0,
        max = MAX_SPREAD_PX,
        hint = "leave it out for no Gaussian blur",
        example = "0.6"
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma_px: Option<f64>,
    /// Focal length over aperture: diffraction by a circular aperture, an Airy pattern. Omitted: no
    /// diffraction.
    #[key(step = 0.05, above = 0.0, hint = "leave it out for a lens without diffraction", example = "8.0")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub f_number: Option<f64>,
    /// Side of a pixel, for the diffraction by `f_number`. Omitted: that of `camera.sensor`.
    #[key(unit = "um", step = 0.01, above = 0.0, hint = "it is the side of a pixel", example = "3.45")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pixel_um: Option<f64>,
    /// Wavelength of the light, for `f_number`: of red, green and blue, or one number.
    #[key(
        default = PerChannel::Each(RED_GREEN_BLUE_NM.into()),
        unit = "nm",
        min = 1.0,
        max = 1e6,
        hint = "give one wavelength or [red, green, blue]"
    )]
    pub wavelength_nm: PerChannel,
    /// Diameter of the even disc of a lens out of focus. Omitted: none.
    #[key(
        unit = "px",
        step = 0.02,
        min = 0.0,
        max = MAX_SPREAD_PX,
        hint = "leave it out for a lens in focus",
        example = "3.0"
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub defocus_px: Option<f64>,
    /// Picture of a point of light, without the pixel's own area: PNG, EXR or CSV. Omitted: none.
    #[key(example = "\"kernel.png\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kernel: Option<LoadedFile>,
    /// Values of `kernel` along the side of a pixel.
    #[key(default = 1, step = 0.1, min = 1, max = MAX_OVERSAMPLING, hint = "1 is a kernel of whole pixels")]
    pub kernel_oversampling: u32,
    /// Fraction of the light that is spread evenly over the picture.
    #[key(step = 0.001, min = 0.0, below = 1.0, hint = "it is a fraction of the light")]
    pub glare: f64,
}
