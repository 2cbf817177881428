//! `rig.toml`: the cameras of a rig in plain numbers.

use std::path::Path;

use camsim_core::{
    mount::body_from_camera,
    scenario::{CameraSpec, LensSpec, Rig},
};
use glam::DMat3;
use serde::Serialize;

use super::{WriteError, write_atomic};

/// Name of the table in the folder of a rig.
pub const RIG_TOML: &str = "rig.toml";

/// Conventions at the head of `rig.toml`.
const HEAD: &str = "\
# The cameras of a rig; each has a folder of its name with a camera.toml.
# T_body_camera takes points in the camera to points on the body, in metres, without vibration: x_body = T x_camera.
# Body: x forward, y right, z down. Camera: x right and y down in the picture, z along the optical axis.
# Frame i is stamped at (i + phase) / fps after the window's begin, plus clock_offset_ms; its image centre is exposed
# delay_ms before its stamp.
";

#[derive(Serialize)]
struct RigTable<'a> {
    cameras: Vec<Entry<'a>>,
}

#[derive(Serialize)]
#[allow(non_snake_case, reason = "the name of the matrix in Kalibr and EuRoC")]
struct Entry<'a> {
    name: &'a str,
    folder: &'a str,
    T_body_camera: [[f64; 4]; 4],
    size_px: [u32; 2],
    focal_px: [f64; 2],
    principal_point_px: [f64; 2],
    fps: f64,
    phase: f64,
    delay_ms: f64,
    readout_ms: f64,
    exposure_ms: f64,
    clock_offset_ms: f64,
    lens: &'a LensSpec,
}

impl<'a> Entry<'a> {
    fn new(camera: &'a CameraSpec) -> Self {
        let centre_px = camera.size_px.map(|side| (f64::from(side) - 1.0) / 2.0);
        let shutter = &camera.shutter;
        Self {
            name: &camera.name,
            folder: &camera.name,
            T_body_camera: body_from_camera_matrix(camera),
            size_px: camera.size_px,
            focal_px: camera.focal_px,
            principal_point_px: camera.principal_point_px.unwrap_or(centre_px),
            fps: camera.fps,
            phase: camera.phase,
            delay_ms: shutter.delay_ms,
            readout_ms: camera.readout_ms(),
            exposure_ms: shutter.exposure_ms,
            clock_offset_ms: camera.clock_offset_ms,
            lens: &camera.lens,
        }
    }
}

/// Rows of the rigid motion from optical axes to the body.
fn body_from_camera_matrix(camera: &CameraSpec) -> [[f64; 4]; 4] {
    let turn = DMat3::from_quat(body_from_camera(camera.mount.angles_deg));
    let row = |i: usize| {
        let [x, y, z] = turn.row(i).to_array();
        [x, y, z, camera.mount.offset_m[i]]
    };
    [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
}

/// Text of `rig.toml`.
///
/// # Errors
/// Values that TOML cannot store.
pub fn rig_toml(rig: &Rig) -> Result<String, toml::ser::Error> {
    let cameras = rig.scenarios().iter().map(|scenario| Entry::new(&scenario.camera)).collect();
    Ok(format!("{HEAD}{}", toml::to_string(&RigTable { cameras })?))
}

/// Writes `rig.toml` into the folder of a rig.
///
/// # Errors
/// As [`write_atomic`].
pub fn write_rig(folder: &Path, rig: &Rig) -> Result<(), WriteError> {
    let path = folder.join(RIG_TOML);
    let text = rig_toml(rig)
        .map_err(|error| WriteError::Encode { path: path.clone(), message: error.to_string() })?;
    write_atomic(&path, text.as_bytes())
}

/// Names of the cameras in the `rig.toml` of a folder; empty without one that can be read.
#[must_use]
pub fn rig_names(folder: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(folder.join(RIG_TOML)).unwrap_or_default();
    let root: toml::Table = text.parse().unwrap_or_default();
    let cameras = root.get("cameras").and_then(toml::Value::as_array).map_or(&[][..], Vec::as_slice);
    cameras.iter().filter_map(|camera| Some(camera.get("name")?.as_str()?.to_owned())).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;
    use crate::scenario_file::parse_rig;

    #[test]
    fn matrices_take_points_from_cameras_to_the_body() {
        let text = "[flight]\nlog = \"a.csv\"\n[scene.pattern]\nimage = \"g.png\"\nwidth_m = 10\n\
            [[cameras]]\nname = \"down\"\nclock_offset_ms = -2.5\n\
            mount = { angles_deg = [0, -90, 0], offset_m = [1.0, 2.0, 3.0] }\n\
            [[cameras]]\nname = \"ahead\"\nsize_px = [100, 50]\nmount = { angles_deg = [0, 0, 90] }\n";
        let rig = parse_rig(text, Path::new("s.toml"), &[]).unwrap();
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(rig_names(folder.path()), [""; 0]);
        write_rig(folder.path(), &rig).unwrap();
        assert_eq!(rig_names(folder.path()), ["down", "ahead"]);
        let root: toml::Table =
            std::fs::read_to_string(folder.path().join(RIG_TOML)).unwrap().parse().unwrap();
        let entry = |i: usize| root["cameras"].as_array().unwrap()[i].clone();
        let times = |camera: &toml::Value, point: [f64; 4]| -> Vec<f64> {
            let rows = camera["T_body_camera"].as_array().unwrap().clone();
            let dot = |row: &toml::Value| -> f64 {
                let row = row.as_array().unwrap().iter().map(|v| v.as_float().unwrap());
                row.zip(point).map(|(a, b)| a * b).sum()
            };
            rows.iter().map(|row| (dot(row) * 1e9).round() / 1e9 + 0.0).collect()
        };
        // Straight down with the top of the picture to the nose: right is right, the picture's down is aft.
        let down = entry(0);
        assert_eq!(times(&down, [5.0, 0.0, 0.0, 1.0]), [1.0, 7.0, 3.0, 1.0]);
        assert_eq!(times(&down, [0.0, 5.0, 0.0, 1.0]), [-4.0, 2.0, 3.0, 1.0]);
        assert_eq!(times(&down, [0.0, 0.0, 5.0, 1.0]), [1.0, 2.0, 8.0, 1.0]);
        assert_eq!(down["clock_offset_ms"].as_float(), Some(-2.5));
        // Turned to the right wing: the optical axis is the body's y, the picture's right is aft.
        let ahead = entry(1);
        assert_eq!(times(&ahead, [0.0, 0.0, 5.0, 1.0]), [0.0, 5.0, 0.0, 1.0]);
        assert_eq!(times(&ahead, [5.0, 0.0, 0.0, 1.0]), [-5.0, 0.0, 0.0, 1.0]);
        assert_eq!(ahead["principal_point_px"].as_array().unwrap()[0].as_float(), Some(49.5));
    }
}
