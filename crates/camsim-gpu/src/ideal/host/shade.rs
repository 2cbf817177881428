//! Colours of pixels whose triangle and depth are known: each is worked out once, whatever is behind it.

use std::sync::Arc;

use camsim_core::plan::SurfaceReads;

use super::{
    corners::Camera,
    cover::{CHUNK_BITS, SKY},
    picture::Picture,
    reads::{Colors, Places, colors, let_through},
    triangles::{Chunk, FLAT, Kind, Plane, SMALL, Surface},
};
use crate::host::{
    lanes::{LANES, Lanes, ZERO, each},
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
    pub reads: SurfaceReads,
    /// Whether pixels that show nothing keep the colour that they have.
    pub is_over: bool,
}

const NO_SURFACE: Surface = Surface { first: [0.0; 2], paint: SKY, u: [0.0; 3], v: [0.0; 3], inverse: [0.0; 3], more: 0, large: SMALL };

/// What surfaces have at pixels.
struct Seen {
    paint: [u32; LANES],
    places: Places,
    /// z / near.
    z: Lanes,
}

impl Shader<'_> {
    fn surface(&self, shown: u32) -> &Surface {
        if shown == SKY {
            return &NO_SURFACE;
        }
        let chunk = &self.chunks[(shown >> CHUNK_BITS) as usize];
        &chunk.surfaces[(shown & ((1 << CHUNK_BITS) - 1)) as usize]
    }

    /// Half floats of linear R G B A of pixels of a row, from `x` on.
    #[inline(always)]
    pub fn block(&self, vectors: impl Vectors, [x, y]: [usize; 2], depth: &[f32; LANES], shown: &[u32; LANES], out: &mut [u16]) {
        let mut colors = [[0.0; 4]; LANES];
        let [r, g, b, _] = self.camera.uniforms.sky;
        let is_empty = shown.iter().all(|&shown| shown == SKY);
        if is_empty && self.is_over {
            return;
        }
        if is_empty {
            colors = [[r, g, b, 1.0]; LANES];
        } else {
            let seen = self.seen([x, y], depth, shown);
            let mut left = seen.paint.map(|paint| paint != SKY);
            while let Some(first) = left.iter().position(|&is_left| is_left) {
                let paint = seen.paint[first];
                let mut is_asked = [false; LANES];
                for i in 0..LANES {
                    is_asked[i] = seen.paint[i] == paint;
                    left[i] &= !is_asked[i];
                }
                self.paint(vectors, &self.paints[paint as usize], [x, y], &seen, shown, &is_asked, &mut colors);
            }
            self.fog([x, y], &seen, &mut colors);
        }
        for ((pixels, shown), out) in colors.chunks_exact(2).zip(shown.chunks_exact(2)).zip(out.chunks_exact_mut(8)) {
            let [[r0, g0, b0, a0], [r1, g1, b1, a1]] = [pixels[0], pixels[1]];
            let halves = vectors.halves([r0, g0, b0, a0, r1, g1, b1, a1]);
            let from = if self.is_over && shown[0] == SKY { 4 } else { 0 };
            let to = if self.is_over && shown[1] == SKY { 4 } else { 8 };
            if from < to {
                out[from..to].copy_from_slice(&halves[from..to]);
            }
        }
    }

    #[inline(always)]
    fn seen(&self, [x, y]: [usize; 2], depth: &[f32; LANES], shown: &[u32; LANES]) -> Seen {
        let mut paint = [SKY; LANES];
        let (mut u, mut v) = (ZERO, ZERO);
        let (mut across, mut down) = ([ZERO; 3], [ZERO; 3]);
        for i in 0..LANES {
            let surface = self.surface(shown[i]);
            paint[i] = surface.paint;
            let px = [(x + i) as f32 - surface.first[0], y as f32 - surface.first[1]];
            (u[i], v[i]) = (at(surface.u, px), at(surface.v, px));
            if surface.large != SMALL {
                let [inverse, of_u, of_v] = self.chunks[(shown[i] >> CHUNK_BITS) as usize].large[surface.large as usize];
                let at = |plane: [f64; 3]| plane[0] + plane[1] * f64::from(px[0]) + plane[2] * f64::from(px[1]);
                let times = f64::from(depth[i]) / at(inverse);
                (u[i], v[i]) = ((at(of_u) * times) as f32, (at(of_v) * times) as f32);
            }
            (across[0][i], down[0][i]) = (surface.u[1], surface.u[2]);
            (across[1][i], down[1][i]) = (surface.v[1], surface.v[2]);
            (across[2][i], down[2][i]) = (surface.inverse[1], surface.inverse[2]);
        }
        // Where there is no surface it does not matter.
        let z = each(|i| 1.0 / if depth[i] > 0.0 { depth[i] } else { 1.0 });
        let (u, v) = (each(|i| u[i] * z[i]), each(|i| v[i] * z[i]));
        let change = |place: &Lanes, of: &Lanes, inverse: &Lanes| each(|i| (of[i] - place[i] * inverse[i]) * z[i]);
        let across = [change(&u, &across[0], &across[2]), change(&v, &across[1], &across[2])];
        let down = [change(&u, &down[0], &down[2]), change(&v, &down[1], &down[2])];
        Seen { paint, places: Places { uv: [u, v], across, down }, z }
    }

    #[inline(always)]
    fn paint(
        &self,
        vectors: impl Vectors,
        paint: &Paint,
        at: [usize; 2],
        seen: &Seen,
        shown: &[u32; LANES],
        is_asked: &[bool; LANES],
        into: &mut Colors,
    ) {
        let read = match &*paint.picture {
            Picture::Uniform(color) => [*color; LANES],
            Picture::Texels(texels) => colors(vectors, texels, self.reads, &seen.places, is_asked),
        };
        for i in 0..LANES {
            if !is_asked[i] {
                continue;
            }
            let tint = if paint.has_more { self.tint(paint, [at[0] + i, at[1]], shown[i], seen.z[i]) } else { paint.tint };
            for k in 0..3 {
                into[i][k] = read[i][k].mul_add(tint[k], paint.emissive[k]);
            }
        }
    }

    /// Of a triangle that has its own, in the light if that falls on it.
    #[inline(always)]
    fn tint(&self, paint: &Paint, [x, y]: [usize; 2], shown: u32, z: f32) -> [f32; 3] {
        let surface = self.surface(shown);
        let chunk = &self.chunks[(shown >> CHUNK_BITS) as usize];
        if surface.more & FLAT != 0 {
            return chunk.flats[(surface.more & !FLAT) as usize];
        }
        let [r, g, b, sun, down] = &chunk.more[surface.more as usize];
        let px = [x as f32 - surface.first[0], y as f32 - surface.first[1]];
        let of = |plane: &Plane| at(*plane, px) * z;
        Kind::lit(paint.sky, [of(r), of(g), of(b), of(sun), of(down)])
    }

    /// Twin of shaders/ideal/fog; sky where there is no surface; no mark anywhere.
    #[inline(always)]
    fn fog(&self, [x, y]: [usize; 2], seen: &Seen, colors: &mut Colors) {
        let Camera { uniforms, focal_px, principal_px, .. } = self.camera;
        let [r, g, b, density] = uniforms.sky;
        let sky = [r, g, b];
        if density > 0.0 {
            let v = (y as f32 - principal_px[1]) / focal_px[1];
            let length = each(|i| {
                let u = ((x + i) as f32 - principal_px[0]) / focal_px[0];
                uniforms.near_m * seen.z[i] * (u * u + v * v + 1.0).sqrt()
            });
            let share = let_through(density, &length);
            for i in 0..LANES {
                for k in 0..3 {
                    colors[i][k] = share[i].mul_add(colors[i][k] - sky[k], sky[k]);
                }
            }
        }
        for (color, &paint) in colors.iter_mut().zip(&seen.paint) {
            let [red, green, blue, _] = *color;
            *color = if paint == SKY { [r, g, b, 1.0] } else { [red, green, blue, 1.0] };
        }
    }
}

#[inline(always)]
fn at(plane: Plane, [x, y]: [f32; 2]) -> f32 {
    plane[1].mul_add(x, plane[2].mul_add(y, plane[0]))
}
