//! Several rasters as tiles of one grid: which position each has, and which tile holds a pixel.

use std::path::Path;

use super::{
    TerrainFileError, crs::Crs, files::command_paths, georeference::Affine, tile::Tile,
    vertical_crs::VerticalDatum,
};

/// Largest distance of a tile's corners from the grid of the others, pixels.
const MAX_OFFSET_PX: f64 = 0.02;

/// Largest area of the rectangle around all tiles, as a multiple of that of the tiles: a diagonal row of them.
const MAX_SPREAD: f64 = 64.0;

/// Largest number of pixels of a side of the rectangle.
const MAX_SIDE: f64 = 1e6;

/// A tile with its georeference.
pub(super) struct Placed<'a> {
    path: &'a Path,
    size: [u32; 2],
    model_from_pixel: Affine,
    crs: &'a Crs,
}

impl<'a> Placed<'a> {
    pub fn new(path: &'a Path, size: [u32; 2], model_from_pixel: Affine, crs: &'a Crs) -> Self {
        Self { path, size, model_from_pixel, crs }
    }

    fn centre(&self) -> [f64; 2] {
        self.model_from_pixel.apply(self.size.map(|n| 0.5 * f64::from(n)))
    }
}

/// The grid of all tiles.
pub(super) struct Joined {
    /// Indices of the tiles in their order: from the north, then from the west.
    pub order: Vec<usize>,
    /// First column and row of each tile, in that order.
    pub offsets: Vec<[u32; 2]>,
    /// Columns and rows of the rectangle around them.
    pub size: [u32; 2],
    /// Its georeference.
    pub model_from_pixel: Affine,
}

/// Refuses tiles whose heights have different units or origins.
pub(super) fn check_alike(tiles: &[Tile]) -> Result<(), TerrainFileError> {
    let Some((first, others)) = tiles.split_first() else { return Ok(()) };
    let other_unit = others.iter().find(|tile| (tile.unit_m - first.unit_m).abs() > 1e-7);
    if let Some(tile) = other_unit {
        return Err(meaning(
            &tile.path,
            format!(
                "has heights in units of {} m, but those of {} are in units of {} m: convert one of them, for example \
                 with `gdal_calc.py -A IN --calc=\"A*FACTOR\" --outfile OUT`",
                tile.unit_m,
                first.path.display(),
                first.unit_m
            ),
        ));
    }
    // A tile that states no datum may have that of the others.
    let of_datum = |datum: VerticalDatum| tiles.iter().find(|tile| tile.datum == Some(datum));
    if let (Some(ellipsoid), Some(sea)) =
        (of_datum(VerticalDatum::Ellipsoid), of_datum(VerticalDatum::SeaLevel))
    {
        return Err(meaning(
            &ellipsoid.path,
            format!(
                "states heights above the ellipsoid, but {} states heights above the sea: tiles of one terrain need the \
                 same; convert one of them, for example with `gdalwarp -s_srs EPSG:A+B -t_srs EPSG:A+C IN OUT`, or \
                 correct what it states",
                sea.path.display()
            ),
        ));
    }
    Ok(())
}

fn meaning(path: &Path, problem: String) -> TerrainFileError {
    TerrainFileError::Meaning { path: path.into(), problem }
}

