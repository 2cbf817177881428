//! Surfaces that are mixed with what is behind them: the reference against closed forms.

use std::sync::Arc;

use camsim_core::{
    reference::ReferenceRenderer,
    scenario::{Auto, Channel},
    scene::{Encoding, Mesh, Scene, Texture},
};
use camsim_plan::Planner;
use glam::{DMat3, DVec2, DVec3};

use crate::fixtures::{Steady, scenario, sequence};

const WALL: DVec3 = DVec3::new(0.9, 0.8, 0.1);
const SKY: DVec3 = DVec3::new(0.1, 0.2, 0.7);

/// A level square of one colour with a side of 60 m, so high above the ground.
fn level(color: DVec3, alpha: f32, height_m: f64) -> Mesh {
    let texture = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
    let mut mesh = Mesh::level_picture(texture, DVec3::new(0.0, 0.0, -height_m), 60.0);
    let [r, g, b] = color.as_vec3().to_array();
    Arc::make_mut(&mut mesh.shape).vertices.iter_mut().for_each(|vertex| vertex.tint = [r, g, b, alpha]);
    mesh
}

fn pane(color: DVec3, alpha: f32, height_m: f64) -> Mesh {
    let mut mesh = level(color, alpha, height_m);
    (mesh.material.blends, mesh.material.cutoff) = (true, Some(0.5));
    mesh
}

const RED: DVec3 = DVec3::new(0.8, 0.1, 0.0);
const BLUE: DVec3 = DVec3::new(0.1, 0.3, 0.9);

fn over(front: DVec3, alpha: f64, behind: DVec3) -> DVec3 {
    alpha * front + (1.0 - alpha) * behind
}

fn looks(meshes: Vec<Mesh>, fog_visibility_m: Option<f64>) -> (DVec3, Option<f64>) {
    let sky_linear = SKY.as_vec3().to_array();
    let scene = Scene { meshes, sky_linear, fog_visibility_m, ..Scene::default() };
    let reference =
        ReferenceRenderer::new(sequence(scenario(), Steady::standing(DVec3::new(0.0, 0.0, -100.0)), scene))
            .unwrap();
    // A pixel on no edge, and one on the edge between the triangles of every square.
    let seen = [DVec2::new(0.013, 0.029), DVec2::ZERO].map(|uv| {
        let pose = reference.sequence().path.pose(0.0);
        (
            reference.radiance(&pose, uv),
            reference.cast(pose.position_ned_m, pose.ned_from_camera * uv.extend(1.0)).map(|hit| hit.depth_m),
        )
    });
    if fog_visibility_m.is_none() {
        assert!(
            seen[0].0.distance(seen[1].0) < 1e-9 && seen[0].1.is_some() == seen[1].1.is_some(),
            "{seen:?}"
        );
    }
    seen[1]
}

#[test]
fn panes_are_blended_from_behind_to_the_front_in_any_order() {
    let wall = level(WALL, 1.0, 0.0);
    for (heights, alphas, depth_m) in [
        ([20.0, 40.0], [0.3, 0.6], 60.0),
        ([40.0, 20.0], [0.3, 0.6], 80.0),
        ([40.0, 20.0], [0.3, 0.4], 100.0),
        ([40.0, 20.0], [0.75, 0.6], 60.0),
    ] {
        let panes = [pane(RED, alphas[0], heights[0]), pane(BLUE, alphas[1], heights[1])];
        let [a, b] = [(RED, f64::from(alphas[0])), (BLUE, f64::from(alphas[1]))];
        let (front, behind) = if heights[0] > heights[1] { (a, b) } else { (b, a) };
        let expected = over(front.0, front.1, over(behind.0, behind.1, WALL));
        for order in [[0, 1, 2], [2, 1, 0], [1, 2, 0]] {
            let all = [wall.clone(), panes[0].clone(), panes[1].clone()];
            let (found, depth) = looks(order.map(|k: usize| all[k].clone()).to_vec(), None);
            assert!(found.distance(expected) < 1e-7, "{heights:?} {alphas:?} {order:?}: {found} {expected}");
            assert!((depth.unwrap() - depth_m).abs() < 1e-9, "{depth:?}: of the foremost from 0.5 on");
        }
    }
}

