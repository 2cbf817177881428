//! Triangles that turn away from a camera, and whether any of those can be seen.
//!
//! From above, ground shows its upper side alone: a ray that begins above it, and stays over it until it leaves its border for good, comes from
//! above wherever it first meets it. What turns its underside to the camera is hidden behind something then, and need not be drawn.

use glam::{DVec3, Vec3};

use super::{Terrain, TerrainDetail, TerrainVertex};

/// How far from its place a corner is drawn at most, pixels: adapters round to a sixteenth or better. What single precision adds, some
/// thousandths, is within what the bound of [`Facing::is_away`] leaves.
const ROUNDED_PX: f64 = 1.0 / 32.0;

/// Triangles of one chunk as a camera sees them.
pub(super) struct Facing<'a> {
    vertices: &'a [TerrainVertex],
    camera_from_centre_m: DVec3,
    /// `4 r / focal` of [`Facing::is_away`], squared.
    least2: f64,
}

impl Terrain {
    /// Whether a camera sees the ground from above only: nothing is missing, the camera is above it, and every side of the border
    /// faces outwards from there, so that no ray comes back over the ground after it has left it.
    pub(super) fn is_seen_from_above(&self, position_ned_m: DVec3) -> bool {
        let above = || self.down_at(position_ned_m.x, position_ned_m.y).is_some_and(|down_m| position_ned_m.z < down_m);
        self.void_cells == 0 && above() && self.border_faces_away_from(position_ned_m)
    }

    /// All sides turn the same way around the place, which lies within.
    fn border_faces_away_from(&self, position_ned_m: DVec3) -> bool {
        let border: Vec<_> = self.border().map(|point| (point - position_ned_m).truncate()).collect();
        let turns = |from_first: usize, sign: f64| sign * border[from_first].perp_dot(border[(from_first + 1) % border.len()]) > 0.0;
        [1.0, -1.0].into_iter().any(|sign| (0..border.len()).all(|first| turns(first, sign)))
    }

    /// The outermost vertices, one after the other around the terrain.
    fn border(&self) -> impl Iterator<Item = DVec3> {
        let [columns, rows] = self.cells;
        let north = (0..columns).map(|i| [i, 0]);
        let east = (0..rows).map(move |j| [columns, j]);
        let south = (1..=columns).rev().map(move |i| [i, rows]);
        let west = (1..=rows).rev().map(|j| [0, j]);
        north.chain(east).chain(south).chain(west).map(move |[i, j]| {
            let cell = [i.min(columns - 1), j.min(rows - 1)];
            let (chunk, [a, b]) = self.chunk_of_cell(cell);
            self.position_ned_m(chunk, a + i - cell[0], b + j - cell[1])
        })
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

    /// Whether a triangle turns its underside to the camera, and still does with its corners where they are drawn.
    ///
    /// With corners a, b, c seen from the camera and the normal n = (b - a) x (c - a), the picture of it has the area
    /// focal^2 |n . a| / (2 z_a z_b z_c), and its side from a to b the length focal |b - a| far / (z_a z_b) at most, where nothing is farther
    /// than `far`. Corners that move by r change the area by 1.5 r times the longest side and 1.3 r^2 at most. A triangle whose area is
    /// more than 2 r times its longest side keeps its turn, then: that side is longer than 4 r, so that the square adds little. It is so if
    /// focal |n . a| > 4 r side far^2.
    pub fn is_away(&self, triangle: [u32; 3]) -> bool {
        let [a, b, c] = triangle.map(|vertex| Vec3::from(self.vertices[vertex as usize].offset_m).as_dvec3() - self.camera_from_centre_m);
        let normal = (b - a).cross(c - a);
        // Of the normal and the way from the camera, one goes down and the other up.
        let from_below = normal.dot(a) * normal.z < 0.0;
        let side2 = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        let far2 = a.length_squared().max(b.length_squared()).max(c.length_squared());
        // False for what is not a number.
        from_below && normal.dot(a).powi(2) > self.least2 * side2 * far2 * far2
    }
}
