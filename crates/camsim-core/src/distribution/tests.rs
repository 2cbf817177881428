use super::*;

const COUNT: u64 = 200_000;

/// Kolmogorov's distance between `COUNT` draws and a distribution function, times the root of the count: above
/// 1.95 once in a thousand times, above 2.7 once in a million.
fn distance(draws: Draws, distribution: &Distribution, cdf: impl Fn(f64) -> f64) -> f64 {
    distribution.check().expect("legal");
    let mut values: Vec<f64> = (0..COUNT).map(|k| distribution.quantile(draws.unit(k))).collect();
    values.sort_by(f64::total_cmp);
    let n = COUNT as f64;
    let at = |(i, value): (usize, &f64)| {
        let p = cdf(*value);
        (p - i as f64 / n).abs().max((p - (i + 1) as f64 / n).abs())
    };
    values.iter().enumerate().map(at).fold(0.0, f64::max) * n.sqrt()
}

/// The standard normal's distribution function, by Simpson's rule over its density from 0.
fn normal_cdf(z: f64) -> f64 {
    const STEPS: i32 = 2000;
    let density = |z: f64| (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
    let step = z / f64::from(STEPS);
    let weight = |i: i32| if i == 0 || i == STEPS { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
    0.5 + (0..=STEPS).map(|i| weight(i) * density(f64::from(i) * step)).sum::<f64>() * step / 3.0
}

#[test]
fn draws_have_the_closed_form_of_their_distribution() {
    let draws = Draws::new(7, "camera.shutter.exposure_ms");
    let uniform = Distribution::Uniform { low: 2.0, high: 10.0 };
    assert!(distance(draws, &uniform, |v| (v - 2.0) / 8.0) < 2.7);
    let log = Distribution::LogUniform { low: 1e-3, high: 10.0 };
    assert!(distance(draws, &log, |v| (v / 1e-3).ln() / 1e4_f64.ln()) < 2.7);
    let normal = Distribution::Normal { mean: -4.0, sigma: 0.5, clip: [f64::NEG_INFINITY, f64::INFINITY] };
    assert!(distance(draws, &normal, |v| normal_cdf((v + 4.0) / 0.5)) < 2.7);
    for clip in [[-1.0, 2.0], [1.0, 2.5], [-3.0, -0.5]] {
        let cut = Distribution::Normal { mean: 0.0, sigma: 1.0, clip };
        let [from, to] = clip.map(normal_cdf);
        assert!(distance(draws, &cut, |v| (normal_cdf(v) - from) / (to - from)) < 2.7, "{clip:?}");
    }
    // A wrong distribution is found.
    assert!(distance(draws, &uniform, |v| ((v - 2.0) / 8.0).powf(1.02)) > 2.7);
}

#[test]
fn moments_of_draws_are_those_of_the_unit_interval() {
    // 48 bits: mean 1/2, variance 1/12, within five standard errors.
    let n = COUNT as f64;
    let draws = Draws::new(0, "a");
    let units: Vec<f64> = (0..COUNT).map(|k| draws.unit(k) - 0.5).collect();
    let mean = units.iter().sum::<f64>() / n;
    let variance = units.iter().map(|u| u * u).sum::<f64>() / n;
    assert!(mean.abs() < 5.0 * (1.0 / 12.0 / n).sqrt(), "{mean}");
    assert!((variance - 1.0 / 12.0).abs() < 5.0 * (1.0 / 180.0 / n).sqrt(), "{variance}");
}

#[test]
fn names_indices_and_seeds_are_uncorrelated() {
    let series = |seed: u64, name: &str, from: u64| -> Vec<f64> {
        let draws = Draws::new(seed, name);
        (from..from + COUNT).map(|k| draws.unit(k) - 0.5).collect()
    };
    let one = series(7, "camera.fps", 0);
    for (other, what) in [
        (series(7, "camera.fps", 1), "the next index"),
        (series(7, "camera.fps", 1 << 32), "a far index"),
        (series(8, "camera.fps", 0), "the next seed"),
        (series(7, "camera.fpt", 0), "another name"),
    ] {
        let product = one.iter().zip(&other).map(|(a, b)| a * b).sum::<f64>() / COUNT as f64;
        // Standard error of the mean product of independent numbers of variance 1/12.
        assert!(product.abs() < 5.0 / 12.0 / (COUNT as f64).sqrt(), "{what}: {product}");
    }
}

#[test]
fn integers_and_choices_come_up_by_their_fractions() {
    let draws = Draws::new(3, "n");
    let dice = Distribution::Integer { low: -1, high: 4 };
    let mut counts = [0_u32; 6];
    let fractions = [0.5, 0.0, 1.5, 2.0];
    let mut chosen = [0_u32; 4];
    for k in 0..COUNT {
        counts[(dice.quantile(draws.unit(k)) + 1.0) as usize] += 1;
        chosen[choose(&fractions, draws.unit(k))] += 1;
    }
    // Chi-squared of 5 degrees of freedom: above 35 once in a million.
    let expected = COUNT as f64 / 6.0;
    let chi2: f64 = counts.iter().map(|&n| (f64::from(n) - expected).powi(2) / expected).sum();
    assert!(chi2 < 35.0, "{counts:?}");
    assert_eq!(chosen[1], 0);
    for (n, fraction) in chosen.iter().zip(fractions) {
        let p = fraction / 4.0;
        let tolerance = 5.0 * (COUNT as f64 * p * (1.0 - p)).sqrt();
        assert!((f64::from(*n) - COUNT as f64 * p).abs() <= tolerance, "{chosen:?}");
    }
    assert_eq!([choose(&[1.0, 0.0], 1.0), choose(&[], 0.5)], [0, 0]);
}

#[test]
fn values_are_short_and_stay_within_their_ends() {
    let third = Distribution::Uniform { low: 1.0 / 3.0, high: 1.0 / 3.0 };
    assert_eq!(third.quantile(0.5), 1.0 / 3.0, "not rounded beyond the ends");
    let value = Distribution::Uniform { low: 0.0, high: 1.0 }.quantile(1.0 / 3.0);
    assert_eq!(value, 0.333_333_333_333);
    let far = Distribution::Normal { mean: 0.0, sigma: 1.0, clip: [4.0, 5.0] };
    far.check().expect("legal");
    for unit in [1e-14, 0.3, 1.0 - 1e-14] {
        assert!((4.0..=5.0).contains(&far.quantile(unit)), "{unit}");
    }
}

#[test]
fn numbers_that_make_no_distribution_are_refused() {
    let normal = |sigma: f64, clip: [f64; 2]| Distribution::Normal { mean: 0.0, sigma, clip };
    for (distribution, wanted) in [
        (Distribution::Uniform { low: 2.0, high: 1.0 }, "lower number first"),
        (Distribution::Uniform { low: f64::NAN, high: 1.0 }, "finite"),
        (Distribution::LogUniform { low: 0.0, high: 1.0 }, "above 0"),
        (normal(0.0, [-1.0, 1.0]), "above 0"),
        (normal(1.0, [1.0, -1.0]), "lower number first"),
        (normal(1.0, [40.0, 50.0]), "hardly ever"),
        (Distribution::Integer { low: 2, high: 1 }, "lower number first"),
        (Distribution::Integer { low: i64::MIN, high: i64::MAX }, "2^32"),
    ] {
        let error = distribution.check().expect_err("refused");
        assert!(error.contains(wanted), "{distribution:?}: {error}");
    }
}
