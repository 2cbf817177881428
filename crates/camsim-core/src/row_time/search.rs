//! All solutions of the equation of the row in one field.
//!
//! The miss of a row is the row at which its camera shows the point, less the row itself; a solution is where it
//! is 0. How far the miss can change between two rows is bounded by how far the camera turns and moves between
//! them ([`Field::way_between`]) times the gain of its picture. So of an interval between two rows
//!
//! - nothing is there if both misses have one sign and their sum is more than the miss can change by;
//! - at most one solution is there if the picture moves by less than a row while a row is read;
//! - else each half of it is looked at, down to the intervals from row to row. In these, an extremum is closed in
//!   on by golden section where the change of the travel from row to row lets it reach 0.
//!
//! The bound is exact for what stands still. Of what moves it takes the path between two instants for at most
//! [`OWN_WAY`] times their distance.

use glam::{DVec2, DVec3};

use super::{Field, FrameCamera, ImagePoint, Projection, WorldPoint};
use crate::pose::CameraPose;

/// Intervals that are looked at in any case, and for each turn within the readout of a point that spins.
const INTERVALS: usize = 4;
const INTERVALS_A_TURN: f64 = 12.0;
const MOST_INTERVALS: usize = 64;
/// What gains outside of the picture, and between the positions at which they are known, have beyond those.
const GAIN_RESERVE: f64 = 1.25;
/// Path of a point that moves, as a multiple of the distance between its ends.
const OWN_PATH: f64 = 1.5;
/// Evaluations that close in on a solution between two rows, at most, and the miss that ends them, rows.
const MOST_EVALUATIONS: usize = 40;
const EXACT: f64 = 1e-7;
/// Miss beyond which a change of sign is a jump and no solution, rows.
const JUMP: f64 = 1e-3;
/// Steps of the golden section within a row: to a thousandth of it.
const GOLDEN_STEPS: usize = 15;
const GOLDEN: f64 = 0.618_033_988_749_894_9;

pub(super) struct Search<'a> {
    frame: &'a FrameCamera,
    field: &'a Field,
    point: WorldPoint<'a>,
    /// Rows of the field by which the picture moves at most if the camera turns by 1 radian.
    gain: f64,
    found: Vec<ImagePoint>,
}

/// The projection at a node of a field.
#[derive(Clone, Copy)]
struct Sample {
    miss: f64,
    /// The same, but of the nearest position in the picture.
    least_miss: f64,
    /// How far it is beside the picture, rows.
    beside: f64,
    /// No more than the distance, metres.
    range_m: f64,
    position_ned_m: Option<DVec3>,
}

/// A fractional row and its miss.
type Bracket = [(f64, f64); 2];
/// A node with what the camera shows there.
type Node = (usize, Option<Sample>);

impl<'a> Search<'a> {
    pub fn new(frame: &'a FrameCamera, field: &'a Field, point: WorldPoint<'a>) -> Self {
        let gain = GAIN_RESERVE * frame.gain.turn_px / field.step_px;
        Self { frame, field, point, gain, found: Vec::new() }
    }

    /// The solutions, by row; some may be beside the picture.
    pub fn run(mut self) -> Vec<ImagePoint> {
        if self.field.is_global() {
            let (t_s, pose) = (self.field.times_s[0], self.field.poses[0]);
            let seen = self.frame.project(&pose, t_s, self.point);
            return seen.map(|seen| self.frame.seen(t_s, pose, seen)).into_iter().collect();
        }
        let last = self.field.last_node();
        let ends = [0, last].map(|node| self.at_node(node));
        if let [(_, Some(first)), (_, Some(end))] = ends
            && self.is_monotone(0, &first, last, &end)
        {
            self.solutions_between(ends[0], ends[1]);
            return self.found;
        }
        let intervals = self.intervals().min(last);
        let mut before = ends[0];
        for i in 1..=intervals {
            let here = if i == intervals { ends[1] } else { self.at_node(i * last / intervals) };
            self.solutions_between(before, here);
            before = here;
        }
        self.found
    }

    /// Intervals that are looked at in any case: more for a point that spins.
    fn intervals(&self) -> usize {
        let WorldPoint::On { motion, .. } = self.point else { return INTERVALS };
        let readout_s = (self.field.times_s[self.field.times_s.len() - 1] - self.field.times_s[0]).abs();
        let turns = motion.highest_spin_hz() * readout_s;
        (INTERVALS + (INTERVALS_A_TURN * turns) as usize).min(MOST_INTERVALS)
    }

