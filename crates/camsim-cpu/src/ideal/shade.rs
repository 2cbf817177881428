//! Colours of pixels whose triangle and depth are known: each is worked out once, whatever is behind it.

use std::{ops::Range, sync::Arc};

use camsim_plan::PrefilterTaps;

use super::{
    corners::Camera,
    cover::{CHUNK_BITS, SKY},
    picture::Picture,
    reads::{Colors, Places, colors, let_through},
    triangles::{Chunk, FLAT, Kind, Plane, SMALL, Surface},
};
use crate::simd::{
    lanes::{LANES, Lanes, Lanes2, each},
    vectors::Vectors,
};

/// What a surface looks like.
#[derive(Debug)]
pub(super) struct Paint {
    pub picture: Arc<Picture>,
    /// Factor of its colour, where that is one for all of it.
    pub tint: [f32; 3],
    pub emissive: [f32; 3],
    /// Whether triangles have a tint of their own, and what light needs.
    pub has_more: bool,
    /// Light of the sky, where light falls on it.
    pub sky: Option<f32>,
}

/// What all pixels of a frame need.
pub(super) struct Shader<'a> {
    pub camera: &'a Camera,
    pub chunks: &'a [Chunk],
    pub paints: &'a [Paint],
    pub reads: PrefilterTaps,
    /// Side of a pixel of the ideal frame, pixels as they are drawn.
    pub a_pixel: f32,
    /// Whether pixels that show nothing keep the colour that they have.
    pub is_over: bool,
}

const NO_SURFACE: Surface = Surface {
    first: [0.0; 2],
    paint: SKY,
    u: [0.0; 3],
    v: [0.0; 3],
    inverse: [0.0; 3],
    more: 0,
    large: SMALL,
};

/// Pixels of one triangle that are written together.
const AT_ONCE: usize = 8;

/// A number for each pixel, and room for those that are written together with the last one.
type Room<T> = [T; LANES + AT_ONCE];

/// What pixels have of their triangles' planes, which depth is not yet taken out of.
pub(super) struct Planes {
    paint: Room<u32>,
    /// near / z.
    inverse: Room<f32>,
    /// Texture coordinates.
    uv: [Room<f32>; 2],
    /// How texture coordinates and near / z change across and down.
    changes: [[Room<f32>; 2]; 3],
}

impl Planes {
    pub fn new() -> Self {
        let zero = [0.0; LANES + AT_ONCE];
        Self { paint: [SKY; LANES + AT_ONCE], inverse: zero, uv: [zero; 2], changes: [[zero; 2]; 3] }
    }

    /// Writes those of pixels that show a triangle, the first of them at a place and each so far beside the
    /// one before; of some beyond them too.
    #[inline(always)]
    fn write(&mut self, surface: &Surface, [x, y]: [f32; 2], step: f32, pixels: Range<usize>) {
        let Surface { first: [left, top], u, v, inverse, .. } = surface;
        let down_px = y - top;
        let begins = [
            u[2].mul_add(down_px, u[0]),
            v[2].mul_add(down_px, v[0]),
            inverse[2].mul_add(down_px, inverse[0]),
        ];
        let mut first = pixels.start;
        while first < pixels.end {
            let from_px = step.mul_add((first - pixels.start) as f32, x - left);
            for i in 0..AT_ONCE {
                let across_px = step.mul_add(i as f32, from_px);
                self.paint[first + i] = surface.paint;
                self.inverse[first + i] = inverse[1].mul_add(across_px, begins[2]);
                self.uv[0][first + i] = u[1].mul_add(across_px, begins[0]);
                self.uv[1][first + i] = v[1].mul_add(across_px, begins[1]);
                (self.changes[0][0][first + i], self.changes[0][1][first + i]) = (u[1], u[2]);
                (self.changes[1][0][first + i], self.changes[1][1][first + i]) = (v[1], v[2]);
                (self.changes[2][0][first + i], self.changes[2][1][first + i]) = (inverse[1], inverse[2]);
            }
            first += AT_ONCE;
        }
    }

