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

use std::path::Path;

use camsim_core::{
    flight_log::Note,
    scenario::{FlightSpec, LogFormat},
};
use roxmltree::{Document, Node};

use super::{
    FlightLogError, RawLog,
    columns::{AttitudeKind, Frame},
    rows::ParsedRow,
    streams::{self, Stream, Streams},
    time_fields,
    unused_keys::{unused_height_note, unused_topic_note},
    xml_prose,
};

/// Reads the tracks of a parsed KML file.
///
/// # Errors
/// There is no track with times, several overlap, or heights are above no datum.
pub(super) fn read(
    path: &Path,
    document: &Document<'_>,
    spec: &FlightSpec,
) -> Result<RawLog, FlightLogError> {
    let problem = |problem: String| FlightLogError::Values { path: path.to_owned(), problem };
    streams::check_format(path, spec, LogFormat::Kml)?;
    let reader = KmlReader { document };
    let tracks: Vec<Node<'_, '_>> = elements(document.root_element(), "Track").collect();
    let rows =
        if tracks.is_empty() { reader.placemarks() } else { reader.tracks(&tracks) }.map_err(problem)?;
    let mut notes: Vec<Note> = unused_topic_note(spec).into_iter().chain(unused_height_note(spec)).collect();
    notes.extend(streams::height_note("heights of KML", true, spec));
    notes.extend(offset_note(document));
    notes.extend(xml_prose::notes(document));
    let has_angles = rows.iter().any(ParsedRow::has_attitude);
    if has_angles {
        let text = "gx:angles are taken as heading, tilt with the nose up, roll with the right wing down";
        notes.push(Note { is_warning: false, text: text.to_owned() });
    }
    let kind = if has_angles { AttitudeKind::Euler } else { AttitudeKind::None };
    let position = Stream { name: "gx:Track".to_owned(), rows };
    Streams { frame: Frame::Geodetic, kind, position, attitude: None, notes }.into_log(path, spec)
}

/// Elements of a name in any namespace, below a node.
fn elements<'a, 'b>(node: Node<'a, 'b>, name: &'static str) -> impl Iterator<Item = Node<'a, 'b>> {
    node.descendants().filter(move |node| node.is_element() && node.tag_name().name() == name)
}

/// Text of the first element of a name below a node.
fn text_of<'a>(node: Node<'a, '_>, name: &'static str) -> Option<&'a str> {
    elements(node, name).next().and_then(|element| element.text()).map(str::trim)
}

struct KmlReader<'a, 'b> {
    document: &'b Document<'a>,
}

impl KmlReader<'_, '_> {
    fn line(&self, node: Node<'_, '_>) -> usize {
        self.document.text_pos_at(node.range().start).row as usize
    }

    /// The rows of all tracks, which may follow each other but not overlap.
    fn tracks(&self, tracks: &[Node<'_, '_>]) -> Result<Vec<ParsedRow>, String> {
        let mut all: Vec<Vec<ParsedRow>> = Vec::new();
        for &track in tracks {
            let rows = self.track(track)?;
            if !rows.is_empty() {
                all.push(rows);
            }
        }
        if all.is_empty() {
            return Err("its gx:Track has no points: export the flight again".to_owned());
        }
        all.sort_by_key(|rows| rows.iter().filter_map(|row| row.time).min());
        let overlap = all.windows(2).find(|pair| {
            let end = pair[0].iter().filter_map(|row| row.time).max();
            end > pair[1].iter().filter_map(|row| row.time).min()
        });
        if let Some(pair) = overlap {
            return Err(format!(
                "the tracks at lines {} and {} fly at the same time: keep the one to fly",
                pair[0][0].line, pair[1][0].line
            ));
        }
        Ok(all.concat())
    }

