//! Which of a header's columns stands for time, position and attitude.

use camsim_core::{
    flight_log::Note,
    scenario::{AttitudeSource, FlightSpec, HeightReference, LogFormat},
};

use super::{
    columns::{AttitudeColumns, Frame, Source, TimeColumns, format_name},
    header::Header,
    names::{self, Meaning},
    text::{Separator, Table},
    units::Datum,
};

fn is_time(meaning: Meaning) -> bool {
    matches!(meaning, Meaning::Time | Meaning::DateTime | Meaning::NanosecondsPart)
}

fn is_height(meaning: Meaning) -> bool {
    matches!(meaning, Meaning::Height(_) | Meaning::PressureHeight | Meaning::RelativeHeight)
}

/// Whether there are a time and a position among the names, whatever else may be wrong with them.
pub(super) fn names_a_flight(header: &Header) -> bool {
    use Meaning::*;
    let any = |is: &dyn Fn(Meaning) -> bool| !header.all(is).is_empty();
    let has = |meaning: Meaning| any(&|other| other == meaning);
    let plane = (has(Latitude) && has(Longitude))
        || has(LatitudeLongitude)
        || (has(North) && has(East))
        || (has(X) && has(Y));
    any(&is_time) && ((plane && (any(&is_height) || has(Down) || has(Z))) || any(&|meaning| meaning == Grid))
}

pub(super) fn what_is_missing(header: &Header) -> String {
    let names: Vec<&str> = header.0.iter().map(|column| column.name.as_str()).collect();
    format!(
        "the columns `{}` name no time and position; name t and lat, lon, alt, or t and north, east, down (or alt), or t and x, y, z",
        names.join(", ")
    )
}

pub(super) fn stem(header: &Header, column: usize) -> &str {
    header.means(column).map_or("", |means| &means.stem)
}

fn information(notes: &mut Vec<Note>, text: String) {
    notes.push(Note { is_warning: false, text });
}

fn warning(notes: &mut Vec<Note>, text: String) {
    notes.push(Note { is_warning: true, text });
}

pub(super) fn time_columns(header: &Header, notes: &mut Vec<Note>) -> Result<TimeColumns, String> {
    let times = header.all(|meaning| meaning == Meaning::Time);
    let parts = header.all(|meaning| meaning == Meaning::NanosecondsPart);
    let texts = header.all(|meaning| meaning == Meaning::DateTime);
    // `time, ms` are two parts of one time, `time, time_ms` two times.
    let is_bare_unit = |column: usize| header.means(column).is_some_and(|means| means.is_bare_unit);
    let with_unit: Vec<usize> = times
        .iter()
        .copied()
        .filter(|&column| header.factor(column).is_some() && !is_bare_unit(column))
        .collect();
    let column = match (&times[..], &with_unit[..], &parts[..], &texts[..]) {
        ([column], ..) => *column,
        ([_, ..], [column], ..) => {
            information(
                notes,
                format!(
                    "of the times {} the one that names its unit counts: `{}`",
                    header.list(&times),
                    header.name(*column)
                ),
            );
            *column
        }
        ([_, ..], ..) => return Err(header.two(&times)),
        ([], _, [column], _) | ([], _, [], [column]) => *column,
        ([], _, [], []) => return Err(what_is_missing(header)),
        ([], _, [], _) => return Err(header.two(&texts)),
        ([], _, _, _) => return Err(header.two(&parts)),
    };
    header.check(column)?;
    let unit_ns = if times.is_empty() && !parts.is_empty() {
        Some(names::NANOSECONDS.factor)
    } else {
        header.factor(column)
    };
    let time_parts = header.all(|meaning| meaning == Meaning::TimePart);
    if is_bare_unit(column) && !time_parts.is_empty() {
        return Err(format!(
            "the time is in several columns ({}): write one, such as seconds since the start",
            header.list(&[&time_parts[..], &[column]].concat())
        ));
    }
    // ROS splits its stamps in two.
    let nanoseconds = match (&parts[..], times.is_empty()) {
        ([], _) | (_, true) => None,
        ([part], false) if stem(header, column).starts_with("sec") => Some(*part),
        _ => return Err(header.two(&[&times[..], &parts[..]].concat())),
    };
    let date = header.one(Meaning::Date)?;
    Ok(TimeColumns { column, unit_ns, whole_are_ns: false, date, nanoseconds })
}

