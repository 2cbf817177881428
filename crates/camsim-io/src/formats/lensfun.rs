//! lensfun's database of lenses (XML): a lens by its name and focal length.
//!
//! The models map undistorted to distorted radii in half the short side of the calibration's sensor:
//! `Rd = Ru (1 - k1 + k1 Ru^2)` (poly3), `Ru (1 + k1 Ru^2 + k2 Ru^4)` (poly5), `Ru (a Ru^3 + b Ru^2 + c Ru + d)`,
//! `d = 1 - a - b - c` (ptlens). The focal length of the distorted picture's centre is `real-focal`, or else d times
//! the nominal one. In units of it, `Rd = Ru (1 + ...)` with the terms times `h^i / d^(i + 1)`, h = focal length over
//! half the short side.
//!
//! poly3, poly5 of a rectilinear lens are Brown-Conrady, and all models of an equidistant fisheye f-theta, to the
//! digit. ptlens of a rectilinear lens has odd powers, so a rational Brown-Conrady is fitted, and its error stated.

use std::path::Path;

use camsim_core::scenario::{CameraSpec, LensModel, LensSpec};
use roxmltree::Node;

use super::reading::{CameraFileError, check, read};
use crate::text::numbers::shortest;

mod fit;
mod tca;
mod vignetting;

use tca::Tca;
use vignetting::Vignetting;

/// Diagonal of a sensor with crop factor 1, millimetres.
const FULL_DIAGONAL_MM: f64 = 43.266_615_305_567_87;
/// Least ratio of crop factors at which a calibration covers the picture.
const COVERS: f64 = 0.96;

/// A lens on a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensfunQuery<'a> {
    /// Name of the lens, or a part of it.
    pub lens: &'a str,
    /// Focal length, millimetres.
    pub focal_mm: f64,
    /// Size of the pictures.
    pub size_px: [u32; 2],
    /// Crop factor of the camera; `None`: that of the calibration.
    pub crop: Option<f64>,
    /// f-number, for the vignetting; `None`: without vignetting.
    pub aperture: Option<f64>,
    /// Distance of what is in focus, metres, for the vignetting.
    pub distance_m: f64,
}

/// A lens of the database on a camera.
#[derive(Clone, Debug, PartialEq)]
pub struct LensfunCamera {
    /// The camera.
    pub spec: CameraSpec,
    /// Notes for the user.
    pub notes: Vec<String>,
}

/// Polynomials by focal length, of one sensor.
struct Calibration {
    name: String,
    kind: String,
    crop: f64,
    aspect: f64,
    model: String,
    /// Ascending by focal length.
    entries: Vec<Entry>,
    tca: Vec<Tca>,
    has_other_tca: bool,
    vignetting: Vec<Vignetting>,
    has_other_vignetting: bool,
    focal_range_mm: [f64; 2],
}

/// Terms at a focal length.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Entry {
    focal_mm: f64,
    real_focal_mm: f64,
    terms: [f64; 3],
}

/// Reads a lens of a lensfun database.
///
/// # Errors
/// The file is not lensfun's, no or several lenses have the name, or none of its calibrations fits the camera.
pub fn import_lensfun(path: &Path, query: &LensfunQuery<'_>) -> Result<LensfunCamera, CameraFileError> {
    let fail = |key: &str, message: String| CameraFileError::Key {
        path: path.to_owned(),
        key: key.to_owned(),
        message,
    };
    let positive = |value: f64| value.is_finite() && value > 0.0;
    if !positive(query.focal_mm) || !query.crop.is_none_or(positive) {
        return Err(fail("--focal", "and --crop are positive numbers".to_owned()));
    }
    if !query.aperture.is_none_or(positive) || !positive(query.distance_m) {
        return Err(fail("--aperture", "and --distance are positive numbers".to_owned()));
    }
    let text = read(path)?;
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..roxmltree::ParsingOptions::default() };
    let tree =
        roxmltree::Document::parse_with_options(&text, options).map_err(|error| CameraFileError::Syntax {
            path: path.to_owned(),
            line: Some(error.pos().row as usize),
            message: format!("XML: {error}"),
        })?;
    if tree.root_element().tag_name().name() != "lensdatabase" {
        return Err(fail("lensdatabase", "is missing: this is not lensfun's database".to_owned()));
    }
    let calibrations = find_lens(&tree, query.lens).map_err(|message| fail("--lens", message))?;
    let chosen = choose(&calibrations, query.crop).map_err(|message| fail("--crop", message))?;
    let camera = camera(chosen, query).map_err(|message| fail(&chosen.name, message))?;
    check(path, &camera.spec)?;
    Ok(camera)
}

