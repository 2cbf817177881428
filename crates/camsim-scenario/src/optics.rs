//! Optics beyond one lens for all light: lateral chromatic aberration, vignetting and the image circle.

use serde::{Deserialize, Serialize};

use super::{CameraSpec, LensModel, LensSpec, OutputEncoding, keys::Table};

/// A primary colour of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Primary {
    /// Channel 0.
    Red,
    /// Channel 1. Its lens is the camera's, and truth is that of its rays.
    Green,
    /// Channel 2.
    Blue,
}

impl Primary {
    /// All three, the one with the truth first.
    pub const ALL: [Self; 3] = [Self::Green, Self::Red, Self::Blue];

    /// Its channel in a picture.
    #[must_use]
    pub fn channel(self) -> usize {
        match self {
            Self::Red => 0,
            Self::Green => 1,
            Self::Blue => 2,
        }
    }

    /// The word for it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Red => "red",
            Self::Green => "green",
            Self::Blue => "blue",
        }
    }
}

/// Lateral chromatic aberration: lenses of red and blue beside green's (docs/reference/LENSES.md).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct ChromaticSpec {
    /// Terms v, c, b of the distance of red from the principal point, over that of green. It is v + c r + b
    /// r^2, with r the distance of green, 1 at half the picture's shorter side. Trailing terms may be left
    /// out.
    #[key(step = 0.0001, example = "[1.0006, 0.0, -0.0002]")]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub red_scale: Vec<f64>,
    /// Terms v, c, b of the distance of blue from the principal point, over that of green. It is v + c r + b
    /// r^2, with r as in `red_scale`.
    #[key(step = 0.0001, example = "[0.9995]")]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub blue_scale: Vec<f64>,
    /// Red's own lens, instead of `red_scale`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub red: Option<PrimaryLensSpec>,
    /// Blue's own lens, instead of `blue_scale`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blue: Option<PrimaryLensSpec>,
}

/// Calibration of one colour.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct PrimaryLensSpec {
    /// Focal lengths of this colour. Omitted: the camera's.
    #[key(
        unit = "px",
        step = 0.1,
        above = 0.0,
        hint = "a 60 degree lens on 640 px has about 554",
        example = "[500.3, 500.3]",
        names = "fx fy"
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focal_px: Option<[f64; 2]>,
    /// Principal point of this colour. Omitted: the camera's.
    #[key(unit = "px", step = 0.05, example = "[319.5, 239.5]", names = "cx cy")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub principal_point_px: Option<[f64; 2]>,
    /// Lens model of this colour. Omitted: the camera's.
    #[key(example = "\"brown-conrady\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<LensModel>,
    /// Coefficients of this colour's lens. Omitted: the camera's, or none with another model.
    #[key(step = 0.0005, example = "[-0.28, 0.07]")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coefficients: Option<Vec<f64>>,
}

impl ChromaticSpec {
    /// Terms of a primary's scale; none of green, and of one that is imaged as green is.
    #[must_use]
    pub fn scale(&self, primary: Primary) -> Option<[f64; 3]> {
        let given = match primary {
            Primary::Red => &self.red_scale,
            Primary::Green => return None,
            Primary::Blue => &self.blue_scale,
        };
        let term = |i: usize| given.get(i).copied().unwrap_or(0.0);
        let terms = [term(0), term(1), term(2)];
        (!given.is_empty() && terms != [1.0, 0.0, 0.0]).then_some(terms)
    }

    /// A primary's own lens.
    #[must_use]
    pub fn lens(&self, primary: Primary) -> Option<&PrimaryLensSpec> {
        match primary {
            Primary::Red => self.red.as_ref(),
            Primary::Green => None,
            Primary::Blue => self.blue.as_ref(),
        }
    }

    fn differs(&self) -> bool {
        Primary::ALL.into_iter().any(|primary| self.scale(primary).is_some() || self.lens(primary).is_some())
    }
}

/// Circle of the picture that the lens shows; pixels beyond it are invalid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct ImageCircleSpec {
    /// Radius of the circle. Omitted: no limit but `half_angle_deg`.
    #[key(unit = "px", above = 0.0, hint = "pixels farther from centre_px are invalid", example = "300.0")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_px: Option<f64>,
    /// Centre of the circle of `radius_px`. Omitted: the principal point.
    #[key(unit = "px", step = 0.5, example = "[319.5, 239.5]", names = "cx cy")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub centre_px: Option<[f64; 2]>,
    /// Largest angle of a ray to the optical axis, instead of `radius_px` or beside it. Omitted: no limit.
    #[key(
        unit = "deg",
        step = 0.5,
        above = 0.0,
        max = 180.0,
        hint = "it is an angle to the optical axis: a lens of 190 degrees has 95",
        example = "95.0"
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub half_angle_deg: Option<f64>,
}

/// Model of the vignetting, which multiplies the map (docs/reference/IMAGING.md).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct VignettingSpec {
    /// Power of the cosine of a ray's angle to the optical axis. 4 is natural vignetting, 0 none.
    #[key(step = 0.1, min = 0.0, max = 100.0, hint = "4 is natural vignetting, 0 none")]
    pub cos_power: f64,
    /// Terms k1, k2, k3 of 1 + k1 r^2 + k2 r^4 + k3 r^6. r is the distance from the principal point, 1 at
    /// half the picture's diagonal. Trailing terms may be omitted.
    #[key(step = 0.005, example = "[-0.3, 0.1, 0.0]")]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub polynomial: Vec<f64>,
    /// Polynomial of red, instead of `polynomial`. Omitted: that of all.
    #[key(step = 0.005, example = "[-0.32]")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polynomial_red: Option<Vec<f64>>,
    /// Polynomial of blue, instead of `polynomial`. Omitted: that of all.
    #[key(step = 0.005, example = "[-0.28]")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polynomial_blue: Option<Vec<f64>>,
}

