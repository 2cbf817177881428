//! Positions and attitudes of logs that hold them in streams of their own, brought to common rows.
//!
//! Each stream is sorted by its own clock. Rows stand at the instants of both streams; positions are
//! interpolated at the instants of the attitude, attitudes later at those of the positions, as rotations.

use camsim_core::{
    flight_log::Note,
    scenario::{AttitudeSource, FlightHeight, FlightSpec, HeightReference, LogFormat},
};

use super::{
    RawLog, clock_rollover,
    columns::{AttitudeKind, Frame},
    quaternions, raw_row,
    rows::ParsedRow,
    sparse_rows, unused_keys,
};

/// A position and an attitude closer than this share a row.
const SAME_INSTANT_NS: i128 = 1_000_000;

/// Samples of one stream. Times are nanoseconds; `line` counts messages.
#[derive(Clone, Debug, Default)]
pub(super) struct Stream {
    /// Name in messages.
    pub(super) name: String,
    /// Samples in the order of the file.
    pub(super) rows: Vec<ParsedRow>,
}

/// Positions of one stream, with attitudes of the same or of another.
#[derive(Clone, Debug)]
pub(super) struct Streams {
    /// Axes of the positions.
    pub(super) frame: Frame,
    /// What the attitudes are.
    pub(super) kind: AttitudeKind,
    /// The positions.
    pub(super) position: Stream,
    /// The attitudes, unless the positions have them.
    pub(super) attitude: Option<Stream>,
    /// Notes so far.
    pub(super) notes: Vec<Note>,
}

impl Streams {
    /// The rows of the log.
    ///
    /// # Errors
    /// No position is usable, or the values are those of several flights or of no quaternions.
    pub(super) fn into_log(mut self, spec: &FlightSpec) -> Result<RawLog, String> {
        self.notes.extend(unused_keys::unused_unit_notes(spec));
        if spec.attitude == AttitudeSource::Track {
            self.attitude = None;
            self.position.rows.iter_mut().for_each(|row| row.attitude = [f64::NAN; 4]);
        }
        clock_rollover::check_single_flight(&self.position.rows)?;
        self.position.sort(&mut self.notes);
        self.position.rows.retain(|row| row.time.is_some());
        if !self.position.rows.iter().any(ParsedRow::has_position) {
            return Err(format!("`{}` has no usable position", self.position.name));
        }
        self.position.check_clock()?;
        let rows = match self.attitude.take() {
            Some(mut attitude) => {
                attitude.sort(&mut self.notes);
                attitude.rows.retain(|row| row.time.is_some() && row.has_attitude());
                merge(self.position, attitude, self.frame == Frame::Geodetic, &mut self.notes)
            }
            None => self.position.rows,
        };
        let rows = quaternions::normalised(rows, self.kind, &mut self.notes)?;
        let rows = rows.iter().map(|row| raw_row(row, self.frame, self.kind)).collect();
        Ok(RawLog { rows, notes: self.notes, quaternions: None })
    }
}

impl Stream {
    /// Refuses positions that differ, all at one time; rows at the instants of another stream would hide that.
    fn check_clock(&self) -> Result<(), String> {
        let known: Vec<&ParsedRow> = self.rows.iter().filter(|row| row.has_position()).collect();
        let [first, others @ ..] = &known[..] else { return Ok(()) };
        let is_moving = others.iter().any(|row| row.position != first.position);
        if !is_moving || others.iter().any(|row| row.time != first.time) {
            return Ok(());
        }
        Err(format!(
            "all times of `{}` are equal and its positions are not, so there is no flight: record it with the time \
                of each position",
            self.name
        ))
    }

    /// Sorts the samples by time, with a warning if they were not.
    fn sort(&mut self, notes: &mut Vec<Note>) {
        let late = |pair: &&[ParsedRow]| pair[1].time < pair[0].time && pair[1].time.is_some();
        let mut falls = self.rows.windows(2).filter(late);
        let Some(first) = falls.next() else { return };
        let count = 1 + falls.count();
        notes.push(Note::warning(format!(
            "the times of `{}` go back {count} times, first at message {}: sorted by time",
            self.name, first[1].line
        )));
        self.rows.sort_by_key(|row| row.time);
    }
}

