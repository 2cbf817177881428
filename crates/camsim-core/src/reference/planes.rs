//! Truth planes of the oracle: what the ray of each pixel's centre meets at mid-exposure.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{
    FrameView, Hit, Oracle, RaySample, RenderOptions,
    render::{EVEN_3D, shifts},
};
use crate::{
    frame::{Plane, PlaneValues},
    scenario::Channel,
};

/// Rays of a pixel for [`Channel::Coverage`].
const COVERAGE_RAYS: u32 = 256;

/// Whether [`Oracle::render`] delivers the plane of a channel.
#[must_use]
pub fn is_rendered(channel: Channel) -> bool {
    match channel {
        Channel::Range
        | Channel::Normal
        | Channel::NormalWorld
        | Channel::Object
        | Channel::Class
        | Channel::Coverage => true,
        other => other.plane().is_none(),
    }
}

impl Oracle {
    /// Planes of the channels that [`is_rendered`] names.
    pub(super) fn planes(&self, frame: u64, options: &RenderOptions) -> Vec<Plane> {
        let mut channels: Vec<Channel> = Vec::new();
        for &channel in &options.channels {
            if channel.plane().is_some() && is_rendered(channel) && !channels.contains(&channel) {
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
            _ => PlaneValues::Float(
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

impl RaySample {
    /// Normal of the surface in optical camera axes.
    pub(super) fn normal_camera(&self, hit: &Hit) -> DVec3 {
        self.pose.ned_from_camera.conjugate() * hit.normal_ned
    }
}

impl FrameView<'_> {
    /// Share of a pixel's area and exposure whose rays meet the same object as the sample at its centre, of
    /// the part of the area that has rays.
    fn coverage(&self, [x, y]: [u32; 2], centre: &RaySample) -> f64 {
        let object =
            |hit: Option<Hit>| hit.map_or(0, |hit| self.oracle.sequence.scene.object_of_surface(hit.surface));
        let wanted = object(centre.hit);
        let shift = shifts(u64::from(y) << 32 | u64::from(x));
        let (mut same, mut all) = (0_u32, 0_u32);
        for i in 0..COVERAGE_RAYS {
            let [x_share, y_share, phase] =
                [0, 1, 2].map(|k: usize| (shift[k] + f64::from(i) * EVEN_3D[k]).fract() - 0.5);
            let Some(sample) = self.sample([x, y], DVec2::new(x_share, y_share), phase) else { continue };
            all += 1;
            same += u32::from(object(sample.hit) == wanted);
        }
        f64::from(same) / f64::from(all.max(1))
    }
}
