//! The reverse pipeline on an ideal RGB-D frame of any origin (Blender, AirSim, Gazebo, a depth camera), as
//! used by `camsim apply`.
//!
//! Output pixel -> lens inverse -> row time -> temporal inverse -> gather over exposure and area ->
//! photometric stage: section 2 of the paper, in f64 on all CPU cores, by the f64 twins that define the
//! shaders. There are two sets of methods:
//!
//! * [`Preset::Default`]: exact relative poses; depth by fixed-point iteration, and by a search along the
//!   epipolar line where surfaces meet; the curved exposure path; footprint taps; averages in linear light.
//! * [`Preset::Paper`]: the methods of the paper ([`paper`]).
//!
//! Instants are seconds relative to the stamp of the frame. The ideal frame shows the scene at
//! [`IdealFrame::instant_s`], where 0 is the stamp itself.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::{
    camera::CameraModel,
    frame::{Plane, RenderedFrame},
    imaging::{ImageSensor, Optics},
    noise::{camera_seed, tail_table},
    photometric::{GrayImage, Photometry, photometric},
    scenario::{CameraSpec, Preset, Primary, Reset, Solver},
    scene::{linear_from_srgb, srgb_from_linear},
    shutter::Shutter,
    temporal::{
        ColorImage, Footprint, InverseDepthImage, PathStage, Source, TapStage,
        displacement::{self, RK2_STEP_DEG, Twist},
        gather, samples_for,
    },
    vignetting::pixel_weights,
};

mod depth_search;
mod flow;
mod ideal;
mod motion;
pub mod paper;

use depth_search::DepthSearch;
pub use flow::FlowField;
use flow::FlowSearch;
pub use ideal::{ApplyError, IdealFrame, NoSource, NoSourceCounts};
pub use motion::{Motion, PoseRow, PoseTrack, PoseTrackError};

/// Largest deviation of the exposure polyline from the curved path, output pixels.
const CHORD_MISS_PX: f64 = 0.01;
/// Largest number of exposure nodes.
const MAX_NODES: u32 = 65;
/// Exposure samples per pixel of path. With 2 the error stays below 1/255 on white texture
/// (docs/accuracy/stress.md).
const SAMPLES_PER_PX: f64 = 2.0;
/// Largest number of samples between two nodes.
const MAX_SAMPLES: u32 = 1024;
/// Largest number of footprint taps per axis.
const MAX_TAPS: u32 = 8;
/// Parallax over the exposure between the surfaces around a source above which every exposure sample is
/// solved on its own, pixels.
const EDGE_PARALLAX_PX: f64 = 0.1;
/// Relative difference of inverse depth, to the nearer one, above which there is a jump and no slope: the
/// threshold of the depth look-up.
const JUMP: f64 = 0.1;
/// Exposure nodes of a flow, whose paths are straight except for the slopes of the flow. Where these bend a
/// path, every sample is solved on its own.
const FLOW_NODES: u32 = 5;
/// Deviation of the polyline at mid-exposure above which every sample is solved on its own, pixels.
const MAX_BEND_PX: f64 = 0.05;

/// Settings of the pipeline.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Set of methods.
    pub preset: Preset,
    /// Temporal inverse; [`Solver::Reproject`] by default, [`Solver::Rk2`] with the paper's preset. Another
    /// solver can be combined with the paper's preset to separate its causes of error.
    pub solver: Option<Solver>,
    /// Number of exposure samples. `None` derives it from the length of the path (100 with the paper's
    /// preset).
    pub blur_samples: Option<u32>,
    /// The paper's fog; only with its preset.
    pub fog: Option<paper::LinearFog>,
    /// Seed of the noise, combined with the camera's name (`camera_seed`).
    pub seed: u64,
    /// Frame number, for the noise and the name of the frame.
    pub frame: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { preset: Preset::Default, solver: None, blur_samples: None, fog: None, seed: 0, frame: 0 }
    }
}

/// The pipeline of one frame, with all data that its pixels share.
#[derive(Debug)]
pub struct Pipeline<'a> {
    spec: &'a CameraSpec,
    camera: CameraModel,
    shutter: Shutter,
    frame: &'a IdealFrame,
    motion: &'a Motion,
    settings: Settings,
    solver: Solver,
    twist: Twist,
    edges: DepthSearch,
    flow: Option<FlowSearch>,
    /// Stored (encoded) colours; only for the paper's preset.
    stored_rgba: Vec<f32>,
    nodes: u32,
    noise_seed: u64,
}

