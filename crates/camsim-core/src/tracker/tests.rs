#![allow(clippy::unwrap_used)]

use glam::DQuat;

use super::*;
use crate::scenario::Auto;

/// The log of the paper's test flight without its six corrupted rows; `None` without CAMSIM_DATA.
fn lawnmower() -> Option<Vec<LogRow>> {
    const CORRUPTED: [usize; 6] = [7190, 22762, 23060, 37732, 44551, 44849];
    let Some(data) = std::env::var_os("CAMSIM_DATA") else {
        eprintln!("CAMSIM_DATA is not set: real flight skipped");
        return None;
    };
    let text =
        std::fs::read_to_string(std::path::Path::new(&data).join("camsim/path_lawnmower.csv")).unwrap();
    let mut rows = Vec::new();
    let mut origin = None;
    for (i, line) in text.lines().enumerate() {
        let v: Vec<f64> = line.split(',').map(|field| field.trim().parse().unwrap()).collect();
        let (lat, lon) = (v[1].to_radians(), v[2].to_radians());
        let ecef = ecef(lat, lon, v[3]);
        let (lat0, lon0, ecef0, t0_s) = *origin.get_or_insert((lat, lon, ecef, v[0]));
        let d = ecef - ecef0;
        let (sp, cp, sl, cl) = (lat0.sin(), lat0.cos(), lon0.sin(), lon0.cos());
        let ned = DVec3::new(
            -sp * cl * d.x - sp * sl * d.y + cp * d.z,
            -sl * d.x + cl * d.y,
            -cp * cl * d.x - cp * sl * d.y - sp * d.z,
        );
        if !CORRUPTED.contains(&(i + 1)) {
            rows.push(LogRow {
                t_s: v[0] - t0_s,
                position_ned_m: ned,
                ned_from_body: attitude(v[4].to_radians(), v[5].to_radians(), v[6].to_radians()),
            });
        }
    }
    Some(rows)
}

fn ecef(lat: f64, lon: f64, height_m: f64) -> DVec3 {
    let (a, e2) = (6_378_137.0, 6.694_379_990_141_316_5e-3);
    let n = a / (1.0 - e2 * lat.sin().powi(2)).sqrt();
    DVec3::new(
        (n + height_m) * lat.cos() * lon.cos(),
        (n + height_m) * lat.cos() * lon.sin(),
        (n * (1.0 - e2) + height_m) * lat.sin(),
    )
}

fn attitude(roll: f64, pitch: f64, yaw: f64) -> DQuat {
    DQuat::from_rotation_z(yaw) * DQuat::from_rotation_y(pitch) * DQuat::from_rotation_x(roll)
}

fn spec(kind: TrackerKind, rate_hz: f64) -> TrackerSpec {
    TrackerSpec { kind, rate_hz, ..TrackerSpec::default() }
}

/// The limits of the paper's experiments.
fn paper_limits(spec: TrackerSpec) -> TrackerSpec {
    TrackerSpec {
        max_acceleration_m_s2: Auto::Value(PAPER_ACCELERATION_M_S2),
        max_angular_acceleration_deg_s2: Auto::Value(PAPER_ANGULAR_ACCELERATION_DEG_S2),
        ..spec
    }
}

fn row(t_s: f64, position_ned_m: DVec3, ned_from_body: DQuat) -> LogRow {
    LogRow { t_s, position_ned_m, ned_from_body }
}

/// Checks all four limits, as lengths of vectors, at every tick and at four instants of every interval.
fn assert_limits_kept(tracked: &TrackResult) {
    let (limits, trajectory) = (&tracked.limits, &tracked.trajectory);
    let instants = (0..trajectory.segments()).flat_map(|k| {
        let [from_s, to_s] = [k, k + 1].map(|k| trajectory.knot_s(k));
        (0..5).map(move |i| from_s + (to_s - from_s) * 0.2 * f64::from(i))
    });
    for state in instants.map(|t_s| trajectory.state(t_s)).chain(trajectory.knots().iter().copied()) {
        assert!(state.velocity_ned_m_s.length() <= limits.max_speed_m_s * (1.0 + 1e-12));
        assert!(state.acceleration_ned_m_s2.length() <= limits.max_acceleration_m_s2);
        assert!(state.rate_body_rad_s.length() <= limits.max_angular_rate_rad_s * (1.0 + 1e-12));
        assert!(state.angular_acceleration_body_rad_s2.length() <= limits.max_angular_acceleration_rad_s2);
    }
}

