//! Textures with mip levels, and bilinear reads of them.

use camsim_core::scene::{TexelForm, Texture, Wrap};

use crate::large_pages::LargeArray;
use crate::simd::{
    lanes::{LANES, Lanes, ZERO, clamp_to, fast_min, per_lane, to_index},
    vectors::Vectors,
};

/// Half floats of a texel: linear R G B A.
const CHANNELS: usize = 4;
/// Maximum number of mip levels: more than the largest texture has.
const MAX_LEVELS: usize = 32;

/// Texture of a surface.
#[derive(Debug)]
pub(super) enum SurfaceTexture {
    /// One colour, as exact as its bytes.
    Uniform([f32; CHANNELS]),
    /// An image.
    MipImage(Box<MipImage>),
}

/// An image and its mip levels, finest first, row by row. Each row and each level is padded by the texel or
/// row that follows it.
#[derive(Debug)]
pub(super) struct MipImage {
    values: LargeArray<u16>,
    /// Index of each level's first half float.
    offsets: [u32; MAX_LEVELS],
    strides: [u32; MAX_LEVELS],
    widths: [f32; MAX_LEVELS],
    heights: [f32; MAX_LEVELS],
    /// Index of the coarsest level.
    last_level: f32,
    reading: Reading,
}

/// How an image is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct Reading {
    pub wrap: [Wrap; 2],
    /// Whether the full-size image, if it alone is read, is read at its nearest texel.
    pub nearest: bool,
    /// Whether reads are weighted by alpha, as blended surfaces need it.
    pub premultiplied: bool,
}

/// Weighted sums of the reads of each pixel: R G B A of the left texels, then of the right ones.
pub(super) type Sums = [[f32; 2 * CHANNELS]; LANES];

impl SurfaceTexture {
    /// `border` is the colour around its coarser levels, if they have one.
    pub fn new(texture: &Texture, reading: Reading, border: Option<[u8; 4]>) -> Self {
        match texture.size_px {
            [1, 1] => {
                let [r, g, b, a] = texture.linear_at([0, 0]);
                let weight = if reading.premultiplied { a } else { 1.0 };
                Self::Uniform([weight * r, weight * g, weight * b, a])
            }
            _ => Self::MipImage(Box::new(MipImage::new(texture, reading, border))),
        }
    }
}

impl MipImage {
    fn new(texture: &Texture, reading: Reading, border: Option<[u8; 4]>) -> Self {
        let mut texels = Self {
            values: LargeArray::default(),
            offsets: [0; MAX_LEVELS],
            strides: [0; MAX_LEVELS],
            widths: [1.0; MAX_LEVELS],
            heights: [1.0; MAX_LEVELS],
            last_level: 0.0,
            reading,
        };
        let mips = texture.mips_with_border(TexelForm::Light, border);
        let sizes = [texture.size_px].into_iter().chain(mips.iter().map(|mip| mip.size_px));
        texels.values.fit(sizes.map(padded_len).sum());
        let mut end = texels.add(0, 0, &texture.texels(&texture.rgba8, TexelForm::Light), texture.size_px);
        for (mip, index) in mips.iter().zip(1..MAX_LEVELS) {
            end = texels.add(index, end, &mip.texels, mip.size_px);
        }
        texels
    }

    /// Adds a level from index `begin` on; returns its end.
    fn add(&mut self, index: usize, begin: usize, bytes: &[u8], size_px: [u32; 2]) -> usize {
        let [width, height] = size_px.map(|side| side as usize);
        let (row_halves, stride) = (CHANNELS * width, CHANNELS * (width + 1));
        (self.offsets[index], self.strides[index]) = (begin as u32, stride as u32);
        (self.widths[index], self.heights[index]) = (width as f32, height as f32);
        self.last_level = index as f32;
        let [repeats, repeats_rows] = self.reading.wrap.map(|wrap| wrap == Wrap::Repeat);
        let end = begin + padded_len(size_px);
        let rows = (0..height).chain([if repeats_rows { 0 } else { height - 1 }]);
        for (row, into) in rows.zip(self.values[begin..end].chunks_exact_mut(stride)) {
            let row = &bytes[2 * row_halves * row..2 * row_halves * (row + 1)];
            for (half, into) in row.chunks_exact(2).zip(&mut *into) {
                *into = u16::from_ne_bytes([half[0], half[1]]);
            }
            let next = if repeats { 0 } else { row_halves - CHANNELS };
            into.copy_within(next..next + CHANNELS, row_halves);
        }
        end
    }

    /// Size of level 0, texels.
    pub fn size(&self) -> [f32; 2] {
        [self.widths[0], self.heights[0]]
    }

    /// Alpha of the full-size image.
    #[inline(always)]
    pub fn alpha(&self, vectors: impl Vectors, [u, v]: &[Lanes; 2], is_active: &[bool; LANES]) -> Lanes {
        let mut sums = NO_SUMS;
        let is_nearest = [self.reading.nearest; LANES];
        self.add_level(vectors, u, v, &ZERO, &[1.0; LANES], is_active, &is_nearest, &mut sums);
        per_lane(|i| sums[i][CHANNELS - 1] + sums[i][2 * CHANNELS - 1])
    }

