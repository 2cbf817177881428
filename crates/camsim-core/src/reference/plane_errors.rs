//! Errors of a frame's ranges, normals and numbers of objects against the oracle, pixel by pixel, borders
//! included.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{DEPTH_TOLERANCE, FrameView, Oracle, RaySample};
use crate::{
    frame::{Plane, PlaneValues, RenderedFrame},
    scenario::Channel,
    scene::Scene,
};

/// Angle beyond which a normal is wrong, radians: 0.1 degrees.
pub const NORMAL_TOLERANCE_RAD: f64 = 0.1 / 180.0 * std::f64::consts::PI;
/// Number of directions in which the surroundings of a pixel are sampled.
const DIRECTIONS: u32 = 16;
/// Distances of those samples, as shares of the largest. Distant terrain has triangles of a few thousandths
/// of a pixel, whose normals differ.
const RINGS: [f64; 5] = [1e-3, 0.03, 0.3, 0.65, 1.0];

/// Errors of a plane of a frame against the oracle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneErrors {
    /// The plane.
    pub channel: Channel,
    /// Pixels that are valid in both.
    pub pixels: u64,
    /// Those of them of which no neighbour has, by the oracle, another object or the sky.
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

/// Whether [`plane_errors`] compares the plane of a channel.
#[must_use]
pub fn is_compared(channel: Channel) -> bool {
    matches!(
        channel,
        Channel::Range | Channel::Normal | Channel::NormalWorld | Channel::Object | Channel::Class
    )
}

/// Compares the planes of frame `number` that [`is_compared`] names with the sample at the centre of each
/// pixel at mid-exposure. Where they differ, surfaces within `near_px` of the centre are sampled as well,
/// because both sides of a border that near are acceptable. Empty if the size differs from that of the
/// sequence.
#[must_use]
pub fn plane_errors(oracle: &Oracle, number: u64, frame: &RenderedFrame, near_px: f64) -> Vec<PlaneErrors> {
    let Some(compared) = Compared::new(oracle, number, frame, near_px) else { return Vec::new() };
    frame
        .planes
        .iter()
        .filter(|plane| is_compared(plane.channel))
        .filter_map(|plane| compared.errors(plane))
        .collect()
}

/// What all planes of a frame are compared with.
pub(super) struct Compared<'a> {
    pub(super) view: FrameView<'a>,
    scene: &'a Scene,
    pub(super) size_px: [u32; 2],
    /// The ray of each pixel that is valid in both.
    pub(super) samples: Vec<Option<RaySample>>,
    pub(super) near_px: f64,
}

/// Places around a pixel's centre, at most `near_px` from it.
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

/// A value of a plane.
#[derive(Clone, Copy)]
enum Value {
    /// A range or a normal.
    Floats(DVec3),
    Number(u32),
}

impl<'a> Compared<'a> {
    /// `None` if the frame's size differs from that of the sequence.
    pub(super) fn new(oracle: &'a Oracle, number: u64, frame: &RenderedFrame, near_px: f64) -> Option<Self> {
        let [width, height] = frame.size_px;
        let count = width as usize * height as usize;
        if frame.size_px != oracle.sequence.scenario.camera.size_px || frame.color_rgba.len() != 4 * count {
            return None;
        }
        let view = oracle.view(number);
        let pixel = |i: usize| [i as u32 % width, i as u32 / width];
        let sample =
            |i: usize| view.sample(pixel(i), DVec2::ZERO, 0.0).filter(|_| frame.color_rgba[4 * i + 3] > 0.0);
        let samples: Vec<Option<RaySample>> = (0..count).into_par_iter().map(sample).collect();
        Some(Self { view, scene: &oracle.sequence.scene, size_px: frame.size_px, samples, near_px })
    }

    pub(super) fn pixel(&self, i: usize) -> [u32; 2] {
        [i as u32 % self.size_px[0], i as u32 / self.size_px[0]]
    }

