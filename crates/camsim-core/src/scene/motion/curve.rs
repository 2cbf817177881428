//! Positions and rotations between keys.

use glam::{DQuat, DVec3};

use crate::trajectory::so3;

/// Keys by time and what is between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve<V> {
    /// Times of the keys, seconds, not descending; at least one.
    times_s: Vec<f64>,
    values: Vec<V>,
    between: Between<V>,
}

/// What is between two keys.
#[derive(Clone, Debug, PartialEq)]
pub enum Between<V> {
    /// The earlier key.
    Step,
    /// A straight line; of rotations, one turn at a constant rate along the shorter arc (slerp).
    Linear,
    /// A cubic Hermite curve with these derivatives a second before and after each key; of quaternions, by
    /// their four parts, normalised.
    Cubic {
        /// Derivative at which each key is reached.
        arriving: Vec<V>,
        /// Derivative at which each key is left.
        leaving: Vec<V>,
    },
}

/// The keys around an instant.
struct Interval {
    key: usize,
    next: usize,
    /// Fraction of the interval from one to the other, 0 to 1.
    fraction: f64,
    /// Time between them; 0 beyond the ends.
    span_s: f64,
}

impl<V> Curve<V> {
    /// `None` unless there are keys, finite and ascending times, and as many values and derivatives.
    #[must_use]
    pub fn new(times_s: Vec<f64>, values: Vec<V>, between: Between<V>) -> Option<Self> {
        let count = times_s.len();
        let has_derivatives = match &between {
            Between::Cubic { arriving, leaving } => arriving.len() == count && leaving.len() == count,
            _ => true,
        };
        let ascends = times_s.windows(2).all(|pair| pair[0] <= pair[1]);
        let is_whole = count > 0 && values.len() == count && has_derivatives;
        (is_whole && ascends && times_s.iter().all(|t_s| t_s.is_finite())).then_some(Self {
            times_s,
            values,
            between,
        })
    }

    /// The same at all times.
    #[must_use]
    pub fn constant(value: V) -> Self {
        Self { times_s: vec![0.0], values: vec![value], between: Between::Step }
    }

    /// Times of the first and last key, seconds.
    #[must_use]
    pub fn span_s(&self) -> [f64; 2] {
        [self.times_s[0], self.times_s[self.times_s.len() - 1]]
    }

    fn interval(&self, t_s: f64) -> Interval {
        let last = self.times_s.len() - 1;
        let key = self.times_s.partition_point(|&key_s| key_s <= t_s);
        if key == 0 {
            return Interval { key: 0, next: 0, fraction: 0.0, span_s: 0.0 };
        }
        let (key, next) = (key - 1, key.min(last));
        let span_s = self.times_s[next] - self.times_s[key];
        let fraction = if span_s > 0.0 { (t_s - self.times_s[key]) / span_s } else { 0.0 };
        Interval { key, next, fraction, span_s }
    }
}

/// Weights of the two values and the two derivatives of a cubic, and of the same for its own derivative.
fn hermite(t: f64, span_s: f64) -> ([f64; 4], [f64; 4]) {
    let (t2, t3) = (t * t, t * t * t);
    (
        [2.0 * t3 - 3.0 * t2 + 1.0, 3.0 * t2 - 2.0 * t3, span_s * (t3 - 2.0 * t2 + t), span_s * (t3 - t2)],
        [
            (6.0 * t2 - 6.0 * t) / span_s,
            (6.0 * t - 6.0 * t2) / span_s,
            3.0 * t2 - 4.0 * t + 1.0,
            3.0 * t2 - 2.0 * t,
        ],
    )
}

impl Curve<DVec3> {
    /// Cubic through all points, with the derivative of the parabola through each one and its neighbours
    /// (Catmull and Rom for uneven times); the ends are left and reached along that parabola too. Two points
    /// make a straight line. `None` as [`Curve::new`], and for two points at one time.
    #[must_use]
    pub fn smooth(times_s: Vec<f64>, values: Vec<DVec3>) -> Option<Self> {
        let count = times_s.len();
        if values.len() != count || times_s.windows(2).any(|pair| pair[0] >= pair[1]) {
            return None;
        }
        let slope = |k: usize| (values[k + 1] - values[k]) / (times_s[k + 1] - times_s[k]);
        let derivative = |k: usize| match (count, k) {
            (0 | 1, _) => DVec3::ZERO,
            (2, _) => slope(0),
            (_, 0) => slope(0) - bend(&times_s, &slope, 1) * (times_s[1] - times_s[0]),
            (_, k) if k == count - 1 => {
                slope(k - 1) + bend(&times_s, &slope, k - 1) * (times_s[k] - times_s[k - 1])
            }
            (_, k) => slope(k - 1) + bend(&times_s, &slope, k) * (times_s[k] - times_s[k - 1]),
        };
        let derivatives: Vec<DVec3> = (0..count).map(derivative).collect();
        Self::new(times_s, values, Between::Cubic { arriving: derivatives.clone(), leaving: derivatives })
    }

    /// Derivative at which key `k` is reached; zero without derivatives.
    #[must_use]
    pub fn rate_at_key(&self, k: usize) -> DVec3 {
        match &self.between {
            Between::Cubic { arriving, .. } => arriving.get(k).copied().unwrap_or(DVec3::ZERO),
            _ => DVec3::ZERO,
        }
    }

