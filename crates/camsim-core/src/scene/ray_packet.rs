//! Rays that are traced together, as those of neighbouring pixels: exactly what each would meet alone.
//!
//! The packet has axes of its own: z along the rays, x and y across, about a point near all origins. There a ray
//! is `o + t (u, v, 1)`. Half-spaces that hold all rays, the [`Beam`], leave out boxes and triangles beside them.
//! A ray passes a triangle a, b, c on one side of all edges:
//!
//! ```text
//! e = (u, v, 1) . (c x b) + m . (c - b) and so on, all positive or all negative,     m = (u, v, 1) x o
//! ```
//!
//! Single precision decides nearly all rays; those nearer to an edge than its rounding are left to
//! [`super::terrain::intersect_triangle`]. Ray parameters are in f64.

#![expect(clippy::needless_range_loop, reason = "numbers of one ray have one index in all arrays")]

use glam::{DMat3, DVec3};

use super::TerrainTriangle;

/// Most rays of a packet.
pub const PACKET_RAYS: usize = 64;
/// Rays that are next to each other in memory, as the pixels of a row.
const ROW: usize = 8;
/// Angle by which the beam is wider than its rays: far above rounding.
const ROUNDING: f64 = 1e-9;
/// No triangle.
const NONE: u32 = u32::MAX;

const ROWS: usize = PACKET_RAYS / ROW;

/// One number for each ray.
type PerRay<T> = [[T; ROW]; ROWS];

/// A ray of a packet: `origin + t direction`, 0 <= t <= limit.
#[derive(Clone, Copy, Debug)]
pub struct PacketRay {
    /// Path time, seconds, for what moves.
    pub t_s: f64,
    /// NED, metres.
    pub origin_ned_m: DVec3,
    /// NED, of any length.
    pub direction_ned: DVec3,
    /// Largest ray parameter; below 0 for a ray that is not there.
    pub limit: f64,
}

impl PacketRay {
    /// The place of a ray that is not there.
    pub const NONE: Self = Self { t_s: 0.0, origin_ned_m: DVec3::ZERO, direction_ned: DVec3::Z, limit: -1.0 };

    /// Whether there is a ray.
    #[must_use]
    pub fn is_there(&self) -> bool {
        self.limit >= 0.0
    }
}

/// What a ray of a packet has met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PacketHit {
    /// Ray parameter.
    pub t: f64,
    /// 0 = terrain, 1 + i = mesh i of the scene.
    pub surface: u32,
    /// The triangle, on the terrain.
    pub triangle: Option<TerrainTriangle>,
    /// Unit normal of the triangle, NED, of either sign.
    pub normal_ned: DVec3,
}

/// Half-spaces `normal . x >= least` that hold all rays of a packet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beam {
    pub sides: [(DVec3, f64); 5],
    /// Distance along the packet: `forward . x - start`.
    pub forward: DVec3,
    pub start: f64,
}

/// From which side a triangle is met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Faces {
    Both,
    /// Corners are anticlockwise.
    Front,
    /// Each ray is left to f64, for holes.
    Holed,
}

/// What a triangle belongs to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PacketSurface {
    pub surface: u32,
    pub triangle: Option<TerrainTriangle>,
    pub faces: Faces,
}

/// A triangle that rays have met.
#[derive(Clone, Copy, Debug)]
struct Met {
    surface: u32,
    triangle: Option<TerrainTriangle>,
    normal_ned: DVec3,
}

/// Rays that go nearly the same way from nearly the same place.
#[derive(Debug)]
pub struct RayPacket {
    rays: [PacketRay; PACKET_RAYS],
    /// Origin and axes of the packet.
    origin_ned_m: DVec3,
    packet_from_ned: DMat3,
    /// Rays in the packet's axes.
    origin: [PerRay<f64>; 3],
    uv: [PerRay<f64>; 2],
    uv_f32: [PerRay<f32>; 2],
    /// `(u, v, 1) x o`.
    moment: [PerRay<f32>; 3],
    /// z of the direction, and ray parameters of the nearest hits for z = 1.
    z: PerRay<f64>,
    limit: PerRay<f64>,
    found: PerRay<u32>,
    met: Vec<Met>,
    /// Smallest and largest u and v of all rays, and of each row and column of rays.
    bounds: [[f64; 2]; 2],
    row_bounds: [[f32; ROWS]; 2],
    column_bounds: [[f32; ROW]; 2],
    /// Farthest origin, metres.
    spread_m: f64,
    /// Beyond the nearest hits of all rays.
    farthest_m: f64,
}

