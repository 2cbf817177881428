//! Interpolation against OpenCV and against the filters as printed.

use super::{
    golden::{COLORS, MOSAIC},
    *,
};

const BAYER: [Mosaic; 4] = [Mosaic::Rggb, Mosaic::Bggr, Mosaic::Grbg, Mosaic::Gbrg];

fn colors(mosaic: Mosaic, method: Demosaic, [width, height]: [u32; 2], values: &[f32]) -> Vec<[f32; 3]> {
    let planes = Mosaicked::new(mosaic, [width, height], |x, y| values[y * width as usize + x]);
    let (mut candidates, mut out) = (Candidates::new(width as usize), Vec::new());
    for y in 0..height as usize {
        let mut row = vec![[0.0; 3]; width as usize];
        planes.colors(y, method, &mut candidates, &mut row);
        out.extend(row);
    }
    out
}

#[test]
fn bilinear_is_that_of_opencv() {
    let values: Vec<f32> = MOSAIC.iter().map(|&value| f32::from(value)).collect();
    for (mosaic, expected) in &COLORS {
        let found = colors(*mosaic, Demosaic::Bilinear, [8, 6], &values);
        for (i, expected) in expected.chunks_exact(3).enumerate() {
            let (x, y) = (i % 6 + 1, i / 6 + 1);
            let found = found[y * 8 + x];
            assert_eq!(found.map(|value| value as u16), expected, "{mosaic:?} {x} {y}");
        }
    }
}

/// Filters of figure 2 of the paper, in eighths.
const GREEN_AT_RED: [[f32; 5]; 5] = [
    [0.0, 0.0, -1.0, 0.0, 0.0],
    [0.0, 0.0, 2.0, 0.0, 0.0],
    [-1.0, 2.0, 4.0, 2.0, -1.0],
    [0.0, 0.0, 2.0, 0.0, 0.0],
    [0.0, 0.0, -1.0, 0.0, 0.0],
];
const RED_AT_GREEN_IN_RED_ROW: [[f32; 5]; 5] = [
    [0.0, 0.0, 0.5, 0.0, 0.0],
    [0.0, -1.0, 0.0, -1.0, 0.0],
    [-1.0, 4.0, 5.0, 4.0, -1.0],
    [0.0, -1.0, 0.0, -1.0, 0.0],
    [0.0, 0.0, 0.5, 0.0, 0.0],
];
const RED_AT_BLUE: [[f32; 5]; 5] = [
    [0.0, 0.0, -1.5, 0.0, 0.0],
    [0.0, 2.0, 0.0, 2.0, 0.0],
    [-1.5, 0.0, 6.0, 0.0, -1.5],
    [0.0, 2.0, 0.0, 2.0, 0.0],
    [0.0, 0.0, -1.5, 0.0, 0.0],
];

#[test]
fn malvar_is_the_filters_of_the_paper() {
    let [width, height] = [17_usize, 13];
    let values: Vec<f32> = (0..width * height).map(|i| ((i * 7919) % 1009) as f32).collect();
    for mosaic in BAYER {
        let found = colors(mosaic, Demosaic::Malvar, [width as u32, height as u32], &values);
        for (y, x) in (2..height - 2).flat_map(|y| (2..width - 2).map(move |x| (y, x))) {
            let filtered = |filter: &[[f32; 5]; 5], turned: bool| {
                let weight = |i: usize, j: usize| if turned { filter[j][i] } else { filter[i][j] };
                let terms =
                    (0..25).map(|k| weight(k / 5, k % 5) * values[(y + k / 5 - 2) * width + x + k % 5 - 2]);
                terms.sum::<f32>() / 8.0
            };
            let color = |x: usize, y: usize| color_at(mosaic, [x as u32, y as u32]);
            let own = values[y * width + x];
            let green = filtered(&GREEN_AT_RED, false);
            let across = filtered(&RED_AT_BLUE, false);
            let row = filtered(&RED_AT_GREEN_IN_RED_ROW, false);
            let column = filtered(&RED_AT_GREEN_IN_RED_ROW, true);
            let expected = match (color(x, y), color(x + 1, y)) {
                (RED, _) => [own, green, across],
                (BLUE, _) => [across, green, own],
                (_, RED) => [row, own, column],
                _ => [column, own, row],
            };
            let found = found[y * width + x];
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 2e-3), "{mosaic:?} {x} {y}");
        }
    }
}

#[test]
fn even_colours_stay_to_the_border() {
    let level = |color: u8| [0.2, 0.5, 0.7, 0.450_66][color as usize];
    for mosaic in BAYER.into_iter().chain([Mosaic::Rgbw]) {
        for method in [Demosaic::Bilinear, Demosaic::Malvar] {
            let size_px = [9, 8];
            let values: Vec<f32> = (0..72).map(|i| level(color_at(mosaic, [i % 9, i / 9]))).collect();
            for (i, found) in colors(mosaic, method, size_px, &values).into_iter().enumerate() {
                let expected = [0.2, 0.5, 0.7];
                assert!(
                    found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5),
                    "{mosaic:?} {method:?} {i}: {found:?}"
                );
            }
        }
    }
}

#[test]
fn malvar_keeps_more_of_a_picture_than_bilinear() {
    let size_px @ [width, height] = [96_u32, 80];
    // Rings of rising frequency in slightly different colours.
    let scene = |x: u32, y: u32| {
        let radius = f64::from(x).hypot(f64::from(y));
        let wave = 0.5 + 0.4 * (radius * radius * 0.012).cos();
        [0.9, 1.0, 0.8].map(|tint| (tint * wave) as f32)
    };
    let pixels = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let values: Vec<f32> =
        pixels().map(|(x, y)| scene(x, y)[color_at(Mosaic::Rggb, [x, y]) as usize]).collect();
    let error = |method: Demosaic| {
        let found = colors(Mosaic::Rggb, method, size_px, &values);
        let squares = pixels().zip(found).flat_map(|((x, y), found)| {
            let expected = scene(x, y);
            [0, 1, 2].map(|k: usize| f64::from(found[k] - expected[k]).powi(2))
        });
        (squares.sum::<f64>() / f64::from(3 * width * height)).sqrt()
    };
    let [bilinear, malvar] = [Demosaic::Bilinear, Demosaic::Malvar].map(error);
    assert!(malvar < 0.6 * bilinear, "{malvar} {bilinear}");
}

#[test]
fn pictures_of_one_row_or_column_have_colours() {
    for size_px in [[1, 1], [1, 5], [6, 1], [2, 2]] {
        for mosaic in [Mosaic::Gbrg, Mosaic::Rgbw] {
            let values = vec![0.5; (size_px[0] * size_px[1]) as usize];
            let found = colors(mosaic, Demosaic::Malvar, size_px, &values);
            assert!(found.iter().flatten().all(|value| value.is_finite()), "{size_px:?} {mosaic:?}");
        }
    }
}
