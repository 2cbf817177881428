//! What the implementations put out for a case.

use std::{convert::Infallible, sync::Arc};

use camsim_core::{
    frame::RenderedFrame,
    noise::tail_table,
    photometric::{Photometry, photometric},
    scenario::Channel,
    scene::{LodSelection, LodTolerance, PlacedMesh, SceneBatches, TerrainDetail},
    sequence::Sequence,
};
use camsim_cpu::{CpuRenderer, ReverseInputs, RowTable};
use camsim_engine::{Engine, Finished, IdealPlanes};
use camsim_plan::{
    Backend, FramePlan,
    placement::{cpu_rasterises, cpu_vectorises},
    uniforms::{Truth, base_ned_m, frame_uniforms},
};
use glam::{DVec2, DVec3};

use super::{
    cases::{Case, Input, Output},
    common,
    stage::{FrameOutput, IdealOutput, PixelOutput},
};

/// All channels that cost something.
pub const ALL_CHANNELS: [Channel; 3] = [Channel::Color, Channel::Coords, Channel::Depth];

/// Who makes a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Implementation {
    /// Rasteriser and vectorised pass of the cpu.
    CpuVectorised,
    /// Rays and general pass of the cpu.
    CpuGeneral,
    Gpu,
}

impl Implementation {
    pub const ALL: [Self; 3] = [Self::CpuVectorised, Self::CpuGeneral, Self::Gpu];
}

/// What an implementation has put out.
#[derive(Debug)]
pub struct CaseOutput {
    pub plan: FramePlan,
    /// The ideal frame as the output frame was read from it.
    pub images: IdealPlanes,
    pub lod: LodSelection,
    pub frame: FrameOutput,
}

/// An engine for each implementation.
#[derive(Debug)]
pub struct Engines {
    cpu: Engine,
    gpu: Option<Engine>,
}

impl Engines {
    /// The cpu draws the ideal frames that are compared; output frames are all made from one ideal frame,
    /// that of the gpu.
    pub fn new(output: Output) -> Self {
        if cfg!(skip_gpu) {
            return Self { cpu: Engine::cpu(), gpu: None };
        }
        let with_backend = |backend| {
            let mut engine = common::engine();
            engine.set_backend(backend);
            engine
        };
        match output {
            Output::Ideal => {
                Self { cpu: with_backend(Backend::Cpu), gpu: Some(with_backend(Backend::GpuThenCpu)) }
            }
            Output::Frame | Output::FrameAndColorAlone => {
                Self { cpu: with_backend(Backend::GpuThenCpu), gpu: Some(with_backend(Backend::Gpu)) }
            }
        }
    }

    pub fn is_software(&self) -> bool {
        self.gpu.as_ref().is_none_or(common::is_software)
    }

    /// The output of an implementation, or why it has none.
    pub fn output(&self, implementation: Implementation, case: &Case) -> Result<CaseOutput, &'static str> {
        match &case.input {
            Input::Frame(number) => self.session_output(implementation, case, *number),
            Input::Plan(plan) => renderer_output(implementation, case, plan),
        }
    }

    fn session_output(
        &self,
        implementation: Implementation,
        case: &Case,
        number: u64,
    ) -> Result<CaseOutput, &'static str> {
        let engine = match implementation {
            Implementation::Gpu => self.gpu.as_ref().ok_or("CAMSIM_SKIP_GPU is set")?,
            Implementation::CpuVectorised | Implementation::CpuGeneral => &self.cpu,
        };
        let rendered = |sequence: &Arc<Sequence>, channels: &[Channel]| {
            let mut session = engine.session::<Infallible>(sequence.clone(), channels).expect("session");
            session.set_general_cpu(implementation == Implementation::CpuGeneral);
            session.set_coords_phase(case.coords_phase);
            let mut finished = None;
            let mut keep = |done: Finished| {
                finished = Some(done);
                Ok(())
            };
            session.render::<Infallible>([number], &mut keep).expect("render");
            let images = session.read_ideal().expect("readable").expect("drawn");
            (finished.expect("a frame"), images)
        };
        let is_by_cpu = implementation != Implementation::Gpu;
        if case.output == Output::Ideal {
            let (done, images) = rendered(&case.sequence, &[Channel::Color]);
            assert_eq!(done.times.ideal_ms.is_some(), is_by_cpu, "{}: {:?}", case.name, done.plan);
            let frame = FrameOutput::default();
            return Ok(CaseOutput { plan: done.plan, images, lod: done.lod, frame });
        }
        let (done, images) = rendered(&case.sequence, &ALL_CHANNELS);
        assert_eq!(done.times.reverse_ms.is_some(), is_by_cpu, "{}: {:?}", case.name, done.plan);
        if implementation == Implementation::CpuVectorised {
            assert!(cpu_vectorises(&done.plan), "{}: {:?}", case.name, done.plan);
        }
        let color = |sequence| rendered(sequence, &[Channel::Color]).0.frame;
        let frame = FrameOutput {
            color_alone: (case.output == Output::FrameAndColorAlone
                && implementation == Implementation::CpuVectorised)
                .then(|| color(&case.sequence).into_color()),
            photometric: case.plain.as_ref().map(|plain| with_effects(case, &color(plain))),
            ..frame_output(&done.frame, &done.plan)
        };
        Ok(CaseOutput { plan: done.plan, images, lod: done.lod, frame })
    }
}