impl<'a> Pipeline<'a> {
    /// Checks the inputs and prepares the pipeline.
    ///
    /// # Errors
    /// A camera, frame or motion that cannot be used, or settings that contradict each other.
    pub fn new(
        spec: &'a CameraSpec,
        frame: &'a IdealFrame,
        motion: &'a Motion,
        settings: &Settings,
    ) -> Result<Self, ApplyError> {
        if spec.auto_exposure.is_some() {
            return Err(ApplyError::AutoExposure);
        }
        let camera = CameraModel::from_spec(spec)?;
        let shutter = Shutter::from_spec(&spec.shutter, spec.fps, spec.size_px)?;
        if shutter.reset() == Reset::Global {
            return Err(ApplyError::Reset);
        }
        frame.check()?;
        let (first_s, last_s) = shutter.window_s();
        motion.covers(first_s.min(frame.instant_s), last_s.max(frame.instant_s))?;
        let paper = settings.preset == Preset::Paper;
        if settings.fog.is_some() && !paper {
            return Err(ApplyError::Fog);
        }
        if spec.point_spread.is_some() && paper {
            return Err(ApplyError::PointSpread);
        }
        let solver = settings.solver.unwrap_or(if paper { Solver::Rk2 } else { Solver::Reproject });
        if solver == Solver::Reference {
            return Err(ApplyError::Reference);
        }
        let flow = match motion {
            Motion::Flow(flow) => {
                frame.check_flow(flow)?;
                if paper || solver != Solver::Reproject {
                    return Err(ApplyError::Flow);
                }
                Some(FlowSearch::new(flow))
            }
            _ => None,
        };
        let depth = InverseDepthImage { size_px: frame.geometry.size_px, values: &frame.inverse_depth };
        let edges = DepthSearch::new(&depth);
        let stored_rgba = if paper {
            frame.color_rgba.iter().map(|&v| srgb_from_linear(v.clamp(0.0, 1.0))).collect()
        } else {
            Vec::new()
        };
        let twist = motion.twist_at(frame.instant_s);
        let noise_seed = camera_seed(settings.seed, &spec.name);
        let settings = settings.clone();
        let mut pipeline = Self {
            spec,
            camera,
            shutter,
            frame,
            motion,
            settings,
            solver,
            twist,
            edges,
            flow,
            stored_rgba,
            nodes: 1,
            noise_seed,
        };
        pipeline.nodes = pipeline.exposure_nodes();
        Ok(pipeline)
    }

    /// Number of exposure nodes that are solved exactly; the path between two of them is straight.
    #[must_use]
    pub fn nodes(&self) -> u32 {
        self.nodes
    }

    /// For a flow: the first and last instant that is read, as fractions of the interval after the ideal frame.
    /// Outside of 0 to 1 the flow is extrapolated.
    #[must_use]
    pub fn flow_fractions(&self) -> Option<[f64; 2]> {
        let (first_s, last_s) = self.shutter.window_s();
        let fractions = [first_s, last_s].map(|at_s| self.flow_fraction(at_s - self.frame.instant_s));
        self.flow.as_ref().map(|_| [fractions[0].min(fractions[1]), fractions[0].max(fractions[1])])
    }

