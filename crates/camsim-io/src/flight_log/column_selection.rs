//! Selection of the columns of a header that hold time, position and attitude.

use camsim_core::{
    flight_log::Note,
    scenario::{AttitudeSource, FlightSpec, LogFormat},
};

use super::{
    column_meaning::ColumnMeaning,
    column_names,
    columns::{AttitudeColumns, FieldSource, Frame, TimeColumns, format_name},
    header::{HeaderColumns, normal_form},
    height_column::{height_column, is_height},
    missing_columns::missing_columns_message,
    split_stamps,
    text_table::{Separator, Table},
    time_fields::TimeFormat,
    unknown_unit::unknown_units,
    written_numbers,
};

pub(super) fn is_time(meaning: ColumnMeaning) -> bool {
    matches!(meaning, ColumnMeaning::Time | ColumnMeaning::DateTime | ColumnMeaning::NanosecondsPart)
}

/// Whether the names include a time and a position, whatever else is wrong with them.
pub(super) fn has_time_and_position(header: &HeaderColumns) -> bool {
    use ColumnMeaning::*;
    let any = |condition: &dyn Fn(ColumnMeaning) -> bool| !header.columns_where(condition).is_empty();
    let has = |meaning: ColumnMeaning| any(&|other| other == meaning);
    let has_horizontal = (has(Latitude) && has(Longitude))
        || has(LatitudeLongitude)
        || (has(North) && has(East))
        || (has(X) && has(Y));
    any(&|meaning| is_time(meaning) || meaning == Date)
        && ((has_horizontal && (any(&is_height) || has(Down) || has(Z)))
            || any(&|meaning| matches!(meaning, Grid | EarthCentred)))
}

/// Adds a note.
pub(super) fn push_information(notes: &mut Vec<Note>, text: String) {
    notes.push(Note { is_warning: false, text });
}

/// Adds a warning.
pub(super) fn push_warning(notes: &mut Vec<Note>, text: String) {
    notes.push(Note { is_warning: true, text });
}

/// The columns of the time.
///
/// # Errors
/// There is no time, or several columns of it among which none can be preferred.
// Long because it is one table of cases.
pub(super) fn time_columns(
    header: &HeaderColumns,
    table: &Table<'_>,
    notes: &mut Vec<Note>,
) -> Result<TimeColumns, String> {
    let all_times = header.columns_where(|meaning| meaning == ColumnMeaning::Time);
    let times = stamps_of_the_measurement(header, table, notes);
    let mut parts = header.columns_where(|meaning| meaning == ColumnMeaning::NanosecondsPart);
    parts.retain(|&column| header.stem(column) != "ns" || !counts_satellites(table, column));
    let texts = date_times(header, table, notes);
    // `time, ms` are two parts of one time; `time, time_ms` are two times.
    let is_bare_unit = |column: usize| header.parsed(column).is_some_and(|parsed| parsed.is_bare_unit);
    let with_unit: Vec<usize> = times
        .iter()
        .copied()
        .filter(|&column| header.factor(column).is_some() && !is_bare_unit(column))
        .collect();
    let column = match (&times[..], &with_unit[..], &parts[..], &texts[..]) {
        ([column], ..) => *column,
        ([_, ..], [column], ..) => {
            push_information(
                notes,
                format!(
                    "of the times {} the one that names its unit counts: `{}`",
                    header.describe(&times),
                    header.name(*column)
                ),
            );
            *column
        }
        ([_, ..], ..) => return Err(header.ambiguity_message(&times)),
        ([], _, _, [column]) | ([], _, [column], []) => *column,
        ([], _, [], []) => return Err(missing_columns_message(header)),
        ([], _, _, []) => return Err(header.ambiguity_message(&parts)),
        ([], ..) => return Err(header.ambiguity_message(&texts)),
    };
    header.check_usable(column)?;
    let unit_ns = if times.is_empty() && texts.is_empty() {
        Some(column_names::NANOSECONDS.factor)
    } else {
        header.factor(column)
    };
    let time_parts = header.columns_where(|meaning| meaning == ColumnMeaning::TimePart);
    if is_bare_unit(column) && !time_parts.is_empty() {
        return Err(format!(
            "the time is in several columns ({}): write one, such as seconds since the start",
            header.describe(&[&time_parts[..], &[column]].concat())
        ));
    }
    let is_of_another = |part: &usize| {
        all_times.iter().any(|&time| split_stamps::nanoseconds_of(header, time) == Some(*part))
    };
    let others = parts.iter().all(is_of_another);
    let nanoseconds = match (split_stamps::nanoseconds_of(header, column), &parts[..]) {
        (Some(part), _) => Some(part),
        (None, [part]) if !times.is_empty() && header.stem(column).starts_with("sec") => Some(*part),
        (None, [_, ..]) if !times.is_empty() && !others => {
            return Err(header.ambiguity_message(&[&times[..], &parts[..]].concat()));
        }
        (None, _) => None,
    };
    if nanoseconds.is_none() && unit_ns == Some(column_names::NANOSECONDS.factor) {
        split_stamps::check_is_clock(header, table, column)?;
    }
    let date = date_column(header, column, notes)?;
    let week = week_column(header, column);
    let column = sample_of(header, table, column, notes).unwrap_or(column);
    Ok(TimeColumns { column, unit_ns, integers_are_ns: false, date, week, nanoseconds })
}

