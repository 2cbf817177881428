//! Deferred shading: colours of pixels whose visible triangle and depth are known.

use std::{ops::Range, sync::Arc};

use camsim_plan::PrefilterTaps;

use super::{
    prefilter::{Colors, TexCoords, filtered_colors, fog_transmittance},
    rasterise::{CHUNK_BITS, SKY},
    texture::SurfaceTexture,
    triangles::{Chunk, FLAT, Plane, SMALL, Surface, TriangleKind},
    vertices::Camera,
};
use crate::simd::{
    lanes::{LANES, Lanes, Lanes2, clamp_to, fast_max, per_lane},
    vectors::{Vectors, widest},
};

/// Material of a surface.
#[derive(Debug)]
pub(super) struct Material {
    pub texture: Arc<SurfaceTexture>,
    /// Tint and alpha, if they are constant over the surface.
    pub tint: [f32; 4],
    pub emissive: [f32; 3],
    /// Whether it is mixed with what is behind it.
    pub blends: bool,
    /// Alpha of the full-size picture, times that of the vertices, from which on there is depth, or any surface.
    pub cutoff: Option<f32>,
    /// Whether triangles have their own tint or illumination.
    pub has_extra_attributes: bool,
    /// Strength of the sky's light, if the surface is illuminated.
    pub sky: Option<f32>,
}

/// State shared by all pixels of a frame.
pub(super) struct Shader<'a> {
    pub camera: &'a Camera,
    pub chunks: &'a [Chunk],
    pub materials: &'a [Material],
    pub taps: PrefilterTaps,
    /// Side of a pixel of the ideal frame, in pixels of the triangle grid.
    pub pixel_step: f32,
    /// Whether pixels without a triangle keep their colour.
    pub is_overlay: bool,
}

const NO_SURFACE: Surface = Surface {
    first: [0.0; 2],
    material: SKY,
    u: [0.0; 3],
    v: [0.0; 3],
    inverse_depth: [0.0; 3],
    extra: 0,
    large: SMALL,
};

/// Alpha below which the colour of a blended surface does not matter.
const LEAST_ALPHA: f32 = 1e-6;

/// Pixels of one triangle per loop iteration.
const RUN_LANES: usize = 8;

/// One value per pixel, and padding for the last iteration.
type Padded<T> = [T; LANES + RUN_LANES];

/// Attributes of pixels from the planes of their triangles, before the perspective division.
pub(super) struct PixelPlanes {
    material: Padded<u32>,
    /// near / z.
    inverse_depth: Padded<f32>,
    /// Texture coordinates times near / z.
    uv: [Padded<f32>; 2],
    /// Derivatives along x and y of both texture coordinates and of near / z.
    derivatives: [[Padded<f32>; 2]; 3],
}

impl PixelPlanes {
    pub fn new() -> Self {
        let zero = [0.0; LANES + RUN_LANES];
        Self {
            material: [SKY; LANES + RUN_LANES],
            inverse_depth: zero,
            uv: [zero; 2],
            derivatives: [[zero; 2]; 3],
        }
    }

    /// Evaluates the planes of a triangle for a run of pixels: the position of the first, and the step
    /// between them. It also writes to the padding after the run.
    #[inline(always)]
    fn write(&mut self, surface: &Surface, [x, y]: [f32; 2], step: f32, pixels: Range<usize>) {
        let Surface { first: [remaining, top], u, v, inverse_depth, .. } = surface;
        let dy_px = y - top;
        let row_start = [
            u[2].mul_add(dy_px, u[0]),
            v[2].mul_add(dy_px, v[0]),
            inverse_depth[2].mul_add(dy_px, inverse_depth[0]),
        ];
        let mut first = pixels.start;
        while first < pixels.end {
            let x0_px = step.mul_add((first - pixels.start) as f32, x - remaining);
            for i in 0..RUN_LANES {
                let dx_px = step.mul_add(i as f32, x0_px);
                self.material[first + i] = surface.material;
                self.inverse_depth[first + i] = inverse_depth[1].mul_add(dx_px, row_start[2]);
                self.uv[0][first + i] = u[1].mul_add(dx_px, row_start[0]);
                self.uv[1][first + i] = v[1].mul_add(dx_px, row_start[1]);
                (self.derivatives[0][0][first + i], self.derivatives[0][1][first + i]) = (u[1], u[2]);
                (self.derivatives[1][0][first + i], self.derivatives[1][1][first + i]) = (v[1], v[2]);
                (self.derivatives[2][0][first + i], self.derivatives[2][1][first + i]) =
                    (inverse_depth[1], inverse_depth[2]);
            }
            first += RUN_LANES;
        }
    }

