//! The scene on the device: textures with their mips, terrain and mesh buffers. Uploaded once a sequence.

use std::{collections::HashMap, ops::Range, sync::Arc};

use camsim_core::scene::{Batch, Encoding, Scene, SceneBatches, Terrain, TexelForm, Texture, Wrap, is_whole};
use wgpu::util::DeviceExt;

use crate::{
    context::{GpuContext, GpuError},
    layout::{MeshMaterial, MeshVertexData},
    tiles::TilePool,
};

/// A scene's device resources.
#[derive(Debug)]
pub struct SceneBuffers {
    /// Terrain, if there is any.
    pub terrain: Option<TerrainBuffers>,
    /// The scene's meshes.
    pub meshes: Arc<SceneBatches>,
    /// Buffers of each batch of them.
    pub batches: Vec<MeshBatch>,
    /// Their pictures, once they have been [brought](SceneBuffers::bring_pictures).
    pub pictures: Vec<wgpu::TextureView>,
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
    /// In one texture, once that has been [brought](SceneBuffers::bring_pictures).
    Whole(Option<wgpu::TextureView>),
    /// Too large for one.
    Tiles(Box<TilePool>),
}

/// Meshes that are drawn at once: the same shape and the same material.
#[derive(Debug)]
pub struct MeshBatch {
    /// Positions, texture coordinates and tints.
    pub vertices: wgpu::Buffer,
    /// Triangle lists of all levels of detail.
    pub indices: wgpu::Buffer,
    /// Where in them each level is, the full shape first.
    pub ranges: Vec<Range<u32>>,
    /// What it shows outside of the picture.
    pub sampler: wgpu::Sampler,
    /// Normals, where light falls on them.
    pub normals: Option<wgpu::Buffer>,
    /// Light of its own, the alpha below which there is a hole, and the scene's light.
    pub material: wgpu::Buffer,
    /// Which pipeline draws it.
    pub kind: MeshKind,
}

/// What pipelines of meshes differ in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MeshKind {
    /// Triangles that turn away are left out.
    pub one_sided: bool,
    /// Samples ask for alpha.
    pub holes: bool,
    /// Light falls on it.
    pub lit: bool,
    /// Mixed with what is behind it.
    pub blends: bool,
}

impl MeshKind {
    /// What draws its colour, below `shaders/`: where it is mixed alpha makes no hole.
    pub(crate) fn shader(self) -> &'static str {
        match (self.holes && !self.blends, self.lit) {
            (false, false) => "ideal/mesh.wgsl",
            (false, true) => "ideal/mesh_lit.wgsl",
            (true, false) => "ideal/mesh_holes.wgsl",
            (true, true) => "ideal/mesh_holes_lit.wgsl",
        }
    }
}

impl SceneBuffers {
    /// Uploads a scene, but for its pictures.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] for what the adapter cannot hold.
    pub fn new(gpu: &GpuContext, scene: &Scene, meshes: Arc<SceneBatches>) -> Result<Self, GpuError> {
        let sampler = create_sampler(gpu, [Wrap::Clamp; 2], false);
        let terrain = scene.terrain.as_ref().map(|terrain| upload_terrain(gpu, terrain)).transpose()?;
        let batches = meshes.batches.iter().map(|batch| upload_batch(gpu, batch)).collect();
        meshes.batches.iter().try_for_each(|batch| {
            check_picture(gpu, &batch.material.texture, "the picture of a mesh or pattern")
        })?;
        Ok(Self { terrain, meshes, batches, pictures: Vec::new(), sampler })
    }

    /// Uploads the scene's pictures, unless they are there: as long as the host draws all ideal frames the
    /// device needs none. What several share is uploaded once.
    pub fn bring_pictures(&mut self, gpu: &GpuContext, scene: &Scene) {
        if let (Some(terrain), Some(TerrainBuffers { picture: GroundPicture::Whole(picture) })) =
            (&scene.terrain, &mut self.terrain)
        {
            picture.get_or_insert_with(|| upload_texture(gpu, &terrain.texture, terrain.beyond));
        }
        if self.pictures.len() < self.batches.len() {
            let mut known: HashMap<*const Texture, wgpu::TextureView> = HashMap::new();
            let picture = |batch: &Batch| {
                let texture = &batch.material.texture;
                known
                    .entry(Arc::as_ptr(texture))
                    .or_insert_with(|| upload_texture(gpu, texture, None))
                    .clone()
            };
            self.pictures = self.meshes.batches.iter().map(picture).collect();
        }
    }

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
    let picture = match is_whole(terrain.texture.size_px, gpu.max_picture_px) {
        true => {
            check_picture(gpu, &terrain.texture, "scene.terrain.ortho")?;
            GroundPicture::Whole(None)
        }
        false => GroundPicture::Tiles(Box::new(TilePool::new(terrain, TexelForm::Light))),
    };
    Ok(TerrainBuffers { picture })
}

