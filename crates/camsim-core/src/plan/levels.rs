//! What resampling and the samples of the exposure cost in grey levels: an estimate from how much the pictures in view change from pixel
//! to pixel. Not a bound: against the oracle's own pictures it is 0.6 (a pattern of hard edges) to 2.2 times (a fisheye over an alpine
//! valley) the error measured away from silhouettes (`camsim verify --pictures` shows both).

use glam::{DMat2, DVec2};

use super::{BlurStage, dry_run::Truth, grain::SceneGrain, probes::Probe};
use crate::temporal::{Footprint, IdealGeometry, samples_for};

/// RMS error of one bilinear tap of an ideal frame, in RMS steps between its pixels.
const TAP: f64 = 0.25;
/// Samples a pixel of path, and the RMS error of their mean over a path of one pixel, of the RMS step; it falls with the root of the path
/// (white texture, paths of 16 and 64 px).
const SAMPLING: [(f64, f64); 4] = [(0.25, 0.73), (0.5, 0.33), (1.0, 0.034), (2.0, 0.0096)];

/// Squared errors of one pixel, of the linear range.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Levels {
    pub resampling: f64,
    pub blur: f64,
}

impl Levels {
    /// At a probe whose source runs from `ends[0]` to `ends[1]` within the exposure.
    pub fn new(
        probe: &Probe,
        truth: &Truth,
        ends_px: [DVec2; 2],
        ideal: &IdealGeometry,
        grain: &SceneGrain,
        max_taps: u32,
        blur: Option<BlurStage>,
    ) -> Self {
        let Some(surface) = truth.surface else { return Self::default() };
        let px_m = 1.0 / (truth.key_inverse_depth * ideal.focal_px.x.min(ideal.focal_px.y));
        let step = grain.step(surface, px_m);
        let ideal_from_px = DMat2::from_diagonal(ideal.focal_px) * probe.uv_from_px;
        let area = Footprint::new(ideal_from_px.x_axis, ideal_from_px.y_axis, max_taps);
        let taps = f64::from(area.taps[0] * area.taps[1]);
        // Fewer taps than pixels: what lies between is seen or not by chance.
        let thin = (area.dx.length() / f64::from(area.taps[0])).max(1.0) * (area.dy.length() / f64::from(area.taps[1])).max(1.0);
        let tap = TAP * step * thin / taps.sqrt();
        let path_px = ends_px[0].distance(ends_px[1]);
        let sampling = blur.filter(|_| path_px > 1.0).map_or(0.0, |blur| {
            let segments = f64::from(blur.nodes - 1);
            let samples = segments * f64::from(samples_for(path_px / segments, blur.samples_per_px, 1, blur.max_samples));
            step * sampling(samples / path_px) / path_px.sqrt()
        });
        // A long path averages what each tap is off by.
        let averaged = if blur.is_some() { path_px.max(1.0) } else { 1.0 };
        Self { resampling: tap * tap / averaged, blur: sampling * sampling }
    }
}

/// Between the rows of the table along straight lines of the logarithms; beyond its ends as at them, or falling on.
fn sampling(samples_per_px: f64) -> f64 {
    let last = SAMPLING[SAMPLING.len() - 1];
    if samples_per_px >= last.0 {
        return last.1 * last.0 / samples_per_px;
    }
    let between = SAMPLING.windows(2).find(|pair| samples_per_px < pair[1].0 && samples_per_px >= pair[0].0);
    between.map_or(SAMPLING[0].1, |pair| {
        let share = (samples_per_px / pair[0].0).ln() / (pair[1].0 / pair[0].0).ln();
        pair[0].1 * (pair[1].1 / pair[0].1).powf(share)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_samples_are_never_worse() {
        let mut before = f64::INFINITY;
        for k in 1..60 {
            let found = sampling(0.1 * f64::from(k));
            assert!(found <= before && found > 0.0);
            before = found;
        }
        assert!((sampling(1.0) - 0.034).abs() < 1e-12 && (sampling(0.5) - 0.33).abs() < 1e-12);
    }
}
