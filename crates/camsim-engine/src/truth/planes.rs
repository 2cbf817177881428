//! The truth channels beside depth and coordinates.

use camsim_core::{
    frame::{Plane, PlaneValues},
    scenario::Channel,
    scene::Scene,
};
use camsim_plan::{FramePlan, FrameRays, PixelHit, PlanError, Planner, uniforms::Truth};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{
    coverage::coverage,
    flow::{blur_path, flow, motion},
};

/// What is known of the pixels of a frame.
pub(crate) struct FramePixels<'a> {
    pub planner: &'a Planner,
    pub plan: &'a FramePlan,
    pub rays: &'a FrameRays<'a>,
    /// Ideal ray of each pixel.
    pub truth: &'a [Truth],
    /// Linear R G B A; A is 1 where a ray exists.
    pub color_rgba: &'a [f32],
    /// What each pixel sees; `None` for the sky.
    pub hits: &'a [Option<PixelHit>],
}

/// One pixel with a ray.
#[derive(Clone, Copy)]
pub(super) struct Pixel<'a> {
    pub position: [u32; 2],
    pub uv: DVec2,
    pub hit: Option<&'a PixelHit>,
}

impl FramePixels<'_> {
    /// Whether pixel i has a ray.
    pub(super) fn is_valid(&self, i: usize) -> bool {
        self.color_rgba[4 * i + 3] > 0.0
    }

    /// Position and ideal ray of pixel i.
    pub(super) fn ray_of(&self, i: usize) -> ([u32; 2], DVec2) {
        let width = self.plan.camera.size_px[0] as usize;
        let [u, v] = self.truth[i].uv.map(f64::from);
        ([(i % width) as u32, (i / width) as u32], DVec2::new(u, v))
    }

    /// Pixel i; `None` without a ray.
    pub(super) fn pixel(&self, i: usize) -> Option<Pixel<'_>> {
        let (position, uv) = self.ray_of(i);
        self.is_valid(i).then(|| Pixel { position, uv, hit: self.hits[i].as_ref() })
    }

    /// One value for each pixel in parallel, `empty` without a ray.
    pub(super) fn map<T: Clone + Send + Sync>(
        &self,
        empty: &T,
        value: impl Fn(Pixel<'_>) -> T + Sync,
    ) -> Vec<T> {
        let of_pixel = |i: usize| self.pixel(i).map_or_else(|| empty.clone(), &value);
        (0..self.truth.len()).into_par_iter().with_min_len(256).map(of_pixel).collect()
    }

    fn floats<const N: usize>(&self, value: impl Fn(Pixel<'_>) -> [f32; N] + Sync) -> PlaneValues {
        PlaneValues::Float(self.map(&[0.0; N], value).into_flattened())
    }

    fn indices(&self, scene: &Scene, number: impl Fn(&Scene, u32) -> u32 + Sync) -> PlaneValues {
        PlaneValues::Index(self.map(&0, |pixel| pixel.hit.map_or(0, |hit| number(scene, hit.surface))))
    }

    fn normal(&self, in_camera: bool) -> PlaneValues {
        self.floats(|pixel| {
            let normal = pixel.hit.map_or(DVec3::ZERO, |hit| hit.normal_ned);
            let normal = match in_camera {
                true => self.rays.pose(pixel.position).ned_from_camera.conjugate() * normal,
                false => normal,
            };
            normal.as_vec3().to_array()
        })
    }
}

/// The planes of the channels that have one.
///
/// # Errors
/// A zoom value of another frame without a usable camera.
pub(crate) fn planes(pixels: &FramePixels<'_>, channels: &[Channel]) -> Result<Vec<Plane>, PlanError> {
    let planner = pixels.planner;
    let scene = &planner.sequence().scene;
    let output = &planner.sequence().scenario.output;
    let frame = pixels.plan.frame as i64;
    let step = i64::from(output.flow_step);
    let flow_to = |frame: i64| -> Result<PlaneValues, PlanError> {
        Ok(pixels.floats_of(flow(pixels, &planner.frame_camera(frame)?)))
    };
    let mut planes = Vec::new();
    for &channel in channels {
        let values = match channel {
            Channel::Color
            | Channel::Depth
            | Channel::Valid
            | Channel::Rows
            | Channel::Raw
            | Channel::Coords => continue,
            Channel::Range => pixels.floats(|pixel| {
                let range_m = pixel.hit.map_or(0.0, |hit| hit.depth_m * pixel.uv.extend(1.0).length());
                [range_m as f32]
            }),
            Channel::Normal => pixels.normal(true),
            Channel::NormalWorld => pixels.normal(false),
            Channel::Object => pixels.indices(scene, Scene::object_of_surface),
            Channel::Class => pixels.indices(scene, Scene::class_of_surface),
            Channel::Coverage => PlaneValues::Float(coverage(pixels)),
            Channel::Flow => flow_to(frame + step)?,
            Channel::FlowBack => flow_to(frame - step)?,
            Channel::FlowGlobal => {
                let camera = planner.global_camera(frame, output.flow_instant)?;
                pixels.floats_of(flow(pixels, &camera))
            }
            Channel::Motion => pixels.floats(|pixel| motion(pixels, pixel)),
            Channel::BlurPath => pixels.floats(|pixel| blur_path(pixels, pixel)),
        };
        planes.push(Plane { channel, values });
    }
    Ok(planes)
}

impl FramePixels<'_> {
    fn floats_of(&self, values: Vec<[f32; 3]>) -> PlaneValues {
        PlaneValues::Float(values.into_flattened())
    }
}
