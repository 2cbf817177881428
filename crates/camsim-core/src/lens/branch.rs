//! The principal branch of a map of the plane, and its certified inverse.
//!
//! The branch is the star-shaped domain about the origin in which the determinant has the sign that it has
//! there: along every ray it ends at the first zero of the determinant or of the map's margin. Where the image of
//! the border is a simple curve, the map is one-to-one within, so a point that is inside and reproduces the
//! image is *the* inverse.

use std::f64::consts::TAU;

use glam::{DMat2, DVec2};

use super::fold::{FOLD_RAYS, FoldCurve, first_irregular};

/// Most Newton steps. Near a fold the root is nearly double and each step only halves the error: 60 reach the
/// last bit.
const MAX_STEPS: usize = 60;
/// Steps without real progress after which the iteration is given up.
const MAX_STALLS: u32 = 5;
/// Largest residual of a solution, in units of the focal length (relative beyond 1).
const MAX_RESIDUAL: f64 = 1e-9;
/// Relative distance from the tabulated border within which a point is tested along its own direction.
const BORDER_BAND: f64 = 0.01;
/// Cells along a side of the table of starts.
const CELLS: usize = 96;
/// Directions and radii at which the branch is sampled for starts.
const SAMPLES: [usize; 2] = [240, 160];
/// Sectors in which the reach of the branch's image is tabulated.
const SECTORS: usize = 360;
/// Radii of starts elsewhere, as fractions of the border's, and their directions.
const ELSEWHERE: (&[f64], usize) = (&[0.5, 0.97], 8);
/// The same for a long search.
const EVERYWHERE: (&[f64], usize) = (&[0.97, 0.5, 0.25, 0.75, 0.9, 0.99, 0.998], 48);
/// Distance from the rim's polygon, relative beyond 1, within which the rim itself may pass on the other side.
const BESIDE_RIM: f64 = 5e-3;
/// Largest deviation of the rim from its polygon, as a fraction of a side.
const SAG: f64 = 0.25;

/// A smooth map of the plane.
pub(super) trait ChartMap {
    fn value(&self, at: DVec2) -> DVec2;
    fn jacobian(&self, at: DVec2) -> DMat2;
    /// Positive where the map is defined.
    fn margin(&self, at: DVec2) -> f64;

    /// Two functions that are positive on the principal branch.
    fn margins(&self, at: DVec2) -> [f64; 2] {
        [self.jacobian(at).determinant(), self.margin(at)]
    }
}

/// Border, starts and reach of a branch.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Branch {
    limit: f64,
    border: FoldCurve,
    centre: DVec2,
    /// Where the iteration starts, by cell of the image.
    starts: Vec<DVec2>,
    /// Largest distance of an image from that of the origin, by direction.
    reach: Vec<f64>,
    /// Image of the border, a polygon; empty if it is not finite.
    rim: Vec<DVec2>,
}

impl Branch {
    /// The branch within a radius of the chart. Where the map would not be one-to-one there, its limit is smaller,
    /// but not below `least`.
    pub(super) fn new(map: &impl ChartMap, limit: f64, least: f64) -> Self {
        let radius = |phi: f64| end_of_branch(map, DVec2::from_angle(phi), limit);
        let value = |at: DVec2| map.value(at);
        let mut border = FoldCurve::with_limit(radius, limit, false, value);
        let limit = one_to_one_limit(map, &border, limit, least);
        if border.range().1 > limit {
            let whole = border.clone();
            // Of its rays: between two sheets the curve has the smaller radius, and phi is rounded.
            let of_ray =
                |phi: f64| whole.radii()[(phi / TAU * FOLD_RAYS as f64).round() as usize % FOLD_RAYS];
            border = FoldCurve::with_limit(|phi| Some(of_ray(phi).min(limit)), limit, false, value);
        }
        let centre = map.value(DVec2::ZERO);
        let starts = starts(map, &border);
        let mut rim = border_images(map, &border, f64::INFINITY);
        let reach = reach(&rim, centre);
        if !rim.iter().all(|image| image.is_finite()) {
            rim.clear();
        }
        Self { limit, border, centre, starts, reach, rim }
    }

    /// Smallest radius of the branch.
    pub(super) fn radius_min(&self) -> f64 {
        self.border.smallest()
    }

    /// Largest radius of the branch.
    pub(super) fn radius_max(&self) -> f64 {
        self.border.range().1
    }

