//! Text tables that state units, datums and conventions beside their rows, or doubtful attitudes: files of
//! `tests/data/field-2`, and flights written here. Each is read as it says, refused with a fix, or read with a
//! warning.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use camsim_core::{
    flight_log::{FlightLog, HeightConversion},
    scenario::{AttitudeSource, FlightHeight, FlightSpec, LogFormat, Origin},
};
use camsim_io::flight_log::read_flight_log;
use glam::{DMat3, DQuat, DVec3, EulerRot};

/// Heights above mean sea level, from an origin at 480 m.
fn spec() -> FlightSpec {
    FlightSpec {
        origin: Origin::Geodetic([47.05, 8.31, 480.0]),
        height: FlightHeight::Msl,
        ..FlightSpec::default()
    }
}

fn track() -> FlightSpec {
    FlightSpec { attitude: AttitudeSource::Track, ..spec() }
}

fn format(format: LogFormat) -> FlightSpec {
    FlightSpec { format, ..spec() }
}

/// What a log must give.
#[derive(Clone, Copy)]
struct Flight {
    seconds: f64,
    /// Down coordinate of the first row, metres.
    down_m: f64,
    /// Motion up, metres per second.
    climb_m_s: f64,
    /// Roll, pitch and yaw of the first row, degrees; not compared where the attitude is that of the path.
    angles: Option<[f64; 3]>,
    /// Substrings of all warnings, in order.
    warnings: &'static [&'static str],
    /// Substrings of notes that must be there, beside any others.
    notes: &'static [&'static str],
}

/// The flight of most files: 6 s, from 480 m up at 1 m/s.
const USUAL: Flight = Flight {
    seconds: 6.0,
    down_m: 0.0,
    climb_m_s: 1.0,
    angles: Some([5.0, 2.0, 60.0]),
    warnings: &[],
    notes: &[],
};

enum Expected {
    Gives(Flight),
    Refused(&'static [&'static str]),
}

use Expected::{Gives, Refused};

fn read(path: &Path, spec: &FlightSpec) -> Result<FlightLog, String> {
    read_flight_log(path, spec, HeightConversion::None).map_err(|error| error.to_string())
}

fn read_file(name: &str, spec: &FlightSpec) -> Result<FlightLog, String> {
    read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/field-2").join(name), spec)
}

fn read_bytes(bytes: &[u8], spec: &FlightSpec) -> Result<FlightLog, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, bytes).unwrap();
    read(&path, spec)
}

/// Rows of the usual flight, north at 10 m/s, below a head. Names in braces stand for its numbers.
fn flight(head: &str, pattern: &str) -> String {
    let mut text = format!("{head}\n");
    for row in 0..=60 {
        let t = f64::from(row) * 0.1;
        let height = 480.0 + t;
        let numbers = [
            ("{t}", format!("{t:.1}")),
            ("{ms}", format!("{:.0}", t * 1e3)),
            ("{lat}", format!("{:.9}", 47.05 + t * 8.994_6e-5)),
            ("{lat_rad}", format!("{:.12}", (47.05 + t * 8.994_6e-5).to_radians())),
            ("{lon}", "8.31".to_owned()),
            ("{lon_rad}", format!("{:.12}", 8.31_f64.to_radians())),
            ("{h}", format!("{height:.3}")),
            ("{ft}", format!("{:.3}", height / 0.3048)),
            ("{up}", format!("{t:.3}")),
            ("{up_mm}", format!("{:.0}", t * 1e3)),
            ("{n}", format!("{:.3}", t * 10.0)),
            ("{n_mm}", format!("{:.0}", t * 1e4)),
            ("{rpy}", "5,2,60".to_owned()),
            ("{rpy_rad}", "0.08726646,0.03490659,1.04719755".to_owned()),
        ];
        let row = numbers.iter().fold(pattern.to_owned(), |row, (name, number)| row.replace(name, number));
        text += &row;
        text += "\n";
    }
    text
}