/// What the photometric twin makes of a frame without photometric effects.
fn with_effects(case: &Case, plain: &RenderedFrame) -> Vec<[f32; 4]> {
    let scenario = &case.sequence.scenario;
    let (stage, seed) = (Photometry::new(&scenario.camera, None), case.sequence.noise_seed());
    let weights = case.sequence.vignette_weights().1;
    let table = tail_table();
    let pixels = plain.color_rgba().as_chunks::<4>().0;
    let black = weights.iter().filter(|&&weight| weight == 0.0).count();
    assert!(black > 50 && black > pixels.len() / 300, "the vignette has a black part: {black}");
    let width = plain.size_px[0];
    let with_effects = |(i, &[r, g, b, alpha]): (usize, &[f32; 4])| {
        if alpha == 0.0 {
            return [0.0; 4];
        }
        let pixel = [i as u32 % width, i as u32 / width];
        let [r, g, b] = photometric(&stage, [r, g, b], weights[i], pixel, plain.index as u32, seed, &table);
        [r, g, b, 1.0]
    };
    pixels.iter().enumerate().map(with_effects).collect()
}

fn frame_output(frame: &RenderedFrame, plan: &FramePlan) -> FrameOutput {
    let (coords, depth_m) = (frame.coords().expect("asked for"), frame.depth_m().expect("asked for"));
    let pixel = |(i, rgba): (usize, &[f32; 4])| {
        let [u, v, x, y, time_s, north_m, east_m, down_m] = coords[i].map(f64::from);
        let uv = DVec2::new(u, v);
        (rgba[3] > 0.0).then(|| PixelOutput {
            color: color_of(rgba),
            uv: Some(uv),
            imaged_px: Some(plan.camera.project(uv)),
            time_s: Some(time_s),
            source_px: Some(DVec2::new(x, y)),
            depth_m: Some(depth_m[i].into()),
            point_ned_m: Some(DVec3::new(north_m, east_m, down_m)),
            is_near_sky: false,
        })
    };
    let pixels = frame.color_rgba().as_chunks::<4>().0.iter().enumerate().map(pixel).collect();
    FrameOutput { pixels, color_rgba: frame.color_rgba().to_vec(), ..FrameOutput::default() }
}

fn color_of(rgba: &[f32; 4]) -> DVec3 {
    DVec3::new(rgba[0].into(), rgba[1].into(), rgba[2].into())
}

