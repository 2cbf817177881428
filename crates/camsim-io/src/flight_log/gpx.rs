//! XML: track points of GPX files; KML goes on to `kml`.
//!
//! | tag | |
//! |---|---|
//! | `trkpt` with `lat`, `lon`, `time`, `ele` | applied: degrees, ISO 8601, metres; all tracks are one log |
//! | `trkpt` without `time`, or without `ele` where others have one | left out, counted |
//! | `fix` | points of `none`, and of `2d` where others have three dimensions, are left out with a warning |
//! | `unit` of an `ele` | applied |
//! | `wpt`, `rte`, `extensions` and other tags of a point | not used, named in a note |

use std::{collections::BTreeSet, path::Path};

use camsim_core::{
    flight_log::{Note, RawAttitude, RawPosition, RawRow},
    geodesy::Geodetic,
    scenario::{FlightSpec, HeightReference, LogFormat, TimeUnit},
};
use roxmltree::{Document, Node};

use super::{
    FlightLogError, RawLog,
    columns::format_name,
    foreign_formats, kml, time_fields,
    units::{self, Dimension, Qualifier},
    unused_keys::{unused_height_note, unused_topic_note},
    xml_prose,
};

/// Reads the track points of a GPX file.
///
/// # Errors
/// The text is no XML, no GPX, or has no usable track points.
pub(super) fn read(path: &Path, text: &str, spec: &FlightSpec) -> Result<RawLog, FlightLogError> {
    let foreign = |(what, advice): (&'static str, &'static str)| FlightLogError::OtherFormat {
        path: path.to_owned(),
        what,
        advice,
    };
    let problem = |problem: String| FlightLogError::Values { path: path.to_owned(), problem };
    let document = Document::parse(text).map_err(|error| problem(format!("not valid XML: {error}")))?;
    match document.root_element().tag_name().name() {
        "gpx" => {}
        "kml" => return kml::read(path, &document, spec),
        _ => return Err(foreign(foreign_formats::OTHER_XML)),
    }
    if !matches!(spec.format, LogFormat::Auto | LogFormat::Gpx) {
        return Err(problem(format!(
            "flight.format is \"{}\" but the file is GPX; remove the key",
            format_name(spec.format)
        )));
    }
    let points: Vec<Node<'_, '_>> =
        document.descendants().filter(|node| node.has_local_name("trkpt")).collect();
    if points.is_empty() {
        return Err(problem(
            "the GPX file has no track points (trkpt); waypoints and routes have no times and are not flown"
                .to_owned(),
        ));
    }
    for (name, advice) in [("time", "record the track with times"), ("ele", "add heights (ele)")] {
        if points.iter().all(|point| child(point, name).is_none()) {
            return Err(problem(format!(
                "no track point has a `{name}`: a flight needs times and heights; {advice}"
            )));
        }
    }
    let line = |point: &Node<'_, '_>| document.text_pos_at(point.range().start).row as usize;
    let mut notes = notes(&document, &points, spec);
    notes.extend(xml_prose::notes(&document));
    let flown = with_fix(&points, &mut notes);
    if flown.is_empty() {
        return Err(problem("no track point has a fix (`fix` is none): the receiver had none".to_owned()));
    }
    let rows = flown.iter().map(|point| raw_row(path, point, line(point))).collect::<Result<_, _>>()?;
    Ok(RawLog { rows, notes, quaternions: None })
}

/// The points with a fix, of three dimensions where any has one.
fn with_fix<'a, 'b>(points: &[Node<'a, 'b>], notes: &mut Vec<Note>) -> Vec<Node<'a, 'b>> {
    let dimensions = |point: &Node<'_, '_>| match child(point, "fix").as_deref().map(str::to_ascii_lowercase)
    {
        Some(fix) if fix == "none" => 0,
        Some(fix) if fix == "2d" => 2,
        _ => 3,
    };
    let least = if points.iter().any(|point| dimensions(point) == 3) { 3 } else { 2 };
    let flown: Vec<Node<'a, 'b>> =
        points.iter().filter(|point| dimensions(point) >= least).copied().collect();
    let mut warn = |text: String| notes.push(Note { is_warning: true, text });
    if flown.len() < points.len() {
        warn(format!(
            "{} of {} track points have no {}fix (`fix`), and are left out",
            points.len() - flown.len(),
            points.len(),
            if least == 3 { "3D " } else { "" }
        ));
    }
    if least == 2 && !flown.is_empty() {
        warn("all fixes are 2d: receivers guess the heights then, check them".to_owned());
    }
    flown
}

/// Text of the child element `name` of a track point.
fn child(point: &Node<'_, '_>, name: &str) -> Option<String> {
    let element = point.children().find(|node| node.has_local_name(name))?;
    element.text().map(|text| text.trim().to_owned())
}

/// Parses one track point.
fn raw_row(path: &Path, point: &Node<'_, '_>, line: usize) -> Result<RawRow, FlightLogError> {
    let problem = |problem: String| FlightLogError::Values { path: path.to_owned(), problem };
    let not_a_number = |name: &str, text: &str| FlightLogError::Header {
        path: path.to_owned(),
        line,
        problem: format!("`{text}` of {name} is not a number"),
    };
    let number = |name: &str, text: Option<&str>| match text.map(str::trim) {
        None | Some("") => Ok(f64::NAN),
        Some(text) => text.parse::<f64>().map_err(|_| not_a_number(name, text)),
    };
    let (latitude, longitude) =
        (number("lat", point.attribute("lat"))?, number("lon", point.attribute("lon"))?);
    if latitude.abs() > 90.0 || longitude.abs() > 360.0 {
        return Err(problem(format!("line {line}: latitude {latitude}, longitude {longitude} is no place")));
    }
    let height_m = number("ele", child(point, "ele").as_deref())?
        * metres(point).map_err(|text| {
            problem(format!(
                "line {line}: {text}: GPX has metres; write the unit as m or ft, or convert the heights"
            ))
        })?;
    let t_ns = match child(point, "time") {
        None => None,
        Some(text) => Some(time_fields::date_time_ns(&text).ok_or_else(|| {
            problem(format!("line {line}: `{text}` is no time such as 2023-05-01T10:00:00Z"))
        })?),
    };
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
fn metres(point: &Node<'_, '_>) -> Result<f64, String> {
    let element = point.children().find(|node| node.has_local_name("ele"));
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
    if spec.height == HeightReference::Ellipsoid {
        let text = "heights of GPX are above mean sea level as a rule, flight.height says \"ellipsoid\": set \
            flight.height = \"msl\" unless you know better";
        notes.push(Note { is_warning: true, text: text.to_owned() });
    }
    if spec.time_unit != TimeUnit::Auto {
        notes.push(Note {
            is_warning: true,
            text: "flight.time_unit is not used: the times of GPX are dates".to_owned(),
        });
    }
    let used = ["ele", "time", "fix", "trkpt", "trk", "trkseg", "gpx"];
    let in_points = points.iter().flat_map(|point| point.descendants());
    let waypoints = document
        .root_element()
        .children()
        .filter(|node| node.has_local_name("wpt") || node.has_local_name("rte"));
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

trait LocalName {
    /// Whether this is an element of the given name in any namespace: GPX 1.0, 1.1, or none.
    fn has_local_name(&self, name: &str) -> bool;
}

impl LocalName for Node<'_, '_> {
    fn has_local_name(&self, name: &str) -> bool {
        self.is_element() && self.tag_name().name() == name
    }
}
