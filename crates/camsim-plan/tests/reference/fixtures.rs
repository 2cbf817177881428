//! Sequences made in memory.

use std::sync::Arc;

use camsim_core::{
    mount::CameraPath,
    pose::BodyState,
    scenario::{FlightSpec, LensModel, LensSpec, MountSpec, Scenario, ShutterSpec},
    scene::{Encoding, Mesh, MeshVertex, Scene, Terrain, Texture, Wrap},
    sequence::Sequence,
    trajectory::Trajectory,
};
use glam::{DQuat, DVec3};

/// Looks straight down, the top of the image towards the nose.
pub fn scenario() -> Scenario {
    let mut scenario =
        Scenario { seed: 12, ..Scenario::new(FlightSpec::new("in-memory"), Default::default()) };
    scenario.camera.mount = MountSpec { angles_deg: [0.0, -90.0, 0.0], ..MountSpec::default() };
    scenario
}

/// Motion without accelerations: `p = position + velocity t`, `R = attitude Exp(rate t)`.
#[derive(Clone, Copy, Debug)]
pub struct Steady {
    pub position_ned_m: DVec3,
    pub velocity_ned_m_s: DVec3,
    pub ned_from_body: DQuat,
    pub rate_body_rad_s: DVec3,
}

impl Steady {
    pub fn standing(position_ned_m: DVec3) -> Self {
        Self {
            position_ned_m,
            velocity_ned_m_s: DVec3::ZERO,
            ned_from_body: DQuat::IDENTITY,
            rate_body_rad_s: DVec3::ZERO,
        }
    }

    /// Turning, drifting and climbing.
    pub fn moving(height_m: f64) -> Self {
        Self {
            position_ned_m: DVec3::new(3.0, -2.0, -height_m),
            velocity_ned_m_s: DVec3::new(25.0, -12.0, -18.0),
            ned_from_body: DQuat::from_rotation_z(0.6)
                * DQuat::from_rotation_y(0.08)
                * DQuat::from_rotation_x(-0.05),
            rate_body_rad_s: DVec3::new(0.3, -0.4, 0.7),
        }
    }

    /// Begins at `BEFORE_S` before time 0.
    pub fn trajectory(&self) -> Trajectory {
        const BEFORE_S: f64 = 5.0;
        let first = BodyState {
            position_ned_m: self.position_ned_m - BEFORE_S * self.velocity_ned_m_s,
            velocity_ned_m_s: self.velocity_ned_m_s,
            ned_from_body: self.ned_from_body * DQuat::from_scaled_axis(-BEFORE_S * self.rate_body_rad_s),
            rate_body_rad_s: self.rate_body_rad_s,
            ..BodyState::default()
        };
        Trajectory::uniform(-BEFORE_S, 2.0 * BEFORE_S, BEFORE_S, vec![first]).unwrap()
    }
}

/// A sequence whose frame 0 has its stamp at t = 0.
pub fn sequence(scenario: Scenario, motion: Steady, scene: Scene) -> Arc<Sequence> {
    let path = CameraPath::new(motion.trajectory(), &scenario.camera.mount).unwrap();
    Arc::new(Sequence::in_memory(scenario, path, scene, 100))
}

pub fn checker(squares: u32) -> Arc<Texture> {
    let rgba8 = (0..64 * 64_u32).flat_map(|i| {
        let level =
            if (i % 64 / (64 / squares) + i / 64 / (64 / squares)).is_multiple_of(2) { 255 } else { 0 };
        [level, level, level, 255]
    });
    Arc::new(Texture { size_px: [64, 64], rgba8: rgba8.collect(), encoding: Encoding::Linear })
}

/// A level picture at the origin.
pub fn plane(width_m: f64) -> Scene {
    Scene {
        meshes: vec![Mesh::level_picture(checker(8), DVec3::ZERO, width_m)],
        sky_linear: [0.2, 0.4, 0.8],
        ..Scene::default()
    }
}

pub fn hills(side: u32, cell_m: f64) -> Terrain {
    let height = |i: u32| {
        let (x, y) = (f64::from(i % side), f64::from(i / side));
        40.0 * (0.07 * x).sin() * (0.05 * y).cos() + 12.0 * (0.31 * x + 0.23 * y).sin()
    };
    let heights: Vec<f64> = (0..side * side).map(height).collect();
    Terrain::from_heights(side, side, cell_m, &heights, Some(checker(8))).unwrap()
}

/// Boxes on a plane.
pub fn town(count: usize) -> Scene {
    let mut scene = plane(4000.0);
    let mut numbers = (0..).map(|i| (f64::from(i) * 0.618_033_988_749_894_9 + 0.1_f64).fract());
    for _ in 0..count {
        let [n, e, w, h] = [0; 4].map(|_: i32| numbers.next().unwrap());
        scene.meshes.push(block(
            DVec3::new(800.0 * (n - 0.5), 800.0 * (e - 0.5), 0.0),
            5.0 + 15.0 * w,
            5.0 + 35.0 * h,
        ));
    }
    scene
}

pub fn block(at: DVec3, half_m: f64, height_m: f64) -> Mesh {
    let corner = |k: u32| {
        let side = |bit: u32| if k >> bit & 1 == 1 { half_m as f32 } else { -half_m as f32 };
        let down = if k >> 2 & 1 == 1 { -height_m as f32 } else { 0.0 };
        MeshVertex::new([side(0), side(1), down], [(k & 1) as f32, (k >> 1 & 1) as f32])
    };
    let faces: [[u32; 4]; 5] = [[4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let indices = faces.iter().flat_map(|f| [f[0], f[1], f[2], f[0], f[2], f[3]]).collect();
    Mesh::new((0..8).map(corner).collect(), indices, checker(2), at, Wrap::Clamp)
}

pub fn rolling(exposure_ms: f64) -> ShutterSpec {
    ShutterSpec { delay_ms: 4.0, readout_ms: 33.0, exposure_ms, ..ShutterSpec::default() }
}

/// A mild lens with strong tangential terms.
pub fn tangential() -> LensSpec {
    LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.28, 0.08, 0.002, -0.004] }
}

/// A fisheye that folds within the picture.
pub fn folding() -> LensSpec {
    LensSpec {
        model: LensModel::BrownConrady,
        coefficients: vec![-0.428129, 0.158059, 0.000245, -0.002286, -0.029194],
    }
}