/// A plan that no planner makes, by the cpu's renderer alone. Its ideal frames are cast, but for those that
/// are compared.
fn renderer_output(
    implementation: Implementation,
    case: &Case,
    plan: &FramePlan,
) -> Result<CaseOutput, &'static str> {
    let sequence = &case.sequence;
    let is_general = match implementation {
        Implementation::Gpu => return Err("a session of the gpu renders plans of the planner only"),
        Implementation::CpuGeneral => true,
        Implementation::CpuVectorised => false,
    };
    let is_ideal = case.output == Output::Ideal;
    if !is_general && is_ideal && !cpu_rasterises(&sequence.scene, u32::MAX) {
        return Err("the rasteriser does not draw the scene");
    }
    if !is_general && !is_ideal && !cpu_vectorises(plan) {
        return Err("the plan is not vectorised");
    }
    let mut renderer = CpuRenderer::new(sequence.clone(), Arc::new(SceneBatches::new(&sequence.scene)));
    renderer.set_general_only(is_general || !is_ideal);
    let tolerance = LodTolerance {
        focal_px: plan.ideal.focal_px.max_element(),
        tangents: plan.ideal.tangents(),
        error_px: 0.0,
        travel_m: 0.0,
        parallax_px: 0.0,
    };
    let buffer = renderer.draw_ideal(plan, &finest_terrain(sequence, plan), &tolerance);
    let (mut color_rgba, inverse_depth) = renderer.ideal_images(buffer);
    let lod = LodSelection::default();
    if is_ideal {
        let images = (plan.ideal, color_rgba, inverse_depth);
        return Ok(CaseOutput { plan: plan.clone(), images, lod, frame: FrameOutput::default() });
    }
    if !is_general {
        // The vectorised pass reads half floats.
        color_rgba.iter_mut().for_each(|value| *value = half::f16::from_f32(*value).to_f32());
    }
    renderer.set_general_only(is_general);
    let uniforms = frame_uniforms(plan, sequence, case.coords_phase);
    let rows = RowTable::new(plan, &sequence.path);
    let (picture, truth) =
        renderer.reverse(&ReverseInputs { plan, uniforms: &uniforms, rows: &rows }, buffer);
    let truth = truth.expect("a plan with truth");
    let pixels = picture.as_chunks::<4>().0.iter().zip(&truth).map(|(rgba, truth)| {
        assert!(rgba[3] == 1.0 || *rgba == [0.0; 4], "{}: {rgba:?}", case.name);
        (rgba[3] > 0.0).then(|| pixel_output(rgba, truth, plan))
    });
    let frame =
        FrameOutput { pixels: pixels.collect(), color_rgba: picture.clone(), ..FrameOutput::default() };
    Ok(CaseOutput { plan: plan.clone(), images: (plan.ideal, color_rgba, inverse_depth), lod, frame })
}

/// A valid pixel of a renderer. The session adds its time.
fn pixel_output(rgba: &[f32; 4], truth: &Truth, plan: &FramePlan) -> PixelOutput {
    let uv = DVec2::from_array(truth.uv.map(f64::from));
    PixelOutput {
        color: color_of(rgba),
        uv: Some(uv),
        imaged_px: Some(plan.camera.project(uv)),
        time_s: None,
        source_px: Some(DVec2::from_array(truth.source_px.map(f64::from))),
        depth_m: Some(truth.depth_m.into()),
        point_ned_m: Some(DVec3::from_array(truth.point_ned_m.map(f64::from))),
        is_near_sky: false,
    }
}

/// The terrain at full detail.
fn finest_terrain(sequence: &Sequence, plan: &FramePlan) -> Vec<PlacedMesh> {
    let (tangents, focal_px) = (plan.ideal.tangents(), plan.ideal.focal_px.max_element());
    let of_key = |terrain, pose| {
        let detail = TerrainDetail::new(terrain, pose, tangents, focal_px, 1e-6);
        detail.visible_mesh().placed(terrain, base_ned_m(pose))
    };
    let terrain = sequence.scene.terrain.iter();
    terrain.flat_map(|terrain| plan.keys.iter().map(|key| of_key(terrain, &key.pose))).collect()
}

/// An ideal frame as it is compared.
pub fn ideal_output((geometry, color_rgba, inverse_depth): &IdealPlanes) -> IdealOutput {
    let pixels = color_rgba.as_chunks::<4>().0;
    IdealOutput {
        geometry: *geometry,
        alpha: pixels.iter().map(|rgba| rgba[3]).collect(),
        color_dn: pixels.iter().map(|rgba| Some(255.0 * color_of(rgba))).collect(),
        inverse_depth: inverse_depth.iter().map(|&w| Some(w.into())).collect(),
    }
}
