//! Damaged and unusual files of the formats of other programs.

use super::*;

/// Reads bytes as a file of this name.
pub(super) fn read_named(name: &str, content: &[u8], spec: &FlightSpec) -> Result<FlightLog, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    read_flight_log(&path, spec, HeightConversion::None).map_err(|error| error.to_string())
}

pub(super) fn refused(name: &str, content: &[u8], spec: &FlightSpec, words: &[&str]) {
    match read_named(name, content, spec) {
        Ok(log) => fault(format!("{name}: read, {} rows, {:?}", log.rows.len(), log.notes)),
        Err(error) => {
            for word in words.iter().chain([&name]).filter(|word| !error.contains(**word)) {
                fault(format!("{name}: `{error}` lacks `{word}`"));
            }
        }
    }
}

pub(super) fn warnings(log: &FlightLog) -> String {
    let told: Vec<&str> = log.notes.iter().filter(|n| n.is_warning).map(|n| n.text.as_str()).collect();
    told.join("; ")
}

pub(super) fn golden(name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/flights");
    std::fs::read(folder.join(name)).unwrap()
}

fn msl() -> FlightSpec {
    FlightSpec { height: FlightHeight::Msl, ..auto() }
}

pub(super) fn topic(name: &str) -> FlightSpec {
    FlightSpec { topic: Some(name.to_owned()), ..msl() }
}

/// Files written by other programs, with a key that they need.
fn goldens() -> Vec<(&'static str, FlightSpec)> {
    let track = FlightSpec { attitude: AttitudeSource::Track, ..auto() };
    vec![
        ("px4_local.ulg", msl()),
        ("px4_global.ulg", msl()),
        ("ardupilot.bin", msl()),
        ("glider.igc", track),
        ("track.kml", msl()),
        ("pose_zstd.mcap", msl()),
        ("pose_lz4.mcap", msl()),
        ("pose_plain.mcap", msl()),
        ("odometry.mcap", topic("/odom")),
        ("fix_imu.mcap", auto()),
    ]
}

#[test]
fn empty_cut_and_foreign_files_are_refused_by_their_ending() {
    let _report = FaultReport;
    for (name, what) in [("a.ulg", "PX4"), ("a.mcap", "MCAP"), ("a.igc", "IGC"), ("a.bin", "ArduPilot")] {
        refused(name, b"", &track(), &["no data rows"]);
        if name != "a.bin" {
            refused(name, b"hello, this is text\n", &track(), &[what]);
        }
        refused(name, b"\x00\xff\x13\x37 no magic", &track(), &[what]);
    }
    for (name, key) in [
        ("ulog", LogFormat::Ulog),
        ("dataflash", LogFormat::Dataflash),
        ("mcap", LogFormat::Mcap),
        ("igc", LogFormat::Igc),
    ] {
        let spec = FlightSpec { format: key, ..track() };
        refused("log.csv", log("t,lat,lon,alt", "T,LAT,LON,H").as_bytes(), &spec, &["no"]);
        let other = if key == LogFormat::Ulog { "ardupilot.bin" } else { "px4_local.ulg" };
        refused(other, &golden(other), &spec, &[&format!("flight.format is \"{name}\" but the file is")]);
    }
    refused("a.ulg", b"ULog\x01\x12\x35\x01\0\0\0\0\0\0\0\0", &msl(), &["no data messages"]);
    refused("a.bin", b"\xa3\x95\x80\x80", &msl(), &["FMT"]);
    refused("path.kml", &golden("path.kml"), &track(), &["LineString", "without times", "gx:Track"]);
}