fn children<'a>(node: Node<'a, 'a>, name: &'static str) -> impl Iterator<Item = Node<'a, 'a>> {
    node.children().filter(move |child| child.has_tag_name(name))
}

fn text<'a>(node: Node<'a, 'a>, name: &'static str) -> Option<&'a str> {
    children(node, name).find_map(|child| child.text()).map(str::trim)
}

/// The calibrations of the lens of a name: the whole name, or a part that only one lens has.
fn find_lens(tree: &roxmltree::Document<'_>, wanted: &str) -> Result<Vec<Calibration>, String> {
    let plain = |name: &str| name.split_whitespace().collect::<Vec<_>>().join(" ").to_lowercase();
    let wanted_plain = plain(wanted);
    let lenses: Vec<Node<'_, '_>> =
        tree.root_element().children().filter(|node| node.has_tag_name("lens")).collect();
    let names = |lens: Node<'_, '_>| -> Vec<String> {
        let models = lens.children().filter(|child| child.has_tag_name("model"));
        models.filter_map(|model| model.text()).map(str::to_owned).collect()
    };
    let matching = |test: &dyn Fn(&str) -> bool| -> Vec<Node<'_, '_>> {
        lenses.iter().copied().filter(|lens| names(*lens).iter().any(|name| test(&plain(name)))).collect()
    };
    let mut found = matching(&|name| name == wanted_plain);
    if found.is_empty() {
        found = matching(&|name| name.contains(&wanted_plain));
    }
    let mut titles: Vec<String> = found.iter().filter_map(|lens| names(*lens).into_iter().next()).collect();
    titles.sort();
    titles.dedup();
    match titles.len() {
        0 => Err(format!("`{wanted}` is no lens of this file")),
        1 => Ok(found
            .iter()
            .map(|lens| calibrations(*lens))
            .collect::<Result<Vec<_>, _>>()?
            .into_iter()
            .flatten()
            .collect()),
        count => {
            titles.truncate(8);
            Err(format!(
                "{count} lenses match `{wanted}`: {}{}",
                titles.join(", "),
                if count > 8 { ", ..." } else { "" }
            ))
        }
    }
}

/// The calibrations of a lens, one or several sensors.
fn calibrations(lens: Node<'_, '_>) -> Result<Vec<Calibration>, String> {
    let name = text(lens, "model").unwrap_or_default().to_owned();
    let crop = text(lens, "cropfactor").unwrap_or("1");
    let aspect = text(lens, "aspect-ratio").unwrap_or("1.5");
    let focal_range_mm = vignetting::focal_range_mm(lens)?;
    let of = |calibration: Node<'_, '_>| {
        let has = |name: &str| calibration.children().any(|child| child.has_tag_name(name));
        let nodes: Vec<Node<'_, '_>> =
            calibration.children().filter(|child| child.has_tag_name("distortion")).collect();
        let model = nodes.first().and_then(|node| node.attribute("model")).unwrap_or("none").to_owned();
        // As lensfun does: entries of another model than the first are skipped.
        let same = nodes.iter().filter(|node| node.attribute("model") == Some(&model));
        let mut entries = same.map(|node| entry(*node, &model)).collect::<Result<Vec<_>, String>>()?;
        entries.sort_by(|a, b| a.focal_mm.total_cmp(&b.focal_mm));
        let tca = tca::entries(calibration)?;
        let vignetting = vignetting::entries(calibration)?;
        Ok(Calibration {
            name: name.clone(),
            kind: text(lens, "type").unwrap_or("rectilinear").to_owned(),
            crop: number(calibration.attribute("cropfactor").unwrap_or(crop), "cropfactor")?,
            aspect: ratio(calibration.attribute("aspect-ratio").unwrap_or(aspect))?,
            model,
            entries,
            has_other_tca: has("tca") && tca.is_empty(),
            tca,
            has_other_vignetting: has("vignetting") && vignetting.is_empty(),
            vignetting,
            focal_range_mm,
        })
    };
    lens.children().filter(|child| child.has_tag_name("calibration")).map(of).collect()
}

fn number(text: &str, name: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| format!("{name} is `{text}`, not a number"))
}

