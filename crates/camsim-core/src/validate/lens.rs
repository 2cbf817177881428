//! Checks of the coefficients of a lens.

use std::ops::RangeBounds;

use super::Check;
use crate::{lens::ModelFacts, scenario::LensModel};

/// Polynomials of pixels have a first term of hundreds, those of the focal length one of about 1.
const PIXELS_FROM: f64 = 30.0;

/// Checks number, order and ranges: one problem of a list.
pub(super) fn check_coefficients(
    check: &mut Check,
    key: &str,
    model: LensModel,
    focal_px: [f64; 2],
    coefficients: &[f64],
) {
    let before = check.problems.len();
    check_count(check, key, model, coefficients);
    // Others are named already.
    let is_finite = coefficients.iter().all(|k| k.is_finite());
    if is_finite && check.problems.len() == before {
        let problem = out_of_range(model, coefficients).or_else(|| of_pixels(model, focal_px, coefficients));
        problem.into_iter().for_each(|problem| check.fail(key, problem));
    }
}

fn check_count(check: &mut Check, key: &str, model: LensModel, coefficients: &[f64]) {
    let facts = ModelFacts::of(model);
    let (most, given) = (facts.coefficients.len(), coefficients.len());
    let order = format!("the order is {}", facts.order());
    let values = if given == 1 { "value" } else { "values" };
    check.require(given <= most, key, || match most {
        0 => format!("has {given} {values}, but model \"{}\" takes none; {}", model.name(), facts.fix),
        _ => format!("has {given} {values} where at most {most} fit; {order}; {}", facts.fix),
    });
    // Three coefficients are what other programs call k1 k2 k3.
    let radial_alone = model == LensModel::BrownConrady && given == 3;
    check.require(!radial_alone, key, || {
        format!("has 3 values; {order}: write k1, k2, 0, 0, k3 if they are radial, k1, k2, p1, p2 if not")
    });
    check.require(model != LensModel::DoubleSphere || given != 1, key, || {
        format!("has 1 value where 2 are needed; {order}")
    });
}

/// The first coefficient that the model is not defined for.
fn out_of_range(model: LensModel, coefficients: &[f64]) -> Option<String> {
    let facts = ModelFacts::of(model);
    facts.ranges.iter().find_map(|(name, range, text)| {
        let value = coefficients.get(facts.coefficients.iter().position(|known| known == name)?)?;
        (!range.contains(value)).then(|| format!("has {name} = {value}; {name} must be {text}"))
    })
}

