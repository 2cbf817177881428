//! The paper preset against its twins.

use std::sync::Arc;

use camsim_core::{
    lens::paper::gauss_newton,
    reference::ReferenceRenderer,
    scenario::{Auto, LensModel, LensSpec, Preset},
    scene::srgb_from_linear,
    temporal::{
        ColorImage, InverseDepthImage,
        displacement::{RK2_STEP_DEG, rk2},
        paper::{gather_straight, linear_fog},
    },
};
use camsim_plan::{RayStage, TemporalStage};
use glam::{DVec2, DVec3};

use super::scenes::{Case, EAST, TURN, ground, rolling, scenario, sequence, steady};
use crate::general::RowTable;

#[test]
fn the_paper_preset_agrees_with_its_twins() {
    let mut paper = scenario();
    paper.camera.focal_px = [23.0, 23.0];
    paper.camera.lens = LensSpec {
        model: LensModel::BrownConrady,
        coefficients: vec![-0.390_024, 0.111_124, -0.001_274_4, -0.008_151_7, -0.008_427_63],
    };
    paper.quality.preset = Preset::Paper;
    paper.quality.blur_samples = Auto::Value(12);
    for (exposure_ms, fog_m) in [(100.0, Some(900.0)), (100.0, None), (0.0, Some(900.0))] {
        paper.camera.shutter = rolling(33.0, exposure_ms);
        let mut scene = ground(2000.0);
        scene.fog_visibility_m = fog_m;
        let mut case = Case::new(sequence(paper.clone(), steady(200.0, EAST, TURN), scene.clone()));
        // The ideal frame of the paper has no fog of its own.
        let clear = sequence(paper.clone(), steady(200.0, EAST, TURN), ground(2000.0));
        case.reference = ReferenceRenderer::new(Arc::new(clear)).unwrap();
        let plan = &case.plan;
        assert_eq!((plan.ray, plan.temporal), (RayStage::GaussNewton, TemporalStage::Rk2));
        let ideal = case.ideal();
        let size_px = plan.ideal.size_px;
        let color = ColorImage { size_px, rgba: &ideal[0].color_rgba };
        let depth = InverseDepthImage { size_px, values: &ideal[0].inverse_depth };
        let RowTable::Times(times) = RowTable::new(plan, &case.sequence.path) else { panic!("times") };
        let sky = DVec3::from_array(scene.sky_linear.map(|v| f64::from(srgb_from_linear(v))));
        let (picture, truth) = case.render_from(&ideal, 0.5);
        let (mut shown, mut foggy) = (0, 0);
        for (i, [x, y]) in case.pixels() {
            let camera = &plan.camera;
            let distorted = camera.distorted_from_pixel(DVec2::new(x.into(), y.into()));
            let source = |uv: DVec2, node: u32| {
                let w = depth.nearest(plan.ideal.px_from_point(uv.extend(1.0)));
                let dt_s = f64::from(times.dt_s[(y * times.stride + node) as usize]);
                let moved = rk2(uv, w, &plan.key_twist, dt_s, RK2_STEP_DEG.to_radians());
                plan.ideal.px_from_point(moved.extend(1.0))
            };
            let ends = [0, if plan.blur.is_some() { 1 } else { 0 }];
            let seen = gauss_newton(&camera.lens, distorted, camera.size_px)
                .map(|uv| (uv, ends.map(|node| source(uv, node))))
                .filter(|(_, ends_px)| ends_px.iter().all(|&end| plan.ideal.contains(end)));
            let found = &picture[4 * i..4 * i + 4];
            let Some((uv, ends_px)) = seen else {
                assert_eq!(found, [0.0; 4], "({x}, {y})");
                continue;
            };
            let mean = match plan.blur {
                Some(_) => {
                    // Sources up to half a pixel outside of the middles of border pixels.
                    let last = DVec2::new(size_px[0].into(), size_px[1].into()) - 1.0;
                    gather_straight(ends_px.map(|end| end.clamp(DVec2::ZERO, last)), 12, &color)
                }
                None => color.sample(ends_px[0]),
            };
            let own = depth.nearest(plan.ideal.px_from_point(uv.extend(1.0)));
            let expected = fog_m.map_or(mean, |end_m| linear_fog(mean, sky, uv, own, end_m));
            foggy += u32::from(expected != mean);
            for channel in 0..3 {
                let stored = f64::from(srgb_from_linear(found[channel]));
                assert!((stored - expected[channel]).abs() < 1e-5, "({x}, {y}): {stored} {expected}");
            }
            let source_px = DVec2::from_array(truth[i].source_px.map(f64::from));
            assert!(source_px.distance(ends_px[1]) < 1e-4, "({x}, {y}): {source_px} {ends_px:?}");
            shown += 1;
        }
        assert!(shown > 1000 && shown < 48 * 36, "{shown}");
        assert_eq!(foggy > 1000, fog_m.is_some());
    }
}
