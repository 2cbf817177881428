//! What moves within a frame, and the stages that it calls for.

use glam::DVec2;

use super::{BlurStage, LensReach, Motion, Skip, TemporalStage};
use crate::{mount::CameraPath, scenario::QualitySpec, scene::Scene, shutter::Shutter, temporal::IdealGeometry};

/// Part of the tolerance that a left-out effect may use up.
const NEGLIGIBLE: f64 = 0.2;
/// Most exposure nodes.
const MAX_NODES: u32 = 65;
/// Exposure nodes for each period of the fastest vibration.
const NODES_PER_PERIOD: f64 = 8.0;

/// Instants that cover a window: 17, and at least 8 a vibration period.
pub(super) fn instants(path: &CameraPath, window_s: [f64; 2]) -> impl Iterator<Item = f64> {
    let [first, last] = window_s;
    let steps = (NODES_PER_PERIOD * path.highest_vibration_hz() * (last - first)).ceil().clamp(16.0, 4096.0) as u32;
    (0..=steps).map(move |k| first + (last - first) * f64::from(k) / f64::from(steps))
}

/// Bounds on the frame's motion.
pub(super) fn measure(
    reach: &LensReach,
    path: &CameraPath,
    shutter: &Shutter,
    stamp_s: f64,
    key_s: f64,
    ideal: &IdealGeometry,
    scene: &Scene,
) -> Motion {
    let key = path.pose(key_s);
    let (first, last) = shutter.window_s();
    let window_s = [stamp_s + first, stamp_s + last];
    let travel_m = super::travel_m(path, window_s, key_s);
    let rotation_rad =
        instants(path, window_s).map(|t| path.pose(t).ned_from_camera.angle_between(key.ned_from_camera)).fold(0.0, f64::max);
    let nearest_m = super::nearest_m(scene, &key, ideal.tangents(), travel_m);
    let slant = reach.slant();
    let focal_px = ideal.focal_px.max_element();
    let (blur_px, blur_sagitta_px) = blur_path(reach, path, shutter, stamp_s, ideal, 1.0 / nearest_m);
    let speed_m_s = instants(path, window_s).map(|t| path.velocity_ned(t).length()).fold(0.0, f64::max);
    Motion {
        nearest_m,
        travel_m,
        rotation_rad,
        // d(h)/d(t): at most f |t| w sqrt(1 + r^2) for a unit w; rotation moves a ray by at most f theta (1 + r^2).
        parallax_px: focal_px * travel_m / nearest_m * slant,
        rotation_px: focal_px * rotation_rad * slant * slant,
        blur_px,
        blur_sagitta_px,
        exposure_travel_px_m: focal_px * speed_m_s * shutter.exposure_s() * slant,
    }
}

/// Longest path over the exposure, and the largest miss of its chord, over a few lines, rays and both depth extremes.
fn blur_path(
    reach: &LensReach,
    path: &CameraPath,
    shutter: &Shutter,
    stamp_s: f64,
    ideal: &IdealGeometry,
    inverse_near: f64,
) -> (f64, f64) {
    let exposure_s = shutter.exposure_s();
    if exposure_s <= 0.0 {
        return (0.0, 0.0);
    }
    const STEPS: u32 = 16;
    let (mut longest, mut sagitta) = (0.0_f64, 0.0_f64);
    let every = (reach.rays.len() / 24).max(1);
    for &(uv, [x, y]) in reach.rays.iter().step_by(every) {
        let mid_s = stamp_s + shutter.dt_pixel_s(x, y);
        let mid = path.pose(mid_s);
        for w in [0.0, inverse_near] {
            let at: Vec<DVec2> = (0..=STEPS)
                .filter_map(|k| {
                    let t_s = mid_s + exposure_s * (f64::from(k) / f64::from(STEPS) - 0.5);
                    let (rotation, shift) = path.pose(t_s).relative_to(&mid);
                    let p = rotation * uv.extend(1.0) + w * shift;
                    (p.z > 0.02).then(|| ideal.focal_px * p.truncate() / p.z)
                })
                .collect();
            longest = longest.max(at.windows(2).map(|pair| pair[0].distance(pair[1])).sum());
            if let (Some(&a), Some(&b)) = (at.first(), at.last()) {
                let steps = (at.len() - 1).max(1) as f64;
                let miss = at.iter().enumerate().map(|(k, p)| p.distance(a.lerp(b, k as f64 / steps))).fold(0.0, f64::max);
                sagitta = sagitta.max(miss);
            }
        }
    }
    (longest, sagitta)
}

