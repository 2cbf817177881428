//! Cameras whose colours have a lens each, whose light falls to the corners, and that show a circle.

#![allow(clippy::print_stdout, reason = "the figures are documented")]

mod common;

use std::sync::Arc;

use camsim_core::{
    camera::CameraModel,
    frame::RenderedFrame,
    noise::tail_table,
    photometric::{Photometry, photometric},
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{
        Channel, ChromaticSpec, Face, ImageCircleSpec, LensModel, LensSpec, MountSpec, OutputEncoding,
        Primary, PrimaryLensSpec, Scenario, VignettingSpec,
    },
    scene::{Encoding, Mesh, Scene, Texture},
    sequence::Sequence,
};
use camsim_engine::{Backend, Engine};
use common::{
    barrel_lens, city, engine,
    gallery::{hills, noise},
    pattern, render, rolling, scenario, sequence, steady,
};
use glam::{DVec2, DVec3};

const FRAME: u64 = 2;

/// Some three pixels in the corner of a picture of 160x120.
fn fringes() -> Option<ChromaticSpec> {
    Some(ChromaticSpec {
        red_scale: vec![1.012, -0.002, 0.006],
        blue_scale: vec![0.99, 0.0, -0.004],
        ..ChromaticSpec::default()
    })
}

/// A camera that moves and turns over a city.
fn over_city(edit: impl FnOnce(&mut Scenario)) -> Arc<Sequence> {
    let mut scenario = scenario();
    scenario.camera.size_px = [160, 120];
    scenario.camera.focal_px = [110.0; 2];
    scenario.camera.lens = barrel_lens();
    scenario.camera.mount = MountSpec { angles_deg: [2.0, -50.0, 5.0], ..MountSpec::default() };
    scenario.camera.shutter = rolling(30.0, 8.0);
    edit(&mut scenario);
    let flight = steady(150.0, 10.0, DVec3::new(20.0, 5.0, 1.0), DVec3::new(0.1, -0.2, 0.3));
    sequence(scenario, flight, city(6))
}

fn reference(sequence: &Arc<Sequence>) -> RenderedFrame {
    let options = RenderOptions { min_samples: 64, max_samples: 256, ..RenderOptions::default() };
    ReferenceRenderer::new(sequence.clone()).expect("a reference").render(FRAME, &options)
}

/// PSNR of each colour over the pixels that are valid in both, dB, and the number of those valid in one alone.
fn psnr_db(a: &RenderedFrame, b: &RenderedFrame) -> ([f64; 3], usize) {
    let pixels = || a.color_rgba().chunks_exact(4).zip(b.color_rgba().chunks_exact(4));
    let both = || pixels().filter(|(a, b)| a[3] > 0.0 && b[3] > 0.0);
    let count = both().count() as f64;
    let psnr = |k: usize| {
        let squares: f64 = both().map(|(a, b)| f64::from(a[k] - b[k]).powi(2)).sum();
        -10.0 * (squares / count).log10()
    };
    ([0, 1, 2].map(psnr), pixels().filter(|(a, b)| (a[3] > 0.0) != (b[3] > 0.0)).count())
}

#[test]
fn chromatic_pictures_are_those_of_the_reference() {
    let engine = Engine::cpu();
    let [plain, chromatic] = [None, fringes()].map(|fringes| over_city(|s| s.camera.chromatic = fringes));
    let channels = [Channel::Color, Channel::Depth];
    let done = render(&engine, &chromatic, &channels, FRAME);
    let (with, differ) = psnr_db(&done.frame, &reference(&chromatic));
    let (without, _) = psnr_db(&render(&engine, &plain, &channels, FRAME).frame, &reference(&plain));
    println!("{with:.1?} dB with fringes, {without:.1?} without, {differ} pixels valid in one alone");
    assert!(differ <= 3, "{differ}");
    let predicted_dn = done.plan.predicted.picture_dn();
    for (primary, db) in Primary::ALL.into_iter().zip(with) {
        let error_dn = 255.0 * 10.0_f64.powf(-db / 20.0);
        println!("{}: {error_dn:.2}/255 of {predicted_dn:.2} predicted", primary.name());
        assert!(db > 48.0 && error_dn <= predicted_dn, "{db} dB");
    }
    // It is not the picture of one lens.
    let (apart, _) = psnr_db(&done.frame, &reference(&plain));
    assert!(apart[0] < 35.0 && apart[2] < 35.0 && apart[1] > 47.0, "{apart:?}");
    // Truth is that of green's rays.
    let depth = |sequence| {
        render(&engine, sequence, &channels, FRAME).frame.into_floats(Channel::Depth).expect("depth")
    };
    let off = depth(&plain).iter().zip(depth(&chromatic)).filter(|(a, b)| (*a - b).abs() > 1e-4 * *a).count();
    assert!(off < 20, "{off} depths differ");
}

