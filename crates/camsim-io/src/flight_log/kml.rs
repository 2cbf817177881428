//! Tracks of KML files.
//!
//! | element | applied |
//! |---|---|
//! | `gx:Track` with `when` and `gx:coord` | time, longitude, latitude, height |
//! | its `gx:angles` | heading, tilt (nose up), roll (right wing down), degrees |
//! | `Placemark` with `TimeStamp`, or `TimeSpan`, and `Point` | the same of one row, where the file has no `gx:Track`; of a span its beginning |
//! | `LineString` | refused: it has no times |
//!
//! Heights are above mean sea level (`altitudeMode` `absolute`, of the geometry or of the nearest element
//! around it that states one, as `gx:MultiTrack`). Heights above ground, or clamped to it, are refused.

use camsim_core::{
    flight_log::Note,
    scenario::{FlightHeight, FlightSpec, HeightReference, LogFormat},
};
use roxmltree::{Document, Node};

use super::{
    RawLog,
    columns::{AttitudeKind, Frame},
    rows::ParsedRow,
    streams::{self, Stream, Streams},
    unused_keys::{unused_height_note, unused_topic_note},
    xml::{self, children, elements, line},
};

/// Reads the tracks of a parsed KML file.
///
/// # Errors
/// There is no track with times, several overlap, or heights are above no datum.
pub(super) fn read(document: &Document<'_>, spec: &FlightSpec) -> Result<RawLog, String> {
    streams::check_format(spec, LogFormat::Kml)?;
    let root = document.root_element();
    let rows =
        if elements(root, "Track").next().is_some() { tracks(root, spec)? } else { placemarks(root, spec)? };
    let mut notes: Vec<Note> = unused_topic_note(spec).into_iter().chain(unused_height_note(spec)).collect();
    if spec.height != FlightHeight::Ground {
        notes.extend(streams::height_note("heights of KML", HeightReference::Msl, spec));
    }
    notes.extend(offset_note(root));
    notes.extend(xml::notes(document));
    let has_angles = rows.iter().any(ParsedRow::has_attitude);
    if has_angles {
        notes.push(Note::information(
            "gx:angles are taken as heading, tilt with the nose up, roll with the right wing down",
        ));
    }
    let kind = if has_angles { AttitudeKind::Euler } else { AttitudeKind::None };
    let position = Stream { name: "gx:Track".to_owned(), rows };
    Streams { frame: Frame::Geodetic, kind, position, attitude: None, notes }.into_log(spec)
}

/// Text of the first element of a name below a node.
fn text_of<'a>(node: Node<'a, '_>, name: &'static str) -> Option<&'a str> {
    elements(node, name).next().and_then(|element| element.text()).map(str::trim)
}

/// The rows of all tracks, which may follow each other but not overlap.
fn tracks(root: Node<'_, '_>, spec: &FlightSpec) -> Result<Vec<ParsedRow>, String> {
    let mut all = elements(root, "Track").map(|node| track(node, spec)).collect::<Result<Vec<_>, _>>()?;
    all.retain(|rows| !rows.is_empty());
    if all.is_empty() {
        return Err("its gx:Track has no points: export the flight again".to_owned());
    }
    let times = |rows: &[ParsedRow]| rows.iter().filter_map(|row| row.time).collect::<Vec<_>>();
    all.sort_by_key(|rows| times(rows).into_iter().min());
    let overlap =
        all.windows(2).find(|pair| times(&pair[0]).into_iter().max() > times(&pair[1]).into_iter().min());
    match overlap {
        Some(pair) => Err(format!(
            "the tracks at lines {} and {} fly at the same time: keep the one to fly",
            pair[0][0].line, pair[1][0].line
        )),
        None => Ok(all.concat()),
    }
}

fn track(track: Node<'_, '_>, spec: &FlightSpec) -> Result<Vec<ParsedRow>, String> {
    let [times, positions, angles] =
        ["when", "coord", "angles"].map(|name| children(track, name).collect::<Vec<_>>());
    if times.len() != positions.len() || !(angles.is_empty() || angles.len() == times.len()) {
        return Err(format!(
            "line {}: the gx:Track has {} when, {} gx:coord and {} gx:angles: each point needs one of each \
                (gx:angles may be omitted for all)",
            line(track),
            times.len(),
            positions.len(),
            angles.len()
        ));
    }
    if !positions.is_empty() {
        check_altitude_mode(track, spec)?;
    }
    let mut rows = Vec::with_capacity(times.len());
    for (index, (&when, &coord)) in times.iter().zip(&positions).enumerate() {
        let mut row = streams::empty_row(line(coord), Some(time_ns(when)?));
        row.position = position(coord.text().unwrap_or(""), char::is_whitespace, line(coord))?;
        if let Some(&angles) = angles.get(index)
            && let Some([heading, tilt, roll]) =
                three(angles.text().unwrap_or(""), char::is_whitespace, line(angles))?
        {
            row.attitude = [roll, tilt, heading, f64::NAN];
        }
        rows.push(row);
    }
    Ok(rows)
}

