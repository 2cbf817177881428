//! Area of a pixel in the ideal frame and what reads it: twin of shaders/reverse/gather/footprint.wgsl and its taps.

use camsim_core::temporal::tap_shares;

use crate::host::lanes::{LANES, Lanes, Lanes2, ZERO, each, within};
use crate::reverse::TapKind;

/// Reads along a side at most: of each grid up to that the order of reads is written down.
pub(super) const MOST_TAPS: u32 = 8;
/// A bilinear read has itself the variance of a pixel this wide.
const WIDEST_SPLINE_PX: f32 = 1.732_050_8;

/// Where the reads of every grid lie, as shares of its sides, in their order.
#[derive(Debug)]
pub(super) struct Cells(Vec<Vec<[f32; 2]>>);

impl Cells {
    pub fn new() -> Self {
        Self((0..MOST_TAPS * MOST_TAPS).map(|grid| tap_shares([grid % MOST_TAPS + 1, grid / MOST_TAPS + 1])).collect())
    }

    fn of(&self, [across, down]: [u32; 2]) -> &[[f32; 2]] {
        &self.0[(down.clamp(1, MOST_TAPS) * MOST_TAPS + across.clamp(1, MOST_TAPS) - MOST_TAPS - 1) as usize]
    }
}

/// What reads each of some pixels.
pub(super) struct Footprint<'a> {
    /// Grids of reads, if there are any.
    grid: Option<Grid<'a>>,
    /// How soft the spline is that reads pixels of one read, if one does.
    pub softness: Option<Lanes2>,
}

struct Grid<'a> {
    dx: Lanes2,
    dy: Lanes2,
    cells: [&'a [[f32; 2]]; LANES],
}

impl<'a> Footprint<'a> {
    /// For pixels with these sides, ideal pixels, up to so many reads along each.
    #[inline(always)]
    pub fn new(cells: &'a Cells, tap: TapKind, sides: impl FnOnce() -> [Lanes2; 2], most: u32) -> Self {
        if tap == TapKind::Bilinear {
            return Self { grid: None, softness: None };
        }
        let sides = sides();
        let softness = matches!(tap, TapKind::Spline | TapKind::SplineOrGrid).then(|| softness(&sides));
        let grid = matches!(tap, TapKind::Grid | TapKind::SplineOrGrid).then(|| Grid::new(cells, &sides, most));
        Self { grid, softness }
    }

    /// Reads of a pixel that see all of it.
    #[inline(always)]
    pub fn reads(&self, i: usize) -> f32 {
        self.grid.as_ref().map_or(1.0, |grid| grid.cells[i].len() as f32)
    }

    /// Where read number `tap` (cyclic) of each pixel lies.
    #[inline(always)]
    pub fn moved(&self, at_px: &Lanes2, tap: impl Fn(usize) -> f32) -> Lanes2 {
        let Some(Grid { dx, dy, cells }) = &self.grid else { return *at_px };
        let (mut across, mut down) = (ZERO, ZERO);
        for i in 0..LANES {
            [across[i], down[i]] = cells[i][tap(i) as usize % cells[i].len()];
        }
        Lanes2 {
            x: each(|i| at_px.x[i] + dx.x[i] * across[i] + dy.x[i] * down[i]),
            y: each(|i| at_px.y[i] + dx.y[i] * across[i] + dy.y[i] * down[i]),
        }
    }
}

impl<'a> Grid<'a> {
    fn new(cells: &'a Cells, sides: &[Lanes2; 2], most: u32) -> Self {
        let mut taps = [[1; 2]; LANES];
        let mut spread = |axis: usize| {
            let (side, stretch) = (&sides[axis], sides[axis].length());
            let mut factor = ZERO;
            for i in 0..LANES {
                if stretch[i] > WIDEST_SPLINE_PX {
                    taps[i][axis] = ((stretch[i] - 0.1).ceil() as u32).clamp(1, most.max(1));
                }
                let n = taps[i][axis] as f32;
                if n > 1.0 {
                    // What the reads have themselves the grid need not have.
                    factor[i] = ((stretch[i] * stretch[i] - 3.0).max(0.0) / (1.0 - 1.0 / (n * n))).sqrt() / stretch[i];
                }
            }
            Lanes2 { x: each(|i| side.x[i] * factor[i]), y: each(|i| side.y[i] * factor[i]) }
        };
        let (dx, dy) = (spread(0), spread(1));
        Self { dx, dy, cells: taps.map(|taps| cells.of(taps)) }
    }
}

