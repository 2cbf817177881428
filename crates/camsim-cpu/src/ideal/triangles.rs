//! Triangle setup: coverage, and attributes as planes over the image.

use super::{
    TERRAIN_MATERIAL,
    rasterise::{self, PixelCentres, SMALL_PX, SamplePositions},
    vertices::{Camera, SUBPIXEL_BITS, SUBPIXELS, Vertex},
};
use crate::simd::{
    lanes::{fast_max, fast_min},
    vectors::{VECTOR_LANES, Vectors},
};

/// Triangles narrower than this, steps of the subpixel grid, have attribute planes from their snapped
/// vertices.
const THIN_STEPS: i64 = 8;
/// Mesh triangles with less than this doubled area, steps of the subpixel grid squared (one pixel), are
/// dropped if they cover no position: many of them are smaller.
const SMALLER_STEPS2: i64 = 2 * (SUBPIXELS * SUBPIXELS) as i64;
/// Rows per band.
pub(super) const BAND_ROWS: usize = 32;
/// Number of vertex attributes besides texture coordinates, if any: tint with alpha, and for illumination the
/// components of the normal towards the sun and down.
pub(super) const EXTRA_ATTRIBUTES: usize = 6;

/// An attribute as a plane over the image: value at the triangle's first pixel, and derivatives along x and
/// y.
pub(super) type Plane = [f32; 3];

/// Coverage of a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct RasterTriangle {
    /// First pixel of the bounding box, x and y.
    pub first: [u16; 2],
    pub last: [u16; 2],
    /// Vertices relative to the first pixel, 1/[`SUBPIXELS`] px, clockwise in the image.
    pub snapped: [[i32; 2]; 3],
    /// near / z.
    pub inverse_depth: Plane,
    /// Index in [`Chunk::large`], or [`SMALL`].
    pub large: u32,
}

/// Attributes of a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    /// Origin of the planes, pixels.
    pub first: [f32; 2],
    /// Index of its material.
    pub material: u32,
    /// Texture coordinate u times near / z.
    pub u: Plane,
    pub v: Plane,
    pub inverse_depth: Plane,
    /// Index in [`Chunk::extra`], or with [`FLAT`] in [`Chunk::flat_tints`].
    pub extra: u32,
    /// Index in [`Chunk::large`], or [`SMALL`].
    pub large: u32,
}

/// Value of `large` for small triangles: all their vertices are so near the first pixel that products of
/// differences fit 32 bits, and single-precision planes are accurate enough.
pub(super) const SMALL: u32 = u32::MAX;

/// Flag of `extra`: tint and illumination are constant over the triangle.
pub(super) const FLAT: u32 = 1 << 31;

/// Properties shared by triangles.
#[derive(Clone, Copy, Debug)]
pub(super) struct TriangleKind {
    pub material: u32,
    pub one_sided: bool,
    /// Strength of the sky's light, if they are illuminated.
    pub sky: Option<f32>,
}

impl TriangleKind {
    /// Tint times illumination, from the [`EXTRA_ATTRIBUTES`] attributes. Twin of
    /// camsim-gpu/shaders/ideal/light.wgsl.
    #[inline(always)]
    pub fn illuminated(sky: Option<f32>, [r, g, b, a, sun, down]: [f32; EXTRA_ATTRIBUTES]) -> [f32; 4] {
        let Some(sky) = sky else { return [r, g, b, a] };
        let light = fast_min(fast_max(fast_max(sun, 0.0) + sky * 0.5 * (1.0 - down), 0.0), 1.0);
        [r * light, g * light, b * light, a]
    }
}

/// What the triangles of a chunk are part of, in drawing order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum ChunkKind {
    #[default]
    Terrain,
    Opaque,
    /// Meshes with holes.
    Masked,
    /// Meshes that are mixed with what is behind them.
    Blended,
}

