//! The reverse pipeline on the host makes the picture that the device's kernel makes, whatever it is made of.

mod common;

use std::{collections::HashSet, convert::Infallible, fmt::Debug, hash::Hash, path::Path, sync::Arc};

use camsim_core::{
    scenario::{
        Auto, Axis, Channel, FieldOr, LensModel, LensSpec, MountSpec, OutputEncoding, Readout, Scenario,
        ShutterSpec, Silhouettes, VibrationSpec,
    },
    sequence::Sequence,
    temporal::TapStage,
    trajectory::Trajectory,
};
use camsim_engine::{Engine, Finished};
use camsim_gpu::reverse::{PipelineKey, TapKind, TemporalKind};
use camsim_io::{load::load_sequence, scenario_file::read_scenario};
use camsim_plan::{Backend, placement::cpu_vectorises};
use camsim_plan::{FramePlan, NodeDepths, PathStage, RayStage};
use common::{city, engine, is_software, pattern, scenario, sequence, steady};
use glam::DVec3;

/// Sides that no block divides.
const SIZE_PX: [u32; 2] = [181, 139];
const ALL: [Channel; 3] = [Channel::Color, Channel::Coords, Channel::Depth];
/// Of the exposure, at which coordinates are told.
const PHASE: f32 = 0.3;

fn camera(exposure_ms: f64) -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = SIZE_PX;
    scenario.camera.focal_px = [150.0, 140.0];
    scenario.camera.mount = MountSpec { angles_deg: [3.0, -60.0, 10.0], ..MountSpec::default() };
    scenario.camera.shutter = ShutterSpec { readout_ms: 33.0, exposure_ms, ..ShutterSpec::default() };
    scenario.quality.silhouettes = Silhouettes::Plain;
    scenario
}

fn lens(mut scenario: Scenario) -> Scenario {
    // So bent that the corners have no ray.
    scenario.camera.lens =
        LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.39, 0.11, 0.001, -0.002, -0.0084] };
    scenario
}

fn still() -> Trajectory {
    steady(120.0, 10.0, DVec3::ZERO, DVec3::ZERO)
}

fn turning() -> Trajectory {
    steady(120.0, 10.0, DVec3::ZERO, DVec3::new(0.3, -0.2, 0.5))
}

fn flying() -> Trajectory {
    steady(120.0, 10.0, DVec3::new(5.0, 30.0, 2.0), DVec3::new(0.1, 0.05, 0.3))
}

/// One that makes output frames on the cpu, one that makes them on the gpu, both from ideal frames of the gpu.
fn engines() -> [Engine; 2] {
    [Backend::GpuThenCpu, Backend::Gpu].map(|place| {
        let mut engine = engine();
        engine.set_backend(place);
        engine
    })
}

fn frame(engine: &Engine, sequence: &Arc<Sequence>, frame_number: u64, channels: &[Channel]) -> Finished {
    let mut session = engine.session::<Infallible>(sequence.clone(), channels).expect("session");
    let mut found = None;
    let mut keep = |finished: Finished| {
        found = Some(finished);
        Ok(())
    };
    session.set_coords_phase(PHASE);
    session.render::<Infallible>([frame_number], &mut keep).expect("render");
    found.expect("a frame")
}

/// Pixels that one of the two alone sees, or that are more than `most` of the range apart: where rounding
/// decides which surface is seen, or what is still in the ideal frame. And what the others are apart, RMS.
fn apart(a: &[f32], b: &[f32], most: f32) -> (usize, f64) {
    let differs = |(a, b): &(&[f32], &[f32])| a.iter().zip(*b).any(|(a, b)| (a - b).abs() > most);
    let (far, near): (Vec<_>, Vec<_>) = a.chunks_exact(4).zip(b.chunks_exact(4)).partition(differs);
    let squares = near.iter().flat_map(|(a, b)| a.iter().zip(*b)).map(|(a, b)| f64::from(a - b).powi(2));
    (far.len(), (squares.sum::<f64>() / a.len() as f64).sqrt())
}

fn assert_same(name: &str, engines: &[Engine; 2], sequence: &Arc<Sequence>, frame_number: u64) -> FramePlan {
    let [by_host, by_device] = engines.each_ref().map(|engine| frame(engine, sequence, frame_number, &ALL));
    let picture_alone = frame(&engines[0], sequence, frame_number, &[Channel::Color]);
    assert!(cpu_vectorises(&by_host.plan), "{name}: {:?}", by_host.plan);
    assert!(
        by_host.times.reverse_ms.is_some() && by_device.times.reverse_ms.is_none(),
        "{name}: each where it should be"
    );
    let (host, device) = (&by_host.frame.color_rgba, &by_device.frame.color_rgba);
    assert!(*host == picture_alone.frame.color_rgba, "{name}: asking for the truth changes no colour");
    // Texels weighed with 8 bits: 2^-9 of what neighbours are apart at most, along each axis, and somewhat
    // more where a spline sharpens.
    let [most, most_rms] = if is_software(&engines[1]) { [1e-3, 1e-5] } else { [6e-3, 3e-4] };
    let (far, rms) = apart(host, device, most as f32);
    let pixels = device.len() / 4;
    eprintln!("{name}: {far} of {pixels} pixels far apart, the others {rms:.1e}");
    assert!(device.chunks_exact(4).filter(|pixel| pixel[3] > 0.0).count() > pixels / 2, "{name}: a picture");
    assert!(far * 5000 <= pixels, "{name}: {far} pixels far apart");
    assert!(rms < most_rms, "{name}: {rms:.1e}");
    assert_same_truth(name, &by_host, &by_device);
    by_host.plan
}

