//! Flight records of glider loggers (IGC).
//!
//! | record | applied |
//! |---|---|
//! | `B` | time of day, latitude, longitude, and the height that `flight.height_from` says |
//! | `H` | date, datum, what heights are above (`header`); without a date times count from midnight. Midnight goes on |
//! | `I` | `LAD`, `LOD` (more decimals of minutes) and `TDS` (decimals of seconds) in `B` |
//!
//! Heights of satellite navigation are above the ellipsoid unless the record says otherwise; those by air
//! pressure are of the standard atmosphere, not above any datum. A fix without height (`V`) is skipped where
//! others have one.

use camsim_core::{
    flight_log::Note,
    scenario::{FlightSpec, HeightSource},
};

use super::{
    RawLog,
    columns::{AttitudeKind, Frame},
    streams::{self, Stream, Streams},
    unused_keys::unused_topic_note,
};

mod header;

use header::Header;

const SECOND_NS: i128 = 1_000_000_000;
const DAY_NS: i128 = 86_400 * SECOND_NS;
/// Length of a `B` record without extensions.
const FIX_CHARACTERS: usize = 35;

/// One fix.
#[derive(Clone, Copy, Debug)]
struct Fix {
    line: usize,
    /// Time of day, later with the date.
    time_ns: i128,
    /// The date that the header states before the fix.
    day_ns: i128,
    plane: [f64; 2],
    /// Whether the fix has three dimensions.
    is_3d: bool,
    pressure_m: f64,
    gnss_m: f64,
}

/// Positions of extensions within `B` records: first and last character, from 0.
#[derive(Clone, Copy, Debug, Default)]
struct Extensions {
    latitude: Option<(usize, usize)>,
    longitude: Option<(usize, usize)>,
    seconds: Option<(usize, usize)>,
}

/// Whether a text is a flight record: it begins with a logger's identifier, and has fixes.
pub(super) fn is_igc(bytes: &[u8]) -> bool {
    let is_fix = |line: &[u8]| {
        line.len() >= FIX_CHARACTERS
            && line[0] == b'B'
            && line[1..7].iter().all(u8::is_ascii_digit)
            && matches!(line[14], b'N' | b'S')
            && matches!(line[23], b'E' | b'W')
    };
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut lines = bytes.split(|&byte| byte == b'\n').take(500);
    match bytes.first() {
        Some(b'A') => lines.any(|line| is_fix(line) || line.get(2..5) == Some(b"DTE")),
        Some(b'H' | b'B' | b'I') => lines.any(is_fix),
        _ => false,
    }
}

/// Reads a flight record.
///
/// # Errors
/// There are no fixes, or one is damaged.
pub(super) fn read(text: &str, spec: &FlightSpec) -> Result<RawLog, String> {
    let mut notes: Vec<Note> = unused_topic_note(spec).into_iter().collect();
    let (mut fixes, mut extensions, mut header) =
        (Vec::<Fix>::new(), Extensions::default(), Header::default());
    for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let line_number = index + 1;
        let bad_line = |problem: String| format!("line {line_number}: {problem}");
        let line = line.trim();
        if line.starts_with('I') {
            extensions = Extensions::parse(line);
        } else if line.starts_with('B') {
            let fix = Fix::parse(line, line_number, &extensions).map_err(bad_line)?;
            fixes.push(Fix { day_ns: header.day_ns.unwrap_or(0), ..fix });
        } else {
            header.read(line, line_number).map_err(bad_line)?;
        }
    }
    if fixes.is_empty() {
        return Err("the IGC file has no fixes (B records): it is no record of a flight".to_owned());
    }
    notes.append(&mut header.notes);
    unroll_midnight(&mut fixes, &mut notes);
    let uses_gnss = chooses_gnss(&fixes, spec, &mut notes)?;
    if let Some(datum) = header.gnss_height.filter(|_| uses_gnss) {
        notes.extend(streams::height_note("GNSS heights of the IGC file", datum, spec));
    }
    if let Some((number, text)) = header.pressure.filter(|_| !uses_gnss) {
        let text = format!(
            "line {number}: `{text}` sets the pressure heights otherwise than the standard atmosphere: they are \
                taken as they stand"
        );
        notes.push(Note::warning(text));
    }
    let count = fixes.len();
    if uses_gnss && fixes.iter().any(|fix| fix.is_3d) {
        fixes.retain(|fix| fix.is_3d);
    }
    if fixes.len() < count {
        let text =
            format!("{} of {count} fixes have no GNSS height (V), and are skipped", count - fixes.len());
        notes.push(Note::warning(text));
    }
    let rows = fixes.iter().map(|fix| {
        let mut row = streams::empty_row(fix.line, Some(fix.time_ns));
        let height = if uses_gnss { fix.gnss_m } else { fix.pressure_m };
        row.position = [fix.plane[0], fix.plane[1], height];
        row
    });
    let position = Stream { name: "B".to_owned(), rows: rows.collect() };
    Streams { frame: Frame::Geodetic, kind: AttitudeKind::None, position, attitude: None, notes }
        .into_log(spec)
}

