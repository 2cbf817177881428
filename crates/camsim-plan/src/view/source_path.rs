//! Path of a source over the exposure.

use camsim_core::mount::CameraPath;
use glam::DVec2;

/// Path of the source over the exposure, camera px: between its positions that are farthest apart, and its
/// length.
pub(crate) fn path_px(
    path: &CameraPath,
    mid_s: f64,
    exposure_s: f64,
    uv: DVec2,
    inverse_depth: f64,
    focal_px: DVec2,
) -> (DVec2, f64) {
    const STRETCHES: u32 = 8;
    if exposure_s <= 0.0 {
        return (DVec2::ZERO, 0.0);
    }
    let mid = path.pose(mid_s);
    let position = |k: u32| {
        let t_s = mid_s + exposure_s * (f64::from(k) / f64::from(STRETCHES) - 0.5);
        let (rotation, shift) = path.pose(t_s).relative_to(&mid);
        let p = rotation * uv.extend(1.0) + inverse_depth * shift;
        focal_px * p.truncate() / p.z
    };
    let positions: Vec<DVec2> = (0..=STRETCHES).map(position).filter(|at| at.is_finite()).collect();
    let length_px = positions.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    let apart = positions
        .iter()
        .enumerate()
        .flat_map(|(k, from)| positions[k + 1..].iter().map(move |to| *to - *from));
    let widest = apart.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    (widest.unwrap_or_default(), length_px)
}
