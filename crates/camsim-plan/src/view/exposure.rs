//! Where over the exposure a source's path is known exactly, and what joins those positions.

use camsim_core::{
    mount::CameraPath,
    scenario::{Auto, QualitySpec},
    shutter::Shutter,
    temporal::path::Curve,
};
use glam::{DMat3, DVec2, DVec3};

use super::lens_reach::LensReach;
use crate::ir::{
    budget::ErrorBudget,
    margins,
    motion::Motion,
    skip::Skip,
    stages::{BlurStage, NodeDepths, PathStage},
};

/// A path shorter than this is no blur, ideal pixels: it takes 0.4 % from the finest wave that the frame
/// holds (1 - sinc(pi / 20)). `quality.max_error_px` does not bound the picture error.
const SHARP_PX: f64 = 0.1;
/// Most steps from node to node.
pub(crate) const MOST_STEPS: u32 = 256;
/// Most steps of the straight lines that rays at silhouettes take.
const MOST_STRAIGHT_STEPS: u32 = 64;
/// Nodes of straight lines for each period of the fastest vibration, to be near it.
const STRAIGHT_PER_PERIOD: f64 = 8.0;
/// Least nodes for each period of the fastest vibration: fewer would not distinguish it from stillness.
const LEAST_PER_PERIOD: f64 = 4.0;
/// Polynomials of a path that are compared with it.
const TRIED: u32 = 8;
/// Rays whose paths are tried.
const RAYS: usize = 24;

/// The path over an exposure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ExposurePath {
    pub path: PathStage,
    /// Polynomials.
    pub stretches: u32,
    /// Steps of the pose table for each step of the path.
    pub stride: u32,
}

impl ExposurePath {
    /// From end to end.
    pub const STRAIGHT: Self = Self { path: PathStage::Straight, stretches: 1, stride: 1 };

    /// The path with more nodes; `None` where the path is missed by no more than its part of the tolerance,
    /// and where there are as many as there may be.
    pub fn finer(self, miss_px: f64, budget: &ErrorBudget) -> Option<Self> {
        let path = PathStage::Quartic;
        let (allowed_px, steps) = (budget.exposure_path_px(), path.steps());
        let stretches = match self.path {
            PathStage::Quartic => (f64::from(self.stretches) * more_for(miss_px, allowed_px, steps))
                .ceil()
                .min(f64::from(MOST_STEPS / steps)) as u32,
            PathStage::Straight | PathStage::Parabola => self.stretches,
        };
        let finer = Self { path, stretches, stride: 1 };
        (miss_px > allowed_px && finer != Self { stride: 1, ..self }).then_some(finer)
    }

    /// Steps from node to node.
    pub fn steps(self) -> u32 {
        self.stretches * self.path.steps()
    }

    pub fn with_samples(self, samples_per_px: f64, max_samples: u32) -> BlurStage {
        let Self { path, stretches, stride } = self;
        let nodes = stretches * path.steps() * stride + 1;
        BlurStage { nodes, stride, path, depths: NodeDepths::Each, samples_per_px, max_samples }
    }
}

/// An exposure whose path is to be chosen.
pub(crate) struct ExposedFrame<'a> {
    pub reach: &'a LensReach,
    pub path: &'a CameraPath,
    pub shutter: &'a Shutter,
    pub stamp_s: f64,
    /// Focal length of the ideal frame.
    pub focal_px: DVec2,
    pub motion: Motion,
}

