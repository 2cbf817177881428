//! The result does not depend on the interval of the flow; strong motion in closed form.

use super::flow::of;
use super::*;
use crate::apply::NoSource;

const SIZE: [u32; 2] = [140, 100];
const IDEAL: [u32; 2] = [200, 150];

/// 30 ms of readout: each row has its own instant.
fn rolling(delay_ms: f64) -> CameraSpec {
    camera(SIZE, 300.0, ShutterSpec { readout_ms: 30.0, delay_ms, ..ShutterSpec::default() })
}

/// Largest source error, in pixels, for an image that moves by `x += dt / T a x` about its centre with the
/// flow given over `T / part`; and the number of sources.
fn worst_of_linear(a: DMat2, part: f64, delay_ms: f64) -> (f64, u32) {
    let spec = rolling(delay_ms);
    let ideal = frame(IDEAL, 300.0, |_| (0.1, [0.5; 3]));
    let centre = ideal.geometry.principal_px;
    let motion = of(IDEAL, 0.033 / part, |position_px| a * (position_px - centre) / part);
    let pipeline = Pipeline::new(&spec, &ideal, &motion, &Settings::default()).unwrap();
    let (mut worst, mut count) = (0.0_f64, 0);
    for y in 0..SIZE[1] {
        let forward = DMat2::IDENTITY + a * (pipeline.shutter.dt_pixel_s(0, y) / 0.033);
        for x in 0..SIZE[0] {
            let centred_px = DVec2::new(f64::from(x), f64::from(y)) - DVec2::new(69.5, 49.5);
            let truth_px = forward.inverse() * centred_px + centre;
            if ideal.geometry.contains(truth_px) {
                worst = worst.max(
                    pipeline
                        .source([x, y], 0.0)
                        .map_or(f64::INFINITY, |source| source.position_px.distance(truth_px)),
                );
                count += 1;
            }
        }
    }
    (worst, count)
}

fn roll(degrees: f64) -> DMat2 {
    DMat2::from_angle(degrees.to_radians()) - DMat2::IDENTITY
}

fn zoom(times: f64) -> DMat2 {
    DMat2::IDENTITY * (times - 1.0)
}

#[test]
fn smooth_fields_are_not_torn_for_any_interval() {
    let rolls = [20.0, 24.0, 25.0, 30.0, 45.0, 60.0].map(|degrees| (roll(degrees), 0.0));
    let zooms = [1.2, 1.49, 1.51, 2.0].map(|times| (zoom(times), 10.0));
    let shear = (DMat2::from_cols_array(&[0.0, 0.0, 1.0, 0.0]), 0.0);
    for (a, delay_ms) in rolls.into_iter().chain(zooms).chain([shear]) {
        for part in [1.0, 3.0, 33.0] {
            let (worst_px, count) = worst_of_linear(a, part, delay_ms);
            // f32 flow of up to 100 px is rounded to 4e-6; the inversion amplifies that by up to 5.
            assert!(worst_px < 1e-4 && count > 5000, "{a} over T / {part}: {worst_px} {count}");
        }
    }
}

/// The iteration `s <- p - tau f(s)` does not converge here: its slope is above 1.
#[test]
fn strong_rotation_is_inverted_where_it_is_regular() {
    for degrees in [60.0, 90.0] {
        for part in [1.0, 3.0] {
            let (worst_px, count) = worst_of_linear(roll(degrees), part, 30.0);
            assert!(worst_px < 1e-4 && count > 5000, "{degrees} over T / {part}: {worst_px} {count}");
        }
    }
}

const BOX_FROM: DVec2 = DVec2::new(60.0, 50.0);
const BOX_TO: DVec2 = DVec2::new(110.0, 90.0);

/// Signed distance into the box in the ideal frame; negative outside.
fn into_box(position_px: DVec2) -> f64 {
    (position_px - (BOX_FROM - 0.5)).min(BOX_TO - 0.5 - position_px).min_element()
}