/// Checks that segments join: the end of each is the beginning of the next in position, velocity, attitude
/// and rate.
fn assert_joined(trajectory: &Trajectory) {
    let knots = trajectory.knots();
    let is_smooth = trajectory.is_smooth();
    for k in 1..knots.len() {
        if is_smooth {
            assert_smooth(trajectory, k);
            continue;
        }
        let end = crate::trajectory::advance(&knots[k - 1], trajectory.knot_s(k) - trajectory.knot_s(k - 1));
        // Rounding of kilometres and of 20 minutes of seconds, with velocities of up to 1 km/s.
        assert!((end.position_ned_m - knots[k].position_ned_m).length() < 1e-8, "{k}");
        assert!((end.velocity_ned_m_s - knots[k].velocity_ned_m_s).length() < 1e-9, "{k}");
        assert!(so3::log(end.ned_from_body.inverse() * knots[k].ned_from_body).length() < 1e-9, "{k}");
        assert!((end.rate_body_rad_s - knots[k].rate_body_rad_s).length() < 1e-9, "{k}");
    }
}

/// Checks that all derivatives up to the accelerations join at a knot, where the motion is a double integrator of
/// accelerations that are linear in time: integrated by Simpson's rule, which is exact for them.
fn assert_smooth(trajectory: &Trajectory, k: usize) {
    let (knots, step_s) = (trajectory.knots(), trajectory.knot_s(k) - trajectory.knot_s(k - 1));
    let (from, to) = (&knots[k - 1], &knots[k]);
    let middle = trajectory.state(trajectory.knot_s(k - 1) + 0.5 * step_s);
    let simpson = |a: DVec3, b: DVec3, c: DVec3| (a + 4.0 * b + c) * (step_s / 6.0);
    let gained = [
        simpson(from.velocity_ned_m_s, middle.velocity_ned_m_s, to.velocity_ned_m_s),
        simpson(from.acceleration_ned_m_s2, middle.acceleration_ned_m_s2, to.acceleration_ned_m_s2),
        simpson(
            from.angular_acceleration_body_rad_s2,
            middle.angular_acceleration_body_rad_s2,
            to.angular_acceleration_body_rad_s2,
        ),
    ];
    // Rounding of the times of 20 minutes, with velocities of up to 1 km/s.
    assert!((from.position_ned_m + gained[0] - to.position_ned_m).length() < 1e-8, "{k}");
    assert!((from.velocity_ned_m_s + gained[1] - to.velocity_ned_m_s).length() < 1e-8, "{k}");
    assert!((from.rate_body_rad_s + gained[2] - to.rate_body_rad_s).length() < 1e-9, "{k}");
    // The attitude and the accelerations are those of both intervals.
    let near_s = 1e-7 * step_s;
    let [before, after] = [-near_s, near_s].map(|off_s| trajectory.state(trajectory.knot_s(k) + off_s));
    assert!(so3::log(before.ned_from_body.inverse() * after.ned_from_body).length() < 1e-7, "{k}");
    let jumps = [
        after.acceleration_ned_m_s2 - before.acceleration_ned_m_s2,
        after.angular_acceleration_body_rad_s2 - before.angular_acceleration_body_rad_s2,
    ];
    // Within 2e-7 of a step: of at most twice the largest acceleration, 1 km/s^2.
    assert!(jumps.iter().all(|jump| jump.length() < 1e-3), "{k}: {jumps:?}");
}

