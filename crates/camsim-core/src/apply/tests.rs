#![allow(clippy::unwrap_used)]

use glam::{DMat2, DMat3};

use super::*;
use crate::lens::LensModel;
use crate::scenario::{FieldOr, LensSpec, PointSpreadSpec, ShutterSpec};
use crate::temporal::IdealGeometry;

mod flow;
mod flow_interval;

/// A frame whose pixels show inverse depth and linear colour as `look` returns them for a ray (u, v, 1).
fn frame(size_px: [u32; 2], focal: f64, look: impl Fn(DVec2) -> (f64, [f32; 3])) -> IdealFrame {
    let geometry = IdealGeometry {
        size_px,
        focal_px: DVec2::splat(focal),
        principal_px: DVec2::new(f64::from(size_px[0]) * 0.5 - 0.5, f64::from(size_px[1]) * 0.5 - 0.5),
    };
    let looks: Vec<_> = (0..size_px[0] * size_px[1])
        .map(|i| {
            look(
                (DVec2::new(f64::from(i % size_px[0]), f64::from(i / size_px[0])) - geometry.principal_px)
                    / geometry.focal_px,
            )
        })
        .collect();
    IdealFrame {
        geometry,
        color_rgba: looks.iter().flat_map(|(_, [r, g, b])| [*r, *g, *b, 1.0]).collect(),
        inverse_depth: looks.iter().map(|(w, _)| *w as f32).collect(),
        holes: Vec::new(),
        instant_s: 0.0,
    }
}

fn camera(size_px: [u32; 2], focal: f64, shutter: ShutterSpec) -> CameraSpec {
    CameraSpec { size_px, focal_px: [focal, focal], shutter, ..CameraSpec::default() }
}

fn solver(solver: Solver) -> Settings {
    Settings { solver: Some(solver), ..Settings::default() }
}

const TILTED: DVec3 = DVec3::new(0.004, -0.006, 0.02);

/// The plane `n . x = 1` in axes of the ideal camera has inverse depth `n . (u, v, 1)`.
fn tilted_plane(uv: DVec2) -> (f64, [f32; 3]) {
    (TILTED.dot(uv.extend(1.0)), [0.5; 3])
}

/// Source of a row's ray `uv` on that plane, by its homography: `z (n . R d) = 1 - n . t`.
fn on_plane(uv: DVec2, (rotation, shift): (DMat3, DVec3), geometry: &IdealGeometry) -> DVec2 {
    let d = rotation * uv.extend(1.0);
    geometry.px_from_point(d * (1.0 - TILTED.dot(shift)) / TILTED.dot(d) + shift)
}

/// Largest distance of the sources from the true ones, over a grid.
fn worst(pipeline: &Pipeline<'_>, truth: impl Fn(DVec2, f64) -> DVec2) -> f64 {
    let [width, height] = pipeline.camera.size_px;
    let mut worst = 0.0_f64;
    for y in (0..height).step_by(7) {
        for x in (0..width).step_by(7) {
            for phase in [-0.5, 0.0, 0.5] {
                let dt_s = pipeline.shutter.dt_pixel_s(x, y) + phase * pipeline.shutter.exposure_s();
                let uv = pipeline.camera.unproject(DVec2::new(f64::from(x), f64::from(y))).unwrap();
                worst =
                    worst.max(pipeline.source([x, y], phase).unwrap().position_px.distance(truth(uv, dt_s)));
            }
        }
    }
    worst
}

fn swing() -> Twist {
    Twist { velocity_m_s: DVec3::new(6.0, -4.0, 20.0), rate_rad_s: DVec3::new(0.4, -0.5, 0.8) }
}

#[test]
fn sources_on_a_plane_match_its_homography_and_solvers_are_ordered_by_error() {
    let spec = CameraSpec {
        lens: LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.28, 0.07, 1e-3, -5e-4] },
        ..camera(
            [160, 120],
            110.0,
            ShutterSpec {
                readout_ms: 33.0,
                exposure_ms: 8.0,
                interlace_ms: FieldOr::Ms(5.0),
                ..ShutterSpec::default()
            },
        )
    };
    let ideal = frame([400, 320], 130.0, tilted_plane);
    let motion = Motion::Twist(swing());
    let error = |which| {
        let pipeline = Pipeline::new(&spec, &ideal, &motion, &solver(which)).unwrap();
        worst(&pipeline, |uv, dt_s| on_plane(uv, motion.key_from(dt_s, 0.0), &ideal.geometry))
    };
    let [linear, rk2, exact] = [Solver::Linear, Solver::Rk2, Solver::Reproject].map(error);
    // f32 depth: 6e-8 of up to 3 px of parallax.
    assert!(exact < 1e-6, "{exact}");
    assert!(linear > 2.0 * rk2 && rk2 > 1e3 * exact, "{linear} {rk2} {exact}");
}