/// Every cut and every flipped byte gives an error, or a flight that is finite; cuts are told.
#[test]
fn damaged_files_give_no_panic_and_no_silent_loss() {
    let _report = FaultReport;
    let mut state = 1_u64;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize
    };
    for (name, spec) in goldens() {
        let whole = golden(name);
        let rows = match read_named(name, &whole, &spec) {
            Ok(log) => log.rows.len(),
            Err(error) => {
                fault(error);
                continue;
            }
        };
        let is_silent = |length: usize| {
            let log = read_named(name, &whole[..length], &spec);
            log.is_ok_and(|log| log.rows.len() < rows && warnings(&log).is_empty())
        };
        // A cut between two messages leaves a whole file, and a record of lines has no end mark.
        for length in (1..12).map(|part| whole.len() * part / 12) {
            if is_silent(length) && is_silent(length + 1) && name != "glider.igc" {
                fault(format!("{name}: cut at {length} without a word"));
            }
        }
        for _ in 0..60 {
            let mut damaged = whole.clone();
            for _ in 0..=random() % 8 {
                let at = random() % damaged.len();
                damaged[at] ^= 1 << (random() % 8);
            }
            if let Ok(log) = read_named(name, &damaged, &spec)
                && !log.rows.iter().all(|row| row.position_ned_m.is_finite() && row.t_s.is_finite())
            {
                fault(format!("{name}: a row is not finite"));
            }
        }
    }
}

/// Time (us), x, y, z, whether it is valid, and the counter of resets.
type LocalPosition = (u64, [f32; 3], u8, u8);

/// A ULog file with `vehicle_local_position` and `vehicle_attitude`, each row
/// with a level attitude.
fn ulog(rows: &[LocalPosition]) -> Vec<u8> {
    let mut bytes = b"ULog\x01\x12\x35\x01\0\0\0\0\0\0\0\0".to_vec();
    let mut message = |kind: u8, body: &[u8]| {
        bytes.extend(u16::try_from(body.len()).unwrap().to_le_bytes());
        bytes.push(kind);
        bytes.extend(body);
    };
    message(b'F', b"vehicle_attitude:uint64_t timestamp;float[4] q;");
    message(b'F', b"inner:float x;");
    message(
        b'F',
        b"vehicle_local_position:uint64_t timestamp;inner unused;float x;float y;float z;bool xy_valid;\
            uint8_t xy_reset_counter;",
    );
    message(b'A', b"\0\0\0vehicle_attitude");
    message(b'A', b"\0\x01\0vehicle_local_position");
    for (time, ned, valid, resets) in rows {
        let mut attitude = vec![0, 0];
        attitude.extend(time.to_le_bytes());
        [1.0_f32, 0.0, 0.0, 0.0].iter().for_each(|q| attitude.extend(q.to_le_bytes()));
        message(b'D', &attitude);
        let mut position = vec![1, 0];
        position.extend(time.to_le_bytes());
        [9.0_f32].iter().chain(ned).for_each(|x| position.extend(x.to_le_bytes()));
        position.extend([*valid, *resets]);
        message(b'D', &position);
    }
    bytes
}

fn straight(count: u64) -> Vec<LocalPosition> {
    (0..count).map(|i| (1_000_000 + i * 100_000, [i as f32, 0.0, -50.0], 1, 0)).collect()
}