    /// Radius of the branch in a direction; exact on the rays of a fold curve.
    pub(super) fn radius(&self, phi_rad: f64) -> f64 {
        self.border.radius(phi_rad)
    }

    /// The image of the border, a polygon; empty if it is not finite.
    pub(super) fn rim(&self) -> &[DVec2] {
        &self.rim
    }

    /// Whether a point of the chart is inside.
    pub(super) fn contains(&self, map: &impl ChartMap, at: DVec2) -> bool {
        let radius = at.length();
        if radius < (1.0 - BORDER_BAND) * self.border.smallest() {
            return true;
        }
        let (near, far) = self.border.neighbours(at.y.atan2(at.x));
        if radius < (1.0 - BORDER_BAND) * near {
            return true;
        }
        // Also false for NaN.
        if !at.is_finite() || radius > (1.0 + BORDER_BAND) * far || radius > self.limit {
            return false;
        }
        end_of_branch(map, at / radius, self.limit).is_none_or(|end| radius < end)
    }

    /// The point inside with a given image.
    pub(super) fn solve(&self, map: &impl ChartMap, image: DVec2) -> Option<DVec2> {
        let from_centre = image - self.centre;
        if !image.is_finite() || from_centre.length() > self.reach[sector(from_centre)] {
            return None;
        }
        let cell = cell_of(image);
        if let Some(found) = self.newton(map, image, self.starts[index(cell)]) {
            return Some(found);
        }
        let pre_images = self.pre_images(image);
        if pre_images == Some(0) {
            return None;
        }
        let newton = |start: DVec2| {
            self.newton(map, image, start)
                .or_else(|| self.newton(map, image, self.approach(map, image, start)))
        };
        let near = [[0, 1], [2, 1], [1, 0], [1, 2], [0, 0], [2, 0], [0, 2], [2, 2]].map(|step| {
            let [x, y] = [0, 1].map(|i| (cell[i] + step[i]).saturating_sub(1).min(CELLS - 1));
            self.starts[index([x, y])]
        });
        // Where there is one for sure, it is worth a long search.
        let (fractions, directions) = if pre_images.is_some() { EVERYWHERE } else { ELSEWHERE };
        let elsewhere = (0..directions).flat_map(|k| {
            let phi = k as f64 * TAU / directions as f64;
            fractions
                .iter()
                .map(move |fraction| DVec2::from_angle(phi) * (fraction * self.border.radius(phi)))
        });
        [self.starts[index(cell)]].into_iter().chain(near).chain(elsewhere).find_map(newton)
    }

    /// Number of points of the branch with an image, by how often the rim winds about it; `None` beside the rim.
    fn pre_images(&self, image: DVec2) -> Option<i32> {
        let mut turns = 0;
        let mut clear = f64::INFINITY;
        for (a, b) in self.rim.iter().zip(self.rim.iter().cycle().skip(1)) {
            let (along, to_image) = (*b - *a, image - *a);
            let fraction = (to_image.dot(along) / along.length_squared().max(1e-300)).clamp(0.0, 1.0);
            // The rim between two corners may pass beside the straight line by a fraction of its length.
            clear = clear.min((to_image - along * fraction).length() - SAG * along.length());
            let left = along.perp_dot(to_image);
            if a.y <= image.y && b.y > image.y && left > 0.0 {
                turns += 1;
            } else if a.y > image.y && b.y <= image.y && left < 0.0 {
                turns -= 1;
            }
        }
        let is_sure = clear > BESIDE_RIM * (1.0 + image.length()) && !self.rim.is_empty();
        is_sure.then_some(turns)
    }

    /// Guarded Newton iteration: each step is pulled back where it would leave the branch, and halved where the
    /// residual grew.
    fn newton(&self, map: &impl ChartMap, image: DVec2, start: DVec2) -> Option<DVec2> {
        let mut at = start;
        let mut error = map.value(at) - image;
        let mut stalls = 0;
        for _ in 0..MAX_STEPS {
            let mut step = solve_linear(map.jacobian(at), -error)?;
            let mut next = self.inside(map, at, at + step);
            let mut next_error = map.value(next) - image;
            for _ in 0..20 {
                if next_error.length_squared() <= error.length_squared() {
                    break;
                }
                step *= 0.5;
                next = self.inside(map, at, at + step);
                next_error = map.value(next) - image;
            }
            let (before, after) = (error.length_squared(), next_error.length_squared());
            // Not even a tiny step helps: the branch comes no nearer, or the last bit is reached. Also true if
            // the map gives no number.
            if after.is_nan() || after >= before {
                break;
            }
            (at, error) = (next, next_error);
            // A root, double or not, is approached by at least a factor of four per step; slower progress means
            // that the iteration slides along the border.
            stalls = if after > 0.9 * before { stalls + 1 } else { 0 };
            if stalls == MAX_STALLS {
                break;
            }
        }
        let is_good = error.length() <= MAX_RESIDUAL * (1.0 + image.length())
            && map.jacobian(at).determinant() > 0.0
            && self.contains(map, at);
        is_good.then_some(at)
    }