fn check(result: &Result<FlightLog, String>, expected: &Expected) -> Result<(), String> {
    let (log, flight) = match (result, expected) {
        (Err(error), Refused(words)) => {
            return match words.iter().find(|word| !error.contains(*word)) {
                Some(word) => Err(format!("the message lacks `{word}`: {error}")),
                None => Ok(()),
            };
        }
        (Ok(log), Refused(_)) => return Err(format!("read, but should be refused: {:#?}", log.notes)),
        (Err(error), Gives(_)) => return Err(format!("refused: {error}")),
        (Ok(log), Gives(flight)) => (log, flight),
    };
    let near =
        |what: &str, found: f64, expected: f64, tolerance: f64| match (found - expected).abs() <= tolerance {
            true => Ok(()),
            false => Err(format!("{what} {found:.3}, not {expected:.3}: {:#?}", log.notes)),
        };
    let (first, last) = (log.rows.first().unwrap(), log.rows.last().unwrap());
    near("seconds", log.duration_s(), flight.seconds, 1e-6)?;
    near("down", first.position_ned_m.z, flight.down_m, 0.02)?;
    let climb_m_s = (first.position_ned_m.z - last.position_ned_m.z) / log.duration_s();
    near("climb", climb_m_s, flight.climb_m_s, 0.02)?;
    if let Some(angles) = flight.angles {
        let (yaw, pitch, roll) = first.ned_from_body.to_euler(EulerRot::ZYX);
        for (found, expected) in [roll, pitch, yaw].into_iter().zip(angles) {
            near("angle", found.to_degrees(), expected, 0.02)?;
        }
    }
    let warnings: Vec<&str> =
        log.notes.iter().filter(|note| note.is_warning).map(|note| note.text.as_str()).collect();
    let same = warnings.len() == flight.warnings.len()
        && warnings.iter().zip(flight.warnings).all(|(warning, word)| warning.contains(word));
    if !same {
        return Err(format!("warnings {warnings:#?}"));
    }
    match flight.notes.iter().find(|word| !log.notes.iter().any(|note| note.text.contains(*word))) {
        Some(word) => Err(format!("no note has `{word}`: {:#?}", log.notes)),
        None => Ok(()),
    }
}

