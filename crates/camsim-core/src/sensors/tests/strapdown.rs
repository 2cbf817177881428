//! Integration of noise-free inertial samples returns to the truth. The integrator, its gravity and its
//! geodesy share nothing with the sensor.

use super::*;
use crate::scenario::{SensorAxes, SensorMountSpec};

/// Rate of the samples: two of them in each control tick, over which accelerations are constant.
const RATE_HZ: f64 = 800.0;

/// Semi-axes of WGS-84.
const A_M: f64 = 6_378_137.0;
const B_M: f64 = 6_356_752.314_245_179;

/// Earth-centred frame at the origin: its position, and north, east, down.
struct Tangent {
    origin_m: DVec3,
    axes: [DVec3; 3],
}

impl Tangent {
    fn new(lat: f64, lon: f64, height_m: f64) -> Self {
        let up = DVec3::new(lat.cos() * lon.cos(), lat.cos() * lon.sin(), lat.sin());
        // The ellipsoid's point with this normal: (a^2 x, a^2 y, b^2 z) / sqrt(a^2 (x^2 + y^2) + b^2 z^2).
        let squared = DVec3::new(A_M * A_M, A_M * A_M, B_M * B_M);
        let foot_m = squared * up / (squared * up * up).element_sum().sqrt();
        let east = DVec3::new(-lon.sin(), lon.cos(), 0.0);
        Self { origin_m: foot_m + height_m * up, axes: [up.cross(east), east, -up] }
    }

    fn to_local(&self, v: DVec3) -> DVec3 {
        DVec3::new(self.axes[0].dot(v), self.axes[1].dot(v), self.axes[2].dot(v))
    }

    /// Gravity at a local point.
    fn gravity(&self, ned_m: DVec3) -> DVec3 {
        let p = self.origin_m + self.axes[0] * ned_m.x + self.axes[1] * ned_m.y + self.axes[2] * ned_m.z;
        // Foot on the ellipsoid: p - h n with n along the gradient there, by fixed point.
        let (mut foot, mut up, mut height_m) = (p, p.normalize(), 0.0);
        for _ in 0..20 {
            let scale =
                ((foot.x * foot.x + foot.y * foot.y) / (A_M * A_M) + foot.z * foot.z / (B_M * B_M)).sqrt();
            foot /= scale;
            up = DVec3::new(foot.x / (A_M * A_M), foot.y / (A_M * A_M), foot.z / (B_M * B_M)).normalize();
            height_m = (p - foot).dot(up);
            foot = p - height_m * up;
        }
        // Somigliana with both gravities of WGS-84, and its continuation upwards.
        let (gamma_e, gamma_p) = (9.780_325_335_9, 9.832_184_937_8);
        let (s2, c2) = (up.z * up.z, 1.0 - up.z * up.z);
        let on_ground = (A_M * gamma_e * c2 + B_M * gamma_p * s2) / (A_M * A_M * c2 + B_M * B_M * s2).sqrt();
        let f = (A_M - B_M) / A_M;
        let m = 7.292_115e-5_f64.powi(2) * A_M * A_M * B_M / 3.986_004_418e14;
        let h = height_m / A_M;
        let at_height = on_ground * (1.0 - 2.0 * h * (1.0 + f + m - 2.0 * f * s2) + 3.0 * h * h);
        self.to_local(-at_height * up)
    }
}