/// The normal form of a name without its units in brackets.
fn plain_name(header: &HeaderColumns, column: usize) -> String {
    normal_form(header.name(column).split(['[', '(']).next().unwrap_or(""))
}

/// The column of the dates; of several that whose name begins as that of the time does, else the first.
///
/// # Errors
/// Its name has a unit.
fn date_column(header: &HeaderColumns, time: usize, notes: &mut Vec<Note>) -> Result<Option<usize>, String> {
    let mut dates = header.columns_where(|meaning| meaning == ColumnMeaning::Date);
    dates.retain(|&column| column != time);
    let first_word = |column: usize| normal_form(header.name(column)).split('_').next().map(str::to_owned);
    let alike = dates.iter().copied().find(|&column| first_word(column) == first_word(time));
    let Some(date) = alike.or(dates.first().copied()) else { return Ok(None) };
    header.check_usable(date)?;
    if dates.len() > 1 {
        push_information(
            notes,
            format!("of the dates {} `{}` counts", header.describe(&dates), header.name(date)),
        );
    }
    Ok(Some(date))
}

/// Names of GPS weeks, in normal form.
const WEEKS: [&str; 9] =
    ["week", "weeks", "gps_week", "gpsweek", "week_number", "gps_week_number", "week_no", "wn", "wno"];

/// The column of the weeks, beside times that by their name count within one.
fn week_column(header: &HeaderColumns, time: usize) -> Option<usize> {
    let name = plain_name(header, time);
    let is_of_week =
        name.starts_with("sec") || ["tow", "sow", "week", "gps"].iter().any(|part| name.contains(part));
    let is_week = |&column: &usize| WEEKS.contains(&plain_name(header, column).as_str());
    (0..header.0.len()).find(is_week).filter(|_| is_of_week)
}

/// The time of the measurement beside that of its message, as PX4 names it: `timestamp_sample`.
fn sample_of(header: &HeaderColumns, table: &Table<'_>, time: usize, notes: &mut Vec<Note>) -> Option<usize> {
    let name = plain_name(header, time) + "_sample";
    let sample = (0..header.0.len()).find(|&column| plain_name(header, column) == name)?;
    if is_constant(table, sample) {
        return None;
    }
    push_information(
        notes,
        format!(
            "of the times {} the one of the measurement counts: `{}`",
            header.describe(&[time, sample]),
            header.name(sample)
        ),
    );
    Some(sample)
}

/// Whether a column holds one text in all of several rows.
fn is_constant(table: &Table<'_>, column: usize) -> bool {
    let field = |row| table.fields(row).get(column).copied();
    table
        .rows
        .first()
        .is_some_and(|first| table.rows.len() > 1 && table.rows.iter().all(|row| field(row) == field(first)))
}

