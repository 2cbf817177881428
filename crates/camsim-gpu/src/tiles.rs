//! Virtual texture: tiles of a texture that is larger than a GPU texture. Those that a frame may read are
//! uploaded before it and replace the least recently used ones.

use std::sync::Arc;

use camsim_core::scene::{Encoding, TILE_SIDE, Terrain, TerrainTiles, TexelForm, TileSource, tile_bytes};

use crate::{adapter::GpuError, context::GpuContext, recorder::Recorder};

/// Tiles along a side of an array layer, as in shaders/ideal/texture/tiled.wgsl.
const TILES_PER_SIDE: u32 = 8;
const TILES_PER_LAYER: u32 = TILES_PER_SIDE * TILES_PER_SIDE;
/// Mip levels for which the page table has room: a side of 2^32 texels.
const MAX_LEVELS: usize = 32;

/// The resident tiles. Capacity follows the neediest frame so far, with its number of layers rounded up to a
/// power of two: at most twice what that frame needs, and 16 MiB.
#[derive(Debug)]
pub struct TilePool {
    /// Tile grid of the terrain: which tiles a frame needs.
    pub ground: Arc<TerrainTiles>,
    source: TileSource,
    array: Option<TextureArray>,
    /// Slot of each resident tile, by tile.
    slot_of_tile: Vec<Option<u32>>,
    /// Content of each slot: the tile, and the number of the last frame that needed it.
    slot_contents: Vec<Option<(u32, u64)>>,
    frames: u64,
    /// Version numbers: of the page table, and of the texture array. Bind groups and buffers of a frame slot
    /// are outdated if theirs differ.
    versions: [u64; 2],
    /// Page table: `TileLayout` in shaders/ideal/texture/tiled.wgsl.
    table: Vec<u32>,
}

#[derive(Debug)]
struct TextureArray {
    texture: wgpu::Texture,
    array_view: wgpu::TextureView,
}

impl TilePool {
    /// Pool for the terrain's texture, with no tile resident.
    #[must_use]
    pub fn new(terrain: &Terrain, form: TexelForm) -> Self {
        let ground = Arc::new(TerrainTiles::new(terrain));
        let source = TileSource::new(&terrain.texture, form, terrain.beyond);
        let slot_of_tile = vec![None; source.grid.count as usize];
        Self {
            ground,
            source,
            array: None,
            slot_of_tile,
            slot_contents: Vec::new(),
            frames: 0,
            versions: [0; 2],
            table: Vec::new(),
        }
    }

    /// View of the texture array, once a frame has needed tiles.
    pub(crate) fn array_view(&self) -> Option<&wgpu::TextureView> {
        self.array.as_ref().map(|array| &array.array_view)
    }

    /// Size of the page table, bytes.
    pub(crate) fn table_bytes(&self) -> u64 {
        4 * (4 + MAX_LEVELS as u64 + u64::from(self.source.grid.count))
    }

    /// Version numbers of the page table and of the texture array.
    pub(crate) fn versions(&self) -> [u64; 2] {
        self.versions
    }

    /// Number of resident tiles, and size of the texture array, bytes.
    #[must_use]
    pub fn resident(&self) -> (usize, u64) {
        (
            self.slot_of_tile.iter().flatten().count(),
            self.slot_contents.len() as u64 * tile_bytes(self.source.form()),
        )
    }

    /// Makes the tiles of a frame resident. Frames that have been submitted read theirs before these are
    /// written.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] for a frame that needs more than a texture can hold.
    pub(crate) fn make_resident(&mut self, gpu: &GpuContext, tiles: &[u32]) -> Result<(), GpuError> {
        self.frames += 1;
        let is_grown = self.grow(gpu, tiles.len() as u32)?;
        for &tile in tiles {
            if let Some(slot) = self.slot_of_tile[tile as usize] {
                self.slot_contents[slot as usize] = Some((tile, self.frames));
            }
        }
        let missing: Vec<u32> =
            tiles.iter().copied().filter(|&tile| self.slot_of_tile[tile as usize].is_none()).collect();
        if missing.is_empty() && !is_grown {
            return Ok(());
        }
        let mut free_slots: Vec<u32> =
            (0..self.slot_contents.len() as u32).filter(|&slot| !self.is_needed(slot)).collect();
        // Empty slots first, then the least recently used.
        free_slots.sort_by_key(|&slot| self.slot_contents[slot as usize].map_or(0, |(_, frame)| frame));
        for (tile, slot) in missing.into_iter().zip(free_slots) {
            if let Some((old, _)) = self.slot_contents[slot as usize].replace((tile, self.frames)) {
                self.slot_of_tile[old as usize] = None;
            }
            self.slot_of_tile[tile as usize] = Some(slot);
            self.write(gpu, tile, slot);
        }
        self.table = self.make_table();
        self.versions = [self.versions[0] + 1, self.versions[1] + u64::from(is_grown)];
        Ok(())
    }