    fn errors(&self, plane: &Plane) -> Option<PlaneErrors> {
        let components = match plane.channel {
            Channel::Normal | Channel::NormalWorld => 3,
            _ => 1,
        };
        let length = match &plane.values {
            PlaneValues::Float(values) => values.len(),
            PlaneValues::Index(values) => values.len(),
        };
        if length != components * self.samples.len() {
            return None;
        }
        let value = |i: usize| match &plane.values {
            PlaneValues::Index(values) => Value::Number(values[i]),
            PlaneValues::Float(values) => {
                let part =
                    |k: usize| if k < components { f64::from(values[components * i + k]) } else { 0.0 };
                Value::Floats(DVec3::new(part(0), part(1), part(2)))
            }
        };
        let of_pixel = |i: usize| {
            let sample = self.samples[i].as_ref()?;
            let error = self.error(plane.channel, value(i), sample);
            let is_beyond = is_beyond(plane.channel, error);
            let is_fault = is_beyond && !self.has_beside(plane.channel, i, value(i));
            Some(PixelError { error, is_beyond, is_away: self.is_away(i), is_fault })
        };
        let pixels: Vec<PixelError> = (0..self.samples.len()).into_par_iter().filter_map(of_pixel).collect();
        let mut sorted: Vec<f64> = pixels.iter().map(|pixel| pixel.error).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| at_share(&sorted, share);
        let number =
            |counts: &dyn Fn(&PixelError) -> bool| pixels.iter().filter(|pixel| counts(pixel)).count() as u64;
        Some(PlaneErrors {
            channel: plane.channel,
            pixels: pixels.len() as u64,
            beyond: number(&|pixel| pixel.is_beyond),
            pixels_away: number(&|pixel| pixel.is_away),
            beyond_away: number(&|pixel| pixel.is_beyond && pixel.is_away),
            faults: number(&|pixel| pixel.is_fault),
            p99: at(0.99),
            max: at(1.0),
        })
    }

    /// Error of a value against a sample. Values that are not numbers are infinitely wrong.
    fn error(&self, channel: Channel, value: Value, sample: &RaySample) -> f64 {
        let hit = sample.hit.as_ref();
        let error = match (channel, value, hit) {
            (Channel::Object, Value::Number(number), _) => {
                let wanted = hit.map_or(0, |hit| self.scene.object_of_surface(hit.surface));
                if number == wanted { 0.0 } else { f64::INFINITY }
            }
            (_, Value::Number(number), _) => {
                let wanted = hit.map_or(0, |hit| self.scene.class_of_surface(hit.surface));
                if number == wanted { 0.0 } else { f64::INFINITY }
            }
            (_, Value::Floats(value), None) => {
                if value == DVec3::ZERO {
                    0.0
                } else {
                    f64::INFINITY
                }
            }
            (Channel::Range, Value::Floats(value), Some(hit)) => {
                let wanted_m = hit.point_ned_m.distance(sample.pose.position_ned_m);
                if value.x > 0.0 { (value.x - wanted_m).abs() / wanted_m } else { f64::INFINITY }
            }
            (_, Value::Floats(value), Some(hit)) => {
                let wanted =
                    if channel == Channel::Normal { sample.normal_camera(hit) } else { hit.normal_ned };
                angle(value, wanted)
            }
        };
        if error.is_nan() { f64::INFINITY } else { error }
    }

    /// Whether a surface near a pixel's centre has a value.
    fn has_beside(&self, channel: Channel, i: usize, value: Value) -> bool {
        beside_offsets(self.near_px).any(|offset| {
            let beside = self.view.sample(self.pixel(i), offset, 0.0);
            beside.is_some_and(|beside| !is_beyond(channel, self.error(channel, value, &beside)))
        })
    }

    /// Whether all pixels around one show the same object.
    pub(super) fn is_away(&self, i: usize) -> bool {
        self.around(i).all(|beside| self.object(beside) == self.object(i))
    }

    /// Object that a pixel's centre sees; `None` without a ray.
    pub(super) fn object(&self, i: usize) -> Option<u32> {
        let of_hit = |sample: &RaySample| {
            sample.hit.as_ref().map_or(0, |hit| self.scene.object_of_surface(hit.surface))
        };
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

/// The error at a share of sorted ones; 0 without any.
pub(super) fn at_share(sorted: &[f64], share: f64) -> f64 {
    let last = sorted.len().saturating_sub(1);
    sorted.get((share * last as f64).ceil() as usize).copied().unwrap_or(0.0)
}

fn is_beyond(channel: Channel, error: f64) -> bool {
    error
        > match channel {
            Channel::Range => DEPTH_TOLERANCE,
            Channel::Normal | Channel::NormalWorld => NORMAL_TOLERANCE_RAD,
            _ => 0.0,
        }
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