/// All but one in a thousand pixels agree about the ray and the time to some units in the last place of
/// floats about 1, 99 of a hundred about the source to 1e-3 px, about the depth to 1e-5 of it.
fn assert_same_truth(name: &str, by_host: &Finished, by_device: &Finished) {
    let truth = |done: &Finished| {
        (done.frame.coords.clone().expect("coords"), done.frame.depth_m.clone().expect("depth"))
    };
    let ((host, host_m), (device, device_m)) = (truth(by_host), truth(by_device));
    let seen: Vec<usize> = (0..host_m.len()).filter(|&i| host_m[i] > 0.0 && device_m[i] > 0.0).collect();
    let differ = (0..host_m.len())
        .filter(|&i| {
            (host_m[i] > 0.0) != (device_m[i] > 0.0)
                || [0, 4].iter().any(|&k| (host[i][k] - device[i][k]).abs() > 5e-7)
        })
        .count();
    assert!(
        seen.len() > host_m.len() / 2 && differ * 1000 <= host_m.len(),
        "{name}: {differ} seen by one, {} by both",
        seen.len()
    );
    let p99 = |of: &dyn Fn(usize) -> f32| {
        let mut all: Vec<f32> = seen.iter().map(|&i| of(i)).collect();
        all.sort_by(f32::total_cmp);
        all[all.len() * 99 / 100]
    };
    let px = p99(&|i| (host[i][2] - device[i][2]).hypot(host[i][3] - device[i][3]));
    let depth = p99(&|i| (host_m[i] / device_m[i] - 1.0).abs());
    let point =
        p99(&|i| (5..8).map(|k| (host[i][k] - device[i][k]).powi(2)).sum::<f32>().sqrt() / device_m[i]);
    eprintln!(
        "{name}: truth {px:.1e} px, depth {depth:.1e}, point {point:.1e} of it; {differ} seen otherwise"
    );
    assert!(px < 1e-3 && depth < 1e-5 && point < 1e-5, "{name}: {px:.1e} px, {depth:.1e}, {point:.1e}");
}

fn cases() -> Vec<(&'static str, Scenario, Trajectory)> {
    let set = |mut scenario: Scenario, change: &dyn Fn(&mut Scenario)| {
        change(&mut scenario);
        scenario
    };
    let within = |px: f64| move |scenario: &mut Scenario| scenario.quality.max_error_px = px;
    let scale = |scale: f64| move |scenario: &mut Scenario| scenario.quality.ideal_scale = Auto::Value(scale);
    let taps = |taps: u32, scale: f64| {
        move |scenario: &mut Scenario| {
            scenario.quality.ideal_scale = Auto::Value(scale);
            scenario.quality.footprint_taps = Auto::Value(taps);
        }
    };
    let coarsely = |scenario: &mut Scenario| scenario.quality.max_error_dn = 40.0;
    let shaking = |hz: f64| {
        move |scenario: &mut Scenario| {
            scenario.camera.mount.vibration = vec![VibrationSpec {
                axis: Axis::Pitch,
                amplitude_deg: 0.3,
                amplitude_m: 0.0,
                hz,
                phase_deg: 20.0,
            }];
        }
    };
    vec![
        ("nothing moves", camera(0.0), still()),
        ("nothing moves, lens", lens(camera(0.0)), still()),
        ("copied", set(camera(0.0), &coarsely), still()),
        (
            "copied, noise",
            set(camera(0.0), &|scenario| {
                coarsely(scenario);
                scenario.camera.photometric.noise_sigma = 0.05;
            }),
            still(),
        ),
        ("turning", camera(0.0), turning()),
        ("turning, exposure", lens(camera(12.0)), turning()),
        ("flying", lens(camera(0.0)), flying()),
        ("flying, exposure", camera(12.0), flying()),
        ("1 px", lens(set(camera(20.0), &within(1.0))), flying()),
        ("0.01 px", lens(set(camera(20.0), &within(0.01))), flying()),
        ("0.001 px", set(camera(12.0), &within(0.001)), flying()),
        (
            "two looks",
            lens(set(camera(12.0), &|scenario| scenario.quality.iterations = Auto::Value(2))),
            flying(),
        ),
        ("five looks", set(camera(12.0), &|scenario| scenario.quality.iterations = Auto::Value(5)), flying()),
        ("shaking", lens(set(camera(20.0), &shaking(40.0))), flying()),
        ("shaking fast", lens(set(camera(20.0), &shaking(150.0))), flying()),
        ("shaking faster", set(camera(20.0), &shaking(400.0)), flying()),
        (
            "one sample",
            set(camera(20.0), &|scenario| scenario.quality.blur_samples = Auto::Value(1)),
            flying(),
        ),
        ("coarse", lens(set(camera(12.0), &scale(0.7))), flying()),
        ("fine", lens(set(camera(12.0), &scale(2.5))), flying()),
        ("fine, sharp", lens(set(camera(0.0), &scale(2.5))), flying()),
        ("taps", lens(set(camera(12.0), &taps(3, 2.5))), flying()),
        ("taps, sharp", set(camera(0.0), &taps(4, 2.5)), flying()),
        ("spline or taps", lens(set(camera(12.0), &taps(3, 1.6))), flying()),
        ("spline or taps, sharp", lens(set(camera(0.0), &taps(3, 1.6))), flying()),
        ("one tap, sharp", lens(set(camera(0.0), &taps(1, 2.5))), turning()),
        ("one tap", lens(set(camera(12.0), &taps(1, 2.5))), flying()),
        (
            "bottom to top, interlaced",
            set(lens(camera(8.0)), &|scenario| {
                scenario.camera.shutter.readout = Readout::BottomToTop;
                scenario.camera.shutter.interlace_ms = FieldOr::Ms(16.0);
            }),
            flying(),
        ),
        (
            "grey, light, noise",
            set(lens(camera(8.0)), &|scenario| {
                scenario.camera.photometric.noise_sigma = 0.02;
                scenario.camera.photometric.light = 1.3;
                scenario.camera.photometric.output = OutputEncoding::Luma8;
                scenario.seed = 0x1234_5678_9abc;
            }),
            flying(),
        ),
        ("noise", set(camera(8.0), &|scenario| scenario.camera.photometric.noise_sigma = 0.05), turning()),
    ]
}

