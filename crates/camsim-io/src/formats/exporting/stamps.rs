//! Stamps as names of files, and clocks without times before 0.

use camsim_core::{scenario::DatasetFormat, sensors::ImuSample};

use super::csv_rows::CsvRows;
use super::imu::{descriptions, imus};
use super::{DatasetError, RunFolder};
use crate::columns::T_NS;
use crate::formats::layout;

const SECOND_NS: i64 = 1_000_000_000;

/// A stamp in nanoseconds with 19 digits, as many as those of our days have: the order of names is that of times.
pub(crate) fn name_ns(t_ns: i64) -> String {
    format!("{t_ns:019}")
}

/// A stamp in seconds with ten digits before the point and nine behind it.
pub(crate) fn name_s(t_ns: i64) -> String {
    format!("{:010}.{:09}", t_ns / SECOND_NS, t_ns % SECOND_NS)
}

/// The run with stamps that the layout can hold: so many whole seconds later that none is before 0; and a note
/// that says so.
pub(crate) fn fitted(
    run: &RunFolder,
    format: DatasetFormat,
) -> Result<(RunFolder, Option<String>), DatasetError> {
    if !layout(format).begins_at_zero {
        return Ok((run.clone(), None));
    }
    let first_ns = first_ns(run)?;
    if first_ns >= 0 {
        return Ok((run.clone(), None));
    }
    let shift_s = first_ns.unsigned_abs().div_ceil(SECOND_NS.unsigned_abs());
    let shift_ns = i64::try_from(shift_s).ok().and_then(|s| s.checked_mul(SECOND_NS)).ok_or_else(|| {
        DatasetError::Refused(format!(
            "the run's stamps begin at {first_ns} ns: set output.stamps = \"zero\""
        ))
    })?;
    let epoch_ns = run.manifest().scenario.output.epoch_ns.saturating_add(shift_ns.unsigned_abs());
    let note = format!(
        "{} has no times before 0, and the run's begin at {} s: all stamps are {shift_s} s later than those of the run \
         (output.stamps = \"zero\" with output.epoch_ns = {epoch_ns} renders such stamps)",
        format.name(),
        first_ns as f64 / 1e9
    );
    Ok((run.shifted(shift_ns), Some(note)))
}

/// The earliest stamp of all that a layout may write.
fn first_ns(run: &RunFolder) -> Result<i64, DatasetError> {
    let mut first_ns = i64::MAX;
    for camera in &run.cameras {
        // Stamps with faults do not ascend.
        for frame in &camera.frames {
            first_ns =
                first_ns.min(frame.stamp_ns).min(camera.centre_ns(frame)).min(camera.true_centre_ns(frame));
        }
    }
    for sensor in descriptions(run)? {
        // All sensors have it.
        let mut rows = CsvRows::open::<ImuSample>(&sensor.table, &[T_NS])?;
        if rows.advance()? {
            first_ns = first_ns.min(rows.whole(0)?);
        }
    }
    if let Some(state) = run.platform()?.next_state()? {
        // The true motion is on the clock of a sensor in some layouts.
        let offsets = imus(run)?.into_iter().map(|imu| imu.clock_offset_ns());
        let offsets = offsets.chain(run.cameras.iter().map(|camera| camera.spec.clock_offset_ns()));
        first_ns = first_ns.min(state.t_ns.saturating_add(offsets.fold(0, i64::min)));
    }
    Ok(first_ns)
}
