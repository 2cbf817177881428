#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use glam::DVec2;

use glam::DVec3;

use super::PixelTruth;
use crate::Planner;
use camsim_core::{
    mount::CameraPath,
    pose::BodyState,
    reference::ReferenceRenderer,
    scenario::{Channel, FlightSpec, LensModel, LensSpec, MountSpec, Scenario, ShutterSpec, Solver},
    scene::{
        Encoding, Mesh, RigidMotion, Scene, Terrain, Texture,
        motion::{Joint, JointFrame, Track},
        ray_packet::{PACKET_RAYS, RayPacket},
    },
    sequence::Sequence,
    trajectory::Trajectory,
};

/// Roofs over hills, seen by a fast camera that turns, with a lens, an exposure and the skyline in view.
fn sequence(solver: Option<Solver>) -> Arc<Sequence> {
    sequence_with(solver, None)
}

/// The same with a motion of the second roof.
fn sequence_with(solver: Option<Solver>, motion: Option<Arc<RigidMotion>>) -> Arc<Sequence> {
    // Long because: every part of a sequence is written out.
    let texture = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
    let roof = |north_m: f64, height_m: f64| {
        Mesh::level_picture(texture.clone(), DVec3::new(north_m, 10.0, -height_m), 30.0)
    };
    let heights: Vec<f64> = (0..65 * 65)
        .map(|i| 8.0 * (f64::from(i % 65) * 0.6).sin() * (f64::from(i / 65) * 0.4).cos())
        .collect();
    let terrain = Terrain::from_heights(65, 65, 10.0, &heights, Some(texture.clone())).unwrap();
    let scene = Scene {
        terrain: Some(terrain),
        meshes: vec![roof(20.0, 25.0), Mesh { motion, ..roof(70.0, 35.0) }],
        ..Scene::default()
    };
    let mut scenario =
        Scenario { seed: 1, ..Scenario::new(FlightSpec::new("in-memory"), Default::default()) };
    scenario.camera.size_px = [80, 60];
    scenario.camera.focal_px = [60.0, 62.0];
    scenario.camera.lens =
        LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.2, 0.05, 0.001, -0.002] };
    scenario.camera.mount = MountSpec { angles_deg: [2.0, -25.0, 0.0], ..MountSpec::default() };
    scenario.camera.shutter = ShutterSpec { readout_ms: 33.0, exposure_ms: 12.0, ..ShutterSpec::default() };
    scenario.quality.solver = solver.map_or(Default::default(), camsim_core::scenario::Auto::Value);
    let first = BodyState {
        position_ned_m: DVec3::new(-100.0, -20.0, -60.0),
        velocity_ned_m_s: DVec3::new(50.0, 10.0, 0.0),
        rate_body_rad_s: DVec3::new(0.1, -0.2, 0.3),
        ..BodyState::default()
    };
    let trajectory = Trajectory::uniform(-1.0, 4.0, 3.0, vec![first]).unwrap();
    let path = CameraPath::new(trajectory, &scenario.camera.mount).unwrap();
    Arc::new(Sequence::in_memory(scenario, path, scene, 9))
}

#[test]
fn pixel_truth_is_that_of_the_reference() {
    let hub = glam::DAffine3::from_translation(DVec3::new(65.0, 5.0, -35.0));
    let axis = DVec3::new(0.0, 0.6, 0.8);
    let spin =
        Joint::new(JointFrame::from_affine(&hub).unwrap(), Track::Spin { axis, hz: 3.0, phase_rad: 0.0 });
    let turning = Arc::new(RigidMotion::new(vec![spin]));
    for motion in [None, Some(turning)] {
        compare_with_reference(&sequence_with(None, motion));
    }
}

