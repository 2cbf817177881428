//! A digital elevation model: the heights of one file, or of several tiles of one grid.

use std::{f64::consts::PI, path::PathBuf};

use rayon::prelude::*;

use camsim_core::scenario::TerrainSpec;

use super::{
    TerrainFileError,
    crs::Crs,
    files,
    georeference::Affine,
    grid_tiles::{self, TileIndex},
    tile::Tile,
};
use crate::text::wording::joined_notes;

/// Range of plausible heights, metres: from below the deepest sea to above the highest mountain. Others are
/// undeclared no-data values.
const PLAUSIBLE_HEIGHTS_M: [f64; 2] = [-11_500.0, 9_500.0];

/// The Earth's mean radius.
const MEAN_RADIUS_M: f64 = 6_371_000.0;

/// Range of common heights, metres; others are reported.
pub(super) const USUAL_HEIGHTS_M: [f64; 2] = [-500.0, 9_000.0];

/// Implausible heights below this may have another unit, of which the millimetre is the smallest; undeclared no-data
/// values are larger.
const MAX_OTHER_UNIT: f64 = 9.5e6;

/// Tiles whose heights differ by more at a post that they share are reported, metres.
const SAME_HEIGHT_M: f64 = 0.01;

/// A georeferenced grid of heights (posts); row 0 is the northernmost, column 0 the westernmost.
pub(super) struct Dem {
    /// The file, or its tiles in words.
    pub path: PathBuf,
    pub size: [u32; 2],
    /// Tiles from the north, in the same order whatever the order of the list.
    tiles: Vec<Tile>,
    index: TileIndex,
    /// Model coordinates from pixel coordinates (corner convention).
    pub model_from_pixel: Affine,
    pub crs: Crs,
    /// Notes for the user.
    pub notes: Vec<String>,
}

/// Statistics of all heights.
pub(super) struct HeightStatistics {
    /// Lowest and highest height, metres.
    pub range_m: [f64; 2],
    /// Number of missing or implausible heights.
    pub voids: u64,
    /// Number of voids whose values may be heights in another unit.
    pub implausible: u64,
    /// Lowest and highest of these.
    pub implausible_range_m: [f64; 2],
    /// Number of heights outside of the common range.
    pub unlikely: u64,
}

/// A range without values.
pub(super) const EMPTY_RANGE: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

/// A range extended to a value.
pub(super) fn widened([low, high]: [f64; 2], value: f64) -> [f64; 2] {
    [low.min(value), high.max(value)]
}