/// Triangles that are set up together, in drawing order.
#[derive(Debug, Default)]
pub(super) struct Chunk {
    pub kind: ChunkKind,
    pub raster: Vec<RasterTriangle>,
    pub surfaces: Vec<Surface>,
    /// Planes of large triangles in double precision, near / z and texture coordinates: towards a horizon
    /// little is left of the precision at the near end.
    pub large: Vec<[[f64; 3]; 3]>,
    /// Planes of the additional attributes.
    pub extra: Vec<[Plane; EXTRA_ATTRIBUTES]>,
    /// Illuminated tints of triangles whose vertices have equal attributes.
    pub flat_tints: Vec<[f32; 4]>,
    /// Indices of the triangles, sorted by band.
    in_band: Vec<u32>,
    band_starts: Vec<u32>,
}

impl Chunk {
    /// Removes all triangles, but keeps the memory.
    pub fn clear(&mut self) {
        self.raster.clear();
        self.surfaces.clear();
        self.extra.clear();
        self.large.clear();
        self.flat_tints.clear();
    }

    /// Indices of the triangles that may be in a band.
    pub fn band(&self, band: usize) -> &[u32] {
        match self.band_starts.get(band..band + 2) {
            Some(&[begin, end]) => &self.in_band[begin as usize..end as usize],
            _ => &[],
        }
    }

    /// Bins triangles into bands, in drawing order within each.
    pub fn bin(&mut self, bands: usize) {
        let bands_of = |cover: &RasterTriangle| {
            usize::from(cover.first[1]) / BAND_ROWS..usize::from(cover.last[1]) / BAND_ROWS + 1
        };
        self.band_starts.clear();
        self.band_starts.resize(bands + 2, 0);
        for cover in &self.raster {
            bands_of(cover).for_each(|band| self.band_starts[band + 2] += 1);
        }
        for band in 1..bands + 2 {
            self.band_starts[band] += self.band_starts[band - 1];
        }
        self.in_band.clear();
        self.in_band.resize(self.band_starts[bands + 1] as usize, 0);
        for (number, cover) in self.raster.iter().enumerate() {
            for band in bands_of(cover) {
                let relative = &mut self.band_starts[band + 1];
                self.in_band[*relative as usize] = number as u32;
                *relative += 1;
            }
        }
        self.band_starts.pop();
    }

    /// Adds a triangle, clipped if necessary.
    #[inline(always)]
    pub fn add<const N: usize>(
        &mut self,
        vectors: impl Vectors,
        camera: &Camera,
        vertices: [&Vertex<N>; 3],
        kind: TriangleKind,
    ) {
        if vertices.iter().all(|vertex| vertex.is_inside) {
            return self.set_up(vectors, camera, vertices, kind);
        }
        self.add_clipped(vectors, camera, vertices, kind);
    }

    #[cold]
    fn add_clipped<const N: usize>(
        &mut self,
        vectors: impl Vectors,
        camera: &Camera,
        vertices: [&Vertex<N>; 3],
        kind: TriangleKind,
    ) {
        if vertices.iter().all(|vertex| vertex.in_camera_m[2] < camera.uniforms.near_m) {
            return;
        }
        let polygon = camera.clip(vertices);
        for pair in polygon.windows(2).skip(1) {
            self.set_up(vectors, camera, [&polygon[0], &pair[0], &pair[1]], kind);
        }
    }

