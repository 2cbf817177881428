//! The output frame by the f64 twins of the stages, from an ideal frame.

use camsim_core::{
    noise::tail_table,
    photometric::{Photometry, photometric},
    reference::{FrameView, ReferenceRenderer},
    shutter::RowAxis,
    temporal::{
        ColorImage, Footprint, IdealGeometry, InverseDepthImage, KeyDepth, PathStage,
        displacement::{RK2_STEP_DEG, linear, rk2},
        gather, path, reproject, reproject_nodes, reproject_with,
    },
};
use camsim_cpu::RowTable;
use camsim_engine::IdealPlanes;
use camsim_plan::{FramePlan, RayStage, TemporalStage, table_shape};
use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

use super::{
    cases::{Case, Input},
    stage::{FrameOutput, PixelOutput},
};

/// Entries of a lens map above this have no ray.
const NO_RAY: f32 = 1e29;
/// Inverse depth below which a surface counts as near the sky, 1/m.
const NEAR_SKY: f64 = 1e-4;

/// Pose of a row's camera relative to the key camera, or its time after the key instant.
#[derive(Clone, Copy, Debug)]
struct RowPose {
    key_from_row: (DMat3, DVec3),
    dt_s: f64,
}

/// The twins of the stages of a frame.
#[derive(Debug)]
pub struct Twin<'a> {
    case: &'a Case,
    plan: &'a FramePlan,
    ideal: IdealGeometry,
    color: ColorImage<'a>,
    depth: InverseDepthImage<'a>,
    /// Table entries in the order of [`RowTable`], in f64.
    rows: Vec<RowPose>,
    /// Pose of the key camera relative to the mid-window camera, if it is another one.
    window_from_key: Option<(DMat3, DVec3)>,
    lens_map: Vec<[f32; 2]>,
    weights: Vec<f32>,
    noise_table: Vec<f32>,
    /// Independent of the plan: times of rows, and the truth of sessions.
    view: FrameView<'a>,
    stamp_s: f64,
}

/// A pose from an entry of the table that the renderers read.
fn pose_from(entry: &[[f32; 4]; 3]) -> (DMat3, DVec3) {
    let [x, y, z] = entry.map(|row| DVec3::new(row[0].into(), row[1].into(), row[2].into()));
    let shift = DVec3::new(entry[0][3].into(), entry[1][3].into(), entry[2][3].into());
    (DMat3::from_cols(x, y, z).transpose(), shift)
}

impl<'a> Twin<'a> {
    pub fn new(
        case: &'a Case,
        plan: &'a FramePlan,
        (ideal, color_rgba, inverse_depth): &'a IdealPlanes,
        reference: &'a ReferenceRenderer,
    ) -> Self {
        assert_eq!(plan.keys.len(), 1, "{}: one ideal frame", case.name);
        let rest = (DMat3::IDENTITY, DVec3::ZERO);
        let rows: Vec<RowPose> = match RowTable::new(plan, &case.sequence.path) {
            RowTable::Poses(table) => {
                let pose = |entry| RowPose { key_from_row: pose_from(entry), dt_s: 0.0 };
                table.entries.iter().map(pose).collect()
            }
            RowTable::Times(table) => {
                let pose = |&dt_s: &f32| RowPose { key_from_row: rest, dt_s: dt_s.into() };
                table.dt_s.iter().map(pose).collect()
            }
        };
        let last_row = rows.last().map(|row| row.key_from_row);
        Self {
            case,
            plan,
            ideal: *ideal,
            color: ColorImage { size_px: ideal.size_px, rgba: color_rgba },
            depth: InverseDepthImage { size_px: ideal.size_px, values: inverse_depth },
            rows,
            window_from_key: last_row.filter(|_| plan.has_displaced_key()),
            lens_map: if plan.ray == RayStage::LensMap { plan.camera.lens_inverse() } else { Vec::new() },
            weights: case.sequence.vignette_weights().1,
            noise_table: tail_table(),
            view: reference.view(plan.frame),
            stamp_s: reference.stamp_s(plan.frame),
        }
    }

    /// The frame; rays of a lens are those that `output` reports.
    pub fn frame(&self, output: &FrameOutput) -> FrameOutput {
        let pixels = output.pixels.par_iter().enumerate();
        let twin = |(i, reported): (usize, &Option<PixelOutput>)| {
            self.pixel(self.position(i), reported.and_then(|pixel| pixel.uv))
        };
        let mut pixels: Vec<_> = pixels.map(twin).collect();
        if matches!(self.case.input, Input::Frame(_)) && self.plan.has_exact_truth() {
            self.complete(&mut pixels);
        }
        FrameOutput { pixels, ..FrameOutput::default() }
    }

    fn position(&self, i: usize) -> [u32; 2] {
        let width = self.plan.camera.size_px[0];
        [i as u32 % width, i as u32 / width]
    }

    /// Sessions cast a ray for the truth of every pixel.
    fn complete(&self, pixels: &mut [Option<PixelOutput>]) {
        pixels.par_iter_mut().enumerate().for_each(|(i, pixel)| {
            pixel.iter_mut().for_each(|pixel| self.cast_truth(self.position(i), pixel));
        });
    }