/// A polynomial of `f-theta` that seems to be one of pixels, as NVIDIA's are, or that does not begin by growing.
fn of_pixels(model: LensModel, focal_px: [f64; 2], coefficients: &[f64]) -> Option<String> {
    let is_inverse = match model {
        LensModel::FTheta => false,
        LensModel::FThetaInverse => true,
        _ => return None,
    };
    let k1 = *coefficients.first()?;
    if k1 <= 0.0 {
        return Some(format!("has k1 = {k1}; k1 must be above 0"));
    }
    let is_of_pixels = if is_inverse { k1 < PIXELS_FROM.recip() } else { k1 > PIXELS_FROM };
    // A polynomial of pixels is right where a pixel is the focal length.
    (is_of_pixels && focal_px.iter().all(|focal| *focal > PIXELS_FROM)).then(|| match is_inverse {
        true => format!(
            "has k1 = {k1}: these look like terms of pixels. The radius is in units of the focal length: multiply the \
             term of power n by focal_px to the power n"
        ),
        false => format!(
            "has k1 = {k1}: these look like pixels. The radius is in units of the focal length: divide k1 to k5 by \
             focal_px"
        ),
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::{
        scenario::{CameraSpec, LensSpec},
        validate::validate_camera,
    };

    fn problems(model: LensModel, coefficients: &[f64]) -> Vec<String> {
        let lens = LensSpec { model, coefficients: coefficients.to_vec() };
        let camera = CameraSpec { lens, ..CameraSpec::default() };
        validate_camera(&camera).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn a_value_that_the_model_is_not_defined_for_is_named_with_its_range() {
        use LensModel::{
            BrownConradyPrism, Division, DoubleSphere, Eucm, FTheta, FThetaInverse, Fov, Mei, Ucm,
        };
        let tilted = |tau_x: f64, tau_y: f64| [[0.0; 12].as_slice(), &[tau_x, tau_y]].concat();
        let cases: [(LensModel, Vec<f64>, &str); 17] = [
            (Eucm, vec![0.6, -1.0], "has beta = -1; beta must be above 0"),
            (Eucm, vec![1.1, 1.0], "has alpha = 1.1; alpha must be 0 to 1"),
            (Eucm, vec![f64::NAN, -1.0], "must be finite"),
            (DoubleSphere, vec![-0.2, 1.5], "has alpha = 1.5; alpha must be 0 to 1"),
            (DoubleSphere, vec![-1.0, 0.5], "has xi = -1; xi must be above -1"),
            (DoubleSphere, vec![-0.2], "has 1 value where 2 are needed; the order is xi alpha"),
            (Ucm, vec![1.2], "has alpha = 1.2; alpha must be 0 to 1"),
            (Mei, vec![-2.0, 0.1], "has xi = -2; xi must be above -1"),
            (Fov, vec![53.0], "has omega = 53; omega must be below pi: it is the field of view in radians"),
            (Division, vec![300.0], "has k = 300; k must be -100 to 100"),
            (BrownConradyPrism, tilted(2.0, 1.0), "has tau_x = 2; tau_x must be -pi/4 to pi/4"),
            (BrownConradyPrism, tilted(0.1, 1.0), "has tau_y = 1; tau_y must be -pi/4 to pi/4"),
            (FTheta, vec![310.0, 1.2, -4.0], "has k1 = 310: these look like pixels"),
            (FTheta, vec![-1.0], "has k1 = -1; k1 must be above 0"),
            (FThetaInverse, vec![0.003], "has k1 = 0.003: these look like terms of pixels"),
            (LensModel::Equirectangular, vec![1.0], "has 1 value, but model \"equirectangular\" takes none"),
            (Ucm, vec![0.5, 1.0], "has 2 values where at most 1 fit"),
        ];
        for (model, coefficients, expected) in cases {
            let problems = problems(model, &coefficients);
            assert_eq!(problems.len(), 1, "{model:?} {coefficients:?}: {problems:?}");
            let start = format!("camera.lens.coefficients: {expected}");
            assert!(problems[0].starts_with(&start), "{model:?} {coefficients:?}: {problems:?}");
        }
    }

    #[test]
    fn a_polynomial_of_pixels_fits_a_focal_length_of_a_pixel() {
        let lens = LensSpec { model: LensModel::FTheta, coefficients: vec![310.0, 1.2, -4.0] };
        let camera = CameraSpec { lens, focal_px: [1.0, 1.0], ..CameraSpec::default() };
        assert_eq!(validate_camera(&camera), []);
    }

    #[test]
    fn published_calibrations_are_in_range() {
        let mut count = 0;
        for name in ["lens_models.csv", "lens_sets.csv"] {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data").join(name);
            let table = std::fs::read_to_string(&path).expect("a table");
            for line in table.lines().skip(1) {
                let cells: Vec<&str> = line.split(',').collect();
                let number = |text: &str| text.parse::<f64>().expect(line);
                let model = LensModel::named(cells[1]);
                let lens = LensSpec {
                    model: model.expect(line),
                    coefficients: cells[8].split_whitespace().map(number).collect(),
                };
                let focal_px = [number(cells[4]), number(cells[5])];
                let camera = CameraSpec { lens, focal_px, ..CameraSpec::default() };
                assert_eq!(validate_camera(&camera), [], "{line}");
                count += 1;
            }
        }
        assert!(count > 100, "{count} calibrations");
    }
}
