//! The reverse pipeline on an ideal RGB-D frame of any origin (Blender, AirSim, Gazebo, a depth camera):
//! `camsim apply`.
//!
//! Output pixel -> lens inverse -> line time -> temporal inverse -> gather over exposure and area ->
//! photometric, the paper's section 2, in f64 on the CPU and on all its cores, by the same twins that define
//! the shaders. Two sets of methods:
//!
//! * [`Preset::Default`]: exact relative poses, depth by fixed point and by a search along the ray's path
//!   where surfaces meet, the true curved path over the exposure, footprint taps, linear light;
//! * [`Preset::Paper`]: what the paper does ([`paper`]).
//!
//! Instants are seconds from the frame's stamp. The ideal frame shows its scene at [`IdealFrame::instant_s`],
//! 0 being the stamp itself.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::{
    camera::CameraModel,
    frame::RenderedFrame,
    noise::{camera_seed, tail_table},
    photometric::{photometric, vignette_weights},
    scenario::{CameraSpec, Preset, Solver},
    scene::{linear_from_srgb, srgb_from_linear},
    sequence::GrayImage,
    shutter::Shutter,
    temporal::{
        ColorImage, Footprint, InverseDepthImage, PathStage, Source, TapStage,
        displacement::{self, RK2_STEP_DEG, Twist},
        gather, samples_for,
    },
};

mod flow;
mod ideal;
mod motion;
pub mod paper;
mod search;

pub use flow::FlowField;
use flow::FlowSearch;
pub use ideal::{ApplyError, IdealFrame, Unseen, UnseenCounts};
pub use motion::{Motion, PoseRow, PoseTrack, PoseTrackError};
use search::DepthEdges;

/// Part of an output pixel by which the polyline over the exposure may miss the curved path.
const CHORD_MISS_PX: f64 = 0.01;
/// Most exposure nodes.
const MAX_NODES: u32 = 65;
/// Samples a pixel of path: keeps white texture below 1/255 (NUMERICS section 3).
const SAMPLES_PER_PX: f64 = 2.0;
/// Most samples between two nodes.
const MAX_SAMPLES: u32 = 1024;
/// Most footprint taps an axis.
const MAX_TAPS: u32 = 8;
/// Parallax between the surfaces around a source, over the exposure, beyond which every sample is solved on
/// its own, pixels.
const EDGE_PARALLAX_PX: f64 = 0.1;
/// A difference of inverse depth, relative to the nearer, that is a jump and no slope: as where depth is
/// read.
const JUMP: f64 = 0.1;
/// Exposure nodes of a flow, which is straight but for its slopes: where these bend a path, every sample is
/// solved on its own.
const FLOW_NODES: u32 = 5;
/// Miss of the polyline at the exposure's middle beyond which every sample is solved on its own, pixels.
const BENT_PX: f64 = 0.05;

/// How to do it.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Whose methods.
    pub preset: Preset,
    /// Temporal inverse; by default [`Solver::Reproject`]. The paper's preset takes [`Solver::Rk2`]; another
    /// one beside it leaves its other methods as they are, which tells its causes of error apart.
    pub solver: Option<Solver>,
    /// Samples over the exposure; `None` chooses by the length of the path (100 in the paper's preset).
    pub blur_samples: Option<u32>,
    /// The paper's fog, only with its preset.
    pub fog: Option<paper::LinearFog>,
    /// Seed of the noise, with the camera's name ([`camera_seed`]).
    pub seed: u64,
    /// Frame number, for the noise and as the frame's name.
    pub frame: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { preset: Preset::Default, solver: None, blur_samples: None, fog: None, seed: 0, frame: 0 }
    }
}

/// Everything prepared for the pixels of one frame.
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
    edges: DepthEdges,
    flow: Option<FlowSearch>,
    /// Stored values, for the paper's preset only.
    stored_rgba: Vec<f32>,
    nodes: u32,
    noise_seed: u64,
}

