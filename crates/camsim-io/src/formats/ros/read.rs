//! ROS camera_info: the YAML file of `camera_calibration`, the message as `rostopic echo` and `ros2 topic
//! echo` print it, and the `.ini` file.
//!
//! Matrix and region of interest refer to the full sensor; the picture is the region, binned.

use camsim_core::scenario::LensModel;
use serde_json::Value;

use crate::formats::reading::format::{ReadCamera, Reader, camera};
use crate::formats::reading::key_table::{KeyRow, Neutral, applied, ignored, reported};
use crate::formats::reading::lens_models;
use crate::formats::reading::selection::CameraEntry;
use crate::text::document::{
    Document, KeyProblem, camera_matrix, find, flag, list, number, numbers, one_of, optional_number, size,
    word,
};

const RECTIFIED: &str = "for rectified pictures; camsim renders raw ones";

pub(crate) const READER: Reader =
    Reader::new("ros-camera-info", "ROS camera_info (file or message)", matches, &[("", KEYS)], |camera| {
        import(camera.value(), false)
    });

pub(crate) const INI_READER: Reader = Reader {
    roots: &["ini"],
    entries,
    ..Reader::new("ros-ini", "ROS .ini", |_| true, &[("", INI_KEYS)], |camera| import(camera.value(), true))
};

const KEYS: &[KeyRow] = &[
    applied("image_width", "width of the full sensor; `width` in a message"),
    applied("image_height", "height of the full sensor; `height` in a message"),
    applied("width", "as image_width"),
    applied("height", "as image_height"),
    applied("camera_matrix", "focal lengths and principal point of the full sensor; `K` or `k` in a message"),
    applied("K k", "as camera_matrix"),
    applied("distortion_model", "plumb_bob, rational_polynomial, equidistant; others are refused"),
    applied("distortion_coefficients", "`D` or `d` in a message"),
    applied("D d", "as distortion_coefficients"),
    applied("roi.x_offset roi.y_offset", "region of the sensor that is the picture"),
    applied("roi.width roi.height", "0: the full size"),
    reported(Neutral::Zero, "roi.do_rectify", RECTIFIED),
    applied("binning_x", "divides width, fx and cx, as ROS's own reader does"),
    applied("binning_y", "divides height, fy and cy, as ROS's own reader does"),
    reported(Neutral::Identity, "rectification_matrix R r", RECTIFIED),
    applied(
        "projection_matrix",
        "reported where it differs from camera_matrix: it applies to rectified pictures",
    ),
    applied("P p", "as projection_matrix"),
    ignored("camera_name", "a name"),
    ignored("header.**", "stamp and frame of a message"),
    reported(Neutral::Identity, "T_cam_imu", "pose of the camera: set mount instead"),
];

const MATRICES: [&str; 3] = ["camera_matrix", "K", "k"];

pub(crate) fn matches(document: &Document) -> bool {
    let has = |key: &str| find(&document.value, key).is_some();
    document.root.is_empty() && MATRICES.iter().any(|key| has(key)) && has("distortion_model")
}

/// Sections of an `.ini`.
fn entries(document: &Document) -> Result<Vec<CameraEntry<'_>>, KeyProblem> {
    let entry = |(index, value): (usize, _)| {
        let name = word(value, "camera_name").unwrap_or_default().to_owned();
        CameraEntry::new(name, value, format!("cameras[{index}]"))
    };
    Ok(list(&document.value, "cameras").iter().enumerate().map(entry).collect())
}

const INI_KEYS: &[KeyRow] = &[
    applied("cameras.image_width", "`width` in `[image]`"),
    applied("cameras.image_height", "`height` in `[image]`"),
    ignored("cameras.camera_name", "the section's name, for `--camera`"),
    applied("cameras.camera_matrix", "`camera matrix`"),
    applied(
        "cameras.distortion_coefficients",
        "`distortion`: five are plumb_bob, eight rational_polynomial; four are refused, because their model \
         is not stated",
    ),
    reported(Neutral::Identity, "cameras.rectification_matrix", RECTIFIED),
    applied(
        "cameras.projection_matrix",
        "reported where it differs from the camera matrix: it applies to rectified pictures",
    ),
    reported(Neutral::Zero, "externals.**", "pose of the camera: set mount instead"),
];

