#![allow(clippy::unwrap_used)]

use super::*;

fn ned_row(line: usize, t_s: f64, position: [f64; 3], angles: [f64; 3]) -> RawRow {
    RawRow {
        line,
        t_ns: Some((t_s * 1e9).round() as i64),
        position: RawPosition::Ned(position.into()),
        attitude: RawAttitude::EulerDeg(angles),
    }
}

/// 20 Hz, 10 m/s north, yaw 178 degrees and slowly rising through 180.
fn straight(count: usize) -> Vec<RawRow> {
    (0..count)
        .map(|i| {
            let t_s = i as f64 * 0.05;
            let yaw = (178.0 + 0.02 * i as f64 + 180.0_f64).rem_euclid(360.0) - 180.0;
            ned_row(i + 1, t_s, [10.0 * t_s, 0.0, -100.0], [0.0, 1.0, yaw])
        })
        .collect()
}

fn log(raw: &[RawRow]) -> FlightLog {
    FlightLog::from_raw(raw, &LogOptions::default()).unwrap()
}

#[test]
fn a_clean_log_passes_unchanged() {
    let log = log(&straight(300));
    assert!(log.report.is_clean(), "{}", log.report);
    assert_eq!(log.rows.len(), 300);
    assert_eq!(log.report.angles, AngleKind::Wrapped);
    assert!((log.speed_percentile_m_s(0.999) - 10.0).abs() < 1e-9);
    assert!((log.angular_rate_percentile_rad_s(0.999) - 0.4_f64.to_radians()).abs() < 1e-6);
}

#[test]
fn continuous_angles_keep_a_full_turn() {
    let log = log(&[
        ned_row(1, 0.0, [0.0, 0.0, -3000.0], [0.0; 3]),
        ned_row(2, 10.0, [0.0, 0.0, -3000.0], [0.0, 0.0, 360.0]),
    ]);
    assert_eq!(log.report.angles, AngleKind::Continuous);
    assert_eq!(log.report.inserted, 3);
    for i in 0..=40 {
        let t_s = 0.25 * f64::from(i);
        let (_, attitude) = log.interpolate(t_s);
        let expected = body_from_euler_deg([0.0, 0.0, 36.0 * t_s]);
        assert!(attitude::angle_between_rad(attitude, expected) < 1e-12, "{t_s}");
    }
    assert!((log.angular_rate_percentile_rad_s(0.999) - 0.2 * std::f64::consts::PI).abs() < 1e-9);
}

#[test]
fn occasional_360_degrees_still_wraps() {
    let yaws = [358.0, 359.0, 360.0, 1.0, 2.0, 3.0];
    let rows: Vec<_> = yaws
        .iter()
        .enumerate()
        .map(|(i, &yaw)| ned_row(i + 1, i as f64, [0.0; 3], [0.0, 0.0, yaw]))
        .collect();
    let log = log(&rows);
    assert_eq!(log.report.angles, AngleKind::Wrapped);
    assert_eq!(log.report.inserted, 0);
}

#[test]
fn faults_are_found_counted_and_repaired() {
    let mut rows = straight(400);
    rows[100].attitude = RawAttitude::EulerDeg([0.0, 1.0, 0.0]);
    rows[150].position = RawPosition::Ned(DVec3::new(75.0, 50.0, -100.0));
    rows[200].t_ns = None;
    rows[210].position = RawPosition::Ned(DVec3::new(f64::NAN, 0.0, 0.0));
    rows[220].position = RawPosition::Ned(DVec3::new(0.0, f64::INFINITY, 0.0));
    rows[230].attitude = RawAttitude::EulerDeg([f64::NAN, 0.0, 0.0]);
    rows[240].t_ns = rows[239].t_ns;
    rows[250].t_ns = rows[249].t_ns.map(|t| t + 50_000);
    rows.swap(300, 301);
    let log = log(&rows);
    let report = &log.report;
    assert_eq!(report.attitude_glitches.lines, [101], "{report}");
    assert_eq!(report.position_spikes.lines, [151], "{report}");
    assert_eq!(report.unusable.lines, [201, 211, 221]);
    assert_eq!(report.attitude_missing.lines, [231]);
    assert_eq!(report.duplicates.lines, [241]);
    assert_eq!(report.merged.lines, [251]);
    assert_eq!(report.out_of_order.lines, [301]);
    // All but the row without a time.
    let repaired_s = [5.0, 7.5, 10.5, 11.0, 11.5, 11.95, 12.450_05, 15.0];
    assert_eq!(report.repaired_s.len(), repaired_s.len());
    assert!(
        report.repaired_s.iter().zip(repaired_s).all(|(found, at)| (found - at).abs() < 1e-9),
        "{:?}",
        report.repaired_s
    );
    assert_eq!(log.rows.len(), 400 - 1 - 3 - 2);
    assert!(log.rows.windows(2).all(|pair| pair[1].t_s - pair[0].t_s >= 1e-3));
    let truth = body_from_euler_deg([0.0, 1.0, 180.0]);
    assert!(attitude::angle_between_rad(log.interpolate(5.0).1, truth) < 1e-6);
    // A merged pair moves by half a step at most; nothing is left of 50 m or of 10 m in 50 us.
    assert!(log.speed_percentile_m_s(1.0) < 12.5, "{}", log.speed_percentile_m_s(1.0));
    assert!(report.to_string().contains("1 position spikes dropped (line 151)"));
}