    /// Adds a weighted trilinear read for each active pixel.
    #[inline(always)]
    pub fn add_trilinear(
        &self,
        vectors: impl Vectors,
        u: &Lanes,
        v: &Lanes,
        level: &Lanes,
        weight: &Lanes,
        is_active: &[bool; LANES],
        sums: &mut Sums,
    ) {
        let (premultiplied, read_weight) = (self.reading.premultiplied, weight);
        let before = premultiplied.then(|| std::mem::replace(sums, NO_SUMS));
        let weight = if premultiplied { &[1.0; LANES] } else { weight };
        let below = per_lane(|i| clamp_to(level[i], self.last_level).floor());
        let fraction = per_lane(|i| clamp_to(level[i], self.last_level) - below[i]);
        let is_between = fraction.iter().any(|&fraction| fraction > 0.0);
        let weight_below = per_lane(|i| weight[i] * (1.0 - fraction[i]));
        let mut is_nearest = [false; LANES];
        for i in 0..LANES {
            is_nearest[i] = self.reading.nearest & (below[i] == 0.0) & (fraction[i] == 0.0);
        }
        self.add_level(vectors, u, v, &below, &weight_below, is_active, &is_nearest, sums);
        if is_between {
            let above = per_lane(|i| fast_min(below[i] + 1.0, self.last_level));
            let weight_above = per_lane(|i| weight[i] * fraction[i]);
            let mut is_blended = [false; LANES];
            for i in 0..LANES {
                is_blended[i] = is_active[i] & (fraction[i] > 0.0);
            }
            self.add_level(vectors, u, v, &above, &weight_above, &is_blended, &[false; LANES], sums);
        }
        if let Some(mut before) = before {
            let own = colors(sums);
            for i in 0..LANES {
                let [r, g, b, a] = own[i];
                for (sum, premultiplied) in before[i].iter_mut().zip([a * r, a * g, a * b, a]) {
                    *sum = read_weight[i].mul_add(premultiplied, *sum);
                }
            }
            *sums = before;
        }
    }

    #[inline(always)]
    fn add_level(
        &self,
        vectors: impl Vectors,
        u: &Lanes,
        v: &Lanes,
        level: &Lanes,
        weight: &Lanes,
        is_active: &[bool; LANES],
        is_nearest: &[bool; LANES],
        sums: &mut Sums,
    ) {
        let (mut width, mut height) = ([self.widths[0]; LANES], [self.heights[0]; LANES]);
        let (mut begin, mut stride) = ([self.offsets[0]; LANES], [self.strides[0]; LANES]);
        if level.iter().any(|&level| level > 0.0) {
            for i in 0..LANES {
                let index = to_index(level[i]) as usize % MAX_LEVELS;
                (width[i], height[i]) = (self.widths[index], self.heights[index]);
                (begin[i], stride[i]) = (self.offsets[index], self.strides[index]);
            }
        }
        let halves = &*self.values;
        let (x, mut across) = texel_and_weight(u, &width, self.reading.wrap[0]);
        let (y, mut down) = texel_and_weight(v, &height, self.reading.wrap[1]);
        if self.reading.nearest {
            across = per_lane(|i| if is_nearest[i] { (across[i] + 0.5).floor() } else { across[i] });
            down = per_lane(|i| if is_nearest[i] { (down[i] + 0.5).floor() } else { down[i] });
        }
        let mut first = [0; LANES];
        for i in 0..LANES {
            first[i] = begin[i] + to_index(y[i]) * stride[i] + CHANNELS as u32 * to_index(x[i]);
        }
        for i in 0..LANES {
            if !is_active[i] {
                continue;
            }
            let (first, span) = (first[i] as usize, stride[i] as usize + 2 * CHANNELS);
            let rows = halves
                .get(first..first + span)
                .and_then(|halves| Some((*halves.first_chunk()?, *halves.last_chunk()?)));
            let Some((top, bottom)) = rows else { continue };
            let (top, bottom) = (vectors.floats_from_halves(top), vectors.floats_from_halves(bottom));
            for k in 0..2 * CHANNELS {
                let between = down[i].mul_add(bottom[k] - top[k], top[k]);
                // Left texels come first.
                let fraction = if k < CHANNELS { 1.0 - across[i] } else { across[i] };
                sums[i][k] = (weight[i] * fraction).mul_add(between, sums[i][k]);
            }
        }
    }
}

/// Half floats of a level, with one row and one column of padding.
fn padded_len([width, height]: [u32; 2]) -> usize {
    CHANNELS * (width as usize + 1) * (height as usize + 1)
}

/// Texel before a position along an axis, and interpolation weight.
#[inline(always)]
fn texel_and_weight(coordinate: &Lanes, size: &Lanes, wrap: Wrap) -> (Lanes, Lanes) {
    let position = match wrap {
        Wrap::Clamp => per_lane(|i| clamp_to(coordinate[i] * size[i] - 0.5, size[i] - 1.0)),
        Wrap::Repeat => {
            let position = per_lane(|i| coordinate[i] * size[i] - 0.5);
            per_lane(|i| clamp_to(position[i] - (position[i] / size[i]).floor() * size[i], size[i]))
        }
        Wrap::Mirror => {
            let along = per_lane(|i| coordinate[i] - 2.0 * (0.5 * coordinate[i]).floor());
            let within = per_lane(|i| fast_min(along[i], 2.0 - along[i]));
            per_lane(|i| clamp_to(within[i] * size[i] - 0.5, size[i] - 1.0))
        }
    };
    let first = per_lane(|i| fast_min(position[i].floor(), size[i] - 1.0));
    let fraction = per_lane(|i| position[i] - first[i]);
    (first, fraction)
}

/// Adds left and right sums.
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

/// Empty sums.
pub(super) const NO_SUMS: Sums = [[0.0; 2 * CHANNELS]; LANES];
