//! nerfstudio's and instant-ngp's `transforms.json`. Their code has the centre of the first pixel at (0.5, 0.5).
//!
//! Intrinsics are at the root or, where the root has none, in the frames. Frames with the same values are one
//! camera.

use std::collections::HashSet;
use std::f64::consts::PI;

use camsim_core::scenario::LensModel;
use serde_json::{Map, Value};

use super::{LENSES, OPENCV_FISHEYE};
use crate::formats::named_lens::NamedLens;
use crate::formats::reading::format::{ReadCamera, Reader, camera};
use crate::formats::reading::key_table::{KeyRow, Neutral, applied, ignored, refused, reported};
use crate::formats::reading::selection::{CameraEntry, single};
use crate::formats::reading::stated_size::add_size;
use crate::text::document::{
    Document, KeyProblem, as_number, find, flag, list, number, numbers_n, optional_number, size, word,
};

const COEFFICIENT: &str = "coefficient; refused unless zero if camera_model does not have it";
const POSES: &str = "pictures and poses";
const OWN: &str = "as that of the root, where the root has none; refused if both differ";
const OTHER_LENS: &str =
    "a lens of instant-ngp that is not imported: calibrate with OPENCV or OPENCV_FISHEYE";
const SHUTTER: &str = "instant-ngp's fractions of the motion between two poses: set shutter.readout_ms";
const MASK: &str = "mask of unused pixels: set photometric.vignette if they are dark";

pub(crate) const READER: Reader = Reader {
    complete,
    entries,
    ..Reader::new("nerfstudio", "nerfstudio transforms.json", matches, &[("", KEYS)], |camera| {
        import(camera.document, camera.entry())
    })
};

const KEYS: &[KeyRow] = &[
    applied(
        "camera_model",
        "OPENCV (also if missing), OPENCV_FISHEYE, PINHOLE, SIMPLE_PINHOLE, EQUIRECTANGULAR; others are refused",
    ),
    applied("is_fisheye", "true is OPENCV_FISHEYE; refused if camera_model says otherwise"),
    applied("w", "width; give --size if it is missing"),
    applied("h", "height"),
    applied("fl_x", "px; from an angle of view across and w if missing, else fl_y"),
    applied("fl_y", "px; from an angle of view down and h if missing, else fl_x"),
    applied(
        "cx",
        "px; half a pixel is subtracted, as its code counts from the corner; the centre if missing",
    ),
    applied("cy", "px; half a pixel is subtracted"),
    applied("k1 k2 k3 k4 p1 p2", COEFFICIENT),
    applied("distortion_params", "k1 k2 k3 k4 p1 p2"),
    applied("camera_angle_x", "radians; named if fl_x is another focal length"),
    applied("camera_angle_y", "radians; named if fl_y is another focal length"),
    applied("x_fov", "degrees, like camera_angle_x"),
    applied("y_fov", "degrees, like camera_angle_y"),
    reported(Neutral::Zero, "rolling_shutter", SHUTTER),
    refused(Neutral::Zero, "ftheta_* latlong", OTHER_LENS),
    applied(
        "frames.camera_model frames.is_fisheye frames.w frames.h frames.fl_x frames.fl_y frames.cx \
         frames.cy",
        OWN,
    ),
    applied("frames.k1", "coefficient, where the root has none, like the following"),
    applied(
        "frames.k2 frames.k3 frames.k4 frames.p1 frames.p2 frames.distortion_params \
         frames.camera_angle_x frames.camera_angle_y frames.x_fov frames.y_fov",
        OWN,
    ),
    reported(Neutral::Zero, "frames.rolling_shutter", SHUTTER),
    refused(Neutral::Zero, "frames.ftheta_* frames.latlong", OTHER_LENS),
    reported(Neutral::Never, "frames.mask_path", MASK),
    ignored("frames.*_path frames.transform_matrix*", POSES),
    ignored("frames.rotation", "of NeRF's synthetic scenes"),
    ignored("frames.colmap_im_id", POSES),
    ignored("frames.sharpness", "how sharp a picture is"),
    ignored("frames.time*", "when a picture was taken"),
    ignored("frames", POSES),
    ignored("aabb_scale scale offset", "a setting of that program"),
    ignored("applied_* orientation_override", POSES),
    ignored("ply_file_path", "a file of points"),
    ignored("*_filenames", POSES),
];

