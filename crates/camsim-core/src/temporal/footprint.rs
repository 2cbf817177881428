//! Taps of an output pixel in the ideal frame: their kernel, their offsets from the source and their order
//! over the exposure.
//!
//! f64 twin of `camsim-gpu/shaders/reverse/gather/tap`.

use glam::{DVec2, DVec3};
use serde::Serialize;

use super::ColorImage;

/// Method by which one exposure sample reads the ideal frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum TapStage {
    /// One bilinear tap.
    Bilinear,
    /// One tap of a cubic spline, whose softness follows from the width of the pixel.
    Spline,
    /// Mean over the area of the pixel; the spline where the pixel is up to sqrt 2 ideal pixels wide.
    Area,
    /// A grid of bilinear taps; one tap where the pixel is up to sqrt 3 ideal pixels wide.
    Grid {
        /// Largest number of taps along a side.
        most: u32,
    },
    /// A grid of bilinear taps, or the spline where the pixel is up to sqrt 3 ideal pixels wide.
    SplineOrGrid {
        /// Largest number of taps along a side.
        most: u32,
    },
}

/// Squared width, in ideal pixels, above which a grid of bilinear taps represents a pixel. A single tap has
/// this variance (times 12): 1 from the ideal pixel and 2 from the tent.
pub const TENT_PX2: f64 = 3.0;

/// Largest side of an area that is read, ideal pixels: six pixels along each axis.
pub const MAX_AREA_SIDE_PX: f64 = 5.0;

/// Areas with shorter sides are not read. The value is slightly above 1, so that rounding does not decide.
const NARROW_AREA_PX: f64 = 1.000_05;

/// Weights of the ideal pixels around a source, along x and y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kernel {
    /// Bilinear between the four nearest pixels.
    Bilinear,
    /// Cubic spline of this softness.
    Spline(DVec2),
    /// Overlap of each pixel with a rectangle of these sides, in ideal pixels, from 1 to
    /// [`MAX_AREA_SIDE_PX`]. Sides of 1 give the bilinear kernel.
    Area(DVec2),
}

/// Taps of an output pixel in the ideal frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Extent of the tap grid along the output pixel's x axis, in ideal pixels: the pixel's own side,
    /// shortened so that grid and tap together have the variance of the pixel.
    pub dx: DVec2,
    /// Extent of the tap grid along the output pixel's y axis, ideal pixels.
    pub dy: DVec2,
    /// Number of taps along x and along y.
    pub taps: [u32; 2],
    /// Kernel of each tap.
    pub kernel: Kernel,
}

impl Footprint {
    /// Footprint of a pixel with sides `dx` and `dy`, the columns of d(ideal px)/d(output px).
    #[must_use]
    pub fn new(dx: DVec2, dy: DVec2, stage: TapStage) -> Self {
        let most = match stage {
            TapStage::Grid { most } | TapStage::SplineOrGrid { most } => most.max(1),
            TapStage::Bilinear | TapStage::Spline | TapStage::Area => 1,
        };
        let taps = [dx, dy].map(|side| match side.length_squared() > TENT_PX2 {
            true => ((side.length() - 0.1).ceil() as u32).clamp(1, most),
            false => 1,
        });
        let softness = |side: DVec2| (0.25 * (side.length_squared() - 1.0)).clamp(0.0, 1.0);
        let has_spline = matches!(stage, TapStage::Spline | TapStage::Area | TapStage::SplineOrGrid { .. });
        let kernel = match stage {
            TapStage::Area if sides_of_area(dx, dy).max_element() > NARROW_AREA_PX => {
                Kernel::Area(sides_of_area(dx, dy))
            }
            _ if has_spline && taps == [1, 1] => Kernel::Spline(DVec2::new(softness(dx), softness(dy))),
            _ => Kernel::Bilinear,
        };
        let [dx, dy] = [(dx, taps[0]), (dy, taps[1])].map(|(side, taps)| spread(side, taps));
        Self { dx, dy, taps, kernel }
    }

    /// Offset of tap `i` (cyclic) from the centre of the pixel, ideal pixels.
    #[must_use]
    pub fn offset_px(&self, i: u32) -> DVec2 {
        let ([nx, ny], [x, y]) = (self.taps, self.cell(i));
        let fx = (f64::from(x) + 0.5) / f64::from(nx) - 0.5;
        let fy = (f64::from(y) + 0.5) / f64::from(ny) - 0.5;
        self.dx * fx + self.dy * fy
    }

    /// Column and row of tap `i` (cyclic) in the grid.
    pub fn cell(&self, i: u32) -> [u32; 2] {
        let [nx, ny] = self.taps;
        let cell = tap_cell(self.taps, i % (nx * ny));
        [cell % nx, cell / nx]
    }

