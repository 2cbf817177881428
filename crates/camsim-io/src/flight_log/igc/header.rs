//! Header records (`H`) that change what the numbers of a flight record mean.
//!
//! | record | applied |
//! |---|---|
//! | `DTE` | the date of the fixes behind it |
//! | `DTM` | WGS 84 in its spellings, or a datum within 1 m of it; another one gives a warning |
//! | `ALG` | what satellite heights are above: `ELL`, `GEO`; `NIL` and `NKN` give a warning |
//! | `ALP` | air pressure in the standard atmosphere (`ISA`); another setting gives a warning where it is flown |
//! | `TZN` | not applied: fixes are in UTC |
//! | `UNT` | a warning if it names feet: `B` records are in metres |

use camsim_core::{flight_log::Note, scenario::HeightReference};

use super::super::time_fields;

/// Statements of the header.
#[derive(Clone, Debug)]
pub(super) struct Header {
    /// Nanoseconds from 1970 to the last date.
    pub(super) day_ns: Option<i128>,
    /// What satellite heights are above, the ellipsoid unless the record says otherwise; `None` if it says that
    /// it does not know.
    pub(super) gnss_height: Option<HeightReference>,
    /// Line and text of a setting of pressure heights other than the standard atmosphere.
    pub(super) pressure: Option<(usize, String)>,
    pub(super) notes: Vec<Note>,
}

impl Default for Header {
    fn default() -> Self {
        let gnss_height = Some(HeightReference::Ellipsoid);
        Self { day_ns: None, gnss_height, pressure: None, notes: Vec::new() }
    }
}

/// Subject, as `DTM`, and what stands behind it, of a record such as `HFDTM100GPSDATUM:WGS-1984`.
fn parse(line: &str) -> Option<(String, &str)> {
    let is_header = matches!(line.as_bytes(), [b'H' | b'h', b'F' | b'O' | b'P' | b'f' | b'o' | b'p', ..]);
    Some((line.get(2..5).filter(|_| is_header)?.to_ascii_uppercase(), line.get(5..)?))
}

impl Header {
    /// Takes a line of the file that is no fix.
    ///
    /// # Errors
    /// It is a date that cannot be read.
    pub(super) fn read(&mut self, line: &str, number: usize) -> Result<(), String> {
        let Some((subject, rest)) = parse(line) else { return Ok(()) };
        let letters: String = rest.chars().filter(char::is_ascii_alphanumeric).collect();
        let letters = letters.to_ascii_uppercase();
        match subject.as_str() {
            "DTE" => self.date(rest, line, number)?,
            "DTM" => self.datum(&letters, line, number),
            "ALG" => self.gnss_height(&letters, line, number),
            "ALP" => {
                // Some loggers write the setting of 1013.25 hPa for the standard atmosphere.
                let standard = ["ISA", "STANDARD", "STD", "101325", "NIL", "NKN"];
                let value = strip(&letters, "ALTPRESSURE");
                let is_standard = value.is_empty() || standard.iter().any(|word| value.contains(word));
                self.pressure = (!is_standard).then(|| (number, line.to_owned()));
            }
            "TZN" => self.note(
                false,
                format!("line {number}: `{line}` is not applied: the fixes of IGC files are in UTC"),
            ),
            "UNT" if letters.contains("FT") || letters.contains("FEET") || letters.contains("FOOT") => self.note(
                true,
                format!(
                    "line {number}: `{line}` names feet, but heights of B records are metres: they are read so"
                ),
            ),
            _ => {}
        }
        Ok(())
    }

    fn note(&mut self, is_warning: bool, text: String) {
        self.notes.push(Note { is_warning, text });
    }

    fn date(&mut self, rest: &str, line: &str, number: usize) -> Result<(), String> {
        let text = rest.trim_start_matches(|c: char| !c.is_ascii_digit());
        let text = text.split([',', ' ', ';']).next().unwrap_or("");
        if text.bytes().all(|byte| byte == b'0') {
            self.note(true, format!("line {number}: `{line}` states no date: times count from midnight"));
            return Ok(());
        }
        let day_ns = date_ns(text);
        self.day_ns = Some(
            day_ns.ok_or_else(|| format!("`{line}` is no date such as HFDTE010523 (day, month, year)"))?,
        );
        Ok(())
    }

    /// Takes `100GPSDATUMWGS84`, where the number, the key or the name may be missing.
    fn datum(&mut self, letters: &str, line: &str, number: usize) {
        let name = letters.trim_start_matches(|c: char| c.is_ascii_digit());
        let code = &letters[..letters.len() - name.len()];
        let name = strip(strip(name, "GPS"), "DATUM");
        // The number of the datum may stand instead of its name.
        let (code, name) = if name.parse::<u32>().is_ok() { (name, "") } else { (code, name) };
        let is_known = if name.is_empty() { ["", "100"].contains(&code) } else { is_wgs84(name) };
        if !is_known {
            self.note(
                true,
                format!(
                    "line {number}: `{line}` names another datum than WGS 84 (100): the positions are taken as \
                        WGS 84, which may place them hundreds of metres off; set the logger to WGS 84, or convert \
                        the positions"
                ),
            );
        }
    }

