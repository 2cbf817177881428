//! Area of a pixel in the ideal frame and what reads it: twin of shaders/reverse/gather/footprint.wgsl and
//! its taps.

use camsim_core::temporal::{MAX_AREA_SIDE_PX, tap_offsets};

use crate::simd::lanes::{LANES, Lanes, Lanes2, ZERO, each, higher, lower, whole, within};
use camsim_core::temporal::TapStage;

use camsim_plan::placement::MOST_VECTOR_TAPS as MOST_TAPS;
/// As in camsim_core::temporal::footprint.
const NARROW_AREA_PX: f32 = 1.000_05;
/// A bilinear read has itself the variance of a pixel this wide.
const WIDEST_SPLINE_PX: f32 = 1.732_050_8;

/// Where the reads of every grid lie, as shares of its sides, in their order.
#[derive(Debug)]
pub(super) struct Cells {
    /// Of all grids, one after the other.
    shares: Vec<[f32; 2]>,
    /// Where those of a grid begin.
    begins: [u32; (MOST_TAPS * MOST_TAPS) as usize],
}

impl Cells {
    pub fn new() -> Self {
        let mut cells = Self { shares: Vec::new(), begins: [0; (MOST_TAPS * MOST_TAPS) as usize] };
        for (grid, begin) in (0..).zip(&mut cells.begins) {
            *begin = cells.shares.len() as u32;
            cells.shares.extend(tap_offsets([grid % MOST_TAPS + 1, grid / MOST_TAPS + 1]));
        }
        cells
    }
}

/// What reads each of some pixels.
pub(super) struct Footprint<'a> {
    /// Grids of reads, if there are any.
    grid: Option<Grid<'a>>,
    /// How soft the spline is that reads narrow pixels, if one does.
    pub softness: Option<Lanes2>,
    /// Sides of the areas that are read of wide ones, if they are; 1 of narrow ones.
    pub area: Option<Lanes2>,
}

struct Grid<'a> {
    dx: Lanes2,
    dy: Lanes2,
    shares: &'a [[f32; 2]],
    /// Where a pixel's shares begin, and how many there are.
    begin: [u32; LANES],
    count: Lanes,
    /// Whether that is the same for all.
    is_common: bool,
}

impl<'a> Footprint<'a> {
    /// For pixels with these sides, ideal pixels, up to so many reads along each.
    #[inline(always)]
    pub fn new(cells: &'a Cells, tap: TapStage, sides: impl FnOnce() -> [Lanes2; 2], most: u32) -> Self {
        if tap == TapStage::Bilinear {
            return Self { grid: None, softness: None, area: None };
        }
        let sides = sides();
        // Written out: what `then` calls may be compiled without the vectors that this is.
        let softness = if matches!(tap, TapStage::Spline | TapStage::Area | TapStage::SplineOrGrid { .. }) {
            Some(softness(&sides))
        } else {
            None
        };
        let grid = if matches!(tap, TapStage::Grid { .. } | TapStage::SplineOrGrid { .. }) {
            Some(Grid::new(cells, &sides, most))
        } else {
            None
        };
        let area = if tap == TapStage::Area { Some(area(&sides)) } else { None };
        Self { grid, softness, area }
    }

    /// Whether something else than the spline reads a pixel.
    #[inline(always)]
    pub fn is_wide(&self, i: usize) -> bool {
        self.area.as_ref().map_or_else(
            || self.reads(i) > 1.0,
            |sides| (sides.x[i] > NARROW_AREA_PX) | (sides.y[i] > NARROW_AREA_PX),
        )
    }

    /// Reads of a pixel that see all of it.
    #[inline(always)]
    pub fn reads(&self, i: usize) -> f32 {
        self.grid.as_ref().map_or(1.0, |grid| grid.count[i])
    }