#[test]
fn px4_logs_tell_gaps_resets_and_disorder() {
    let _report = FaultReport;
    let clean = read_named("a.ulg", &ulog(&straight(100)), &auto()).unwrap();
    assert_eq!((clean.rows.len(), warnings(&clean).as_str(), clean.report.is_clean()), (100, "", true));
    assert!((clean.rows[99].position_ned_m - DVec3::new(99.0, 0.0, -50.0)).length() < 1e-6);
    let told = |what: &str, change: &dyn Fn(&mut Vec<LocalPosition>), word: &str| {
        let mut rows = straight(100);
        change(&mut rows);
        match read_named("a.ulg", &ulog(&rows), &auto()) {
            Ok(log) => {
                let text = format!("{}; {}", warnings(&log), log.report);
                if !text.contains(word) || !log.rows.iter().all(|row| row.position_ned_m.is_finite()) {
                    fault(format!("{what}: {text}"));
                }
            }
            Err(error) => fault(format!("{what}: {error}")),
        }
    };
    told("not valid", &|rows| rows[0].2 = 0, "1 of 100 positions of `vehicle_local_position` are marked");
    told("NaN", &|rows| rows[50].1[0] = f32::NAN, "");
    told("back", &|rows| rows.swap(50, 51), "the times of `vehicle_local_position` go back 1 times");
    told("twice", &|rows| rows[50].0 = rows[49].0, "of equal time");
    told("reset", &|rows| rows[50..].iter_mut().for_each(|row| row.3 = 1), "moved the positions");
    told(
        "gap",
        &|rows| rows[50..].iter_mut().for_each(|row| row.0 += 9_000_000),
        "1 gaps of more than 1.0 s",
    );
    refused(
        "a.ulg",
        &ulog(&[(1, [0.0; 3], 0, 0)]),
        &auto(),
        &["no position is valid", "vehicle_local_position"],
    );
    let words = ["`vehicle_gps_position` is no topic with positions; there are: vehicle_local_position"];
    refused("a.ulg", &ulog(&straight(9)), &topic("vehicle_gps_position"), &words);
    let words = ["`nothing` is no topic with attitudes; there are: vehicle_attitude"];
    refused("a.ulg", &ulog(&straight(9)), &topic("vehicle_local_position, nothing"), &words);
    // A flight that begins again within the file.
    let mut twice = straight(50);
    twice.extend(straight(50));
    refused("a.ulg", &ulog(&twice), &auto(), &["the times begin again"]);
    // A newer kind of file.
    let mut newer = ulog(&straight(9));
    let mut flags = vec![40, 0, b'B'];
    flags.extend([0; 8]);
    flags.extend([2, 0, 0, 0, 0, 0, 0, 0]);
    flags.extend([0; 24]);
    newer.splice(16..16, flags);
    refused("a.ulg", &newer, &auto(), &["newer than this reader"]);
    // Damage in the middle, without and with a mark to go on from.
    let mut damaged = ulog(&straight(100));
    let middle = damaged.len() / 2;
    damaged[middle..middle + 200].fill(0);
    let log = read_named("a.ulg", &damaged, &auto()).unwrap();
    assert!(warnings(&log).contains("are not read"), "{}", warnings(&log));
    damaged.splice(middle + 200..middle + 200, *b"\x08\x00\x53\x2f\x73\x13\x20\x25\x0c\xbb\x12");
    let log = read_named("a.ulg", &damaged, &auto()).unwrap();
    assert!(warnings(&log).contains("are passed over"), "{}", warnings(&log));
}

#[test]
fn ardupilot_logs_name_the_messages_that_there_are() {
    let _report = FaultReport;
    let file = golden("ardupilot.bin");
    let list = "there are: AHR2, GPS, POS, XKF1";
    refused("a.bin", &file, &topic("XKF4"), &["`XKF4` is no message with positions", list]);
    refused("a.bin", &file, &topic("POS, NONE"), &["`NONE` is no message with attitudes", "AHR2, ATT, XKF1"]);
    refused("a.bin", &file, &topic("XKF1#7"), &["no instance 7"]);
    let first = read_named("a.bin", &file, &topic("XKF1#0")).unwrap();
    let second = read_named("a.bin", &file, &topic("XKF1#1")).unwrap();
    let apart = |row: usize| second.rows[row].position_ned_m - first.rows[row].position_ned_m;
    assert!(apart(5).length() < 1e-3, "each log has its own origin: {:?}", apart(5));
    let lat = |log: &FlightLog| log.frame.unwrap().origin().lat_deg();
    assert!(((lat(&second) - lat(&first)) * 111_319.5 - 1.0).abs() < 2e-3);
    let mut noise = file.clone();
    noise.splice(3000..3000, *b"garbage");
    let log = read_named("a.bin", &noise, &msl()).unwrap();
    assert!(warnings(&log).contains("bytes are no messages"), "{}", warnings(&log));
}
