//! Things that move, against closed forms and against the same scene that stands as it is at the instant.

use std::{f64::consts::TAU, sync::Arc};

use camsim_core::{
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{FieldOr, Scenario, ShutterSpec},
    scene::{
        Encoding, Light, Mesh, MeshVertex, RigidMotion, Scene, Shape, Texture, Wrap,
        motion::{Between, Curve, Joint, JointFrame, Keys, Track},
    },
};
use glam::{DAffine3, DQuat, DVec2, DVec3};

use crate::fixtures::{Steady, block, checker, hills, scenario, sequence};

const HEIGHT_M: f64 = 100.0;
const FOCAL_PX: f64 = 80.0;
const SIZE_PX: [u32; 2] = [64, 48];
const READOUT_MS: f64 = 20.0;

/// A pinhole camera that looks down: right is east, up is north.
fn camera(exposure_ms: f64) -> Scenario {
    let mut scenario = scenario();
    let camera = &mut scenario.camera;
    camera.size_px = SIZE_PX;
    camera.focal_px = [FOCAL_PX; 2];
    camera.principal_point_px = Some([31.5, 23.5]);
    camera.fps = 10.0;
    camera.shutter = ShutterSpec {
        readout_ms: READOUT_MS,
        exposure_ms,
        interlace_ms: FieldOr::Ms(0.0),
        ..ShutterSpec::default()
    };
    scenario
}

/// Mid-exposure of row y of frame 1.
fn row_s(y: u32) -> f64 {
    0.1 + 1e-3 * READOUT_MS * ((f64::from(y) + 0.5) / f64::from(SIZE_PX[1]) - 0.5)
}

fn reference(exposure_ms: f64, meshes: Vec<Mesh>) -> ReferenceRenderer {
    let scene = Scene { meshes, ..Scene::default() };
    let steady = Steady::standing(DVec3::new(0.0, 0.0, -HEIGHT_M));
    ReferenceRenderer::new(sequence(camera(exposure_ms), steady, scene)).unwrap()
}

/// A white rectangle from `low` to `high` (north, east) on the ground.
fn rectangle(low: [f32; 2], high: [f32; 2]) -> Mesh {
    let corner = |n: f32, e: f32| MeshVertex::new([n, e, 0.0], [0.5; 2]);
    let vertices = vec![
        corner(low[0], low[1]),
        corner(low[0], high[1]),
        corner(high[0], low[1]),
        corner(high[0], high[1]),
    ];
    let white = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
    Mesh::new(vertices, vec![0, 1, 2, 2, 1, 3], white, DVec3::ZERO, Wrap::Clamp)
}

fn moving(mesh: Mesh, joints: Vec<Joint>) -> Mesh {
    Mesh { motion: Some(Arc::new(RigidMotion::new(joints))), ..mesh }
}

/// Straight from where it is at time 0.
fn straight(velocity_m_s: DVec3) -> Joint {
    let ends = vec![-10.0 * velocity_m_s, 10.0 * velocity_m_s];
    let keys = Keys {
        position: Curve::new(vec![-10.0, 10.0], ends, Between::Linear).unwrap(),
        rotation: Curve::constant(DQuat::IDENTITY),
        start_s: 0.0,
        repeat: None,
    };
    Joint::new(JointFrame::IDENTITY, Track::Keys(keys))
}

fn spin(hub_m: DVec3, axis: DVec3, hz: f64, phase_rad: f64) -> Joint {
    let frame = JointFrame::from_affine(&DAffine3::from_translation(hub_m)).unwrap();
    Joint::new(frame, Track::Spin { axis, hz, phase_rad })
}

/// Whether a position of frame 1 shows anything at an exposure phase. `x_px` may be within any pixel of the row.
fn sees(reference: &ReferenceRenderer, x_px: f64, y: u32, phase: f64) -> bool {
    let pixel = x_px.round().clamp(0.0, f64::from(SIZE_PX[0] - 1));
    let sample = reference.view(1).sample([pixel as u32, y], DVec2::new(x_px - pixel, 0.0), phase);
    sample.unwrap().hit.is_some()
}