    /// A point nearer to the solution, by guarded Newton steps on `F / sqrt(1 + |F|^2)`, which is as smooth near a
    /// pole as elsewhere.
    fn approach(&self, map: &impl ChartMap, image: DVec2, start: DVec2) -> DVec2 {
        let flat = |image: DVec2| image / (1.0 + image.length_squared()).sqrt();
        let wanted = flat(image);
        let mut at = start;
        let mut value = map.value(at);
        let mut error = flat(value) - wanted;
        for _ in 0..MAX_STEPS {
            // d flat / d F = (I - f f^T) / sqrt(1 + |F|^2), whose inverse is (I + F F^T) sqrt(1 + |F|^2).
            let full = (error + value * value.dot(error)) * (1.0 + value.length_squared()).sqrt();
            let Some(mut step) = solve_linear(map.jacobian(at), -full) else { return at };
            let mut moved = None;
            for _ in 0..20 {
                let next = self.inside(map, at, at + step);
                let next_value = map.value(next);
                let next_error = flat(next_value) - wanted;
                if next_error.length_squared() < error.length_squared() {
                    moved = Some((next, next_value, next_error));
                    break;
                }
                step *= 0.5;
            }
            let Some(next) = moved else { return at };
            (at, value, error) = next;
        }
        at
    }

    /// `to`, or if that is outside, the point in its direction midway between the radius of `from` and the border.
    fn inside(&self, map: &impl ChartMap, from: DVec2, to: DVec2) -> DVec2 {
        let radius = to.length();
        if radius < self.border.smallest() {
            return to;
        }
        let border = self.border.radius(to.y.atan2(to.x));
        // Between two sheets the curve has the smaller radius, and the branch may reach farther.
        if radius < border || self.border.has_sheets(to.y.atan2(to.x)) && self.contains(map, to) {
            return to;
        }
        to.normalize_or_zero() * (0.5 * (from.length().min(border) + border))
    }
}

/// The largest limit, down to `least`, within which the image of the border is a simple curve.
fn one_to_one_limit(map: &impl ChartMap, border: &FoldCurve, limit: f64, least: f64) -> f64 {
    let is_simple = |limit: f64| {
        let images = border_images(map, border, limit);
        !images.iter().all(|image| image.is_finite()) || is_simple_polygon(&images)
    };
    if limit <= least || is_simple(limit) || !is_simple(least) {
        return limit;
    }
    let (mut low, mut high) = (least, limit);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        *(if is_simple(middle) { &mut low } else { &mut high }) = middle;
    }
    low
}

/// Images of the border's points within a limit, slightly inside: the map is infinite at a pole.
fn border_images(map: &impl ChartMap, border: &FoldCurve, limit: f64) -> Vec<DVec2> {
    let point = |(ray, radius): (usize, &f64)| {
        let phi = ray as f64 * TAU / FOLD_RAYS as f64;
        map.value(DVec2::from_angle(phi) * (radius.min(limit) * (1.0 - 1e-9)))
    };
    border.radii().iter().enumerate().map(point).collect()
}

/// Whether no two sides of a closed polygon cross.
fn is_simple_polygon(corners: &[DVec2]) -> bool {
    let n = corners.len();
    let side = |i: usize| (corners[i], corners[(i + 1) % n]);
    let turn = |a: DVec2, b: DVec2, c: DVec2| (b - a).perp_dot(c - a);
    let cross = |(a, b): (DVec2, DVec2), (c, d): (DVec2, DVec2)| {
        let is_apart = a.max(b).cmplt(c.min(d)).any() || c.max(d).cmplt(a.min(b)).any();
        !is_apart && turn(a, b, c) * turn(a, b, d) < 0.0 && turn(c, d, a) * turn(c, d, b) < 0.0
    };
    (0..n).all(|i| (i + 2..n).all(|j| !cross(side(i), side(j))))
}

