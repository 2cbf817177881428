//! Elements of GPX and KML files, and what their words say about the numbers: comments, descriptions,
//! attributes.

use camsim_core::flight_log::Note;
use roxmltree::{Document, Node};

use super::{time_fields, word_list::has_word};

/// Elements of a name below a node, in any namespace.
pub(super) fn elements<'a, 'b>(node: Node<'a, 'b>, name: &'static str) -> impl Iterator<Item = Node<'a, 'b>> {
    node.descendants().filter(move |node| is_named(node, name))
}

/// Child elements of a name, in any namespace.
pub(super) fn children<'a, 'b>(node: Node<'a, 'b>, name: &'static str) -> impl Iterator<Item = Node<'a, 'b>> {
    node.children().filter(move |node| is_named(node, name))
}

fn is_named(node: &Node<'_, '_>, name: &str) -> bool {
    node.is_element() && node.tag_name().name() == name
}

/// The line of a node in its file.
pub(super) fn line(node: Node<'_, '_>) -> usize {
    node.document().text_pos_at(node.range().start).row as usize
}

/// A time such as 2023-05-01T10:00:00Z of a node, in nanoseconds.
pub(super) fn time_ns(text: &str, line: usize) -> Result<i128, String> {
    time_fields::date_time_ns(text)
        .ok_or_else(|| format!("line {line}: `{text}` is no time such as 2023-05-01T10:00:00Z"))
}

/// Refuses latitudes and longitudes that are none.
pub(super) fn check_position(latitude: f64, longitude: f64, line: usize) -> Result<(), String> {
    if latitude.abs() > 90.0 || longitude.abs() > 360.0 {
        return Err(format!("line {line}: latitude {latitude}, longitude {longitude} is no position"));
    }
    Ok(())
}

/// Datums other than WGS 84, by letters and digits alone. Maps of China shift positions on purpose (GCJ-02).
pub(super) const DATUMS: &str = "ED50 NAD27 TOKYODATUM OSGB36 OSGB1936 PULKOVO PULKOVO1942 SK42 CH1903 \
    AGD66 AGD84 NZGD49 GCJ02 BD09 WGS72";

/// Warnings about statements that are not applied: the first of each kind. Words of single points are passed over.
pub(super) fn notes(document: &Document<'_>) -> Vec<Note> {
    let mut found: Vec<(&str, Note)> = Vec::new();
    for node in document.descendants().filter(|&node| !is_of_point(node)) {
        let attributes = node.attributes().map(|attribute| attribute.value());
        for text in node.text().filter(|_| !node.is_element()).into_iter().chain(attributes) {
            let Some((kind, problem)) = problem(text) else { continue };
            if found.iter().all(|(other, _)| *other != kind) {
                let line = line(node);
                let shown: String = text.trim().chars().take(80).collect();
                let text = format!("line {line}: `{shown}` {problem}");
                found.push((kind, Note::warning(text)));
            }
        }
    }
    found.into_iter().map(|(_, note)| note).collect()
}

fn is_of_point(node: Node<'_, '_>) -> bool {
    node.ancestors().any(|above| matches!(above.tag_name().name(), "trkpt" | "wpt" | "rte" | "Point"))
}

/// What a text says against the format, with the name of its kind.
fn problem(text: &str) -> Option<(&'static str, String)> {
    let upper = text.to_uppercase();
    let words: Vec<&str> =
        upper.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    let has = |list: &str| words.iter().any(|word| has_word(list, word));
    let has_pair = |joined: &str| words.windows(2).any(|pair| joined.strip_prefix(pair[0]) == Some(pair[1]));
    // `ED50`, `ED 50` and `ED-50`.
    if let Some(datum) = DATUMS.split(' ').find(|datum| words.contains(datum) || has_pair(datum)) {
        let text = format!(
            "names the datum {datum}: the positions are taken as WGS 84, convert them if they are not"
        );
        return Some(("datum", text));
    }
    if !has("ELE ELEVATION ELEVATIONS ALT ALTITUDE ALTITUDES HEIGHT HEIGHTS") {
        return None;
    }
    if has("FEET FOOT FT") {
        let text = "names heights in feet: they are taken as metres, as the format has them; convert them if they are not";
        return Some(("feet", text.to_owned()));
    }
    let above = if has("ELLIPSOID ELLIPSOIDAL HAE") {
        "the ellipsoid: set flight.height = \"ellipsoid\" if they are"
    } else if has("AGL") || has_pair("ABOVEGROUND") || has_pair("ABOVETAKEOFF") {
        "ground: set flight.height = \"ground\" or \"takeoff\" if they are"
    } else {
        return None;
    };
    Some(("heights", format!("names heights above {above}")))
}
