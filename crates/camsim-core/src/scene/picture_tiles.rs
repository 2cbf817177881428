//! A picture that is too large for one texture, in tiles: all of its smaller versions are cut into squares,
//! of which a device holds those that a frame may read.
//!
//! A tile holds [`TILE_TEXELS`] of its version along each side and one more around them, so that a bilinear
//! read within it needs no other tile. Versions are those of [`Texture::mips`], and reads between two
//! versions mix one read of each: what is read is what a single texture would give, up to the rounding of
//! coordinates.

use std::{mem::size_of_val, sync::Arc};

use super::{Encoding, MipLevel, TexelForm, Texture};

/// Texels of a version along a tile's side.
pub const TILE_TEXELS: u32 = 254;
/// With one more at each end.
pub const TILE_SIDE: u32 = TILE_TEXELS + 2;
/// Memory of a tile on a device.
#[must_use]
pub const fn tile_bytes(form: TexelForm) -> u64 {
    form.bytes() as u64 * (TILE_SIDE as u64) * (TILE_SIDE as u64)
}

/// A picture that takes more than this with its smaller versions is cut into tiles even where an adapter has
/// textures as large.
pub const WHOLE_BYTES: u64 = 512 << 20;

/// Whether a device holds a picture whole, in a texture of at most `max_side_px`.
#[must_use]
pub fn is_whole(size_px: [u32; 2], max_side_px: u32) -> bool {
    let [width, height] = size_px.map(u64::from);
    width.max(height) <= u64::from(max_side_px) && 16 * width * height / 3 <= WHOLE_BYTES
}

/// How a picture is cut: versions from the finest to one of a single texel, tiles row after row, numbered
/// through all versions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TileGrid {
    /// Width and height of each version.
    pub sizes: Vec<[u32; 2]>,
    /// Number of the first tile of each version.
    pub first: Vec<u32>,
    /// Of all versions.
    pub count: u32,
}

impl TileGrid {
    /// For a picture of a size.
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

    /// Tiles of a version, across and down.
    #[must_use]
    pub fn tiles(&self, level: usize) -> [u32; 2] {
        self.sizes[level].map(|side| side.div_ceil(TILE_TEXELS))
    }

    /// Columns and rows of the tiles of a version that hold what lies between two texture coordinates and
    /// `margin` texels around. Outside of the picture its border is read.
    #[must_use]
    pub fn between(&self, level: usize, low: [f64; 2], high: [f64; 2], margin: f64) -> [[u32; 2]; 2] {
        let tiles = self.tiles(level);
        let at = |uv: f64, k: usize, margin: f64| {
            let texel = uv * f64::from(self.sizes[level][k]) + margin;
            // Saturates; NaN is the first.
            ((texel / f64::from(TILE_TEXELS)).floor().max(0.0) as u32).min(tiles[k] - 1)
        };
        [0, 1].map(|k: usize| [at(low[k], k, -margin), at(high[k], k, margin)])
    }

    /// Version, column and row of a tile.
    fn place(&self, tile: u32) -> (usize, [u32; 2]) {
        let level = self.first.partition_point(|&first| first <= tile) - 1;
        let (within, across) = (tile - self.first[level], self.tiles(level)[0]);
        (level, [within % across, within / across])
    }

    /// For each tile where it is, as a device reads it: `place << 8 | 0`, or, where it is not on the device,
    /// how many versions further all that it shows is there. The last version always has to be.
    #[must_use]
    pub fn table(&self, place_of: &dyn Fn(u32) -> Option<u32>) -> Vec<u32> {
        let mut table = vec![0; self.count as usize];
        for level in (0..self.sizes.len()).rev() {
            let [across, down] = self.tiles(level);
            for row in 0..down {
                for column in 0..across {
                    let tile = self.first[level] + row * across + column;
                    table[tile as usize] = match place_of(tile) {
                        Some(place) => place << 8,
                        None => self.further(&table, level, [column, row]),
                    };
                }
            }
        }
        table
    }

