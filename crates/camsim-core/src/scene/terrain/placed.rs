//! The drawn triangles of a terrain with their vertices, as uploaded for one ideal frame.

use glam::{DVec3, Vec3};

use super::{CHUNK_CELLS, LodSelection, Terrain, TerrainMesh, select::VERTEX_BITS};

/// Vertices and indices of the triangles to draw.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlacedMesh {
    /// North, east, down from a base in whole metres, and texture coordinates, in the order of first use. A
    /// vertex on a chunk's border occurs once per chunk. Positions are the correctly rounded sums of two
    /// exact numbers, so these chunks agree in every bit.
    pub vertices: Vec<[f32; 5]>,
    /// Three indices per triangle.
    pub indices: Vec<u32>,
    /// Tiles of the texture that the triangles may read; empty for a texture that is not tiled.
    pub tiles: Vec<u32>,
    /// Statistics of the level of detail.
    pub lod: LodSelection,
}

impl PlacedMesh {
    /// GPU memory: 20 bytes per vertex and 4 per index.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        (size_of_val(&*self.vertices) + size_of_val(&*self.indices)) as u64
    }
}

impl TerrainMesh {
    /// Resolves the vertices, relative to a base near the camera. The base is in whole metres, as chunk
    /// centres are.
    #[must_use]
    pub fn placed(&self, terrain: &Terrain, base_ned_m: DVec3) -> PlacedMesh {
        const NONE: u32 = u32::MAX;
        let mut placed = PlacedMesh {
            indices: Vec::with_capacity(self.indices.len()),
            lod: self.lod,
            ..PlacedMesh::default()
        };
        // New index of each vertex of this chunk, if it was used before.
        let mut known = vec![NONE; ((CHUNK_CELLS + 1) * (CHUNK_CELLS + 1)) as usize];
        for of_chunk in self.indices.chunk_by(|a, b| a >> VERTEX_BITS == b >> VERTEX_BITS) {
            let chunk = &terrain.chunks[self.chunks[(of_chunk[0] >> VERTEX_BITS) as usize] as usize];
            let centre_from_base_m = (chunk.centre_ned_m - base_ned_m).as_vec3();
            known.fill(NONE);
            for index in of_chunk {
                let vertex = index & ((1 << VERTEX_BITS) - 1);
                let number = &mut known[vertex as usize];
                if *number == NONE {
                    *number = placed.vertices.len() as u32;
                    let source = &terrain.vertices[(chunk.first_vertex + vertex) as usize];
                    let [north, east, down] = (centre_from_base_m + Vec3::from(source.offset_m)).to_array();
                    placed.vertices.push([north, east, down, source.uv[0], source.uv[1]]);
                }
                placed.indices.push(*number);
            }
        }
        placed
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::{
        super::{
            TerrainDetail,
            tests::{forward, hills},
        },
        *,
    };

    #[test]
    fn placed_vertices_match_the_terrain() {
        let terrain = hills(200, 150, 10.0, 40.0);
        let camera = forward(DVec3::new(-600.25, 80.5, -150.0), 0.2);
        let mesh = TerrainDetail::new(&terrain, &camera, [-0.7, 0.7, -0.5, 0.5], 300.0, 0.25).visible_mesh();
        let base_ned_m = camera.position_ned_m.round();
        let placed = mesh.placed(&terrain, base_ned_m);
        assert!(
            placed.indices.len() > 3000
                && placed.indices.len() == mesh.indices.len()
                && placed.lod == mesh.lod
        );
        for (position, index) in placed.indices.iter().zip(&mesh.indices) {
            let chunk = &terrain.chunks[mesh.chunks[(index >> VERTEX_BITS) as usize] as usize];
            let vertex = terrain.vertices[(chunk.first_vertex + (index & ((1 << VERTEX_BITS) - 1))) as usize];
            let exact_m = chunk.centre_ned_m - base_ned_m + Vec3::from(vertex.offset_m).as_dvec3();
            // Rounded once.
            let [north, east, down, uv @ ..] = placed.vertices[*position as usize];
            assert_eq!(([north, east, down], uv), (exact_m.as_vec3().to_array(), vertex.uv));
        }
        // Only vertices on chunk borders occur twice, and every vertex is used.
        let mut used: Vec<u32> = placed.indices.clone();
        used.sort_unstable();
        used.dedup();
        assert_eq!(used.len(), placed.vertices.len());
        let inner = placed.vertices.len() - mesh.chunks.len() * 4 * 64;
        let mut positions: Vec<[u32; 3]> = placed
            .vertices
            .iter()
            .map(|vertex| [vertex[0], vertex[1], vertex[2]].map(f32::to_bits))
            .collect();
        positions.sort_unstable();
        positions.dedup();
        assert!(positions.len() >= inner);
        assert_eq!(placed.bytes(), 20 * placed.vertices.len() as u64 + 4 * placed.indices.len() as u64);
    }
}
