//! GPU stages against their CPU twins, on lavapipe, one stage at a time; and the promises about bytes and
//! order.

mod common;

use std::{convert::Infallible, sync::Arc};

use camsim_core::{
    noise::tail_table,
    photometric::{photometric, vignette_weights},
    scenario::{
        Auto, Axis, Channel, LensModel, LensSpec, MountSpec, OutputEncoding, Scenario, ShutterSpec, Solver,
        VibrationSpec, ZoomSpec,
    },
    sequence::{GrayImage, Sequence},
    temporal::{
        ColorImage, Footprint, IdealGeometry, InverseDepthImage, KeyDepth, Source, TapStage, gather,
        reproject, reproject_nodes, reproject_with,
    },
};
use camsim_plan::{BlurStage, NodeDepths, RayStage, TemporalStage, row_poses};
use common::{engine, pattern, render, scenario, sequence, steady};
use glam::{DMat3, DVec2, DVec3};

const EAST: DVec3 = DVec3::new(0.0, 60.0, 0.0);
const TURN: DVec3 = DVec3::new(0.2, -0.3, 0.9);

fn moving_scenario() -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = [200, 150];
    scenario.camera.focal_px = [160.0, 160.0];
    scenario.camera.mount = MountSpec { angles_deg: [8.0, -70.0, 15.0], ..MountSpec::default() };
    scenario.camera.lens =
        LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.3, 0.09, 0.001, -0.002] };
    scenario.camera.shutter = ShutterSpec { readout_ms: 33.0, exposure_ms: 30.0, ..ShutterSpec::default() };
    scenario
}

/// f64 twins need poses in f64: those of the shader's own f32 table.
fn pose_from(entry: [[f32; 4]; 3]) -> (DMat3, DVec3) {
    let row = |i: usize| DVec3::new(f64::from(entry[i][0]), f64::from(entry[i][1]), f64::from(entry[i][2]));
    let shift = DVec3::new(f64::from(entry[0][3]), f64::from(entry[1][3]), f64::from(entry[2][3]));
    (DMat3::from_cols(row(0), row(1), row(2)).transpose(), shift)
}

/// The ideal frame that the last frame was made from, as the twins take it.
struct Ideal {
    geometry: IdealGeometry,
    color: Vec<f32>,
    depth: Vec<f32>,
}

fn render_with_ideal(sequence: &Arc<Sequence>, channels: &[Channel]) -> (camsim_engine::Finished, Ideal) {
    let engine = engine();
    let mut session = engine.session::<Infallible>(sequence.clone(), channels).expect("session");
    let mut found = None;
    session
        .render::<Infallible>([0], &mut |finished| {
            found = Some(finished);
            Ok(())
        })
        .expect("render");
    let (geometry, color, depth) = session.read_ideal().expect("readable").expect("drawn");
    (found.expect("one frame"), Ideal { geometry, color, depth })
}

