//! Labels of the elements of lists of numbers.

use camsim_core::scenario::LensModel;

/// Labels of a key's elements, in order; empty for keys without labels.
pub fn element_labels(key: &str, lens: LensModel) -> &'static [&'static str] {
    const NED: &[&str] = &["N", "E", "D"];
    const GEODETIC: &[&str] = &["lat", "lon", "h"];
    const ANGLES: &[&str] = &["roll", "pitch", "yaw"];
    let leaf = key.rsplit('.').next().unwrap_or(key);
    match (leaf, lens) {
        ("coefficients", lens) => lens.facts().coefficients,
        ("size_px", _) => &["W", "H"],
        ("crop_px" | "part_px", _) => &["left", "top", "width", "height"],
        ("focal_px", _) => &["fx", "fy"],
        ("principal_point_px", _) => &["cx", "cy"],
        ("angles_deg", _) => ANGLES,
        ("offset_m", _) => &["fwd", "right", "down"],
        ("window_s", _) => &["from", "to"],
        ("vignette_thresholds", _) => &["t1", "t2"],
        ("sky" | "white_balance", _) => &["R", "G", "B"],
        ("spectral_matrix" | "color_matrix", _) => &["rR", "rG", "rB", "gR", "gG", "gB", "bR", "bG", "bB"],
        ("axis", _) => &["x", "y", "z"],
        ("window", _) => &["left", "top", "right", "bottom"],
        ("exposure_ms" | "gain", _) => &["min", "max"],
        ("centre_px", _) => &["cx", "cy"],
        ("sigma_m" | "drift_m" | "velocity_sigma_m_s", _) => &["horizontal", "vertical"],
        ("field_ned_ut", _) => NED,
        ("hard_iron_ut", _) => &["x", "y", "z"],
        ("soft_iron", _) => &["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"],
        ("misalignment_deg", _) => &["xy", "xz", "yx", "yz", "zx", "zy"],
        ("origin" | "geodetic", _) => GEODETIC,
        ("at", _) if key.starts_with("scene.") => NED,
        _ => &[],
    }
}

#[cfg(test)]
mod tests {
    use camsim_io::scenario_file::{ValueKind, keys};

    use super::*;

    #[test]
    fn every_list_of_fixed_length_has_a_label_per_element() {
        for (key, kind) in keys() {
            let count = match kind {
                ValueKind::Numbers(count) | ValueKind::NumbersOr(count, _) | ValueKind::Counts(count, _) => {
                    *count
                }
                _ => continue,
            };
            assert_eq!(element_labels(key, LensModel::BrownConrady).len(), count, "{key}");
        }
        assert_eq!(
            element_labels("camera.lens.coefficients", LensModel::KannalaBrandt),
            ["k1", "k2", "k3", "k4"]
        );
    }
}
