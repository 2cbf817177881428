//! The numbers of a frame in single precision, as shaders and the cpu renderer read them.
//!
//! The structs mirror those of the shaders; a test of the gpu crate compares their offsets with naga's.

use bytemuck::{Pod, Zeroable};
use camsim_core::{
    photometric::Photometry,
    pose::CameraPose,
    scene::Scene,
    sequence::Sequence,
    shutter::RowAxis,
    temporal::{IdealGeometry, MAX_KEYS, TapStage, displacement::RK2_STEP_DEG},
};
use glam::{DMat3, DVec3};

use crate::ir::{
    frame_plan::FramePlan,
    limits::{NEAR_M, SIZE_QUANTUM_PX},
    linear_fog::LinearFog,
    row_tables::table_shape,
    stages::{EdgeStage, TemporalStage},
};

/// Mirror of `Frame` in camsim-gpu/shaders/common/frame.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[expect(missing_docs, reason = "documented in the shader, field by field")]
pub struct FrameUniforms {
    pub size_px: [u32; 2],
    pub ideal_size_px: [u32; 2],
    pub ideal_focal_px: [f32; 2],
    pub ideal_principal_px: [f32; 2],
    pub focal_px: [f32; 2],
    pub principal_px: [f32; 2],
    pub near_m: f32,
    pub nodes: u32,
    pub line_axis: u32,
    pub lines: u32,
    pub fields: u32,
    pub iterations: u32,
    pub samples_per_px: f32,
    pub max_samples: u32,
    pub max_taps: u32,
    pub coords_phase: f32,
    pub light: f32,
    pub noise_sigma: f32,
    pub vignette_thresholds: [f32; 2],
    pub seed: [u32; 2],
    pub frame_number: u32,
    pub mono: u32,
    pub node_stride: u32,
    pub edge_scale: u32,
    pub edge_samples: u32,
    pub rk2_step_rad: f32,
    pub lens_tangential: [f32; 2],
    pub key_position_ned_m: [f32; 4],
    pub ned_from_key_x: [f32; 4],
    pub ned_from_key_y: [f32; 4],
    pub ned_from_key_z: [f32; 4],
    pub key_velocity_m_s: [f32; 4],
    pub key_rate_rad_s: [f32; 4],
    pub lens_radial: [f32; 3],
    pub most: f32,
    pub linear_fog: [f32; 4],
    pub keys: u32,
    pub key_rows: u32,
    pub pad1: f32,
    pub sky_reach_px: f32,
    pub planes: [[f32; 4]; MAX_KEYS as usize],
}

/// Mirror of `IdealCamera` in camsim-gpu/shaders/ideal/camera.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[expect(missing_docs, reason = "documented in the shader, field by field")]
pub struct IdealCamera {
    pub clip_scale: [f32; 2],
    pub clip_shift: [f32; 2],
    pub camera_from_ned_x: [f32; 4],
    pub camera_from_ned_y: [f32; 4],
    pub camera_from_ned_z: [f32; 4],
    pub camera_from_base_m: [f32; 4],
    pub sky: [f32; 4],
    pub near_m: f32,
    pub pad0: f32,
    pub pad1: f32,
    pub pad2: f32,
}

/// Mirror of `Truth` in camsim-gpu/shaders/reverse/edges/truth.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[expect(missing_docs, reason = "documented in the shader, field by field")]
pub struct Truth {
    pub uv: [f32; 2],
    pub source_px: [f32; 2],
    pub point_ned_m: [f32; 3],
    pub depth_m: f32,
}

