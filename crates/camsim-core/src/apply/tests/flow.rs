//! Flow instead of camera motion.

use super::*;

pub(super) fn of(size_px: [u32; 2], interval_s: f64, flow: impl Fn(DVec2) -> DVec2) -> Motion {
    let pixel =
        |i: u32| flow(DVec2::new(f64::from(i % size_px[0]), f64::from(i / size_px[0]))).as_vec2().to_array();
    Motion::Flow(FlowField { size_px, px: (0..size_px[0] * size_px[1]).map(pixel).collect(), interval_s })
}

/// A camera that flies sideways over a tilted plane moves every pixel uniformly along a straight line, so
/// flow describes its motion exactly.
#[test]
fn flow_of_a_flight_gives_the_sources_of_its_poses() {
    let spec = CameraSpec {
        lens: LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.28, 0.07, 1e-3, -5e-4] },
        ..camera(
            [160, 120],
            110.0,
            ShutterSpec { readout_ms: 33.0, exposure_ms: 8.0, delay_ms: 7.0, ..ShutterSpec::default() },
        )
    };
    let ideal = frame([400, 320], 130.0, tilted_plane);
    let flight = Motion::Twist(Twist { velocity_m_s: DVec3::new(6.0, -4.0, 0.0), ..Twist::default() });
    for interval_s in [0.04, -0.1] {
        let geometry = ideal.geometry;
        let flow = of([400, 320], interval_s, |position_px| {
            let uv = (position_px - geometry.principal_px) / geometry.focal_px;
            let point = uv.extend(1.0) / TILTED.dot(uv.extend(1.0));
            geometry.px_from_point(point - interval_s * DVec3::new(6.0, -4.0, 0.0)) - position_px
        });
        let pipeline = Pipeline::new(&spec, &ideal, &flow, &Settings::default()).unwrap();
        let error = worst(&pipeline, |uv, dt_s| on_plane(uv, flight.key_from(dt_s, 0.0), &geometry));
        // f32 flow of up to 2 px: 1e-7 of it.
        assert!(error < 1e-6, "{interval_s}: {error}");
        let [flown, flowed] = [&flight, &flow].map(|motion| {
            Pipeline::new(&spec, &ideal, motion, &Settings::default()).unwrap().render(None).into_color()
        });
        assert!(flown.iter().zip(&flowed).all(|(a, b)| (a - b).abs() < 1e-6));
    }
}

/// An accelerated image motion, here a rotation about the optical axis, stays within the documented bound.
#[test]
fn flow_error_of_rotation_is_within_its_bound() {
    let spec = camera([120, 120], 100.0, ShutterSpec { readout_ms: 40.0, ..ShutterSpec::default() });
    // The ideal frame is at the instant of the first row.
    let ideal = IdealFrame { instant_s: -0.02, ..frame([200, 200], 100.0, |_| (0.0, [0.5; 3])) };
    let rate = 2.0;
    let turn = Motion::Twist(Twist { rate_rad_s: DVec3::new(0.0, 0.0, rate), ..Twist::default() });
    let centre = ideal.geometry.principal_px;
    let flow = of([200, 200], 0.04, |position_px| {
        DVec2::from_angle(-rate * 0.04).rotate(position_px - centre) + centre - position_px
    });
    let pipeline = Pipeline::new(&spec, &ideal, &flow, &Settings::default()).unwrap();
    let at_most = |uv: DVec2| 100.0 * uv.length() * rate * rate / 2.0 * 0.02 * 0.02;
    let mut farthest = 0.0_f64;
    for pixel in [[0, 0], [0, 30], [110, 60], [60, 60], [20, 119]] {
        let uv = pipeline.camera.unproject(DVec2::new(f64::from(pixel[0]), f64::from(pixel[1]))).unwrap();
        let dt_s = pipeline.shutter.dt_pixel_s(pixel[0], pixel[1]);
        let (rotation, _) = turn.key_from(dt_s, -0.02);
        let error = pipeline
            .source(pixel, 0.0)
            .unwrap()
            .position_px
            .distance(ideal.geometry.px_from_point(rotation * uv.extend(1.0)));
        // The flow's own shortening of the path is of the next order: one percent.
        assert!(error <= 1.01 * at_most(uv) + 1e-6, "{pixel:?}: {error} {}", at_most(uv));
        farthest = farthest.max(error);
    }
    assert!(farthest > 0.02, "{farthest}");
}

const BOX_PX: [f64; 2] = [80.0, 110.0];

/// A red square moves 10 px to the right in front of a blue background, which is at rest or moves by `back`
/// px.
fn moving_box(with_depth: bool, back: f64) -> (IdealFrame, Motion) {
    let inside = |x: f64| (BOX_PX[0]..BOX_PX[1]).contains(&x);
    let ideal = frame([200, 60], 100.0, |uv| {
        let x = (uv.x * 100.0 + 99.5).round();
        let w = if inside(x) { 0.2 } else { 0.05 };
        (if with_depth { w } else { 0.0 }, if inside(x) { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] })
    });
    (
        ideal,
        of([200, 60], 0.1, move |position_px| {
            DVec2::new(if inside(position_px.x) { 10.0 } else { back }, 0.0)
        }),
    )
}