/// `3:2` or `1.5`.
fn ratio(text: &str) -> Result<f64, String> {
    match text.split_once(':') {
        Some((width, height)) => Ok(number(width, "aspect-ratio")? / number(height, "aspect-ratio")?),
        None => number(text, "aspect-ratio"),
    }
}

fn entry(node: Node<'_, '_>, model: &str) -> Result<Entry, String> {
    let names: &[&str] = match model {
        "poly3" => &["k1"],
        "poly5" => &["k1", "k2"],
        "ptlens" => &["a", "b", "c"],
        other => {
            return Err(format!(
                "has distortion of the model `{other}`: poly3, poly5 and ptlens can be imported"
            ));
        }
    };
    let get = |name: &str| node.attribute(name).map_or(Ok(0.0), |text| number(text, name));
    let focal = node.attribute("focal").ok_or("has a distortion without focal")?;
    let focal_mm = number(focal, "focal")?;
    let mut terms = [0.0; 3];
    for (term, name) in terms.iter_mut().zip(names) {
        *term = get(name)?;
    }
    let real_focal_mm = match node.attribute("real-focal") {
        Some(text) => number(text, "real-focal")?,
        None => focal_mm * centre_scale(model, terms),
    };
    Ok(Entry { focal_mm, real_focal_mm, terms })
}

/// d: the scale of the distorted picture's centre.
fn centre_scale(model: &str, [a, b, c]: [f64; 3]) -> f64 {
    match model {
        "poly3" => 1.0 - a,
        "ptlens" => 1.0 - a - b - c,
        _ => 1.0,
    }
}

/// The calibration of the largest sensor's crop that covers the camera's picture.
fn choose(all: &[Calibration], crop: Option<f64>) -> Result<&Calibration, String> {
    let mut usable: Vec<&Calibration> = all.iter().filter(|one| !one.entries.is_empty()).collect();
    if usable.is_empty() {
        return Err(
            "the lens has no distortion in this file: its pictures may be used as a pinhole's".to_owned()
        );
    }
    usable.sort_by(|a, b| b.crop.total_cmp(&a.crop));
    let Some(crop) = crop else { return Ok(usable[0]) };
    usable.iter().copied().find(|one| crop / one.crop >= COVERS).ok_or_else(|| {
        let known: Vec<String> = usable.iter().map(|one| one.crop.to_string()).collect();
        format!("is {crop}, a larger sensor than that of any calibration (crop factor {})", known.join(", "))
    })
}

/// Terms at a focal length, as lensfun interpolates them: terms times focal length by a cubic Hermite between
/// neighbours, the nearest beyond the ends. The flag says whether it is beyond.
fn at_focal(entries: &[Entry], focal_mm: f64) -> (Entry, bool) {
    let after = entries.partition_point(|entry| entry.focal_mm < focal_mm);
    let (Some(before), Some(next)) = (after.checked_sub(1), entries.get(after)) else {
        let nearest = if after == 0 { entries[0] } else { entries[entries.len() - 1] };
        return (nearest, nearest.focal_mm != focal_mm);
    };
    if next.focal_mm == focal_mm {
        return (*next, false);
    }
    let first = entries[before];
    let t = (focal_mm - first.focal_mm) / (next.focal_mm - first.focal_mm);
    let outer = [before.checked_sub(1).map(|i| entries[i]), entries.get(after + 1).copied()];
    let between = |value: &dyn Fn(&Entry) -> f64| {
        let (y2, y3) = (value(&first), value(next));
        let m2 = outer[0].map_or(y3 - y2, |y1| 0.5 * (y3 - value(&y1)));
        let m3 = outer[1].map_or(y3 - y2, |y4| 0.5 * (value(&y4) - y2));
        let (t2, t3) = (t * t, t * t * t);
        (2.0 * t3 - 3.0 * t2 + 1.0) * y2
            + (t3 - 2.0 * t2 + t) * m2
            + (3.0 * t2 - 2.0 * t3) * y3
            + (t3 - t2) * m3
    };
    let mut terms = [0.0; 3];
    for (i, term) in terms.iter_mut().enumerate() {
        *term = between(&|entry| entry.terms[i] * entry.focal_mm) / focal_mm;
    }
    (Entry { focal_mm, real_focal_mm: between(&|entry| entry.real_focal_mm), terms }, false)
}

