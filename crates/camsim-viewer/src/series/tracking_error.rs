//! Error of the tracker: tracker less log.

/// Formats with three decimals, or with three significant digits below 1.
pub fn format_error(value: f64) -> String {
    let zeros = if value == 0.0 { 0.0 } else { (-value.abs().log10()).floor().clamp(0.0, 5.0) };
    format!("{value:.*}", 3 + zeros as usize)
}

/// Tracking error of one channel, in the channel's unit.
#[derive(Clone, Debug, Default)]
pub struct TrackingError {
    /// Root mean square.
    pub rms: f64,
    /// Largest absolute value.
    pub max_abs: f64,
    /// `[t_s, error]`, the largest absolute error of each step of the plot.
    pub points: Vec<[f64; 2]>,
}

impl TrackingError {
    /// From samples `[t_s, error]` in order of time, `per_step` of them for each point.
    pub fn new(samples: &[[f64; 2]], per_step: usize) -> Self {
        let larger = |a: [f64; 2], b: [f64; 2]| if b[1].abs() > a[1].abs() { b } else { a };
        let points: Vec<[f64; 2]> =
            samples.chunks(per_step.max(1)).filter_map(|step| step.iter().copied().reduce(larger)).collect();
        let squares: f64 = samples.iter().map(|sample| sample[1] * sample[1]).sum();
        let max_abs = points.iter().map(|point| point[1].abs()).fold(0.0, f64::max);
        Self { rms: (squares / samples.len().max(1) as f64).sqrt(), max_abs, points }
    }
}

/// An angle's error, degrees, wrapped to -180..180.
pub fn wrapped_deg(error: f64) -> f64 {
    error - 360.0 * (error / 360.0).round()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimated_errors_keep_their_peak() {
        let mut samples: Vec<[f64; 2]> = (0..1000).map(|k| [f64::from(k), 0.1]).collect();
        samples[517] = [517.0, -3.0];
        let error = TrackingError::new(&samples, 100);
        assert_eq!((error.points.len(), error.points[5], error.max_abs), (10, [517.0, -3.0], 3.0));
        assert!((error.rms - ((999.0 * 0.01 + 9.0) / 1000.0_f64).sqrt()).abs() < 1e-12, "{}", error.rms);
        assert_eq!([wrapped_deg(-358.0), wrapped_deg(3.0), wrapped_deg(190.0)], [2.0, 3.0, -170.0]);
    }

    #[test]
    fn small_errors_have_three_significant_digits() {
        assert_eq!(
            [format_error(0.0), format_error(12.3456), format_error(0.1234), format_error(0.0191)],
            ["0.000", "12.346", "0.123", "0.0191"]
        );
        assert_eq!(format_error(0.000_312), "0.000312");
    }
}