/// Placemarks with a time and a position each.
fn placemarks(root: Node<'_, '_>, spec: &FlightSpec) -> Result<Vec<ParsedRow>, String> {
    let mut rows = Vec::new();
    for placemark in elements(root, "Placemark") {
        let Some(point) = elements(placemark, "Point").next() else { continue };
        let time = |of: &'static str, name: &'static str| {
            elements(placemark, of).next().and_then(|of| elements(of, name).next())
        };
        let when = time("TimeStamp", "when").or_else(|| time("TimeSpan", "begin"));
        let Some((when, text)) = when.zip(text_of(point, "coordinates")) else { continue };
        check_altitude_mode(point, spec)?;
        let mut row = streams::empty_row(line(point), Some(time_ns(when)?));
        row.position = position(text, |c| c == ',', line(point))?;
        rows.push(row);
    }
    if !rows.is_empty() {
        return Ok(rows);
    }
    Err(match elements(root, "LineString").next() {
        Some(line_string) => format!(
            "line {}: a LineString is a path without times, which cannot be flown: export the flight as \
                gx:Track, GPX or CSV",
            line(line_string)
        ),
        None => "the KML file has no gx:Track, and no placemarks with times: export the flight as gx:Track, \
            GPX or CSV"
            .to_owned(),
    })
}

fn time_ns(when: Node<'_, '_>) -> Result<i128, String> {
    xml::time_ns(when.text().unwrap_or("").trim(), line(when))
}

/// Refuses heights that are not above what `flight.height` says, by the mode of a geometry or of the nearest element
/// around it.
fn check_altitude_mode(node: Node<'_, '_>, spec: &FlightSpec) -> Result<(), String> {
    let of_element =
        |node: Node<'_, '_>| children(node, "altitudeMode").next()?.text().map(|text| text.trim().to_owned());
    let stated = node.ancestors().find_map(of_element);
    let to_absolute = "write <altitudeMode>absolute</altitudeMode> into it";
    let problem = match stated.as_deref() {
        Some(mode) if mode.eq_ignore_ascii_case("absolute") && spec.height != FlightHeight::Ground => return Ok(()),
        Some(mode) if mode.eq_ignore_ascii_case("relativeToGround") && spec.height == FlightHeight::Ground => {
            return Ok(());
        }
        Some(mode) if mode.eq_ignore_ascii_case("absolute") => {
            "the altitudeMode is absolute, so the heights are above mean sea level: set flight.height = \"msl\""
                .to_owned()
        }
        None => format!(
            "there is no altitudeMode, which in KML means that heights are not used (clampToGround): if they are \
                above mean sea level, {to_absolute}"
        ),
        Some(mode) if mode.to_ascii_lowercase().starts_with("clamp") => format!(
            "the altitudeMode is {mode}, so the heights are not used: if they are above mean sea level, \
                {to_absolute}"
        ),
        Some(mode) => format!(
            "the altitudeMode is {mode}, so the heights are above ground: set flight.height = \"ground\", or export \
                the flight with altitudes above mean sea level (absolute)"
        ),
    };
    Err(format!("line {}: {problem}", line(node)))
}

/// A warning that heights are shown with an offset, which is not applied.
fn offset_note(root: Node<'_, '_>) -> Option<Note> {
    let is_zero = |text: &str| text.trim().parse() == Ok(0.0);
    let offset = elements(root, "altitudeOffset").find(|element| !element.text().is_some_and(is_zero))?;
    Some(Note::warning(format!(
        "line {}: gx:altitudeOffset {} is not applied: the heights are those of the coordinates",
        line(offset),
        offset.text().unwrap_or("").trim()
    )))
}

/// Latitude, longitude and height of a text of longitude, latitude and height; NaN where the text is empty, as
/// KML allows for a missing position.
fn position(text: &str, separator: fn(char) -> bool, line: usize) -> Result<[f64; 3], String> {
    let Some([longitude, latitude, height]) = three(text, separator, line)? else { return Ok([f64::NAN; 3]) };
    xml::check_position(latitude, longitude, line)?;
    Ok([latitude, longitude, height])
}

/// Three numbers, or none where the text is empty.
fn three(text: &str, separator: fn(char) -> bool, line: usize) -> Result<Option<[f64; 3]>, String> {
    let text = text.trim();
    if text.is_empty() {
        return Ok(None);
    }
    let parts = text.split(separator).map(str::trim).filter(|part| !part.is_empty());
    let numbers: Vec<f64> = parts.map_while(|part| part.parse().ok()).collect();
    <[f64; 3]>::try_from(numbers)
        .map(Some)
        .map_err(|_| format!("line {line}: `{text}` are not three numbers"))
}
