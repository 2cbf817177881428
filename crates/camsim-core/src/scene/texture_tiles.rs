//! Tiles of textures that are too large for the GPU: all mip levels are cut into squares, of which the GPU
//! holds those that a frame may read.
//!
//! A tile holds [`TILE_TEXELS`] of its level along each side, and one more on every side, so that a bilinear
//! read needs no other tile. Levels are those of [`Texture::mips`], and a read between two levels mixes one
//! read of each: the result equals that of a single texture up to the rounding of coordinates.

use std::{mem::size_of_val, sync::Arc};

use super::{Encoding, MipLevel, TexelForm, Texture};

/// Texels of a level along the side of a tile.
pub(crate) const TILE_TEXELS: u32 = 254;
/// Side of a tile including its border of one texel.
pub const TILE_SIDE: u32 = TILE_TEXELS + 2;
/// GPU memory of a tile, bytes.
#[must_use]
pub const fn tile_bytes(form: TexelForm) -> u64 {
    form.bytes() as u64 * (TILE_SIDE as u64) * (TILE_SIDE as u64)
}

/// Textures that take more memory than this with their mip levels are tiled even if the adapter supports
/// their size.
pub(crate) const MAX_WHOLE_BYTES: u64 = 512 << 20;

/// Whether a texture is uploaded whole, given the adapter's largest texture side.
#[must_use]
pub fn is_whole(size_px: [u32; 2], max_side_px: u32) -> bool {
    let [width, height] = size_px.map(u64::from);
    width.max(height) <= u64::from(max_side_px) && 16 * width * height / 3 <= MAX_WHOLE_BYTES
}

/// Subdivision of a texture into tiles: mip levels from the finest to a single texel, tiles row by row,
/// numbered consecutively over all levels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TileGrid {
    /// Width and height of each level.
    pub sizes: Vec<[u32; 2]>,
    /// Number of the first tile of each level.
    pub first: Vec<u32>,
    /// Number of tiles of all levels.
    pub count: u32,
}

impl TileGrid {
    /// Subdivision of a texture of a given size.
    #[must_use]
    pub fn new(size_px: [u32; 2]) -> Self {
        let mut grid = Self { sizes: Vec::new(), first: Vec::new(), count: 0 };
        let mut size = size_px;
        loop {
            let [across, down] = size.map(|side| side.div_ceil(TILE_TEXELS));
            grid.first.push(grid.count);
            grid.sizes.push(size);
            grid.count += across * down;
            if size == [1, 1] {
                return grid;
            }
            size = size.map(|side| (side / 2).max(1));
        }
    }

    /// Tiles of a level, across and down.
    #[must_use]
    pub fn tiles(&self, level: usize) -> [u32; 2] {
        self.sizes[level].map(|side| side.div_ceil(TILE_TEXELS))
    }

    /// First and last tile, by column and row, that hold the texels between two texture coordinates plus
    /// `margin` texels. Coordinates outside of the texture take its border.
    #[must_use]
    pub fn tiles_between(&self, level: usize, low: [f64; 2], high: [f64; 2], margin: f64) -> [[u32; 2]; 2] {
        let tiles = self.tiles(level);
        let texel_at = |uv: f64, k: usize, margin: f64| {
            let texel = uv * f64::from(self.sizes[level][k]) + margin;
            // The conversion saturates; NaN gives 0.
            ((texel / f64::from(TILE_TEXELS)).floor().max(0.0) as u32).min(tiles[k] - 1)
        };
        [0, 1].map(|k: usize| [texel_at(low[k], k, -margin), texel_at(high[k], k, margin)])
    }

    /// Level, column and row of a tile.
    fn level_and_position(&self, tile: u32) -> (usize, [u32; 2]) {
        let level = self.first.partition_point(|&first| first <= tile) - 1;
        let (within, across) = (tile - self.first[level], self.tiles(level)[0]);
        (level, [within % across, within / across])
    }

    /// Page table for the shader: `slot << 8 | 0` for a resident tile; otherwise the number of levels to the
    /// first one at which all its texels are resident. The last level must always be resident.
    #[must_use]
    pub fn table(&self, slot_of: &dyn Fn(u32) -> Option<u32>) -> Vec<u32> {
        let mut table = vec![0; self.count as usize];
        for level in (0..self.sizes.len()).rev() {
            let [across, down] = self.tiles(level);
            for row in 0..down {
                for column in 0..across {
                    let tile = self.first[level] + row * across + column;
                    table[tile as usize] = match slot_of(tile) {
                        Some(index) => index << 8,
                        None => self.levels_to_resident(&table, level, [column, row]),
                    };
                }
            }
        }
        table
    }