#[test]
fn no_motion_is_the_identity() {
    let spec =
        camera([97, 61], 75.5, ShutterSpec { readout_ms: 33.0, exposure_ms: 10.0, ..ShutterSpec::default() });
    let color = |uv: DVec2| [(uv.x * 40.0).sin().abs() as f32, (uv.y * 55.0).cos().abs() as f32, 0.25];
    let ideal = frame([97, 61], 75.5, |uv| (if uv.x > 0.1 { 0.2 } else { 0.0 }, color(uv)));
    let motion = Motion::Twist(Twist::default());
    for which in [Solver::Linear, Solver::Rk2, Solver::Reproject] {
        let pipeline = Pipeline::new(&spec, &ideal, &motion, &solver(which)).unwrap();
        for pixel in [[0, 0], [96, 60], [50, 31], [53, 7]] {
            let position_px = pipeline.source(pixel, 0.5).unwrap().position_px;
            assert!(
                position_px.distance(DVec2::new(f64::from(pixel[0]), f64::from(pixel[1]))) < 1e-10,
                "{which:?} {pixel:?} {position_px}"
            );
        }
        let rendered = pipeline.render(None);
        let worst = rendered
            .color_rgba()
            .iter()
            .zip(&ideal.color_rgba)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f32::max);
        assert!(worst < 1e-6, "{which:?}: {worst}");
        let depth_m = rendered.depth_m().unwrap();
        assert!(depth_m.iter().zip(&ideal.inverse_depth).all(|(z, w)| if *w == 0.0 {
            *z == 0.0
        } else {
            (z * w - 1.0).abs() < 1e-6
        }));
    }
}

/// A wall over half of the image at 10 m in front of a wall at 40 m. The camera moves sideways, so the near
/// edge covers or uncovers the far wall.
#[test]
fn rays_at_a_depth_edge_find_their_surface() {
    let edge_m = 0.7;
    let (near, far) = (1.0 / 10.0, 1.0 / 40.0);
    let ideal = frame([300, 200], 200.0, |uv| {
        if uv.x * 10.0 > edge_m { (near, [1.0, 0.0, 0.0]) } else { (far, [0.0, 0.0, 1.0]) }
    });
    let motion = Motion::Twist(Twist { velocity_m_s: DVec3::new(30.0, 0.0, 0.0), ..Twist::default() });
    // Each row is exposed at one instant: 33 ms of readout over 100 rows shift the near wall by up to 10 px,
    // the far one by 2.5 px.
    let spec = camera([200, 100], 200.0, ShutterSpec { readout_ms: 33.0, ..ShutterSpec::default() });
    let pipeline = Pipeline::new(&spec, &ideal, &motion, &Settings::default()).unwrap();
    let (mut wrong, mut all, mut unseen) = (0, 0, 0);
    for y in 0..100 {
        for x in 0..200 {
            let uv = pipeline.camera.unproject(DVec2::new(f64::from(x), f64::from(y))).unwrap();
            let shift_m = 30.0 * pipeline.shutter.dt_pixel_s(x, y);
            let on_near_m = uv.x / near + shift_m;
            let w = if on_near_m > edge_m { near } else { far };
            let truth_m = DVec3::new(uv.x / w + shift_m, uv.y / w, 1.0 / w);
            // The edge in the texels is up to half a texel from that of the wall: 0.025 m there.
            if (on_near_m - edge_m).abs() < 0.03 {
                continue;
            }
            all += 1;
            // Points that the near wall hid from the ideal camera are unknown.
            if w == far && truth_m.x / truth_m.z * 10.0 > edge_m {
                unseen += 1;
                continue;
            }
            let source = pipeline.source([x, y], 0.0).unwrap();
            let error_px = source.position_px.distance(ideal.geometry.px_from_point(truth_m));
            wrong += u32::from(error_px > 1e-4);
        }
    }
    assert!(unseen > 100 && all > 19_000, "the test must see edges: {unseen} of {all}");
    assert_eq!(wrong, 0, "of {all}");
}