    /// Evaluates the texture coordinates of a large triangle, in double precision.
    #[inline(always)]
    fn write_large_triangle(
        &mut self,
        [inverse_depth, u, v]: &[[f64; 3]; 3],
        first_px: [f32; 2],
        positions: &Lanes2,
        pixels: Range<usize>,
    ) {
        for i in pixels {
            let [dx_px, dy_px] =
                [f64::from(positions.x[i] - first_px[0]), f64::from(positions.y[i] - first_px[1])];
            let value_of = |plane: &[f64; 3]| plane[0] + plane[1] * dx_px + plane[2] * dy_px;
            self.inverse_depth[i] = value_of(inverse_depth) as f32;
            let scale = f64::from(self.inverse_depth[i]) / value_of(inverse_depth);
            (self.uv[0][i], self.uv[1][i]) = ((value_of(u) * scale) as f32, (value_of(v) * scale) as f32);
        }
    }
}

/// A block of pixels to shade.
pub(super) struct Block {
    /// Visible triangle of each pixel; [`SKY`] for pixels that are not shaded.
    pub visible: [u32; LANES],
    /// Position of each pixel, in pixels of the triangle grid.
    pub positions: Lanes2,
}

/// Surface attributes of a block.
struct BlockAttributes {
    material: [u32; LANES],
    coordinates: TexCoords,
    /// z / near.
    z: Lanes,
}