impl ExposedFrame<'_> {
    /// The path with the fewest nodes that is missed by no more than its part of the tolerance; `None` where
    /// the exposure does not show.
    pub fn path(&self, quality: &QualitySpec, skipped: &mut Vec<Skip>) -> Option<ExposurePath> {
        self.shows(quality, skipped).then(|| self.path_within(&ErrorBudget::new(quality)))
    }

    /// Whether the exposure shows.
    fn shows(&self, quality: &QualitySpec, skipped: &mut Vec<Skip>) -> bool {
        if self.shutter.exposure_s() <= 0.0 {
            skipped.push(Skip { what: "motion blur", reason: "camera.shutter.exposure_ms is 0".into() });
            return false;
        }
        let blur_px = self.motion.blur_px;
        if blur_px <= quality.max_error_px.min(SHARP_PX) && quality.blur_samples == Auto::Auto {
            skipped.push(Skip {
                what: "motion blur",
                reason: format!("no path over the exposure is longer than {blur_px:.2e} px"),
            });
            return false;
        }
        true
    }

    /// The path with the fewest nodes that is missed by no more than its part of a tolerance.
    pub fn path_within(&self, budget: &ErrorBudget) -> ExposurePath {
        let allowed_px = budget.exposure_path_px();
        if self.motion.blur_sagitta_px <= allowed_px {
            return ExposurePath::STRAIGHT;
        }
        let of_parabola = |stretches| self.miss_px(PathStage::Parabola, stretches);
        if LEAST_PER_PERIOD * self.periods() <= 2.0 && of_parabola(1) <= allowed_px {
            return ExposurePath { path: PathStage::Parabola, stretches: 1, stride: 1 };
        }
        let path = PathStage::Quartic;
        ExposurePath { path, stretches: self.stretches(path, LEAST_PER_PERIOD, allowed_px), stride: 1 }
    }

    /// With poses so near to each other that straight lines between them miss no more than the path does:
    /// rays at silhouettes take those.
    pub fn with_poses_for_rays(&self, exposure: ExposurePath, quality: &QualitySpec) -> ExposurePath {
        let wanted = self.stretches(
            PathStage::Straight,
            STRAIGHT_PER_PERIOD,
            ErrorBudget::new(quality).exposure_path_px(),
        );
        let steps = exposure.stretches * exposure.path.steps();
        ExposurePath { stride: wanted.div_ceil(steps).min(MOST_STRAIGHT_STEPS / steps).max(1), ..exposure }
    }

    /// Periods of the fastest vibration within the exposure, where it bends the path.
    fn periods(&self) -> f64 {
        self.path.highest_vibration_hz() * self.shutter.longest_exposure_s()
    }

    /// Polynomials of one kind that keep within `allowed_px`, or as many as there may be.
    fn stretches(&self, path: PathStage, per_period: f64, allowed_px: f64) -> u32 {
        let steps = f64::from(path.steps());
        let most = (f64::from(MOST_STEPS) / steps).floor();
        let mut stretches = (per_period * self.periods() / steps).ceil().clamp(1.0, most);
        if path == PathStage::Straight {
            stretches = (self.motion.blur_sagitta_px / allowed_px).sqrt().ceil().clamp(stretches, most);
        }
        // The miss falls with a power of the number, once the stretches are shorter than the bends.
        for _ in 0..4 {
            let miss_px = self.miss_px(path, stretches as u32);
            if miss_px <= allowed_px || stretches >= most {
                break;
            }
            stretches =
                (stretches * more_for(miss_px, allowed_px, path.steps())).ceil().clamp(stretches + 1.0, most);
        }
        stretches as u32
    }

    /// Largest miss, of up to eight polynomials of a few rays, at both depth extremes.
    fn miss_px(&self, path: PathStage, stretches: u32) -> f64 {
        let tried = TRIED.min(stretches);
        let halves = 2 * path.steps();
        let mut worst = 0.0_f64;
        for &(uv, [x, y]) in self.reach.rays.iter().step_by((self.reach.rays.len() / RAYS).max(1)) {
            let mid_s = self.stamp_s + self.shutter.dt_pixel_s(x, y);
            let exposure_s = self.shutter.exposure_pixel_s(x, y);
            let mid = self.path.pose(mid_s);
            for k in (0..tried).map(|k| k * stretches / tried) {
                let pose = |half: u32| {
                    let fraction =
                        (f64::from(k) + f64::from(half) / f64::from(halves)) / f64::from(stretches);
                    self.path.pose(mid_s + exposure_s * (fraction - 0.5)).relative_to(&mid)
                };
                let poses: Vec<(DMat3, DVec3)> = (0..=halves).map(pose).collect();
                for w in [0.0, 1.0 / self.motion.nearest_m] {
                    let position = |(rotation, shift): &(DMat3, DVec3)| {
                        let p = *rotation * uv.extend(1.0) + w * *shift;
                        (p.z > 0.02).then(|| self.focal_px * p.truncate() / p.z)
                    };
                    let positions: Option<Vec<DVec2>> = poses.iter().map(position).collect();
                    worst = worst.max(positions.map_or(0.0, |positions| miss_of(&positions)));
                }
            }
        }
        worst
    }
}

/// How many times more polynomials a path takes that is missed by more than is allowed.
fn more_for(miss_px: f64, allowed_px: f64, steps: u32) -> f64 {
    (margins::PATH_MISS * miss_px / allowed_px).powf(f64::from(steps + 1).recip())
}

/// Whether nodes that are so many steps apart over an exposure of so many periods of the fastest vibration
/// may all meet it alike.
pub(crate) fn may_alias(steps: u32, periods: f64) -> bool {
    f64::from(steps) < LEAST_PER_PERIOD * periods
}

/// How far the path over the exposure is from its polynomials, given where it is at a fraction of the exposure
/// (0 to 1): at one such fraction.
pub(crate) fn miss_at_px(
    path: PathStage,
    stretches: u32,
    fraction: f64,
    mut position: impl FnMut(f64) -> DVec2,
) -> f64 {
    let along = fraction * f64::from(stretches);
    let k = along.floor().min(f64::from(stretches) - 1.0);
    let node = |j: u32| (k + f64::from(j) / f64::from(path.steps())) / f64::from(stretches);
    let nodes: Vec<DVec2> = (0..=path.steps()).map(|j| position(node(j))).collect();
    let px = Curve::through(&nodes).at((along - k) * f64::from(path.steps())).distance(position(fraction));
    if px.is_finite() { px } else { 0.0 }
}

