//! Names of columns whose unit is not known, as `alt_kft`: they are named, not passed over.

use super::{
    column_meaning::ColumnMeaning,
    column_names,
    header::{HeaderColumns, dimension, normal_form},
    units::parse_qualifier,
};

/// The columns that have a known name with an unknown unit, each with a sentence that says so.
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
    const OTHER_WORDS: &[&str] = &[
        "acc", "bias", "cmd", "cov", "dem", "des", "diff", "err", "lim", "max", "mean", "min", "ok", "rate",
        "raw", "ref", "rel", "rms", "sd", "set", "sp", "src", "std", "type", "unit", "valid", "var", "vel",
    ];
    let normal = normal_form(name.trim_matches(['"', '\'', ' ']));
    let (stem, word) = normal.rsplit_once('_')?;
    let meaning = column_names::find(stem).map(|known| known.meaning)?;
    let looks_like_unit = (2..=4).contains(&word.len())
        && word.chars().all(char::is_alphabetic)
        && !OTHER_WORDS.contains(&word)
        && parse_qualifier(word).is_none();
    // `n_sat` and `gps_num` count satellites.
    let may_have_unit = stem.len() > 1 && meaning != ColumnMeaning::LatitudeLongitude;
    (dimension(meaning).is_some() && may_have_unit && looks_like_unit).then(|| (meaning, word.to_owned()))
}
