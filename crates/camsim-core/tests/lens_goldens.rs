//! The lens models against values of OpenCV (forward) and of a brute-force search (inverse), from
//! scripts/goldens/lens_opencv.py.
#![allow(clippy::unwrap_used)]

use std::collections::HashMap;

use camsim_core::lens::{Lens, LensModel};
use glam::DVec2;

/// Tolerance between two f64 evaluations of the same formula, relative beyond 1.
const FORWARD_TOLERANCE: f64 = 1e-9;
/// Tolerance of the search, which stops at a residual of 1e-11; near a fold it is magnified 1e3 times.
const INVERSE_TOLERANCE: f64 = 1e-8;

fn lenses() -> HashMap<&'static str, Lens> {
    let text = include_str!("../../../tests/data/lens_sets.csv");
    let lens = |line: &'static str| {
        let cells: Vec<&str> = line.split(',').collect();
        let model = match cells[1] {
            "brown-conrady" => LensModel::BrownConrady,
            "kannala-brandt" => LensModel::KannalaBrandt,
            other => panic!("unknown model {other}"),
        };
        let coefficients: Vec<f64> = cells[8].split_whitespace().map(|k| k.parse().unwrap()).collect();
        (cells[0], Lens::new(model, &coefficients).unwrap())
    };
    text.lines().skip(1).map(lens).collect()
}

fn rows(text: &str) -> impl Iterator<Item = (&str, Vec<Option<f64>>)> {
    text.lines().skip(1).map(|line| {
        let mut cells = line.split(',');
        (cells.next().unwrap(), cells.map(|cell| cell.parse().ok()).collect())
    })
}

#[test]
fn forward_agrees_with_opencv() {
    let lenses = lenses();
    let mut checked = 0;
    for (name, cells) in rows(include_str!("../../../tests/data/lens_opencv_forward.csv")) {
        let [u, v, x, y] = [0, 1, 2, 3].map(|i| cells[i].unwrap());
        let (distorted, expected) = (lenses[name].distort(DVec2::new(u, v)), DVec2::new(x, y));
        let error = (distorted - expected).length() / expected.length().max(1.0);
        assert!(error < FORWARD_TOLERANCE, "{name} at ({u}, {v}): {distorted}, OpenCV says {expected}");
        checked += 1;
    }
    assert!(checked >= 800, "only {checked} points in the golden file");
}

#[test]
fn inverse_agrees_with_a_brute_force_search() {
    let lenses = lenses();
    let (mut found, mut refused) = (0, 0);
    for (name, cells) in rows(include_str!("../../../tests/data/lens_inverse.csv")) {
        let distorted = DVec2::new(cells[0].unwrap(), cells[1].unwrap());
        let answer = lenses[name].undistort(distorted);
        match (cells[4] == Some(1.0), answer) {
            (true, Some(ideal)) => {
                let expected = DVec2::new(cells[2].unwrap(), cells[3].unwrap());
                let error = (ideal - expected).length() / expected.length_squared().max(1.0);
                assert!(
                    error < INVERSE_TOLERANCE,
                    "{name} at {distorted}: {ideal}, the search found {expected}"
                );
                found += 1;
            }
            (false, None) => refused += 1,
            (true, None) => panic!("{name} at {distorted}: no answer, but the search found one"),
            (false, Some(ideal)) => panic!("{name} at {distorted}: false answer {ideal}"),
        }
    }
    assert!(found > 800 && refused > 50, "only {found} + {refused} points in the golden file");
}
