//! The steps from raw rows to a log, in order.

use glam::DVec3;

use super::{
    CleaningReport, FlightLog, HeightConversion, LogError, LogOptions, LogRow, RawAttitude, RawPosition,
    RawRow,
    attitude::{self, Attitude},
    null_rows,
    outliers::{self, OutlierSignal},
    track_attitude,
};
use crate::{
    geodesy::{Geodetic, GeoidCache, LocalFrame},
    scenario::{AngleKind, AttitudeSource},
};

/// Rows closer than this are one row written twice: their velocity would be rounding noise (the FSR2015 log
/// has steps of 50 us).
const MERGE_NS: i128 = 1_000_000;
const GAP_S: f64 = 1.0;
/// Largest distance of a plausible position from the origin.
const MAX_DISTANCE_M: f64 = 1e8;
/// Least deviation of a position that counts as a spike.
const SPIKE_FLOOR_M: f64 = 0.05;
/// Least deviation of an attitude that counts as a glitch.
const GLITCH_FLOOR_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;
/// Most rows inserted between two rows; 2500 turns in one step are no flight.
const MAX_PIECES: f64 = 10_000.0;

/// A row during cleaning: position in local NED, attitude relative to its own tangent frame.
#[derive(Clone, Copy, Debug)]
struct CleanRow {
    line: usize,
    t_ns: i64,
    position_ned_m: DVec3,
    attitude: Attitude,
    /// Whether the file states an attitude here, usable or not.
    states_attitude: bool,
}

pub(super) fn clean(raw: &[RawRow], options: &LogOptions<'_>) -> Result<FlightLog, LogError> {
    check_options(options)?;
    let first = raw.first().ok_or(LogError::Empty)?;
    let mut report = CleaningReport { rows_read: raw.len(), ..CleaningReport::default() };

    let mut usable = drop_unusable(raw, &mut report);
    if usable.is_empty() {
        return Err(LogError::NoGoodRow { rows: raw.len(), line: first.line });
    }
    check_one_kind(&usable)?;
    sort_by_time(&mut usable, &mut report);
    null_rows::drop(&mut usable, &mut report);

    let uses_log_attitude = options.attitude == AttitudeSource::Log;
    let continuous = uses_log_attitude && attitude::is_continuous(&usable, options.angles);
    report.angles = if continuous { AngleKind::Continuous } else { AngleKind::Wrapped };
    let (mut rows, frame) = localise(&usable, options, continuous, &mut report)?;
    // Attitudes of local logs are relative to the frame's own axes, wherever the row is.
    let tangent_frame = frame.filter(|_| matches!(usable[0].position, RawPosition::Geodetic(_)));

    drop_spikes(&mut rows, &mut report);
    if uses_log_attitude {
        if rows.iter().all(|row| row.attitude.is_missing()) {
            return Err(LogError::NoAttitude);
        }
        mark_attitudes(&mut rows, &mut report);
    }
    check_clock(&rows)?;
    merge(&mut rows, &mut report);
    if uses_log_attitude {
        fill_attitudes(&mut rows);
    }
    count_gaps(&rows, &mut report);
    if continuous {
        rows = insert_turns(&rows, &mut report)?;
    }

    let epoch_ns = rows[0].t_ns;
    let mut log_rows: Vec<LogRow> = rows
        .iter()
        .map(|row| {
            let ned_from_local =
                tangent_frame.map(|frame| frame.ned_from_local(frame.geodetic_from_ned(row.position_ned_m)));
            let local_from_body = row.attitude.rotation();
            LogRow {
                t_s: seconds_between(epoch_ns, row.t_ns) / options.speed,
                position_ned_m: row.position_ned_m,
                ned_from_body: ned_from_local
                    .map_or(local_from_body, |rotation| (rotation * local_from_body).normalize()),
            }
        })
        .collect();
    if !uses_log_attitude {
        track_attitude::fill(&mut log_rows, tangent_frame.as_ref());
    }
    let repaired = report.take_lines();
    if !repaired.is_empty() {
        let times = raw.iter().filter(|row| repaired.contains(&row.line)).filter_map(|row| row.t_ns);
        report.repaired_s = times.map(|t_ns| seconds_between(epoch_ns, t_ns) / options.speed).collect();
        report.repaired_s.sort_by(f64::total_cmp);
    }
    Ok(FlightLog { rows: log_rows, epoch_ns, frame, report, notes: Vec::new() })
}