/// Columns of times, without those that stand still. Of ROS messages the time of the measurement, in their
/// header, counts before the time of their arrival, which jitters.
fn stamps_of_the_measurement(header: &HeaderColumns, table: &Table<'_>, notes: &mut Vec<Note>) -> Vec<usize> {
    let mut times = header.columns_where(|meaning| meaning == ColumnMeaning::Time);
    let all = times.clone();
    // Parts of a time may stand still.
    let has_parts = !header.columns_where(|meaning| meaning == ColumnMeaning::NanosecondsPart).is_empty();
    let is_part =
        |column: usize| has_parts || header.parsed(column).is_some_and(|parsed| parsed.is_bare_unit);
    times.retain(|&column| is_part(column) || !is_constant(table, column));
    if times.is_empty() {
        times = all;
    } else if times.len() < all.len() {
        push_information(
            notes,
            format!("of the times {} those that stand still do not count", header.describe(&all)),
        );
    }
    let is_of_header = |stem: &str| stem.ends_with("header_stamp") || stem.ends_with("header_stamp_secs");
    let stamps: Vec<usize> =
        times.iter().copied().filter(|&column| is_of_header(header.stem(column))).collect();
    if stamps.len() != 1 || times.len() == 1 {
        return times;
    }
    push_information(
        notes,
        format!(
            "of the times {} the one of the measurement counts: `{}`",
            header.describe(&times),
            header.name(stamps[0])
        ),
    );
    stamps
}

/// Whether a column `ns` holds numbers of satellites: a clock of nanoseconds does not stay within a
/// microsecond.
fn counts_satellites(table: &Table<'_>, column: usize) -> bool {
    table.rows.iter().all(|row| {
        let value = table.fields(row).get(column).and_then(|field| table.number(field));
        value.is_some_and(|value| value.is_nan() || value.abs() < 1000.0)
    })
}

/// Names of dates with times in photos, the one with decimals of seconds first.
const PHOTO_TIMES: [&str; 4] =
    ["sub_sec_date_time_original", "gps_date_time", "date_time_original", "create_date"];

/// Columns of dates with times. Of several that photos have, one counts.
fn date_times(header: &HeaderColumns, table: &Table<'_>, notes: &mut Vec<Note>) -> Vec<usize> {
    let texts = header.columns_where(|meaning| meaning == ColumnMeaning::DateTime);
    if texts.is_empty() {
        let is_date_time = |column: &usize| {
            let fields = table.rows.iter().map(|row| table.fields(row).get(*column).copied().unwrap_or(""));
            fields.filter_map(TimeFormat::detect).next() == Some(TimeFormat::DateTime)
        };
        let dates = header.columns_where(|meaning| meaning == ColumnMeaning::Date);
        return dates.into_iter().filter(is_date_time).collect();
    }
    let rank = |column: usize| PHOTO_TIMES.iter().position(|name| *name == header.stem(column));
    let first = texts.iter().copied().min_by_key(|&column| rank(column));
    match first.filter(|_| texts.len() > 1 && texts.iter().all(|&column| rank(column).is_some())) {
        Some(first) => {
            push_information(
                notes,
                format!("of the times {} `{}` counts", header.describe(&texts), header.name(first)),
            );
            vec![first]
        }
        None => texts,
    }
}

