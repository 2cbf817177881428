//! Truth planes of the oracle: what the ray of each pixel's centre meets at mid-exposure.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{
    FrameView, Hit, Oracle, RaySample, RenderOptions,
    flow::FlowPicture,
    render::{EVEN_3D, shifts},
};
use crate::{
    frame::{Plane, PlaneValues},
    scenario::Channel,
};

/// Rays of a pixel for [`Channel::Coverage`].
const COVERAGE_RAYS: u32 = 256;

impl Oracle {
    /// Planes of the channels that have one.
    pub(super) fn planes(&self, frame: u64, options: &RenderOptions) -> Vec<Plane> {
        let mut channels: Vec<Channel> = Vec::new();
        for &channel in &options.channels {
            if channel.plane().is_some() && !channels.contains(&channel) {
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
        let floats = |value: &(dyn Fn(&RaySample, &Hit) -> DVec3 + Sync), components: usize| {
            let of_pixel = |sample: &Option<RaySample>| {
                let seen = sample.as_ref().and_then(|sample| Some((sample, sample.hit.as_ref()?)));
                seen.map_or(DVec3::ZERO, |(sample, hit)| value(sample, hit)).as_vec3().to_array()
            };
            let values = samples.iter().map(of_pixel);
            PlaneValues::Float(values.flat_map(|value| value.into_iter().take(components)).collect())
        };
        let numbers = |number: &dyn Fn(u32) -> u32| {
            let seen = samples.iter().map(|sample| sample.and_then(|sample| sample.hit));
            PlaneValues::Index(seen.map(|hit| hit.map_or(0, |hit| number(hit.surface))).collect())
        };
        let scene = &self.sequence.scene;
        let values = |channel: Channel| match channel {
            Channel::Range => {
                floats(&|sample, hit| DVec3::X * hit.point_ned_m.distance(sample.pose.position_ned_m), 1)
            }
            Channel::Normal => floats(&|sample, hit| sample.normal_camera(hit), 3),
            Channel::NormalWorld => floats(&|_, hit| hit.normal_ned, 3),
            Channel::Object => numbers(&|surface| scene.object_of_surface(surface)),
            Channel::Class => numbers(&|surface| scene.class_of_surface(surface)),
            Channel::Flow | Channel::FlowBack | Channel::FlowGlobal | Channel::Motion | Channel::BlurPath => {
                self.flow_plane(frame, channel, &view, &samples)
            }
            Channel::Color
            | Channel::Depth
            | Channel::Valid
            | Channel::Rows
            | Channel::Raw
            | Channel::Coords => PlaneValues::Float(Vec::new()),
            Channel::Coverage => PlaneValues::Float(
                samples
                    .par_iter()
                    .enumerate()
                    .map(|(i, sample)| sample.map_or(0.0, |sample| view.coverage(pixel(i), &sample) as f32))
                    .collect(),
            ),
        };
        channels.iter().map(|&channel| Plane { channel, values: values(channel) }).collect()
    }
}

impl Oracle {
    /// Flows, motion or blur path of all samples.
    fn flow_plane(
        &self,
        frame: u64,
        channel: Channel,
        view: &FrameView<'_>,
        samples: &[Option<RaySample>],
    ) -> PlaneValues {
        let width = self.sequence.scenario.camera.size_px[0];
        let picture = self.flow_picture(frame, channel);
        let of_pixel = |(i, sample): (usize, &Option<RaySample>)| {
            let from_px = DVec2::new(f64::from(i as u32 % width), f64::from(i as u32 / width));
            let pair = |px: DVec2| px.as_vec2().to_array();
            match (channel, sample, &picture) {
                (_, Some(seen), Some(picture)) => {
                    let (shift, state) = picture.flow(from_px, seen);
                    let [dx, dy] = pair(shift);
                    vec![dx, dy, f32::from(state as u8)]
                }
                (Channel::Motion, Some(seen), None) => pair(view.motion(seen)).to_vec(),
                (_, Some(seen), None) => view.blur_path(from_px, seen).map(pair).concat(),
                (Channel::Motion, None, _) => vec![0.0; 2],
                (Channel::BlurPath, None, _) => vec![0.0; 4],
                (_, None, _) => vec![0.0; 3],
            }
        };
        PlaneValues::Float(samples.par_iter().enumerate().flat_map_iter(of_pixel).collect())
    }

    /// The picture that a flow of a frame leads to; `None` for other channels.
    pub(super) fn flow_picture(&self, frame: u64, channel: Channel) -> Option<FlowPicture<'_>> {
        let output = &self.sequence.scenario.output;
        let step = i64::from(output.flow_step);
        match channel {
            Channel::Flow => Some(self.flow_frame(frame as i64 + step)),
            Channel::FlowBack => Some(self.flow_frame(frame as i64 - step)),
            Channel::FlowGlobal => Some(self.flow_global(frame, output.flow_instant)),
            _ => None,
        }
    }
}

impl RaySample {
    /// Normal of the surface in optical camera axes.
    pub(super) fn normal_camera(&self, hit: &Hit) -> DVec3 {
        self.pose.ned_from_camera.conjugate() * hit.normal_ned
    }
}

impl FrameView<'_> {
    /// Share of a pixel's area and exposure whose rays meet the same object as the sample at its centre, of
    /// the part of the area that has rays.
    pub(super) fn coverage(&self, pixel: [u32; 2], centre: &RaySample) -> f64 {
        self.coverage_of(pixel, centre, &[]).0
    }

    /// As [`Self::coverage`], and the share of rays that meet none of the objects in `known`.
    pub(super) fn coverage_of(&self, [x, y]: [u32; 2], centre: &RaySample, known: &[u32]) -> (f64, f64) {
        let object =
            |hit: Option<Hit>| hit.map_or(0, |hit| self.oracle.sequence.scene.object_of_surface(hit.surface));
        let wanted = object(centre.hit);
        let shift = shifts(u64::from(y) << 32 | u64::from(x));
        let (mut same, mut unknown, mut all) = (0_u32, 0_u32, 0_u32);
        for i in 0..COVERAGE_RAYS {
            let [x_share, y_share, phase] =
                [0, 1, 2].map(|k: usize| (shift[k] + f64::from(i) * EVEN_3D[k]).fract() - 0.5);
            let Some(sample) = self.sample([x, y], DVec2::new(x_share, y_share), phase) else { continue };
            all += 1;
            let number = object(sample.hit);
            same += u32::from(number == wanted);
            unknown += u32::from(number != wanted && !known.contains(&number));
        }
        let share = |count: u32| f64::from(count) / f64::from(all.max(1));
        (share(same), share(unknown))
    }
}
