//! What counts as a silhouette, and errors of light.

use camsim_core::{
    frame::RenderedFrame,
    plan::Planner,
    reference::{KeyFrame, Oracle, RenderOptions, coord_errors, image_errors, silhouettes},
    scenario::{Channel, Scenario},
    scene::Scene,
};
use glam::{DVec2, DVec3};

use crate::fixtures::{Steady, block, plane, scenario, sequence};

/// 160 x 120 px, 100 m above the ground: a pixel is a metre there.
fn camera() -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = [160, 120];
    scenario.camera.focal_px = [100.0, 100.0];
    scenario
}

fn one_block(at: DVec3, half_m: f64, height_m: f64) -> Scene {
    let mut scene = plane(4000.0);
    scene.meshes.push(block(at, half_m, height_m));
    scene
}

#[test]
fn pixels_near_a_roof_are_at_a_silhouette_and_others_are_not() {
    // Straight above its middle only the roof's border is seen: 20 m below the camera's 100, 10 m to each side: 12.5 px.
    let scene = one_block(DVec3::ZERO, 10.0, 20.0);
    let oracle = Oracle::new(sequence(camera(), Steady::standing(DVec3::new(0.0, 0.0, -100.0)), scene)).unwrap();
    let near = silhouettes(&oracle, 0, &[0.0]);
    for y in 0..120_u32 {
        for x in 0..160_u32 {
            let from_middle = (DVec2::new(f64::from(x), f64::from(y)) - DVec2::new(79.5, 59.5)).abs().max_element();
            let from_border = (from_middle - 12.5).abs();
            let marked = near[(y * 160 + x) as usize];
            // Within 3 px of a pixel beside the border: surely at 3, surely not at 5.
            assert!(if from_border <= 3.0 { marked } else { from_border < 5.0 || !marked }, "{x} {y}: {marked}");
        }
    }
}

#[test]
fn what_the_key_camera_cannot_see_counts_as_a_silhouette() {
    // The block stands to the right; a key camera beyond it does not see the ground before it, nor its near wall.
    let scene = one_block(DVec3::new(0.0, 30.0, 0.0), 5.0, 60.0);
    let sequence = sequence(camera(), Steady::standing(DVec3::new(0.0, 0.0, -100.0)), scene);
    let oracle = Oracle::new(sequence.clone()).unwrap();
    let mut plan = Planner::new(sequence, &[Channel::Coords], 4096).unwrap().plan(0).unwrap();
    let at_silhouettes = |plan: &camsim_core::plan::FramePlan| {
        let key = Some(KeyFrame { pose: plan.key_pose, ideal: plan.ideal });
        let frame = oracle.render(0, &RenderOptions { channels: vec![Channel::Coords], key, ..RenderOptions::default() });
        let errors = coord_errors(&oracle, plan, &frame, 0.0, 1).unwrap();
        assert!(errors.all.max_px < 5e-5 && errors.all.count == 160 * 120, "{errors:?}");
        errors.silhouettes.count
    };
    let from_here = at_silhouettes(&plan);
    plan.key_pose.position_ned_m.y += 60.0;
    let from_there = at_silhouettes(&plan);
    // From 60 m to the east the roof's near border (25 m east, 60 m high) hides the ground from 27.5 m west to the wall: 52 px, at least 10 wide;
    // and the wall, 37 px from its foot to its top.
    assert!(from_here > 50 && from_there > from_here + 800, "{from_here} {from_there}");
}

#[test]
fn errors_of_light_are_what_was_added() {
    let frame = |offset: f32| {
        let color_rgba = (0..200)
            .flat_map(|i| if i < 150 { [0.5 + offset, 0.5 + offset, 0.5 + offset, 1.0] } else { [0.5 + 10.0 * offset, 0.5, 0.5, 1.0] })
            .collect();
        RenderedFrame { size_px: [20, 10], color_rgba, ..RenderedFrame::default() }
    };
    let near: Vec<bool> = (0..200).map(|i| i >= 150).collect();
    let errors = image_errors(&frame(0.0), &frame(0.01), &near).unwrap();
    assert!((errors.smooth_db - 40.0).abs() < 1e-3, "{errors:?}");
    // One channel of three is off by 0.1: 20 dB + 10 log 3.
    assert!((errors.silhouettes_db - 24.771).abs() < 1e-3, "{errors:?}");
    let mean = (150.0 * 1e-4 + 50.0 * 1e-2 / 3.0) / 200.0;
    assert!((errors.all_db + 10.0 * f64::log10(mean)).abs() < 1e-3 && errors.pixels == [200, 50], "{errors:?}");
    assert_eq!(image_errors(&frame(0.0), &frame(0.0), &near).unwrap().all_db, f64::INFINITY);
    // Nothing is farther off than what is not a number.
    let mut broken = frame(0.0);
    broken.color_rgba[1] = f32::NAN;
    assert_eq!(image_errors(&frame(0.0), &broken, &near).unwrap().smooth_db, f64::NEG_INFINITY);
    assert_eq!(image_errors(&frame(0.0), &frame(0.0), &near[1..]), None);
}
