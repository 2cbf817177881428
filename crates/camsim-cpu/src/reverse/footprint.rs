//! Footprint of an output pixel in the ideal frame, and its taps: twin of
//! camsim-gpu/shaders/reverse/gather/footprint.wgsl and its taps.

use camsim_core::temporal::{MAX_AREA_SIDE_PX, tap_offsets};

use crate::simd::lanes::{LANES, Lanes, Lanes2, ZERO, clamp_to, fast_max, fast_min, per_lane, to_index};
use camsim_core::temporal::TapStage;

use camsim_plan::placement::MOST_VECTOR_TAPS as MAX_GRID_TAPS;
/// As in camsim_core::temporal::footprint.
const NARROW_AREA_PX: f32 = 1.000_05;
/// Width of a box with the variance of one bilinear tap, ideal pixels.
const WIDEST_SPLINE_PX: f32 = 1.732_050_8;

/// Offsets of the taps of every grid, as fractions of its sides, in the order in which they are read.
#[derive(Debug)]
pub(super) struct GridTaps {
    /// Offsets of all grids, one after the other.
    offsets: Vec<[f32; 2]>,
    /// Index of each grid's first offset.
    first_offsets: [u32; (MAX_GRID_TAPS * MAX_GRID_TAPS) as usize],
}

impl GridTaps {
    pub fn new() -> Self {
        let mut grid_taps =
            Self { offsets: Vec::new(), first_offsets: [0; (MAX_GRID_TAPS * MAX_GRID_TAPS) as usize] };
        for (grid, begin) in (0..).zip(&mut grid_taps.first_offsets) {
            *begin = grid_taps.offsets.len() as u32;
            grid_taps.offsets.extend(tap_offsets([grid % MAX_GRID_TAPS + 1, grid / MAX_GRID_TAPS + 1]));
        }
        grid_taps
    }
}

/// Footprints of a block of pixels.
pub(super) struct Footprint<'a> {
    /// Grids of bilinear taps, if the stage has any.
    grid: Option<Grid<'a>>,
    /// Softness of the spline for narrow pixels, if the stage has one.
    pub softness: Option<Lanes2>,
    /// Sides of the rectangles for wide pixels, if the stage averages areas; 1 for narrow pixels.
    pub area: Option<Lanes2>,
}

struct Grid<'a> {
    dx: Lanes2,
    dy: Lanes2,
    offsets: &'a [[f32; 2]],
    /// Index of the first offset of each pixel's grid.
    begin: [u32; LANES],
    count: Lanes,
    /// Whether all pixels have the same grid.
    is_common: bool,
}

impl<'a> Footprint<'a> {
    /// Footprints of pixels with these sides, ideal pixels, with up to `max_taps` taps along each side.
    #[inline(always)]
    pub fn new(
        grid_taps: &'a GridTaps,
        tap: TapStage,
        sides: impl FnOnce() -> [Lanes2; 2],
        max_taps: u32,
    ) -> Self {
        if tap == TapStage::Bilinear {
            return Self { grid: None, softness: None, area: None };
        }
        let sides = sides();
        // No `then` here: its closure may be compiled without the enabled vector instructions.
        let softness = if matches!(tap, TapStage::Spline | TapStage::Area | TapStage::SplineOrGrid { .. }) {
            Some(softness(&sides))
        } else {
            None
        };
        let grid = if matches!(tap, TapStage::Grid { .. } | TapStage::SplineOrGrid { .. }) {
            Some(Grid::new(grid_taps, &sides, max_taps))
        } else {
            None
        };
        let area = if tap == TapStage::Area { Some(area(&sides)) } else { None };
        Self { grid, softness, area }
    }

    /// Whether the pixel is too wide for the spline.
    #[inline(always)]
    pub fn is_wide(&self, i: usize) -> bool {
        self.area.as_ref().map_or_else(
            || self.tap_count(i) > 1.0,
            |sides| (sides.x[i] > NARROW_AREA_PX) | (sides.y[i] > NARROW_AREA_PX),
        )
    }