#[test]
fn a_lens_of_its_own_is_that_of_a_camera_with_it() {
    let engine = Engine::cpu();
    let red = PrimaryLensSpec {
        coefficients: Some(vec![-0.27, 0.08, 0.002, -0.001]),
        focal_px: Some([111.0, 110.5]),
        principal_point_px: Some([79.0, 60.5]),
        model: None,
    };
    let chromatic = over_city(|s| {
        s.camera.chromatic = Some(ChromaticSpec { red: Some(red.clone()), ..ChromaticSpec::default() });
    });
    let alone = over_city(|s| {
        s.camera.lens.coefficients = red.coefficients.clone().expect("given");
        s.camera.focal_px = red.focal_px.expect("given");
        s.camera.principal_point_px = red.principal_point_px;
    });
    let frame = render(&engine, &chromatic, &[Channel::Color], FRAME).frame;
    let [red_db, _, _] = psnr_db(&frame, &reference(&alone)).0;
    let [_, green_db, blue_db] = psnr_db(&frame, &reference(&over_city(|_| {}))).0;
    assert!(red_db > 47.0 && green_db > 47.0 && blue_db > 47.0, "{red_db} {green_db} {blue_db}");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn both_renderers_make_the_same_fringes() {
    let sequence = over_city(|s| {
        s.camera.chromatic = fringes();
        s.camera.photometric.noise_sigma = 0.02;
        s.camera.photometric.vignetting =
            Some(VignettingSpec { cos_power: 4.0, ..VignettingSpec::default() });
    });
    let channels = [Channel::Color, Channel::Depth];
    let mut on_gpu = engine();
    on_gpu.set_backend(Backend::Gpu);
    let [cpu, gpu] = [Engine::cpu(), on_gpu].map(|engine| render(&engine, &sequence, &channels, FRAME).frame);
    let (psnr, differ) = psnr_db(&cpu, &gpu);
    println!("cpu against gpu: {psnr:.1?} dB");
    assert!(differ <= 3 && psnr.into_iter().all(|db| db > 50.0), "{psnr:?}, {differ}");
}

/// Values of dark and bright stripes: filters may overshoot them without being cut off.
const DARK: f64 = 51.0 / 255.0;
const BRIGHT: f64 = 204.0 / 255.0;

/// Dark and bright stripes across east on level ground, 8 m wide. Their edges are soft, six pixels wide, so that sums
/// over pixels are as exact as integrals.
fn stripes() -> Scene {
    const SIDE: u32 = 1024;
    let level = |x: u32| {
        let position = (f64::from(x) + 0.5) / 64.0;
        let edge = position.round();
        let rise =
            0.5 + 0.5 * (std::f64::consts::FRAC_PI_2 * ((position - edge) * 12.8).clamp(-1.0, 1.0)).sin();
        let bright = if edge % 2.0 == 1.0 { rise } else { 1.0 - rise };
        (255.0 * (DARK + (BRIGHT - DARK) * bright)).round() as u8
    };
    let rgba8 = (0..SIDE * SIDE).flat_map(|i| [level(i % SIDE), level(i % SIDE), level(i % SIDE), 255]);
    let texture = Texture { size_px: [SIDE; 2], rgba8: rgba8.collect(), encoding: Encoding::Linear };
    Scene { meshes: vec![Mesh::level_picture(Arc::new(texture), DVec3::ZERO, 128.0)], ..Scene::default() }
}

/// Position of an edge between dark (0) and bright (1) within some pixels of a row, by the light left and right of it.
fn edge_px(values: &[f64], first: usize) -> f64 {
    let rises = values[values.len() - 1] > values[0];
    let dark: f64 = values.iter().map(|value| if rises { 1.0 - value } else { *value }).sum();
    first as f64 - 0.5 + dark
}

#[test]
fn fringes_are_as_wide_as_the_lenses_say() {
    let mut scenario = scenario();
    // Resampled finely enough that edges are measured, and not the filters.
    scenario.quality.max_error_dn = 0.1;
    let camera = &mut scenario.camera;
    camera.size_px = [320, 240];
    camera.focal_px = [200.0; 2];
    camera.lens = LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.1, 0.02] };
    camera.mount = MountSpec { angles_deg: [0.0, -90.0, 0.0], ..MountSpec::default() };
    camera.chromatic = fringes();
    let sequence = sequence(scenario, steady(40.0, 0.0, DVec3::ZERO, DVec3::ZERO), stripes());
    let spec = &sequence.scenario.camera;
    let [green, red, blue] =
        Primary::ALL.map(|primary| CameraModel::from_spec(&spec.of_primary(primary)).expect("a camera"));
    let frame = render(&Engine::cpu(), &sequence, &[Channel::Color], 0).frame;
    let value = |x: usize, y: usize, k: usize| {
        (f64::from(frame.color_rgba()[4 * (320 * y + x) + k]) - DARK) / (BRIGHT - DARK)
    };
    let (mut worst, mut widest, mut edges) = (0.0_f64, 0.0_f64, 0);
    for y in (4..236).step_by(8) {
        for x in 16..303 {
            if (value(x, y, 1) > 0.5) == (value(x + 1, y, 1) > 0.5) {
                continue;
            }
            let position = |k: usize| {
                let values: Vec<f64> = (x - 12..x + 14).map(|x| value(x, y, k)).collect();
                edge_px(&values, x - 12)
            };
            let row = y as f64;
            let Some(near) = green.unproject(DVec2::new(position(1), row)) else { continue };
            // Edges are 8 m apart, 40 m below.
            let u = 0.2 * (near.x / 0.2).round();
            for (camera, k) in [&red, &green, &blue].into_iter().zip([0, 1, 2]) {
                // Where this lens shows the edge in this row.
                let mut ideal = DVec2::new(u, near.y);
                for _ in 0..20 {
                    ideal.y -= (camera.project(ideal).y - row) / 200.0;
                }
                let expected = camera.project(ideal).x;
                let error = position(k) - expected;
                worst = worst.max(error.abs());
                widest = widest.max((expected - position(1)).abs());
                edges += 1;
            }
        }
    }
    println!("{edges} edges: off by at most {worst:.4} px, fringes of up to {widest:.2} px");
    assert!(edges > 300 && widest > 2.0, "{edges} edges, {widest} px");
    assert!(worst < 0.02, "{worst} px");
}