    /// Colour of tap `i` around a source.
    #[must_use]
    pub fn tap_color(&self, color: &ColorImage<'_>, source_px: DVec2, i: u32) -> DVec3 {
        match self.kernel {
            Kernel::Bilinear => color.sample(source_px + self.offset_px(i)),
            Kernel::Spline(softness) => color.spline(source_px, softness),
            Kernel::Area(sides_px) => color.over_area(source_px, sides_px),
        }
    }
}

/// Sides of the axis-aligned rectangle that is read for a pixel. Together with the width of an ideal pixel,
/// its variance equals that of the output pixel; a square pixel has the same variance along all axes,
/// whatever its rotation. Unlike for grids, the variance that supersampled ideal pixels already have is not
/// subtracted: borders are sharper and more accurate that way.
fn sides_of_area(dx: DVec2, dy: DVec2) -> DVec2 {
    (dx * dx + dy * dy - 1.0)
        .clamp(DVec2::ONE, DVec2::splat(MAX_AREA_SIDE_PX * MAX_AREA_SIDE_PX))
        .map(f64::sqrt)
}

/// `n` taps spread evenly over a length d have the variance `d^2 (1 - 1/n^2) / 12`.
fn spread(side: DVec2, taps: u32) -> DVec2 {
    if taps == 1 {
        return DVec2::ZERO;
    }
    let length2 = side.length_squared();
    side * ((length2 - TENT_PX2).max(0.0) / (1.0 - f64::from(taps * taps).recip()) / length2).sqrt()
}

/// Order in which the cells of a grid are read during the exposure. Cells are numbered row by row, four bits
/// each, the first one lowest. The key is columns and rows, with columns >= rows.
///
/// Each tap reads one cell at one instant, so cell and instant must be uncorrelated: in plain row order, a
/// path across the rows would appear longer or shorter than it is. These orders were found by search
/// (scripts/gather_order.py). They minimise the error at borders of any direction for paths of 0.8 to 8
/// ideal pixels, and their mean stays near the pixel's centre wherever the sequence stops.
const TAP_ORDERS: [([u32; 2], u64); 6] = [
    ([4, 1], 0x1302),
    ([3, 2], 0x42_0531),
    ([4, 2], 0x2471_6035),
    ([3, 3], 0x7_1560_4823),
    ([4, 3], 0x7902_5b83_1a46),
    ([4, 4], 0x64df_2790_c5be_318a),
];

/// Cell of a turn. Grids without an entry in the table alternate: first, last, second, last but one, and so
/// on.
fn tap_cell([nx, ny]: [u32; 2], turn: u32) -> u32 {
    let [columns, rows] = [nx.max(ny), nx.min(ny)];
    let Some((_, turns)) = TAP_ORDERS.iter().find(|(grid, _)| *grid == [columns, rows]) else {
        return if turn % 2 == 1 { nx * ny - 1 - turn / 2 } else { turn / 2 };
    };
    let cell = (turns >> (4 * turn)) as u32 & 15;
    // The order of the transposed grid, for a grid with more rows than columns.
    if nx >= ny { cell } else { cell % columns * nx + cell / columns }
}

