//! Logs of receivers as text, whose lines are messages and no rows of one table.

const NOVATEL: (&str, &str) = (
    "a NovAtel log as text (#BESTPOSA,... or #INSPVAXA,...)",
    "write one row for each message: the second of the week before the semicolon, and fields behind it, below a \
        header such as t_s,lat_deg,lon_deg,alt_msl_m (BESTPOS; attitude = \"track\" then), or with \
        roll_deg,pitch_deg,yaw_deg, too (INSPVA, INSPVAX: the yaw is the azimuth)",
);
const VECTORNAV: (&str, &str) = (
    "messages of a VectorNav sensor ($VN...)",
    "write one row for each message below a header such as t_s,lat_deg,lon_deg,alt_m,roll_deg,pitch_deg,yaw_deg",
);
const SENTENCES: (&str, &str) = (
    "sentences of a receiver ($...*checksum)",
    "convert it to GPX (gpsbabel -i nmea -f FILE -o gpx -F flight.gpx), or write one row for each position \
        below a header such as t_s,lat_deg,lon_deg,alt_msl_m",
);
const RINEX: (&str, &str) = (
    "observations of a receiver (RINEX), not positions",
    "compute positions with RTKLIB (rnx2rtkp), and give its .pos file",
);

/// Names and advice. docs/reference/inputs/LOGS.md lists them.
pub(super) static RECEIVER_LOGS: [(&str, &str); 4] = [NOVATEL, VECTORNAV, SENTENCES, RINEX];

/// Name and advice of such a log; `None` of any other file.
pub(super) fn detect(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    let head = bytes.get(..4096).unwrap_or(bytes);
    let text = String::from_utf8_lossy(head);
    let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).take(4).collect();
    let first = lines.first()?;
    if first.contains("RINEX VERSION") {
        return Some(RINEX);
    }
    if lines.iter().any(|line| line.starts_with("$VN") && line.contains(',')) {
        return Some(VECTORNAV);
    }
    if lines.iter().any(|line| is_novatel(line)) {
        return Some(NOVATEL);
    }
    lines.iter().any(|line| is_sentence(line)).then_some(SENTENCES)
}

/// Whether a line is `#BESTPOSA,COM1,...;...*checksum`, `%INSPVASA,...;...`, or `<INSPVA COM1 ...`.
fn is_novatel(line: &str) -> bool {
    let is_name =
        |name: &str| name.len() > 4 && name.chars().all(|c| c.is_ascii_uppercase() || c.is_ascii_digit());
    if let Some(rest) = line.strip_prefix('<') {
        let mut words = rest.split_whitespace();
        let ports = ["COM", "USB", "FILE", "ICOM", "NCOM", "SPECIAL"];
        return words.next().is_some_and(is_name)
            && words.next().is_some_and(|port| ports.iter().any(|name| port.starts_with(name)));
    }
    let rest = line.strip_prefix(['#', '%']);
    let name = rest.and_then(|rest| rest.split_once(',')).map(|(name, _)| name);
    name.is_some_and(|name| is_name(name) && name.ends_with('A')) && line.contains(';') && line.contains('*')
}

/// Whether a line is `$NAME,...*checksum`.
fn is_sentence(line: &str) -> bool {
    let is_checksum = |text: &str| text.len() == 2 && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    line.starts_with(['$', '!'])
        && line.contains(',')
        && line.rsplit_once('*').is_some_and(|(_, checksum)| is_checksum(checksum))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logs_of_receivers_are_told_from_comments() {
        for (text, expected) in [
            (
                "#INSPVAXA,COM1,0,58.5,FINESTEERING,2260,381600.000,00000040,0000,0;A,B,47.05*abcdef12\n",
                NOVATEL,
            ),
            ("%INSPVASA,2260,381600.1;2260,381600.1,47.05,8.3,480.0*aa\n", NOVATEL),
            ("<INSPVA COM1 0 58.5 FINESTEERING 2260 381600.000\n<     2260 381600.0 47.05\n", NOVATEL),
            ("$VNINS,381600.0,2260,0004,60.0,2.0,5.0,47.05,8.31,480.0*5E\n", VECTORNAV),
            ("$PASHR,123519.00,60.0,T,5.0,2.0,0.1,0.1,0.1,0.1,1,1*2D\n", SENTENCES),
            ("     3.04           OBSERVATION DATA    M (MIXED)           RINEX VERSION / TYPE\n", RINEX),
        ] {
            assert_eq!(detect(text.as_bytes()), Some(expected), "{text}");
        }
        for text in [
            "# t tx ty tz qx qy qz qw\n0 1 2 3 0 0 0 1\n",
            "#timestamp [ns],p_RS_R_x [m]\n1,2\n",
            "#ALTITUDE,in;feet\n0,47,8,500\n",
            "$FLYS,1\n$COL,GNSS,time,lat\n",
        ] {
            assert_eq!(detect(text.as_bytes()), None, "{text}");
        }
    }
}