    /// Number of levels from an absent tile to the first one that has all its texels: the largest of the
    /// numbers in the table for the next level, plus one.
    fn levels_to_resident(&self, table: &[u32], level: usize, at: [u32; 2]) -> u32 {
        if level + 1 == self.sizes.len() {
            return 0;
        }
        let edge = |n: u32, k: usize| f64::from(n * TILE_TEXELS) / f64::from(self.sizes[level][k]);
        let (low, high) = ([edge(at[0], 0), edge(at[1], 1)], [edge(at[0] + 1, 0), edge(at[1] + 1, 1)]);
        let [columns, rows] = self.tiles_between(level + 1, low, high, 0.01);
        let across = self.tiles(level + 1)[0];
        let named = (rows[0]..=rows[1])
            .flat_map(|row| (columns[0]..=columns[1]).map(move |column| row * across + column));
        1 + named
            .map(|tile| table[(self.first[level + 1] + tile) as usize])
            .map(|entry| entry & 0xff)
            .max()
            .unwrap_or(0)
    }
}

/// Source of tiles: a texture and its mip levels in host memory.
#[derive(Clone, Debug)]
pub struct TileSource {
    /// Subdivision into tiles.
    pub grid: TileGrid,
    texture: Arc<Texture>,
    form: TexelForm,
    mips: Vec<MipLevel>,
}

impl TileSource {
    /// Computes the mip levels, with a border of one colour if given.
    #[must_use]
    pub fn new(texture: &Arc<Texture>, form: TexelForm, border: Option<[u8; 4]>) -> Self {
        Self {
            grid: TileGrid::new(texture.size_px),
            texture: texture.clone(),
            form,
            mips: texture.mips_with_border(form, border),
        }
    }

    /// Form of [`TileSource::texels`].
    #[must_use]
    pub fn form(&self) -> TexelForm {
        self.form
    }

    /// Encoding of the bytes.
    #[must_use]
    pub fn encoding(&self) -> Encoding {
        self.texture.encoding
    }