/// Offsets of the taps of a grid, in the order in which they are read, as fractions of the grid's sides from its
/// centre.
#[must_use]
pub fn tap_offsets(taps: [u32; 2]) -> Vec<[f32; 2]> {
    let [nx, ny] = taps.map(|n| n.max(1));
    let fraction = |cell: u32, of: u32| (f64::from(cell) + 0.5) as f32 / of as f32 - 0.5;
    (0..nx * ny)
        .map(|turn| tap_cell([nx, ny], turn))
        .map(|cell| [fraction(cell % nx, nx), fraction(cell / nx, ny)])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::temporal::{PathStage, gather};

    #[test]
    fn taps_have_the_variance_of_the_pixel() {
        // The mean of a parabola over an area gives its variance.
        let size_px = [40, 40];
        let parabola = |i: u32| (f64::from(i % 40) - 20.0).powi(2) + 1.0 / 12.0;
        let rgba: Vec<f32> =
            (0..1600).flat_map(|i| [parabola(i) as f32, (i % 40) as f32 - 20.0, 0.0, 1.0]).collect();
        let color = ColorImage { size_px, rgba: &rgba };
        let mean = |width_px: f64, stage: TapStage| {
            let area = Footprint::new(DVec2::new(width_px, 0.0), DVec2::Y, stage);
            let position_px = |k: u32| DVec2::new(20.0 + f64::from(k) / 16.0, 20.0);
            // Averaged over all positions between pixels.
            let about = |k: u32| {
                let (found, x) = (
                    gather(&[position_px(k)], PathStage::Straight, &area, &color, 2.0, 8),
                    position_px(k).x - 20.0,
                );
                found.x - 2.0 * x * found.y + x * x
            };
            (0..16).map(about).sum::<f64>() / 16.0
        };
        for width_px in [1.0, 1.2, 1.5, 1.7, 2.0, 2.6, 3.4] {
            let variance = mean(width_px, TapStage::SplineOrGrid { most: 4 });
            assert!(
                (variance - width_px * width_px / 12.0).abs() < 2e-3,
                "{width_px}: {variance} {}",
                width_px * width_px / 12.0
            );
        }
        // An area read has the variance of the pixel plus that of the ideal pixels, which is not subtracted.
        for width_px in [1.5, 2.0, 2.6, 3.4, 5.0] {
            let variance = mean(width_px, TapStage::Area) - (width_px * width_px + 1.0) / 12.0;
            assert!(variance.abs() < 2e-3, "{width_px}: {variance}");
        }
        assert_eq!(mean(1.4, TapStage::Area), mean(1.4, TapStage::Spline), "narrow ones are splines");
        // Error of a single bilinear tap, and of a grid that has only one tap.
        assert!((mean(1.0, TapStage::Bilinear) - 3.0 / 12.0).abs() < 2e-3);
        for [width_px, is_off_by] in
            [[1.0, 2.0 / 12.0], [1.7, (3.0 - 1.7 * 1.7) / 12.0], [2.0, 0.0], [3.4, 0.0]]
        {
            let variance = mean(width_px, TapStage::Grid { most: 4 }) - width_px * width_px / 12.0;
            assert!((variance - is_off_by).abs() < 2e-3, "{width_px}: {variance} {is_off_by}");
        }
    }

    #[test]
    fn areas_are_invariant_to_rotation_and_bounded() {
        let footprint = |turn: f64, width_px: f64| {
            let across = width_px * DVec2::from_angle(turn);
            Footprint::new(across, across.perp(), TapStage::Area).kernel
        };
        let Kernel::Area(sides_px) = footprint(0.0, 2.5) else { panic!("a wide pixel") };
        assert!(sides_px.distance(DVec2::splat((2.5_f64 * 2.5 - 1.0).sqrt())) < 1e-12);
        for turn in [0.1, 0.7, 2.0] {
            let Kernel::Area(turned_px) = footprint(turn, 2.5) else { panic!("a wide pixel") };
            assert!(turned_px.distance(sides_px) < 1e-12, "{turn}: {turned_px}");
        }
        assert_eq!(footprint(0.3, 9.0), Kernel::Area(DVec2::splat(MAX_AREA_SIDE_PX)));
        // Narrow along one axis only.
        let one = Footprint::new(3.0 * DVec2::X, DVec2::Y, TapStage::Area);
        assert_eq!(one.kernel, Kernel::Area(DVec2::new(8.0_f64.sqrt(), 1.0)));
    }

    #[test]
    fn tap_orders_visit_every_cell_and_stay_centred() {
        for [nx, ny] in (1..=6).flat_map(|nx| (1..=6).map(move |ny| [nx, ny])) {
            let count = nx * ny;
            let cells: Vec<u32> = (0..count).map(|turn| tap_cell([nx, ny], turn)).collect();
            let mut sorted = cells.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..count).collect::<Vec<_>>(), "{nx} x {ny}");
            // In cells, summed over all taps; 1/n of it is the offset of n taps.
            let middle = 0.5 * DVec2::new(f64::from(nx - 1), f64::from(ny - 1));
            let mut sum = DVec2::ZERO;
            for cell in cells {
                sum += DVec2::new(f64::from(cell % nx), f64::from(cell / nx)) - middle;
                let most = if nx.max(ny) <= 4 { 2.0 } else { middle.length() };
                assert!(sum.length() <= most + 1e-9, "{nx} x {ny}: {sum}");
            }
        }
    }

    #[test]
    fn tap_cells_and_instants_are_uncorrelated() {
        for [nx, ny] in TAP_ORDERS.iter().flat_map(|&([nx, ny], _)| [[nx, ny], [ny, nx]]) {
            let count = nx * ny;
            let cell = |turn: u32| {
                let cell = tap_cell([nx, ny], turn);
                DVec2::new(f64::from(cell % nx), f64::from(cell / nx))
                    - 0.5 * DVec2::new(f64::from(nx - 1), f64::from(ny - 1))
            };
            let with_time = |of: &dyn Fn(DVec2) -> f64| {
                let values: Vec<f64> = (0..count).map(|turn| of(cell(turn))).collect();
                let mean = values.iter().sum::<f64>() / f64::from(count);
                let middle = 0.5 * f64::from(count - 1);
                let sum = |value: &dyn Fn(f64, f64) -> f64| {
                    (0..count)
                        .zip(&values)
                        .map(|(turn, v)| value(v - mean, f64::from(turn) - middle))
                        .sum::<f64>()
                };
                let both = (sum(&|v, _| v * v) * sum(&|_, t| t * t)).sqrt();
                if both > 1e-9 { sum(&|v, t| v * t) / both } else { 0.0 }
            };
            for correlation in [
                with_time(&|c| c.x),
                with_time(&|c| c.y),
                with_time(&|c| c.x * c.y),
                with_time(&|c| c.length_squared()),
            ] {
                assert!(correlation.abs() < 0.3, "{nx} x {ny}: {correlation}");
            }
        }
    }
}
