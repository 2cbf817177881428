//! Triangles as they are drawn: which pixels they may cover, and what is on them as planes over the picture.

use super::{
    GROUND,
    corners::{Camera, Corner, SUBPIXEL_BITS, SUBPIXELS},
    cover::{self, Pixels, SMALL_PX, Samples},
};
use crate::simd::{
    lanes::{higher, lower},
    vectors::{SIDE_BY_SIDE, Vectors},
};

/// Triangles less wide than this, steps of the grid, have planes by their corners on the grid.
const THIN_STEPS: i64 = 8;
/// Models' triangles of a smaller area, twice that in steps of the grid, are left out where no place shows
/// them: a pixel's, as many of them are smaller.
const SMALLER_STEPS2: i64 = 2 * (SUBPIXELS * SUBPIXELS) as i64;
/// Rows of the picture that are drawn together.
pub(super) const BAND_ROWS: usize = 32;
/// Numbers on a triangle besides texture coordinates, where it has any: a tint, and what light needs of the
/// normal (towards the sun, down).
pub(super) const MORE: usize = 5;

/// A number over the picture: at the triangle's first pixel, and how it changes from pixel to pixel across
/// and down.
pub(super) type Plane = [f32; 3];

/// What decides which pixels a triangle covers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cover {
    /// First and last pixels, across and down.
    pub first: [u16; 2],
    pub last: [u16; 2],
    /// Corners from the first pixel on, 1/[`SUBPIXELS`] px, clockwise as the picture is seen.
    pub at: [[i32; 2]; 3],
    /// near / z.
    pub inverse: Plane,
    /// As of [`Surface`].
    pub large: u32,
}

/// What is on a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    /// Of the planes.
    pub first: [f32; 2],
    /// Which [`super::shade::Paint`].
    pub paint: u32,
    /// Texture coordinates, and near / z, each times near / z.
    pub u: Plane,
    pub v: Plane,
    pub inverse: Plane,
    /// Place in [`Chunk::more`], or with [`FLAT`] in [`Chunk::flats`].
    pub more: u32,
    /// Place in [`Chunk::large`], or [`SMALL`].
    pub large: u32,
}

/// Place of what is not in [`Chunk::large`]: triangles whose corners are all so near their first pixel that
/// products of differences fit 32 bits, and that planes need no more digits than floats have.
pub(super) const SMALL: u32 = u32::MAX;

/// Says that all of a triangle has one tint and one light.
pub(super) const FLAT: u32 = 1 << 31;

/// What triangles have in common.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kind {
    pub paint: u32,
    pub one_sided: bool,
    /// Light of the sky, where light falls on them.
    pub sky: Option<f32>,
}

impl Kind {
    /// A tint in the light, from what a triangle has [`MORE`]. Twin of shaders/ideal/light.wgsl.
    #[inline(always)]
    pub fn lit(sky: Option<f32>, [r, g, b, sun, down]: [f32; MORE]) -> [f32; 3] {
        let Some(sky) = sky else { return [r, g, b] };
        let light = lower(higher(higher(sun, 0.0) + sky * 0.5 * (1.0 - down), 0.0), 1.0);
        [r * light, g * light, b * light]
    }
}

/// Triangles that are worked out together, in the order in which they are drawn.
#[derive(Debug, Default)]
pub(super) struct Chunk {
    /// Whether they are the terrain's, and not models'.
    pub is_of_ground: bool,
    pub covers: Vec<Cover>,
    pub surfaces: Vec<Surface>,
    /// Planes of large ones once more, near / z and texture coordinates: towards a horizon little is left of
    /// what they have at the other end.
    pub large: Vec<[[f64; 3]; 3]>,
    /// Planes of what some have besides.
    pub more: Vec<[Plane; MORE]>,
    /// Tints of those whose corners all have the same, and the same light.
    pub flats: Vec<[f32; 3]>,
    /// Triangles by the bands that they may be in, and where each band's begin.
    in_band: Vec<u32>,
    band_starts: Vec<u32>,
}

impl Chunk {
    /// Forgets its triangles, but not the memory that they took.
    pub fn clear(&mut self) {
        self.covers.clear();
        self.surfaces.clear();
        self.more.clear();
        self.large.clear();
        self.flats.clear();
    }

    /// Those that may be in a band.
    pub fn of_band(&self, band: usize) -> &[u32] {
        match self.band_starts.get(band..band + 2) {
            Some(&[begin, end]) => &self.in_band[begin as usize..end as usize],
            _ => &[],
        }
    }

