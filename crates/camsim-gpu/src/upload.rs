//! The scene on the device: textures with their mips, terrain and mesh buffers. Uploaded once a sequence.

use camsim_core::scene::{Encoding, Mesh, Scene, Terrain, Texture, Wrap, is_whole};
use glam::DVec3;
use wgpu::util::DeviceExt;

use crate::{
    context::{GpuContext, GpuError},
    tiles::TilePool,
};

/// A scene's device resources.
#[derive(Debug)]
pub struct SceneBuffers {
    /// Terrain, if there is any.
    pub terrain: Option<TerrainBuffers>,
    /// Meshes in scene order.
    pub meshes: Vec<MeshBuffers>,
    /// Trilinear, edges held; the shader takes several taps where the footprint is long.
    pub sampler: wgpu::Sampler,
}

/// A terrain on the device, without its triangles: each frame brings those that it draws.
#[derive(Debug)]
pub struct TerrainBuffers {
    /// On the ground.
    pub picture: GroundPicture,
}

/// The picture on the ground.
#[derive(Debug)]
pub enum GroundPicture {
    /// In one texture.
    Whole(wgpu::TextureView),
    /// Too large for one.
    Tiles(Box<TilePool>),
}

/// One mesh.
#[derive(Debug)]
pub struct MeshBuffers {
    /// Positions and texture coordinates.
    pub vertices: wgpu::Buffer,
    /// Triangle list.
    pub indices: wgpu::Buffer,
    /// Number of indices.
    pub count: u32,
    /// Picture.
    pub texture: wgpu::TextureView,
    /// What it shows outside of the picture.
    pub sampler: wgpu::Sampler,
    /// NED position of the mesh's own origin, metres.
    pub origin_ned_m: DVec3,
}

impl SceneBuffers {
    /// Uploads a scene.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] for what the adapter cannot hold.
    pub fn new(gpu: &GpuContext, scene: &Scene) -> Result<Self, GpuError> {
        let sampler = create_sampler(gpu, Wrap::Clamp);
        let terrain = scene.terrain.as_ref().map(|terrain| upload_terrain(gpu, terrain)).transpose()?;
        let meshes = scene.meshes.iter().map(|mesh| upload_mesh(gpu, mesh)).collect::<Result<_, _>>()?;
        Ok(Self { terrain, meshes, sampler })
    }
}

impl SceneBuffers {
    /// The tiles of the ground's picture, if it is not whole.
    pub(crate) fn tiles(&self) -> Option<&TilePool> {
        self.terrain.as_ref().and_then(|terrain| match &terrain.picture {
            GroundPicture::Tiles(tiles) => Some(&**tiles),
            GroundPicture::Whole(_) => None,
        })
    }

    /// As [`SceneBuffers::tiles`].
    pub(crate) fn tiles_mut(&mut self) -> Option<&mut TilePool> {
        self.terrain.as_mut().and_then(|terrain| match &mut terrain.picture {
            GroundPicture::Tiles(tiles) => Some(&mut **tiles),
            GroundPicture::Whole(_) => None,
        })
    }
}

fn create_sampler(gpu: &GpuContext, wrap: Wrap) -> wgpu::Sampler {
    let address = match wrap {
        Wrap::Clamp => wgpu::AddressMode::ClampToEdge,
        Wrap::Repeat => wgpu::AddressMode::Repeat,
    };
    gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("camsim.ideal.sampler"),
        address_mode_u: address,
        address_mode_v: address,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..Default::default()
    })
}

fn upload_terrain(gpu: &GpuContext, terrain: &Terrain) -> Result<TerrainBuffers, GpuError> {
    let picture = match is_whole(terrain.texture.size_px, gpu.max_picture_px) {
        true => GroundPicture::Whole(upload_texture(gpu, &terrain.texture, "scene.terrain.ortho")?),
        false => GroundPicture::Tiles(Box::new(TilePool::new(terrain))),
    };
    Ok(TerrainBuffers { picture })
}

fn upload_mesh(gpu: &GpuContext, mesh: &Mesh) -> Result<MeshBuffers, GpuError> {
    let texture = upload_texture(gpu, &mesh.texture, "the picture of a mesh or pattern")?;
    let floats: Vec<f32> = mesh.vertices.iter().flat_map(|v| v.position_m.into_iter().chain(v.uv)).collect();
    let buffer = |label, contents: &[u8], usage| {
        gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
    };
    Ok(MeshBuffers {
        vertices: buffer("camsim.mesh.vertices", bytemuck::cast_slice(&floats), wgpu::BufferUsages::VERTEX),
        indices: buffer("camsim.mesh.indices", bytemuck::cast_slice(&mesh.indices), wgpu::BufferUsages::INDEX),
        count: mesh.indices.len() as u32,
        texture,
        sampler: create_sampler(gpu, mesh.wrap),
        origin_ned_m: mesh.origin_ned_m,
    })
}

fn upload_texture(gpu: &GpuContext, texture: &Texture, what: &str) -> Result<wgpu::TextureView, GpuError> {
    let [width, height] = texture.size_px;
    if width.max(height) > gpu.max_side_px() {
        return Err(GpuError::TooLarge {
            what: format!("{what} ({width}x{height} px)"),
            needed: u64::from(width.max(height)),
            limit_name: "max_texture_dimension_2d",
            limit: u64::from(gpu.max_side_px()),
            fix: "reduce the picture",
        });
    }
    let mips = texture.mips();
    let format = match texture.encoding {
        Encoding::Srgb => wgpu::TextureFormat::Rgba8UnormSrgb,
        Encoding::Linear => wgpu::TextureFormat::Rgba8Unorm,
    };
    let mut data = texture.rgba8.clone();
    mips.iter().for_each(|mip| data.extend_from_slice(&mip.rgba8));
    let on_device = gpu.device.create_texture_with_data(
        &gpu.queue,
        &wgpu::TextureDescriptor {
            label: Some("camsim.surface.texture"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: mips.len() as u32 + 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        &data,
    );
    Ok(on_device.create_view(&wgpu::TextureViewDescriptor::default()))
}