#[test]
fn borders_of_moving_objects_do_not_depend_on_the_interval() {
    let ideal = IdealFrame {
        instant_s: 0.0,
        ..frame(IDEAL, 300.0, |uv| {
            let position_px = (uv * 300.0 + DVec2::new(99.5, 74.5)).round();
            (if into_box(position_px) > 0.0 { 0.2 } else { 0.1 }, [0.5; 3])
        })
    };
    for px_per_ms in [0.3, 0.45, 0.49, 0.51, 0.7, -0.49] {
        for delay_ms in [0.0, 30.0] {
            let spec = rolling(delay_ms);
            let velocity = DVec2::new(px_per_ms, 0.6 * px_per_ms);
            let (mut of_first, mut all) = (Vec::new(), 0);
            for interval_ms in [33.0, 11.0, 1.0] {
                let motion = of(IDEAL, 1e-3 * interval_ms, |position_px| {
                    if into_box(position_px) > 0.0 { velocity * interval_ms } else { DVec2::ZERO }
                });
                let pipeline = Pipeline::new(&spec, &ideal, &motion, &Settings::default()).unwrap();
                let mut sources = Vec::new();
                for y in 0..SIZE[1] {
                    let moved_px = velocity * 1e3 * pipeline.shutter.dt_pixel_s(0, y);
                    for x in 0..SIZE[0] {
                        let ideal_px = DVec2::new(f64::from(x), f64::from(y)) + DVec2::new(30.0, 25.0);
                        let source = pipeline.source([x, y], 0.0).unwrap();
                        sources.push(source.position_px);
                        let inside = into_box(ideal_px - moved_px);
                        let is_bared = inside < 0.0 && into_box(ideal_px) > 0.0;
                        if inside.abs() <= 0.5 || is_bared {
                            continue;
                        }
                        let label = format!(
                            "{px_per_ms} px/ms over {interval_ms} ms, {delay_ms} ms, {x} {y}: {source:?}"
                        );
                        assert!(
                            (source.inverse_depth - if inside > 0.0 { 0.2 } else { 0.1 }).abs() < 1e-6,
                            "{label}"
                        );
                        // A boundary that has moved by less than half a pixel is no boundary: the field is
                        // stretched or compressed between two pixels there.
                        if inside.abs() > 1.0 && into_box(ideal_px).abs() > 1.0 {
                            let truth_px = if inside > 0.0 { ideal_px - moved_px } else { ideal_px };
                            assert!(source.position_px.distance(truth_px) < 1e-4, "{label} {truth_px}");
                            all += 1;
                        }
                    }
                }
                if of_first.is_empty() {
                    of_first.clone_from(&sources);
                }
                let apart = of_first.iter().zip(&sources).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
                assert!(
                    apart < 1e-4,
                    "{px_per_ms} px/ms over {interval_ms} ms: {apart} px from that over 33 ms"
                );
            }
            assert!(all > 30_000, "{all}");
        }
    }
}

/// Noise in which every pixel moves on its own is not inverted. Such pixels are counted, and the search stays
/// within its limit.
#[test]
fn incoherent_flow_is_empty_and_counted() {
    let ideal = frame([220, 200], 300.0, |_| (0.1, [0.5; 3]));
    let noise = |position_px: DVec2, k: f64| {
        ((position_px.dot(DVec2::new(12.9898, 78.233)) + k).sin() * 43_758.547).fract() * 500.0
    };
    let motion =
        of([220, 200], 0.033, |position_px| DVec2::new(noise(position_px, 0.0), noise(position_px, 1.0)));
    let spec = camera([20, 20], 300.0, ShutterSpec { delay_ms: 33.0, ..ShutterSpec::default() });
    let pipeline = Pipeline::new(&spec, &ideal, &motion, &Settings::default()).unwrap();
    assert_eq!(pipeline.source([10, 10], 0.0), Err(NoSource::TornFlow));
    assert_eq!(
        pipeline.render_and_count(None).1,
        NoSourceCounts { torn_flow: 400, ..NoSourceCounts::default() }
    );
}

/// Zero flow gives the result of no motion, to the last bit, with holes as well.
#[test]
fn zero_flow_equals_no_motion_with_holes() {
    let spec = CameraSpec {
        lens: LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.28, 0.07, 1e-3, -5e-4] },
        ..camera(SIZE, 240.0, ShutterSpec { readout_ms: 30.0, exposure_ms: 10.0, ..ShutterSpec::default() })
    };
    let mut ideal = frame(IDEAL, 300.0, |uv| {
        (if uv.x > 0.1 { 0.2 } else { 0.1 }, [(40.0 * uv.x).sin().abs() as f32, uv.y.abs() as f32, 0.3])
    });
    ideal.holes = (0..IDEAL[0] * IDEAL[1]).map(|i| i % 7 == 0 && i % IDEAL[0] > 90).collect();
    ideal.inverse_depth.iter_mut().zip(&ideal.holes).filter(|(_, hole)| **hole).for_each(|(w, _)| *w = 0.0);
    let motions = [Motion::Twist(Twist::default()), of(IDEAL, 0.033, |_| DVec2::ZERO)];
    let [still, flowed] = motions.map(|motion| {
        Pipeline::new(&spec, &ideal, &motion, &Settings::default()).unwrap().render_and_count(None)
    });
    assert!(still.1.holes > 500, "{:?}", still.1);
    assert_eq!(
        (still.1, still.0.color_rgba(), still.0.depth_m()),
        (flowed.1, flowed.0.color_rgba(), flowed.0.depth_m())
    );
    // A hole moves with the object that contains it.
    let motion = of(IDEAL, 0.033, |_| DVec2::new(12.0, -5.0));
    let late = rolling(33.0);
    let pipeline = Pipeline::new(&late, &ideal, &motion, &Settings::default()).unwrap();
    for [x, y] in [[90, 50], [91, 50], [92, 50], [93, 50], [94, 50], [95, 50], [96, 50]] {
        let truth_px = DVec2::new(f64::from(x), f64::from(y)) + DVec2::new(30.0, 25.0)
            - DVec2::new(12.0, -5.0) * (pipeline.shutter.dt_pixel_s(x, y) / 0.033);
        let nearest_px = truth_px.round();
        let is_hole = ideal.holes[(nearest_px.y as u32 * IDEAL[0] + nearest_px.x as u32) as usize];
        assert_eq!(pipeline.source([x, y], 0.0).is_err(), is_hole, "{x} {y}: {truth_px}");
    }
}
