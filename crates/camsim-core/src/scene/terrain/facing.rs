//! Triangles that turn away from a camera, and whether any of those can be seen.
//!
//! From above, ground shows its upper side alone: a ray that begins above it, and stays over it until it
//! leaves its border for good, comes from above wherever it first meets it. What turns its underside to the
//! camera is hidden behind something then, and need not be drawn.

use std::ops::Range;

use glam::{DVec2, DVec3, Vec3};

use super::{Terrain, TerrainDetail, TerrainVertex};

/// How far from its place a corner is drawn at most, pixels: adapters round to a sixteenth or better. What
/// single precision adds, some thousandths, is within what the bound of [`Facing::is_away`] leaves.
const ROUNDED_PX: f64 = 1.0 / 32.0;

/// Triangles of one chunk as a camera sees them.
pub(super) struct Facing<'a> {
    vertices: &'a [TerrainVertex],
    camera_from_centre_m: DVec3,
    /// `4 r / focal` of [`Facing::is_away`], squared.
    least2: f64,
}

/// Sides of the border that a part of it holds at most.
const PART_SIDES: u32 = 64;

/// Consecutive sides of the border, all along the same side of the grid.
#[derive(Clone, Debug)]
pub(super) struct BorderPart {
    /// Numbers of the sides; side k begins at vertex k of the border.
    sides: Range<u32>,
    /// Box around where they begin, north and east, metres.
    from_m: [DVec2; 2],
    /// Box around where they lead, from there.
    step_m: [DVec2; 2],
}

impl BorderPart {
    /// Which way all of these sides turn around a place, if the boxes tell: 1 or -1.
    ///
    /// A side from a to b turns by `(a - p) x (b - a)`. What the boxes tell is at least [`Self::SURE`] of the
    /// products' size away from 0, far more than rounding moves any of it.
    fn turn(&self, place: DVec2) -> Option<f64> {
        let [from, step] = [self.from_m.map(|m| m - place), self.step_m];
        let products = |along: fn(DVec2) -> f64, across: fn(DVec2) -> f64| {
            let all = [
                along(from[0]) * across(step[0]),
                along(from[0]) * across(step[1]),
                along(from[1]) * across(step[0]),
            ];
            let last = along(from[1]) * across(step[1]);
            all.into_iter().fold((last, last), |(low, high), product| (low.min(product), high.max(product)))
        };
        let (xy, yx) = (products(|v| v.x, |v| v.y), products(|v| v.y, |v| v.x));
        let sure = Self::SURE
            * [xy.0, xy.1, yx.0, yx.1].into_iter().fold(0.0, |most: f64, product| most.max(product.abs()));
        match (xy.0 - yx.1 > sure, xy.1 - yx.0 < -sure) {
            (true, _) => Some(1.0),
            (_, true) => Some(-1.0),
            _ => None,
        }
    }

    const SURE: f64 = 1e-9;
}

impl Terrain {
    /// Whether a camera sees the ground from above only: nothing is missing, the camera is above it, and
    /// every side of the border faces outwards from there, so that no ray comes back over the ground after it
    /// has left it.
    pub(super) fn is_seen_from_above(&self, position_ned_m: DVec3) -> bool {
        let above = || {
            self.down_at(position_ned_m.x, position_ned_m.y).is_some_and(|down_m| position_ned_m.z < down_m)
        };
        self.void_cells == 0 && above() && self.border_faces_away_from(position_ned_m)
    }

    /// All sides turn the same way around the place, which lies within. Few of them are looked at one by one:
    /// a part of the border that is not seen end-on tells by its boxes.
    pub(super) fn border_faces_away_from(&self, position_ned_m: DVec3) -> bool {
        let place = position_ned_m.truncate();
        [1.0, -1.0].into_iter().any(|sign| {
            self.border.iter().all(|part| match part.turn(place) {
                Some(turn) => turn == sign,
                None => part.sides.clone().all(|side| sign * self.side_turn(side, place) > 0.0),
            })
        })
    }

