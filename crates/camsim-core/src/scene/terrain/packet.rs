//! The terrain in a packet of rays.

#![expect(clippy::needless_range_loop, reason = "numbers of one vertex have one index in all arrays")]

use glam::DVec3;

use super::{Terrain, TerrainTriangle, cell_triangles, intersect_triangle, tree::BLOCK_CELLS};
use crate::scene::ray_packet::{Faces, PacketSurface, RayPacket};

/// Vertices along a side of a block, and of all.
const SIDE: usize = BLOCK_CELLS as usize + 1;
const VERTICES: usize = SIDE * SIDE;

impl Terrain {
    /// Meets a packet of rays: what each meets first, if that is nearer than what it has met before, from either
    /// side, as [`Terrain::intersect`] finds it.
    pub fn meet_packet(&self, packet: &mut RayPacket) {
        let (beam, farthest_m) = (packet.beam(), packet.farthest_m());
        self.tree.walk_beam(&beam, farthest_m, &mut |block| {
            crate::simd::with_widest(
                #[inline(always)]
                || self.meet_block(packet, block),
            );
            packet.farthest_m()
        });
    }

    #[inline(always)]
    fn meet_block(&self, packet: &mut RayPacket, block: [u32; 2]) {
        let (number, [i0, j0]) = self.chunk_of_cell(block.map(|n| n * BLOCK_CELLS));
        let chunk = &self.chunks[number as usize];
        let [columns, rows] = [(i0, chunk.cells[0]), (j0, chunk.cells[1])]
            .map(|(first, cells)| BLOCK_CELLS.min(cells - first) as usize);
        let stride = chunk.cells[0] as usize + 1;
        let first = chunk.first_vertex as usize + j0 as usize * stride + i0 as usize;
        let mut offsets_m = [[f32::NAN; VERTICES]; 3];
        for j in 0..=rows {
            for (i, vertex) in self.vertices[first + j * stride..][..=columns].iter().enumerate() {
                for axis in 0..3 {
                    offsets_m[axis][SIDE * j + i] = vertex.offset_m[axis];
                }
            }
        }
        let (packet_from_ned, origin_ned_m) = packet.axes();
        let centre_m = packet_from_ned * (chunk.centre_ned_m - origin_ned_m);
        let [north, east, down] = [0, 1, 2].map(|k| packet_from_ned.col(k));
        let mut points_m = [[0.0; VERTICES]; 3];
        for axis in 0..3 {
            for i in 0..VERTICES {
                points_m[axis][i] = centre_m[axis]
                    + north[axis] * f64::from(offsets_m[0][i])
                    + east[axis] * f64::from(offsets_m[1][i])
                    + down[axis] * f64::from(offsets_m[2][i]);
            }
        }
        let mut beyond = [0_u32; VERTICES];
        for i in 0..VERTICES {
            beyond[i] = packet.sides_beyond([points_m[0][i], points_m[1][i], points_m[2][i]]);
        }
        for j in 0..rows {
            for i in 0..columns {
                let at = SIDE * j + i;
                let of_both = beyond[at] & beyond[at + SIDE + 1];
                for (half, corner) in (0..).zip([at + 1, at + SIDE]) {
                    if of_both & beyond[corner] != 0 {
                        continue;
                    }
                    let cell = [i0 + i as u32, j0 + j as u32];
                    let corners =
                        if half == 0 { [at, at + SIDE + 1, corner] } else { [at, corner, at + SIDE + 1] };
                    let corners_m =
                        corners.map(|i| DVec3::new(points_m[0][i], points_m[1][i], points_m[2][i]));
                    let [column, row] = block.map(|n| n * BLOCK_CELLS);
                    let triangle = TerrainTriangle { cell: [column + i as u32, row + j as u32], half };
                    let of = PacketSurface { surface: 0, triangle: Some(triangle), faces: Faces::Both };
                    packet.meet(corners_m, of, |ray, limit| {
                        let corners = cell_triangles(cell)[half as usize];
                        let corners = corners.map(|[i, j]| self.position_ned_m(number, i, j));
                        intersect_triangle(corners, ray.origin_ned_m, ray.direction_ned, limit)
                            .map(|(t, _)| t)
                    });
                }
            }
        }
        packet.find_farthest();
    }
}