#[test]
fn what_is_hidden_turned_away_or_clear_adds_nothing() {
    let wall = level(WALL, 1.0, 10.0);
    let alone = looks(vec![wall.clone()], None);
    assert!(alone.0.distance(WALL) < 1e-7 && (alone.1.unwrap() - 90.0).abs() < 1e-9, "{alone:?}");
    assert_eq!(looks(vec![wall.clone(), pane(RED, 0.6, 5.0)], None), alone);
    assert_eq!(looks(vec![wall.clone(), pane(RED, 0.0, 50.0)], None), alone);
    // One side of it is not there.
    let mut away = pane(RED, 0.6, 50.0);
    away.material.one_sided = true;
    let sides = [DMat3::IDENTITY, DMat3::from_rotation_x(std::f64::consts::PI)];
    let found = sides
        .map(|ned_from_shape| looks(vec![wall.clone(), Mesh { ned_from_shape, ..away.clone() }], None).0);
    let mut distances = found.map(|color| color.distance(WALL));
    distances.sort_by(f64::total_cmp);
    assert!(distances[0] < 1e-7 && distances[1] > 0.3, "{found:?}");
    // Before the sky.
    let (found, depth) = looks(vec![pane(RED, 0.25, 50.0)], None);
    assert!(found.distance(over(RED, 0.25, SKY)) < 1e-7 && depth.is_none(), "{found}");
}

#[test]
fn each_layer_has_its_own_fog_and_light_of_its_own_is_as_clear_as_it() {
    let mut shining = pane(RED, 0.3, 40.0);
    shining.material.emissive = [0.1, 0.2, 0.3];
    let (found, _) = looks(vec![level(WALL, 1.0, 0.0), shining.clone()], Some(200.0));
    // Through the air between the wall and the pane, the pane, and the air before it.
    let air = |color: DVec3, path_m: f64| SKY + (-3.912 * path_m / 200.0_f64).exp() * (color - SKY);
    let expected = air(over(RED + DVec3::new(0.1, 0.2, 0.3), 0.3, air(WALL, 40.0)), 60.0);
    assert!(found.distance(expected) < 1e-6, "{found} {expected}");
}

/// A camera that flies over a pane above a picture: what the plan says of the mixture's one depth against the
/// difference that it makes.
#[test]
fn the_error_by_one_depth_is_predicted() {
    let predicted = |meshes: Vec<Mesh>, speed_m_s: f64, keys: u32| {
        let mut scenario = scenario();
        scenario.quality.key_frames = Auto::Value(keys);
        scenario.camera.shutter.readout_ms = 60.0;
        let motion = Steady {
            velocity_ned_m_s: DVec3::new(0.0, speed_m_s, 0.0),
            ..Steady::standing(DVec3::new(0.0, 0.0, -100.0))
        };
        let sequence = sequence(
            scenario,
            motion,
            Scene { meshes, sky_linear: SKY.as_vec3().to_array(), ..Scene::default() },
        );
        Planner::new(sequence, &[Channel::Color], 16_384).unwrap().plan(0).unwrap()
    };
    let ground = || crate::fixtures::plane(400.0).meshes;
    let with = |panes: &[Mesh]| [ground(), panes.to_vec()].concat();
    let none = predicted(ground(), 40.0, 1);
    assert!(
        none.predicted.blended_depth.is_none()
            && none.skipped.iter().any(|skip| skip.what.contains("blending"))
    );
    // One colour: wherever the pane is seen, it is the same; but for its border.
    let wide =
        Mesh { ned_from_shape: DMat3::from_diagonal(DVec3::new(8.0, 8.0, 1.0)), ..pane(RED, 0.3, 40.0) };
    let plain = predicted(with(std::slice::from_ref(&wide)), 40.0, 1).predicted.blended_depth.unwrap();
    assert!(plain.fraction > 0.99 && plain.error_dn < 1e-6, "{plain:?}");
    // Alpha from 0 to 0.48 over 480 m to the east, above ground of one colour: of a ray to a point of that,
    // which comes from a camera d m further east, 40 m of 100 m below the pane, alpha differs by 0.001 * 0.4
    // d. Lines are even over the 60 ms.
    let mut ramp = wide.clone();
    Arc::make_mut(&mut ramp.shape)
        .vertices
        .iter_mut()
        .for_each(|vertex| vertex.tint[3] = 0.48 * vertex.uv[0]);
    let ground = Mesh { ned_from_shape: wide.ned_from_shape, ..level(WALL, 1.0, 0.0) };
    for (speed_m_s, keys) in [(0.0, 1), (30.0, 1), (300.0, 1), (300.0, 2), (300.0, 4)] {
        let plan = predicted(vec![ground.clone(), ramp.clone()], speed_m_s, keys);
        let found = plan.predicted.blended_depth.unwrap();
        assert_eq!(plan.keys.len(), if speed_m_s > 0.0 { keys as usize } else { 1 });
        // From the nearest of the ideal frames, which are in the middles of equal parts.
        let rms_m = 0.03 * speed_m_s / 3.0_f64.sqrt() / f64::from(keys);
        let expected_dn = 255.0 * 0.001 * 0.4 * rms_m * (RED - WALL).length() / 3.0_f64.sqrt();
        // Times a margin of 1.2; the pixels that are looked at are even over lines to some hundredths.
        assert!(
            (found.error_dn / 1.2 - expected_dn).abs() < 0.05 * expected_dn + 1e-6,
            "{found:?} {expected_dn}"
        );
    }
}