    fn track(&self, track: Node<'_, '_>) -> Result<Vec<ParsedRow>, String> {
        let line = self.line(track);
        let children = |name: &'static str| {
            track.children().filter(move |node| node.is_element() && node.tag_name().name() == name)
        };
        let times: Vec<Node<'_, '_>> = children("when").collect();
        let places: Vec<Node<'_, '_>> = children("coord").collect();
        let angles: Vec<Node<'_, '_>> = children("angles").collect();
        if times.len() != places.len() || !(angles.is_empty() || angles.len() == times.len()) {
            return Err(format!(
                "line {line}: the gx:Track has {} when, {} gx:coord and {} gx:angles: each point needs one of \
                    each (gx:angles may be left out for all)",
                times.len(),
                places.len(),
                angles.len()
            ));
        }
        if !places.is_empty() {
            check_altitude_mode(track, line)?;
        }
        let mut rows = Vec::with_capacity(times.len());
        for (index, (&when, &coord)) in times.iter().zip(&places).enumerate() {
            let line = self.line(coord);
            let mut row = streams::empty_row(line, self.time(when)?);
            row.position = place(coord.text().unwrap_or(""), char::is_whitespace, line)?;
            if let Some(&angles) = angles.get(index) {
                let line = self.line(angles);
                if let Some([heading, tilt, roll]) =
                    three(angles.text().unwrap_or(""), char::is_whitespace, line)?
                {
                    row.attitude = [roll, tilt, heading, f64::NAN];
                }
            }
            rows.push(row);
        }
        Ok(rows)
    }

    /// Placemarks with a time and a place each.
    fn placemarks(&self) -> Result<Vec<ParsedRow>, String> {
        let mut rows = Vec::new();
        for placemark in elements(self.document.root_element(), "Placemark") {
            let Some(point) = elements(placemark, "Point").next() else { continue };
            let stamp =
                elements(placemark, "TimeStamp").next().and_then(|stamp| elements(stamp, "when").next());
            let span =
                || elements(placemark, "TimeSpan").next().and_then(|span| elements(span, "begin").next());
            let (Some(when), Some(text)) = (stamp.or_else(span), text_of(point, "coordinates")) else {
                continue;
            };
            let line = self.line(point);
            check_altitude_mode(point, line)?;
            let mut row = streams::empty_row(line, self.time(when)?);
            row.position = place(text, |c| c == ',', line)?;
            rows.push(row);
        }
        if !rows.is_empty() {
            return Ok(rows);
        }
        Err(match elements(self.document.root_element(), "LineString").next() {
            Some(line_string) => format!(
                "line {}: a LineString is a path without times, which cannot be flown: export the flight as \
                    gx:Track, GPX or CSV",
                self.line(line_string)
            ),
            None => "the KML file has no gx:Track, and no placemarks with times: export the flight as \
                gx:Track, GPX or CSV"
                .to_owned(),
        })
    }

    fn time(&self, when: Node<'_, '_>) -> Result<Option<i128>, String> {
        let text = when.text().unwrap_or("").trim();
        time_fields::date_time_ns(text).map(Some).ok_or_else(|| {
            format!("line {}: `{text}` is no time such as 2023-05-01T10:00:00Z", self.line(when))
        })
    }
}

/// Refuses heights that are above no datum, by the mode of a geometry or of the nearest element around it.
fn check_altitude_mode(node: Node<'_, '_>, line: usize) -> Result<(), String> {
    let of_element = |node: Node<'_, '_>| {
        let mode =
            node.children().find(|child| child.is_element() && child.tag_name().name() == "altitudeMode")?;
        mode.text().map(|text| text.trim().to_owned())
    };
    let stated = node.ancestors().find_map(of_element);
    let to_absolute = "write <altitudeMode>absolute</altitudeMode> into it";
    let problem = match stated.as_deref() {
        Some(mode) if mode.eq_ignore_ascii_case("absolute") => return Ok(()),
        None => format!(
            "there is no altitudeMode, which in KML means that heights are not used (clampToGround): if they are \
                above mean sea level, {to_absolute}"
        ),
        Some(mode) if mode.to_ascii_lowercase().starts_with("clamp") => format!(
            "the altitudeMode is {mode}, so the heights are not used: if they are above mean sea level, \
                {to_absolute}"
        ),
        Some(mode) => format!(
            "the altitudeMode is {mode}, so the heights are above ground: export the flight with altitudes above \
                mean sea level (absolute)"
        ),
    };
    Err(format!("line {line}: {problem}"))
}

/// A warning that heights are shown with an offset, which is not applied.
fn offset_note(document: &Document<'_>) -> Option<Note> {
    let offset = elements(document.root_element(), "altitudeOffset")
        .find(|element| element.text().and_then(|text| text.trim().parse::<f64>().ok()) != Some(0.0))?;
    let line = document.text_pos_at(offset.range().start).row;
    Some(Note {
        is_warning: true,
        text: format!(
            "line {line}: gx:altitudeOffset {} is not applied: the heights are those of the coordinates",
            offset.text().unwrap_or("").trim()
        ),
    })
}

/// Latitude, longitude and height of a text of longitude, latitude and height; NaN where the text is empty, as
/// KML allows for a missing place.
fn place(text: &str, separator: fn(char) -> bool, line: usize) -> Result<[f64; 3], String> {
    let Some([longitude, latitude, height]) = three(text, separator, line)? else { return Ok([f64::NAN; 3]) };
    if latitude.abs() > 90.0 || longitude.abs() > 360.0 {
        return Err(format!("line {line}: latitude {latitude}, longitude {longitude} is no place"));
    }
    Ok([latitude, longitude, height])
}

/// Three numbers, or none where the text is empty.
fn three(text: &str, separator: fn(char) -> bool, line: usize) -> Result<Option<[f64; 3]>, String> {
    let text = text.trim();
    if text.is_empty() {
        return Ok(None);
    }
    let numbers: Vec<f64> = text
        .split(separator)
        .map(str::trim)
        .filter(|part| !part.is_empty())
        .map_while(|part| part.parse().ok())
        .collect();
    <[f64; 3]>::try_from(numbers)
        .map(Some)
        .map_err(|_| format!("line {line}: `{text}` are not three numbers"))
}