/// The range of two ranges, which may be empty.
pub(super) fn union(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

fn is_plausible(height_m: f64) -> bool {
    (PLAUSIBLE_HEIGHTS_M[0]..=PLAUSIBLE_HEIGHTS_M[1]).contains(&height_m)
}

impl Dem {
    /// Reads `scene.terrain.dem`. `uses_geoid` is whether heights are converted by the geoid.
    pub fn read(spec: &TerrainSpec, uses_geoid: bool) -> Result<Self, TerrainFileError> {
        let paths = files::dem_files(&spec.dem)?;
        let mut tiles = Vec::new();
        for path in &paths {
            tiles.push(Tile::read(path, spec, uses_geoid)?);
        }
        grid_tiles::check_alike(&tiles)?;
        let joined =
            grid_tiles::join(tiles.iter().map(|tile| {
                grid_tiles::Placed::new(&tile.path, tile.size, tile.model_from_pixel, &tile.crs)
            }))?;
        let path = files::label(&paths);
        let mut in_order: Vec<Option<Tile>> = tiles.into_iter().map(Some).collect();
        let tiles: Vec<Tile> = joined.order.iter().filter_map(|&at| in_order.get_mut(at)?.take()).collect();
        let notes = joined_notes(tiles.iter().map(|tile| (tile.path.as_path(), &tile.notes[..])));
        let crs = tiles.first().and_then(|tile| Crs::new(tile.crs.epsg));
        let crs = crs.ok_or_else(|| TerrainFileError::NoCrs { path: path.clone() })?;
        let mut dem = Self {
            path,
            size: joined.size,
            index: TileIndex::new(&joined.offsets, tiles.iter().map(|tile| tile.size)),
            tiles,
            model_from_pixel: joined.model_from_pixel,
            crs,
            notes,
        };
        dem.notes.extend(dem.mosaic_notes());
        Ok(dem)
    }

    /// Metres per unit of the heights.
    pub fn unit_m(&self) -> f64 {
        self.tiles.first().map_or(1.0, |tile| tile.unit_m)
    }

    /// Paths of its files.
    pub fn files(&self) -> Vec<PathBuf> {
        self.tiles.iter().map(|tile| tile.path.clone()).collect()
    }

    /// What is to be said about tiles: posts that none of them has, and heights that differ where they overlap.
    fn mosaic_notes(&self) -> Vec<String> {
        if self.tiles.len() < 2 {
            return Vec::new();
        }
        let rows = (0..self.size[1]).into_par_iter().map(|row| {
            (0..self.size[0]).fold((0_u64, 0_u64, 0.0_f64), |(holes, others, most_m), column| {
                let mut heights =
                    self.tiles_at([column, row]).map(|height_m| height_m.filter(|h| is_plausible(*h)));
                match heights.next() {
                    None => (holes + 1, others, most_m),
                    Some(first) => {
                        let range = heights.chain([first]).flatten().fold(EMPTY_RANGE, widened);
                        let by_m = (range[1] - range[0]).max(0.0);
                        (holes, others + u64::from(by_m > SAME_HEIGHT_M), most_m.max(by_m))
                    }
                }
            })
        });
        let (holes, others, most_m) =
            rows.reduce(|| (0, 0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1, a.2.max(b.2)));
        let path = self.path.display();
        let holes = (holes > 0).then(|| {
            format!(
                "{path}: its tiles leave holes: {:.2} % of the rectangle around them has no heights",
                100.0 * holes as f64 / self.post_count() as f64
            )
        });
        let others = (others > 0).then(|| {
            format!(
                "{path}: its tiles differ by up to {most_m:.2} m at {others} of the posts that they share: there the \
                 heights of the more northern tile are used, or of the more western one"
            )
        });
        holes.into_iter().chain(others).collect()
    }

    /// Heights of all tiles at a post, metres; `None` for those that are missing.
    fn tiles_at(&self, post: [u32; 2]) -> impl Iterator<Item = Option<f64>> {
        self.index.at(post).map(|(tile, post)| {
            let height_m = self.tiles.get(tile).map_or(f64::NAN, |tile| tile.stored_m(post));
            (!height_m.is_nan()).then_some(height_m)
        })
    }

    /// Number of posts.
    pub fn post_count(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1])
    }

    /// Column and row of a post index.
    pub fn column_and_row(&self, index: usize) -> [u32; 2] {
        let cols = self.size[0] as usize;
        [(index % cols) as u32, (index / cols) as u32]
    }

    /// Height, metres; NaN for a void.
    pub fn height_m(&self, post: [u32; 2]) -> f64 {
        let height_m = self.stored_m(post);
        if is_plausible(height_m) { height_m } else { f64::NAN }
    }

    /// Height, metres, plausible or not; NaN for no-data values and masked posts. Where tiles overlap, that of the
    /// first tile with a plausible one.
    fn stored_m(&self, post: [u32; 2]) -> f64 {
        if let [only] = &self.tiles[..] {
            return only.stored_m(post);
        }
        let known = || self.tiles_at(post).flatten();
        known().find(|height_m| is_plausible(*height_m)).or_else(|| known().next()).unwrap_or(f64::NAN)
    }

    /// Statistics of all heights.
    pub fn statistics(&self) -> HeightStatistics {
        let none = || HeightStatistics {
            range_m: EMPTY_RANGE,
            voids: 0,
            implausible: 0,
            implausible_range_m: EMPTY_RANGE,
            unlikely: 0,
        };
        let rows = (0..self.size[1]).into_par_iter().map(|row| {
            (0..self.size[0]).fold(none(), |sum, column| match self.stored_m([column, row]) {
                height_m if is_plausible(height_m) => {
                    let is_usual = (USUAL_HEIGHTS_M[0]..=USUAL_HEIGHTS_M[1]).contains(&height_m);
                    HeightStatistics {
                        range_m: widened(sum.range_m, height_m),
                        unlikely: sum.unlikely + u64::from(!is_usual),
                        ..sum
                    }
                }
                height_m if height_m.abs() < MAX_OTHER_UNIT => HeightStatistics {
                    voids: sum.voids + 1,
                    implausible: sum.implausible + 1,
                    implausible_range_m: widened(sum.implausible_range_m, height_m),
                    ..sum
                },
                _ => HeightStatistics { voids: sum.voids + 1, ..sum },
            })
        });
        rows.reduce(none, |a, b| HeightStatistics {
            range_m: union(a.range_m, b.range_m),
            voids: a.voids + b.voids,
            implausible: a.implausible + b.implausible,
            implausible_range_m: union(a.implausible_range_m, b.implausible_range_m),
            unlikely: a.unlikely + b.unlikely,
        })
    }

    /// Pixel coordinates (corner convention) of a post.
    pub fn pixel_centre(post: [u32; 2]) -> [f64; 2] {
        post.map(|n| f64::from(n) + 0.5)
    }

    /// Model coordinates of a post.
    pub fn model(&self, post: [u32; 2]) -> [f64; 2] {
        self.model_from_pixel.apply(Self::pixel_centre(post))
    }

    /// Latitude, longitude of a post, radians; `None` outside of the projection's domain.
    pub fn geodetic_rad(&self, post: [u32; 2]) -> Option<[f64; 2]> {
        self.crs.geodetic_from_model(self.model(post))
    }

    /// Width along the middle row and height along the middle column on the ground; `None` where the projection
    /// ends within.
    pub fn ground_size_m(&self) -> Option<[f64; 2]> {
        let [width, height] = self.size;
        let between = |from: [u32; 2], to: [u32; 2]| {
            let [[from_lat, from_lon], [to_lat, to_lon]] = [self.geodetic_rad(from)?, self.geodetic_rad(to)?];
            let turn = (to_lon - from_lon + PI).rem_euclid(2.0 * PI) - PI;
            let east = turn * (0.5 * (from_lat + to_lat)).cos();
            Some(MEAN_RADIUS_M * east.hypot(to_lat - from_lat))
        };
        let across = between([0, height / 2], [width - 1, height / 2])?;
        let down = between([width / 2, 0], [width / 2, height - 1])?;
        // From posts to cells.
        let cells = |length: f64, posts: u32| length * f64::from(posts) / f64::from(posts - 1);
        Some([cells(across, width), cells(down, height)])
    }

    /// Number of posts outside of the projection's domain.
    pub fn count_outside_crs(&self) -> u64 {
        self.count(|post| self.geodetic_rad(post).is_none())
    }

    /// Number of posts that fulfil a predicate.
    pub fn count(&self, predicate: impl Fn([u32; 2]) -> bool + Sync) -> u64 {
        (0..self.post_count() as usize)
            .into_par_iter()
            .filter(|&index| predicate(self.column_and_row(index)))
            .count() as u64
    }

    /// The outermost posts.
    pub fn border(&self) -> impl Iterator<Item = [u32; 2]> {
        let [cols, rows] = self.size;
        (0..cols)
            .flat_map(move |i| [[i, 0], [i, rows - 1]])
            .chain((0..rows).flat_map(move |j| [[0, j], [cols - 1, j]]))
    }
}
