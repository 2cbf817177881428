//! Errors of a frame's flows, motion, blur path and coverage against the reference.
//!
//! These cost the reference up to a thousand evaluations a pixel, so that large frames are sampled.

use glam::DVec2;
use rayon::prelude::*;
use serde::Serialize;

use super::{
    RaySample, ReferenceRenderer,
    plane_errors::{Compared, at_fraction, beside_offsets},
    planes::{self, PlaneReference},
};
use crate::{
    frame::RenderedFrame,
    scenario::{Channel, Check, FlowState},
    silhouette::may_step,
};

/// Distance beyond which a flow or a blur path is wrong, pixels.
pub const FLOW_TOLERANCE_PX: f64 = 0.01;
/// Fraction of its length by which a motion may be off, and what is added to it, pixels a second.
pub const MOTION_TOLERANCE: (f64, f64) = (1e-3, 0.05);
/// Difference of a coverage from that by the reference's 256 rays from which on it is wrong: the largest error of
/// 64 rays at a straight border is 0.1, and that of the reference half of it.
pub const COVERAGE_TOLERANCE: f64 = 0.15;
/// States of a flow.
const STATES: usize = 5;

/// Errors of a set of pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FlowStats {
    /// Pixels whose displacement is known to both.
    pub pixels: u64,
    /// Median, pixels; for motion, pixels a second.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Largest.
    pub max: f64,
    /// All pixels that were looked at.
    pub looked_at: u64,
    /// Those of them with another state.
    pub wrong_states: u64,
}

/// Errors of a flow, of motion or of a blur path.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FlowErrors {
    /// The plane.
    #[serde(skip)]
    pub channel: Channel,
    /// Valid pixels of the frame, of which some were looked at.
    pub of_pixels: u64,
    /// Pixels farther than 1 px from other objects, the sky and steps of depth.
    pub away: FlowStats,
    /// The others.
    pub near: FlowStats,
    /// Pixels by the state that the reference has (row) and that of the frame (column); all 0 for motion and blur
    /// path.
    pub states: [[u64; STATES]; STATES],
    /// Pixels that are off by more than the tolerance, or have another state.
    pub beyond: u64,
    /// Those of them that no surface within the allowed distance from the pixel's centre explains.
    pub faults: u64,
}

/// Errors of coverages.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CoverageErrors {
    /// Pixels looked at: half of them by chance, and half of those that have less than 1.
    pub pixels: u64,
    /// Root mean square difference.
    pub rms: f64,
    /// Largest.
    pub max: f64,
    /// Differences that objects which no pixel beside shows do not explain.
    pub faults: u64,
}

/// What a frame has, or should have, at a pixel.
#[derive(Clone, Copy, Debug)]
struct Value {
    /// Displacement or velocity; of a blur path both ends.
    shifts: [DVec2; 2],
    state: usize,
}

struct PixelError {
    error: Option<f64>,
    states: [usize; 2],
    is_away: bool,
    is_beyond: bool,
    is_fault: bool,
}

/// Compares the planes of frame `number` that hold displacements or velocities in `most` of its pixels, evenly
/// chosen. Where they differ, the surroundings within `near_px` of the pixel's centre decide whether that is a
/// fault, because both sides of a border that near are acceptable. Empty if the size differs from that of the sequence.
#[must_use]
pub fn flow_errors(
    reference: &ReferenceRenderer,
    number: u64,
    frame: &RenderedFrame,
    near_px: f64,
    most: usize,
) -> Vec<FlowErrors> {
    let is_flow = |channel: &Channel| matches!(channel.facts().check, Check::Displacement | Check::Velocity);
    let channels: Vec<Channel> = frame.planes.iter().map(|plane| plane.channel).filter(is_flow).collect();
    let compared = if channels.is_empty() { None } else { Compared::new(reference, number, frame, near_px) };
    let Some(compared) = compared else { return Vec::new() };
    let valid: Vec<usize> = (0..compared.samples.len()).filter(|&i| compared.samples[i].is_some()).collect();
    let chosen = chosen(&valid, most);
    let errors = |&channel: &Channel| {
        let values = frame.floats(channel)?;
        let parts = channel.components().len();
        if values.len() != parts * compared.samples.len() {
            return None;
        }
        let flows = Flows { parts, check: channel.facts().check, reference: compared.reference(channel) };
        let found =
            |i: usize| std::array::from_fn(|k| if k < parts { values[parts * i + k].into() } else { 0.0 });
        let of_pixel = |&i: &usize| flows.error(&compared, i, displacement(found(i), parts));
        let pixels: Vec<PixelError> = chosen.par_iter().filter_map(of_pixel).collect();
        Some(errors_of(channel, valid.len() as u64, &pixels))
    };
    channels.iter().filter_map(errors).collect()
}