#[test]
fn blur_is_the_mean_along_the_path() {
    let spec = camera([120, 90], 100.0, ShutterSpec { exposure_ms: 100.0, ..ShutterSpec::default() });
    // At 20 m and 40 m/s: 20 px over the exposure, linear in time, so the mean of a ramp is its value at the
    // middle.
    let ideal = frame([200, 150], 100.0, |uv| {
        (1.0 / 20.0, [(0.5 + 0.2 * uv.x) as f32, (0.5 + 0.3 * uv.y) as f32, 0.5])
    });
    let motion = Motion::Twist(Twist { velocity_m_s: DVec3::new(40.0, 10.0, 0.0), ..Twist::default() });
    let rendered = Pipeline::new(&spec, &ideal, &motion, &Settings::default()).unwrap().render(None);
    let paper = Settings { preset: Preset::Paper, blur_samples: Some(10), ..Settings::default() };
    let by_paper = Pipeline::new(&spec, &ideal, &motion, &paper).unwrap().render(None);
    for (x, y) in [(60_u32, 45_u32), (30, 20), (100, 80)] {
        let value = |frame: &RenderedFrame, channel: usize| {
            f64::from(frame.color_rgba()[4 * (y * 120 + x) as usize + channel])
        };
        let expected = 0.5 + 0.2 * (f64::from(x) - 59.5) / 100.0;
        assert!((value(&rendered, 0) - expected).abs() < 1e-5, "{} {expected}", value(&rendered, 0));
        // The paper's preset averages stored values: 10 samples of the encoded ramp, ends included.
        let samples: f64 = (0..10)
            .map(|i| f64::from(srgb_from_linear((expected + 0.2 * (f64::from(i) / 9.0 - 0.5) * 0.2) as f32)))
            .sum::<f64>()
            / 10.0;
        assert!((value(&by_paper, 0) - f64::from(linear_from_srgb(samples as f32))).abs() < 2e-5);
    }
}

#[test]
fn rotation_during_the_exposure_is_an_arc() {
    let spec = camera([161, 161], 100.0, ShutterSpec { exposure_ms: 1000.0, ..ShutterSpec::default() });
    let ideal = frame([301, 301], 100.0, |uv| (0.0, [(0.5 + 0.2 * uv.x) as f32, 0.0, 0.0]));
    let motion =
        Motion::Twist(Twist { rate_rad_s: DVec3::new(0.0, 0.0, 36_f64.to_radians()), ..Twist::default() });
    let pipeline = Pipeline::new(&spec, &ideal, &motion, &Settings::default()).unwrap();
    // The sagitta of 36 deg at 113 px is 5.6 px; the segments reduce it below 0.01 px.
    assert!(pipeline.nodes() >= 24, "{}", pipeline.nodes());
    let rendered = pipeline.render(None);
    let half = 18_f64.to_radians();
    for x in [10_u32, 80, 150] {
        let u = (f64::from(x) - 80.0) / 100.0;
        // Mean of u cos(phi) over the arc.
        let expected = 0.5 + 0.2 * u * half.sin() / half;
        let value = f64::from(rendered.color_rgba()[4 * (80 * 161 + x) as usize]);
        assert!((value - expected).abs() < 2e-5, "{x}: {value} {expected}");
    }
}

#[test]
fn linear_fog_needs_the_paper_preset() {
    let fog = paper::LinearFog { end_m: 100.0, color: DVec3::new(0.5, 0.6, 0.7) };
    assert_eq!(fog.over(DVec3::ZERO, DVec2::ZERO, 0.02), fog.color * 0.5);
    assert_eq!(fog.over(DVec3::ZERO, DVec2::ONE, 0.0), fog.color);
    let spec = camera([4, 3], 10.0, ShutterSpec::default());
    let ideal = frame([4, 3], 10.0, |_| (0.02, [0.0; 3]));
    let motion = Motion::Twist(Twist::default());
    let settings = Settings { fog: Some(fog), ..Settings::default() };
    assert!(matches!(Pipeline::new(&spec, &ideal, &motion, &settings), Err(ApplyError::Fog)));
    let spread = PointSpreadSpec { sigma_px: Some(1.0), ..PointSpreadSpec::default() };
    let blurred = CameraSpec { point_spread: Some(spread), ..spec.clone() };
    let paper = Settings { preset: Preset::Paper, ..Settings::default() };
    assert!(matches!(Pipeline::new(&blurred, &ideal, &motion, &paper), Err(ApplyError::PointSpread)));
    let rendered = Pipeline::new(&spec, &ideal, &motion, &Settings { preset: Preset::Paper, ..settings })
        .unwrap()
        .render(None);
    let slant = (1.0_f64 + 0.15 * 0.15 + 0.1 * 0.1).sqrt();
    assert!((f64::from(srgb_from_linear(rendered.color_rgba()[2])) - 0.7 * 0.5 * slant).abs() < 1e-6);
}

