//! Whole frames against the reference.

use camsim_core::{
    reference::coord_errors,
    scenario::{Auto, FieldOr, Readout, Scenario, ShutterSpec, Solver, ZoomSpec},
    sequence::Sequence,
};
use camsim_plan::{RayStage, TemporalStage};
use glam::{DVec2, DVec3};

use super::scenes::{Case, EAST, TURN, barrel_lens, ground, rms_dn, rolling, scenario, sequence, steady};

/// Over ground whose waves are some 15 pixels long.
fn over_ground(scenario: Scenario, velocity: DVec3, rate: DVec3) -> Sequence {
    sequence(scenario, steady(120.0, velocity, rate), ground(900.0))
}

/// Compares colours, sources at several phases, depths and points.
fn check(name: &str, case: &Case, most_px: f64, most_dn: f64) {
    let ideal = case.ideal();
    let expected = case.expected();
    for phase in [0.0, -0.5, 0.3] {
        let made = case.render_from(&ideal, phase);
        let frame = case.frame(&made);
        let errors =
            coord_errors(&case.reference, 0, &case.plan.ideal_view(), &frame, f64::from(phase as f32), 1)
                .unwrap();
        let dn = rms_dn(&made.0, &expected, |_| true);
        eprintln!(
            "{name} at {phase}: {:?}, sources off by {:.1e} px at most, colours {dn:.2} DN",
            case.plan.temporal, errors.all.max_px
        );
        assert!(errors.missing == 0 && errors.falsely_valid == 0 && errors.all.count > 1500, "{errors:?}");
        assert!(errors.all.max_px < most_px, "{name} at {phase}: {errors:?}");
        assert!(dn < most_dn, "{name}: {dn}");
        let view = case.reference.view(0);
        for (i, pixel) in case.pixels() {
            let sample = view.sample(pixel, DVec2::ZERO, 0.0);
            let Some(hit) = sample.and_then(|sample| sample.hit) else { continue };
            let truth = &made.1[i];
            let depth_error = f64::from(truth.depth_m) / hit.depth_m - 1.0;
            let point = DVec3::from_array(truth.point_ned_m.map(f64::from));
            let point_error = point.distance(hit.point_ned_m) / hit.depth_m;
            assert!(depth_error.abs() < 1e-4 && point_error < 1e-4, "{name} {pixel:?}: {truth:?} {hit:?}");
        }
    }
}

#[test]
fn a_still_camera_sees_the_ideal_frame() {
    let case = Case::new(over_ground(scenario(), DVec3::ZERO, DVec3::ZERO));
    assert_eq!((case.plan.temporal, case.plan.ray), (TemporalStage::Identity, RayStage::Pinhole));
    check("still", &case, 1e-3, 0.5);
    let mut with_lens = scenario();
    with_lens.camera.lens = barrel_lens();
    let case = Case::new(over_ground(with_lens, DVec3::ZERO, DVec3::ZERO));
    assert_eq!(case.plan.ray, RayStage::LensMap);
    check("lens", &case, 1e-3, 0.5);
}

#[test]
fn a_turning_camera_needs_no_depth() {
    let mut turning = scenario();
    turning.camera.lens = barrel_lens();
    for exposure_ms in [0.0, 60.0] {
        turning.camera.shutter = rolling(33.0, exposure_ms);
        let case = Case::new(over_ground(turning.clone(), DVec3::ZERO, 3.0 * TURN));
        assert_eq!(case.plan.temporal, TemporalStage::Rotation);
        check("turning", &case, 1e-3, 0.8);
    }
}

#[test]
fn a_moving_camera_is_reprojected_over_tilted_ground() {
    let mut moving = scenario();
    moving.camera.lens = barrel_lens();
    for exposure_ms in [0.0, 150.0] {
        moving.camera.shutter = rolling(60.0, exposure_ms);
        let case = Case::new(over_ground(moving.clone(), EAST, TURN));
        assert!(matches!(case.plan.temporal, TemporalStage::Reproject { .. }));
        check("moving", &case, 1e-3, 0.5);
    }
}

#[test]
fn columns_and_fields_have_their_own_instants() {
    let directions = [Readout::BottomToTop, Readout::LeftToRight, Readout::RightToLeft];
    for readout in directions {
        for interlace_ms in [0.0, 15.0] {
            let mut moving = scenario();
            moving.camera.shutter =
                ShutterSpec { readout, interlace_ms: FieldOr::Ms(interlace_ms), ..rolling(50.0, 80.0) };
            let case = Case::new(over_ground(moving, EAST, TURN));
            check(&format!("{readout:?}, fields {interlace_ms} ms"), &case, 1e-3, 0.5);
        }
    }
}

#[test]
fn a_zoom_lens_has_the_rays_of_its_zoom() {
    let mut zooming = scenario();
    let entry = |at: f64, focal_px: f64, k1: f64| ZoomSpec {
        at,
        focal_px: [focal_px; 2],
        principal_point_px: None,
        coefficients: vec![k1, 0.05],
    };
    zooming.camera.lens = barrel_lens();
    zooming.camera.zoom = vec![entry(1.0, 40.0, -0.3), entry(2.0, 80.0, -0.1)];
    zooming.camera.shutter = rolling(30.0, 80.0);
    let mut sequence = over_ground(zooming, EAST, TURN);
    sequence.zoom_track = vec![(-1.0, 1.0), (1.0, 1.8)];
    let case = Case::new(sequence);
    assert_eq!(case.plan.zoom, Some(1.4));
    check("zoom 1.4", &case, 1e-3, 0.5);
}

