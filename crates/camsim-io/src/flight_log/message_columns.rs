//! Tables merged from messages, whose columns are named `MESSAGE.field`: MAVLink's and ArduPilot's as
//! `mavlogdump.py --format csv` writes them. The message fixes units and datums.

use camsim_core::scenario::{FlightHeight, HeightReference};

use super::{
    column_meaning::{ColumnMeaning, FixCode},
    header::{HeaderColumn, ParsedName},
    units::{DEGREE, DEGREE_E7, METRE, MICROSECOND, MILLIMETRE, MILLISECOND, RADIAN, Unit},
};

/// A field of a message with its meaning; a field that is not listed is not read.
type Field = (&'static str, ColumnMeaning, Option<&'static Unit>);

/// A message that states a position, an attitude or both.
struct Message {
    name: &'static str,
    fields: &'static [Field],
}

const MSL: ColumnMeaning = ColumnMeaning::Height(Some(HeightReference::Msl));
const ELLIPSOID: ColumnMeaning = ColumnMeaning::Height(Some(HeightReference::Ellipsoid));
const DEGREES: Option<&Unit> = Some(&DEGREE);
const RADIANS: Option<&Unit> = Some(&RADIAN);
const METRES: Option<&Unit> = Some(&METRE);
const E7: Option<&Unit> = Some(&DEGREE_E7);
const MM: Option<&Unit> = Some(&MILLIMETRE);

use ColumnMeaning::{
    Down, East, Fix, InUse, Latitude, Longitude, North, Pitch, Qw, Qx, Qy, Qz, Receiver, RelativeHeight,
    Roll, Time, Yaw,
};

const EULER_RAD: [Field; 3] = [("roll", Roll, RADIANS), ("pitch", Pitch, RADIANS), ("yaw", Yaw, RADIANS)];
const RAW_GPS: &[Field] = &[
    ("lat", Latitude, E7),
    ("lon", Longitude, E7),
    ("alt", MSL, MM),
    ("alt_ellipsoid", ELLIPSOID, MM),
    ("fix_type", Fix(FixCode::Dimensions), None),
];
const ARDUPILOT_GPS: &[Field] = &[
    ("Lat", Latitude, DEGREES),
    ("Lng", Longitude, DEGREES),
    ("Alt", MSL, METRES),
    ("I", Receiver, None),
    ("U", InUse, None),
    ("Status", Fix(FixCode::Dimensions), None),
];
const AHRS: &[Field] = &[
    ("lat", Latitude, E7),
    ("lng", Longitude, E7),
    ("altitude", MSL, METRES),
    EULER_RAD[0],
    EULER_RAD[1],
    EULER_RAD[2],
];
const ARDUPILOT_AHRS: &[Field] = &[
    ("Lat", Latitude, DEGREES),
    ("Lng", Longitude, DEGREES),
    ("Alt", MSL, METRES),
    ("Roll", Roll, DEGREES),
    ("Pitch", Pitch, DEGREES),
    ("Yaw", Yaw, DEGREES),
];

/// Messages; of several with a position, or with an attitude, the first counts.
const MESSAGES: &[Message] = &[
    Message {
        name: "GLOBAL_POSITION_INT",
        fields: &[
            ("lat", Latitude, E7),
            ("lon", Longitude, E7),
            ("alt", MSL, MM),
            ("relative_alt", RelativeHeight(FlightHeight::Takeoff), MM),
        ],
    },
    Message {
        name: "POS",
        fields: &[
            ("Lat", Latitude, DEGREES),
            ("Lng", Longitude, DEGREES),
            ("Alt", MSL, METRES),
            ("RelHomeAlt", RelativeHeight(FlightHeight::Takeoff), METRES),
        ],
    },
    Message {
        name: "LOCAL_POSITION_NED",
        fields: &[("x", North, METRES), ("y", East, METRES), ("z", Down, METRES)],
    },
    Message { name: "GPS_RAW_INT", fields: RAW_GPS },
    Message { name: "GPS2_RAW", fields: RAW_GPS },
    Message { name: "GPS", fields: ARDUPILOT_GPS },
    Message { name: "GPS2", fields: ARDUPILOT_GPS },
    Message { name: "ATTITUDE", fields: &EULER_RAD },
    Message {
        name: "ATTITUDE_QUATERNION",
        fields: &[("q1", Qw, None), ("q2", Qx, None), ("q3", Qy, None), ("q4", Qz, None)],
    },
    Message {
        name: "ATT",
        fields: &[("Roll", Roll, DEGREES), ("Pitch", Pitch, DEGREES), ("Yaw", Yaw, DEGREES)],
    },
    Message { name: "AHR2", fields: ARDUPILOT_AHRS },
    Message { name: "AHRS2", fields: AHRS },
    Message { name: "AHRS3", fields: AHRS },
];

