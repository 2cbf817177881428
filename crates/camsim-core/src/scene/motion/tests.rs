#![allow(clippy::unwrap_used, reason = "tests")]

use std::f64::consts::TAU;

use super::*;

/// A car on a bent path, or a table of poses with two kinds of curves.
fn carriers() -> Vec<Track> {
    let points = [[0.0, 0.0, 0.0], [10.0, 2.0, -1.0], [14.0, 9.0, 0.5], [5.0, 20.0, 2.0]].map(DVec3::from);
    let times_s = vec![0.0, 0.8, 1.7, 3.1];
    let turns =
        [0.0, 0.7, 2.9, -2.0].map(|yaw| DQuat::from_rotation_z(yaw) * DQuat::from_rotation_y(0.3 * yaw));
    let turn = |between| Curve::new(times_s.clone(), turns.to_vec(), between).unwrap();
    let rates = vec![DQuat::from_xyzw(0.1, -0.2, 0.3, 0.05); 4];
    let cubic = Between::Cubic { arriving: rates.clone(), leaving: rates };
    let smooth = Curve::smooth(times_s.clone(), points.to_vec()).unwrap();
    let straight = Curve::new(times_s.clone(), points.to_vec(), Between::Linear).unwrap();
    let keys = |position: &Curve<DVec3>, rotation, repeat| {
        Track::Keys(Keys { position: position.clone(), rotation, start_s: 0.35, repeat })
    };
    let again = |always| Some(Repeat { from_s: 0.0, period_s: 3.1, always });
    vec![
        keys(&smooth, turn(Between::Linear), None),
        keys(&straight, turn(Between::Step), again(false)),
        keys(&smooth, turn(cubic), again(true)),
        Track::Spin { axis: DVec3::new(0.6, 0.0, 0.8), hz: 1.3, phase_rad: 0.4 },
    ]
}

/// A wheel in mirrored, scaled axes on each carrier.
fn motions() -> Vec<RigidMotion> {
    let wheel = Track::Spin { axis: DVec3::new(0.0, 0.6, -0.8), hz: 2.7, phase_rad: 1.1 };
    let axes = DMat3::from_rotation_x(0.4) * DMat3::from_diagonal(DVec3::new(-2.0, 2.0, 2.0));
    let frame = DAffine3 { matrix3: axes, translation: DVec3::new(3.0, -1.0, 0.5) };
    let frame = JointFrame::from_affine(&frame).unwrap();
    let still = RigidMotion::new(Vec::new());
    let with_wheel = carriers().into_iter().map(|carrier| {
        RigidMotion::new(vec![Joint::new(JointFrame::IDENTITY, carrier), Joint::new(frame, wheel.clone())])
    });
    with_wheel.chain([still]).collect()
}

/// Instants without a key of the carriers around them.
fn instants() -> impl Iterator<Item = f64> {
    (0..60).map(|i| -1.0 + 0.1 * f64::from(i) + 0.0131)
}

const POINT: DVec3 = DVec3::new(4.0, -2.5, 1.5);

#[test]
fn everything_is_at_its_position_at_time_zero() {
    for motion in motions() {
        assert!(motion.state(0.0).point(POINT).distance(POINT) < 1e-12);
    }
}

#[test]
fn rates_are_the_derivatives_of_positions() {
    let h = 1e-5;
    for (i, motion) in motions().iter().enumerate() {
        for t_s in instants() {
            let state = motion.state(t_s);
            let [before, after] = [motion.state(t_s - h), motion.state(t_s + h)];
            let velocity = (after.point(POINT) - before.point(POINT)) / (2.0 * h);
            let now = state.point(POINT);
            // Central differences of turns of 17 rad/s: h^2 times the third derivative, 5e3 times metres.
            assert!(state.velocity(now).distance(velocity) < 2e-5, "{i} {t_s}: {velocity}");
            let turn = (after.rotation * before.rotation.conjugate()).to_scaled_axis() / (2.0 * h);
            assert!(state.rate_rad_s.distance(turn) < 2e-5, "{i} {t_s}: {turn}");
            assert!(state.point_at_start(now).distance(POINT) < 1e-12);
        }
    }
}