#[test]
fn spikes_of_several_rows_and_at_the_ends_are_dropped() {
    let mut rows = straight(100);
    for i in [0, 50, 51, 99] {
        rows[i].position = RawPosition::Ned(DVec3::new(0.0, 60.0, -100.0));
    }
    assert_eq!(log(&rows).report.position_spikes.lines, [1, 51, 52, 100]);
    // Every repaired row has its position on the timeline, however many there are.
    let mut many = straight(400);
    (100..200).for_each(|at| many[at].attitude = RawAttitude::EulerDeg([f64::NAN, 0.0, 0.0]));
    let report = log(&many).report;
    assert_eq!((report.attitude_missing.lines.len(), report.repaired_s.len()), (report::LISTED_LINES, 100));
}

#[test]
fn violent_motion_is_not_flagged() {
    // A shaken camera: 3 Hz, 20 degrees, sampled at 20 Hz; and a turn at a waypoint.
    let rows: Vec<_> = (0..200)
        .map(|i| {
            let t_s = f64::from(i) * 0.05;
            let shake = 20.0 * (std::f64::consts::TAU * 3.0 * t_s).sin();
            let east = if t_s > 5.0 { 10.0 * (t_s - 5.0) } else { 0.0 };
            ned_row(
                i as usize + 1,
                t_s,
                [10.0 * t_s.min(5.0), east, 0.0],
                [shake, 0.5 * shake, if t_s > 5.0 { 90.0 } else { 0.0 }],
            )
        })
        .collect();
    assert!(log(&rows).report.is_clean(), "{}", log(&rows).report);
}

#[test]
fn one_row_is_a_still_camera_and_extrapolation_is_continuous() {
    let still = log(&[ned_row(1, 7.0, [1.0, 2.0, 3.0], [10.0, 20.0, 30.0])]);
    assert_eq!(still.epoch_ns, 7_000_000_000);
    assert_eq!(still.interpolate(-5.0), still.interpolate(1e9));
    assert!(still.speed_percentile_m_s(0.999).abs() < 1e-15);
    let moving = log(&straight(100));
    for (t_s, north) in [(-2.0, -20.0), (0.0, 0.0), (moving.duration_s(), 49.5), (6.0, 60.0)] {
        assert!((moving.interpolate(t_s).0.x - north).abs() < 1e-9, "{t_s}");
    }
    let expected = body_from_euler_deg([0.0, 1.0, 178.0 + 0.4 * 6.0]);
    assert!(attitude::angle_between_rad(moving.interpolate(6.0).1, expected) < 1e-9);
    assert!(moving.interpolate(f64::NAN).0.is_nan());
}

