//! Agisoft XML: Metashape and PhotoScan since 1.2 (`f`, principal point from the image centre, P1 and P2 the other way round than in OpenCV),
//! and Agisoft Lens (`fx`, `fy`, absolute principal point, P1 and P2 as in OpenCV). Image corners are at whole pixels in both.

use camsim_core::scenario::LensModel;

use super::document::{Document, Problem, find, number, optional_number, size, word};
use super::{CameraFormat, ImportedCamera, camera};

pub(super) fn fits(document: &Document) -> bool {
    document.root == "calibration" && ["f", "fx"].iter().any(|key| find(&document.value, key).is_some())
}

pub(super) fn import(document: &Document) -> Result<ImportedCamera, Problem> {
    let value = &document.value;
    let or_zero = |key: &str| optional_number(value, key).map(|found| found.unwrap_or(0.0));
    for (key, why) in [("b2", "skew"), ("skew", "skew"), ("p3", "higher tangential terms"), ("p4", "higher tangential terms")] {
        if or_zero(key)? != 0.0 {
            return Err(Problem::new(key, format!("is not zero: a camera here has no {why}; recalibrate without")));
        }
    }
    let (width, height) = if find(value, "resolution").is_some() {
        (number(value, "resolution.width")?, number(value, "resolution.height")?)
    } else {
        (number(value, "width")?, number(value, "height")?)
    };
    let size_px = size("width", [width, height])?;
    let [k1, k2, k3, k4] = [or_zero("k1")?, or_zero("k2")?, or_zero("k3")?, or_zero("k4")?];
    let (p1, p2) = (or_zero("p1")?, or_zero("p2")?);
    // Where both are given (files that serve both programs), the newer one's keys count.
    let (focal_px, corner_based, [p1, p2]) = if find(value, "f").is_some() {
        let f = number(value, "f")?;
        ([f + or_zero("b1")?, f], [0.5 * width + or_zero("cx")?, 0.5 * height + or_zero("cy")?], [p2, p1])
    } else {
        ([number(value, "fx")?, number(value, "fy")?], [number(value, "cx")?, number(value, "cy")?], [p1, p2])
    };
    let principal_point_px = [corner_based[0] - 0.5, corner_based[1] - 0.5];
    let (model, coefficients) = match word(value, "projection").or_else(|| word(value, "type")).unwrap_or("frame") {
        "frame" if k4 != 0.0 => {
            return Err(Problem::new("k4", "is not zero: a radial term in r^8 is not modelled; recalibrate with K4 off"));
        }
        "frame" => (LensModel::BrownConrady, vec![k1, k2, p1, p2, k3]),
        "fisheye" | "equidistant_fisheye" if p1 != 0.0 || p2 != 0.0 => {
            return Err(Problem::new("p1", "is not zero: a fisheye here has no tangential terms; recalibrate with P1 and P2 off"));
        }
        "fisheye" | "equidistant_fisheye" => (LensModel::KannalaBrandt, vec![k1, k2, k3, k4]),
        other => return Err(Problem::new("projection", format!("is `{other}`: frame and fisheye can be imported"))),
    };
    let mut imported = camera(CameraFormat::Agisoft, size_px, focal_px, principal_point_px, model, coefficients);
    imported.notes.push("the file has no frame rate and no shutter times: fps is 30, the shutter global".to_owned());
    Ok(imported)
}
