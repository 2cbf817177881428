//! Malformed and unusual logs: each is read as the right flight, or refused with a message that helps. None
//! is silently read as another flight.

#![allow(clippy::unwrap_used)]

mod columns;
mod files;
mod formats;
mod records;
mod times;
mod units;

use camsim_core::scenario::{
    AngleKind, AngleUnit, AttitudeSource, FlightHeight, HeightSource, LogFormat, TimeUnit,
};

use super::{tests::spec, *};

thread_local! {
    static FAULTS: std::cell::RefCell<Vec<String>> = const { std::cell::RefCell::new(Vec::new()) };
}

/// Fails the test when dropped, with all faults that were collected, not only the first one.
struct FaultReport;

impl Drop for FaultReport {
    fn drop(&mut self) {
        let faults = FAULTS.take();
        assert!(std::thread::panicking() || faults.is_empty(), "{}", faults.join("\n"));
    }
}

/// Adds a fault to the report of the running test.
fn fault(text: String) {
    FAULTS.with_borrow_mut(|faults| faults.push(text));
}

fn read_with(content: &[u8], spec: &FlightSpec) -> Result<FlightLog, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, content).unwrap();
    read_flight_log(&path, spec, HeightConversion::None).map_err(|error| error.to_string())
}

/// A log with a header and 21 rows over 20 s, 200 m north and 20 m up. In the pattern of a row, `T` stands
/// for seconds, `LAT` and `LON` for degrees, `N` for metres north, `H` for the height in metres.
fn log(header: &str, pattern: &str) -> String {
    scaled(header, pattern, 1.0)
}

/// As [`log`], with times of another unit, of which there are `per_second` in a second.
fn scaled(header: &str, pattern: &str, per_second: f64) -> String {
    let mut text = if header.is_empty() { String::new() } else { format!("{header}\n") };
    for i in 0..21 {
        let t = f64::from(i);
        let row = pattern
            .replace("LAT", &format!("{:.9}", 47.0 + t * 8.994_6e-5))
            .replace("LON", "8.0")
            .replace('T', &format!("{}", t * per_second))
            .replace('N', &format!("{}", 10.0 * t))
            .replace('H', &format!("{}", 500.0 + t));
        text += &row;
        text += "\n";
    }
    text
}

/// Checks that a log lasts 20 s and moves 200 m north and 20 m up, and that a warning contains `warning`;
/// there is no warning if that is empty.
fn assert_flies(what: &str, content: &str, spec: &FlightSpec, warning: &str) {
    let log = match read_with(content.as_bytes(), spec) {
        Ok(log) => log,
        Err(error) => return fault(format!("{what}: {error}")),
    };
    let moved = log.rows.last().unwrap().position_ned_m - log.rows[0].position_ned_m;
    if !((log.duration_s() - 20.0).abs() < 1e-6
        && (moved.x - 200.0).abs() < 0.1
        && (moved.z + 20.0).abs() < 0.1)
    {
        fault(format!("{what}: {moved} in {} s", log.duration_s()));
    }
    let warnings: Vec<&str> =
        log.notes.iter().filter(|note| note.is_warning).map(|note| note.text.as_str()).collect();
    if warnings.is_empty() != warning.is_empty()
        || !(warning.is_empty() || warnings.iter().any(|text| text.contains(warning)))
    {
        fault(format!("{what}: {warnings:?}"));
    }
}

/// Checks that a log is refused with a message that contains all `words`.
fn assert_refused(what: &str, content: &[u8], spec: &FlightSpec, words: &[&str]) {
    match read_with(content, spec) {
        Ok(log) => {
            fault(format!("{what}: read, {} rows, {} s, {:?}", log.rows.len(), log.duration_s(), log.notes))
        }
        Err(error) => {
            for word in words.iter().filter(|word| !error.contains(**word)) {
                fault(format!("{what}: `{error}` lacks `{word}`"));
            }
        }
    }
}

fn track() -> FlightSpec {
    FlightSpec { attitude: AttitudeSource::Track, ..spec(LogFormat::Auto) }
}

fn auto() -> FlightSpec {
    spec(LogFormat::Auto)
}

#[test]
fn logs_md_is_up_to_date() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/inputs/LOGS.md");
    if std::env::var_os("CAMSIM_BLESS").is_some() {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, page()).unwrap();
    }
    assert_eq!(std::fs::read_to_string(&path).unwrap(), page(), "set CAMSIM_BLESS=1 to write it");
}
