//! Loads the scene of a scenario into the local frame of its log.

use std::{cell::RefCell, collections::HashSet, path::Path, sync::Arc};

use camsim_core::{
    flight_log::FlightLog,
    geodesy::{Geodetic, GeoidCache},
    scenario::{BoardSpec, GltfSpec, LightSpec, PatternCentre, Scenario},
    scene::{
        Encoding, Light, Mesh, Scene, depth_sort::MAX_TRIANGLES, linear_from_srgb, ned_from_board,
        split_intersecting_blended,
    },
};
use glam::DVec3;

use super::{
    LoadError,
    far_models::{self, Copy},
    motion::{carrier, model_motion},
    objects::{ModelObjects, ObjectList, name_or},
    placements::{Placement, read_placements},
    raises_log, raises_terrain,
};
use crate::{
    board_file::read_board,
    gltf_file::{GltfOptions, MAX_RADIUS_M, Model, ModelMotion, read_moving_gltf},
    raster::pictures::read_texture,
    raster::{HeightShift, TerrainSummary, read_terrain_in_light},
    text::wording::joined_notes,
};

/// Reads all files that `[scene]` names. Returns the scene, the summary of the terrain, and notes.
pub(super) fn load_scene(
    scenario: &Scenario,
    log: &FlightLog,
) -> Result<(Scene, Option<TerrainSummary>, Vec<String>), LoadError> {
    let spec = &scenario.scene;
    let light = spec.light.map(|LightSpec { sun_azimuth_deg, sun_elevation_deg, sun, sky, shadows }| {
        Light::new(sun_azimuth_deg.to_radians(), sun_elevation_deg.to_radians(), sun, sky)
            .with_shadows(shadows)
    });
    let sky_brightness = spec.sky_brightness.unwrap_or(1.0) as f32;
    let mut scene = Scene {
        light,
        sky_linear: spec.sky.map(|value| sky_brightness * linear_from_srgb(value as f32)),
        fog_visibility_m: spec.fog_visibility_m,
        ..Scene::default()
    };
    let mut objects = ObjectList::default();
    let mut notes = Vec::new();
    let mut summary = None;
    if let Some(terrain) = &spec.terrain {
        let frame = log.frame.as_ref().ok_or_else(|| no_origin(scenario, "scene.terrain"))?;
        let ned =
            |lat_rad, lon_rad, height_m| frame.ned_from_geodetic(Geodetic { lat_rad, lon_rad, height_m });
        let shift = if raises_terrain(scenario) { Some(&undulation_m as HeightShift<'_>) } else { None };
        let loaded = read_terrain_in_light(terrain, &ned, shift, light.as_ref())?;
        scene.terrain = Some(loaded.terrain);
        scene.terrain_object = objects.add(name_or(&terrain.name, "terrain"), terrain.class);
        summary = Some(loaded.summary);
        notes.extend(loaded.notes);
    }
    // Pattern and board come before the models: the choice of tracked corners counts on it.
    if let Some(pattern) = &spec.pattern {
        let picture_error = |source| LoadError::Picture { key: "scene.pattern.image", source };
        let texture = read_texture(&pattern.image, Encoding::Srgb).map_err(picture_error)?;
        let object = objects.add(name_or(&pattern.name, "pattern"), pattern.class);
        let mesh = match pattern.repeat {
            false => Mesh::level_picture(Arc::new(texture), local(pattern.at), pattern.width_m),
            true => Mesh::repeated_picture(Arc::new(texture), local(pattern.at), pattern.width_m),
        };
        scene.meshes.push(Mesh { object, ..mesh });
    }
    if let Some(spec) = &spec.board {
        let object = objects.add(name_or(&spec.name, "board"), spec.class);
        let mesh = read_board(spec)?
            .mesh(board_position_ned_m(scenario, spec, log)?, ned_from_board(spec.angles_deg));
        scene.meshes.push(Mesh { object, ..mesh });
    }
    if light.is_some() && scene.terrain.is_none() && spec.gltf.is_empty() {
        notes.push(
            "scene.light changes nothing: it falls on terrain and models, of which the scene has \
            none; patterns and boards keep their colours"
                .to_owned(),
        );
    }
    let (mut models, mut of_models) = (Vec::new(), Vec::new());
    for spec in &spec.gltf {
        let model = read_once(&mut models, scenario, spec)?;
        of_models
            .push((spec.file.as_path(), add_model(scenario, log, spec, &model, &mut scene, &mut objects)?));
    }
    notes.extend(joined_notes(of_models.iter().map(|(file, notes)| (*file, &notes[..]))));
    scene.objects = objects.into_objects();
    notes.extend(blended_triangles_note(&scene));
    let remaining = split_intersecting_blended(&mut scene.meshes).remaining;
    notes.extend((remaining > 0).then(|| {
        format!(
            "scene.gltf: {remaining} positions where blended triangles pass through each other are not cut, and \
            may be mixed in the wrong order there"
        )
    }));
    // Several models of one file give equal notes.
    let mut known = HashSet::new();
    notes.retain(|note| known.insert(note.clone()));
    Ok((scene, summary, notes))
}

/// A note if the scene has more blended triangles than can be sorted by depth.
fn blended_triangles_note(scene: &Scene) -> Option<String> {
    let blended = scene.meshes.iter().filter(|mesh| mesh.material.blends);
    let triangles: usize = blended.map(|mesh| mesh.shape.indices.len() / 3).sum();
    (triangles > MAX_TRIANGLES).then(|| {
        format!(
            "scene.gltf: {triangles} triangles are blended; frames with more than {MAX_TRIANGLES} of them in \
                view draw them mesh by mesh by distance, and may \
             mix those of meshes within each other in the wrong order; if their alpha is 0 or 1, alphaMode \
             MASK does without"
        )
    })
}

/// What a model is read by, and the model.
type KnownModel<'a> = ((&'a Path, GltfOptions, ModelMotion), Arc<Model>);

