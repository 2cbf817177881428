//! Lens inverse of the reference: from a pixel to the ideal ray on the principal branch, using nothing but the
//! forward function of the lens and its Jacobian.

use glam::{DMat2, DVec2};
use rayon::prelude::*;

use crate::{lens::Lens, scenario::ImageCircleSpec};

/// Number of directions in which the border of the principal branch is tabulated.
const DIRECTIONS: usize = 1440;
/// Samples along each of these directions, equally spaced in the angle off axis.
const RADIAL_SAMPLES: usize = 400;
/// Largest angle off axis that an ideal image plane can hold: 89 degrees.
const MAX_FIELD_RAD: f64 = 89.0 * std::f64::consts::PI / 180.0;
/// Relative distance from the tabulated border within which a point is tested along its own direction.
const BORDER_BAND: f64 = 0.02;
/// Number of direction bins in the distorted plane that bound where the branch is imaged.
const RIM_BINS: usize = 360;
/// Start points of the inverse along each side of the image.
const STARTS: u32 = 49;
/// Steps of the damped Newton method without real progress.
const MAX_STALLS: u32 = 5;
/// Largest residual of an accepted root, in units of the focal length (relative beyond 1).
const RESIDUAL: f64 = 1e-11;

/// Intrinsics at one zoom value, prepared for the inverse.
#[derive(Debug)]
pub(super) struct LensInverse {
    size_px: [u32; 2],
    focal_px: DVec2,
    principal_px: DVec2,
    lens: Lens,
    plain: bool,
    /// Ideal radius at which the branch ends, by direction of the ideal point.
    border: Vec<f64>,
    border_min: f64,
    /// Bound on the distorted radius of the branch, by direction of the distorted point.
    rim: Vec<f64>,
    /// Ideal points of a coarse grid over the image, as starts of the inverse.
    starts: Vec<Option<DVec2>>,
    circle: ImageCircleSpec,
    /// The lenses of red and blue, where these are others.
    pub(super) others: Option<Box<[Self; 2]>>,
}

impl LensInverse {
    pub(super) fn new(size_px: [u32; 2], focal_px: [f64; 2], principal_px: [f64; 2], lens: Lens) -> Self {
        let mut lens = Self {
            size_px,
            focal_px: focal_px.into(),
            principal_px: principal_px.into(),
            plain: matches!(lens, Lens::Pinhole(_)),
            lens,
            border: Vec::new(),
            border_min: f64::INFINITY,
            rim: Vec::new(),
            starts: Vec::new(),
            circle: ImageCircleSpec::default(),
            others: None,
        };
        if !lens.plain && !lens.is_face() {
            lens.border = (0..DIRECTIONS)
                .into_par_iter()
                .map(|direction_index| lens.end_of_branch(direction(direction_index)))
                .collect();
            lens.border_min = lens.border.iter().copied().fold(f64::INFINITY, f64::min);
            lens.rim = lens.find_rim();
            lens.starts = (0..STARTS * STARTS)
                .into_par_iter()
                .map(|i| lens.solve_from_nothing(lens.distorted(lens.start_px(i))))
                .collect();
        }
        lens
    }

    pub(super) fn within(self, circle: &ImageCircleSpec) -> Self {
        Self { circle: circle.clone(), ..self }
    }

    /// Ideal `(u, v)` at an image position; `None` without a pre-image on the principal branch.
    pub(super) fn ray(&self, position_px: DVec2) -> Option<DVec2> {
        let wanted = self.distorted(position_px);
        if self.plain {
            return wanted.is_finite().then_some(wanted);
        }
        if self.is_face() {
            return self.polish(self.lens.undistort(wanted)?, wanted);
        }
        if !self.may_be_imaged(wanted) {
            return None;
        }
        let cell = (position_px + 0.5) / DVec2::from(self.size_px.map(f64::from)) * f64::from(STARTS - 1);
        let [i, j] = [cell.x, cell.y].map(|c| c.round().clamp(0.0, f64::from(STARTS - 1)) as usize);
        let near = self.starts.get(j * STARTS as usize + i).copied().flatten();
        near.and_then(|start| self.polish(start, wanted)).or_else(|| self.solve_from_nothing(wanted))
    }

