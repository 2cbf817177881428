#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use super::*;
use crate::view::{
    lens_reach::LensReach,
    neighbourhood::search::NeighbourhoodSearch,
    surfaces::Surfaces,
    test_flights::{SPEED_M_S, flying_east, flying_east_from},
};
use camsim_core::temporal::SKY_REACH_PX;
use camsim_core::{
    camera::CameraModel,
    scenario::{LensModel, ShutterSpec},
    scene::{Encoding, Mesh, Scene, Terrain, Texture},
    shutter::Shutter,
};

const FOCAL_PX: f64 = 200.0;

/// A black board 100 m below the camera, of so many pixels a side, the sky beyond it; flying east, with
/// the ideal frame of so long after. Of all probes, or of two halves.
struct Board {
    side_px: f64,
    others: Vec<Mesh>,
    exposure_ms: f64,
    gain: f64,
    by_quarters: bool,
}

const BOARD: Board =
    Board { side_px: 200.0, others: Vec::new(), exposure_ms: 0.0, gain: 1.0, by_quarters: false };

fn found(Board { side_px, others, exposure_ms, gain, by_quarters }: Board, key_s: f64) -> f64 {
    let black = Arc::new(Texture::uniform([0, 0, 0, 255], Encoding::Linear));
    let board = Mesh::level_picture(black, DVec3::new(0.0, 0.0, -50.0), 100.0 * side_px / FOCAL_PX);
    let scene = Scene { meshes: [vec![board], others].concat(), sky_linear: [1.0; 3], ..Scene::default() };
    let path = flying_east();
    let shutter =
        Shutter::from_spec(&ShutterSpec { exposure_ms, ..ShutterSpec::default() }, 5.0, [400, 300]).unwrap();
    let camera = CameraModel::new([400, 300], [FOCAL_PX; 2], None, LensModel::Pinhole, &[]).unwrap();
    let (reach, surfaces) = (LensReach::new(Arc::new(camera)).unwrap(), Surfaces::new(Arc::new(scene)));
    let skyline = |reach: &LensReach| {
        let gain = |_: [u32; 2]| gain;
        let search = NeighbourhoodSearch {
            reach,
            surfaces: &surfaces,
            path: &path,
            shutter: &shutter,
            stamp_s: 0.0,
            gain: &gain,
        };
        search.neighbourhoods().skyline
    };
    let of_quarters = || {
        let quarters = [[false, false], [true, false], [false, true], [true, true]];
        let found = quarters.map(|of| skyline(&reach.with_a_quarter_of_the_probes(of)));
        found.into_iter().reduce(Skyline::and).unwrap()
    };
    let found = if by_quarters { of_quarters() } else { skyline(&reach) };
    let key_pose = path.pose(key_s);
    // Ten times as near as it is: looked for there, the border that has come nearer to the
    // sky is not found.
    let plane = SeenPlane { camera: key_pose, normal_per_m: 0.1 * DVec3::Z };
    found.strips(&key_pose, &plane)
}

#[test]
fn strips_at_a_displaced_skyline_are_predicted_at_any_width() {
    // Of the board's two borders across the flight, each of which moves towards the sky from one of two
    // frames, and with white beyond black. Straight and along rows and columns, as the probes nearly are,
    // they are found with the most scatter; and at the edges of the picture there are fewer lines. Over
    // an exposure these move by as much as they are displaced in as long.
    for (key_s, exposure_ms) in [(0.005, 0.0), (0.05, 0.0), (0.1, 0.0), (0.1, 20.0)] {
        let [width_px, path_px] = [key_s, 1e-3 * exposure_ms].map(|s| FOCAL_PX * SPEED_M_S * s / 100.0);
        // The border on the other side has gone, and later looks, which begin with nothing, find that up
        // to the reach.
        let wrong_px =
            (all_of(width_px) + gone(width_px)) * width_px.max(1.0) / (width_px.max(1.0) + path_px);
        for by_quarters in [false, true] {
            let sides_px = [150.0, 171.0, 190.0, 203.0, 222.0, 240.0, 261.0];
            let ratios = sides_px.map(|side_px| {
                let expected = margins::SKYLINE * margins::SKYLINE * side_px * 2.0 * wrong_px / 120_000.0;
                let found = |key_s| found(Board { side_px, exposure_ms, by_quarters, ..BOARD }, key_s);
                (found(key_s) + found(-key_s)) / expected
            });
            let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
            assert!((1.0..1.35).contains(&mean), "{key_s} s, {width_px} px: {ratios:?}");
            assert!(
                ratios.iter().all(|ratio| (0.8..1.7).contains(ratio)),
                "{key_s} s, {width_px} px: {ratios:?}"
            );
        }
    }
}