fn upload_batch(gpu: &GpuContext, batch: &Batch) -> MeshBatch {
    let Batch { shape, levels, material, light, .. } = batch;
    let vertices: Vec<MeshVertexData> = shape.vertices.iter().map(MeshVertexData::from).collect();
    let (mut indices, mut ranges) = (Vec::<u32>::new(), Vec::new());
    for level in levels.levels() {
        let first = indices.len() as u32;
        indices.extend(&level.indices);
        ranges.push(first..indices.len() as u32);
    }
    let [r, g, b] = material.emissive;
    let sun_sky =
        light.map_or([0.0; 4], |light| (light.sun * light.to_sun_ned).extend(light.sky).as_vec4().to_array());
    let uniform = MeshMaterial { emissive_cutoff: [r, g, b, material.cutoff.unwrap_or(0.0)], sun_sky };
    let buffer = |label, contents: &[u8], usage| {
        let size = contents.len() as u64;
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage,
            mapped_at_creation: true,
        });
        // On a device that is lost there is nothing to write to; it says so itself.
        if let Ok(mut range) = buffer.get_mapped_range_mut(..) {
            range.copy_from_slice(contents);
        }
        buffer.unmap();
        buffer
    };
    MeshBatch {
        vertices: buffer("camsim.mesh.vertices", bytemuck::cast_slice(&vertices), wgpu::BufferUsages::VERTEX),
        indices: buffer("camsim.mesh.indices", bytemuck::cast_slice(&indices), wgpu::BufferUsages::INDEX),
        normals: light.map(|_| {
            buffer("camsim.mesh.normals", bytemuck::cast_slice(&shape.normals), wgpu::BufferUsages::VERTEX)
        }),
        ranges,
        sampler: create_sampler(gpu, material.wrap, material.nearest),
        material: buffer("camsim.mesh.material", bytemuck::bytes_of(&uniform), wgpu::BufferUsages::UNIFORM),
        kind: MeshKind {
            one_sided: material.one_sided,
            holes: material.cutoff.is_some(),
            lit: light.is_some(),
            blends: material.blends,
        },
    }
}

/// Of a picture on the device.
pub(crate) fn texture_format(encoding: Encoding, form: TexelForm) -> wgpu::TextureFormat {
    match (form, encoding) {
        (TexelForm::Light, _) => wgpu::TextureFormat::Rgba16Float,
        (TexelForm::Stored, Encoding::Srgb) => wgpu::TextureFormat::Rgba8UnormSrgb,
        (TexelForm::Stored, Encoding::Linear) => wgpu::TextureFormat::Rgba8Unorm,
    }
}

/// Refuses a picture that the adapter cannot hold.
fn check_picture(gpu: &GpuContext, texture: &Texture, what: &str) -> Result<(), GpuError> {
    let [width, height] = texture.size_px;
    if width.max(height) <= gpu.max_side_px() {
        return Ok(());
    }
    Err(GpuError::TooLarge {
        what: format!("{what} ({width}x{height} px)"),
        needed: u64::from(width.max(height)),
        limit_name: "max_texture_dimension_2d",
        limit: u64::from(gpu.max_side_px()),
        fix: "reduce the picture",
    })
}

/// With a border around the smaller versions if there is one.
fn upload_texture(gpu: &GpuContext, texture: &Texture, border: Option<[u8; 4]>) -> wgpu::TextureView {
    let [width, height] = texture.size_px;
    let form = match (texture.encoding, texture.size_px) {
        // Every device has the exact light of these bytes, and there are no smaller versions: a half would
        // only round.
        (Encoding::Linear, [1, 1]) => TexelForm::Stored,
        _ => TexelForm::Light,
    };
    let mips = texture.mips_with_border(form, border);
    let mut data = texture.texels(&texture.rgba8, form).into_owned();
    mips.iter().for_each(|mip| data.extend_from_slice(&mip.texels));
    let on_device = gpu.device.create_texture_with_data(
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
    on_device.create_view(&wgpu::TextureViewDescriptor::default())
}