    #[inline(always)]
    fn set_up<const N: usize>(
        &mut self,
        vectors: impl Vectors,
        camera: &Camera,
        vertices: [&Vertex<N>; 3],
        kind: TriangleKind,
    ) {
        // Long because: one straight computation in the hot path, whose parts share most of their values.
        let [a, b, c] = vertices;
        let [ax, ay, bx, by, cx, cy] =
            [a.snapped[0], a.snapped[1], b.snapped[0], b.snapped[1], c.snapped[0], c.snapped[1]];
        let (min_x, max_x) = (ax.min(bx).min(cx), ax.max(bx).max(cx));
        let (min_y, max_y) = (ay.min(by).min(cy), ay.max(by).max(cy));
        // Pixels of the bounding box whose positions are tested.
        let sample_offset = camera.sample_offset;
        let first =
            [min_x, min_y].map(|least| ((least + SUBPIXELS - 1 - sample_offset) >> SUBPIXEL_BITS).max(0));
        let last = [(max_x, 0), (max_y, 1)]
            .map(|(most, k)| ((most + sample_offset) >> SUBPIXEL_BITS).min(camera.size_px[k] as i32 - 1));
        if first[0] > last[0] || first[1] > last[1] {
            return;
        }
        let area2 = i64::from(bx - ax) * i64::from(cy - ay) - i64::from(by - ay) * i64::from(cx - ax);
        if area2 == 0 || (area2 > 0 && kind.one_sided) {
            return;
        }
        let (is_front, b, c) = if area2 < 0 { (true, c, b) } else { (false, b, c) };
        let from = [first[0] << SUBPIXEL_BITS, first[1] << SUBPIXEL_BITS];
        let relative = |vertex: &Vertex<N>| [vertex.snapped[0] - from[0], vertex.snapped[1] - from[1]];
        let snapped = [relative(a), relative(b), relative(c)];
        let fits_32_bits = |[x, y]: [i32; 2]| x.abs().max(y.abs()) <= SMALL_PX * SUBPIXELS;
        let is_small = fits_32_bits(snapped[0]) & fits_32_bits(snapped[1]) & fits_32_bits(snapped[2]);
        if kind.material != TERRAIN_MATERIAL
            && is_small
            && area2.abs() < SMALLER_STEPS2
            && !covers_any_position(vectors, camera, snapped, first, last)
        {
            return;
        }
        // Coverage follows the snapped vertices, but attributes follow the exact ones: half a step of the
        // subpixel grid matters towards a horizon. Not for thin triangles, where attributes would extrapolate
        // far beyond the values at the vertices.
        let manhattan = |to: &Vertex<N>| {
            i64::from((to.snapped[0] - a.snapped[0]).abs() + (to.snapped[1] - a.snapped[1]).abs())
        };
        let is_thin = area2.abs() < THIN_STEPS * (manhattan(b) + manhattan(c));
        const PX: f32 = 1.0 / SUBPIXELS as f32;
        let first_px = [first[0] as f32, first[1] as f32];
        let [a_px, b_px, c_px] = match is_thin {
            true => snapped.map(|[x, y]| [x as f32 * PX, y as f32 * PX]),
            false => [a, b, c]
                .map(|vertex| [vertex.position_px[0] - first_px[0], vertex.position_px[1] - first_px[1]]),
        };
        let large = if is_small {
            SMALL
        } else {
            self.add_large(camera, [a, b, c], is_thin.then_some(&snapped), first_px)
        };
        let (to_b, to_c) = ([b_px[0] - a_px[0], b_px[1] - a_px[1]], [c_px[0] - a_px[0], c_px[1] - a_px[1]]);
        let per_area = 1.0 / (to_b[0] * to_c[1] - to_b[1] * to_c[0]);
        let plane = |value_a: f32, value_b: f32, value_c: f32| -> Plane {
            let (value_b, value_c) = (value_b - value_a, value_c - value_a);
            let across = (value_b * to_c[1] - value_c * to_b[1]) * per_area;
            let down = (value_c * to_b[0] - value_b * to_c[0]) * per_area;
            [value_a - across * a_px[0] - down * a_px[1], across, down]
        };
        let over_z = |k: usize| {
            plane(
                a.attributes[k] * a.inverse_depth,
                b.attributes[k] * b.inverse_depth,
                c.attributes[k] * c.inverse_depth,
            )
        };
        let inverse_depth = plane(a.inverse_depth, b.inverse_depth, c.inverse_depth);
        let [first, last] = [[first[0] as u16, first[1] as u16], [last[0] as u16, last[1] as u16]];
        let extra =
            if N == 2 + EXTRA_ATTRIBUTES { self.add_extra([a, b, c], kind.sky, is_front, over_z) } else { 0 };
        self.raster.push(RasterTriangle { first, last, snapped, inverse_depth, large });
        self.surfaces.push(Surface {
            first: [f32::from(first[0]), f32::from(first[1])],
            material: kind.material,
            u: over_z(0),
            v: over_z(1),
            inverse_depth,
            extra,
            large,
        });
    }