    /// Ideal `(u, v)` of a position in a pixel that this camera makes.
    pub(super) fn ray_of(&self, pixel: [u32; 2], offset_px: DVec2) -> Option<DVec2> {
        let pixel = DVec2::from_array(pixel.map(f64::from));
        if self.holds(pixel) { self.ray(pixel + offset_px) } else { None }
    }

    /// Whether the pixel is one that this camera makes, and not another face, or none.
    pub(super) fn holds(&self, pixel: DVec2) -> bool {
        self.lens.holds(self.distorted(pixel))
            && self.is_near(pixel)
            // A face's lens ends at the angle by itself.
            && (self.is_face()
                || self.circle.half_angle_deg.is_none()
                || self.ray(pixel).is_some_and(|ideal| self.is_steep(ideal)))
    }

    fn is_near(&self, pixel: DVec2) -> bool {
        let centre_px = self.circle.centre_px.map_or(self.principal_px, DVec2::from);
        // A distance that is the radius to within rounding is.
        self.circle.radius_px.is_none_or(|radius_px| pixel.distance(centre_px) <= radius_px + 1e-9)
    }

    fn is_steep(&self, ideal: DVec2) -> bool {
        self.circle.half_angle_deg.is_none_or(|most_deg| ideal.length().atan().to_degrees() <= most_deg)
    }

    /// The branch of a face is that of its whole lens, whose certified inverse gives the start.
    fn is_face(&self) -> bool {
        self.lens.face().is_some()
    }

    /// Pixel at which an ideal ray is imaged; `None` beyond the principal branch.
    pub(super) fn image(&self, ideal: DVec2) -> Option<DVec2> {
        let is_imaged = match self.is_face() {
            true => self.lens.contains(ideal),
            false => ideal.is_finite() && (self.plain || self.inside(ideal)),
        };
        let pixel = || self.lens.distort(ideal) * self.focal_px + self.principal_px;
        let is_seen = |pixel: &DVec2| self.is_near(*pixel) && (self.is_face() || self.is_steep(ideal));
        is_imaged.then(pixel).filter(is_seen)
    }

    fn distorted(&self, position_px: DVec2) -> DVec2 {
        (position_px - self.principal_px) / self.focal_px
    }

    fn start_px(&self, i: u32) -> DVec2 {
        let fraction = DVec2::new(f64::from(i % STARTS), f64::from(i / STARTS)) / f64::from(STARTS - 1);
        fraction * DVec2::from(self.size_px.map(f64::from)) - 0.5
    }

    /// Plain Newton iteration, for starts near the root.
    fn polish(&self, start: DVec2, wanted: DVec2) -> Option<DVec2> {
        let mut ideal = start;
        for _ in 0..8 {
            let error = self.lens.distort(ideal) - wanted;
            let step = solve(self.lens.jacobian(ideal), error)?;
            ideal -= step;
            if step.length_squared() < 1e-24 * (1.0 + ideal.length_squared()) {
                return self.accept(ideal, wanted);
            }
        }
        self.accept(ideal, wanted)
    }

    /// Continuation from the axis along the straight line of distorted points to the wanted one, step by step
    /// on the branch. If that line leaves the image of the branch or ends at its border, damped Newton
    /// iterations from starts all over the branch.
    fn solve_from_nothing(&self, wanted: DVec2) -> Option<DVec2> {
        if !self.may_be_imaged(wanted) {
            return None;
        }
        if let Some(found) = self.continue_from_axis(wanted) {
            return Some(found);
        }
        let starts = (0..12).flat_map(|k| [0.5, 0.9].map(|fraction| (k * DIRECTIONS / 12, fraction)));
        starts.into_iter().find_map(|(direction_index, fraction)| {
            let start = direction(direction_index) * (fraction * self.border[direction_index].min(20.0));
            self.accept(self.descend(start, wanted), wanted)
        })
    }

