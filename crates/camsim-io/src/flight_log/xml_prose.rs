//! What the words of GPX and KML files say about their numbers: comments, descriptions, attributes.

use camsim_core::flight_log::Note;
use roxmltree::{Document, Node};

/// Datums other than WGS 84, by letters and digits alone. Maps of China shift positions on purpose (GCJ-02).
pub(super) const DATUMS: [&str; 15] = [
    "ED50",
    "NAD27",
    "TOKYODATUM",
    "OSGB36",
    "OSGB1936",
    "PULKOVO",
    "PULKOVO1942",
    "SK42",
    "CH1903",
    "AGD66",
    "AGD84",
    "NZGD49",
    "GCJ02",
    "BD09",
    "WGS72",
];

/// Warnings about statements that are not applied: the first of each kind. Words of single points are passed over.
pub(super) fn notes(document: &Document<'_>) -> Vec<Note> {
    let mut found: Vec<(&str, Note)> = Vec::new();
    for node in document.descendants().filter(|&node| !is_of_point(node)) {
        let attributes = node.attributes().map(|attribute| attribute.value());
        for text in node.text().filter(|_| !node.is_element()).into_iter().chain(attributes) {
            let Some((kind, problem)) = problem(text) else { continue };
            if found.iter().all(|(other, _)| *other != kind) {
                let line = document.text_pos_at(node.range().start).row;
                let shown: String = text.trim().chars().take(80).collect();
                let text = format!("line {line}: `{shown}` {problem}");
                found.push((kind, Note { is_warning: true, text }));
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
    let has = |list: &[&str]| words.iter().any(|word| list.contains(word));
    let has_pair = |joined: &str| words.windows(2).any(|pair| joined.strip_prefix(pair[0]) == Some(pair[1]));
    // `ED50`, `ED 50` and `ED-50`.
    if let Some(datum) = DATUMS.iter().find(|datum| words.contains(*datum) || has_pair(datum)) {
        let text = format!(
            "names the datum {datum}: the positions are taken as WGS 84, convert them if they are not"
        );
        return Some(("datum", text));
    }
    if !has(&["ELE", "ELEVATION", "ELEVATIONS", "ALT", "ALTITUDE", "ALTITUDES", "HEIGHT", "HEIGHTS"]) {
        return None;
    }
    if has(&["FEET", "FOOT", "FT"]) {
        let text = "names heights in feet: they are taken as metres, as the format has them; convert them if they are not";
        return Some(("feet", text.to_owned()));
    }
    let above = if has(&["ELLIPSOID", "ELLIPSOIDAL", "HAE"]) {
        "the ellipsoid: set flight.height = \"ellipsoid\" if they are"
    } else if has(&["AGL"]) || has_pair("ABOVEGROUND") || has_pair("ABOVETAKEOFF") {
        "ground: they are taken as flight.height says; convert them if they are not"
    } else {
        return None;
    };
    Some(("heights", format!("names heights above {above}")))
}