/// The axes of the positions and their three columns.
///
/// # Errors
/// There is no complete position, its axes are not known, or several columns hold the same quantity.
// Long because the rules for geodetic, north-east and x-y columns take precedence over each other.
pub(super) fn position_columns(
    header: &HeaderColumns,
    table: &Table<'_>,
    spec: &FlightSpec,
    time: usize,
    notes: &mut Vec<Note>,
) -> Result<(Frame, [FieldSource; 3]), String> {
    use ColumnMeaning::{
        Down, EarthCentred, East, Grid, Latitude, LatitudeLongitude, Longitude, North, X, Y, Z,
    };
    let format = spec.format;
    let has = |meaning: ColumnMeaning| !header.columns_where(|other| other == meaning).is_empty();
    let has_geodetic = (has(Latitude) && has(Longitude)) || has(LatitudeLongitude);
    let has_height = !header.columns_where(is_height).is_empty();
    let source = |column: usize| FieldSource::whole(column, header.factor(column));
    if has_geodetic && has_height && matches!(format, LogFormat::Auto | LogFormat::CsvLla) {
        let letters = header.columns_where(|meaning| meaning == ColumnMeaning::Hemisphere);
        let horizontal = header.unique_each([Latitude, Longitude])?;
        let are_signed = |columns| hemispheres_are_signed(table, &letters, columns);
        if !letters.is_empty() && !horizontal.is_some_and(are_signed) {
            return Err(format!(
                "{} say the hemisphere by letters: write signed degrees and remove these columns",
                header.describe(&letters)
            ));
        }
        let is_part = |name: &str| {
            let part = name
                .strip_prefix("latitude_")
                .or(name.strip_prefix("longitude_"))
                .or(name.strip_prefix("lat_"))
                .or(name.strip_prefix("lon_"));
            part.is_some_and(|part| {
                ["min", "mins", "minute", "minutes", "sec", "secs", "second", "seconds"].contains(&part)
            })
        };
        let parts = columns_by_name(header, is_part);
        if !parts.is_empty() {
            return Err(format!(
                "{} are minutes and seconds of latitude and longitude: write degrees with decimals in one \
                    column each, and remove these columns",
                header.describe(&parts)
            ));
        }
        let height = height_column(header, Some(spec.height), spec.height_from, notes)?;
        let horizontal =
            match (horizontal, header.columns_where(|meaning| meaning == LatitudeLongitude).first()) {
                // A position in one field says the same.
                (Some(pair), _) => pair.map(source),
                (None, Some(&column)) => {
                    header.unique(LatitudeLongitude)?;
                    [0, 1].map(|part| FieldSource { part: Some(part), ..source(column) })
                }
                (None, None) => return Err(missing_columns_message(header)),
            };
        return Ok((Frame::Geodetic, [horizontal[0], horizontal[1], source(height)]));
    }
    let format_mismatch = || {
        format!(
            "flight.format is \"{}\" but the columns are named otherwise; remove the key or rename the \
                columns",
            format_name(format)
        )
    };
    if format == LogFormat::CsvLla {
        return Err(format_mismatch());
    }
    if has(North) && has(East) && (has(Down) || has_height) {
        let Some([north, east]) = header.unique_each([North, East])? else {
            return Err(missing_columns_message(header));
        };
        let (frame, vertical) = match header.unique(Down)? {
            Some(_) if has_height && format == LogFormat::CsvXya => {
                (Frame::NorthEastUp, height_column(header, None, spec.height_from, notes)?)
            }
            Some(down) => (Frame::NorthEastDown, down),
            None => (Frame::NorthEastUp, height_column(header, None, spec.height_from, notes)?),
        };
        let fits = match format {
            LogFormat::Auto => true,
            LogFormat::CsvXya => frame == Frame::NorthEastUp,
            LogFormat::CsvNed => frame == Frame::NorthEastDown,
            _ => false,
        };
        return if fits { Ok((frame, [north, east, vertical].map(source))) } else { Err(format_mismatch()) };
    }
    if has(X) && has(Y) && (has(Z) || has_height) {
        let Some([x, y]) = header.unique_each([X, Y])? else { return Err(missing_columns_message(header)) };
        let z = header.unique(Z)?;
        let frame = match format {
            LogFormat::CsvXya => Frame::NorthEastUp,
            LogFormat::CsvNed if z.is_some() => Frame::NorthEastDown,
            LogFormat::Tum | LogFormat::Euroc if z.is_some() => Frame::EastNorthUp,
            LogFormat::Auto if z.is_some_and(|z| has_known_axes(header, table, time, [x, y, z])) => {
                Frame::EastNorthUp
            }
            LogFormat::Auto => return Err(unknown_axes_message(header, &[x, y])),
            _ => return Err(format_mismatch()),
        };
        let has_angles = has(ColumnMeaning::Roll)
            && has(ColumnMeaning::Pitch)
            && has(ColumnMeaning::Yaw)
            && !has(ColumnMeaning::Qw);
        if frame == Frame::EastNorthUp && has_angles && spec.attitude == AttitudeSource::Log {
            return Err("roll, pitch and yaw do not say what they turn where x is east and z is up: give a \
                    quaternion (qx, qy, qz, qw), or set flight.format = \"csv-xya\" or \"csv-ned\" if x is \
                    north"
                .to_owned());
        }
        let vertical = match z {
            Some(z) => z,
            None => height_column(header, None, spec.height_from, notes)?,
        };
        return Ok((frame, [x, y, vertical].map(source)));
    }
    if has(Grid) {
        return Err(format!(
            "{} are grid coordinates, whose north is not true north: convert them to latitude and longitude \
                (cs2cs, gdaltransform) and name them lat and lon",
            header.describe(&header.columns_where(|meaning| meaning == Grid))
        ));
    }
    if has(EarthCentred) {
        return Err(format!(
            "{} are coordinates from the centre of the Earth (ECEF): convert them to latitude, longitude and \
                height (RTKLIB: solution format Lat/Lon/Height; cs2cs EPSG:4978 EPSG:4979)",
            header.describe(&header.columns_where(|meaning| meaning == EarthCentred))
        ));
    }
    Err(if format == LogFormat::Auto { missing_columns_message(header) } else { format_mismatch() })
}

