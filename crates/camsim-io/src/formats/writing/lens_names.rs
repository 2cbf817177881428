//! Names and orders of lens models in formats that have a name and a list of numbers.

use camsim_core::scenario::LensModel;

use super::{Calibration, CalibrationError};

/// Formats that share names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Family {
    /// Number of coefficients, or the module fisheye.
    OpenCv,
    /// `distortion_model` of `sensor_msgs/CameraInfo`.
    Ros,
    /// `distortion_model` of Kalibr.
    Kalibr,
    /// `distortion_model` of ASL's `sensor.yaml`; that of eight coefficients is OKVIS's.
    Euroc,
}

impl Family {
    fn title(self) -> &'static str {
        match self {
            Self::OpenCv => "OpenCV",
            Self::Ros => "camera_info of ROS",
            Self::Kalibr => "Kalibr",
            Self::Euroc => "sensor.yaml",
        }
    }
}

/// OKVIS's name for eight coefficients.
const EIGHT: &str = "radialtangential8";

/// Name and coefficients of the lens in a format, as short as the format allows.
///
/// # Errors
/// The format does not have the lens.
pub(crate) fn lens(
    family: Family,
    camera: &Calibration,
) -> Result<(&'static str, Vec<f64>), CalibrationError> {
    let lens = &camera.intrinsics;
    if let Some(k) = lens.equidistant() {
        let name = if family == Family::OpenCv { "fisheye" } else { "equidistant" };
        return Ok((name, k.to_vec()));
    }
    if let Some(k) = lens.of_model(LensModel::BrownConradyPrism, 14) {
        let count = if k[12..] == [0.0; 2] { 12 } else { 14 };
        return match family {
            Family::OpenCv => Ok(("radtan", k[..count].to_vec())),
            // OpenCV, which ROS hands them to, tells the models apart by their number.
            Family::Ros => Ok(("rational_polynomial", k[..count].to_vec())),
            Family::Kalibr | Family::Euroc => Err(no_such_lens(camera, family.title())),
        };
    }
    let [four, five, eight] =
        [4, 5, 8].map(|count| lens.of_model(LensModel::BrownConrady, count).map(<[f64]>::to_vec));
    let named = |name| move |k| (name, k);
    let found = match family {
        // OpenCV's four could be those of a fisheye, so five are written.
        Family::OpenCv => five.or(eight).map(named("radtan")),
        Family::Ros => five.map(named("plumb_bob")).or_else(|| eight.map(named("rational_polynomial"))),
        Family::Kalibr => four.map(named("radtan")),
        Family::Euroc => four.map(named("radial-tangential")).or_else(|| eight.map(named(EIGHT))),
    };
    found.ok_or_else(|| no_such_lens(camera, family.title()))
}

/// What readers of `sensor.yaml` should know of a lens whose name is not one of EuRoC's own.
pub(crate) fn euroc_note(camera: &Calibration, label: &str) -> Option<String> {
    let (name, _) = lens(Family::Euroc, camera).ok().filter(|(name, _)| *name == EIGHT)?;
    Some(format!(
        "sensor.yaml of {label} has the lens as {name} (k1 k2 p1 p2 k3 k4 k5 k6), which OKVIS knows; readers that know \
         EuRoC's own radial-tangential alone have no field for k3: give them a lens of k1 k2 p1 p2 or pictures without lens ({TWIN_ADVICE})"
    ))
}

/// How to get pictures without lens.
const TWIN_ADVICE: &str = "render the scenario without this export and with `[[output.twin]]`, name = \"plain\", lens = \
                           false, and export the twin's folder: `camsim export OUT/plain --as ...`, or its OUT/plain/camera.toml with `camsim camera export`";

/// The error of a format without the lens.
pub(crate) fn no_such_lens(camera: &Calibration, format: &str) -> CalibrationError {
    let reason = match camera.intrinsics.model {
        LensModel::Pinhole | LensModel::BrownConrady => "lens with this many coefficients".to_owned(),
        model => format!("lens of the model {}", model.name()),
    };
    CalibrationError::Refused(format!(
        "{}: {format} has no {reason} ({:?}): `camsim camera export --as stmap` writes any lens, and a twin without lens \
         needs none: {TWIN_ADVICE}",
        camera.label(),
        camera.spec.lens.coefficients
    ))
}