fn assert_all<T: Debug + Eq + Hash>(seen: &HashSet<T>, all: impl IntoIterator<Item = T>) {
    let missing: Vec<T> = all.into_iter().filter(|kind| !seen.contains(kind)).collect();
    assert!(missing.is_empty(), "no case has {missing:?}");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn the_host_makes_the_same_picture() {
    let engines = engines();
    let mut plans = Vec::new();
    for (name, scenario, trajectory) in cases() {
        // Ground that fills the view, and silhouettes.
        for scene in [pattern(6000.0), city(6)] {
            let sequence = sequence(scenario.clone(), trajectory.clone(), scene);
            plans.push(assert_same(name, &engines, &sequence, 2));
        }
    }
    let benches = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../benches");
    let read = |name: &str| read_scenario(&benches.join(name), &[], None).expect("scenario");
    let all_effects = load_sequence(&read("all_effects.toml")).expect("sequence").sequence;
    plans.extend([52, 98].map(|frame| assert_same("all effects", &engines, &all_effects, frame)));
    // Over houses pixels are read by their areas; of a lens that bends little too.
    for (exposure_ms, radial) in [(0.0, 0.0), (8.0, 0.0), (0.0, -0.06), (8.0, -0.06)] {
        let mut scenario = read("houses.toml");
        scenario.camera.size_px = SIZE_PX;
        (scenario.camera.focal_px, scenario.camera.principal_point_px) = ([150.0, 140.0], Some([90.0, 69.0]));
        scenario.camera.lens =
            LensSpec { model: LensModel::BrownConrady, coefficients: vec![radial, 0.0, 0.0, 0.0, 0.0] };
        scenario.camera.shutter.exposure_ms = exposure_ms;
        let houses = load_sequence(&scenario).expect("sequence").sequence;
        let plan = assert_same("houses", &engines, &houses, 40);
        assert_eq!(plan.taps, TapStage::Area, "{exposure_ms} ms, {radial}");
        plans.push(plan);
    }
    assert!(plans.iter().filter(|plan| plan.copied_from().is_some()).count() >= 4, "some are copied");
    let keys: Vec<PipelineKey> = plans.iter().map(PipelineKey::of).collect();
    assert_all(&keys.iter().map(|key| key.ray).collect(), [RayStage::Pinhole, RayStage::LensMap]);
    assert_all(
        &keys.iter().map(|key| key.temporal).collect(),
        [TemporalKind::Identity, TemporalKind::Rotation, TemporalKind::Reproject],
    );
    let blurred = || keys.iter().filter(|key| key.blur && key.temporal == TemporalKind::Reproject);
    assert_all(&blurred().map(|key| key.depths).collect(), NodeDepths::ALL);
    assert_all(&blurred().map(|key| key.path).collect(), PathStage::ALL);
    assert_all(
        &keys.iter().map(|key| (key.blur, key.tap)).collect(),
        TapKind::ALL.into_iter().flat_map(|tap| [(false, tap), (true, tap)]),
    );
}
