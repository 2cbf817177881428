//! Which triangle each pixel shows, and how far it is.

use super::{
    corners::SUBPIXELS,
    triangles::{BAND_ROWS, Chunk, Cover},
};

/// What a pixel shows where it shows no triangle.
pub(super) const SKY: u32 = u32::MAX;
/// Pixels that are looked at together.
const SIDE_BY_SIDE: usize = 8;
/// Room beyond the last pixel of a row.
pub(super) const BEYOND: usize = SIDE_BY_SIDE;
/// Up to this size of a triangle, pixels, products of differences are exact in 32 bits, eight pixels beyond its end too.
pub(super) const SMALL_PX: i32 = 60;
/// Bits of a triangle's number within its chunk.
pub(super) const CHUNK_BITS: u32 = 16;

/// Depths and triangles of a band of rows.
pub(super) struct Band<'a> {
    pub first_row: usize,
    /// Numbers from one row to the next.
    pub stride: usize,
    /// near / z; 0 is infinitely far.
    pub depth: &'a mut [f32],
    /// Number of the chunk, and of the triangle in it.
    pub shown: &'a mut [u32],
}

/// `a x + b y + c`, at least 0 within a triangle.
#[derive(Clone, Copy)]
struct Side<T> {
    across: T,
    down: T,
    from: T,
}

/// A side from a corner to the next, by pixels from the triangle's first; what is exactly on it is within if it is an upper or a left one.
#[inline(always)]
fn side<T: From<i32> + Copy + std::ops::Mul<Output = T> + std::ops::Sub<Output = T>>(a: [i32; 2], b: [i32; 2]) -> Side<T> {
    let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
    let is_kept = dy < 0 || (dy == 0 && dx > 0);
    let t = T::from;
    let from = t(dy) * t(a[0]) - t(dx) * t(a[1]) - t(i32::from(!is_kept));
    Side { across: t(0) - t(dy) * t(SUBPIXELS), down: t(dx) * t(SUBPIXELS), from }
}

impl Band<'_> {
    /// Draws a chunk's triangles.
    #[inline(always)]
    pub fn draw(&mut self, chunk: &Chunk, number: u32) {
        for &triangle in chunk.of_band(self.first_row / BAND_ROWS) {
            let cover = &chunk.covers[triangle as usize];
            let name = number << CHUNK_BITS | triangle;
            match chunk.large.get(cover.large as usize) {
                None => self.small(cover, name),
                Some([inverse, ..]) => self.large(cover, inverse, name),
            }
        }
    }

    fn rows(&self, cover: &Cover) -> std::ops::RangeInclusive<usize> {
        let last = self.first_row + BAND_ROWS - 1;
        usize::from(cover.first[1]).max(self.first_row)..=usize::from(cover.last[1]).min(last)
    }

    #[inline(always)]
    fn small(&mut self, cover: &Cover, name: u32) {
        let [a, b, c] = cover.at;
        let sides: [Side<i32>; 3] = [side(a, b), side(b, c), side(c, a)];
        let last = i32::from(cover.last[0] - cover.first[0]);
        // What each of the pixels side by side adds.
        let (mut adds, mut adds_inverse) = ([[0; SIDE_BY_SIDE]; 3], [0.0; SIDE_BY_SIDE]);
        for i in 0..SIDE_BY_SIDE {
            adds_inverse[i] = cover.inverse[1] * i as f32;
            for k in 0..3 {
                adds[k][i] = sides[k].across * i as i32;
            }
        }
        for y in self.rows(cover) {
            let down = (y - usize::from(cover.first[1])) as i32;
            let begins = [sides[0].from + sides[0].down * down, sides[1].from + sides[1].down * down, sides[2].from + sides[2].down * down];
            let begin_inverse = cover.inverse[2].mul_add(down as f32, cover.inverse[0]);
            let row = (y - self.first_row) * self.stride + usize::from(cover.first[0]);
            for x in (0..=last).step_by(SIDE_BY_SIDE) {
                let from = [begins[0] + sides[0].across * x, begins[1] + sides[1].across * x, begins[2] + sides[2].across * x];
                let inverse = cover.inverse[1].mul_add(x as f32, begin_inverse);
                let place = row + x as usize;
                // Rows have more numbers than pixels, so that there are enough.
                let (Some(depth), Some(shown)) = (slots(self.depth, place), slots(self.shown, place)) else { return };
                for i in 0..SIDE_BY_SIDE {
                    // Bits of what is less than 0 anywhere.
                    let beyond = (from[0] + adds[0][i]) | (from[1] + adds[1][i]) | (from[2] + adds[2][i]) | (last - x - i as i32);
                    let here = inverse + adds_inverse[i];
                    let is_seen = (beyond >= 0) & (here > depth[i]);
                    depth[i] = if is_seen { here } else { depth[i] };
                    shown[i] = if is_seen { name } else { shown[i] };
                }
            }
        }
    }

    /// By spans, whose ends are exact in 64 bits.
    fn large(&mut self, cover: &Cover, inverse: &[f64; 3], name: u32) {
        let [a, b, c] = cover.at;
        let sides: [Side<i64>; 3] = [side(a, b), side(b, c), side(c, a)];
        for y in self.rows(cover) {
            let down = (y - usize::from(cover.first[1])) as i64;
            let (mut first, mut last) = (0, i64::from(cover.last[0] - cover.first[0]));
            for side in &sides {
                let from = side.from + side.down * down;
                match side.across {
                    0 if from < 0 => last = -1,
                    0 => {}
                    across @ 1.. => first = first.max((-from).div_euclid(across) + i64::from((-from).rem_euclid(across) != 0)),
                    across => last = last.min(from.div_euclid(-across)),
                }
            }
            if first > last {
                continue;
            }
            let begin = inverse[0] + inverse[2] * down as f64 + inverse[1] * first as f64;
            let row = (y - self.first_row) * self.stride + usize::from(cover.first[0]);
            let span = row + first as usize..row + last as usize + 1;
            let pixels = self.depth[span.clone()].iter_mut().zip(&mut self.shown[span]);
            for (i, (depth, shown)) in (0_i32..).zip(pixels) {
                let here = (begin + inverse[1] * f64::from(i)) as f32;
                let is_seen = here > *depth;
                *depth = if is_seen { here } else { *depth };
                *shown = if is_seen { name } else { *shown };
            }
        }
    }
}

/// Numbers side by side.
#[inline(always)]
fn slots<T>(values: &mut [T], place: usize) -> Option<&mut [T; SIDE_BY_SIDE]> {
    values.get_mut(place..)?.first_chunk_mut()
}