#[test]
fn a_rectangle_that_moves_sideways_is_sheared_by_the_readout() {
    // 150 m/s are 120 px/s, 2.4 px in a readout.
    let speed_m_s = 150.0;
    let speed_px_s = speed_m_s * FOCAL_PX / HEIGHT_M;
    let moved = moving(rectangle([-60.0, -30.0], [60.0, 0.0]), vec![straight(DVec3::Y * speed_m_s)]);
    let exposure_ms = 30.0;
    let reference = reference(exposure_ms, vec![moved]);
    for y in 0..SIZE_PX[1] {
        let edge_px = 31.5 + speed_px_s * row_s(y);
        for phase in [-0.5, 0.0, 0.5] {
            // It blurs over v t_e.
            let edge_px = edge_px + speed_px_s * 1e-3 * exposure_ms * phase;
            let found = [-1e-6, 1e-6].map(|off_px| sees(&reference, edge_px + off_px, y, phase));
            assert_eq!(found, [true, false], "{y} {phase}");
        }
    }
}

#[test]
fn the_blur_of_an_edge_is_as_long_as_its_path() {
    let (speed_m_s, exposure_ms, y) = (300.0, 40.0, 20);
    let speed_px_s = speed_m_s * FOCAL_PX / HEIGHT_M;
    let length_px = speed_px_s * 1e-3 * exposure_ms;
    let reference = reference(
        exposure_ms,
        vec![moving(rectangle([-60.0, -200.0], [60.0, 0.0]), vec![straight(DVec3::Y * speed_m_s)])],
    );
    let only = (0..SIZE_PX[0] * SIZE_PX[1]).map(|i| i / SIZE_PX[0] == y).collect();
    let options = RenderOptions {
        photometric: false,
        only: Some(only),
        min_samples: 1024,
        max_samples: 4096,
        tolerance_dn: 0.1,
        ..RenderOptions::default()
    };
    let frame = reference.render(1, &options);
    let middle_px = 31.5 + speed_px_s * row_s(y);
    let mut in_ramp = 0;
    for x in 0..SIZE_PX[0] {
        let value = f64::from(frame.color_rgba()[(4 * (y * SIZE_PX[0] + x)) as usize]);
        let off_px = f64::from(x) - middle_px;
        // Pixels at the ends of the ramp are partly beyond it.
        if (off_px.abs() - 0.5 * length_px).abs() < 0.5 {
            continue;
        }
        let expected = (0.5 - off_px / length_px).clamp(0.0, 1.0);
        // A thousand even samples: two or three of them on the wrong side.
        assert!((value - expected).abs() < 4e-3, "{x}: {value} {expected}");
        in_ramp += usize::from(expected > 0.0 && expected < 1.0);
    }
    assert!(in_ramp >= 7 && length_px > 9.0, "{in_ramp}");
}

#[test]
fn a_rotor_bends_as_its_closed_form() {
    // A blade that begins at the hub, which is the picture's centre; 20 turns a second make 144 degrees in a
    // readout.
    let (hz, phase_rad) = (20.0, 0.4);
    let hub_m = DVec3::new(0.0, 0.0, 0.0);
    let blade = Mesh {
        ned_from_shape: glam::DMat3::from_rotation_z(phase_rad),
        ..rectangle([-200.0, -200.0], [200.0, 0.0])
    };
    let reference = reference(0.0, vec![moving(blade, vec![spin(hub_m, DVec3::Z, hz, phase_rad)])]);
    let mut rows = 0;
    for y in 0..SIZE_PX[1] {
        let angle = phase_rad + TAU * hz * row_s(y);
        // The edge is the line through the hub at this angle from north; the rectangle is west of it.
        let north_m = (23.5 - f64::from(y)) * HEIGHT_M / FOCAL_PX;
        let edge_px = 31.5 + FOCAL_PX / HEIGHT_M * north_m * angle.tan();
        if !(0.0..f64::from(SIZE_PX[0] - 1)).contains(&edge_px) {
            continue;
        }
        let is_west = angle.cos() > 0.0;
        let found = [-1e-6, 1e-6].map(|off_px| sees(&reference, edge_px + off_px, y, 0.0));
        assert_eq!(found, [is_west, !is_west], "{y} {edge_px}");
        rows += 1;
    }
    assert!(rows > 30, "{rows}");
}