    fn continue_from_axis(&self, wanted: DVec2) -> Option<DVec2> {
        let (mut at, mut gone, mut stride) = (DVec2::ZERO, 0.0_f64, 0.25_f64);
        while gone < 1.0 {
            let next = (gone + stride).min(1.0);
            let ahead =
                solve(self.lens.jacobian(at), self.lens.distort(at) - next * wanted).map(|step| at - step);
            let landed = ahead.filter(|p| self.within_table(*p)).and_then(|p| self.correct(p, next * wanted));
            match landed.filter(|p| self.within_table(*p) && p.distance(at) < 0.5 * (0.2 + at.length())) {
                Some(p) => {
                    (at, gone) = (p, next);
                    stride *= 2.0;
                }
                None => stride *= 0.5,
            }
            if stride < 1e-4 {
                break;
            }
        }
        self.accept(self.descend(at, wanted), wanted)
    }

    /// A few Newton steps, which must converge at once.
    fn correct(&self, start: DVec2, wanted: DVec2) -> Option<DVec2> {
        let mut ideal = start;
        let mut before = f64::INFINITY;
        for _ in 0..5 {
            let error = self.lens.distort(ideal) - wanted;
            let size = error.length();
            if size < 1e-9 {
                return Some(ideal);
            }
            // Also true if the formula gives no number.
            if size.is_nan() || size >= 0.5 * before {
                return None;
            }
            before = size;
            ideal -= solve(self.lens.jacobian(ideal), error)?;
        }
        None
    }

    /// Damped Newton iteration that stays on the branch and never lets the residual grow.
    fn descend(&self, start: DVec2, wanted: DVec2) -> DVec2 {
        let mut ideal = start;
        let mut error = self.lens.distort(ideal) - wanted;
        let (mut stalls, mut goal) = (0, 0.25 * error.length());
        for _ in 0..80 {
            // A root, even a double one at the border, is approached by at least a factor of four per step.
            // Slower progress means that the iteration slides along the border.
            stalls += 1;
            if error.length() < goal {
                (stalls, goal) = (0, 0.25 * error.length());
            } else if stalls > MAX_STALLS {
                break;
            }
            let Some(mut step) = solve(self.lens.jacobian(ideal), error) else { break };
            let mut moved = None;
            for _ in 0..30 {
                let next = ideal - step;
                if self.within_table(next) {
                    let next_error = self.lens.distort(next) - wanted;
                    if next_error.length_squared() < error.length_squared() {
                        moved = Some((next, next_error));
                        break;
                    }
                }
                step *= 0.5;
            }
            let Some((next, next_error)) = moved else { break };
            (ideal, error) = (next, next_error);
        }
        ideal
    }

    fn accept(&self, at: DVec2, wanted: DVec2) -> Option<DVec2> {
        let residual = (self.lens.distort(at) - wanted).length();
        let is_on_branch = self.is_face() || self.regular(at) && self.inside(at);
        (residual <= RESIDUAL * (1.0 + wanted.length()) && is_on_branch).then_some(at)
    }

    /// On the sheet of the axis both eigenvalues of the Jacobian are positive.
    fn regular(&self, ideal: DVec2) -> bool {
        let jacobian = self.lens.jacobian(ideal);
        jacobian.determinant() > 0.0 && jacobian.x_axis.x + jacobian.y_axis.y > 0.0
    }

    /// Whether the branch is regular everywhere between the axis and a point.
    fn inside(&self, ideal: DVec2) -> bool {
        let radius = ideal.length();
        if radius < (1.0 - BORDER_BAND) * self.border_min {
            return true;
        }
        let border = self.border_at(ideal);
        if radius < (1.0 - BORDER_BAND) * border {
            return true;
        }
        radius < (1.0 + BORDER_BAND) * border && radius < self.end_of_branch(ideal.normalize_or_zero())
    }

    fn within_table(&self, ideal: DVec2) -> bool {
        let radius = ideal.length();
        radius < (1.0 - BORDER_BAND) * self.border_min || radius < self.border_at(ideal)
    }

    fn border_at(&self, ideal: DVec2) -> f64 {
        let turn = ideal.y.atan2(ideal.x).rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU
            * DIRECTIONS as f64;
        let direction_index = turn as usize;
        self.border[direction_index % DIRECTIONS].min(self.border[(direction_index + 1) % DIRECTIONS])
    }

