//! Rows that are read one after the other, and how far the camera moves from one to the next.

use glam::DVec3;

use crate::{mount::CameraPath, pose::CameraPose};

/// Rows that are read one after the other: all of a frame, or those of one of its fields; columns with a
/// sideways readout. In a readout in halves the rows are those of both.
#[derive(Debug)]
pub(super) struct Field {
    /// Pixel coordinate of the first row and distance to the next.
    pub first_px: f64,
    pub step_px: f64,
    /// Parity of the image rows that belong to the field, where there are two fields.
    pub parity: Option<u32>,
    /// Mid-exposure of each row, path time, seconds.
    pub times_s: Vec<f64>,
    pub poses: Vec<CameraPose>,
    /// The camera half a row before the first and behind the last row.
    beyond: [CameraPose; 2],
    travel: Travel,
}

/// How far the camera turns and moves: what bounds the movement of its picture.
#[derive(Debug, Default)]
struct Travel {
    /// From the first node to each, radians and metres.
    turned: Vec<f64>,
    moved_m: Vec<f64>,
    /// Most in one row.
    most: Motion,
    /// Change from row to row near each interval between two nodes.
    changes: Vec<Motion>,
}

/// Radians by which a camera turns, and metres by which it moves.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Motion {
    pub turn: f64,
    pub shift_m: f64,
}

impl Motion {
    fn max(self, other: Self) -> Self {
        Self { turn: self.turn.max(other.turn), shift_m: self.shift_m.max(other.shift_m) }
    }
}

/// The vector by which one pose is turned from another, in the camera's axes, radians; exact for small turns.
pub(super) fn turn_between(from: &CameraPose, to: &CameraPose) -> DVec3 {
    let turned = from.ned_from_camera.conjugate() * to.ned_from_camera;
    2.0 * turned.xyz() * turned.w.signum()
}

impl Field {
    pub fn new(
        [first_px, step_px]: [f64; 2],
        parity: Option<u32>,
        times_s: Vec<f64>,
        path: &CameraPath,
    ) -> Self {
        let poses: Vec<CameraPose> = times_s.iter().map(|&t_s| path.pose(t_s)).collect();
        let mut field = Self {
            first_px,
            step_px,
            parity,
            beyond: [poses[0]; 2],
            times_s,
            poses,
            travel: Travel::default(),
        };
        if !field.is_global() {
            field.beyond =
                [0, field.last_node()].map(|node| path.pose(field.time_s(field.row_of_node(node))));
            field.travel = Travel::new(&field);
        }
        field
    }

    /// Whether all rows have one instant.
    pub fn is_global(&self) -> bool {
        self.times_s.iter().all(|t_s| *t_s == self.times_s[0])
    }

    /// Fractional row at a pixel coordinate.
    pub fn row_of(&self, px: f64) -> f64 {
        (px - self.first_px) / self.step_px
    }

    /// Instant of a fractional row: linear between the centres of rows, and beyond the first and the last one.
    pub fn time_s(&self, row: f64) -> f64 {
        let Some(before_last) = self.times_s.len().checked_sub(2) else { return self.times_s[0] };
        let from = (row.max(0.0) as usize).min(before_last);
        self.times_s[from] + (self.times_s[from + 1] - self.times_s[from]) * (row - from as f64)
    }

    /// Distance from a pixel coordinate to the nearest image row of the field, pixels; 0 where all rows belong
    /// to it.
    pub fn distance_to_rows_px(&self, y_px: f64) -> f64 {
        let from_first = |parity: u32| y_px - f64::from(parity);
        self.parity.map(from_first).map_or(0.0, |y_px| (y_px - 2.0 * (0.5 * y_px).round()).abs())
    }

    /// Nodes are the rows, and half a row before the first and behind the last one.
    pub fn last_node(&self) -> usize {
        self.poses.len() + 1
    }

    pub fn row_of_node(&self, node: usize) -> f64 {
        let last = self.poses.len() as f64 - 0.5;
        (node as f64 - 1.0).clamp(-0.5, last)
    }

    pub fn pose_of_node(&self, node: usize) -> &CameraPose {
        match node {
            0 => &self.beyond[0],
            node => self.poses.get(node - 1).unwrap_or(&self.beyond[1]),
        }
    }

    /// How far the camera turns and moves from one node to a later one.
    pub fn travel_between(&self, from: usize, to: usize) -> Motion {
        let Travel { turned, moved_m, .. } = &self.travel;
        Motion { turn: turned[to] - turned[from], shift_m: moved_m[to] - moved_m[from] }
    }

    /// How far the camera turns and moves in one row, at most.
    pub fn most_in_a_row(&self) -> Motion {
        self.travel.most
    }

    /// By how much a row's travel differs from the next one's, near the interval behind a node.
    pub fn change_behind(&self, node: usize) -> Motion {
        self.travel.changes[node]
    }
}

impl Travel {
    fn new(field: &Field) -> Self {
        let mut travel = Self { turned: vec![0.0], moved_m: vec![0.0], ..Self::default() };
        let mut before: Option<[DVec3; 2]> = None;
        // At each node but the last.
        let mut at_nodes = Vec::with_capacity(field.last_node());
        for node in 0..field.last_node() {
            let [from, to] = [node, node + 1].map(|node| field.pose_of_node(node));
            let rows = field.row_of_node(node + 1) - field.row_of_node(node);
            let in_a_row =
                [turn_between(from, to), to.position_ned_m - from.position_ned_m].map(|step| step / rows);
            let [turn, shift_m] = in_a_row.map(DVec3::length);
            travel.most = travel.most.max(Motion { turn, shift_m });
            travel.turned.push(travel.turned[node] + rows * turn);
            travel.moved_m.push(travel.moved_m[node] + rows * shift_m);
            let change = before.map_or([0.0; 2], |before| [0, 1].map(|k| (in_a_row[k] - before[k]).length()));
            at_nodes.push(Motion { turn: change[0], shift_m: change[1] });
            before = Some(in_a_row);
        }
        let behind = |node: usize| at_nodes.get(node + 1).copied().unwrap_or_default();
        travel.changes = (0..at_nodes.len()).map(|node| at_nodes[node].max(behind(node))).collect();
        travel
    }
}
