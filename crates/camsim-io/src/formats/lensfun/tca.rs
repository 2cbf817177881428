//! Lateral chromatic aberration (`tca`) of lensfun: red and blue are imaged `k` (linear) or `v + c r + b r^2` (poly3)
//! times as far from the centre as green, r in half the short side of the calibration's sensor.

use camsim_core::scenario::ChromaticSpec;
use roxmltree::Node;

use super::number;

/// Terms v, c, b of red and blue at a focal length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tca {
    pub focal_mm: f64,
    red: [f64; 3],
    blue: [f64; 3],
}

/// The entries of a calibration whose model is linear or poly3, ascending by focal length.
pub(super) fn entries(calibration: Node<'_, '_>) -> Result<Vec<Tca>, String> {
    let nodes = calibration.children().filter(|child| child.has_tag_name("tca"));
    let mut found = nodes.filter_map(|node| entry(node).transpose()).collect::<Result<Vec<_>, _>>()?;
    found.sort_by(|a, b| a.focal_mm.total_cmp(&b.focal_mm));
    Ok(found)
}

fn entry(node: Node<'_, '_>) -> Result<Option<Tca>, String> {
    let get = |name: &str, default: f64| node.attribute(name).map_or(Ok(default), |text| number(text, name));
    let [red, blue] = match node.attribute("model") {
        Some("linear") => [[get("kr", 1.0)?, 0.0, 0.0], [get("kb", 1.0)?, 0.0, 0.0]],
        Some("poly3") => [
            [get("vr", 1.0)?, get("cr", 0.0)?, get("br", 0.0)?],
            [get("vb", 1.0)?, get("cb", 0.0)?, get("bb", 0.0)?],
        ],
        _ => return Ok(None),
    };
    let focal = node.attribute("focal").ok_or("has a tca without focal")?;
    Ok(Some(Tca { focal_mm: number(focal, "focal")?, red, blue }))
}

/// The scales of a camera at a focal length: linear between entries, the nearest beyond them. `half_short` is half
/// the picture's short side in that of the calibration. `None` without entries.
pub(super) fn chromatic(entries: &[Tca], focal_mm: f64, half_short: f64) -> Option<ChromaticSpec> {
    let after = entries.partition_point(|entry| entry.focal_mm <= focal_mm);
    let low = entries.get(after.saturating_sub(1))?;
    let high = entries.get(after).unwrap_or(low);
    let span = high.focal_mm - low.focal_mm;
    let fraction = if span > 0.0 { ((focal_mm - low.focal_mm) / span).clamp(0.0, 1.0) } else { 0.0 };
    let terms = |of: fn(&Tca) -> [f64; 3]| {
        let [a, b] = [of(low), of(high)];
        let mut scale = vec![0.0; 3];
        for (i, term) in scale.iter_mut().enumerate() {
            *term = (a[i] + fraction * (b[i] - a[i])) * half_short.powi(i as i32);
        }
        while scale.len() > 1 && scale.last() == Some(&0.0) {
            scale.pop();
        }
        scale
    };
    let (red_scale, blue_scale) = (terms(|entry| entry.red), terms(|entry| entry.blue));
    Some(ChromaticSpec { red_scale, blue_scale, ..ChromaticSpec::default() })
}
