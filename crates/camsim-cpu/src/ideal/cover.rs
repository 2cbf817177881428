//! Which triangle each pixel shows, and how far it is.

use std::ops::Range;

use super::{
    corners::SUBPIXELS,
    triangles::{BAND_ROWS, Chunk, Cover},
};
use crate::simd::vectors::{Inside, Numbers, SIDE_BY_SIDE, Shown, Vectors, Wholes};

/// What a pixel shows where it shows no triangle.
pub(super) const SKY: u32 = u32::MAX;
/// Room beyond the last pixel of a row.
pub(super) const BEYOND: usize = SIDE_BY_SIDE;
/// Up to this size of a triangle, pixels, products of differences are exact in 32 bits, eight pixels beyond
/// its end too.
pub(super) const SMALL_PX: i32 = 60;
/// Bits of a triangle's number within its chunk.
pub(super) const CHUNK_BITS: u32 = 16;

/// Depths and triangles of a band of rows.
pub(super) struct Band<'a> {
    /// Of as many rows of the grid that triangles are on as [`BAND_ROWS`].
    pub number: usize,
    /// Numbers from one row to the next.
    pub stride: usize,
    /// near / z; 0 is infinitely far.
    pub depth: &'a mut [f32],
    /// Number of the chunk, and of the triangle in it.
    pub shown: &'a mut [u32],
}

/// Where it is asked which triangle is shown.
pub(super) trait Places: Copy + Send + Sync {
    /// Pixels that triangles are on, from one place to the next.
    const STEP: usize;
    /// Columns after which places are as high again.
    const ALIKE: usize;

    /// Quarters of a pixel from a pixel's middle to the right, in even rows and odd ones, and down, in even
    /// columns and odd ones; of pixels that are further apart, from the first one's.
    const RIGHT: [i32; 2];
    const DOWN: [i32; 2];

    /// Quarters of a pixel from the first of places side by side to each, to the right; and from the middle
    /// of its pixel down, where the first one is in an even column and in an odd one.
    const STEPS: Wholes = steps(Self::STEP);
    const DOWNS: [Wholes; 2] =
        [alternating(Self::DOWN[0], Self::DOWN[1]), alternating(Self::DOWN[1], Self::DOWN[0])];

    fn beside(column: usize, row: usize) -> [i32; 2] {
        [Self::RIGHT[row % 2], Self::DOWN[column % 2]]
    }
}

const fn steps(step: usize) -> Wholes {
    let quarters = 4 * step as i32;
    [0, quarters, 2 * quarters, 3 * quarters, 4 * quarters, 5 * quarters, 6 * quarters, 7 * quarters]
}

const fn alternating(a: i32, b: i32) -> Wholes {
    [a, b, a, b, a, b, a, b]
}

/// At the middles of the pixels that triangles are on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pixels;

/// In the middle of each two by two of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fours;

/// A quarter beside the middle of each: to the right in even rows and to the left in odd ones, up in even
/// columns and down in odd ones, so that two by two of them are the places of a device's four samples a
/// pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Samples;

impl Places for Pixels {
    const STEP: usize = 1;
    const ALIKE: usize = 1;
    const RIGHT: [i32; 2] = [0; 2];
    const DOWN: [i32; 2] = [0; 2];
}

impl Places for Fours {
    const STEP: usize = 2;
    const ALIKE: usize = 1;
    const RIGHT: [i32; 2] = [2; 2];
    const DOWN: [i32; 2] = [2; 2];
}

impl Places for Samples {
    const STEP: usize = 1;
    const ALIKE: usize = 2;
    const RIGHT: [i32; 2] = [1, -1];
    const DOWN: [i32; 2] = [-1, 1];
}

/// `a x + b y + c` of places in quarters of a pixel, at least 0 within a triangle.
#[derive(Clone, Copy)]
struct Side<T> {
    across: T,
    down: T,
    from: T,
}

