//! Flight logs that are no tables, whose instances, frames, flags or headers decide: `tests/data/field-2`. Files
//! in `streams` are written by `scripts/goldens/flight_streams.py`; texts stand here.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use camsim_core::{
    flight_log::{FlightLog, HeightConversion},
    scenario::{AttitudeSource, FlightHeight, FlightSpec, HeightSource, Origin},
};
use camsim_io::flight_log::read_flight_log;
use glam::{DVec3, EulerRot};

fn spec() -> FlightSpec {
    FlightSpec {
        origin: Origin::Geodetic([47.05, 8.31, 480.0]),
        height: FlightHeight::Msl,
        ..FlightSpec::default()
    }
}

fn topic(topic: &str) -> FlightSpec {
    FlightSpec { topic: Some(topic.to_owned()), ..spec() }
}

/// Heights are above the ellipsoid, the attitude is that of the path.
fn glider() -> FlightSpec {
    FlightSpec { height: FlightHeight::Ellipsoid, ..path() }
}

fn path() -> FlightSpec {
    FlightSpec { attitude: AttitudeSource::Track, ..spec() }
}

/// What a log must give.
#[derive(Clone, Copy)]
struct Flight {
    rows: usize,
    /// Seconds from the first row to the last.
    seconds: f64,
    /// First position: north, east, down (m).
    first: [f64; 3],
    /// Velocity from the first row to the last, north, east, down (m/s).
    velocity: [f64; 3],
    /// Largest distance of any row from the straight line between the first and the last, metres.
    off_line_m: f64,
    /// Roll, pitch, yaw of the first row (deg); not compared where the attitude is that of the path.
    angles: Option<[f64; 3]>,
    /// Substrings of all warnings, in order.
    warnings: &'static [&'static str],
    /// Substrings of notes that must be there, beside any others.
    notes: &'static [&'static str],
}

/// The straight flight of `flight_streams.py`. Poses in local axes count from its origin, geodetic ones from 480
/// m, where that begins.
const LOCAL: Flight = Flight {
    rows: 31,
    seconds: 3.0,
    first: [0.0, 0.0, -30.0],
    velocity: [7.5, 13.0, -1.0],
    off_line_m: 0.02,
    angles: Some([5.0, 2.0, 60.0]),
    warnings: &[],
    notes: &[],
};
const GEODETIC: Flight = Flight { first: [0.0; 3], ..LOCAL };

enum Expected {
    Gives(Flight),
    Refused(&'static [&'static str]),
}

use Expected::{Gives, Refused};

fn read(name: &str, spec: &FlightSpec) -> Result<FlightLog, String> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/field-2").join(name);
    read_flight_log(&file, spec, HeightConversion::None).map_err(|error| error.to_string())
}

fn read_text(name: &str, text: &str, spec: &FlightSpec) -> Result<FlightLog, String> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join(name);
    std::fs::write(&file, text).unwrap();
    read_flight_log(&file, spec, HeightConversion::None).map_err(|error| error.to_string())
}

