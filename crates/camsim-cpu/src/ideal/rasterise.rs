//! Rasterisation: visible triangle and depth of each pixel.

use std::ops::Range;

use super::{
    triangles::{BAND_ROWS, Chunk, RasterTriangle},
    vertices::SUBPIXELS,
};
use crate::simd::vectors::{Coverage, FloatVector, IntVector, VECTOR_LANES, VectorTriangle, Vectors};

/// Triangle id of pixels that show the sky.
pub(super) const SKY: u32 = u32::MAX;
/// Padding after the last pixel of a row.
pub(super) const ROW_PADDING: usize = VECTOR_LANES;
/// Largest extent of a small triangle, pixels: its edge functions are exact in 32 bits, also for eight pixels
/// beyond its end.
pub(super) const SMALL_PX: i32 = 60;
/// Bits of a triangle's index within its chunk.
pub(super) const CHUNK_BITS: u32 = 16;

/// Depths and triangle ids of a band of rows.
pub(super) struct Band<'a> {
    /// Index of the band, in bands of [`BAND_ROWS`] rows of the grid on which triangles are set up.
    pub number: usize,
    /// Values from one row to the next.
    pub stride: usize,
    /// near / z, 0 = infinitely far.
    pub depth: &'a mut [f32],
    /// Triangle ids: index of the chunk, and of the triangle in it.
    pub visible: &'a mut [u32],
}

/// Positions at which visibility is tested.
pub(super) trait SamplePattern: Copy + Send + Sync {
    /// Distance of neighbouring positions, pixels of the triangle grid.
    const STEP: usize;
    /// Period in columns of the vertical offset.
    const PERIOD: usize;

    /// Horizontal offset from the pixel centre in even and odd rows, and vertical offset in even and odd
    /// columns, quarters of a pixel. If positions are more than a pixel apart, offsets are from the first
    /// pixel.
    const OFFSETS_X: [i32; 2];
    const OFFSETS_Y: [i32; 2];

    /// Horizontal offset of each lane from the first one, and vertical offset of each lane from its pixel
    /// centre, with the first lane in an even and in an odd column, quarters of a pixel.
    const LANE_OFFSETS_X: IntVector = steps(Self::STEP);
    const LANE_OFFSETS_Y: [IntVector; 2] = [
        alternating(Self::OFFSETS_Y[0], Self::OFFSETS_Y[1]),
        alternating(Self::OFFSETS_Y[1], Self::OFFSETS_Y[0]),
    ];

    /// Offset of a position from its pixel's centre, quarters of a pixel.
    fn sample_offset(column: usize, row: usize) -> [i32; 2] {
        [Self::OFFSETS_X[row % 2], Self::OFFSETS_Y[column % 2]]
    }
}

const fn steps(step: usize) -> IntVector {
    let quarters = 4 * step as i32;
    [0, quarters, 2 * quarters, 3 * quarters, 4 * quarters, 5 * quarters, 6 * quarters, 7 * quarters]
}

const fn alternating(a: i32, b: i32) -> IntVector {
    [a, b, a, b, a, b, a, b]
}

/// At the pixel centres.
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelCentres;

/// At the centre of each 2x2 pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct QuadCentres;

/// A quarter pixel from the centre of each pixel: to the right in even rows and to the left in odd ones, up
/// in even columns and down in odd ones, so that 2x2 of them are the standard positions of 4x multisampling.
#[derive(Clone, Copy, Debug)]
pub(super) struct SamplePositions;

impl SamplePattern for PixelCentres {
    const STEP: usize = 1;
    const PERIOD: usize = 1;
    const OFFSETS_X: [i32; 2] = [0; 2];
    const OFFSETS_Y: [i32; 2] = [0; 2];
}

impl SamplePattern for QuadCentres {
    const STEP: usize = 2;
    const PERIOD: usize = 1;
    const OFFSETS_X: [i32; 2] = [2; 2];
    const OFFSETS_Y: [i32; 2] = [2; 2];
}

impl SamplePattern for SamplePositions {
    const STEP: usize = 1;
    const PERIOD: usize = 2;
    const OFFSETS_X: [i32; 2] = [1, -1];
    const OFFSETS_Y: [i32; 2] = [-1, 1];
}

/// Edge function `a x + b y + c` of positions in quarters of a pixel, at least 0 within a triangle.
#[derive(Clone, Copy)]
struct EdgeFunction<T> {
    across: T,
    down: T,
    from: T,
}

