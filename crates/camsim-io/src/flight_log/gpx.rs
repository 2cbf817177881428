//! XML: track points of GPX files; KML goes on to `kml`.
//!
//! | tag | |
//! |---|---|
//! | `trkpt` with `lat`, `lon`, `time`, `ele` | applied: degrees, ISO 8601, metres; all tracks are one log |
//! | `trkpt` without `time`, or without `ele` where others have one | skipped, counted |
//! | `fix` | points of `none`, and of `2d` where others have three dimensions, are skipped with a warning |
//! | `unit` of an `ele` | applied |
//! | `wpt`, `rte`, `extensions` and other tags of a point | not used, named in a note |

use std::collections::BTreeSet;

use camsim_core::{
    flight_log::{Note, RawAttitude, RawPosition, RawRow},
    geodesy::Geodetic,
    scenario::{FlightHeight, FlightSpec, LogFormat, TimeUnit},
};
use roxmltree::{Document, Node};

use super::{
    RawLog, foreign_formats, kml, streams,
    units::{self, Dimension, Qualifier},
    unused_keys::{unused_height_note, unused_topic_note},
    xml::{self, children, elements, line},
};

/// Reads the track points of a GPX file.
///
/// # Errors
/// The text is no XML, no GPX, or has no usable track points.
pub(super) fn read(text: &str, spec: &FlightSpec) -> Result<RawLog, String> {
    let document = Document::parse(text).map_err(|error| format!("not valid XML: {error}"))?;
    match document.root_element().tag_name().name() {
        "gpx" => {}
        "kml" => return kml::read(&document, spec),
        _ => return Err(foreign_formats::refusal(foreign_formats::OTHER_XML)),
    }
    if !matches!(spec.format, LogFormat::Auto | LogFormat::Gpx) {
        return Err(streams::other_format(spec, "GPX"));
    }
    let points: Vec<Node<'_, '_>> = elements(document.root(), "trkpt").collect();
    if points.is_empty() {
        return Err(
            "the GPX file has no track points (trkpt); waypoints and routes have no times and are not flown"
                .to_owned(),
        );
    }
    for (name, advice) in [("time", "record the track with times"), ("ele", "add heights (ele)")] {
        if points.iter().all(|&point| child(point, name).is_none()) {
            return Err(format!("no track point has a `{name}`: a flight needs times and heights; {advice}"));
        }
    }
    let mut notes = notes(&document, &points, spec);
    notes.extend(xml::notes(&document));
    let flown = with_fix(&points, &mut notes);
    if flown.is_empty() {
        return Err("no track point has a fix (`fix` is none): the receiver had none".to_owned());
    }
    let rows = flown.into_iter().map(raw_row).collect::<Result<_, _>>()?;
    Ok(RawLog { rows, notes, quaternions: None })
}

/// The points with a fix, of three dimensions where any has one.
fn with_fix<'a, 'b>(points: &[Node<'a, 'b>], notes: &mut Vec<Note>) -> Vec<Node<'a, 'b>> {
    let dimensions = |point: Node<'_, '_>| match child(point, "fix").map(str::to_ascii_lowercase).as_deref() {
        Some("none") => 0,
        Some("2d") => 2,
        _ => 3,
    };
    let least = if points.iter().any(|&point| dimensions(point) == 3) { 3 } else { 2 };
    let flown: Vec<Node<'a, 'b>> =
        points.iter().copied().filter(|&point| dimensions(point) >= least).collect();
    if flown.len() < points.len() {
        notes.push(Note::warning(format!(
            "{} of {} track points have no {}fix (`fix`), and are skipped",
            points.len() - flown.len(),
            points.len(),
            if least == 3 { "3D " } else { "" }
        )));
    }
    if least == 2 && !flown.is_empty() {
        notes.push(Note::warning("all fixes are 2d: receivers guess the heights then, check them"));
    }
    flown
}

/// Text of the child element `name` of a track point.
fn child<'a>(point: Node<'a, '_>, name: &'static str) -> Option<&'a str> {
    children(point, name).next()?.text().map(str::trim)
}

/// Parses one track point.
fn raw_row(point: Node<'_, '_>) -> Result<RawRow, String> {
    let line = line(point);
    let number = |name: &str, text: Option<&str>| match text.map(str::trim) {
        None | Some("") => Ok(f64::NAN),
        Some(text) => {
            text.parse::<f64>().map_err(|_| format!("line {line}: `{text}` of {name} is not a number"))
        }
    };
    let latitude = number("lat", point.attribute("lat"))?;
    let longitude = number("lon", point.attribute("lon"))?;
    xml::check_position(latitude, longitude, line)?;
    let metres = metres(point).map_err(|text| {
        format!("line {line}: {text}: GPX has metres; write the unit as m or ft, or convert the heights")
    });
    let height_m = number("ele", child(point, "ele"))? * metres?;
    let t_ns = child(point, "time").map(|text| xml::time_ns(text, line)).transpose()?;
    Ok(RawRow {
        line,
        t_ns: t_ns.and_then(|ns| i64::try_from(ns).ok()),
        position: RawPosition::Geodetic(Geodetic::from_deg(latitude, longitude, height_m)),
        attitude: RawAttitude::None,
    })
}

/// Metres in the unit that the height of a point names, which the standard does not know.
///
/// # Errors
/// The unit is none of length.
fn metres(point: Node<'_, '_>) -> Result<f64, String> {
    let element = children(point, "ele").next();
    let unit =
        element.and_then(|element| ["unit", "units", "uom"].iter().find_map(|name| element.attribute(*name)));
    let Some(unit) = unit else { return Ok(1.0) };
    match units::parse_qualifier(unit) {
        Some(Qualifier::Unit(unit)) if unit.dimension == Dimension::Length => Ok(unit.factor),
        _ => Err(format!("`{unit}` of ele is no unit of length")),
    }
}

/// Notes on keys and tags that are not used.
fn notes(document: &Document<'_>, points: &[Node<'_, '_>], spec: &FlightSpec) -> Vec<Note> {
    let mut notes = Vec::new();
    notes.extend(unused_topic_note(spec).into_iter().chain(unused_height_note(spec)));
    if spec.height == FlightHeight::Ellipsoid {
        let text = "heights of GPX are above mean sea level as a rule, flight.height says \"ellipsoid\": set \
            flight.height = \"msl\" unless you know better";
        notes.push(Note::warning(text));
    }
    if spec.time_unit != TimeUnit::Auto {
        notes.push(Note::warning("flight.time_unit is not used: the times of GPX are dates"));
    }
    let used = ["ele", "time", "fix", "trkpt", "trk", "trkseg", "gpx"];
    let in_points = points.iter().flat_map(|point| point.descendants());
    let waypoints = ["wpt", "rte"].into_iter().flat_map(|name| children(document.root_element(), name));
    let not_used: BTreeSet<&str> = in_points
        .chain(waypoints)
        .filter(|node| node.is_element())
        .map(|node| node.tag_name().name())
        .filter(|name| !used.contains(name) && *name != "extensions")
        .collect();
    if !not_used.is_empty() {
        // Attitude tags change the picture in other formats, so leaving them out is worth a warning.
        const ATTITUDE: [&str; 6] = ["heading", "yaw", "roll", "pitch", "course", "geoidheight"];
        let is_warning = not_used.iter().any(|name| ATTITUDE.contains(name));
        let list: Vec<&str> = not_used.into_iter().collect();
        notes.push(Note {
            is_warning,
            text: format!("tags of the GPX file that are not used: {}", list.join(", ")),
        });
    }
    notes
}