    fn is_needed(&self, slot: u32) -> bool {
        self.slot_contents[slot as usize].is_some_and(|(_, frame)| frame == self.frames)
    }

    fn grow(&mut self, gpu: &GpuContext, tiles: u32) -> Result<bool, GpuError> {
        if tiles as usize <= self.slot_contents.len() && self.array.is_some() {
            return Ok(false);
        }
        let needed = tiles.div_ceil(TILES_PER_LAYER).max(1);
        // All tiles of the texture are enough.
        let count = needed.next_power_of_two().min(self.source.grid.count.div_ceil(TILES_PER_LAYER));
        let limit = gpu.device.limits().max_texture_array_layers;
        if needed > limit {
            return Err(GpuError::TooLarge {
                what: format!(
                    "what one frame reads of scene.terrain.ortho ({} MiB in {tiles} tiles, in layers of \
                     {TILES_PER_LAYER})",
                    (u64::from(tiles) * tile_bytes(self.source.form())) >> 20
                ),
                needed: needed.into(),
                limit_name: "max_texture_array_layers",
                limit: limit.into(),
                fix: "reduce the size of the image, or camera.size_px",
            });
        }
        let count = count.min(limit);
        // The old array is dropped first: two would need too much memory.
        self.array = None;
        self.slot_of_tile.fill(None);
        self.slot_contents = vec![None; (count * TILES_PER_LAYER) as usize];
        let side = TILES_PER_SIDE * TILE_SIDE;
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("camsim.surface.tiles"),
            size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: count },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: texture_format(self.source.encoding(), self.source.form()),
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let array_view = texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        });
        self.array = Some(TextureArray { texture, array_view });
        Ok(true)
    }

    fn write(&self, gpu: &GpuContext, tile: u32, slot: u32) {
        let Some(array) = &self.array else { return };
        let origin = wgpu::Origin3d {
            x: slot % TILES_PER_SIDE * TILE_SIDE,
            y: slot % TILES_PER_LAYER / TILES_PER_SIDE * TILE_SIDE,
            z: slot / TILES_PER_LAYER,
        };
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture: &array.texture,
                mip_level: 0,
                origin,
                aspect: wgpu::TextureAspect::All,
            },
            &self.source.texels(tile),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(self.source.form().bytes() as u32 * TILE_SIDE),
                rows_per_image: None,
            },
            wgpu::Extent3d { width: TILE_SIDE, height: TILE_SIDE, depth_or_array_layers: 1 },
        );
    }

    fn make_table(&self) -> Vec<u32> {
        let grid = &self.source.grid;
        let mut table = vec![grid.sizes[0][0], grid.sizes[0][1], grid.sizes.len() as u32, 0];
        table.extend((0..MAX_LEVELS).map(|level| grid.first.get(level).copied().unwrap_or(0)));
        table.extend(grid.table(&|tile| self.slot_of_tile[tile as usize]));
        table
    }

    /// Uploads the page table to a buffer of [`TilePool::table_bytes`].
    pub(crate) fn write_table(&self, recorder: &mut Recorder<'_>, to: &wgpu::Buffer) {
        recorder.write(to, 0, bytemuck::cast_slice(&self.table));
    }
}

/// Format of a texture on the GPU.
pub(crate) fn texture_format(encoding: Encoding, form: TexelForm) -> wgpu::TextureFormat {
    match (form, encoding) {
        (TexelForm::Light, _) => wgpu::TextureFormat::Rgba16Float,
        (TexelForm::Stored, Encoding::Srgb) => wgpu::TextureFormat::Rgba8UnormSrgb,
        (TexelForm::Stored, Encoding::Linear) => wgpu::TextureFormat::Rgba8Unorm,
    }
}
