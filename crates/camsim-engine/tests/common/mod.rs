//! Synthetic sequences that need no files.

#![allow(dead_code, reason = "each test binary uses its part")]

pub mod rays;

use std::{convert::Infallible, sync::Arc};

use camsim_core::{
    mount::CameraPath,
    pose::BodyState,
    scenario::{Channel, Scenario},
    scene::{Encoding, Mesh, Scene, Texture},
    sequence::Sequence,
    trajectory::Trajectory,
};
use camsim_engine::{AdapterChoice, Engine, Finished, IdealImages};
use glam::{DQuat, DVec3, EulerRot};

/// The software adapter, so that figures compare between machines, or the one that `CAMSIM_ADAPTER` names.
pub fn engine() -> Engine {
    Engine::new(AdapterChoice::Software)
        .expect("tests need a software Vulkan adapter; CAMSIM_SKIP_GPU=1 skips them")
}

/// Whether textures are read and triangles drawn by code. Circuits weigh texels with 8 bits of fraction, and
/// move corners to multiples of 1/256 px.
pub fn is_software(engine: &Engine) -> bool {
    engine.gpu().expect("an adapter").adapter.kind == "software"
}

/// A default scenario to change; log and scene are given in memory.
pub fn scenario() -> Scenario {
    Scenario {
        seed: 12,
        flight: serde_free_flight(),
        tracker: Default::default(),
        camera: Default::default(),
        scene: Default::default(),
        quality: Default::default(),
        output: Default::default(),
    }
}

fn serde_free_flight() -> camsim_core::scenario::FlightSpec {
    camsim_core::scenario::FlightSpec {
        log: "in-memory".into(),
        format: Default::default(),
        time_unit: Default::default(),
        angle_unit: Default::default(),
        angles: Default::default(),
        attitude: Default::default(),
        origin: Default::default(),
        height: Default::default(),
        window_s: None,
        speed: 1.0,
    }
}

/// Constant velocity and body rate about t = 0: at `height_m` over the origin, heading `yaw_deg`.
pub fn steady(height_m: f64, yaw_deg: f64, velocity_ned_m_s: DVec3, rate_body_rad_s: DVec3) -> Trajectory {
    let at_zero = BodyState {
        position_ned_m: DVec3::new(0.0, 0.0, -height_m),
        velocity_ned_m_s,
        acceleration_ned_m_s2: DVec3::ZERO,
        ned_from_body: DQuat::from_euler(EulerRot::ZYX, yaw_deg.to_radians(), 0.0, 0.0),
        rate_body_rad_s,
        angular_acceleration_body_rad_s2: DVec3::ZERO,
    };
    let start_s = -5.0;
    let turn = DQuat::from_scaled_axis(rate_body_rad_s * start_s);
    let first = BodyState {
        position_ned_m: at_zero.position_ned_m + velocity_ned_m_s * start_s,
        ned_from_body: (at_zero.ned_from_body * turn).normalize(),
        ..at_zero
    };
    Trajectory::uniform(start_s, 10.0, 5.0, vec![first]).expect("one segment")
}

/// A smooth picture on the ground: band-limited, so that interpolation errors stay small.
pub fn pattern(width_m: f64) -> Scene {
    const SIDE: u32 = 512;
    let level = |x: u32, y: u32, k: f64, phase: f64| {
        let s = (std::f64::consts::TAU * k * f64::from(x) / f64::from(SIDE) + phase).sin()
            * (std::f64::consts::TAU * k * f64::from(y) / f64::from(SIDE)).cos();
        (127.5 + 110.0 * s).round() as u8
    };
    let rgba8 = (0..SIDE * SIDE).flat_map(|i| {
        let (x, y) = (i % SIDE, i / SIDE);
        [level(x, y, 8.0, 0.0), level(x, y, 5.0, 1.0), level(x, y, 11.0, 2.0), 255]
    });
    let texture = Texture { size_px: [SIDE, SIDE], rgba8: rgba8.collect(), encoding: Encoding::Linear };
    Scene {
        meshes: vec![Mesh::level_picture(Arc::new(texture), DVec3::ZERO, width_m)],
        sky_linear: [0.2, 0.4, 0.8],
        ..Scene::default()
    }
}

