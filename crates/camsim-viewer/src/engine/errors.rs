//! The predicted error of a picture from place to place, and as a screen shows it.

use std::sync::Arc;

use camsim_plan::{ErrorMap, SourceError};
use eframe::egui::{Color32, ColorImage};

use super::picture::{Picture, ramp};

/// Decades of error, below the largest, that the colours tell apart.
pub const DECADES: f64 = 2.0;
/// What is left of the picture's own light: of colours, which keep their hue by it, and where there is none.
const OF_COLOR: f32 = 0.4;
const OF_GREY: f32 = 0.45;

/// What is predicted of one picture.
#[derive(Debug)]
pub struct Errors {
    /// At the places where the plan tried its methods, pixels of the ideal frame.
    pub map: ErrorMap,
    /// The picture, grey, in the colours of its places' errors: one colour for each part of the image that a
    /// place stands for. Where pixels are counted apart there is none.
    pub image: Arc<ColorImage>,
}

impl Errors {
    pub fn new(picture: &Picture, map: ErrorMap) -> Self {
        let image = Arc::new(tinted(&picture.image, &map));
        Self { map, image }
    }
}

/// Place on the scale of colours, 0 to 1, of an error where the largest is as given.
fn share_of_scale(px: f64, largest_px: f64) -> f64 {
    (1.0 + (px / largest_px).log10() / DECADES).clamp(0.0, 1.0)
}

fn tinted(image: &ColorImage, map: &ErrorMap) -> ColorImage {
    let [width, height] = image.size;
    let [columns, rows] = map.grid.map(|cells| cells.max(1) as usize);
    let largest_px = map.known().map(|(_, px)| px).fold(0.0, f64::max);
    // Outer: whether a place lies there at all.
    let mut cells = vec![None::<Option<f64>>; columns * rows];
    for place in &map.pixels {
        let [x, y] = place.pixel.map(|at| at as usize);
        let at = (y * rows / height.max(1)).min(rows - 1) * columns
            + (x * columns / width.max(1)).min(columns - 1);
        let Some(cell) = cells.get_mut(at) else { continue };
        let known = cell.flatten();
        *cell = Some(match place.error {
            // A corner of the image is in one cell with another place: what is larger counts.
            SourceError::Within(px) => Some(known.map_or(px, |known| known.max(px))),
            _ => known,
        });
    }
    // On a border between cells a pixel is in just one of them: the other has what is around.
    let around = |at: usize| {
        map.near_px(
            [(at % columns * 2 + 1) * width / (2 * columns), (at / columns * 2 + 1) * height / (2 * rows)]
                .map(|v| v as u32),
        )
    };
    let cells = cells.into_iter().enumerate().map(|(at, cell)| cell.unwrap_or_else(|| around(at)));
    let colors: Vec<Option<[u8; 3]>> = cells
        .map(|cell| cell.map(|px| ramp(if px > 0.0 { share_of_scale(px, largest_px) } else { 0.0 })))
        .collect();
    let pixels = image.pixels.iter().enumerate().map(|(i, pixel)| {
        if pixel.a() == 0 {
            return Color32::TRANSPARENT;
        }
        let light = 0.3 * f32::from(pixel.r()) + 0.59 * f32::from(pixel.g()) + 0.11 * f32::from(pixel.b());
        let cell = (i / width * rows / height) * columns + i % width * columns / width;
        let [r, g, b] = match colors.get(cell).copied().flatten() {
            Some(color) => color.map(|c| f32::from(c) * (1.0 - OF_COLOR + OF_COLOR * light / 255.0)),
            None => [OF_GREY * light; 3],
        };
        Color32::from_rgb(r as u8, g as u8, b as u8)
    });
    ColorImage::new(image.size, pixels.collect())
}

#[cfg(test)]
mod tests {
    use camsim_plan::PixelError;

    use super::*;

    #[test]
    fn each_part_of_the_image_has_the_colour_of_its_place() {
        let image = ColorImage::new([4, 2], [vec![Color32::BLACK; 7], vec![Color32::TRANSPARENT]].concat());
        let place = |pixel, error| PixelError { pixel, error };
        let pixels = vec![
            place([0, 0], SourceError::Within(1e-3)),
            place([2, 1], SourceError::Within(0.1)),
            place([3, 0], SourceError::Silhouette),
            place([1, 1], SourceError::NoSource),
        ];
        let map = ErrorMap { pixels, everywhere_px: 1.0, grid: [2, 2], reach_px: 2.0 };
        let tinted = tinted(&image, &map);
        let light = |i: usize| {
            u32::from(tinted.pixels[i].r())
                + u32::from(tinted.pixels[i].g())
                + u32::from(tinted.pixels[i].b())
        };
        assert_eq!(tinted.pixels[0], tinted.pixels[1], "one place's");
        assert!(light(6) > light(0) && light(0) > 0, "{} {}", light(6), light(0));
        assert_eq!(
            [light(2), light(3), light(4), light(5)],
            [0; 4],
            "silhouettes and what has no source keep the picture's grey"
        );
        assert_eq!(tinted.pixels[7], Color32::TRANSPARENT);
        // A bright picture changes how light a colour is, not which.
        let white = super::tinted(&ColorImage::new([4, 2], vec![Color32::WHITE; 8]), &map);
        let share = |pixel: Color32| f32::from(pixel.r()) / f32::from(pixel.g());
        assert!(
            (share(white.pixels[6]) - share(tinted.pixels[6])).abs() < 0.02
                && white.pixels[6].g() > tinted.pixels[6].g()
        );
        assert_eq!(
            [share_of_scale(0.1, 0.1), share_of_scale(0.01, 0.1), share_of_scale(1e-6, 0.1)],
            [1.0, 0.5, 0.0]
        );
    }
}