/// Whether letters of hemispheres say what the signs of latitude and longitude do.
fn hemispheres_are_signed(table: &Table<'_>, letters: &[usize], [latitude, longitude]: [usize; 2]) -> bool {
    table.rows.iter().all(|row| {
        let fields = table.fields(row);
        let field = |column: usize| fields.get(column).copied().unwrap_or("");
        let is_negative = |column: usize| {
            let value = table.number(field(column)).or_else(|| written_numbers::degrees(field(column)));
            value.is_none_or(|value| value <= 0.0)
        };
        letters.iter().all(|&column| match field(column).as_bytes().first().map(u8::to_ascii_lowercase) {
            Some(b's') => is_negative(latitude),
            Some(b'w') => is_negative(longitude),
            _ => true,
        })
    })
}

/// Columns whose name, in lower case, fulfils a condition.
pub(super) fn columns_by_name(header: &HeaderColumns, condition: impl Fn(&str) -> bool) -> Vec<usize> {
    (0..header.0.len())
        .filter(|&column| condition(&header.name(column).trim_matches(['"', ' ']).to_lowercase()))
        .collect()
}

/// Whether x, y, z are known to be east, north, up: by the names of EuRoC or TUM, or by plain names in TUM's
/// order, separated by blanks.
fn has_known_axes(header: &HeaderColumns, table: &Table<'_>, time: usize, [x, y, z]: [usize; 3]) -> bool {
    use ColumnMeaning::{Qw, Qx, Qy, Qz};
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
    let has_quaternion = !header.columns_where(|meaning| meaning == ColumnMeaning::Qw).is_empty();
    let choices = if has_quaternion {
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

/// Notes columns that look relevant and are not used.
pub(super) fn note_unused_columns(
    header: &HeaderColumns,
    frame: Frame,
    attitude: AttitudeColumns,
    notes: &mut Vec<Note>,
) {
    use ColumnMeaning::{Course, Gimbal};
    let describes_another = |name: &str| {
        let stem =
            ["_unit", "_units", "_datum", "_frame"].iter().find_map(|suffix| name.strip_suffix(suffix));
        matches!(name, "unit" | "units" | "datum")
            || stem.is_some_and(|stem| column_names::find(stem).is_some())
    };
    let descriptions = columns_by_name(header, describes_another);
    if !descriptions.is_empty() {
        push_warning(
            notes,
            format!(
                "{} are not read: name units in the header (alt_ft), and say by flight.height what heights \
                    are above",
                header.describe(&descriptions)
            ),
        );
    }
    for (meaning, text) in unknown_units(header) {
        if header.columns_where(|other| other == meaning).is_empty() {
            push_warning(notes, text);
        }
    }
    let declination = columns_by_name(header, |name| {
        name.starts_with("declination") || name.starts_with("magnetic_declination")
    });
    if !declination.is_empty() && matches!(attitude, AttitudeColumns::Euler(_)) {
        push_warning(
            notes,
            format!("{} is not applied: yaw is taken as from true north", header.describe(&declination)),
        );
    }
    let gimbal = header.columns_where(|meaning| meaning == Gimbal);
    if !gimbal.is_empty() {
        push_warning(
            notes,
            format!("{} are not used: camera.mount says where the camera looks", header.describe(&gimbal)),
        );
    }
    let course = header.columns_where(|meaning| meaning == Course);
    if !course.is_empty() && attitude == AttitudeColumns::None {
        push_information(
            notes,
            format!(
                "{} is where the aircraft moves, not where its nose points: no part of an attitude",
                header.describe(&course)
            ),
        );
    }
    if matches!(frame, Frame::Geodetic | Frame::NorthEastUp)
        && matches!(attitude, AttitudeColumns::Quaternion(_))
    {
        push_warning(
            notes,
            "quaternions beside heights that count up are taken as turning forward-right-down bodies to \
                north-east-down, as PX4 writes; ROS writes others"
                .to_owned(),
        );
    }
}
