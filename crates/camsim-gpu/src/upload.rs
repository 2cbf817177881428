//! The scene on the GPU: textures with their mip levels, terrain and mesh buffers. Uploaded once per
//! sequence.

use std::{collections::HashMap, ops::Range, sync::Arc};

use camsim_core::scene::{Batch, Encoding, Scene, SceneBatches, Terrain, TexelForm, Texture, Wrap, is_whole};
use wgpu::util::DeviceExt;

use crate::{
    adapter::GpuError,
    context::GpuContext,
    layout::{MeshMaterial, MeshVertexData},
    tiles::{TilePool, texture_format},
};

/// GPU resources of a scene.
#[derive(Debug)]
pub struct SceneBuffers {
    /// Terrain, if there is one.
    pub terrain: Option<TerrainBuffers>,
    /// Meshes of the scene.
    pub meshes: Arc<SceneBatches>,
    /// Buffers of each batch of meshes.
    pub batches: Vec<MeshBatch>,
    /// Textures of the batches, once [uploaded](SceneBuffers::upload_textures).
    pub textures: Vec<wgpu::TextureView>,
    /// Trilinear sampler with clamped edges; the shader takes several taps for long footprints.
    pub sampler: wgpu::Sampler,
}

/// Terrain on the GPU, without its triangles: each frame uploads those that it draws.
#[derive(Debug)]
pub struct TerrainBuffers {
    /// Texture of the terrain.
    pub texture: TerrainTexture,
}

/// Texture of the terrain.
#[derive(Debug)]
pub enum TerrainTexture {
    /// One GPU texture, once [uploaded](SceneBuffers::upload_textures).
    Whole(Option<wgpu::TextureView>),
    /// Larger than a GPU texture: split into tiles.
    Tiles(Box<TilePool>),
}

/// Meshes that are drawn together: same shape and material.
#[derive(Debug)]
pub struct MeshBatch {
    /// Positions, texture coordinates and tints.
    pub vertices: wgpu::Buffer,
    /// Triangle lists by level of detail, up to the coarsest that was drawn.
    pub indices: Vec<wgpu::Buffer>,
    /// Sampler with the wrap modes of the material.
    pub sampler: wgpu::Sampler,
    /// Normals, if the mesh is illuminated.
    pub normals: Option<wgpu::Buffer>,
    /// [`MeshMaterial`]: emission, alpha cut-off, illumination.
    pub material: wgpu::Buffer,
    /// Pipeline that draws it.
    pub kind: MeshKind,
}

/// Properties in which pipelines of meshes differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MeshKind {
    /// Back faces are culled.
    pub one_sided: bool,
    /// An alpha mask is evaluated per sample.
    pub masked: bool,
    /// The mesh is illuminated by sun and sky.
    pub lit: bool,
    /// The mesh is blended over what is behind it.
    pub blends: bool,
}

impl MeshKind {
    /// Shader of its colour, below `shaders/`. Blended meshes have no alpha mask.
    pub(crate) fn shader(self) -> &'static str {
        match (self.masked && !self.blends, self.lit) {
            (false, false) => "ideal/mesh.wgsl",
            (false, true) => "ideal/mesh_lit.wgsl",
            (true, false) => "ideal/mesh_masked.wgsl",
            (true, true) => "ideal/mesh_masked_lit.wgsl",
        }
    }
}

impl SceneBuffers {
    /// Uploads a scene without its textures.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] for what the adapter cannot hold.
    pub fn new(gpu: &GpuContext, scene: &Scene, meshes: Arc<SceneBatches>) -> Result<Self, GpuError> {
        let sampler = create_sampler(gpu, [Wrap::Clamp; 2], false);
        let terrain = scene.terrain.as_ref().map(|terrain| upload_terrain(gpu, terrain)).transpose()?;
        let batches = meshes.batches.iter().map(|batch| upload_batch(gpu, batch)).collect();
        meshes.batches.iter().try_for_each(|batch| {
            check_texture(gpu, &batch.material.texture, "the texture of a mesh or pattern")
        })?;
        Ok(Self { terrain, meshes, batches, textures: Vec::new(), sampler })
    }

    /// Uploads the levels of detail that are drawn for the first time. `level_instances` has as many ranges for
    /// a batch as levels up to the coarsest that is drawn.
    pub fn upload_levels(&mut self, gpu: &GpuContext, level_instances: &[Vec<Range<u32>>]) {
        let batches = self.batches.iter_mut().zip(&self.meshes.batches).zip(level_instances);
        for ((uploaded, Batch { levels, .. }), level_instances) in batches {
            let new = uploaded.indices.len()..level_instances.len();
            uploaded.indices.extend(new.map(|level| {
                let indices = bytemuck::cast_slice(levels.indices(level));
                upload_buffer(gpu, "camsim.mesh.indices", indices, wgpu::BufferUsages::INDEX)
            }));
        }
    }

    /// Uploads the textures of the scene, unless already done: as long as the CPU draws all ideal frames the
    /// GPU needs none. A texture shared by several batches is uploaded once.
    pub fn upload_textures(&mut self, gpu: &GpuContext, scene: &Scene) {
        if let (Some(terrain), Some(TerrainBuffers { texture: TerrainTexture::Whole(texture) })) =
            (&scene.terrain, &mut self.terrain)
        {
            texture.get_or_insert_with(|| upload_texture(gpu, &terrain.texture, terrain.beyond));
        }
        if self.textures.len() < self.batches.len() {
            let mut cached: HashMap<*const Texture, wgpu::TextureView> = HashMap::new();
            let texture = |batch: &Batch| {
                let texture = &batch.material.texture;
                cached
                    .entry(Arc::as_ptr(texture))
                    .or_insert_with(|| upload_texture(gpu, texture, None))
                    .clone()
            };
            self.textures = self.meshes.batches.iter().map(texture).collect();
        }
    }

