//! Errors of a frame's ranges, normals and numbers of objects against the reference, pixel by pixel, borders
//! included.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{
    DEPTH_TOLERANCE, FrameView, RaySample, ReferenceRenderer,
    planes::{PlaneReference, Value},
};
use crate::{
    frame::{Plane, PlaneValues, RenderedFrame},
    scenario::{Channel, Check},
};

/// Angle beyond which a normal is wrong, radians: 0.1 degrees.
pub const NORMAL_TOLERANCE_RAD: f64 = 0.1 / 180.0 * std::f64::consts::PI;
/// Number of directions in which the surroundings of a pixel are sampled.
const DIRECTIONS: u32 = 16;
/// Distances of those samples, as fractions of the largest. Distant terrain has triangles of a few thousandths
/// of a pixel, whose normals differ.
const RINGS: [f64; 5] = [1e-3, 0.03, 0.3, 0.65, 1.0];

/// Errors of a plane of a frame against the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneErrors {
    /// The plane.
    pub channel: Channel,
    /// Pixels that are valid in both.
    pub pixels: u64,
    /// Those of them of which no neighbour has, by the reference, another object or the sky.
    pub pixels_away: u64,
    /// Pixels whose value is wrong: a range by more than [`DEPTH_TOLERANCE`] of it, a normal by more than
    /// [`NORMAL_TOLERANCE_RAD`], another number, or the sky in one of the two only.
    pub beyond: u64,
    /// Those of them that are away from borders, as in `pixels_away`.
    pub beyond_away: u64,
    /// Pixels counted in `beyond` whose value belongs to no surface within the allowed distance from the
    /// pixel's centre.
    pub faults: u64,
    /// 99th percentile of the errors: relative for a range, radians for a normal, 0 or infinite for a number
    /// and for the sky in one of the two only.
    pub p99: f64,
    /// Largest error.
    pub max: f64,
}

/// What a value may be off by, in channels that [`plane_errors`] compares.
fn tolerance(channel: Channel) -> Option<f64> {
    match channel.facts().check {
        Check::Relative => Some(DEPTH_TOLERANCE),
        Check::Direction => Some(NORMAL_TOLERANCE_RAD),
        Check::Exact => Some(0.0),
        _ => None,
    }
}

/// Compares the planes of frame `number` that hold a range, a unit vector or a number with the sample at the
/// centre of each pixel at mid-exposure. Where they differ, surfaces within `near_px` of the centre are sampled
/// as well, because both sides of a border that near are acceptable. Empty if the size differs from that of the
/// sequence.
#[must_use]
pub fn plane_errors(
    reference: &ReferenceRenderer,
    number: u64,
    frame: &RenderedFrame,
    near_px: f64,
) -> Vec<PlaneErrors> {
    let Some(compared) = Compared::new(reference, number, frame, near_px) else { return Vec::new() };
    frame.planes.iter().filter_map(|plane| compared.errors(plane, tolerance(plane.channel)?)).collect()
}

/// What all planes of a frame are compared with.
pub(super) struct Compared<'a> {
    number: u64,
    pub(super) view: FrameView<'a>,
    pub(super) size_px: [u32; 2],
    /// The ray of each pixel that is valid in both.
    pub(super) samples: Vec<Option<RaySample>>,
    pub(super) near_px: f64,
}

/// Positions around a pixel's centre, at most `near_px` from it.
pub(super) fn beside_offsets(near_px: f64) -> impl Iterator<Item = DVec2> {
    (0..DIRECTIONS).flat_map(move |k| {
        let direction = DVec2::from_angle(std::f64::consts::TAU * f64::from(k) / f64::from(DIRECTIONS));
        RINGS.iter().map(move |ring| ring * near_px * direction)
    })
}

/// Error of one pixel.
struct PixelError {
    error: f64,
    is_beyond: bool,
    is_away: bool,
    is_fault: bool,
}

impl<'a> Compared<'a> {
    /// `None` if the frame's size differs from that of the sequence.
    pub(super) fn new(
        reference: &'a ReferenceRenderer,
        number: u64,
        frame: &RenderedFrame,
        near_px: f64,
    ) -> Option<Self> {
        let [width, height] = frame.size_px;
        let count = width as usize * height as usize;
        let color_rgba = frame.color_rgba();
        if frame.size_px != reference.sequence.scenario.camera.size_px || color_rgba.len() != 4 * count {
            return None;
        }
        let view = reference.view(number);
        let pixel = |i: usize| [i as u32 % width, i as u32 / width];
        let sample =
            |i: usize| view.sample(pixel(i), DVec2::ZERO, 0.0).filter(|_| color_rgba[4 * i + 3] > 0.0);
        let samples: Vec<Option<RaySample>> = (0..count).into_par_iter().map(sample).collect();
        Some(Self { number, view, size_px: frame.size_px, samples, near_px })
    }

    pub(super) fn pixel(&self, i: usize) -> [u32; 2] {
        [i as u32 % self.size_px[0], i as u32 / self.size_px[0]]
    }

