//! Lens models by the names that calibration files and other programs give them.

use super::{LensModel, ModelFacts};

/// A lens as a file names it, in camsim's terms.
#[derive(Clone, Debug, PartialEq)]
pub struct ForeignLens {
    /// Model.
    pub model: LensModel,
    /// Coefficients in the model's order.
    pub coefficients: Vec<f64>,
}

/// A lens that camsim does not have, or one with the wrong number of parameters.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ForeignLensError {
    /// No such model.
    #[error("is `{0}`, which is not a known lens model")]
    Unknown(String),
    /// Wrong number of parameters.
    #[error("has {got} parameters where `{name}` has {wanted}")]
    Count {
        /// The model's name in the file.
        name: String,
        /// What it should have.
        wanted: String,
        /// Number of parameters given.
        got: usize,
    },
}

/// Model and coefficients of a lens by its name in a calibration file, in any spelling (`radtan`,
/// `RAD_TAN_THIN_PRISM_FISHEYE`, `double sphere`). The parameters are those beside focal length and principal
/// point, in the order of the model's authority: `xi alpha` (double sphere), `alpha beta` (EUCM), `xi k1 k2 p1 p2`
/// (omni, MEI), OpenCV's order (radial-tangential).
pub fn foreign_lens(name: &str, parameters: &[f64]) -> Result<ForeignLens, ForeignLensError> {
    let model = foreign_model(name).ok_or_else(|| ForeignLensError::Unknown(name.to_owned()))?;
    let counts = ModelFacts::of(model).foreign_counts;
    // OpenCV names all its models alike: the thin prism shows in the count.
    let is_prism = model == LensModel::BrownConrady && [12, 14].contains(&parameters.len());
    if is_prism {
        let is_used = parameters[8..].iter().any(|k| *k != 0.0);
        let model = if is_used { LensModel::BrownConradyPrism } else { LensModel::BrownConrady };
        let coefficients = if is_used { parameters } else { &parameters[..8] };
        return Ok(ForeignLens { model, coefficients: coefficients.to_vec() });
    }
    if !counts.contains(&parameters.len()) {
        let wanted: Vec<String> = counts.iter().map(ToString::to_string).collect();
        return Err(ForeignLensError::Count {
            name: name.to_owned(),
            wanted: wanted.join(" or "),
            got: parameters.len(),
        });
    }
    Ok(ForeignLens { model, coefficients: parameters.to_vec() })
}

/// The model that other programs give this name, in any spelling.
#[must_use]
pub fn foreign_model(name: &str) -> Option<LensModel> {
    let plain: String =
        name.chars().filter(char::is_ascii_alphanumeric).map(|c| c.to_ascii_lowercase()).collect();
    LensModel::ALL.iter().copied().find(|model| ModelFacts::of(*model).foreign.contains(&plain.as_str()))
}

/// Focal length in pixels, and the lens, of an f-theta polynomial in pixels (`p[0]` is the constant term, which
/// must be zero): of the angle (`angle_to_pixeldist_poly`), or, if `is_inverse`, of the distance
/// (`pixeldist_to_angle_poly`). `None` for a polynomial that no camera has.
#[must_use]
pub fn foreign_f_theta(
    is_inverse: bool,
    polynomial: &[f64],
    linear_cde: [f64; 3],
    max_angle_rad: f64,
) -> Option<(f64, ForeignLens)> {
    let [constant, first, ..] = *polynomial else { return None };
    let focal_px = if is_inverse { first.recip() } else { first };
    let is_camera = constant == 0.0 && focal_px.is_finite() && focal_px > 0.0 && polynomial.len() <= 6;
    if !is_camera {
        return None;
    }
    let mut coefficients = vec![0.0; 5];
    for (i, term) in polynomial[1..].iter().enumerate() {
        let scale = if is_inverse { focal_px.powi(i as i32 + 1) } else { focal_px.recip() };
        coefficients[i] = term * scale;
    }
    coefficients.extend(linear_cde);
    coefficients.push(max_angle_rad);
    let model = if is_inverse { LensModel::FThetaInverse } else { LensModel::FTheta };
    Some((focal_px, ForeignLens { model, coefficients }))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn names_are_found_in_any_spelling() {
        for (name, parameters, model) in [
            ("ds", &[-0.2, 0.6][..], LensModel::DoubleSphere),
            ("RAD_TAN_THIN_PRISM_FISHEYE", &[0.0; 12], LensModel::Fisheye624),
            ("plumb_bob", &[0.1; 5], LensModel::BrownConrady),
            ("rational_polynomial", &[0.0; 14], LensModel::BrownConrady),
            ("rational_polynomial", &[0.1; 12], LensModel::BrownConradyPrism),
            ("omni-radtan", &[1.2, 0.0, 0.0, 0.0, 0.0], LensModel::Mei),
            ("SIMPLE_DIVISION", &[-0.1], LensModel::Division),
        ] {
            assert_eq!(foreign_lens(name, parameters).unwrap().model, model, "{name}");
        }
        assert!(
            foreign_lens("ds", &[0.1]).unwrap_err().to_string().contains("has 1 parameters where `ds` has 2")
        );
        assert!(foreign_lens("splined_stereographic", &[]).is_err());
    }

    #[test]
    fn f_theta_in_pixels_keeps_its_values() {
        let forward = [0.0, 500.0, -20.0, 3.0, 0.5, -0.1];
        let (focal_px, lens) = foreign_f_theta(false, &forward, [1.0, 0.0, 0.0], 1.2).unwrap();
        let of_lens = crate::lens::Lens::new(lens.model, &lens.coefficients).unwrap();
        let angle: f64 = 0.8;
        let wanted: f64 = (0..6).map(|i| forward[i as usize] * angle.powi(i)).sum();
        let got = of_lens.image(glam::DVec3::new(angle.sin(), 0.0, angle.cos())).x * focal_px;
        assert!((got - wanted).abs() < 1e-9, "{got} {wanted}");
        // The inverse polynomial gives the angle of a distance.
        let inverse = [0.0, 2e-3, 1e-8, -2e-10, 0.0, 1e-16];
        let (focal_px, lens) = foreign_f_theta(true, &inverse, [1.0, 0.0, 0.0], 0.0).unwrap();
        let of_lens = crate::lens::Lens::new(lens.model, &lens.coefficients).unwrap();
        let distance: f64 = 430.0;
        let angle: f64 = (0..6).map(|i| inverse[i as usize] * distance.powi(i)).sum();
        let got = of_lens.image(glam::DVec3::new(0.0, angle.sin(), angle.cos())).y * focal_px;
        assert!((got - distance).abs() < 1e-9, "{got}");
        assert_eq!(foreign_f_theta(false, &[1.0, 500.0], [1.0, 0.0, 0.0], 0.0), None);
    }
}
