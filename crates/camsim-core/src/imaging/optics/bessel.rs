//! The Bessel function J1.

/// `2 J1(x) / x`, the transfer function of an even disc, 1 at 0. Abramowitz and Stegun, 9.4.4 and 9.4.6: the
/// absolute error of `J1(x) / x` and of `sqrt(x) J1(x)` is below 1e-7.
pub(super) fn jinc(x: f64) -> f64 {
    const SMALL: [f64; 7] =
        [0.5, -0.562_499_85, 0.210_935_73, -0.039_542_89, 0.004_433_19, -0.000_317_61, 0.000_011_09];
    const AMPLITUDE: [f64; 7] =
        [0.797_884_56, 0.000_001_56, 0.016_596_67, 0.000_171_05, -0.002_495_11, 0.001_136_53, -0.000_200_33];
    const PHASE: [f64; 7] =
        [-2.356_194_49, 0.124_996_12, 0.000_056_50, -0.006_378_79, 0.000_743_48, 0.000_798_24, -0.000_291_66];
    let polynomial = |terms: &[f64], at: f64| terms.iter().rev().fold(0.0, |sum, term| sum * at + term);
    let x = x.abs();
    if x <= 3.0 {
        return 2.0 * polynomial(&SMALL, (x / 3.0) * (x / 3.0));
    }
    let inverse = 3.0 / x;
    2.0 * polynomial(&AMPLITUDE, inverse) * (x + polynomial(&PHASE, inverse)).cos() / (x * x.sqrt())
}

#[cfg(test)]
mod tests {
    use super::jinc;

    #[test]
    fn it_is_bessels_integral() {
        // J1(x) = 1/pi of the integral of cos(t - x sin t) from 0 to pi; the trapezoid rule converges
        // exponentially.
        for x in [1e-3, 0.3, 1.0, 2.9, 3.0, 3.1, 3.831_706, 5.0, 10.0, 33.3, 120.0, 250.0_f64] {
            const STEPS: u32 = 1000;
            let at = |i: u32| {
                let t = std::f64::consts::PI * f64::from(i) / f64::from(STEPS);
                let weight = if i == 0 || i == STEPS { 0.5 } else { 1.0 };
                weight * (t - x * t.sin()).cos()
            };
            let expected = 2.0 / x * (0..=STEPS).map(at).sum::<f64>() / f64::from(STEPS);
            assert!((jinc(x) - expected).abs() < 2e-7, "{x}: {} {expected}", jinc(x));
        }
        assert_eq!(jinc(0.0), 1.0);
    }
}