    /// Memory of the texture with its levels, bytes: 16/3 per texel, 20/3 with levels in
    /// [`TexelForm::Light`].
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let mips: usize = self.mips.iter().map(|mip| size_of_val(&*mip.texels)).sum();
        (size_of_val(&*self.texture.rgba8) + mips) as u64
    }

    /// Texels of a tile, [`TILE_SIDE`] along each side. Outside of the texture its border continues.
    #[must_use]
    pub fn texels(&self, tile: u32) -> Vec<u8> {
        let (level, at) = self.grid.level_and_position(tile);
        match level.checked_sub(1) {
            // The finest level is stored as bytes.
            None => self
                .texture
                .texels(&self.cut(0, at, &self.texture.rgba8, TexelForm::Stored.bytes()), self.form)
                .into_owned(),
            Some(version) => self.cut(level, at, &self.mips[version].texels, self.form.bytes()),
        }
    }

    fn cut(&self, level: usize, at: [u32; 2], texels: &[u8], bytes: usize) -> Vec<u8> {
        let [width, height] = self.grid.sizes[level];
        let [west, north] = at.map(|n| i64::from(n * TILE_TEXELS) - 1);
        let within = |at: i64, side: u32| at.clamp(0, i64::from(side) - 1) as usize;
        let mut tile = Vec::with_capacity(bytes * (TILE_SIDE * TILE_SIDE) as usize);
        for row in 0..i64::from(TILE_SIDE) {
            let row =
                &texels[bytes * within(north + row, height) * width as usize..][..bytes * width as usize];
            // The part within the texture is one piece; its ends are repeated on both sides.
            let [first, last] = [west, west + i64::from(TILE_SIDE) - 1].map(|column| within(column, width));
            let before = first as i64 - west;
            (0..before).for_each(|_| tile.extend_from_slice(&row[..bytes]));
            tile.extend_from_slice(&row[bytes * first..bytes * (last + 1)]);
            let after = i64::from(TILE_SIDE) - before - (last - first) as i64 - 1;
            (0..after).for_each(|_| tile.extend_from_slice(&row[bytes * last..bytes * (last + 1)]));
        }
        tile
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(size_px: [u32; 2]) -> Arc<Texture> {
        let pixels = (0..size_px[0] * size_px[1])
            .flat_map(|i| crate::noise::pcg4d([i, 3, 0, 0]).map(|bits| (bits >> 24) as u8));
        Arc::new(Texture { size_px, rgba8: pixels.collect(), encoding: Encoding::Srgb })
    }

    #[test]
    fn tiles_hold_every_mip_level_with_a_border() {
        for form in [TexelForm::Stored, TexelForm::Light] {
            expect_every_level(form);
        }
    }

    fn expect_every_level(form: TexelForm) {
        let texture = picture([700, 259]);
        let source = TileSource::new(&texture, form, None);
        let whole = texture.texels(&texture.rgba8, form);
        let bytes = form.bytes();
        let versions: Vec<_> = [(texture.size_px, &*whole)]
            .into_iter()
            .chain(source.mips.iter().map(|mip| (mip.size_px, &*mip.texels)))
            .collect();
        assert_eq!(versions.iter().map(|version| version.0).collect::<Vec<_>>(), source.grid.sizes);
        assert_eq!(source.grid.count, 3 * 2 + 2 + 8);
        for (level, ([width, height], expected_texels)) in versions.into_iter().enumerate() {
            let across = source.grid.tiles(level)[0];
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                let tile = source.grid.first[level] + y / TILE_TEXELS * across + x / TILE_TEXELS;
                assert_eq!(source.grid.level_and_position(tile), (level, [x / TILE_TEXELS, y / TILE_TEXELS]));
                if x % 97 != 0 && x + 1 != width && x % TILE_TEXELS != 0 {
                    continue;
                }
                let texels = source.texels(tile);
                // The neighbouring texels as well, which may lie in other tiles.
                for (dx, dy) in [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)] {
                    let [column, row] =
                        [(x % TILE_TEXELS) as i32 + 1 + dx, (y % TILE_TEXELS) as i32 + 1 + dy];
                    let first_byte = bytes * (row * TILE_SIDE as i32 + column) as usize;
                    let [i, j] = [
                        (x as i32 + dx).clamp(0, width as i32 - 1),
                        (y as i32 + dy).clamp(0, height as i32 - 1),
                    ];
                    let expected = bytes * (j * width as i32 + i) as usize;
                    assert_eq!(
                        texels[first_byte..first_byte + bytes],
                        expected_texels[expected..expected + bytes],
                        "{level} {x} {y} {dx} {dy}"
                    );
                }
                break;
            }
        }
    }

    #[test]
    fn page_table_of_absent_tiles_points_to_a_resident_level() {
        let grid = TileGrid::new([3001, 1777]);
        for seed in 0..20 {
            // The last levels are always resident.
            let last = grid.first[grid.sizes.len() - 6];
            let is_there =
                |tile: u32| tile >= last || crate::noise::pcg4d([tile, seed, 0, 0])[0].is_multiple_of(3);
            let table = grid.table(&|tile| is_there(tile).then_some(tile + 5));
            let mut far = 0;
            for tile in 0..grid.count {
                let (level, at) = grid.level_and_position(tile);
                let steps = table[tile as usize] & 0xff;
                assert_eq!(steps == 0, is_there(tile));
                if steps == 0 {
                    assert_eq!(table[tile as usize] >> 8, tile + 5);
                    continue;
                }
                far = far.max(steps);
                // Wherever the tile is read, that level's tile is resident.
                let there = level + steps as usize;
                for k in 0..400_u32 {
                    let uv = [0, 1].map(|axis: usize| {
                        let fraction = f64::from(crate::noise::pcg4d([k, tile, axis as u32, 1])[0])
                            / f64::from(u32::MAX);
                        ((f64::from(at[axis]) + fraction) * f64::from(TILE_TEXELS)
                            / f64::from(grid.sizes[level][axis]))
                        .min(1.0)
                    });
                    let [[column, _], [row, _]] = grid.tiles_between(there, uv, uv, 0.0);
                    assert!(
                        is_there(grid.first[there] + row * grid.tiles(there)[0] + column),
                        "{tile} {steps}"
                    );
                }
            }
            assert!(far >= 2);
        }
    }
}
