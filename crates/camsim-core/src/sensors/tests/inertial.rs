//! Lever arms, axes, errors by their formulas, read-out, clock, and independence of the window.

use super::*;
use crate::scenario::{SensorAxes, SensorMountSpec};

/// Time from knot to knot of a circle.
const STEP_S: f64 = 1.0 / 1024.0;

/// A level circle of `radius_m` at `rate_rad_s` (clockwise), nose along the track, from the east of its
/// centre southwards; exact at its knots, every 2^-10 s.
fn circle(radius_m: f64, rate_rad_s: f64, seconds: f64) -> Trajectory {
    let knot = |k: usize| {
        let angle = rate_rad_s * STEP_S * k as f64;
        let out = DVec3::new(-angle.sin(), angle.cos(), 0.0);
        let along = DVec3::new(-angle.cos(), -angle.sin(), 0.0);
        BodyState {
            position_ned_m: radius_m * out,
            velocity_ned_m_s: radius_m * rate_rad_s * along,
            acceleration_ned_m_s2: -radius_m * rate_rad_s * rate_rad_s * out,
            ned_from_body: DQuat::from_rotation_z(std::f64::consts::PI + angle),
            rate_body_rad_s: DVec3::Z * rate_rad_s,
            angular_acceleration_body_rad_s2: DVec3::ZERO,
        }
    };
    let count = (seconds / STEP_S) as usize;
    Trajectory::uniform(0.0, STEP_S, seconds, (0..=count).map(knot).collect()).unwrap()
}

#[test]
fn lever_arm_on_a_circle() {
    let (radius_m, w) = (50.0, 0.6);
    // At 4 s the motion ends, and with it the acceleration.
    let input = input(circle(radius_m, w, 4.0), None, [0.0, 3.9]);
    let spec = ImuSpec {
        rate_hz: 256.0,
        mount: SensorMountSpec { offset_m: [2.0, -3.0, 1.0], ..SensorMountSpec::default() },
        ..ImuSpec::default()
    };
    // Every fourth knot is a sample's instant. There the acceleration of the segment before, which is half a step
    // behind on average, and of the one that begins count alike.
    let (sin, cos) = (0.5 * w * STEP_S).sin_cos();
    // At 0 the platform stops coasting.
    for sample in imu(spec, &input).samples().skip(1) {
        // The centre is to the right at 50 m; the arm adds its own distance to it. Up is -9.80665.
        let expected = w * w * (DVec3::new(-2.0, 3.0, 0.0) + radius_m * cos * DVec3::new(sin, cos, 0.0))
            - DVec3::Z * 9.806_65;
        assert!((sample.true_accel_m_s2 - expected).length() < 1e-12, "{}", sample.true_accel_m_s2);
        assert!((sample.true_gyro_rad_s - DVec3::Z * w).length() < 1e-14);
        let from_axis_m = sample.position_ned_m.truncate().length();
        assert!((from_axis_m - DVec3::new(2.0, radius_m + 3.0, 0.0).length()).abs() < 1e-9);
        assert!((sample.velocity_ned_m_s.length() - w * from_axis_m).abs() < 1e-9);
    }
}

#[test]
fn angular_acceleration_acts_on_the_lever_arm() {
    // From -1 s on, so that it is level and at rest at 0.
    let state = BodyState {
        rate_body_rad_s: DVec3::Y * -0.5,
        angular_acceleration_body_rad_s2: DVec3::Y * 0.5,
        ..still(DQuat::from_rotation_y(0.25)).state(0.0)
    };
    let trajectory = Trajectory::listed(vec![-1.0], 4.0, vec![state]).unwrap();
    let spec = ImuSpec {
        mount: SensorMountSpec { offset_m: [2.0, 0.0, 0.0], ..SensorMountSpec::default() },
        ..ImuSpec::default()
    };
    let first = imu(spec, &input(trajectory, None, [0.0, 1.0])).samples().next().unwrap();
    // The nose goes up: alpha x r = (0, 0, -1).
    assert!((first.true_accel_m_s2 - DVec3::new(0.0, 0.0, -1.0 - 9.806_65)).length() < 1e-12);
}