    fn at_node(&self, node: usize) -> Node {
        (node, self.sample(node))
    }

    fn sample(&self, node: usize) -> Option<Sample> {
        let row = self.field.row_of_node(node);
        let t_s = self.field.time_s(row);
        let position_ned_m = self.point.position_ned_m(t_s);
        let now = position_ned_m.map_or(self.point, WorldPoint::At);
        let Projection { px, depth_m } = self.frame.project(self.field.pose_of_node(node), t_s, now)?;
        let [width, height] = self.frame.camera.size_px.map(f64::from);
        let inside = px.clamp(DVec2::splat(-0.5), DVec2::new(width, height) - 0.5);
        let beside_px = px - inside;
        Some(Sample {
            miss: self.field.row_of(self.frame.along(px)) - row,
            least_miss: self.field.row_of(self.frame.along(inside)) - row,
            beside: (beside_px.x + beside_px.y - self.frame.along(beside_px)).abs() / self.field.step_px,
            range_m: depth_m.abs(),
            position_ned_m,
        })
    }

    /// Looks for solutions between two nodes.
    fn solutions_between(&mut self, low: Node, high: Node) {
        let ((from, low_sample), (to, high_sample)) = (low, high);
        match (low_sample, high_sample) {
            // Beyond the lens at both, the point may come into the picture between.
            (None, None) => {
                let turn = self.field.travel_between(from, to).turn;
                if to - from == 1 || turn <= 2.0 * self.frame.lens_margin_rad {
                    return;
                }
            }
            (Some(a), Some(b)) => {
                let changes_sign = (a.miss >= 0.0) != (b.miss >= 0.0);
                if to - from == 1 || self.is_monotone(from, &a, to, &b) {
                    match changes_sign {
                        true => self.solution_between((from, a), (to, b)),
                        false if to - from == 1 => self.pair_in_a_row(from, &a, &b),
                        false => {}
                    }
                    return;
                }
                if !changes_sign && !self.may_reach(from, to, &[a, b]) {
                    return;
                }
            }
            (Some(only), None) | (None, Some(only)) => {
                if to - from == 1 || !self.may_reach(from, to, &[only]) {
                    return;
                }
            }
        }
        let middle = self.at_node(from.midpoint(to));
        self.solutions_between(low, middle);
        self.solutions_between(middle, high);
    }

    /// How far a point moves between two nodes, as an angle at the camera and without what the camera turns by.
    fn angle_of_shift(&self, shift_m: f64, ends: &[Sample]) -> f64 {
        let range_m = ends.iter().map(|end| end.range_m).fold(0.0, f64::max);
        if shift_m == 0.0 || range_m == f64::INFINITY {
            return 0.0;
        }
        // The camera may come nearer by as much.
        if range_m > shift_m { shift_m / (range_m - shift_m) } else { f64::INFINITY }
    }

    fn own_path_m(ends: &[Sample]) -> f64 {
        match ends {
            [a, b] => a.position_ned_m.zip(b.position_ned_m).map_or(0.0, |(a, b)| OWN_PATH * a.distance(b)),
            _ => 0.0,
        }
    }

    /// Whether the picture of the point moves by less than a row while any row between two nodes is read, so that
    /// the miss falls.
    fn is_monotone(&self, from: usize, a: &Sample, to: usize, b: &Sample) -> bool {
        let rows = self.field.row_of_node(to) - self.field.row_of_node(from);
        let (ends, most) = ([*a, *b], self.field.most_in_a_row());
        let own_path_m = Self::own_path_m(&ends);
        let travel_m = self.field.travel_between(from, to).shift_m + own_path_m;
        let range_m = a.range_m.max(b.range_m);
        if travel_m > 0.0 && range_m <= travel_m {
            return false;
        }
        let shift_m = most.shift_m + own_path_m / rows;
        let angle = if range_m == f64::INFINITY { 0.0 } else { shift_m / (range_m - travel_m) };
        self.gain * (most.turn + angle) < 1.0
    }

    /// Whether the point may be shown in the picture by a row between two nodes, whose misses have one sign.
    fn may_reach(&self, from: usize, to: usize, ends: &[Sample]) -> bool {
        let travel = self.field.travel_between(from, to);
        let shift = self.angle_of_shift(travel.shift_m + Self::own_path_m(ends), ends);
        let most = self.gain * (travel.turn + shift);
        let rows = self.field.row_of_node(to) - self.field.row_of_node(from);
        let sum = |part: fn(&Sample) -> f64| ends.iter().map(part).sum::<f64>();
        sum(|end| end.least_miss.abs()) <= most + rows && sum(|end| end.beside) <= most
    }