fn compare_with_reference(sequence: &Arc<Sequence>) {
    let plan = Planner::new(sequence.clone(), &[Channel::Coords], 16_384).unwrap();
    let (planner, plan) = (&plan, plan.plan(1).unwrap());
    assert!(plan.has_exact_truth(), "{:?}", plan.temporal);
    let reference = ReferenceRenderer::new(sequence.clone()).unwrap();
    let view = reference.view(1);
    let key = plan.ideal_view();
    let mut of_surface = [0; 4];
    for pixel in (0..60).flat_map(|y| (0..80).map(move |x| [x, y])) {
        for phase in [0.0, -0.5, 0.3] {
            let [mid, look] = [0.0, phase].map(|phase| view.sample(pixel, DVec2::ZERO, phase).unwrap());
            let truth = planner.frame_rays(&plan, phase).cast(pixel, look.uv);
            let off_px = truth.source_px.distance(key.source_px(&look));
            assert!(off_px < 1e-8, "{pixel:?} {phase}: {off_px:.1e} px");
            let off_m = match (truth.hit, mid.hit) {
                (Some(found), Some(hit)) => {
                    assert_eq!(found.surface, hit.surface, "{pixel:?}");
                    found.point_ned_m.distance(hit.point_ned_m) + (found.depth_m - hit.depth_m).abs()
                }
                (None, None) => 0.0,
                (found, _) => panic!("{pixel:?}: {found:?}, not {:?}", mid.hit),
            };
            assert!(off_m < 1e-8, "{pixel:?}: {off_m:.1e} m");
            of_surface[mid.hit.map_or(3, |hit| hit.surface as usize)] += 1;
        }
    }
    assert!(of_surface.iter().all(|&count| count > 100), "terrain, roofs and sky: {of_surface:?}");
}

#[test]
fn only_exact_solvers_have_exact_truth() {
    let looks = |solver: Option<Solver>, channel: Channel| {
        Planner::new(sequence(solver), &[channel], 16_384).unwrap().plan(1).unwrap().has_exact_truth()
    };
    assert!(looks(Some(Solver::Reproject), Channel::Depth));
    assert!(!looks(Some(Solver::Rk2), Channel::Depth) && !looks(Some(Solver::Linear), Channel::Coords));
    assert!(!looks(None, Channel::Color), "nothing is wanted");
}

#[test]
fn packets_see_what_single_rays_see() {
    let hub = glam::DAffine3::from_translation(DVec3::new(65.0, 5.0, -35.0));
    let axis = DVec3::new(0.0, 0.6, 0.8);
    let spin =
        Joint::new(JointFrame::from_affine(&hub).unwrap(), Track::Spin { axis, hz: 3.0, phase_rad: 0.0 });
    for (motion, phase) in [(None, 0.0), (Some(Arc::new(RigidMotion::new(vec![spin]))), 0.3)] {
        let planner = Planner::new(sequence_with(None, motion), &[Channel::Coords], 16_384).unwrap();
        let plan = planner.plan(1).unwrap();
        let rays = planner.frame_rays(&plan, phase);
        let (mut packet, mut count) = (RayPacket::default(), 0);
        // Squares, a row, and pixels all over the picture, some of them missing.
        for layout in 0..80 {
            let pixels: [_; PACKET_RAYS] = std::array::from_fn(|i| {
                let i = i as u32;
                let pixel = match layout {
                    0..60 => [layout % 10 * 8 + i % 8, layout / 10 * 8 + i / 8],
                    60..70 => [i, layout - 60],
                    _ => [(i * 37 + layout) % 80, (i * 23 + 7 * layout) % 60],
                };
                let is_there = pixel[1] < 60 && (layout < 50 || !(i + layout).is_multiple_of(3));
                is_there.then(|| Some((pixel, plan.camera.unproject_pixel(pixel)?))).flatten()
            });
            rays.cast_packet(&mut packet, &pixels, |i, seen| {
                let (pixel, uv) = pixels[i].unwrap();
                let alone = rays.cast(pixel, uv);
                assert!(
                    seen.source_px.distance(alone.source_px) < 1e-9,
                    "{pixel:?}: {seen:?}, not {alone:?}"
                );
                let id = |truth: &PixelTruth| truth.hit.map(|hit| (hit.surface, hit.triangle));
                assert_eq!(id(&seen), id(&alone), "{pixel:?}");
                if let (Some(a), Some(b)) = (seen.hit, alone.hit) {
                    assert!((a.depth_m / b.depth_m - 1.0).abs() < 1e-11, "{pixel:?}: {a:?}, not {b:?}");
                    assert!(a.normal_ned.distance(b.normal_ned) < 1e-11, "{pixel:?}: {a:?}, not {b:?}");
                }
                count += 1;
            });
        }
        assert!(count > 4000, "{count}");
    }
}