fn check_all(cases: impl IntoIterator<Item = (String, Result<FlightLog, String>, Expected)>) {
    let faults: Vec<String> = cases
        .into_iter()
        .filter_map(|(name, result, expected)| Some(format!("{name}: {}", check(&result, &expected).err()?)))
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn files_of_reports_are_read_named_or_refused() {
    let local = || FlightSpec { origin: Origin::First, ..spec() };
    let local_track = || FlightSpec { attitude: AttitudeSource::Track, ..local() };
    let path = Flight { angles: None, ..USUAL };
    let cases = [
        (
            "01-g5-two-headers/L01_g5.csv",
            spec(),
            Gives(Flight {
                seconds: 30.0,
                angles: Some([5.0, 2.0, 57.0]),
                warnings: &["`Magnetic Heading (deg)` is from magnetic north", "says above the ellipsoid"],
                notes: &["lines 2 and 3 both name the columns"],
                ..USUAL
            }),
        ),
        (
            "02-units-line-above/L50d_unitsabove_nohash.csv",
            spec(),
            Gives(Flight { seconds: 30.0, notes: &["line 1 states the units"], ..USUAL }),
        ),
        (
            "03-comment-states-feet/L51b_commentfeet.csv",
            spec(),
            Gives(Flight { notes: &["line 1 states the unit of `alt`: ft"], ..USUAL }),
        ),
        ("05-flysight1-units-line/L08_flysight1.csv", track(), Gives(path)),
        ("06-flysight2/L08b_flysight2.csv", track(), Gives(path)),
        (
            "25-hash-data-lines/inspvax.txt",
            spec(),
            Refused(&["a NovAtel log", "t_s,lat_deg,lon_deg,alt_msl_m"]),
        ),
        (
            "38-only-height-unknown/L40_fl.csv",
            spec(),
            Refused(&[
                "line 1",
                "name no height",
                "`flight_level` is not known",
                "alt_ft",
                "multiply by 100",
            ]),
        ),
        (
            "38-only-height-unknown/L41_zdown.csv",
            spec(),
            Refused(&["name no height", "`z_down` is not known", "change its sign and name it alt"]),
        ),
        ("39-ddmm-latitude/L33_ddmm.csv", spec(), Refused(&["4703", "ddmm.mmmm", "47.05"])),
        (
            "50-tum-w-first/L15b_tum_wfirst_nohdr.txt",
            local(),
            Gives(Flight {
                angles: None,
                warnings: &["upside down in every row: in the order w, x, y, z"],
                ..USUAL
            }),
        ),
        ("51-tum-zero-quaternions/ID2_tum_zero.txt", local(), Refused(&["flight.attitude = \"track\""])),
        ("51-tum-zero-quaternions/ID2_tum_zero.txt", local_track(), Gives(path)),
        (
            "52-identity-attitude/ID1_tum_identity.txt",
            local(),
            Gives(Flight {
                angles: Some([0.0, 0.0, 90.0]),
                warnings: &["the attitude is the same in every row, but the path turns"],
                ..USUAL
            }),
        ),
        ("52-identity-attitude/ID1_tum_identity.txt", local_track(), Gives(path)),
    ];
    check_all(cases.map(|(file, spec, expected)| {
        // Local coordinates begin at their own origin.
        (file.to_owned(), read_file(file, &spec), expected)
    }));
}

/// Units and datums in lines above, among and below the rows.
#[test]
fn units_and_datums_beside_the_rows_are_applied_or_named() {
    let names = "time,lat,lon,alt,roll,pitch,yaw";
    let feet = "{t},{lat},{lon},{ft},{rpy}";
    let metres = "{t},{lat},{lon},{h},{rpy}";
    let applied = |notes| Gives(Flight { notes, ..USUAL });
    let named = |warnings| Gives(Flight { warnings, ..USUAL });
    // Feet that are read as metres, with a warning.
    let unread = |warnings| {
        Gives(Flight { down_m: 480.0 - 480.0 / 0.3048, climb_m_s: 1.0 / 0.3048, warnings, ..USUAL })
    };
    let ned = || format(LogFormat::CsvNed);
    let cases: Vec<(&str, String, FlightSpec, Expected)> = vec![
        // Lines of units.
        (
            "comment above",
            flight(&format!("#s, deg, deg, ft, deg, deg, deg\n{names}"), feet),
            spec(),
            applied(&["line 1"]),
        ),
        (
            "below",
            flight(&format!("{names}\n[s],[deg],[deg],[ft],[deg],[deg],[deg]"), feet),
            spec(),
            applied(&["line 2"]),
        ),
        (
            "comment below",
            flight(&format!("{names}\n# s,deg,deg,ft,deg,deg,deg"), feet),
            spec(),
            applied(&["line 2"]),
        ),
        (
            "label and blanks",
            flight(
                &format!("{}\n# units: s deg deg ft deg deg deg", names.replace(',', " ")),
                &feet.replace("{rpy}", "5 2 60").replace(',', " "),
            ),
            spec(),
            applied(&["line 2"]),
        ),
        (
            "units of speeds",
            flight(&format!("{names},vs,hr\ns,deg,deg,ft,deg,deg,deg,ft/min,bpm"), &format!("{feet},1,2")),
            spec(),
            applied(&["line 2"]),
        ),
        (
            "empty units",
            flight(&format!("{names},sats,fix\n,,,(ft),,,,,"), &format!("{feet},9,3")),
            spec(),
            applied(&["line 2"]),
        ),
        (
            "no unit of a quality",
            flight(
                &format!("{} Q\n(s) (deg) (deg) (ft) (deg) (deg) (deg)", names.replace(',', " ")),
                &(feet.replace("{rpy}", "5 2 60").replace(',', " ") + " 1"),
            ),
            spec(),
            applied(&["line 2 states the units"]),
        ),
        (
            "unknown unit",
            flight(&format!("{names}\ns,deg,deg,kft,deg,deg,deg"), feet),
            spec(),
            Refused(&["column 4 (`alt`)", "`kft` is no unit known"]),
        ),
        (
            "words below",
            flight(&format!("{names}\nfloat,float,float,float,float,float,float"), feet),
            spec(),
            Refused(&["line 2", "between the names of the columns (line 1)", "no line of units"]),
        ),
        (
            "Garmin G1000",
            flight(
                "#airframe_info, log_version=\"1.00\", airframe_name=\"X\"\n\
                 #yyy-mm-dd, hh:mm:ss, hh:mm, ident, degrees, degrees, ft Baro, inch, ft msl, deg, deg, deg\n  \
                 Lcl Date, Lcl Time, UTCOfst, AtvWpt, Latitude, Longitude, AltB, BaroA, AltMSL, Roll, Pitch, HDG",
                "2023-05-04, {t}, +02:00, X, {lat}, {lon}, 1, 29.9, {ft}, {rpy}",
            ),
            spec(),
            applied(&["line 2 states the units"]),
        ),
        // Two lines of names.
        (
            "names twice",
            flight(
                &format!(
                    "Time (s),Latitude (deg),Longitude (deg),Altitude MSL (ft),Roll (deg),Pitch (deg),Yaw (deg)\n{names}"
                ),
                feet,
            ),
            spec(),
            applied(&["lines 1 and 2"]),
        ),
        (
            "contradiction",
            flight("time,lat,lon,alt_m,roll,pitch,yaw\ntime,lat,lon,alt_ft,roll,pitch,yaw", feet),
            spec(),
            Refused(&["line 1 names it `alt_m` and line 2 `alt_ft`"]),
        ),
        // Prose.
        (
            "key and value",
            flight(&format!("# Altitude unit: feet\n{names}"), feet),
            spec(),
            applied(&["line 1 states the unit of `alt`: ft"]),
        ),
        ("without a mark", flight(&format!("Altitude in feet\n{names}"), feet), spec(), applied(&["line 1"])),
        (
            "preamble",
            flight(&format!("Logger,X1,serial,1234\nAltitude unit,feet\n\n{names}"), feet),
            spec(),
            applied(&["line 2"]),
        ),
        (
            "below the names",
            flight(&format!("{names}\n# altitude in ft, speeds in knots"), feet),
            spec(),
            applied(&["line 2"]),
        ),
        ("at the end", flight(names, feet) + "# altitude in feet\n", spec(), applied(&["line 63"])),
        ("no names", flight("# heights in feet", feet), spec(), applied(&["`height`: ft"])),
        (
            "radians",
            flight(&format!("# roll, pitch, yaw in radians\n{names}"), "{t},{lat},{lon},{h},{rpy_rad}"),
            spec(),
            applied(&["`roll`, `pitch`, `yaw`: rad"]),
        ),
        (
            "all radians",
            flight(
                &format!("# units: radians, metres, seconds\n{names}"),
                "{t},{lat_rad},{lon_rad},{h},{rpy_rad}",
            ),
            spec(),
            applied(&["rad"]),
        ),
        (
            "milliseconds",
            flight(&format!("# timestamps in milliseconds\n{names}"), "{ms},{lat},{lon},{h},{rpy}"),
            spec(),
            applied(&["`time`: ms"]),
        ),
        (
            "local millimetres",
            flight(
                "# all positions in mm\nt,north,east,down,roll_deg,pitch_deg,yaw_deg",
                "{t},{n_mm},0,-{up_mm},{rpy}",
            ),
            FlightSpec { origin: Origin::First, ..ned() },
            applied(&["mm"]),
        ),
        (
            "doubt",
            flight(&format!("# heights are not in feet\n{names}"), metres),
            spec(),
            named(&["line 1 says `heights are not in feet`"]),
        ),
        (
            "everything",
            flight(&format!("# everything in feet\n{names}"), feet),
            spec(),
            unread(&["line 1 says `everything in feet`, but it is not plainly about a column"]),
        ),
        (
            "imperial",
            flight(&format!("# Imperial units\n{names}"), feet),
            spec(),
            unread(&["heights are read as metres"]),
        ),
        (
            "two units",
            flight(&format!("# alt in feet\n# alt in metres\n{names}"), feet),
            spec(),
            unread(&["another unit is stated for `alt`"]),
        ),
        (
            "the name counts",
            flight("# altitude in feet\ntime,lat,lon,alt_m,roll,pitch,yaw", metres),
            spec(),
            named(&["`alt_m` has another unit"]),
        ),
        (
            "a unit of something else beside a unit in the name",
            flight("# Altitude ceiling (ft): 400\ntime,lat,lon,alt_m,roll,pitch,yaw", metres),
            spec(),
            named(&["the unit of `alt_m` is known by its name"]),
        ),
        (
            "values",
            flight(&format!("# flown at 400 feet, antenna height in feet: 2\n{names}"), metres),
            spec(),
            named(&[]),
        ),
        (
            "a list of columns",
            flight(
                "# Columns:\n# 1: time (s)\n# 2: latitude (deg)\n# 3: longitude (deg)\n# 4: altitude (ft, MSL)\n# 5-7: roll, pitch, yaw (deg)",
                feet,
            ),
            spec(),
            applied(&["line 5 states the unit of `height`: ft"]),
        ),
        // Datums.
        (
            "ellipsoid",
            flight(&format!("# heights above the WGS84 ellipsoid\n{names}"), metres),
            spec(),
            named(&["set flight.height = \"ellipsoid\""]),
        ),
        (
            "vertical datum",
            flight(&format!("# vertical datum = ellipsoid\n{names}"), metres),
            spec(),
            named(&["set flight.height = \"ellipsoid\""]),
        ),
        (
            "above ground",
            flight(&format!("# alt is AGL\n{names}"), metres),
            spec(),
            named(&["flight.height = \"takeoff\""]),
        ),
        ("agrees", flight(&format!("# heights AMSL (EGM96)\n{names}"), metres), spec(), named(&[])),
        (
            "pressure",
            flight(&format!("# altitude: QNH 1013\n{names}"), metres),
            spec(),
            named(&["by air pressure"]),
        ),
        (
            "old datum",
            flight(&format!("# Datum: ED50\n{names}"), metres),
            spec(),
            named(&["positions are taken as WGS 84"]),
        ),
        // Conventions.
        (
            "magnetic",
            flight(&format!("# yaw is magnetic\n{names}"), metres),
            spec(),
            named(&["add the declination"]),
        ),
        ("agreeing axes", flight(&format!("# attitude: NED, FRD\n{names}"), metres), spec(), named(&[])),
        (
            "other axes",
            flight(&format!("# attitude relative to ENU\n{names}"), metres),
            spec(),
            named(&["forward-right-down body to north-east-down"]),
        ),
        (
            "counterclockwise",
            flight(&format!("# heading counter-clockwise from east\n{names}"), metres),
            spec(),
            named(&["clockwise"]),
        ),
    ];
    check_all(
        cases.into_iter().map(|(name, text, spec, expected)| {
            (name.to_owned(), read_bytes(text.as_bytes(), &spec), expected)
        }),
    );
}

/// Conventions other than those by which angles, heights and positions are read.
#[test]
fn conventions_beside_the_rows_are_named() {
    let cases: [(&str, &[&str]); 20] = [
        ("pitch positive nose down", &["pitch is read as positive with the nose up"]),
        ("roll positive right wing down", &[]),
        ("Euler order: XYZ", &["yaw, then pitch, then roll"]),
        ("rotation order: roll first", &["yaw, then pitch, then roll"]),
        ("Euler order: ZYX", &[]),
        ("rotation order: roll, pitch, yaw about fixed axes", &[]),
        ("longitude positive west", &["longitudes as positive east"]),
        ("longitude: east positive, west negative", &[]),
        ("pitch: nose up positive, nose down negative", &[]),
        ("south latitudes positive", &["latitudes are read as positive north"]),
        ("altitude is negative down", &["heights are read as positive up"]),
        ("altitude is positive down", &["heights are read as positive up"]),
        ("positions of the camera, not the body", &["those of the body: camera.mount"]),
        ("Magnetic declination: 3.0 deg (applied)", &[]),
        ("Magnetic declination: 3.0 deg", &["add the declination"]),
        ("home altitude above ground 2 m", &[]),
        ("Sensor height: 1.5 m above ground", &[]),
        ("heights above ground, which is at 480 m", &["flight.height = \"takeoff\""]),
        ("logger WGS72 firmware", &[]),
        ("Datum: WGS72", &["positions are taken as WGS 84"]),
    ];
    check_all(cases.map(|(line, warnings)| {
        let head = format!("# {line}\ntime,lat,lon,alt,roll,pitch,yaw");
        let text = flight(&head, "{t},{lat},{lon},{h},{rpy}");
        (line.to_owned(), read_bytes(text.as_bytes(), &spec()), Gives(Flight { warnings, ..USUAL }))
    }));
}

/// A unit that may be that of something else than a column does not change the numbers.
#[test]
fn units_of_other_things_are_named_and_not_applied() {
    let lines = [
        "# Image height in mm: 24",
        "# marker height in mm: 80",
        "RTH Altitude (ft): 400",
        "# Altitude ceiling (ft)",
        "# geofence height in feet",
        "# DEM height unit: ft",
        "# obstacle heights in feet",
        "# Wingspan and height (ft): 36, 8",
        "# Dist and height units: ft",
        "# Cloud base altitude in feet",
        "# altitude in feet of terrain",
        "# boresight roll in mrad: 3",
        "# IMU roll/pitch bias [mrad]: 1 2",
        "# time between photos in ms: 2000",
        "# timestamps of video in ms",
        "# Video time unit: ms",
        "# col 4: ft",
        "# distances in feet",
    ];
    check_all(lines.map(|line| {
        let text = flight(&format!("{line}\ntime,lat,lon,alt,roll,pitch,yaw"), "{t},{lat},{lon},{h},{rpy}");
        let warnings = &["line 1 says"];
        (line.to_owned(), read_bytes(text.as_bytes(), &spec()), Gives(Flight { warnings, ..USUAL }))
    }));
}

/// A level flight north at heading 60, as a quaternion of a forward-left-up body in east, north, up: 30 degrees
/// to the left of east.
const NORTH_EAST: [&str; 4] = ["0", "0", "0.258819045", "0.965925826"];

fn tum(head: &str, order: [usize; 4], extra: &str) -> String {
    let quaternion = order.map(|index| NORTH_EAST[index]).join(" ");
    flight(head, &format!("{{t}} {{n}} 0 {{up}} {quaternion}{extra}")).trim_start().to_owned()
}

/// The same flight in centimetres.
fn cm(head: &str) -> String {
    let row = "{t} {n}e2 0 {up}e2 ".to_owned() + &NORTH_EAST.join(" ");
    flight(head, &row)
}

#[test]
fn conventions_of_trajectories_are_applied_or_named() {
    let local = || FlightSpec { origin: Origin::First, ..spec() };
    let plain = [0, 1, 2, 3];
    let scalar_first = [3, 0, 1, 2];
    let level = Flight { angles: Some([0.0, 0.0, 60.0]), ..USUAL };
    let read_as_tum = || FlightSpec { format: LogFormat::Tum, ..local() };
    let open_vins =
        "# timestamp(s) tx ty tz qx qy qz qw Pr11 Pr12 Pr13 Pr22 Pr23 Pr33 Pt11 Pt12 Pt13 Pt22 Pt23 Pt33";
    let cases = [
        (
            "names of more columns",
            tum(open_vins, plain, ""),
            local(),
            Gives(Flight { warnings: &["line 1 names 20 columns, but the rows have 8"], ..level }),
        ),
        (
            "and with the format",
            tum(open_vins, plain, ""),
            read_as_tum(),
            Gives(Flight { warnings: &["line 1 names 20 columns, but the rows have 8"], ..level }),
        ),
        (
            "names of fewer columns",
            tum("# t tx ty tz qx qy qz", plain, ""),
            read_as_tum(),
            Gives(Flight { warnings: &["line 1 names 7 columns"], ..level }),
        ),
        (
            "a label and names of more columns",
            tum("# format: timestamp tx ty tz qx qy qz qw valid", plain, ""),
            local(),
            Gives(Flight { warnings: &["line 1 names 9 columns, but the rows have 8"], ..level }),
        ),
        (
            "others before the attitude",
            tum("# timestamp tx ty tz vx vy vz qx qy qz qw", plain, ""),
            local(),
            Gives(Flight { warnings: &["line 1 names 11 columns"], ..level }),
        ),
        (
            "another order",
            tum("# timestamp, x, y, z, qw, qx, qy, qz, frame_id", plain, ""),
            local(),
            Refused(&["9 columns, but the rows have 8"]),
        ),
        (
            "more numbers than names",
            tum("# timestamp tx ty tz qx qy qz qw", plain, " 1 2 3"),
            local(),
            Gives(Flight { warnings: &["line 1 names 8 columns, but the rows have 11"], ..level }),
        ),
        (
            "others between them, with the format",
            tum("# t tx ty tz vx vy vz qx qy qz qw", plain, ""),
            read_as_tum(),
            Gives(Flight { warnings: &["line 1 names 11 columns"], ..level }),
        ),
        (
            "units in names of more columns",
            cm("# time[s] tx[cm] ty[cm] tz[cm] qx qy qz qw valid"),
            local(),
            Gives(Flight { warnings: &["line 1 names 9 columns"], ..level }),
        ),
        (
            "names of others",
            tum("# t id tx ty tz qx qy qz qw", plain, ""),
            local(),
            Refused(&["9 columns, but the rows have 8"]),
        ),
        (
            "scalar first",
            tum("# quaternion: scalar first", scalar_first, ""),
            local(),
            Gives(Flight { notes: &["order of the quaternions: qw"], ..level }),
        ),
        (
            "w x y z",
            tum("# poses with quaternions (w, x, y, z)", scalar_first, ""),
            local(),
            Gives(Flight { notes: &["order of the quaternions: qw"], ..level }),
        ),
        ("scalar last", tum("# quaternions are xyzw", plain, ""), local(), Gives(level)),
        (
            "names against prose",
            tum("# scalar first\n# timestamp tx ty tz qx qy qz qw", plain, ""),
            local(),
            Gives(Flight { warnings: &["the names say otherwise"], ..level }),
        ),
        (
            "named axes",
            tum("# frame: NED", plain, ""),
            local(),
            Gives(Flight { warnings: &["positions are read as x east, y north, z up"], ..level }),
        ),
        (
            "z down",
            tum("# z axis points down", plain, ""),
            local(),
            Gives(Flight { warnings: &["x east, y north, z up"], ..level }),
        ),
        (
            "axes in as many words as columns",
            tum("# world frame: NED (x north, y east, z down)\n# timestamp tx ty tz qx qy qz qw", plain, ""),
            local(),
            Gives(Flight { warnings: &["positions are read as x east"], ..level }),
        ),
        (
            "JPL",
            tum("# quaternions in JPL convention", plain, ""),
            local(),
            Gives(Flight { warnings: &["read as Hamilton's"], ..level }),
        ),
        ("agreeing axes", tum("# world ENU, body FLU, z up", plain, ""), local(), Gives(level)),
        (
            "poses of the world",
            tum("# T_cw: world to camera", plain, ""),
            local(),
            Gives(Flight { warnings: &["invert them"], ..level }),
        ),
        (
            "units of all",
            cm("# all values in cm and s"),
            local(),
            Gives(Flight { notes: &["line 1 states the unit of `x`, `y`, `z`: cm"], ..level }),
        ),
        ("unit of poses", cm("# pose in cm"), local(), Gives(level)),
        ("unit of ground truth", cm("# ground truth, unit: cm"), local(), Gives(level)),
        ("scale of one", cm("# scale: 1 unit = 1 cm"), local(), Gives(level)),
        ("nothing but a unit", cm("# [cm]"), local(), Gives(level)),
        (
            "another scale",
            tum("# 1 unit = 0.01 m", plain, ""),
            local(),
            Gives(Flight { warnings: &["line 1 says `1 unit = 0.01 m`"], ..level }),
        ),
        ("velocities", tum("# velocity in NED", plain, ""), local(), Gives(level)),
        ("some without", tum("", plain, "") + "6.0 60 0 6 0 0 0 0\n", local(), Gives(level)),
    ];
    check_all(
        cases.map(|(name, text, spec, expected)| {
            (name.to_owned(), read_bytes(text.as_bytes(), &spec), expected)
        }),
    );
}

/// A circle flown within 60 s, level, with the attitude of each pattern: `{yaw}` is the course, `{w}` and `{z}`
/// the quaternion of a forward-left-up body along it, `{xo}` to `{wo}` that of a camera.
fn circle(head: &str, pattern: &str) -> String {
    let mut text = if head.is_empty() { String::new() } else { format!("{head}\n") };
    for row in 0..=600 {
        let t = f64::from(row) * 0.1;
        let course = (t * 6.0).to_radians();
        let half_left_of_east = (90_f64.to_radians() - course) / 2.0;
        let latitude_deg = 47.05 + 100.0 * course.sin() * 8.994_6e-6;
        let longitude_deg = 8.31 + (100.0 - 100.0 * course.cos()) * 1.3176e-5;
        // A camera that looks along the course: x right, y down, z forward.
        let optical = DQuat::from_mat3(&DMat3::from_cols(
            DVec3::new(course.cos(), -course.sin(), 0.0),
            -DVec3::Z,
            DVec3::new(course.sin(), course.cos(), 0.0),
        ));
        let numbers = [
            ("{t}", format!("{t:.1}")),
            ("{east}", format!("{:.4}", 100.0 - 100.0 * course.cos())),
            ("{north}", format!("{:.4}", 100.0 * course.sin())),
            ("{yaw}", format!("{:.3}", course.to_degrees())),
            ("{w}", format!("{:.9}", half_left_of_east.cos())),
            ("{z}", format!("{:.9}", half_left_of_east.sin())),
            ("{lat}", format!("{:.9}", latitude_deg)),
            ("{lon}", format!("{:.9}", longitude_deg)),
            ("{lat_rad}", format!("{:.12}", latitude_deg.to_radians())),
            ("{lon_rad}", format!("{:.12}", longitude_deg.to_radians())),
            ("{wo}", format!("{:.9}", optical.w)),
            ("{xo}", format!("{:.9}", optical.x)),
            ("{yo}", format!("{:.9}", optical.y)),
            ("{zo}", format!("{:.9}", optical.z)),
        ];
        let row = numbers.iter().fold(pattern.to_owned(), |row, (name, number)| row.replace(name, number));
        text += &row;
        text += "\n";
    }
    text
}

#[test]
fn attitudes_that_contradict_the_path_are_named() {
    let local = || FlightSpec { origin: Origin::First, ..spec() };
    let upright = || Flight { seconds: 60.0, climb_m_s: 0.0, angles: None, ..USUAL };
    let with = |warnings| Gives(Flight { warnings, ..upright() });
    let ned = "t,north,east,down,roll_deg,pitch_deg,yaw_deg";
    let xyz = "{t} {east} {north} 0";
    let cases = [
        ("a circle", circle("", &format!("{xyz} 0 0 {{z}} {{w}}")), with(&[])),
        (
            "scalar first in a circle",
            circle("", &format!("{xyz} {{w}} 0 0 {{z}}")),
            with(&["in the order w, x, y, z"]),
        ),
        (
            "named against the numbers",
            circle("# t tx ty tz qw qx qy qz", &format!("{xyz} 0 0 {{z}} {{w}}")),
            with(&["in the order x, y, z, w"]),
        ),
        ("roll of 180", circle(ned, "{t},{north},{east},0,180,0,{yaw}"), with(&["upside down in every row"])),
        (
            "zeros",
            circle(ned, "{t},{north},{east},0,0,0,0"),
            with(&["the attitude is the same in every row"]),
        ),
        ("identity", circle("", &format!("{xyz} 0 0 0 1")), with(&["set flight.attitude = \"track\""])),
        (
            "zeros by latitude",
            circle("t,lat,lon,alt,roll,pitch,yaw", "{t},{lat},{lon},480,0,0,0"),
            with(&["the attitude is the same in every row"]),
        ),
        (
            "one attitude by latitude",
            circle("t,lat_rad,lon_rad,alt,roll,pitch,yaw", "{t},{lat_rad},{lon_rad},480,5,2,60"),
            with(&["the attitude is the same in every row"]),
        ),
        (
            "identity by latitude",
            circle("t,lat,lon,alt,qw,qx,qy,qz", "{t},{lat},{lon},480,1,0,0,0"),
            with(&["as PX4 writes", "the attitude is the same in every row"]),
        ),
        (
            "a circle by latitude",
            circle("t,lat,lon,alt,roll,pitch,yaw", "{t},{lat},{lon},480,0,0,{yaw}"),
            with(&[]),
        ),
        (
            "optical axes",
            circle("", &format!("{xyz} {{xo}} {{yo}} {{zo}} {{wo}}")),
            with(&["belong to camera (optical) axes"]),
        ),
        (
            "optical axes, named",
            circle("# t tx ty tz qx qy qz qw", &format!("{xyz} {{xo}} {{yo}} {{zo}} {{wo}}")),
            with(&["belong to camera (optical) axes"]),
        ),
        (
            "z down",
            circle("", &format!("{xyz} {{w}} {{z}} 0 0")),
            with(&["upside down in every row: do the quaternions belong to a body with other axes"]),
        ),
        ("roll of -90", circle(ned, "{t},{north},{east},0,-88,0,{yaw}"), with(&["lies on its side"])),
        (
            "one heading",
            circle(ned, "{t},{north},{east},0,0,0,45"),
            with(&["the attitude is the same in every row"]),
        ),
        ("angles of a circle", circle(ned, "{t},{north},{east},0,20,2,{yaw}"), with(&[])),
        ("zeros at rest", circle(ned, "{t},0,0,0,0,0,0"), with(&[])),
        ("a loop", circle(ned, "{t},{north},{east},0,0,0,{yaw}").replace(",0,0,1", ",180,0,1"), with(&[])),
    ];
    check_all(
        cases
            .map(|(name, text, expected)| (name.to_owned(), read_bytes(text.as_bytes(), &local()), expected)),
    );
}

#[test]
fn files_that_are_no_table_are_named() {
    let ddmm = |lat: &str, lon: &str| {
        flight("time,lat,lon,alt,roll,pitch,yaw", &format!("{{t}},{lat},{lon},{{h}},{{rpy}}"))
    };
    let cases: Vec<(&str, Vec<u8>, &[&str])> = vec![
        ("TIFF", b"II*\0\x08\0\0\0\xff\xfe".to_vec(), &["picture"]),
        ("big TIFF", b"MM\0+\0\x08\0\0\xff".to_vec(), &["picture"]),
        ("PNG", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec(), &["picture"]),
        ("PDF", b"%PDF-1.7\n%\xe2\xe3\xcf\xd3\n".to_vec(), &["PDF"]),
        ("zip and xlsx", b"PK\x03\x04\x14\0\x08\0".to_vec(), &["spreadsheet or an archive"]),
        ("gzip", b"\x1f\x8b\x08\0\0".to_vec(), &["compressed"]),
        ("binary", b"\x01\x02\0\0\xff\xfe".to_vec(), &["binary, of no known kind"]),
        (
            "VectorNav",
            b"$VNINS,381600.0,2260,0004,60.0,2.0,5.0,47.05,8.31,480.0*5E\n".to_vec(),
            &["VectorNav"],
        ),
        (
            "RINEX",
            b"     3.04           OBSERVATION DATA    M                   RINEX VERSION / TYPE\n".to_vec(),
            &["RINEX"],
        ),
        (
            "data behind marks",
            flight("#", "# {t},{lat},{lon},{h},{rpy}").into_bytes(),
            &["all 62 lines begin with # or %", "remove these marks"],
        ),
        ("no time", flight("lat,lon,alt,roll", "{lat},{lon},{h},5").into_bytes(), &["name no time"]),
        (
            "no longitude",
            flight("t,lat,alt,roll", "{t},{lat},{h},5").into_bytes(),
            &["latitude but no longitude"],
        ),
        (
            "a height of its own",
            flight("t,lat,lon,hgt_x", "{t},{lat},{lon},{h}").into_bytes(),
            &["no height", "`hgt_x` is not known"],
        ),
        (
            "in a comment",
            flight("# time,lat,lon,flight_level,roll,pitch,yaw", "{t},{lat},{lon},{h},{rpy}").into_bytes(),
            &["line 1", "no height"],
        ),
        (
            "down beside degrees",
            flight("t,lat,lon,down", "{t},{lat},{lon},-{h}").into_bytes(),
            &["no height", "`down` counts down"],
        ),
        ("minutes", ddmm("4703.05", "00831.2").into_bytes(), &["ddmm.mmmm"]),
        ("south and west", ddmm("-3355.0", "-15112.5").into_bytes(), &["ddmm.mmmm"]),
        ("metres", ddmm("5211970.5", "4470.5").into_bytes(), &["are these metres?"]),
    ];
    check_all(
        cases
            .into_iter()
            .map(|(name, bytes, words)| (name.to_owned(), read_bytes(&bytes, &spec()), Refused(words))),
    );
}