#[test]
fn colors_of_a_wide_field_have_borders_of_faces_of_their_own() {
    const SIDE_PX: u32 = 200;
    let mut scenario = scenario();
    let camera = &mut scenario.camera;
    camera.size_px = [SIDE_PX; 2];
    camera.focal_px = [99.5 / 110_f64.to_radians(); 2];
    camera.lens = LensSpec { model: LensModel::KannalaBrandt, coefficients: vec![0.0; 4] };
    camera.mount.angles_deg = [0.0, -60.0, 0.0];
    camera.shutter = rolling(20.0, 6.0);
    camera.chromatic = Some(ChromaticSpec {
        red_scale: vec![1.01],
        blue_scale: vec![0.985, 0.0, 0.004],
        ..ChromaticSpec::default()
    });
    camera.image_circle = Some(ImageCircleSpec { radius_px: Some(99.0), ..ImageCircleSpec::default() });
    let path = steady(30.0, 30.0, DVec3::new(8.0, 2.0, 0.0), DVec3::new(0.1, -0.2, 0.3));
    let texture = noise([64, 64], |_| 255, Encoding::Srgb);
    let scene = Scene { terrain: Some(hills(0.6, texture)), ..Scene::default() };
    let sequence = sequence(scenario, path, scene);
    let frame = render(&Engine::cpu(), &sequence, &[Channel::Color], FRAME).frame;
    let options = RenderOptions { tolerance_dn: 0.25, ..RenderOptions::default() };
    let parts = Face::ALL.into_iter().flat_map(|face| Primary::ALL.map(|primary| (face, primary)));
    let mut squares = [0.0; 3];
    let mut counts = [0_u32; 3];
    for (face, primary) in parts {
        let part = Arc::new(sequence.face(face).primary(primary));
        let exact = ReferenceRenderer::new(part).expect("a reference").render(FRAME, &options);
        let k = primary.channel();
        for (got, wanted) in frame.color_rgba().chunks_exact(4).zip(exact.color_rgba().chunks_exact(4)) {
            if wanted[3] > 0.0 && got[3] > 0.0 {
                squares[k] += f64::from(got[k] - wanted[k]).powi(2);
                counts[k] += 1;
            }
        }
    }
    let psnr = [0, 1, 2].map(|k| -10.0 * (squares[k] / f64::from(counts[k])).log10());
    println!("{psnr:.1?} dB over {counts:?} pixels");
    let valid = frame.color_rgba().chunks_exact(4).filter(|rgba| rgba[3] > 0.0).count() as f64;
    assert!(
        (valid / (std::f64::consts::PI * 99.0 * 99.0) - 1.0).abs() < 0.002,
        "{valid} pixels in the circle"
    );
    // No pixel of a colour is missing, or of two faces.
    assert!(counts.iter().all(|&count| f64::from(count) == valid), "{counts:?} of {valid}");
    assert!(psnr.into_iter().all(|db| db > 45.0), "{psnr:?}");
}

