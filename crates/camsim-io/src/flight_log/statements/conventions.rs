//! Conventions in prose: what heights are above, where axes point, how quaternions are written.

use camsim_core::{
    flight_log::Note,
    scenario::{FlightSpec, HeightReference},
};

use super::{
    super::{
        column_meaning::ColumnMeaning,
        columns::{AttitudeColumns, AttitudeKind, Frame},
        layout::TableLayout,
        text_table::HeaderLine,
        word_list::has_word,
        xml::DATUMS,
    },
    Doubt, meaning_of,
};

/// A convention that prose may name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Convention {
    MeanSeaLevel,
    Ellipsoid,
    AboveGround,
    AirPressure,
    NorthEastDown,
    EastNorthUp,
    OtherWorld,
    ForwardRightDown,
    ForwardLeftUp,
    OtherBody,
    ScalarFirst,
    ScalarLast,
    WorldToBody,
    MagneticNorth,
    CounterClockwise,
    LeftHanded,
    VerticalY,
    ZUp,
    ZDown,
    XNorth,
    XEast,
    Imperial,
    Jpl,
    PitchDown,
    HeightDown,
    WestOrSouth,
    EulerOrder,
    OtherPoint,
}

use Convention::*;

/// What phrases name, as words of letters and digits, with commas between phrases.
const PHRASES: &[(Convention, &str)] = &[
    (
        MeanSeaLevel,
        "msl, amsl, asl, sea level, orthometric, above geoid, above the geoid, egm96, egm2008, navd88",
    ),
    (
        Ellipsoid,
        "hae, ellipsoidal height, ellipsoidal heights, ellipsoid height, ellipsoid heights, \
            above ellipsoid, above the ellipsoid, above wgs84, above wgs 84, above the wgs84, \
            above the wgs 84, height wgs84 ellipsoid, heights ellipsoidal, height ellipsoidal",
    ),
    (
        AboveGround,
        "agl, above ground, above takeoff, above take off, above home, relative to home, \
            relative to takeoff, relative to take off, relative to ground, above launch",
    ),
    (
        AirPressure,
        "pressure altitude, pressure altitudes, barometric altitude, barometric altitudes, \
            barometric height, barometric heights, flight levels, qnh, qfe, qne",
    ),
    (NorthEastDown, "ned, north east down"),
    (EastNorthUp, "enu, east north up"),
    (OtherWorld, "nwu, north west up, ecef, eun, esu, wnd, earth centred, earth centered"),
    (ForwardRightDown, "frd, forward right down, front right down, fwd right down"),
    (ForwardLeftUp, "flu, forward left up, front left up, fwd left up"),
    (OtherBody, "rdf, right down forward, optical frame, camera frame, rub, opengl, opencv"),
    (ScalarFirst, "wxyz, w x y z, qw qx qy qz, w first, scalar first, real part first"),
    (ScalarLast, "xyzw, x y z w, qx qy qz qw, w last, scalar last, real part last"),
    (
        WorldToBody,
        "world to body, world to camera, world to cam, w2c, w2b, body from world, camera from world, \
            global to body, ned to body, enu to body, map to body",
    ),
    (MagneticNorth, "magnetic"),
    (
        CounterClockwise,
        "counter clockwise, counterclockwise, anticlockwise, anti clockwise, ccw, yaw from east, \
            heading from east",
    ),
    (LeftHanded, "left handed, left hand"),
    (VerticalY, "y up, y down, y vertical"),
    (ZUp, "z up, z upward, z upwards"),
    (ZDown, "z down, z downward, z downwards"),
    (XNorth, "x north"),
    (XEast, "x east"),
    (Imperial, "imperial, us customary"),
    (Jpl, "jpl, shuster"),
    (
        PitchDown,
        "positive nose down, nose down positive, nose down is positive, negative nose up, nose up negative, \
            pitch positive down, pitch positive downward, pitch positive downwards, positive pitch down, \
            positive pitch nose down",
    ),
    (
        HeightDown,
        "altitude positive down, altitude negative down, altitude negative up, altitude positive downward, \
            altitude positive downwards, altitudes positive down, altitudes negative down, \
            alt positive down, alt negative down, alt negative up, height positive down, \
            height negative down, height negative up, heights positive down, heights negative down, \
            heights negative up, positive down altitude, positive down height",
    ),
    (
        WestOrSouth,
        "positive west, positive westward, positive westwards, west positive, west longitude positive, \
            west longitudes positive, negative east, east negative, positive south, positive southward, \
            positive southwards, south positive, south latitude positive, south latitudes positive, \
            negative north, north negative",
    ),
    (
        EulerOrder,
        "euler order, euler sequence, euler convention, rotation order, rotation sequence, \
            order of rotation, order of rotations, order of angles, angle order, angles order, euler xyz, \
            euler angles xyz, xyz euler, roll first",
    ),
    (
        OtherPoint,
        "position of camera, positions of camera, camera position, camera positions, position of antenna, \
            positions of antenna, antenna position, antenna positions, position of antenna phase center, \
            position of lidar, positions of lidar",
    ),
];