/// Edge function from a vertex to the next, relative to the triangle's first pixel. Positions exactly on it
/// are inside if it is a top or left edge.
#[inline(always)]
fn edge_function<T: From<i32> + Copy + std::ops::Mul<Output = T> + std::ops::Sub<Output = T>>(
    a: [i32; 2],
    b: [i32; 2],
) -> EdgeFunction<T> {
    let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
    let is_top_left = dy < 0 || (dy == 0 && dx > 0);
    let t = T::from;
    let from = t(dy) * t(a[0]) - t(dx) * t(a[1]) - t(i32::from(!is_top_left));
    EdgeFunction { across: t(0) - t(dy) * t(SUBPIXELS / 4), down: t(dx) * t(SUBPIXELS / 4), from }
}

/// Whether the triangle covers any position. The triangle is at most a vector wide; its vertices are relative
/// to its first pixel.
#[inline(always)]
pub(super) fn covers_any_position<P: SamplePattern>(
    vectors: impl Vectors,
    [a, b, c]: [[i32; 2]; 3],
    first: [i32; 2],
    last: [i32; 2],
) -> bool {
    let edges: [EdgeFunction<i32>; 3] = [edge_function(a, b), edge_function(b, c), edge_function(c, a)];
    let (steps, downs) = (&P::LANE_OFFSETS_X, &P::LANE_OFFSETS_Y[first[0] as usize % 2]);
    let edge_increments =
        |k: usize| vectors.weighted_int_sum([edges[k].across, edges[k].down], [steps, downs]);
    let lane_increments = [edge_increments(0), edge_increments(1), edge_increments(2)];
    for y in first[1]..=last[1] {
        let (right, down) = (P::OFFSETS_X[y as usize % 2], 4 * (y - first[1]));
        let edge_at =
            |k: usize| (edges[k].from + edges[k].down * down + edges[k].across * right, &lane_increments[k]);
        if vectors.is_any_covered(&Coverage {
            edges: [edge_at(0), edge_at(1), edge_at(2)],
            last: last[0] - first[0],
        }) {
            return true;
        }
    }
    false
}

/// Extent of a triangle in a band.
pub(super) struct BandExtent {
    pub rows: Range<usize>,
    /// First and last column.
    pub columns: [usize; 2],
    /// Distance from the triangle's first pixel to the first column, quarters of a pixel.
    right: i32,
}