/// Fields that hold the time of a message.
const TIMES: &[(&str, &Unit)] =
    &[("time_boot_ms", &MILLISECOND), ("time_usec", &MICROSECOND), ("TimeUS", &MICROSECOND)];

/// Fields of a table of one ArduPilot message, which has no `MESSAGE.` before its names.
const ONE_MESSAGE: [(&str, ColumnMeaning); 4] =
    [("I", Receiver), ("C", Receiver), ("U", InUse), ("Status", Fix(FixCode::Dimensions))];

fn split(name: &str) -> Option<(&'static Message, &str)> {
    let (before, field) = name.split_once('.')?;
    MESSAGES.iter().find(|message| message.name == before).map(|message| (message, field))
}

/// The quantity that a column is part of, of which one message counts.
fn is_position(meaning: ColumnMeaning) -> bool {
    matches!(
        meaning,
        Latitude
            | Longitude
            | ColumnMeaning::Height(_)
            | North
            | East
            | Down
            | RelativeHeight(_)
            | Fix(_)
            | Receiver
            | InUse
    )
}

/// Applies the tables above to the columns of a header. Columns of messages that do not count lose their
/// meaning.
pub(super) fn apply(columns: &mut [HeaderColumn]) {
    apply_one_message(columns);
    let split_columns = columns.iter().map(|column| {
        let (message, field) = split(&column.name)?;
        Some((message, message.fields.iter().find(|(name, ..)| *name == field), field.to_owned()))
    });
    let mut known: Vec<Option<(&Message, Option<&Field>, String)>> = split_columns.collect();
    // Other programs may use the name of a message for fields of their own.
    let messages: Vec<&str> = known
        .iter()
        .flatten()
        .filter(|(_, field, _)| field.is_some())
        .map(|(message, ..)| message.name)
        .collect();
    for column in &mut known {
        *column = column.take().filter(|(message, ..)| messages.contains(&message.name));
    }
    if messages.is_empty() {
        return;
    }
    let rank = |message: &Message| {
        MESSAGES.iter().position(|other| other.name == message.name).unwrap_or(usize::MAX)
    };
    // A message counts for a quantity if it states a part that only such a message has.
    let first = |of_position: bool| {
        let states = |meaning: ColumnMeaning| match of_position {
            true => matches!(meaning, Latitude | North),
            false => matches!(meaning, Roll | Qw),
        };
        let messages =
            known.iter().flatten().filter(|(_, field, _)| field.is_some_and(|field| states(field.1)));
        messages.map(|(message, ..)| rank(message)).min()
    };
    let (position, attitude) = (first(true), first(false));
    let counts = |message: &Message, meaning: ColumnMeaning| {
        Some(rank(message)) == if is_position(meaning) { position } else { attitude }
    };
    // The time of the row, which no message has, comes before those of the messages.
    let has_row_time = columns.iter().zip(&known).any(|(column, known)| {
        known.is_none() && column.parsed.as_ref().is_some_and(|parsed| parsed.meaning == Time)
    });
    for (column, known) in columns.iter_mut().zip(&known) {
        let Some((message, field, name)) = known else { continue };
        let time = TIMES.iter().find(|(time, _)| time == name);
        column.parsed = match (field, time) {
            (Some((stem, meaning, unit)), _) if counts(message, *meaning) => {
                Some(ParsedName::stated(*meaning, stem, *unit))
            }
            (None, Some((stem, unit))) if !has_row_time && Some(rank(message)) == position => {
                Some(ParsedName::stated(Time, stem, Some(unit)))
            }
            _ => None,
        };
    }
}

fn apply_one_message(columns: &mut [HeaderColumn]) {
    if !columns.iter().any(|column| column.name == "TimeUS") {
        return;
    }
    for column in columns {
        if let Some((name, meaning)) = ONE_MESSAGE.iter().find(|(name, _)| *name == column.name) {
            column.parsed = Some(ParsedName::stated(*meaning, name, None));
        }
    }
}

/// Rows of docs/reference/inputs/LOGS.md: messages and the fields that are read, with their units.
pub(super) fn documentation() -> impl Iterator<Item = [String; 2]> {
    let field = |(name, _, unit): &Field| match unit {
        Some(unit) => format!("{name} ({})", unit.name),
        None => (*name).to_owned(),
    };
    MESSAGES.iter().map(move |message| {
        let fields: Vec<String> = message.fields.iter().map(field).collect();
        [message.name.to_owned(), fields.join(", ")]
    })
}
