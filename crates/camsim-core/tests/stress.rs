//! Adversarial cases of gather and temporal inverse: f64 twins against integrals and rays in closed form. The
//! resulting table is in docs/accuracy/stress.md.

#![allow(clippy::unwrap_used)]

use camsim_core::temporal::PathStage;
use camsim_core::{
    apply::{IdealFrame, Motion, Pipeline, Settings},
    camera::CameraModel,
    scenario::{CameraSpec, ShutterSpec, Solver},
    shutter::Shutter,
    temporal::{
        ColorImage, Footprint, IdealGeometry, InverseDepthImage, Kernel, KeyDepth, displacement::Twist,
        gather, reproject,
    },
};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// Alternating black and white texels.
fn checker(size_px: [u32; 2]) -> Vec<f32> {
    let value = |i: u32| ((i % size_px[0] + i / size_px[0]) % 2) as f32;
    (0..size_px[0] * size_px[1]).flat_map(|i| [value(i), value(i), value(i), 1.0]).collect()
}

const POINT: Footprint =
    Footprint { dx: DVec2::X, dy: DVec2::Y, taps: [1, 1], kernel: Kernel::Spline(DVec2::ZERO) };

/// Difference, in DN, between camsim's samples and 8000 along the same straight path: RMS and largest over
/// positions and directions.
fn blur_error(color: &ColorImage<'_>, length_px: f64) -> (f64, f64) {
    let (mut square, mut worst, mut count) = (0.0, 0.0_f64, 0.0);
    for direction in 0..12 {
        let half = DVec2::from_angle(f64::from(direction) * 0.53) * (0.5 * length_px);
        for k in 0..40 {
            let centre = DVec2::new(128.0, 128.0)
                + DVec2::new((f64::from(k) * 0.618).fract(), (f64::from(k) * 0.37).fract());
            let undistorted =
                gather(&[centre - half, centre + half], PathStage::Straight, &POINT, color, 2.0, 1024).x;
            let exact = (0..8000)
                .map(|i| color.spline(centre + half * ((f64::from(i) + 0.5) / 4e3 - 1.0), DVec2::ZERO).x)
                .sum::<f64>()
                / 8e3;
            let error = 255.0 * (undistorted - exact).abs();
            square += error * error;
            worst = worst.max(error);
            count += 1.0;
        }
    }
    ((square / count).sqrt(), worst)
}

#[test]
fn a_checker_at_nyquist_is_blurred_to_its_mean() {
    let rgba = checker([256, 256]);
    let color = ColorImage { size_px: [256, 256], rgba: &rgba };
    for length_px in [4.0, 8.3, 16.0, 33.7, 64.0, 200.0] {
        let (rms, worst) = blur_error(&color, length_px);
        eprintln!("checker of one texel, {length_px} px: rms {rms:.2}, max {worst:.2} of 255");
        // The rule min(2 L, L + 16) is for 1/255 RMS; a checkerboard is its worst case.
        assert!(rms < 2.0, "{length_px}: {rms}");
    }
}

#[test]
fn without_a_path_there_is_no_blur() {
    let rgba = checker([16, 16]);
    let color = ColorImage { size_px: [16, 16], rgba: &rgba };
    for at in [DVec2::new(7.0, 5.0), DVec2::new(7.3, 5.9), DVec2::new(-0.5, 15.5)] {
        let sharp = gather(&[at], PathStage::Straight, &POINT, &color, 2.0, 256);
        assert_eq!(sharp, color.spline(at, DVec2::ZERO));
        for (nodes, path) in [(2, PathStage::Straight), (3, PathStage::Parabola), (65, PathStage::Quartic)] {
            assert!((gather(&vec![at; nodes], path, &POINT, &color, 2.0, 256) - sharp).length() < 1e-12);
        }
    }
}

