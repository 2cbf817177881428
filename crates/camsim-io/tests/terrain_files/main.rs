//! Terrain files in all supported encodings, and invalid ones: heights and colours at known pixels, or the
//! error.

#![allow(clippy::unwrap_used, reason = "tests")]

mod heights;
mod mosaic;
mod pictures;
mod raster;
mod sidecar;

use std::path::{Path, PathBuf};

use camsim_core::scenario::TerrainSpec;
use camsim_io::raster::{LoadedTerrain, TerrainFileError, read_terrain};
use glam::DVec3;

/// A file made by GDAL: scripts/goldens/terrain_rasters.py.
fn gdal_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/terrain").join(name)
}

fn spec(dem: &Path) -> TerrainSpec {
    TerrainSpec { dem: dem.into(), ..TerrainSpec::default() }
}

/// Reads with a local frame whose down is the negative height.
fn read(spec: &TerrainSpec) -> Result<LoadedTerrain, TerrainFileError> {
    let ned = |lat: f64, lon: f64, height: f64| DVec3::new((lat - 0.82) * 1e5, (lon - 0.157) * 1e5, -height);
    read_terrain(spec, &ned, None)
}

fn read_error(spec: &TerrainSpec) -> String {
    read(spec).map(|loaded| loaded.notes).unwrap_err().to_string()
}

/// Height at a post, metres, of grids of at most 65 x 65; `None` for a void.
fn height_m(loaded: &LoadedTerrain, [column, row]: [u32; 2]) -> Option<f64> {
    let down = loaded.terrain.position_ned_m(0, column, row).z;
    (!down.is_nan()).then_some(-down)
}

fn color(loaded: &LoadedTerrain, [column, row]: [u32; 2]) -> [u8; 3] {
    let texture = &loaded.terrain.texture;
    let start = 4 * (row * texture.size_px[0] + column) as usize;
    [0, 1, 2].map(|k| texture.rgba8[start + k])
}

fn pixels([columns, rows]: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
    (0..rows).flat_map(move |row| (0..columns).map(move |column| [column, row]))
}