/// Quaternion (w, x, y, z) product, as plain arrays.
fn times(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

fn pure(v: DVec3) -> [f64; 4] {
    [0.0, v.x, v.y, v.z]
}

fn plus(a: [f64; 4], b: [f64; 4], scale: f64) -> [f64; 4] {
    std::array::from_fn(|i| a[i] + scale * b[i])
}

/// RK4 step of `q' = (q w - e q) / 2` over `h`, with `w` given at its begin, middle and end.
fn turned(q: [f64; 4], w: [DVec3; 3], earth: DVec3, h: f64) -> [f64; 4] {
    let rate =
        |q: [f64; 4], w: DVec3| plus([0.0; 4], plus(times(q, pure(w)), times(pure(earth), q), -1.0), 0.5);
    let k1 = rate(q, w[0]);
    let k2 = rate(plus(q, k1, 0.5 * h), w[1]);
    let k3 = rate(plus(q, k2, 0.5 * h), w[1]);
    let k4 = rate(plus(q, k3, h), w[2]);
    plus(plus(plus(plus(q, k1, h / 6.0), k2, h / 3.0), k3, h / 3.0), k4, h / 6.0)
}

fn rotated(q: [f64; 4], v: DVec3) -> DVec3 {
    let [_, x, y, z] = times(times(q, pure(v)), [q[0], -q[1], -q[2], -q[3]]);
    DVec3::new(x, y, z)
}

/// Errors after integration over all samples: metres and degrees.
fn errors(samples: &[ImuSample], gravity: &dyn Fn(DVec3) -> DVec3, earth: DVec3) -> [f64; 2] {
    let first = &samples[0];
    let start = first.ned_from_sensor;
    let mut q = [start.w, start.x, start.y, start.z];
    let (mut p, mut v) = (first.position_ned_m, first.velocity_ned_m_s);
    let h = 2.0 / RATE_HZ;
    for tick in samples.windows(3).step_by(2) {
        let [w0, w1, w2] = [0, 1, 2].map(|i| tick[i].gyro_rad_s);
        let middle = turned(q, [w0, 0.5 * (w0 + w1), w1], earth, 0.5 * h);
        let force = rotated(middle, tick[1].accel_m_s2);
        let coriolis = |v: DVec3| 2.0 * earth.cross(v);
        let p_middle = p + 0.5 * h * v;
        let a = force + gravity(p_middle) - coriolis(v);
        let a = force + gravity(p_middle) - coriolis(v + 0.5 * h * a);
        p += h * (v + 0.5 * h * a);
        v += h * a;
        q = turned(middle, [w1, 0.5 * (w1 + w2), w2], earth, 0.5 * h);
    }
    let last = samples[samples.len() - 1];
    let got = DQuat::from_xyzw(q[1], q[2], q[3], q[0]).normalize();
    let angle = so3::log(last.ned_from_sensor.inverse() * got).length().to_degrees();
    [(p - last.position_ned_m).length(), angle]
}

fn minute(spec: ImuSpec, frame: Option<LocalFrame>) -> Vec<ImuSample> {
    let input = input(flown(60.0), frame, [0.0, 60.0]);
    let samples: Vec<ImuSample> = imu(ImuSpec { rate_hz: RATE_HZ, ..spec }, &input).samples().collect();
    assert_eq!(samples.len(), 48_001);
    samples
}

#[test]
fn a_minute_of_strapdown_integration_returns_to_the_true_pose() {
    let samples = minute(ImuSpec::default(), None);
    let [off_m, off_deg] = errors(&samples, &|_| DVec3::new(0.0, 0.0, 9.806_65), DVec3::ZERO);
    assert!(off_m < 1e-3 && off_deg < 1e-4, "{off_m} m, {off_deg} deg");
    // The flight is one to be measured: another gravity, or a gyroscope that is off by a hundredth of a
    // degree an hour, shows.
    let [off_m, _] = errors(&samples, &|_| DVec3::new(0.0, 0.0, 9.806_66), DVec3::ZERO);
    assert!(off_m > 1e-2, "{off_m} m");
}

#[test]
fn the_same_on_a_lever_arm_on_the_turning_earth() {
    let spec = ImuSpec {
        mount: SensorMountSpec { angles_deg: [10.0, -35.0, 120.0], offset_m: [1.5, -0.4, 0.3] },
        axes: SensorAxes::Flu,
        earth_rate: true,
        ..ImuSpec::default()
    };
    let samples = minute(spec, Some(local_frame()));
    let tangent = Tangent::new(46.7_f64.to_radians(), 9.85_f64.to_radians(), 2100.0);
    let earth = tangent.to_local(DVec3::new(0.0, 0.0, 7.292_115e-5));
    let gravity = |p: DVec3| tangent.gravity(p);
    let [off_m, off_deg] = errors(&samples, &gravity, earth);
    assert!(off_m < 1e-3 && off_deg < 1e-4, "{off_m} m, {off_deg} deg");
    // Without the Earth's rotation it is a quarter of a degree a minute.
    let [off_m, off_deg] = errors(&samples, &gravity, DVec3::ZERO);
    assert!(off_m > 1.0 && (off_deg - 0.25).abs() < 0.1, "{off_m} m, {off_deg} deg");
}

/// Largest distance from the path, metres, of the midpoint rule over all samples, which begin on a straight line:
/// means of the forces of two samples. Rates are integrated through four samples, since the mean of two alone turns
/// 200 Hz into an attitude that is off by 1e-6 rad, 4 mm a minute by gravity.
fn midpoint_error_m(samples: &[ImuSample], gravity: DVec3) -> f64 {
    let first = &samples[0];
    let (mut p, mut v, start) = (first.position_ned_m, first.velocity_ned_m_s, first.ned_from_sensor);
    let mut q = [start.w, start.x, start.y, start.z];
    let mut most_m = 0.0_f64;
    for k in 1..samples.len() {
        let (from, to) = (&samples[k - 1], &samples[k]);
        let [before, after] = [k.saturating_sub(2), (k + 1).min(samples.len() - 1)].map(|k| &samples[k]);
        let h = to.time.t_s - from.time.t_s;
        let (inner, outer) = (from.gyro_rad_s + to.gyro_rad_s, before.gyro_rad_s + after.gyro_rad_s);
        // The product of both rates is what a rotation vector has beside the integral of the rate (coning).
        let turn = h / 24.0 * (13.0 * inner - outer) + h * h / 12.0 * from.gyro_rad_s.cross(to.gyro_rad_s);
        let half = 0.5 * turn.length();
        let axis = if half > 0.0 { turn / (2.0 * half) } else { DVec3::ZERO };
        let next = times(q, [half.cos(), half.sin() * axis.x, half.sin() * axis.y, half.sin() * axis.z]);
        let a = 0.5 * (rotated(q, from.accel_m_s2) + rotated(next, to.accel_m_s2)) + gravity;
        p += h * (v + 0.5 * h * a);
        v += h * a;
        q = next;
        most_m = most_m.max((p - to.position_ned_m).length());
    }
    most_m
}

#[test]
fn a_minute_of_samples_at_usual_rates_returns_the_path() {
    // The rate of `sqrt` has a bend at every tick: integrated as a smooth one it turns by up to 5e-7 rad less.
    for (kind, most_m) in [(TrackerKind::Spline, 1e-3), (TrackerKind::Sqrt, 2e-3)] {
        let input = input(flown_by(kind, 40.0, 60.0), None, [-1.0, 61.0]);
        for rate_hz in [200.0, 400.0] {
            let samples: Vec<ImuSample> =
                imu(ImuSpec { rate_hz, ..ImuSpec::default() }, &input).samples().collect();
            assert_eq!(samples.len(), (62.0 * rate_hz) as usize + 1);
            let off_m = midpoint_error_m(&samples, DVec3::new(0.0, 0.0, 9.806_65));
            assert!(off_m < most_m, "{kind:?} at {rate_hz} Hz: {off_m} m");
        }
    }
}