impl Default for RayPacket {
    fn default() -> Self {
        Self {
            rays: [PacketRay::NONE; PACKET_RAYS],
            origin_ned_m: DVec3::ZERO,
            packet_from_ned: DMat3::IDENTITY,
            origin: Default::default(),
            uv: Default::default(),
            uv_f32: Default::default(),
            moment: Default::default(),
            z: Default::default(),
            limit: Default::default(),
            found: Default::default(),
            met: Vec::new(),
            bounds: [[0.0; 2]; 2],
            row_bounds: Default::default(),
            column_bounds: Default::default(),
            spread_m: 0.0,
            farthest_m: 0.0,
        }
    }
}

impl RayPacket {
    /// Begins with other rays. False for rays that go too far apart, or are not finite: each is then to be
    /// traced alone.
    #[must_use]
    pub fn begin(&mut self, rays: &[PacketRay; PACKET_RAYS]) -> bool {
        crate::simd::with_widest(
            #[inline(always)]
            || self.begin_by_widest(rays),
        )
    }

    #[inline(always)]
    fn begin_by_widest(&mut self, rays: &[PacketRay; PACKET_RAYS]) -> bool {
        /// Least cosine of the angle between a ray and the packet.
        const LEAST_Z: f64 = 0.5;
        self.met.clear();
        self.found = [[NONE; ROW]; ROWS];
        self.rays = *rays;
        let Some(first) = rays.iter().find(|ray| ray.is_there()) else {
            (self.limit, self.farthest_m) = ([[-1.0; ROW]; ROWS], -1.0);
            return true;
        };
        // Rays that are not there take the place of one that is.
        self.rays.iter_mut().filter(|ray| !ray.is_there()).for_each(|ray| {
            (ray.origin_ned_m, ray.direction_ned) = (first.origin_ned_m, first.direction_ned);
        });
        let middle = self.rays[PACKET_RAYS / 2 + ROW / 2];
        self.origin_ned_m = middle.origin_ned_m;
        let forward = middle.direction_ned.normalize();
        let across = self.rays[ROW - 1].direction_ned - self.rays[0].direction_ned;
        let across = (across - across.dot(forward) * forward).try_normalize();
        let right = across.unwrap_or_else(|| forward.any_orthonormal_vector());
        self.packet_from_ned = DMat3::from_cols(right, forward.cross(right), forward).transpose();
        let [x, y, z] = [right, forward.cross(right), forward];
        let (mut low, mut high, mut spread2, mut is_together) =
            ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2], 0.0_f64, true);
        for (row, rays) in self.rays.chunks_exact(ROW).enumerate() {
            for (k, ray) in rays.iter().enumerate() {
                let (from, along) = (ray.origin_ned_m - self.origin_ned_m, ray.direction_ned);
                let direction = [x.dot(along), y.dot(along), z.dot(along)];
                let origin = [x.dot(from), y.dot(from), z.dot(from)];
                let per_z = 1.0 / direction[2];
                for axis in 0..3 {
                    self.origin[axis][row][k] = origin[axis];
                }
                for axis in 0..2 {
                    let value = direction[axis] * per_z;
                    self.uv[axis][row][k] = value;
                    self.uv_f32[axis][row][k] = value as f32;
                    low[axis] = if value < low[axis] { value } else { low[axis] };
                    high[axis] = if value > high[axis] { value } else { high[axis] };
                }
                let [u, v] = [self.uv[0][row][k], self.uv[1][row][k]];
                let moment =
                    [v * origin[2] - origin[1], origin[0] - u * origin[2], u * origin[1] - v * origin[0]];
                for axis in 0..3 {
                    self.moment[axis][row][k] = moment[axis] as f32;
                }
                self.z[row][k] = direction[2];
                self.limit[row][k] = ray.limit * direction[2];
                let (length2, far2) = (along.length_squared(), from.length_squared());
                spread2 = if far2 > spread2 { far2 } else { spread2 };
                let cosine2 = direction[2] * direction[2].abs() / length2;
                // False for NaN.
                is_together &= (cosine2 >= LEAST_Z * LEAST_Z) & (far2 < f64::INFINITY);
            }
        }
        self.bounds = [0, 1].map(|axis: usize| [low[axis] - ROUNDING, high[axis] + ROUNDING]);
        self.find_bounds();
        self.spread_m = spread2.sqrt();
        self.find_farthest();
        is_together
    }

    #[inline(always)]
    fn find_bounds(&mut self) {
        self.row_bounds = [[f32::INFINITY; ROWS], [f32::NEG_INFINITY; ROWS]];
        self.column_bounds = [[f32::INFINITY; ROW], [f32::NEG_INFINITY; ROW]];
        let wider = |[low, high]: &mut [f32; 2], value: f32| {
            *low = if value < *low { value } else { *low };
            *high = if value > *high { value } else { *high };
        };
        for row in 0..ROWS {
            let mut of_row = [f32::INFINITY, f32::NEG_INFINITY];
            for k in 0..ROW {
                wider(&mut of_row, self.uv_f32[1][row][k]);
                let mut of_column = self.column_bounds.map(|bound| bound[k]);
                wider(&mut of_column, self.uv_f32[0][row][k]);
                [self.column_bounds[0][k], self.column_bounds[1][k]] = of_column;
            }
            [self.row_bounds[0][row], self.row_bounds[1][row]] = of_row;
        }
    }

    /// Bits of the rows of rays that may meet a triangle; none if no column may. All for a triangle that is not in
    /// front.
    #[inline(always)]
    fn rows_beside(&self, [a, b, c]: &[DVec3; 3]) -> u32 {
        /// Of a quotient in single precision, with a reserve.
        const SINGLE: f64 = 1e-6;
        let per_z = [1.0 / a.z, 1.0 / b.z, 1.0 / c.z];
        let nearest = a.z.min(b.z).min(c.z) - self.spread_m;
        // False for NaN.
        let is_in_front = nearest > 0.0;
        if !is_in_front {
            return u32::MAX;
        }
        let span = |at: [f64; 3]| {
            let at = [at[0] * per_z[0], at[1] * per_z[1], at[2] * per_z[2]];
            let (low, high) = (at[0].min(at[1]).min(at[2]), at[0].max(at[1]).max(at[2]));
            // Seen from a ray's own origin o: |(x - o_x) / (z - o_z) - x / z| <= |o| (1 + |x / z|) / (z - |o|).
            let pad = (SINGLE + self.spread_m / nearest) * (1.0 + low.abs().max(high.abs()));
            [(low - pad) as f32, (high + pad) as f32]
        };
        let [low, high] = span([a.x, b.x, c.x]);
        let (mut columns, mut rows) = (0, 0);
        for k in 0..ROW {
            columns |= u32::from((self.column_bounds[0][k] <= high) & (self.column_bounds[1][k] >= low)) << k;
        }
        let [low, high] = span([a.y, b.y, c.y]);
        for k in 0..ROWS {
            rows |= u32::from((self.row_bounds[0][k] <= high) & (self.row_bounds[1][k] >= low)) << k;
        }
        if columns == 0 { 0 } else { rows }
    }

    /// Whether any ray may still meet something at this distance along the packet.
    pub(crate) fn farthest_m(&self) -> f64 {
        self.farthest_m
    }

    #[inline(always)]
    pub(crate) fn find_farthest(&mut self) {
        let mut most = [f64::NEG_INFINITY; ROW];
        for row in &self.limit {
            for k in 0..ROW {
                most[k] = if row[k] > most[k] { row[k] } else { most[k] };
            }
        }
        let most = most.into_iter().fold(f64::NEG_INFINITY, f64::max);
        self.farthest_m = most + self.spread_m;
    }

    /// The half-spaces that hold the rays, NED.
    pub(crate) fn beam(&self) -> Beam {
        let [x, y, z] = [0, 1, 2].map(|k| self.packet_from_ned.row(k));
        let [[left, right], [top, bottom]] = self.bounds;
        let side = |normal: DVec3, slope: f64| {
            (normal, normal.dot(self.origin_ned_m) - self.spread_m * (1.0 + slope.abs()))
        };
        Beam {
            sides: [
                side(x - left * z, left),
                side(right * z - x, right),
                side(y - top * z, top),
                side(bottom * z - y, bottom),
                side(z, 0.0),
            ],
            forward: z,
            start: z.dot(self.origin_ned_m),
        }
    }

    /// From NED to the packet's axes, and its origin.
    pub(crate) fn axes(&self) -> (DMat3, DVec3) {
        (self.packet_from_ned, self.origin_ned_m)
    }

    /// Bits for the sides of the beam that a point of the packet's axes is beyond. None for NaN.
    #[inline(always)]
    pub(crate) fn sides_beyond(&self, [x, y, z]: [f64; 3]) -> u32 {
        let [[left, right], [top, bottom]] = self.bounds;
        let beyond = |by: f64, slope: f64, bit: u32| {
            if by > self.spread_m * (1.0 + slope.abs()) { bit } else { 0 }
        };
        beyond(left * z - x, left, 1)
            | beyond(x - right * z, right, 2)
            | beyond(top * z - y, top, 4)
            | beyond(y - bottom * z, bottom, 8)
            | beyond(-z, 0.0, 16)
            | if z > self.farthest_m { 32 } else { 0 }
    }

    /// Meets a triangle, by its corners in the packet's axes. `exact` is the ray parameter of a ray, at most that
    /// given, by the corners in NED. It decides near edges.
    #[inline(always)]
    pub(crate) fn meet(
        &mut self,
        corners: [DVec3; 3],
        PacketSurface { surface, triangle, faces }: PacketSurface,
        exact: impl Fn(&PacketRay, f64) -> Option<f64>,
    ) {
        let mut rows = self.rows_beside(&corners) & ((1 << ROWS) - 1);
        if rows == 0 {
            return;
        }
        let [a, b, c] = corners;
        let edges = [c.cross(b), a.cross(c), b.cross(a)];
        let sides = [c - b, a - c, b - a];
        let normal = (b - a).cross(c - a);
        let height = a.dot(normal);
        let slack = self.slack(&corners, &edges, &sides);
        let is_two_sided = faces != Faces::Front;
        let [[x0, y0, z0], [x1, y1, z1], [x2, y2, z2]] = edges.map(|edge| edge.as_vec3().to_array());
        let [[p0, q0, r0], [p1, q1, r1], [p2, q2, r2]] = sides.map(|side| side.as_vec3().to_array());
        let id = self.met.len() as u32;
        let mut is_met = false;
        while rows != 0 {
            let row = rows.trailing_zeros() as usize;
            rows &= rows - 1;
            let (u, v) = (&self.uv_f32[0][row], &self.uv_f32[1][row]);
            // How far inside all edges, from the front or from the back.
            let mut inside = [0.0_f32; ROW];
            let [p, q, r] = [0, 1, 2].map(|axis| &self.moment[axis][row]);
            for k in 0..ROW {
                let of_origin = [
                    p0.mul_add(p[k], q0.mul_add(q[k], r0 * r[k])),
                    p1.mul_add(p[k], q1.mul_add(q[k], r1 * r[k])),
                    p2.mul_add(p[k], q2.mul_add(q[k], r2 * r[k])),
                ];
                let e0 = x0.mul_add(u[k], y0.mul_add(v[k], z0 + of_origin[0]));
                let e1 = x1.mul_add(u[k], y1.mul_add(v[k], z1 + of_origin[1]));
                let e2 = x2.mul_add(u[k], y2.mul_add(v[k], z2 + of_origin[2]));
                let low = if e0 < e1 { e0 } else { e1 };
                let low = if e2 < low { e2 } else { low };
                let high = if e0 > e1 { e0 } else { e1 };
                let high = if e2 > high { e2 } else { high };
                inside[k] = if (low > -high) | !is_two_sided { low } else { -high };
            }
            let (mut sure, mut open) = (0_u32, 0_u32);
            for k in 0..ROW {
                sure |= u32::from(inside[k] > slack) << k;
                open |= u32::from(inside[k] >= -slack) << k;
            }
            // NaN is in neither.
            if open == 0 {
                continue;
            }
            let (u, v) = (&self.uv[0][row], &self.uv[1][row]);
            let [x, y, z] = [0, 1, 2].map(|axis| &self.origin[axis][row]);
            let mut t = [0.0; ROW];
            for k in 0..ROW {
                let above = height - normal.x * x[k] - normal.y * y[k] - normal.z * z[k];
                t[k] = above / (normal.x * u[k] + normal.y * v[k] + normal.z);
            }
            let mut bits = open;
            while bits != 0 {
                let k = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let limit = self.limit[row][k];
                let at = if faces != Faces::Holed && sure >> k & 1 == 1 {
                    t[k]
                } else {
                    let z = self.z[row][k];
                    exact(&self.rays[ROW * row + k], limit / z).map_or(f64::NAN, |t| t * z)
                };
                if at >= 0.0 && at <= limit {
                    self.limit[row][k] = at;
                    self.found[row][k] = id;
                    is_met = true;
                }
            }
        }
        if is_met {
            let normal_ned = (self.packet_from_ned.transpose() * normal).normalize_or_zero();
            self.met.push(Met { surface, triangle, normal_ned });
        }
    }

    /// Bound of the rounding of an edge function in single precision.
    #[inline(always)]
    fn slack(&self, corners: &[DVec3; 3], edges: &[DVec3; 3], sides: &[DVec3; 3]) -> f32 {
        /// Of six products and their sums in single precision, relative to their sizes.
        const SINGLE: f64 = 6e-7;
        /// As in [`super::terrain::intersect_triangle`], with a reserve.
        const DOUBLE: f64 = 1e-14;
        let [a, b, c] = *corners;
        let [u, v] = self.bounds.map(|[low, high]| low.abs().max(high.abs()));
        let size = |edge: &DVec3| edge.x.abs() * u + edge.y.abs() * v + edge.z.abs();
        let size = size(&edges[0]).max(size(&edges[1])).max(size(&edges[2]));
        let length = sides.map(|side| side.abs().element_sum());
        let length = length[0].max(length[1]).max(length[2]);
        let reach = a.abs().max(b.abs()).max(c.abs()).max_element() + self.spread_m;
        // No coordinate of a moment is larger than |o| (1 + |u| + |v|).
        let of_origins = self.spread_m * (1.0 + u + v) * length;
        (1.001 * (SINGLE * (size + of_origins) + DOUBLE * reach * reach)) as f32
    }

    /// What ray i has met.
    #[must_use]
    #[inline]
    pub fn hit(&self, i: usize) -> Option<PacketHit> {
        let (row, k) = (i / ROW, i % ROW);
        let Met { surface, triangle, normal_ned } = *self.met.get(self.found[row][k] as usize)?;
        Some(PacketHit { t: self.limit[row][k] / self.z[row][k], surface, triangle, normal_ned })
    }
}

impl Beam {
    /// In other axes: `x = ned_from_own own + origin`.
    pub fn in_axes(&self, ned_from_own: DMat3, origin_ned_m: DVec3) -> Self {
        let transposed = ned_from_own.transpose();
        let own = |(normal, least): (DVec3, f64)| (transposed * normal, least - normal.dot(origin_ned_m));
        let (forward, start) = own((self.forward, self.start));
        Self { sides: self.sides.map(own), forward, start }
    }
}

#[cfg(test)]
mod tests;
