//! What a header lacks that no flight can be read without.

use super::{
    column_meaning::ColumnMeaning::{
        self, Date, Down, EarthCentred, East, Grid, Latitude, LatitudeLongitude, Longitude, North, X, Y, Z,
    },
    header::HeaderColumns,
    unused_columns::unknown_units,
};

/// Unknown names that a message lists.
const MAX_NAMES: usize = 8;

impl HeaderColumns {
    /// Whether the names include latitude and longitude.
    pub(super) fn is_geodetic(&self) -> bool {
        self.has(LatitudeLongitude) || (self.has(Latitude) && self.has(Longitude))
    }

    /// Whether the names include a time and a position, whatever else is wrong with them.
    pub(super) fn has_time_and_position(&self) -> bool {
        let has_plane =
            self.is_geodetic() || (self.has(North) && self.has(East)) || (self.has(X) && self.has(Y));
        let has_vertical = self.has_any(ColumnMeaning::is_height) || self.has(Down) || self.has(Z);
        self.has_any(|meaning| meaning.is_time() || meaning == Date)
            && ((has_plane && has_vertical) || self.has(Grid) || self.has(EarthCentred))
    }
}

/// Message for a header without a time or a whole position: what is missing, and which names are not known.
pub(super) fn missing_columns_message(header: &HeaderColumns) -> String {
    let has = |meaning| header.has(meaning);
    let has_time = header.has_any(ColumnMeaning::is_time);
    let is_geodetic = header.is_geodetic();
    let has_height = header.has_any(ColumnMeaning::is_height) || (!is_geodetic && (has(Down) || has(Z)));
    let pairs = [
        ("latitude", has(Latitude), "longitude", has(Longitude), "lat and lon"),
        ("north", has(North), "east", has(East), "north and east"),
        ("x", has(X), "y", has(Y), "x and y"),
    ];
    let half = pairs.iter().find(|(_, one, _, other, _)| one != other);
    let is_local = pairs[1..].iter().any(|(_, one, _, other, _)| *one && *other);
    let advice = match (has_time, is_geodetic || is_local, has_height) {
        (true, true, false) if is_geodetic => "no height: name it alt (metres, up), alt_ft, alt_msl_m or the like".to_owned(),
        (true, true, false) => "no height: name it alt (up) or down, or z beside x and y".to_owned(),
        (false, true, true) => "no time: name it t_s, t_ms, time or the like".to_owned(),
        (true, false, _) if let Some((one, has_one, other, _, names)) = half => {
            let (known, missing) = if *has_one { (one, other) } else { (other, one) };
            format!("{known} but no {missing}: name them {names}")
        }
        _ => "no time and position; name t and lat, lon, alt, or t and north, east, down (or alt), or t and x, y, z"
            .to_owned(),
    };
    let names: Vec<&str> = header.0.iter().map(|column| column.name.as_str()).collect();
    format!(
        "the columns `{}` name {advice}{}{}{}",
        names.join(", "),
        unknown_names(header),
        vertical_hint(header, is_geodetic && !has_height),
        unknown_units(header).into_iter().map(|(_, text)| format!("; {text}")).collect::<String>()
    )
}

/// The names that are not known, for the end of a message.
fn unknown_names(header: &HeaderColumns) -> String {
    let unknown: Vec<String> = header
        .0
        .iter()
        .filter(|column| column.parsed.is_none() && !column.name.is_empty())
        .map(|column| format!("`{}`", column.name))
        .collect();
    if unknown.is_empty() {
        return String::new();
    }
    let more = if unknown.len() > MAX_NAMES { " and more" } else { "" };
    let verb = if unknown.len() == 1 { "is" } else { "are" };
    format!(". {}{more} {verb} not known", unknown[..unknown.len().min(MAX_NAMES)].join(", "))
}

/// Advice for names that look like a height but are none.
fn vertical_hint(header: &HeaderColumns, lacks_height: bool) -> String {
    let hints = header.0.iter().filter_map(|column| {
        let name = column.name.to_lowercase();
        let is_level = name.contains("level") || name == "fl" || name.starts_with("fl_");
        let is_down = name.contains("down") || name == "d" || name.contains("depth");
        if is_level {
            Some(format!(
                "; flight levels are hundreds of feet by air pressure: multiply by 100 and name it \
                    pressure_alt_ft (`{}`)",
                column.name
            ))
        } else if is_down {
            Some(format!("; `{}` counts down: change its sign and name it alt", column.name))
        } else if name == "z" {
            Some(format!("; `{}` does not say whether it counts up: name it alt if it does", column.name))
        } else {
            None
        }
    });
    hints.filter(|_| lacks_height).collect()
}