    /// Where read number `tap` (cyclic) of each pixel lies.
    #[inline(always)]
    pub fn moved(&self, at_px: &Lanes2, tap: &Lanes) -> Lanes2 {
        let Some(grid) = &self.grid else { return *at_px };
        let Lanes2 { x: across, y: down } = grid.shares_of(tap);
        let Grid { dx, dy, .. } = grid;
        Lanes2 {
            x: each(|i| at_px.x[i] + dx.x[i] * across[i] + dy.x[i] * down[i]),
            y: each(|i| at_px.y[i] + dx.y[i] * across[i] + dy.y[i] * down[i]),
        }
    }
}

impl<'a> Grid<'a> {
    #[inline(always)]
    fn new(cells: &'a Cells, sides: &[Lanes2; 2], most: u32) -> Self {
        let most = most.clamp(1, MOST_TAPS) as f32;
        let (dx, across) = spread(&sides[0], most);
        let (dy, down) = spread(&sides[1], most);
        let mut begin = [0; LANES];
        for i in 0..LANES {
            begin[i] = cells.begins[(whole(down[i]) * MOST_TAPS + whole(across[i]) - MOST_TAPS - 1) as usize
                % cells.begins.len()];
        }
        let is_common = begin.iter().all(|&of| of == begin[0]);
        Self { dx, dy, shares: &cells.shares, begin, count: each(|i| across[i] * down[i]), is_common }
    }

    /// Shares of the sides at which read number `tap` (cyclic) of each pixel lies.
    #[inline(always)]
    fn shares_of(&self, tap: &Lanes) -> Lanes2 {
        // Half a read further the quotient is never so near a whole number that rounding could pass it.
        let turn = each(|i| tap[i] - ((tap[i] + 0.5) / self.count[i]).floor() * self.count[i]);
        let share = |i: usize| {
            self.shares.get((self.begin[i] + whole(turn[i])) as usize).copied().unwrap_or_default()
        };
        if self.is_common && turn.iter().all(|&of| of == turn[0]) {
            let [across, down] = share(0);
            return Lanes2 { x: [across; LANES], y: [down; LANES] };
        }
        let mut shares = Lanes2::ZERO;
        for i in 0..LANES {
            [shares.x[i], shares.y[i]] = share(i);
        }
        shares
    }
}

/// Sides of the grids of reads, and how many reads there are along them.
#[inline(always)]
fn spread(side: &Lanes2, most: f32) -> (Lanes2, Lanes) {
    let stretch = side.length();
    let taps = each(|i| {
        if stretch[i] > WIDEST_SPLINE_PX { lower(higher((stretch[i] - 0.1).ceil(), 1.0), most) } else { 1.0 }
    });
    // What the reads have themselves the grid need not have.
    let factor = each(|i| {
        let wide = (higher(stretch[i] * stretch[i] - 3.0, 0.0) / (1.0 - 1.0 / (taps[i] * taps[i]))).sqrt()
            / stretch[i];
        if taps[i] > 1.0 { wide } else { 0.0 }
    });
    (Lanes2 { x: each(|i| side.x[i] * factor[i]), y: each(|i| side.y[i] * factor[i]) }, taps)
}

/// A pixel's variance beyond the ideal pixel's own, as the spline has it.
#[inline(always)]
fn softness(sides: &[Lanes2; 2]) -> Lanes2 {
    let along =
        |side: &Lanes2| each(|i| within(0.25 * (side.x[i] * side.x[i] + side.y[i] * side.y[i] - 1.0), 1.0));
    Lanes2 { x: along(&sides[0]), y: along(&sides[1]) }
}

/// Sides of the area of each pixel along the frame's axes: its variance, but for an ideal pixel's own.
#[inline(always)]
fn area(sides: &[Lanes2; 2]) -> Lanes2 {
    const WIDEST: f32 = MAX_AREA_SIDE_PX as f32;
    let [across, down] = sides;
    let along = |of: &Lanes, other: &Lanes| {
        each(|i| {
            lower(higher(of[i].mul_add(of[i], other[i].mul_add(other[i], -1.0)), 1.0), WIDEST * WIDEST).sqrt()
        })
    };
    Lanes2 { x: along(&across.x, &down.x), y: along(&across.y, &down.y) }
}

