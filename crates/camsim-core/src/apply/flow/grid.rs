//! Flow on the pixel grid, with unknown values filled in, and its motion boundaries.
//!
//! A boundary is told from a slope by the differences d between neighbours along a line of pixels. In a
//! smooth field, however steep, each difference lies between those beside it; at a boundary it is larger than
//! the continuation of either side. The excess is the tear, in pixels of the flow: the distance of d from the
//! hull of 0 and the differences beside it. (0 is included because a level field has no boundary.) The test
//! is repeated with the differences two pixels away, because a boundary blended into one pixel, by
//! antialiasing or by flow of half the resolution, shows as two halves side by side. A flow of `a sin(2 pi x
//! / L)` has tears of up to `a (2 pi / L)^3 * 2`.

use std::collections::VecDeque;

use glam::DVec2;

use super::{FlowField, cell::Cell};

/// Flow that is known, or filled in, everywhere.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    pub(super) size_px: [u32; 2],
    px: Vec<[f32; 2]>,
    known: Vec<bool>,
    /// Tears between a pixel and its neighbours to the right and below.
    tears: Vec<[f32; 2]>,
}

impl Grid {
    pub(super) fn new(flow: &FlowField) -> Self {
        let known: Vec<bool> = flow.px.iter().map(|[u, v]| u.is_finite() && v.is_finite()).collect();
        let px = filled(flow, &known);
        let mut grid = Self { size_px: flow.size_px, px, known, tears: Vec::new() };
        let [width, height] = grid.size_px.map(i64::from);
        let tears = |i: i64| {
            let [x, y] = [i % width, i / width];
            let across = |k: i64| grid.texel((x + k) as u32, y as u32);
            let down = |k: i64| grid.texel(x as u32, (y + k) as u32);
            [tear(x, width, across), tear(y, height, down)]
        };
        grid.tears = (0..width * height).map(tears).collect();
        grid
    }

    pub(super) fn texel(&self, x: u32, y: u32) -> DVec2 {
        let [u, v] = self.px[(y * self.size_px[0] + x) as usize];
        DVec2::new(f64::from(u), f64::from(v))
    }

    fn nearest_index(&self, position_px: DVec2) -> usize {
        let last = DVec2::new(f64::from(self.size_px[0] - 1), f64::from(self.size_px[1] - 1));
        let texel = (position_px + 0.5).floor().clamp(DVec2::ZERO, last);
        texel.y as usize * self.size_px[0] as usize + texel.x as usize
    }

    /// Flow of the nearest pixel.
    pub(super) fn nearest(&self, position_px: DVec2) -> DVec2 {
        let [u, v] = self.px[self.nearest_index(position_px)];
        DVec2::new(f64::from(u), f64::from(v))
    }

    /// Whether the flow of the nearest pixel is known.
    pub(super) fn is_known(&self, position_px: DVec2) -> bool {
        self.known[self.nearest_index(position_px)]
    }

    /// A cell, whose corners are pixel centres. An outer ring of cells extrapolates the slope at the border,
    /// so there is one cell more than pixels per side. Cell (0, 0) begins at pixel (-1, -1).
    pub(super) fn cell(&self, column: u32, row: u32) -> Cell {
        let [width, height] = self.size_px;
        let (x, y) =
            ([column.saturating_sub(1), column.min(width - 1)], [row.saturating_sub(1), row.min(height - 1)]);
        let tear = |x: u32, y: u32, axis: usize, is_ring: bool| {
            if is_ring { 0.0 } else { f64::from(self.tears[(y * width + x) as usize][axis]) }
        };
        Cell {
            origin_px: DVec2::new(f64::from(column) - 1.0, f64::from(row) - 1.0),
            flows: [(0, 0), (1, 0), (0, 1), (1, 1)]
                .map(|(i, j)| self.corner([x[i], y[j]], [column + i as u32, row + j as u32])),
            across: [0, 1].map(|k: usize| tear(x[0], y[k], 0, x[0] == x[1])),
            down: [0, 1].map(|k: usize| tear(x[k], y[0], 1, y[0] == y[1])),
        }
    }

    /// Flow at a corner of a cell. `at` counts from (-1, -1), and is at most one pixel outside of the image.
    fn corner(&self, [x, y]: [u32; 2], at: [u32; 2]) -> DVec2 {
        let mut flow = self.texel(x, y);
        for (axis, [dx, dy]) in [[1, 0], [0, 1]].into_iter().enumerate() {
            let last = self.size_px[axis] - 1;
            let (inner, sign) = match at[axis] {
                0 => ([x, y], -1.0),
                // Pixel `last` has index `last + 1`.
                k if k > last + 1 => ([x - dx.min(x), y - dy.min(y)], 1.0),
                _ => continue,
            };
            if last > 0 {
                let step = self.texel(inner[0] + dx, inner[1] + dy) - self.texel(inner[0], inner[1]);
                let tear = self.tears[(inner[1] * self.size_px[0] + inner[0]) as usize][axis];
                // A difference that is mostly a tear is no slope.
                if f64::from(tear) <= 0.5 * step.abs().max_element() {
                    flow += sign * step;
                }
            }
        }
        flow
    }