#[test]
fn real_flight_is_followed_closer_than_the_reference_program_does() {
    let Some(rows) = lawnmower() else { return };
    // Largest RMS per channel. The paper's program reaches 0.373, 0.306, 0.076 m and 0.207, 0.042, 0.052 deg.
    // Most of the yaw error is one more corrupted row, 44848 (10 deg off for 24 ms).
    let sqrt = [0.115, 0.07, 0.004, 0.045, 0.039, 0.047];
    let spline = [0.105, 0.062, 0.003, 0.026, 0.019, 0.045];
    for (kind, most, rates) in [
        (TrackerKind::Sqrt, sqrt, &[200.0, 400.0, 800.0][..]),
        (TrackerKind::Spline, spline, &[200.0, 400.0][..]),
    ] {
        for &rate_hz in rates {
            let tracked = track(&rows, &paper_limits(spec(kind, rate_hz))).unwrap();
            assert_limits_kept(&tracked);
            assert_joined(&tracked.trajectory);
            let report = tracked.report(&rows).unwrap();
            let rms = report.rms;
            let name = format!("{kind:?} at {rate_hz} Hz: {rms:?}");
            let channels = [rms.north_m, rms.east_m, rms.down_m, rms.roll_deg, rms.pitch_deg, rms.yaw_deg];
            assert!(channels.into_iter().zip(most).all(|(own, most)| own < most), "{name}");
            for fraction in report.sign_changes_ned.into_iter().chain(report.sign_changes_body) {
                // No chatter, which would be 100 %. The rest are sign changes of the log's own noise, of
                // which `spline` keeps up to 7 per second.
                let most = if kind == TrackerKind::Sqrt { 0.03 } else { 0.03f64.max(7.5 / rate_hz) };
                assert!(fraction <= most, "{name}: {fraction}");
            }
            assert!(
                report.max_used.acceleration_m_s2 <= 19.6
                    && report.max_used.angular_acceleration_deg_s2 <= 60.0
            );
            assert!(
                report.samples == tracked.trajectory.segments()
                    || report.samples + 1 == tracked.trajectory.segments()
            );
        }
    }
}

/// Response to a step of 10 m (north) or 30 deg (yaw), smoothed so little that the controller limits the
/// motion.
fn step_response(
    curve: Curve,
    rate_hz: f64,
    distance_m: f64,
    angle_rad: f64,
) -> (Vec<BodyState>, ResolvedLimits) {
    let limits = ResolvedLimits {
        max_speed_m_s: 50.0,
        max_acceleration_m_s2: 19.6,
        max_angular_rate_rad_s: 5.0,
        max_angular_acceleration_rad_s2: 1.047,
    };
    let ticks = (4.0 * rate_hz) as usize;
    let jump = ticks / 20;
    let reference = Reference {
        curve,
        step_s: 1.0 / rate_hz,
        position_ned_m: (0..=ticks)
            .map(|k| if k > jump { DVec3::X * distance_m } else { DVec3::ZERO })
            .collect(),
        ned_from_body: (0..=ticks)
            .map(|k| DQuat::from_rotation_z(if k > jump { angle_rad } else { 0.0 }))
            .collect(),
    };
    (plant::follow(&reference, &limits).states, limits)
}

#[test]
fn a_step_is_taken_without_overshoot_or_chatter() {
    let curves = [Curve::Quadratic, Curve::Cubic];
    for (curve, rate_hz) in curves
        .into_iter()
        .flat_map(|curve| [50.0, 100.0, 200.0, 400.0, 1000.0].map(|rate_hz| (curve, rate_hz)))
    {
        let (states, _) = step_response(curve, rate_hz, 10.0, 0.5);
        let accelerations = |pick: fn(&BodyState) -> f64| {
            let signs: Vec<bool> =
                states.iter().map(pick).filter(|a| a.abs() > 1e-6).map(|a| a > 0.0).collect();
            signs.windows(2).filter(|pair| pair[0] != pair[1]).count()
        };
        let farthest = states.iter().map(|state| state.position_ned_m.x).fold(0.0, f64::max);
        assert!(farthest <= 10.0 + 1e-9, "{rate_hz} Hz: {farthest}");
        let turned = |state: &BodyState| so3::log(state.ned_from_body).z;
        assert!(states.iter().map(turned).fold(0.0, f64::max) <= 0.5 + 1e-9, "{rate_hz} Hz");
        // The target velocity in the tick of the jump gives one acceleration, followed by braking: few
        // changes in all.
        assert!(accelerations(|state| state.acceleration_ned_m_s2.x) <= 3, "{rate_hz} Hz");
        assert!(accelerations(|state| state.angular_acceleration_body_rad_s2.z) <= 3, "{rate_hz} Hz");
        let last = states.last().unwrap();
        assert!(
            (last.position_ned_m.x - 10.0).abs() < 1e-4 && (turned(last) - 0.5).abs() < 1e-4,
            "{rate_hz} Hz: {last:?}"
        );
        // The optimum is 2 sqrt(10 / 19.6) = 1.43 s; braking at 0.8 of the limit and the linear zone add the
        // rest.
        let settled = states.iter().rposition(|state| (state.position_ned_m.x - 10.0).abs() > 0.1).unwrap()
            as f64
            / rate_hz
            - 0.2;
        assert!(settled < 1.9, "{rate_hz} Hz: {settled} s");
    }
}

