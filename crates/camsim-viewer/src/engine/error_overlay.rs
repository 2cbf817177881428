//! The predicted error over the image, and its colour overlay.

use std::sync::Arc;

use camsim_plan::{ErrorMap, SourceError};
use eframe::egui::{Color32, ColorImage};

use super::picture::{Picture, ramp};

/// Decades below the bound on 99 % of the pixels that the colour scale covers.
pub const DECADES: f64 = 2.0;
/// Fraction of a coloured pixel's brightness that comes from the picture.
const PICTURE_SHARE: f32 = 0.4;
/// Brightness of pixels without predicted error, as a fraction of the picture's.
const GREY_SHARE: f32 = 0.45;
/// Colour of errors above the bound: those of 1 % of the pixels.
pub const ABOVE_BOUND: [u8; 3] = [235, 60, 60];

/// Predicted source errors of one picture.
#[derive(Debug)]
pub struct ErrorOverlay {
    /// Errors at the planner's probes, pixels of the ideal frame.
    pub map: ErrorMap,
    /// The picture in grey, tinted by error: one colour for each cell of the probe grid, none at silhouettes.
    pub image: Arc<ColorImage>,
}

impl ErrorOverlay {
    /// Tints `picture` by the maps of its faces.
    pub fn new(picture: &Picture, maps: Vec<ErrorMap>) -> Self {
        let map = joined(maps);
        let image = Arc::new(tinted(&picture.image, &map, picture.predicted_px()));
        Self { map, image }
    }
}

/// One map of those of several faces, each of which has probes in its own pixels.
fn joined(maps: Vec<ErrorMap>) -> ErrorMap {
    let empty = ErrorMap { pixels: Vec::new(), everywhere_px: 0.0, grid: [1, 1], reach_px: 0.0 };
    maps.into_iter().fold(empty, |mut all, map| {
        all.pixels.extend(map.pixels);
        ErrorMap { everywhere_px: all.everywhere_px.max(map.everywhere_px), pixels: all.pixels, ..map }
    })
}

/// Colour of an error: on a logarithmic scale that ends at `bound_px`, and red above it.
fn color_of(px: f64, bound_px: f64) -> [u8; 3] {
    let position = 1.0 + (px / bound_px).log10() / DECADES;
    if px > bound_px { ABOVE_BOUND } else { ramp(if px > 0.0 { position.clamp(0.0, 1.0) } else { 0.0 }) }
}

fn tinted(image: &ColorImage, map: &ErrorMap, bound_px: f64) -> ColorImage {
    let [width, height] = image.size;
    let [columns, rows] = map.grid.map(|cells| cells.max(1) as usize);
    // The outer option: whether the cell has a probe. The inner: whether the probe has an error.
    let mut cells = vec![None::<Option<f64>>; columns * rows];
    for probe in &map.pixels {
        let [x, y] = probe.pixel.map(|coordinate| coordinate as usize);
        let index = (y * rows / height.max(1)).min(rows - 1) * columns
            + (x * columns / width.max(1)).min(columns - 1);
        let Some(cell) = cells.get_mut(index) else { continue };
        let known = cell.flatten();
        *cell = Some(match probe.error {
            // Corners of the image share their cell with another probe: the larger error counts.
            SourceError::Within(px) => Some(known.map_or(px, |known| known.max(px))),
            _ => known,
        });
    }
    // A probe on the border between two cells is counted in one of them; the other takes the nearest error.
    let nearest_px = |index: usize| {
        map.near_px(
            [
                (index % columns * 2 + 1) * width / (2 * columns),
                (index / columns * 2 + 1) * height / (2 * rows),
            ]
            .map(|v| v as u32),
        )
    };
    let cells = cells.into_iter().enumerate().map(|(index, cell)| cell.unwrap_or_else(|| nearest_px(index)));
    let colors: Vec<Option<[u8; 3]>> = cells.map(|cell| cell.map(|px| color_of(px, bound_px))).collect();
    let pixels = image.pixels.iter().enumerate().map(|(i, pixel)| {
        if pixel.a() == 0 {
            return Color32::TRANSPARENT;
        }
        let light = 0.3 * f32::from(pixel.r()) + 0.59 * f32::from(pixel.g()) + 0.11 * f32::from(pixel.b());
        let cell = (i / width * rows / height) * columns + i % width * columns / width;
        let [r, g, b] = match colors.get(cell).copied().flatten() {
            Some(color) => {
                color.map(|c| f32::from(c) * (1.0 - PICTURE_SHARE + PICTURE_SHARE * light / 255.0))
            }
            None => [GREY_SHARE * light; 3],
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
    fn each_grid_cell_is_tinted_by_the_error_of_its_probe() {
        let image = ColorImage::new([4, 2], [vec![Color32::BLACK; 7], vec![Color32::TRANSPARENT]].concat());
        let probe = |pixel, error| PixelError { pixel, error };
        let pixels = vec![
            probe([0, 0], SourceError::Within(1e-3)),
            probe([2, 1], SourceError::Within(0.1)),
            probe([3, 0], SourceError::Silhouette),
            probe([1, 1], SourceError::NoSource),
        ];
        let map = ErrorMap { pixels, everywhere_px: 1.0, grid: [2, 2], reach_px: 2.0 };
        let tinted = tinted(&image, &map, 0.1);
        let light = |i: usize| {
            u32::from(tinted.pixels[i].r())
                + u32::from(tinted.pixels[i].g())
                + u32::from(tinted.pixels[i].b())
        };
        assert_eq!(tinted.pixels[0], tinted.pixels[1], "one cell");
        assert!(light(6) > light(0) && light(0) > 0, "{} {}", light(6), light(0));
        assert_eq!(
            [light(2), light(3), light(4), light(5)],
            [0; 4],
            "silhouettes and pixels without source keep the grey of the picture"
        );
        assert_eq!(tinted.pixels[7], Color32::TRANSPARENT);
        // A bright picture changes the brightness, not the hue.
        let white = super::tinted(&ColorImage::new([4, 2], vec![Color32::WHITE; 8]), &map, 0.1);
        let fraction = |pixel: Color32| f32::from(pixel.r()) / f32::from(pixel.g());
        assert!(
            (fraction(white.pixels[6]) - fraction(tinted.pixels[6])).abs() < 0.02
                && white.pixels[6].g() > tinted.pixels[6].g()
        );
        let colors = [0.1, 0.01, 1e-6, 0.0, 0.2].map(|px| color_of(px, 0.1));
        assert_eq!(colors, [ramp(1.0), ramp(0.5), ramp(0.0), ramp(0.0), ABOVE_BOUND]);
    }
}