    /// The cell around a position, and the position within it.
    pub(super) fn cell_at(&self, position_px: DVec2) -> (Cell, DVec2) {
        let most = DVec2::new(f64::from(self.size_px[0]), f64::from(self.size_px[1]));
        let index = (position_px.floor() + 1.0).clamp(DVec2::ZERO, most);
        let cell = self.cell(index.x as u32, index.y as u32);
        (cell, (position_px - cell.origin_px).clamp(DVec2::ZERO, DVec2::ONE))
    }
}

/// Tear between pixel `at` of a line of `count` pixels and the next: the distance of their difference from
/// the continuation of either side. 0 after the last pixel.
fn tear(at: i64, count: i64, texel: impl Fn(i64) -> DVec2) -> f32 {
    if at + 1 >= count {
        return 0.0;
    }
    let step = |k: i64| texel(k + 1) - texel(k);
    let here = step(0);
    let beyond = |away: i64| {
        let (mut low, mut high) = (DVec2::ZERO, DVec2::ZERO);
        for k in [-away, away] {
            if at + k >= 0 && at + k + 1 < count {
                (low, high) = (low.min(step(k)), high.max(step(k)));
            }
        }
        (low - here).max(here - high).max_element()
    };
    beyond(1).max(beyond(2)).max(0.0) as f32
}

/// Fills unknown flow from the nearest known pixel in horizontal and vertical steps; 0 if none is known.
fn filled(flow: &FlowField, known: &[bool]) -> Vec<[f32; 2]> {
    let [width, height] = flow.size_px.map(|side| side as usize);
    let mut px = flow.px.clone();
    let mut is_set = known.to_vec();
    let mut front: VecDeque<usize> = (0..px.len()).filter(|i| known[*i]).collect();
    if front.is_empty() || front.len() == px.len() {
        return if front.is_empty() { vec![[0.0; 2]; px.len()] } else { px };
    }
    while let Some(i) = front.pop_front() {
        let (x, y) = (i % width, i / width);
        let beside = [
            (x > 0).then(|| i - 1),
            (x + 1 < width).then(|| i + 1),
            (y > 0).then(|| i - width),
            (y + 1 < height).then(|| i + width),
        ];
        for other in beside.into_iter().flatten().filter(|other| !is_set[*other]).collect::<Vec<_>>() {
            is_set[other] = true;
            px[other] = px[i];
            front.push_back(other);
        }
    }
    px
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tears(flow: &[f32]) -> Vec<f32> {
        let field = FlowField {
            size_px: [flow.len() as u32, 1],
            px: flow.iter().map(|u| [*u, 0.0]).collect(),
            interval_s: 1.0,
        };
        Grid::new(&field).tears.iter().map(|[across, _]| *across).collect()
    }

    #[test]
    fn steep_slopes_have_no_tears() {
        assert_eq!(tears(&[0.0, 3.0, 6.0, 9.0, 12.0, 15.0]), [0.0; 6]);
        // Nor where a slope begins and ends.
        assert_eq!(tears(&[0.0, 0.0, 0.0, 3.0, 6.0, 9.0, 12.0, 12.0, 12.0]), [0.0; 9]);
        let wave: Vec<f32> =
            (0..64).map(|i| (5.0 * (std::f64::consts::TAU * f64::from(i) / 32.0).sin()) as f32).collect();
        let most = 5.0 * (std::f32::consts::TAU / 32.0).powi(3) * 2.0;
        assert!(tears(&wave)[2..60].iter().all(|tear| *tear <= most), "{:?}", tears(&wave));
    }

    #[test]
    fn steps_are_tears_beside_thin_objects_and_blended_pixels() {
        assert_eq!(tears(&[1.0, 1.0, 1.0, 4.0, 4.0, 4.0]), [0.0, 0.0, 3.0, 0.0, 0.0, 0.0]);
        // On a slope, the tear is the jump alone.
        assert_eq!(tears(&[0.0, 1.0, 2.0, 6.0, 7.0, 8.0]), [0.0, 0.0, 3.0, 0.0, 0.0, 0.0]);
        assert_eq!(tears(&[0.0, 0.0, 5.0, 0.0, 0.0]), [0.0, 5.0, 5.0, 0.0, 0.0]);
        assert_eq!(tears(&[0.0, 0.0, 5.0, 5.0, 0.0, 0.0]), [0.0, 5.0, 0.0, 5.0, 0.0, 0.0]);
        assert_eq!(tears(&[0.0, 0.0, 5.0, 5.0, 9.0, 9.0]), [0.0, 5.0, 0.0, 4.0, 0.0, 0.0]);
        assert_eq!(tears(&[0.0, 0.0, 2.0, 4.0, 4.0, 4.0]), [0.0, 2.0, 2.0, 0.0, 0.0, 0.0]);
        // At the border of the image.
        assert_eq!(tears(&[5.0, 0.0, 0.0, 0.0]), [5.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn unknown_flow_takes_the_nearest_known_value() {
        let nan = f32::NAN;
        let field = FlowField {
            size_px: [5, 1],
            px: [1.0, nan, nan, nan, 2.0].map(|u| [u, 0.0]).to_vec(),
            interval_s: 1.0,
        };
        let grid = Grid::new(&field);
        assert_eq!(grid.px.iter().map(|uv| uv[0]).collect::<Vec<_>>(), [1.0, 1.0, 1.0, 2.0, 2.0]);
        assert_eq!(grid.known, [true, false, false, false, true]);
    }
}
