//! Input that no flight has: no panic, and an answer that makes sense or none.

use std::sync::Arc;

use camsim_core::{
    reference::{ReferenceRenderer, RenderOptions, coord_errors},
    scenario::{Channel, LensModel, LensSpec, ZoomSpec},
    scene::{Mesh, Scene, Terrain},
};
use camsim_plan::Planner;
use glam::{DVec2, DVec3};

use crate::fixtures::{Steady, checker, folding, hills, plane, rolling, scenario, sequence, town};

fn reference(scene: Scene) -> ReferenceRenderer {
    ReferenceRenderer::new(sequence(scenario(), Steady::standing(DVec3::new(0.0, 0.0, -100.0)), scene))
        .unwrap()
}

#[test]
fn rays_that_are_no_rays_meet_nothing() {
    let reference = reference(Scene { terrain: Some(hills(50, 10.0)), ..town(5) });
    let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, 1e300, -1e300, f64::MIN_POSITIVE, 5e-324];
    for x in bad {
        for y in bad {
            for z in bad {
                let (p, d) = (DVec3::new(x, y, z), DVec3::new(z, x, y));
                for hit in [
                    reference.cast(p, d),
                    reference.cast(p, DVec3::Z),
                    reference.cast(DVec3::new(0.0, 0.0, -100.0), d),
                ]
                .into_iter()
                .flatten()
                {
                    assert!(hit.depth_m > 0.0 && hit.point_ned_m.is_finite(), "{p} {d} {hit:?}");
                }
                let _ = reference.is_occluded(p, d);
                let _ = reference.sample(0, [3, 4], DVec2::new(x, y), z);
            }
        }
    }
    assert_eq!(reference.cast(DVec3::new(0.0, 0.0, -100.0), DVec3::ZERO), None);
}

/// Rays in the planes of cells, along edges and diagonals, within the surface itself.
#[test]
fn rays_parallel_to_cells_are_sane() {
    let flat = Terrain::from_heights(41, 41, 10.0, &[0.0; 41 * 41], Some(checker(8))).unwrap();
    let reference = reference(Scene { terrain: Some(flat), ..Scene::default() });
    for direction in [DVec3::X, DVec3::Y, -DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0, 0.3, 0.0)] {
        // Above the surface nothing is met; in it, nothing that is behind the eye.
        assert_eq!(reference.cast(DVec3::new(5.0, 5.0, -1.0), direction), None);
        assert!(reference.cast(DVec3::new(5.0, 5.0, 0.0), direction).is_none_or(|hit| hit.depth_m > 0.0));
        let grazing =
            reference.cast(DVec3::new(0.0, 0.0, -1e-6), direction + DVec3::new(0.0, 0.0, 1e-7)).unwrap();
        assert!((grazing.depth_m - 10.0).abs() < 1e-6 && grazing.point_ned_m.z.abs() < 1e-12, "{grazing:?}");
    }
}

#[test]
fn cameras_inside_and_below_see_surfaces_from_behind() {
    let mut scene = plane(1000.0);
    scene.terrain = Some(hills(60, 10.0));
    let under = reference(scene);
    // From below upwards: the terrain's underside; downwards: nothing.
    let below = DVec3::new(3.0, 4.0, 300.0);
    assert!(
        under
            .cast(below, -DVec3::Z)
            .is_some_and(|hit| (hit.point_ned_m.z - 300.0 + hit.depth_m).abs() < 1e-9)
    );
    assert_eq!(under.cast(below, DVec3::Z), None);
    // In a closed box every path out is a wall.
    let boxed = reference(town(1));
    let middle =
        boxed.cast(DVec3::new(-320.0 + 1.0, 174.427_191 + 1.0, -500.0), DVec3::Z).unwrap().point_ned_m
            + 1.0 * DVec3::Z;
    for k in 0..50 {
        let turn = f64::from(k) * 2.399_963;
        assert!(boxed.cast(middle, DVec3::new(turn.cos(), turn.sin(), 0.02 * f64::from(k) - 0.5)).is_some());
    }
}