#[test]
fn invalid_frames_are_refused() {
    let spec = camera([4, 3], 10.0, ShutterSpec::default());
    let good = frame([4, 3], 10.0, |_| (0.1, [0.5; 3]));
    let motion = Motion::Twist(Twist::default());
    let error = |ideal: &IdealFrame, settings: &Settings| {
        Pipeline::new(&spec, ideal, &motion, settings).unwrap_err().to_string()
    };
    let mut bad = good.clone();
    bad.inverse_depth[3] = f32::NAN;
    assert!(error(&bad, &Settings::default()).contains("not finite"));
    bad.inverse_depth.pop();
    assert!(error(&bad, &Settings::default()).contains("same size"));
    assert!(
        error(&IdealFrame { color_rgba: vec![f32::INFINITY; 48], ..good.clone() }, &Settings::default())
            .contains("colours")
    );
    assert!(error(&good, &solver(Solver::Reference)).contains("reproject"));
    // A ray more than 90 deg from the axis of the ideal camera has no source and causes no panic.
    let about =
        Motion::Twist(Twist { rate_rad_s: DVec3::new(0.0, 300.0, 0.0), velocity_m_s: DVec3::splat(1e9) });
    let blurred =
        camera([4, 3], 10.0, ShutterSpec { readout_ms: 33.0, exposure_ms: 20.0, ..ShutterSpec::default() });
    for which in [Solver::Linear, Solver::Rk2, Solver::Reproject] {
        assert_eq!(
            Pipeline::new(&blurred, &good, &about, &solver(which)).unwrap().render(None).into_color(),
            [0.0; 48]
        );
    }
}

/// A far wall, a hole in the depth and a near wall side by side. Rays into the hole have no result, with
/// every solver, and are counted.
#[test]
fn rays_into_holes_are_empty_and_counted() {
    let spec = camera([60, 20], 50.0, ShutterSpec { exposure_ms: 10.0, ..ShutterSpec::default() });
    let mut ideal = frame([120, 40], 50.0, |uv| (if uv.x < 0.0 { 0.1 } else { 0.5 }, [0.5; 3]));
    // Columns 55..65: 5 of each wall.
    ideal.holes = (0..120 * 40).map(|i| (55..65).contains(&(i % 120))).collect();
    ideal.inverse_depth.iter_mut().zip(&ideal.holes).filter(|(_, hole)| **hole).for_each(|(w, _)| *w = 0.0);
    let still = Motion::Twist(Twist::default());
    for which in [Solver::Linear, Solver::Rk2, Solver::Reproject] {
        let pipeline = Pipeline::new(&spec, &ideal, &still, &solver(which)).unwrap();
        let (rendered, counts) = pipeline.render_and_count(None);
        assert_eq!(counts, NoSourceCounts { holes: 10 * 20, ..NoSourceCounts::default() }, "{which:?}");
        let alpha = |x: usize| rendered.color_rgba()[4 * (60 * 7 + x) + 3];
        assert_eq!(
            (24..36).map(alpha).collect::<Vec<_>>(),
            [1., 0., 0., 0., 0., 0., 0., 0., 0., 0., 0., 1.],
            "{which:?}"
        );
    }
    // 0.4 m to the right, 100 ms earlier: the far wall moves by 0.4 * 0.1 * 50 = 2 px, the near one by 10 px.
    // Rays that hit neither visible wall are empty, and none falls back to infinity.
    let motion = Motion::Twist(Twist { velocity_m_s: DVec3::new(-4.0, 0.0, 0.0), ..Twist::default() });
    let late = camera([60, 20], 50.0, ShutterSpec { delay_ms: 100.0, ..ShutterSpec::default() });
    let pipeline = Pipeline::new(&late, &ideal, &motion, &Settings::default()).unwrap();
    let mut counts = [0; 3];
    for x in 0..60 {
        // Position of the ray on either wall: 2 px to the right on the far one, 10 px on the near one.
        let (on_far, on_near) = (x + 30 + 2, x + 30 + 10);
        let expected = if on_near >= 65 {
            Some((on_near, 0.5))
        } else if on_far < 55 {
            Some((on_far, 0.1))
        } else {
            None
        };
        match (pipeline.source([x, 9], 0.0), expected) {
            (Ok(found), Some((at, w))) => {
                assert!(
                    (found.position_px.x - f64::from(at)).abs() < 1e-4
                        && (found.inverse_depth - w).abs() < 1e-6,
                    "{x}: {found:?}"
                );
                counts[if w > 0.2 { 0 } else { 1 }] += 1;
            }
            (Err(NoSource::Hole), None) => counts[2] += 1,
            other => panic!("{x}: {other:?}"),
        }
    }
    assert!(counts.iter().all(|&count| count > 0), "{counts:?}");
}
