//! Range checks of `[scene]`.

use super::{Check, motion::check_motion};
use crate::{
    scenario::{BoardSpec, LightSpec, ObjectsOf, PatternCentre, SceneSpec, TerrainSpec},
    scene::{Board, BoardError},
};

/// Largest factor of the sky: half floats hold 65 504.
const MOST_BRIGHTNESS: f64 = 10_000.0;

pub(super) fn check_scene(check: &mut Check, scene: &SceneSpec) {
    let has_surface =
        scene.terrain.is_some() || scene.pattern.is_some() || scene.board.is_some() || !scene.gltf.is_empty();
    check.require(has_surface, "scene", || {
        "is empty; give scene.terrain = { dem = \"dem.tif\" }, scene.pattern = { image = \"grid.png\", width_m = 100.0 }, a [scene.board] or a [[scene.gltf]]"
            .into()
    });
    for (i, model) in scene.gltf.iter().enumerate() {
        let table = format!("scene.gltf.{i}");
        check_place(check, &table, model.at, model.geodetic);
        check.finite(format!("{table}.heading_deg"), &[model.heading_deg]);
        check.positive(format!("{table}.scale"), model.scale, "1 is as the file has it");
        check.finite(format!("{table}.time_s"), &[model.time_s.unwrap_or(0.0)]);
        check_object(check, &table, &model.name, model.class);
        check.require(
            model.classes.is_empty() || model.objects != ObjectsOf::Placement,
            format!("{table}.classes"),
            || "needs objects = \"node\" or \"material\"; a placed copy has the one class of class".into(),
        );
        for (name, &class) in &model.classes {
            check_class(check, format!("{table}.classes.{name}"), class);
        }
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
    if let Some(white) = scene.terrain.as_ref().and_then(|terrain| terrain.ortho_white) {
        check.positive(
            "scene.terrain.ortho_white",
            white,
            "give the stored value of white, 2047 for 11 bits",
        );
    }
    if let Some(TerrainSpec { name, class, .. }) = &scene.terrain {
        check_object(check, "scene.terrain", name, *class);
    }
    if let Some(board) = &scene.board {
        check_board(check, board);
        check_object(check, "scene.board", &board.name, board.class);
    }
    if let Some(pattern) = &scene.pattern {
        check_object(check, "scene.pattern", &pattern.name, pattern.class);
        check.positive("scene.pattern.width_m", pattern.width_m, "give the width on the ground in metres");
        if let PatternCentre::Ned(centre) = pattern.at {
            check.finite("scene.pattern.at", &centre);
        }
    }
    check.require(scene.sky.iter().all(|value| (0.0..=1.0).contains(value)), "scene.sky", || {
        format!("must be sRGB values in 0..1, not {:?}; divide 8-bit values by 255", scene.sky)
    });
    if let Some(brightness) = scene.sky_brightness {
        check.require((0.0..=MOST_BRIGHTNESS).contains(&brightness), "scene.sky_brightness", || {
            format!(
                "must be a factor of 0 to {MOST_BRIGHTNESS}, not {brightness}; 1 leaves scene.sky as it is"
            )
        });
    }
    if let Some(visibility_m) = scene.fog_visibility_m {
        check.positive("scene.fog_visibility_m", visibility_m, "leave it out for clear air");
    }
    if let Some(light) = &scene.light {
        check_light(check, light);
    }
}

fn check_light(check: &mut Check, light: &LightSpec) {
    check.require(light.sun_azimuth_deg.abs() <= 360.0, "scene.light.sun_azimuth_deg", || {
        format!("must be -360 to 360, from north to east, not {}", light.sun_azimuth_deg)
    });
    check.require((0.0..=90.0).contains(&light.sun_elevation_deg), "scene.light.sun_elevation_deg", || {
        format!(
            "must be 0 (on the horizon) to 90 (overhead), not {}; for a night set scene.light.sun = 0",
            light.sun_elevation_deg
        )
    });
    for (key, share) in [("scene.light.sun", light.sun), ("scene.light.sky", light.sky)] {
        check.require((0.0..=1.0).contains(&share), key, || {
            format!("must be a factor of 0 to 1, not {share}")
        });
    }
    // The sum must not exceed white; exposure is a matter of the camera. A small tolerance allows sums like
    // 0.7 + 0.3. Each value by itself has been checked above.
    let both = light.sun + light.sky;
    let each = [light.sun, light.sky].iter().all(|share| (0.0..=1.0).contains(share));
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
    check_place(check, "scene.board", board.at, board.geodetic);
    check.finite("scene.board.angles_deg", &board.angles_deg);
}

/// Name and class of an object.
fn check_object(check: &mut Check, table: &str, name: &Option<String>, class: Option<u16>) {
    check.require(name.as_ref().is_none_or(|name| !name.trim().is_empty()), format!("{table}.name"), || {
        "is empty; leave it out for the usual name".into()
    });
    class.into_iter().for_each(|class| check_class(check, format!("{table}.class"), class));
}

fn check_class(check: &mut Check, key: String, class: u16) {
    check.require(class > 0, key, || "must be 1 to 65535; leave it out for no class".into());
}

/// Placement of an object: in local north-east-down or geodetic, not both.
fn check_place(check: &mut Check, table: &str, at: PatternCentre, geodetic: Option<[f64; 3]>) {
    if let PatternCentre::Ned(centre) = at {
        check.finite(format!("{table}.at"), &centre);
    }
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
