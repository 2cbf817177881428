use std::collections::HashSet;

use glam::DVec3;

use super::*;

fn rays() -> Vec<DVec3> {
    (0..RAYS).map(ray).map(|(position, phase)| position.extend(phase)).collect()
}

#[test]
fn rays_are_a_net() {
    for a in 0..=6 {
        for b in 0..=6 - a {
            let counts = DVec3::new(f64::from(1 << a), f64::from(1 << b), f64::from(1 << (6 - a - b)));
            let boxes: HashSet<[i64; 3]> = rays()
                .iter()
                .map(|ray| ((*ray + 0.5) * counts).to_array().map(|x| x.floor() as i64))
                .collect();
            assert_eq!(boxes.len(), 64, "{counts}");
        }
    }
}

/// Fraction of the cube |x|, |y|, |z| <= 1/2 with normal . (x, y, z) <= c, for a normal without zeros: by
/// inclusion and exclusion of corners.
fn fraction(normal: DVec3, c: f64) -> f64 {
    let sides = normal.abs();
    let shifted = c + 0.5 * sides.element_sum();
    let corners = (0..8_u32).map(|corner| {
        let passed: f64 = (0..3).filter(|k| corner >> k & 1 == 1).map(|k| sides[k]).sum();
        let sign = if corner.count_ones() % 2 == 0 { 1.0 } else { -1.0 };
        sign * (shifted - passed).max(0.0).powi(3)
    });
    corners.sum::<f64>() / (6.0 * sides.x * sides.y * sides.z)
}

#[test]
fn a_straight_border_at_any_speed_has_the_stated_error() {
    let rays = rays();
    let (mut most, mut squares, mut count) = (0.0_f64, 0.0, 0.0);
    for i in 0..60 {
        // Not along an axis, where a volume of the formula has a side of 0.
        let angle = 0.003 + f64::from(i) * std::f64::consts::TAU / 60.0;
        for speed_px in [1e-3, 0.3, -0.7, 1.0, -2.0, 5.0, 20.0] {
            let normal = DVec3::new(angle.cos(), angle.sin(), speed_px);
            for j in 0..40 {
                let c = (f64::from(j) / 39.0 - 0.5) * normal.abs().element_sum();
                let found = rays.iter().filter(|ray| normal.dot(**ray) <= c).count() as f64 / 64.0;
                let off = found - fraction(normal, c);
                (most, squares, count) = (most.max(off.abs()), squares + off * off, count + 1.0);
            }
        }
    }
    let rms = (squares / count).sqrt();
    assert!(most < 0.1 && rms < 0.016, "{most} {rms}");
}