/// The grid that tiles share. The result depends on the tiles, not on their order.
///
/// # Errors
/// Tiles of different coordinate systems, pixel sizes or grids, with the command that joins them.
pub(super) fn join<'a>(tiles: impl Iterator<Item = Placed<'a>>) -> Result<Joined, TerrainFileError> {
    let mut tiles: Vec<(usize, Placed<'a>)> = tiles.enumerate().collect();
    if let [(_, only)] = &tiles[..] {
        let (size, model_from_pixel) = (only.size, only.model_from_pixel);
        return Ok(Joined { order: vec![0], offsets: vec![[0; 2]], size, model_from_pixel });
    }
    let of_all = tiles.iter().map(|(_, tile)| tile.path).collect::<Vec<_>>();
    let command_paths = command_paths(&of_all);
    join_across_the_date_line(&mut tiles);
    tiles.sort_by(|(_, a), (_, b)| {
        let [of_a, of_b] = [a, b].map(|tile| tile.model_from_pixel.origin);
        of_b[1].total_cmp(&of_a[1]).then(of_a[0].total_cmp(&of_b[0])).then(a.path.cmp(b.path))
    });
    let Some((_, first)) = tiles.first() else {
        return Err(meaning(Path::new("scene.terrain"), "names no file".into()));
    };
    let degenerate = || TerrainFileError::DegenerateGeoreference { path: first.path.into() };
    let pixel_from_model = first.model_from_pixel.inverse().ok_or_else(degenerate)?;
    let mut starts = Vec::new();
    for (_, tile) in &tiles {
        if tile.crs.epsg != first.crs.epsg {
            return Err(meaning(
                tile.path,
                format!(
                    "is in EPSG:{}, but {} in EPSG:{}: join tiles of several coordinate systems with `gdalwarp -t_srs \
                     EPSG:{} -r bilinear {command_paths} all.tif`, and give all.tif",
                    tile.crs.epsg,
                    first.path.display(),
                    first.crs.epsg,
                    first.crs.epsg
                ),
            ));
        }
        let pixel = |corner: [f64; 2]| pixel_from_model.apply(tile.model_from_pixel.apply(corner));
        let size = tile.size.map(f64::from);
        let start = pixel([0.0; 2]).map(f64::round);
        let off_px = [[0.0, 0.0], size, [size[0], 0.0]]
            .iter()
            .flat_map(|corner| {
                let at = pixel(*corner);
                [0, 1].map(|k: usize| (at[k] - start[k] - corner[k]).abs())
            })
            .max_by(f64::total_cmp)
            .unwrap_or(0.0);
        if off_px.is_nan() || off_px > MAX_OFFSET_PX {
            return Err(meaning(tile.path, off_grid(tile, first, off_px, &command_paths)));
        }
        starts.push(start);
    }
    let low = [0, 1].map(|k: usize| starts.iter().map(|start| start[k]).fold(f64::INFINITY, f64::min));
    let high = [0, 1].map(|k: usize| {
        let ends = starts.iter().zip(&tiles).map(|(start, (_, tile))| start[k] + f64::from(tile.size[k]));
        ends.fold(f64::NEG_INFINITY, f64::max)
    });
    let size = [0, 1].map(|k: usize| high[k] - low[k]);
    let own: f64 = tiles.iter().map(|(_, tile)| f64::from(tile.size[0]) * f64::from(tile.size[1])).sum();
    if size.iter().any(|side| *side > MAX_SIDE) || size[0] * size[1] > MAX_SPREAD * own {
        return Err(meaning(
            first.path,
            format!(
                "its tiles lie far apart: the rectangle around them has {} x {} pixels, most of which no tile has; give \
                 those under the flight alone",
                size[0], size[1]
            ),
        ));
    }
    Ok(Joined {
        order: tiles.iter().map(|(index, _)| *index).collect(),
        offsets: starts.iter().map(|start| [0, 1].map(|k: usize| (start[k] - low[k]) as u32)).collect(),
        size: size.map(|side| side as u32),
        // The first tile's own georeference where that is the corner: no rounding.
        model_from_pixel: match low {
            [0.0, 0.0] => first.model_from_pixel,
            low => Affine { origin: first.model_from_pixel.apply(low), ..first.model_from_pixel },
        },
    })
}

/// Tiles of longitudes beyond 180 degrees are moved by a turn to those before.
fn join_across_the_date_line(tiles: &mut [(usize, Placed<'_>)]) {
    let period = tiles.first().and_then(|(_, tile)| tile.crs.period());
    let Some(period) = period.filter(|_| tiles.len() > 1) else { return };
    let centres = tiles.iter().map(|(_, tile)| tile.centre()[0]);
    let [west, east] =
        centres.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
    if east - west > 0.5 * period {
        for (_, tile) in tiles.iter_mut().filter(|(_, tile)| tile.centre()[0] < 0.0) {
            tile.model_from_pixel.origin[0] += period;
        }
    }
}

/// Why a tile is not on the grid of another.
fn off_grid(tile: &Placed<'_>, first: &Placed<'_>, off_px: f64, command_paths: &str) -> String {
    let length = |vector: [f64; 2]| vector[0].hypot(vector[1]);
    let [of_tile, of_first] =
        [tile, first].map(|tile| [tile.model_from_pixel.column, tile.model_from_pixel.row].map(length));
    let is_same_size = (0..2).all(|k| (of_tile[k] / of_first[k] - 1.0).abs() < 1e-6);
    let reason = if is_same_size {
        format!("its pixels lie {:.2} pixels off those of {}", off_px.fract().min(0.5), first.path.display())
    } else {
        format!(
            "its pixels are {} x {} wide, but those of {} {} x {}",
            of_tile[0],
            of_tile[1],
            first.path.display(),
            of_first[0],
            of_first[1]
        )
    };
    format!(
        "{reason}: tiles of one grid are joined, others are resampled first: run `gdalbuildvrt -resolution highest -r \
         bilinear all.vrt {command_paths}` and `gdal_translate all.vrt all.tif`, and give all.tif"
    )
}

/// Which tiles hold a pixel.
pub(super) struct TileIndex {
    offsets: Vec<[u32; 2]>,
    /// Columns and rows at which tiles begin or end, ascending.
    cuts: [Vec<u32>; 2],
    /// Tiles of each cell between two cuts, row by row.
    cells: Vec<Vec<usize>>,
}

impl TileIndex {
    pub fn new(offsets: &[[u32; 2]], sizes: impl Iterator<Item = [u32; 2]>) -> Self {
        let spans: Vec<[[u32; 2]; 2]> = offsets
            .iter()
            .zip(sizes)
            .map(|(offset, size)| [*offset, [offset[0] + size[0], offset[1] + size[1]]])
            .collect();
        let cuts = [0, 1].map(|k: usize| {
            let mut cuts: Vec<u32> = spans.iter().flat_map(|[start, end]| [start[k], end[k]]).collect();
            cuts.sort_unstable();
            cuts.dedup();
            cuts
        });
        let [columns, rows] = [0, 1].map(|k: usize| cuts[k].len().saturating_sub(1));
        let mut cells = vec![Vec::new(); columns * rows];
        for (index, [start, end]) in spans.iter().enumerate() {
            let [first, last] =
                [start, end].map(|at| [0, 1].map(|k: usize| cuts[k].partition_point(|cut| *cut < at[k])));
            for row in first[1]..last[1] {
                for cell in &mut cells[row * columns + first[0]..row * columns + last[0]] {
                    cell.push(index);
                }
            }
        }
        Self { offsets: offsets.to_vec(), cuts, cells }
    }

    /// The tiles that hold a pixel, each with the pixel's position in it.
    pub fn at(&self, pixel: [u32; 2]) -> impl Iterator<Item = (usize, [u32; 2])> {
        let [column, row] = [0, 1].map(|k: usize| self.cuts[k].partition_point(|cut| *cut <= pixel[k]));
        let cell = match (column.checked_sub(1), row.checked_sub(1)) {
            (Some(column), Some(row)) => self.cells.get(row * (self.cuts[0].len() - 1) + column),
            _ => None,
        };
        cell.into_iter().flatten().map(move |&tile| {
            let offset = self.offsets[tile];
            (tile, [pixel[0] - offset[0], pixel[1] - offset[1]])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_lead_to_all_tiles_that_hold_them() {
        // Two tiles of 3 x 2 that share a column, and one apart.
        let index = TileIndex::new(&[[0, 0], [2, 0], [7, 5]], [[3, 2], [3, 2], [1, 1]].into_iter());
        let at = |pixel: [u32; 2]| index.at(pixel).collect::<Vec<_>>();
        assert_eq!(at([0, 1]), [(0, [0, 1])]);
        assert_eq!(at([2, 1]), [(0, [2, 1]), (1, [0, 1])]);
        assert_eq!(at([4, 0]), [(1, [2, 0])]);
        assert_eq!(at([7, 5]), [(2, [0, 0])]);
        for hole in [[5, 0], [0, 2], [6, 5], [7, 4], [8, 5], [7, 6]] {
            assert_eq!(at(hole), [], "{hole:?}");
        }
    }
}
