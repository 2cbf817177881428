//! File formats that are not read as a flight log, with the tool that converts each.

use super::receiver_logs;

/// Formats recognised by their signatures: name with its article, as messages print it; first bytes, any of
/// them; and how to convert it. docs/reference/inputs/LOGS.md lists them.
pub(super) static FOREIGN_FORMATS: &[(&str, &[&[u8]], &str)] = &[
    (
        "an ArduPilot log as text",
        &[b"FMT,", b"FMT ,"],
        "give the binary log (.bin), or export a table of POS and ATT",
    ),
    ("a ROS 1 bag", &[b"#ROSBAG"], "convert it to MCAP (mcap convert FILE.bag flight.mcap)"),
    (
        "a database (SQLite), as ROS 2 bags of the kind .db3 are",
        &[b"SQLite format 3"],
        "convert it to MCAP (ros2 bag convert, with `storage_id: mcap` in its output options, or mcap \
            convert FILE.db3 flight.mcap)",
    ),
    (
        "compressed",
        &[b"\x1f\x8b", b"BZh", b"\xfd7zXZ", b"\x28\xb5\x2f\xfd", b"7z\xbc\xaf"],
        "unpack it first",
    ),
    (
        "a spreadsheet or an archive",
        &[b"PK\x03\x04", b"\xd0\xcf\x11\xe0"],
        "unpack it, or save the sheet as CSV in UTF-8",
    ),
    ("text in UTF-16", &[b"\xff\xfe", b"\xfe\xff"], "save it as UTF-8"),
    (
        "NMEA sentences",
        &[b"$GP", b"$GN", b"$GL", b"!AIV"],
        "convert it to GPX (gpsbabel -i nmea -f FILE -o gpx -F flight.gpx)",
    ),
    (
        "a picture",
        &[b"II*\0", b"II+\0", b"MM\0*", b"MM\0+", b"\x89PNG", b"\xff\xd8\xff", b"RIFF"],
        "flight.log is the file of times and positions; terrain and pictures of the ground go to [scene]",
    ),
    (
        "a Betaflight or INAV blackbox log",
        &[b"H Product:Blackbox"],
        "convert it with blackbox_decode --merge-gps, and name the units in its header line",
    ),
    (
        "messages of a u-blox receiver",
        &[b"\xb5\x62"],
        "convert it to GPX or CSV with the receiver's program, or to .pos with RTKLIB",
    ),
    (
        "a table for a program (HDF5, NumPy, Parquet, MATLAB)",
        &[b"\x89HDF", b"\x93NUMPY", b"PAR1", b"MATLAB 5.0"],
        "write its rows as CSV with a header line",
    ),
    (
        "a document (PDF, PostScript, RTF)",
        &[b"%PDF", b"%!PS", b"{\\rtf"],
        "flight.log is the file of times and positions",
    ),
    ("a model (glTF)", &[b"glTF"], "flight.log is the file of times and positions; models go to scene.gltf"),
    ("a point cloud (LAS)", &[b"LASF"], "flight.log is the file of times and positions of the aircraft"),
    (
        "a binary log of a NovAtel or Septentrio receiver",
        &[b"\xaa\x44\x12", b"\xaa\x44\x13", b"$@"],
        "convert it to a table with NovAtel Convert or RxTools (time, latitude, longitude, height, roll, \
            pitch, azimuth)",
    ),
    ("JSON", &[b"{", b"[{", b"[\n"], "write its rows as CSV with a header line"),
];

/// Subtitles, recognised by their second line: name and advice. docs/reference/inputs/LOGS.md lists them.
pub(super) const SUBTITLES: (&str, &str) = (
    "subtitles of a video (DJI's .SRT)",
    "write a CSV with a header `t_s,lat_deg,lon_deg,alt_msl_m` (exiftool -ee -csv of the video, or its \
        flight record), and set flight.attitude = \"track\"",
);
/// Name and advice of MAVLink packets, each behind its time in a `.tlog`, or alone.
pub(super) const MAVLINK: (&str, &str) = (
    "a MAVLink telemetry log",
    "convert it with mavlogdump.py --format csv --types GLOBAL_POSITION_INT,ATTITUDE FILE > flight.csv \
        (pip install pymavlink)",
);
/// Name and advice of videos.
pub(super) const VIDEO: (&str, &str) = (
    "a video",
    "extract its telemetry as a table: exiftool -ee -csv for most cameras and drones, gpmf for GoPro, or an \
        .SRT beside it",
);
/// Name and advice of records of sports watches.
pub(super) const FIT: (&str, &str) = (
    "a FIT file of a sports watch",
    "convert it to GPX (gpsbabel -i garmin_fit -f FILE -o gpx -F flight.gpx)",
);
/// Name and advice of other files that are no text.
pub(super) const BINARY: (&str, &str) = (
    "binary, of no known kind",
    "give the log as text (CSV with a header line, TUM, EuRoC), GPX, KML, IGC, ULog, ArduPilot's .bin or MCAP",
);
/// Formats that no signature at the first byte tells. docs/reference/inputs/LOGS.md lists them.
pub(super) static OTHER_BINARY: [(&str, &str); 4] = [MAVLINK, VIDEO, FIT, BINARY];