    /// Stores the additional attributes of a triangle; returns their index.
    #[inline(always)]
    fn add_extra<const N: usize>(
        &mut self,
        vertices: [&Vertex<N>; 3],
        sky: Option<f32>,
        is_front: bool,
        plane: impl Fn(usize) -> Plane,
    ) -> u32 {
        // The back side has the opposite normal.
        let sign = if is_front { 1.0 } else { -1.0 };
        let [a, b, c] = vertices;
        if a.attributes[2..] == b.attributes[2..] && a.attributes[2..] == c.attributes[2..] {
            let attribute = |k: usize| if k < 4 { a.attributes[2 + k] } else { sign * a.attributes[2 + k] };
            let attributes =
                [attribute(0), attribute(1), attribute(2), attribute(3), attribute(4), attribute(5)];
            self.flat_tints.push(TriangleKind::illuminated(sky, attributes));
            return FLAT | (self.flat_tints.len() as u32 - 1);
        }
        let (mut sun, mut down) = (plane(6), plane(7));
        for k in 0..3 {
            (sun[k], down[k]) = (sign * sun[k], sign * down[k]);
        }
        self.extra.push([plane(2), plane(3), plane(4), plane(5), sun, down]);
        self.extra.len() as u32 - 1
    }

    /// Stores the double-precision planes of a large triangle, from its snapped vertices if those are given;
    /// returns their index.
    #[cold]
    fn add_large<const N: usize>(
        &mut self,
        camera: &Camera,
        vertices: [&Vertex<N>; 3],
        snapped: Option<&[[i32; 2]; 3]>,
        first_px: [f32; 2],
    ) -> u32 {
        let [a_px, b, c] = match snapped {
            Some(snapped) => {
                snapped.map(|vertex| vertex.map(|steps| f64::from(steps) / f64::from(SUBPIXELS)))
            }
            None => vertices.map(|vertex| {
                let [x, y] = camera.exact_position_px(vertex);
                [x - f64::from(first_px[0]), y - f64::from(first_px[1])]
            }),
        };
        let [to_b, to_c] = [b, c].map(|to| [to[0] - a_px[0], to[1] - a_px[1]]);
        let per_area = 1.0 / (to_b[0] * to_c[1] - to_b[1] * to_c[0]);
        let plane = |values: [f64; 3]| {
            let (value_b, value_c) = (values[1] - values[0], values[2] - values[0]);
            let across = (value_b * to_c[1] - value_c * to_b[1]) * per_area;
            let down = (value_c * to_b[0] - value_b * to_c[0]) * per_area;
            [values[0] - across * a_px[0] - down * a_px[1], across, down]
        };
        let inverse_depth =
            vertices.map(|vertex| f64::from(camera.uniforms.near_m) / f64::from(vertex.in_camera_m[2]));
        let over_z = |k: usize| {
            plane(
                [0, 1, 2]
                    .map(|vertex: usize| f64::from(vertices[vertex].attributes[k]) * inverse_depth[vertex]),
            )
        };
        self.large.push([plane(inverse_depth), over_z(0), over_z(1)]);
        self.large.len() as u32 - 1
    }
}

/// Whether a small mesh triangle covers any position: pixel centres, or four samples per pixel.
#[inline(always)]
fn covers_any_position(
    vectors: impl Vectors,
    camera: &Camera,
    snapped: [[i32; 2]; 3],
    first: [i32; 2],
    last: [i32; 2],
) -> bool {
    let is_wide = last[0] - first[0] >= VECTOR_LANES as i32;
    is_wide
        || match camera.sample_offset {
            0 => rasterise::covers_any_position::<PixelCentres>(vectors, snapped, first, last),
            _ => rasterise::covers_any_position::<SamplePositions>(vectors, snapped, first, last),
        }
}