/// Of those beyond the reach where a surface has gone by so much.
fn gone(moved_px: f64) -> f64 {
    (moved_px - REACHED * SKY_REACH_PX - 0.5 + 1.0 / 3.0).max(0.0)
}

/// Of all pixels, in closed form.
fn all_of(moved_px: f64) -> f64 {
    if moved_px < 1.0 { moved_px * moved_px - moved_px.powi(3) / 3.0 } else { moved_px - 1.0 / 3.0 }
}

/// Of those with their middles beyond the skyline.
fn exactly(moved_px: f64) -> f64 {
    let w = moved_px.abs();
    match (moved_px > 0.0, w) {
        (true, ..=0.5) => w * w / 2.0 + w.powi(3) / 3.0,
        (true, 1.0..) => w - 0.375,
        (false, ..=0.5) => w * w / 2.0 - w.powi(3) * 2.0 / 3.0,
        (false, 0.5..) => 1.0 / 24.0,
        _ => panic!("between"),
    }
}

#[test]
fn pixels_that_find_the_surface_have_no_error() {
    for moved_px in [0.02, 0.2, 0.5, 1.0, -0.02, -0.2, -0.5, -0.8, -1.3] {
        // Looked for where it is, at once or beside it.
        assert_eq!(wrong_px(moved_px, moved_px, moved_px, SKY_REACH_PX), 0.0);
        assert_eq!(wrong_px(moved_px, moved_px - REACHED * SKY_REACH_PX + 0.5, moved_px, SKY_REACH_PX), 0.0);
        assert_eq!(wrong_px(moved_px, f64::NEG_INFINITY, 0.0, SKY_REACH_PX), 0.0);
        // What is beside it may move less: by nothing as the sky, by a little more or less than half.
        for part in [0.0, 0.5] {
            let found = wrong_px(moved_px, moved_px, part * moved_px, SKY_REACH_PX);
            assert!(
                (found / exactly((1.0 - part) * moved_px) - 1.0).abs() < 0.05,
                "{moved_px} {part}: {found}"
            );
        }
        // Whoever finds the sky only sees all of it.
        let of_all = wrong_px(moved_px, f64::INFINITY, moved_px, SKY_REACH_PX) / all_of(moved_px.abs());
        assert!((of_all - 1.0).abs() < 0.05, "{moved_px}: {of_all}");
        // A guess that is far too near finds the sky where the surface has come over it, and the surface
        // where that has gone.
        let too_near = wrong_px(moved_px, 300.0 * moved_px, moved_px, SKY_REACH_PX);
        assert!(if moved_px > 0.0 { too_near > 0.0 } else { too_near == 0.0 }, "{moved_px}: {too_near}");
    }
    // Beyond the reach: shown where it is not from there on, and not shown where it is up to there.
    for moved_px in [3.0, 5.0] {
        let over = wrong_px(moved_px, moved_px, moved_px, SKY_REACH_PX);
        assert!((over - gone(moved_px)).abs() < 0.05 * over, "{moved_px}: {over}");
        let found = wrong_px(-moved_px, 0.0, -moved_px, SKY_REACH_PX);
        assert!((found - gone(moved_px)).abs() < 0.05 * found, "{moved_px}: {found}");
    }
}

