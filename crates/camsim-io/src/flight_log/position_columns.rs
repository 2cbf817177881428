//! Selection of the columns of a header that hold the position.

use camsim_core::{
    flight_log::Note,
    scenario::{AttitudeSource, FlightSpec, LogFormat},
};

use super::{
    column_meaning::ColumnMeaning::{
        self, Down, EarthCentred, East, Grid, Hemisphere, Latitude, LatitudeLongitude, Longitude, North,
        Pitch, Qw, Qx, Qy, Qz, Roll, X, Y, Yaw, Z,
    },
    columns::{FieldSource, Frame},
    header::HeaderColumns,
    height_column::height_column,
    missing_columns::missing_columns_message,
    text_table::{Separator, Table},
    word_list::has_word,
    written_numbers,
};

/// The axes of the positions and their three columns. Geodetic columns count before local ones, unless
/// flight.format says otherwise, and north and east before x and y.
///
/// # Errors
/// There is no complete position, its axes are not known, or several columns hold the same quantity.
pub(super) fn position_columns(
    header: &HeaderColumns,
    table: &Table<'_>,
    spec: &FlightSpec,
    time: usize,
    notes: &mut Vec<Note>,
) -> Result<(Frame, [FieldSource; 3]), String> {
    let has_height = header.has_any(ColumnMeaning::is_height);
    let has_all = |plane: [ColumnMeaning; 2], vertical: ColumnMeaning| {
        plane.iter().all(|&meaning| header.has(meaning)) && (header.has(vertical) || has_height)
    };
    if header.is_geodetic() && has_height && matches!(spec.format, LogFormat::Auto | LogFormat::CsvLla) {
        return Ok((Frame::Geodetic, geodetic(header, table, spec, notes)?));
    }
    let (frame, columns) = match spec.format {
        LogFormat::CsvLla => return Err(format_mismatch(spec.format)),
        _ if has_all([North, East], Down) => north_and_east(header, spec, notes)?,
        _ if has_all([X, Y], Z) => x_and_y(header, table, spec, time, notes)?,
        format => return Err(no_position(header, format)),
    };
    Ok((frame, columns.map(|column| header.source(column))))
}

/// Latitude, longitude and height.
fn geodetic(
    header: &HeaderColumns,
    table: &Table<'_>,
    spec: &FlightSpec,
    notes: &mut Vec<Note>,
) -> Result<[FieldSource; 3], String> {
    let letters = header.columns(Hemisphere);
    let horizontal = header.unique_each([Latitude, Longitude])?;
    let are_signed = |columns| hemispheres_are_signed(table, &letters, columns);
    if !letters.is_empty() && !horizontal.is_some_and(are_signed) {
        return Err(format!(
            "{} say the hemisphere by letters: write signed degrees and remove these columns",
            header.describe(&letters)
        ));
    }
    let parts = header.columns_by_name(|name| {
        let prefixes = ["latitude_", "longitude_", "lat_", "lon_"];
        let part = prefixes.iter().find_map(|prefix| name.strip_prefix(prefix));
        part.is_some_and(|part| has_word("min mins minute minutes sec secs second seconds", part))
    });
    if !parts.is_empty() {
        return Err(format!(
            "{} are minutes and seconds of latitude and longitude: write degrees with decimals in one column \
                each, and remove these columns",
            header.describe(&parts)
        ));
    }
    let height = height_column(header, Some(spec.height), spec.height_from, notes)?;
    let [latitude, longitude] = match horizontal {
        // A position in one field says the same.
        Some(pair) => pair.map(|column| header.source(column)),
        None => {
            let column = header.unique(LatitudeLongitude)?.ok_or_else(|| missing_columns_message(header))?;
            [0, 1].map(|part| FieldSource { part: Some(part), ..header.source(column) })
        }
    };
    Ok([latitude, longitude, header.source(height)])
}

/// North, east and a height or a depth.
fn north_and_east(
    header: &HeaderColumns,
    spec: &FlightSpec,
    notes: &mut Vec<Note>,
) -> Result<(Frame, [usize; 3]), String> {
    let pair = header.unique_each([North, East])?;
    let [north, east] = pair.ok_or_else(|| missing_columns_message(header))?;
    let prefers_up = spec.format == LogFormat::CsvXya && header.has_any(ColumnMeaning::is_height);
    let (frame, vertical, own) = match header.unique(Down)?.filter(|_| !prefers_up) {
        Some(down) => (Frame::NorthEastDown, down, LogFormat::CsvNed),
        None => {
            let height = height_column(header, None, spec.height_from, notes)?;
            (Frame::NorthEastUp, height, LogFormat::CsvXya)
        }
    };
    if spec.format != LogFormat::Auto && spec.format != own {
        return Err(format_mismatch(spec.format));
    }
    Ok((frame, [north, east, vertical]))
}