    /// Sorts triangles into bands, those of one in their order.
    pub fn sort(&mut self, bands: usize) {
        let of = |cover: &Cover| {
            usize::from(cover.first[1]) / BAND_ROWS..usize::from(cover.last[1]) / BAND_ROWS + 1
        };
        self.band_starts.clear();
        self.band_starts.resize(bands + 2, 0);
        for cover in &self.covers {
            of(cover).for_each(|band| self.band_starts[band + 2] += 1);
        }
        for band in 1..bands + 2 {
            self.band_starts[band] += self.band_starts[band - 1];
        }
        self.in_band.clear();
        self.in_band.resize(self.band_starts[bands + 1] as usize, 0);
        for (number, cover) in self.covers.iter().enumerate() {
            for band in of(cover) {
                let place = &mut self.band_starts[band + 1];
                self.in_band[*place as usize] = number as u32;
                *place += 1;
            }
        }
        self.band_starts.pop();
    }

    /// Adds a triangle, or what of it is within.
    #[inline(always)]
    pub fn add<const N: usize>(
        &mut self,
        vectors: impl Vectors,
        camera: &Camera,
        corners: [&Corner<N>; 3],
        kind: Kind,
    ) {
        if corners.iter().all(|corner| corner.is_within) {
            return self.add_within(vectors, camera, corners, kind);
        }
        self.add_cut(vectors, camera, corners, kind);
    }

    #[cold]
    fn add_cut<const N: usize>(
        &mut self,
        vectors: impl Vectors,
        camera: &Camera,
        corners: [&Corner<N>; 3],
        kind: Kind,
    ) {
        if corners.iter().all(|corner| corner.in_camera_m[2] < camera.uniforms.near_m) {
            return;
        }
        let polygon = camera.cut(corners);
        for pair in polygon.windows(2).skip(1) {
            self.add_within(vectors, camera, [&polygon[0], &pair[0], &pair[1]], kind);
        }
    }

    #[inline(always)]
    fn add_within<const N: usize>(
        &mut self,
        vectors: impl Vectors,
        camera: &Camera,
        corners: [&Corner<N>; 3],
        kind: Kind,
    ) {
        let [a, b, c] = corners;
        let [ax, ay, bx, by, cx, cy] = [a.at[0], a.at[1], b.at[0], b.at[1], c.at[0], c.at[1]];
        let (left, right) = (ax.min(bx).min(cx), ax.max(bx).max(cx));
        let (top, bottom) = (ay.min(by).min(cy), ay.max(by).max(cy));
        // Pixels that are asked within the box.
        let beside = camera.beside;
        let first = [left, top].map(|least| ((least + SUBPIXELS - 1 - beside) >> SUBPIXEL_BITS).max(0));
        let last = [(right, 0), (bottom, 1)]
            .map(|(most, k)| ((most + beside) >> SUBPIXEL_BITS).min(camera.size_px[k] as i32 - 1));
        if first[0] > last[0] || first[1] > last[1] {
            return;
        }
        let area2 = i64::from(bx - ax) * i64::from(cy - ay) - i64::from(by - ay) * i64::from(cx - ax);
        if area2 == 0 || (area2 > 0 && kind.one_sided) {
            return;
        }
        let (is_front, b, c) = if area2 < 0 { (true, c, b) } else { (false, b, c) };
        let from = [first[0] << SUBPIXEL_BITS, first[1] << SUBPIXEL_BITS];
        let place = |corner: &Corner<N>| [corner.at[0] - from[0], corner.at[1] - from[1]];
        let at = [place(a), place(b), place(c)];
        let is_near = |[x, y]: [i32; 2]| x.abs().max(y.abs()) <= SMALL_PX * SUBPIXELS;
        let is_small = is_near(at[0]) & is_near(at[1]) & is_near(at[2]);
        if kind.paint != GROUND
            && is_small
            && area2.abs() < SMALLER_STEPS2
            && !is_anywhere(vectors, camera, at, first, last)
        {
            return;
        }
        // Coverage is of corners on the grid, but what is on the triangle is of where they are: half a step
        // of the grid is much towards a horizon. Not where it is next to as much as the triangle is wide:
        // what is on that would go far beyond what its corners have.
        let reach = |to: &Corner<N>| i64::from((to.at[0] - a.at[0]).abs() + (to.at[1] - a.at[1]).abs());
        let is_thin = area2.abs() < THIN_STEPS * (reach(b) + reach(c));
        const PX: f32 = 1.0 / SUBPIXELS as f32;
        let first_px = [first[0] as f32, first[1] as f32];
        let [px, b_px, c_px] = match is_thin {
            true => at.map(|[x, y]| [x as f32 * PX, y as f32 * PX]),
            false => [a, b, c].map(|corner| [corner.at_px[0] - first_px[0], corner.at_px[1] - first_px[1]]),
        };
        let large = if is_small {
            SMALL
        } else {
            self.add_large(camera, [a, b, c], is_thin.then_some(&at), first_px)
        };
        let (to_b, to_c) = ([b_px[0] - px[0], b_px[1] - px[1]], [c_px[0] - px[0], c_px[1] - px[1]]);
        let per_area = 1.0 / (to_b[0] * to_c[1] - to_b[1] * to_c[0]);
        let plane = |of_a: f32, of_b: f32, of_c: f32| -> Plane {
            let (of_b, of_c) = (of_b - of_a, of_c - of_a);
            let across = (of_b * to_c[1] - of_c * to_b[1]) * per_area;
            let down = (of_c * to_b[0] - of_b * to_c[0]) * per_area;
            [of_a - across * px[0] - down * px[1], across, down]
        };
        let times_inverse =
            |k: usize| plane(a.on_it[k] * a.inverse, b.on_it[k] * b.inverse, c.on_it[k] * c.inverse);
        let inverse = plane(a.inverse, b.inverse, c.inverse);
        let [first, last] = [[first[0] as u16, first[1] as u16], [last[0] as u16, last[1] as u16]];
        let more =
            if N == 2 + MORE { self.add_more([a, b, c], kind.sky, is_front, times_inverse) } else { 0 };
        self.covers.push(Cover { first, last, at, inverse, large });
        self.surfaces.push(Surface {
            first: [f32::from(first[0]), f32::from(first[1])],
            paint: kind.paint,
            u: times_inverse(0),
            v: times_inverse(1),
            inverse,
            more,
            large,
        });
    }