#[test]
fn voids_let_rays_through() {
    let mut heights = vec![0.0; 100];
    heights[44] = f64::NAN;
    let terrain = Terrain::from_heights(10, 10, 10.0, &heights, Some(checker(8))).unwrap();
    // Vertex (4, 4) of 10 x 10 lies at north 5, east -5.
    let reference = reference(Scene { terrain: Some(terrain), ..Scene::default() });
    assert_eq!(reference.cast(DVec3::new(5.0, -5.0, -50.0), DVec3::Z), None);
    assert!(reference.cast(DVec3::new(30.0, 30.0, -50.0), DVec3::Z).is_some());
}

/// A hundred kilometres away a ray still meets a plane to a hundredth of a micrometre, and pixels are as
/// sharp.
#[test]
fn far_from_the_origin_nothing_is_lost() {
    let there = DVec3::new(1e5, -1e5, 0.0);
    let mut scene = plane(1.0);
    scene.meshes[0] = Mesh::level_picture(checker(8), there, 2000.0);
    let motion =
        Steady { position_ned_m: there + Steady::moving(100.0).position_ned_m, ..Steady::moving(100.0) };
    let reference = ReferenceRenderer::new(sequence(scenario(), motion, scene)).unwrap();
    for [x, y] in [[0, 0], [320, 240], [639, 479]] {
        let look = reference.sample(0, [x, y], DVec2::ZERO, 0.0).unwrap();
        let seen =
            look.pose.ned_from_camera.inverse() * (look.hit.unwrap().point_ned_m - look.pose.position_ned_m);
        assert!((DVec2::new(seen.x, seen.y) / seen.z - look.uv).length() * 500.0 < 1e-6);
    }
}

#[test]
fn any_instant_has_an_answer() {
    let mut late = scenario();
    late.camera.shutter = rolling(5.0);
    late.camera.size_px = [16, 12];
    let mut sequence =
        camsim_core::sequence::Sequence::clone(&sequence(late, Steady::moving(100.0), plane(500.0)));
    for start_s in [1e9, -1e9, f64::NAN, f64::INFINITY, 1e300] {
        sequence.start_s = start_s;
        let reference = ReferenceRenderer::new(Arc::new(sequence.clone())).unwrap();
        let options = RenderOptions {
            channels: vec![Channel::Depth, Channel::Coords],
            max_samples: 32,
            ..RenderOptions::default()
        };
        for frame in [0, u64::MAX] {
            let rendered = reference.render(frame, &options);
            assert_eq!(rendered.color_rgba().len(), 4 * 16 * 12);
            assert!(rendered.color_rgba().iter().all(|value| value.is_finite()), "{start_s} {frame}");
            assert!(
                rendered.depth_m().unwrap().iter().all(|depth| depth.is_finite() && *depth >= 0.0),
                "{start_s} {frame}"
            );
        }
    }
}

#[test]
fn lenses_that_fold_or_burst_show_their_branch_only() {
    let lens = |coefficients: &[f64]| LensSpec {
        model: LensModel::BrownConrady,
        coefficients: coefficients.to_vec(),
    };
    let fisheye = |coefficients: &[f64]| LensSpec {
        model: LensModel::KannalaBrandt,
        coefficients: coefficients.to_vec(),
    };
    for spec in [
        folding(),
        lens(&[-1.0, 0.455]),
        lens(&[0.0, 0.0, 0.1, 0.1]),
        lens(&[0.1, 0.0, 0.0, 0.0, 0.0, -2.0]),
        lens(&[-50.0]),
        lens(&[1e9]),
        fisheye(&[-0.3]),
        fisheye(&[9.0]),
        fisheye(&[-0.013, 0.02, -0.015, 0.003]),
    ] {
        let mut scenario = scenario();
        scenario.camera.lens = spec.clone();
        scenario.camera.focal_px = [250.0, 250.0];
        let reference = ReferenceRenderer::new(sequence(
            scenario.clone(),
            Steady::standing(DVec3::new(0.0, 0.0, -100.0)),
            plane(1e5),
        ))
        .unwrap();
        let camera = camsim_core::camera::CameraModel::from_spec(&scenario.camera).unwrap();
        let (mut differ, mut seen) = (0, 0);
        for y in (0..480).step_by(8) {
            for x in (0..640).step_by(8) {
                let px = DVec2::new(f64::from(x), f64::from(y));
                let found = reference.sample(0, [x, y], DVec2::ZERO, 0.0).map(|look| look.uv);
                if let Some(uv) = found {
                    seen += 1;
                    assert!((camera.project(uv) - px).length() < 1e-6, "{spec:?} {px}");
                }
                // Another solver of the same equations: the two may only differ on the very border, where the
                // root is double.
                let same = match (found, camera.unproject(px)) {
                    (Some(a), Some(b)) => a.distance(b) < 1e-4,
                    (None, None) => true,
                    _ => false,
                };
                differ += i32::from(!same);
            }
        }
        eprintln!("{spec:?}: {seen} of 4800 seen, {differ} not as by the renderer's inverse");
        assert!(differ <= 2, "{spec:?}: {differ}");
    }
}

