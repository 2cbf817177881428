//! Things that move in frames of the cpu and the gpu renderer, against the reference renderer.

mod common;

use std::sync::Arc;

use camsim_core::{
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{Axis, Channel, FieldOr, MountSpec, Preset, Readout, Scenario, ShutterSpec, VibrationSpec},
    scene::{
        Encoding, Mesh, RigidMotion, Scene, Terrain, Texture,
        motion::{Between, Curve, Joint, JointFrame, Keys, Track},
    },
    sequence::Sequence,
};
use camsim_engine::{Engine, RenderError};
use common::{engine, render, roof, scenario, sequence, steady};
use glam::{DAffine3, DQuat, DVec2, DVec3};

/// A name, and what is different in the scenario.
type Change = (&'static str, fn(&mut Scenario));

const SIZE_PX: [u32; 2] = [96, 72];
const FRAME: u64 = 3;

/// A roof that drifts and turns over hills, and a second one that stands still.
fn scene(moves: bool) -> Scene {
    let heights: Vec<f64> = (0..65 * 65)
        .map(|i| 8.0 * (f64::from(i % 65) * 0.4).sin() * (f64::from(i / 65) * 0.3).cos())
        .collect();
    let texture = Arc::new(Texture::uniform([90, 110, 60, 255], Encoding::Srgb));
    let terrain = Terrain::from_heights(65, 65, 8.0, &heights, Some(texture)).expect("heights");
    let times_s = vec![-1.0, 1.0];
    let drift_m = DVec3::new(30.0, 90.0, 0.0);
    let turns = [-1.4, 1.4].map(DQuat::from_rotation_z).to_vec();
    let keys = Keys {
        position: Curve::new(times_s.clone(), vec![-drift_m, drift_m], Between::Linear).expect("keys"),
        rotation: Curve::new(times_s, turns, Between::Linear).expect("keys"),
        start_s: 0.0,
        repeat: None,
    };
    let motion = RigidMotion::new(vec![Joint::new(JointFrame::IDENTITY, Track::Keys(keys))]);
    let still = Mesh { origin_ned_m: DVec3::new(-40.0, 50.0, -20.0), ..roof(20.0, 12.0) };
    let moving = Mesh { motion: Some(Arc::new(motion)), ..roof(40.0, 15.0) };
    let meshes = if moves { vec![still, moving] } else { vec![still] };
    Scene { terrain: Some(terrain), meshes, sky_linear: [0.2, 0.4, 0.8], ..Scene::default() }
}

fn camera(moves: bool, change: fn(&mut Scenario)) -> Arc<Sequence> {
    let mut scenario = scenario();
    scenario.camera.size_px = SIZE_PX;
    scenario.camera.focal_px = [80.0, 80.0];
    scenario.camera.mount = MountSpec { angles_deg: [0.0, -80.0, 0.0], ..MountSpec::default() };
    scenario.camera.shutter = ShutterSpec { readout_ms: 30.0, exposure_ms: 12.0, ..ShutterSpec::default() };
    change(&mut scenario);
    sequence(
        scenario,
        steady(110.0, 0.0, DVec3::new(20.0, -30.0, 0.0), DVec3::new(0.1, -0.2, 0.3)),
        scene(moves),
    )
}

/// Root mean square difference of linear colours, DN, and the pixels that differ at all.
fn difference(a: &[f32], b: &[f32]) -> (f64, Vec<usize>) {
    let squares: Vec<f64> = a
        .chunks_exact(4)
        .zip(b.chunks_exact(4))
        .map(|(a, b)| (0..3).map(|k| f64::from(a[k] - b[k]).powi(2)).sum::<f64>() / 3.0)
        .collect();
    let differing = (0..squares.len()).filter(|&i| squares[i] > 0.0).collect();
    (255.0 * (squares.iter().sum::<f64>() / squares.len() as f64).sqrt(), differing)
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn frames_with_moving_things_are_those_of_the_reference() {
    let cases: [Change; 4] = [
        ("rows", |_| {}),
        ("columns", |s| s.camera.shutter.readout = Readout::LeftToRight),
        ("interlaced", |s| s.camera.shutter.interlace_ms = FieldOr::Field),
        ("no exposure", |s| s.camera.shutter.exposure_ms = 0.0),
    ];
    let (gpu, cpu) = (engine(), Engine::cpu());
    for (name, change) in cases {
        let with = camera(true, change);
        let reference = ReferenceRenderer::new(with.clone()).expect("a usable camera");
        let options = RenderOptions { tolerance_dn: 0.3, max_samples: 1024, ..RenderOptions::default() };
        let expected = reference.render(FRAME, &options).into_color();
        let still = camera(false, change);
        for (renderer, engine) in [("cpu", &cpu), ("gpu", &gpu)] {
            let found = render(engine, &with, &[Channel::Color], FRAME).frame.into_color();
            let without = render(engine, &still, &[Channel::Color], FRAME).frame.into_color();
            let (gone_dn, painted) = difference(&found, &without);
            // The rest of the picture is that of the renderer without the roof.
            let patched = |source: &[f32]| {
                let mut picture = found.clone();
                painted
                    .iter()
                    .for_each(|&i| picture[4 * i..4 * i + 4].copy_from_slice(&source[4 * i..4 * i + 4]));
                picture
            };
            let (error_dn, _) = difference(&found, &patched(&expected));
            eprintln!(
                "{name}, {renderer}: {error_dn:.2} DN; without the roof {gone_dn:.1} DN, {} px",
                painted.len()
            );
            // Rays err at the roof's border.
            assert!(
                gone_dn > 20.0 && error_dn < 0.02 * gone_dn,
                "{name}, {renderer}: {error_dn} of {gone_dn}"
            );
            assert!(painted.len() * 4 < 3 * found.len() / 4, "{name}: a part of the picture is left alone");
        }
    }
}

/// A blade that turns more than once within an exposure, and one that no row can see.
#[test]
fn a_fast_rotor_is_seen_all_around_and_what_is_out_of_view_changes_nothing() {
    let with_rotor = |centre_ned_m: DVec3| {
        let frame = JointFrame::from_affine(&DAffine3::from_translation(centre_ned_m)).expect("a frame");
        let spin = Track::Spin { axis: DVec3::Z, hz: 100.0, phase_rad: 0.3 };
        let motion = Some(Arc::new(RigidMotion::new(vec![Joint::new(frame, spin)])));
        let origin_ned_m = centre_ned_m + DVec3::new(14.0, 0.0, 0.0);
        let mut scene = scene(false);
        scene.meshes.push(Mesh { motion, origin_ned_m, ..roof(40.0, 5.0) });
        let still = camera(false, |_| {});
        Arc::new(Sequence { scene: Arc::new(scene), ..Sequence::clone(&still) })
    };
    let cpu = Engine::cpu();
    let frame =
        |sequence: &Arc<Sequence>| render(&cpu, sequence, &[Channel::Color], FRAME).frame.into_color();
    let without = frame(&camera(false, |_| {}));
    let rotor = with_rotor(DVec3::new(10.0, 0.0, -40.0));
    let reference = ReferenceRenderer::new(rotor.clone()).expect("a usable camera");
    let options = RenderOptions { tolerance_dn: 0.3, max_samples: 1024, ..RenderOptions::default() };
    let expected = reference.render(FRAME, &options).into_color();
    let found = frame(&rotor);
    let (error_dn, _) = difference(&found, &expected);
    let (gone_dn, _) = difference(&found, &without);
    let red_dn = |a: &[f32], b: &[f32], i: usize| 255.0 * (a[4 * i] - b[4 * i]).abs();
    let pixels = 0..found.len() / 4;
    let swept: Vec<usize> = pixels.filter(|&i| red_dn(&expected, &without, i) > 10.0).collect();
    let missed = swept.iter().filter(|&&i| red_dn(&found, &without, i) == 0.0).count();
    eprintln!("rotor: {error_dn:.2} DN; without it {gone_dn:.1} DN; {missed} of {} px missed", swept.len());
    assert!(swept.len() > 300 && missed == 0, "{missed} of {}", swept.len());
    // A pixel sees the blade in a tenth of the exposure: in 6 of 64 instants, give or take one.
    assert!(error_dn < gone_dn / 6.0, "{error_dn} of {gone_dn}");
    let behind = with_rotor(DVec3::new(-4000.0, 0.0, -40.0));
    assert_eq!(frame(&behind), without);
}

/// A narrow blade that turns a little within an exposure, before a camera that shakes several times meanwhile: only
/// what is near it is cast, and nothing of it is missed.
#[test]
fn a_narrow_blade_is_cast_alone_and_seen_by_a_camera_that_shakes() {
    let shakes = |moves: bool| {
        camera(moves, |s| {
            let shake = VibrationSpec {
                axis: Axis::Roll,
                amplitude_deg: 8.0,
                amplitude_m: 0.0,
                hz: 250.0,
                phase_deg: 0.0,
            };
            s.camera.mount.vibration = vec![shake];
        })
    };
    let without = shakes(false);
    let centre_ned_m = DVec3::new(10.0, 0.0, -40.0);
    let frame = JointFrame::from_affine(&DAffine3::from_translation(centre_ned_m)).expect("a frame");
    let spin = Track::Spin { axis: DVec3::Z, hz: 1.0, phase_rad: 0.3 };
    let motion = Some(Arc::new(RigidMotion::new(vec![Joint::new(frame, spin)])));
    let mut scene = Scene::clone(&without.scene);
    scene.meshes.push(Mesh { motion, origin_ned_m: centre_ned_m, ..roof(50.0, 6.0) });
    let with = Arc::new(Sequence { scene: Arc::new(scene), ..Sequence::clone(&without) });
    let cpu = Engine::cpu();
    let color =
        |sequence: &Arc<Sequence>| render(&cpu, sequence, &[Channel::Color], FRAME).frame.into_color();
    let exact = |sequence: &Arc<Sequence>| {
        let reference = ReferenceRenderer::new(sequence.clone()).expect("a usable camera");
        let options = RenderOptions { tolerance_dn: 0.3, max_samples: 1024, ..RenderOptions::default() };
        reference.render(FRAME, &options).into_color()
    };
    let (expected, still) = (exact(&with), exact(&without));
    let (found, without) = (color(&with), color(&without));
    let red_dn = |a: &[f32], b: &[f32], i: usize| 255.0 * (a[4 * i] - b[4 * i]).abs();
    let seen: Vec<usize> = (0..found.len() / 4).filter(|&i| red_dn(&expected, &still, i) > 10.0).collect();
    let missed = seen.iter().filter(|&&i| red_dn(&found, &without, i) == 0.0).count();
    let cast = (0..found.len() / 4).filter(|&i| found[4 * i..4 * i + 4] != without[4 * i..4 * i + 4]).count();
    eprintln!("blade: seen by {} px, {missed} missed, {cast} cast", seen.len());
    assert!(seen.len() > 100 && missed == 0, "{missed} of {}", seen.len());
    // The disc of all directions has some 900 pixels.
    assert!(cast < 4 * seen.len(), "{cast} for {}", seen.len());
}

#[test]
fn truth_of_moving_things_is_that_of_rays_at_their_instant() {
    let with = camera(true, |_| {});
    let reference = ReferenceRenderer::new(with.clone()).expect("a usable camera");
    let frame = render(&Engine::cpu(), &with, &[Channel::Depth, Channel::NormalWorld], FRAME).frame;
    let depth_m = frame.depth_m().expect("depth");
    let (mut of_roof, mut wrong) = (0, 0);
    for (i, found_m) in depth_m.iter().enumerate() {
        let pixel = [i as u32 % SIZE_PX[0], i as u32 / SIZE_PX[0]];
        let seen = reference.sample(FRAME, pixel, DVec2::ZERO, 0.0).and_then(|seen| seen.hit);
        let expected_m = seen.map_or(0.0, |hit| hit.depth_m);
        of_roof += usize::from(seen.is_some_and(|hit| hit.surface == 2));
        wrong += usize::from((f64::from(*found_m) - expected_m).abs() > 1e-4 * expected_m);
    }
    assert!(of_roof > 300 && wrong <= 2, "{wrong} wrong, {of_roof} on the roof that moves");
}

#[test]
fn the_papers_preset_refuses_things_that_move() {
    let with = camera(true, |s| s.quality.preset = Preset::Paper);
    let engine = Engine::cpu();
    let refused = engine.session::<std::convert::Infallible>(with, &[Channel::Color]);
    assert!(matches!(refused, Err(RenderError::Moving)));
}