/// Reads the model of an entry of the scene, unless another entry has: all its copies share shapes and textures.
fn read_once<'a>(
    known: &mut Vec<KnownModel<'a>>,
    scenario: &Scenario,
    spec: &'a GltfSpec,
) -> Result<Arc<Model>, LoadError> {
    let number = |n: Option<u32>| n.map(|n| n as usize);
    let options = GltfOptions {
        scene: number(spec.scene),
        time_s: spec.time_s,
        animation: number(spec.animation),
        normals: scenario.scene.light.is_some(),
    };
    let key = (spec.file.as_path(), options, model_motion(spec));
    if let Some((_, model)) = known.iter().find(|(other, _)| *other == key) {
        return Ok(model.clone());
    }
    let model = Arc::new(read_moving_gltf(key.0, options, &key.2)?);
    known.push((key, model.clone()));
    Ok(model)
}

/// Adds a model at all its placements. Returns notes about it.
fn add_model(
    scenario: &Scenario,
    log: &FlightLog,
    spec: &GltfSpec,
    model: &Model,
    scene: &mut Scene,
    objects: &mut ObjectList,
) -> Result<Vec<String>, LoadError> {
    let notes_of =
        |others: Vec<String>| -> Vec<String> { model.notes.iter().cloned().chain(others).collect() };
    let model_objects = ModelObjects::new(spec, model)?;
    if let Some(carrier) = carrier(scenario, log, spec, scene.terrain.as_ref())? {
        let position_ned_m = carrier.start().position_m;
        check_reach(spec, position_ned_m, model.radius_m * spec.scale)?;
        let heading_rad = spec.heading_deg.to_radians();
        let placed = model.place_on(Some(&carrier), position_ned_m, heading_rad, spec.scale);
        let numbers = model_objects.of_copy(1, objects);
        scene.meshes.extend(placed.zip(numbers).map(|(mesh, object)| Mesh { object, ..mesh }));
        return Ok(notes_of(Vec::new()));
    }
    let placements = match &spec.placements {
        None => vec![Placement { position: (spec.at, spec.geodetic), heading_deg: 0.0, scale: 1.0 }],
        Some(path) => read_placements(path, spec.on_ground)?,
    };
    let (all, mut without_ground, mut copies) = (placements.len(), 0, Vec::new());
    for (row, Placement { position: (local, geodetic), heading_deg, scale }) in (1..).zip(placements) {
        let mut position_ned_m = position_ned_m(scenario, log, local, geodetic, "a position of scene.gltf")?;
        if spec.on_ground {
            let ground = scene
                .terrain
                .as_ref()
                .and_then(|terrain| terrain.down_at(position_ned_m.x, position_ned_m.y));
            // Some of many scattered copies may lie off the terrain and are skipped. If all do, that is a
            // mistake.
            let Some(ground_down_m) = ground else {
                without_ground += 1;
                if without_ground == all {
                    return Err(LoadError::NoGround {
                        file: spec.file.clone(),
                        north_m: position_ned_m.x,
                        east_m: position_ned_m.y,
                    });
                }
                continue;
            };
            position_ned_m.z = ground_down_m;
        }
        check_reach(spec, position_ned_m, model.radius_m * spec.scale * scale)?;
        let placed =
            model.place(position_ned_m, (spec.heading_deg + heading_deg).to_radians(), spec.scale * scale);
        let numbers = model_objects.of_copy(row, objects);
        let first = scene.meshes.len();
        scene.meshes.extend(placed.zip(numbers).map(|(mesh, object)| Mesh { object, ..mesh }));
        copies.push(Copy::new(position_ned_m, &scene.meshes[first..]));
    }
    let far = far_models::notes(scenario, log, spec, &copies, model.spacing_m());
    let left_out = (without_ground > 0)
        .then(|| format!("{without_ground} of {all} positions have no ground below them and are skipped"));
    Ok(notes_of(left_out.into_iter().chain(far).collect()))
}