/// Keys of a camera but those of its focal length and its distortion.
const CAMERA: [&str; 6] = ["camera_model", "is_fisheye", "w", "h", "cx", "cy"];
/// Keys of the focal length across and down: pixels, and the angle of view in radians and in degrees.
const FOCAL: [[&str; 3]; 2] = [["fl_x", "camera_angle_x", "x_fov"], ["fl_y", "camera_angle_y", "y_fov"]];
/// Keys of the distortion: frames have their own only where the root has none of them.
const DISTORTION: [&str; 7] = ["k1", "k2", "k3", "k4", "p1", "p2", "distortion_params"];

fn camera_keys() -> impl Iterator<Item = &'static str> {
    CAMERA.into_iter().chain(FOCAL.into_iter().flatten()).chain(DISTORTION)
}

fn frames(root: &Value) -> &[Value] {
    list(root, "frames")
}

/// Whether the root has a key, so that those of frames do not count.
fn is_of_root(root: &Value, key: &str) -> bool {
    let has = |key: &str| find(root, key).is_some();
    if DISTORTION.contains(&key) { DISTORTION.iter().any(|other| has(other)) } else { has(key) }
}

/// A value in which 500 is 500.0.
fn plain(value: &Value) -> Value {
    as_number(value).map_or_else(|| value.clone(), Value::from)
}

/// The camera of a frame, or that of the root if both are the root.
fn camera_of(root: &Value, frame: &Value) -> Map<String, Value> {
    let value_of = |key: &'static str| {
        let from = if is_of_root(root, key) { root } else { frame };
        find(from, key).map(|value| (key.to_owned(), plain(value)))
    };
    camera_keys().filter_map(value_of).collect()
}

fn matches(document: &Document) -> bool {
    let root = &document.value;
    let has_focal = |value: &Value| FOCAL.iter().flatten().any(|key| find(value, key).is_some());
    let is_complete = has_focal(root) && find(root, "w").is_some();
    let has_frames = !frames(root).is_empty();
    is_complete || has_frames && (has_focal(root) || frames(root).iter().any(has_focal))
}

fn complete(document: &mut Document, size_px: [u32; 2]) {
    let root = &document.value;
    if std::iter::once(root).chain(frames(root)).all(|value| find(value, "w").is_none()) {
        add_size(&mut document.value, ["w", "h"], size_px);
    }
}

fn entries(document: &Document) -> Result<Vec<CameraEntry<'_>>, KeyProblem> {
    let root = &document.value;
    check_frames(root)?;
    let mut known = HashSet::new();
    let is_own =
        |frame: &Value| camera_keys().any(|key| !is_of_root(root, key) && find(frame, key).is_some());
    let mut cameras: Vec<(usize, &Value)> = frames(root).iter().enumerate().collect();
    if !cameras.iter().any(|(_, frame)| is_own(frame)) {
        return single(document);
    }
    cameras.retain(|(_, frame)| known.insert(Value::Object(camera_of(root, frame)).to_string()));
    let file_of = |(index, frame): &(usize, &Value)| {
        word(frame, "file_path").map_or_else(|| format!("frames[{index}]"), str::to_owned)
    };
    let files: Vec<String> = cameras.iter().map(file_of).collect();
    let named = cameras.iter().zip(&files).map(|((index, frame), file)| {
        let is_only =
            |folder: &&str| files.iter().filter(|file| folder_of(file) == Some(*folder)).count() == 1;
        CameraEntry {
            name: folder_of(file).filter(is_only).unwrap_or(file).to_owned(),
            aliases: vec![file.clone()],
            value: frame,
            roots: vec![format!("frames[{index}]")],
        }
    });
    Ok(named.collect())
}