/// X, y and z, whose axes flight.format or their names say.
fn x_and_y(
    header: &HeaderColumns,
    table: &Table<'_>,
    spec: &FlightSpec,
    time: usize,
    notes: &mut Vec<Note>,
) -> Result<(Frame, [usize; 3]), String> {
    let [x, y] = header.unique_each([X, Y])?.ok_or_else(|| missing_columns_message(header))?;
    let z = header.unique(Z)?;
    let frame = match spec.format {
        LogFormat::CsvXya => Frame::NorthEastUp,
        LogFormat::CsvNed if z.is_some() => Frame::NorthEastDown,
        LogFormat::Tum | LogFormat::Euroc if z.is_some() => Frame::EastNorthUp,
        LogFormat::Auto if z.is_some_and(|z| has_known_axes(header, table, time, [x, y, z])) => {
            Frame::EastNorthUp
        }
        LogFormat::Auto => return Err(unknown_axes_message(header, &[x, y])),
        format => return Err(format_mismatch(format)),
    };
    let has_angles = [Roll, Pitch, Yaw].into_iter().all(|angle| header.has(angle)) && !header.has(Qw);
    if frame == Frame::EastNorthUp && has_angles && spec.attitude == AttitudeSource::Log {
        return Err("roll, pitch and yaw do not say what they turn where x is east and z is up: give a \
                quaternion (qx, qy, qz, qw), or set flight.format = \"csv-xya\" or \"csv-ned\" if x is north"
            .to_owned());
    }
    let vertical = z.map_or_else(|| height_column(header, None, spec.height_from, notes), Ok)?;
    Ok((frame, [x, y, vertical]))
}

fn format_mismatch(format: LogFormat) -> String {
    format!(
        "flight.format is \"{}\" but the columns are named otherwise; remove the key or rename the columns",
        format.name()
    )
}

/// Message for columns without a position that can be flown.
fn no_position(header: &HeaderColumns, format: LogFormat) -> String {
    let (meaning, problem) = if header.has(Grid) {
        let problem = "are grid coordinates, whose north is not true north: convert them to latitude and \
            longitude (cs2cs, gdaltransform) and name them lat and lon";
        (Grid, problem)
    } else if header.has(EarthCentred) {
        let problem = "are coordinates from the centre of the Earth (ECEF): convert them to latitude, \
            longitude and height (RTKLIB: solution format Lat/Lon/Height; cs2cs EPSG:4978 EPSG:4979)";
        (EarthCentred, problem)
    } else if format == LogFormat::Auto {
        return missing_columns_message(header);
    } else {
        return format_mismatch(format);
    };
    format!("{} {problem}", header.describe(&header.columns(meaning)))
}

/// Whether letters of hemispheres say what the signs of latitude and longitude do.
fn hemispheres_are_signed(table: &Table<'_>, letters: &[usize], [latitude, longitude]: [usize; 2]) -> bool {
    table.rows.iter().all(|row| {
        let is_negative = |column: usize| {
            let field = table.field(row, column);
            let value = table.number(field).or_else(|| written_numbers::degrees(field));
            value.is_none_or(|value| value <= 0.0)
        };
        letters.iter().all(|&column| match table.field(row, column).as_bytes().first() {
            Some(b's' | b'S') => is_negative(latitude),
            Some(b'w' | b'W') => is_negative(longitude),
            _ => true,
        })
    })
}

/// Whether x, y, z are known to be east, north, up: by the names of EuRoC or TUM, or by plain names in TUM's
/// order, separated by blanks.
fn has_known_axes(header: &HeaderColumns, table: &Table<'_>, time: usize, [x, y, z]: [usize; 3]) -> bool {
    let quaternion = header.unique_each([Qx, Qy, Qz, Qw]).ok().flatten();
    let in_tum_order = time == 0 && [x, y, z] == [1, 2, 3] && quaternion == Some([4, 5, 6, 7]);
    match header.stem(x) {
        "p_rs_r_x" | "tx" => true,
        "x" | "px" | "p_x" => in_tum_order && table.separator == Separator::Space,
        _ => false,
    }
}

/// Message for columns x, y, z whose axes are not known.
fn unknown_axes_message(header: &HeaderColumns, columns: &[usize]) -> String {
    let choices = if header.has(Qw) {
        "\"csv-ned\" (x north, y east, z down, body forward-right-down, as AirSim writes), \"csv-xya\" (x \
            north, y east, z up) or \"tum\" (x east, y north, z up, body forward-left-up, as ROS writes)"
    } else {
        "\"csv-xya\" (x north, y east, z up) or \"csv-ned\" (z down)"
    };
    format!(
        "the columns {}, z do not say where their axes point; set flight.format = {choices}, or name them \
            north, east, alt or down",
        header.describe(columns)
    )
}
