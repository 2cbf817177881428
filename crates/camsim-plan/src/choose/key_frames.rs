//! How many ideal frames an output frame is made of, and when. One camera does not see what other rows of
//! the frame see behind a silhouette; a second one, at another instant, sees most of it.

use camsim_core::{mount::CameraPath, scenario::QualitySpec, temporal::IdealGeometry};

use super::edges::FINE_PIXEL_BYTES;
use crate::ir::{
    budget::{ErrorBudget, NEARLY, disoccluded_fraction},
    key_frame::KeyFrame,
    limits::{MAX_IDEAL_PX, MAX_KEYS, SIZE_QUANTUM_PX},
    predicted::Disocclusion,
    skip::Skip,
    stages::{EdgeStage, TemporalStage, scale_of},
};

/// Colour and depth of an ideal pixel.
const PIXEL_BYTES: u64 = 12;
/// Memory that more than one ideal frame may take, with the finer pictures of silhouettes.
const MAX_BYTES: u64 = 2 << 30;

/// The middles of `count` equal parts of the window.
pub(crate) fn spread(path: &CameraPath, [first_s, last_s]: [f64; 2], count: u32) -> Vec<KeyFrame> {
    let middle_s = |k: u32| match count {
        0 | 1 => 0.5 * (first_s + last_s),
        _ => first_s + (last_s - first_s) * (f64::from(k) + 0.5) / f64::from(count),
    };
    (0..count.max(1)).map(middle_s).map(|t_s| KeyFrame { t_s, pose: path.pose(t_s) }).collect()
}

/// Number of ideal frames that the frame needs; `disocclusion` is that of a single one.
///
/// A second one shows most of what is disoccluded: only rows near the ends of the window see strips then, and
/// half as wide ones. It takes as long as the first, so it is for disocclusion that would be a large part of
/// either tolerance: of `quality.max_error_dn` by their colours, which is an RMS over the picture, or of
/// `quality.max_error_px` by the positions that these are read from, which are off by as much as the strips are
/// wide, and may be so in a hundredth of the pixels.
pub(crate) fn wanted(
    disocclusion: Option<&Disocclusion>,
    for_blended: u32,
    temporal: TemporalStage,
    quality: &QualitySpec,
    skipped: &mut Vec<Skip>,
) -> u32 {
    let mut one = |reason: String| {
        skipped.push(Skip { what: "second ideal frame", reason });
        1
    };
    match temporal {
        TemporalStage::Reproject { .. } => {}
        TemporalStage::Identity => {
            return one("nothing moves within the frame, or by too little for quality.max_error_px".into());
        }
        TemporalStage::Rotation => {
            return one(
                "there is no parallax within the frame, or too little for quality.max_error_px".into()
            );
        }
        TemporalStage::Linear | TemporalStage::Rk2 => {
            return one("solvers of a constant twist use a single one".into());
        }
    }
    if let Some(count) = quality.key_frames.value() {
        return if count <= 1 { one("quality.key_frames is 1".into()) } else { count.min(MAX_KEYS) };
    }
    if for_blended > 1 {
        return for_blended.min(MAX_KEYS);
    }
    let Some(Disocclusion { fraction, width_px, wide_fraction, error_dn, .. }) = disocclusion else {
        return one("no silhouette has rays of its own".into());
    };
    if *error_dn > ErrorBudget::new(quality).disocclusion_dn() || *wide_fraction > disoccluded_fraction() {
        return 2;
    }
    if *fraction == 0.0 {
        return one("no disocclusion was found behind silhouettes".into());
    }
    one(format!(
        "disocclusion in {:.4} % of the picture, {width_px:.2} px wide, costs {error_dn:.2}/255 over the picture",
        100.0 * fraction
    ))
}

/// Number of ideal frames that blended surfaces need: each row is then nearer in time to its own, and the
/// surfaces are displaced by less. As many as keep `quality.max_error_dn`, or come near to the least error
/// there is. `blended_dn` is their error with a number of frames, `rest_dn` what else there is.
pub(crate) fn for_blended(blended_dn: impl Fn(u32) -> f64, rest_dn: f64, max_error_dn: f64) -> u32 {
    if rest_dn.hypot(blended_dn(1)) <= max_error_dn {
        return 1;
    }
    let with: Vec<(u32, f64)> =
        (1..=MAX_KEYS).map(|count| (count, rest_dn.hypot(blended_dn(count)))).collect();
    let enough_dn = max_error_dn.max(NEARLY * with.iter().map(|(_, dn)| *dn).fold(f64::INFINITY, f64::min));
    with.into_iter().find(|(_, dn)| *dn <= enough_dn).map_or(1, |(count, _)| count)
}