/// The cheapest temporal inverse within the tolerance.
pub(super) fn temporal_stage(motion: &Motion, quality: &QualitySpec, focal_px: f64, skipped: &mut Vec<Skip>) -> TemporalStage {
    let negligible_px = NEGLIGIBLE * quality.max_error_px;
    if motion.parallax_px > negligible_px {
        return TemporalStage::Reproject { iterations: iterations(motion.parallax_px, focal_px, negligible_px) };
    }
    skipped.push(Skip {
        what: "depth in the temporal inverse",
        reason: format!("parallax within the frame is at most {:.2e} px", motion.parallax_px),
    });
    if motion.rotation_px > negligible_px {
        return TemporalStage::Rotation;
    }
    skipped.push(Skip {
        what: "temporal inverse",
        reason: format!("rotation within the frame moves no pixel by more than {:.2e} px", motion.rotation_px),
    });
    TemporalStage::Identity
}

/// Depth look-ups so that `rho^n * parallax` is negligible. The contraction rho is `parallax * |grad w| / w`; on a surface seen at up to
/// about 70 deg from its normal `|grad w| / w <= 3 / f`.
fn iterations(parallax_px: f64, focal_px: f64, negligible_px: f64) -> u32 {
    let rho = (3.0 * parallax_px / focal_px).clamp(0.01, 0.5);
    ((negligible_px / parallax_px).ln() / rho.ln()).ceil().clamp(2.0, 8.0) as u32
}

/// Nodes and samples of the exposure, or `None` when it does not show.
pub(super) fn blur_stage(
    motion: &Motion,
    quality: &QualitySpec,
    path: &CameraPath,
    shutter: &Shutter,
    skipped: &mut Vec<Skip>,
) -> Option<BlurStage> {
    if shutter.exposure_s() <= 0.0 {
        skipped.push(Skip { what: "motion blur", reason: "camera.shutter.exposure_ms is 0".into() });
        return None;
    }
    if motion.blur_px <= quality.max_error_px {
        skipped.push(Skip { what: "motion blur", reason: format!("no path over the exposure is longer than {:.2e} px", motion.blur_px) });
        return None;
    }
    // The chord's miss falls with the square of the number of segments; half the tolerance goes to it.
    let by_curve = (motion.blur_sagitta_px / (0.5 * quality.max_error_px)).sqrt().ceil();
    let by_vibration = (NODES_PER_PERIOD * path.highest_vibration_hz() * shutter.exposure_s()).ceil();
    let segments = by_curve.max(if motion.blur_sagitta_px > NEGLIGIBLE * quality.max_error_px { by_vibration } else { 1.0 });
    let nodes = segments.clamp(1.0, f64::from(MAX_NODES - 1)) as u32 + 1;
    Some(samples_between(nodes, quality, motion))
}

/// Samples of an exposure of so many nodes.
pub(super) fn samples_between(nodes: u32, quality: &QualitySpec, motion: &Motion) -> BlurStage {
    let (samples_per_px, max_samples) = match quality.blur_samples.value() {
        Some(samples) => (f64::from(samples), samples.div_ceil(nodes - 1)),
        None => (2.0, ((2.0 * motion.blur_px).ceil() as u32 / (nodes - 1) + 2).clamp(2, 512)),
    };
    BlurStage { nodes, samples_per_px, max_samples }
}
