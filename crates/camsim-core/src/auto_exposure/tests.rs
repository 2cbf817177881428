//! Exposures of whole flights: the meter against rendered pictures, and what a frame's exposure depends on.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use rayon::prelude::*;

use crate::{
    auto_exposure::ExposureTrack,
    exposure::FrameExposures,
    frame::RenderedFrame,
    mount::CameraPath,
    photometric::GrayImage,
    pose::BodyState,
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{
        AutoExposureSpec, ExposureStart, FlightSpec, ImageSensorSpec, LensModel, LensSpec, Mosaic, MountSpec,
        Scenario, ShutterSpec,
    },
    scene::{Encoding, Mesh, Scene, Texture},
    sequence::Sequence,
    trajectory::Trajectory,
};

const SIDE_PX: u32 = 1024;
const WIDTH_M: f64 = 2048.0;
const SPEED_M_S: f64 = 60.0;

/// Level ground with rough texture: snow in the west, forest in the east.
fn snow_and_forest() -> Scene {
    let texel = |i: u32| {
        let rough = f64::from(crate::noise::pcg4d([i, 3, 7, 1])[0] >> 8) / f64::from(1 << 24) - 0.5;
        let level = if i % SIDE_PX < SIDE_PX / 2 { 0.8 + 0.2 * rough } else { 0.03 + 0.04 * rough };
        [(255.0 * level).round() as u8; 3]
    };
    let rgba8 = (0..SIDE_PX * SIDE_PX).flat_map(|i| {
        let [r, g, b] = texel(i);
        [r, g, b, 255]
    });
    let texture = Texture { size_px: [SIDE_PX; 2], rgba8: rgba8.collect(), encoding: Encoding::Linear };
    Scene {
        meshes: vec![Mesh::level_picture(Arc::new(texture), DVec3::ZERO, WIDTH_M)],
        sky_linear: [0.2, 0.4, 0.8],
        ..Scene::default()
    }
}

fn scenario(auto: AutoExposureSpec) -> Scenario {
    let mut scenario = Scenario::new(FlightSpec::new("in-memory"), Default::default());
    scenario.camera.size_px = [96, 72];
    scenario.camera.focal_px = [70.0, 70.0];
    scenario.camera.shutter = ShutterSpec { readout_ms: 20.0, exposure_ms: 4.0, ..ShutterSpec::default() };
    scenario.camera.mount = MountSpec { angles_deg: [0.0, -70.0, 0.0], ..MountSpec::default() };
    scenario.camera.auto_exposure = Some(auto);
    scenario
}

/// Eastwards over the border between both, which is below at path time 3 s.
fn sequence_of(scenario: Scenario, vignette: Option<GrayImage>) -> Arc<Sequence> {
    let first = BodyState {
        position_ned_m: DVec3::new(0.0, -3.0 * SPEED_M_S, -150.0),
        velocity_ned_m_s: DVec3::new(0.0, SPEED_M_S, 0.0),
        ned_from_body: DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2),
        ..BodyState::default()
    };
    let trajectory = Trajectory::uniform(0.0, 10.0, 10.0, vec![first]).expect("one segment");
    let path = CameraPath::new(trajectory, &scenario.camera.mount).expect("a mount");
    let sequence = Sequence {
        vignette: vignette.map(Arc::new),
        ..Sequence::in_memory(scenario, path, snow_and_forest(), 300)
    };
    let exposures = ExposureTrack::new(&sequence).expect("a camera").map(|track| Arc::new(track) as _);
    Arc::new(Sequence { exposures, ..sequence })
}

fn track(sequence: &Sequence) -> ExposureTrack {
    ExposureTrack::new(sequence).expect("a camera").expect("automatic")
}

fn render(sequence: &Arc<Sequence>, frame: u64) -> RenderedFrame {
    let options = RenderOptions { tolerance_dn: 1.0, ..RenderOptions::default() };
    ReferenceRenderer::new(sequence.clone()).expect("a reference").render(frame, &options)
}

/// Mean luminance of a picture over the pixels that have a ray.
fn mean(frame: &RenderedFrame) -> f64 {
    let luminance =
        |rgba: &[f32]| f64::from(0.2126 * rgba[0] + 0.7152 * rgba[1] + 0.0722 * rgba[2]) * f64::from(rgba[3]);
    let pixels = frame.color_rgba().chunks_exact(4);
    let count: f64 = pixels.clone().map(|rgba| f64::from(rgba[3])).sum();
    pixels.map(luminance).sum::<f64>() / count
}

#[test]
fn the_meter_finds_the_mean_of_the_picture() {
    let mut wide = scenario(AutoExposureSpec::default());
    wide.camera.lens = LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.2, 0.03, 0.0, 0.0] };
    let ramp = GrayImage { size_px: [3, 3], values: [0.3, 0.6, 0.3, 0.6, 1.0, 0.6, 0.3, 0.6, 0.3].to_vec() };
    wide.camera.photometric.vignette_thresholds = [0.05, 1.0];
    let sky = {
        let mut scenario = scenario(AutoExposureSpec::default());
        scenario.camera.mount.angles_deg = [0.0, 5.0, 0.0];
        scenario
    };
    let cases = [(scenario(AutoExposureSpec::default()), None), (wide, Some(ramp)), (sky, None)];
    for (scenario, vignette) in cases {
        let sequence = sequence_of(scenario, vignette);
        let track = track(&sequence);
        for frame in [0, 75, 95, 150] {
            let (metered, rendered) = (track.level(frame), mean(&render(&sequence, frame)));
            // docs/theory/IMAGING.md has this figure.
            assert!((metered / rendered - 1.0).abs() < 0.02, "{frame}: {metered} {rendered}");
        }
    }
}