#[test]
fn skyline_error_follows_gain_and_sweep_and_is_zero_without_travel() {
    assert_eq!(found(BOARD, 0.0), 0.0);
    assert!((found(Board { gain: 0.5, ..BOARD }, 0.05) / found(BOARD, 0.05) - 0.25).abs() < 1e-12);
    // But for what an exposure of 8 px sweeps from beyond the reach, across two of four borders.
    let of_each = (4.0 - REACHED * SKY_REACH_PX).powi(3) / (3.0 * 64.0);
    let expected = margins::SKYLINE * margins::SKYLINE * 200.0 * 2.0 * of_each / 120_000.0;
    let swept = found(Board { exposure_ms: 100.0, ..BOARD }, 0.0);
    assert!((0.8..1.4).contains(&(swept / expected)), "{swept} {expected}");
}

#[test]
fn skylines_have_contrast_in_a_scene_with_panes() {
    let grey = Arc::new(Texture::uniform([99, 99, 99, 255], Encoding::Linear));
    let mut pane = Mesh::level_picture(grey, DVec3::new(9000.0, 0.0, -50.0), 10.0);
    pane.material.blends = true;
    let (with, without) = (found(Board { others: vec![pane], ..BOARD }, 0.05), found(BOARD, 0.05));
    // With a pane nothing goes with a surface: both borders are wrong from end to end.
    let expected = 2.0 * all_of(4.0) / (all_of(4.0) + gone(4.0));
    assert!(without > 0.0 && (with / without / expected - 1.0).abs() < 0.05, "{with} {without} {expected}");
}

/// A crest whose every other height is 3 m lower, 1500 m to the north and 30 m above the camera: where
/// coarser triangles leave the lower heights out it is drawn 1.5 m higher there in the mean, 1 px at
/// most.
#[test]
fn a_coarser_crest_displaces_the_skyline() {
    let height_m = |row: u32, column: u32| match row.abs_diff(64) {
        0 if column % 2 == 1 => 157.0,
        rows => 160.0 - 4.0 * f64::from(rows),
    };
    let heights: Vec<f64> =
        (0..129).flat_map(|row| (0..129).map(move |column| height_m(row, column))).collect();
    let terrain = Terrain::from_heights(129, 129, 10.0, &heights, None).unwrap();
    let (path, tangents) = (flying_east_from(DVec3::new(-1500.0, 0.0, -130.0), 0.0), [-0.4, 0.4, -0.3, 0.3]);
    let scene = Arc::new(Scene { terrain: Some(terrain), sky_linear: [0.0; 3], ..Scene::default() });
    let shutter = Shutter::from_spec(&ShutterSpec::default(), 5.0, [400, 300]).unwrap();
    let camera = CameraModel::new([400, 300], [500.0; 2], None, LensModel::Pinhole, &[]).unwrap();
    let (reach, surfaces) = (LensReach::new(Arc::new(camera)).unwrap(), Surfaces::new(scene.clone()));
    let search = NeighbourhoodSearch {
        reach: &reach,
        surfaces: &surfaces,
        path: &path,
        shutter: &shutter,
        stamp_s: 0.0,
        gain: &|_| 1.0,
    };
    let skyline = search.neighbourhoods().skyline;
    let lowered = |max_error_px: f64| {
        let detail = TerrainDetail::new(
            scene.terrain.as_ref().unwrap(),
            &path.pose(0.0),
            tangents,
            500.0,
            max_error_px,
        );
        skyline.lowered(&detail)
    };
    assert!(lowered(1e-6) < 1e-20);
    // From 0 to 1 px and back along the crest: of squares a third, in the mean.
    let contrast2 =
        skyline.points.iter().map(|(_, point)| point.contrast2).sum::<f64>() / skyline.points.len() as f64;
    let fraction = 400.0 / 120_000.0;
    let expected = margins::SKYLINE_OF_TERRAIN * margins::SKYLINE_OF_TERRAIN * contrast2 * fraction / 3.0;
    assert!((0.6..1.6).contains(&(lowered(2.0) / expected)), "{} {expected}", lowered(2.0));
}