/// How far polynomial `k` of the path over the exposure is from the path itself, given where that is at a
/// fraction of the exposure (0 to 1).
pub(crate) fn miss_px(path: PathStage, stretches: u32, k: u32, position: impl FnMut(f64) -> DVec2) -> f64 {
    let halves = 2 * path.steps();
    let fraction = |half: u32| (f64::from(k) + f64::from(half) / f64::from(halves)) / f64::from(stretches);
    let positions: Vec<DVec2> = (0..=halves).map(fraction).map(position).collect();
    let miss_px = miss_of(&positions);
    if miss_px.is_finite() { miss_px } else { 0.0 }
}

/// How far the polynomial through every second position is from the positions between them, where it is off by at
/// least nine tenths of the most that it is.
fn miss_of(positions: &[DVec2]) -> f64 {
    let nodes: Vec<DVec2> = positions.iter().copied().step_by(2).collect();
    let curve = Curve::through(&nodes);
    let between = positions.iter().enumerate().skip(1).step_by(2);
    between.map(|(half, position)| curve.at(0.5 * half as f64).distance(*position)).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missed_path_gets_more_nodes_up_to_the_most() {
        let quality = QualitySpec { max_error_px: 0.05, ..QualitySpec::default() };
        let budget = ErrorBudget::new(&quality);
        let allowed_px = budget.exposure_path_px();
        let finer = |exposure: ExposurePath, miss_px: f64| exposure.finer(miss_px, &budget);
        assert_eq!(finer(ExposurePath::STRAIGHT, 0.5 * allowed_px), None);
        let quartic = ExposurePath { path: PathStage::Quartic, stretches: 1, stride: 1 };
        assert_eq!(finer(ExposurePath::STRAIGHT, 1.0), Some(quartic));
        assert_eq!(finer(ExposurePath { path: PathStage::Parabola, ..quartic }, 1.0), Some(quartic));
        // 0.8 px are 32 times what is allowed, and the miss falls with the fifth power of the stretches: 2
        // would do, but for a margin.
        assert_eq!(finer(quartic, 32.0 * allowed_px), Some(ExposurePath { stretches: 3, ..quartic }));
        let most = ExposurePath { stretches: MOST_STEPS / 4, ..quartic };
        assert_eq!((finer(quartic, 1e12), finer(most, 1e12)), (Some(most), None));
    }

    #[test]
    fn aliased_nodes_are_found_at_other_instants() {
        // Thirty periods: both ends, and the middle between them, are at rest.
        let swing =
            |fraction: f64| DVec2::new(2.0 * fraction, 0.7 * (30.0 * std::f64::consts::TAU * fraction).sin());
        assert!(
            miss_px(PathStage::Straight, 1, 0, swing) < 1e-12 && may_alias(1, 30.0) && !may_alias(120, 30.0)
        );
        let misses: Vec<f64> = (1..=128)
            .map(|i| {
                miss_at_px(PathStage::Straight, 1, (0.618_033_988_749_895 * f64::from(i)).fract(), swing)
            })
            .collect();
        let (most, mean2) = (
            misses.iter().copied().fold(0.0, f64::max),
            misses.iter().map(|px| px * px).sum::<f64>() / 128.0,
        );
        assert!(
            (most / 0.7 - 1.0).abs() < 0.01 && (mean2.sqrt() / (0.7 * 0.5_f64.sqrt()) - 1.0).abs() < 0.02,
            "{most} {mean2}"
        );
        // With nodes enough it is that of the polynomials, wherever one looks.
        let fine = (0..=200)
            .map(|i| miss_at_px(PathStage::Quartic, 60, f64::from(i) / 200.0, swing))
            .fold(0.0, f64::max);
        let known = (0..60).map(|k| miss_px(PathStage::Quartic, 60, k, swing)).fold(0.0, f64::max);
        assert!(fine > 0.5 * known && fine < 1.2 * known, "{fine:.2e} {known:.2e}");
    }

    #[test]
    fn the_largest_miss_is_found() {
        for path in PathStage::ALL {
            let swing = |fraction: f64| DVec2::new(10.0 * fraction, (2.5 * fraction + 0.4).sin());
            let stretches = 2;
            let found = (0..stretches).map(|k| miss_px(path, stretches, k, swing)).fold(0.0, f64::max);
            let steps = path.steps();
            let mut largest = 0.0_f64;
            for k in 0..stretches {
                let at = |t: f64| swing((f64::from(k) + t / f64::from(steps)) / f64::from(stretches));
                let curve = Curve::through(&(0..=steps).map(|j| at(f64::from(j))).collect::<Vec<_>>());
                let positions = (0..=1000).map(|i| f64::from(steps * i) / 1000.0);
                largest = positions.map(|t| curve.at(t).distance(at(t))).fold(largest, f64::max);
            }
            assert!(found <= largest && found > 0.85 * largest, "{path:?}: {found:.3e} of {largest:.3e}");
        }
    }
}