/// A side from a corner to the next, by quarters from the triangle's first pixel; what is exactly on it is
/// within if it is an upper or a left one.
#[inline(always)]
fn side<T: From<i32> + Copy + std::ops::Mul<Output = T> + std::ops::Sub<Output = T>>(
    a: [i32; 2],
    b: [i32; 2],
) -> Side<T> {
    let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
    let is_kept = dy < 0 || (dy == 0 && dx > 0);
    let t = T::from;
    let from = t(dy) * t(a[0]) - t(dx) * t(a[1]) - t(i32::from(!is_kept));
    Side { across: t(0) - t(dy) * t(SUBPIXELS / 4), down: t(dx) * t(SUBPIXELS / 4), from }
}

/// Whether any place shows a triangle that nothing hides, of not more columns than there are side by side:
/// its corners from its first pixel on, and its first and last pixels.
#[inline(always)]
pub(super) fn is_anywhere<P: Places>(
    vectors: impl Vectors,
    [a, b, c]: [[i32; 2]; 3],
    first: [i32; 2],
    last: [i32; 2],
) -> bool {
    let sides: [Side<i32>; 3] = [side(a, b), side(b, c), side(c, a)];
    let (steps, downs) = (&P::STEPS, &P::DOWNS[first[0] as usize % 2]);
    let of_side = |k: usize| vectors.mixed([sides[k].across, sides[k].down], [steps, downs]);
    let adds = [of_side(0), of_side(1), of_side(2)];
    for y in first[1]..=last[1] {
        let (right, down) = (P::RIGHT[y as usize % 2], 4 * (y - first[1]));
        let side = |k: usize| (sides[k].from + sides[k].down * down + sides[k].across * right, &adds[k]);
        if vectors.is_any_inside(&Inside { sides: [side(0), side(1), side(2)], last: last[0] - first[0] }) {
            return true;
        }
    }
    false
}

/// Where a triangle is in a band.
struct Within {
    rows: Range<usize>,
    /// First and last columns.
    columns: [usize; 2],
    /// Quarters of a pixel from the triangle's first one to the first column.
    right: i32,
}

