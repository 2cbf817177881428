//! Memory of the process.

/// Peak memory of this process, MB (`VmHWM` in `/proc/self/status`). `None` on systems without this file.
#[must_use]
pub fn peak_memory_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let kib = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?.split_whitespace().next()?;
    Some(1.024e-3 * kib.parse::<f64>().ok()?)
}