fn check_options(options: &LogOptions<'_>) -> Result<(), LogError> {
    if !(options.speed > 0.0 && options.speed.is_finite()) {
        return Err(LogError::BadSpeed(options.speed));
    }
    if options.origin.is_some_and(|origin| !origin.is_valid()) {
        return Err(LogError::BadOrigin);
    }
    Ok(())
}

fn drop_unusable<'a>(raw: &'a [RawRow], report: &mut CleaningReport) -> Vec<&'a RawRow> {
    raw.iter()
        .filter(|row| {
            let has_position = match row.position {
                RawPosition::Geodetic(at) => at.is_valid(),
                // Also false for NaN.
                RawPosition::Ned(ned) => ned.abs().max_element() <= MAX_DISTANCE_M && !ned.is_nan(),
            };
            let good = has_position && row.t_ns.is_some();
            if !good {
                report.unusable.add(row.line);
            }
            good
        })
        .collect()
}

fn check_one_kind(rows: &[&RawRow]) -> Result<(), LogError> {
    let is_geodetic = |row: &RawRow| matches!(row.position, RawPosition::Geodetic(_));
    if let Some(other) = rows.iter().find(|row| is_geodetic(row) != is_geodetic(rows[0])) {
        return Err(LogError::MixedPositions { line: other.line });
    }
    let is_euler = |row: &RawRow| match row.attitude {
        RawAttitude::EulerDeg(_) => Some(true),
        RawAttitude::Quaternion(_) => Some(false),
        RawAttitude::None => None,
    };
    let kind = rows.iter().find_map(|row| is_euler(row));
    match rows.iter().find(|row| is_euler(row).is_some_and(|euler| Some(euler) != kind)) {
        Some(other) => Err(LogError::MixedAttitudes { line: other.line }),
        None => Ok(()),
    }
}

fn sort_by_time(rows: &mut [&RawRow], report: &mut CleaningReport) {
    let mut latest = None;
    for row in rows.iter() {
        if row.t_ns < latest {
            report.out_of_order.add(row.line);
        }
        latest = latest.max(row.t_ns);
    }
    rows.sort_by_key(|row| row.t_ns);
}

/// Converts positions to local NED and angles to attitudes; also returns the frame.
fn localise(
    usable: &[&RawRow],
    options: &LogOptions<'_>,
    continuous: bool,
    report: &mut CleaningReport,
) -> Result<(Vec<CleanRow>, Option<LocalFrame>), LogError> {
    let mut geoid = GeoidCache::new();
    let mut frame = options.origin.map(LocalFrame::new);
    let ground_m = ground_heights(usable, options.height, frame.as_ref(), report)?;
    let mut convert = |row: usize, at: Geodetic| {
        let by_m = match options.height {
            HeightConversion::None => 0.0,
            HeightConversion::MslToEllipsoid => geoid.undulation_m(at),
            HeightConversion::EllipsoidToMsl => -geoid.undulation_m(at),
            HeightConversion::AboveGround(_) => ground_m[row],
            HeightConversion::AboveTakeoff(_) => ground_m[0],
        };
        Geodetic { height_m: at.height_m + by_m, ..at }
    };
    let rows = usable
        .iter()
        .enumerate()
        .filter_map(|(index, row)| {
            let position_ned_m = match row.position {
                RawPosition::Geodetic(geodetic) => {
                    let geodetic = convert(index, geodetic);
                    frame.get_or_insert_with(|| LocalFrame::new(geodetic)).ned_from_geodetic(geodetic)
                }
                RawPosition::Ned(ned) => match &frame {
                    Some(frame) if !ground_m.is_empty() => {
                        frame.ned_from_geodetic(convert(index, level_with_height(frame, ned)))
                    }
                    _ => ned,
                },
            };
            let attitude = Attitude::from_raw(row.attitude, continuous);
            let states_attitude = row.attitude != RawAttitude::None;
            row.t_ns.map(|t_ns| CleanRow { line: row.line, t_ns, position_ned_m, attitude, states_attitude })
        })
        .collect();
    Ok((rows, frame))
}

/// A local position as latitude and longitude of the point below it on the frame's plane, and the height above that.
fn level_with_height(frame: &LocalFrame, ned_m: DVec3) -> Geodetic {
    Geodetic { height_m: -ned_m.z, ..frame.geodetic_from_ned(ned_m.with_z(0.0)) }
}

