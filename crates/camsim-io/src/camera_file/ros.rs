//! ROS camera_info: the YAML file of `camera_calibration`, the message as `rostopic echo` and `ros2 topic
//! echo` print it, and the `.ini` file.
//!
//! Matrix and region of interest are those of the full sensor; the pictures are the region, binned.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use super::choose::Entry;
use super::document::{
    Document, Problem, camera_matrix, find, flag, number, numbers, one_of, optional_number, size, word,
};
use super::keys::{Key, Neutral, Use};
use super::{CameraFormat, ImportedCamera, camera, models};

const RECTIFIED: &str = "of the rectified pictures: those that come out are the raw ones";

pub(super) const KEYS: &[Key] = &[
    Key::new("image_width", Use::Applied, "width of the full sensor; `width` in a message"),
    Key::new("image_height", Use::Applied, "height of the full sensor; `height` in a message"),
    Key::new("width", Use::Applied, "as image_width"),
    Key::new("height", Use::Applied, "as image_height"),
    Key::new(
        "camera_matrix",
        Use::Applied,
        "focal lengths and principal point of the full sensor; `K` or `k` in a message",
    ),
    Key::new("K", Use::Applied, "as camera_matrix"),
    Key::new("k", Use::Applied, "as camera_matrix"),
    Key::new(
        "distortion_model",
        Use::Applied,
        "plumb_bob, rational_polynomial, equidistant; others are refused",
    ),
    Key::new("distortion_coefficients", Use::Applied, "`D` or `d` in a message"),
    Key::new("D", Use::Applied, "as distortion_coefficients"),
    Key::new("d", Use::Applied, "as distortion_coefficients"),
    Key::new("roi.x_offset", Use::Applied, "the picture is this part of the sensor"),
    Key::new("roi.y_offset", Use::Applied, "the picture is this part of the sensor"),
    Key::new("roi.width", Use::Applied, "0: all of it"),
    Key::new("roi.height", Use::Applied, "0: all of it"),
    Key::new("roi.do_rectify", Use::Named(Neutral::Zero), RECTIFIED),
    Key::new("binning_x", Use::Applied, "divides width, fx and cx, as ROS's own reader does"),
    Key::new("binning_y", Use::Applied, "divides height, fy and cy, as ROS's own reader does"),
    Key::new("rectification_matrix", Use::Named(Neutral::Identity), RECTIFIED),
    Key::new("R", Use::Named(Neutral::Identity), RECTIFIED),
    Key::new("r", Use::Named(Neutral::Identity), RECTIFIED),
    Key::new(
        "projection_matrix",
        Use::Applied,
        "named where it differs from camera_matrix: it is that of the rectified pictures",
    ),
    Key::new("P", Use::Applied, "as projection_matrix"),
    Key::new("p", Use::Applied, "as projection_matrix"),
    Key::new("camera_name", Use::Silent, "a name"),
    Key::new("header.**", Use::Silent, "stamp and frame of a message"),
    Key::new("T_cam_imu", Use::Named(Neutral::Identity), "pose of the camera: set mount by hand"),
];

const MATRICES: [&str; 3] = ["camera_matrix", "K", "k"];

pub(super) fn fits(document: &Document) -> bool {
    let has = |key: &str| find(&document.value, key).is_some();
    (document.root.is_empty() && MATRICES.iter().any(|key| has(key)) && has("distortion_model"))
        || document.root == "ini"
}

pub(super) fn entries(document: &Document) -> Vec<Entry<'_>> {
    match find(&document.value, "cameras").and_then(Value::as_array) {
        Some(list) if document.root == "ini" => {
            let name = |value: &Value| word(value, "camera_name").unwrap_or_default().to_owned();
            list.iter()
                .enumerate()
                .map(|(index, value)| Entry::new(name(value), value, format!("cameras[{index}]")))
                .collect()
        }
        _ => Entry::only(&document.value),
    }
}

pub(super) const INI_KEYS: &[Key] = &[
    Key::new("cameras.image_width", Use::Applied, "`width` in `[image]`"),
    Key::new("cameras.image_height", Use::Applied, "`height` in `[image]`"),
    Key::new("cameras.camera_name", Use::Silent, "the section's name, by which `--camera` names it"),
    Key::new("cameras.camera_matrix", Use::Applied, "`camera matrix`"),
    Key::new(
        "cameras.distortion_coefficients",
        Use::Applied,
        "`distortion`: five are plumb_bob, eight rational_polynomial; four are refused, as nothing says what they are",
    ),
    Key::new("cameras.rectification_matrix", Use::Named(Neutral::Identity), RECTIFIED),
    Key::new(
        "cameras.projection_matrix",
        Use::Applied,
        "named where it differs from the camera matrix: it is that of the rectified pictures",
    ),
    Key::new("externals.**", Use::Named(Neutral::Zero), "pose of the camera: set mount by hand"),
];