#[test]
fn luminance_and_colored_gains_are_those_of_all_colors() {
    let engine = Engine::cpu();
    let light = |edit: fn(&mut Scenario)| {
        let sequence = over_city(|s| {
            s.camera.chromatic = fringes();
            edit(s);
        });
        (render(&engine, &sequence, &[Channel::Color], FRAME).frame, sequence)
    };
    let (plain, _) = light(|_| {});
    let (grey, grey_of) = light(|s| {
        s.camera.photometric.output = OutputEncoding::Luma8;
        s.camera.photometric.noise_sigma = 0.03;
        s.camera.photometric.light = 0.9;
    });
    let (colored, colored_of) = light(|s| {
        s.camera.photometric.vignetting = Some(VignettingSpec {
            polynomial: vec![-0.3],
            polynomial_red: Some(vec![-0.4, 0.1]),
            ..VignettingSpec::default()
        });
    });
    let table = tail_table();
    let (seed, number) = (grey_of.noise_seed(), FRAME as u32);
    let mut squares = [0.0; 2];
    for (i, pixel) in (0..160 * 120).map(|i| (i as usize, [i % 160, i / 160])) {
        let [plain, grey, colored] =
            [&plain, &grey, &colored].map(|frame| &frame.color_rgba()[4 * i..4 * i + 4]);
        let rgb = [plain[0], plain[1], plain[2]];
        let stage = Photometry::whole(&grey_of.scenario.camera, None);
        let expected = photometric(&stage, rgb, 1.0, pixel, number, seed, &table);
        let [x, y] = pixel.map(f64::from);
        let r2 = ((x - 79.5).powi(2) + (y - 59.5).powi(2)) / (0.25 * (160.0 * 160.0 + 120.0 * 120.0));
        let gains = [1.0 - 0.4 * r2 + 0.1 * r2 * r2, 1.0 - 0.3 * r2, 1.0 - 0.3 * r2];
        for k in 0..3 {
            squares[0] += f64::from(grey[k] - expected[k]).powi(2);
            squares[1] += (f64::from(colored[k]) - f64::from(plain[k]) * gains[k]).powi(2);
        }
    }
    // Plans depend on how much light counts, and pictures differ within their tolerance of 1/255.
    let rms = squares.map(|sum: f64| (sum / (3.0 * 160.0 * 120.0)).sqrt());
    assert!(rms.into_iter().all(|rms| rms < 1.0 / 255.0), "{rms:?}");
    let exact = [reference(&grey_of), reference(&colored_of)];
    for (got, exact) in [grey, colored].iter().zip(&exact) {
        let (psnr, _) = psnr_db(got, exact);
        assert!(psnr.into_iter().all(|db| db > 47.0), "{psnr:?}");
    }
}

#[test]
fn light_falls_as_the_model_says_in_all_renderers() {
    let with = |edit: fn(&mut Scenario)| {
        let mut scenario = scenario();
        scenario.camera.size_px = [96, 72];
        scenario.camera.focal_px = [60.0; 2];
        scenario.camera.mount = MountSpec { angles_deg: [0.0, -90.0, 0.0], ..MountSpec::default() };
        edit(&mut scenario);
        sequence(scenario, steady(40.0, 0.0, DVec3::ZERO, DVec3::ZERO), pattern(200.0))
    };
    let (plain, falling) = (
        with(|_| {}),
        with(|s| {
            s.camera.photometric.vignetting =
                Some(VignettingSpec { cos_power: 4.0, polynomial: vec![-0.2], ..VignettingSpec::default() });
        }),
    );
    let engine = Engine::cpu();
    let [plain, falling_frame] =
        [&plain, &falling].map(|sequence| render(&engine, sequence, &[Channel::Color], FRAME).frame);
    for (i, (plain, got)) in
        plain.color_rgba().chunks_exact(4).zip(falling_frame.color_rgba().chunks_exact(4)).enumerate()
    {
        let (x, y) = ((i % 96) as f64 - 47.5, (i / 96) as f64 - 35.5);
        // Half of the diagonal is as long as the focal length.
        let r2 = (x * x + y * y) / 3600.0;
        let weight = (1.0 + r2).powi(-2) * (1.0 - 0.2 * r2);
        for k in 0..3 {
            assert!((f64::from(got[k]) - weight * f64::from(plain[k])).abs() < 2e-3, "{x}, {y}");
        }
    }
    let (psnr, _) = psnr_db(&falling_frame, &reference(&falling));
    assert!(psnr.into_iter().all(|db| db > 48.0), "{psnr:?}");
}
