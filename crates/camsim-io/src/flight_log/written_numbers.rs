//! Numbers with their units in the field, as exiftool writes them for people to read.

/// Degrees of `47 deg 3' 12.30" N`, also with `°`, and without minutes, seconds or a letter; `None` where the
/// text has no mark of degrees.
pub(super) fn degrees(text: &str) -> Option<f64> {
    let text = text.trim();
    let (magnitude, sign) = match text.chars().last()?.to_ascii_uppercase() {
        'N' | 'E' => (&text[..text.len() - 1], 1.0),
        'S' | 'W' => (&text[..text.len() - 1], -1.0),
        _ => (text, 1.0),
    };
    let (degrees, rest) = magnitude.split_once("deg").or_else(|| magnitude.split_once('°'))?;
    let (minutes, rest) = rest.split_once('\'').unwrap_or(("0", rest));
    // A quote within quotes is written twice.
    let seconds = rest.trim().trim_end_matches('"').trim();
    let seconds = if seconds.is_empty() { "0" } else { seconds };
    // Seconds that are rounded may be 60.
    let part = |text: &str| text.trim().parse::<f64>().ok().filter(|value| (0.0..=60.0).contains(value));
    let degrees: f64 = degrees.trim().parse().ok()?;
    let fraction = part(minutes)? / 60.0 + part(seconds)? / 3600.0;
    Some(sign * (degrees.abs() + fraction).copysign(degrees))
}

/// Metres of `480 m Above Sea Level`, `12.5 m Below Sea Level` and `480 m`.
pub(super) fn metres(text: &str) -> Option<f64> {
    let mut words = text.split_whitespace();
    let value: f64 = words.next()?.parse().ok()?;
    if words.next()? != "m" {
        return None;
    }
    match words.collect::<Vec<_>>().join(" ").to_ascii_lowercase().as_str() {
        "" | "above sea level" => Some(value),
        "below sea level" => Some(-value),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degrees_and_metres_with_units() {
        for (text, expected) in [
            ("47 deg 3' 36.00\" N", Some(47.06)),
            ("47 deg 3' 36.00\"\" S", Some(-47.06)),
            ("8° 18' W", Some(-8.3)),
            ("47 deg 2' 60.00\" N", Some(47.05)),
            ("8.31°", Some(8.31)),
            ("-8 deg 30' 0\"", Some(-8.5)),
            ("47.05N", None),
            ("47 deg 61' 0\" N", None),
            ("deg", None),
            ("", None),
        ] {
            let value = degrees(text);
            assert_eq!(value.map(|value| (value * 1e9).round() / 1e9), expected, "{text}");
        }
        for (text, expected) in [
            ("480.5 m Above Sea Level", Some(480.5)),
            ("12 m Below Sea Level", Some(-12.0)),
            ("480 m", Some(480.0)),
            ("480 ft", None),
            ("480 m above ground", None),
        ] {
            assert_eq!(metres(text), expected, "{text}");
        }
    }
}
