//! How far the tracker is from the log.

/// Three decimals, or for what is small three digits.
pub fn digits(value: f64) -> String {
    let zeros = if value == 0.0 { 0.0 } else { (-value.abs().log10()).floor().clamp(0.0, 5.0) };
    format!("{value:.*}", 3 + zeros as usize)
}

/// How far the tracker is from the log.
#[derive(Clone, Debug, Default)]
pub struct Errors {
    /// Root of the mean square.
    pub rms: f64,
    /// Without its sign.
    pub largest: f64,
    /// `[t_s, error]`.
    pub points: Vec<[f64; 2]>,
}

impl Errors {
    /// From errors in order of time, so many for each point.
    pub fn of(errors: &[[f64; 2]], for_each: usize) -> Self {
        let larger = |a: [f64; 2], b: [f64; 2]| if b[1].abs() > a[1].abs() { b } else { a };
        let points: Vec<[f64; 2]> =
            errors.chunks(for_each.max(1)).filter_map(|part| part.iter().copied().reduce(larger)).collect();
        let squares: f64 = errors.iter().map(|error| error[1] * error[1]).sum();
        let largest = points.iter().map(|point| point[1].abs()).fold(0.0, f64::max);
        Self { rms: (squares / errors.len().max(1) as f64).sqrt(), largest, points }
    }
}

/// An angle's error does not count turns.
pub fn shorter_deg(error: f64) -> f64 {
    error - 360.0 * (error / 360.0).round()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_keep_their_peaks_however_few_points_there_are() {
        let mut errors: Vec<[f64; 2]> = (0..1000).map(|k| [f64::from(k), 0.1]).collect();
        errors[517] = [517.0, -3.0];
        let found = Errors::of(&errors, 100);
        assert_eq!((found.points.len(), found.points[5], found.largest), (10, [517.0, -3.0], 3.0));
        assert!((found.rms - ((999.0 * 0.01 + 9.0) / 1000.0_f64).sqrt()).abs() < 1e-12, "{}", found.rms);
        assert_eq!([shorter_deg(-358.0), shorter_deg(3.0), shorter_deg(190.0)], [2.0, 3.0, -170.0]);
    }

    #[test]
    fn what_is_small_has_digits_too() {
        assert_eq!(
            [digits(0.0), digits(12.3456), digits(0.1234), digits(0.0191), digits(0.000_312)],
            ["0.000", "12.346", "0.123", "0.0191", "0.000312"]
        );
    }
}
