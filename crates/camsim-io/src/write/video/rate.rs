//! Frame rates as ratios of whole numbers, which video formats ask for.

/// The ratio nearest to a rate: whole numbers, the rates of television (30000/1001), or millionths.
pub(super) fn ratio(fps: f64) -> [u64; 2] {
    let is_near = |denominator: f64, scale: f64| {
        let numerator = (fps * denominator / scale).round() * scale;
        (numerator / denominator - fps).abs() <= 1e-9 * fps && numerator >= 1.0
    };
    if is_near(1.0, 1.0) {
        [fps.round() as u64, 1]
    } else if is_near(1001.0, 1000.0) {
        [((fps * 1.001).round() * 1000.0) as u64, 1001]
    } else {
        [((fps * 1e6).round() as u64).max(1), 1_000_000]
    }
}

#[cfg(test)]
mod tests {
    use super::ratio;

    #[test]
    fn ratios_are_those_of_the_rates() {
        for (fps, expected) in [
            (30.0, [30, 1]),
            (30000.0 / 1001.0, [30000, 1001]),
            (29.97, [29_970_000, 1_000_000]),
            (12.5, [12_500_000, 1_000_000]),
            (1e-9, [1, 1_000_000]),
        ] {
            assert_eq!(ratio(fps), expected, "{fps}");
        }
    }
}