/// At most `most` of some indices, spread as by chance.
fn chosen(valid: &[usize], most: usize) -> Vec<usize> {
    if valid.len() <= most {
        return valid.to_vec();
    }
    let hash = |i: usize| (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
    let limit = (most as f64 / valid.len() as f64 * u64::MAX as f64) as u64;
    valid.iter().copied().filter(|&i| hash(i).wrapping_mul(0xbf58_476d_1ce4_e5b9) < limit).collect()
}

/// A value of so many parts: one displacement, two, or one with a state.
fn displacement([x0, y0, x1, y1]: planes::Value, parts: usize) -> Value {
    let first = DVec2::new(x0, y0);
    match parts {
        2 => Value { shifts: [first; 2], state: 0 },
        3 => Value { shifts: [first; 2], state: (x1 as usize).min(STATES - 1) },
        _ => Value { shifts: [first, DVec2::new(x1, y1)], state: 0 },
    }
}

fn errors_of(channel: Channel, of_pixels: u64, pixels: &[PixelError]) -> FlowErrors {
    let mut states = [[0; STATES]; STATES];
    if channel.components().contains(&"state") {
        pixels.iter().for_each(|pixel| states[pixel.states[0]][pixel.states[1]] += 1);
    }
    let count =
        |counts: &dyn Fn(&PixelError) -> bool| pixels.iter().filter(|pixel| counts(pixel)).count() as u64;
    let stats = |is_away: bool| {
        let of = || pixels.iter().filter(move |pixel| pixel.is_away == is_away);
        let mut errors: Vec<f64> = of().filter_map(|pixel| pixel.error).collect();
        errors.sort_unstable_by(f64::total_cmp);
        let at = |fraction: f64| at_fraction(&errors, fraction);
        FlowStats {
            pixels: errors.len() as u64,
            p50: at(0.5),
            p99: at(0.99),
            max: at(1.0),
            wrong_states: of().filter(|pixel| pixel.states[0] != pixel.states[1]).count() as u64,
            looked_at: of().count() as u64,
        }
    };
    FlowErrors {
        channel,
        of_pixels,
        away: stats(true),
        near: stats(false),
        states,
        beyond: count(&|pixel| pixel.is_beyond),
        faults: count(&|pixel| pixel.is_fault),
    }
}

/// A channel of a frame, by the reference.
struct Flows<'a> {
    parts: usize,
    check: Check,
    reference: PlaneReference<'a>,
}

impl Flows<'_> {
    fn error(&self, compared: &Compared<'_>, i: usize, found: Value) -> Option<PixelError> {
        let seen = compared.samples[i].as_ref()?;
        let pixel = compared.pixel(i);
        let wanted = self.value(pixel, DVec2::ZERO, seen);
        let error = distance(wanted, found);
        let is_beyond = !self.is_same(wanted, found);
        let has_beside = || {
            beside_offsets(compared.near_px).any(|offset| {
                let beside = compared.view.sample(pixel, offset, 0.0);
                beside.is_some_and(|seen| self.is_same(self.value(pixel, offset, &seen), found))
            })
        };
        Some(PixelError {
            error,
            states: [wanted.state, found.state],
            is_away: compared.is_away(i) && !compared.has_step(i),
            is_beyond,
            is_fault: is_beyond && !has_beside(),
        })
    }

    fn value(&self, pixel: [u32; 2], offset: DVec2, seen: &RaySample) -> Value {
        displacement(self.reference.value(pixel, offset, seen), self.parts)
    }

    fn is_same(&self, wanted: Value, found: Value) -> bool {
        let allowed = match self.check {
            Check::Velocity => MOTION_TOLERANCE.0 * wanted.shifts[0].length() + MOTION_TOLERANCE.1,
            _ => FLOW_TOLERANCE_PX,
        };
        wanted.state == found.state && distance(wanted, found).is_none_or(|error| error <= allowed)
    }
}