    /// The only solution between two nodes whose misses differ in sign.
    fn solution_between(&mut self, mut low: (usize, Sample), mut high: (usize, Sample)) {
        for i in 0..MOST_EVALUATIONS {
            let (below, above) = (low.1.miss, high.1.miss);
            if high.0 - low.0 == 1 {
                let row = |node: usize| self.field.row_of_node(node);
                return self.close_in([(row(low.0), below), (row(high.0), above)]);
            }
            // The secant, and the middle each third time.
            let fraction = if i % 3 == 2 { 0.5 } else { below / (below - above) };
            let node = low.0 + (fraction * (high.0 - low.0) as f64).round() as usize;
            let node = node.clamp(low.0 + 1, high.0 - 1);
            let Some(sample) = self.sample(node) else { return };
            if (sample.miss >= 0.0) == (below >= 0.0) { low = (node, sample) } else { high = (node, sample) }
        }
    }

    /// The camera at a fractional row, and the row's miss.
    fn seen_at(&self, row: f64) -> Option<(f64, f64, CameraPose, Projection)> {
        let t_s = self.field.time_s(row);
        let pose = self.frame.path.pose(t_s);
        let seen = self.frame.project(&pose, t_s, self.point)?;
        Some((self.field.row_of(self.frame.along(seen.px)) - row, t_s, pose, seen))
    }

    /// Finds the solution between two fractional rows whose misses differ in sign.
    fn close_in(&mut self, [mut low, mut high]: Bracket) {
        // The secant; an end that stays counts half (Illinois), so that both come nearer.
        let (mut below, mut above) = (low.1, high.1);
        let mut last_is_low = None;
        for _ in 0..MOST_EVALUATIONS {
            let fraction = if below == above { 0.5 } else { below / (below - above) };
            let row = low.0 + (high.0 - low.0) * fraction.clamp(0.0, 1.0);
            let Some((miss, t_s, pose, seen)) = self.seen_at(row) else { return };
            if miss.abs() < EXACT || high.0 - low.0 < 1e-12 {
                if miss.abs() < JUMP {
                    self.found.push(self.frame.seen(t_s, pose, seen));
                }
                return;
            }
            let is_low = (miss >= 0.0) == (low.1 >= 0.0);
            if is_low {
                (low, below) = ((row, miss), miss);
                above *= if last_is_low == Some(true) { 0.5 } else { 1.0 };
            } else {
                (high, above) = ((row, miss), miss);
                below *= if last_is_low == Some(false) { 0.5 } else { 1.0 };
            }
            last_is_low = Some(is_low);
        }
    }

    /// Two solutions between a row and the next, whose misses have one sign.
    fn pair_in_a_row(&mut self, node: usize, a: &Sample, b: &Sample) {
        let ends = [*a, *b];
        let [low, high] = [node, node + 1].map(|node| self.field.row_of_node(node));
        let change = self.field.change_behind(node);
        let travel = self.field.travel_between(node, node + 1);
        let own = self.angle_of_shift(Self::own_path_m(&ends), &ends);
        let moved = self.gain * (travel.turn + self.angle_of_shift(travel.shift_m, &ends) + own);
        // A parabola is an eighth of its second difference away from its chord. The projection itself bends by
        // the square of the travel over the focal length.
        let focal = self.frame.camera.focal_px.min_element() / self.field.step_px;
        let second = self.gain * (change.turn + self.angle_of_shift(change.shift_m, &ends) + own)
            + 2.0 * moved * moved / focal;
        let is_near = a.miss.abs().min(b.miss.abs()) <= 0.125 * second;
        // With a steeper chord the extremum is not between the two.
        if !is_near || (a.miss - b.miss).abs() >= 0.5 * second {
            return;
        }
        let is_above = a.miss >= 0.0;
        let (mut from, mut to) = (low, high);
        for _ in 0..GOLDEN_STEPS {
            let rows = [to - GOLDEN * (to - from), from + GOLDEN * (to - from)];
            let [Some(first), Some(second)] = rows.map(|row| self.seen_at(row).map(|(miss, ..)| miss)) else {
                return;
            };
            for (row, miss) in rows.into_iter().zip([first, second]) {
                if (miss >= 0.0) != is_above {
                    self.close_in([(low, a.miss), (row, miss)]);
                    self.close_in([(row, miss), (high, b.miss)]);
                    return;
                }
            }
            if first.abs() < second.abs() { to = rows[1] } else { from = rows[0] }
        }
    }
}
