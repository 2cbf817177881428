//! Reads of the ideal frame.

use super::footprint::{BlockSpline, SPLINE_READS};
use crate::simd::lanes::{LANES, Lanes, Lanes2, ZERO, clamp_to, fast_max, fast_min, per_lane, to_index};
use crate::simd::vectors::Vectors;
use camsim_plan::uniforms::FrameUniforms;

/// Directions in which a surface is searched around a position that shows the sky.
const DIRECTIONS: [[f32; 2]; 8] = {
    const SIDE: f32 = std::f32::consts::FRAC_1_SQRT_2;
    [
        [1.0, 0.0],
        [SIDE, SIDE],
        [0.0, 1.0],
        [-SIDE, SIDE],
        [-1.0, 0.0],
        [-SIDE, -SIDE],
        [0.0, -1.0],
        [SIDE, -SIDE],
    ]
};

/// Half floats of a texel: R G B A.
pub(super) const CHANNELS: usize = 4;

/// Weighted sums of the left and of the right texels of a pixel's reads, to be added at the end: R G B A
/// each.
pub(super) type HalfSums = [f32; 2 * CHANNELS];

/// An ideal frame in memory.
#[derive(Clone, Copy, Debug)]
pub struct IdealTexels<'a> {
    /// Linear R G B A, half floats.
    pub color: &'a [u16],
    /// Texels from one row of `color` to the next.
    pub color_stride: u32,
    /// Reversed depth, near / z.
    pub depth: &'a [f32],
    /// Texels from one row of `depth` to the next.
    pub depth_stride: u32,
}

/// First texel of the 2x2 texels around each position, and interpolation weights.
struct TexelNeighbourhoods {
    first: [u32; LANES],
    t: Lanes2,
}

/// Texels around positions; positions outside are clamped to the frame's border. Frames are at least two
/// texels wide and high.
#[inline(always)]
fn texel_neighbourhoods(frame: &FrameUniforms, position_px: &Lanes2, stride: u32) -> TexelNeighbourhoods {
    let last = frame.ideal_size_px.map(|size| (size - 1) as f32);
    let clamped = Lanes2 {
        x: per_lane(|i| clamp_to(position_px.x[i], last[0])),
        y: per_lane(|i| clamp_to(position_px.y[i], last[1])),
    };
    let x = per_lane(|i| clamp_to(clamped.x[i].floor(), last[0] - 1.0));
    let y = per_lane(|i| clamp_to(clamped.y[i].floor(), last[1] - 1.0));
    let mut first = [0; LANES];
    for i in 0..LANES {
        first[i] = to_index(y[i]) * stride + to_index(x[i]);
    }
    TexelNeighbourhoods { first, t: clamped.minus(&Lanes2 { x, y }) }
}

