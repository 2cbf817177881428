//! How many ideal frames an output frame is made of, and when. One camera does not see what other lines of the frame see behind a
//! silhouette; a second one, at another instant, sees most of it.

use super::{
    EdgeStage, Motion, Skip, TemporalStage,
    edges::{FINE_PIXEL_BYTES, SceneOutline, scale_of},
};
use crate::{mount::CameraPath, pose::CameraPose, scenario::QualitySpec, temporal::IdealGeometry};

/// Most ideal frames of one output frame.
pub const MAX_KEYS: u32 = 4;
/// Colour and depth of an ideal pixel.
const PIXEL_BYTES: u64 = 12;
/// Memory that more than one ideal frame may take.
const MAX_BYTES: u64 = 2 << 30;
/// Allocated heights are multiples of this.
pub const SIZE_QUANTUM_PX: u32 = 64;
/// Strips of unseen surface beside silhouettes, ideal pixels, up to which the surface beside them may stand in.
const HOLE_PX: f64 = 4.0;
/// The same where `quality.max_error_dn` asks for more than the default.
const FINE_HOLE_PX: f64 = 2.0;
const DEFAULT_DN: f64 = 1.0;

/// Instant and pose of an ideal frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyFrame {
    /// Path time, seconds.
    pub t_s: f64,
    /// Pose of the camera then.
    pub pose: CameraPose,
}

/// The middles of `count` equal parts of the window.
pub(super) fn spread(path: &CameraPath, [first_s, last_s]: [f64; 2], count: u32) -> Vec<KeyFrame> {
    let at = |k: u32| match count {
        0 | 1 => 0.5 * (first_s + last_s),
        _ => first_s + (last_s - first_s) * (f64::from(k) + 0.5) / f64::from(count),
    };
    (0..count.max(1)).map(at).map(|t_s| KeyFrame { t_s, pose: path.pose(t_s) }).collect()
}

/// The one or two keys that are nearest to an instant: a line's own, and the one that fills its holes first.
pub(super) fn nearest_two(keys: &[KeyFrame], t_s: f64) -> impl Iterator<Item = &KeyFrame> {
    let mut order: Vec<&KeyFrame> = keys.iter().collect();
    order.sort_by(|a, b| (a.t_s - t_s).abs().total_cmp(&(b.t_s - t_s).abs()));
    order.into_iter().take(2)
}

/// Number of ideal frames that the frame asks for.
///
/// What the line at the end of the window sees and the middle one does not is a strip of `f |t| (w_max - w_min)` px beside a silhouette
/// (w = inverse depth of surfaces in view; sky behind it is one colour and needs no second look).
pub(super) fn wanted(
    outline: &SceneOutline,
    motion: &Motion,
    temporal: TemporalStage,
    edges: EdgeStage,
    quality: &QualitySpec,
    pose: &CameraPose,
    ideal: &IdealGeometry,
    skipped: &mut Vec<Skip>,
) -> u32 {
    let mut one = |reason: String| {
        skipped.push(Skip { what: "second ideal frame", reason });
        1
    };
    match temporal {
        TemporalStage::Reproject { .. } => {}
        TemporalStage::Identity => return one("nothing moves within the frame, or by too little to matter".into()),
        TemporalStage::Rotation => return one("there is no parallax within the frame, or too little to matter".into()),
        TemporalStage::Linear | TemporalStage::Rk2 => return one("solvers of a constant twist look into a single one".into()),
    }
    if let Some(count) = quality.key_frames.value() {
        return if count <= 1 { one("quality.key_frames is 1".into()) } else { count.min(MAX_KEYS) };
    }
    if edges == EdgeStage::None {
        return one("no silhouette is seen sample by sample".into());
    }
    let far_w = outline.farthest_m(pose, ideal.tangents()).map_or(0.0, f64::recip);
    // `parallax_px` is that of the nearest surface, f |t| w_max.
    let hole_px = motion.parallax_px * (1.0 - far_w * motion.nearest_m).max(0.0);
    let limit_px = if quality.max_error_dn < DEFAULT_DN { FINE_HOLE_PX } else { HOLE_PX };
    if hole_px <= limit_px {
        return one(format!("strips that only other lines see beside silhouettes are at most {hole_px:.2} px wide"));
    }
    2
}