#[test]
fn track_attitude_of_a_coordinated_circle() {
    // 15 m/s on a 60 m circle, climbing 1 m/s: tan(bank) = v^2 / (r g).
    let rows: Vec<_> = (0..600)
        .map(|i| {
            let t_s = f64::from(i) * 0.05;
            let (sin, cos) = (15.0 / 60.0 * t_s).sin_cos();
            RawRow {
                attitude: RawAttitude::None,
                ..ned_row(1 + i as usize, t_s, [60.0 * sin, 60.0 * (1.0 - cos), -t_s], [0.0; 3])
            }
        })
        .collect();
    let options = LogOptions { attitude: AttitudeSource::Track, ..LogOptions::default() };
    let log = FlightLog::from_raw(&rows, &options).unwrap();
    let row = log.rows[300];
    let expected = body_from_euler_deg([
        (15.0_f64 * 15.0 / 60.0 / 9.806_65).atan().to_degrees(),
        1.0_f64.atan2(15.0).to_degrees(),
        (15.0 / 60.0 * row.t_s).to_degrees(),
    ]);
    // The quadratic over +-1 s flattens a circle by (omega h)^2 / 15 of the curvature: 0.1 degrees of bank.
    assert!(attitude::angle_between_rad(row.ned_from_body, expected).to_degrees() < 0.3);
    assert_eq!(FlightLog::from_raw(&rows, &LogOptions::default()), Err(LogError::NoAttitude));
    let still: Vec<_> = (0..9).map(|i| RawRow { t_ns: Some(i), ..rows[0] }).collect();
    let still = FlightLog::from_raw(&still, &options).unwrap();
    assert!(attitude::angle_between_rad(still.rows[0].ned_from_body, DQuat::IDENTITY) < 1e-9);
}

#[test]
fn geodetic_attitudes_use_the_local_tangent_frame() {
    let row = |line: usize, at: Geodetic| RawRow {
        line,
        t_ns: Some(line as i64 * 1_000_000_000),
        position: RawPosition::Geodetic(at),
        attitude: RawAttitude::EulerDeg([0.0; 3]),
    };
    let rows = [row(1, Geodetic::from_deg(47.0, 8.0, 500.0)), row(2, Geodetic::from_deg(47.0, 9.0, 500.0))];
    let flown = log(&rows);
    let frame = flown.frame.unwrap();
    assert!(flown.rows[0].position_ned_m.length() < 1e-8);
    assert!(
        flown.rows[1].ned_from_body.angle_between(frame.ned_from_local(Geodetic::from_deg(47.0, 9.0, 500.0)))
            < 1e-7
    );
    // Level at 9 E is tilted by about 0.68 degrees seen from 8 E.
    let up = flown.rows[1].ned_from_body * DVec3::NEG_Z;
    assert!((up.angle_between(DVec3::NEG_Z).to_degrees() - 0.68).abs() < 0.01);

    let msl = LogOptions { height: HeightConversion::MslToEllipsoid, ..LogOptions::default() };
    let raised = FlightLog::from_raw(&rows, &msl).unwrap().frame.unwrap().origin().height_m;
    assert!(
        (raised - 500.0 - crate::geodesy::geoid_undulation_m(Geodetic::from_deg(47.0, 8.0, 0.0))).abs()
            < 0.01
    );
}

#[test]
fn speed_scales_time_and_gaps_are_counted() {
    let mut rows = straight(100);
    for row in &mut rows[50..] {
        row.t_ns = row.t_ns.map(|t| t + 5_000_000_000);
    }
    let fast = FlightLog::from_raw(&rows, &LogOptions { speed: 2.0, ..LogOptions::default() }).unwrap();
    assert_eq!(fast.report.gaps.lines, [51]);
    assert!((fast.report.longest_step_s - 5.05).abs() < 1e-9);
    assert!((fast.duration_s() - (99.0 * 0.05 + 5.0) / 2.0).abs() < 1e-9);
}

#[test]
fn invalid_rows_give_errors_not_panics() {
    let options = LogOptions::default();
    assert_eq!(FlightLog::from_raw(&[], &options), Err(LogError::Empty));
    let nan = ned_row(4, 0.0, [f64::NAN; 3], [0.0; 3]);
    assert_eq!(FlightLog::from_raw(&[nan], &options), Err(LogError::NoGoodRow { rows: 1, line: 4 }));
    for speed in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            FlightLog::from_raw(&straight(3), &LogOptions { speed, ..options }),
            Err(LogError::BadSpeed(_))
        ));
    }
    let origin = Some(Geodetic::from_deg(91.0, 0.0, 0.0));
    assert_eq!(
        FlightLog::from_raw(&straight(3), &LogOptions { origin, ..options }),
        Err(LogError::BadOrigin)
    );
    let mut mixed = straight(3);
    mixed[1].position = RawPosition::Geodetic(Geodetic::default());
    assert_eq!(FlightLog::from_raw(&mixed, &options), Err(LogError::MixedPositions { line: 2 }));
    let mut mixed = straight(3);
    mixed[2].attitude = RawAttitude::Quaternion(DQuat::IDENTITY);
    assert_eq!(FlightLog::from_raw(&mixed, &options), Err(LogError::MixedAttitudes { line: 3 }));
    let spun = [ned_row(1, 0.0, [0.0; 3], [0.0; 3]), ned_row(2, 1.0, [0.0; 3], [0.0, 0.0, 9e8])];
    assert!(matches!(FlightLog::from_raw(&spun, &options), Err(LogError::TurnTooLarge { line: 2, .. })));
    let huge = ned_row(1, 0.0, [1e300, 0.0, 0.0], [0.0; 3]);
    assert!(matches!(FlightLog::from_raw(&[huge], &options), Err(LogError::NoGoodRow { .. })));
    let mut ends = straight(2);
    ends[0].t_ns = Some(i64::MIN);
    ends[1].t_ns = Some(i64::MAX);
    assert!((FlightLog::from_raw(&ends, &options).unwrap().duration_s() - 1.844_674_407e10).abs() < 10.0);
    let zero =
        RawRow { attitude: RawAttitude::Quaternion(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0)), ..straight(1)[0] };
    assert_eq!(FlightLog::from_raw(&[zero], &options), Err(LogError::NoAttitude));
}

