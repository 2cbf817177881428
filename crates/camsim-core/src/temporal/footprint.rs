//! Reads of an output pixel in the ideal frame: which of them, where around the source, and in which order.
//!
//! Twin of `shaders/reverse/gather/tap`.

use glam::{DVec2, DVec3};
use serde::Serialize;

use super::ColorImage;

/// What reads the ideal frame for one sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum TapStage {
    /// One bilinear read.
    Bilinear,
    /// One read of a cubic spline, as soft as the pixel is wide.
    Spline,
    /// The mean over the pixel's area; the spline where a pixel is up to sqrt 2 ideal pixels wide.
    Area,
    /// A grid of bilinear reads; one of them where a pixel is up to sqrt 3 ideal pixels wide.
    Grid {
        /// Reads along a side, at most.
        most: u32,
    },
    /// The same, but for the spline where a pixel is so narrow.
    SplineOrGrid {
        /// Reads along a side, at most.
        most: u32,
    },
}

/// Widths from which on a grid of bilinear reads covers a pixel, squared, ideal pixels: a single read has
/// this variance (times 12), 1 of the ideal pixel and 2 of the tent.
pub const TENT_PX2: f64 = 3.0;

/// Widest area that is read, ideal pixels: six of them along each axis.
pub const WIDEST_AREA_PX: f64 = 5.0;

/// Areas of no longer sides are not read: a little more than 1, so that rounding decides nothing.
const NARROW_AREA_PX: f64 = 1.000_05;

/// How ideal pixels around a source are weighed, along x and y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kernel {
    /// Between the four nearest.
    Bilinear,
    /// By a cubic spline of this softness.
    Spline(DVec2),
    /// By the part of a rectangle of these sides that each of them covers, ideal pixels, from 1 to
    /// [`WIDEST_AREA_PX`]. Of sides of 1 that is the bilinear one.
    Area(DVec2),
}

/// Reads of an output pixel in the ideal frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Extent of the grid of reads along x and y, ideal pixels: the pixel's own, less what each read covers,
    /// so that the variances agree.
    pub dx: DVec2,
    /// See above.
    pub dy: DVec2,
    /// Reads along each.
    pub taps: [u32; 2],
    /// What each of them is.
    pub kernel: Kernel,
}

impl Footprint {
    /// Of a pixel with the sides `dx` and `dy`, columns of d(ideal px)/d(output px).
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

