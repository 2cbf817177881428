//! What the prose of GPX and KML files says about their numbers: comments and descriptions.

use camsim_core::flight_log::Note;
use roxmltree::{Document, Node};

/// Elements of prose.
const ELEMENTS: [&str; 6] = ["desc", "cmt", "description", "keywords", "Snippet", "name"];
/// Datums other than WGS 84, by letters and digits alone. Maps of China shift positions on purpose (GCJ-02).
const DATUMS: [&str; 12] = [
    "ED50",
    "NAD27",
    "TOKYODATUM",
    "OSGB36",
    "PULKOVO",
    "SK42",
    "CH1903",
    "AGD66",
    "AGD84",
    "GCJ02",
    "BD09",
    "WGS72",
];

/// Warnings about statements that are not applied; prose of single points is passed over.
pub(super) fn notes(document: &Document<'_>) -> Vec<Note> {
    document.descendants().filter_map(|node| note(document, node)).collect()
}

fn note(document: &Document<'_>, node: Node<'_, '_>) -> Option<Note> {
    let is_prose = node.is_comment() || node.is_element() && ELEMENTS.contains(&node.tag_name().name());
    let is_of_point = |node: Node<'_, '_>| {
        node.ancestors()
            .skip(1)
            .any(|above| matches!(above.tag_name().name(), "trkpt" | "wpt" | "rte" | "Point"))
    };
    let text = node.text().filter(|_| is_prose && !is_of_point(node))?.trim();
    let line = document.text_pos_at(node.range().start).row;
    let letters: String = text.chars().filter(char::is_ascii_alphanumeric).collect();
    let letters = letters.to_ascii_uppercase();
    let lower = text.to_lowercase();
    let words: Vec<&str> = lower.split(|c: char| !c.is_alphanumeric()).collect();
    let has = |list: &[&str]| words.iter().any(|word| list.contains(word));
    let shown: String = text.chars().take(80).collect();
    let problem = if let Some(datum) = DATUMS.iter().find(|datum| letters.contains(*datum)) {
        format!("names the datum {datum}: the positions are taken as WGS 84, convert them if they are not")
    } else if has(&["feet", "foot", "ft"])
        && has(&["ele", "elevation", "elevations", "altitude", "altitudes", "height", "heights", "alt"])
    {
        "names heights in feet: they are taken as metres, as the format has them; convert them if they are not"
            .to_owned()
    } else {
        return None;
    };
    Some(Note { is_warning: true, text: format!("line {line}: `{shown}` {problem}") })
}
