//! The scene of a scenario, in the local frame of its log.

use std::{cell::RefCell, sync::Arc};

use camsim_core::{
    flight_log::{FlightLog, HeightConversion},
    geodesy::{Geodetic, GeoidCache},
    scenario::{BoardSpec, PatternCentre, Scenario},
    scene::{Encoding, Mesh, Scene, linear_from_srgb, ned_from_board},
};
use glam::DVec3;

use super::{LoadError, height_plan};
use crate::{
    board_file::read_board,
    pictures::read_texture,
    terrain::{TerrainSummary, read_terrain},
};

/// Reads what `[scene]` names.
pub(super) fn load_scene(scenario: &Scenario, log: &FlightLog) -> Result<(Scene, Option<TerrainSummary>), LoadError> {
    let spec = &scenario.scene;
    let mut scene = Scene {
        sky_linear: spec.sky.map(|value| linear_from_srgb(value as f32)),
        fog_visibility_m: spec.fog_visibility_m,
        ..Scene::default()
    };
    let mut summary = None;
    if let Some(terrain) = &spec.terrain {
        let frame = log.frame.as_ref().ok_or_else(|| no_origin(scenario, "scene.terrain"))?;
        let ned = |lat_rad, lon_rad, height_m| frame.ned_from_geodetic(Geodetic { lat_rad, lon_rad, height_m });
        let (_, shift_terrain) = height_plan(scenario);
        let loaded = read_terrain(terrain, &ned, if shift_terrain { Some(&undulation) } else { None })?;
        scene.terrain = Some(loaded.terrain);
        summary = Some(loaded.summary);
    }
    if let Some(pattern) = &spec.pattern {
        let of_pattern = |source| LoadError::Picture { key: "scene.pattern.image", source };
        let texture = read_texture(&pattern.image, Encoding::Srgb).map_err(of_pattern)?;
        scene.meshes.push(Mesh::level_picture(Arc::new(texture), local(pattern.at), pattern.width_m));
    }
    if let Some(spec) = &spec.board {
        scene.meshes.push(read_board(spec)?.mesh(board_place(scenario, spec, log)?, ned_from_board(spec.angles_deg)));
    }
    Ok((scene, summary))
}

/// Where the middle of a board is.
///
/// # Errors
/// It has a place on Earth, and the log has none.
pub fn board_place(scenario: &Scenario, board: &BoardSpec, log: &FlightLog) -> Result<DVec3, LoadError> {
    place(scenario, log, board.at, board.geodetic, "scene.board.geodetic")
}

fn place(
    scenario: &Scenario,
    log: &FlightLog,
    at: PatternCentre,
    geodetic: Option<[f64; 3]>,
    key: &'static str,
) -> Result<DVec3, LoadError> {
    let Some([lat_deg, lon_deg, height_m]) = geodetic else { return Ok(local(at)) };
    let frame = log.frame.as_ref().ok_or_else(|| no_origin(scenario, key))?;
    let mut at = Geodetic::from_deg(lat_deg, lon_deg, height_m);
    // As the log's own heights.
    if height_plan(scenario).0 == HeightConversion::MslToEllipsoid {
        at.height_m += undulation(at.lat_rad, at.lon_rad);
    }
    Ok(frame.ned_from_geodetic(at))
}

fn local(at: PatternCentre) -> DVec3 {
    match at {
        PatternCentre::Origin => DVec3::ZERO,
        PatternCentre::Ned(ned) => DVec3::from_array(ned),
    }
}

fn no_origin(scenario: &Scenario, key: &'static str) -> LoadError {
    LoadError::NoOrigin { log: scenario.flight.log.clone(), key }
}

/// Height of the geoid above the ellipsoid. One sum of harmonics a vertex would take minutes; the caches interpolate a lattice, one for each
/// thread that reads terrain.
fn undulation(lat_rad: f64, lon_rad: f64) -> f64 {
    thread_local!(static GEOID: RefCell<GeoidCache> = RefCell::new(GeoidCache::new()));
    GEOID.with_borrow_mut(|geoid| geoid.undulation_m(Geodetic { lat_rad, lon_rad, height_m: 0.0 }))
}
