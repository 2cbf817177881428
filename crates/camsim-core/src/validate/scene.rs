//! Range checks of `[scene]`.

use super::{Check, motion::check_motion};
use crate::{
    scenario::{BoardSpec, LightSpec, ObjectsOf, PatternCentre, SceneSpec},
    scene::{Board, BoardError},
};

pub(super) fn check_scene(check: &mut Check, scene: &SceneSpec) {
    let has_surface =
        scene.terrain.is_some() || scene.pattern.is_some() || scene.board.is_some() || !scene.gltf.is_empty();
    check.require(has_surface, "scene", || {
        "is empty; give scene.terrain = { dem = \"dem.tif\" }, scene.pattern = { image = \"grid.png\", width_m = 100.0 }, a [scene.board] or a [[scene.gltf]]"
            .into()
    });
    for (i, model) in scene.gltf.iter().enumerate() {
        let table = format!("scene.gltf.{i}");
        check_position(check, &table, model.at, model.geodetic);
        check_name(check, &table, &model.name);
        check.require(
            model.classes.is_empty() || model.objects != ObjectsOf::Placement,
            format!("{table}.classes"),
            || "needs objects = \"node\" or \"material\"; a placed copy has the one class of class".into(),
        );
        check.require(!model.on_ground || scene.terrain.is_some(), format!("{table}.on_ground"), || {
            "needs a terrain: give scene.terrain, or heights in the placements".into()
        });
        if let Some(motion) = &model.motion {
            check_motion(check, &table, model, motion);
        }
        let twice =
            model.placements.is_some() && (model.at != PatternCentre::Origin || model.geodetic.is_some());
        check.require(!twice, format!("{table}.placements"), || {
            "takes the place of at and geodetic: leave those out".into()
        });
    }
    if let Some(terrain) = &scene.terrain {
        check_name(check, "scene.terrain", &terrain.name);
    }
    if let Some(board) = &scene.board {
        check_board(check, board);
        check_name(check, "scene.board", &board.name);
    }
    if let Some(pattern) = &scene.pattern {
        check_name(check, "scene.pattern", &pattern.name);
    }
    if let Some(light) = &scene.light {
        check_light(check, light);
    }
}

fn check_light(check: &mut Check, light: &LightSpec) {
    // The sum must not exceed white; exposure is a matter of the camera. A small tolerance allows sums like
    // 0.7 + 0.3. Each value by itself has its own interval.
    let both = light.sun + light.sky;
    let each = [light.sun, light.sky].iter().all(|fraction| (0.0..=1.0).contains(fraction));
    check.require(!each || both <= 1.0 + 1e-9, "scene.light.sky", || {
        format!("makes {both} with scene.light.sun, and both together must be at most 1; camera.photometric.light makes pictures brighter")
    });
}

fn check_board(check: &mut Check, board: &BoardSpec) {
    if board.target.is_none() {
        if let Err(BoardError { key, message }) = Board::from_spec(board) {
            check.fail(format!("scene.board.{key}"), message);
        }
    } else {
        let given =
            board.kind.is_some() || board.columns.is_some() || board.rows.is_some() || board.size_m.is_some();
        check.require(!given, "scene.board.target", || {
            "takes the place of kind, columns, rows and size_m: leave those out".into()
        });
    }
    check_position(check, "scene.board", board.at, board.geodetic);
}

/// Name of an object.
fn check_name(check: &mut Check, table: &str, name: &Option<String>) {
    check.require(name.as_ref().is_none_or(|name| !name.trim().is_empty()), format!("{table}.name"), || {
        "is empty; leave it out for the usual name".into()
    });
}

/// Placement of an object: in local north-east-down or geodetic, not both.
fn check_position(check: &mut Check, table: &str, at: PatternCentre, geodetic: Option<[f64; 3]>) {
    if let Some([lat_deg, lon_deg, height_m]) = geodetic {
        let key = format!("{table}.geodetic");
        let ok = lat_deg.abs() <= 90.0 && lon_deg.abs() <= 360.0 && height_m.is_finite();
        check.require(ok, key.clone(), || {
            format!("must be [latitude_deg -90..90, longitude_deg, height_m], not [{lat_deg}, {lon_deg}, {height_m}]")
        });
        check.require(at == PatternCentre::Origin, key, || {
            format!("takes the place of {table}.at: leave one of them out")
        });
    }
}
