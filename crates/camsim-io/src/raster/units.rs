//! Units of length by EPSG code and by name.

/// Words of scene.terrain.height_unit, for messages.
pub(super) const HEIGHT_UNITS: &str = "\"m\", \"ft\", \"us-ft\", \"dm\", \"cm\" or \"mm\"";

/// Units that differ by less are the same; the international and the US survey foot differ by six times as
/// much.
pub(super) const SAME_UNIT_M: f64 = 1e-7;

/// Metres per unit of an EPSG code; `None` for an unknown one.
pub(super) fn metres_per_unit_code(code: u16) -> Option<f64> {
    Some(match code {
        9001 => 1.0,
        9002 => 0.3048,
        9003 => 1200.0 / 3937.0,
        9036 => 1000.0,
        1025 => 0.001,
        1033 => 0.01,
        _ => return None,
    })
}

/// Metres per unit of a name; `None` for an unknown one.
pub(crate) fn metres_per_unit_name(name: &str) -> Option<f64> {
    let name = name.trim().to_lowercase().replace(['_', '-'], " ").replace(['.', '[', ']', '(', ')'], "");
    Some(match name.as_str() {
        "m" | "metre" | "metres" | "meter" | "meters" => 1.0,
        "ft" | "foot" | "feet" | "international foot" | "international feet" | "foot international"
        | "ft intl" => 0.3048,
        "us survey foot" | "us survey feet" | "survey foot" | "survey feet" | "us foot" | "us feet"
        | "us ft" | "usft" | "ftus" | "ft us" | "foot us" | "sft" => 1200.0 / 3937.0,
        "cm" | "centimetre" | "centimetres" | "centimeter" | "centimeters" => 0.01,
        "dm" | "decimetre" | "decimetres" | "decimeter" | "decimeters" => 0.1,
        "mm" | "millimetre" | "millimetres" | "millimeter" | "millimeters" => 0.001,
        "km" | "kilometre" | "kilometres" | "kilometer" | "kilometers" => 1000.0,
        _ => return None,
    })
}