#[test]
fn the_meter_sees_what_an_image_sensor_counts() {
    let mut scenario = scenario(AutoExposureSpec { target: 0.3, ..AutoExposureSpec::default() });
    scenario.camera.sensor = Some(ImageSensorSpec {
        white_e: Some(20_000.0),
        full_well_e: Some(9000.0),
        gain_e_per_dn: Some(4.0),
        black_dn: 100.0,
        mosaic: Mosaic::Mono,
        ..ImageSensorSpec::default()
    });
    let sequence = sequence_of(scenario, None);
    let track = track(&sequence);
    for frame in [0, 90, 200] {
        let rendered = render(&sequence, frame);
        let raw = rendered.raw().expect("a raw picture");
        let found: f64 = raw.values.iter().map(|&dn| (f64::from(dn) - 100.0) / 3995.0).sum();
        let (found, metered) = (found / raw.values.len() as f64, track.level(frame));
        assert!((metered / found - 1.0).abs() < 0.02, "{frame}: {metered} {found}");
    }
    // In the forest there is more time, and then gain, and the picture is as bright as over the snow.
    let [snow, forest] = [0, 200].map(|frame| track.of(frame));
    assert!(forest.time_s == 0.02 && forest.gain > 1.5 && snow.gain == 1.0, "{snow:?} {forest:?}");
}

#[test]
fn from_snow_to_forest_the_exposure_settles_without_oscillation() {
    for (speed, delay) in [(0.2, 1), (0.5, 4), (1.0, 2)] {
        let track =
            track(&sequence_of(scenario(AutoExposureSpec { speed, delay, ..Default::default() }), None));
        let light: Vec<f64> = (0..240).map(|frame| track.of(frame).light).collect();
        // Texture that passes by changes the mean by 1 % or so.
        assert!(light.windows(2).all(|pair| pair[1] > 0.97 * pair[0]), "{speed} {delay}: {light:?}");
        let level = |frame: u64| track.level(frame);
        assert!([0, 5, 200, 239].iter().all(|&f| (level(f) / 0.18 - 1.0).abs() < 0.04), "{speed} {delay}");
        assert!(light[239] > 15.0 * light[0]);
    }
}

#[test]
fn an_exposure_is_a_function_of_the_frame_alone() {
    let spec = AutoExposureSpec { delay: 3, start: ExposureStart::Nominal, ..AutoExposureSpec::default() };
    let sequence = sequence_of(scenario(spec), None);
    let frames = track(&sequence);
    let in_order: Vec<_> = (0..290).map(|frame| frames.of(frame)).collect();
    assert!((in_order[0].time_s, in_order[0].gain) == (4e-3, 1.0) && in_order[2] == in_order[0]);
    assert_ne!(in_order[3], in_order[0]);
    let anew = || sequence_of(sequence.scenario.clone(), None);
    assert_eq!(track(&anew()).of(289), in_order[289]);
    let at_once = track(&anew());
    let shuffled: Vec<_> = (0..290_u64).into_par_iter().map(|i| at_once.of(i * 97 % 290)).collect();
    assert!((0..290).all(|i| shuffled[i] == in_order[i * 97 % 290]));
    // Twins and faces are exposed as the frames are.
    let twin =
        crate::scenario::TwinSpec { name: "sharp".into(), exposure: Some(false), ..Default::default() };
    let twin = sequence.twin(&twin, None).expect("a twin");
    assert!(twin.exposure(200) == Some(in_order[200]) && twin.blurred_s(200) == 0.0);
    assert_eq!(sequence.blurred_s(200), in_order[200].time_s);
}

#[test]
fn the_window_and_its_weights_choose_what_counts() {
    let level = |spec: AutoExposureSpec| {
        let sequence =
            sequence_of(scenario(AutoExposureSpec { start: ExposureStart::Nominal, ..spec }), None);
        // The border between snow and forest is in the middle of this picture; the aircraft flies upwards in it.
        track(&sequence).level(80)
    };
    let fixed = AutoExposureSpec { exposure_ms: [4.0, 4.0], gain: [1.0, 1.0], ..AutoExposureSpec::default() };
    let part = |window| level(AutoExposureSpec { window, ..fixed.clone() });
    let (ahead, behind) = (part([0.0, 0.0, 1.0, 0.1]), part([0.0, 0.9, 1.0, 1.0]));
    assert!((ahead - 0.03).abs() < 0.004 && (behind - 0.8).abs() < 0.01, "{ahead} {behind}");
    let [even, centre] = [crate::scenario::MeterWeights::Even, crate::scenario::MeterWeights::Centre]
        .map(|weights| level(AutoExposureSpec { weights, ..fixed.clone() }));
    assert!((even - centre).abs() > 1e-3 && (0.1..0.8).contains(&centre), "{even} {centre}");
}