fn level(size_px: [u32; 2], focal: f64, look: impl Fn(DVec2) -> (f64, f32) + Sync) -> IdealFrame {
    let geometry = IdealGeometry {
        size_px,
        focal_px: DVec2::splat(focal),
        principal_px: DVec2::new(f64::from(size_px[0]) * 0.5 - 0.5, f64::from(size_px[1]) * 0.5 - 0.5),
    };
    let looks: Vec<(f64, f32)> = (0..size_px[0] * size_px[1])
        .into_par_iter()
        .map(|i| {
            look(
                (DVec2::new(f64::from(i % size_px[0]), f64::from(i / size_px[0])) - geometry.principal_px)
                    / geometry.focal_px,
            )
        })
        .collect();
    IdealFrame {
        geometry,
        color_rgba: looks.iter().flat_map(|(_, v)| [*v, *v, *v, 1.0]).collect(),
        inverse_depth: looks.iter().map(|(w, _)| *w as f32).collect(),
        holes: Vec::new(),
        instant_s: 0.0,
    }
}

#[test]
fn path_longer_than_the_image() {
    let shutter = ShutterSpec { exposure_ms: 100.0, ..ShutterSpec::default() };
    let spec = CameraSpec { size_px: [60, 20], focal_px: [50.0, 50.0], shutter, ..CameraSpec::default() };
    let wave = |uv: DVec2| (0.1, (0.5 + 0.4 * (uv.x * 9.0).sin()) as f32);
    let motion = Motion::Twist(Twist { velocity_m_s: DVec3::new(300.0, 0.0, 0.0), ..Twist::default() });
    // 150 px over the exposure in an image of 60 px: solved if the ideal frame is wide enough ...
    let wide = level([260, 40], 50.0, wave);
    let rendered = Pipeline::new(&spec, &wide, &motion, &Settings::default()).unwrap().render(None);
    for x in [0_u32, 31, 59] {
        let u = (f64::from(x) - 29.5) / 50.0;
        // Mean of the wave over 3 units of u.
        let expected = 0.5 + 0.4 * (9.0 * u).sin() * 13.5_f64.sin() / 13.5;
        let value = f64::from(rendered.color_rgba()[4 * (10 * 60 + x) as usize]);
        // A bilinear read of a wave with a period of 35 px loses (2 pi / 35)^2 / 12 of its amplitude: 3e-3 of
        // 0.03.
        assert!((value - expected).abs() < 3e-4, "{x}: {value} {expected}");
    }
    // ... and without a source, and without a panic, in an ideal frame of the same size.
    let narrow = level([60, 20], 50.0, wave);
    let rendered = Pipeline::new(&spec, &narrow, &motion, &Settings::default()).unwrap().render(None);
    assert!(rendered.color_rgba().iter().all(|v| *v == 0.0));
}

/// Boxes on level ground 100 m below a camera that looks straight down, in camera axes (x right, y down, z
/// forward).
struct Town;

impl Town {
    const GROUND_M: f64 = 100.0;

    /// Boxes of half width 6 m, 20 m apart, 10 to 45 m high.
    fn boxes() -> impl Iterator<Item = (DVec3, DVec3)> {
        (-6..=6).flat_map(|i| {
            (-5..=5).map(move |j| {
                let centre = DVec2::new(20.0 * f64::from(i) + 3.0, 20.0 * f64::from(j) - 2.0);
                let height = 10.0 + 35.0 * (f64::from(i * 7 + j * 13) * 0.618).rem_euclid(1.0);
                let half = DVec2::splat(6.0);
                ((centre - half).extend(Self::GROUND_M - height), (centre + half).extend(Self::GROUND_M))
            })
        })
    }

    /// First intersection of `origin + t direction`, t > 0.
    fn cast(origin: DVec3, direction: DVec3) -> f64 {
        let mut nearest = (Self::GROUND_M - origin.z) / direction.z;
        for (low, high) in Self::boxes() {
            let (a, b) = ((low - origin) / direction, (high - origin) / direction);
            let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
            if enter < leave && enter > 0.0 && enter < nearest {
                nearest = enter;
            }
        }
        nearest
    }
}

