//! Tables: rows of a frame, frames of a sequence, the platform's trajectory, the camera.

use std::fmt::Write as _;

use camsim_core::{frame::RowRecord, pose::BodyState, scenario::CameraSpec};
use glam::{DQuat, DVec3};

/// Header of `rows/*.csv`; q = ned_from_camera.
pub const ROWS_COLUMNS: &str = "row,t_mid_ns,n,e,d,qw,qx,qy,qz,vn,ve,vd";
/// Header of `trajectory.csv` and of `camsim track`; q = ned_from_body, body rates in rad/s, t_s on the log's clock.
pub const TRAJECTORY_COLUMNS: &str = "t_s,n_m,e_m,d_m,vn,ve,vd,an,ae,ad,qw,qx,qy,qz,wx,wy,wz,alphax,alphay,alphaz";
/// Header of `frames.csv`, before one column of file names for each file of a frame; the pose is the camera's at the stamp, q = ned_from_camera.
pub const FRAMES_COLUMNS: &str = "frame,stamp_ns,n,e,d,qw,qx,qy,qz";

/// One line of `trajectory.csv`.
#[derive(Clone, Copy, Debug)]
pub struct TrajectoryRecord {
    /// Nanoseconds on the log's clock.
    pub t_ns: i64,
    /// Motion of the platform.
    pub state: BodyState,
}

/// One line of `frames.csv`.
#[derive(Clone, Debug)]
pub struct FrameRecord {
    /// Frame number.
    pub frame: u64,
    /// Stamp, nanoseconds on the log's clock.
    pub stamp_ns: i64,
    /// Optical centre in NED at the stamp.
    pub position_ned_m: DVec3,
    /// Takes optical camera coordinates to NED, at the stamp.
    pub ned_from_camera: DQuat,
    /// Column name and path below the output folder, the same columns in every record.
    pub files: Vec<(String, String)>,
}

/// Numbers in the shortest form that reads back to the same bits.
fn push(line: &mut String, values: &[f64]) {
    for value in values {
        // Writing to a String cannot fail.
        let _ = write!(line, ",{value}");
    }
}

fn wxyz(q: DQuat) -> [f64; 4] {
    [q.w, q.x, q.y, q.z]
}

/// Decimal seconds of integer nanoseconds, without rounding.
fn seconds(t_ns: i64) -> String {
    let (whole, rest) = (t_ns.unsigned_abs() / 1_000_000_000, t_ns.unsigned_abs() % 1_000_000_000);
    format!("{}{whole}.{rest:09}", if t_ns < 0 { "-" } else { "" })
}

/// `rows/*.csv` of one frame.
pub fn rows_csv(rows: &[RowRecord]) -> String {
    let mut text = format!("{ROWS_COLUMNS}\n");
    for row in rows {
        let _ = write!(text, "{},{}", row.row, row.t_mid_ns);
        push(&mut text, &row.position_ned_m.to_array());
        push(&mut text, &wxyz(row.ned_from_camera));
        push(&mut text, &row.velocity_ned_m_s.to_array());
        text.push('\n');
    }
    text
}

/// `trajectory.csv`.
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

/// `frames.csv`; the file columns are those of the first record.
pub fn frames_csv(records: &[FrameRecord]) -> String {
    let mut text = FRAMES_COLUMNS.to_owned();
    for (column, _) in records.first().map_or(&[][..], |record| &record.files) {
        let _ = write!(text, ",{column}");
    }
    text.push('\n');
    for record in records {
        let _ = write!(text, "{},{}", record.frame, record.stamp_ns);
        push(&mut text, &record.position_ned_m.to_array());
        push(&mut text, &wxyz(record.ned_from_camera));
        for (_, file) in &record.files {
            let _ = write!(text, ",{file}");
        }
        text.push('\n');
    }
    text
}

/// `camera.toml`: a camera file that reads back to `camera`.
///
/// # Errors
/// A value that TOML cannot hold (a path that is not Unicode).
pub fn camera_toml(camera: &CameraSpec) -> Result<String, toml::ser::Error> {
    Ok(format!("# The camera of this run: `camera = \"camera.toml\"` in a scenario uses it.\n{}", toml::to_string(camera)?))
}