/// Lit things that turn in each other, one of them with holes, over hills.
fn busy() -> Scene {
    let lit = |mesh: Mesh, normal: [f32; 3]| {
        let normals = vec![normal; mesh.shape.vertices.len()];
        Mesh { shape: Arc::new(Shape { normals, ..(*mesh.shape).clone() }), ..mesh }
    };
    let roof = lit(Mesh::level_picture(checker(4), DVec3::new(5.0, -8.0, -71.5), 60.0), [0.3, -0.1, -0.9]);
    let house = block(DVec3::new(-20.0, 15.0, -40.0), 12.0, 30.0);
    let mut pane = Mesh::level_picture(checker(2), DVec3::new(20.0, 10.0, -80.0), 40.0);
    pane.material.cutoff = Some(0.5);
    pane.material.texture =
        Arc::new(Texture { rgba8: holed(&pane.material.texture), ..(*pane.material.texture).clone() });
    let car = straight(DVec3::new(20.0, -35.0, 4.0));
    let tilt = DVec3::new(0.6, 0.0, 0.8);
    let meshes = vec![
        moving(roof.clone(), vec![spin(DVec3::new(0.0, 5.0, -70.0), tilt, 1.7, 0.3)]),
        house.clone(),
        moving(
            Mesh { origin_ned_m: DVec3::new(-8.0, -5.0, -45.0), ..house },
            vec![car.clone(), spin(DVec3::new(-20.0, 15.0, 0.0), DVec3::Z, -0.9, 0.0)],
        ),
        moving(pane, vec![car]),
        Mesh { origin_ned_m: DVec3::new(-15.0, -20.0, -62.0), ..roof },
    ];
    Scene {
        terrain: Some(hills(65, 10.0)),
        meshes,
        light: Some(Light::new(0.7, 0.6, 0.7, 0.3)),
        ..Scene::default()
    }
}

fn holed(texture: &Texture) -> Vec<u8> {
    texture.rgba8.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2], pixel[0]]).collect()
}

#[test]
fn rays_meet_what_moves_as_if_it_stood_there() {
    let moving = busy();
    let steady = Steady::standing(DVec3::ZERO);
    let reference = ReferenceRenderer::new(sequence(scenario(), steady, moving.clone())).unwrap();
    let mut of_surface = [0; 7];
    for t_s in [-0.4, 0.0, 0.21, 0.77] {
        let meshes = moving.meshes.iter().map(|mesh| mesh.at(t_s)).collect();
        let stands = Scene { meshes, ..moving.clone() };
        let standing = ReferenceRenderer::new(sequence(scenario(), steady, stands)).unwrap();
        for i in 0..4000_u32 {
            let part = |k: u32, step: f64| (f64::from(i) * step + 0.1 * f64::from(k)).fract() - 0.5;
            let origin = DVec3::new(60.0 * part(1, 0.618_034), 60.0 * part(2, 0.754_878), -150.0);
            let direction = DVec3::new(part(3, 0.819_173), part(4, 0.671_044), 1.0);
            let [found, expected] =
                [reference.cast_at(t_s, origin, direction), standing.cast(origin, direction)];
            of_surface[expected.map_or(6, |hit| hit.surface as usize)] += 1;
            match (found, expected) {
                (Some(found), Some(expected)) => {
                    let tints = found.tint.iter().zip(expected.tint).map(|(a, b)| (a - b).abs());
                    let off = tints.fold(found.point_ned_m.distance(expected.point_ned_m), f64::max);
                    assert!(found.surface == expected.surface && off < 1e-8, "{t_s} {i}: {off:.1e}");
                }
                (found, expected) => assert_eq!(found, expected),
            }
        }
    }
    assert!(of_surface[..6].iter().all(|&count| count > 20), "{of_surface:?}");
}
