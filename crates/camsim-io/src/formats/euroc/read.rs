//! EuRoC's `sensor.yaml`, which describes one camera with Kalibr's keys.

use crate::formats::kalibr::read::{OFFSET, POSE, import};
use crate::formats::reading::format::Reader;
use crate::formats::reading::key_table::{KeyRow, Neutral, Treatment, applied, ignored, reported};
use crate::text::document::{Document, find};

pub(crate) const READER: Reader = Reader {
    poses: |found, camera| {
        found.in_body(camera.value(), "", "T_BS", false)?;
        found.shift(camera.value(), "", "timeshift_cam_imu")
    },
    ..Reader::new("euroc", "EuRoC sensor.yaml", matches, &[("", KEYS)], |camera| import(camera.value()))
};

const KEYS: &[KeyRow] = &[
    applied("camera_model", "as in a Kalibr camchain"),
    applied("intrinsics", "fx fy cx cy"),
    applied("distortion_model", "radial-tangential, equidistant, none; others are refused"),
    applied("distortion_coefficients", "k1 k2 p1 p2 (radial-tangential) or k1 k2 k3 k4 (equidistant)"),
    applied("distortion_coeffs", "as above"),
    applied("resolution", "width, height"),
    KeyRow::new(Treatment::FrameRate, "rate_hz", "frames per second"),
    KeyRow::new(Treatment::LineDelay(1e3), "line_delay", "s per row; the readout is this times the rows"),
    reported(Neutral::Zero, "timeshift_cam_imu", OFFSET),
    reported(Neutral::Identity, "T_BS", POSE),
    reported(
        Neutral::Identity,
        "T_*",
        "a pose under another name: as T_BS, body from camera, `--body` or `--rig` applies it",
    ),
    ignored("sensor_type", "camera"),
    ignored("comment", "free text"),
];

fn matches(document: &Document) -> bool {
    ["intrinsics", "resolution", "distortion_model"].iter().all(|key| find(&document.value, key).is_some())
}