/// Name of the folder that a picture is in.
fn folder_of(file: &str) -> Option<&str> {
    file.rsplit(['/', '\\']).nth(1)
}

fn import(document: &Document, entry: &CameraEntry<'_>) -> Result<ReadCamera, KeyProblem> {
    let root = &document.value;
    let value = &Value::Object(camera_of(root, entry.value));
    let kind = kind(value)?;
    let lens = NamedLens::named(LENSES, kind).ok_or_else(|| {
        let text =
            format!("is `{kind}`: OPENCV, OPENCV_FISHEYE, PINHOLE and EQUIRECTANGULAR can be imported");
        KeyProblem::new("camera_model", text)
    })?;
    let mut notes = Vec::new();
    let coefficients = coefficients(value, kind, &lens.coefficients())?;
    let [width, height] = [sized(value, "w")?, sized(value, "h")?];
    let size_px = size("w", [width, height])?;
    let focal_px = match lens.model {
        // A turn is twice fl_x there, half a turn fl_y.
        LensModel::Equirectangular => {
            let angles = FOCAL.iter().flat_map(|keys| &keys[1..]).filter(|key| find(value, key).is_some());
            notes.extend(
                angles.map(|key| format!("not applied: {key}, as EQUIRECTANGULAR has fl_x and fl_y")),
            );
            let or = |key: &str, default: f64| {
                optional_number(value, key).map(|focal| focal.unwrap_or(default) / PI)
            };
            [or("fl_x", 0.5 * width)?, or("fl_y", height)?]
        }
        _ => focal_px(value, [width, height], &mut notes)?,
    };
    let centre = |key: &str, side: f64| optional_number(value, key).map(|c| c.unwrap_or(0.5 * side) - 0.5);
    let point = [centre("cx", width)?, centre("cy", height)?];
    if find(value, "cx").is_none() || find(value, "cy").is_none() {
        notes.push("cx or cy is missing: it is the centre of the picture".to_owned());
    }
    let mut imported = camera(size_px, focal_px, point, lens.model, coefficients);
    notes.push(
        "the principal point was shifted by half a pixel: nerfstudio's code has image corners at integers, whatever \
         its documentation says"
            .to_owned(),
    );
    imported.notes = notes;
    Ok(imported)
}

/// The camera model by both keys that name it.
fn kind(value: &Value) -> Result<&str, KeyProblem> {
    match (word(value, "camera_model"), flag(value, "is_fisheye")?) {
        (None, Some(true)) => Ok(OPENCV_FISHEYE),
        (Some(kind), Some(is_fisheye)) if is_fisheye != (kind == OPENCV_FISHEYE) => {
            let text = format!("is {is_fisheye}, but camera_model is {kind}: delete the wrong one");
            Err(KeyProblem::new("is_fisheye", text))
        }
        (kind, _) => Ok(kind.unwrap_or("OPENCV")),
    }
}

/// Coefficients of a model by their names; others must be zero.
fn coefficients(value: &Value, kind: &str, names: &[&str]) -> Result<Vec<f64>, KeyProblem> {
    let all = ["k1", "k2", "k3", "k4", "p1", "p2"];
    let mut given = [0.0; 6];
    for (number, key) in given.iter_mut().zip(all) {
        *number = optional_number(value, key)?.unwrap_or(0.0);
    }
    let list = "distortion_params";
    if find(value, list).is_some() {
        if let Some(key) = all.iter().find(|key| find(value, key).is_some()) {
            return Err(KeyProblem::new(list, format!("and {key} are both given: delete one of the two")));
        }
        given = numbers_n(value, list)?;
    }
    let of = |key: &&str| all.iter().position(|known| known == key).map_or(0.0, |index| given[index]);
    if let Some(key) = all.iter().find(|key| !names.contains(key) && of(key) != 0.0) {
        let has = if names.is_empty() {
            "no coefficients".to_owned()
        } else {
            format!("{} only", names.join(", "))
        };
        let other = if kind == OPENCV_FISHEYE {
            "a lens with p1 and p2 is camera_model OPENCV"
        } else if *key == "k4" {
            "a fisheye with k1 to k4 is camera_model OPENCV_FISHEYE"
        } else {
            "a lens with coefficients is camera_model OPENCV, or OPENCV_FISHEYE"
        };
        return Err(KeyProblem::new(*key, format!("is not zero, but {kind} has {has}: {other}")));
    }
    Ok(names.iter().map(of).collect())
}

