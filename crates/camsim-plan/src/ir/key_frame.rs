//! Instants and poses of ideal frames.

use camsim_core::pose::CameraPose;

/// Instant and pose of an ideal frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyFrame {
    /// Path time, seconds.
    pub t_s: f64,
    /// Pose of the camera then.
    pub pose: CameraPose,
}

/// In the order of their distance from an instant: a row's own key, the one that fills its disocclusion
/// first, and so on.
pub(crate) fn nearest_first(keys: &[KeyFrame], t_s: f64) -> Vec<&KeyFrame> {
    let mut order: Vec<&KeyFrame> = keys.iter().collect();
    order.sort_by(|a, b| (a.t_s - t_s).abs().total_cmp(&(b.t_s - t_s).abs()));
    order
}