    /// What the sign of tells which way a side of the border turns around a place.
    pub(super) fn side_turn(&self, side: u32, place: DVec2) -> f64 {
        let [from, to] = [side, (side + 1) % self.border_sides()]
            .map(|vertex| self.border_vertex(vertex).truncate() - place);
        from.perp_dot(to)
    }

    /// Sides of the border, as many as vertices.
    pub(super) fn border_sides(&self) -> u32 {
        2 * (self.cells[0] + self.cells[1])
    }

    pub(super) fn border_parts(&self) -> Vec<BorderPart> {
        let [columns, rows] = self.cells;
        let corners = [0, columns, columns + rows, 2 * columns + rows, self.border_sides()];
        let parts = corners.windows(2).flat_map(|ends| {
            let part = move |first: u32| first..(first + PART_SIDES).min(ends[1]);
            (ends[0]..ends[1]).step_by(PART_SIDES as usize).map(part)
        });
        parts.map(|sides| self.border_part(sides)).collect()
    }

    fn border_part(&self, sides: Range<u32>) -> BorderPart {
        let mut part = BorderPart {
            sides: sides.clone(),
            from_m: [DVec2::INFINITY, DVec2::NEG_INFINITY],
            step_m: [DVec2::INFINITY, DVec2::NEG_INFINITY],
        };
        for side in sides {
            let [from, to] =
                [side, (side + 1) % self.border_sides()].map(|vertex| self.border_vertex(vertex).truncate());
            part.from_m = [part.from_m[0].min(from), part.from_m[1].max(from)];
            part.step_m = [part.step_m[0].min(to - from), part.step_m[1].max(to - from)];
        }
        part
    }

    /// The outermost vertices, one after the other around the terrain: along the north, the east, the south
    /// and the west.
    fn border_vertex(&self, vertex: u32) -> DVec3 {
        let [columns, rows] = self.cells;
        let [i, j] = match vertex {
            v if v < columns => [v, 0],
            v if v < columns + rows => [columns, v - columns],
            v if v < 2 * columns + rows => [2 * columns + rows - v, rows],
            v => [0, 2 * (columns + rows) - v],
        };
        let cell = [i.min(columns - 1), j.min(rows - 1)];
        let (chunk, [a, b]) = self.chunk_of_cell(cell);
        self.position_ned_m(chunk, a + i - cell[0], b + j - cell[1])
    }
}

impl<'a> Facing<'a> {
    pub fn new(detail: &TerrainDetail<'a>, chunk: u32) -> Self {
        let of = &detail.terrain.chunks[chunk as usize];
        let (position_ned_m, focal_px) = detail.seen_from();
        let least = 4.0 * ROUNDED_PX / focal_px;
        Self {
            vertices: &detail.terrain.vertices[of.first_vertex as usize..],
            camera_from_centre_m: position_ned_m - of.centre_ned_m,
            least2: least * least,
        }
    }

    /// Whether a triangle turns its underside to the camera, and still does with its corners where they are
    /// drawn.
    ///
    /// With corners a, b, c seen from the camera and the normal n = (b - a) x (c - a), the picture of it has
    /// the area focal^2 |n . a| / (2 z_a z_b z_c), and its side from a to b the length focal |b - a| far /
    /// (z_a z_b) at most, where nothing is farther than `far`. Corners that move by r change the area by 1.5
    /// r times the longest side and 1.3 r^2 at most. A triangle whose area is more than 2 r times its longest
    /// side keeps its turn, then: that side is longer than 4 r, so that the square adds little. It is so if
    /// focal |n . a| > 4 r side far^2.
    pub fn is_away(&self, triangle: [u32; 3]) -> bool {
        let corner = |k: usize| {
            Vec3::from(self.vertices[triangle[k] as usize].offset_m).as_dvec3() - self.camera_from_centre_m
        };
        let (a, b, c) = (corner(0), corner(1), corner(2));
        let normal = (b - a).cross(c - a);
        // Of the normal and the way from the camera, one goes down and the other up.
        let from_below = normal.dot(a) * normal.z < 0.0;
        let side2 = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        let far2 = a.length_squared().max(b.length_squared()).max(c.length_squared());
        // False for what is not a number.
        from_below && normal.dot(a).powi(2) > self.least2 * side2 * far2 * far2
    }
}
