//! The scene as plain data: terrain, meshes, textures, sky, fog and light. Independent of GPU and file
//! formats.
//!
//! All positions are local NED in metres. Vertices are f32 offsets from an f64 (or whole-metre) origin, so
//! that the renderer can form camera-relative coordinates without cancellation.

use crate::pose::CameraPose;

pub mod batches;
mod blend_split;
pub mod board;
mod box4;
pub mod depth_sort;
pub mod light;
pub mod mesh;
pub mod mesh_lod;
pub mod motion;
mod prefilter;
pub mod proximity_bvh;
pub mod ray_bvh;
pub mod ray_packet;
pub mod terrain;
pub mod texture;
mod texture_tiles;

pub use batches::{Batch, PlacedShape, SceneBatches};
pub use blend_split::{BlendSplit, split_intersecting_blended};
pub use board::{Board, BoardError, BoardPoint, ned_from_board};
pub use light::{Light, transformed_normal};
pub use mesh::{Material, Mesh, MeshVertex, Shape};
pub use mesh_lod::{LodTolerance, ModelLod, SceneLods, ShapeLod, ShapeLods};
pub use motion::{RigidMotion, RigidState};
pub use prefilter::{Prefilter, PrefilterTaps};
pub use terrain::{
    Aabb, CHUNK_CELLS, DrawnCell, LodSelection, PlacedMesh, SunMap, Terrain, TerrainChunk, TerrainDetail,
    TerrainError, TerrainGrid, TerrainHit, TerrainMesh, TerrainTiles, TerrainTriangle, TerrainVertex,
    TerrainWalk, WalkHit,
};
pub use texture::{
    Encoding, LUMINANCE, LUMINANCE_F64, MipLevel, TexelForm, Texture, Wrap, linear_from_srgb,
    linear_from_srgb_f64, luminance, srgb_from_linear, srgb_from_linear_f64,
};
pub use texture_tiles::{TILE_SIDE, TileGrid, TileSource, is_whole, tile_bytes};

/// A scene.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Ground from an elevation model.
    pub terrain: Option<Terrain>,
    /// All other surfaces, including the planar pattern and the calibration board.
    pub meshes: Vec<Mesh>,
    /// Colour of the sky, linear light.
    pub sky_linear: [f32; 3],
    /// Visibility V in metres: colour is mixed with the sky by 1 - exp(-3.912 d / V), with the slant range d.
    pub fog_visibility_m: Option<f64>,
    /// Light on meshes whose shapes have normals. On the terrain, light is baked into the texture
    /// ([`Terrain::bake_light`]). Without light, colours are used as they are.
    pub light: Option<Light>,
    /// Its objects, in the order of their numbers.
    pub objects: Vec<SceneObject>,
    /// Number of the terrain's object, counted from 1; 0 = none.
    pub terrain_object: u32,
}

/// An object of a scene: what `object` and `class` number.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneObject {
    /// Name that the scenario or the model gives it.
    pub name: String,
    /// Class that the scenario gives it; 0 = none.
    pub class: u16,
}

impl Scene {
    /// Names of the objects that move, in the order of their numbers; "unnamed" for what belongs to none.
    #[must_use]
    pub fn moving_objects(&self) -> Vec<&str> {
        let moving = self.meshes.iter().filter(|mesh| mesh.motion.is_some());
        let numbers: std::collections::BTreeSet<u32> = moving.map(|mesh| mesh.object).collect();
        let name = |number: u32| number.checked_sub(1).and_then(|index| self.objects.get(index as usize));
        numbers
            .into_iter()
            .map(|number| name(number).map_or("unnamed", |object| object.name.as_str()))
            .collect()
    }

    /// Number of the object that a surface belongs to (0 = terrain, 1 + i = mesh i), counted from 1; 0 if the
    /// surface belongs to none.
    #[must_use]
    pub fn object_of_surface(&self, surface: u32) -> u32 {
        match surface.checked_sub(1) {
            None => self.terrain_object,
            Some(mesh) => self.meshes.get(mesh as usize).map_or(0, |mesh| mesh.object),
        }
    }

    /// Class of the object that a surface belongs to; 0 = none.
    #[must_use]
    pub fn class_of_surface(&self, surface: u32) -> u32 {
        let object = self.object_of_surface(surface).checked_sub(1);
        object.and_then(|object| self.objects.get(object as usize)).map_or(0, |object| object.class.into())
    }

    /// Numbers of the meshes that emit light above white.
    pub fn lamps(&self) -> impl Iterator<Item = usize> + '_ {
        (0..).zip(&self.meshes).filter(|(_, mesh)| mesh.material.is_above_white()).map(|(number, _)| number)
    }

    /// Whether any mesh is blended with what is behind it.
    #[must_use]
    pub fn has_blended(&self) -> bool {
        self.meshes.iter().any(|mesh| mesh.material.blends)
    }

    /// Whether all silhouettes are borders of triangles: no surface is blended or cut out by the alpha of its
    /// texture.
    #[must_use]
    pub fn has_triangle_borders_only(&self) -> bool {
        self.meshes.iter().all(|mesh| !mesh.material.blends && mesh.material.cutoff.is_none())
    }

    /// Whether anything in it moves.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.meshes.iter().any(|mesh| mesh.motion.is_some())
    }

    /// Motion of a surface (0 = terrain, 1 + i = mesh i); `None` if it stands still.
    #[must_use]
    pub fn motion_of_surface(&self, surface: u32) -> Option<&RigidMotion> {
        let mesh = surface.checked_sub(1).and_then(|mesh| self.meshes.get(mesh as usize))?;
        mesh.motion.as_deref()
    }

    /// Bounding boxes of all meshes, NED; of what moves, at path time 0.
    #[must_use]
    pub fn mesh_bounds(&self) -> Vec<Aabb> {
        self.meshes.iter().map(Mesh::bounds).collect()
    }
}

/// Indices of the boxes that may be in view, in order. `tangents` are u_min, u_max, v_min, v_max.
#[must_use]
pub fn in_view(bounds: &[Aabb], pose: &CameraPose, tangents: [f64; 4]) -> Vec<u32> {
    let frustum = terrain::Frustum::new(pose, tangents);
    (0..).zip(bounds).filter(|(_, bounds)| frustum.may_see(bounds)).map(|(i, _)| i).collect()
}
