//! Vertices of triangles, transformed and projected; clipping at the near plane and at the guard band.

use camsim_plan::uniforms::IdealCamera;

/// Subpixel precision of vertices, as on GPUs.
pub(super) const SUBPIXELS: i32 = 1 << SUBPIXEL_BITS;
pub(super) const SUBPIXEL_BITS: u32 = 8;
/// Guard band: largest coordinate of a vertex, pixels. Products of two differences are exact in 64 bits up to
/// here.
const GUARD_BAND_PX: f32 = 32_768.0;
/// Triangles are clipped slightly inside the guard band, so that rounded results are within it.
pub(super) const CLIP_PX: f32 = 0.99 * GUARD_BAND_PX;

/// Key camera, and fog.
#[derive(Clone, Copy, Debug)]
pub(super) struct Camera {
    pub uniforms: IdealCamera,
    pub focal_px: [f32; 2],
    pub principal_px: [f32; 2],
    pub size_px: [u32; 2],
    /// Offset of sample positions from pixel centres, 1/[`SUBPIXELS`] px.
    pub sample_offset: i32,
}

/// A vertex, or a clipped point of an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertex<const N: usize> {
    pub in_camera_m: [f32; 3],
    /// Vertex attributes, beginning with texture coordinates.
    pub attributes: [f32; N],
    /// Position in the image, pixels.
    pub position_px: [f32; 2],
    pub snapped: [i32; 2],
    /// near / z.
    pub inverse_depth: f32,
    /// Whether it is inside the near plane and the guard band.
    pub is_inside: bool,
}

impl<const N: usize> Vertex<N> {
    /// A vertex that has not been projected.
    pub const UNPROJECTED: Self = Self {
        in_camera_m: [0.0; 3],
        attributes: [0.0; N],
        position_px: [0.0; 2],
        snapped: [0; 2],
        inverse_depth: 0.0,
        is_inside: false,
    };
}

impl Camera {
    /// Camera of the sample grid: a pixel per sample, 2x2 of them for each of `scale` x `scale` fine pixels.
    pub fn sample_grid(&self, scale: u32) -> Self {
        let times = 2.0 * scale as f32;
        Self {
            focal_px: self.focal_px.map(|px| times * px),
            principal_px: self.principal_px.map(|px| times * px + 0.5 * (times - 1.0)),
            size_px: self.size_px.map(|side| 2 * scale * side),
            sample_offset: SUBPIXELS / 2,
            ..*self
        }
    }

    /// Projects a vertex.
    #[inline(always)]
    pub fn project<const N: usize>(&self, in_camera_m: [f32; 3], attributes: [f32; N]) -> Vertex<N> {
        self.project_within(CLIP_PX, in_camera_m, attributes)
    }

    #[inline(always)]
    fn project_within<const N: usize>(
        &self,
        most_px: f32,
        in_camera_m: [f32; 3],
        attributes: [f32; N],
    ) -> Vertex<N> {
        let [x, y, z] = in_camera_m;
        let inverse_z = 1.0 / z;
        let x_px = (x * inverse_z).mul_add(self.focal_px[0], self.principal_px[0]);
        let y_px = (y * inverse_z).mul_add(self.focal_px[1], self.principal_px[1]);
        let is_inside = z >= self.uniforms.near_m && x_px.abs() <= most_px && y_px.abs() <= most_px;
        let on_grid =
            |px: f32| (if is_inside { px * SUBPIXELS as f32 } else { 0.0 }).round_ties_even() as i32;
        let snapped = [on_grid(x_px), on_grid(y_px)];
        Vertex {
            in_camera_m,
            attributes,
            position_px: [x_px, y_px],
            snapped,
            inverse_depth: self.uniforms.near_m * inverse_z,
            is_inside,
        }
    }

    /// Position in the image, pixels, in double precision: far outside of the image [`Vertex::position_px`]
    /// has few digits.
    pub fn exact_position_px<const N: usize>(&self, vertex: &Vertex<N>) -> [f64; 2] {
        let [x, y, z] = vertex.in_camera_m.map(f64::from);
        let coordinate =
            |side: f64, k: usize| side / z * f64::from(self.focal_px[k]) + f64::from(self.principal_px[k]);
        [coordinate(x, 0), coordinate(y, 1)]
    }

    /// Transforms a position relative to the base, metres, as `key_camera_from_base` of
    /// camsim-gpu/shaders/ideal/camera.wgsl.
    #[inline(always)]
    pub fn in_camera_m(&self, from_base_m: [f32; 3]) -> [f32; 3] {
        let uniforms = &self.uniforms;
        let from = &uniforms.camera_from_base_m;
        let offset_m = [from_base_m[0] - from[0], from_base_m[1] - from[1], from_base_m[2] - from[2]];
        let coordinate =
            |row: &[f32; 4]| row[0].mul_add(offset_m[0], row[1].mul_add(offset_m[1], row[2] * offset_m[2]));
        [
            coordinate(&uniforms.camera_from_ned_x),
            coordinate(&uniforms.camera_from_ned_y),
            coordinate(&uniforms.camera_from_ned_z),
        ]
    }

    /// Signed distances from the clipping planes; positive is inside.
    fn distances(&self, [x, y, z]: [f32; 3]) -> [f32; 5] {
        let side = |sign: f32, k: usize| (CLIP_PX + sign * self.principal_px[k]) / self.focal_px[k];
        [
            z - self.uniforms.near_m,
            side(-1.0, 0) * z - x,
            side(1.0, 0) * z + x,
            side(-1.0, 1) * z - y,
            side(1.0, 1) * z + y,
        ]
    }

    /// Clips a triangle to a convex polygon of up to eight vertices, in their order (Sutherland-Hodgman).
    #[cold]
    pub fn clip<const N: usize>(&self, triangle: [&Vertex<N>; 3]) -> Vec<Vertex<N>> {
        let mut polygon: Vec<Vertex<N>> = triangle.into_iter().copied().collect();
        for plane in 0..5 {
            let mut clipped = Vec::with_capacity(polygon.len() + 1);
            for (k, vertex) in polygon.iter().enumerate() {
                let next = &polygon[(k + 1) % polygon.len()];
                let [inside_distance, outside_distance] =
                    [vertex, next].map(|vertex| self.distances(vertex.in_camera_m)[plane]);
                if inside_distance >= 0.0 {
                    clipped.push(*vertex);
                }
                // Always from inside to outside: two triangles that share the edge get the same point.
                match (inside_distance >= 0.0, outside_distance >= 0.0) {
                    (true, false) => clipped.push(self.clip_point(
                        vertex,
                        next,
                        inside_distance / (inside_distance - outside_distance),
                    )),
                    (false, true) => clipped.push(self.clip_point(
                        next,
                        vertex,
                        outside_distance / (outside_distance - inside_distance),
                    )),
                    _ => {}
                }
            }
            polygon = clipped;
            if polygon.is_empty() {
                break;
            }
        }
        polygon.retain(|vertex| vertex.is_inside);
        polygon
    }

    fn clip_point<const N: usize>(&self, a: &Vertex<N>, b: &Vertex<N>, fraction: f32) -> Vertex<N> {
        let mix = |a: f32, b: f32| a + fraction * (b - a);
        let [x, y, z] = [0, 1, 2].map(|k| mix(a.in_camera_m[k], b.in_camera_m[k]));
        let in_camera_m = [x, y, z.max(self.uniforms.near_m)];
        self.project_within(
            GUARD_BAND_PX,
            in_camera_m,
            std::array::from_fn(|k| mix(a.attributes[k], b.attributes[k])),
        )
    }
}
