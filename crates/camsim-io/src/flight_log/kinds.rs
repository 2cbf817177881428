//! The kind of a log that is no table: by its content, or by the ending of its name.

use std::path::Path;

use camsim_core::scenario::{FlightSpec, LogFormat};

use super::{LogProblem, RawLog, dataflash, igc, mcap_file, streams, ulog};

/// The format of a binary log or flight record; `None` for tables, XML and formats that are not read.
///
/// The content decides. Where it is that of no known file, `flight.format` or the ending of the name does, so
/// that a damaged file is called by its name.
pub(super) fn detect(path: &Path, bytes: &[u8], spec: &FlightSpec) -> Option<LogFormat> {
    let by_content = if bytes.starts_with(b"ULog") {
        Some(LogFormat::Ulog)
    } else if bytes.starts_with(b"\x89MCAP") {
        Some(LogFormat::Mcap)
    } else if bytes.starts_with(b"\xa3\x95") {
        Some(LogFormat::Dataflash)
    } else if igc::is_igc(bytes) {
        Some(LogFormat::Igc)
    } else {
        None
    };
    let is_binary = |format: &LogFormat| {
        matches!(format, LogFormat::Ulog | LogFormat::Dataflash | LogFormat::Mcap | LogFormat::Igc)
    };
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or("").to_lowercase();
    let by_ending = match ending.as_str() {
        "ulg" => Some(LogFormat::Ulog),
        "mcap" => Some(LogFormat::Mcap),
        "igc" => Some(LogFormat::Igc),
        // Other programs write other files of this ending.
        "bin" if std::str::from_utf8(bytes).is_err() => Some(LogFormat::Dataflash),
        _ => None,
    };
    by_content.or_else(|| Some(spec.format).filter(is_binary)).or(by_ending)
}

/// Reads a log of a format that [`detect`] finds.
///
/// # Errors
/// The file is empty, or as the reader of its format says.
pub(super) fn read(format: LogFormat, bytes: &[u8], spec: &FlightSpec) -> Result<RawLog, LogProblem> {
    if bytes.is_empty() {
        return Err(LogProblem::Empty);
    }
    streams::check_format(spec, format)?;
    Ok(match format {
        LogFormat::Ulog => ulog::read(bytes, spec),
        LogFormat::Dataflash => dataflash::read(bytes, spec),
        LogFormat::Mcap => mcap_file::read(bytes, spec),
        // Names of pilots may be in any encoding.
        LogFormat::Igc => igc::read(&String::from_utf8_lossy(bytes), spec),
        other => Err(format!("{} is not read as a binary log", other.name())),
    }?)
}
