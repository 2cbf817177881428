//! Camera files of camodocal, which VINS-Mono and VINS-Fusion read.

use std::fmt::Write as _;

use camsim_core::scenario::Readout;

use super::{LENSES, intrinsic_keys};
use crate::formats::named_lens::NamedLens;
use crate::formats::writing::exported::{Content, Field, Writer};
use crate::formats::writing::{Calibration, CalibrationError, ImuReference, Intrinsics};
use crate::text::numbers::{Element, opencv_matrix, real};

pub(crate) const WRITER: Writer = Writer::new(
    "vins",
    "camera.yaml",
    Content::One(settings),
    &[Field::Name, Field::Pose, Field::TimeShift, Field::Readout(&[Readout::TopToBottom])],
);

/// The file of one camera.
///
/// # Errors
/// The format does not have the lens.
pub(crate) fn file(name: &str, camera: &Calibration) -> Result<String, CalibrationError> {
    let (lens, coefficients) = NamedLens::that_holds(LENSES, camera, "camodocal")?;
    let Intrinsics { focal_px: [fx, fy], principal_px: [cx, cy], size_px: [w, h], .. } = camera.intrinsics;
    let intrinsics = intrinsic_keys(lens.name).into_iter().zip([fx, fy, cx, cy]);
    let mut text = format!(
        "%YAML:1.0\n---\nmodel_type: {}\ncamera_name: {name}\nimage_width: {w}\nimage_height: {h}\n",
        lens.name
    );
    for table in ["mirror", "distortion", "projection"] {
        let own = coefficients.iter().filter_map(|(key, value)| Some((key.split_once('.')?, *value)));
        let own = own.filter(|((of, _), _)| *of == table).map(|((_, key), value)| (key, value));
        let values: Vec<(&str, f64)> =
            own.chain(intrinsics.clone().filter(|_| table == "projection")).collect();
        if !values.is_empty() {
            let _ = writeln!(text, "{table}_parameters:");
        }
        for (key, value) in values {
            let _ = writeln!(text, "   {key}: {}", real(value));
        }
    }
    Ok(text)
}

/// The file of one camera with what VINS-Mono's settings say of it: pose, clock, rolling shutter.
///
/// # Errors
/// As [`file`].
pub(crate) fn settings(camera: &Calibration, imu: &ImuReference) -> Result<String, CalibrationError> {
    let name = if camera.spec.name.is_empty() { "camera" } else { &camera.spec.name };
    let imu_from_camera = imu.body_from_imu.inverse().of(&camera.body_from_camera());
    let rows = imu_from_camera.matrix();
    let rotation: Vec<f64> = rows[..3].iter().flat_map(|row| row[..3].to_vec()).collect();
    let readout_s =
        camera.line_delay_s().filter(|line_s| *line_s > 0.0).map_or(0.0, |_| camera.shutter.readout_s());
    Ok(format!(
        "{}estimate_extrinsic: 0\n{}{}# stamp + td is the time of the image's centre on the IMU's clock\ntd: {}\n\
         # seconds from the first row to the last\nrolling_shutter: {}\nrolling_shutter_tr: {}\n",
        file(name, camera)?,
        opencv_matrix("extrinsicRotation", [3, 3], Element::Double, &rotation),
        opencv_matrix(
            "extrinsicTranslation",
            [3, 1],
            Element::Double,
            &imu_from_camera.translation_m.to_array()
        ),
        real(camera.stamp_to_centre_s() + imu.clock_offset_s),
        u8::from(readout_s > 0.0),
        real(readout_s)
    ))
}