/// Name and advice of XML files with any other root element.
pub(super) const OTHER_XML: (&str, &str) =
    ("XML other than GPX and KML", "write a CSV with a header line, or GPX");

/// Message for such a file.
pub(super) fn refusal((name, advice): (&str, &str)) -> String {
    format!("the file is {name}, no flight log that can be read: {advice}")
}

/// Name and advice of the format of a file that cannot be a flight log; `None` if it may be one.
pub(super) fn detect(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    // A telemetry log may begin with any byte, so that of its packets counts first.
    if is_mavlink(bytes) {
        return Some(MAVLINK);
    }
    let by_signature = FOREIGN_FORMATS
        .iter()
        .find(|(_, signatures, _)| signatures.iter().any(|bytes| text.starts_with(bytes)));
    if let Some(&(name, _, advice)) = by_signature {
        return Some((name, advice));
    }
    let second_line = text.split(|&byte| byte == b'\n').nth(1).unwrap_or(b"");
    let first_has_digits_only = text
        .split(|&byte| byte == b'\n')
        .next()
        .is_some_and(|line| line.trim_ascii().iter().all(u8::is_ascii_digit));
    let has_arrow = second_line.windows(3).any(|window| window == b"-->");
    if first_has_digits_only && has_arrow {
        return Some(SUBTITLES);
    }
    if let Some(receiver_log) = receiver_logs::detect(text) {
        return Some(receiver_log);
    }
    match bytes.get(4..12) {
        Some([b'f', b't', b'y', b'p', ..] | [b'm', b'o', b'o', b'v', ..]) => return Some(VIDEO),
        Some([_, _, _, _, b'.', b'F', b'I', b'T']) => return Some(FIT),
        _ => {}
    }
    let is_text = std::str::from_utf8(bytes).is_ok();
    let head = bytes.get(..4096).unwrap_or(bytes);
    (!is_text && head.contains(&0)).then_some(BINARY)
}

/// Whether packets of MAVLink follow each other from the beginning, or behind 8 bytes of time each.
fn is_mavlink(bytes: &[u8]) -> bool {
    // The second packet, too, begins where the length of the first one says; or the file ends there.
    [8, 0].into_iter().any(|time_bytes| {
        let first = packet_length(bytes, time_bytes).map(|length| time_bytes + length);
        first.is_some_and(|end| {
            let is_end = end == bytes.len() && end > 0;
            is_end || packet_length(bytes, end + time_bytes).is_some()
        })
    })
}

/// Length of a whole packet of MAVLink 1 or 2 at a byte, by its head.
fn packet_length(bytes: &[u8], at: usize) -> Option<usize> {
    let payload = usize::from(*bytes.get(at + 1)?);
    match *bytes.get(at)? {
        0xfe => Some(payload + 8),
        0xfd => {
            let flags = *bytes.get(at + 2)?;
            // The only flag that is known adds a signature of 13 bytes.
            (flags & !1 == 0).then_some(payload + 12 + usize::from(flags) * 13)
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A packet of MAVLink 1 or 2 with a payload of zeros.
    fn packet(version: u8, payload: u8, is_signed: bool) -> Vec<u8> {
        let (head, rest) = if version == 1 { (6, 2) } else { (10, 2 + if is_signed { 13 } else { 0 }) };
        let mut bytes = vec![0; head + usize::from(payload) + rest];
        bytes[0] = if version == 1 { 0xfe } else { 0xfd };
        bytes[1] = payload;
        if is_signed {
            bytes[2] = 1;
        }
        bytes
    }

    #[test]
    fn packets_of_mavlink_are_found_with_and_without_times() {
        let time = 1_683_195_600_000_000_u64.to_be_bytes();
        for (version, payload, is_signed) in [(1, 9, false), (1, 28, false), (2, 28, false), (2, 3, true)] {
            let one = packet(version, payload, is_signed);
            let timed = [&time[..], &one, &time, &one, b"\0\x05"].concat();
            let plain = [&one[..], &one].concat();
            for bytes in [&timed, &plain, &[&time[..], &one].concat()] {
                assert_eq!(detect(bytes), Some(MAVLINK), "version {version}, {payload} bytes");
            }
        }
        // An archive that begins as a packet of MAVLink 2, and text in UTF-16.
        let archive = [&b"\xfd7zXZ\0"[..], &[0; 100]].concat();
        assert_eq!(detect(&archive).map(|(name, _)| name), Some("compressed"));
        assert_eq!(detect(b"\xfe\xff\0t\0,").map(|(name, _)| name), Some("text in UTF-16"));
    }

    #[test]
    fn binary_files_are_not_called_text() {
        assert_eq!(detect(b"\0\0\0\x18ftypmp42\0\0"), Some(VIDEO));
        assert_eq!(detect(b"\x0e\x10\x43\x08\0\0\0\0.FIT\0"), Some(FIT));
        assert_eq!(detect(b"\x01\x02\0\xff\xff\xc3"), Some(BINARY));
        assert_eq!(detect(b"II*\0\x08\0").map(|(name, _)| name), Some("a picture"));
        // Another encoding of text remains a matter of the reader.
        assert_eq!(detect(b"t,lat,lon,alt,h\xf6he\n"), None);
    }
}