/// Height of the ground below each row, or below the first; empty where no heights are above it.
///
/// # Errors
/// It is not known below more than half of them.
fn ground_heights(
    usable: &[&RawRow],
    height: HeightConversion<'_>,
    frame: Option<&LocalFrame>,
    report: &mut CleaningReport,
) -> Result<Vec<f64>, LogError> {
    let (ground, count) = match height {
        HeightConversion::AboveGround(ground) => (ground, usable.len()),
        HeightConversion::AboveTakeoff(ground) => (ground, 1),
        _ => return Ok(Vec::new()),
    };
    let at = |row: &RawRow| match (row.position, frame) {
        (RawPosition::Geodetic(geodetic), _) => ground(geodetic),
        (RawPosition::Ned(ned), Some(frame)) => ground(level_with_height(frame, ned)),
        // Without a frame there is no terrain, which the caller refuses.
        (RawPosition::Ned(_), None) => Some(0.0),
    };
    let mut known: Vec<Option<f64>> = usable[..count].iter().map(|row| at(row)).collect();
    let mut last = known.iter().find_map(|height_m| *height_m);
    for (row, height_m) in usable.iter().zip(&mut known) {
        if height_m.is_none() {
            report.without_ground.add(row.line);
        }
        last = height_m.or(last);
        *height_m = last;
    }
    let missing = &report.without_ground;
    match missing.lines.first() {
        // Most of the flight is elsewhere.
        Some(&line) if 2 * missing.count > count => Err(LogError::NoGround { line }),
        _ => Ok(known.into_iter().flatten().collect()),
    }
}

struct Positions<'a>(&'a [CleanRow]);

impl OutlierSignal for Positions<'_> {
    fn deviation(&self, row: usize, before: usize, after: usize, fraction: f64) -> f64 {
        let (a, b) = (self.0[before].position_ned_m, self.0[after].position_ned_m);
        (a + (b - a) * fraction).distance(self.0[row].position_ned_m)
    }

    fn distance(&self, a: usize, b: usize) -> f64 {
        self.0[a].position_ned_m.distance(self.0[b].position_ned_m)
    }
}

struct Attitudes<'a>(&'a [CleanRow]);

impl OutlierSignal for Attitudes<'_> {
    fn deviation(&self, row: usize, before: usize, after: usize, fraction: f64) -> f64 {
        let (a, b) = (self.0[before].attitude, self.0[after].attitude);
        if a.is_missing() || b.is_missing() {
            return f64::NAN;
        }
        a.interpolate(b, fraction).distance_rad(self.0[row].attitude).unwrap_or(f64::NAN)
    }

    fn distance(&self, a: usize, b: usize) -> f64 {
        self.0[a].attitude.distance_rad(self.0[b].attitude).unwrap_or(f64::NAN)
    }
}

/// Drops position spikes. If the first row is one, the origin of a geodetic log remains at that row.
fn drop_spikes(rows: &mut Vec<CleanRow>, report: &mut CleaningReport) {
    let is_spike = outliers::find(&times_s(rows), &Positions(rows), SPIKE_FLOOR_M);
    let mut flags = is_spike.iter();
    rows.retain(|row| {
        let spike = flags.next().copied().unwrap_or(false);
        if spike {
            report.position_spikes.add(row.line);
        }
        !spike
    });
}

/// Counts missing attitudes and marks glitches as missing.
fn mark_attitudes(rows: &mut [CleanRow], report: &mut CleaningReport) {
    for row in rows.iter().filter(|row| row.states_attitude && row.attitude.is_missing()) {
        report.attitude_missing.add(row.line);
    }
    let is_glitch = outliers::find(&times_s(rows), &Attitudes(rows), GLITCH_FLOOR_RAD);
    for (row, _) in rows.iter_mut().zip(is_glitch).filter(|(_, glitch)| *glitch) {
        report.attitude_glitches.add(row.line);
        row.attitude = Attitude::Missing;
    }
}

/// Refuses rows of one time at several positions: their mean would stand still where nothing was.
fn check_clock(rows: &[CleanRow]) -> Result<(), LogError> {
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return Ok(()) };
    let distance_m =
        rows.iter().map(|row| row.position_ned_m.distance(first.position_ned_m)).fold(0.0, f64::max);
    if last.t_ns != first.t_ns || distance_m <= SPIKE_FLOOR_M {
        return Ok(());
    }
    Err(LogError::AllTimesEqual { rows: rows.len(), line: first.line, distance_m })
}