impl VignettingSpec {
    /// The polynomial of a primary.
    #[must_use]
    pub fn polynomial(&self, primary: Primary) -> &[f64] {
        match primary {
            Primary::Red => self.polynomial_red.as_ref().unwrap_or(&self.polynomial),
            Primary::Green => &self.polynomial,
            Primary::Blue => self.polynomial_blue.as_ref().unwrap_or(&self.polynomial),
        }
    }

    /// Whether colours differ.
    #[must_use]
    pub fn is_colored(&self) -> bool {
        self.polynomial_red.is_some() || self.polynomial_blue.is_some()
    }
}

impl CameraSpec {
    /// Whether red or blue have a lens of their own, so that a picture is made by three.
    #[must_use]
    pub fn is_chromatic(&self) -> bool {
        self.primary.is_none() && self.chromatic.as_ref().is_some_and(ChromaticSpec::differs)
    }

    /// The camera of one primary.
    #[must_use]
    pub fn of_primary(&self, primary: Primary) -> Self {
        let mut camera = Self { primary: Some(primary), ..self.clone() };
        let Some(own) = self.chromatic.as_ref().and_then(|chromatic| chromatic.lens(primary)) else {
            return camera;
        };
        let model = own.model.unwrap_or(self.lens.model);
        let same = if model == self.lens.model { self.lens.coefficients.clone() } else { Vec::new() };
        camera.lens = LensSpec { model, coefficients: own.coefficients.clone().unwrap_or(same) };
        camera.focal_px = own.focal_px.unwrap_or(self.focal_px);
        camera.principal_point_px = own.principal_point_px.or(self.principal_point_px);
        camera
    }

    /// Terms of the scale of this camera's primary.
    #[must_use]
    pub fn primary_scale(&self) -> Option<[f64; 3]> {
        self.chromatic.as_ref().zip(self.primary).and_then(|(chromatic, primary)| chromatic.scale(primary))
    }

    /// Whether the photometric stage needs all colours of a pixel at once, so that it comes after the passes:
    /// gains that differ between colours, or luminance of three lenses.
    #[must_use]
    pub fn defers_photometric(&self) -> bool {
        let vignetting = self.photometric.vignetting.as_ref();
        let is_grey = matches!(self.photometric.output, OutputEncoding::Luma8 | OutputEncoding::Luma16);
        let is_chromatic = self.chromatic.as_ref().is_some_and(ChromaticSpec::differs);
        is_chromatic && is_grey || vignetting.is_some_and(VignettingSpec::is_colored)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PhotometricSpec;

    fn chromatic() -> CameraSpec {
        let red = PrimaryLensSpec { focal_px: Some([501.0, 502.0]), ..PrimaryLensSpec::default() };
        CameraSpec {
            lens: LensSpec { model: LensModel::BrownConrady, coefficients: vec![0.1, 0.02] },
            chromatic: Some(ChromaticSpec {
                red: Some(red),
                blue_scale: vec![0.999],
                ..ChromaticSpec::default()
            }),
            ..CameraSpec::default()
        }
    }

    #[test]
    fn a_primary_has_what_is_given_and_else_the_cameras() {
        let camera = chromatic();
        assert!(camera.is_chromatic() && !camera.of_primary(Primary::Red).is_chromatic());
        let [green, red, blue] = Primary::ALL.map(|primary| camera.of_primary(primary));
        assert_eq!((red.focal_px, &red.lens), ([501.0, 502.0], &camera.lens));
        assert_eq!((green.focal_px, green.primary_scale()), (camera.focal_px, None));
        assert_eq!((blue.primary_scale(), red.primary_scale()), (Some([0.999, 0.0, 0.0]), None));
        let mut other = camera;
        other.chromatic.iter_mut().flat_map(|all| &mut all.red).for_each(|red| {
            red.model = Some(LensModel::KannalaBrandt);
        });
        assert!(other.of_primary(Primary::Red).lens.coefficients.is_empty());
    }

    #[test]
    fn a_scale_of_one_is_no_aberration() {
        let scaled = |terms: &[f64]| CameraSpec {
            chromatic: Some(ChromaticSpec {
                red_scale: terms.to_vec(),
                blue_scale: vec![1.0],
                ..Default::default()
            }),
            ..CameraSpec::default()
        };
        assert!(!scaled(&[1.0]).is_chromatic() && !scaled(&[1.0, 0.0, 0.0]).is_chromatic());
        assert!(scaled(&[1.0, 0.0, 1e-6]).is_chromatic() && scaled(&[1.001]).is_chromatic());
    }

    #[test]
    fn luminance_of_three_lenses_and_colored_gains_come_late() {
        let mut camera = chromatic();
        assert!(!camera.defers_photometric());
        camera.photometric.output = OutputEncoding::Luma8;
        assert!(camera.defers_photometric() && camera.of_primary(Primary::Red).defers_photometric());
        let vignetting = VignettingSpec { polynomial_red: Some(vec![-0.1]), ..VignettingSpec::default() };
        let photometric = PhotometricSpec { vignetting: Some(vignetting), ..PhotometricSpec::default() };
        assert!(CameraSpec { photometric, ..CameraSpec::default() }.defers_photometric());
    }
}