#[test]
fn yaw_takes_the_shorter_arc_through_180() {
    let rows: Vec<_> = (0..400)
        .map(|i| {
            let t_s = 0.025 * f64::from(i);
            let yaw_deg = 170.0 + 4.0 * t_s;
            row(
                t_s,
                DVec3::X * t_s,
                attitude(0.0, 0.0, (if yaw_deg > 180.0 { yaw_deg - 360.0 } else { yaw_deg }).to_radians()),
            )
        })
        .collect();
    for kind in [TrackerKind::Sqrt, TrackerKind::Spline] {
        let tracked = track(&rows, &spec(kind, 400.0)).unwrap();
        let report = tracked.report(&rows).unwrap();
        assert!(
            report.max_error.yaw_deg < 1e-6 && report.max_used.angular_rate_deg_s < 4.000_01,
            "{kind:?} {report:?}"
        );
    }
}

#[test]
fn loop_through_vertical_is_followed() {
    // One loop in 10 s, then a barrel roll: pitch passes +90 and -90 deg.
    let rows: Vec<_> = (0..800)
        .map(|i| {
            let t_s = 0.025 * f64::from(i);
            let phase = std::f64::consts::TAU * t_s / 10.0;
            let turn = if t_s < 10.0 { DQuat::from_rotation_y(phase) } else { DQuat::from_rotation_x(phase) };
            row(t_s, DVec3::ZERO, DQuat::from_rotation_z(0.5) * turn)
        })
        .collect();
    for kind in [TrackerKind::Sqrt, TrackerKind::Spline] {
        let tracked = track(&rows, &spec(kind, 400.0)).unwrap();
        assert_limits_kept(&tracked);
        let report = tracked.report(&rows).unwrap();
        // The corner between loop and roll turns the rate vector by 90 deg, a change of 51 deg/s, which takes
        // 22 deg at 60 deg/s^2; the smoothed reference begins it early.
        assert!(report.max_error.attitude_deg < 15.0, "{kind:?} {report:?}");
        // Away from the corner there is no lag.
        for t_s in [1.0, 2.5, 5.0, 7.5, 13.5, 15.0, 18.0] {
            let error = so3::log(
                tracked.trajectory.state(t_s).ned_from_body.inverse()
                    * LogInterpolator::new(&rows).unwrap().at(t_s).1,
            );
            assert!(error.length() < 1e-3, "{kind:?} {t_s}: {error}");
        }
    }
}