/// Applies the order of quaternions. Returns the statements that differ from how the table is read.
pub(super) fn apply(
    layout: &mut TableLayout,
    lines: &[HeaderLine<'_>],
    spec: &FlightSpec,
    notes: &mut Vec<Note>,
) -> Vec<Doubt> {
    let named: Vec<(Convention, &HeaderLine<'_>)> =
        lines.iter().flat_map(|line| find(line.text).into_iter().map(move |found| (found, line))).collect();
    let names = |convention: Convention| named.iter().any(|(other, _)| *other == convention);
    let orders = (names(ScalarFirst), names(ScalarLast));
    if orders.0 != orders.1
        && let Some(line) = named.iter().find(|(found, _)| matches!(found, ScalarFirst | ScalarLast))
    {
        apply_order(layout, orders.0, line.1.number, notes);
    }
    let mut doubts: Vec<Doubt> = named
        .iter()
        .filter_map(|(convention, line)| Some(Doubt::new(line, difference(*convention, layout, spec)?)))
        .collect();
    doubts.extend(lines.iter().filter_map(|line| other_datum(line, layout)));
    doubts
}

/// The conventions that a line names.
fn find(line: &str) -> Vec<Convention> {
    const FILLERS: &str = "is are axis axes points pointing to towards the as";
    const MOTIONS: &str = "velocity velocities vel speed acceleration accelerations gyro";
    const STATES: &str = "position positions attitude orientation pose poses quaternion height heights \
        altitude altitudes";
    let lower = line.to_lowercase();
    let words: Vec<&str> =
        lower.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    let joined = |words: &[&str]| format!(" {} ", words.join(" "));
    let plain = joined(&words);
    let short: Vec<&str> = words.iter().copied().filter(|word| !has_word(FILLERS, word)).collect();
    let unsigned: Vec<&str> = short.iter().copied().filter(|word| *word != "positive").collect();
    let (short, unsigned) = (joined(&short), joined(&unsigned));
    let contains = |list: &str| words.iter().any(|word| has_word(list, word));
    // `velocity in ENU` does not concern positions.
    let is_of_motion = contains(MOTIONS) && !contains(STATES);
    if is_of_motion {
        return Vec::new();
    }
    let has = |phrase: &str| {
        let phrase = format!(" {phrase} ");
        plain.contains(&phrase) || short.contains(&phrase) || unsigned.contains(&phrase)
    };
    let named = PHRASES.iter().filter(|(_, phrases)| phrases.split(", ").any(has));
    let mut found: Vec<Convention> = named.map(|(convention, _)| *convention).collect();
    found.retain(|convention| match convention {
        // `Magnetic declination: 3 deg (applied)`
        MagneticNorth => !contains("applied corrected removed"),
        AboveGround => !is_height_of_other(&words),
        // `nose up positive, nose down negative`
        PitchDown | WestOrSouth if lower.contains(',') => {
            lower.split(',').any(|clause| find(clause).contains(convention))
        }
        EulerOrder => !has_order_read(&plain),
        _ => true,
    });
    // An ellipsoid alone is a part of any geodetic datum; that of heights is a statement.
    let is_vertical = contains("height heights altitude altitudes alt vertical elevation h");
    if is_vertical && contains("ellipsoid ellipsoidal") && !found.contains(&Ellipsoid) {
        found.push(Ellipsoid);
    }
    if is_vertical
        && contains("geoid")
        && !contains("undulation separation")
        && !found.contains(&MeanSeaLevel)
    {
        found.push(MeanSeaLevel);
    }
    found
}

/// Whether a line says how high something is, as in `Sensor height: 1.5 m above ground`.
fn is_height_of_other(words: &[&str]) -> bool {
    let is_number = |word: &&str| word.bytes().all(|byte| byte.is_ascii_digit());
    let is_other = |word: &&str| {
        ["home", "sensor", "camera", "antenna", "lidar", "takeoff", "launch", "base", "station"]
            .contains(word)
    };
    words.iter().any(is_number)
        && words
            .windows(2)
            .any(|pair| is_other(&pair[0]) && ["height", "altitude", "elevation", "alt"].contains(&pair[1]))
}

/// Whether a line names the order in which angles are read: yaw, pitch, roll about turned axes, which is roll,
/// pitch, yaw about fixed ones.
fn has_order_read(line: &str) -> bool {
    let has = |phrases: &[&str]| phrases.iter().any(|phrase| line.contains(&format!(" {phrase} ")));
    if has(&["extrinsic", "fixed", "static"]) {
        return has(&["xyz", "x y z", "roll pitch yaw", "rpy"]);
    }
    has(&["zyx", "z y x", "yaw pitch roll", "ypr", "321", "3 2 1", "yaw first"])
}

/// Reads quaternions without names in the order that prose states.
fn apply_order(layout: &mut TableLayout, is_scalar_first: bool, line: usize, notes: &mut Vec<Note>) {
    let AttitudeColumns::Quaternion(columns) = &mut layout.attitude else { return };
    let ordered = if is_scalar_first { [5, 6, 7, 4] } else { [4, 5, 6, 7] };
    if layout.has_header || *columns == ordered {
        return;
    }
    *columns = ordered;
    let names = if is_scalar_first { ["qw", "qx", "qy", "qz"] } else { ["qx", "qy", "qz", "qw"] };
    for (name, order) in layout.names.iter_mut().skip(4).zip(names) {
        order.clone_into(name);
    }
    notes.push(Note::information(format!(
        "line {line} states the order of the quaternions: {}",
        names.join(", ")
    )));
}

/// How the table is read, and what to do, where that differs from a convention; `None` where it agrees or the
/// convention concerns nothing that is read.
// Long because it is one table of cases.
fn difference(convention: Convention, layout: &TableLayout, spec: &FlightSpec) -> Option<String> {
    let frame = layout.frame;
    let is_geodetic = frame == Frame::Geodetic;
    let (is_euler, is_quaternion) = match layout.attitude.kind() {
        AttitudeKind::None => (false, false),
        AttitudeKind::Euler => (true, false),
        AttitudeKind::Quaternion => (false, true),
    };
    let has_attitude = is_euler || is_quaternion;
    let axes = match frame {
        Frame::Geodetic => "attitudes are read as turning a forward-right-down body to north-east-down",
        Frame::NorthEastUp => "positions are read as north, east, up",
        Frame::NorthEastDown => "positions are read as north, east, down, bodies as forward-right-down",
        Frame::EastNorthUp => "positions are read as x east, y north, z up, bodies as forward-left-up",
    };
    let turned = format!("{axes}: convert them, or name the columns or set flight.format to say so");
    let mounted = format!("{axes}: camera.mount turns the camera in that body");
    let height = meaning_of(layout, layout.position[2].column);
    let (differs, reason) = match convention {
        MeanSeaLevel | Ellipsoid if !is_geodetic => return None,
        MeanSeaLevel => return other_height(HeightReference::Msl, height, spec),
        Ellipsoid => return other_height(HeightReference::Ellipsoid, height, spec),
        AboveGround => {
            let is_read_so =
                spec.height.datum().is_none() || matches!(height, Some(ColumnMeaning::RelativeHeight(_)));
            let problem = "heights are read as above what flight.height says: set flight.height = \"takeoff\" or \
                \"ground\" if they are";
            (is_geodetic && !is_read_so, problem)
        }
        AirPressure => (
            is_geodetic && height != Some(ColumnMeaning::PressureHeight),
            "heights are read as true ones: those by air pressure may be off by 100 m and more",
        ),
        NorthEastDown => (!matches!(frame, Frame::NorthEastDown | Frame::Geodetic), &*turned),
        EastNorthUp => (frame != Frame::EastNorthUp && (!is_geodetic || has_attitude), &*turned),
        OtherWorld => (!is_geodetic || has_attitude, &*turned),
        ForwardRightDown => (has_attitude && frame == Frame::EastNorthUp, &*turned),
        ForwardLeftUp => (has_attitude && frame != Frame::EastNorthUp, &*turned),
        OtherBody => (has_attitude, &*mounted),
        ScalarFirst | ScalarLast => {
            let AttitudeColumns::Quaternion([x, _, _, w]) = layout.attitude else { return None };
            ((w < x) != (convention == ScalarFirst), "the names say otherwise, and count")
        }
        WorldToBody => {
            (is_quaternion, "quaternions are read as turning the body to the world: invert them if it is so")
        }
        MagneticNorth => {
            (is_euler && !has_magnetic_yaw(layout), "yaw is read as from true north: add the declination")
        }
        CounterClockwise => (is_euler, "yaw is read as from north, clockwise: convert it"),
        LeftHanded => (!is_geodetic || has_attitude, &*turned),
        VerticalY => (!is_geodetic, &*turned),
        ZUp => (frame == Frame::NorthEastDown, &*turned),
        ZDown => (matches!(frame, Frame::NorthEastUp | Frame::EastNorthUp), &*turned),
        XNorth => (frame == Frame::EastNorthUp, &*turned),
        XEast => (matches!(frame, Frame::NorthEastUp | Frame::NorthEastDown), &*turned),
        Jpl => (
            is_quaternion,
            "quaternions are read as Hamilton's, which turn the body to the world: invert them if they turn the \
                world to the body",
        ),
        PitchDown => (is_euler, "pitch is read as positive with the nose up: change its sign if it is not"),
        HeightDown => (
            frame != Frame::NorthEastDown,
            "heights are read as positive up: change their sign if they are not",
        ),
        WestOrSouth => (
            is_geodetic,
            "latitudes are read as positive north and longitudes as positive east: change the sign",
        ),
        EulerOrder => (
            is_euler,
            "angles are read as yaw, then pitch, then roll, about turned axes (ZYX): convert them if they \
                are not",
        ),
        OtherPoint => {
            (true, "positions are read as those of the body: camera.mount says where the camera is in it")
        }
        Imperial => (
            layout.position[2].factor.is_none(),
            "heights are read as metres: name units in the header, as `alt_ft`",
        ),
    };
    differs.then(|| reason.to_owned())
}

/// How heights are read where their column or flight.height says otherwise than prose.
fn other_height(stated: HeightReference, height: Option<ColumnMeaning>, spec: &FlightSpec) -> Option<String> {
    if let Some(ColumnMeaning::Height(Some(named))) = height {
        // The names are compared with the key where the column is chosen.
        return (named != stated).then(|| "the name of the column says otherwise, and counts".to_owned());
    }
    (spec.height.datum() != Some(stated)).then(|| {
        format!(
            "flight.height says \"{}\": set flight.height = \"{}\" if the line is about the heights",
            spec.height.name(),
            stated.name()
        )
    })
}

/// Whether the name of the yaw says that it is from magnetic north, of which the header's reader warns.
fn has_magnetic_yaw(layout: &TableLayout) -> bool {
    let AttitudeColumns::Euler([_, _, yaw]) = layout.attitude else { return false };
    meaning_of(layout, yaw.column) == Some(ColumnMeaning::MagneticYaw)
}

/// A horizontal datum other than WGS 84.
fn other_datum(line: &HeaderLine<'_>, layout: &TableLayout) -> Option<Doubt> {
    let words: Vec<String> = line
        .text
        .split_whitespace()
        .map(|word| word.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_ascii_uppercase())
        .collect();
    let is_named = |datum: &&str| {
        words.iter().any(|word| word == datum) || words.windows(2).any(|pair| pair.concat() == *datum)
    };
    let datum = DATUMS.split(' ').find(is_named)?;
    // `logger WGS72 firmware`: the name of a device.
    let has = |list: &str| words.iter().any(|word| has_word(list, word));
    if has("FIRMWARE SOFTWARE HARDWARE SERIAL")
        && !has("DATUM COORDINATES POSITIONS CRS LATITUDE LONGITUDE LAT LON")
    {
        return None;
    }
    (layout.frame == Frame::Geodetic).then(|| {
        Doubt::new(line, format!("positions are taken as WGS 84: convert them if they are of {datum}"))
    })
}