/// A cubic spline over the texels around places: four by four without the corners.
pub(super) struct Spline {
    /// Column and row of the second texel each.
    pub base: Lanes2,
    /// Weights of columns, and of rows; without the corners the products are 1 together.
    pub columns: [Lanes; 4],
    pub rows: [Lanes; 4],
}

/// A spline as five bilinear reads, axis by axis: the one between, those above and below it, those left and
/// right of it.
pub(super) const SPLINE_READS: [[usize; 2]; 5] = [[1, 1], [1, 0], [1, 2], [0, 1], [2, 1]];

impl Spline {
    /// Around places. Softness 0 is Catmull-Rom's, 1 the B-spline.
    #[inline(always)]
    pub fn around(at_px: &Lanes2, softness: &Lanes2) -> Self {
        let base = Lanes2 { x: each(|i| at_px.x[i].floor()), y: each(|i| at_px.y[i].floor()) };
        let columns = weights(&at_px.x, &base.x, &softness.x);
        let mut rows = weights(&at_px.y, &base.y, &softness.y);
        let ([x0, x1, x2, x3], [y0, y1, y2, y3]) = (&columns, &rows);
        // All together: nothing is lost with the corners.
        let part = each(|i| {
            let (x, y) = (x1[i] + x2[i], y1[i] + y2[i]);
            1.0 / (x * y + x * (y0[i] + y3[i]) + y * (x0[i] + x3[i]))
        });
        for of_row in &mut rows {
            for i in 0..LANES {
                of_row[i] *= part[i];
            }
        }
        Self { base, columns, rows }
    }

    /// Place of one of its [reads](SPLINE_READS) and its weight.
    #[inline(always)]
    pub fn read(&self, [x, y]: [usize; 2]) -> (Lanes2, Lanes) {
        let ([x_px, x], [y_px, y]) =
            (of_read(&self.base.x, &self.columns, x), of_read(&self.base.y, &self.rows, y));
        (Lanes2 { x: x_px, y: y_px }, each(|i| x[i] * y[i]))
    }
}

/// Weights along an axis of the texels before, at, and after `base`.
#[inline(always)]
fn weights(at_px: &Lanes, base: &Lanes, softness: &Lanes) -> [Lanes; 4] {
    let mut weights = [ZERO; 4];
    for i in 0..LANES {
        let f = at_px[i] - base[i];
        let g = 1.0 - f;
        let mix = |sharp: f32, soft: f32| sharp + softness[i] * (soft - sharp);
        weights[0][i] = mix(f * (-0.5 + f * (1.0 - 0.5 * f)), g * g * g / 6.0);
        weights[1][i] = mix(1.0 + f * f * (-2.5 + 1.5 * f), (4.0 + f * f * (3.0 * f - 6.0)) / 6.0);
        weights[2][i] = mix(f * (0.5 + f * (2.0 - 1.5 * f)), (4.0 + g * g * (3.0 * g - 6.0)) / 6.0);
        weights[3][i] = mix(f * f * (-0.5 + 0.5 * f), f * f * f / 6.0);
    }
    weights
}

/// Of one axis: place and weight of the read before, of the one between and of the one after.
#[inline(always)]
fn of_read(base: &Lanes, [before, first, second, after]: &[Lanes; 4], which: usize) -> [Lanes; 2] {
    match which {
        0 => [each(|i| base[i] - 1.0), *before],
        1 => [each(|i| base[i] + second[i] / (first[i] + second[i])), each(|i| first[i] + second[i])],
        _ => [each(|i| base[i] + 2.0), *after],
    }
}