#[test]
fn one_row_two_rows_and_gaps() {
    let kinds = [TrackerKind::Hold, TrackerKind::Linear, TrackerKind::Sqrt, TrackerKind::Spline];
    let one = [row(3.0, DVec3::new(1.0, 2.0, -3.0), attitude(0.1, 0.2, 0.3))];
    let two =
        [row(0.0, DVec3::ZERO, DQuat::IDENTITY), row(40.0, DVec3::X * 12_000.0, DQuat::from_rotation_z(1.5))];
    let close =
        [row(0.0, DVec3::ZERO, DQuat::IDENTITY), row(5e-5, DVec3::X * 0.11, DQuat::from_rotation_z(0.01))];
    let gap: Vec<_> = (0..200)
        .map(|i| {
            let t_s = 0.05 * f64::from(i) + if i >= 100 { 12.0 } else { 0.0 };
            row(
                t_s,
                DVec3::new(5.0 * t_s, if i >= 100 { 30.0 } else { 0.0 }, 0.0),
                DQuat::from_rotation_z(if i >= 100 { -2.5 } else { 0.5 }),
            )
        })
        .collect();
    for kind in kinds {
        let still = track(&one, &spec(kind, 400.0)).unwrap();
        assert_eq!(still.trajectory.span_s(), (3.0, 3.0));
        for t_s in [-5.0, 3.0, 8.0] {
            let state = still.trajectory.state(t_s);
            assert!((state.position_ned_m - one[0].position_ned_m).length() < 1e-12, "{kind:?}");
            assert!(
                so3::log(state.ned_from_body.inverse() * one[0].ned_from_body).length() < 1e-12,
                "{kind:?}"
            );
        }
        assert_eq!(still.report(&one).unwrap().samples, 1);

        let straight = track(&two, &spec(kind, 400.0)).unwrap();
        if kind != TrackerKind::Hold {
            let state = straight.trajectory.state(20.0);
            assert!((state.position_ned_m - DVec3::X * 6000.0).length() < 1e-6, "{kind:?} {state:?}");
            assert!((state.rate_body_rad_s.z - 1.5 / 40.0).abs() < 1e-9, "{kind:?}");
        }
        let short = track(&close, &spec(kind, 400.0)).unwrap();
        assert!(short.trajectory.state(1.0).position_ned_m.is_finite());

        let gapped = track(&gap, &spec(kind, 200.0)).unwrap();
        if matches!(kind, TrackerKind::Sqrt | TrackerKind::Spline) {
            assert_limits_kept(&gapped);
            assert_joined(&gapped.trajectory);
            assert!(gapped.report(&gap).unwrap().max_error.north_m < 0.5, "{kind:?}");
        }
    }
}

#[test]
fn limits_hold_on_noise_and_impossible_logs() {
    // Steps of up to 100 m and 3 rad between rows 10 ms apart, from a small linear congruential generator.
    let mut seed = 1u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let rows: Vec<_> = (0..1000)
        .map(|i| {
            let p = DVec3::new(random(), random(), random()) * 100.0;
            row(0.01 * f64::from(i), p, so3::exp(DVec3::new(random(), random(), random()) * 6.0))
        })
        .collect();
    let tight = TrackerSpec {
        max_speed_m_s: Auto::Value(10.0),
        max_angular_rate_deg_s: Auto::Value(20.0),
        ..TrackerSpec::default()
    };
    for kind in [TrackerKind::Sqrt, TrackerKind::Spline] {
        for rate_hz in [7.0, 50.0, 400.0, 1000.0] {
            let tracked = track(&rows, &TrackerSpec { kind, rate_hz, ..tight.clone() }).unwrap();
            assert_limits_kept(&tracked);
            assert_joined(&tracked.trajectory);
        }
    }
}

#[test]
fn saturated_limits_are_reported_by_key() {
    let rows: Vec<_> =
        (0..200).map(|i| row(0.1 * f64::from(i), DVec3::X * 3.0 * f64::from(i), DQuat::IDENTITY)).collect();
    let slow = TrackerSpec { max_speed_m_s: Auto::Value(20.0), ..TrackerSpec::default() };
    let warnings = track(&rows, &slow).unwrap().warnings();
    assert!(warnings.len() == 1 && warnings[0].contains("tracker.max_speed_m_s = 20"), "{warnings:?}");
    let free = track(&rows, &TrackerSpec::default()).unwrap();
    assert!(free.warnings().is_empty());
    assert!((free.limits.max_speed_m_s - 36.0).abs() < 1e-9);
}

/// A platform that oscillates at 1.5 Hz by 20 degrees, 1777 deg/s^2 at most, after 10 s of rest.
fn agile() -> Vec<LogRow> {
    let turn = |t_s: f64| {
        if t_s < 10.0 {
            0.0
        } else {
            20_f64.to_radians() * (std::f64::consts::TAU * 1.5 * (t_s - 10.0)).sin()
        }
    };
    (0..4000)
        .map(|i| 0.005 * f64::from(i))
        .map(|t_s| row(t_s, DVec3::ZERO, DQuat::from_rotation_z(turn(t_s))))
        .collect()
}