/// As many ideal frames as `wanted`, or as fit one above the other into a texture; `None` for one.
pub(super) fn fitting(
    wanted: u32,
    edges: EdgeStage,
    max_side_px: u32,
    skipped: &mut Vec<Skip>,
    made: impl Fn(u32) -> (Vec<KeyFrame>, IdealGeometry),
) -> Option<(Vec<KeyFrame>, IdealGeometry)> {
    let scale = u64::from(scale_of(edges));
    for count in (2..=wanted).rev() {
        let (keys, ideal) = made(count);
        let [width, height] = ideal.size_px.map(|side| u64::from(side.next_multiple_of(SIZE_QUANTUM_PX)));
        let fine_bytes = if edges == EdgeStage::None { 0 } else { scale * scale * FINE_PIXEL_BYTES };
        let bytes = width * height * u64::from(count) * (PIXEL_BYTES + fine_bytes);
        let reason = if width.max(height * u64::from(count)) * scale > u64::from(max_side_px) {
            format!("{count} of {width}x{height} px are more than the {max_side_px} px a side that the adapter has; reduce camera.size_px")
        } else if bytes > MAX_BYTES {
            format!("{count} of {width}x{height} px take {} MiB, more than {}; reduce the field of view", bytes >> 20, MAX_BYTES >> 20)
        } else {
            return Some((keys, ideal));
        };
        skipped.push(Skip { what: "a further ideal frame", reason });
    }
    None
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec2, DVec3};

    use super::*;

    fn key(t_s: f64) -> KeyFrame {
        KeyFrame { t_s, pose: CameraPose { position_ned_m: DVec3::ZERO, ned_from_camera: DQuat::IDENTITY } }
    }

    #[test]
    fn a_line_uses_the_keys_beside_it() {
        let keys = [0.125, 0.375, 0.625, 0.875].map(key);
        let times = |t_s: f64| nearest_two(&keys, t_s).map(|key| key.t_s).collect::<Vec<_>>();
        assert_eq!(times(0.0), [0.125, 0.375]);
        assert_eq!(times(0.45), [0.375, 0.625]);
        assert_eq!(times(2.0), [0.875, 0.625]);
        assert_eq!(nearest_two(&keys[..1], 0.3).count(), 1);
    }

    #[test]
    fn what_does_not_fit_is_left_out_and_said() {
        let ideal = IdealGeometry { size_px: [700, 500], focal_px: DVec2::ONE, principal_px: DVec2::ZERO };
        let made = |count: u32| ((0..count).map(|k| key(f64::from(k))).collect::<Vec<_>>(), ideal);
        let edges = EdgeStage::Supersampled { scale: 2, samples: 32, thin: true };
        let count = |wanted, side| {
            let mut skipped = Vec::new();
            let found = fitting(wanted, edges, side, &mut skipped, made);
            (found.map_or(1, |(keys, _)| keys.len()), skipped.len())
        };
        // 512 px each, twice supersampled.
        assert_eq!(count(4, 4096), (4, 0));
        assert_eq!(count(4, 4095), (3, 1));
        assert_eq!(count(4, 2048), (2, 2));
        assert_eq!(count(4, 2047), (1, 3));
        assert_eq!(count(2, 1300), (1, 1));
        assert_eq!(count(1, 64), (1, 0));
        // A gigapixel fits into no memory, whatever the adapter's textures hold.
        let wide =
            |count: u32| ((0..count).map(|k| key(f64::from(k))).collect::<Vec<_>>(), IdealGeometry { size_px: [10_697, 6787], ..ideal });
        let mut skipped = Vec::new();
        assert!(fitting(2, edges, 65_536, &mut skipped, wide).is_none() && skipped[0].reason.contains("MiB"), "{skipped:?}");
    }
}