#[test]
fn a_zoom_lens_is_that_of_its_frame() {
    let mut scenario = scenario();
    let entry = |at, focal, k1| ZoomSpec {
        at,
        focal_px: [focal; 2],
        principal_point_px: None,
        coefficients: vec![k1],
    };
    scenario.camera.lens = LensSpec { model: LensModel::BrownConrady, coefficients: vec![] };
    scenario.camera.zoom = vec![entry(1.0, 300.0, -0.06), entry(2.0, 600.0, -0.03)];
    let mut sequence = camsim_core::sequence::Sequence::clone(&sequence(
        scenario,
        Steady::standing(DVec3::new(0.0, 0.0, -100.0)),
        plane(1e4),
    ));
    sequence.zoom_track = vec![(0.0, 1.0), (1.0, 2.0)];
    let reference = ReferenceRenderer::new(Arc::new(sequence.clone())).unwrap();
    for (frame, focal, k1) in [(0, 300.0, -0.06), (15, 450.0, -0.045), (60, 600.0, -0.03)] {
        let uv = reference.sample(frame, [600, 400], DVec2::ZERO, 0.0).unwrap().uv;
        let image = uv * (1.0 + k1 * uv.length_squared()) * focal + DVec2::new(319.5, 239.5);
        assert!((image - DVec2::new(600.0, 400.0)).length() < 1e-9, "{frame}: {image}");
    }
    sequence.zoom_track[1].1 = f64::NAN;
    assert!(ReferenceRenderer::new(Arc::new(sequence)).is_err());
}

/// What is not a number in a frame is an infinite error, never a small one; frames of another shape are not
/// compared.
#[test]
fn measuring_hides_nothing() {
    let mut small = scenario();
    small.camera.size_px = [20, 15];
    let sequence = sequence(small, Steady::moving(100.0), plane(2000.0));
    let reference = ReferenceRenderer::new(sequence.clone()).unwrap();
    let plan = Planner::new(sequence, &[Channel::Coords], 4096).unwrap().plan(0).unwrap();
    let key = Some(camsim_core::reference::IdealView { pose: plan.key_pose, ideal: plan.ideal });
    let mut frame = reference
        .render(0, &RenderOptions { channels: vec![Channel::Coords], key, ..RenderOptions::default() });
    let own = coord_errors(&reference, plan.frame, &plan.ideal_view(), &frame, 0.0, 1).unwrap();
    assert!(own.all.max_px < 2e-5 && own.all.count == 300, "{own:?}");
    frame.floats_mut(Channel::Coords).unwrap()[7 * 8 + 2] = f32::NAN;
    frame.color_rgba_mut()[4 * 9 + 3] = 0.0;
    let broken = coord_errors(&reference, plan.frame, &plan.ideal_view(), &frame, 0.0, 1).unwrap();
    assert_eq!((broken.all.max_px, broken.missing, broken.all.count), (f64::INFINITY, 1, 299));
    frame.size_px = [15, 20];
    assert_eq!(coord_errors(&reference, plan.frame, &plan.ideal_view(), &frame, 0.0, 1), None);
}