    fn gnss_height(&mut self, letters: &str, line: &str, number: usize) {
        let value = strip(letters, "ALTGPS");
        let has = |words: &[&str]| words.iter().any(|word| value.contains(word));
        if value.is_empty() || has(&["ELL", "WGS", "HAE"]) {
            self.gnss_height = Some(HeightReference::Ellipsoid);
        } else if has(&["GEO", "MSL", "EGM", "SEALEVEL"]) {
            self.gnss_height = Some(HeightReference::Msl);
        } else {
            self.gnss_height = None;
            let text = format!(
                "line {number}: `{line}` does not say what satellite heights are above (ELL or GEO): they are taken \
                    as flight.height says"
            );
            self.note(true, text);
        }
    }
}

/// A text without a word at its beginning.
fn strip<'a>(text: &'a str, word: &str) -> &'a str {
    text.strip_prefix(word).unwrap_or(text)
}

/// Whether the letters and digits of a datum's name are those of WGS 84, or of a system within 1 m of it.
fn is_wgs84(name: &str) -> bool {
    let same =
        ["WGS84", "WGS1984", "WORLDGEODETICSYSTEM1984", "WORLDGEODETICSYSTEM84", "EPSG4326", "EPSG4979"];
    let near = ["ETRS89", "ETRF", "ITRF", "GDA94", "GDA2020", "NZGD2000", "PZ90"];
    // As part of `WGS 84 (G1762)`, too.
    name == "WGS" || same.iter().chain(&near).any(|word| name.contains(word))
}

/// Nanoseconds since 1970 of day, month and year as `010523`, `01052023`, `01-05-23` or `2023-05-01`.
fn date_ns(text: &str) -> Option<i128> {
    if let Some(iso) = time_fields::date_ns(text) {
        return Some(iso);
    }
    let marks = |c: char| matches!(c, '-' | '/' | '.');
    let parts: Vec<String> = if text.contains(marks) {
        text.split(marks).map(|part| format!("{part:0>2}")).collect()
    } else {
        [text.get(0..2)?, text.get(2..4)?, text.get(4..)?].map(str::to_owned).to_vec()
    };
    let [day, month, year] = &parts[..] else { return None };
    let year = match year.len() {
        2 if year.as_str() < "80" => format!("20{year}"),
        2 => format!("19{year}"),
        4 => year.clone(),
        _ => return None,
    };
    time_fields::date_ns(&format!("{year}-{month}-{day}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn warnings(line: &str) -> usize {
        let mut header = Header::default();
        header.read(line, 3).unwrap_or_default();
        header.notes.iter().filter(|note| note.is_warning).count()
    }

    #[test]
    fn spellings_of_wgs84_are_no_warning_and_others_are_one() {
        for line in [
            "HFDTM100GPSDATUM:WGS-1984",
            "HFDTM100GPSDATUM:WGS84",
            "HFDTM100DATUM:WGS-1984",
            "HFDTM100:WGS 84",
            "HFDTMGPSDATUM:WGS84",
            "HODTM100GPSDATUM: World Geodetic System 1984",
            "HFDTM100",
            "HFDTMGPSDATUM:",
            "HFDTM:100",
            "HFDTM100GPSDATUM:WGS84 (G1762)",
            "HFDTMWGS84",
            "HFDTM000GPSDATUM:WGS84",
            "HFDTM100GPSDATUM:ETRS89",
        ] {
            assert_eq!(warnings(line), 0, "{line}");
        }
        for line in [
            "HFDTM021GPSDATUM:ED50",
            "HFDTM100GPSDATUM:ED50",
            "HPDTM:TOKYO",
            "HFDTM021",
            "HFDTMGPSDATUM:NAD27 CONUS",
            "hfdtm:european 1950",
            "HFDTM100GPSDATUM:WGS72",
            "HFDTMED50",
        ] {
            assert_eq!(warnings(line), 1, "{line}");
        }
    }

    #[test]
    fn dates_are_read_in_their_forms() {
        // 2023-05-01 is day 19478.
        let day_ns = 19_478 * 86_400_000_000_000_i128;
        for line in [
            "HFDTE010523",
            "HFDTEDATE:010523,01",
            "HFDTEDATE: 010523",
            "HFDTE:01052023",
            "HFDTEDATE:01-05-23",
            "HPDTE01.05.2023",
            "hfdte010523",
        ] {
            let mut header = Header::default();
            assert_eq!(header.read(line, 1), Ok(()), "{line}");
            assert_eq!(header.day_ns, Some(day_ns), "{line}");
        }
        let mut header = Header::default();
        assert!(header.read("HFDTE451399", 1).is_err_and(|text| text.contains("HFDTE010523")));
        assert_eq!(warnings("HFDTE000000"), 1);
    }

    #[test]
    fn altitude_references_are_told_apart() {
        let of = |line: &str| {
            let mut header = Header::default();
            header.read(line, 1).unwrap_or_default();
            (header.gnss_height, header.notes.len(), header.pressure.is_some())
        };
        assert_eq!(of("HFALGALTGPS:ELL"), (Some(HeightReference::Ellipsoid), 0, false));
        assert_eq!(of("HFALG ALTGPS: GEOID"), (Some(HeightReference::Msl), 0, false));
        assert_eq!(of("HFALGALTGPS:GEO"), (Some(HeightReference::Msl), 0, false));
        assert_eq!(of("HFALGALTGPS:NKN"), (None, 1, false));
        assert_eq!(of("HFALPALTPRESSURE:ISA"), (Some(HeightReference::Ellipsoid), 0, false));
        assert_eq!(of("HFALPALTPRESSURE:QNH 1021"), (Some(HeightReference::Ellipsoid), 0, true));
        assert_eq!(of("HFTZNTIMEZONE:2.0"), (Some(HeightReference::Ellipsoid), 1, false));
    }
}
