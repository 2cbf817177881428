//! Corners of triangles in the key camera and in its picture; what is behind the camera or far beside the
//! picture is cut off.

use camsim_plan::uniforms::IdealCamera;

/// Of a pixel, as on the devices: corners stand on a grid this fine.
pub(super) const SUBPIXELS: i32 = 1 << SUBPIXEL_BITS;
pub(super) const SUBPIXEL_BITS: u32 = 8;
/// How far from the first pixel a corner may be in the picture, pixels: so far products of two differences
/// are exact in 64 bits.
const FARTHEST_PX: f32 = 32_768.0;
/// Where triangles are cut, so that rounding leaves what is cut within.
pub(super) const CUT_PX: f32 = 0.99 * FARTHEST_PX;

/// Numbers of the key camera, and of fog.
#[derive(Clone, Copy, Debug)]
pub(super) struct Camera {
    pub uniforms: IdealCamera,
    pub focal_px: [f32; 2],
    pub principal_px: [f32; 2],
    pub size_px: [u32; 2],
    /// How far beside the middles of pixels it is asked what they show, 1/[`SUBPIXELS`] px.
    pub beside: i32,
}

/// A corner, or a place on a border that has been cut.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner<const N: usize> {
    pub in_camera_m: [f32; 3],
    /// What is on it: texture coordinates first.
    pub on_it: [f32; N],
    /// In the picture, pixels; and on the grid of 1/[`SUBPIXELS`] px.
    pub at_px: [f32; 2],
    pub at: [i32; 2],
    /// near / z.
    pub inverse: f32,
    /// Whether it is where it can be drawn.
    pub is_within: bool,
}

impl<const N: usize> Corner<N> {
    /// One that has not been projected.
    pub const NOWHERE: Self = Self {
        in_camera_m: [0.0; 3],
        on_it: [0.0; N],
        at_px: [0.0; 2],
        at: [0; 2],
        inverse: 0.0,
        is_within: false,
    };
}

impl Camera {
    /// The same with two by two pixels for each, one for each of its samples.
    pub fn of_samples(&self) -> Self {
        Self {
            focal_px: self.focal_px.map(|px| 2.0 * px),
            principal_px: self.principal_px.map(|px| 2.0 * px + 0.5),
            size_px: self.size_px.map(|side| 2 * side),
            beside: SUBPIXELS / 2,
            ..*self
        }
    }

    /// Projects a corner.
    #[inline(always)]
    pub fn corner<const N: usize>(&self, in_camera_m: [f32; 3], on_it: [f32; N]) -> Corner<N> {
        self.corner_within(CUT_PX, in_camera_m, on_it)
    }

    #[inline(always)]
    fn corner_within<const N: usize>(
        &self,
        most_px: f32,
        in_camera_m: [f32; 3],
        on_it: [f32; N],
    ) -> Corner<N> {
        let [x, y, z] = in_camera_m;
        let inverse_z = 1.0 / z;
        let x_px = (x * inverse_z).mul_add(self.focal_px[0], self.principal_px[0]);
        let y_px = (y * inverse_z).mul_add(self.focal_px[1], self.principal_px[1]);
        let is_within = z >= self.uniforms.near_m && x_px.abs() <= most_px && y_px.abs() <= most_px;
        let on_grid =
            |px: f32| (if is_within { px * SUBPIXELS as f32 } else { 0.0 }).round_ties_even() as i32;
        let at = [on_grid(x_px), on_grid(y_px)];
        Corner {
            in_camera_m,
            on_it,
            at_px: [x_px, y_px],
            at,
            inverse: self.uniforms.near_m * inverse_z,
            is_within,
        }
    }

    /// Where a corner is in the picture, pixels, with all digits: far beside it few are left of
    /// [`Corner::at_px`].
    pub fn place_px<const N: usize>(&self, corner: &Corner<N>) -> [f64; 2] {
        let [x, y, z] = corner.in_camera_m.map(f64::from);
        let along =
            |side: f64, k: usize| side / z * f64::from(self.focal_px[k]) + f64::from(self.principal_px[k]);
        [along(x, 0), along(y, 1)]
    }

    /// From metres relative to the base, as `in_ideal_camera` of shaders/ideal/camera.wgsl.
    #[inline(always)]
    pub fn in_camera_m(&self, from_base_m: [f32; 3]) -> [f32; 3] {
        let of = &self.uniforms;
        let from = &of.camera_from_base_m;
        let d = [from_base_m[0] - from[0], from_base_m[1] - from[1], from_base_m[2] - from[2]];
        let along = |row: &[f32; 4]| row[0].mul_add(d[0], row[1].mul_add(d[1], row[2] * d[2]));
        [along(&of.camera_from_ned_x), along(&of.camera_from_ned_y), along(&of.camera_from_ned_z)]
    }

    /// Signed distances from the planes that corners are within.
    fn distances(&self, [x, y, z]: [f32; 3]) -> [f32; 5] {
        let side = |sign: f32, k: usize| (CUT_PX + sign * self.principal_px[k]) / self.focal_px[k];
        [
            z - self.uniforms.near_m,
            side(-1.0, 0) * z - x,
            side(1.0, 0) * z + x,
            side(-1.0, 1) * z - y,
            side(1.0, 1) * z + y,
        ]
    }

    /// What is left of a triangle: a polygon with up to eight corners, in their order.
    #[cold]
    pub fn cut<const N: usize>(&self, triangle: [&Corner<N>; 3]) -> Vec<Corner<N>> {
        let mut polygon: Vec<Corner<N>> = triangle.into_iter().copied().collect();
        for plane in 0..5 {
            let mut left = Vec::with_capacity(polygon.len() + 1);
            for (k, corner) in polygon.iter().enumerate() {
                let next = &polygon[(k + 1) % polygon.len()];
                let [here, there] = [corner, next].map(|corner| self.distances(corner.in_camera_m)[plane]);
                if here >= 0.0 {
                    left.push(*corner);
                }
                // From inside outwards, whoever asks: two triangles that share the border find the same
                // place.
                match (here >= 0.0, there >= 0.0) {
                    (true, false) => left.push(self.between(corner, next, here / (here - there))),
                    (false, true) => left.push(self.between(next, corner, there / (there - here))),
                    _ => {}
                }
            }
            polygon = left;
            if polygon.is_empty() {
                break;
            }
        }
        polygon.retain(|corner| corner.is_within);
        polygon
    }

    fn between<const N: usize>(&self, a: &Corner<N>, b: &Corner<N>, share: f32) -> Corner<N> {
        let mix = |a: f32, b: f32| a + share * (b - a);
        let [x, y, z] = [0, 1, 2].map(|k| mix(a.in_camera_m[k], b.in_camera_m[k]));
        let in_camera_m = [x, y, z.max(self.uniforms.near_m)];
        self.corner_within(FARTHEST_PX, in_camera_m, std::array::from_fn(|k| mix(a.on_it[k], b.on_it[k])))
    }
}