fn import(value: &Value, is_ini: bool) -> Result<ReadCamera, KeyProblem> {
    let matrix = one_of(value, &MATRICES)?.ok_or_else(|| KeyProblem::new("camera_matrix", "is missing"))?;
    if numbers(value, matrix)?.iter().all(|x| *x == 0.0) {
        return Err(KeyProblem::new(
            matrix,
            "is all zeros, which in ROS means that the camera is not calibrated",
        ));
    }
    let (focal_px, principal_point_px) = camera_matrix(value, matrix)?;
    let [width, height] = [&["image_width", "width"], &["image_height", "height"]]
        .map(|names| one_of(value, names).map(|name| name.unwrap_or(names[0])));
    let full_size = [number(value, width?)?, number(value, height?)?];
    size("image_width", full_size)?;
    let coefficients = one_of(value, &["distortion_coefficients", "D", "d"])?;
    let key = coefficients.unwrap_or("distortion_coefficients");
    let list = match coefficients {
        Some(key) => numbers(value, key)?,
        None if is_ini => {
            return Err(KeyProblem::new("distortion", "is missing: five zeros are no distortion"));
        }
        None => lens_models::coefficients(
            value,
            "distortion_model",
            word(value, "distortion_model").unwrap_or_default(),
            Some(key),
        )?,
    };
    let (model, list) = if is_ini {
        by_count(list)?
    } else {
        lens_models::lens_by_name(
            "distortion_model",
            word(value, "distortion_model").unwrap_or_default(),
            key,
            list,
        )?
    };
    let region = Region::read(value, full_size)?;
    let size_px =
        size("roi and binning", [region.size[0] / region.binning[0], region.size[1] / region.binning[1]])?;
    let focal_px = [focal_px[0] / region.binning[0], focal_px[1] / region.binning[1]];
    let point = [0, 1].map(|axis| (principal_point_px[axis] - region.offset[axis]) / region.binning[axis]);
    let mut imported = camera(size_px, focal_px, point, model, list);
    imported.notes.extend(region.notes(full_size));
    imported.notes.extend(projection_note(value, matrix)?);
    Ok(imported)
}

/// Model by the number of coefficients, as in ROS: `.ini` files state no model.
fn by_count(list: Vec<f64>) -> Result<(LensModel, Vec<f64>), KeyProblem> {
    match list.len() {
        5 | 8 => Ok((LensModel::BrownConrady, list)),
        count => {
            let text = format!(
                "has {count} numbers, and the format cannot state a model: ROS reads five as plumb_bob and \
                 eight as rational_polynomial. Write k1 k2 p1 p2 0 for a plumb_bob, and a fisheye in a YAML \
                 file, with `distortion_model: equidistant`"
            );
            Err(KeyProblem::new("distortion", text))
        }
    }
}

/// Region of the sensor that is the picture, pixels of the full sensor.
struct Region {
    offset: [f64; 2],
    size: [f64; 2],
    binning: [f64; 2],
}

impl Region {
    fn read(value: &Value, full: [f64; 2]) -> Result<Self, KeyProblem> {
        let or_zero = |key: &str| optional_number(value, key).map(|number| number.unwrap_or(0.0));
        let offset = [or_zero("roi.x_offset")?, or_zero("roi.y_offset")?];
        let size = [or_zero("roi.width")?, or_zero("roi.height")?];
        flag(value, "roi.do_rectify")?;
        // In ROS 0 means 1.
        let binning = [or_zero("binning_x")?, or_zero("binning_y")?]
            .map(|binning| if binning == 0.0 { 1.0 } else { binning });
        let size = match size {
            [0.0, 0.0] if offset == [0.0, 0.0] => full,
            [0.0, 0.0] => {
                return Err(KeyProblem::new(
                    "roi",
                    "has an offset but no size: write its width and height, or remove it",
                ));
            }
            size => size,
        };
        let is_inside = |axis: usize| {
            offset[axis] >= 0.0
                && size[axis] > 0.0
                && offset[axis] + size[axis] <= full[axis]
                && offset[axis].fract() == 0.0
        };
        if !(is_inside(0) && is_inside(1)) {
            let text = format!(
                "at {offset:?} with {size:?} px is not within the sensor of {full:?}: offsets and sizes are \
                 in pixels of the full, unbinned sensor"
            );
            return Err(KeyProblem::new("roi", text));
        }
        for (key, binning, size) in [("binning_x", binning[0], size[0]), ("binning_y", binning[1], size[1])] {
            if binning < 1.0 || binning.fract() != 0.0 || size % binning != 0.0 {
                return Err(KeyProblem::new(
                    key,
                    format!("is {binning}, which does not divide {size} pixels"),
                ));
            }
        }
        Ok(Self { offset, size, binning })
    }

    fn notes(&self, full: [f64; 2]) -> Option<String> {
        let cropped = (self.size != full || self.offset != [0.0, 0.0])
            .then(|| format!("the region {:?} px from {:?} of {full:?}", self.size, self.offset));
        let binned = (self.binning != [1.0, 1.0]).then(|| {
            format!(
                "binned by {:?} (matrix divided as ROS's image_geometry does, without a shift by half a \
                 pixel)",
                self.binning
            )
        });
        let parts: Vec<String> = [cropped, binned].into_iter().flatten().collect();
        (!parts.is_empty()).then(|| format!("the picture is {}", parts.join(", ")))
    }
}

/// A note about a projection matrix that differs from the camera matrix.
fn projection_note(value: &Value, matrix: &str) -> Result<Option<String>, KeyProblem> {
    let Some(key) = one_of(value, &["projection_matrix", "P", "p"])? else { return Ok(None) };
    let (camera, projection) = (numbers(value, matrix)?, numbers(value, key)?);
    if projection.len() != 12 {
        return Err(KeyProblem::new(key, format!("has {} numbers instead of 3 x 4", projection.len())));
    }
    let is_same = (0..3).all(|row| {
        (0..3).all(|column| (projection[4 * row + column] - camera[3 * row + column]).abs() < 1e-6)
    }) && projection[3] == 0.0
        && projection[7] == 0.0;
    let is_unused = is_same || projection.iter().all(|x| *x == 0.0);
    Ok((!is_unused).then(|| format!("not applied: {key}, which differs from {matrix} ({RECTIFIED})")))
}