    /// Truth by the reference's own rays: at mid-exposure, and at the phase of the source coordinates.
    fn cast_truth(&self, position: [u32; 2], pixel: &mut PixelOutput) {
        let sample = |phase| self.view.sample(position, DVec2::ZERO, phase);
        let source = sample(self.case.coords_phase.into());
        pixel.source_px = source.map(|sample| self.plan.ideal_view().source_px(&sample));
        let hit = sample(0.0).and_then(|sample| sample.hit);
        pixel.depth_m = Some(hit.map_or(0.0, |hit| hit.depth_m));
        pixel.point_ned_m = hit.map(|hit| hit.point_ned_m);
    }

    fn map_entry(&self, [x, y]: [u32; 2]) -> Option<DVec2> {
        let [u, v] = self.lens_map[(y * self.plan.camera.size_px[0] + x) as usize];
        (u < NO_RAY).then(|| DVec2::new(u.into(), v.into()))
    }

    /// Ray of a pixel and its change per pixel along x and along y: of the lens map by central or one-sided
    /// differences.
    fn ray(&self, pixel: [u32; 2], reported: Option<DVec2>) -> Option<(DVec2, [DVec2; 2])> {
        let camera = &self.plan.camera;
        if self.plan.ray == RayStage::Pinhole {
            let position_px = DVec2::new(pixel[0].into(), pixel[1].into());
            let uv = (position_px - camera.principal_point_px) / camera.focal_px;
            return Some((uv, [DVec2::X / camera.focal_px.x, DVec2::Y / camera.focal_px.y]));
        }
        let centre = self.map_entry(pixel)?;
        let difference = |axis: usize| {
            let neighbour = |position: u32| {
                let mut pixel = pixel;
                pixel[axis] = position;
                self.map_entry(pixel)
            };
            let before = pixel[axis].checked_sub(1).and_then(neighbour);
            let after = Some(pixel[axis] + 1).filter(|&next| next < camera.size_px[axis]).and_then(neighbour);
            match (before, after) {
                (Some(before), Some(after)) => 0.5 * (after - before),
                (None, Some(after)) => after - centre,
                (Some(before), None) => centre - before,
                (None, None) => DVec2::ZERO,
            }
        };
        Some((reported.unwrap_or(centre), [difference(0), difference(1)]))
    }

    /// Poses of a pixel's row at the exposure nodes that are solved, and at mid-exposure.
    fn poses(&self, [x, y]: [u32; 2]) -> (Vec<RowPose>, RowPose) {
        let (axis, rows, fields) = table_shape(&self.plan.shutter);
        let row = if axis == RowAxis::Columns { x } else { y };
        let field = if fields == 2 { y & 1 } else { 0 };
        let blur = self.plan.blur.filter(|blur| blur.nodes > 1);
        let stride = blur.map_or(1, |blur| blur.nodes + 1) as usize;
        let entries = &self.rows[(field * rows + row) as usize * stride..][..stride];
        let nodes = entries[..stride - 1].iter().step_by(blur.map_or(1, |blur| blur.stride as usize));
        (nodes.copied().collect(), entries[stride - 1])
    }

