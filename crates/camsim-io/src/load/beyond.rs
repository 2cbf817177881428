//! How much of what a flight sees has no picture.

use camsim_core::{camera::CameraModel, scenario::Beyond, sequence::Sequence};
use glam::DVec2;

use crate::terrain::TerrainSummary;

/// Frames that are looked at, and places along each side of each.
const FRAMES: u64 = 25;
const PLACES: u32 = 12;

/// Says how much of the frames is ground beyond the ortho-image, by some frames and pixels of a fixed lens.
pub(super) fn beyond_picture_warning(sequence: &Sequence, summary: &TerrainSummary) -> Option<String> {
    let spec = sequence.scenario.scene.terrain.as_ref()?;
    if summary.outside_ortho == 0 || spec.beyond == Beyond::Void {
        return None;
    }
    let terrain = sequence.scene.terrain.as_ref()?;
    let camera = CameraModel::from_spec(&sequence.scenario.camera).ok()?;
    let size = camera.size_px.map(f64::from);
    let [low, high] = summary.ortho_uv;
    let (mut all, mut beyond, mut worst) = (0_u32, 0_u32, (0, 0_u64));
    for frame in (0..sequence.frames).step_by(sequence.frames.div_ceil(FRAMES).max(1) as usize) {
        let pose = sequence.path.pose(sequence.start_s + frame as f64 / sequence.scenario.camera.fps);
        let mut of_frame = 0;
        for (x, y) in (0..PLACES).flat_map(|y| (0..PLACES).map(move |x| (x, y))) {
            let at = [x, y].map(|n| (f64::from(n) + 0.5) / f64::from(PLACES));
            all += 1;
            let Some(ray) = camera.unproject(DVec2::new(at[0] * size[0] - 0.5, at[1] * size[1] - 0.5)) else {
                continue;
            };
            let direction = pose.ned_from_camera * ray.extend(1.0);
            let hit = terrain.intersect(pose.position_ned_m, direction, f64::INFINITY);
            of_frame +=
                u32::from(hit.is_some_and(|hit| (0..2).any(|k| !(low[k]..=high[k]).contains(&hit.uv[k]))));
        }
        beyond += of_frame;
        worst = worst.max((of_frame, frame));
    }
    let percent = |share: f64| 100.0 * share;
    (beyond > 0).then(|| {
        format!(
            "about {:.0} % of the frames is ground beyond the ortho-image, {:.0} % of frame {}: see scene.terrain.beyond",
            percent(f64::from(beyond) / f64::from(all)),
            percent(f64::from(worst.0) / f64::from(PLACES * PLACES)),
            worst.1
        )
    })
}
