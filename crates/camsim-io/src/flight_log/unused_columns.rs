//! Columns that look relevant and are not read: they are named, not passed over.

use camsim_core::flight_log::Note;

use super::{
    column_meaning::ColumnMeaning::{self, Course, Gimbal},
    column_names,
    columns::{AttitudeColumns, Frame},
    header::{HeaderColumns, normal_form},
    units::parse_qualifier,
    word_list::has_word,
};

/// Notes columns that look relevant and are not used.
pub(super) fn note_unused_columns(
    header: &HeaderColumns,
    frame: Frame,
    attitude: AttitudeColumns,
    notes: &mut Vec<Note>,
) {
    let describes_another = |name: &str| {
        let stem =
            ["_unit", "_units", "_datum", "_frame"].iter().find_map(|suffix| name.strip_suffix(suffix));
        matches!(name, "unit" | "units" | "datum")
            || stem.is_some_and(|stem| column_names::find(stem).is_some())
    };
    let descriptions = header.columns_by_name(describes_another);
    if !descriptions.is_empty() {
        notes.push(Note::warning(format!(
            "{} are not read: name units in the header (alt_ft), and say by flight.height what heights are \
                above",
            header.describe(&descriptions)
        )));
    }
    let of_unread = unknown_units(header).into_iter().filter(|(meaning, _)| !header.has(*meaning));
    notes.extend(of_unread.map(|(_, text)| Note::warning(text)));
    let declination = header
        .columns_by_name(|name| name.starts_with("declination") || name.starts_with("magnetic_declination"));
    if !declination.is_empty() && matches!(attitude, AttitudeColumns::Euler(_)) {
        notes.push(Note::warning(format!(
            "{} is not applied: yaw is taken as from true north",
            header.describe(&declination)
        )));
    }
    if header.has(Gimbal) {
        notes.push(Note::warning(format!(
            "{} are not used: camera.mount says where the camera looks",
            header.describe(&header.columns(Gimbal))
        )));
    }
    if header.has(Course) && attitude == AttitudeColumns::None {
        notes.push(Note::information(format!(
            "{} is where the aircraft moves, not where its nose points: no part of an attitude",
            header.describe(&header.columns(Course))
        )));
    }
    if matches!(frame, Frame::Geodetic | Frame::NorthEastUp)
        && matches!(attitude, AttitudeColumns::Quaternion(_))
    {
        notes.push(Note::warning(
            "quaternions beside heights that count up are taken as turning forward-right-down bodies to \
                north-east-down, as PX4 writes; ROS writes others",
        ));
    }
}

/// The columns that have a known name with an unknown unit, as `alt_kft`, each with a sentence that says so.
pub(super) fn unknown_units(header: &HeaderColumns) -> Vec<(ColumnMeaning, String)> {
    let unknown = (0..header.0.len()).filter(|&column| header.parsed(column).is_none());
    unknown
        .filter_map(|column| {
            let (meaning, word) = unknown_unit(header.name(column))?;
            let text = format!(
                "column {} (`{}`) is not read: `{word}` is no unit known \
                 (docs/reference/inputs/LOGS.md lists them)",
                column + 1,
                header.name(column)
            );
            Some((meaning, text))
        })
        .collect()
}

/// The last word of a name that looks like a unit and is none known, behind the name of a known quantity:
/// `kft` of `alt_kft`.
fn unknown_unit(name: &str) -> Option<(ColumnMeaning, String)> {
    const OTHER_WORDS: &str = "acc bias cmd cov dem des diff err lim max mean min ok rate raw ref rel rms sd \
        set sp src std type unit valid var vel";
    let normal = normal_form(name.trim_matches(['"', '\'', ' ']));
    let (stem, word) = normal.rsplit_once('_')?;
    let meaning = column_names::find(stem)?.meaning;
    let looks_like_unit = (2..=4).contains(&word.len())
        && word.chars().all(char::is_alphabetic)
        && !has_word(OTHER_WORDS, word)
        && parse_qualifier(word).is_none();
    // `n_sat` and `gps_num` count satellites.
    let may_have_unit = stem.len() > 1 && meaning != ColumnMeaning::LatitudeLongitude;
    (meaning.dimension().is_some() && may_have_unit && looks_like_unit).then(|| (meaning, word.to_owned()))
}