    /// Offset of tap `i` (cyclic) from the pixel's centre, ideal pixels.
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
        let place = place_of_turn(self.taps, i % (nx * ny));
        [place % nx, place / nx]
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

/// Sides of the rectangle that is read of a pixel: along the frame's own axes, so that with the ideal pixels'
/// own width its variance is the pixel's, which has the same along all axes if it is a square, however that
/// is turned. What ideal pixels of several samples have themselves is not taken off besides, as it is of
/// grids: borders come out sharper so, and nearer to what they are.
fn sides_of_area(dx: DVec2, dy: DVec2) -> DVec2 {
    (dx * dx + dy * dy - 1.0).clamp(DVec2::ONE, DVec2::splat(WIDEST_AREA_PX * WIDEST_AREA_PX)).map(f64::sqrt)
}

/// `n` reads evenly over a length d have the variance `d^2 (1 - 1/n^2) / 12`.
fn spread(side: DVec2, taps: u32) -> DVec2 {
    if taps == 1 {
        return DVec2::ZERO;
    }
    let length2 = side.length_squared();
    side * ((length2 - TENT_PX2).max(0.0) / (1.0 - f64::from(taps * taps).recip()) / length2).sqrt()
}

/// The order in which the cells of a grid are read while the exposure goes by: cells count row after row,
/// four bits each and the first one lowest. By columns and rows, of which there are no fewer columns.
///
/// Each read is of one cell at one instant, so that cells and instants must not go together: read row after
/// row, a path across the rows is longer or shorter than it is. These orders were found by search to leave
/// least of borders in any direction, for paths of 0.8 to 8 ideal pixels, and to be near the pixel's centre
/// on the whole wherever they stop (scripts/order_of_reads.py).
const TURNS: [([u32; 2], u64); 6] = [
    ([4, 1], 0x1302),
    ([3, 2], 0x42_0531),
    ([4, 2], 0x2471_6035),
    ([3, 3], 0x7_1560_4823),
    ([4, 3], 0x7902_5b83_1a46),
    ([4, 4], 0x64df_2790_c5be_318a),
];

/// The cell that is read in a turn. Grids that have no order of their own begin with the first cell and the
/// last one, the second and the one before the last, and so on.
fn place_of_turn([nx, ny]: [u32; 2], turn: u32) -> u32 {
    let [columns, rows] = [nx.max(ny), nx.min(ny)];
    let Some((_, turns)) = TURNS.iter().find(|(grid, _)| *grid == [columns, rows]) else {
        return if turn % 2 == 1 { nx * ny - 1 - turn / 2 } else { turn / 2 };
    };
    let place = (turns >> (4 * turn)) as u32 & 15;
    // The same of a grid that is higher than wide, with rows and columns changed.
    if nx >= ny { place } else { place % columns * nx + place / columns }
}

/// Where the reads of a grid of `taps` along each side lie, in the order in which they are read: shares of
/// its sides from the middle on.
#[must_use]
pub fn tap_shares(taps: [u32; 2]) -> Vec<[f32; 2]> {
    let [nx, ny] = taps.map(|n| n.max(1));
    let share = |cell: u32, of: u32| (f64::from(cell) + 0.5) as f32 / of as f32 - 0.5;
    (0..nx * ny)
        .map(|turn| place_of_turn([nx, ny], turn))
        .map(|place| [share(place % nx, nx), share(place / nx, ny)])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::temporal::{PathStage, gather};

    #[test]
    fn reads_have_the_variance_of_the_pixel_that_they_stand_for() {
        // A parabola's mean over an area tells its variance.
        let size_px = [40, 40];
        let parabola = |i: u32| (f64::from(i % 40) - 20.0).powi(2) + 1.0 / 12.0;
        let rgba: Vec<f32> =
            (0..1600).flat_map(|i| [parabola(i) as f32, (i % 40) as f32 - 20.0, 0.0, 1.0]).collect();
        let color = ColorImage { size_px, rgba: &rgba };
        let mean = |width_px: f64, stage: TapStage| {
            let area = Footprint::new(DVec2::new(width_px, 0.0), DVec2::Y, stage);
            let at = |k: u32| DVec2::new(20.0 + f64::from(k) / 16.0, 20.0);
            // Over all positions between the pixels, about each of them.
            let about = |k: u32| {
                let (found, x) =
                    (gather(&[at(k)], PathStage::Straight, &area, &color, 2.0, 8), at(k).x - 20.0);
                found.x - 2.0 * x * found.y + x * x
            };
            (0..16).map(about).sum::<f64>() / 16.0
        };
        for width_px in [1.0, 1.2, 1.5, 1.7, 2.0, 2.6, 3.4] {
            let found = mean(width_px, TapStage::SplineOrGrid { most: 4 });
            assert!(
                (found - width_px * width_px / 12.0).abs() < 2e-3,
                "{width_px}: {found} {}",
                width_px * width_px / 12.0
            );
        }
        // An area has the pixel's own variance with the ideal pixels' squares; what they are the mean of is
        // not taken off.
        for width_px in [1.5, 2.0, 2.6, 3.4, 5.0] {
            let found = mean(width_px, TapStage::Area) - (width_px * width_px + 1.0) / 12.0;
            assert!(found.abs() < 2e-3, "{width_px}: {found}");
        }
        assert_eq!(mean(1.4, TapStage::Area), mean(1.4, TapStage::Spline), "narrow ones are splines");
        // What one bilinear read is off by, and that a grid is the same where it has several.
        assert!((mean(1.0, TapStage::Bilinear) - 3.0 / 12.0).abs() < 2e-3);
        for [width_px, is_off_by] in
            [[1.0, 2.0 / 12.0], [1.7, (3.0 - 1.7 * 1.7) / 12.0], [2.0, 0.0], [3.4, 0.0]]
        {
            let found = mean(width_px, TapStage::Grid { most: 4 }) - width_px * width_px / 12.0;
            assert!((found - is_off_by).abs() < 2e-3, "{width_px}: {found} {is_off_by}");
        }
    }

    #[test]
    fn areas_are_as_wide_however_a_square_pixel_is_turned_and_no_wider_than_is_read() {
        let of = |turn: f64, width_px: f64| {
            let across = width_px * DVec2::from_angle(turn);
            Footprint::new(across, across.perp(), TapStage::Area).kernel
        };
        let Kernel::Area(sides_px) = of(0.0, 2.5) else { panic!("a wide pixel") };
        assert!(sides_px.distance(DVec2::splat((2.5_f64 * 2.5 - 1.0).sqrt())) < 1e-12);
        for turn in [0.1, 0.7, 2.0] {
            let Kernel::Area(turned_px) = of(turn, 2.5) else { panic!("a wide pixel") };
            assert!(turned_px.distance(sides_px) < 1e-12, "{turn}: {turned_px}");
        }
        assert_eq!(of(0.3, 9.0), Kernel::Area(DVec2::splat(WIDEST_AREA_PX)));
        // Narrow along one axis alone.
        let one = Footprint::new(3.0 * DVec2::X, DVec2::Y, TapStage::Area);
        assert_eq!(one.kernel, Kernel::Area(DVec2::new(8.0_f64.sqrt(), 1.0)));
    }

    #[test]
    fn every_cell_has_its_turn_and_no_round_that_is_cut_short_is_far_off() {
        for [nx, ny] in (1..=6).flat_map(|nx| (1..=6).map(move |ny| [nx, ny])) {
            let count = nx * ny;
            let places: Vec<u32> = (0..count).map(|turn| place_of_turn([nx, ny], turn)).collect();
            let mut sorted = places.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..count).collect::<Vec<_>>(), "{nx} x {ny}");
            // In cells, of all reads together: 1/n of that is what n reads are off by.
            let middle = 0.5 * DVec2::new(f64::from(nx - 1), f64::from(ny - 1));
            let mut sum = DVec2::ZERO;
            for place in places {
                sum += DVec2::new(f64::from(place % nx), f64::from(place / nx)) - middle;
                let most = if nx.max(ny) <= 4 { 2.0 } else { middle.length() };
                assert!(sum.length() <= most + 1e-9, "{nx} x {ny}: {sum}");
            }
        }
    }

    #[test]
    fn cells_and_instants_do_not_go_together() {
        for [nx, ny] in TURNS.iter().flat_map(|&([nx, ny], _)| [[nx, ny], [ny, nx]]) {
            let count = nx * ny;
            let cell = |turn: u32| {
                let place = place_of_turn([nx, ny], turn);
                DVec2::new(f64::from(place % nx), f64::from(place / nx))
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