#[test]
fn moving_objects_occlude_and_disocclude_the_background() {
    // Rows from 0 to 100 ms: each has its own instant of the interval.
    let spec = camera([200, 60], 100.0, ShutterSpec { readout_ms: 100.0, ..ShutterSpec::default() });
    for (with_depth, back) in [(true, 0.0), (false, 0.0), (true, -4.0), (false, -4.0)] {
        let (mut ideal, motion) = moving_box(with_depth, back);
        ideal.instant_s = -0.05;
        let pipeline = Pipeline::new(&spec, &ideal, &motion, &Settings::default()).unwrap();
        let (rendered, counts) = pipeline.render_and_count(None);
        let (mut bared, mut on_box) = (0, 0);
        for y in 0..60 {
            let fraction = pipeline.shutter.dt_pixel_s(0, y) / 0.1 + 0.5;
            for x in 0..200_u32 {
                let now = [0, 1].map(|k: usize| BOX_PX[k] - 0.5 + 10.0 * fraction - f64::from(x));
                // The spline taps reach two pixels, in the output and in the ideal frame (disoccluded areas
                // have the colour of one pixel). A source exactly at the border of the image may count as on
                // either side.
                let at_rim = (f64::from(x) - fraction * back - 199.5).abs() < 1e-6;
                let was = f64::from(x) - fraction * back;
                let covered = now[0] < 0.0 && now[1] > 0.0;
                let is_bared = !covered && (BOX_PX[0] - 0.5..BOX_PX[1] - 0.5).contains(&was);
                let is_mixed =
                    !covered && !is_bared && BOX_PX.iter().any(|border| (border - 0.5 - was).abs() < 2.6);
                if at_rim || is_mixed || now.iter().any(|border| border.abs() < 2.6) {
                    continue;
                }
                let pixel = &rendered.color_rgba()[4 * (y * 200 + x) as usize..][..4];
                // Content that enters from beyond the border is not in the frame.
                let beyond = !covered && f64::from(x) - fraction * back > 199.5;
                let expected = if covered { [1.0, 0.0, 0.0, 1.0] } else { [0.0, 0.0, 1.0, 1.0] };
                let expected = if beyond { [0.0; 4] } else { expected };
                assert!(
                    pixel.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6),
                    "{with_depth} {back}, {x} {y}: {pixel:?}"
                );
                on_box += u32::from(covered);
                bared += u32::from(is_bared);
            }
        }
        assert!(bared > 100 && on_box > 1000, "{bared} {on_box}");
        assert_eq!(counts.outside > 0, back < 0.0);
    }
}

#[test]
fn moving_objects_are_blurred_and_static_ones_are_not() {
    // An exposure over the whole interval: the borders of the square become ramps of 10 px, from -5 to 5
    // around the stamp.
    let spec = camera([200, 60], 100.0, ShutterSpec { exposure_ms: 100.0, ..ShutterSpec::default() });
    let (ideal, motion) = moving_box(true, 0.0);
    let rendered = Pipeline::new(&spec, &ideal, &motion, &Settings::default()).unwrap().render(None);
    for x in 0..200_u32 {
        let red = f64::from(rendered.color_rgba()[4 * (30 * 200 + x) as usize]);
        let ramp = |border: f64| (0.5 + (f64::from(x) - border + 0.5) / 10.0).clamp(0.0, 1.0);
        let expected = ramp(BOX_PX[0]) - ramp(BOX_PX[1]);
        // Two samples per pixel of path, and a border pixel that reads both sides.
        assert!((red - expected).abs() < 0.08, "{x}: {red} {expected}");
    }
}

#[test]
fn unknown_flow_is_empty_and_mismatched_flow_is_refused() {
    let spec = camera([60, 20], 50.0, ShutterSpec::default());
    let ideal = frame([120, 40], 50.0, |_| (0.1, [0.5; 3]));
    let motion =
        of(
            [120, 40],
            0.1,
            |position_px| if (55.0..65.0).contains(&position_px.x) { DVec2::NAN } else { DVec2::ZERO },
        );
    let (rendered, counts) =
        Pipeline::new(&spec, &ideal, &motion, &Settings::default()).unwrap().render_and_count(None);
    assert_eq!(counts, NoSourceCounts { unknown_flow: 10 * 20, ..NoSourceCounts::default() });
    let alpha: Vec<f32> = (24..36).map(|x| rendered.color_rgba()[4 * (60 * 7 + x) + 3]).collect();
    assert_eq!(alpha, [1., 0., 0., 0., 0., 0., 0., 0., 0., 0., 0., 1.]);
    let nowhere = of([120, 40], 0.1, |_| DVec2::NAN);
    let counts =
        Pipeline::new(&spec, &ideal, &nowhere, &Settings::default()).unwrap().render_and_count(None).1;
    assert_eq!(counts, NoSourceCounts { unknown_flow: 60 * 20, ..NoSourceCounts::default() });
    let error = |motion: &Motion, settings: &Settings| {
        Pipeline::new(&spec, &ideal, motion, settings).unwrap_err().to_string()
    };
    assert!(
        error(&of([60, 20], 0.1, |_| DVec2::ZERO), &Settings::default())
            .contains("60x20 pixels and an image of 120x40")
    );
    assert!(error(&of([120, 40], 0.0, |_| DVec2::ZERO), &Settings::default()).contains("over 0 s"));
    for settings in [solver(Solver::Rk2), Settings { preset: Preset::Paper, ..Settings::default() }] {
        assert!(error(&motion, &settings).contains("leave --preset and --solver out"));
    }
}
