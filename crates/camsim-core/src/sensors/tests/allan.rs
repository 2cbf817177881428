//! Allan deviations of static samples give the four noise figures back.

use super::*;

/// Overlapping Allan deviation of rates at averages over `m` samples of `step_s`, from their integral.
fn allan_deviation(rates: &[f64], step_s: f64, m: usize) -> f64 {
    let mut angle = vec![0.0];
    rates.iter().for_each(|rate| angle.push(angle[angle.len() - 1] + rate * step_s));
    let tau_s = m as f64 * step_s;
    let terms = angle.len() - 2 * m;
    let sum: f64 = (0..terms).map(|k| (angle[k + 2 * m] - 2.0 * angle[k + m] + angle[k]).powi(2)).sum();
    (sum / (2.0 * tau_s * tau_s * terms as f64)).sqrt()
}

/// Noise density and random walk by the mean Allan variances of the three axes at two averages:
/// `N^2 / tau + K^2 tau / 3`.
fn figures(axes: &[Vec<f64>; 3], step_s: f64) -> [f64; 2] {
    let [(t1, v1), (t2, v2)] = [0.05, 5.0].map(|tau_s: f64| {
        let m = (tau_s / step_s).round() as usize;
        let variance = axes.iter().map(|axis| allan_deviation(axis, step_s, m).powi(2)).sum::<f64>() / 3.0;
        (m as f64 * step_s, variance)
    });
    let walk2 = (v2 * t2 - v1 * t1) / ((t2 * t2 - t1 * t1) / 3.0);
    [(v1 * t1 - walk2 * t1 * t1 / 3.0).sqrt(), walk2.sqrt()]
}

#[test]
fn static_noise_has_the_densities_of_its_keys() {
    // Noise and walk are equal at averages of 0.4 s. In half an hour there are 360 averages of 5 s on each of
    // three axes, which leave the walk uncertain by 1 / sqrt(2 * 3 * 360) = 2.2 %.
    let triad = |noise: f64| TriadSpec {
        noise_density: PerAxis::all(noise),
        random_walk: PerAxis::all(4.0 * noise),
        ..TriadSpec::default()
    };
    let spec = ImuSpec { gyro: triad(1.7e-4), accel: triad(2e-3), ..ImuSpec::default() };
    let imu = imu(spec, &input(still(so3::exp(DVec3::new(0.1, 0.3, 1.0))), None, [0.0, 1800.0]));
    let mut gyro: [Vec<f64>; 3] = Default::default();
    let mut accel: [Vec<f64>; 3] = Default::default();
    for sample in imu.samples() {
        for i in 0..3 {
            gyro[i].push(sample.gyro_rad_s[i]);
            accel[i].push(sample.accel_m_s2[i]);
        }
    }
    for (axes, noise) in [(gyro, 1.7e-4), (accel, 2e-3)] {
        let [density, walk] = figures(&axes, 1.0 / 200.0);
        assert!((density / noise - 1.0).abs() < 0.05, "{density} for {noise}");
        assert!((walk / (4.0 * noise) - 1.0).abs() < 0.05, "{walk} for {}", 4.0 * noise);
    }
}

#[test]
fn drift_has_its_deviation_and_correlation_time() {
    let gyro =
        TriadSpec { drift_sigma: PerAxis([0.01, 0.02, 0.03]), drift_tau_s: 0.5, ..TriadSpec::default() };
    let spec = ImuSpec { gyro, ..ImuSpec::default() };
    // An hour holds 7200 correlation times; before the first row of the log the process is the same.
    let imu = imu(spec, &input(still(DQuat::IDENTITY), None, [-600.0, 3000.0]));
    let drift: Vec<DVec3> = imu.samples().map(|sample| sample.gyro_bias_rad_s).collect();
    let mean = |f: &dyn Fn(usize) -> f64, n: usize| (0..n).map(f).sum::<f64>() / n as f64;
    for (i, sigma) in [0.01_f64, 0.02, 0.03].into_iter().enumerate() {
        let variance = mean(&|k| drift[k][i].powi(2), drift.len());
        // Samples of 0.5 s are correlated by 1/e.
        let lagged = mean(&|k| drift[k][i] * drift[k + 100][i], drift.len() - 100);
        // Standard errors: sqrt(2 tau / T) = 1.7 % of the variance; five of them.
        assert!((variance / sigma.powi(2) - 1.0).abs() < 0.085, "{variance}");
        assert!((lagged / sigma.powi(2) - (-1.0_f64).exp()).abs() < 0.085, "{lagged}");
    }
}
