//! What moves within a frame.

use camsim_core::{mount::CameraPath, shutter::Shutter, temporal::IdealGeometry};
use glam::DVec2;

use super::{lens_reach::LensReach, surfaces::Surfaces};
use crate::ir::motion::{Departure, Motion};

/// Instants for each period of the fastest vibration.
const INSTANTS_PER_PERIOD: f64 = 8.0;

/// Instants that cover a window: 17, and at least 8 a vibration period.
pub(crate) fn instants(path: &CameraPath, window_s: [f64; 2]) -> impl Iterator<Item = f64> {
    let [first, last] = window_s;
    let steps = (INSTANTS_PER_PERIOD * path.highest_vibration_hz() * (last - first))
        .ceil()
        .clamp(16.0, 4096.0) as u32;
    (0..=steps).map(move |k| first + (last - first) * f64::from(k) / f64::from(steps))
}

/// Farthest the optical centre gets from `key_s`'s position over the window, sampled at 17 instants plus 2
/// per vibration period.
pub(crate) fn travel_m(path: &CameraPath, window_s: [f64; 2], key_s: f64) -> f64 {
    let key = path.pose(key_s).position_ned_m;
    instants(path, window_s).map(|t| path.pose(t).position_ned_m.distance(key)).fold(0.0, f64::max)
}

/// Bounds on the frame's motion.
pub(crate) fn measure(
    reach: &LensReach,
    path: &CameraPath,
    shutter: &Shutter,
    stamp_s: f64,
    key_s: f64,
    ideal: &IdealGeometry,
    surfaces: &Surfaces,
) -> Motion {
    let key = path.pose(key_s);
    let (first, last) = shutter.window_s();
    let window_s = [stamp_s + first, stamp_s + last];
    let travel_m = travel_m(path, window_s, key_s);
    let nearest_m = surfaces.nearest_m(&key, ideal.tangents(), travel_m);
    let slant = reach.slant();
    let focal_px = ideal.focal_px.max_element();
    let departure = |from_s: f64| {
        let from = path.pose(from_s);
        let travel_m = self::travel_m(path, window_s, from_s);
        let rotation_rad = instants(path, window_s)
            .map(|t| path.pose(t).ned_from_camera.angle_between(from.ned_from_camera))
            .fold(0.0, f64::max);
        // d(h)/d(t): at most f |t| w sqrt(1 + r^2) for a unit w; rotation moves a ray by at most f theta (1 + r^2).
        Departure {
            travel_m,
            rotation_rad,
            parallax_px: focal_px * travel_m / nearest_m * slant,
            rotation_px: focal_px * rotation_rad * slant * slant,
        }
    };
    let Departure { rotation_rad, parallax_px, rotation_px, .. } = departure(key_s);
    let (blur_px, blur_sagitta_px) = blur_path(reach, path, shutter, stamp_s, ideal, 1.0 / nearest_m);
    Motion {
        nearest_m,
        travel_m,
        rotation_rad,
        parallax_px,
        rotation_px,
        blur_px,
        blur_sagitta_px,
        own: departure(window_s[0]),
    }
}

/// Longest path over the exposure, and the largest miss of its chord, over a few lines, rays and both depth
/// extremes.
fn blur_path(
    reach: &LensReach,
    path: &CameraPath,
    shutter: &Shutter,
    stamp_s: f64,
    ideal: &IdealGeometry,
    inverse_near: f64,
) -> (f64, f64) {
    let longest_s = shutter.longest_exposure_s();
    if longest_s <= 0.0 {
        return (0.0, 0.0);
    }
    let steps =
        (INSTANTS_PER_PERIOD * path.highest_vibration_hz() * longest_s).ceil().clamp(16.0, 256.0) as u32;
    let (mut longest, mut sagitta) = (0.0_f64, 0.0_f64);
    let every = (reach.rays.len() / 24).max(1);
    for &(uv, [x, y]) in reach.rays.iter().step_by(every) {
        let (mid_s, exposure_s) = (stamp_s + shutter.dt_pixel_s(x, y), shutter.exposure_pixel_s(x, y));
        let mid = path.pose(mid_s);
        for w in [0.0, inverse_near] {
            let positions: Vec<DVec2> = (0..=steps)
                .filter_map(|k| {
                    let t_s = mid_s + exposure_s * (f64::from(k) / f64::from(steps) - 0.5);
                    let (rotation, shift) = path.pose(t_s).relative_to(&mid);
                    let p = rotation * uv.extend(1.0) + w * shift;
                    (p.z > 0.02).then(|| ideal.focal_px * p.truncate() / p.z)
                })
                .collect();
            longest = longest.max(positions.windows(2).map(|pair| pair[0].distance(pair[1])).sum());
            if let (Some(&a), Some(&b)) = (positions.first(), positions.last()) {
                let last = (positions.len() - 1).max(1) as f64;
                let miss = positions
                    .iter()
                    .enumerate()
                    .map(|(k, p)| p.distance(a.lerp(b, k as f64 / last)))
                    .fold(0.0, f64::max);
                sagitta = sagitta.max(miss);
            }
        }
    }
    (longest, sagitta)
}