#[test]
fn boxes_hold_what_moves() {
    let corners = [DVec3::new(-1.0, -2.0, -0.5), DVec3::new(2.0, 1.0, 3.0)];
    let bounds = Aabb { min: corners[0], max: corners[1] };
    for (i, motion) in motions().iter().enumerate() {
        for (t_s, length_s) in instants().flat_map(|t_s| [(t_s, 0.0), (t_s, 0.02), (t_s, 0.4), (t_s, 9.0)]) {
            let moved = motion.bounds(&bounds, t_s, t_s + length_s);
            for k in 0..=100 {
                let state = motion.state(t_s + length_s * f64::from(k) / 100.0);
                for corner in 0..8 {
                    let side = |axis: usize| corners[corner >> axis & 1][axis];
                    let at = state.point(DVec3::new(side(0), side(1), side(2)));
                    let is_inside =
                        (at - moved.min).min_element().min((moved.max - at).min_element()) > -1e-9;
                    assert!(is_inside, "{i} {t_s} {length_s} {k}: {at} {moved:?}");
                }
            }
            // Of a standing box, twice its size at most.
            let size = (moved.max - moved.min).max_element();
            assert!(length_s > 0.0 || size < 2.0 * bounds.min.distance(bounds.max), "{i} {t_s}: {size}");
        }
    }
}

#[test]
fn a_wheel_on_a_car_follows_its_closed_form() {
    // The car drives east at 6 m/s and turns right at 0.5 rad/s about its own origin; the wheel turns about
    // the car's y axis, 2 m ahead.
    let turned = DQuat::from_rotation_z(2.0);
    let keys = Keys {
        position: Curve::new(vec![0.0, 4.0], vec![DVec3::ZERO, DVec3::Y * 24.0], Between::Linear).unwrap(),
        rotation: Curve::new(vec![0.0, 4.0], vec![DQuat::IDENTITY, turned], Between::Linear).unwrap(),
        start_s: 0.0,
        repeat: None,
    };
    let hub = JointFrame::from_affine(&DAffine3::from_translation(DVec3::X * 2.0)).unwrap();
    let wheel = Track::Spin { axis: DVec3::Y, hz: 3.0, phase_rad: 0.7 };
    let motion =
        RigidMotion::new(vec![Joint::new(JointFrame::IDENTITY, Track::Keys(keys)), Joint::new(hub, wheel)]);
    for t_s in [0.0, 0.9, 2.2, 3.999] {
        let rim = DQuat::from_rotation_y(TAU * 3.0 * t_s) * DVec3::new(0.0, 0.1, 0.4);
        let expected = DVec3::Y * (6.0 * t_s) + DQuat::from_rotation_z(0.5 * t_s) * (DVec3::X * 2.0 + rim);
        let found = motion.state(t_s).point(DVec3::new(2.0, 0.1, 0.4));
        assert!(found.distance(expected) < 1e-12, "{t_s}: {found} {expected}");
    }
}

#[test]
fn smooth_curves_keep_parabolas_and_lines() {
    let parabola = |t_s: f64| DVec3::new(3.0 - 2.0 * t_s + 0.5 * t_s * t_s, 4.0 * t_s, 1.0);
    let times_s = vec![0.0, 0.7, 1.0, 2.5, 2.9];
    let points = times_s.iter().map(|&t_s| parabola(t_s)).collect();
    let curve = Curve::smooth(times_s, points).unwrap();
    for k in 0..=29 {
        let t_s = 0.1 * f64::from(k);
        assert!(curve.at(t_s).0.distance(parabola(t_s)) < 1e-12, "{t_s}");
    }
    let two = Curve::smooth(vec![1.0, 3.0], vec![DVec3::ZERO, DVec3::X]).unwrap();
    assert!(two.at(1.5).0.distance(DVec3::X * 0.25) < 1e-15);
    assert_eq!((two.at(-4.0), two.at(9.0)), ((DVec3::ZERO, DVec3::ZERO), (DVec3::X, DVec3::ZERO)));
}

#[test]
fn uneven_frames_and_disordered_keys_are_refused() {
    let stretched = DAffine3::from_scale(DVec3::new(1.0, 2.0, 1.0));
    assert_eq!(JointFrame::from_affine(&stretched), None);
    assert_eq!(Curve::new(vec![1.0, 0.0], vec![DVec3::ZERO; 2], Between::Linear), None);
    assert_eq!(Curve::smooth(vec![1.0, 1.0], vec![DVec3::ZERO; 2]), None);
    assert_eq!(Curve::<DVec3>::new(Vec::new(), Vec::new(), Between::Step), None);
}
