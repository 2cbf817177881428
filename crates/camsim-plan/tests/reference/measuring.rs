//! What counts as a silhouette, and errors of light.

use camsim_core::{
    frame::RenderedFrame,
    reference::{IdealView, ReferenceRenderer, RenderOptions, coord_errors, image_errors, silhouettes},
    scenario::{Channel, FieldOr, Preset, Scenario},
    scene::{Scene, Terrain},
};
use camsim_plan::Planner;
use glam::{DVec2, DVec3};

use crate::fixtures::{Steady, block, plane, rolling, scenario, sequence};

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
    // Straight above its middle only the roof's border is seen: 20 m below the camera's 100, 10 m to each
    // side: 12.5 px.
    let scene = one_block(DVec3::ZERO, 10.0, 20.0);
    // Two fields see the same while the camera stands, whenever they look.
    for interlace_ms in [0.0, 20.0] {
        let mut scenario = camera();
        scenario.camera.shutter.interlace_ms = FieldOr::Ms(interlace_ms);
        let reference = ReferenceRenderer::new(sequence(
            scenario,
            Steady::standing(DVec3::new(0.0, 0.0, -100.0)),
            scene.clone(),
        ))
        .unwrap();
        let near = silhouettes(&reference, 0, &[0.0]);
        for y in 0..120_u32 {
            for x in 0..160_u32 {
                let from_middle =
                    (DVec2::new(f64::from(x), f64::from(y)) - DVec2::new(79.5, 59.5)).abs().max_element();
                let from_border = (from_middle - 12.5).abs();
                let marked = near[(y * 160 + x) as usize];
                // Within 3 px of a pixel beside the border: surely at 3, surely not at 5.
                assert!(
                    if from_border <= 3.0 { marked } else { from_border < 5.0 || !marked },
                    "{x} {y}, {interlace_ms} ms: {marked}"
                );
            }
        }
    }
}

#[test]
fn fields_of_different_instants_make_no_silhouettes() {
    // Between the fields the camera turns by 4 degrees and comes 4 m nearer; the ground is a plane.
    let mut scenario = camera();
    scenario.camera.shutter.interlace_ms = FieldOr::Ms(200.0);
    let reference = |scene: Scene| {
        ReferenceRenderer::new(sequence(scenario.clone(), Steady::moving(100.0), scene)).unwrap()
    };
    let on_plane = silhouettes(&reference(plane(4000.0)), 0, &[-0.5, 0.0]);
    assert!(!on_plane.contains(&true), "{}", on_plane.iter().filter(|near| **near).count());
    // Each field has the silhouettes of its own instant: those of a camera that shows both rows of a pair
    // then.
    let scene = one_block(DVec3::ZERO, 10.0, 40.0);
    let near = silhouettes(&reference(scene.clone()), 0, &[0.0]);
    for (field, delay_ms) in [(0, 200.0), (1, 0.0)] {
        let mut one_field = camera();
        one_field.camera.shutter.delay_ms = delay_ms;
        let own = silhouettes(
            &ReferenceRenderer::new(sequence(one_field, Steady::moving(100.0), scene.clone())).unwrap(),
            0,
            &[0.0],
        );
        let rows = || (0..160 * 120_usize).filter(|i| i / 160 % 2 == field);
        let marked = rows().filter(|&i| own[i]).count();
        // At the outer end of the 3 px they may differ by a row.
        let differ = rows().filter(|&i| own[i] != near[i]).count();
        assert!(marked > 100 && differ < marked / 5, "field {field}: {differ} of {marked}");
    }
}

/// Ridges and furrows with slopes of 0.25, a crease every 20 m.
fn zigzag() -> Scene {
    let ridge_m = |k: u32| 2.5 * f64::from((k % 4).abs_diff(2));
    let heights: Vec<f64> = (0..81 * 81).map(|i| ridge_m(i % 81) + ridge_m(i / 81)).collect();
    Scene { terrain: Some(Terrain::from_heights(81, 81, 10.0, &heights, None).unwrap()), ..Scene::default() }
}

#[test]
fn slopes_and_creases_are_no_silhouettes_measured_or_predicted() {
    // Nothing hides anything from a camera that looks down steeply.
    let mut scenario = camera();
    scenario.camera.size_px = [80, 60];
    scenario.camera.shutter = rolling(0.0);
    // With all of the probes.
    scenario.quality.frames_per_ideal = 1;
    let own = sequence(scenario.clone(), Steady::moving(120.0), zigzag());
    let near = silhouettes(&ReferenceRenderer::new(own.clone()).unwrap(), 0, &[0.0]);
    assert!(!near.contains(&true), "{} of 4800", near.iter().filter(|near| **near).count());
    let plan = Planner::new(own, &[Channel::Coords], 4096).unwrap().plan(0).unwrap();
    assert!(plan.predicted.silhouette_fraction == 0.0 && plan.predicted.probes > 400, "{:?}", plan.predicted);
    // A wall does.
    let mut walled = zigzag();
    walled.meshes.push(block(DVec3::ZERO, 15.0, 40.0));
    let own = sequence(scenario, Steady::moving(120.0), walled);
    let near = silhouettes(&ReferenceRenderer::new(own.clone()).unwrap(), 0, &[0.0]);
    let measured = near.iter().filter(|near| **near).count() as f64 / 4800.0;
    let predicted =
        Planner::new(own, &[Channel::Coords], 4096).unwrap().plan(0).unwrap().predicted.silhouette_fraction;
    assert!(measured > 0.1 && (predicted - measured).abs() < 0.15, "{measured} {predicted}");
}