/// Uniforms of a frame. `coords_phase` in [-0.5, 0.5] picks the instant of the exposure at which source
/// coordinates are reported.
#[must_use]
pub fn frame_uniforms(plan: &FramePlan, sequence: &Sequence, coords_phase: f32) -> FrameUniforms {
    // Long because: a line for each field of the shaders' struct.
    let scenario = &sequence.scenario;
    let photometric = &scenario.camera.photometric;
    let stage = Photometry::new(&scenario.camera, plan.exposure.as_ref());
    let noise_seed = sequence.noise_seed();
    let (axis, lines, fields) = table_shape(&plan.shutter);
    let ned_from_key = DMat3::from_quat(plan.key_pose.ned_from_camera);
    let column = |i: usize| ned_from_key.col(i).as_vec3().extend(0.0).to_array();
    let lens = |i: usize| plan.camera.lens.coefficients().get(i).map_or(0.0, |&k| k as f32);
    let linear_fog = plan
        .linear_fog
        .map_or([0.0; 4], |LinearFog { sky_stored: [r, g, b], end_m }| [r, g, b, (1.0 / end_m) as f32]);
    let mut planes = [[0.0; 4]; MAX_KEYS as usize];
    for (plane, key) in planes.iter_mut().zip(&plan.keys) {
        *plane = plan.plane.seen_from(&key.pose).as_vec3().extend(0.0).to_array();
    }
    let (edge_scale, edge_samples) = match plan.edges {
        EdgeStage::None => (1, 0),
        EdgeStage::Supersampled { scale, samples, .. } => (scale, samples),
    };
    FrameUniforms {
        size_px: plan.camera.size_px,
        ideal_size_px: plan.ideal.size_px,
        ideal_focal_px: plan.ideal.focal_px.as_vec2().to_array(),
        ideal_principal_px: plan.ideal.principal_px.as_vec2().to_array(),
        focal_px: plan.camera.focal_px.as_vec2().to_array(),
        principal_px: plan.camera.principal_point_px.as_vec2().to_array(),
        near_m: NEAR_M as f32,
        nodes: plan.blur.map_or(1, |blur| blur.nodes),
        node_stride: plan.blur.map_or(1, |blur| blur.stride),
        line_axis: u32::from(axis == RowAxis::Columns),
        lines,
        fields,
        iterations: match plan.temporal {
            TemporalStage::Reproject { iterations } => iterations,
            _ => 0,
        },
        samples_per_px: plan.blur.map_or(0.0, |blur| blur.samples_per_px as f32),
        max_samples: plan.blur.map_or(1, |blur| blur.max_samples),
        max_taps: match plan.taps {
            TapStage::Grid { most } | TapStage::SplineOrGrid { most } => most,
            TapStage::Bilinear | TapStage::Spline | TapStage::Area => 1,
        },
        coords_phase,
        light: stage.light,
        noise_sigma: stage.noise_sigma,
        vignette_thresholds: photometric.vignette_thresholds.map(|t| t as f32),
        seed: [noise_seed as u32, (noise_seed >> 32) as u32],
        frame_number: sequence.picture(plan.frame) as u32,
        mono: u32::from(stage.is_mono),
        key_position_ned_m: plan.key_pose.position_ned_m.as_vec3().extend(0.0).to_array(),
        ned_from_key_x: column(0),
        ned_from_key_y: column(1),
        ned_from_key_z: column(2),
        edge_scale,
        edge_samples,
        keys: plan.keys.len() as u32,
        key_rows: key_rows(&plan.ideal),
        pad1: 0.0,
        rk2_step_rad: RK2_STEP_DEG.to_radians() as f32,
        lens_radial: [lens(0), lens(1), lens(4)],
        lens_tangential: [lens(2), lens(3)],
        most: stage.most,
        linear_fog,
        sky_reach_px: plan.sky_reach_px as f32,
        planes,
        key_velocity_m_s: plan.key_twist.velocity_m_s.as_vec3().extend(0.0).to_array(),
        key_rate_rad_s: plan
            .key_twist
            .rate_rad_s
            .extend(plan.key_twist.rate_rad_s.length())
            .as_vec4()
            .to_array(),
    }
}

/// What surfaces stand relative to when seen from a camera: in whole metres, so that sums with whole chunk
/// centres are exact.
#[must_use]
pub fn base_ned_m(pose: &CameraPose) -> DVec3 {
    pose.position_ned_m.round()
}

/// Uniforms of the key camera. Pixel centres stand at integers, so the viewport's half-pixel offset goes into
/// the shift.
#[must_use]
pub fn ideal_camera(plan: &FramePlan, pose: &CameraPose, base_ned_m: DVec3, scene: &Scene) -> IdealCamera {
    let ideal = &plan.ideal;
    let camera_from_ned = DMat3::from_quat(pose.ned_from_camera.inverse());
    let row = |i: usize| camera_from_ned.row(i).as_vec3().extend(0.0).to_array();
    let [width, height] = ideal.size_px.map(f64::from);
    let (f, c) = (ideal.focal_px, ideal.principal_px);
    // The paper's fog comes after the gather.
    let visibility_m = scene.fog_visibility_m.filter(|_| plan.linear_fog.is_none());
    let fog = visibility_m.map_or(0.0, |visibility_m| 3.912 / visibility_m);
    let [r, g, b] = scene.sky_linear;
    IdealCamera {
        clip_scale: [(2.0 * f.x / width) as f32, (-2.0 * f.y / height) as f32],
        clip_shift: [(2.0 * (c.x + 0.5) / width - 1.0) as f32, (1.0 - 2.0 * (c.y + 0.5) / height) as f32],
        camera_from_ned_x: row(0),
        camera_from_ned_y: row(1),
        camera_from_ned_z: row(2),
        camera_from_base_m: (pose.position_ned_m - base_ned_m).as_vec3().extend(0.0).to_array(),
        sky: [r, g, b, fog as f32],
        near_m: NEAR_M as f32,
        ..IdealCamera::default()
    }
}

/// Rows from one ideal frame to the next in a target.
#[must_use]
pub fn key_rows(ideal: &IdealGeometry) -> u32 {
    ideal.size_px[1].next_multiple_of(SIZE_QUANTUM_PX)
}
