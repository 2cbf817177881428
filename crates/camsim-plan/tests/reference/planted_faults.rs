//! Faults planted into the renderer's side must be seen by the comparison with the reference; the same without a
//! fault must pass.

use camsim_core::{
    camera::CameraModel,
    frame::{Plane, RenderedFrame},
    reference::{CoordErrors, ReferenceRenderer, coord_errors},
    scenario::{Channel, Scenario},
    sequence::Sequence,
    temporal::{InverseDepthImage, KeyDepth, reproject},
};
use camsim_plan::{FramePlan, Planner};
use glam::{DVec2, DVec3};

use crate::fixtures::{Steady, plane, rolling, scenario, sequence, tangential};

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    None,
    RowTimeSign,
    ForwardShiftSign,
    TangentialSwapped,
}

/// A frame's coordinates by the twins of the renderer's stages, over a plane whose depth in the ideal frame
/// is exact.
fn by_twins(sequence: &Sequence, plan: &FramePlan, fault: Fault) -> RenderedFrame {
    let mut spec = sequence.scenario.camera.clone();
    if fault == Fault::TangentialSwapped {
        spec.lens.coefficients.swap(2, 3);
    }
    let camera = CameraModel::from_spec(&spec).unwrap();
    let normal = plan.key_pose.ned_from_camera.inverse() * glam::DVec3::Z / -plan.key_pose.position_ned_m.z;
    let [width, height] = plan.ideal.size_px;
    let ideal_ray = |i: u32| {
        (DVec2::new(f64::from(i % width), f64::from(i / width)) - plan.ideal.principal_px)
            / plan.ideal.focal_px
    };
    // n . x = 1 in the key camera: inverse depth is n . (x / z).
    let values: Vec<f32> = (0..width * height).map(|i| normal.dot(ideal_ray(i).extend(1.0)) as f32).collect();
    let depth = InverseDepthImage { size_px: plan.ideal.size_px, values: &values };

    let [width, height] = camera.size_px;
    let mut coords = Vec::new();
    let key =
        KeyDepth { ideal: &plan.ideal, depth: &depth, plane: DVec3::ZERO, sky_reach_px: plan.sky_reach_px };
    let mut color_rgba = Vec::new();
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let mut dt_s = plan.shutter.dt_pixel_s(x, y);
        if fault == Fault::RowTimeSign {
            dt_s = -2.0 * plan.shutter.delay_s() - dt_s;
        }
        let (rotation, mut shift) = sequence.path.pose(plan.stamp_s + dt_s).relative_to(&plan.key_pose);
        if fault == Fault::ForwardShiftSign {
            shift.z = -shift.z;
        }
        let source = camera
            .unproject(DVec2::new(f64::from(x), f64::from(y)))
            .and_then(|uv| Some((uv, reproject(uv, (rotation, shift), 6, &key)?.position_px)));
        let (uv, at_px) = source.unwrap_or_default();
        coords.push([uv.x, uv.y, at_px.x, at_px.y, dt_s, 0.0, 0.0, 0.0].map(|value| value as f32));
        color_rgba.extend([0.0, 0.0, 0.0, if source.is_some() { 1.0 } else { 0.0 }]);
    }
    RenderedFrame {
        index: plan.frame,
        size_px: camera.size_px,
        planes: vec![Plane::color(color_rgba), Plane::coords(coords)],
        ..RenderedFrame::default()
    }
}

fn camera() -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = [160, 120];
    scenario.camera.focal_px = [110.0, 110.0];
    scenario.camera.lens = tangential();
    scenario.camera.shutter = rolling(0.0);
    scenario
}

fn errors(fault: Fault) -> CoordErrors {
    let sequence = sequence(camera(), Steady::moving(60.0), plane(20_000.0));
    let plan = Planner::new(sequence.clone(), &[Channel::Coords], 8192).unwrap().plan(0).unwrap();
    let frame = by_twins(&sequence, &plan, fault);
    let reference = ReferenceRenderer::new(sequence).unwrap();
    let errors = coord_errors(&reference, plan.frame, &plan.ideal_view(), &frame, 0.0, 1).unwrap();
    eprintln!("{fault:?}: {errors:?}");
    errors
}

#[test]
fn the_twins_agree_with_the_reference() {
    let errors = errors(Fault::None);
    // Coordinates and depths are stored in f32: half an ulp at 256 px is 1.5e-5.
    assert!(errors.smooth.max_px < 5e-5, "{errors:?}");
    assert_eq!(
        (errors.smooth.count, errors.falsely_valid, errors.missing, errors.silhouettes.count),
        (160 * 120, 0, 0, 0)
    );
}

#[test]
fn planted_faults_are_caught() {
    for fault in [Fault::RowTimeSign, Fault::ForwardShiftSign, Fault::TangentialSwapped] {
        let errors = errors(fault);
        // A thousand times what is there without a fault.
        assert!(errors.all.rms_px > 5e-2, "{fault:?}: {errors:?}");
    }
}