pub(super) fn attitude_columns(header: &Header, notes: &mut Vec<Note>) -> Result<AttitudeColumns, String> {
    use Meaning::{MagneticYaw, Pitch, Qw, Qx, Qy, Qz, Roll, Yaw};
    let any = |meaning: Meaning| !header.all(|other| other == meaning).is_empty();
    let yaws = header.all(|meaning| matches!(meaning, Yaw | MagneticYaw));
    let has_angles = any(Roll) && any(Pitch) && !yaws.is_empty();
    if let Some(columns) = header.all_of([Qx, Qy, Qz, Qw])? {
        if has_angles {
            warning(notes, "of the attitude's quaternion and angles the quaternion counts".to_owned());
        }
        return Ok(AttitudeColumns::Quaternion(columns));
    }
    if !has_angles {
        let some: Vec<usize> =
            header.all(|meaning| matches!(meaning, Roll | Pitch | Yaw | MagneticYaw | Qx | Qy | Qz | Qw));
        if !some.is_empty() {
            information(
                notes,
                format!(
                    "an attitude needs roll, pitch and yaw, or qx, qy, qz and qw: {} alone is none",
                    header.list(&some)
                ),
            );
        }
        let numbered = named(header, |name| {
            ["q0", "q1", "q2", "q3", "q4", "q[0]", "q[1]", "q[2]", "q[3]"].contains(&name)
        });
        if !numbered.is_empty() {
            warning(
                notes,
                format!(
                    "{} are no attitude, as their order is not known: rename them to qw, qx, qy, qz (PX4 numbers them in this order)",
                    header.list(&numbered)
                ),
            );
        }
        return Ok(AttitudeColumns::None);
    }
    let &[yaw] = &yaws[..] else { return Err(header.two(&yaws)) };
    header.check(yaw)?;
    if any(MagneticYaw) {
        warning(
            notes,
            format!(
                "`{}` is from magnetic north, but taken as from true north: add the declination",
                header.name(yaw)
            ),
        );
    }
    let [roll, pitch] = header.all_of([Roll, Pitch])?.unwrap_or_default();
    Ok(AttitudeColumns::Euler([roll, pitch, yaw].map(|column| Source::whole(column, header.factor(column)))))
}