fn sized(value: &Value, key: &str) -> Result<f64, KeyProblem> {
    match find(value, key) {
        Some(_) => number(value, key),
        None => Err(KeyProblem::new(key, "is missing: add w and h of the pictures, or give --size")),
    }
}

/// Focal lengths, from the angles of view if there are none; of an axis without either, that of the other.
fn focal_px(value: &Value, size: [f64; 2], notes: &mut Vec<String>) -> Result<[f64; 2], KeyProblem> {
    let across = axis_focal_px(value, FOCAL[0], size[0], notes)?;
    let down = axis_focal_px(value, FOCAL[1], size[1], notes)?;
    match (across, down) {
        (Some(fx), fy) => Ok([fx, fy.unwrap_or(fx)]),
        (None, Some(fy)) => {
            notes.push(format!("fl_x is missing: it is the focal length down, {fy:.3} px"));
            Ok([fy; 2])
        }
        (None, None) => Err(KeyProblem::new("fl_x", "is missing")),
    }
}

/// Focal length by the first of the keys that is there; others that say another one are named.
fn axis_focal_px(
    value: &Value,
    keys: [&'static str; 3],
    side: f64,
    notes: &mut Vec<String>,
) -> Result<Option<f64>, KeyProblem> {
    let units = [None, Some(1.0), Some(1_f64.to_radians())];
    let mut used: Option<(&str, f64)> = None;
    for (key, unit) in keys.into_iter().zip(units) {
        let Some(given) = optional_number(value, key)? else { continue };
        let px = unit.map_or(given, |unit| 0.5 * side / (0.5 * given * unit).tan());
        let is_angle = unit.is_none_or(|unit| given > 0.0 && given * unit < PI);
        match used {
            None if !is_angle => {
                let half_turn = PI / unit.unwrap_or(1.0);
                let text = format!("is {given}, and an angle of view lies between 0 and {half_turn:.4}");
                return Err(KeyProblem::new(key, text));
            }
            None => used = Some((key, px)),
            Some((first, of_first)) if !is_angle || (of_first / px - 1.0).abs() > 0.01 => {
                notes.push(format!(
                    "not applied: {key}, which says a focal length of {px:.1} px: {first} says {of_first:.1}"
                ));
            }
            Some(_) => {}
        }
    }
    if let Some((key, px)) = used.filter(|(key, _)| *key != keys[0]) {
        notes.push(format!("{} is missing: {px:.3} px is from {key}", keys[0]));
    }
    Ok(used.map(|(_, px)| px))
}

/// Refuses frames that state another value than the root: the programs differ in which counts.
fn check_frames(root: &Value) -> Result<(), KeyProblem> {
    let differs = |frame: &Value, key: &str| {
        is_of_root(root, key)
            && find(frame, key).map(plain).is_some_and(|own| find(root, key).map(plain) != Some(own))
    };
    for (index, frame) in frames(root).iter().enumerate() {
        let keys: Vec<String> = camera_keys()
            .filter(|key| differs(frame, key))
            .map(|key| format!("frames[{index}].{key}"))
            .collect();
        if !keys.is_empty() {
            return Err(KeyProblem::new(
                keys.join(", "),
                "differ from the root, whose values count in nerfstudio, while the picture's count in instant-ngp: \
                 delete those of the frames or, if each picture has a camera of its own, those of the root",
            ));
        }
    }
    Ok(())
}