impl Shader<'_> {
    pub fn surface(&self, visible: u32) -> &Surface {
        if visible == SKY {
            return &NO_SURFACE;
        }
        let chunk = self.chunk(visible);
        &chunk.surfaces[(visible & ((1 << CHUNK_BITS) - 1)) as usize]
    }

    /// Whether a triangle is mixed with what is behind it.
    pub fn blends(&self, visible: u32) -> bool {
        self.materials.get(self.surface(visible).material as usize).is_some_and(|material| material.blends)
    }

    pub fn chunk(&self, visible: u32) -> &Chunk {
        &self.chunks[(visible >> CHUNK_BITS) as usize]
    }

    /// Shades pixels of a row from `x` on and writes them as half floats.
    #[inline(always)]
    pub fn block(
        &self,
        vectors: impl Vectors,
        [x, y]: [usize; 2],
        visible: &[u32; LANES],
        planes: &mut PixelPlanes,
        out: &mut [u16],
    ) {
        let is_empty = visible.iter().all(|&visible| visible == SKY);
        if is_empty && self.is_overlay {
            return;
        }
        let positions = Lanes2 { x: per_lane(|i| (x + i) as f32), y: [y as f32; LANES] };
        let colors = self.colors(&Block { visible: *visible, positions }, planes);
        let pairs = out.as_chunks_mut::<8>().0.iter_mut().zip(colors.as_flattened().as_chunks::<8>().0);
        for (pair, (out, pixels)) in pairs.enumerate() {
            let halves = vectors.halves_from_floats(*pixels);
            if !self.is_overlay {
                *out = halves;
                continue;
            }
            for k in 0..8 {
                if visible[2 * pair + k / 4] != SKY {
                    out[k] = halves[k];
                }
            }
        }
    }

    /// Linear R G B of a block, not premultiplied, and alpha; the sky's colour where there is no surface.
    // Not inlined: the code that reads textures is long, and its callers are several.
    pub fn colors(&self, block: &Block, planes: &mut PixelPlanes) -> Colors {
        widest!(vectors => self.colors_by(vectors, block, planes))
    }

    #[inline(always)]
    fn colors_by(&self, vectors: impl Vectors, block: &Block, planes: &mut PixelPlanes) -> Colors {
        let [r, g, b, _] = self.camera.uniforms.sky;
        let mut colors = [[r, g, b, 1.0]; LANES];
        if block.visible.iter().any(|&visible| visible != SKY) {
            let attributes = self.attributes(block, planes);
            let mut remaining = attributes.material;
            while let Some(&material) = remaining.iter().find(|&&material| material != SKY) {
                let mut is_active = [false; LANES];
                for i in 0..LANES {
                    is_active[i] = attributes.material[i] == material;
                    remaining[i] = if is_active[i] { SKY } else { remaining[i] };
                }
                self.material(
                    vectors,
                    &self.materials[material as usize],
                    block,
                    &attributes,
                    &is_active,
                    &mut colors,
                );
            }
            self.fog(block, &attributes, &mut colors);
        }
        colors
    }

    #[inline(always)]
    fn attributes(&self, Block { visible, positions }: &Block, planes: &mut PixelPlanes) -> BlockAttributes {
        // Neighbouring pixels mostly show the same triangle. Values written beyond the end of a run are
        // overwritten by the next one.
        const { assert!(LANES == u32::BITS as usize) };
        let step = self.pixel_step;
        let mut run_starts = 0_u32;
        for i in 1..LANES {
            let continues_run = (visible[i] == visible[i - 1])
                & (positions.x[i] - positions.x[i - 1] == step)
                & (positions.y[i] == positions.y[i - 1]);
            run_starts |= u32::from(!continues_run) << i;
        }
        let mut begin = 0;
        while begin < LANES {
            let end = run_starts.trailing_zeros() as usize;
            run_starts &= run_starts.wrapping_sub(1);
            let surface = self.surface(visible[begin]);
            planes.write(surface, [positions.x[begin], positions.y[begin]], step, begin..end);
            if surface.large != SMALL {
                let large = &self.chunk(visible[begin]).large[surface.large as usize];
                planes.write_large_triangle(large, surface.first, positions, begin..end);
            }
            begin = end;
        }
        let PixelPlanes {
            material: run_material,
            inverse_depth,
            uv: [u, v],
            derivatives: [[u_across, u_down], [v_across, v_down], [inverse_across, inverse_down]],
        } = planes;
        let mut material = [SKY; LANES];
        material.copy_from_slice(&run_material[..LANES]);
        // Without a surface the value does not matter.
        let z = per_lane(|i| 1.0 / if inverse_depth[i] > 0.0 { inverse_depth[i] } else { 1.0 });
        let (u, v) = (per_lane(|i| u[i] * z[i]), per_lane(|i| v[i] * z[i]));
        let derivative = |coordinate: &Lanes, slope: &Padded<f32>, inverse_depth: &Padded<f32>| {
            per_lane(|i| step * (slope[i] - coordinate[i] * inverse_depth[i]) * z[i])
        };
        let across = [derivative(&u, u_across, inverse_across), derivative(&v, v_across, inverse_across)];
        let down = [derivative(&u, u_down, inverse_down), derivative(&v, v_down, inverse_down)];
        BlockAttributes { material, coordinates: TexCoords { uv: [u, v], across, down }, z }
    }

    #[inline(always)]
    fn material(
        &self,
        vectors: impl Vectors,
        material: &Material,
        block: &Block,
        attributes: &BlockAttributes,
        is_active: &[bool; LANES],
        colors: &mut Colors,
    ) {
        let texture_colors = match &*material.texture {
            SurfaceTexture::Uniform(color) => [*color; LANES],
            SurfaceTexture::MipImage(texels) => {
                filtered_colors(vectors, texels, self.taps, &attributes.coordinates, is_active)
            }
        };
        for i in 0..LANES {
            if !is_active[i] {
                continue;
            }
            let tint = self.tint(material, block, i, attributes.z[i]);
            if material.blends {
                let alpha = texture_colors[i][3];
                for k in 0..3 {
                    let premultiplied = texture_colors[i][k].mul_add(tint[k], material.emissive[k] * alpha);
                    colors[i][k] = premultiplied / fast_max(alpha, LEAST_ALPHA);
                }
                // Beyond the triangle, at pixels that it covers in part, vertices' alpha may exceed 1.
                colors[i][3] = alpha * clamp_to(tint[3], 1.0);
                continue;
            }
            for k in 0..3 {
                colors[i][k] = texture_colors[i][k].mul_add(tint[k], material.emissive[k]);
            }
        }
    }

    /// Whether the surfaces of a block have depth: alpha is not below their cut-off.
    pub fn has_depth(&self, block: &Block, planes: &mut PixelPlanes) -> [bool; LANES] {
        widest!(vectors => self.has_depth_by(vectors, block, planes))
    }

    #[inline(always)]
    fn has_depth_by(&self, vectors: impl Vectors, block: &Block, planes: &mut PixelPlanes) -> [bool; LANES] {
        let attributes = self.attributes(block, planes);
        let (mut has_depth, mut remaining) = ([true; LANES], attributes.material);
        while let Some(&number) = remaining.iter().find(|&&material| material != SKY) {
            let material = &self.materials[number as usize];
            let mut is_active = [false; LANES];
            for i in 0..LANES {
                is_active[i] = attributes.material[i] == number;
                remaining[i] = if is_active[i] { SKY } else { remaining[i] };
            }
            let Some(cutoff) = material.cutoff else { continue };
            let alpha = match &*material.texture {
                SurfaceTexture::Uniform([.., alpha]) => [*alpha; LANES],
                SurfaceTexture::MipImage(image) => {
                    image.alpha(vectors, &attributes.coordinates.uv, &is_active)
                }
            };
            for i in 0..LANES {
                if is_active[i] {
                    let [.., tint] = self.tint(material, block, i, attributes.z[i]);
                    has_depth[i] = alpha[i] * tint >= cutoff;
                }
            }
        }
        has_depth
    }

    /// Tint of a triangle, times its illumination, and alpha.
    #[inline(always)]
    fn tint(&self, material: &Material, Block { visible, positions }: &Block, i: usize, z: f32) -> [f32; 4] {
        if !material.has_extra_attributes {
            return material.tint;
        }
        let surface = self.surface(visible[i]);
        let chunk = self.chunk(visible[i]);
        if surface.extra & FLAT != 0 {
            return chunk.flat_tints[(surface.extra & !FLAT) as usize];
        }
        let [r, g, b, a, sun, down] = &chunk.extra[surface.extra as usize];
        let offset_px = [positions.x[i] - surface.first[0], positions.y[i] - surface.first[1]];
        let attribute = |plane: &Plane| at(*plane, offset_px) * z;
        TriangleKind::illuminated(
            material.sky,
            [attribute(r), attribute(g), attribute(b), attribute(a), attribute(sun), attribute(down)],
        )
    }

    /// Applies fog. Twin of camsim-gpu/shaders/ideal/fog. Pixels without a surface have the colour of the
    /// sky, which fog does not change.
    #[inline(always)]
    fn fog(&self, Block { positions, .. }: &Block, attributes: &BlockAttributes, colors: &mut Colors) {
        let Camera { uniforms, focal_px, principal_px, .. } = self.camera;
        let [r, g, b, density] = uniforms.sky;
        let sky = [r, g, b];
        if density > 0.0 {
            let length = per_lane(|i| {
                let u = (positions.x[i] - principal_px[0]) / focal_px[0];
                let v = (positions.y[i] - principal_px[1]) / focal_px[1];
                uniforms.near_m * attributes.z[i] * (u * u + v * v + 1.0).sqrt()
            });
            let transmittance = fog_transmittance(density, &length);
            for i in 0..LANES {
                for k in 0..3 {
                    colors[i][k] = transmittance[i].mul_add(colors[i][k] - sky[k], sky[k]);
                }
            }
        }
    }
}

#[inline(always)]
fn at(plane: Plane, [x, y]: [f32; 2]) -> f32 {
    plane[1].mul_add(x, plane[2].mul_add(y, plane[0]))
}
