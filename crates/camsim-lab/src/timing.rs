//! Clock, processor time and memory, and what is said about a set of such times.

pub use camsim_engine::peak_memory_mb;
use std::time::Duration;

/// Milliseconds.
#[must_use]
pub fn ms(duration: Duration) -> f64 {
    1e3 * duration.as_secs_f64()
}

/// Time that this program's threads have had a processor, milliseconds; those that have ended count too, so
/// that it never falls. With a software adapter that is the work itself, whatever else runs on the machine.
/// `None` on systems without such a clock.
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

/// The value below which `part` of the values lie, 0..=1, linear between neighbours; NaN without values.
#[must_use]
pub fn quantile(values: &[f64], part: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let place = part.clamp(0.0, 1.0) * (sorted.len().saturating_sub(1)) as f64;
    let (below, rest) = (place.floor() as usize, place.fract());
    let value = |i: usize| sorted.get(i).or(sorted.last()).copied().unwrap_or(f64::NAN);
    value(below) + rest * (value(below + 1) - value(below))
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
    fn quantiles_lie_between_their_neighbours() {
        assert_eq!(quartiles(&[4.0, 1.0, 3.0, 2.0, 5.0]), [2.0, 3.0, 4.0]);
        assert_eq!(quartiles(&[1.0, 2.0]), [1.25, 1.5, 1.75]);
        assert_eq!(quantile(&[7.0], 0.99), 7.0);
        assert!(quantile(&[], 0.5).is_nan());
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn memory_once_held_stays_in_the_peak() {
        let before = peak_memory_mb().expect("status");
        let held = std::hint::black_box(vec![1_u8; 256 << 20]);
        drop(held);
        let peak = peak_memory_mb().expect("status");
        assert!(peak > 200.0 && peak < before + 4096.0, "{before} {peak}");
    }

    fn work_for(time: Duration) -> f64 {
        let begin = std::time::Instant::now();
        let mut sum = 0.0_f64;
        while begin.elapsed() < time {
            sum += std::hint::black_box(sum).sin();
        }
        sum
    }

    #[test]
    #[cfg(unix)]
    fn work_shows_in_processor_time_and_stays_there_when_its_thread_ends() {
        let mut before = processor_ms().expect("a clock of this process");
        for _ in 0..4 {
            let worker = std::thread::spawn(|| work_for(Duration::from_millis(60)));
            worker.join().expect("work");
            let used = processor_ms().expect("a clock of this process");
            // Another process may have had this processor for most of the time.
            assert!(used > before + 5.0, "{used} after {before}");
            before = used;
        }
    }
}