/// Refuses a model that is farther away than [`MAX_RADIUS_M`].
fn check_reach(spec: &GltfSpec, position_ned_m: DVec3, radius_m: f64) -> Result<(), LoadError> {
    let reach_m = position_ned_m.length() + radius_m;
    if reach_m.is_nan() || reach_m > MAX_RADIUS_M {
        return Err(LoadError::TooFar { file: spec.file.clone(), reach_m });
    }
    Ok(())
}

/// Position of the centre of a board, local north-east-down, metres.
///
/// # Errors
/// The board is georeferenced, and the log has local coordinates.
pub fn board_position_ned_m(
    scenario: &Scenario,
    board: &BoardSpec,
    log: &FlightLog,
) -> Result<DVec3, LoadError> {
    position_ned_m(scenario, log, board.at, board.geodetic, "scene.board.geodetic")
}

/// Local position of an object that is placed locally or geodetically. `key` names it in the error.
pub(super) fn position_ned_m(
    scenario: &Scenario,
    log: &FlightLog,
    at: PatternCentre,
    geodetic: Option<[f64; 3]>,
    key: &'static str,
) -> Result<DVec3, LoadError> {
    let Some([lat_deg, lon_deg, height_m]) = geodetic else { return Ok(local(at)) };
    let frame = log.frame.as_ref().ok_or_else(|| no_origin(scenario, key))?;
    let mut position = Geodetic::from_deg(lat_deg, lon_deg, height_m);
    // Heights have the datum of the log's.
    if raises_log(scenario) {
        position.height_m += undulation_m(position.lat_rad, position.lon_rad);
    }
    Ok(frame.ned_from_geodetic(position))
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

/// Height of the geoid above the ellipsoid, metres. A sum of harmonics per vertex would take minutes, so each
/// thread that reads terrain interpolates in a cached grid.
pub(super) fn undulation_m(lat_rad: f64, lon_rad: f64) -> f64 {
    thread_local!(static GEOID: RefCell<GeoidCache> = RefCell::new(GeoidCache::new()));
    GEOID.with_borrow_mut(|geoid| geoid.undulation_m(Geodetic { lat_rad, lon_rad, height_m: 0.0 }))
}

#[cfg(test)]
mod tests {
    use camsim_core::scene::{Encoding, Texture};

    use super::*;

    #[test]
    fn too_many_blended_triangles_are_noted() {
        let texture = Arc::new(Texture::uniform([255, 255, 255, 99], Encoding::Linear));
        let mut pane = Mesh::level_picture(texture, DVec3::ZERO, 1.0);
        let note = |mesh: &Mesh, count: usize| {
            blended_triangles_note(&Scene { meshes: vec![mesh.clone(); count], ..Scene::default() })
        };
        assert_eq!(note(&pane, MAX_TRIANGLES), None);
        pane.material.blends = true;
        assert_eq!(note(&pane, MAX_TRIANGLES / 2), None);
        assert!(
            note(&pane, MAX_TRIANGLES / 2 + 1)
                .is_some_and(|note| note.contains("16386 triangles are blended"))
        );
    }
}