#[test]
fn axes_and_matrix_agree() {
    // Nose up by 30 degrees, at rest: the specific force points up.
    let attitude = DQuat::from_rotation_y(30_f64.to_radians());
    let input = input(still(attitude), None, [0.0, 0.0]);
    let g = 9.806_65;
    let (forward, up) = (0.5 * g, 0.75_f64.sqrt() * g);
    for (axes, expected) in [
        (SensorAxes::Frd, DVec3::new(forward, 0.0, -up)),
        (SensorAxes::Flu, DVec3::new(forward, 0.0, up)),
        (SensorAxes::Rdf, DVec3::new(0.0, -up, forward)),
    ] {
        let imu = imu(ImuSpec { axes, ..ImuSpec::default() }, &input);
        let sample = imu.samples().next().unwrap();
        assert!((sample.accel_m_s2 - expected).length() < 1e-14, "{axes:?} {}", sample.accel_m_s2);
        let matrix = imu.mount.body_from_sensor_matrix();
        let in_body = matrix.transform_vector3(sample.accel_m_s2);
        assert!((in_body - DVec3::new(forward, 0.0, -up)).length() < 1e-14);
    }
    // A mount that is pitched down by 90 degrees has its x where the belly is.
    let mount = SensorMountSpec { angles_deg: [0.0, -90.0, 0.0], offset_m: [1.0, 2.0, 3.0] };
    let matrix = SensorMount::new(&mount, SensorAxes::Frd).body_from_sensor_matrix();
    assert!((matrix.transform_point3(DVec3::X) - DVec3::new(1.0, 2.0, 4.0)).length() < 1e-15);
}

#[test]
fn scale_misalignment_sensitivity_and_bias_are_added_as_defined() {
    let state =
        BodyState { rate_body_rad_s: DVec3::new(0.3, -0.2, 0.5), ..still(DQuat::IDENTITY).state(0.0) };
    let trajectory = Trajectory::listed(vec![0.0], 1.0, vec![state]).unwrap();
    let gyro = TriadSpec {
        scale: PerAxis([0.01, 0.02, -0.03]),
        misalignment_deg: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        bias: PerAxis([0.1, 0.2, 0.3]),
        ..TriadSpec::default()
    };
    let accel = TriadSpec { scale: PerAxis::all(0.1), ..TriadSpec::default() };
    let spec = ImuSpec { gyro, accel, g_sensitivity: PerAxis([0.0, 0.0, 0.01]), ..ImuSpec::default() };
    let sample = imu(spec, &input(trajectory, None, [0.0, 0.0])).samples().next().unwrap();
    let deg = std::f64::consts::PI / 180.0;
    let expected = DVec3::new(
        1.01 * 0.3 + 1.0 * deg * -0.2 + 2.0 * deg * 0.5 + 0.1,
        3.0 * deg * 0.3 + 1.02 * -0.2 + 4.0 * deg * 0.5 + 0.2,
        5.0 * deg * 0.3 + 6.0 * deg * -0.2 + 0.97 * 0.5 + 0.3 + 0.01 * -9.806_65,
    );
    assert!((sample.gyro_rad_s - expected).length() < 1e-14, "{}", sample.gyro_rad_s);
    assert!((sample.accel_m_s2 - DVec3::Z * (1.1 * -9.806_65)).length() < 1e-14);
    assert_eq!(sample.gyro_bias_rad_s, DVec3::new(0.1, 0.2, 0.3));
}

#[test]
fn readings_are_rounded_and_cut() {
    let accel = TriadSpec {
        noise_density: PerAxis::all(0.5),
        quantisation: PerAxis([0.25, 0.0, 0.25]),
        range: PerAxis([2.0, 0.0, 12.1]),
        ..TriadSpec::default()
    };
    let imu = imu(ImuSpec { accel, ..ImuSpec::default() }, &input(still(DQuat::IDENTITY), None, [0.0, 50.0]));
    let (mut cut, mut largest) = (0, 0.0_f64);
    for sample in imu.samples() {
        let [x, y, z] = sample.accel_m_s2.to_array();
        assert!(x.abs() <= 2.0 && (x / 0.25).fract() == 0.0, "{x}");
        assert!(z.abs() <= 12.1 && (z.abs() == 12.1 || (z / 0.25).fract() == 0.0), "{z}");
        assert_eq!(sample.is_saturated, x.abs() == 2.0 || z.abs() == 12.1, "{x} {z}");
        cut += usize::from(sample.is_saturated);
        largest = largest.max(y.abs());
    }
    // White noise of 0.5 sqrt(200) = 7.07 m/s^2: y is not cut, and x is in 78 % of all samples.
    assert!(largest > 20.0, "{largest}");
    assert!(cut > 7000, "{cut}");
}

