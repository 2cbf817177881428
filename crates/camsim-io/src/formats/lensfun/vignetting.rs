//! Vignetting (`pa`) of lensfun: what arrives is `1 + k1 r^2 + k2 r^4 + k3 r^6` of the light, r in half the
//! diagonal of the calibration's sensor.
//!
//! Between calibrations all of them count, with the weight `d^-3.5`: d is the distance in focal length over the
//! lens's range, 4 / aperture and 0.1 m / distance. None counts if the nearest is farther than 1.

use camsim_core::scenario::VignettingSpec;
use roxmltree::Node;

use super::{LensfunQuery, children, number, text};

/// Power of the distance.
const POWER: f64 = 3.5;
/// Distance within which a calibration counts alone.
const SAME: f64 = 1e-4;
/// Distance beyond which none counts.
const FAR: f64 = 1.0;
/// Words of lens names whose focal lengths are not those of the lens with what they name.
const ATTACHED: [&str; 5] = ["adapter", "reducer", "booster", "extender", "converter"];

/// Terms k1, k2, k3 at a focal length, an aperture and a distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Vignetting {
    focal_mm: f64,
    pub aperture: f64,
    distance_m: f64,
    terms: [f64; 3],
}

/// The entries of a calibration whose model is pa.
pub(super) fn entries(calibration: Node<'_, '_>) -> Result<Vec<Vignetting>, String> {
    let nodes = calibration.children().filter(|child| child.has_tag_name("vignetting"));
    nodes.filter(|node| node.attribute("model") == Some("pa")).map(entry).collect()
}

fn entry(node: Node<'_, '_>) -> Result<Vignetting, String> {
    let get = |name: &str| {
        let text = node.attribute(name).ok_or_else(|| format!("has a vignetting without {name}"))?;
        number(text, name)
    };
    let positive = |name: &str| {
        let value = get(name)?;
        if value > 0.0 { Ok(value) } else { Err(format!("has a vignetting whose {name} is {value}")) }
    };
    Ok(Vignetting {
        focal_mm: positive("focal")?,
        aperture: positive("aperture")?,
        distance_m: positive("distance")?,
        terms: [get("k1")?, get("k2")?, get("k3")?],
    })
}

/// Shortest and longest focal length of a lens, millimetres: as it states, or its name, or its calibrations.
pub(super) fn focal_range_mm(lens: Node<'_, '_>) -> Result<[f64; 2], String> {
    if let Some(node) = children(lens, "focal").next() {
        let get = |name: &str| node.attribute(name).or(node.attribute("value")).unwrap_or("0");
        return Ok([number(get("min"), "focal")?, number(get("max"), "focal")?]);
    }
    let name = text(lens, "model").unwrap_or_default().to_lowercase();
    let of_name = if ATTACHED.iter().any(|word| name.contains(word)) { None } else { range_of_name(&name) };
    if let Some(range) = of_name {
        return Ok(range);
    }
    let nodes = lens.descendants().filter_map(|node| node.attribute("focal"));
    let focals = nodes.map(|text| number(text, "focal")).collect::<Result<Vec<_>, _>>()?;
    let ends = focals.iter().fold([f64::INFINITY, 0.0], |[low, high], &f| [f.min(low), f.max(high)]);
    Ok(if focals.is_empty() { [0.0; 2] } else { ends })
}

/// `18-55` or `35` before the first `mm`.
fn range_of_name(name: &str) -> Option<[f64; 2]> {
    name.match_indices("mm").find_map(|(end, _)| {
        let before = name[..end].trim_end();
        let begin = before.trim_end_matches(|c: char| c.is_ascii_digit() || c == '.' || c == '-').len();
        let mut parts = before[begin..].trim_start_matches('-').split('-').map(str::parse::<f64>);
        let first = parts.next()?.ok()?;
        Some([first, parts.next().map_or(Some(first), Result::ok)?])
    })
}

/// The vignetting of a camera with an aperture, interpolated between the entries. `radius` is half the picture's
/// diagonal in that of the calibration. `Err` says what is skipped and why.
pub(super) fn of_camera(
    entries: &[Vignetting],
    focal_range_mm: [f64; 2],
    query: &LensfunQuery<'_>,
    radius: f64,
) -> Result<Option<VignettingSpec>, String> {
    let Some(nearest_aperture) = entries.first() else { return Ok(None) };
    let Some(aperture) = query.aperture else {
        let ends = entries.iter().fold([nearest_aperture.aperture; 2], |[low, high], entry| {
            [entry.aperture.min(low), entry.aperture.max(high)]
        });
        return Err(format!(
            "not applied: vignetting, which depends on the aperture: add --aperture N (calibrated from f/{} to f/{})",
            ends[0], ends[1]
        ));
    };
    let [low_mm, high_mm] = focal_range_mm;
    let span_mm = if high_mm > low_mm { high_mm - low_mm } else { 1.0 };
    let distance = |entry: &Vignetting| {
        let focal = (entry.focal_mm - query.focal_mm) / span_mm;
        let stop = 4.0 / entry.aperture - 4.0 / aperture;
        let near = 0.1 / entry.distance_m - 0.1 / query.distance_m;
        (focal * focal + stop * stop + near * near).sqrt()
    };
    let distances: Vec<f64> = entries.iter().map(distance).collect();
    let nearest = distances.iter().copied().fold(f64::INFINITY, f64::min);
    if nearest > FAR {
        return Err(format!(
            "not applied: vignetting, none of whose calibrations is near {} mm at f/{aperture}",
            query.focal_mm
        ));
    }
    let terms = match distances.iter().position(|&d| d < SAME) {
        Some(same) => entries[same].terms,
        None => {
            let weights: Vec<f64> = distances.iter().map(|d| d.powf(-POWER)).collect();
            let sum: f64 = weights.iter().sum();
            let mean =
                |i: usize| entries.iter().zip(&weights).map(|(e, w)| w * e.terms[i]).sum::<f64>() / sum;
            [0, 1, 2].map(mean)
        }
    };
    let scale = radius * radius;
    let polynomial = vec![terms[0] * scale, terms[1] * scale.powi(2), terms[2] * scale.powi(3)];
    Ok(Some(VignettingSpec { polynomial, ..VignettingSpec::default() }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn focal_lengths_are_read_from_names() {
        for (name, range) in [
            ("ef-s 18-55mm f/3.5-5.6", Some([18.0, 55.0])),
            ("planar 1.4/50 mm", Some([50.0, 50.0])),
            ("lens 10.5mm", Some([10.5, 10.5])),
            ("hamming 70-200mm", Some([70.0, 200.0])),
            ("nothing", None),
        ] {
            assert_eq!(range_of_name(name), range, "{name}");
        }
    }
}
