//! Spline and area reads against their definitions.

use bytemuck::Zeroable;
use camsim_core::temporal::ColorImage;
use glam::{DVec2, DVec3};

use super::*;
use crate::simd::vectors::widest;

#[test]
fn spline_equals_its_five_bilinear_reads() {
    let (width, height, stride) = (70, 45, 75);
    let value = |i: usize| half::f16::from_f32((i as f32 * 0.618_034).fract() + 0.1).to_bits();
    let color: Vec<u16> = (0..CHANNELS * stride * height).map(value).collect();
    let ideal = IdealTexels { color: &color, color_stride: stride as u32, depth: &[], depth_stride: 0 };
    let frame = FrameUniforms { ideal_size_px: [width, height as u32], ..Zeroable::zeroed() };
    let part = |i: usize, step: f32| (i as f32 * step).fract();
    let (mut inside_count, mut outside_count) = (0, 0);
    for block in 0..400 {
        // Positions inside and outside of the frame.
        let index = |i: usize| block * LANES + i;
        let position_px = Lanes2 {
            x: per_lane(|i| {
                if block.is_multiple_of(2) {
                    1.0 + 66.9 * part(index(i), 0.754_878)
                } else {
                    -4.0 + 78.0 * part(index(i), 0.754_878)
                }
            }),
            y: per_lane(|i| {
                if block.is_multiple_of(2) {
                    1.0 + 41.9 * part(index(i), 0.569_84)
                } else {
                    -4.0 + 53.0 * part(index(i), 0.569_84)
                }
            }),
        };
        let softness =
            Lanes2 { x: per_lane(|i| part(index(i), 0.324_718)), y: per_lane(|i| part(index(i), 0.220_744)) };
        let spline = BlockSpline::texel_neighbourhoods(&position_px, &softness);
        let is_taken = |i: usize| !(block + i).is_multiple_of(7);
        let (mut found, mut exact) = ([[0.0; 8]; LANES], [[0.0; 8]; LANES]);
        widest!(vectors => {
            ideal.add_spline(vectors, &frame, &spline, is_taken, &mut found);
            for read in SPLINE_READS {
                let (position_px, weight) = spline.read(read);
                ideal.add_color(vectors, &frame, &position_px, is_taken, |i| weight[i], &mut exact);
            }
        });
        for i in 0..LANES {
            for k in 0..CHANNELS {
                let [found, exact] = [found[i], exact[i]].map(|of| of[k] + of[k + CHANNELS]);
                // Some twenty roundings of numbers of about 1.
                assert!((found - exact).abs() < 2e-6, "{block} {i} {k}: {found} {exact}");
                assert_eq!(found == 0.0, !is_taken(i));
            }
        }
        let is_inside_frame = (0..LANES).all(|i| {
            position_px.x[i] >= 1.0
                && position_px.x[i] < 68.0
                && position_px.y[i] >= 1.0
                && position_px.y[i] < 43.0
        });
        (inside_count, outside_count) = if is_inside_frame {
            (inside_count + 1, outside_count)
        } else {
            (inside_count, outside_count + 1)
        };
    }
    assert!(inside_count >= 200 && outside_count >= 100, "{inside_count} {outside_count}");
}

#[test]
fn area_means_equal_their_twin_inside_and_outside_of_the_frame() {
    let (width, height, stride) = (70, 45, 75);
    let number = |i: usize| half::f16::from_f32((i as f32 * 0.618_034).fract());
    let color: Vec<u16> = (0..CHANNELS * stride * height).map(|i| number(i).to_bits()).collect();
    let ideal = IdealTexels { color: &color, color_stride: stride as u32, depth: &[], depth_stride: 0 };
    let frame = FrameUniforms { ideal_size_px: [width, height as u32], ..Zeroable::zeroed() };
    let of_row = |y: usize| {
        (CHANNELS * stride * y..CHANNELS * (stride * y + width as usize)).map(|i| number(i).to_f32())
    };
    let rgba: Vec<f32> = (0..height).flat_map(of_row).collect();
    let twin = ColorImage { size_px: frame.ideal_size_px, rgba: &rgba };
    let part = |i: usize, step: f32| (i as f32 * step).fract();
    // One to six texels along each axis; pixels of a block alike, or each with sides of its own.
    for (block, most) in (0..600).flat_map(|block| [1.0, 1.9, 2.9, 3.9, 5.0].map(|most| (block, most))) {
        let index = |i: usize| block * LANES + i;
        let is_inside_frame = !block.is_multiple_of(3);
        let clamped = |i: usize, step: f32, size: f32| {
            if is_inside_frame {
                4.0 + (size - 9.0) * part(index(i), step)
            } else {
                -6.0 + (size + 12.0) * part(index(i), step)
            }
        };
        let position_px = Lanes2 {
            x: per_lane(|i| clamped(i, 0.754_878, 70.0)),
            y: per_lane(|i| clamped(i, 0.569_84, 45.0)),
        };
        let side = |i: usize, step: f32| {
            1.0 + (most - 1.0)
                * if block.is_multiple_of(2) { part(block, step) } else { part(index(i), step) }
        };
        let sides_px = Lanes2 { x: per_lane(|i| side(i, 0.324_718)), y: per_lane(|i| side(i, 0.220_744)) };
        let is_taken = |i: usize| !(block + i).is_multiple_of(7);
        let mut found = [[0.0; 8]; LANES];
        widest!(vectors => {
            ideal.add_area(vectors, &frame, &position_px, &sides_px, is_taken, &mut found);
        });
        for i in 0..LANES {
            let [clamped, sides] =
                [&position_px, &sides_px].map(|of| DVec2::new(f64::from(of.x[i]), f64::from(of.y[i])));
            let exact = if is_taken(i) { twin.over_area(clamped, sides) } else { DVec3::ZERO };
            let found =
                DVec3::from_array([0, 1, 2].map(|k: usize| f64::from(found[i][k] + found[i][k + CHANNELS])));
            // Positions up to 70 are known to the last bit, and weights likewise.
            assert!(found.distance(exact) < 2e-5, "{block} {i}, {clamped}, {sides}: {found} {exact}");
        }
    }
}
