#![allow(clippy::unwrap_used)]

use glam::{DVec2, DVec3};

use super::*;
use crate::lens::{LensModel, tests::gallery};

/// Distorted points all over a square, beyond the fold of some lenses and beside the rectangle that is prepared.
fn points(reach: f64) -> Vec<DVec2> {
    let side = 79;
    let at = |k: usize| DVec2::new((k % side) as f64, (k / side) as f64) * (2.2 * reach / 78.0) - 1.1 * reach;
    (0..side * side).map(at).collect()
}

/// Solutions of blocks; `None` where a single point has to be asked.
fn solved(lens: &Lens, points: &[DVec2], reach: f64, is_ray: bool) -> Vec<Option<DVec3>> {
    let bulk = Bulk::new(lens, DVec2::splat(-reach), DVec2::splat(reach));
    let mut block = Block::default();
    let mut all = Vec::new();
    for points in points.chunks(BLOCK) {
        for (i, point) in points.iter().enumerate() {
            (block.image[0][i], block.image[1][i]) = (point.x, point.y);
        }
        if is_ray {
            bulk.rays(lens, &mut block)
        } else {
            bulk.ideal(lens, &mut block)
        }
        let [x, y, z] = &block.solved;
        let found = |i: usize| DVec3::new(x[i], y[i], if is_ray { z[i] } else { 1.0 });
        all.extend((0..points.len()).map(|i| Some(found(i)).filter(|found| !found.x.is_nan())));
    }
    all
}

/// Change of the image between two rays, to first order: what the Jacobian leaves of it.
fn apart(lens: &Lens, one: DVec3, other: DVec3) -> f64 {
    let [x, y, z] = lens.gradient(other);
    let step = one - other;
    (x * step.x + y * step.y + z * step.z).length()
}

#[test]
fn many_points_are_solved_as_single_ones() {
    let reach = 0.9;
    let points = points(reach);
    for (name, lens) in gallery() {
        for is_ray in [false, true] {
            let mut unsolved = 0;
            for (point, many) in points.iter().zip(solved(&lens, &points, reach, is_ray)) {
                let single =
                    if is_ray { lens.ray(*point) } else { lens.undistort(*point).map(|uv| uv.extend(1.0)) };
                let Some(many) = many else {
                    unsolved += usize::from(single.is_some() && point.abs().max_element() < reach);
                    continue;
                };
                let single =
                    single.unwrap_or_else(|| panic!("{name} {point}: {many}, but singly there is none"));
                // Some roundings of a formula; beside folds and poles it magnifies what differs in the last bit.
                let scale = 1.0 + single.length() + point.length();
                assert!(
                    apart(&lens, many, single) < 1e-14 * scale,
                    "{name} {point}: {many}, singly {single}"
                );
                assert!((many - single).length() < 1e-6 * scale, "{name} {point}: {many}, singly {single}");
                assert!(
                    !is_ray || (many.length() - 1.0).abs() < 2e-15,
                    "{name} {point}: {many} is no unit ray"
                );
            }
            let fraction = unsolved as f64 / points.len() as f64;
            let is_bulk = !matches!(
                lens.model(),
                LensModel::Fisheye624 | LensModel::Equirectangular | LensModel::Table
            );
            // Beside folds points are solved singly.
            assert!(!is_bulk || fraction < 0.2, "{name}, rays {is_ray}: {fraction} remain");
            assert!(is_bulk || fraction > 0.5, "{name} is solved in bulk after all: leave it out here");
        }
    }
}

#[test]
fn real_lenses_leave_nothing() {
    for (model, k) in [
        (LensModel::BrownConrady, &[-0.28, 0.07, 6e-4, -4e-4, -0.006][..]),
        (LensModel::BrownConrady, &[-0.28, 0.07, 6e-4, -4e-4, -0.006, 0.01, 0.002, -0.001]),
        (LensModel::KannalaBrandt, &[-0.02, 0.004, -0.003, 5e-4]),
        (
            LensModel::BrownConradyPrism,
            &[-0.28, 0.07, 6e-4, -4e-4, 0.0, 0.0, 0.0, 0.0, 1e-3, -4e-4, 2e-3, 3e-4, 0.01, -0.02],
        ),
        (LensModel::Mei, &[1.2, -0.2, 0.05, 1e-3, -5e-4]),
    ] {
        let lens = Lens::new(model, k).unwrap();
        let reach = if model == LensModel::Mei { 0.4 } else { 0.8 };
        let within: Vec<DVec2> =
            points(reach).into_iter().filter(|at| at.abs().max_element() < reach).collect();
        for is_ray in [false, true] {
            let found = solved(&lens, &within, reach, is_ray);
            let unsolved = found.iter().filter(|found| found.is_none()).count();
            assert!(unsolved * 1000 <= found.len(), "{model:?}: {unsolved} of {}", found.len());
        }
    }
}

#[test]
fn what_is_not_finite_is_not_solved() {
    for (name, lens) in gallery() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
            let points = [DVec2::new(bad, 0.1), DVec2::new(0.1, bad)];
            for is_ray in [false, true] {
                let found = solved(&lens, &points, 0.5, is_ray);
                let is_there = matches!(lens, Lens::Pinhole(_)) && bad == 1e300;
                assert!(is_there || found.iter().all(Option::is_none), "{name}: {found:?}");
            }
        }
    }
}
