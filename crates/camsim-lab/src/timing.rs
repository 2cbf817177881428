//! Processor time, memory, and quantiles of measurements.

pub use camsim_engine::peak_memory_mb;
use std::time::Duration;

/// Converts a duration to milliseconds.
#[must_use]
pub fn ms(duration: Duration) -> f64 {
    1e3 * duration.as_secs_f64()
}

/// Processor time of this program, milliseconds: the sum over all threads, including those that have ended.
/// Other programs hardly affect it. `None` on systems without such a clock.
#[must_use]
pub fn processor_ms() -> Option<f64> {
    #[cfg(unix)]
    {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        Some(1e3 * time.tv_sec as f64 + 1e-6 * time.tv_nsec as f64)
    }
    #[cfg(not(unix))]
    None
}

/// Quantile `part` (0..=1) of the values, interpolated linearly; NaN without values.
#[must_use]
pub fn quantile(values: &[f64], part: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let position = part.clamp(0.0, 1.0) * (sorted.len().saturating_sub(1)) as f64;
    let (below, fraction) = (position.floor() as usize, position.fract());
    let value = |i: usize| sorted.get(i).or(sorted.last()).copied().unwrap_or(f64::NAN);
    value(below) + fraction * (value(below + 1) - value(below))
}

/// Lower quartile, median, upper quartile.
#[must_use]
pub fn quartiles(values: &[f64]) -> [f64; 3] {
    [0.25, 0.5, 0.75].map(|part| quantile(values, part))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_interpolated() {
        assert_eq!(quartiles(&[4.0, 1.0, 3.0, 2.0, 5.0]), [2.0, 3.0, 4.0]);
        assert_eq!(quartiles(&[1.0, 2.0]), [1.25, 1.5, 1.75]);
        assert_eq!(quantile(&[7.0], 0.99), 7.0);
        assert!(quantile(&[], 0.5).is_nan());
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn peak_memory_includes_freed_memory() {
        let before = peak_memory_mb().expect("status");
        let held = std::hint::black_box(vec![1_u8; 256 << 20]);
        drop(held);
        let peak = peak_memory_mb().expect("status");
        assert!(peak > 200.0 && peak < before + 4096.0, "{before} {peak}");
    }

    fn busy_loop(time: Duration) -> f64 {
        let begin = std::time::Instant::now();
        let mut sum = 0.0_f64;
        while begin.elapsed() < time {
            sum += std::hint::black_box(sum).sin();
        }
        sum
    }

    #[test]
    #[cfg(unix)]
    fn processor_time_includes_ended_threads() {
        let mut before = processor_ms().expect("a clock of this process");
        for _ in 0..4 {
            let worker = std::thread::spawn(|| busy_loop(Duration::from_millis(60)));
            worker.join().expect("the thread");
            let used = processor_ms().expect("a clock of this process");
            // Another process may have used this processor for most of the time.
            assert!(used > before + 5.0, "{used} after {before}");
            before = used;
        }
    }
}