/// A number for each of both axes.
#[inline(always)]
pub(super) fn scaled(lanes: &Lanes2, [x, y]: [f32; 2]) -> Lanes2 {
    let times = |lanes: &Lanes, by: f32| each(|i| lanes[i] * by);
    Lanes2 { x: times(&lanes.x, x), y: times(&lanes.y, y) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_of_every_grid_come_in_their_order_over_and_over() {
        let cells = Cells::new();
        // As many reads along a side as it has ideal pixels: lanes have the same grid, or each its own.
        let side = |length: &dyn Fn(usize) -> u32| each(|i| length(i) as f32 + 0.05);
        for grid in 0..MOST_TAPS * MOST_TAPS {
            for own in [0, 1] {
                let taps = |i: usize| {
                    let grid = (grid + own * i as u32) % (MOST_TAPS * MOST_TAPS);
                    [grid % MOST_TAPS + 1, grid / MOST_TAPS + 1]
                };
                let across = Lanes2 { x: side(&|i| taps(i)[0]), y: [0.0; LANES] };
                let down = Lanes2 { x: [0.0; LANES], y: side(&|i| taps(i)[1]) };
                let of = Grid::new(&cells, &[across, down], MOST_TAPS);
                assert_eq!(of.is_common, own == 0);
                let orders = [0, 1, 2, 3].map(|i| tap_offsets(taps(i)));
                for tap in 0..1000 {
                    let found = of.shares_of(&[tap as f32; LANES]);
                    for (i, order) in orders.iter().enumerate() {
                        assert_eq!(of.count[i], order.len() as f32);
                        assert_eq!([found.x[i], found.y[i]], order[tap % order.len()], "{:?} {tap}", taps(i));
                    }
                }
            }
        }
    }

    #[test]
    fn areas_and_splines_are_their_twins() {
        use camsim_core::temporal::{Footprint as Twin, Kernel, TapStage};
        use glam::DVec2;
        let cells = Cells::new();
        let (mut splines, mut areas) = (0, 0);
        for block in 0..100 {
            // Narrow and wide ones in a block, on both sides of the width that tells them apart, turned and
            // mirrored.
            let width = |i: usize| {
                0.2 + 1.25
                    * (((block * LANES + i) as f32 * 0.618_034).fract()
                        * if i.is_multiple_of(3) { 5.0 } else { 1.3 })
            };
            let turn = |i: usize| (block * LANES + i) as f32 * 0.754_878;
            let across =
                Lanes2 { x: each(|i| width(i) * turn(i).cos()), y: each(|i| width(i) * turn(i).sin()) };
            let down = Lanes2 {
                x: each(|i| 0.9 * width(i) * turn(i).sin()),
                y: each(|i| -0.9 * width(i) * turn(i).cos()),
            };
            let found = Footprint::new(&cells, TapStage::Area, || [across, down], 1);
            let [sides, softness] = [found.area, found.softness].map(|of| of.expect("both are known"));
            for i in 0..LANES {
                let at = |of: &Lanes2| DVec2::new(f64::from(of.x[i]), f64::from(of.y[i]));
                assert_eq!(found.reads(i), 1.0);
                match Twin::new(at(&across), at(&down), TapStage::Area).kernel {
                    Kernel::Area(exact) => {
                        areas += 1;
                        assert!(
                            found.is_wide(i) && at(&sides).distance(exact) < 1e-5,
                            "{block} {i}: {} {exact}",
                            at(&sides)
                        );
                    }
                    Kernel::Spline(exact) => {
                        splines += 1;
                        assert!(
                            !found.is_wide(i) && at(&softness).distance(exact) < 1e-5,
                            "{block} {i}: {} {exact}",
                            at(&softness)
                        );
                    }
                    Kernel::Bilinear => panic!("neither"),
                }
            }
        }
        assert!(splines > 500 && areas > 500, "{splines} {areas}");
    }
}