/// As many ideal frames as `wanted`, or as fit one above the other into a texture; `None` for one.
pub(crate) fn fitting(
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
            format!(
                "{count} of {width}x{height} px are more than the {max_side_px} px a side that the adapter has; reduce camera.size_px"
            )
        } else if width * height * u64::from(count) > MAX_IDEAL_PX {
            format!(
                "{count} of {width}x{height} px are more than {} million px; reduce the field of view",
                MAX_IDEAL_PX / 1_000_000
            )
        } else if bytes > MAX_BYTES {
            format!(
                "{count} of {width}x{height} px take {} MiB, more than {}; reduce the field of view",
                bytes >> 20,
                MAX_BYTES >> 20
            )
        } else {
            return Some((keys, ideal));
        };
        skipped.push(Skip { what: "a further ideal frame", reason });
    }
    None
}

#[cfg(test)]
mod tests {
    use camsim_core::pose::CameraPose;
    use glam::{DQuat, DVec2, DVec3};

    use super::*;
    use crate::ir::key_frame::nearest_first;

    fn key(t_s: f64) -> KeyFrame {
        KeyFrame { t_s, pose: CameraPose { position_ned_m: DVec3::ZERO, ned_from_camera: DQuat::IDENTITY } }
    }

    #[test]
    fn a_row_uses_the_keys_nearest_in_time() {
        let keys = [0.125, 0.375, 0.625, 0.875].map(key);
        let times = |t_s: f64| nearest_first(&keys, t_s).into_iter().map(|key| key.t_s).collect::<Vec<_>>();
        assert_eq!(times(0.0), [0.125, 0.375, 0.625, 0.875]);
        assert_eq!(times(0.45), [0.375, 0.625, 0.125, 0.875]);
        assert_eq!(times(2.0), [0.875, 0.625, 0.375, 0.125]);
        assert_eq!(nearest_first(&keys[..1], 0.3).len(), 1);
    }

    #[test]
    fn blended_surfaces_get_as_many_key_frames_as_they_need() {
        // Gradual alpha, and borders.
        let gradual = |dn: f64, rest_dn: f64| for_blended(|count| dn / f64::from(count), rest_dn, 1.0);
        let sharp = |dn: f64, rest_dn: f64| for_blended(|count| dn / f64::from(count).sqrt(), rest_dn, 1.0);
        assert_eq!([0.0, 0.9, 1.1, 2.5, 3.9].map(|dn| gradual(dn, 0.1)), [1, 1, 2, 3, 4]);
        assert_eq!([0.9, 1.1, 1.5, 2.5].map(|dn| sharp(dn, 0.1)), [1, 2, 3, 4]);
        // Where something else breaks the tolerance three would be hardly better than two.
        assert_eq!((gradual(2.5, 2.3), gradual(0.5, 2.3)), (2, 1));
        assert_eq!(gradual(40.0, 0.1), MAX_KEYS);
    }

    #[test]
    fn key_frames_that_do_not_fit_are_skipped_with_a_reason() {
        let ideal = IdealGeometry { size_px: [700, 500], focal_px: DVec2::ONE, principal_px: DVec2::ZERO };
        let made = |count: u32| ((0..count).map(|k| key(f64::from(k))).collect::<Vec<_>>(), ideal);
        let edges = EdgeStage::Supersampled { scale: 2, samples: 32, thin: true };
        let count = |wanted, side| {
            let mut skipped = Vec::new();
            let chosen = fitting(wanted, edges, side, &mut skipped, made);
            (chosen.map_or(1, |(keys, _)| keys.len()), skipped.len())
        };
        // 512 px each, twice supersampled.
        assert_eq!(count(4, 4096), (4, 0));
        assert_eq!(count(4, 4095), (3, 1));
        assert_eq!(count(4, 2048), (2, 2));
        assert_eq!(count(4, 2047), (1, 3));
        assert_eq!(count(2, 1300), (1, 1));
        assert_eq!(count(1, 64), (1, 0));
        // Their pixels add up, whether there are silhouettes or not.
        let large = |count: u32| {
            (
                (0..count).map(|k| key(f64::from(k))).collect::<Vec<_>>(),
                IdealGeometry { size_px: [6400, 6400], ..ideal },
            )
        };
        let mut skipped = Vec::new();
        assert!(
            fitting(2, EdgeStage::None, 16_384, &mut skipped, large).is_none()
                && skipped[0].reason.contains("67 million px"),
            "{skipped:?}"
        );
        // Their samples at silhouettes take more than the pixels do.
        let wide = |count: u32| {
            (
                (0..count).map(|k| key(f64::from(k))).collect::<Vec<_>>(),
                IdealGeometry { size_px: [5000, 5000], ..ideal },
            )
        };
        let mut skipped = Vec::new();
        assert!(
            fitting(2, edges, 65_536, &mut skipped, wide).is_none() && skipped[0].reason.contains("MiB"),
            "{skipped:?}"
        );
    }
}