    /// Tiles of the terrain's texture, if it is split.
    pub(crate) fn tiles(&self) -> Option<&TilePool> {
        self.terrain.as_ref().and_then(|terrain| match &terrain.texture {
            TerrainTexture::Tiles(tiles) => Some(&**tiles),
            TerrainTexture::Whole(_) => None,
        })
    }

    /// Tiles of the terrain's texture, if it is split, for changes.
    pub(crate) fn tiles_mut(&mut self) -> Option<&mut TilePool> {
        self.terrain.as_mut().and_then(|terrain| match &mut terrain.texture {
            TerrainTexture::Tiles(tiles) => Some(&mut **tiles),
            TerrainTexture::Whole(_) => None,
        })
    }
}

fn create_sampler(gpu: &GpuContext, wrap: [Wrap; 2], nearest: bool) -> wgpu::Sampler {
    let [address_mode_u, address_mode_v] = wrap.map(|wrap| match wrap {
        Wrap::Clamp => wgpu::AddressMode::ClampToEdge,
        Wrap::Repeat => wgpu::AddressMode::Repeat,
        Wrap::Mirror => wgpu::AddressMode::MirrorRepeat,
    });
    gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("camsim.ideal.sampler"),
        address_mode_u,
        address_mode_v,
        mag_filter: if nearest { wgpu::FilterMode::Nearest } else { wgpu::FilterMode::Linear },
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..Default::default()
    })
}

fn upload_terrain(gpu: &GpuContext, terrain: &Terrain) -> Result<TerrainBuffers, GpuError> {
    let texture = match is_whole(terrain.texture.size_px, gpu.max_picture_px) {
        true => {
            check_texture(gpu, &terrain.texture, "scene.terrain.ortho")?;
            TerrainTexture::Whole(None)
        }
        false => TerrainTexture::Tiles(Box::new(TilePool::new(terrain, TexelForm::Light))),
    };
    Ok(TerrainBuffers { texture })
}

fn upload_batch(gpu: &GpuContext, batch: &Batch) -> MeshBatch {
    let Batch { shape, material, light, .. } = batch;
    let vertices: Vec<MeshVertexData> = shape.vertices.iter().map(MeshVertexData::from).collect();
    let [r, g, b] = material.emissive;
    let sun_sky =
        light.map_or([0.0; 4], |light| (light.sun * light.to_sun_ned).extend(light.sky).as_vec4().to_array());
    let uniform = MeshMaterial { emissive_cutoff: [r, g, b, material.cutoff.unwrap_or(0.0)], sun_sky };
    let buffer = |label, contents: &[u8], usage| upload_buffer(gpu, label, contents, usage);
    MeshBatch {
        vertices: buffer("camsim.mesh.vertices", bytemuck::cast_slice(&vertices), wgpu::BufferUsages::VERTEX),
        indices: Vec::new(),
        normals: light.map(|_| {
            buffer("camsim.mesh.normals", bytemuck::cast_slice(&shape.normals), wgpu::BufferUsages::VERTEX)
        }),
        sampler: create_sampler(gpu, material.wrap, material.nearest),
        material: buffer("camsim.mesh.material", bytemuck::bytes_of(&uniform), wgpu::BufferUsages::UNIFORM),
        kind: MeshKind {
            one_sided: material.one_sided,
            masked: material.cutoff.is_some(),
            lit: light.is_some(),
            blends: material.blends,
        },
    }
}

fn upload_buffer(gpu: &GpuContext, label: &str, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
    let size = contents.len() as u64;
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage,
        mapped_at_creation: true,
    });
    // A lost device cannot be written to; it reports that itself.
    if let Ok(mut range) = buffer.get_mapped_range_mut(..) {
        range.copy_from_slice(contents);
    }
    buffer.unmap();
    buffer
}

/// Checks that a texture fits the adapter.
fn check_texture(gpu: &GpuContext, texture: &Texture, what: &str) -> Result<(), GpuError> {
    let [width, height] = texture.size_px;
    if width.max(height) <= gpu.max_side_px() {
        return Ok(());
    }
    Err(GpuError::TooLarge {
        what: format!("{what} ({width}x{height} px)"),
        needed: u64::from(width.max(height)),
        limit_name: "max_texture_dimension_2d",
        limit: u64::from(gpu.max_side_px()),
        fix: "reduce the size of the image",
    })
}

/// Uploads a texture with its mip levels, which have a border if one is given.
fn upload_texture(gpu: &GpuContext, texture: &Texture, border: Option<[u8; 4]>) -> wgpu::TextureView {
    let [width, height] = texture.size_px;
    let form = match (texture.encoding, texture.size_px) {
        // Every device decodes these bytes exactly, and there are no mip levels: half floats would only
        // round.
        (Encoding::Linear, [1, 1]) => TexelForm::Stored,
        _ => TexelForm::Light,
    };
    let mips = texture.mips_with_border(form, border);
    let mut data = texture.texels(&texture.rgba8, form).into_owned();
    mips.iter().for_each(|mip| data.extend_from_slice(&mip.texels));
    let gpu_texture = gpu.device.create_texture_with_data(
        &gpu.queue,
        &wgpu::TextureDescriptor {
            label: Some("camsim.surface.texture"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: mips.len() as u32 + 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: texture_format(texture.encoding, form),
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        &data,
    );
    gpu_texture.create_view(&wgpu::TextureViewDescriptor::default())
}
