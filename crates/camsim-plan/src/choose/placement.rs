//! Which renderer makes which pass of a frame.
//!
//! | machine | ideal frames | output frames |
//! |---|---|---|
//! | graphics card | gpu | gpu |
//! | software adapter | cpu, where it vectorises all passes; else gpu | cpu likewise, or from a copy; else gpu |
//! | no adapter, or `--backend cpu` | cpu | cpu |
//!
//! A copy is one of an ideal frame that the cpu cannot draw, without silhouette rays.
//!
//! Shadows of the sun are made by the cpu: a frame of a scene with shadows has all its passes there, whatever
//! the machine has.
//!
//! A software adapter runs on the same processor as the cpu renderer, which takes half of its time for the
//! plans that it vectorises (docs/theory/DECISIONS.md, "Cpu renderer").

use camsim_core::{
    scenario::Preset,
    scene::{Scene, is_whole},
    temporal::TapStage,
};

use crate::ir::{
    frame_plan::FramePlan,
    placement::{AdapterClass, Backend, Capabilities, Placement, Renderer},
    row_tables::table_shape,
    stages::{EdgeStage, RayStage, TemporalStage, scale_of},
};

/// Reads of one grid of taps that the vectorised cpu pass makes, at most.
pub const MOST_VECTOR_TAPS: u32 = 8;
/// Side of an ideal frame, in samples, up to which the coordinates of the cpu's rasteriser reach.
const MOST_RASTER_SIDE: u32 = 1 << 15;
/// Pixels of an ideal frame for each pixel of the frames made from it, at most, that are worth a copy from a
/// software adapter to the cpu renderer.
const MOST_COPIED: f64 = 12.0;

/// Who makes the passes of a plan; `rasterises`: whether the cpu's rasteriser [draws its
/// scene](cpu_rasterises).
pub(crate) fn place(capabilities: &Capabilities, plan: &FramePlan, rasterises: bool) -> Placement {
    let (cpu, gpu) = (Placement::all(Renderer::Cpu), Placement::all(Renderer::Gpu));
    if plan.shadows.is_some() {
        return cpu;
    }
    let gpu_then_cpu = Placement { ideal: Renderer::Gpu, reverse: Renderer::Cpu };
    match (capabilities.backend, capabilities.adapter) {
        (Backend::Cpu, _) | (_, None) => cpu,
        (Backend::Gpu, _) => gpu,
        (Backend::GpuThenCpu, _) => {
            if cpu_takes_copies(plan) {
                gpu_then_cpu
            } else {
                gpu
            }
        }
        (Backend::Auto, Some(AdapterClass::Card)) => gpu,
        (Backend::Auto, Some(AdapterClass::Software)) => {
            // What the cpu does not vectorise stays with the adapter: its general code is slower.
            if !capabilities.has_vectors {
                gpu
            } else if rasterises && cpu_vectorises(plan) && cpu_draws(plan) {
                cpu
            } else if !rasterises && cpu_takes_copies(plan) && is_worth_the_copy(plan) {
                gpu_then_cpu
            } else {
                gpu
            }
        }
    }
}

/// Whether the cpu's vectorised reverse pass makes frames of a plan: by lines of one instant (all but those of
/// sideways readout of interlaced fields), a solver that iterates on the depth or needs none, and grids of at most
/// [`MOST_VECTOR_TAPS`] taps. Its general pass makes all others.
#[must_use]
pub fn cpu_vectorises(plan: &FramePlan) -> bool {
    let solves = matches!(
        plan.temporal,
        TemporalStage::Identity | TemporalStage::Rotation | TemporalStage::Reproject { .. }
    );
    let has_map = plan.ray != RayStage::GaussNewton;
    let has_one_field = table_shape(&plan.shutter).2 == 1;
    let has_few_taps = match plan.taps {
        TapStage::Grid { most } | TapStage::SplineOrGrid { most } => most <= MOST_VECTOR_TAPS,
        TapStage::Bilinear | TapStage::Spline | TapStage::Area => true,
    };
    let has_sides = plan.ideal.size_px.iter().all(|&side| side >= 2);
    plan.preset != Preset::Paper && solves && has_map && has_one_field && has_few_taps && has_sides
}

/// Whether the cpu makes frames of a plan from a copy of an ideal frame that an adapter has drawn: one, without
/// samples for silhouette rays.
#[must_use]
pub fn cpu_takes_copies(plan: &FramePlan) -> bool {
    cpu_vectorises(plan) && plan.keys.len() == 1 && !plan.edges.has_rays() && plan.zoom.is_none()
}

/// Whether the cpu's rasteriser draws the ideal frames of a plan, if it [draws the scene](cpu_rasterises): in
/// linear light, with shadows at pixels alone, and with samples within its coordinates.
#[must_use]
pub fn cpu_draws(plan: &FramePlan) -> bool {
    let (has_samples, scale) = (plan.edges != EdgeStage::None, scale_of(plan.edges));
    let is_within = plan.ideal.size_px.iter().all(|&side| 2 * scale * side <= MOST_RASTER_SIDE);
    plan.preset != Preset::Paper && (plan.shadows.is_none() || scale == 1) && (is_within || !has_samples)
}

/// Whether the cpu's rasteriser draws a scene: a ground picture that one texture holds, and no shadows beside
/// surfaces with holes or blended ones, through which light falls.
#[must_use]
pub fn cpu_rasterises(scene: &Scene, max_picture_px: u32) -> bool {
    let ground = scene.terrain.as_ref().map(|terrain| terrain.texture.size_px);
    let has_shadows = scene.light.is_some_and(|light| light.shadows);
    ground.is_none_or(|size_px| is_whole(size_px, max_picture_px))
        && (scene.has_triangle_borders_only() || !has_shadows)
}

/// Whether frames of a plan that the cpu vectorises take less time there although their ideal frame has to be
/// copied from a software adapter.
fn is_worth_the_copy(plan: &FramePlan) -> bool {
    let area = |[width, height]: [u32; 2]| f64::from(width) * f64::from(height);
    let frames = plan.shared_frames.map_or(1.0, |[first, last]| (last - first + 1) as f64);
    area(plan.ideal.size_px) <= MOST_COPIED * frames * area(plan.camera.size_px)
}
