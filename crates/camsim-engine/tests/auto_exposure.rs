//! Frames whose exposure follows the pictures before them: the same by every renderer and in any order.

mod common;

use std::{convert::Infallible, sync::Arc};

use camsim_core::{
    auto_exposure::ExposureTrack,
    frame::RenderedFrame,
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{AutoExposureSpec, Channel, ImageSensorSpec, Mosaic},
    scene::{Encoding, Mesh, Scene, Texture},
    sequence::Sequence,
};
use camsim_engine::{Engine, Finished};
use camsim_plan::Backend;
use common::{engine, render, rolling, scenario, sequence, steady};
use glam::DVec3;

/// Smooth ground, bright in the south and dark in the north.
fn ground() -> Scene {
    const SIDE: u32 = 256;
    let texel = |i: u32| {
        let [x, y] =
            [i % SIDE, i / SIDE].map(|k| std::f64::consts::TAU * 6.0 * f64::from(k) / f64::from(SIDE));
        // Rows run from north to south.
        let fraction = (f64::from(i / SIDE) / f64::from(SIDE) - 0.5) * 40.0;
        let level = (0.06 + 0.64 / (1.0 + (-fraction).exp())) * (1.0 + 0.3 * x.sin() * y.cos());
        [(255.0 * level).round() as u8; 3]
    };
    let rgba8 = (0..SIDE * SIDE).flat_map(|i| {
        let [r, g, b] = texel(i);
        [r, g, b, 255]
    });
    let texture = Texture { size_px: [SIDE; 2], rgba8: rgba8.collect(), encoding: Encoding::Linear };
    Scene { meshes: vec![Mesh::level_picture(Arc::new(texture), DVec3::ZERO, 1600.0)], ..Scene::default() }
}

/// Northwards from bright to dark ground.
fn flight(sensor: Option<ImageSensorSpec>) -> Arc<Sequence> {
    let mut scenario = scenario();
    scenario.camera.size_px = [96, 72];
    scenario.camera.focal_px = [90.0, 90.0];
    scenario.camera.fps = 25.0;
    scenario.camera.mount.angles_deg = [0.0, -90.0, 0.0];
    scenario.camera.shutter = rolling(10.0, 8.0);
    scenario.camera.sensor = sensor;
    scenario.camera.auto_exposure =
        Some(AutoExposureSpec { target: 0.25, speed: 0.5, exposure_ms: [0.5, 38.0], ..Default::default() });
    let sequence = sequence(scenario, steady(150.0, 0.0, DVec3::new(60.0, 0.0, 0.0), DVec3::ZERO), ground());
    let exposures = ExposureTrack::new(&sequence).expect("a camera").map(|track| Arc::new(track) as _);
    Arc::new(Sequence { exposures, ..Sequence::clone(&sequence) })
}

fn sensor() -> ImageSensorSpec {
    ImageSensorSpec {
        white_e: Some(9000.0),
        gain_e_per_dn: Some(2.0),
        read_noise_e: Some(3.0),
        mosaic: Mosaic::Mono,
        ..ImageSensorSpec::default()
    }
}

fn finished(sequence: &Arc<Sequence>, frames: impl IntoIterator<Item = u64>) -> Vec<Finished> {
    let engine = Engine::cpu();
    let mut session = engine.session::<Infallible>(sequence.clone(), &[Channel::Color]).expect("session");
    let mut all = Vec::new();
    let mut keep = |finished| {
        all.push(finished);
        Ok(())
    };
    session.render::<Infallible>(frames, &mut keep).expect("render");
    all
}

fn rms(a: &RenderedFrame, b: &RenderedFrame) -> f64 {
    let squares = a.color_rgba().iter().zip(b.color_rgba()).map(|(a, b)| f64::from(a - b).powi(2));
    (squares.sum::<f64>() / a.color_rgba().len() as f64).sqrt()
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn every_renderer_exposes_a_frame_as_the_reference_does() {
    let sequence = flight(None);
    let reference = ReferenceRenderer::new(sequence.clone()).expect("a reference");
    let options = RenderOptions { tolerance_dn: 0.2, ..RenderOptions::default() };
    let mut times_s = Vec::new();
    for frame in [0, 40, 95] {
        let exact = reference.render(frame, &options);
        for backend in [Backend::Cpu, Backend::GpuThenCpu, Backend::Gpu] {
            let mut engine = engine();
            engine.set_backend(backend);
            let found = render(&engine, &sequence, &[Channel::Color], frame);
            let exposure = found.plan.exposure.expect("automatic");
            assert_eq!(Some(exposure), sequence.exposure(frame));
            assert_eq!(found.plan.shutter.exposure_s(), exposure.time_s);
            times_s.push(exposure.time_s);
            // `quality.max_error_dn`, and the reference's own noise.
            let error = rms(&found.frame, &exact) * 255.0;
            assert!(error < 1.0, "{frame} {backend:?}: {error}");
            let mean: f64 = found.frame.color_rgba().chunks_exact(4).map(|p| f64::from(p[1])).sum();
            let mean = mean / (96.0 * 72.0);
            assert!((mean / 0.25 - 1.0).abs() < 0.1, "{frame}: {mean}");
        }
    }
    assert!(times_s[6] > 3.0 * times_s[0], "{times_s:?}");
}

#[test]
fn a_frame_by_itself_is_the_frame_of_a_run() {
    for sensor in [None, Some(sensor())] {
        let run = finished(&flight(sensor.clone()), 20..44);
        let fractions = run.iter().filter(|one| one.plan.shared_frames.is_some()).count();
        assert!(fractions > 8, "frames of different exposures share ideal frames: {fractions}");
        let times: Vec<f64> = run.iter().map(|one| one.plan.shutter.exposure_s()).collect();
        assert!(times.windows(2).all(|pair| pair[0] != pair[1]), "{times:?}");
        for k in [0, 13, 23] {
            let alone = finished(&flight(sensor.clone()), [20 + k as u64]);
            let (alone, run) = (&alone[0].frame, &run[k].frame);
            assert!(alone.color_rgba() == run.color_rgba() && alone.raw() == run.raw(), "{k}");
        }
    }
}

#[test]
fn gain_and_time_make_the_numbers_of_the_sensor() {
    let sequence = flight(Some(sensor()));
    for one in finished(&sequence, [0, 95]) {
        let raw = one.frame.raw().expect("a raw picture");
        let mean = raw.values.iter().map(|&dn| f64::from(dn) / 4095.0).sum::<f64>() / raw.values.len() as f64;
        assert!((mean / 0.25 - 1.0).abs() < 0.1, "{mean}");
    }
}