fn end_of_branch(map: &impl ChartMap, axis: DVec2, limit: f64) -> Option<f64> {
    first_irregular(limit, |radius| map.margins(axis * radius))
}

/// `J^-1 e`; `None` if J is singular or not finite.
fn solve_linear(jacobian: DMat2, error: DVec2) -> Option<DVec2> {
    let (a, c, b, d) = (jacobian.x_axis.x, jacobian.x_axis.y, jacobian.y_axis.x, jacobian.y_axis.y);
    let step = DVec2::new(d * error.x - b * error.y, a * error.y - c * error.x) / jacobian.determinant();
    step.is_finite().then_some(step)
}

/// For every cell of the image, a point of the branch whose image is near.
fn starts(map: &impl ChartMap, border: &FoldCurve) -> Vec<DVec2> {
    let mut cells: Vec<Option<(f64, DVec2)>> = vec![None; CELLS * CELLS];
    let [directions, radii] = SAMPLES;
    for i in 0..directions * radii {
        let phi = (i / radii) as f64 * TAU / directions as f64;
        let fraction = (i % radii) as f64 / (radii as f64 - 0.999);
        let at = DVec2::from_angle(phi) * (fraction * border.radius(phi));
        let image = map.value(at);
        if !image.is_finite() {
            continue;
        }
        let [x, y] = cell_of(image);
        let off = (squeezed(image) - DVec2::new(x as f64 + 0.5, y as f64 + 0.5)).length_squared();
        let cell = &mut cells[index([x, y])];
        if cell.is_none_or(|(best, _)| off < best) {
            *cell = Some((off, at));
        }
    }
    filled(cells)
}

/// Cells without a sample take that of a neighbour.
fn filled(mut cells: Vec<Option<(f64, DVec2)>>) -> Vec<DVec2> {
    for _ in 0..2 * CELLS {
        let before = cells.clone();
        let mut is_full = true;
        for y in 0..CELLS {
            for x in 0..CELLS {
                if before[index([x, y])].is_none() {
                    let around = [
                        (x > 0).then(|| [x - 1, y]),
                        (x + 1 < CELLS).then(|| [x + 1, y]),
                        (y > 0).then(|| [x, y - 1]),
                        (y + 1 < CELLS).then(|| [x, y + 1]),
                    ];
                    cells[index([x, y])] = around.into_iter().flatten().find_map(|cell| before[index(cell)]);
                    is_full = false;
                }
            }
        }
        if is_full {
            break;
        }
    }
    cells.into_iter().map(|cell| cell.map_or(DVec2::ZERO, |(_, at)| at)).collect()
}

/// The image in units of cells: the whole plane is squeezed into the table.
fn squeezed(image: DVec2) -> DVec2 {
    (image / (1.0 + image.abs()) + 1.0) * (0.5 * CELLS as f64)
}

fn cell_of(image: DVec2) -> [usize; 2] {
    squeezed(image).to_array().map(|cell| (cell as usize).min(CELLS - 1))
}

fn index([x, y]: [usize; 2]) -> usize {
    y * CELLS + x
}

/// The image of the border encloses that of the branch.
fn reach(images: &[DVec2], centre: DVec2) -> Vec<f64> {
    let image = |ray: usize| images[ray % FOLD_RAYS] - centre;
    let mut reach = vec![0.0_f64; SECTORS];
    for ray in 0..FOLD_RAYS {
        let (here, next) = (image(ray), image(ray + 1));
        // A hundredth for the arc between both.
        let far = 1.01 * here.length().max(next.length());
        if !far.is_finite() {
            return vec![f64::INFINITY; SECTORS];
        }
        // Every sector between the two, along the shorter arc, and one more on each side.
        let (from, to) = (sector(here), sector(next));
        let forward = (to + SECTORS - from) % SECTORS;
        let (first, count) = if forward <= SECTORS / 2 { (from, forward) } else { (to, SECTORS - forward) };
        for at in first + SECTORS - 1..=first + SECTORS + count + 1 {
            reach[at % SECTORS] = reach[at % SECTORS].max(far);
        }
    }
    reach
}

fn sector(from_centre: DVec2) -> usize {
    let turn = from_centre.y.atan2(from_centre.x).rem_euclid(TAU) / TAU;
    (turn * SECTORS as f64) as usize % SECTORS
}