/// A sequence whose frame 0 has its stamp at t = 0.
pub fn sequence(scenario: Scenario, trajectory: Trajectory, scene: Scene) -> Arc<Sequence> {
    let path = CameraPath::new(trajectory, &scenario.camera.mount).expect("a legal mount");
    Arc::new(Sequence {
        scenario,
        path: Arc::new(path),
        epoch_ns: 0,
        start_s: 0.0,
        frames: 100,
        scene: Arc::new(scene),
        vignette: None,
        zoom_track: Vec::new(),
    })
}

/// Renders one frame with the given coordinates phase.
pub fn render_at_phase(
    engine: &Engine,
    sequence: &Arc<Sequence>,
    channels: &[Channel],
    frame: u64,
    phase: f32,
) -> Finished {
    let mut session = engine.session::<Infallible>(sequence.clone(), channels).expect("session");
    session.set_coords_phase(phase);
    let mut found = None;
    session
        .render::<Infallible>([frame], &mut |finished| {
            found = Some(finished);
            Ok(())
        })
        .expect("render");
    found.expect("one frame")
}

/// Renders one frame.
pub fn render(engine: &Engine, sequence: &Arc<Sequence>, channels: &[Channel], frame: u64) -> Finished {
    render_at_phase(engine, sequence, channels, frame, 0.0)
}

/// Frame 0 with coordinates of the given phase, and the ideal frame that it was gathered from.
pub fn render_with_ideal(sequence: &Arc<Sequence>, phase: f32) -> (Finished, IdealImages) {
    let engine = engine();
    let mut session =
        engine.session::<Infallible>(sequence.clone(), &[Channel::Color, Channel::Coords]).expect("session");
    session.set_coords_phase(phase);
    let mut found = None;
    let mut keep = |finished| {
        found = Some(finished);
        Ok(())
    };
    session.render::<Infallible>([0], &mut keep).expect("render");
    let ideal = session.read_ideal().expect("readable").expect("drawn");
    (found.expect("one frame"), ideal)
}

/// Boxes on level ground: `side` x `side` of them, 30 m apart, turned and of different size; textures are
/// smooth pictures.
pub fn city(side: u32) -> Scene {
    let mut scene = pattern(800.0);
    let texture = scene.meshes[0].material.texture.clone();
    for i in 0..side * side {
        let [column, row] = [i % side, i / side].map(f64::from);
        // Any irregular numbers do.
        let vary = |k: f64| (k * 12.9898 * (1.0 + column) + 78.233 * row * k + k).sin().abs();
        let centre =
            (DVec3::new(row, column, 0.0) - 0.5 * f64::from(side - 1) * DVec3::new(1.0, 1.0, 0.0)) * 30.0;
        let half_m = [4.0 + 4.0 * vary(1.0), 4.0 + 4.0 * vary(2.0)];
        scene.meshes.push(tower(&texture, centre, half_m, 6.0 + 24.0 * vary(3.0), 90.0 * vary(4.0)));
    }
    scene
}

/// Walls and roof of a box, its floor centred at `centre_ned_m`.
fn tower(
    texture: &Arc<Texture>,
    centre_ned_m: DVec3,
    half_m: [f64; 2],
    height_m: f64,
    turn_deg: f64,
) -> Mesh {
    let (sin, cos) = turn_deg.to_radians().sin_cos();
    let at = |n: f64, e: f64, down: f64| {
        let (n, e) = (n * half_m[0], e * half_m[1]);
        [(n * cos - e * sin) as f32, (n * sin + e * cos) as f32, down as f32]
    };
    let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]];
    let mut shape = camsim_core::scene::Shape::default();
    let mut face = |positions: [[f32; 3]; 4], first_uv: f32| {
        let base = shape.vertices.len() as u32;
        let uvs = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]]
            .map(|[u, v]: [f32; 2]| [u + first_uv, v + 0.5 * first_uv]);
        shape.vertices.extend(
            positions
                .iter()
                .zip(uvs)
                .map(|(&position_m, uv)| camsim_core::scene::MeshVertex::new(position_m, uv)),
        );
        shape.indices.extend([0, 1, 2, 0, 2, 3].map(|i: u32| base + i));
    };
    for k in 0..4 {
        let ([a, b], [c, d]) = (corners[k], corners[(k + 1) % 4]);
        face([at(a, b, 0.0), at(c, d, 0.0), at(c, d, -height_m), at(a, b, -height_m)], 0.2 * k as f32);
    }
    face(corners.map(|[a, b]| at(a, b, -height_m)), 0.85);
    Mesh::new(shape.vertices, shape.indices, texture.clone(), centre_ned_m, camsim_core::scene::Wrap::Clamp)
}