impl Band<'_> {
    /// Draws a chunk's triangles that are wanted.
    #[inline(always)]
    pub fn draw<P: Places>(
        &mut self,
        vectors: impl Vectors,
        _: P,
        chunk: &Chunk,
        number: u32,
        mut is_wanted: impl FnMut(&Cover) -> bool,
    ) {
        for &triangle in chunk.of_band(self.number) {
            let cover = &chunk.covers[triangle as usize];
            if !is_wanted(cover) {
                continue;
            }
            let name = number << CHUNK_BITS | triangle;
            match chunk.large.get(cover.large as usize) {
                None => self.small::<P>(vectors, cover, name),
                Some([inverse, ..]) => {
                    (0..P::ALIKE).for_each(|first| self.large::<P>(cover, inverse, name, first))
                }
            }
        }
    }

    fn first_row<P: Places>(&self) -> usize {
        self.number * (BAND_ROWS / P::STEP)
    }

    #[inline(always)]
    fn within<P: Places>(&self, cover: &Cover) -> Within {
        let place = |[x, y]: [u16; 2]| [usize::from(x) / P::STEP, usize::from(y) / P::STEP];
        let (first, last) = (place(cover.first), place(cover.last));
        let first_row = self.first_row::<P>();
        let right = 4 * ((P::STEP * first[0]) as i32 - i32::from(cover.first[0]));
        Within {
            rows: first[1].max(first_row)..(last[1] + 1).min(first_row + BAND_ROWS / P::STEP),
            columns: [first[0], last[0]],
            right,
        }
    }

    #[inline(always)]
    fn small<P: Places>(&mut self, vectors: impl Vectors, cover: &Cover, name: u32) {
        let [a, b, c] = cover.at;
        let sides: [Side<i32>; 3] = [side(a, b), side(b, c), side(c, a)];
        let Within { rows, columns: [first, last], right } = self.within::<P>(cover);
        let last = (last - first) as i32;
        let step = 4 * P::STEP as i32;
        let inverse = [cover.inverse[0], 0.25 * cover.inverse[1], 0.25 * cover.inverse[2]];
        // What each of the pixels side by side adds.
        let (steps, downs) = (&P::STEPS, &P::DOWNS[first % 2]);
        // Written out, here and below: what `map` calls may be compiled without these vectors.
        let of_side = |k: usize| vectors.mixed([sides[k].across, sides[k].down], [steps, downs]);
        let adds = [of_side(0), of_side(1), of_side(2)];
        let adds_inverse =
            vectors.mixed_numbers([inverse[1], inverse[2]], [&numbers(steps), &numbers(downs)]);
        let first_row = self.first_row::<P>();
        for y in rows {
            let right = right + P::RIGHT[y % 2];
            let down = 4 * ((P::STEP * y) as i32 - i32::from(cover.first[1]));
            let mut begins = [0; 3];
            for k in 0..3 {
                begins[k] = sides[k].from + sides[k].down * down + sides[k].across * right;
            }
            let begin_inverse = inverse[2].mul_add(down as f32, inverse[1].mul_add(right as f32, inverse[0]));
            let row = (y - first_row) * self.stride + first;
            let mut x = 0;
            while x <= last {
                let far = step * x;
                let place = row + x as usize;
                // Rows have more numbers than pixels, so that there are enough.
                let (Some(depth), Some(shown)) = (slots(self.depth, place), slots(self.shown, place)) else {
                    return;
                };
                let side = |k: usize| (begins[k] + sides[k].across * far, &adds[k]);
                let inside = Inside { sides: [side(0), side(1), side(2)], last: last - x };
                let near = (inverse[1].mul_add(far as f32, begin_inverse), &adds_inverse);
                vectors.show(&Shown { name, inside, near }, depth, shown);
                x += SIDE_BY_SIDE as i32;
            }
        }
    }

    /// By spans, whose ends are exact in 64 bits: of columns that are alike, from the triangle's first one or
    /// one beside it on.
    #[inline(always)]
    fn large<P: Places>(&mut self, cover: &Cover, inverse: &[f64; 3], name: u32, begin: usize) {
        let [a, b, c] = cover.at;
        let sides: [Side<i64>; 3] = [side(a, b), side(b, c), side(c, a)];
        let Within { rows, columns: [first_column, last_column], right } = self.within::<P>(cover);
        let step = 4 * P::STEP as i64;
        let inverse = [inverse[0], 0.25 * inverse[1], 0.25 * inverse[2]];
        let first_row = self.first_row::<P>();
        for y in rows {
            let beside = P::beside(first_column + begin, y);
            let right = i64::from(right + beside[0]);
            let down = i64::from(4 * ((P::STEP * y) as i32 - i32::from(cover.first[1])) + beside[1]);
            let (mut first, mut last) = (0, (last_column - first_column) as i64);
            for side in &sides {
                let from = side.from + side.down * down + side.across * right;
                match step * side.across {
                    0 if from < 0 => last = -1,
                    0 => {}
                    across @ 1.. => {
                        first =
                            first.max((-from).div_euclid(across) + i64::from((-from).rem_euclid(across) != 0))
                    }
                    across => last = last.min(from.div_euclid(-across)),
                }
            }
            first += (begin as i64 - first).rem_euclid(P::ALIKE as i64);
            if first > last {
                continue;
            }
            let across = step as f64 * inverse[1];
            let at_first =
                inverse[0] + inverse[2] * down as f64 + inverse[1] * right as f64 + across * first as f64;
            let row = (y - first_row) * self.stride + first_column;
            let span = row + first as usize..row + last as usize + 1;
            let pixels = self.depth[span.clone()].iter_mut().zip(&mut self.shown[span]);
            for (i, (depth, shown)) in (0_i32..).zip(pixels).step_by(P::ALIKE) {
                let here = (at_first + across * f64::from(i)) as f32;
                let is_seen = here > *depth;
                *depth = if is_seen { here } else { *depth };
                *shown = if is_seen { name } else { *shown };
            }
        }
    }
}

#[inline(always)]
fn numbers(wholes: &Wholes) -> Numbers {
    let mut numbers = [0.0; SIDE_BY_SIDE];
    for i in 0..SIDE_BY_SIDE {
        numbers[i] = wholes[i] as f32;
    }
    numbers
}

/// Numbers side by side.
#[inline(always)]
fn slots<T>(values: &mut [T], place: usize) -> Option<&mut [T; SIDE_BY_SIDE]> {
    values.get_mut(place..)?.first_chunk_mut()
}