/// Rows at the instants of both streams, which are sorted.
fn merge(position: Stream, attitude: Stream, is_geodetic: bool, notes: &mut Vec<Note>) -> Vec<ParsedRow> {
    if attitude.rows.is_empty() {
        notes.push(Note::warning(format!("`{}` has no usable attitude", attitude.name)));
        return position.rows;
    }
    gap_note(&position, notes);
    let instants: Vec<i128> = attitude.rows.iter().filter_map(|row| row.time).collect();
    let has_near = |time: i128| {
        let after = instants.partition_point(|&other| other <= time - SAME_INSTANT_NS);
        instants.get(after).is_some_and(|&other| other < time + SAME_INSTANT_NS)
    };
    let mut rows = position.rows.clone();
    rows.extend(&attitude.rows);
    let is_known = |row: &ParsedRow| row.has_position();
    sparse_rows::interpolate(&mut rows, 0..3, is_geodetic, &is_known, &|row: &ParsedRow| row.has_attitude());
    let before = rows.len();
    rows.retain(|row| row.has_position() || !row.has_attitude());
    let outside = before - rows.len();
    if outside > 0 {
        notes.push(Note::information(format!(
            "{outside} of {} attitudes are before the first or after the last position, and are skipped",
            attitude.rows.len()
        )));
    }
    rows.retain(|row| row.has_attitude() || row.time.is_none_or(|time| !has_near(time)));
    rows.sort_by_key(|row| row.time);
    notes.push(Note::information(format!(
        "positions of `{}` ({}) are interpolated at the instants of `{}` ({})",
        position.name,
        position.rows.len(),
        attitude.name,
        attitude.rows.len()
    )));
    rows
}

/// A warning about gaps of the positions, which the rows of the attitude hide.
fn gap_note(position: &Stream, notes: &mut Vec<Note>) {
    let times: Vec<i128> =
        position.rows.iter().filter(|row| row.has_position()).filter_map(|row| row.time).collect();
    let gap_ns = sparse_rows::gap_ns(&times);
    let steps = times.windows(2).map(|pair| pair[1] - pair[0]);
    let gaps = steps.clone().filter(|step| *step > gap_ns).count();
    if gaps > 0 {
        notes.push(Note::warning(format!(
            "`{}` has {gaps} gaps of more than {:.1} s, the longest {:.1} s: straight lines lead over them",
            position.name,
            gap_ns as f64 * 1e-9,
            steps.max().unwrap_or(0) as f64 * 1e-9
        )));
    }
}

/// Refuses a file whose format is another one than `flight.format` says.
pub(super) fn check_format(spec: &FlightSpec, actual: LogFormat) -> Result<(), String> {
    if [LogFormat::Auto, actual].contains(&spec.format) {
        Ok(())
    } else {
        Err(other_format(spec, actual.name()))
    }
}

/// Message for a file that is another one than `flight.format` says.
pub(super) fn other_format(spec: &FlightSpec, actual: &str) -> String {
    format!("flight.format is \"{}\" but the file is {actual}; remove the key", spec.format.name())
}

/// Names for messages.
pub(super) fn listed(names: &[String]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

/// A warning that one of several instances is flown although the log does not say that the vehicle used it.
pub(super) fn instance_note(name: &str, instances: &str, flown: u32) -> Note {
    Note::warning(format!(
        "`{name}` has the instances {instances}, and the log does not say which the vehicle used: {flown} is \
            flown; set flight.topic = \"{name}#1\" for another"
    ))
}

/// A warning if `flight.height` says other than the heights of the file.
pub(super) fn height_note(what: &str, datum: HeightReference, spec: &FlightSpec) -> Option<Note> {
    (spec.height.datum() != Some(datum)).then(|| {
        Note::warning(format!(
            "{what} are above {}, flight.height says otherwise: set flight.height = \"{}\"",
            FlightHeight::from(datum).surface(),
            datum.name()
        ))
    })
}

/// The streams that `flight.topic` names: that of the position and, behind a comma, that of the attitude.
pub(super) fn named_topics(spec: &FlightSpec) -> (Option<&str>, Option<&str>) {
    let Some(topic) = spec.topic.as_deref() else { return (None, None) };
    let (position, attitude) = topic.split_once(',').unwrap_or((topic, ""));
    let [position, attitude] = [position, attitude].map(str::trim);
    (Some(position).filter(|name| !name.is_empty()), Some(attitude).filter(|name| !name.is_empty()))
}

/// A name with the number behind its last `#`, which counts instances of it.
pub(super) fn split_instance(name: &str) -> (&str, Option<u32>) {
    match name.rsplit_once('#') {
        Some((stem, digits)) if digits.parse::<u32>().is_ok() => (stem, digits.parse().ok()),
        _ => (name, None),
    }
}

/// A sample without values.
pub(super) fn empty_row(message: usize, time_ns: Option<i128>) -> ParsedRow {
    ParsedRow { line: message, time: time_ns, position: [f64::NAN; 3], attitude: [f64::NAN; 4] }
}