    /// Texture coordinates of a large triangle, at the places of pixels.
    #[inline(always)]
    fn write_large(
        &mut self,
        [inverse, u, v]: &[[f64; 3]; 3],
        first_px: [f32; 2],
        places: &Lanes2,
        pixels: Range<usize>,
    ) {
        for i in pixels {
            let [across_px, down_px] =
                [f64::from(places.x[i] - first_px[0]), f64::from(places.y[i] - first_px[1])];
            let at = |plane: &[f64; 3]| plane[0] + plane[1] * across_px + plane[2] * down_px;
            self.inverse[i] = at(inverse) as f32;
            let times = f64::from(self.inverse[i]) / at(inverse);
            (self.uv[0][i], self.uv[1][i]) = ((at(u) * times) as f32, (at(v) * times) as f32);
        }
    }
}

/// Pixels whose colours are worked out together.
pub(super) struct Block {
    /// What each shows; [`SKY`] of those that nothing is asked of.
    pub shown: [u32; LANES],
    /// Where each is, pixels as they are drawn.
    pub places: Lanes2,
}

/// What surfaces have at pixels.
struct Seen {
    paint: [u32; LANES],
    coordinates: Places,
    /// z / near.
    z: Lanes,
}

impl Shader<'_> {
    pub fn surface(&self, shown: u32) -> &Surface {
        if shown == SKY {
            return &NO_SURFACE;
        }
        let chunk = self.chunk(shown);
        &chunk.surfaces[(shown & ((1 << CHUNK_BITS) - 1)) as usize]
    }

    pub fn chunk(&self, shown: u32) -> &Chunk {
        &self.chunks[(shown >> CHUNK_BITS) as usize]
    }

    /// Half floats of linear R G B A of pixels of a row, from `x` on.
    #[inline(always)]
    pub fn block(
        &self,
        vectors: impl Vectors,
        [x, y]: [usize; 2],
        shown: &[u32; LANES],
        planes: &mut Planes,
        out: &mut [u16],
    ) {
        let is_empty = shown.iter().all(|&shown| shown == SKY);
        if is_empty && self.is_over {
            return;
        }
        let places = Lanes2 { x: each(|i| (x + i) as f32), y: [y as f32; LANES] };
        let colors = self.colors(vectors, &Block { shown: *shown, places }, planes);
        let pairs = out.as_chunks_mut::<8>().0.iter_mut().zip(colors.as_flattened().as_chunks::<8>().0);
        for (pair, (out, pixels)) in pairs.enumerate() {
            let halves = vectors.halves(*pixels);
            if !self.is_over {
                *out = halves;
                continue;
            }
            for k in 0..8 {
                if shown[2 * pair + k / 4] != SKY {
                    out[k] = halves[k];
                }
            }
        }
    }

    /// Linear R G B A: the sky's where no surface is.
    #[inline(always)]
    pub fn colors(&self, vectors: impl Vectors, block: &Block, planes: &mut Planes) -> Colors {
        let [r, g, b, _] = self.camera.uniforms.sky;
        let mut colors = [[r, g, b, 1.0]; LANES];
        if block.shown.iter().any(|&shown| shown != SKY) {
            let seen = self.seen(block, planes);
            let mut left = seen.paint;
            while let Some(&paint) = left.iter().find(|&&paint| paint != SKY) {
                let mut is_asked = [false; LANES];
                for i in 0..LANES {
                    is_asked[i] = seen.paint[i] == paint;
                    left[i] = if is_asked[i] { SKY } else { left[i] };
                }
                self.paint(vectors, &self.paints[paint as usize], block, &seen, &is_asked, &mut colors);
            }
            self.fog(block, &seen, &mut colors);
        }
        colors
    }

    #[inline(always)]
    fn seen(&self, Block { shown, places }: &Block, planes: &mut Planes) -> Seen {
        // Neighbours mostly show the same triangle. What is written beyond its end the next one writes over.
        const { assert!(LANES == u32::BITS as usize) };
        let step = self.a_pixel;
        let mut begins = 0_u32;
        for i in 1..LANES {
            let goes_on = (shown[i] == shown[i - 1])
                & (places.x[i] - places.x[i - 1] == step)
                & (places.y[i] == places.y[i - 1]);
            begins |= u32::from(!goes_on) << i;
        }
        let mut begin = 0;
        while begin < LANES {
            let end = begins.trailing_zeros() as usize;
            begins &= begins.wrapping_sub(1);
            let surface = self.surface(shown[begin]);
            planes.write(surface, [places.x[begin], places.y[begin]], step, begin..end);
            if surface.large != SMALL {
                let large = &self.chunk(shown[begin]).large[surface.large as usize];
                planes.write_large(large, surface.first, places, begin..end);
            }
            begin = end;
        }
        let Planes {
            paint: all,
            inverse,
            uv: [u, v],
            changes: [[u_across, u_down], [v_across, v_down], [inverse_across, inverse_down]],
        } = planes;
        let mut paint = [SKY; LANES];
        paint.copy_from_slice(&all[..LANES]);
        // Where there is no surface it does not matter.
        let z = each(|i| 1.0 / if inverse[i] > 0.0 { inverse[i] } else { 1.0 });
        let (u, v) = (each(|i| u[i] * z[i]), each(|i| v[i] * z[i]));
        let change = |place: &Lanes, of: &Room<f32>, inverse: &Room<f32>| {
            each(|i| step * (of[i] - place[i] * inverse[i]) * z[i])
        };
        let across = [change(&u, u_across, inverse_across), change(&v, v_across, inverse_across)];
        let down = [change(&u, u_down, inverse_down), change(&v, v_down, inverse_down)];
        Seen { paint, coordinates: Places { uv: [u, v], across, down }, z }
    }

    #[inline(always)]
    fn paint(
        &self,
        vectors: impl Vectors,
        paint: &Paint,
        block: &Block,
        seen: &Seen,
        is_asked: &[bool; LANES],
        into: &mut Colors,
    ) {
        let read = match &*paint.picture {
            Picture::Uniform(color) => [*color; LANES],
            Picture::Texels(texels) => colors(vectors, texels, self.reads, &seen.coordinates, is_asked),
        };
        for i in 0..LANES {
            if !is_asked[i] {
                continue;
            }
            let tint = if paint.has_more { self.tint(paint, block, i, seen.z[i]) } else { paint.tint };
            for k in 0..3 {
                into[i][k] = read[i][k].mul_add(tint[k], paint.emissive[k]);
            }
        }
    }

    /// Of a triangle that has its own, in the light if that falls on it.
    #[inline(always)]
    fn tint(&self, paint: &Paint, Block { shown, places }: &Block, i: usize, z: f32) -> [f32; 3] {
        let surface = self.surface(shown[i]);
        let chunk = self.chunk(shown[i]);
        if surface.more & FLAT != 0 {
            return chunk.flats[(surface.more & !FLAT) as usize];
        }
        let [r, g, b, sun, down] = &chunk.more[surface.more as usize];
        let px = [places.x[i] - surface.first[0], places.y[i] - surface.first[1]];
        let of = |plane: &Plane| at(*plane, px) * z;
        Kind::lit(paint.sky, [of(r), of(g), of(b), of(sun), of(down)])
    }

    /// Twin of shaders/ideal/fog. Where there is no surface colours are the sky's, and remain so.
    #[inline(always)]
    fn fog(&self, Block { places, .. }: &Block, seen: &Seen, colors: &mut Colors) {
        let Camera { uniforms, focal_px, principal_px, .. } = self.camera;
        let [r, g, b, density] = uniforms.sky;
        let sky = [r, g, b];
        if density > 0.0 {
            let length = each(|i| {
                let u = (places.x[i] - principal_px[0]) / focal_px[0];
                let v = (places.y[i] - principal_px[1]) / focal_px[1];
                uniforms.near_m * seen.z[i] * (u * u + v * v + 1.0).sqrt()
            });
            let share = let_through(density, &length);
            for i in 0..LANES {
                for k in 0..3 {
                    colors[i][k] = share[i].mul_add(colors[i][k] - sky[k], sky[k]);
                }
            }
        }
    }
}

#[inline(always)]
fn at(plane: Plane, [x, y]: [f32; 2]) -> f32 {
    plane[1].mul_add(x, plane[2].mul_add(y, plane[0]))
}
