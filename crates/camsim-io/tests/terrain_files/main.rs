//! Terrain files in every way that they are written, and in ways that they should not be: heights and colours
//! at known places, or the refusal.

#![allow(clippy::unwrap_used)]

mod beside;
mod heights;
mod pictures;
mod raster;

use std::path::{Path, PathBuf};

use camsim_core::scenario::TerrainSpec;
use camsim_io::terrain::{LoadedTerrain, TerrainFileError, read_terrain};
use glam::DVec3;

/// Made by GDAL: scripts/goldens/terrain_rasters.py.
fn by_gdal(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/terrain").join(name)
}

fn spec(dem: &Path) -> TerrainSpec {
    TerrainSpec { dem: dem.into(), ..TerrainSpec::default() }
}

/// A frame in which down is just the height turned over.
fn read(spec: &TerrainSpec) -> Result<LoadedTerrain, TerrainFileError> {
    let ned = |lat: f64, lon: f64, height: f64| DVec3::new((lat - 0.82) * 1e5, (lon - 0.157) * 1e5, -height);
    read_terrain(spec, &ned, None)
}

fn fails(spec: &TerrainSpec) -> String {
    read(spec).map(|loaded| loaded.notes).unwrap_err().to_string()
}

/// Metres at a pixel's centre, of grids of at most 65 x 65; `None` for a void.
fn height_m(loaded: &LoadedTerrain, [column, row]: [u32; 2]) -> Option<f64> {
    let down = loaded.terrain.position_ned_m(0, column, row).z;
    (!down.is_nan()).then_some(-down)
}

fn color(loaded: &LoadedTerrain, [column, row]: [u32; 2]) -> [u8; 3] {
    let texture = &loaded.terrain.texture;
    let at = 4 * (row * texture.size_px[0] + column) as usize;
    [0, 1, 2].map(|k| texture.rgba8[at + k])
}

fn pixels([columns, rows]: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
    (0..rows).flat_map(move |row| (0..columns).map(move |column| [column, row]))
}
