//! The stages of the temporal inverse one by one.

use glam::DQuat;

use super::*;
use crate::noise::pcg4d;

/// A tilted plane `n . x = 1` in key coordinates has inverse depth `n . (x/z)`, which is linear over the
/// image.
fn plane_image(ideal: &IdealGeometry, normal: DVec3) -> Vec<f32> {
    let [w, h] = ideal.size_px;
    (0..w * h)
        .map(|i| {
            let px = DVec2::new(f64::from(i % w), f64::from(i / w));
            normal.dot(((px - ideal.principal_px) / ideal.focal_px).extend(1.0)) as f32
        })
        .collect()
}

#[test]
fn parabola_through_three_values() {
    let parabola = |fraction: f64| 3.0 - 2.0 * fraction + 0.7 * fraction * fraction;
    let through = parabola_through([0.0, 0.5, 1.0].map(parabola));
    for fraction in [0.0, 0.2, 0.5, 0.85, 1.0] {
        assert!((through(fraction) - parabola(fraction)).abs() < 1e-14, "{fraction}");
    }
}

#[test]
fn reprojection_on_a_plane_matches_its_homography() {
    let ideal = IdealGeometry {
        size_px: [200, 150],
        focal_px: DVec2::splat(150.0),
        principal_px: DVec2::new(99.5, 74.5),
    };
    let normal = DVec3::new(0.002, -0.003, 0.02);
    let values = plane_image(&ideal, normal);
    let depth = InverseDepthImage { size_px: ideal.size_px, values: &values };
    let rotation = DMat3::from_quat(DQuat::from_euler(glam::EulerRot::ZYX, 0.1, -0.05, 0.07));
    let shift = DVec3::new(0.8, -0.5, 1.1);
    for uv in [DVec2::new(0.0, 0.0), DVec2::new(0.2, -0.15), DVec2::new(-0.25, 0.2)] {
        // x_key = R x + t and n . x_key = 1 give z (n . R d) = 1 - n . t.
        let d = uv.extend(1.0);
        let z = (1.0 - normal.dot(shift)) / normal.dot(rotation * d);
        let exact = ideal.px_from_point(rotation * d * z + shift);
        let key = |plane| KeyDepth { ideal: &ideal, depth: &depth, plane, sky_reach_px: 0.0 };
        let far = key(DVec3::ZERO);
        let source = reproject(uv, (rotation, shift), 12, &far).expect("in view");
        // f32 depth: 6e-8 relative, times about 8 px of parallax.
        assert!(
            (source.position_px - exact).length() < 2e-6 && (source.inverse_depth * z - 1.0).abs() < 1e-6,
            "{source:?} {exact}"
        );
        let two = reproject(uv, (rotation, shift), 2, &far).expect("in view");
        assert!(
            (two.position_px - exact).length() < 0.2,
            "two look-ups: {}",
            (two.position_px - exact).length()
        );
        // With the true plane as the first guess, no iteration is needed.
        let none = reproject(uv, (rotation, shift), 0, &key(normal)).expect("in view");
        assert!(
            (none.position_px - exact).length() < 1e-10,
            "no look-up: {}",
            (none.position_px - exact).length()
        );
        let one = reproject(uv, (rotation, shift), 1, &key(1.1 * normal)).expect("in view");
        assert!(
            (one.position_px - exact).length() < 0.05,
            "a plane that is off by a tenth: {}",
            (one.position_px - exact).length()
        );
    }
}

#[test]
fn depth_is_not_interpolated_across_edges() {
    let values = [0.1_f32, 0.001, 0.1, 0.001];
    let image = InverseDepthImage { size_px: [2, 2], values: &values };
    assert_eq!(image.inverse_depth(DVec2::new(0.4, 0.2)), f64::from(0.1_f32));
    assert_eq!(image.inverse_depth(DVec2::new(0.6, 0.2)), f64::from(0.001_f32));
}