/// `None` where the two lead to different pictures, or one of them nowhere.
fn distance(wanted: Value, found: Value) -> Option<f64> {
    let kind = |state: usize| match state {
        _ if state == FlowState::None as usize => 0,
        _ if state == FlowState::Outside as usize => 1,
        _ => 2,
    };
    let off = (0..2).map(|k| wanted.shifts[k].distance(found.shifts[k])).fold(0.0, f64::max);
    let off = if found.shifts.iter().all(|shift| shift.is_finite()) { off } else { f64::INFINITY };
    (kind(wanted.state) == kind(found.state)).then_some(off)
}

/// Compares the coverages of frame `number` in about `most` of its pixels. `None` without that channel, or if
/// the size differs from that of the sequence.
#[must_use]
pub fn coverage_errors(
    reference: &ReferenceRenderer,
    number: u64,
    frame: &RenderedFrame,
    most: usize,
) -> Option<CoverageErrors> {
    let values = frame.floats(Channel::Coverage)?;
    let compared = Compared::new(reference, number, frame, 0.0)?;
    let is_valid = |i: &usize| compared.samples[*i].is_some() && *i < values.len();
    let valid: Vec<usize> = (0..compared.samples.len()).filter(is_valid).collect();
    let mixed: Vec<usize> = valid.iter().copied().filter(|&i| values[i] < 1.0).collect();
    let mut looked_at = chosen(&valid, most / 2);
    looked_at.extend(chosen(&mixed, most / 2));
    looked_at.sort_unstable();
    looked_at.dedup();
    let of_pixel = |&i: &usize| {
        let seen = compared.samples[i].as_ref()?;
        let (wanted, unknown) =
            compared.view.coverage_of(compared.pixel(i), seen, &compared.objects_around(i));
        let off = (f64::from(values[i]) - wanted).abs();
        let off = if off.is_nan() { f64::INFINITY } else { off };
        Some((off, off - unknown > COVERAGE_TOLERANCE))
    };
    let errors: Vec<(f64, bool)> = looked_at.par_iter().filter_map(of_pixel).collect();
    let squares: f64 = errors.iter().map(|(off, _)| off * off).sum();
    Some(CoverageErrors {
        pixels: errors.len() as u64,
        rms: (squares / errors.len().max(1) as f64).sqrt(),
        max: errors.iter().map(|(off, _)| *off).fold(0.0, f64::max),
        faults: errors.iter().filter(|(_, is_fault)| *is_fault).count() as u64,
    })
}

impl Compared<'_> {
    /// Objects that the centres of a pixel and of those around it see.
    fn objects_around(&self, i: usize) -> Vec<u32> {
        self.around(i).filter_map(|i| self.object(i)).collect()
    }

    /// Whether depth steps or bends sharply between a pixel and those beside it.
    fn has_step(&self, i: usize) -> bool {
        let inverse_depth =
            |i: usize| self.samples[i].as_ref().map(|seen| seen.hit.map_or(0.0, |hit| 1.0 / hit.depth_m));
        let [width, height] = self.size_px.map(|side| side as usize);
        let [x, y] = [i % width, i / width];
        if x == 0 || y == 0 || x + 1 == width || y + 1 == height {
            return false;
        }
        [1, width, width + 1, width - 1].into_iter().any(|step| {
            let three = [i - step, i, i + step].map(inverse_depth);
            matches!(three, [Some(a), Some(b), Some(c)] if may_step([a, b, c]))
        })
    }
}
