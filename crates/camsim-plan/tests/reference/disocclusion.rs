//! What no ideal frame sees: predicted from a few hundred probes, counted by the reference, and the ideal frames
//! that are taken for it.

use std::sync::Arc;

use camsim_core::{
    reference::{ReferenceRenderer, disocclusion},
    scenario::{Auto, Channel, Scenario, ShutterSpec, Silhouettes},
    scene::Scene,
    sequence::Sequence,
};
use camsim_plan::{FramePlan, Planner};
use glam::DVec3;

use crate::fixtures::{Steady, block, hills, plane, scenario, sequence};

/// 160 x 120 px, 100 px to the radian, straight down.
fn camera(readout_ms: f64, exposure_ms: f64) -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = [160, 120];
    scenario.camera.focal_px = [100.0, 100.0];
    scenario.camera.shutter = ShutterSpec { readout_ms, exposure_ms, ..ShutterSpec::default() };
    scenario
}

/// Level flight to the north-east at 25 m/s.
fn flight(height_m: f64) -> Steady {
    Steady {
        velocity_ned_m_s: DVec3::new(20.0, 15.0, 0.0),
        ..Steady::standing(DVec3::new(0.0, 0.0, -height_m))
    }
}

fn plan(sequence: &Arc<Sequence>) -> FramePlan {
    Planner::new(sequence.clone(), &[Channel::Color], 8192).unwrap().plan(0).unwrap()
}

fn with(sequence: &Arc<Sequence>, edit: impl Fn(&mut Scenario)) -> Arc<Sequence> {
    let mut own = (**sequence).clone();
    edit(&mut own.scenario);
    Arc::new(own)
}

/// Over the exposure as the probes look.
fn counted(sequence: &Arc<Sequence>, plan: &FramePlan) -> f64 {
    let phases: &[f64] = if plan.blur.is_some() { &[-0.5, 0.0, 0.5] } else { &[0.0] };
    disocclusion(&ReferenceRenderer::new(sequence.clone()).unwrap(), plan.frame, &plan.key_poses(), phases)
        .fraction()
}

fn house() -> Scene {
    let mut scene = plane(4000.0);
    scene.meshes.push(block(DVec3::new(4.0, 3.0, 0.0), 8.0, 25.0));
    scene
}

/// Houses of 6 to 24 m, one each 25 m.
fn town() -> Scene {
    let mut scene = plane(4000.0);
    for (i, j) in (-6..=6).flat_map(|i| (-6..=6).map(move |j| (i, j))) {
        scene.meshes.push(block(
            25.0 * DVec3::new(f64::from(i), f64::from(j), 0.0),
            5.0,
            6.0 + 2.5 * f64::from((3 * i + 5 * j) & 7),
        ));
    }
    scene
}

#[test]
fn predicted_disocclusion_is_what_the_reference_counts() {
    for (name, sequence) in [
        ("a house", sequence(camera(400.0, 0.0), flight(50.0), house())),
        ("a house, blurred", sequence(camera(200.0, 200.0), flight(50.0), house())),
        ("a town", sequence(camera(100.0, 0.0), flight(80.0), town())),
        ("a town, turning", sequence(camera(200.0, 20.0), Steady::moving(80.0), town())),
    ] {
        for keys in [1, 2] {
            let sequence = with(&sequence, |scenario| scenario.quality.key_frames = Auto::Value(keys));
            let plan = plan(&sequence);
            assert_eq!(plan.keys.len(), keys as usize, "{name}");
            let (found, measured) = (plan.predicted.disocclusion.unwrap(), counted(&sequence, &plan));
            eprintln!("{name}, {keys} keys: {found:?}, measured {measured:.2e}");
            assert!(measured > 1e-4 || keys > 1, "{name}: {measured:.1e}");
            // The strips that two of them leave may be found in their true width alone: so much is for a
            // single probe to say.
            let slack = if keys == 1 { 0.0 } else { 1.0 / f64::from(plan.predicted.probes) };
            assert!(
                found.fraction < 2.0 * measured + slack && measured < 2.0 * found.fraction + slack,
                "{name}, {keys}: {found:?} {measured:.2e}"
            );
        }
    }
}

#[test]
fn a_second_ideal_frame_is_for_visible_disocclusion() {
    let keys = |sequence: &Arc<Sequence>| plan(sequence).keys.len();
    // 25 m of roof above 50 m: strips up to 25 px.
    let close = sequence(camera(400.0, 0.0), flight(50.0), house());
    assert_eq!(keys(&close), 2);
    // The same house within 2 ms is passed by 5 cm.
    let short = with(&close, |scenario| scenario.camera.shutter.readout_ms = 2.0);
    assert_eq!(keys(&short), 1);
    // Hills and a skyline, where the nearest surface moves by several pixels against the farthest: behind
    // their crests there is little to miss.
    let mut oblique = camera(33.0, 24.0);
    oblique.camera.mount.angles_deg = [0.0, -30.0, 0.0];
    // A finer ideal frame without rays, whose disocclusion counts with its silhouettes, would do as well.
    oblique.quality.silhouettes = Silhouettes::Rays;
    let over_hills =
        sequence(oblique, flight(120.0), Scene { terrain: Some(hills(257, 20.0)), ..Scene::default() });
    let of_hills = plan(&over_hills);
    assert!(of_hills.motion.parallax_px > 0.5 && of_hills.keys.len() == 1, "{of_hills}");
    assert!(of_hills.predicted.disocclusion.is_some(), "{of_hills}");
    // A plane hides nothing, and disocclusion is not looked for.
    let flat = plan(&sequence(camera(400.0, 0.0), flight(50.0), plane(4000.0)));
    assert!(flat.keys.len() == 1 && flat.predicted.disocclusion.is_none(), "{flat}");
    assert!(flat.skipped.iter().any(|skip| skip.what == "second ideal frame"), "{flat}");
}

#[test]
fn a_tighter_tolerance_takes_a_second_ideal_frame_earlier() {
    let mut camera = camera(100.0, 0.0);
    // A finer ideal frame has wider strips.
    camera.quality.ideal_scale = Auto::Value(1.0);
    let over_town = sequence(camera, flight(80.0), town());
    let keys = |max_error_dn: f64| {
        plan(&with(&over_town, |scenario| scenario.quality.max_error_dn = max_error_dn)).keys.len()
    };
    assert_eq!([1.0, 0.1].map(keys), [1, 2]);
    // What is said is what is compared.
    let loose = plan(&over_town);
    let error_dn = loose.predicted.disocclusion.unwrap().error_dn;
    assert_eq!([1.9, 2.1].map(|times| keys(times * error_dn)), [2, 1]);
    let reason = loose.skipped.iter().find(|skip| skip.what == "second ideal frame").unwrap();
    assert!(reason.reason.contains(&format!("{error_dn:.2}/255")), "{reason:?}");
}