    /// Number of taps that cover a pixel.
    #[inline(always)]
    pub fn tap_count(&self, i: usize) -> f32 {
        self.grid.as_ref().map_or(1.0, |grid| grid.count[i])
    }

    /// Position of tap `tap` (cyclic) of each pixel.
    #[inline(always)]
    pub fn tap_position_px(&self, position_px: &Lanes2, tap: &Lanes) -> Lanes2 {
        let Some(grid) = &self.grid else { return *position_px };
        let Lanes2 { x: across, y: down } = grid.tap_offsets_at(tap);
        let Grid { dx, dy, .. } = grid;
        Lanes2 {
            x: per_lane(|i| position_px.x[i] + dx.x[i] * across[i] + dy.x[i] * down[i]),
            y: per_lane(|i| position_px.y[i] + dx.y[i] * across[i] + dy.y[i] * down[i]),
        }
    }
}

impl<'a> Grid<'a> {
    #[inline(always)]
    fn new(grid_taps: &'a GridTaps, sides: &[Lanes2; 2], max_taps: u32) -> Self {
        let max_taps = max_taps.clamp(1, MAX_GRID_TAPS) as f32;
        let (dx, across) = grid_extent(&sides[0], max_taps);
        let (dy, down) = grid_extent(&sides[1], max_taps);
        let mut begin = [0; LANES];
        for i in 0..LANES {
            begin[i] = grid_taps.first_offsets[(to_index(down[i]) * MAX_GRID_TAPS + to_index(across[i])
                - MAX_GRID_TAPS
                - 1) as usize
                % grid_taps.first_offsets.len()];
        }
        let is_common = begin.iter().all(|&of| of == begin[0]);
        Self {
            dx,
            dy,
            offsets: &grid_taps.offsets,
            begin,
            count: per_lane(|i| across[i] * down[i]),
            is_common,
        }
    }

    /// Offset of tap `tap` (cyclic) of each pixel, as fractions of the sides.
    #[inline(always)]
    fn tap_offsets_at(&self, tap: &Lanes) -> Lanes2 {
        // With half a tap added, rounding cannot move the quotient past a whole number.
        let tap_in_grid = per_lane(|i| tap[i] - ((tap[i] + 0.5) / self.count[i]).floor() * self.count[i]);
        let offset_at = |i: usize| {
            self.offsets.get((self.begin[i] + to_index(tap_in_grid[i])) as usize).copied().unwrap_or_default()
        };
        if self.is_common && tap_in_grid.iter().all(|&of| of == tap_in_grid[0]) {
            let [across, down] = offset_at(0);
            return Lanes2 { x: [across; LANES], y: [down; LANES] };
        }
        let mut offsets = Lanes2::ZERO;
        for i in 0..LANES {
            [offsets.x[i], offsets.y[i]] = offset_at(i);
        }
        offsets
    }
}

/// Sides of the grids, and number of taps along them.
#[inline(always)]
fn grid_extent(side: &Lanes2, max_taps: f32) -> (Lanes2, Lanes) {
    let length_px = side.length();
    let taps = per_lane(|i| {
        if length_px[i] > WIDEST_SPLINE_PX {
            fast_min(fast_max((length_px[i] - 0.1).ceil(), 1.0), max_taps)
        } else {
            1.0
        }
    });
    // The taps have variance of their own, which the grid need not have.
    let factor = per_lane(|i| {
        let wide = (fast_max(length_px[i] * length_px[i] - 3.0, 0.0) / (1.0 - 1.0 / (taps[i] * taps[i])))
            .sqrt()
            / length_px[i];
        if taps[i] > 1.0 { wide } else { 0.0 }
    });
    (Lanes2 { x: per_lane(|i| side.x[i] * factor[i]), y: per_lane(|i| side.y[i] * factor[i]) }, taps)
}