impl<'a> Pipeline<'a> {
    /// Checks and prepares.
    ///
    /// # Errors
    /// A camera, frame or motion that cannot be used; settings that do not go together.
    pub fn new(
        spec: &'a CameraSpec,
        frame: &'a IdealFrame,
        motion: &'a Motion,
        settings: &Settings,
    ) -> Result<Self, ApplyError> {
        let camera = CameraModel::from_spec(spec)?;
        let shutter = Shutter::from_spec(&spec.shutter, spec.fps, spec.size_px)?;
        frame.check()?;
        let (first_s, last_s) = shutter.window_s();
        motion.covers(first_s.min(frame.instant_s), last_s.max(frame.instant_s))?;
        let paper = settings.preset == Preset::Paper;
        if settings.fog.is_some() && !paper {
            return Err(ApplyError::Fog);
        }
        let solver = settings.solver.unwrap_or(if paper { Solver::Rk2 } else { Solver::Reproject });
        if solver == Solver::Oracle {
            return Err(ApplyError::Oracle);
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
        let edges = DepthEdges::new(&depth);
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

    /// Exposure nodes that are solved one by one; the path between two is taken as straight.
    #[must_use]
    pub fn nodes(&self) -> u32 {
        self.nodes
    }

    /// Of a flow: the first and the last instant that is seen, shares of its interval after the ideal frame.
    /// Beyond 0 to 1 it is gone on with.
    #[must_use]
    pub fn flow_shares(&self) -> Option<[f64; 2]> {
        let (first_s, last_s) = self.shutter.window_s();
        let shares = [first_s, last_s].map(|at_s| self.flow_share(at_s - self.frame.instant_s));
        self.flow.as_ref().map(|_| [shares[0].min(shares[1]), shares[0].max(shares[1])])
    }

    /// Where a pixel looks in the ideal frame at exposure phase `phase` (-0.5 begin, 0.5 end).
    ///
    /// # Errors
    /// Why it sees nothing.
    pub fn source(&self, pixel: [u32; 2], phase: f64) -> Result<Source, Unseen> {
        let uv = self
            .camera
            .unproject(DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])))
            .ok_or(Unseen::NoRay)?;
        self.source_of_ray(
            uv,
            self.shutter.dt_pixel_s(pixel[0], pixel[1]) + phase * self.shutter.exposure_s(),
        )
    }

    /// As [`Pipeline::source`], of an ideal ray at an instant.
    fn source_of_ray(&self, uv: DVec2, dt_s: f64) -> Result<Source, Unseen> {
        let ideal = &self.frame.geometry;
        let holes = &self.frame.holes;
        if let Some(flow) = &self.flow {
            let share = self.flow_share(dt_s - self.frame.instant_s);
            return flow.source(ideal.px_from_point(uv.extend(1.0)), share, &self.depth(), holes, ideal);
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
        // These read the depth where the ray would look if nothing moved.
        if !holes.is_empty() && holes[self.depth().nearest_index(ideal.px_from_point(uv.extend(1.0)))] {
            return Err(Unseen::Hole);
        }
        let inverse_depth = self.inverse_depth_of_ray(uv);
        let shift_s = dt_s - self.frame.instant_s;
        let moved = match self.solver {
            Solver::Linear => displacement::linear(uv, inverse_depth, &self.twist, shift_s),
            _ => displacement::rk2(uv, inverse_depth, &self.twist, shift_s, RK2_STEP_DEG.to_radians()),
        };
        let at_px = ideal.px_from_point(moved.extend(1.0));
        if at_px.is_finite() && ideal.contains(at_px) {
            Ok(Source { at_px, inverse_depth })
        } else {
            Err(Unseen::Outside)
        }
    }

    /// The share of a flow's interval that a time is; 0 without a flow.
    fn flow_share(&self, dt_s: f64) -> f64 {
        if let Motion::Flow(flow) = self.motion { dt_s / flow.interval_s } else { 0.0 }
    }

    /// The paper's models take the depth where the ray would look if nothing moved: the nearest texel in its
    /// own preset, bilinear else.
    fn inverse_depth_of_ray(&self, uv: DVec2) -> f64 {
        let at_px = self.frame.geometry.px_from_point(uv.extend(1.0));
        if self.settings.preset == Preset::Paper {
            self.depth().nearest(at_px)
        } else {
            self.depth().inverse_depth(at_px)
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

    /// The finished picture, with depth in each line's own camera. `vignette` is the map of
    /// `photometric.vignette`, read.
    #[must_use]
    pub fn render(&self, vignette: Option<&GrayImage>) -> RenderedFrame {
        self.render_and_count(vignette).0
    }

    /// As [`Pipeline::render`], with the pixels that show nothing.
    #[must_use]
    pub fn render_and_count(&self, vignette: Option<&GrayImage>) -> (RenderedFrame, UnseenCounts) {
        let size_px @ [width, height] = self.camera.size_px;
        let weights =
            vignette.map(|map| vignette_weights(map, size_px, self.spec.photometric.vignette_thresholds));
        let table = tail_table();
        let pixels: Vec<Result<([f32; 3], f32), Unseen>> = (0..height)
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
        let mut counts = UnseenCounts::default();
        pixels.iter().filter_map(|found| found.err()).for_each(|why| counts.add(why));
        let frame = RenderedFrame {
            index: self.settings.frame,
            size_px,
            color_rgba,
            depth_m: Some(depth_m),
            ..RenderedFrame::default()
        };
        (frame, counts)
    }

    /// Linear colour and depth. What the vignette blackens is not gathered.
    fn pixel(&self, pixel: [u32; 2], weight: f32, table: &[f32]) -> Result<([f32; 3], f32), Unseen> {
        let uv = self
            .camera
            .unproject(DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])))
            .ok_or(Unseen::NoRay)?;
        let dt_s = self.shutter.dt_pixel_s(pixel[0], pixel[1]);
        let middle = self.source_of_ray(uv, dt_s);
        let depth_m = middle.map_or(0.0, |source| {
            if source.inverse_depth > 0.0 { (1.0 / source.inverse_depth) as f32 } else { 0.0 }
        });
        let frame = self.settings.frame as u32;
        let finish = |color: DVec3| {
            photometric(
                &self.spec.photometric,
                color.as_vec3().to_array(),
                weight,
                pixel,
                frame,
                self.noise_seed,
                table,
            )
        };
        if weight <= 0.0 {
            return Ok((finish(DVec3::ZERO), depth_m));
        }
        if self.settings.preset == Preset::Paper {
            // Vignette, light and noise act on stored values too; only then is the picture decoded, so that
            // files are linear or encoded as ever.
            let stored = finish(self.gather_paper(uv, dt_s)?);
            return Ok((stored.map(linear_from_srgb), depth_m));
        }
        Ok((finish(self.gather_exact(uv, dt_s, middle?)?), depth_m))
    }

    /// Mean over the exposure and the pixel's area, in linear light. A pixel that looks outside of the ideal
    /// frame, or into a hole of its depth, at any node has none.
    fn gather_exact(&self, uv: DVec2, dt_s: f64, middle: Source) -> Result<DVec3, Unseen> {
        let area = self.footprint(uv, dt_s, &middle);
        let exposure_s = self.shutter.exposure_s();
        if self.nodes < 2 {
            return Ok(gather(
                &[middle.at_px],
                PathStage::Straight,
                &area,
                &self.color(),
                SAMPLES_PER_PX,
                MAX_SAMPLES,
            ));
        }
        let at_node = |k: u32| dt_s + exposure_s * (f64::from(k) / f64::from(self.nodes - 1) - 0.5);
        let sources: Result<Vec<Source>, Unseen> =
            (0..self.nodes).map(|k| self.source_of_ray(uv, at_node(k))).collect();
        let sources = sources?;
        let nodes_px: Vec<DVec2> = sources.iter().map(|source| source.at_px).collect();
        let (per_px, cap) = match self.settings.blur_samples {
            Some(samples) => (f64::from(samples), samples.div_ceil(self.nodes - 1)),
            None => (SAMPLES_PER_PX, MAX_SAMPLES),
        };
        if !self.meets_edge(uv, dt_s, &sources, middle.at_px) {
            return Ok(gather(&nodes_px, PathStage::Straight, &area, &self.color(), per_px, cap));
        }
        // Surfaces that part over the exposure: every sample finds its own.
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
            source.map(|source| area.tap_color(&color, source.at_px, i))
        };
        let sum: Result<DVec3, Unseen> = (0..count).map(sample).sum();
        sum.map(|sum| sum / f64::from(count))
    }

    /// Whether surfaces meet near the sources, and the exposure's travel pulls them apart; or the polyline
    /// misses the path at its middle.
    fn meets_edge(&self, uv: DVec2, dt_s: f64, sources: &[Source], middle_px: DVec2) -> bool {
        let half = sources.len() / 2;
        let chord_px = sources[(sources.len() - 1) / 2].at_px.midpoint(sources[half].at_px);
        if chord_px.distance(middle_px) > BENT_PX {
            return true;
        }
        let half_s = 0.5 * self.shutter.exposure_s();
        if let Some(flow) = &self.flow {
            let shares = [-half_s, half_s]
                .map(|from_middle_s| self.flow_share(dt_s + from_middle_s - self.frame.instant_s));
            return flow.parts(self.frame.geometry.px_from_point(uv.extend(1.0)), shares, EDGE_PARALLAX_PX);
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
            || sources.iter().any(|source| apart(depth.spread(source.at_px), source.inverse_depth))
    }

    /// Change of the source per output pixel: through the lens's inverse Jacobian and the relative pose at
    /// the ray's own depth.
    fn footprint(&self, uv: DVec2, dt_s: f64, source: &Source) -> Footprint {
        let uv_from_px = self.camera.lens.jacobian(uv).inverse();
        let focal = self.camera.focal_px;
        let pixel = [DVec2::new(1.0 / focal.x, 0.0), DVec2::new(0.0, 1.0 / focal.y)];
        if let Some(flow) = &self.flow {
            let source_from_look =
                flow.source_from_look(source.at_px, self.flow_share(dt_s - self.frame.instant_s));
            let [dx, dy] =
                pixel.map(|d| source_from_look * (self.frame.geometry.focal_px * (uv_from_px * d)));
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

    /// Nodes so that no chord misses the path by more than [`CHORD_MISS_PX`], seen at a grid of pixels. The
    /// miss falls with the square of the number of segments.
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
        let places = (0..63_u32).map(|i| [(i % 9) * (width - 1) / 8, (i / 9) * (height - 1) / 6]);
        let ideal = &self.frame.geometry;
        let (mut longest, mut miss) = (0.0_f64, 0.0_f64);
        for [x, y] in places {
            let Some(uv) = self.camera.unproject(DVec2::new(f64::from(x), f64::from(y))) else { continue };
            let w = self.inverse_depth_of_ray(uv);
            let mid_s = self.shutter.dt_pixel_s(x, y);
            let at: Vec<DVec2> = (0..=steps)
                .map(|k| {
                    let t_s = mid_s + exposure_s * (f64::from(k) / f64::from(steps) - 0.5);
                    let (rotation, shift) = self.motion.key_from(t_s, self.frame.instant_s);
                    ideal.px_from_point(rotation * uv.extend(1.0) + w * shift)
                })
                .filter(|at| at.is_finite())
                .collect();
            longest = longest.max(at.windows(2).map(|pair| pair[0].distance(pair[1])).sum());
            if let (Some(&a), Some(&b)) = (at.first(), at.last()) {
                let parts = (at.len() - 1).max(1) as f64;
                miss = at
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