    /// Ideal radius along a direction at which determinant or trace of the Jacobian first reach zero.
    fn end_of_branch(&self, direction: DVec2) -> f64 {
        let point = |angle: f64| direction * angle.tan();
        let margin = |angle: f64| {
            let jacobian = self.lens.jacobian(point(angle));
            let (det, trace) = (jacobian.determinant(), jacobian.x_axis.x + jacobian.y_axis.y);
            if trace > 0.0 { det } else { -det.abs() }
        };
        let step = MAX_FIELD_RAD / RADIAL_SAMPLES as f64;
        let ends_between = |mut good: f64, mut bad: f64| {
            for _ in 0..55 {
                let middle = 0.5 * (good + bad);
                if margin(middle) > 0.0 { good = middle } else { bad = middle }
            }
            good.tan()
        };
        let (mut before, mut last) = (f64::INFINITY, margin(0.0));
        for look in 1..=RADIAL_SAMPLES {
            let angle = look as f64 * step;
            let here = margin(angle);
            if here.is_nan() || here <= 0.0 {
                return ends_between(angle - step, angle);
            }
            if last < here && last <= before {
                // A local minimum may be below zero between two samples.
                let floor = lowest((angle - 2.0 * step).max(0.0), angle, margin);
                let at_floor = margin(floor);
                if at_floor.is_nan() || at_floor <= 0.0 {
                    return ends_between((angle - 2.0 * step).max(0.0), floor);
                }
            }
            (before, last) = (last, here);
        }
        MAX_FIELD_RAD.tan()
    }

    /// Bound on the distorted radius by direction. The image of the border encloses that of the branch; a
    /// chord between neighbouring images deviates from the arc by 2e-6 of its radius.
    fn find_rim(&self) -> Vec<f64> {
        let mut rim = vec![0.0_f64; RIM_BINS];
        let images: Vec<DVec2> = self
            .border
            .iter()
            .enumerate()
            .map(|(direction_index, radius)| {
                self.lens.distort(direction(direction_index) * (radius * (1.0 - 1e-9)))
            })
            .collect();
        for (i, image) in images.iter().enumerate() {
            // Every bin between two neighbouring images takes the farther one.
            let next = images[(i + 1) % images.len()];
            let reach = (1.0 + 1e-4) * image.length().max(next.length());
            if !reach.is_finite() {
                return vec![f64::INFINITY; RIM_BINS];
            }
            let (from, to) = (rim_bin(*image), rim_bin(next));
            let forward = (to + RIM_BINS - from) % RIM_BINS;
            let (first, count) =
                if forward <= RIM_BINS / 2 { (from, forward) } else { (to, RIM_BINS - forward) };
            for bin in first + RIM_BINS - 1..=first + RIM_BINS + count + 1 {
                rim[bin % RIM_BINS] = rim[bin % RIM_BINS].max(reach);
            }
        }
        rim
    }

    fn may_be_imaged(&self, wanted: DVec2) -> bool {
        wanted.is_finite() && wanted.length() <= self.rim[rim_bin(wanted)]
    }
}

fn direction(direction_index: usize) -> DVec2 {
    DVec2::from_angle(direction_index as f64 * std::f64::consts::TAU / DIRECTIONS as f64)
}

fn rim_bin(distorted: DVec2) -> usize {
    let turn = distorted.y.atan2(distorted.x).rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU;
    (turn * RIM_BINS as f64) as usize % RIM_BINS
}

/// `J^-1 e`; `None` if J is singular or not finite.
fn solve(jacobian: DMat2, error: DVec2) -> Option<DVec2> {
    let det = jacobian.determinant();
    let (a, c, b, d) = (jacobian.x_axis.x, jacobian.x_axis.y, jacobian.y_axis.x, jacobian.y_axis.y);
    let step = DVec2::new(d * error.x - b * error.y, a * error.y - c * error.x) / det;
    step.is_finite().then_some(step)
}

/// Position of the minimum of a unimodal function in an interval, by ternary search.
fn lowest(mut low: f64, mut high: f64, value: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..60 {
        let third = (high - low) / 3.0;
        if value(low + third) < value(high - third) { high -= third } else { low += third }
    }
    0.5 * (low + high)
}