/// Softness of the spline with the variance of a pixel beyond that of an ideal pixel.
#[inline(always)]
fn softness(sides: &[Lanes2; 2]) -> Lanes2 {
    let along = |side: &Lanes2| {
        per_lane(|i| clamp_to(0.25 * (side.x[i] * side.x[i] + side.y[i] * side.y[i] - 1.0), 1.0))
    };
    Lanes2 { x: along(&sides[0]), y: along(&sides[1]) }
}

/// Sides of the axis-aligned rectangle with the variance of each pixel, less that of an ideal pixel.
#[inline(always)]
fn area(sides: &[Lanes2; 2]) -> Lanes2 {
    const WIDEST: f32 = MAX_AREA_SIDE_PX as f32;
    let [across, down] = sides;
    let along = |of: &Lanes, other: &Lanes| {
        per_lane(|i| {
            fast_min(fast_max(of[i].mul_add(of[i], other[i].mul_add(other[i], -1.0)), 1.0), WIDEST * WIDEST)
                .sqrt()
        })
    };
    Lanes2 { x: along(&across.x, &down.x), y: along(&across.y, &down.y) }
}

/// Cubic spline over 4x4 texels without the corners.
pub(super) struct BlockSpline {
    /// Column and row of the second texel of each axis.
    pub base: Lanes2,
    /// Weights of the columns.
    pub columns: [Lanes; 4],
    pub rows: [Lanes; 4],
}

/// The spline as five bilinear reads, by column and row of the read: centre, above, below, left, right.
pub(super) const SPLINE_READS: [[usize; 2]; 5] = [[1, 1], [1, 0], [1, 2], [0, 1], [2, 1]];