pub(super) fn import(value: &Value, ini: bool) -> Result<ImportedCamera, Problem> {
    let matrix = one_of(value, &MATRICES)?.ok_or_else(|| Problem::new("camera_matrix", "is missing"))?;
    if numbers(value, matrix)?.iter().all(|x| *x == 0.0) {
        return Err(Problem::new(
            matrix,
            "is all zeros, which means in ROS that the camera was never calibrated",
        ));
    }
    let (focal_px, principal_point_px) = camera_matrix(value, matrix)?;
    let [width, height] = [&["image_width", "width"], &["image_height", "height"]]
        .map(|names| one_of(value, names).map(|name| name.unwrap_or(names[0])));
    let full = [number(value, width?)?, number(value, height?)?];
    size("image_width", full)?;
    let coefficients = one_of(value, &["distortion_coefficients", "D", "d"])?;
    let key = coefficients.unwrap_or("distortion_coefficients");
    let list = match coefficients {
        Some(key) => numbers(value, key)?,
        None if ini => return Err(Problem::new("distortion", "is missing: five zeros are no distortion")),
        None => models::stated(
            value,
            "distortion_model",
            word(value, "distortion_model").unwrap_or_default(),
            Some(key),
        )?,
    };
    let (model, list) = if ini {
        by_count(list)?
    } else {
        models::by_name("distortion_model", word(value, "distortion_model").unwrap_or_default(), key, list)?
    };
    let region = Region::read(value, full)?;
    let size_px =
        size("roi and binning", [region.size[0] / region.binning[0], region.size[1] / region.binning[1]])?;
    let focal_px = [focal_px[0] / region.binning[0], focal_px[1] / region.binning[1]];
    let point = [0, 1].map(|axis| (principal_point_px[axis] - region.offset[axis]) / region.binning[axis]);
    let format = if ini { CameraFormat::RosIni } else { CameraFormat::RosCameraInfo };
    let mut imported = camera(format, size_px, focal_px, point, model, list);
    imported.notes.extend(region.notes(full));
    imported.notes.extend(rectified(value, matrix)?);
    Ok(imported)
}

/// The `.ini` file names no model; ROS's own reader goes by the number of coefficients.
fn by_count(list: Vec<f64>) -> Result<(LensModel, Vec<f64>), Problem> {
    match list.len() {
        5 => Ok((LensModel::BrownConrady, list)),
        8 => Ok((LensModel::BrownConrady, list)),
        count => {
            let text = format!(
                "has {count} numbers, and the file cannot name a model: ROS reads five as plumb_bob and eight as rational_polynomial. Write k1 k2 p1 p2 0 for a \
                 plumb_bob, and a fisheye in a YAML file, with `distortion_model: equidistant`"
            );
            Err(Problem::new("distortion", text))
        }
    }
}

/// The part of the sensor that the picture is.
struct Region {
    offset: [f64; 2],
    size: [f64; 2],
    binning: [f64; 2],
}

impl Region {
    fn read(value: &Value, full: [f64; 2]) -> Result<Self, Problem> {
        let or_zero = |key: &str| optional_number(value, key).map(|found| found.unwrap_or(0.0));
        let offset = [or_zero("roi.x_offset")?, or_zero("roi.y_offset")?];
        let size = [or_zero("roi.width")?, or_zero("roi.height")?];
        flag(value, "roi.do_rectify")?;
        // 0 is as good as 1 there.
        let binning = [or_zero("binning_x")?, or_zero("binning_y")?]
            .map(|binning| if binning == 0.0 { 1.0 } else { binning });
        let size = match size {
            [0.0, 0.0] if offset == [0.0, 0.0] => full,
            [0.0, 0.0] => {
                return Err(Problem::new(
                    "roi",
                    "has an offset but no size: write its width and height, or no region at all",
                ));
            }
            size => size,
        };
        let inside = |axis: usize| {
            offset[axis] >= 0.0
                && size[axis] > 0.0
                && offset[axis] + size[axis] <= full[axis]
                && offset[axis].fract() == 0.0
        };
        if !(inside(0) && inside(1)) {
            let text = format!(
                "reaches from {offset:?} over {size:?} px, not within the sensor of {full:?}: offsets and sizes are in pixels of the full, unbinned sensor"
            );
            return Err(Problem::new("roi", text));
        }
        for (key, binning, size) in [("binning_x", binning[0], size[0]), ("binning_y", binning[1], size[1])] {
            if binning < 1.0 || binning.fract() != 0.0 || size % binning != 0.0 {
                return Err(Problem::new(key, format!("is {binning}, which does not divide {size} pixels")));
            }
        }
        Ok(Self { offset, size, binning })
    }

    fn notes(&self, full: [f64; 2]) -> Option<String> {
        let cropped = (self.size != full || self.offset != [0.0, 0.0])
            .then(|| format!("the region {:?} px from {:?} of {full:?}", self.size, self.offset));
        let binned = (self.binning != [1.0, 1.0]).then(|| {
            format!("binned by {:?} (matrix divided as ROS's image_geometry does, without a shift by half a pixel)", self.binning)
        });
        let both: Vec<String> = [cropped, binned].into_iter().flatten().collect();
        (!both.is_empty()).then(|| format!("the picture is {}", both.join(", ")))
    }
}

/// A word on a projection matrix that is not the camera's.
fn rectified(value: &Value, matrix: &str) -> Result<Option<String>, Problem> {
    let Some(key) = one_of(value, &["projection_matrix", "P", "p"])? else { return Ok(None) };
    let (camera, projection) = (numbers(value, matrix)?, numbers(value, key)?);
    if projection.len() != 12 {
        return Err(Problem::new(key, format!("has {} numbers instead of 3 x 4", projection.len())));
    }
    let same = (0..3).all(|row| {
        (0..3).all(|column| (projection[4 * row + column] - camera[3 * row + column]).abs() < 1e-6)
    }) && projection[3] == 0.0
        && projection[7] == 0.0;
    let unused = same || projection.iter().all(|x| *x == 0.0);
    Ok((!unused).then(|| format!("left out: {key}, which differs from {matrix} ({RECTIFIED})")))
}