/// The camera of a calibration.
fn camera(calibration: &Calibration, query: &LensfunQuery<'_>) -> Result<LensfunCamera, String> {
    let (entry, is_beyond) = at_focal(&calibration.entries, query.focal_mm);
    let mut notes = Vec::new();
    if is_beyond {
        notes.push(format!(
            "{} mm is beyond the calibrated focal lengths: that of {} mm is taken, as lensfun does",
            query.focal_mm, entry.focal_mm
        ));
    }
    let crop = query.crop.unwrap_or(calibration.crop);
    let [width, height] = query.size_px.map(f64::from);
    let pitch_mm = FULL_DIAGONAL_MM / crop / width.hypot(height);
    let focal_px = entry.real_focal_mm / pitch_mm;
    let half_short_mm = FULL_DIAGONAL_MM / calibration.crop / calibration.aspect.hypot(1.0) / 2.0;
    let scaled = scaled_terms(&calibration.model, &entry, entry.real_focal_mm / half_short_mm);
    let mut spec = CameraSpec {
        size_px: query.size_px,
        focal_px: [focal_px; 2],
        principal_point_px: Some([0.5 * (width - 1.0), 0.5 * (height - 1.0)]),
        ..CameraSpec::default()
    };
    spec.lens = match (calibration.kind.as_str(), scaled) {
        ("rectilinear", [0.0, k1, 0.0, k2]) => {
            LensSpec { model: LensModel::BrownConrady, coefficients: vec![k1, k2, 0.0, 0.0] }
        }
        ("rectilinear", terms) => {
            let fit = fit::rational(terms, 0.5 * width.hypot(height) / focal_px)
                .ok_or("folds within the picture, so its polynomial is no lens there")?;
            notes.push(format!(
                "ptlens is fitted by a rational Brown-Conrady: the largest error in the picture is {:.1e} px",
                fit.error * focal_px
            ));
            LensSpec { model: LensModel::BrownConrady, coefficients: fit.coefficients.to_vec() }
        }
        ("fisheye", [k2, k3, k4, k5]) => {
            LensSpec { model: LensModel::FTheta, coefficients: vec![1.0, k2, k3, k4, k5] }
        }
        (other, _) => {
            return Err(format!(
                "is of the type `{other}`: rectilinear and fisheye (equidistant) can be imported"
            ));
        }
    };
    let half_short = 0.5 * width.min(height) * pitch_mm / half_short_mm;
    spec.chromatic = tca::chromatic(&calibration.tca, query.focal_mm, half_short);
    match vignetting::of_camera(
        &calibration.vignetting,
        calibration.focal_range_mm,
        query,
        calibration.crop / crop,
    ) {
        Ok(found) => spec.photometric.vignetting = found,
        Err(left_out) => notes.push(left_out),
    }
    notes.extend(left_out(calibration, &entry, crop));
    Ok(LensfunCamera { spec, notes })
}

/// Factors of r, r^2, r^3, r^4 in `Rd / Ru - 1`, in units of the focal length.
fn scaled_terms(model: &str, entry: &Entry, h: f64) -> [f64; 4] {
    let [a, b, c] = entry.terms;
    let d = centre_scale(model, entry.terms);
    match model {
        "poly3" => [0.0, a * h.powi(2) / d.powi(3), 0.0, 0.0],
        "poly5" => [0.0, a * h.powi(2), 0.0, b * h.powi(4)],
        _ => [c * h / d.powi(2), b * h.powi(2) / d.powi(3), a * h.powi(3) / d.powi(4), 0.0],
    }
}

fn left_out(calibration: &Calibration, entry: &Entry, crop: f64) -> Vec<String> {
    let mut notes = vec![format!(
        "{}, {} at {} mm: the focal length of the picture's centre is {} mm, the crop factor {crop}, calibrated at {}",
        calibration.name,
        calibration.model,
        entry.focal_mm,
        shortest(entry.real_focal_mm, 1e-4),
        calibration.crop
    )];
    let parts = [(calibration.has_other_tca, "tca"), (calibration.has_other_vignetting, "vignetting")];
    let parts: Vec<&str> = parts.into_iter().filter(|(has, _)| *has).map(|(_, name)| name).collect();
    if !parts.is_empty() {
        notes.push(format!("not applied: {} of this lens", parts.join(", ")));
    }
    notes.push(
        "the file has no principal point, frame rate or shutter: the centre, 30 fps, a global shutter"
            .to_owned(),
    );
    notes
}

#[cfg(test)]
mod tests;
