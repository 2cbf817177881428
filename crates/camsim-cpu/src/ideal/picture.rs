//! Pictures on surfaces in the host's memory, and reads of them.

use camsim_core::scene::{TexelForm, Texture, Wrap};

use crate::large_pages::Large;
use crate::simd::{
    lanes::{LANES, Lanes, each, lower, whole, within},
    vectors::Vectors,
};

/// Half floats of a texel: linear R G B A.
const CHANNELS: usize = 4;
/// Versions of a picture of the largest side that there is, and more.
const MOST_VERSIONS: usize = 32;

/// A surface's picture.
#[derive(Debug)]
pub(super) enum Picture {
    /// Of one colour, as exact as its bytes.
    Uniform([f32; CHANNELS]),
    /// Of many.
    Texels(Box<Texels>),
}

/// A picture and its smaller versions, the largest first: texels row after row, and after the last column and
/// the last row what follows them.
#[derive(Debug)]
pub(super) struct Texels {
    halves: Large<u16>,
    /// Of each version, where it begins and half floats from one row to the next.
    begins: [u32; MOST_VERSIONS],
    strides: [u32; MOST_VERSIONS],
    widths: [f32; MOST_VERSIONS],
    heights: [f32; MOST_VERSIONS],
    /// Number of the smallest.
    last: f32,
    repeats: [bool; 2],
}

/// What reads of pixels have summed up: R G B A of the left texels, then of the right ones.
pub(super) type Sums = [[f32; 2 * CHANNELS]; LANES];

impl Picture {
    /// Of a picture that is read between texels, with a border around its smaller versions if there is one.
    pub fn new(texture: &Texture, wrap: [Wrap; 2], border: Option<[u8; 4]>) -> Self {
        match texture.size_px {
            [1, 1] => Self::Uniform(texture.linear_at([0, 0])),
            _ => Self::Texels(Box::new(Texels::new(texture, wrap.map(|wrap| wrap == Wrap::Repeat), border))),
        }
    }
}

impl Texels {
    fn new(texture: &Texture, repeats: [bool; 2], border: Option<[u8; 4]>) -> Self {
        let mut texels = Self {
            halves: Large::default(),
            begins: [0; MOST_VERSIONS],
            strides: [0; MOST_VERSIONS],
            widths: [1.0; MOST_VERSIONS],
            heights: [1.0; MOST_VERSIONS],
            last: 0.0,
            repeats,
        };
        let mips = texture.mips_with_border(TexelForm::Light, border);
        let sizes = [texture.size_px].into_iter().chain(mips.iter().map(|mip| mip.size_px));
        texels.halves.fit(sizes.map(halves_of).sum());
        let mut end = texels.add(0, 0, &texture.texels(&texture.rgba8, TexelForm::Light), texture.size_px);
        for (mip, number) in mips.iter().zip(1..MOST_VERSIONS) {
            end = texels.add(number, end, &mip.texels, mip.size_px);
        }
        texels
    }

    /// Adds a version from `begin` on; where it ends.
    fn add(&mut self, number: usize, begin: usize, bytes: &[u8], size_px: [u32; 2]) -> usize {
        let [width, height] = size_px.map(|side| side as usize);
        let (row_halves, stride) = (CHANNELS * width, CHANNELS * (width + 1));
        (self.begins[number], self.strides[number]) = (begin as u32, stride as u32);
        (self.widths[number], self.heights[number]) = (width as f32, height as f32);
        self.last = number as f32;
        let [repeats, repeats_rows] = self.repeats;
        let end = begin + halves_of(size_px);
        let rows = (0..height).chain([if repeats_rows { 0 } else { height - 1 }]);
        for (row, into) in rows.zip(self.halves[begin..end].chunks_exact_mut(stride)) {
            let row = &bytes[2 * row_halves * row..2 * row_halves * (row + 1)];
            for (half, into) in row.chunks_exact(2).zip(&mut *into) {
                *into = u16::from_ne_bytes([half[0], half[1]]);
            }
            let next = if repeats { 0 } else { row_halves - CHANNELS };
            into.copy_within(next..next + CHANNELS, row_halves);
        }
        end
    }

    /// Of the picture itself.
    pub fn size(&self) -> [f32; 2] {
        [self.widths[0], self.heights[0]]
    }

