//! Back-face test for terrain triangles.
//!
//! Seen from above, terrain shows its upper side only: a ray that begins above it, and stays over it until it
//! leaves the border for good, hits it from above first. Triangles whose underside faces the camera are then
//! hidden behind others and need not be drawn.

use std::ops::Range;

use glam::{DVec2, DVec3, Vec3};

use super::{Terrain, TerrainDetail, TerrainVertex};

/// Largest distance of a drawn corner from its exact projection, pixels: adapters round to a sixteenth or
/// better. The error of single precision, some thousandths, is within the margin of
/// [`BackFaceTest::is_back_facing`].
const ROUNDED_PX: f64 = 1.0 / 32.0;

/// Back-face test for the triangles of one chunk.
pub(super) struct BackFaceTest<'a> {
    vertices: &'a [TerrainVertex],
    camera_from_centre_m: DVec3,
    /// `4 r / focal` of [`BackFaceTest::is_back_facing`], squared.
    least2: f64,
}

/// Most sides of the border in one part.
const PART_SIDES: u32 = 64;

/// Consecutive sides of the border along the same side of the grid.
#[derive(Clone, Debug)]
pub(super) struct BorderPart {
    /// Numbers of the sides; side k begins at vertex k of the border.
    sides: Range<u32>,
    /// Bounds of their begins, north and east, metres.
    from_m: [DVec2; 2],
    /// Bounds of their directions, metres.
    step_m: [DVec2; 2],
}

impl BorderPart {
    /// Direction, 1 or -1, in which all of these sides turn around a position, if the bounds decide it.
    ///
    /// A side from a to b turns by `(a - p) x (b - a)`. The bounds must exclude 0 by at least [`Self::SURE`]
    /// of the products' size, which is far more than rounding.
    fn turn(&self, position: DVec2) -> Option<f64> {
        let [from, step] = [self.from_m.map(|m| m - position), self.step_m];
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
    /// Whether a camera sees the terrain from above only: there are no voids, the camera is above it, and
    /// every side of the border faces outwards from there, so that no ray returns over the terrain after
    /// leaving it.
    pub(super) fn is_seen_from_above(&self, position_ned_m: DVec3) -> bool {
        let above = || {
            self.down_at(position_ned_m.x, position_ned_m.y).is_some_and(|down_m| position_ned_m.z < down_m)
        };
        self.void_cells == 0 && above() && self.border_faces_away_from(position_ned_m)
    }

    /// Whether all sides turn the same way around the position, which lies inside. Most are decided by the
    /// bounds of their part; only parts seen end-on are tested side by side.
    pub(super) fn border_faces_away_from(&self, position_ned_m: DVec3) -> bool {
        let position = position_ned_m.truncate();
        [1.0, -1.0].into_iter().any(|sign| {
            self.border.iter().all(|part| match part.turn(position) {
                Some(turn) => turn == sign,
                None => part.sides.clone().all(|side| sign * self.side_turn(side, position) > 0.0),
            })
        })
    }

    /// Signed area whose sign is the direction in which a side of the border turns around a position.
    pub(super) fn side_turn(&self, side: u32, position: DVec2) -> f64 {
        let [from, to] = [side, (side + 1) % self.border_sides()]
            .map(|vertex| self.border_vertex(vertex).truncate() - position);
        from.perp_dot(to)
    }

    /// Number of sides of the border, equal to that of its vertices.
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

    /// Vertices of the border in order: along the north, the east, the south and the west.
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

impl<'a> BackFaceTest<'a> {
    pub fn new(detail: &TerrainDetail<'a>, chunk: u32) -> Self {
        let span = &detail.terrain.chunks[chunk as usize];
        let (position_ned_m, focal_px) = detail.viewpoint();
        let least = 4.0 * ROUNDED_PX / focal_px;
        Self {
            vertices: &detail.terrain.vertices[span.first_vertex as usize..],
            camera_from_centre_m: position_ned_m - span.centre_ned_m,
            least2: least * least,
        }
    }

    /// Whether the underside of a triangle faces the camera, and still does with its corners where they are
    /// drawn.
    ///
    /// With corners a, b, c relative to the camera and the normal n = (b - a) x (c - a), the projected area
    /// is focal^2 |n . a| / (2 z_a z_b z_c), and the projected side from a to b is at most focal |b - a| far
    /// / (z_a z_b) long, where nothing is farther than `far`. Moving the corners by r changes the area by at
    /// most 1.5 r times the longest side plus 1.3 r^2. A triangle with an area above 2 r times its longest
    /// side therefore keeps its orientation (its longest side exceeds 4 r, so the square adds little). That
    /// is the case if focal |n . a| > 4 r side far^2.
    pub fn is_back_facing(&self, triangle: [u32; 3]) -> bool {
        let corner = |k: usize| {
            Vec3::from(self.vertices[triangle[k] as usize].offset_m).as_dvec3() - self.camera_from_centre_m
        };
        let (a, b, c) = (corner(0), corner(1), corner(2));
        let normal = (b - a).cross(c - a);
        // The normal and the direction from the camera have opposite vertical signs.
        let from_below = normal.dot(a) * normal.z < 0.0;
        let side2 = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        let far2 = a.length_squared().max(b.length_squared()).max(c.length_squared());
        // False for NaN.
        from_below && normal.dot(a).powi(2) > self.least2 * side2 * far2 * far2
    }
}
