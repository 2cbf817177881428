//! Warns if a flight sees ground beyond the ortho-image.

use camsim_core::{camera::CameraModel, scenario::Beyond, sequence::Sequence};
use glam::DVec2;

use crate::terrain::TerrainSummary;

/// Number of frames that are sampled.
const FRAMES: u64 = 25;
/// Number of sampled pixels along each side of a frame.
const SAMPLES_PER_SIDE: u32 = 12;

/// Warns how much of the frames is ground beyond the ortho-image, from samples of frames and pixels of a
/// fixed lens.
pub(super) fn ortho_coverage_warning(sequence: &Sequence, summary: &TerrainSummary) -> Option<String> {
    let spec = sequence.scenario.scene.terrain.as_ref()?;
    if summary.outside_ortho == 0 || spec.beyond == Beyond::Void {
        return None;
    }
    let terrain = sequence.scene.terrain.as_ref()?;
    let camera = CameraModel::from_spec(&sequence.scenario.camera).ok()?;
    let [width_px, height_px] = camera.size_px.map(f64::from);
    let [min_uv, max_uv] = summary.ortho_uv;
    let (mut all, mut beyond, mut worst) = (0_u32, 0_u32, (0, 0_u64));
    for frame in (0..sequence.frames).step_by(sequence.frames.div_ceil(FRAMES).max(1) as usize) {
        let pose = sequence.path.pose(sequence.start_s + frame as f64 / sequence.scenario.camera.fps);
        let mut beyond_in_frame = 0;
        for (x, y) in (0..SAMPLES_PER_SIDE).flat_map(|y| (0..SAMPLES_PER_SIDE).map(move |x| (x, y))) {
            let [u, v] = [x, y].map(|n| (f64::from(n) + 0.5) / f64::from(SAMPLES_PER_SIDE));
            all += 1;
            let pixel = DVec2::new(u * width_px - 0.5, v * height_px - 0.5);
            let Some(ray) = camera.unproject(pixel) else { continue };
            let direction = pose.ned_from_camera * ray.extend(1.0);
            let hit = terrain.intersect(pose.position_ned_m, direction, f64::INFINITY);
            beyond_in_frame += u32::from(
                hit.is_some_and(|hit| (0..2).any(|k| !(min_uv[k]..=max_uv[k]).contains(&hit.uv[k]))),
            );
        }
        beyond += beyond_in_frame;
        worst = worst.max((beyond_in_frame, frame));
    }
    let percent = |share: f64| 100.0 * share;
    (beyond > 0).then(|| {
        format!(
            "about {:.0} % of the frames is ground beyond the ortho-image, {:.0} % of frame {}: see \
             scene.terrain.beyond",
            percent(f64::from(beyond) / f64::from(all)),
            percent(f64::from(worst.0) / f64::from(SAMPLES_PER_SIDE * SAMPLES_PER_SIDE)),
            worst.1
        )
    })
}