    fn key(&self, sky_reach_px: f64) -> KeyDepth<'_> {
        let plane = self.plan.plane.seen_from(&self.plan.keys[0].pose);
        KeyDepth { ideal: &self.ideal, depth: &self.depth, plane, sky_reach_px }
    }

    /// Temporal inverse: the source of a ray, ideal pixels.
    fn source(&self, uv: DVec2, pose: &RowPose, sky_reach_px: f64) -> Option<DVec2> {
        let key = self.key(sky_reach_px);
        let own_w = || self.depth.inverse_depth(self.ideal.px_from_point(uv.extend(1.0)));
        let in_key = match self.plan.temporal {
            TemporalStage::Reproject { iterations } => {
                return reproject(uv, pose.key_from_row, iterations, &key).map(|source| source.position_px);
            }
            TemporalStage::Identity => uv.extend(1.0),
            TemporalStage::Rotation => pose.key_from_row.0 * uv.extend(1.0),
            TemporalStage::Linear => linear(uv, own_w(), &self.plan.key_twist, pose.dt_s).extend(1.0),
            TemporalStage::Rk2 => {
                let step_rad = RK2_STEP_DEG.to_radians();
                rk2(uv, own_w(), &self.plan.key_twist, pose.dt_s, step_rad).extend(1.0)
            }
        };
        let position_px = self.ideal.px_from_point(in_key);
        (in_key.z > 0.0 && self.ideal.contains(position_px)).then_some(position_px)
    }

    /// Sources at the exposure nodes; that at mid-exposure without blur.
    fn sources(&self, uv: DVec2, nodes: &[RowPose], mid: &RowPose, sky_reach_px: f64) -> Option<Vec<DVec2>> {
        match (self.plan.blur, self.plan.temporal) {
            (None, _) => self.source(uv, mid, sky_reach_px).map(|source_px| vec![source_px]),
            (Some(blur), TemporalStage::Reproject { iterations }) => {
                let poses: Vec<_> = nodes.iter().map(|pose| pose.key_from_row).collect();
                let key = self.key(sky_reach_px);
                let sources = reproject_nodes(uv, &poses, mid.key_from_row, blur.depths, iterations, &key);
                sources.into_iter().map(|source| Some(source?.position_px)).collect()
            }
            _ => nodes.iter().map(|pose| self.source(uv, pose, sky_reach_px)).collect(),
        }
    }

    /// Source at the phase of the coordinates, which the sky beside a surface does not share with it.
    fn source_at_phase(&self, uv: DVec2, nodes: &[RowPose], mid: &RowPose) -> Option<DVec2> {
        let Some(blur) = self.plan.blur.filter(|_| self.case.coords_phase != 0.0) else {
            return self.source(uv, mid, 0.0);
        };
        let nodes_px = self.sources(uv, nodes, mid, 0.0)?;
        let mut curves = path::curves(&nodes_px, blur.path);
        let elapsed = (f64::from(self.case.coords_phase) + 0.5) * curves.len() as f64;
        let number = (elapsed as usize).min(curves.len() - 1);
        Some(curves.nth(number)?.at(f64::from(blur.path.steps()) * (elapsed - number as f64)))
    }

    fn pixel(&self, pixel: [u32; 2], reported: Option<DVec2>) -> Option<PixelOutput> {
        let plan = self.plan;
        let (uv, d_uv) = self.ray(pixel, reported)?;
        let (nodes, mid) = self.poses(pixel);
        let weight = match self.weights[..] {
            [weight] => weight,
            _ => self.weights[(pixel[1] * plan.camera.size_px[0] + pixel[0]) as usize],
        };
        let color = if weight > 0.0 {
            let nodes_px = self.sources(uv, &nodes, &mid, plan.sky_reach_px)?;
            let [d_dx, d_dy] = d_uv.map(|d_uv| d_uv * self.ideal.focal_px);
            let area = Footprint::new(d_dx, d_dy, plan.taps);
            let (path, samples_per_px, cap) = plan
                .blur
                .map_or((PathStage::Straight, 0.0, 1), |b| (b.path, b.samples_per_px, b.max_samples));
            gather(&nodes_px, path, &area, &self.color, samples_per_px, cap)
        } else {
            DVec3::ZERO
        };
        let scenario = &self.case.sequence.scenario;
        let stage = Photometry::new(&scenario.camera, plan.exposure.as_ref());
        let color = photometric(
            &stage,
            color.as_vec3().to_array(),
            weight,
            pixel,
            plan.frame as u32,
            self.case.sequence.noise_seed(),
            &self.noise_table,
        );
        let truth = self.truth(uv, &nodes, &mid);
        Some(PixelOutput {
            color: DVec3::from_array(color.map(f64::from)),
            uv: Some(uv),
            imaged_px: Some(DVec2::new(pixel[0].into(), pixel[1].into())),
            time_s: Some(self.view.mid_s(pixel) - self.stamp_s),
            ..truth
        })
    }

    /// Source, depth and point of a ray.
    fn truth(&self, uv: DVec2, nodes: &[RowPose], mid: &RowPose) -> PixelOutput {
        let ray_of =
            |position_px: DVec2| ((position_px - self.ideal.principal_px) / self.ideal.focal_px).extend(1.0);
        let in_window = |position_px: DVec2| match self.window_from_key {
            Some((rotation, shift)) => {
                let w = self.depth.inverse_depth(position_px);
                self.ideal.px_from_point(rotation * ray_of(position_px) + w * shift)
            }
            None => position_px,
        };
        let mut truth = PixelOutput {
            source_px: self.source_at_phase(uv, nodes, mid).map(in_window),
            ..PixelOutput::default()
        };
        let Some(mid_px) = self.source(uv, mid, 0.0) else { return truth };
        let in_key = self.depth.inverse_depth(mid_px);
        let row_w = match self.plan.temporal {
            TemporalStage::Identity => Some(in_key),
            TemporalStage::Rotation | TemporalStage::Reproject { .. } => {
                // The depth channel is looked up at the source itself.
                reproject_with(uv, mid.key_from_row, in_key, &self.ideal).map(|source| source.inverse_depth)
            }
            TemporalStage::Linear | TemporalStage::Rk2 => None,
        };
        truth.depth_m = row_w.map(|w| if w > 0.0 && in_key > 0.0 { 1.0 / w } else { 0.0 });
        truth.point_ned_m = (in_key > 0.0).then(|| {
            let pose = &self.plan.keys[0].pose;
            pose.position_ned_m + pose.ned_from_camera * (ray_of(mid_px) / in_key)
        });
        let is_sky = |position_px| self.depth.inverse_depth(position_px) < NEAR_SKY;
        truth.is_near_sky =
            row_w.is_some_and(|w| w < NEAR_SKY) || is_sky(mid_px + 3.0) || is_sky(mid_px - 3.0);
        truth
    }
}
