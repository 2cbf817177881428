//! The border of a lens's principal branch.

use std::f64::consts::{PI, TAU};

use glam::DVec2;

/// Number of rays of a fold curve.
pub const FOLD_RAYS: usize = 720;

/// Largest angle off axis of any lens, 89 degrees. The ideal plane is infinite at 90 degrees, and a flat
/// ideal frame ends well before.
pub(crate) const MAX_FIELD_RAD: f64 = 89.0 * PI / 180.0;

/// Steps of the scan along a ray, uniform in the angle off axis.
const SCAN_STEPS: usize = 256;

/// Bisections of a search: 60 halvings of a step reach the last bit of an f64.
const BISECTIONS: usize = 60;

/// Neighbouring rays whose radii differ by more than this ratio belong to different sheets of the fold; the
/// smaller radius holds between them.
const SHEET_RATIO: f64 = 1.1;

/// Radius of the border of the principal branch's star-shaped domain, by direction in the ideal plane.
#[derive(Clone, Debug, PartialEq)]
pub struct FoldCurve {
    radii: Vec<f64>,
    folds: bool,
    distorted_max: f64,
    smallest: f64,
}

impl FoldCurve {
    /// The curve from one radius per ray (`None`: regular up to [`MAX_FIELD_RAD`]) and the forward function.
    pub(super) fn new(
        radius_of_ray: impl Fn(f64) -> Option<f64>,
        same_for_all: bool,
        distort: impl Fn(DVec2) -> DVec2,
    ) -> Self {
        Self::with_limit(radius_of_ray, MAX_FIELD_RAD.tan(), same_for_all, distort)
    }

    /// As [`Self::new`]; rays that are regular everywhere end at `limit`.
    pub(super) fn with_limit(
        radius_of_ray: impl Fn(f64) -> Option<f64>,
        limit: f64,
        same_for_all: bool,
        distort: impl Fn(DVec2) -> DVec2,
    ) -> Self {
        let angle = |ray: usize| ray as f64 * TAU / FOLD_RAYS as f64;
        let rays: Vec<Option<f64>> = if same_for_all {
            vec![radius_of_ray(0.0); FOLD_RAYS]
        } else {
            (0..FOLD_RAYS).map(|ray| radius_of_ray(angle(ray))).collect()
        };
        let folds = rays.iter().any(Option::is_some);
        let radii: Vec<f64> = rays.into_iter().map(|radius| radius.unwrap_or(limit)).collect();
        // Slightly inside, because the forward function is infinite at a pole of the denominator.
        let distorted_max = radii
            .iter()
            .enumerate()
            .map(|(ray, radius)| distort(DVec2::from_angle(angle(ray)) * (radius * (1.0 - 1e-9))).length())
            .fold(0.0, |max: f64, radius| if radius.is_nan() { f64::INFINITY } else { max.max(radius) });
        let smallest = radii.iter().copied().fold(f64::INFINITY, f64::min);
        Self { radii, folds, distorted_max, smallest }
    }

    /// Radius in direction `phi` (radians from +u towards +v), linear between rays.
    pub fn radius(&self, phi_rad: f64) -> f64 {
        let position = (phi_rad / TAU).rem_euclid(1.0) * FOLD_RAYS as f64;
        let ray = position.floor();
        let (here, next) = (self.radii[ray as usize % FOLD_RAYS], self.radii[(ray as usize + 1) % FOLD_RAYS]);
        let (near, far) = (here.min(next), here.max(next));
        if far > SHEET_RATIO * near { near } else { here + (next - here) * (position - ray) }
    }

    /// Smaller and larger radius of the two rays about a direction.
    pub(super) fn neighbours(&self, phi_rad: f64) -> (f64, f64) {
        let ray = ((phi_rad / TAU).rem_euclid(1.0) * FOLD_RAYS as f64) as usize;
        let (here, next) = (self.radii[ray % FOLD_RAYS], self.radii[(ray + 1) % FOLD_RAYS]);
        (here.min(next), here.max(next))
    }

    /// Whether the two rays about a direction end on different sheets.
    pub(super) fn has_sheets(&self, phi_rad: f64) -> bool {
        let (near, far) = self.neighbours(phi_rad);
        far > SHEET_RATIO * near
    }

    /// Smallest radius.
    pub fn smallest(&self) -> f64 {
        self.smallest
    }

    /// Radii of all rays; ray i points to `phi = i 2 pi / FOLD_RAYS`.
    pub fn radii(&self) -> &[f64] {
        &self.radii
    }

    /// Whether any ray ends at a fold or pole; if not, all end at `MAX_FIELD_RAD`.
    pub fn folds(&self) -> bool {
        self.folds
    }

    /// Smallest and largest radius.
    pub fn range(&self) -> (f64, f64) {
        self.radii
            .iter()
            .fold((f64::INFINITY, 0.0), |(min, max), radius| (min.min(*radius), max.max(*radius)))
    }

    /// Bound on the distorted radius of the branch. (Inside the fold the lens is an open map, so the farthest
    /// image is that of a border point; a margin of 0.1 % covers the border between rays.)
    pub fn distorted_max(&self) -> f64 {
        self.distorted_max * 1.001
    }
}

/// First angle of a ray, up to [`MAX_FIELD_RAD`], at which one of the margins is not positive.
pub(super) fn first_irregular_angle(at: impl Fn(f64) -> [f64; 2]) -> Option<f64> {
    first_irregular(MAX_FIELD_RAD, at)
}

/// First parameter of a ray in `(0, limit]` at which one of the margins is not positive.
///
/// `at(parameter)` returns two functions that are positive on the regular part. They are sampled at
/// [`SCAN_STEPS`] parameters; a dip below zero between two samples is found by searching every local minimum.
pub(super) fn first_irregular(limit: f64, at: impl Fn(f64) -> [f64; 2]) -> Option<f64> {
    let step = limit / SCAN_STEPS as f64;
    // Written so that NaN counts as irregular.
    let regular = |angle: f64| at(angle).iter().all(|margin| *margin > 0.0);
    let mut before_last = at(0.0);
    let mut last = before_last;
    for i in 1..=SCAN_STEPS {
        let angle = i as f64 * step;
        if !regular(angle) {
            return Some(bisect(angle - step, angle, regular));
        }
        let here = at(angle);
        for margin in 0..2 {
            if last[margin] < here[margin] && last[margin] <= before_last[margin] {
                let lowest = minimum(angle - 2.0 * step, angle, |angle| at(angle)[margin]);
                if !regular(lowest) {
                    return Some(bisect((angle - 2.0 * step).max(0.0), lowest, regular));
                }
            }
        }
        (before_last, last) = (last, here);
    }
    None
}

/// The last regular parameter before `bad`.
fn bisect(mut good: f64, mut bad: f64, regular: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (good + bad);
        if regular(middle) {
            good = middle;
        } else {
            bad = middle;
        }
    }
    good
}

/// Position of the minimum of a unimodal function in `[low, high]` (golden section, 40 steps).
fn minimum(low: f64, high: f64, value: impl Fn(f64) -> f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let (mut low, mut high) = (low.max(0.0), high);
    for _ in 0..40 {
        let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if value(a) < value(b) {
            high = b;
        } else {
            low = a;
        }
    }
    0.5 * (low + high)
}
