//! Fold and validity of every calibration set against an independent scan: the formulas are written out
//! again, derivatives are finite differences, and the pre-images of a pixel are counted by the winding number
//! of the border's image.
#![allow(clippy::unwrap_used)]

use std::f64::consts::{PI, TAU};

use camsim_core::camera::CameraModel;
use camsim_core::lens::LensModel;
use glam::DVec2;
use polygon::winding;
use rayon::prelude::*;

#[path = "lens_models/polygon.rs"]
mod polygon;

const RAYS: usize = 360;
const STEPS: usize = 1500;
/// Largest distance of a chord of the border's image from the curve (360 rays, 1000 px). Pixels nearer to the
/// border are not tested.
const UNJUDGED_PX: f64 = 0.1;

struct Set {
    name: &'static str,
    model: LensModel,
    k: Vec<f64>,
    camera: CameraModel,
}

fn sets() -> Vec<Set> {
    let text: &'static str = include_str!("../../../tests/data/lens_sets.csv");
    let set = |line: &'static str| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |i: usize| cells[i].parse::<f64>().unwrap();
        let model =
            if cells[1] == "brown-conrady" { LensModel::BrownConrady } else { LensModel::KannalaBrandt };
        let mut k: Vec<f64> = cells[8].split_whitespace().map(|k| k.parse().unwrap()).collect();
        let size_px = [number(2) as u32, number(3) as u32];
        let camera =
            CameraModel::new(size_px, [number(4), number(5)], Some([number(6), number(7)]), model, &k)
                .unwrap();
        k.resize(8, 0.0);
        Set { name: cells[0], model, k, camera }
    };
    text.lines().skip(1).map(set).collect()
}

impl Set {
    fn forward(&self, p: DVec2) -> DVec2 {
        let k = &self.k;
        if self.model == LensModel::KannalaBrandt {
            let r = p.x.hypot(p.y);
            if r == 0.0 {
                return p;
            }
            let t = r.atan2(1.0);
            return p * ((t + k[0] * t.powi(3) + k[1] * t.powi(5) + k[2] * t.powi(7) + k[3] * t.powi(9)) / r);
        }
        let r = p.x.hypot(p.y);
        let above = 1.0 + k[0] * r.powi(2) + k[1] * r.powi(4) + k[4] * r.powi(6);
        let radial = above / self.below(r);
        DVec2::new(
            p.x * radial + 2.0 * k[2] * p.x * p.y + k[3] * (r * r + 2.0 * p.x * p.x),
            p.y * radial + k[2] * (r * r + 2.0 * p.y * p.y) + 2.0 * k[3] * p.x * p.y,
        )
    }

    /// The denominator of a Brown-Conrady lens.
    fn below(&self, r: f64) -> f64 {
        let k = &self.k;
        1.0 + k[5] * r.powi(2) + k[6] * r.powi(4) + k[7] * r.powi(6)
    }

    /// Beyond a pole the determinant may be positive again.
    fn is_regular(&self, p: DVec2) -> bool {
        !self.has_pole(p.length()) && self.determinant(p) > 0.0
    }

    fn has_pole(&self, r: f64) -> bool {
        self.model == LensModel::BrownConrady && self.below(r) <= 0.0
    }

    fn determinant(&self, p: DVec2) -> f64 {
        let h = 1e-6 * (1.0 + p.length());
        let (e, n) = (DVec2::new(h, 0.0), DVec2::new(0.0, h));
        let (a, b) = (
            (self.forward(p + e) - self.forward(p - e)) / (2.0 * h),
            (self.forward(p + n) - self.forward(p - n)) / (2.0 * h),
        );
        a.perp_dot(b)
    }

    /// First radius along a ray at which the lens is not regular, at most that of 89 degrees.
    fn fold_radius(&self, phi: f64) -> f64 {
        let ray = DVec2::from_angle(phi);
        let radius = |step: usize| (step as f64 / STEPS as f64 * 89.0 * PI / 180.0).tan();
        let Some(first) = (1..=STEPS).find(|step| !self.is_regular(ray * radius(*step))) else {
            return radius(STEPS);
        };
        let (mut good, mut bad) = (radius(first - 1), radius(first));
        for _ in 0..40 {
            let middle = 0.5 * (good + bad);
            *(if self.is_regular(ray * middle) { &mut good } else { &mut bad }) = middle;
        }
        0.5 * (good + bad)
    }
}

#[test]
fn folds_and_valid_pixels_of_every_set() {
    let judged: usize = sets().par_iter().map(judge).sum();
    eprintln!("{judged} pixels judged");
    assert!(judged > 100_000, "only {judged} pixels were judged");
}

/// Tests about a thousand pixels of one camera.
fn judge(set: &Set) -> usize {
    let (name, camera) = (set.name, &set.camera);
    let fold: Vec<f64> = (0..RAYS).map(|ray| set.fold_radius(ray as f64 * TAU / RAYS as f64)).collect();
    for (ray, radius) in fold.iter().enumerate() {
        let phi = ray as f64 * TAU / RAYS as f64;
        let error = (camera.lens.fold_radius(phi) / radius - 1.0).abs();
        // Finite differences of step 1e-6 near a pole or a flat fold are accurate to 1e-4.
        assert!(
            error < 1e-4,
            "{name}, ray {ray}: fold at {}, the scan says {radius}",
            camera.lens.fold_radius(phi)
        );
    }
    // 0.1 % inside, which moves the image by 1e-6 at a fold. At a pole it may be flung out as late as 1e-5 before;
    // finite differences see the pole 2e-6 before.
    let border: Vec<DVec2> = fold
        .iter()
        .enumerate()
        .map(|(ray, radius)| {
            let inside = if set.has_pole(radius * (1.0 + 1e-5)) { 1e-5 } else { 1e-3 };
            let image =
                set.forward(DVec2::from_angle(ray as f64 * TAU / RAYS as f64) * (radius * (1.0 - inside)));
            image * camera.focal_px + camera.principal_point_px
        })
        .collect();
    let mut judged = 0;
    for row in 0..32 {
        for column in 0..32 {
            let fraction = DVec2::new(f64::from(column), f64::from(row)) / 31.0;
            let pixel =
                fraction * DVec2::new(f64::from(camera.size_px[0] - 1), f64::from(camera.size_px[1] - 1));
            let answer = camera.unproject(pixel);
            if let Some(ideal) = answer {
                let image = set.forward(ideal) * camera.focal_px + camera.principal_point_px;
                assert!((image - pixel).length() < 1e-4, "{name} {pixel}: {ideal} is imaged at {image}");
                let ray = ideal.y.atan2(ideal.x).rem_euclid(TAU) / TAU * RAYS as f64;
                let (here, next) = (fold[ray as usize % RAYS], fold[(ray as usize + 1) % RAYS]);
                assert!(
                    ideal.length() < 1.0001 * here.max(next),
                    "{name} {pixel}: {ideal} lies beyond the fold"
                );
            }
            let (turns, distance) = winding(&border, pixel);
            if distance > UNJUDGED_PX {
                assert_eq!(
                    answer.is_some(),
                    turns > 0,
                    "{name} {pixel}: {turns} pre-images, {distance} px from the border: {answer:?}"
                );
                judged += 1;
            }
        }
    }
    judged
}
