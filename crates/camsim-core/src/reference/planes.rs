//! Truth planes of the reference: what the ray of each pixel's centre meets at mid-exposure.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{
    FrameView, Hit, RaySample, ReferenceRenderer, RenderOptions,
    flow::FlowPicture,
    render::{EVEN_3D, shifts},
};
use crate::{
    frame::{Plane, PlaneValues},
    scenario::{Channel, ChannelSource, PlaneKind},
};

/// Rays of a pixel for [`Channel::Coverage`].
const COVERAGE_RAYS: u32 = 256;

/// Values of a channel at a pixel: its components, or a number, and 0 in what is left.
pub(super) type Value = [f64; 4];

/// A channel of a frame by the reference's rays.
pub(super) struct PlaneReference<'a> {
    channel: Channel,
    view: &'a FrameView<'a>,
    /// The picture that a flow leads to.
    picture: Option<FlowPicture<'a>>,
}

impl ReferenceRenderer {
    /// Planes of the channels that rays give.
    pub(super) fn planes(&self, frame: u64, options: &RenderOptions) -> Vec<Plane> {
        let mut channels: Vec<Channel> = Vec::new();
        for &channel in &options.channels {
            if channel.facts().source == ChannelSource::Rays && !channels.contains(&channel) {
                channels.push(channel);
            }
        }
        if channels.is_empty() {
            return Vec::new();
        }
        let view = self.view(frame);
        let [width, height] = self.sequence.scenario.camera.size_px;
        let count = width as usize * height as usize;
        let pixel = |i: usize| [i as u32 % width, i as u32 / width];
        let is_wanted =
            |i: usize| options.only.as_ref().is_none_or(|only| only.get(i).copied().unwrap_or(false));
        let samples: Vec<Option<RaySample>> = (0..count)
            .into_par_iter()
            .map(|i| is_wanted(i).then(|| view.sample(pixel(i), DVec2::ZERO, 0.0)).flatten())
            .collect();
        let plane = |&channel: &Channel| {
            let reference = PlaneReference::new(&view, frame, channel);
            let value = |(i, sample): (usize, &Option<RaySample>)| {
                sample.as_ref().map_or([0.0; 4], |seen| reference.value(pixel(i), DVec2::ZERO, seen))
            };
            let values = samples.par_iter().enumerate().map(value);
            let values = match channel.kind() {
                PlaneKind::Index => PlaneValues::Index(values.map(|[number, ..]| number as u32).collect()),
                _ => {
                    let count = channel.components().len();
                    let floats = |value: Value| value.map(|part| part as f32).into_iter().take(count);
                    PlaneValues::Float(values.flat_map_iter(floats).collect())
                }
            };
            Plane { channel, values }
        };
        channels.iter().map(plane).collect()
    }
}

impl<'a> PlaneReference<'a> {
    pub(super) fn new(view: &'a FrameView<'a>, frame: u64, channel: Channel) -> Self {
        let reference = view.reference;
        let output = &reference.sequence.scenario.output;
        let step = i64::from(output.flow_step);
        let picture = match channel {
            Channel::Flow => Some(reference.flow_frame(frame as i64 + step)),
            Channel::FlowBack => Some(reference.flow_frame(frame as i64 - step)),
            Channel::FlowGlobal => Some(reference.flow_global(frame, output.flow_instant)),
            _ => None,
        };
        Self { channel, view, picture }
    }

    /// What a ray through a pixel, `offset` from its centre, sees.
    pub(super) fn value(&self, pixel: [u32; 2], offset: DVec2, seen: &RaySample) -> Value {
        let scene = &self.view.reference.sequence.scene;
        let from_px = DVec2::from_array(pixel.map(f64::from)) + offset;
        let one = |value: f64| [value, 0.0, 0.0, 0.0];
        let hit = seen.hit.as_ref();
        let number = |of: &dyn Fn(u32) -> u32| one(hit.map_or(0.0, |hit| f64::from(of(hit.surface))));
        let vector = |vector: DVec3| [vector.x, vector.y, vector.z, 0.0];
        match self.channel {
            Channel::Range => one(hit.map_or(0.0, |hit| hit.point_ned_m.distance(seen.pose.position_ned_m))),
            Channel::Normal => {
                vector(hit.map_or(DVec3::ZERO, |hit| seen.pose.ned_from_camera.conjugate() * hit.normal_ned))
            }
            Channel::NormalWorld => vector(hit.map_or(DVec3::ZERO, |hit| hit.normal_ned)),
            Channel::Object => number(&|surface| scene.object_of_surface(surface)),
            Channel::Class => number(&|surface| scene.class_of_surface(surface)),
            Channel::Coverage => one(self.view.coverage(pixel, seen)),
            Channel::Flow | Channel::FlowBack | Channel::FlowGlobal => {
                let Some(picture) = &self.picture else { return [0.0; 4] };
                let (shift, state) = picture.flow(from_px, seen);
                [shift.x, shift.y, f64::from(state as u8), 0.0]
            }
            Channel::Motion => {
                let px_s = self.view.motion(seen);
                [px_s.x, px_s.y, 0.0, 0.0]
            }
            Channel::BlurPath => {
                let [begin, end] = self.view.blur_path(from_px, seen);
                [begin.x, begin.y, end.x, end.y]
            }
            Channel::Color
            | Channel::Depth
            | Channel::Valid
            | Channel::Rows
            | Channel::Raw
            | Channel::Coords => [0.0; 4],
        }
    }
}

impl FrameView<'_> {
    /// Fraction of a pixel's area and exposure whose rays meet the same object as the sample at its centre, of
    /// the part of the area that has rays.
    pub(super) fn coverage(&self, pixel: [u32; 2], centre: &RaySample) -> f64 {
        self.coverage_of(pixel, centre, &[]).0
    }

    /// As [`Self::coverage`], and the fraction of rays that meet none of the objects in `known`.
    pub(super) fn coverage_of(&self, [x, y]: [u32; 2], centre: &RaySample, known: &[u32]) -> (f64, f64) {
        let object = |hit: Option<Hit>| {
            hit.map_or(0, |hit| self.reference.sequence.scene.object_of_surface(hit.surface))
        };
        let wanted = object(centre.hit);
        let shift = shifts(u64::from(y) << 32 | u64::from(x));
        let (mut same, mut unknown, mut all) = (0_u32, 0_u32, 0_u32);
        for i in 0..COVERAGE_RAYS {
            let [x_part, y_part, phase] =
                [0, 1, 2].map(|k: usize| (shift[k] + f64::from(i) * EVEN_3D[k]).fract() - 0.5);
            let Some(sample) = self.sample([x, y], DVec2::new(x_part, y_part), phase) else { continue };
            all += 1;
            let number = object(sample.hit);
            same += u32::from(number == wanted);
            unknown += u32::from(number != wanted && !known.contains(&number));
        }
        let fraction = |count: u32| f64::from(count) / f64::from(all.max(1));
        (fraction(same), fraction(unknown))
    }
}