fn check(result: &Result<FlightLog, String>, expected: &Expected) -> Result<(), String> {
    let (log, flight) = match (result, expected) {
        (Err(error), Refused(words)) => {
            return match words.iter().find(|word| !error.contains(*word)) {
                Some(word) => Err(format!("the message lacks `{word}`")),
                None => Ok(()),
            };
        }
        (Ok(_), Refused(_)) => return Err("read, but should be refused".into()),
        (Err(_), Gives(_)) => return Err("refused".into()),
        (Ok(log), Gives(flight)) => (log, flight),
    };
    let near = |what: &str, found: [f64; 3], expected: [f64; 3], tolerance: f64| {
        let off = (DVec3::from_array(found) - DVec3::from_array(expected)).abs().max_element();
        if off <= tolerance { Ok(()) } else { Err(format!("{what} {found:.3?}, not {expected:?}")) }
    };
    let (first, last) = (log.rows.first().unwrap(), log.rows.last().unwrap());
    if log.rows.len() != flight.rows || (log.duration_s() - flight.seconds).abs() > 1e-6 {
        return Err(format!("{} rows, {} s", log.rows.len(), log.duration_s()));
    }
    let velocity = (last.position_ned_m - first.position_ned_m) / log.duration_s().max(1e-9);
    // The autopilots' spheres and scales differ from the ellipsoid by 0.3 %.
    near("first", first.position_ned_m.to_array(), flight.first, 0.06)?;
    near("velocity", velocity.to_array(), flight.velocity, 0.05)?;
    let off_line = log
        .rows
        .iter()
        .map(|row| row.position_ned_m.distance(first.position_ned_m + velocity * (row.t_s - first.t_s)))
        .fold(0.0, f64::max);
    if off_line > flight.off_line_m {
        return Err(format!("a row is {off_line:.3} m off the line"));
    }
    if let Some(angles) = flight.angles {
        let (yaw, pitch, roll) = first.ned_from_body.to_euler(EulerRot::ZYX);
        near("angles", [roll, pitch, yaw].map(f64::to_degrees), angles, 0.02)?;
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

fn check_all(cases: Vec<(String, Result<FlightLog, String>, Expected)>) {
    let faults: Vec<String> = cases
        .into_iter()
        .filter_map(|(name, result, expected)| {
            let fault = check(&result, &expected).err()?;
            Some(format!("{name}: {fault}\n    {}", result.map_or_else(|error| error, |_| String::new())))
        })
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn instances_frames_and_flags_are_read_as_the_files_state_them() {
    let local = FlightSpec { origin: Origin::First, ..spec() };
    let local_topic = |topic: &str| FlightSpec { topic: Some(topic.to_owned()), ..local.clone() };
    let cases = [
        // Cases of reports, with the values of their README.
        (
            "08-bin-primary-core/A2e_drift.bin",
            spec(),
            Gives(Flight {
                rows: 61,
                seconds: 6.0,
                // Core 0 drifts by 12 m before it is left; at the end it would be 48 m off.
                off_line_m: 13.5,
                velocity: [6.114, 13.668, -1.0],
                warnings: &[
                    "the instances 0, 1: the one that the vehicle used is flown (XKF4.PI), 0 until 11.0 s",
                ],
                ..GEODETIC
            }),
        ),
        (
            "10-mcap-odom-ned/M2_ned.mcap",
            local.clone(),
            Gives(Flight {
                rows: 61,
                seconds: 6.0,
                off_line_m: 3.0,
                velocity: [6.114, 13.668, -1.0],
                notes: &["north-east-down and forward-right-down"],
                ..LOCAL
            }),
        ),
        (
            "11-mcap-optical-child/M2d_optical_axes.mcap",
            local.clone(),
            Gives(Flight {
                rows: 61,
                seconds: 6.0,
                off_line_m: 3.0,
                velocity: [6.114, 13.668, -1.0],
                warnings: &["optical frame `camera_color_optical_frame`"],
                ..LOCAL
            }),
        ),
        (
            "12-mcap-tf-parent/M4_tfchain.mcap",
            local_topic("/tf#base_link"),
            Gives(Flight {
                rows: 61,
                seconds: 6.0,
                off_line_m: 3.0,
                velocity: [6.114, 13.668, -1.0],
                notes: &["map -> odom"],
                ..LOCAL
            }),
        ),
        (
            "15-all-times-equal/L11g_gpx_time0.gpx",
            path(),
            Refused(&["all times are equal (61 rows", "no flight"]),
        ),
        (
            "33-tlog/A5b_real.tlog",
            spec(),
            Refused(&["MAVLink telemetry log", "mavlogdump.py --format csv --types"]),
        ),
        (
            "37-kml-multitrack-mode/L09a_multitrack.kml",
            path(),
            Gives(Flight {
                rows: 61,
                seconds: 6.0,
                off_line_m: 3.0,
                velocity: [6.114, 13.668, -1.0],
                angles: None,
                ..GEODETIC
            }),
        ),
        // Frames.
        (
            "streams/pose_local_origin_ned.mcap",
            local.clone(),
            Gives(Flight { warnings: &["its body is read as forward-right-down, because"], ..LOCAL }),
        ),
        (
            "streams/odom_ned_of_flu.mcap",
            local.clone(),
            Gives(Flight { notes: &["north-east-down and forward-left-up"], ..LOCAL }),
        ),
        (
            "streams/odom_of_fcu_frd.mcap",
            local.clone(),
            Gives(Flight { notes: &["east-north-up and forward-right-down"], ..LOCAL }),
        ),
        ("streams/map_nwu.mcap", local.clone(), Gives(Flight { notes: &["north-west-up"], ..LOCAL })),
        ("streams/airsim.mcap", local.clone(), Gives(Flight { notes: &["forward-right-down"], ..LOCAL })),
        (
            "streams/cam0_optical.mcap",
            local.clone(),
            Gives(Flight { warnings: &["optical frame `cam0_optical`"], ..LOCAL }),
        ),
        (
            "streams/pose_in_base_link.mcap",
            local.clone(),
            Gives(Flight { warnings: &["`base_link`, which by its name moves with the vehicle"], ..LOCAL }),
        ),
        ("streams/pose_in_earth.mcap", local.clone(), Refused(&["`earth`", "geocentric", "flight.topic"])),
        (
            "streams/frame_changes.mcap",
            local.clone(),
            Refused(&["several frames", "`map` (16 messages)", "`odom` (15 messages)"]),
        ),
        ("streams/two_children.mcap", local.clone(), Refused(&["/odom#base_link", "/odom#payload"])),
        ("streams/two_children.mcap", local_topic("/odom#base_link"), Gives(LOCAL)),
        (
            "streams/tf_static_parent.mcap",
            local_topic("/tf#base_link"),
            Gives(Flight { notes: &["map -> odom"], ..LOCAL }),
        ),
        ("streams/tf_moving_parent.mcap", local_topic("/tf#base_link"), Gives(LOCAL)),
        ("streams/two_vehicles.mcap", local_topic("/uav1/tf#base_link"), Gives(LOCAL)),
        (
            "streams/imu_mount.mcap",
            glider_with_attitude(),
            Gives(Flight { warnings: &["pose of `imu_link` in `base_link` is not applied"], ..GEODETIC }),
        ),
        (
            "streams/odom_below_map.mcap",
            local_topic("/odom"),
            Gives(Flight { warnings: &["`odom`, whose pose in `map` is not applied"], ..LOCAL }),
        ),
        ("streams/mavros_axes.mcap", local_topic("/odom"), Gives(LOCAL)),
        (
            "streams/fix_imu_ned.mcap",
            glider_with_attitude(),
            Gives(Flight { warnings: &["3 messages of `/fix` have no fix"], ..GEODETIC }),
        ),
        // Cores and receivers of ArduPilot.
        (
            "streams/nkf_old_cores.bin",
            spec(),
            Gives(Flight {
                warnings: &["the one that the vehicle used is flown (NKF4.PI), 0 until 3.5 s"],
                ..GEODETIC
            }),
        ),
        (
            "streams/xkf_no_primary.bin",
            spec(),
            Gives(Flight {
                warnings: &["`XKF1` has the instances 0, 1, and the log does not say"],
                ..GEODETIC
            }),
        ),
        (
            "streams/xkf_no_primary.bin",
            topic("XKF1#1"),
            Gives(Flight { first: [40.0, 0.0, 0.0], ..GEODETIC }),
        ),
        ("streams/xkf_no_primary.bin", topic("XKF1#2"), Refused(&["no instance 2", "0, 1"])),
        ("streams/xkf_core_1.bin", spec(), Gives(Flight { notes: &["(XKF4.PI), 1"], ..GEODETIC })),
        ("streams/ekf_type_2.bin", spec(), Gives(GEODETIC)),
        (
            "streams/gps_used.bin",
            spec(),
            Gives(Flight {
                warnings: &["the one that the vehicle used is flown (GPS.U), 0 until 3.5 s"],
                ..GEODETIC
            }),
        ),
        (
            "streams/gps_no_fix.bin",
            spec(),
            Gives(Flight {
                warnings: &["`GPS` has the instances 0, 1, and the log does not say"],
                ..GEODETIC
            }),
        ),
        (
            "streams/gps2_used.bin",
            spec(),
            Gives(Flight {
                warnings: &["the one that the vehicle used is flown (GPS.U), 0 until 3.5 s"],
                ..GEODETIC
            }),
        ),
        (
            "streams/gps2_used.bin",
            topic("GPS2"),
            Gives(Flight {
                first: [40.0, 0.0, 0.0],
                off_line_m: 41.0,
                velocity: [7.5 - 40.0 / 3.0, 13.0, -1.0],
                warnings: &["the attitude is the same in every row"],
                ..GEODETIC
            }),
        ),
        // Estimators and receivers of PX4.
        (
            "streams/estimators.ulg",
            spec(),
            Gives(Flight {
                warnings: &[
                    "`estimator_local_position` has 2 instances: that of the estimator which flew is taken \
                        (estimator_selector_status), 0 until 3.5 s",
                    "`estimator_attitude` has 2 instances",
                ],
                ..GEODETIC
            }),
        ),
        (
            "streams/estimators.ulg",
            topic("estimator_local_position#1"),
            Gives(Flight {
                first: [40.0, 0.0, 0.0],
                off_line_m: 41.0,
                velocity: [7.5 - 40.0 / 3.0, 13.0, -1.0],
                warnings: &["the attitude is the same in every row"],
                ..GEODETIC
            }),
        ),
        (
            "streams/gps_instances.ulg",
            spec(),
            Gives(Flight {
                rows: 28,
                seconds: 2.7,
                first: [2.25, 3.9, -0.3],
                warnings: &[
                    "`sensor_gps` has no valid position",
                    "`sensor_gps` has the instances 0, 1",
                    "3 of 31 positions of `sensor_gps#1` are marked as invalid or without a 3D fix",
                ],
                ..GEODETIC
            }),
        ),
        (
            "streams/dead_reckoning.ulg",
            spec(),
            Gives(Flight {
                warnings: &["11 of 31 positions of `vehicle_global_position` are dead reckoning"],
                ..GEODETIC
            }),
        ),
        (
            "streams/equal_times.ulg",
            spec(),
            Refused(&["all times of `vehicle_global_position` are equal", "no flight"]),
        ),
    ];
    let results = cases.into_iter().map(|(file, spec, expected)| {
        let name = format!("{file} {}", spec.topic.as_deref().unwrap_or(""));
        (name, read(file, &spec), expected)
    });
    check_all(results.collect());
}

fn glider_with_attitude() -> FlightSpec {
    FlightSpec { height: FlightHeight::Ellipsoid, ..spec() }
}

/// A flight record of 6 s with header records.
fn igc(header: &str) -> String {
    let fixes: String =
        (0..7).map(|s| format!("B10200{s}4703{:03}N00818600EA00480{:05}\n", s * 5, 480 + s)).collect();
    format!("AXXX001\r\nHFDTE040523\n{header}\n{fixes}")
}

#[test]
fn headers_of_flight_records_are_applied_or_named() {
    // 5 thousandths of a minute of latitude are 9.26 m.
    let flight = Flight {
        rows: 7,
        seconds: 6.0,
        first: [0.0; 3],
        velocity: [9.265, 0.0, -1.0],
        off_line_m: 0.5,
        angles: None,
        warnings: &[],
        notes: &[],
    };
    let warned = |warnings| Gives(Flight { warnings, ..flight });
    let pressure = || FlightSpec { height_from: HeightSource::Pressure, ..glider() };
    let cases = [
        ("HFDTM100GPSDATUM:WGS-1984", glider(), Gives(flight)),
        ("HFDTM021GPSDATUM:ED50", glider(), warned(&["line 3: `HFDTM021GPSDATUM:ED50` names another datum"])),
        ("HODTM:NAD27", glider(), warned(&["line 3: `HODTM:NAD27`"])),
        ("HFALGALTGPS:GEO", glider(), warned(&["flight.height = \"msl\""])),
        ("HFALGALTGPS:GEO", path(), Gives(flight)),
        ("HFALGALTGPS:ELL", path(), warned(&["flight.height = \"ellipsoid\""])),
        ("HFALGALTGPS:NKN", path(), warned(&["does not say what satellite heights are above"])),
        ("HFTZNUTCOFFSET:02:00", glider(), Gives(Flight { notes: &["in UTC"], ..flight })),
        ("HFUNTUNITS:FEET", glider(), warned(&["names feet"])),
        (
            "HFALPALTPRESSURE:QNH1021",
            pressure(),
            Gives(Flight {
                velocity: [9.265, 0.0, 0.0],
                warnings: &["standard atmosphere", "`HFALPALTPRESSURE:QNH1021`"],
                ..flight
            }),
        ),
        ("HFDTE991323", glider(), Refused(&["line 3", "`HFDTE991323` is no date"])),
    ];
    let results = cases.into_iter().map(|(header, spec, expected)| {
        (header.to_owned(), read_text("a.igc", &igc(header), &spec), expected)
    });
    check_all(results.collect());
}

#[test]
fn two_dates_of_a_flight_record_are_both_used() {
    // Over midnight, with a new date behind it, and without.
    let fix = |clock: &str, minutes: u32| format!("B{clock}4703{minutes:03}N00818600EA0048000480\n");
    for second in ["HFDTE050523\n", ""] {
        let text = format!(
            "AXXX001\nHFDTE040523\n{}{}{second}{}{}",
            fix("235958", 0),
            fix("235959", 5),
            fix("000000", 10),
            fix("000001", 15)
        );
        let log = read_text("a.igc", &text, &glider()).unwrap();
        assert_eq!(log.rows.len(), 4);
        assert!((log.duration_s() - 3.0).abs() < 1e-9, "{}", log.duration_s());
        // 2023-05-04T23:59:58Z.
        assert_eq!(log.epoch_ns, 1_683_244_798_000_000_000);
    }
}

/// A GPX file of seven points 1 s apart; `{fix}` of the first three, and what stands before the track.
fn gpx(head: &str, fixes: [&str; 3], height: &dyn Fn(usize) -> String) -> String {
    let points: String = (0..7)
        .map(|s| {
            let fix = fixes.get(s).map_or("<fix>3d</fix>".to_owned(), |fix| format!("<fix>{fix}</fix>"));
            format!(
                "<trkpt lat=\"{:.7}\" lon=\"8.31\">{}<time>2023-05-04T10:20:0{s}Z</time>{fix}</trkpt>\n",
                47.05 + s as f64 * 1e-4,
                height(s)
            )
        })
        .collect();
    format!("<?xml version=\"1.0\"?>\n<gpx version=\"1.1\">{head}<trk><trkseg>{points}</trkseg></trk></gpx>")
}

#[test]
fn fixes_units_and_prose_of_gpx_are_used_or_named() {
    let metres = |s: usize| format!("<ele>{}</ele>", 480 + s);
    let feet = |s: usize| format!("<ele unit=\"ft\">{}</ele>", (480 + s) as f64 / 0.3048);
    let all = Flight {
        rows: 7,
        seconds: 6.0,
        first: [0.0; 3],
        // A degree of latitude is 111 176 m at 47 degrees.
        velocity: [11.118, 0.0, -1.0],
        off_line_m: 0.02,
        angles: None,
        warnings: &[],
        notes: &[],
    };
    let late = |warnings| Flight { rows: 4, seconds: 3.0, first: [33.354, 0.0, -3.0], warnings, ..all };
    let warned = |warnings| Gives(Flight { warnings, ..all });
    let three = ["3d"; 3];
    let cases = [
        ("plain", gpx("", three, &metres), Gives(all)),
        ("none", gpx("", ["none"; 3], &metres), Gives(late(&["3 of 7 track points have no 3D fix"]))),
        ("2d", gpx("", ["2d", "none", "2D"], &metres), Gives(late(&["3 of 7 track points have no 3D fix"]))),
        ("feet", gpx("", three, &feet), Gives(all)),
        (
            "unit",
            gpx("", three, &|s| format!("<ele unit=\"chains\">{s}</ele>")),
            Refused(&["`chains`", "line 2"]),
        ),
        (
            "ellipsoid",
            gpx("<metadata><desc>heights above the ellipsoid</desc></metadata>", three, &metres),
            warned(&["flight.height = \"ellipsoid\""]),
        ),
        ("attribute", gpx("<trk datum=\"NAD 27\"/>", three, &metres), warned(&["names the datum NAD27"])),
        ("no datum", gpx("<trk><name>TASK 42</name></trk>", three, &metres), Gives(all)),
        (
            "datum",
            gpx("<metadata><desc>Datum: ED 50</desc></metadata>", three, &metres),
            warned(&["line 2: `Datum: ED 50` names the datum ED50"]),
        ),
        (
            "comment",
            gpx("<!-- elevations in feet -->", three, &metres),
            warned(&["line 2: `elevations in feet` names heights in feet"]),
        ),
        ("gcj", gpx("<trk><desc>GCJ-02</desc></trk>", three, &metres), warned(&["GCJ02"])),
        ("wgs", gpx("<metadata><desc>WGS84, 30 ft flags</desc></metadata>", three, &metres), Gives(all)),
    ];
    let results = cases
        .into_iter()
        .map(|(name, text, expected)| (name.to_owned(), read_text("a.gpx", &text, &path()), expected));
    check_all(results.collect());
}

#[test]
fn altitude_modes_of_kml_are_those_around_the_track() {
    let track = |mode: &str| {
        let times: String = (0..4).map(|s| format!("<when>2023-05-04T10:20:0{s}Z</when>")).collect();
        let positions: String = (0..4)
            .map(|s| format!("<gx:coord>8.31 {:.7} {}</gx:coord>", 47.05 + f64::from(s) * 1e-4, 480 + s))
            .collect();
        format!("<gx:Track>{mode}{times}{positions}</gx:Track>")
    };
    let kml = |body: &str| {
        format!(
            "<?xml version=\"1.0\"?>\n<kml xmlns=\"http://www.opengis.net/kml/2.2\" \
                xmlns:gx=\"http://www.google.com/kml/ext/2.2\"><Document><Placemark>{body}</Placemark></Document></kml>"
        )
    };
    let flight = Flight {
        rows: 4,
        seconds: 3.0,
        first: [0.0; 3],
        velocity: [11.118, 0.0, -1.0],
        off_line_m: 0.02,
        angles: None,
        warnings: &[],
        notes: &[],
    };
    let absolute = "<altitudeMode>absolute</altitudeMode>";
    let model = "<Model><altitudeMode>relativeToGround</altitudeMode></Model>";
    let cases = [
        ("own", kml(&track(absolute)), Gives(flight)),
        ("gx", kml(&track("<gx:altitudeMode>absolute</gx:altitudeMode>")), Gives(flight)),
        ("around", kml(&format!("<gx:MultiTrack>{absolute}{}</gx:MultiTrack>", track(""))), Gives(flight)),
        ("placemark", kml(&format!("{absolute}{}", track(""))), Gives(flight)),
        ("behind", kml(&format!("<MultiGeometry>{}{absolute}</MultiGeometry>", track(""))), Gives(flight)),
        (
            "own before that around",
            kml(&format!(
                "<gx:MultiTrack>{absolute}{}</gx:MultiTrack>",
                track("<altitudeMode>relativeToGround</altitudeMode>")
            )),
            Refused(&["line 2", "relativeToGround", "above ground"]),
        ),
        // The mode of the model that stands for the vehicle is another one.
        ("model", kml(&track(&format!("{absolute}{model}"))), Gives(flight)),
        ("model before", kml(&track(&format!("{model}{absolute}"))), Gives(flight)),
        (
            "none",
            kml(&track("")),
            Refused(&["there is no altitudeMode", "<altitudeMode>absolute</altitudeMode>"]),
        ),
        (
            "sea floor",
            kml(&track("<gx:altitudeMode>clampToSeaFloor</gx:altitudeMode>")),
            Refused(&["clampToSeaFloor"]),
        ),
        (
            "offset",
            kml(&format!("<gx:altitudeOffset>25</gx:altitudeOffset>{}", track(absolute))),
            Gives(Flight { warnings: &["gx:altitudeOffset 25 is not applied"], ..flight }),
        ),
        (
            "datum",
            kml(&format!("<description>positions on Tokyo datum</description>{}", track(absolute))),
            Gives(Flight { warnings: &["names the datum TOKYODATUM"], ..flight }),
        ),
    ];
    let results = cases
        .into_iter()
        .map(|(name, text, expected)| (name.to_owned(), read_text("a.kml", &text, &path()), expected));
    check_all(results.collect());
}

#[test]
fn a_span_of_time_begins_a_placemark() {
    let marks: String = (0..3)
        .map(|s| {
            format!(
                "<Placemark><TimeSpan><begin>2023-05-04T10:20:0{s}Z</begin><end>2023-05-04T10:20:0{}Z</end></TimeSpan>\
                    <Point><altitudeMode>absolute</altitudeMode><coordinates>8.31,{:.7},480</coordinates></Point></Placemark>",
                s + 1,
                47.05 + f64::from(s) * 1e-4
            )
        })
        .collect();
    let log = read_text("a.kml", &format!("<kml><Document>{marks}</Document></kml>"), &path()).unwrap();
    assert_eq!(log.rows.len(), 3);
    assert!((log.duration_s() - 2.0).abs() < 1e-9);
}

#[test]
fn all_equal_times_are_refused_and_one_position_is_not() {
    let point = |lat: f64| {
        format!("<trkpt lat=\"{lat}\" lon=\"8.31\"><ele>480</ele><time>2023-05-04T10:20:00Z</time></trkpt>")
    };
    let text = |points: String| format!("<gpx><trk><trkseg>{points}</trkseg></trk></gpx>");
    let moving = text(point(47.05) + &point(47.06));
    assert!(
        read_text("a.gpx", &moving, &path())
            .is_err_and(|error| error.contains("all times are equal (2 rows"))
    );
    let still = text(point(47.05) + &point(47.05));
    assert_eq!(read_text("a.gpx", &still, &path()).unwrap().rows.len(), 1);
    // Two rows of one time among others are averaged, but the distance is named.
    let some = "t_s,lat_deg,lon_deg,alt_m\n5,47.05,8.31,480\n5,47.06,8.31,480\n6,47.07,8.31,480\n7,47.07,8.31,480\n\
        8,47.07,8.31,480\n";
    let report = read_text("a.csv", some, &path()).unwrap().report;
    assert!(report.to_string().contains("averaged rows are up to 1111.8 m apart"), "{report}");
    // The same of a table.
    let table = "t_s,lat_deg,lon_deg,alt_m\n5,47.05,8.31,480\n5,47.06,8.31,480\n5,47.07,8.31,480\n";
    assert!(read_text("a.csv", table, &path()).is_err_and(|error| error.contains("all times are equal")));
}

#[test]
fn datum_of_the_reported_flight_record_is_named() {
    let log = read("04-igc-datum/IG1_datum.igc", &glider()).unwrap();
    let warnings: Vec<&str> =
        log.notes.iter().filter(|note| note.is_warning).map(|note| note.text.as_str()).collect();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].contains("line 3: `HFDTM021GPSDATUM:ED50`"), "{warnings:?}");
}
