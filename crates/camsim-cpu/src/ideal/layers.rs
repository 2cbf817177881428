//! Surfaces with holes, and surfaces that are mixed with what is behind them. At each position all of their triangles
//! in front of what else is drawn are collected, shaded together, and mixed from the nearest to the farthest.

use half::f16;

use super::{
    CHANNELS,
    rasterise::{Band, BandExtent, CHUNK_BITS, SKY, SamplePattern},
    shade::{Block, PixelPlanes, Shader},
    triangles::{Chunk, ChunkKind},
};
use crate::simd::{
    lanes::{LANES, Lanes2, ZERO},
    vectors::{Vectors, widest},
};

/// Triangles with their number among the chunks.
type Layer<'a> = (u32, &'a Chunk);

/// A triangle of a layer at a position.
#[derive(Clone, Copy, Debug)]
struct Fragment {
    /// Index in the band.
    at: usize,
    /// near / z.
    depth: f32,
    id: u32,
}

/// Draws the layers of a band in front of its depths, over its colours as far as there is room for them.
pub(super) fn draw<P: SamplePattern>(_: P, shader: &Shader<'_>, band: &mut Band<'_>, color: &mut [u16]) {
    let mut layers: Vec<Layer<'_>> = Vec::new();
    for (number, chunk) in (0..).zip(shader.chunks) {
        if chunk.kind >= ChunkKind::Masked && !chunk.band(band.number).is_empty() {
            layers.push((number, chunk));
        }
    }
    if layers.is_empty() {
        return;
    }
    let fragments = collected::<P>(&layers, band);
    let offset_px =
        |column: usize, row: usize| P::sample_offset(column, row).map(|quarters| 0.25 * quarters as f32);
    let offsets_px = [0, 1].map(|row| [0, 1].map(|column| offset_px(column, row)));
    let first_row = band.first_row::<P>();
    mix(shader, &fragments, (first_row, &offsets_px), band, color);
}

/// Mixes the triangles of each position. `offsets_px` are those of positions from their pixels' centres in even and odd
/// rows and columns.
fn mix(
    shader: &Shader<'_>,
    fragments: &[Fragment],
    (first_row, offsets_px): (usize, &[[[f32; 2]; 2]; 2]),
    band: &mut Band<'_>,
    color: &mut [u16],
) {
    let (mut mixer, mut planes) = (Mixer::default(), PixelPlanes::new());
    for some in fragments.chunks(LANES) {
        let mut block = Block { visible: [SKY; LANES], positions: Lanes2 { x: ZERO, y: ZERO } };
        for (i, fragment) in some.iter().enumerate() {
            let (column, row) = (fragment.at % band.stride, first_row + fragment.at / band.stride);
            let [right, down] = offsets_px[row % 2][column % 2];
            block.visible[i] = fragment.id;
            (block.positions.x[i], block.positions.y[i]) = (column as f32 + right, row as f32 + down);
        }
        let has_depth = shader.has_depth(&block, &mut planes);
        let colors = match color.is_empty() {
            true => [[0.0; CHANNELS]; LANES],
            false => shader.colors(&block, &mut planes),
        };
        for (i, fragment) in some.iter().enumerate() {
            if mixer.at != fragment.at {
                mixer.finish(color);
                mixer = Mixer { at: fragment.at, ..Mixer::default() };
            }
            let blends = shader.blends(fragment.id);
            if let Some(depth) = mixer.add(&colors[i], blends, has_depth[i], fragment.depth) {
                band.depth[fragment.at] = depth;
            }
        }
    }
    mixer.finish(color);
}

/// The triangles of all layers in front of the depths of a band, the nearest of each position first.
fn collected<P: SamplePattern>(layers: &[Layer<'_>], band: &Band<'_>) -> Vec<Fragment> {
    widest!(vectors => collect::<P>(vectors, layers, band))
}

#[inline(always)]
fn collect<P: SamplePattern>(vectors: impl Vectors, layers: &[Layer<'_>], band: &Band<'_>) -> Vec<Fragment> {
    let mut fragments = Vec::new();
    // Each triangle is drawn alone, and what it covers is cleared again.
    let (mut depth, mut visible) = (band.depth.to_vec(), vec![SKY; band.visible.len()]);
    let mut alone =
        Band { number: band.number, stride: band.stride, depth: &mut depth, visible: &mut visible };
    for &(number, chunk) in layers {
        for &index in chunk.band(band.number) {
            let (triangle, id) = (&chunk.raster[index as usize], number << CHUNK_BITS | index);
            alone.draw_triangle::<P>(vectors, chunk, triangle, id);
            let BandExtent { rows, columns: [first, last], .. } = alone.extent::<P>(triangle);
            for row in rows {
                let start = (row - alone.first_row::<P>()) * alone.stride;
                for at in start + first..start + last + 1 {
                    if alone.visible[at] != SKY {
                        fragments.push(Fragment { at, depth: alone.depth[at], id });
                        (alone.visible[at], alone.depth[at]) = (SKY, band.depth[at]);
                    }
                }
            }
        }
    }
    fragments
        .sort_unstable_by(|a, b| a.at.cmp(&b.at).then(b.depth.total_cmp(&a.depth)).then(a.id.cmp(&b.id)));
    fragments
}

/// The layers of a position.
struct Mixer {
    at: usize,
    /// Linear R G B of those before.
    sum: [f32; 3],
    /// Fraction of the light from behind them.
    left: f32,
    has_depth: bool,
    /// Whether one hides all behind it.
    is_closed: bool,
}

impl Default for Mixer {
    fn default() -> Self {
        Self { at: usize::MAX, sum: [0.0; 3], left: 1.0, has_depth: false, is_closed: false }
    }
}

impl Mixer {
    /// Adds the next layer, with its colour and alpha; its depth if that is the position's.
    #[inline(always)]
    fn add(
        &mut self,
        [r, g, b, alpha]: &[f32; CHANNELS],
        blends: bool,
        has_depth: bool,
        depth: f32,
    ) -> Option<f32> {
        // A surface that does not blend is a hole where it has no depth.
        if self.is_closed || !(blends || has_depth) {
            return None;
        }
        let weight = if blends { self.left * alpha } else { self.left };
        for (sum, color) in self.sum.iter_mut().zip([r, g, b]) {
            *sum += weight * color;
        }
        self.left -= weight;
        self.is_closed = !blends;
        let is_first = has_depth && !self.has_depth;
        self.has_depth |= has_depth;
        is_first.then_some(depth)
    }

    /// Puts the layers before a colour.
    #[inline(always)]
    fn finish(&self, color: &mut [u16]) {
        let first = CHANNELS.saturating_mul(self.at);
        let Some(texel) = color.get_mut(first..).and_then(|color| color.first_chunk_mut::<3>()) else {
            return;
        };
        for (half, sum) in texel.iter_mut().zip(self.sum) {
            *half = f16::from_f32(self.left.mul_add(f16::from_bits(*half).to_f32(), sum)).to_bits();
        }
    }
}