/// Whether heights are those of satellite navigation.
fn chooses_gnss(fixes: &[Fix], spec: &FlightSpec, notes: &mut Vec<Note>) -> Result<bool, String> {
    let has_gnss = fixes.iter().any(|fix| fix.gnss_m != 0.0);
    let has_pressure = fixes.iter().any(|fix| fix.pressure_m != 0.0);
    match spec.height_from {
        HeightSource::Gnss if !has_gnss => {
            Err("all GNSS heights are 0: set flight.height_from = \"pressure\"".to_owned())
        }
        HeightSource::Pressure if !has_pressure => {
            Err("all pressure heights are 0: set flight.height_from = \"gnss\"".to_owned())
        }
        HeightSource::Auto if has_gnss => Ok(true),
        HeightSource::Gnss => Ok(true),
        HeightSource::Pressure | HeightSource::Auto => {
            let reason = if spec.height_from == HeightSource::Auto { "all GNSS heights are 0: " } else { "" };
            notes.push(Note::warning(format!(
                "{reason}the heights are those of air pressure in the standard atmosphere, which may be \
                        off by 100 m and more"
            )));
            Ok(false)
        }
    }
}

/// Adds the dates, and a day wherever the clock falls by more than half of one without a new date.
fn unroll_midnight(fixes: &mut [Fix], notes: &mut Vec<Note>) {
    let mut offset_ns = fixes.first().map_or(0, |fix| fix.day_ns);
    let mut before: Option<(i128, i128)> = None;
    for fix in fixes {
        match before {
            Some((day_ns, _)) if day_ns != fix.day_ns => offset_ns = fix.day_ns,
            Some((_, time_ns)) if time_ns - fix.time_ns > DAY_NS / 2 => {
                offset_ns += DAY_NS;
                let text =
                    format!("the clock passes midnight at line {}: the times go on from there", fix.line);
                notes.push(Note::information(text));
            }
            _ => {}
        }
        before = Some((fix.day_ns, fix.time_ns));
        fix.time_ns += offset_ns;
    }
}

impl Fix {
    fn parse(line: &str, number: usize, extensions: &Extensions) -> Result<Self, String> {
        let bad = |what: &str| {
            format!(
                "`{line}` is a damaged fix ({what}): remove the line, or copy the record again from the logger"
            )
        };
        if line.len() < FIX_CHARACTERS || !line.is_ascii() {
            return Err(bad("it is cut off"));
        }
        let whole = |from: usize, to: usize| {
            let text = &line[from..to];
            text.bytes().all(|byte| byte.is_ascii_digit()).then(|| text.parse::<i64>().ok()).flatten()
        };
        let clock = |from: usize| whole(from, from + 2).map(i128::from);
        let (Some(hours), Some(minutes), Some(seconds)) = (clock(1), clock(3), clock(5)) else {
            return Err(bad("time"));
        };
        if hours > 23 || minutes > 59 || seconds > 59 {
            return Err(bad("time"));
        }
        let time_ns = (hours * 3600 + minutes * 60 + seconds) * SECOND_NS
            + (decimals(line, extensions.seconds) * 1e9).round() as i128;
        let angle = |degrees: Option<i64>, thousandths: Option<i64>, range: Option<(usize, usize)>| {
            let minutes = (thousandths? as f64 + decimals(line, range)) / 1000.0;
            (minutes < 60.0).then(|| degrees.map(|degrees| degrees as f64 + minutes / 60.0)).flatten()
        };
        let latitude =
            angle(whole(7, 9), whole(9, 14), extensions.latitude).ok_or_else(|| bad("latitude"))?;
        let longitude =
            angle(whole(15, 18), whole(18, 23), extensions.longitude).ok_or_else(|| bad("longitude"))?;
        let (south, west) = match (&line[14..15], &line[23..24]) {
            (ns @ ("N" | "S"), ew @ ("E" | "W")) => (ns == "S", ew == "W"),
            _ => return Err(bad("hemisphere")),
        };
        if latitude > 90.0 || longitude > 180.0 {
            return Err(bad("position"));
        }
        // Heights below 0 begin with a minus sign.
        let height = |from: usize| line[from..from + 5].parse::<f64>().map_err(|_| bad("height"));
        Ok(Self {
            line: number,
            time_ns,
            day_ns: 0,
            plane: [if south { -latitude } else { latitude }, if west { -longitude } else { longitude }],
            is_3d: &line[24..25] == "A",
            pressure_m: height(25)?,
            gnss_m: height(30)?,
        })
    }
}

impl Extensions {
    /// Parses an `I` record: `I`, a count, and for each extension its first and last character and code.
    fn parse(line: &str) -> Self {
        let mut extensions = Self::default();
        let parts = line.get(3..).unwrap_or("").as_bytes().chunks_exact(7);
        for part in parts {
            let field = |from: usize| {
                let text = std::str::from_utf8(part.get(from..from + 2)?).ok()?;
                text.parse::<usize>().ok()?.checked_sub(1)
            };
            let range = field(0).zip(field(2));
            match &part[4..] {
                b"LAD" => extensions.latitude = range,
                b"LOD" => extensions.longitude = range,
                b"TDS" => extensions.seconds = range,
                _ => {}
            }
        }
        extensions
    }
}

/// The digits at a position as decimals: `25` is 0.25; 0 where there are none.
fn decimals(line: &str, range: Option<(usize, usize)>) -> f64 {
    range
        .and_then(|(first, last)| line.get(first..last.checked_add(1)?))
        .filter(|digits| digits.bytes().all(|byte| byte.is_ascii_digit()))
        .and_then(|digits| format!("0.{digits}").parse().ok())
        .unwrap_or(0.0)
}