    /// Source of a pixel in the ideal frame at exposure phase `phase` (-0.5 is the begin, 0.5 the end).
    ///
    /// # Errors
    /// Why the pixel has no source.
    pub fn source(&self, pixel: [u32; 2], phase: f64) -> Result<Source, NoSource> {
        let uv = self
            .camera
            .unproject(DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])))
            .ok_or(NoSource::NoRay)?;
        self.source_of_ray(
            uv,
            self.shutter.dt_pixel_s(pixel[0], pixel[1]) + phase * self.shutter.exposure_s(),
        )
    }

    /// As [`Pipeline::source`], for an ideal ray at an instant.
    fn source_of_ray(&self, uv: DVec2, dt_s: f64) -> Result<Source, NoSource> {
        let ideal = &self.frame.geometry;
        let holes = &self.frame.holes;
        if let Some(flow) = &self.flow {
            let fraction = self.flow_fraction(dt_s - self.frame.instant_s);
            return flow.source(ideal.px_from_point(uv.extend(1.0)), fraction, &self.depth(), holes, ideal);
        }
        if self.solver == Solver::Reproject {
            return self.edges.source(
                uv,
                self.motion.key_from(dt_s, self.frame.instant_s),
                &self.depth(),
                holes,
                ideal,
            );
        }
        // The paper's models read the depth at the position that the ray would have without motion.
        if !holes.is_empty() && holes[self.depth().nearest_index(ideal.px_from_point(uv.extend(1.0)))] {
            return Err(NoSource::Hole);
        }
        let inverse_depth = self.inverse_depth_of_ray(uv);
        let shift_s = dt_s - self.frame.instant_s;
        let moved = match self.solver {
            Solver::Linear => displacement::linear(uv, inverse_depth, &self.twist, shift_s),
            _ => displacement::rk2(uv, inverse_depth, &self.twist, shift_s, RK2_STEP_DEG.to_radians()),
        };
        let position_px = ideal.px_from_point(moved.extend(1.0));
        if position_px.is_finite() && ideal.contains(position_px) {
            Ok(Source { position_px, inverse_depth })
        } else {
            Err(NoSource::Outside)
        }
    }

    /// Fraction of the flow's interval at a time; 0 without a flow.
    fn flow_fraction(&self, dt_s: f64) -> f64 {
        if let Motion::Flow(flow) = self.motion { dt_s / flow.interval_s } else { 0.0 }
    }

    /// Depth for the paper's models, at the position that the ray would have without motion: the nearest
    /// texel with the paper's preset, bilinear otherwise.
    fn inverse_depth_of_ray(&self, uv: DVec2) -> f64 {
        let position_px = self.frame.geometry.px_from_point(uv.extend(1.0));
        if self.settings.preset == Preset::Paper {
            self.depth().nearest(position_px)
        } else {
            self.depth().inverse_depth(position_px)
        }
    }

    fn depth(&self) -> InverseDepthImage<'_> {
        InverseDepthImage { size_px: self.frame.geometry.size_px, values: &self.frame.inverse_depth }
    }

    fn color(&self) -> ColorImage<'_> {
        ColorImage { size_px: self.frame.geometry.size_px, rgba: &self.frame.color_rgba }
    }

    fn stored(&self) -> ColorImage<'_> {
        ColorImage { size_px: self.frame.geometry.size_px, rgba: &self.stored_rgba }
    }

    /// The finished frame, with depth in the camera of each row. `vignette` is the image named by
    /// `photometric.vignette`.
    #[must_use]
    pub fn render(&self, vignette: Option<&GrayImage>) -> RenderedFrame {
        self.render_and_count(vignette).0
    }

    /// As [`Pipeline::render`], with the number of pixels without a source.
    #[must_use]
    pub fn render_and_count(&self, vignette: Option<&GrayImage>) -> (RenderedFrame, NoSourceCounts) {
        let size_px @ [width, height] = self.camera.size_px;
        let weights = pixel_weights(self.spec, vignette, Primary::Green);
        let table = tail_table();
        let pixels: Vec<Result<([f32; 3], f32), NoSource>> = (0..height)
            .into_par_iter()
            .flat_map_iter(|y| (0..width).map(move |x| [x, y]))
            .map(|pixel| {
                let weight =
                    weights.as_ref().map_or(1.0, |weights| weights[(pixel[1] * width + pixel[0]) as usize]);
                self.pixel(pixel, weight, &table)
            })
            .collect();
        let color_rgba =
            pixels.iter().flat_map(|found| found.map_or([0.0; 4], |([r, g, b], _)| [r, g, b, 1.0])).collect();
        let depth_m = pixels.iter().map(|found| found.map_or(0.0, |(_, depth_m)| depth_m)).collect();
        let mut counts = NoSourceCounts::default();
        pixels.iter().filter_map(|found| found.err()).for_each(|why| counts.add(why));
        let mut frame = RenderedFrame {
            index: self.settings.frame,
            size_px,
            planes: vec![Plane::color(color_rgba), Plane::depth(depth_m)],
            ..RenderedFrame::default()
        };
        if let Some(optics) = Optics::new(self.spec, self.settings.seed) {
            optics.expose(&mut frame, None);
        }
        if let Some(sensor) = ImageSensor::new(self.spec, self.settings.seed) {
            // These frames have no time on a clock: the stamp is 0.
            sensor.expose(&mut frame, 0.0, None);
        }
        (frame, counts)
    }

    /// Linear colour and depth of a pixel. Pixels that the vignette makes black are not gathered.
    fn pixel(&self, pixel: [u32; 2], weight: f32, table: &[f32]) -> Result<([f32; 3], f32), NoSource> {
        let uv = self
            .camera
            .unproject(DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])))
            .ok_or(NoSource::NoRay)?;
        let dt_s = self.shutter.dt_pixel_s(pixel[0], pixel[1]);
        let middle = self.source_of_ray(uv, dt_s);
        let depth_m = middle.map_or(0.0, |source| {
            if source.inverse_depth > 0.0 { (1.0 / source.inverse_depth) as f32 } else { 0.0 }
        });
        let frame = self.settings.frame as u32;
        let stage = Photometry::new(self.spec, None);
        let finish = |color: DVec3| {
            photometric(&stage, color.as_vec3().to_array(), weight, pixel, frame, self.noise_seed, table)
        };
        if weight <= 0.0 {
            return Ok((finish(DVec3::ZERO), depth_m));
        }
        if self.settings.preset == Preset::Paper {
            // In the paper's preset, vignette, light and noise act on stored values. The colour is decoded
            // only afterwards, so that output files have the usual encodings.
            let stored = finish(self.gather_paper(uv, dt_s)?);
            return Ok((stored.map(linear_from_srgb), depth_m));
        }
        Ok((finish(self.gather_exact(uv, dt_s, middle?)?), depth_m))
    }

    /// Mean over the exposure and the pixel's area in linear light. An error if the source at any node is
    /// outside of the ideal frame or in a hole of its depth.
    fn gather_exact(&self, uv: DVec2, dt_s: f64, middle: Source) -> Result<DVec3, NoSource> {
        let area = self.footprint(uv, dt_s, &middle);
        let exposure_s = self.shutter.exposure_s();
        if self.nodes < 2 {
            return Ok(gather(
                &[middle.position_px],
                PathStage::Straight,
                &area,
                &self.color(),
                SAMPLES_PER_PX,
                MAX_SAMPLES,
            ));
        }
        let at_node = |k: u32| dt_s + exposure_s * (f64::from(k) / f64::from(self.nodes - 1) - 0.5);
        let sources: Result<Vec<Source>, NoSource> =
            (0..self.nodes).map(|k| self.source_of_ray(uv, at_node(k))).collect();
        let sources = sources?;
        let nodes_px: Vec<DVec2> = sources.iter().map(|source| source.position_px).collect();
        let (per_px, cap) = match self.settings.blur_samples {
            Some(samples) => (f64::from(samples), samples.div_ceil(self.nodes - 1)),
            None => (SAMPLES_PER_PX, MAX_SAMPLES),
        };
        if !self.sees_parallax(uv, dt_s, &sources, middle.position_px) {
            return Ok(gather(&nodes_px, PathStage::Straight, &area, &self.color(), per_px, cap));
        }
        // Surfaces with different parallax over the exposure: every sample is solved on its own.
        let length_px: f64 = nodes_px.windows(2).map(|ends| ends[0].distance(ends[1])).sum();
        let count = samples_for(
            length_px,
            per_px,
            (area.taps[0] * area.taps[1]).max(self.nodes),
            cap.saturating_mul(self.nodes - 1),
        );
        let color = self.color();
        let sample = |i: u32| {
            let phase = (f64::from(i) + 0.5) / f64::from(count) - 0.5;
            let source = self.source_of_ray(uv, dt_s + phase * exposure_s);
            source.map(|source| area.tap_color(&color, source.position_px, i))
        };
        let sum: Result<DVec3, NoSource> = (0..count).map(sample).sum();
        sum.map(|sum| sum / f64::from(count))
    }

    /// Whether surfaces meet near the sources and the exposure's motion gives them different parallax, or
    /// whether the polyline deviates from the path at mid-exposure.
    fn sees_parallax(&self, uv: DVec2, dt_s: f64, sources: &[Source], middle_px: DVec2) -> bool {
        let half = sources.len() / 2;
        let chord_px = sources[(sources.len() - 1) / 2].position_px.midpoint(sources[half].position_px);
        if chord_px.distance(middle_px) > MAX_BEND_PX {
            return true;
        }
        let half_s = 0.5 * self.shutter.exposure_s();
        if let Some(flow) = &self.flow {
            let fractions = [-half_s, half_s]
                .map(|from_middle_s| self.flow_fraction(dt_s + from_middle_s - self.frame.instant_s));
            return flow.may_separate(
                self.frame.geometry.px_from_point(uv.extend(1.0)),
                fractions,
                EDGE_PARALLAX_PX,
            );
        }
        let (_, begin) = self.motion.key_from(dt_s - half_s, self.frame.instant_s);
        let (_, end) = self.motion.key_from(dt_s + half_s, self.frame.instant_s);
        let travel_px_m = self.frame.geometry.focal_px.max_element() * begin.distance(end);
        let depth = self.depth();
        let apart = |difference: f64, nearer: f64| {
            difference > JUMP * nearer && difference * travel_px_m > EDGE_PARALLAX_PX
        };
        let between = |pair: &[Source]| {
            let [a, b] = [pair[0].inverse_depth, pair[1].inverse_depth];
            apart((a - b).abs(), a.max(b))
        };
        sources.windows(2).any(between)
            || sources.iter().any(|source| apart(depth.spread(source.position_px), source.inverse_depth))
    }

    /// Footprint of a pixel: the change of the source per output pixel, from the inverse Jacobian of the lens
    /// and the relative pose at the depth of the ray.
    fn footprint(&self, uv: DVec2, dt_s: f64, source: &Source) -> Footprint {
        let uv_from_px = self.camera.lens.jacobian(uv).inverse();
        let focal = self.camera.focal_px;
        let pixel = [DVec2::new(1.0 / focal.x, 0.0), DVec2::new(0.0, 1.0 / focal.y)];
        if let Some(flow) = &self.flow {
            let source_from_ray =
                flow.source_from_ray(source.position_px, self.flow_fraction(dt_s - self.frame.instant_s));
            let [dx, dy] = pixel.map(|d| source_from_ray * (self.frame.geometry.focal_px * (uv_from_px * d)));
            return Footprint::new(dx, dy, TapStage::SplineOrGrid { most: MAX_TAPS });
        }
        let (rotation, shift) = self.motion.key_from(dt_s, self.frame.instant_s);
        let p = rotation * uv.extend(1.0) + source.inverse_depth * shift;
        let step = |d: DVec2| {
            let moved = rotation * (uv_from_px * d).extend(0.0);
            self.frame.geometry.focal_px * (moved.truncate() - p.truncate() * (moved.z / p.z)) / p.z
        };
        let [dx, dy] = pixel.map(step);
        Footprint::new(dx, dy, TapStage::SplineOrGrid { most: MAX_TAPS })
    }

    /// Number of nodes for which no chord deviates from the path by more than [`CHORD_MISS_PX`], tested on a
    /// grid of pixels. The deviation falls with the square of the number of segments.
    fn exposure_nodes(&self) -> u32 {
        let exposure_s = self.shutter.exposure_s();
        if exposure_s <= 0.0 {
            return 1;
        }
        if self.flow.is_some() {
            return FLOW_NODES;
        }
        let steps = self.motion.instants(exposure_s);
        let [width, height] = self.camera.size_px;
        let pixels = (0..63_u32).map(|i| [(i % 9) * (width - 1) / 8, (i / 9) * (height - 1) / 6]);
        let ideal = &self.frame.geometry;
        let (mut longest, mut miss) = (0.0_f64, 0.0_f64);
        for [x, y] in pixels {
            let Some(uv) = self.camera.unproject(DVec2::new(f64::from(x), f64::from(y))) else { continue };
            let w = self.inverse_depth_of_ray(uv);
            let mid_s = self.shutter.dt_pixel_s(x, y);
            let path_px: Vec<DVec2> = (0..=steps)
                .map(|k| {
                    let t_s = mid_s + exposure_s * (f64::from(k) / f64::from(steps) - 0.5);
                    let (rotation, shift) = self.motion.key_from(t_s, self.frame.instant_s);
                    ideal.px_from_point(rotation * uv.extend(1.0) + w * shift)
                })
                .filter(|path_px| path_px.is_finite())
                .collect();
            longest = longest.max(path_px.windows(2).map(|pair| pair[0].distance(pair[1])).sum());
            if let (Some(&a), Some(&b)) = (path_px.first(), path_px.last()) {
                let parts = (path_px.len() - 1).max(1) as f64;
                miss = path_px
                    .iter()
                    .enumerate()
                    .map(|(k, p)| p.distance(a.lerp(b, k as f64 / parts)))
                    .fold(miss, f64::max);
            }
        }
        if longest == 0.0 {
            return 1;
        }
        ((miss / CHORD_MISS_PX).sqrt().ceil().clamp(1.0, f64::from(MAX_NODES - 1)) as u32 + 1).max(2)
    }
}

#[cfg(test)]
mod tests;