    /// Keeps what a triangle has besides; gives its place.
    #[inline(always)]
    fn add_more<const N: usize>(
        &mut self,
        corners: [&Corner<N>; 3],
        sky: Option<f32>,
        is_front: bool,
        plane: impl Fn(usize) -> Plane,
    ) -> u32 {
        // The side that is seen from behind has its normal the other way.
        let sign = if is_front { 1.0 } else { -1.0 };
        let [a, b, c] = corners;
        if a.on_it[2..] == b.on_it[2..] && a.on_it[2..] == c.on_it[2..] {
            let of = |k: usize| if k < 3 { a.on_it[2 + k] } else { sign * a.on_it[2 + k] };
            self.flats.push(Kind::lit(sky, [of(0), of(1), of(2), of(3), of(4)]));
            return FLAT | (self.flats.len() as u32 - 1);
        }
        let (mut sun, mut down) = (plane(5), plane(6));
        for k in 0..3 {
            (sun[k], down[k]) = (sign * sun[k], sign * down[k]);
        }
        self.more.push([plane(2), plane(3), plane(4), sun, down]);
        self.more.len() as u32 - 1
    }

    /// Keeps the planes of a large triangle, by its corners' places on the grid if those are given; gives
    /// their place.
    #[cold]
    fn add_large<const N: usize>(
        &mut self,
        camera: &Camera,
        corners: [&Corner<N>; 3],
        on_grid: Option<&[[i32; 2]; 3]>,
        first_px: [f32; 2],
    ) -> u32 {
        let [px, b, c] = match on_grid {
            Some(at) => at.map(|at| at.map(|at| f64::from(at) / f64::from(SUBPIXELS))),
            None => corners.map(|corner| {
                let [x, y] = camera.place_px(corner);
                [x - f64::from(first_px[0]), y - f64::from(first_px[1])]
            }),
        };
        let [to_b, to_c] = [b, c].map(|to| [to[0] - px[0], to[1] - px[1]]);
        let per_area = 1.0 / (to_b[0] * to_c[1] - to_b[1] * to_c[0]);
        let plane = |of: [f64; 3]| {
            let (of_b, of_c) = (of[1] - of[0], of[2] - of[0]);
            let across = (of_b * to_c[1] - of_c * to_b[1]) * per_area;
            let down = (of_c * to_b[0] - of_b * to_c[0]) * per_area;
            [of[0] - across * px[0] - down * px[1], across, down]
        };
        let inverse =
            corners.map(|corner| f64::from(camera.uniforms.near_m) / f64::from(corner.in_camera_m[2]));
        let times_inverse = |k: usize| {
            plane([0, 1, 2].map(|corner: usize| f64::from(corners[corner].on_it[k]) * inverse[corner]))
        };
        self.large.push([plane(inverse), times_inverse(0), times_inverse(1)]);
        self.large.len() as u32 - 1
    }
}

/// Whether any place that a camera's pictures have may show a small model's triangle: its pixels, or four
/// samples a pixel.
#[inline(always)]
fn is_anywhere(
    vectors: impl Vectors,
    camera: &Camera,
    at: [[i32; 2]; 3],
    first: [i32; 2],
    last: [i32; 2],
) -> bool {
    let is_wide = last[0] - first[0] >= SIDE_BY_SIDE as i32;
    is_wide
        || match camera.beside {
            0 => cover::is_anywhere::<Pixels>(vectors, at, first, last),
            _ => cover::is_anywhere::<Samples>(vectors, at, first, last),
        }
}