    /// Adds reads of the pixels that are asked for, times a weight of each: bilinear, between the two
    /// versions that a level lies between.
    #[inline(always)]
    pub fn add_reads(
        &self,
        vectors: impl Vectors,
        u: &Lanes,
        v: &Lanes,
        level: &Lanes,
        weight: &Lanes,
        is_asked: &[bool; LANES],
        sums: &mut Sums,
    ) {
        let below = each(|i| within(level[i], self.last).floor());
        let share = each(|i| within(level[i], self.last) - below[i]);
        let is_between = share.iter().any(|&share| share > 0.0);
        let of_this = each(|i| weight[i] * (1.0 - share[i]));
        self.add_version(vectors, u, v, &below, &of_this, is_asked, sums);
        if is_between {
            let above = each(|i| lower(below[i] + 1.0, self.last));
            let of_that = each(|i| weight[i] * share[i]);
            let mut is_shared = [false; LANES];
            for i in 0..LANES {
                is_shared[i] = is_asked[i] & (share[i] > 0.0);
            }
            self.add_version(vectors, u, v, &above, &of_that, &is_shared, sums);
        }
    }

    #[inline(always)]
    fn add_version(
        &self,
        vectors: impl Vectors,
        u: &Lanes,
        v: &Lanes,
        version: &Lanes,
        weight: &Lanes,
        is_asked: &[bool; LANES],
        sums: &mut Sums,
    ) {
        let (mut width, mut height) = ([self.widths[0]; LANES], [self.heights[0]; LANES]);
        let (mut begin, mut stride) = ([self.begins[0]; LANES], [self.strides[0]; LANES]);
        if version.iter().any(|&version| version > 0.0) {
            for i in 0..LANES {
                let number = whole(version[i]) as usize % MOST_VERSIONS;
                (width[i], height[i]) = (self.widths[number], self.heights[number]);
                (begin[i], stride[i]) = (self.begins[number], self.strides[number]);
            }
        }
        let halves = &*self.halves;
        let (x, across) = along(u, &width, self.repeats[0]);
        let (y, down) = along(v, &height, self.repeats[1]);
        let mut first = [0; LANES];
        for i in 0..LANES {
            first[i] = begin[i] + whole(y[i]) * stride[i] + CHANNELS as u32 * whole(x[i]);
        }
        for i in 0..LANES {
            if !is_asked[i] {
                continue;
            }
            let (first, span) = (first[i] as usize, stride[i] as usize + 2 * CHANNELS);
            let of = halves
                .get(first..first + span)
                .and_then(|halves| Some((*halves.first_chunk()?, *halves.last_chunk()?)));
            let Some((top, bottom)) = of else { continue };
            let (top, bottom) = (vectors.numbers(top), vectors.numbers(bottom));
            for k in 0..2 * CHANNELS {
                let between = down[i].mul_add(bottom[k] - top[k], top[k]);
                // Left texels come first.
                let share = if k < CHANNELS { 1.0 - across[i] } else { across[i] };
                sums[i][k] = (weight[i] * share).mul_add(between, sums[i][k]);
            }
        }
    }
}

/// Half floats of a version: a row and a column more than it has.
fn halves_of([width, height]: [u32; 2]) -> usize {
    CHANNELS * (width as usize + 1) * (height as usize + 1)
}

/// Whole texel that a place along a side lies after, and how far after it.
#[inline(always)]
fn along(place: &Lanes, size: &Lanes, repeats: bool) -> (Lanes, Lanes) {
    let mut at = each(|i| place[i] * size[i] - 0.5);
    if repeats {
        at = each(|i| within(at[i] - (at[i] / size[i]).floor() * size[i], size[i]));
    } else {
        at = each(|i| within(at[i], size[i] - 1.0));
    }
    let first = each(|i| lower(at[i].floor(), size[i] - 1.0));
    let share = each(|i| at[i] - first[i]);
    (first, share)
}

/// Colours of sums.
#[inline(always)]
pub(super) fn colors(sums: &Sums) -> [[f32; CHANNELS]; LANES] {
    let mut colors = [[0.0; CHANNELS]; LANES];
    for i in 0..LANES {
        for k in 0..CHANNELS {
            colors[i][k] = sums[i][k] + sums[i][CHANNELS + k];
        }
    }
    colors
}

/// No reads.
pub(super) const NO_SUMS: Sums = [[0.0; 2 * CHANNELS]; LANES];