#[test]
fn stamps_have_offset_and_jitter_and_ascend() {
    let input = input(still(DQuat::IDENTITY), None, [-1.0, 99.0]);
    let with = |clock_offset_ms, jitter_ms| {
        let imu = imu(ImuSpec { clock_offset_ms, jitter_ms, ..ImuSpec::default() }, &input);
        imu.samples().map(|sample| sample.time).collect::<Vec<_>>()
    };
    for (time, k) in with(12.5, 0.0).iter().zip(-200..) {
        assert_eq!((time.sample, time.true_ns), (k, 1_000_000_000_000 + 5_000_000 * k));
        assert_eq!(time.stamp_ns - time.true_ns, 12_500_000);
    }
    let jittered = with(0.0, 0.1);
    let mean2 = jittered.iter().map(|t| ((t.stamp_ns - t.true_ns) as f64 * 1e-6).powi(2)).sum::<f64>();
    // 20 000 samples: 0.5 % standard error.
    assert!(((mean2 / jittered.len() as f64).sqrt() - 0.1).abs() < 0.0025);
    let wild = with(0.0, 50.0);
    assert!(wild.windows(2).all(|pair| pair[0].stamp_ns < pair[1].stamp_ns));
}

#[test]
fn noise_depends_on_seed_name_and_sample_but_not_on_the_window() {
    let triad = TriadSpec {
        noise_density: PerAxis::all(0.01),
        random_walk: PerAxis::all(0.1),
        bias_sigma: PerAxis::all(1.0),
        drift_sigma: PerAxis::all(0.3),
        drift_tau_s: 3.0,
        ..TriadSpec::default()
    };
    let spec = ImuSpec { gyro: triad, accel: triad, jitter_ms: 0.3, ..ImuSpec::default() };
    let over = |span_s| -> Vec<ImuSample> {
        imu(spec.clone(), &input(flown(20.0), None, span_s)).samples().collect()
    };
    let all = over([-2.0, 20.0]);
    for span_s in [[-1.0, 3.0], [0.0, 1.0], [5.0, 7.5], [-2.0, -1.0]] {
        let part = over(span_s);
        let begin = (200.0 * (span_s[0] + 2.0)) as usize;
        assert_eq!(part.as_slice(), &all[begin..begin + part.len()], "{span_s:?}");
    }
    let first = |name: &str, seed| {
        let spec = ImuSpec { name: name.into(), ..spec.clone() };
        Imu::new(&spec, seed, &input(flown(1.0), None, [0.0, 0.0])).unwrap().samples().next().unwrap()
    };
    let base = first("imu0", 12);
    assert_ne!(base.gyro_rad_s, first("imu1", 12).gyro_rad_s);
    assert_ne!(base.gyro_rad_s, first("imu0", 13).gyro_rad_s);
    assert_ne!(base.gyro_bias_rad_s, first("imu0", 13).gyro_bias_rad_s);
}

#[test]
fn spans_have_a_lead_before_and_after_the_frames() {
    let mut scenario = crate::validate::tests::good();
    assert_eq!(span_s(&scenario, 30.0), [-1.0, 31.0]);
    scenario.flight.window_s = Some([5.0, 10.0]);
    scenario.flight.speed = 2.0;
    scenario.camera.fps = 20.0;
    scenario.camera.shutter.delay_ms = 500.0;
    scenario.camera.phase = 0.5;
    let [from_s, to_s] = span_s(&scenario, 30.0);
    // The first frame's centre is at 2.5 + 0.025 - 0.5 s.
    assert!((from_s - 1.025).abs() < 1e-12 && (to_s - 6.0).abs() < 1e-12, "{from_s} {to_s}");
}

#[test]
fn what_cannot_be_simulated_is_refused() {
    let nowhere = input(still(DQuat::IDENTITY), None, [0.0, 1.0]);
    let refused = |spec: ImuSpec, input: &SensorInput| {
        Imu::new(&ImuSpec { name: "imu0".into(), ..spec }, 0, input).unwrap_err().to_string()
    };
    let text = refused(ImuSpec { earth_rate: true, ..ImuSpec::default() }, &nowhere);
    assert!(text.contains("imu \"imu0\": earth_rate needs") && text.contains("flight.origin"), "{text}");
    let long = SensorInput { span_s: [0.0, 1e9], ..nowhere.clone() };
    assert!(refused(ImuSpec::default(), &long).contains("lower rate_hz"));
    let early = SensorInput { span_s: [-1e9, 1.0], ..nowhere };
    assert!(refused(ImuSpec::default(), &early).contains("lower rate_hz"));
}