/// Lens map by central or one-sided differences, as the shader takes them.
fn footprint(
    map: &[[f32; 2]],
    size_px: [u32; 2],
    [x, y]: [u32; 2],
    ideal: &IdealGeometry,
    taps: TapStage,
) -> Footprint {
    let at = |x: u32, y: u32| {
        let uv = map[(y * size_px[0] + x) as usize];
        (uv[0] < 1e29).then(|| DVec2::new(f64::from(uv[0]), f64::from(uv[1])))
    };
    let difference = |before: Option<DVec2>, centre: DVec2, after: Option<DVec2>| match (before, after) {
        (Some(before), Some(after)) => 0.5 * (after - before),
        (None, Some(after)) => after - centre,
        (Some(before), None) => centre - before,
        (None, None) => DVec2::ZERO,
    };
    let centre = at(x, y).expect("a valid pixel");
    let left = if x > 0 { at(x - 1, y) } else { None };
    let right = if x + 1 < size_px[0] { at(x + 1, y) } else { None };
    let up = if y > 0 { at(x, y - 1) } else { None };
    let down = if y + 1 < size_px[1] { at(x, y + 1) } else { None };
    Footprint::new(
        difference(left, centre, right) * ideal.focal_px,
        difference(up, centre, down) * ideal.focal_px,
        taps,
    )
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn temporal_inverse_and_gather_agree_with_their_twins() {
    // Tolerances that ask for depth at mid-exposure, at its ends, at all three for five nodes, and in each of
    // three.
    let depths = [0.5, 0.001, 1e-5, 3.2e-4].map(|max_error_px| gather_as_its_twin(max_error_px, None).depths);
    assert_eq!(depths, NodeDepths::ALL);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn paths_of_one_two_and_more_polynomials_agree_with_their_twins() {
    let stretches = [5.0, 40.0, 90.0].map(|hz| gather_as_its_twin(0.05, Some(hz)).stretches());
    assert!(stretches[0] == 1 && stretches[1] == 2 && stretches[2] > 2, "{stretches:?}");
}

/// Of a mount that shakes so often.
fn gather_as_its_twin(max_error_px: f64, hz: Option<f64>) -> BlurStage {
    let mut scenario = moving_scenario();
    let shake =
        |hz| VibrationSpec { axis: Axis::Pitch, amplitude_deg: 0.3, amplitude_m: 0.0, hz, phase_deg: 20.0 };
    scenario.camera.mount.vibration = hz.map(shake).into_iter().collect();
    scenario.quality.max_error_px = max_error_px;
    scenario.quality.solver = Auto::Value(Solver::Reproject);
    let sequence = sequence(scenario, steady(120.0, 30.0, EAST, TURN), pattern(6000.0));
    let (done, ideal) = render_with_ideal(&sequence, &[Channel::Color, Channel::Coords, Channel::Depth]);
    let plan = &done.plan;
    let blur = plan.blur.expect("30 ms at 60 m/s blurs");
    assert!(
        plan.ray == RayStage::LensMap
            && matches!(plan.temporal, TemporalStage::Reproject { .. })
            && blur.nodes > 1
    );
    let TemporalStage::Reproject { iterations } = plan.temporal else { unreachable!("asserted above") };
    let size_px = plan.camera.size_px;
    let map = plan.camera.lens_inverse();
    let table = row_poses(plan, &sequence.path);
    let depth = InverseDepthImage { size_px: ideal.geometry.size_px, values: &ideal.depth };
    let key = KeyDepth {
        ideal: &ideal.geometry,
        depth: &depth,
        plane: plan.plane.seen_from(&plan.keys[0].pose),
        sky_reach_px: plan.sky_reach_px,
    };
    let color = ColorImage { size_px: ideal.geometry.size_px, rgba: &ideal.color };
    let coords = done.frame.coords.as_ref().expect("asked for");
    let depths = done.frame.depth_m.as_ref().expect("asked for");
    let (mut worst_px, mut worst_depth, mut differing, mut compared) = (0.0_f64, 0.0_f64, 0, 0);
    for y in 0..size_px[1] {
        for x in 0..size_px[0] {
            let i = (y * size_px[0] + x) as usize;
            let uv = DVec2::new(f64::from(coords[i][0]), f64::from(coords[i][1]));
            let entry = |node: u32| pose_from(table.entries[(y * table.stride + node) as usize]);
            let solve = |node| reproject(uv, entry(node), iterations, &key);
            let Some(Source { position_px: at_px, .. }) = solve(blur.nodes) else { continue };
            // The depth channel is looked up at the source itself.
            let at_source =
                reproject_with(uv, entry(blur.nodes), depth.inverse_depth(at_px), &ideal.geometry);
            let Some(Source { inverse_depth, .. }) = at_source else { continue };
            // Skyline and pattern border: a rounding may pick another texel there.
            if inverse_depth < 1e-4
                || depth.inverse_depth(at_px + 3.0) < 1e-4
                || depth.inverse_depth(at_px - 3.0) < 1e-4
            {
                continue;
            }
            worst_px =
                worst_px.max(at_px.distance(DVec2::new(f64::from(coords[i][2]), f64::from(coords[i][3]))));
            worst_depth = worst_depth.max((f64::from(depths[i]) * inverse_depth - 1.0).abs());
            let poses: Vec<_> = (0..blur.nodes).step_by(blur.stride as usize).map(entry).collect();
            let nodes = reproject_nodes(uv, &poses, entry(blur.nodes), blur.depths, iterations, &key);
            let Some(nodes) =
                nodes.into_iter().map(|node| node.map(|s| s.position_px)).collect::<Option<Vec<_>>>()
            else {
                continue;
            };
            let area = footprint(&map, size_px, [x, y], &ideal.geometry, plan.taps);
            let expected = gather(&nodes, blur.path, &area, &color, blur.samples_per_px, blur.max_samples);
            let found = DVec3::new(
                f64::from(done.frame.color_rgba[4 * i]),
                f64::from(done.frame.color_rgba[4 * i + 1]),
                f64::from(done.frame.color_rgba[4 * i + 2]),
            );
            compared += 1;
            // Where a path length sits on a sample-count boundary, f32 may take one sample more: such pixels
            // differ a little, and are few.
            differing += u32::from((found - expected).abs().max_element() > 1e-3);
            assert!((found - expected).abs().max_element() < 0.02, "({x}, {y}): {found} {expected}");
        }
    }
    eprintln!(
        "{:?}, {} nodes, {} polynomials: temporal {worst_px:.2e} px, depth {worst_depth:.2e}; gather: {differing} of {compared} pixels beyond 1e-3",
        blur.depths,
        blur.solved(),
        blur.stretches()
    );
    assert!(compared > 20_000, "{compared}");
    // f32 of coordinates up to 400 px: 3e-5 px a rounding.
    assert!(worst_px < 5e-4 && worst_depth < 1e-4, "{worst_px:.2e} {worst_depth:.2e}");
    assert!(differing * 100 < compared, "{differing} of {compared}");
    blur
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn photometric_agrees_with_its_twin() {
    for output in [OutputEncoding::Srgb8, OutputEncoding::Luma8] {
        let still = |noise_sigma: f64, light: f64, vignette: Option<GrayImage>| {
            let mut scenario = moving_scenario();
            scenario.camera.shutter = ShutterSpec::default();
            scenario.camera.photometric.noise_sigma = noise_sigma;
            scenario.camera.photometric.light = light;
            scenario.camera.photometric.output = output;
            let mut sequence =
                Arc::unwrap_or_clone(sequence(scenario, steady(300.0, 0.0, EAST, TURN), pattern(6000.0)));
            sequence.vignette = vignette.map(Arc::new);
            Arc::new(sequence)
        };
        let vignette = GrayImage { size_px: [3, 2], values: vec![0.0, 0.3, 0.9, 0.02, 0.6, 1.0] };
        let engine = engine();
        let mut plain_scenario = still(0.0, 1.0, None);
        // The twin takes colour before luminance, so the plain frame keeps its colours.
        Arc::make_mut(&mut plain_scenario).scenario.camera.photometric.output = OutputEncoding::Srgb8;
        let plain = render(&engine, &plain_scenario, &[Channel::Color], 5);
        let full_sequence = still(0.05, 1.3, Some(vignette.clone()));
        let full = render(&engine, &full_sequence, &[Channel::Color], 5);
        let spec = &full_sequence.scenario.camera.photometric;
        let size_px = full.frame.size_px;
        let weights = vignette_weights(&vignette, size_px, spec.vignette_thresholds);
        let table = tail_table();
        let mut black = 0;
        for (i, (plain, full)) in
            plain.frame.color_rgba.chunks_exact(4).zip(full.frame.color_rgba.chunks_exact(4)).enumerate()
        {
            let pixel = [i as u32 % size_px[0], i as u32 / size_px[0]];
            if plain[3] == 0.0 {
                assert_eq!(full, [0.0; 4]);
                continue;
            }
            black += u32::from(weights[i] == 0.0);
            let expected =
                photometric(spec, [plain[0], plain[1], plain[2]], weights[i], pixel, 5, 12, &table);
            for (found, expected) in full.iter().zip(expected) {
                assert!((found - expected).abs() < 2e-6, "{pixel:?}: {found} {expected}");
            }
        }
        assert!(black > 100, "the vignette has a black part");
    }
}

/// Frames 0..5 of a sequence rendered in some order by one session, sorted.
fn frames_in_order(sequence: &Arc<Sequence>, order: &[u64]) -> Vec<camsim_core::frame::RenderedFrame> {
    let engine = engine();
    let mut session =
        engine.session::<Infallible>(sequence.clone(), &[Channel::Color, Channel::Coords]).expect("session");
    let mut frames = Vec::new();
    let mut keep = |finished: camsim_engine::Finished| {
        frames.push(finished.frame);
        Ok(())
    };
    session.render::<Infallible>(order.iter().copied(), &mut keep).expect("render");
    frames.sort_by_key(|frame| frame.index);
    frames
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn bytes_are_the_same_twice_and_in_any_order() {
    let mut fixed = moving_scenario();
    fixed.camera.photometric.noise_sigma = 0.02;
    let mut zooming = fixed.clone();
    let entry = |at: f64, focal_px: f64, k1: f64| ZoomSpec {
        at,
        focal_px: [focal_px; 2],
        principal_point_px: None,
        coefficients: vec![k1, 0.05],
    };
    zooming.camera.zoom = vec![entry(1.0, 160.0, -0.3), entry(2.0, 300.0, -0.1)];
    for (name, scenario) in [("fixed lens", fixed), ("zoom lens", zooming)] {
        let mut sequence =
            Arc::unwrap_or_clone(sequence(scenario, steady(200.0, 30.0, EAST, TURN), pattern(6000.0)));
        sequence.zoom_track = vec![(0.0, 1.0), (0.2, 2.0)];
        let sequence = Arc::new(sequence);
        let bits = |order: &[u64]| {
            let frames = frames_in_order(&sequence, order);
            frames.into_iter().map(|f| (f.color_rgba, f.coords)).collect::<Vec<_>>()
        };
        let forwards = bits(&[0, 1, 2, 3, 4]);
        assert!(forwards == bits(&[3, 0, 4, 2, 1]), "{name}: order must not matter");
        assert!(forwards == bits(&[0, 1, 2, 3, 4]), "{name}: twice must be the same");
        assert!(forwards[0] != forwards[1], "{name}: frames differ");
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_still_camera_without_lens_gives_the_ideal_frame() {
    let mut scenario = moving_scenario();
    scenario.camera.lens = LensSpec::default();
    scenario.quality.footprint_taps = Auto::Auto;
    let sequence = sequence(scenario, steady(300.0, 0.0, DVec3::ZERO, DVec3::ZERO), pattern(6000.0));
    let (done, ideal) = render_with_ideal(&sequence, &[Channel::Color]);
    assert_eq!(done.plan.temporal, TemporalStage::Identity);
    assert!(done.plan.blur.is_none() && done.plan.ray == RayStage::Pinhole);
    let shift = ideal.geometry.principal_px - done.plan.camera.principal_point_px;
    assert_eq!(shift, shift.round(), "pixels of both frames fall together");
    for y in 0..150 {
        for x in 0..200 {
            let at = ((y + shift.y as u32) * ideal.geometry.size_px[0] + x + shift.x as u32) as usize;
            for c in 0..3 {
                let (found, expected) =
                    (done.frame.color_rgba[4 * (y * 200 + x) as usize + c], ideal.color[4 * at + c]);
                assert!((found - expected).abs() < 1e-5, "({x}, {y}): {found} {expected}");
            }
        }
    }
}
