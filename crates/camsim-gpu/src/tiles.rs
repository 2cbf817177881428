//! Tiles of a picture that is larger than a texture: those that a frame may read are brought to the device
//! before it, in place of those that have not been needed for longest.

use std::sync::Arc;

use camsim_core::scene::{TILE_SIDE, Terrain, TerrainTiles, TexelForm, TileSource, tile_bytes};

use crate::{
    context::{GpuContext, GpuError},
    recorder::Recorder,
    upload::texture_format,
};

/// Tiles along a side of a layer of the texture that holds them, as in shaders/ideal/picture/tiles.wgsl.
const TILES_A_SIDE: u32 = 8;
const TILES_A_LAYER: u32 = TILES_A_SIDE * TILES_A_SIDE;
/// Versions that the table on the device has room for: a side of 2^32 texels.
const MOST_LEVELS: usize = 32;

/// The tiles on the device. There is room for the neediest frame so far, its number of layers rounded up to a
/// power of two: at most twice of what that frame needs and 16 MiB.
#[derive(Debug)]
pub struct TilePool {
    /// Which tiles a frame needs.
    pub ground: Arc<TerrainTiles>,
    source: TileSource,
    layers: Option<Layers>,
    /// Place of each tile.
    place_of: Vec<Option<u32>>,
    /// What is at each place: the tile and the number of the last frame that needed it.
    at_place: Vec<Option<(u32, u64)>>,
    frames: u64,
    /// How often tiles came, and how often the layers were replaced: what is bound and written is of these.
    changes: [u64; 2],
    /// The table as the device gets it: `TileTable` in shaders/ideal/picture/tiles.wgsl.
    table: Vec<u32>,
}

#[derive(Debug)]
struct Layers {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
}

impl TilePool {
    /// For the ground's picture. Nothing is on the device yet.
    #[must_use]
    pub fn new(terrain: &Terrain, form: TexelForm) -> Self {
        let ground = Arc::new(TerrainTiles::new(terrain));
        let source = TileSource::new(&terrain.texture, form, terrain.beyond);
        let place_of = vec![None; source.grid.count as usize];
        Self {
            ground,
            source,
            layers: None,
            place_of,
            at_place: Vec::new(),
            frames: 0,
            changes: [0; 2],
            table: Vec::new(),
        }
    }

    /// The layers, once a frame needed some.
    pub(crate) fn view(&self) -> Option<&wgpu::TextureView> {
        self.layers.as_ref().map(|layers| &layers.view)
    }

    /// Bytes of the table on the device.
    pub(crate) fn table_bytes(&self) -> u64 {
        4 * (4 + MOST_LEVELS as u64 + u64::from(self.source.grid.count))
    }

    /// How often tiles came, and how often the layers were replaced.
    pub(crate) fn changes(&self) -> [u64; 2] {
        self.changes
    }

    /// Tiles on the device, and what their layers take, bytes.
    #[must_use]
    pub fn held(&self) -> (usize, u64) {
        (self.place_of.iter().flatten().count(), self.at_place.len() as u64 * tile_bytes(self.source.form()))
    }

    /// Makes sure that a frame finds its tiles. Frames that have been submitted have read theirs before these
    /// are written.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] for a frame that needs more than a texture can hold.
    pub(crate) fn bring(&mut self, gpu: &GpuContext, tiles: &[u32]) -> Result<(), GpuError> {
        self.frames += 1;
        let is_new = self.make_room(gpu, tiles.len() as u32)?;
        for &tile in tiles {
            if let Some(place) = self.place_of[tile as usize] {
                self.at_place[place as usize] = Some((tile, self.frames));
            }
        }
        let absent: Vec<u32> =
            tiles.iter().copied().filter(|&tile| self.place_of[tile as usize].is_none()).collect();
        if absent.is_empty() && !is_new {
            return Ok(());
        }
        let mut places: Vec<u32> =
            (0..self.at_place.len() as u32).filter(|&place| !self.is_needed(place)).collect();
        // Empty ones come before those that were needed long ago.
        places.sort_by_key(|&place| self.at_place[place as usize].map_or(0, |(_, frame)| frame));
        for (tile, place) in absent.into_iter().zip(places) {
            if let Some((old, _)) = self.at_place[place as usize].replace((tile, self.frames)) {
                self.place_of[old as usize] = None;
            }
            self.place_of[tile as usize] = Some(place);
            self.write(gpu, tile, place);
        }
        self.table = self.make_table();
        self.changes = [self.changes[0] + 1, self.changes[1] + u64::from(is_new)];
        Ok(())
    }

    fn is_needed(&self, place: u32) -> bool {
        self.at_place[place as usize].is_some_and(|(_, frame)| frame == self.frames)
    }

    fn make_room(&mut self, gpu: &GpuContext, tiles: u32) -> Result<bool, GpuError> {
        if tiles as usize <= self.at_place.len() && self.layers.is_some() {
            return Ok(false);
        }
        let needed = tiles.div_ceil(TILES_A_LAYER).max(1);
        // As many as there can be at all are enough.
        let count = needed.next_power_of_two().min(self.source.grid.count.div_ceil(TILES_A_LAYER));
        let limit = gpu.device.limits().max_texture_array_layers;
        if needed > limit {
            return Err(GpuError::TooLarge {
                what: format!(
                    "what one frame reads of scene.terrain.ortho ({} MiB in {tiles} tiles, in layers of {TILES_A_LAYER})",
                    (u64::from(tiles) * tile_bytes(self.source.form())) >> 20
                ),
                needed: needed.into(),
                limit_name: "max_texture_array_layers",
                limit: limit.into(),
                fix: "reduce the picture, or camera.size_px",
            });
        }
        let count = count.min(limit);
        // The old ones go first: never two of them.
        self.layers = None;
        self.place_of.fill(None);
        self.at_place = vec![None; (count * TILES_A_LAYER) as usize];
        let side = TILES_A_SIDE * TILE_SIDE;
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
        let view = texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        });
        self.layers = Some(Layers { texture, view });
        Ok(true)
    }

    fn write(&self, gpu: &GpuContext, tile: u32, place: u32) {
        let Some(layers) = &self.layers else { return };
        let origin = wgpu::Origin3d {
            x: place % TILES_A_SIDE * TILE_SIDE,
            y: place % TILES_A_LAYER / TILES_A_SIDE * TILE_SIDE,
            z: place / TILES_A_LAYER,
        };
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture: &layers.texture,
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
        table.extend((0..MOST_LEVELS).map(|level| grid.first.get(level).copied().unwrap_or(0)));
        table.extend(grid.table(&|tile| self.place_of[tile as usize]));
        table
    }

    /// Writes the table of the frame at work to a buffer of [`TilePool::table_bytes`].
    pub(crate) fn write_table(&self, recorder: &mut Recorder<'_>, to: &wgpu::Buffer) {
        recorder.write(to, 0, bytemuck::cast_slice(&self.table));
    }
}