impl IdealTexels<'_> {
    /// Inverse planar depth, 1/m: bilinear, which is exact on planes; the nearest texel where the four belong
    /// to different surfaces.
    #[inline(always)]
    pub(super) fn inverse_depth(&self, frame: &FrameUniforms, position_px: &Lanes2) -> Lanes {
        let TexelNeighbourhoods { first, t } = texel_neighbourhoods(frame, position_px, self.depth_stride);
        let (mut d00, mut d10, mut d01, mut d11) = (ZERO, ZERO, ZERO, ZERO);
        let span = self.depth_stride as usize + 2;
        for i in 0..LANES {
            [[d00[i], d10[i]], [d01[i], d11[i]]] = first_and_last(self.depth, first[i] as usize, span);
        }
        let per_m = 1.0 / frame.near_m;
        per_lane(|i| {
            let low = fast_min(fast_min(d00[i], d10[i]), fast_min(d01[i], d11[i]));
            let high = fast_max(fast_max(d00[i], d10[i]), fast_max(d01[i], d11[i]));
            let top = t.x[i].mul_add(d10[i] - d00[i], d00[i]);
            let bottom = t.x[i].mul_add(d11[i] - d01[i], d01[i]);
            let mixed = t.y[i].mul_add(bottom - top, top);
            let top = if t.x[i] > 0.5 { d10[i] } else { d00[i] };
            let bottom = if t.x[i] > 0.5 { d11[i] } else { d01[i] };
            let nearest = if t.y[i] > 0.5 { bottom } else { top };
            per_m * if low > 0.9 * high { mixed } else { nearest }
        })
    }

    /// Inverse planar depth at the last look-up, 1/m: where it finds the sky, that of the nearest surface
    /// within `sky_reach_px`. Twin of `surface_at` in
    /// camsim-gpu/shaders/reverse/temporal_inverse/reproject.wgsl.
    #[inline(always)]
    pub(super) fn surface_at(&self, frame: &FrameUniforms, position_px: &Lanes2) -> Lanes {
        let mut found = self.inverse_depth(frame, position_px);
        let mut is_sky = false;
        for i in 0..LANES {
            is_sky |= found[i] == 0.0;
        }
        if !is_sky {
            return found;
        }
        let last = frame.ideal_size_px.map(|size| (size - 1) as f32);
        let mut nearest = ZERO;
        for [right, down] in DIRECTIONS {
            let x = per_lane(|i| {
                clamp_to((frame.sky_reach_px.mul_add(right, position_px.x[i]) + 0.5).floor(), last[0])
            });
            let y = per_lane(|i| {
                clamp_to((frame.sky_reach_px.mul_add(down, position_px.y[i]) + 0.5).floor(), last[1])
            });
            for i in 0..LANES {
                if found[i] == 0.0 {
                    let texel =
                        to_index(y[i]) as usize * self.depth_stride as usize + to_index(x[i]) as usize;
                    nearest[i] = fast_max(nearest[i], self.depth.get(texel).copied().unwrap_or(0.0));
                }
            }
        }
        let per_m = 1.0 / frame.near_m;
        for i in 0..LANES {
            if found[i] == 0.0 {
                found[i] = per_m * nearest[i];
            }
        }
        found
    }

    /// Adds a weighted bilinear read of linear colour for each pixel that takes one, with separate sums of
    /// left and right texels.
    #[inline(always)]
    pub(super) fn add_color(
        &self,
        vectors: impl Vectors,
        frame: &FrameUniforms,
        position_px: &Lanes2,
        is_taken: impl Fn(usize) -> bool,
        weight: impl Fn(usize) -> f32,
        sum: &mut [HalfSums; LANES],
    ) {
        let TexelNeighbourhoods { first, t } = texel_neighbourhoods(frame, position_px, self.color_stride);
        let span = CHANNELS * (self.color_stride as usize + 2);
        for i in 0..LANES {
            if !is_taken(i) {
                continue;
            }
            let [top, bottom] = first_and_last(self.color, CHANNELS * first[i] as usize, span);
            let (top, bottom) = (vectors.floats_from_halves(top), vectors.floats_from_halves(bottom));
            for k in 0..2 * CHANNELS {
                let between = t.y[i].mul_add(bottom[k] - top[k], top[k]);
                // Left texels come first.
                let fraction = if k < CHANNELS { 1.0 - t.x[i] } else { t.x[i] };
                sum[i][k] = (weight(i) * fraction).mul_add(between, sum[i][k]);
            }
        }
    }

    /// Adds the mean of linear colour over a rectangle for each pixel that takes one.
    #[inline(always)]
    pub(super) fn add_area(
        &self,
        vectors: impl Vectors,
        frame: &FrameUniforms,
        position_px: &Lanes2,
        sides_px: &Lanes2,
        is_taken: impl Fn(usize) -> bool,
        sum: &mut [HalfSums; LANES],
    ) {
        let texels = |sides: &Lanes| {
            to_index(sides.iter().fold(0.0, |most: f32, &side| fast_max(most, side + 1.0)).ceil())
        };
        match [texels(&sides_px.x), texels(&sides_px.y)] {
            [0..=2, 0..=2] => self.add_areas::<2, 2>(vectors, frame, position_px, sides_px, is_taken, sum),
            [0..=4, 0..=3] => self.add_areas::<4, 3>(vectors, frame, position_px, sides_px, is_taken, sum),
            [0..=4, 0..=4] => self.add_areas::<4, 4>(vectors, frame, position_px, sides_px, is_taken, sum),
            [0..=6, 0..=5] => self.add_areas::<6, 5>(vectors, frame, position_px, sides_px, is_taken, sum),
            _ => self.add_areas::<6, 6>(vectors, frame, position_px, sides_px, is_taken, sum),
        }
    }

    /// Adds means over rectangles that touch at most COLUMNS (even) by ROWS texels.
    #[inline(always)]
    fn add_areas<const COLUMNS: usize, const ROWS: usize>(
        &self,
        vectors: impl Vectors,
        frame: &FrameUniforms,
        position_px: &Lanes2,
        sides_px: &Lanes2,
        is_taken: impl Fn(usize) -> bool,
        sum: &mut [HalfSums; LANES],
    ) {
        let (columns, rows) = (
            TexelSpan::<COLUMNS>::new(&position_px.x, &sides_px.x),
            TexelSpan::<ROWS>::new(&position_px.y, &sides_px.y),
        );
        let fraction = per_lane(|i| 1.0 / (sides_px.x[i] * sides_px.y[i]));
        let [right, bottom] =
            [(0, COLUMNS), (1, ROWS)].map(|(k, texels)| frame.ideal_size_px[k] as f32 - texels as f32);
        let mut is_inside_frame = true;
        for i in 0..LANES {
            let is_inside = (columns.first[i] >= 0.0)
                & (columns.first[i] <= right)
                & (rows.first[i] >= 0.0)
                & (rows.first[i] <= bottom);
            is_inside_frame &= !is_taken(i) | is_inside;
        }
        if !is_inside_frame {
            return self.add_pairs(vectors, frame, &columns, &rows, &fraction, is_taken, sum);
        }
        let stride = CHANNELS * self.color_stride as usize;
        for i in 0..LANES {
            if !is_taken(i) {
                continue;
            }
            let first =
                to_index(rows.first[i]) as usize * stride + CHANNELS * to_index(columns.first[i]) as usize;
            let Some(texels) = self.color.get(first..first + (ROWS - 1) * stride + COLUMNS * CHANNELS) else {
                continue;
            };
            for pair in 0..COLUMNS / 2 {
                let mut pair_sum = [0.0; 2 * CHANNELS];
                for row in 0..ROWS {
                    let texels_of_row =
                        vectors.floats_from_halves(texel_pair(texels, row * stride + 2 * CHANNELS * pair));
                    for k in 0..2 * CHANNELS {
                        pair_sum[k] = rows.weights[row][i].mul_add(texels_of_row[k], pair_sum[k]);
                    }
                }
                for k in 0..2 * CHANNELS {
                    // Left texels come first.
                    let weight = fraction[i]
                        * if k < CHANNELS {
                            columns.weights[2 * pair][i]
                        } else {
                            columns.weights[2 * pair + 1][i]
                        };
                    sum[i][k] = weight.mul_add(pair_sum[k], sum[i][k]);
                }
            }
        }
    }

    /// As `add_areas`, for rectangles that extend beyond the frame, where the border texels are repeated: by
    /// bilinear reads of two by two texels, which clamp.
    #[inline(never)]
    fn add_pairs<const COLUMNS: usize, const ROWS: usize>(
        &self,
        vectors: impl Vectors,
        frame: &FrameUniforms,
        columns: &TexelSpan<COLUMNS>,
        rows: &TexelSpan<ROWS>,
        fraction: &Lanes,
        is_taken: impl Fn(usize) -> bool,
        sum: &mut [HalfSums; LANES],
    ) {
        for row in (0..ROWS).step_by(2) {
            let [y, of_row] = rows.between(row);
            for column in (0..COLUMNS).step_by(2) {
                let [x, of_column] = columns.between(column);
                self.add_color(
                    vectors,
                    frame,
                    &Lanes2 { x, y },
                    &is_taken,
                    |i| fraction[i] * of_row[i] * of_column[i],
                    sum,
                );
            }
        }
    }

    /// Adds spline reads of linear colour for each pixel that takes one.
    #[inline(always)]
    pub(super) fn add_spline(
        &self,
        vectors: impl Vectors,
        frame: &FrameUniforms,
        spline: &BlockSpline,
        is_taken: impl Fn(usize) -> bool,
        sum: &mut [HalfSums; LANES],
    ) {
        let BlockSpline { base, columns, rows } = spline;
        let [right, bottom] = frame.ideal_size_px.map(|size| size as f32 - 3.0);
        let mut is_inside_frame = true;
        for i in 0..LANES {
            is_inside_frame &= !is_taken(i)
                | ((base.x[i] >= 1.0) & (base.x[i] <= right) & (base.y[i] >= 1.0) & (base.y[i] <= bottom));
        }
        if !is_inside_frame {
            // Beyond the frame the border texels are repeated: bilinear reads clamp.
            for read in SPLINE_READS {
                let (position_px, weight) = spline.read(read);
                self.add_color(vectors, frame, &position_px, &is_taken, |i| weight[i], sum);
            }
            return;
        }
        let stride = CHANNELS * self.color_stride as usize;
        for i in 0..LANES {
            if !is_taken(i) {
                continue;
            }
            let first =
                (to_index(base.y[i]) - 1) as usize * stride + CHANNELS * (to_index(base.x[i]) - 1) as usize;
            let Some(texels) = self.color.get(first..first + 3 * stride + 4 * CHANNELS) else { continue };
            let pair = |row: usize, column: usize| {
                vectors.floats_from_halves(texel_pair(texels, row * stride + CHANNELS * column))
            };
            let middle = [pair(0, 1), pair(3, 1)];
            let (left, right) = ([pair(1, 0), pair(2, 0)], [pair(1, 2), pair(2, 2)]);
            let [w0, w1, w2, w3] = [rows[0][i], rows[1][i], rows[2][i], rows[3][i]];
            for k in 0..2 * CHANNELS {
                // Left texels of pairs come first.
                let of =
                    |column: usize| if k < CHANNELS { columns[column][i] } else { columns[column + 1][i] };
                let outer = w3.mul_add(middle[1][k], w0 * middle[0][k]);
                let left_sum = w2.mul_add(left[1][k], w1 * left[0][k]);
                let right_sum = w2.mul_add(right[1][k], w1 * right[0][k]);
                sum[i][k] += of(2).mul_add(right_sum, of(0).mul_add(left_sum, of(1) * outer));
            }
        }
    }
}