#[test]
fn area_mean_matches_pixel_overlaps() {
    let size_px = [12, 9];
    let value = |x: i64, y: i64| {
        f64::from((pcg4d([x.clamp(0, 11) as u32, y.clamp(0, 8) as u32, 5, 6])[0] >> 8) as f32 / 16_777_216.0)
    };
    let rgba: Vec<f32> = (0..108).flat_map(|i| [value(i % 12, i / 12) as f32, 0.5, 0.25, 1.0]).collect();
    let color = ColorImage { size_px, rgba: &rgba };
    for (position_px, sides_px) in [
        (DVec2::new(5.3, 4.8), DVec2::new(2.3, 3.1)),
        (DVec2::new(5.5, 4.0), DVec2::new(3.0, 1.0)),
        (DVec2::new(0.2, 8.9), DVec2::new(4.7, 2.0)),
        (DVec2::new(-3.0, 14.0), DVec2::new(2.0, 5.0)),
    ] {
        // Overlap of each pixel with the area, computed from the ends of both; the border pixel continues
        // outside.
        let part = |k: usize, px: i64| {
            let [begin, end] = [-0.5, 0.5].map(|half| position_px[k] + half * sides_px[k]);
            ((px as f64 + 0.5).min(end) - (px as f64 - 0.5).max(begin)).max(0.0) / sides_px[k]
        };
        let exact: f64 = (-20..40)
            .flat_map(|y| (-20..40).map(move |x| (x, y)))
            .map(|(x, y)| part(0, x) * part(1, y) * value(x, y))
            .sum();
        let mean = color.over_area(position_px, sides_px);
        assert!(
            (mean - DVec3::new(exact, 0.5, 0.25)).abs().max_element() < 1e-7,
            "{position_px} {sides_px}: {mean} {exact}"
        );
        let one = color.over_area(position_px, DVec2::ONE);
        assert!(one.distance(color.sample(position_px)) < 1e-12, "{position_px}: {one}");
    }
}

#[test]
fn spline_interpolates_pixels_and_beats_bilinear_on_a_wave() {
    let wave = |x: f64, y: f64| 0.5 + 0.25 * (1.3 * x).sin() + 0.2 * (1.1 * y + 0.4).sin();
    let rgba: Vec<f32> = (0..32 * 32)
        .flat_map(|i| [wave(f64::from(i % 32), f64::from(i / 32)) as f32, 0.5, 0.0, 1.0])
        .collect();
    let color = ColorImage { size_px: [32, 32], rgba: &rgba };
    assert!(
        color.spline(DVec2::new(7.0, 9.0), DVec2::ZERO).distance(color.sample(DVec2::new(7.0, 9.0))) < 1e-12
    );
    let (mut spline, mut bilinear) = (0.0, 0.0);
    for k in 0..200 {
        let position_px = DVec2::new(8.0 + 0.077 * f64::from(k), 20.0 - 0.053 * f64::from(k));
        let exact = wave(position_px.x, position_px.y);
        spline += (color.spline(position_px, DVec2::ZERO).x - exact).powi(2);
        bilinear += (color.sample(position_px).x - exact).powi(2);
        assert!((color.spline(position_px, DVec2::splat(0.3)).y - 0.5).abs() < 1e-12, "a constant stays");
    }
    assert!(spline < 0.1 * bilinear, "{spline:.2e} {bilinear:.2e}");
}

#[test]
fn gathering_a_ramp_gives_its_value_at_the_mean_position() {
    let size_px = [64, 8];
    let rgba: Vec<f32> = (0..64 * 8).flat_map(|i| [(i % 64) as f32, 1.0, 0.0, 1.0]).collect();
    let color = ColorImage { size_px, rgba: &rgba };
    let area = Footprint::new(DVec2::new(2.3, 0.0), DVec2::new(0.0, 1.0), TapStage::Grid { most: 4 });
    assert_eq!(area.taps, [3, 1]);
    let nodes = [DVec2::new(10.0, 3.0), DVec2::new(20.0, 3.0), DVec2::new(40.0, 3.0)];
    let mean = gather(&nodes, PathStage::Straight, &area, &color, 2.0, 256);
    // Both segments last equally long: (15 + 30) / 2. The cyclic order of the taps leaves a bias of at
    // most half a tap divided by the number of samples.
    assert!((mean.x - 22.5).abs() < 0.05 && (mean.y - 1.0).abs() < 1e-12, "{mean}");
}