/// Averages groups of rows within 1 ms of the group's first row.
fn merge(rows: &mut Vec<CleanRow>, report: &mut CleaningReport) {
    let mut merged = Vec::with_capacity(rows.len());
    let mut start = 0;
    while start < rows.len() {
        let since_start_ns = |row: &CleanRow| i128::from(row.t_ns) - i128::from(rows[start].t_ns);
        let end = start + rows[start..].iter().take_while(|row| since_start_ns(row) < MERGE_NS).count();
        let group = &rows[start..end];
        for pair in group.windows(2) {
            let finding =
                if pair[0].t_ns == pair[1].t_ns { &mut report.duplicates } else { &mut report.merged };
            finding.add(pair[1].line);
        }
        let apart_m =
            group.iter().map(|row| row.position_ned_m.distance(group[0].position_ned_m)).fold(0.0, f64::max);
        report.averaged_apart_m = report.averaged_apart_m.max(apart_m);
        let count = group.len();
        let offset_ns = group.iter().map(since_start_ns).sum::<i128>() / count as i128;
        merged.push(CleanRow {
            line: group[0].line,
            // Below 1 ms by construction.
            t_ns: group[0].t_ns.saturating_add(offset_ns as i64),
            position_ned_m: group.iter().map(|row| row.position_ned_m).sum::<DVec3>() / count as f64,
            attitude: Attitude::mean(group.iter().map(|row| row.attitude)),
            states_attitude: group.iter().any(|row| row.states_attitude),
        });
        start = end;
    }
    *rows = merged;
}

/// Interpolates missing attitudes between their known neighbours, or takes the nearest one at the ends.
fn fill_attitudes(rows: &mut [CleanRow]) {
    let known: Vec<usize> = (0..rows.len()).filter(|&i| !rows[i].attitude.is_missing()).collect();
    let mut next = 0;
    for i in 0..rows.len() {
        if next < known.len() && known[next] == i {
            next += 1;
            continue;
        }
        let before = next.checked_sub(1).map(|k| rows[known[k]]);
        let after = known.get(next).map(|&k| rows[k]);
        rows[i].attitude = match (before, after) {
            (Some(a), Some(b)) => {
                let span_s = seconds_between(a.t_ns, b.t_ns);
                a.attitude.interpolate(b.attitude, seconds_between(a.t_ns, rows[i].t_ns) / span_s)
            }
            (Some(one), None) | (None, Some(one)) => one.attitude,
            (None, None) => Attitude::Missing,
        };
    }
}

fn count_gaps(rows: &[CleanRow], report: &mut CleaningReport) {
    for pair in rows.windows(2) {
        let step_s = seconds_between(pair[0].t_ns, pair[1].t_ns);
        report.longest_step_s = report.longest_step_s.max(step_s);
        if step_s > GAP_S {
            report.gaps.add(pair[1].line);
        }
    }
}

/// Inserts rows between rows whose three angles change by more than 90 degrees together, so that slerp
/// between rows keeps the turns.
fn insert_turns(rows: &[CleanRow], report: &mut CleaningReport) -> Result<Vec<CleanRow>, LogError> {
    let mut filled = vec![rows[0]];
    for pair in rows.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        if let (Attitude::Turns(from), Attitude::Turns(to)) = (a.attitude, b.attitude) {
            let degrees: f64 = (0..3).map(|axis| (to[axis] - from[axis]).abs()).sum();
            let pieces = (degrees / 90.0).ceil().max(1.0);
            if pieces > MAX_PIECES {
                return Err(LogError::TurnTooLarge { line: b.line, degrees });
            }
            let span_ns = (i128::from(b.t_ns) - i128::from(a.t_ns)) as f64;
            for piece in 1..pieces as usize {
                let fraction = piece as f64 / pieces;
                let t_ns = i128::from(a.t_ns) + (span_ns * fraction) as i128;
                filled.push(CleanRow {
                    line: a.line,
                    t_ns: t_ns as i64,
                    position_ned_m: a.position_ned_m.lerp(b.position_ned_m, fraction),
                    attitude: a.attitude.interpolate(b.attitude, fraction),
                    states_attitude: false,
                });
                report.inserted += 1;
            }
        }
        filled.push(b);
    }
    Ok(filled)
}

fn times_s(rows: &[CleanRow]) -> Vec<f64> {
    rows.iter().map(|row| seconds_between(rows[0].t_ns, row.t_ns)).collect()
}

/// Computed in i128, because the difference of two i64 may not fit.
fn seconds_between(from_ns: i64, to_ns: i64) -> f64 {
    (i128::from(to_ns) - i128::from(from_ns)) as f64 * 1e-9
}