/// Rows or columns of texels that a rectangle touches: the first one, and the covered fraction of each.
struct TexelSpan<const TEXELS: usize> {
    first: Lanes,
    weights: [Lanes; TEXELS],
}

impl<const TEXELS: usize> TexelSpan<TEXELS> {
    #[inline(always)]
    fn new(position_px: &Lanes, side_px: &Lanes) -> Self {
        let reach = per_lane(|i| 0.5 * (side_px[i] + 1.0));
        // Relative to the texel of the position, where it is exact to the last bit, however far from the
        // origin.
        let base = per_lane(|i| position_px[i].floor());
        let begin = per_lane(|i| (position_px[i] - base[i] - reach[i]).floor() + 1.0);
        let mut weights = [ZERO; TEXELS];
        for (k, weights) in weights.iter_mut().enumerate() {
            for i in 0..LANES {
                weights[i] =
                    clamp_to(reach[i] - (begin[i] + k as f32 - (position_px[i] - base[i])).abs(), 1.0);
            }
        }
        Self { first: per_lane(|i| base[i] + begin[i]), weights }
    }

    /// Position of a bilinear read that stands for a texel and the next one, and their covered fraction.
    fn between(&self, texel: usize) -> [Lanes; 2] {
        let second = self.weights.get(texel + 1).unwrap_or(&ZERO);
        let both = per_lane(|i| self.weights[texel][i] + second[i]);
        [per_lane(|i| self.first[i] + texel as f32 + second[i] / fast_max(both[i], f32::MIN_POSITIVE)), both]
    }
}

/// Two adjacent texels.
#[inline(always)]
fn texel_pair(values: &[u16], clamped: usize) -> [u16; 2 * CHANNELS] {
    values.get(clamped..).and_then(|values| values.first_chunk()).copied().unwrap_or_default()
}

/// The first and last `N` of `span` values from an index; zeros beyond the end, which no position within the
/// frame reaches.
#[inline(always)]
fn first_and_last<T: Copy + Default, const N: usize>(
    values: &[T],
    clamped: usize,
    span: usize,
) -> [[T; N]; 2] {
    let of = values
        .get(clamped..clamped + span)
        .and_then(|values| Some([*values.first_chunk()?, *values.last_chunk()?]));
    of.unwrap_or([[T::default(); N]; 2])
}

#[cfg(test)]
mod tests;