fn geodetic_row(line: usize, t_s: f64, lat_deg: f64, lon_deg: f64, height_m: f64) -> RawRow {
    RawRow {
        position: RawPosition::Geodetic(Geodetic::from_deg(lat_deg, lon_deg, height_m)),
        ..ned_row(line, t_s, [0.0; 3], [0.0; 3])
    }
}

#[test]
fn null_fixes_are_dropped_and_true_zeros_are_kept() {
    let alps = |i: usize| geodetic_row(i + 1, i as f64, 47.0 + 1e-5 * i as f64, 8.0, 500.0 + i as f64);
    let mut rows: Vec<RawRow> = (0..20).map(alps).collect();
    for (i, lat, lon, height) in [
        (0, 0.0, 0.0, 0.0),
        (1, 0.0, 0.0, 0.0),
        (9, 0.0, 8.0, 509.0),
        (12, 47.00012, 0.0, 512.0),
        (19, 0.0, 0.0, 0.0),
    ] {
        rows[i] = geodetic_row(i + 1, i as f64, lat, lon, height);
    }
    for i in [2, 3, 15] {
        rows[i] = geodetic_row(i + 1, i as f64, 47.0 + 1e-5 * i as f64, 8.0, 0.0);
    }
    let report = log(&rows).report;
    assert_eq!(
        (report.null_fixes.count, &report.null_fixes.lines[..]),
        (5, &[1, 2, 10, 13, 20][..]),
        "{report}"
    );
    assert_eq!((report.null_heights.count, &report.null_heights.lines[..]), (3, &[3, 4, 16][..]), "{report}");
    assert!((log(&rows).frame.unwrap().origin().lat_deg() - 47.00004).abs() < 1e-12);

    // Over the equator and Greenwich, and off from the sea.
    let ghana: Vec<_> =
        (0..21).map(|i| geodetic_row(i + 1, i as f64, 0.1 - 0.01 * i as f64, 0.0, 3.0 * i as f64)).collect();
    assert!(log(&ghana).report.is_clean(), "{}", log(&ghana).report);
    // A fix at 0, 0 throughout is a made-up position, and a log of its own.
    let nowhere: Vec<_> = (0..21).map(|i| geodetic_row(i + 1, i as f64, 0.0, 0.0, 100.0)).collect();
    assert!(log(&nowhere).report.is_clean());
}

#[test]
fn rows_without_attitude_are_interpolated_without_a_repair() {
    let mut rows = straight(40);
    for row in rows.iter_mut().skip(1).step_by(2) {
        row.attitude = RawAttitude::None;
    }
    let log = log(&rows);
    assert!(log.report.is_clean(), "{}", log.report);
    let truth = body_from_euler_deg([0.0, 1.0, 178.0 + 0.02 * 11.0]);
    assert!(attitude::angle_between_rad(log.rows[11].ned_from_body, truth) < 1e-6);
}

/// A level circle of 100 m at an angular rate, with rows at 20 Hz for 20 s, flown by its track.
fn track_circle(rate_rad_s: f64) -> FlightLog {
    let rows: Vec<_> = (0..=400)
        .map(|i| {
            let t_s = f64::from(i) * 0.05;
            let (sin, cos) = (rate_rad_s * t_s).sin_cos();
            let position = [100.0 * sin, 100.0 * (1.0 - cos), -100.0];
            RawRow { attitude: RawAttitude::None, ..ned_row(1 + i as usize, t_s, position, [0.0; 3]) }
        })
        .collect();
    FlightLog::from_raw(&rows, &by_track()).unwrap()
}

