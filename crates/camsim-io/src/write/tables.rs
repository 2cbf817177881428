//! Tables: rows of a frame, trajectories of platform and camera.

use std::fmt::Write as _;

use camsim_core::{
    frame::RowRecord,
    pose::{BodyState, CameraPose},
    scene::SceneObject,
};
use glam::{DQuat, DVec3};

use super::Number;

/// Columns of `rows/*.csv`; q is ned_from_camera. Where the exposures of the rows differ, `exposure_ns` follows.
pub const ROWS_COLUMNS: &str = "row,t_mid_ns,n,e,d,qw,qx,qy,qz,vn,ve,vd";
/// Columns of `trajectory.csv` and of `camsim track`; q is ned_from_body, body rates are in rad/s, t_s is on
/// the log's clock.
pub const TRAJECTORY_COLUMNS: &str =
    "t_s,n_m,e_m,d_m,vn,ve,vd,an,ae,ad,qw,qx,qy,qz,wx,wy,wz,alphax,alphay,alphaz";
/// Columns of `camera_trajectory.csv` and of `camsim track --of camera`: motion of the camera, with lever
/// arm, mount and vibration; q is ned_from_camera, rates are in camera axes, rad/s.
pub const CAMERA_TRAJECTORY_COLUMNS: &str = "t_s,n_m,e_m,d_m,vn,ve,vd,qw,qx,qy,qz,wx,wy,wz";

/// One line of `trajectory.csv`.
#[derive(Clone, Copy, Debug)]
pub struct TrajectoryRecord {
    /// Nanoseconds on the clock of stamps.
    pub t_ns: i64,
    /// Motion of the platform.
    pub state: BodyState,
}

/// One line of `camera_trajectory.csv`.
#[derive(Clone, Copy, Debug)]
pub struct CameraRecord {
    /// Nanoseconds on the clock of stamps.
    pub t_ns: i64,
    /// Optical centre and attitude.
    pub pose: CameraPose,
    /// Velocity of the optical centre, m/s.
    pub velocity_ned_m_s: DVec3,
    /// Angular rate relative to NED, in camera axes, rad/s.
    pub rate_camera_rad_s: DVec3,
}

/// Appends numbers, each with a comma before it.
pub(super) fn push(line: &mut String, values: &[f64]) {
    for value in values {
        line.push(',');
        line.push_str(Number(*value).digits(&mut zmij::Buffer::new()));
    }
}

/// Components of a quaternion, scalar first.
pub(super) fn wxyz(q: DQuat) -> [f64; 4] {
    [q.w, q.x, q.y, q.z]
}

/// Nanoseconds as decimal seconds, exactly.
fn seconds(t_ns: i64) -> String {
    let (whole, rest) = (t_ns.unsigned_abs() / 1_000_000_000, t_ns.unsigned_abs() % 1_000_000_000);
    format!("{}{whole}.{rest:09}", if t_ns < 0 { "-" } else { "" })
}

/// Text of `rows/*.csv` of one frame.
pub fn rows_csv(rows: &[RowRecord]) -> String {
    let differ = rows.windows(2).any(|pair| pair[0].exposure_ns != pair[1].exposure_ns);
    let mut text = format!("{ROWS_COLUMNS}{}\n", if differ { ",exposure_ns" } else { "" });
    for row in rows {
        let _ = write!(text, "{},{}", row.row, row.t_mid_ns);
        push(&mut text, &row.position_ned_m.to_array());
        push(&mut text, &wxyz(row.ned_from_camera));
        push(&mut text, &row.velocity_ned_m_s.to_array());
        if differ {
            let _ = write!(text, ",{}", row.exposure_ns);
        }
        text.push('\n');
    }
    text
}

/// Columns of `objects.csv`.
pub const OBJECTS_COLUMNS: &str = "number,name,class";

/// Text of `objects.csv`: number (from 1), name and class of each object. Names with commas, quotes or line
/// breaks are quoted, as RFC 4180 has it.
pub fn objects_csv(objects: &[SceneObject]) -> String {
    let mut text = format!("{OBJECTS_COLUMNS}\n");
    for (number, SceneObject { name, class }) in (1..).zip(objects) {
        let number: u32 = number;
        let name = match name.contains([',', '"', '\n', '\r']) {
            true => format!("\"{}\"", name.replace('"', "\"\"")),
            false => name.clone(),
        };
        let _ = writeln!(text, "{number},{name},{class}");
    }
    text
}

/// Text of `trajectory.csv`.
pub fn trajectory_csv(records: impl IntoIterator<Item = TrajectoryRecord>) -> String {
    let mut text = format!("{TRAJECTORY_COLUMNS}\n");
    for TrajectoryRecord { t_ns, state } in records {
        text.push_str(&seconds(t_ns));
        for vector in [state.position_ned_m, state.velocity_ned_m_s, state.acceleration_ned_m_s2] {
            push(&mut text, &vector.to_array());
        }
        push(&mut text, &wxyz(state.ned_from_body));
        push(&mut text, &state.rate_body_rad_s.to_array());
        push(&mut text, &state.angular_acceleration_body_rad_s2.to_array());
        text.push('\n');
    }
    text
}

/// Text of `camera_trajectory.csv`.
pub fn camera_trajectory_csv(records: impl IntoIterator<Item = CameraRecord>) -> String {
    let mut text = format!("{CAMERA_TRAJECTORY_COLUMNS}\n");
    for CameraRecord { t_ns, pose, velocity_ned_m_s, rate_camera_rad_s } in records {
        text.push_str(&seconds(t_ns));
        push(&mut text, &pose.position_ned_m.to_array());
        push(&mut text, &velocity_ned_m_s.to_array());
        push(&mut text, &wxyz(pose.ned_from_camera));
        push(&mut text, &rate_camera_rad_s.to_array());
        text.push('\n');
    }
    text
}