#[test]
fn a_second_of_rolling_shutter_over_buildings() {
    let readout = ShutterSpec { readout_ms: 1000.0, ..ShutterSpec::default() };
    let spec = CameraSpec {
        size_px: [240, 180],
        focal_px: [180.0, 180.0],
        shutter: readout.clone(),
        ..CameraSpec::default()
    };
    let ideal = level([400, 300], 180.0, |uv| (1.0 / Town::cast(DVec3::ZERO, uv.extend(1.0)), 0.5));
    let twist = Twist { velocity_m_s: DVec3::new(20.0, 4.0, 0.0), rate_rad_s: DVec3::new(0.0, 0.0, 0.05) };
    let motion = Motion::Twist(twist);
    let camera = CameraModel::from_spec(&spec).unwrap();
    let shutter = Shutter::from_spec(&readout, 30.0, spec.size_px).unwrap();
    let depth = InverseDepthImage { size_px: ideal.geometry.size_px, values: &ideal.inverse_depth };
    let key = KeyDepth { ideal: &ideal.geometry, depth: &depth, plane: DVec3::ZERO, sky_reach_px: 0.0 };
    let pipelines = [Solver::Linear, Solver::Rk2, Solver::Reproject].map(|solver| {
        Pipeline::new(&spec, &ideal, &motion, &Settings { solver: Some(solver), ..Settings::default() })
            .unwrap()
    });
    let mut errors: [Vec<f64>; 4] = Default::default();
    let mut hidden = 0;
    for (x, y) in (0..180).flat_map(|y| (0..240).map(move |x| (x, y))) {
        let uv = camera.unproject(DVec2::new(f64::from(x), f64::from(y))).unwrap();
        let (rotation, shift) = motion.key_from(shutter.dt_pixel_s(x, y), 0.0);
        let hit = shift + rotation * uv.extend(1.0) * Town::cast(shift, rotation * uv.extend(1.0));
        if Town::cast(DVec3::ZERO, hit) < 1.0 - 1e-9 {
            hidden += 1;
            continue;
        }
        let exact = ideal.geometry.px_from_point(hit);
        let two_looks = reproject(uv, (rotation, shift), 2, &key);
        let sources = pipelines.iter().map(|pipeline| pipeline.source([x, y], 0.0).ok()).chain([two_looks]);
        for (errors, sources) in errors.iter_mut().zip(sources) {
            errors.push(sources.unwrap().position_px.distance(exact));
        }
    }
    let [linear, rk2, own, two_looks] = errors.map(|mut errors| {
        errors.sort_by(f64::total_cmp);
        let over = errors.iter().filter(|e| **e > 1.0).count() as f64 / errors.len() as f64;
        let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        (
            rms,
            errors[errors.len() / 2],
            errors[errors.len() * 95 / 100],
            errors[errors.len() * 99 / 100],
            over,
        )
    });
    for (name, (rms, p50, p95, p99, over)) in
        [("linear", linear), ("rk2", rk2), ("two look-ups", two_looks), ("apply", own)]
    {
        eprintln!(
            "1 s over buildings, {name}: rms {rms:.3}, p50 {p50:.1e}, p95 {p95:.1e}, p99 {p99:.3} px, {:.2} % over 1 px ({hidden} hidden)",
            100.0 * over
        );
    }
    assert!(hidden > 500, "{hidden}");
    // An edge in the texels is up to half a texel from that of the building, so one ray in a hundred may take
    // the adjacent surface.
    assert!(own.2 < 0.05 && own.4 < 0.015, "{own:?}");
    assert!(rk2.4 > 5.0 * own.4 && two_looks.4 > 1.5 * own.4, "{rk2:?} {two_looks:?}");
}
