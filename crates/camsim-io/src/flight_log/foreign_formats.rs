//! File formats that are not read as a flight log, with the tool that converts each.

/// A file format that is refused.
pub(super) struct ForeignFormat {
    /// Name with its article, as error messages print it.
    pub(super) name: &'static str,
    /// File signatures: the first bytes, any of them.
    signatures: &'static [&'static [u8]],
    /// How to convert it.
    pub(super) advice: &'static str,
}

/// Formats recognised by their signature. docs/inputs/LOGS.md lists them.
pub(super) static FOREIGN_FORMATS: &[ForeignFormat] = &[
    ForeignFormat {
        name: "an ArduPilot log as text",
        signatures: &[b"FMT,", b"FMT ,"],
        advice: "give the binary log (.bin), or export a table of POS and ATT",
    },
    ForeignFormat {
        name: "a MAVLink telemetry log",
        signatures: &[b"\xfe\x09", b"\xfd\x09"],
        advice: "convert it with mavlogdump.py --format csv",
    },
    ForeignFormat {
        name: "a ROS 1 bag",
        signatures: &[b"#ROSBAG"],
        advice: "convert it to MCAP (mcap convert FILE.bag flight.mcap)",
    },
    ForeignFormat {
        name: "a database (SQLite), as ROS 2 bags of the kind .db3 are",
        signatures: &[b"SQLite format 3"],
        advice: "convert it to MCAP (ros2 bag convert, with `storage_id: mcap` in its output options, or mcap \
            convert FILE.db3 flight.mcap)",
    },
    ForeignFormat {
        name: "compressed",
        signatures: &[b"\x1f\x8b", b"BZh", b"\xfd7zXZ", b"\x28\xb5\x2f\xfd", b"7z\xbc\xaf"],
        advice: "unpack it first",
    },
    ForeignFormat {
        name: "a spreadsheet or an archive",
        signatures: &[b"PK\x03\x04", b"\xd0\xcf\x11\xe0"],
        advice: "unpack it, or save the sheet as CSV in UTF-8",
    },
    ForeignFormat {
        name: "text in UTF-16",
        signatures: &[b"\xff\xfe", b"\xfe\xff"],
        advice: "save it as UTF-8",
    },
    ForeignFormat {
        name: "NMEA sentences",
        signatures: &[b"$GP", b"$GN", b"$GL", b"!AIV"],
        advice: "convert it to GPX (gpsbabel -i nmea -f FILE -o gpx -F flight.gpx)",
    },
    ForeignFormat {
        name: "JSON",
        signatures: &[b"{", b"[{", b"[\n"],
        advice: "write its rows as CSV with a header line",
    },
];

/// Subtitles, recognised by their second line: name and advice. docs/inputs/LOGS.md lists them.
pub(super) const SUBTITLES: (&str, &str) = (
    "subtitles of a video (DJI's .SRT)",
    "write a CSV with a header `t_s,lat_deg,lon_deg,alt_msl_m` (exiftool -ee -csv of the video, or its \
        flight record), and set flight.attitude = \"track\"",
);
/// Name and advice of XML files with any other root element.
pub(super) const OTHER_XML: (&str, &str) =
    ("XML other than GPX and KML", "write a CSV with a header line, or GPX");

/// Name and advice of the format of a file that cannot be a flight log; `None` if it may be one.
pub(super) fn detect(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let has_signature =
        |format: &&ForeignFormat| format.signatures.iter().any(|bytes| text.starts_with(bytes));
    if let Some(format) = FOREIGN_FORMATS.iter().find(has_signature) {
        return Some((format.name, format.advice));
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
    None
}
