//! OpenCV's FileStorage (YAML): the keys of its calibration samples.

use std::fmt::Write as _;

use camsim_core::{lens::ModelFacts, scenario::LensModel};

use crate::formats::writing::exported::{Content, Writer};
use crate::formats::writing::lens_names::Family;
use crate::formats::writing::{Calibration, CalibrationError, lens_names};
use crate::text::numbers::{Element, opencv_matrix};

pub(crate) const WRITER: Writer =
    Writer::new("opencv", "calibration.yaml", Content::One(|camera, _| file(camera)), &[]);

/// The file of one camera.
fn file(camera: &Calibration) -> Result<String, CalibrationError> {
    let lens = &camera.intrinsics;
    let (model, coefficients) = lens_names::lens(Family::OpenCv, camera)?;
    let ([fx, fy], [cx, cy], [w, h]) = (lens.focal_px, lens.principal_px, lens.size_px);
    let mut text = format!(
        "%YAML:1.0\n---\n# (0, 0) is the centre of the first pixel.\nimage_width: {w}\nimage_height: {h}\n\
         fisheye_model: {}\n",
        u8::from(model == "fisheye")
    );
    text +=
        &opencv_matrix("camera_matrix", [3, 3], Element::Double, &[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]);
    text +=
        &opencv_matrix("distortion_coefficients", [1, coefficients.len()], Element::Double, &coefficients);
    let order = if model == "fisheye" {
        ModelFacts::of(LensModel::KannalaBrandt).coefficients.join(" ") + " of the module fisheye"
    } else {
        ModelFacts::of(LensModel::BrownConradyPrism).coefficients[..coefficients.len()].join(" ")
    };
    let _ = writeln!(text, "# {order}");
    Ok(text)
}
