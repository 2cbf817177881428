//! Pose and time of every row, relative to the key frame, in f64 and then f32.

use camsim_core::{
    frame::RowRecord,
    mount::CameraPath,
    pose::CameraPose,
    shutter::{RowAxis, Shutter},
};
use glam::{DMat3, DVec3};

use super::frame_plan::FramePlan;

/// Relative poses `x_key = R x_row + t` of a frame: `[key][field][row][node]`, each three rows of `(R, t)`;
/// with more than one node the mid-exposure pose follows the nodes. Of frames whose ideal frames are not the
/// mid-window camera's the poses `x_mid = R x_key + t` of the keys in that camera follow, and of frames with
/// several keys then an entry for each field and row with the row's mid-exposure and exposure time as fractions of
/// the window in its first two numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct RowPoses {
    /// Rows of `(R | t)`.
    pub entries: Vec<[[f32; 4]; 3]>,
    /// Entries a row.
    pub stride: u32,
}

/// Times of a frame's rows after its key instant, seconds, ordered as the poses of [`RowPoses`].
#[derive(Clone, Debug, PartialEq)]
pub struct RowTimes {
    /// Seconds.
    pub dt_s: Vec<f32>,
    /// Entries a row.
    pub stride: u32,
}

/// The pose table of a frame.
#[must_use]
pub fn row_poses(plan: &FramePlan, path: &CameraPath) -> RowPoses {
    let relative = |pose: &CameraPose, to: &CameraPose| {
        let (rotation, shift) = pose.relative_to(to);
        matrix_rows(rotation, shift)
    };
    let mut entries = Vec::new();
    let mut stride = 1;
    for key in &plan.keys {
        let (key_entries, stride_of_key) = entries_of(plan, |t_s| relative(&path.pose(t_s), &key.pose));
        entries.extend(key_entries);
        stride = stride_of_key;
    }
    if plan.keys.len() > 1 || plan.has_displaced_key() {
        entries.extend(plan.keys.iter().map(|key| relative(&key.pose, &plan.key_pose)));
    }
    if plan.keys.len() > 1 {
        entries.extend(rows_of(plan).map(|(field, row)| {
            let fraction = plan.window_fraction(plan.stamp_s + row_dt_s(plan, field, row));
            [[fraction as f32, exposure_fraction(plan, row) as f32, 0.0, 0.0], [0.0; 4], [0.0; 4]]
        }));
    }
    RowPoses { entries, stride }
}

/// Exposure of a row as a fraction of the window.
fn exposure_fraction(plan: &FramePlan, row: u32) -> f64 {
    plan.shutter.exposure_row_s(row) / (plan.window_s[1] - plan.window_s[0]).max(f64::MIN_POSITIVE)
}

/// The time table of a frame, for the solvers that take the motion as constant. Differences are taken in f64.
#[must_use]
pub fn row_times(plan: &FramePlan) -> RowTimes {
    let (dt_s, stride) = entries_of(plan, |t_s| (t_s - plan.key_s) as f32);
    RowTimes { dt_s, stride }
}

/// Fields and their rows, in the order of the tables.
fn rows_of(plan: &FramePlan) -> impl Iterator<Item = (u32, u32)> {
    let (_, rows, fields) = table_shape(&plan.shutter);
    (0..fields).flat_map(move |field| (0..rows).map(move |row| (field, row)))
}

/// An entry for every `[field][row][node]` and the entries a row.
fn entries_of<T>(plan: &FramePlan, entry: impl Fn(f64) -> T) -> (Vec<T>, u32) {
    let (_, rows, fields) = table_shape(&plan.shutter);
    let nodes = plan.blur.map_or(1, |blur| blur.nodes);
    let stride = if nodes == 1 { 1 } else { nodes + 1 };
    let mut entries = Vec::with_capacity((fields * rows * stride) as usize);
    for (field, row) in rows_of(plan) {
        let mid_s = plan.stamp_s + row_dt_s(plan, field, row);
        if nodes > 1 {
            entries.extend((0..nodes).map(|node| {
                let along = f64::from(node) / f64::from(nodes - 1) - 0.5;
                entry(mid_s + plan.shutter.exposure_row_s(row) * along)
            }));
        }
        entries.push(entry(mid_s));
    }
    (entries, stride)
}

/// Time shift of a row of a field: with sideways readout the fields are the even and the odd rows.
fn row_dt_s(plan: &FramePlan, field: u32, row: u32) -> f64 {
    match plan.shutter.row_axis() {
        RowAxis::Rows => plan.shutter.dt_row_s(row),
        RowAxis::Columns => plan.shutter.dt_pixel_s(row, field),
    }
}

fn matrix_rows(rotation: DMat3, shift: DVec3) -> [[f32; 4]; 3] {
    std::array::from_fn(|i| {
        let row = rotation.row(i);
        [row.x as f32, row.y as f32, row.z as f32, shift[i] as f32]
    })
}

/// Time, pose and velocity of every row at its mid-exposure. With sideways readout and interlacing the
/// records are those of the field that keeps the exact time.
#[must_use]
pub fn row_records(plan: &FramePlan, path: &CameraPath, epoch_ns: i64) -> Vec<RowRecord> {
    (0..plan.shutter.lines())
        .map(|row| {
            let t_s = plan.stamp_s + plan.shutter.dt_row_s(row);
            let pose = path.pose(t_s);
            RowRecord {
                row,
                t_mid_ns: epoch_ns.saturating_add((t_s * 1e9).round() as i64),
                position_ned_m: pose.position_ned_m,
                ned_from_camera: pose.ned_from_camera,
                velocity_ned_m_s: path.velocity_ned(t_s),
                exposure_ns: (plan.shutter.exposure_row_s(row) * 1e9).round() as i64,
            }
        })
        .collect()
}

/// Row axis and the number of pose-table fields (2 where sideways readout meets interlacing).
#[must_use]
pub fn table_shape(shutter: &Shutter) -> (RowAxis, u32, u32) {
    let axis = shutter.row_axis();
    let fields = if axis == RowAxis::Columns && shutter.interlace_s() > 0.0 { 2 } else { 1 };
    (axis, shutter.lines(), fields)
}