#[test]
fn accelerations_come_from_the_log_and_are_at_least_the_papers() {
    let rows = agile();
    for (kind, most_deg) in [(TrackerKind::Sqrt, 5.0), (TrackerKind::Spline, 1.0)] {
        let tracked = track(&rows, &spec(kind, 400.0)).unwrap();
        let limit_deg_s2 = tracked.limits.max_angular_acceleration_rad_s2.to_degrees();
        // Smoothing leaves exp(-(2 pi 1.5 sigma)^2 / 2) of it: 0.70 for 0.09 s and 0.64 for 0.1 s; times 1.5.
        assert!((1600.0..1950.0).contains(&limit_deg_s2), "{kind:?}: {limit_deg_s2}");
        assert_eq!(tracked.limits.max_acceleration_m_s2, PAPER_ACCELERATION_M_S2);
        let report = tracked.report(&rows).unwrap();
        assert!(
            report.rms.attitude_deg < most_deg && tracked.saturation.angular_acceleration_s < 0.1,
            "{kind:?}: {report:?}"
        );
    }
}

#[test]
fn saturation_intervals_have_their_times() {
    let rows = agile();
    let tracked = track(&rows, &paper_limits(TrackerSpec::default())).unwrap();
    let first = tracked.saturation_intervals.first().copied().unwrap();
    assert_eq!(first.limit, Limit::MaxAngularAcceleration);
    assert!((first.duration_s() - tracked.saturation.angular_acceleration_s).abs() < 1e-9, "{first:?}");
    let since = tracked.saturation_intervals.iter().map(|hold| hold.from_s).fold(f64::INFINITY, f64::min);
    assert!((9.5..10.3).contains(&since) && tracked.saturation_intervals.len() <= MAX_INTERVALS, "{since}");
    let warning = tracked.distance_warning(&rows).unwrap();
    assert!(warning.contains("deg RMS from the log"), "{warning}");
    let still: Vec<_> =
        (0..100).map(|i| row(0.1 * f64::from(i), DVec3::X * f64::from(i), DQuat::IDENTITY)).collect();
    assert_eq!(track(&still, &TrackerSpec::default()).unwrap().distance_warning(&still), None);
}

#[test]
fn invalid_logs_and_settings_are_refused() {
    let good = row(0.0, DVec3::ZERO, DQuat::IDENTITY);
    let default = TrackerSpec::default();
    assert_eq!(track(&[], &default).unwrap_err(), TrackerError::Empty);
    for bad in [
        row(f64::NAN, DVec3::ZERO, DQuat::IDENTITY),
        row(1.0, DVec3::new(0.0, f64::INFINITY, 0.0), DQuat::IDENTITY),
        row(1.0, DVec3::new(f64::NAN, 0.0, 0.0), DQuat::IDENTITY),
        row(1.0, DVec3::ZERO, DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0)),
        row(1.0, DVec3::ZERO, DQuat::from_xyzw(f64::NAN, 0.0, 0.0, 1.0)),
        row(1.0, DVec3::X * 1e300, DQuat::IDENTITY),
    ] {
        assert_eq!(track(&[good, bad], &default).unwrap_err(), TrackerError::BadRow { row: 2 });
    }
    assert_eq!(track(&[good, good], &default).unwrap_err(), TrackerError::TimeOrder { row: 2 });
    let denormal = row(5e-324, DVec3::X, DQuat::IDENTITY);
    let linear = spec(TrackerKind::Linear, 400.0);
    assert_eq!(track(&[good, denormal], &linear).unwrap_err(), TrackerError::Overflow);
    let smooth =
        track(&[good, denormal], &TrackerSpec { max_speed_m_s: Auto::Value(5.0), ..TrackerSpec::default() })
            .unwrap();
    assert!(smooth.trajectory.state(0.5).position_ned_m.is_finite());
    let late = row(1e9, DVec3::ZERO, DQuat::IDENTITY);
    assert!(matches!(track(&[good, late], &default).unwrap_err(), TrackerError::TooLong { .. }));
    for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let wrong = TrackerSpec { rate_hz: value, ..TrackerSpec::default() };
        assert!(matches!(track(&[good], &wrong).unwrap_err(), TrackerError::BadKey { key: "rate_hz", .. }));
    }
}