#[test]
fn a_frame_that_looks_beside_its_ideal_frame_is_not_predicted_to_be_right() {
    // The paper's frustum is symmetric about the optical axis, which lies far outside of this picture.
    let mut scenario = camera();
    scenario.quality.preset = Preset::Paper;
    let plan = |principal_px: [f64; 2]| {
        let mut scenario = scenario.clone();
        scenario.camera.principal_point_px = Some(principal_px);
        let sequence = sequence(scenario, Steady::standing(DVec3::new(0.0, 0.0, -100.0)), plane(4000.0));
        Planner::new(sequence, &[Channel::Coords], 4096).unwrap().plan(0).unwrap()
    };
    let beside = plan([400.0, 300.0]);
    assert!(
        beside.predicted.probes == 0
            && !beside.predicted.source_error_kept
            && beside.predicted.void_fraction == 1.0,
        "{:?}",
        beside.predicted
    );
    assert!(
        beside.predicted.source_error_obstacle.as_ref().is_some_and(|cause| cause.contains("ideal frame")),
        "{:?}",
        beside.predicted
    );
    let text = beside.to_string();
    assert!(text.contains("nothing predicted") && !text.contains("within the tolerance"), "{text}");
    // Half of it.
    let half = plan([160.0, 59.5]).predicted;
    assert!(
        half.void_fraction > 0.1 && half.probes > 100 && !half.source_error_kept && half.total_px < 0.05,
        "{half:?}"
    );
    let middle = plan([79.5, 59.5]).predicted;
    assert!(middle.source_error_kept && middle.void_fraction == 0.0, "{middle:?}");
}

#[test]
fn what_the_key_camera_cannot_see_counts_as_a_silhouette() {
    // The block stands to the right; a key camera beyond it does not see the ground before it, nor its near
    // wall.
    let scene = one_block(DVec3::new(0.0, 30.0, 0.0), 5.0, 60.0);
    let sequence = sequence(camera(), Steady::standing(DVec3::new(0.0, 0.0, -100.0)), scene);
    let reference = ReferenceRenderer::new(sequence.clone()).unwrap();
    let mut plan = Planner::new(sequence, &[Channel::Coords], 4096).unwrap().plan(0).unwrap();
    let at_silhouettes = |plan: &camsim_plan::FramePlan| {
        let key = Some(IdealView { pose: plan.key_pose, ideal: plan.ideal });
        let frame = reference
            .render(0, &RenderOptions { channels: vec![Channel::Coords], key, ..RenderOptions::default() });
        let errors = coord_errors(&reference, plan.frame, &plan.ideal_view(), &frame, 0.0, 1).unwrap();
        assert!(errors.all.max_px < 5e-5 && errors.all.count == 160 * 120, "{errors:?}");
        errors.silhouettes.count
    };
    let from_here = at_silhouettes(&plan);
    plan.key_pose.position_ned_m.y += 60.0;
    let from_there = at_silhouettes(&plan);
    // From 60 m to the east the roof's near border (25 m east, 60 m high) hides the ground from 27.5 m west
    // to the wall: 52 px, at least 10 wide; and the wall, 37 px from its foot to its top.
    assert!(from_here > 50 && from_there > from_here + 800, "{from_here} {from_there}");
}

#[test]
fn errors_of_light_are_what_was_added() {
    let frame = |offset: f32| {
        let color_rgba = (0..200)
            .flat_map(|i| {
                if i < 150 {
                    [0.5 + offset, 0.5 + offset, 0.5 + offset, 1.0]
                } else {
                    [0.5 + 10.0 * offset, 0.5, 0.5, 1.0]
                }
            })
            .collect();
        RenderedFrame::picture([20, 10], color_rgba)
    };
    let near: Vec<bool> = (0..200).map(|i| i >= 150).collect();
    let errors = image_errors(&frame(0.0), &frame(0.01), &near).unwrap();
    assert!((errors.smooth_db - 40.0).abs() < 1e-3, "{errors:?}");
    // One channel of three is off by 0.1: 20 dB + 10 log 3.
    assert!((errors.silhouettes_db - 24.771).abs() < 1e-3, "{errors:?}");
    let mean = (150.0 * 1e-4 + 50.0 * 1e-2 / 3.0) / 200.0;
    assert!(
        (errors.all_db + 10.0 * f64::log10(mean)).abs() < 1e-3 && errors.pixels == [200, 50],
        "{errors:?}"
    );
    assert_eq!(image_errors(&frame(0.0), &frame(0.0), &near).unwrap().all_db, f64::INFINITY);
    // Nothing is farther off than what is not a number.
    let mut broken = frame(0.0);
    broken.color_rgba_mut()[1] = f32::NAN;
    assert_eq!(image_errors(&frame(0.0), &broken, &near).unwrap().smooth_db, f64::NEG_INFINITY);
    assert_eq!(image_errors(&frame(0.0), &frame(0.0), &near[1..]), None);
}