    /// Versions from an absent tile to the first that has all of it: the farthest of those that the next
    /// version's tiles name.
    fn further(&self, table: &[u32], level: usize, at: [u32; 2]) -> u32 {
        if level + 1 == self.sizes.len() {
            return 0;
        }
        let edge = |n: u32, k: usize| f64::from(n * TILE_TEXELS) / f64::from(self.sizes[level][k]);
        let (low, high) = ([edge(at[0], 0), edge(at[1], 1)], [edge(at[0] + 1, 0), edge(at[1] + 1, 1)]);
        let [columns, rows] = self.between(level + 1, low, high, 0.01);
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

/// Where tiles come from: a picture and its versions in the host's memory.
#[derive(Clone, Debug)]
pub struct TileSource {
    /// How it is cut.
    pub grid: TileGrid,
    texture: Arc<Texture>,
    form: TexelForm,
    mips: Vec<MipLevel>,
}

impl TileSource {
    /// Computes the smaller versions, within a border of a colour if there is one.
    #[must_use]
    pub fn new(texture: &Arc<Texture>, form: TexelForm, border: Option<[u8; 4]>) -> Self {
        Self {
            grid: TileGrid::new(texture.size_px),
            texture: texture.clone(),
            form,
            mips: texture.mips_within(form, border),
        }
    }

    /// What [`TileSource::texels`] are.
    #[must_use]
    pub fn form(&self) -> TexelForm {
        self.form
    }

    /// Meaning of its bytes.
    #[must_use]
    pub fn encoding(&self) -> Encoding {
        self.texture.encoding
    }

    /// Memory of picture and versions, bytes: 16/3 a texel, 20/3 with versions of [`TexelForm::Light`].
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let mips: usize = self.mips.iter().map(|mip| size_of_val(&*mip.texels)).sum();
        (size_of_val(&*self.texture.rgba8) + mips) as u64
    }

    /// The texels of a tile, [`TILE_SIDE`] along each side: beyond the picture its border goes on.
    #[must_use]
    pub fn texels(&self, tile: u32) -> Vec<u8> {
        let (level, at) = self.grid.place(tile);
        match level.checked_sub(1) {
            // The picture itself stands there in bytes.
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
            // What lies within the picture is one piece; its ends are repeated to both sides.
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
    fn tiles_hold_every_version_with_a_border_around() {
        for form in [TexelForm::Stored, TexelForm::Light] {
            expect_every_version(form);
        }
    }

    fn expect_every_version(form: TexelForm) {
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
                assert_eq!(source.grid.place(tile), (level, [x / TILE_TEXELS, y / TILE_TEXELS]));
                if x % 97 != 0 && x + 1 != width && x % TILE_TEXELS != 0 {
                    continue;
                }
                let texels = source.texels(tile);
                // And its neighbours, which may lie in other tiles.
                for (dx, dy) in [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)] {
                    let [column, row] =
                        [(x % TILE_TEXELS) as i32 + 1 + dx, (y % TILE_TEXELS) as i32 + 1 + dy];
                    let at = bytes * (row * TILE_SIDE as i32 + column) as usize;
                    let [i, j] = [
                        (x as i32 + dx).clamp(0, width as i32 - 1),
                        (y as i32 + dy).clamp(0, height as i32 - 1),
                    ];
                    let expected = bytes * (j * width as i32 + i) as usize;
                    assert_eq!(
                        texels[at..at + bytes],
                        expected_texels[expected..expected + bytes],
                        "{level} {x} {y} {dx} {dy}"
                    );
                }
                break;
            }
        }
    }

    #[test]
    fn an_absent_tile_names_the_version_that_has_all_of_it() {
        let grid = TileGrid::new([3001, 1777]);
        for seed in 0..20 {
            // The last ones are always there.
            let last = grid.first[grid.sizes.len() - 6];
            let is_there =
                |tile: u32| tile >= last || crate::noise::pcg4d([tile, seed, 0, 0])[0].is_multiple_of(3);
            let table = grid.table(&|tile| is_there(tile).then_some(tile + 5));
            let mut far = 0;
            for tile in 0..grid.count {
                let (level, at) = grid.place(tile);
                let steps = table[tile as usize] & 0xff;
                assert_eq!(steps == 0, is_there(tile));
                if steps == 0 {
                    assert_eq!(table[tile as usize] >> 8, tile + 5);
                    continue;
                }
                far = far.max(steps);
                // Wherever it is read, that version's tile there is on the device.
                let there = level + steps as usize;
                for k in 0..400_u32 {
                    let uv = [0, 1].map(|axis: usize| {
                        let share = f64::from(crate::noise::pcg4d([k, tile, axis as u32, 1])[0])
                            / f64::from(u32::MAX);
                        ((f64::from(at[axis]) + share) * f64::from(TILE_TEXELS)
                            / f64::from(grid.sizes[level][axis]))
                        .min(1.0)
                    });
                    let [[column, _], [row, _]] = grid.between(there, uv, uv, 0.0);
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