    /// Value and derivative a second at a time; constant beyond the ends.
    #[must_use]
    pub fn at(&self, t_s: f64) -> (DVec3, DVec3) {
        let Interval { key, next, fraction, span_s } = self.interval(t_s);
        let (a, b) = (self.values[key], self.values[next]);
        if span_s == 0.0 {
            return (a, DVec3::ZERO);
        }
        match &self.between {
            Between::Step => (a, DVec3::ZERO),
            Between::Linear => (a + fraction * (b - a), (b - a) / span_s),
            Between::Cubic { arriving, leaving } => {
                let (value, rate) = hermite(fraction, span_s);
                let sum = |w: [f64; 4]| w[0] * a + w[1] * b + w[2] * leaving[key] + w[3] * arriving[next];
                (sum(value), sum(rate))
            }
        }
    }

    /// Passes points whose convex hull holds the curve between two times to `visit`.
    pub(super) fn hull(&self, from_s: f64, to_s: f64, visit: &mut dyn FnMut(DVec3)) {
        let inner = |k: &usize| self.times_s[*k] > from_s && self.times_s[*k] < to_s;
        let first = self.times_s.partition_point(|&key_s| key_s <= from_s);
        let keys = (first..self.times_s.len()).take_while(inner);
        let mut from = from_s;
        for to in keys.map(|k| self.times_s[k]).chain([to_s]) {
            // A part of a cubic is a cubic: of its end points and derivatives come its Bezier points.
            let ((a, leaving), b) = (self.at(from), self.before(to));
            visit(a);
            visit(b.0);
            if matches!(self.between, Between::Cubic { .. }) {
                let third_s = (to - from) / 3.0;
                visit(a + third_s * leaving);
                visit(b.0 - third_s * b.1);
            }
            from = to;
        }
        visit(self.at(to_s).0);
        self.times_s
            .iter()
            .zip(&self.values)
            .filter(|(t_s, _)| (from_s..=to_s).contains(*t_s))
            .for_each(|(_, value)| visit(*value));
    }

    /// Value and derivative just before a time.
    fn before(&self, t_s: f64) -> (DVec3, DVec3) {
        let Interval { key, fraction, .. } = self.interval(t_s);
        if fraction > 0.0 || self.times_s[key] != t_s || key == 0 {
            return self.at(t_s);
        }
        let (value, arriving) = match &self.between {
            Between::Step => (self.values[key - 1], DVec3::ZERO),
            Between::Linear => (self.values[key], DVec3::ZERO),
            Between::Cubic { arriving, .. } => (self.values[key], arriving[key]),
        };
        (value, arriving)
    }
}

/// Half the second derivative of the parabola through key `k` and its neighbours.
fn bend(times_s: &[f64], slope: &dyn Fn(usize) -> DVec3, k: usize) -> DVec3 {
    (slope(k) - slope(k - 1)) / (times_s[k + 1] - times_s[k - 1])
}

impl Curve<DQuat> {
    /// Rotation and angular rate in the outer axes, rad/s; constant beyond the ends.
    #[must_use]
    pub fn at(&self, t_s: f64) -> (DQuat, DVec3) {
        let Interval { key, next, fraction, span_s } = self.interval(t_s);
        let (a, b) = (self.values[key], self.values[next]);
        if span_s == 0.0 {
            return (a.normalize(), DVec3::ZERO);
        }
        match &self.between {
            Between::Step => (a.normalize(), DVec3::ZERO),
            Between::Linear => {
                let turn = short_turn(a, b);
                ((so3::exp(fraction * turn) * a).normalize(), turn / span_s)
            }
            Between::Cubic { arriving, leaving } => {
                let (value, rate) = hermite(fraction, span_s);
                let sum = |w: [f64; 4]| a * w[0] + b * w[1] + leaving[key] * w[2] + arriving[next] * w[3];
                let (raw, change) = (sum(value), sum(rate));
                let rotation = raw.normalize();
                // The part of the change along the quaternion only changes its length.
                let twice = (change * rotation.conjugate()) * (2.0 / raw.length());
                (rotation, twice.xyz())
            }
        }
    }

    /// An upper bound of the angle that the rotation passes through between two times, rad.
    pub(super) fn variation(&self, from_s: f64, to_s: f64) -> f64 {
        if to_s <= from_s {
            return 0.0;
        }
        if matches!(self.between, Between::Cubic { .. }) && self.times_s.len() > 1 {
            return std::f64::consts::PI;
        }
        let first = self.interval(from_s).key;
        let pairs = first..self.times_s.len().saturating_sub(1);
        let in_reach = pairs.take_while(|&k| self.times_s[k] <= to_s);
        in_reach
            .map(|k| {
                let angle = short_turn(self.values[k], self.values[k + 1]).length();
                let [begin, end] = [self.times_s[k], self.times_s[k + 1]];
                let is_jump = matches!(self.between, Between::Step) || end == begin;
                match is_jump {
                    true if end > from_s && end <= to_s => angle,
                    true => 0.0,
                    false => angle * ((to_s.min(end) - from_s.max(begin)) / (end - begin)).max(0.0),
                }
            })
            .sum()
    }
}

/// Rotation vector from one rotation to another in the outer axes, along the shorter arc.
fn short_turn(a: DQuat, b: DQuat) -> DVec3 {
    so3::log((b * a.conjugate()).normalize())
}