impl BlockSpline {
    /// Spline at positions. Softness 0 is Catmull-Rom, 1 the cubic B-spline.
    #[inline(always)]
    pub fn texel_neighbourhoods(position_px: &Lanes2, softness: &Lanes2) -> Self {
        let base =
            Lanes2 { x: per_lane(|i| position_px.x[i].floor()), y: per_lane(|i| position_px.y[i].floor()) };
        let columns = weights(&position_px.x, &base.x, &softness.x);
        let mut rows = weights(&position_px.y, &base.y, &softness.y);
        let ([x0, x1, x2, x3], [y0, y1, y2, y3]) = (&columns, &rows);
        // Normalises the weights: the corners are missing.
        let part = per_lane(|i| {
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

    /// Position and weight of one of the [reads](SPLINE_READS).
    #[inline(always)]
    pub fn read(&self, [x, y]: [usize; 2]) -> (Lanes2, Lanes) {
        let ([x_px, x], [y_px, y]) =
            (of_read(&self.base.x, &self.columns, x), of_read(&self.base.y, &self.rows, y));
        (Lanes2 { x: x_px, y: y_px }, per_lane(|i| x[i] * y[i]))
    }
}

/// Weights along an axis of the texel before `base`, at `base`, and of the two after.
#[inline(always)]
fn weights(position_px: &Lanes, base: &Lanes, softness: &Lanes) -> [Lanes; 4] {
    let mut weights = [ZERO; 4];
    for i in 0..LANES {
        let f = position_px[i] - base[i];
        let g = 1.0 - f;
        let mix = |sharp: f32, soft: f32| sharp + softness[i] * (soft - sharp);
        weights[0][i] = mix(f * (-0.5 + f * (1.0 - 0.5 * f)), g * g * g / 6.0);
        weights[1][i] = mix(1.0 + f * f * (-2.5 + 1.5 * f), (4.0 + f * f * (3.0 * f - 6.0)) / 6.0);
        weights[2][i] = mix(f * (0.5 + f * (2.0 - 1.5 * f)), (4.0 + g * g * (3.0 * g - 6.0)) / 6.0);
        weights[3][i] = mix(f * f * (-0.5 + 0.5 * f), f * f * f / 6.0);
    }
    weights
}

/// Position and weight along one axis of the read before, at, and after.
#[inline(always)]
fn of_read(base: &Lanes, [before, first, second, after]: &[Lanes; 4], which: usize) -> [Lanes; 2] {
    match which {
        0 => [per_lane(|i| base[i] - 1.0), *before],
        1 => [per_lane(|i| base[i] + second[i] / (first[i] + second[i])), per_lane(|i| first[i] + second[i])],
        _ => [per_lane(|i| base[i] + 2.0), *after],
    }
}

/// Both axes times a factor each.
#[inline(always)]
pub(super) fn scaled(lanes: &Lanes2, [x, y]: [f32; 2]) -> Lanes2 {
    let times = |lanes: &Lanes, by: f32| per_lane(|i| lanes[i] * by);
    Lanes2 { x: times(&lanes.x, x), y: times(&lanes.y, y) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn taps_of_every_grid_follow_their_order_cyclically() {
        let grid_taps = GridTaps::new();
        // The number of taps follows from the side in ideal pixels; lanes share a grid, or have one each.
        let side = |length: &dyn Fn(usize) -> u32| per_lane(|i| length(i) as f32 + 0.05);
        for grid in 0..MAX_GRID_TAPS * MAX_GRID_TAPS {
            for own in [0, 1] {
                let taps = |i: usize| {
                    let grid = (grid + own * i as u32) % (MAX_GRID_TAPS * MAX_GRID_TAPS);
                    [grid % MAX_GRID_TAPS + 1, grid / MAX_GRID_TAPS + 1]
                };
                let across = Lanes2 { x: side(&|i| taps(i)[0]), y: [0.0; LANES] };
                let down = Lanes2 { x: [0.0; LANES], y: side(&|i| taps(i)[1]) };
                let of = Grid::new(&grid_taps, &[across, down], MAX_GRID_TAPS);
                assert_eq!(of.is_common, own == 0);
                let orders = [0, 1, 2, 3].map(|i| tap_offsets(taps(i)));
                for tap in 0..1000 {
                    let found = of.tap_offsets_at(&[tap as f32; LANES]);
                    for (i, order) in orders.iter().enumerate() {
                        assert_eq!(of.count[i], order.len() as f32);
                        assert_eq!([found.x[i], found.y[i]], order[tap % order.len()], "{:?} {tap}", taps(i));
                    }
                }
            }
        }
    }

    #[test]
    fn areas_and_splines_equal_their_twins() {
        use camsim_core::temporal::{Footprint as Twin, Kernel, TapStage};
        use glam::DVec2;
        let grid_taps = GridTaps::new();
        let (mut splines, mut areas) = (0, 0);
        for block in 0..100 {
            // Narrow and wide pixels in a block, on both sides of the threshold, rotated and mirrored.
            let width = |i: usize| {
                0.2 + 1.25
                    * (((block * LANES + i) as f32 * 0.618_034).fract()
                        * if i.is_multiple_of(3) { 5.0 } else { 1.3 })
            };
            let tap_in_grid = |i: usize| (block * LANES + i) as f32 * 0.754_878;
            let across = Lanes2 {
                x: per_lane(|i| width(i) * tap_in_grid(i).cos()),
                y: per_lane(|i| width(i) * tap_in_grid(i).sin()),
            };
            let down = Lanes2 {
                x: per_lane(|i| 0.9 * width(i) * tap_in_grid(i).sin()),
                y: per_lane(|i| -0.9 * width(i) * tap_in_grid(i).cos()),
            };
            let found = Footprint::new(&grid_taps, TapStage::Area, || [across, down], 1);
            let [sides, softness] = [found.area, found.softness].map(|of| of.expect("both are known"));
            for i in 0..LANES {
                let at = |of: &Lanes2| DVec2::new(f64::from(of.x[i]), f64::from(of.y[i]));
                assert_eq!(found.tap_count(i), 1.0);
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
