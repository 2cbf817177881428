//! The scene as plain data: terrain, meshes, pictures, sky, fog. No GPU and no file format in here.
//!
//! Everything stands in local NED metres. Vertices are f32 offsets from an f64 (or whole-metre) origin, so
//! that the renderer can form camera-relative coordinates without cancellation.

use crate::pose::CameraPose;

pub mod board;
pub mod box_tree;
pub mod crossings;
pub mod levels;
pub mod light;
pub mod mesh;
pub mod paint_order;
pub mod picture_tiles;
mod quad;
pub mod ray_tree;
pub mod surface_filter;
pub mod terrain;
pub mod texture;

pub use board::{Board, BoardError, BoardPoint, ned_from_board};
pub use crossings::{Crossings, cut_where_blended_cross};
pub use levels::{LevelTolerance, ModelDetail, SceneLevels, ShapeLevel, ShapeLevels};
pub use light::{Light, turned_normal};
pub use mesh::{Material, Mesh, MeshVertex, Shape};
pub use picture_tiles::{TILE_SIDE, TILE_TEXELS, TileGrid, TileSource, WHOLE_BYTES, is_whole, tile_bytes};
pub use surface_filter::{SurfaceFilter, SurfaceReads};
pub use terrain::{
    Aabb, CHUNK_CELLS, DrawnCell, GroundTiles, LodSelection, PlacedMesh, Terrain, TerrainChunk,
    TerrainDetail, TerrainError, TerrainGrid, TerrainHit, TerrainMesh, TerrainVertex, VERTEX_BITS,
};
pub use texture::{Encoding, MipLevel, TexelForm, Texture, Wrap, linear_from_srgb, srgb_from_linear};

/// What there is to see.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Ground from an elevation model.
    pub terrain: Option<Terrain>,
    /// Everything else that has a surface (the planar pattern is one of them).
    pub meshes: Vec<Mesh>,
    /// Colour where no surface is, linear light.
    pub sky_linear: [f32; 3],
    /// Visibility V in metres: colour is mixed with the sky by 1 - exp(-3.912 d / V), d = slant range.
    pub fog_visibility_m: Option<f64>,
    /// Light on meshes whose shapes have normals; the ground has it in its picture ([`Terrain::light_up`]).
    /// Without, colours are as they are.
    pub light: Option<Light>,
}

impl Scene {
    /// Whether anything is mixed with what is behind it.
    #[must_use]
    pub fn has_blended(&self) -> bool {
        self.meshes.iter().any(|mesh| mesh.material.blends)
    }

    /// Whether all borders are those of triangles: no surface is mixed with what is behind it or has holes by
    /// its picture.
    #[must_use]
    pub fn has_borders_of_triangles(&self) -> bool {
        self.meshes.iter().all(|mesh| !mesh.material.blends && mesh.material.cutoff.is_none())
    }

    /// Boxes around all meshes, NED.
    #[must_use]
    pub fn mesh_bounds(&self) -> Vec<Aabb> {
        self.meshes.iter().map(Mesh::bounds).collect()
    }
}

/// Places of the boxes that may be in view, in order. `tangents`: u_min, u_max, v_min, v_max.
#[must_use]
pub fn in_view(bounds: &[Aabb], pose: &CameraPose, tangents: [f64; 4]) -> Vec<u32> {
    let frustum = terrain::Frustum::new(pose, tangents);
    (0..).zip(bounds).filter(|(_, bounds)| frustum.may_see(bounds)).map(|(i, _)| i).collect()
}