    /// A channel of the frame by the reference.
    pub(super) fn reference(&self, channel: Channel) -> PlaneReference<'_> {
        PlaneReference::new(&self.view, self.number, channel)
    }

    fn errors(&self, Plane { channel, values }: &Plane, tolerance: f64) -> Option<PlaneErrors> {
        let (channel, components) = (*channel, channel.components().len().max(1));
        if values.len() != components * self.samples.len() {
            return None;
        }
        let value = |i: usize| -> Value {
            let part = |k: usize| match values {
                PlaneValues::Float(values) => f64::from(values[components * i + k]),
                PlaneValues::Index(values) => f64::from(values[i]),
                PlaneValues::Raw(raw) => f64::from(raw.values[i]),
            };
            std::array::from_fn(|k| if k < components { part(k) } else { 0.0 })
        };
        let reference = self.reference(channel);
        let error = |i: usize, offset: DVec2, sample: &RaySample| {
            let wanted = reference.value(self.pixel(i), offset, sample);
            error(channel.facts().check, value(i), wanted, sample.hit.is_some())
        };
        // Whether a surface near a pixel's centre has the value.
        let has_beside = |i: usize| {
            beside_offsets(self.near_px).any(|offset| {
                let beside = self.view.sample(self.pixel(i), offset, 0.0);
                beside.is_some_and(|beside| error(i, offset, &beside) <= tolerance)
            })
        };
        let of_pixel = |i: usize| {
            let error = error(i, DVec2::ZERO, self.samples[i].as_ref()?);
            let is_beyond = error > tolerance;
            Some(PixelError {
                error,
                is_beyond,
                is_away: self.is_away(i),
                is_fault: is_beyond && !has_beside(i),
            })
        };
        let pixels: Vec<PixelError> = (0..self.samples.len()).into_par_iter().filter_map(of_pixel).collect();
        let mut sorted: Vec<f64> = pixels.iter().map(|pixel| pixel.error).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let at = |fraction: f64| at_fraction(&sorted, fraction);
        let number =
            |counts: &dyn Fn(&PixelError) -> bool| pixels.iter().filter(|pixel| counts(pixel)).count() as u64;
        Some(PlaneErrors {
            channel,
            pixels: pixels.len() as u64,
            beyond: number(&|pixel| pixel.is_beyond),
            pixels_away: number(&|pixel| pixel.is_away),
            beyond_away: number(&|pixel| pixel.is_beyond && pixel.is_away),
            faults: number(&|pixel| pixel.is_fault),
            p99: at(0.99),
            max: at(1.0),
        })
    }

    /// Whether all pixels around one show the same object.
    pub(super) fn is_away(&self, i: usize) -> bool {
        self.around(i).all(|beside| self.object(beside) == self.object(i))
    }

    /// Object that a pixel's centre sees; `None` without a ray.
    pub(super) fn object(&self, i: usize) -> Option<u32> {
        let scene = &self.view.reference.sequence.scene;
        let of_hit =
            |sample: &RaySample| sample.hit.as_ref().map_or(0, |hit| scene.object_of_surface(hit.surface));
        self.samples[i].as_ref().map(of_hit)
    }

    /// A pixel and those around it.
    pub(super) fn around(&self, i: usize) -> impl Iterator<Item = usize> + use<> {
        let [width, height] = self.size_px.map(i64::from);
        let [x, y] = [i as i64 % width, i as i64 / width];
        let around = (-1..=1).flat_map(move |dy| (-1..=1).map(move |dx| [x + dx, y + dy]));
        around
            .filter(move |[x, y]| (0..width).contains(x) && (0..height).contains(y))
            .map(move |[x, y]| (y * width + x) as usize)
    }
}

/// The error at a fraction of sorted ones; 0 without any.
pub(super) fn at_fraction(sorted: &[f64], fraction: f64) -> f64 {
    let last = sorted.len().saturating_sub(1);
    sorted.get((fraction * last as f64).ceil() as usize).copied().unwrap_or(0.0)
}

/// Error of a value; infinite for what is not a number, and where one of the two is the sky.
fn error(check: Check, value: Value, wanted: Value, is_surface: bool) -> f64 {
    let vector = |[x, y, z, _]: Value| DVec3::new(x, y, z);
    let error = match check {
        Check::Relative if is_surface && value[0] > 0.0 => (value[0] - wanted[0]).abs() / wanted[0],
        Check::Direction if is_surface => angle(vector(value), vector(wanted)),
        Check::Relative if is_surface => f64::INFINITY,
        _ if value == wanted => 0.0,
        _ => f64::INFINITY,
    };
    if error.is_nan() { f64::INFINITY } else { error }
}

/// Angle between a vector and one of length 1, radians; infinite for a vector of another length. A triangle
/// without area has no normal, which is 0.
fn angle(value: DVec3, wanted: DVec3) -> f64 {
    const LENGTH_OFF: f64 = 1e-3;
    if (value.length() - wanted.length()).abs() > LENGTH_OFF {
        return f64::INFINITY;
    }
    value.cross(wanted).length().atan2(value.dot(wanted))
}