/// A pixel's variance beyond the ideal pixel's own, as the spline has it.
fn softness(sides: &[Lanes2; 2]) -> Lanes2 {
    let [x, y] = sides.each_ref().map(|side| each(|i| within(0.25 * (side.x[i] * side.x[i] + side.y[i] * side.y[i] - 1.0), 1.0)));
    Lanes2 { x, y }
}

/// A cubic spline as five bilinear reads: the one between, those above and below it, those left and right of it.
pub(super) struct Spline([Axis; 2]);

/// Of one axis: places of the reads before, between and after, and their weights.
struct Axis {
    at_px: [Lanes; 3],
    weight: [Lanes; 3],
}

/// Axis by axis, which of the three.
const SPLINE_READS: [[usize; 2]; 5] = [[1, 1], [1, 0], [1, 2], [0, 1], [2, 1]];

impl Spline {
    /// Around places. Softness 0 is Catmull-Rom's, 1 the B-spline.
    #[inline(always)]
    pub fn around(at_px: &Lanes2, softness: &Lanes2) -> Self {
        let mut axes = [Axis::around(&at_px.x, &softness.x), Axis::around(&at_px.y, &softness.y)];
        // All five together: nothing is lost with the corners.
        let part = each(|i| {
            let [x, y] = [&axes[0].weight, &axes[1].weight];
            (x[1][i] * y[1][i] + x[1][i] * (y[0][i] + y[2][i]) + y[1][i] * (x[0][i] + x[2][i])).sqrt().recip()
        });
        for weight in axes.iter_mut().flat_map(|axis| &mut axis.weight) {
            *weight = each(|i| weight[i] * part[i]);
        }
        Self(axes)
    }

    /// Places of its reads and their weights.
    #[inline(always)]
    pub fn reads(&self) -> impl Iterator<Item = (Lanes2, Lanes)> {
        let [across, down] = &self.0;
        SPLINE_READS.into_iter().map(|[x, y]| {
            let at_px = Lanes2 { x: across.at_px[x], y: down.at_px[y] };
            (at_px, each(|i| across.weight[x][i] * down.weight[y][i]))
        })
    }
}

impl Axis {
    #[inline(always)]
    fn around(at_px: &Lanes, softness: &Lanes) -> Self {
        let base = each(|i| at_px[i].floor());
        let weights = |i: usize| {
            let f = at_px[i] - base[i];
            let g = 1.0 - f;
            let mix = |sharp: f32, soft: f32| sharp + softness[i] * (soft - sharp);
            [
                mix(f * (-0.5 + f * (1.0 - 0.5 * f)), g * g * g / 6.0),
                mix(1.0 + f * f * (-2.5 + 1.5 * f), (4.0 + f * f * (3.0 * f - 6.0)) / 6.0),
                mix(f * (0.5 + f * (2.0 - 1.5 * f)), (4.0 + g * g * (3.0 * g - 6.0)) / 6.0),
                mix(f * f * (-0.5 + 0.5 * f), f * f * f / 6.0),
            ]
        };
        Self {
            at_px: [
                each(|i| base[i] - 1.0),
                each(|i| {
                    let [_, w1, w2, _] = weights(i);
                    base[i] + w2 / (w1 + w2)
                }),
                each(|i| base[i] + 2.0),
            ],
            weight: [each(|i| weights(i)[0]), each(|i| weights(i)[1] + weights(i)[2]), each(|i| weights(i)[3])],
        }
    }
}

/// A number for each of both axes.
pub(super) fn scaled(lanes: &Lanes2, [x, y]: [f32; 2]) -> Lanes2 {
    let times = |lanes: &Lanes, by: f32| each(|i| lanes[i] * by);
    Lanes2 { x: times(&lanes.x, x), y: times(&lanes.y, y) }
}
