//! Camera files of camodocal, which VINS-Mono and VINS-Fusion read.

use std::fmt::Write as _;

use camsim_core::scenario::LensModel;

use super::{
    Calibration, CalibrationError, ImuReference,
    lens_names::no_such_lens,
    text::{Element, opencv_matrix, real},
};

/// The file of one camera.
///
/// # Errors
/// The format does not have the lens.
pub(crate) fn file(name: &str, camera: &Calibration) -> Result<String, CalibrationError> {
    let lens = &camera.intrinsics;
    let ([fx, fy], [cx, cy], [w, h]) = (lens.focal_px, lens.principal_px, lens.size_px);
    let pinhole = vec![("fx", fx), ("fy", fy), ("cx", cx), ("cy", cy)];
    if let Some([xi, k1, k2, p1, p2]) = lens.of_model::<5>(LensModel::Mei) {
        let distortion = vec![("k1", k1), ("k2", k2), ("p1", p1), ("p2", p2)];
        let projection = vec![("gamma1", fx), ("gamma2", fy), ("u0", cx), ("v0", cy)];
        let tables = [
            ("mirror_parameters", vec![("xi", xi)]),
            ("distortion_parameters", distortion),
            ("projection_parameters", projection),
        ];
        return Ok(yaml("MEI", name, [w, h], tables));
    }
    let (model, distortion, projection) = match (lens.equidistant(), lens.brown::<4>(), lens.brown::<8>()) {
        // Its k1 is 1 and not written.
        (Some([k1, k2, k3, k4]), ..) => (
            "KANNALA_BRANDT",
            Vec::new(),
            vec![
                ("k2", k1),
                ("k3", k2),
                ("k4", k3),
                ("k5", k4),
                ("mu", fx),
                ("mv", fy),
                ("u0", cx),
                ("v0", cy),
            ],
        ),
        (None, Some([k1, k2, p1, p2]), _) => {
            ("PINHOLE", vec![("k1", k1), ("k2", k2), ("p1", p1), ("p2", p2)], pinhole)
        }
        (None, None, Some(k)) => {
            let names = ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"];
            ("PINHOLE_FULL", names.into_iter().zip(k).collect(), pinhole)
        }
        (None, None, None) => return Err(no_such_lens(camera, "camodocal")),
    };
    let tables = [
        ("mirror_parameters", Vec::new()),
        ("distortion_parameters", distortion),
        ("projection_parameters", projection),
    ];
    Ok(yaml(model, name, [w, h], tables))
}

/// A model with its tables of numbers; empty ones are left out.
fn yaml(model: &str, name: &str, [w, h]: [u32; 2], tables: [(&str, Vec<(&str, f64)>); 3]) -> String {
    let mut text = format!(
        "%YAML:1.0\n---\nmodel_type: {model}\ncamera_name: {name}\nimage_width: {w}\nimage_height: {h}\n"
    );
    for (table, values) in tables.into_iter().filter(|(_, values)| !values.is_empty()) {
        let _ = writeln!(text, "{table}:");
        for (name, value) in values {
            let _ = writeln!(text, "   {name}: {}", real(value));
        }
    }
    text
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