fn by_track() -> LogOptions<'static> {
    LogOptions { attitude: AttitudeSource::Track, ..LogOptions::default() }
}

/// Roll, pitch and yaw in degrees.
fn angles_deg(row: &LogRow) -> [f64; 3] {
    let (yaw, pitch, roll) = row.ned_from_body.to_euler(glam::EulerRot::ZYX);
    [roll, pitch, yaw].map(f64::to_degrees)
}

#[test]
fn bank_of_a_circle_is_that_of_the_stated_filter() {
    // Moments of the tricube window over [-1, 1], by the midpoint rule.
    let moment = |power: i32| {
        (0..20_000)
            .map(|i| (f64::from(i) + 0.5) / 10_000.0 - 1.0)
            .map(|tau| (1.0 - tau.abs().powi(3)).powi(3) * tau.powi(power))
            .sum::<f64>()
            / 10_000.0
    };
    let [m0, m2, m4, m6] = [0, 2, 4, 6].map(moment);
    let flattening = (m6 * m0 - m2 * m4) / (m4 * m0 - m2 * m2) / 12.0;
    assert!((flattening - 0.043).abs() < 5e-4, "{flattening}");
    for rate in [0.05, 0.1, 0.2, 0.3] {
        let log = track_circle(rate);
        for row in &log.rows[40..360] {
            let [roll, pitch, yaw] = angles_deg(row);
            let coordinated = 100.0 * rate * rate / 9.806_65;
            let expected = (coordinated * (1.0 - flattening * rate * rate)).atan().to_degrees();
            let heading = (rate * row.t_s).to_degrees();
            let turned = (yaw - heading + 180.0).rem_euclid(360.0) - 180.0;
            assert!((roll - expected).abs() < 0.01, "{rate}: bank {roll}, not {expected}");
            assert!(turned.abs() < 1e-3 && pitch.abs() < 1e-6, "{rate}: heading {yaw}, not {heading}");
        }
    }
}

/// North at 5 m/s for 10 s, a stop of 20 s, then east, with noise of a receiver all the time.
fn stop_and_go(sigma_m: f64) -> FlightLog {
    let mut state = 1_u64;
    let mut noise = || {
        let mut sum = 0.0;
        for _ in 0..12 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            sum += (state >> 11) as f64 / (1_u64 << 53) as f64;
        }
        sigma_m * (sum - 6.0)
    };
    let rows: Vec<_> = (0..400)
        .map(|i| {
            let t_s = f64::from(i) * 0.1;
            let north = 5.0 * t_s.min(10.0) + noise();
            let east = 5.0 * (t_s - 30.0).max(0.0) + noise();
            let row = ned_row(1 + i as usize, t_s, [north, east, -100.0], [0.0; 3]);
            RawRow { attitude: RawAttitude::None, ..row }
        })
        .collect();
    FlightLog::from_raw(&rows, &by_track()).unwrap()
}

#[test]
fn heading_is_kept_at_a_standstill() {
    for (sigma_m, still_deg, flying_deg) in [(0.0, 1e-6, 1e-6), (0.3, 20.0, 25.0)] {
        for row in &stop_and_go(sigma_m).rows {
            let [roll, pitch, yaw] = angles_deg(row);
            if (12.0..27.5).contains(&row.t_s) {
                let level = roll.abs() < 1e-6 && pitch.abs() < 1e-6;
                assert!(yaw.abs() <= still_deg && level, "{} s: {yaw} {roll} {pitch}", row.t_s);
            }
            if row.t_s > 32.0 {
                assert!((yaw - 90.0).abs() <= flying_deg, "{} s: {yaw}", row.t_s);
            }
        }
    }
    // 90 degrees within 2 s by a smooth step: 1.5 times the mean rate at its middle.
    let quiet = stop_and_go(0.0);
    let rates = quiet.rows.windows(2).map(|pair| {
        attitude::angle_between_rad(pair[0].ned_from_body, pair[1].ned_from_body).to_degrees()
            / (pair[1].t_s - pair[0].t_s)
    });
    let fastest = rates.fold(0.0, f64::max);
    assert!((60.0..68.0).contains(&fastest), "{fastest}");
}