impl Band<'_> {
    /// Draws the triangles of a chunk that are wanted.
    #[inline(always)]
    pub fn draw<P: SamplePattern>(
        &mut self,
        vectors: impl Vectors,
        _: P,
        chunk: &Chunk,
        number: u32,
        mut is_wanted: impl FnMut(&RasterTriangle) -> bool,
    ) {
        for &index in chunk.band(self.number) {
            let triangle = &chunk.raster[index as usize];
            if !is_wanted(triangle) {
                continue;
            }
            self.draw_triangle::<P>(vectors, chunk, triangle, number << CHUNK_BITS | index);
        }
    }

    #[inline(always)]
    pub fn draw_triangle<P: SamplePattern>(
        &mut self,
        vectors: impl Vectors,
        chunk: &Chunk,
        triangle: &RasterTriangle,
        id: u32,
    ) {
        match chunk.large.get(triangle.large as usize) {
            None => self.draw_small::<P>(vectors, triangle, id),
            Some([inverse_depth, ..]) => {
                (0..P::PERIOD).for_each(|first| self.draw_large::<P>(triangle, inverse_depth, id, first))
            }
        }
    }

    pub fn first_row<P: SamplePattern>(&self) -> usize {
        self.number * (BAND_ROWS / P::STEP)
    }

    #[inline(always)]
    pub fn extent<P: SamplePattern>(&self, triangle: &RasterTriangle) -> BandExtent {
        let position = |[x, y]: [u16; 2]| [usize::from(x) / P::STEP, usize::from(y) / P::STEP];
        let (first, last) = (position(triangle.first), position(triangle.last));
        let first_row = self.first_row::<P>();
        let right = 4 * ((P::STEP * first[0]) as i32 - i32::from(triangle.first[0]));
        BandExtent {
            rows: first[1].max(first_row)..(last[1] + 1).min(first_row + BAND_ROWS / P::STEP),
            columns: [first[0], last[0]],
            right,
        }
    }

    #[inline(always)]
    fn draw_small<P: SamplePattern>(&mut self, vectors: impl Vectors, triangle: &RasterTriangle, id: u32) {
        let [a, b, c] = triangle.snapped;
        let edges: [EdgeFunction<i32>; 3] = [edge_function(a, b), edge_function(b, c), edge_function(c, a)];
        let BandExtent { rows, columns: [first, last], right } = self.extent::<P>(triangle);
        let last = (last - first) as i32;
        let step = 4 * P::STEP as i32;
        let inverse_depth =
            [triangle.inverse_depth[0], 0.25 * triangle.inverse_depth[1], 0.25 * triangle.inverse_depth[2]];
        // Increments of each lane.
        let (steps, downs) = (&P::LANE_OFFSETS_X, &P::LANE_OFFSETS_Y[first % 2]);
        // No `map` here and below: its closure may be compiled without these vector instructions.
        let edge_increments =
            |k: usize| vectors.weighted_int_sum([edges[k].across, edges[k].down], [steps, downs]);
        let lane_increments = [edge_increments(0), edge_increments(1), edge_increments(2)];
        let depth_increments = vectors
            .weighted_sum([inverse_depth[1], inverse_depth[2]], [&to_floats(steps), &to_floats(downs)]);
        let first_row = self.first_row::<P>();
        for y in rows {
            let right = right + P::OFFSETS_X[y % 2];
            let down = 4 * ((P::STEP * y) as i32 - i32::from(triangle.first[1]));
            let mut edge_sums = [0; 3];
            for k in 0..3 {
                edge_sums[k] = edges[k].from + edges[k].down * down + edges[k].across * right;
            }
            let begin_depth = inverse_depth[2]
                .mul_add(down as f32, inverse_depth[1].mul_add(right as f32, inverse_depth[0]));
            let row = (y - first_row) * self.stride + first;
            let mut x = 0;
            while x <= last {
                let distance = step * x;
                let position = row + x as usize;
                // Rows have padding, so there are enough values.
                let (Some(depth), Some(visible)) =
                    (vector_at(self.depth, position), vector_at(self.visible, position))
                else {
                    return;
                };
                let edge_at = |k: usize| (edge_sums[k] + edges[k].across * distance, &lane_increments[k]);
                let coverage = Coverage { edges: [edge_at(0), edge_at(1), edge_at(2)], last: last - x };
                let depth_sum = (inverse_depth[1].mul_add(distance as f32, begin_depth), &depth_increments);
                vectors.depth_test(&VectorTriangle { id, coverage, depth_sum }, depth, visible);
                x += VECTOR_LANES as i32;
            }
        }
    }

    /// Draws a large triangle by spans, whose ends are exact in 64 bits, for the columns of one period of the
    /// position pattern, beginning with `begin`.
    #[inline(always)]
    fn draw_large<P: SamplePattern>(
        &mut self,
        triangle: &RasterTriangle,
        inverse_depth: &[f64; 3],
        id: u32,
        begin: usize,
    ) {
        let [a, b, c] = triangle.snapped;
        let edges: [EdgeFunction<i64>; 3] = [edge_function(a, b), edge_function(b, c), edge_function(c, a)];
        let BandExtent { rows, columns: [first_column, last_column], right } = self.extent::<P>(triangle);
        let step = 4 * P::STEP as i64;
        let inverse_depth = [inverse_depth[0], 0.25 * inverse_depth[1], 0.25 * inverse_depth[2]];
        let first_row = self.first_row::<P>();
        for y in rows {
            let sample_offset = P::sample_offset(first_column + begin, y);
            let right = i64::from(right + sample_offset[0]);
            let down =
                i64::from(4 * ((P::STEP * y) as i32 - i32::from(triangle.first[1])) + sample_offset[1]);
            let (mut first, mut last) = (0, (last_column - first_column) as i64);
            for edge in &edges {
                let from = edge.from + edge.down * down + edge.across * right;
                match step * edge.across {
                    0 if from < 0 => last = -1,
                    0 => {}
                    across @ 1.. => {
                        first =
                            first.max((-from).div_euclid(across) + i64::from((-from).rem_euclid(across) != 0))
                    }
                    across => last = last.min(from.div_euclid(-across)),
                }
            }
            first += (begin as i64 - first).rem_euclid(P::PERIOD as i64);
            if first > last {
                continue;
            }
            let across = step as f64 * inverse_depth[1];
            let at_first = inverse_depth[0]
                + inverse_depth[2] * down as f64
                + inverse_depth[1] * right as f64
                + across * first as f64;
            let row = (y - first_row) * self.stride + first_column;
            let span = row + first as usize..row + last as usize + 1;
            let pixels = self.depth[span.clone()].iter_mut().zip(&mut self.visible[span]);
            for (i, (depth, visible)) in (0_i32..).zip(pixels).step_by(P::PERIOD) {
                let here = (at_first + across * f64::from(i)) as f32;
                let is_nearer = here > *depth;
                *depth = if is_nearer { here } else { *depth };
                *visible = if is_nearer { id } else { *visible };
            }
        }
    }
}

#[inline(always)]
fn to_floats(ints: &IntVector) -> FloatVector {
    let mut floats = [0.0; VECTOR_LANES];
    for i in 0..VECTOR_LANES {
        floats[i] = ints[i] as f32;
    }
    floats
}

/// A vector of values.
#[inline(always)]
fn vector_at<T>(values: &mut [T], position: usize) -> Option<&mut [T; VECTOR_LANES]> {
    values.get_mut(position..)?.first_chunk_mut()
}
