//! Poses of the readout's rows relative to the key frames.

use camsim_core::{mount::CameraPath, shutter::RowAxis};
use camsim_plan::{FramePlan, RowPoses, RowTimes, TemporalStage, row_poses, row_times, table_shape};
use glam::{DMat3, DVec3};

/// Table of all rows for the temporal inverse: relative poses, or times for the constant-twist solvers.
#[derive(Clone, Debug, PartialEq)]
pub enum RowTable {
    /// Poses relative to the key frames.
    Poses(RowPoses),
    /// Times after the key instant.
    Times(RowTimes),
}

impl RowTable {
    /// The table that the plan's solver reads.
    #[must_use]
    pub fn new(plan: &FramePlan, path: &CameraPath) -> Self {
        match plan.temporal {
            TemporalStage::Linear | TemporalStage::Rk2 => Self::Times(row_times(plan)),
            TemporalStage::Identity | TemporalStage::Rotation | TemporalStage::Reproject { .. } => {
                Self::Poses(row_poses(plan, path))
            }
        }
    }

    /// The table as the shaders read it.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        match self {
            Self::Poses(poses) => bytemuck::cast_slice(&poses.entries),
            Self::Times(times) => bytemuck::cast_slice(&times.dt_s),
        }
    }
}

/// Pose of a row's camera at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pose {
    /// `x_key = rotation x_row + shift_m`.
    pub rotation: DMat3,
    pub shift_m: DVec3,
    /// Time after the key instant, for the constant-twist solvers.
    pub dt_s: f64,
}

impl Pose {
    pub const IDENTITY: Self = Self { rotation: DMat3::IDENTITY, shift_m: DVec3::ZERO, dt_s: 0.0 };

    fn from_entry(entry: &[[f32; 4]; 3]) -> Self {
        let [x, y, z] = entry.map(|row| DVec3::new(row[0].into(), row[1].into(), row[2].into()));
        let shift_m = DVec3::new(entry[0][3].into(), entry[1][3].into(), entry[2][3].into());
        Self { rotation: DMat3::from_cols(x, y, z).transpose(), shift_m, dt_s: 0.0 }
    }

    fn mix(&self, other: &Self, t: f64) -> Self {
        Self {
            rotation: self.rotation * (1.0 - t) + other.rotation * t,
            shift_m: self.shift_m.lerp(other.shift_m, t),
            dt_s: self.dt_s + t * (other.dt_s - self.dt_s),
        }
    }
}

/// Poses over the exposure of one row relative to one key frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exposure<'a> {
    /// Poses at equidistant times from begin to end of the exposure; a single one without blur.
    pub nodes: &'a [Pose],
    pub mid: Pose,
}

impl Exposure<'_> {
    /// Pose at a fraction of the exposure, linear between nodes.
    pub fn pose(&self, fraction: f64) -> Pose {
        if fraction == 0.5 || self.nodes.len() < 2 {
            return self.mid;
        }
        let along = fraction * (self.nodes.len() - 1) as f64;
        let node = (along as usize).min(self.nodes.len() - 2);
        self.nodes[node].mix(&self.nodes[node + 1], along - node as f64)
    }
}

/// A [`RowTable`] in double precision. Order of the entries: `camsim_plan::RowPoses`.
#[derive(Debug)]
pub(super) struct Rows {
    poses: Vec<Pose>,
    /// Mid-exposure of every field and row, and its exposure time, as fractions of the window; empty with one key
    /// frame.
    fractions: Vec<[f64; 2]>,
    axis: RowAxis,
    /// Rows of a field.
    rows: usize,
    fields: usize,
    /// Table entries of a row.
    stride: usize,
    keys: usize,
}

impl Rows {
    /// # Panics
    /// If the table does not match the plan.
    pub fn new(plan: &FramePlan, table: &RowTable) -> Self {
        let (axis, rows, fields) = table_shape(&plan.shutter);
        let [rows, fields, keys] = [rows as usize, fields as usize, plan.keys.len()];
        let stride = plan.blur.map_or(1, |blur| if blur.nodes > 1 { blur.nodes as usize + 1 } else { 1 });
        let entries = keys * fields * rows * stride;
        let mut fractions = Vec::new();
        let poses = match table {
            _ if plan.temporal == TemporalStage::Identity => vec![Pose::IDENTITY; entries],
            RowTable::Poses(table) => {
                let has_references = keys > 1 || plan.has_displaced_key();
                let all = entries + if has_references { keys } else { 0 };
                if keys > 1 {
                    let of_row = |entry: &[[f32; 4]; 3]| [entry[0][0], entry[0][1]].map(f64::from);
                    fractions.extend(table.entries[all..].iter().map(of_row));
                }
                table.entries[..all].iter().map(Pose::from_entry).collect()
            }
            RowTable::Times(table) => {
                let pose = |&dt_s: &f32| Pose { dt_s: dt_s.into(), ..Pose::IDENTITY };
                table.dt_s.iter().map(pose).collect()
            }
        };
        assert!(poses.len() >= entries, "a table of {} entries for {entries}", poses.len());
        Self { poses, fractions, axis, rows, fields, stride, keys }
    }

    /// Index of a pixel's row; the rows of the second field follow those of the first.
    fn row(&self, [x, y]: [u32; 2]) -> usize {
        let row = if self.axis == RowAxis::Columns { x } else { y };
        let field = if self.fields == 2 { y & 1 } else { 0 };
        field as usize * self.rows + row as usize
    }

    /// Poses of a pixel's row relative to a key frame.
    pub fn exposure(&self, key: usize, pixel: [u32; 2]) -> Exposure<'_> {
        let first = (key * self.fields * self.rows + self.row(pixel)) * self.stride;
        let entries = &self.poses[first..first + self.stride];
        Exposure { nodes: &entries[..(self.stride - 1).max(1)], mid: entries[self.stride - 1] }
    }

    /// Pose of a key camera relative to the mid-window camera, if the table has it.
    pub fn reference(&self, key: usize) -> Option<Pose> {
        self.poses.get(self.keys * self.fields * self.rows * self.stride + key).copied()
    }

    /// Mid-exposure of a pixel's row, and its exposure time, as fractions of the window.
    pub fn fractions(&self, pixel: [u32; 2]) -> [f64; 2] {
        self.fractions.get(self.row(pixel)).copied().unwrap_or([0.5, 1.0])
    }
}
