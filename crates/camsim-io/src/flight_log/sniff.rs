//! Files that are no table: what they are, and how to make one of them.

/// A kind of file that is refused.
pub(super) struct Other {
    pub(super) what: &'static str,
    begins: &'static [&'static [u8]],
    pub(super) advice: &'static str,
}

/// Every kind known by its first bytes. Also in the documentation.
pub(super) static OTHERS: &[Other] = &[
    Other {
        what: "a PX4 log (ULog)",
        begins: &[b"ULog\x01\x12\x35"],
        advice: "convert it (pip install pyulog; ulog2csv FILE.ulg) and give vehicle_global_position's table, with lat, lon and alt",
    },
    Other {
        what: "an ArduPilot log (DataFlash)",
        begins: &[b"\xa3\x95", b"FMT,", b"FMT ,"],
        advice: "convert it (pip install pymavlink; mavlogdump.py --types GPS --format csv FILE) or export a table of POS and ATT",
    },
    Other {
        what: "a MAVLink telemetry log",
        begins: &[b"\xfe\x09", b"\xfd\x09"],
        advice: "convert it with mavlogdump.py --format csv",
    },
    Other {
        what: "a ROS bag",
        begins: &[b"#ROSBAG"],
        advice: "export the poses (evo_traj bag FILE TOPIC --save_as_tum)",
    },
    Other {
        what: "a ROS 2 bag",
        begins: &[b"SQLite format 3", b"\x89MCAP"],
        advice: "export the poses (evo_traj bag2 FOLDER TOPIC --save_as_tum)",
    },
    Other {
        what: "compressed",
        begins: &[b"\x1f\x8b", b"BZh", b"\xfd7zXZ", b"\x28\xb5\x2f\xfd", b"7z\xbc\xaf"],
        advice: "unpack it first",
    },
    Other {
        what: "a spreadsheet or an archive",
        begins: &[b"PK\x03\x04", b"\xd0\xcf\x11\xe0"],
        advice: "unpack it, or save the sheet as CSV in UTF-8",
    },
    Other { what: "text in UTF-16", begins: &[b"\xff\xfe", b"\xfe\xff"], advice: "save it as UTF-8" },
    Other {
        what: "NMEA sentences",
        begins: &[b"$GP", b"$GN", b"$GL", b"!AIV"],
        advice: "convert it to GPX (gpsbabel -i nmea -f FILE -o gpx -F flight.gpx)",
    },
    Other {
        what: "an IGC flight record",
        begins: &[b"AXXX", b"AXCT", b"ALXN", b"ALXV", b"AFLA", b"AGCS", b"HFDTE"],
        advice: "convert it to GPX (gpsbabel -i igc -f FILE -o gpx -F flight.gpx)",
    },
    Other {
        what: "JSON",
        begins: &[b"{", b"[{", b"[\n"],
        advice: "write its rows as CSV with a header line",
    },
];

/// Kinds known by more than their first bytes. Also in the documentation.
pub(super) const SUBTITLES: (&str, &str) = (
    "subtitles of a video (DJI's .SRT)",
    "write a CSV with a header `t_s,lat_deg,lon_deg,alt_msl_m` (exiftool -ee -csv of the video, or its flight record), and set flight.attitude = \"track\"",
);
pub(super) const KML: (&str, &str) =
    ("KML", "convert it to GPX (gpsbabel -i kml -f FILE -o gpx -F flight.gpx), if its points have times");
pub(super) const OTHER_XML: (&str, &str) = ("XML other than GPX", "write a CSV with a header line, or GPX");

/// What a file is and what to do, if it is none that is read.
pub(super) fn refused(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    if let Some(other) = OTHERS.iter().find(|other| other.begins.iter().any(|begin| text.starts_with(begin)))
    {
        return Some((other.what, other.advice));
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