pub(super) fn position_columns(
    header: &Header,
    table: &Table<'_>,
    spec: &FlightSpec,
    time: usize,
    notes: &mut Vec<Note>,
) -> Result<(Frame, [Source; 3]), String> {
    use Meaning::{Down, East, Grid, Latitude, LatitudeLongitude, Longitude, North, X, Y, Z};
    let format = spec.format;
    let any = |meaning: Meaning| !header.all(|other| other == meaning).is_empty();
    let has_geodetic = (any(Latitude) && any(Longitude)) || any(LatitudeLongitude);
    let has_height = !header.all(is_height).is_empty();
    let source = |column: usize| Source::whole(column, header.factor(column));
    if has_geodetic && has_height && matches!(format, LogFormat::Auto | LogFormat::CsvLla) {
        let letters = header.all(|meaning| meaning == Meaning::Hemisphere);
        if !letters.is_empty() {
            return Err(format!(
                "{} say the hemisphere by letters: write signed degrees and remove these columns",
                header.list(&letters)
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
        let parts = named(header, is_part);
        if !parts.is_empty() {
            return Err(format!(
                "{} are minutes and seconds of latitude and longitude: write degrees with decimals in one column each, and remove these columns",
                header.list(&parts)
            ));
        }
        let height = height_column(header, Some(spec.height), notes)?;
        let plane = match (header.all_of([Latitude, Longitude])?, header.one(LatitudeLongitude)?) {
            (Some(pair), None) => pair.map(source),
            (None, Some(column)) => [0, 1].map(|part| Source { part: Some(part), ..source(column) }),
            (Some([latitude, longitude]), Some(both)) => return Err(header.two(&[latitude, longitude, both])),
            (None, None) => return Err(what_is_missing(header)),
        };
        return Ok((Frame::Geodetic, [plane[0], plane[1], source(height)]));
    }
    let named_otherwise = || {
        format!(
            "flight.format is \"{}\" but the columns are named otherwise; remove the key or rename the columns",
            format_name(format)
        )
    };
    if format == LogFormat::CsvLla {
        return Err(named_otherwise());
    }
    if any(North) && any(East) && (any(Down) || has_height) {
        let Some([north, east]) = header.all_of([North, East])? else { return Err(what_is_missing(header)) };
        let (frame, vertical) = match header.one(Down)? {
            Some(_) if has_height && format == LogFormat::CsvXya => {
                (Frame::NorthEastUp, height_column(header, None, notes)?)
            }
            Some(down) => (Frame::NorthEastDown, down),
            None => (Frame::NorthEastUp, height_column(header, None, notes)?),
        };
        let fits = match format {
            LogFormat::Auto => true,
            LogFormat::CsvXya => frame == Frame::NorthEastUp,
            LogFormat::CsvNed => frame == Frame::NorthEastDown,
            _ => false,
        };
        return if fits { Ok((frame, [north, east, vertical].map(source))) } else { Err(named_otherwise()) };
    }
    if any(X) && any(Y) && (any(Z) || has_height) {
        let Some([x, y]) = header.all_of([X, Y])? else { return Err(what_is_missing(header)) };
        let z = header.one(Z)?;
        let frame = match format {
            LogFormat::CsvXya => Frame::NorthEastUp,
            LogFormat::CsvNed if z.is_some() => Frame::NorthEastDown,
            LogFormat::Tum | LogFormat::Euroc if z.is_some() => Frame::EastNorthUp,
            LogFormat::Auto if z.is_some_and(|z| is_known_world(header, table, time, [x, y, z])) => {
                Frame::EastNorthUp
            }
            LogFormat::Auto => return Err(axes_unknown(header, &[x, y])),
            _ => return Err(named_otherwise()),
        };
        let has_angles = any(Meaning::Roll) && any(Meaning::Pitch) && any(Meaning::Yaw) && !any(Meaning::Qw);
        if frame == Frame::EastNorthUp && has_angles && spec.attitude == AttitudeSource::Log {
            return Err(
                "roll, pitch and yaw do not say what they turn where x is east and z is up: give a quaternion (qx, qy, qz, qw), or set flight.format = \"csv-xya\" or \"csv-ned\" if x is north".to_owned(),
            );
        }
        let vertical = match z {
            Some(z) => z,
            None => height_column(header, None, notes)?,
        };
        return Ok((frame, [x, y, vertical].map(source)));
    }
    if any(Grid) {
        return Err(format!(
            "{} are grid coordinates, whose north is not true north: convert them to latitude and longitude (cs2cs, gdaltransform) and name them lat and lon",
            header.list(&header.all(|meaning| meaning == Grid))
        ));
    }
    Err(if format == LogFormat::Auto { what_is_missing(header) } else { named_otherwise() })
}

/// Columns by their names in lower case.
fn named(header: &Header, is: impl Fn(&str) -> bool) -> Vec<usize> {
    (0..header.0.len())
        .filter(|&column| is(&header.name(column).trim_matches(['"', ' ']).to_lowercase()))
        .collect()
}

/// EuRoC's names, TUM's names, or TUM's order of plain names between blanks: worlds of which it is known that
/// z points up.
fn is_known_world(header: &Header, table: &Table<'_>, time: usize, [x, y, z]: [usize; 3]) -> bool {
    use Meaning::{Qw, Qx, Qy, Qz};
    let quaternion = header.all_of([Qx, Qy, Qz, Qw]).ok().flatten();
    let in_order = time == 0 && [x, y, z] == [1, 2, 3] && quaternion == Some([4, 5, 6, 7]);
    match stem(header, x) {
        "p_rs_r_x" | "tx" => true,
        "x" | "px" | "p_x" => in_order && table.separator == Separator::Space,
        _ => false,
    }
}

fn axes_unknown(header: &Header, columns: &[usize]) -> String {
    let has_quaternion = !header.all(|meaning| meaning == Meaning::Qw).is_empty();
    let worlds = if has_quaternion {
        "\"csv-ned\" (x north, y east, z down, body forward-right-down, as AirSim writes), \"csv-xya\" (x north, y east, z up) or \"tum\" (x east, y north, z up, body forward-left-up, as ROS writes)"
    } else {
        "\"csv-xya\" (x north, y east, z up) or \"csv-ned\" (z down)"
    };
    format!(
        "the columns {}, z do not say where their axes point; set flight.format = {worlds}, or name them north, east, alt or down",
        header.list(columns)
    )
}

/// The column that is the height; `reference` is what `flight.height` says, where that matters.
fn height_column(
    header: &Header,
    reference: Option<HeightReference>,
    notes: &mut Vec<Note>,
) -> Result<usize, String> {
    let wanted = reference.map(|height| match height {
        HeightReference::Msl => Datum::MeanSeaLevel,
        HeightReference::Ellipsoid => Datum::Ellipsoid,
    });
    let of = |datum: Option<Datum>| header.all(|meaning| meaning == Meaning::Height(datum));
    let all = header.all(|meaning| matches!(meaning, Meaning::Height(_)));
    let other = |datum: Datum| if datum == Datum::Ellipsoid { Datum::MeanSeaLevel } else { Datum::Ellipsoid };
    let key = |datum: Option<Datum>| if datum == Some(Datum::Ellipsoid) { "ellipsoid" } else { "msl" };
    let column = match (all.len(), wanted) {
        (0, _) => match (
            header.one(Meaning::PressureHeight)?,
            header.all(|meaning| meaning == Meaning::RelativeHeight).first().copied(),
        ) {
            (Some(column), _) => {
                warning(
                    notes,
                    format!(
                        "the only height, `{}`, is by air pressure: it may be off by 100 m and more",
                        header.name(column)
                    ),
                );
                column
            }
            (None, Some(column)) => {
                return Err(format!(
                    "the only height, `{}`, is above take-off or ground: add the height of the place of take-off and name the column alt",
                    header.name(column)
                ));
            }
            (None, None) => return Err(what_is_missing(header)),
        },
        (1, _) => all[0],
        (_, Some(wanted)) => {
            // The one that states what flight.height says; or a sole one that states nothing beside one that
            // states the contrary.
            let column = match (&of(Some(wanted))[..], &of(None)[..], &of(Some(other(wanted)))[..]) {
                ([column], ..) => *column,
                ([], [column], [_]) => *column,
                _ => return Err(header.two(&all)),
            };
            warning(
                notes,
                format!(
                    "of the heights {} `{}` counts, because flight.height is \"{}\"",
                    header.list(&all),
                    header.name(column),
                    key(Some(wanted))
                ),
            );
            column
        }
        (_, None) => return Err(header.two(&all)),
    };
    header.check(column)?;
    let stated = header.means(column).map(|means| means.meaning);
    if let (Some(Meaning::Height(Some(datum))), Some(wanted)) = (stated, wanted)
        && datum != wanted
    {
        warning(
            notes,
            format!(
                "the column `{}` says {}, flight.height says \"{}\": set flight.height = \"{}\", or rename the column",
                header.name(column),
                if datum == Datum::Ellipsoid { "above the ellipsoid" } else { "above mean sea level" },
                key(Some(wanted)),
                key(Some(datum))
            ),
        );
    }
    let pressure = header.all(|meaning| meaning == Meaning::PressureHeight);
    if !all.is_empty() && !pressure.is_empty() {
        information(
            notes,
            format!(
                "the height is `{}`, not {}, which is by air pressure",
                header.name(column),
                header.list(&pressure)
            ),
        );
    }
    Ok(column)
}

pub(super) fn say_what_is_not_used(
    header: &Header,
    frame: Frame,
    attitude: AttitudeColumns,
    notes: &mut Vec<Note>,
) {
    use Meaning::{Course, Gimbal};
    let says_how = |name: &str| {
        let stem = ["_unit", "_units", "_datum", "_frame"].iter().find_map(|end| name.strip_suffix(end));
        stem.is_some_and(|stem| names::find(stem).is_some())
    };
    let how = named(header, says_how);
    if !how.is_empty() {
        warning(
            notes,
            format!(
                "{} are not read: name units in the header (alt_ft), and say by flight.height what heights are above",
                header.list(&how)
            ),
        );
    }
    let declination =
        named(header, |name| name.starts_with("declination") || name.starts_with("magnetic_declination"));
    if !declination.is_empty() && matches!(attitude, AttitudeColumns::Euler(_)) {
        warning(
            notes,
            format!("{} is not applied: yaw is taken as from true north", header.list(&declination)),
        );
    }
    let gimbal = header.all(|meaning| meaning == Gimbal);
    if !gimbal.is_empty() {
        warning(
            notes,
            format!("{} are not used: camera.mount says where the camera looks", header.list(&gimbal)),
        );
    }
    let course = header.all(|meaning| meaning == Course);
    if !course.is_empty() && attitude == AttitudeColumns::None {
        information(
            notes,
            format!(
                "{} is where the aircraft moves, not where its nose points: no part of an attitude",
                header.list(&course)
            ),
        );
    }
    if matches!(frame, Frame::Geodetic | Frame::NorthEastUp)
        && matches!(attitude, AttitudeColumns::Quaternion(_))
    {
        warning(
            notes,
            "quaternions beside heights that count up are taken as turning forward-right-down bodies to north-east-down, as PX4 writes; ROS writes others".to_owned(),
        );
    }
}