#[test]
fn an_ideal_frame_of_another_instant_has_the_coordinates_of_the_middle() {
    let mut moving = scenario();
    moving.camera.shutter = rolling(30.0, 80.0);
    let mut case = Case::new(over_ground(moving, EAST, TURN)).widened(12);
    let TemporalStage::Reproject { iterations } = case.plan.temporal else { panic!("{:?}", case.plan) };
    case.plan.temporal = TemporalStage::Reproject { iterations: iterations + 2 };
    let key = &mut case.plan.keys[0];
    key.t_s += 0.1;
    key.pose = case.sequence.path.pose(key.t_s);
    assert!(case.plan.has_displaced_key());
    check("from 0.1 s later", &case, 1e-3, 0.5);
}

#[test]
fn solvers_of_constant_twist_follow_a_constant_twist() {
    // Straight flight over level ground: constant depth of each ray, so that the linear step is exact, and a
    // turn that is short for Heun's steps.
    let mut moving = scenario();
    moving.camera.mount.angles_deg = [0.0, -90.0, 0.0];
    moving.camera.shutter = rolling(40.0, 60.0);
    for (solver, rate, most_px) in
        [(Solver::Linear, DVec3::ZERO, 1e-4), (Solver::Rk2, TURN, 0.02), (Solver::Linear, TURN, 0.2)]
    {
        moving.quality.solver = Auto::Value(solver);
        let velocity = DVec3::new(3.0, 40.0, 0.0);
        let case = Case::new(over_ground(moving.clone(), velocity, rate)).widened(8);
        let name = format!("{solver:?} {rate}");
        let made = case.render(0.5);
        let view = case.plan.ideal_view();
        let errors = coord_errors(&case.reference, 0, &view, &case.frame(&made), 0.5, 1).unwrap();
        eprintln!("{name}: {:?}, {errors:?}", case.plan.temporal);
        assert!(matches!(case.plan.temporal, TemporalStage::Linear | TemporalStage::Rk2));
        assert!(errors.all.max_px < most_px && errors.missing == 0, "{name}: {errors:?}");
        let dn = rms_dn(&made.0, &case.expected(), |_| true);
        assert!(dn < 0.6, "{name}: {dn}");
        let view = case.reference.view(0);
        for (i, pixel) in case.pixels() {
            let hit = view.sample(pixel, DVec2::ZERO, 0.0).unwrap().hit.unwrap();
            let error = f64::from(made.1[i].depth_m) / hit.depth_m - 1.0;
            assert!(error.abs() < 1e-3, "{name} {pixel:?}: {error}");
        }
    }
}

#[test]
fn positions_outside_of_the_ideal_frame_are_not_shown() {
    let mut case = Case::new(over_ground(scenario(), DVec3::ZERO, DVec3::ZERO));
    let ideal = &mut case.plan.ideal;
    ideal.size_px[0] /= 2;
    let last_px = f64::from(ideal.size_px[0]) - 0.5;
    let ideal = *ideal;
    let (picture, truth) = case.render(0.0);
    let mut shown = 0;
    for (i, [x, y]) in case.pixels() {
        let camera = &case.plan.camera;
        let uv = (DVec2::new(x.into(), y.into()) - camera.principal_point_px) / camera.focal_px;
        let is_inside = ideal.px_from_point(uv.extend(1.0)).x <= last_px;
        assert_eq!(picture[4 * i + 3], if is_inside { 1.0 } else { 0.0 });
        assert!(is_inside || picture[4 * i..4 * i + 4] == [0.0; 4]);
        assert!(is_inside || truth[i] == Default::default());
        shown += usize::from(is_inside);
    }
    assert!(shown > 400 && shown < 48 * 36 - 400, "{shown}");
}

#[test]
fn a_lens_map_has_the_rays_that_the_lens_images_at_its_pixels() {
    let mut bent = scenario();
    bent.camera.size_px = [96, 72];
    // So strong that corners have no ray.
    bent.camera.lens.model = camsim_core::scenario::LensModel::BrownConrady;
    bent.camera.lens.coefficients = vec![-0.39, 0.11, 0.001, -0.002, -0.0084];
    bent.camera.focal_px = [20.0, 20.0];
    let camera = camsim_core::camera::CameraModel::from_spec(&bent.camera).unwrap();
    let map = camera.lens_inverse();
    let mut without = 0;
    for (i, [u, v]) in map.iter().enumerate() {
        if *u > 1e29 {
            without += 1;
            continue;
        }
        let pixel = DVec2::new((i % 96) as f64, (i / 96) as f64);
        let found = camera.project(DVec2::new((*u).into(), (*v).into()));
        assert!(found.distance(pixel) < 1e-4, "{pixel}: {found}");
    }
    assert!(without > 20 && without < 2000, "{without}");
}
