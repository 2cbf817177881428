//! Pixels that see several surfaces against the reference.

use std::sync::Arc;

use camsim_core::{
    reference::{self, coord_errors, disocclusion},
    scenario::{Auto, Channel, FieldOr, Readout, Scenario, ShutterSpec, Silhouettes, Solver},
    scene::SceneBatches,
    temporal::{silhouette_rays::first_surface_of_keys, supersampled::PixelCentre},
};
use camsim_plan::{
    EdgeStage, TemporalStage,
    placement::{cpu_draws, cpu_vectorises},
    uniforms::{Truth, frame_uniforms},
};
use glam::{DVec2, DVec3};

use super::scenes::{
    Case, EAST, HEADING_RAD, TURN, barrel_lens, ground_and_roof, rms_dn, rolling, scenario, sequence, steady,
    wall,
};
use crate::{
    CpuRenderer, ReverseInputs, RowTable,
    fixtures::supersampled::{SilhouetteErrors, SupersampledFrame, with_keys_of_pixel},
    general::{IdealImage, Pixel, ReversePass, rays::Ray},
};

/// With rays of their own at silhouettes.
fn by_rays(readout_ms: f64, exposure_ms: f64, keys: u32) -> Scenario {
    let mut scenario = scenario();
    scenario.camera.shutter = rolling(readout_ms, exposure_ms);
    scenario.quality.silhouettes = Silhouettes::Rays;
    scenario.quality.key_frames = Auto::Value(keys);
    scenario
}

fn over_roof(scenario: Scenario, rate: DVec3) -> Case {
    Case::with_channels(
        sequence(scenario, steady(120.0, EAST, rate), ground_and_roof(900.0, 60.0, 15.0)),
        &[Channel::Color],
    )
}

/// RMS difference from the reference near silhouettes, DN.
fn near_silhouettes_dn(case: &Case, ideal: &[IdealImage], expected: &[f32]) -> f64 {
    let near = reference::silhouettes(&case.reference, 0, &[-0.5, 0.0, 0.5]);
    assert!(near.iter().filter(|&&near| near).count() > 200);
    rms_dn(&case.render_from(ideal, 0.0).0, expected, |i| near[i])
}

#[test]
fn rays_give_each_surface_its_fraction_of_area_and_exposure() {
    for (exposure_ms, most_dn) in [(0.0, 4.0), (100.0, 4.0)] {
        let mut case = over_roof(by_rays(40.0, exposure_ms, 1), TURN);
        assert!(case.plan.edges.has_rays(), "{:?}", case.plan.edges);
        let (ideal, expected) = (case.ideal(), case.expected());
        let rays_dn = near_silhouettes_dn(&case, &ideal, &expected);
        let edges = case.plan.edges;
        case.plan.edges = EdgeStage::None;
        let plain: Vec<_> = ideal.iter().map(|image| IdealImage { fine: None, ..image.clone() }).collect();
        let plain_dn = near_silhouettes_dn(&case, &plain, &expected);
        eprintln!("{exposure_ms} ms, {edges:?}: {rays_dn:.2} DN by rays, {plain_dn:.2} DN without");
        assert!(rays_dn < most_dn && plain_dn > 2.0 * rays_dn, "{rays_dn} {plain_dn}");
    }
}

impl ReversePass<'_> {
    /// The key frame that shows what a ray of a pixel meets.
    fn key_of_ray(&self, position: [u32; 2], uv: DVec2, fraction: f64) -> Option<usize> {
        let pixel = Pixel {
            position,
            ray: Ray { uv, ..Ray::default() },
            key: 0,
            exposure: self.rows.exposure(0, position),
        };
        let (image, _) = self.first_surface_of_keys(&pixel, uv, fraction)?;
        self.keys.iter().position(|key| key.silhouettes.as_ref().is_some_and(|of| std::ptr::eq(of, image)))
    }
}

#[test]
fn rays_through_key_frames_agree_with_their_twin() {
    // With one fine pixel a pixel colours are those of the pixels' middles, with more those of the samples.
    for (keys, scale, thin) in [(1, 3, true), (1, 1, false), (2, 2, false)] {
        let mut scenario = by_rays(300.0, 60.0, keys);
        if keys > 1 {
            // Key frames far apart, and instants of columns, fields and exposure between them.
            let interlace_ms = FieldOr::Ms(300.0);
            let readout = Readout::LeftToRight;
            scenario.camera.shutter = ShutterSpec { readout, interlace_ms, ..rolling(900.0, 400.0) };
        }
        let mut case = over_roof(scenario, 0.2 * TURN);
        let samples = 64;
        case.plan.edges = EdgeStage::Supersampled { scale, samples, thin };
        assert_eq!(case.plan.keys.len(), keys as usize);
        let ideal = case.ideal();
        let plan = &case.plan;
        let frames: Vec<SupersampledFrame> = (0..ideal.len())
            .map(|number| {
                SupersampledFrame::new(plan.ideal.size_px, scale, thin, |position_px| {
                    let (inverse_depth, color) = case.ideal_pixel(number, position_px);
                    PixelCentre { inverse_depth, color }
                })
            })
            .collect();
        let picture = case.render_from(&ideal, 0.0).0;
        let near = reference::silhouettes(&case.reference, 0, &[-0.5, 0.0, 0.5]);
        let mut errors = SilhouetteErrors::default();
        let (mut other_key, mut later_keys) = (0, 0);
        case.with_pass(&ideal, |pass| {
            for (i, pixel) in case.pixels().filter(|(i, _)| near[*i]) {
                with_keys_of_pixel(&case.sequence, plan, &frames, 1.0 / 50.0, pixel, |uv, d_uv, keys| {
                    for fraction in [0.05, 0.95] {
                        let (key, _) = first_surface_of_keys(uv, fraction, keys, &plan.ideal).unwrap();
                        let found = pass.key_of_ray(pixel, uv, fraction);
                        other_key += u32::from(found != Some(key));
                        later_keys += key;
                    }
                    errors.add((uv, d_uv), keys, samples, plan, picture[4 * i]);
                });
            }
        });
        let (mean, SilhouetteErrors { compared, differing, .. }) = (errors.mean(), errors);
        eprintln!(
            "{keys} keys, scale {scale}: mean {mean:.1e}, {differing} of {compared} differ by more than a ray"
        );
        assert!(other_key * 50 < compared && (keys == 1 || later_keys > 100), "{other_key} {later_keys}");
        // A pixel whose rays meet one surface is gathered plainly.
        assert!(compared > 200 && mean < 2e-3 && differing * 50 < compared, "{mean} {differing} {compared}");
    }
}

/// The picture and truth of a renderer whose general code draws or makes the frame, or all of it is vectorised.
fn rendered(case: &Case, [casts, is_general]: [bool; 2]) -> (Vec<f32>, Vec<Truth>) {
    let (plan, sequence) = (&case.plan, &case.sequence);
    let mut renderer = CpuRenderer::new(sequence.clone(), Arc::new(SceneBatches::new(&sequence.scene)));
    let tolerance = plan.model_tolerance(&sequence.scenario.quality);
    renderer.set_general_only(casts);
    let buffer = renderer.draw_ideal(plan, &[], &tolerance);
    renderer.set_general_only(is_general);
    let uniforms = frame_uniforms(plan, sequence, 0.0);
    let rows = RowTable::new(plan, &sequence.path);
    let (picture, truth) =
        renderer.reverse(&ReverseInputs { plan, uniforms: &uniforms, rows: &rows }, buffer);
    (picture, truth.unwrap_or_default())
}

#[test]
fn vectorised_frames_with_rays_agree_with_general_ones() {
    for (keys, exposure_ms, scale) in [(1, 100.0, 1), (2, 60.0, 1), (3, 0.0, 2)] {
        let mut scenario = by_rays(if keys == 1 { 60.0 } else { 900.0 }, exposure_ms, keys);
        scenario.camera.lens = barrel_lens();
        scenario.camera.photometric.noise_sigma = 0.01;
        let scene = ground_and_roof(900.0, 60.0, 15.0);
        let mut case = Case::new(sequence(scenario, steady(120.0, EAST, 0.2 * TURN), scene));
        case.plan.edges = EdgeStage::Supersampled { scale, samples: 32, thin: true };
        assert!(cpu_vectorises(&case.plan) && cpu_draws(&case.plan) && case.plan.keys.len() == keys as usize);
        let general = rendered(&case, [true, true]);
        for casts in [true, false] {
            let (picture, truth) = rendered(&case, [casts, false]);
            let dn = rms_dn(&picture, &general.0, |_| true);
            let unknown = |truth: &[Truth]| truth.iter().filter(|truth| truth.depth_m < 0.0).count();
            let [own, other] = [unknown(&truth), unknown(&general.1)];
            let source_px =
                std::iter::zip(&truth, &general.1).filter(|(a, b)| a.depth_m > 0.0 && b.depth_m > 0.0);
            let most_px = source_px.fold(0.0_f32, |most, (a, b)| {
                most.max((a.source_px[0] - b.source_px[0]).hypot(a.source_px[1] - b.source_px[1]))
            });
            eprintln!("{keys} keys, cast {casts}: {dn:.3} DN, {own} and {other} for rays, {most_px:.1e} px");
            // Measured: 0.013 DN and 1.8e-5 px. In rasterised frames corners are rounded to a part of a pixel, which
            // moves borders: 0.017 to 0.157 DN, 3.1e-5 px.
            assert!(dn < if casts { 0.03 } else { 0.3 } && most_px < 1e-3, "{dn} {most_px}");
            assert!(other > 20 && own.abs_diff(other) * 20 < other, "{own} {other}");
        }
    }
}

#[test]
fn a_second_key_frame_shows_what_the_first_does_not_see() {
    let case = |keys: u32| over_roof(by_rays(1500.0, 0.0, keys), DVec3::ZERO);
    let [one, two] = [1, 2].map(|keys| {
        let case = case(keys);
        assert_eq!(case.plan.keys.len(), keys as usize);
        let unseen = disocclusion(&case.reference, 0, &case.plan.key_poses(), &[0.0]).hidden;
        let dn = near_silhouettes_dn(&case, &case.ideal(), &case.expected());
        eprintln!("{keys} keys: {unseen} pixels see what no key sees, {dn:.2} DN at silhouettes");
        (unseen, dn)
    });
    assert!(one.0 > 2 * two.0 + 20, "{one:?} {two:?}");
    assert!(two.1 < 7.0 && one.1 > 2.5 * two.1, "{one:?} {two:?}");
}

#[test]
fn key_frames_of_columns_and_fields_are_those_of_their_instants() {
    for readout in [Readout::LeftToRight, Readout::BottomToTop] {
        let mut scenario = by_rays(600.0, 40.0, 3);
        scenario.camera.shutter.readout = readout;
        scenario.camera.shutter.interlace_ms = FieldOr::Ms(300.0);
        let case = over_roof(scenario, 0.1 * TURN);
        assert_eq!(case.plan.keys.len(), 3);
        let dn = near_silhouettes_dn(&case, &case.ideal(), &case.expected());
        eprintln!("{readout:?}: {dn:.2} DN at silhouettes");
        assert!(dn < 4.0, "{readout:?}: {dn}");
    }
}

#[test]
fn rays_of_constant_twist_see_the_surfaces_too() {
    for solver in [Solver::Linear, Solver::Rk2] {
        let mut scenario = by_rays(200.0, 30.0, 1);
        scenario.camera.mount.angles_deg = [0.0, -90.0, 0.0];
        scenario.quality.solver = Auto::Value(solver);
        let mut sequence = sequence(
            scenario,
            steady(120.0, DVec3::new(3.0, 40.0, 0.0), 0.1 * TURN),
            ground_and_roof(900.0, 60.0, 15.0),
        );
        sequence.scenario.quality.max_error_dn = 0.5;
        let mut case = Case::new(sequence).widened(10);
        assert!(case.plan.edges.has_rays(), "{:?}", case.plan.edges);
        let (ideal, expected) = (case.ideal(), case.expected());
        let rays_dn = near_silhouettes_dn(&case, &ideal, &expected);
        // Coordinates at silhouettes are those of the surface that the pixel's own ray meets.
        let frame = case.frame(&case.render_from(&ideal, 0.0));
        let errors = coord_errors(&case.reference, 0, &case.plan.ideal_view(), &frame, 0.0, 1).unwrap();
        case.plan.edges = EdgeStage::None;
        let plain: Vec<_> = ideal.iter().map(|image| IdealImage { fine: None, ..image.clone() }).collect();
        let plain_dn = near_silhouettes_dn(&case, &plain, &expected);
        eprintln!("{solver:?}: {rays_dn:.2} DN by rays, {plain_dn:.2} DN without, {:?}", errors.silhouettes);
        assert!(rays_dn < 6.0 && plain_dn > 1.5 * rays_dn, "{solver:?}: {rays_dn} {plain_dn}");
        assert!(errors.silhouettes.p99_px < 0.02, "{solver:?}: {errors:?}");
    }
}

#[test]
fn truth_at_silhouettes_is_left_to_rays_and_right_elsewhere() {
    let mut scenario = by_rays(60.0, 150.0, 1);
    scenario.quality.max_error_px = 1e-4;
    let mut case =
        Case::new(sequence(scenario, steady(120.0, EAST, TURN), ground_and_roof(900.0, 60.0, 15.0)));
    case.plan.temporal = TemporalStage::Reproject { iterations: 4 };
    let ideal = case.ideal();
    let view = case.reference.view(0);
    for phase in [0.0, 0.5] {
        let (_, truth) = case.render_from(&ideal, phase);
        let near = reference::silhouettes(&case.reference, 0, &[0.0, phase]);
        let (mut unknown, mut known) = (0, 0);
        for (i, pixel) in case.pixels() {
            if truth[i].depth_m < 0.0 {
                assert!(near[i], "{pixel:?} is far from silhouettes");
                unknown += 1;
                continue;
            }
            let hit = view.sample(pixel, DVec2::ZERO, 0.0).unwrap().hit.unwrap();
            let error = f64::from(truth[i].depth_m) / hit.depth_m - 1.0;
            assert!(error.abs() < 1e-3, "{pixel:?}: {:?} {hit:?}", truth[i]);
            let exact_px = case.plan.ideal_view().source_px(&view.sample(pixel, DVec2::ZERO, phase).unwrap());
            let found_px = DVec2::from_array(truth[i].source_px.map(f64::from));
            assert!(found_px.distance(exact_px) < 0.02, "{pixel:?} at {phase}: {found_px} {exact_px}");
            known += 1;
        }
        assert!(unknown > 20 && known > 1000, "{unknown} {known}");
    }
}

#[test]
fn depths_of_constant_twist_at_silhouettes_are_those_of_their_surface() {
    // Sideways over tilted surfaces, so that depths are constant.
    let mut scenario = by_rays(200.0, 0.0, 1);
    scenario.camera.mount.angles_deg = [0.0, -70.0, 0.0];
    scenario.quality.solver = Auto::Value(Solver::Rk2);
    let velocity = 40.0 * DVec3::new(-HEADING_RAD.sin(), HEADING_RAD.cos(), 0.0);
    let scene = ground_and_roof(900.0, 60.0, 15.0);
    let case = Case::new(sequence(scenario, steady(120.0, velocity, DVec3::ZERO), scene));
    assert!(case.plan.edges.has_rays(), "{:?}", case.plan.edges);
    let (_, truth) = case.render(0.0);
    let near = reference::silhouettes(&case.reference, 0, &[0.0]);
    let view = case.reference.view(0);
    let (mut far_off, mut compared) = (0, 0);
    for (i, pixel) in case.pixels().filter(|(i, _)| near[*i]) {
        let hit = view.sample(pixel, DVec2::ZERO, 0.0).unwrap().hit.unwrap();
        let error = (f64::from(truth[i].depth_m) / hit.depth_m - 1.0).abs();
        far_off += u32::from(error > 1e-5);
        compared += 1;
    }
    eprintln!("{far_off} of {compared} depths are off by more than 1e-5");
    // Beside marks that of a sample stands, up to a tenth of a pixel away.
    assert!(compared > 200 && 5 * far_off < compared, "{far_off} {compared}");
}

/// Past a black wall before a white sky, by pixels of the ideal frame alone.
fn past_a_wall(exposure_ms: f64, channels: &[Channel]) -> Case {
    let mut scenario = scenario();
    scenario.camera.size_px = [100, 75];
    scenario.camera.focal_px = [80.0, 80.0];
    scenario.camera.mount.angles_deg = [2.0, 0.0, -17.0];
    scenario.camera.shutter = rolling(33.0, exposure_ms);
    scenario.quality.solver = Auto::Value(Solver::Reproject);
    scenario.quality.silhouettes = Silhouettes::Plain;
    scenario.quality.ideal_scale = Auto::Value(2.0);
    let velocity = DVec3::new(0.0, 120.0, 0.0);
    Case::with_channels(sequence(scenario, steady(12.0, velocity, DVec3::ZERO), wall()), channels)
}

#[test]
fn the_sky_beside_a_surface_moves_with_it() {
    let mut case = past_a_wall(0.0, &[Channel::Color]);
    let (ideal, expected) = (case.ideal(), case.expected());
    let image_dn = |case: &Case| rms_dn(&case.render_from(&ideal, 0.0).0, &expected, |_| true);
    let with_dn = image_dn(&case);
    case.plan.sky_reach_px = 0.0;
    let without_dn = image_dn(&case);
    eprintln!("{:?}: {with_dn:.2} DN, {without_dn:.2} DN if the sky stays", case.plan.temporal);
    assert!(with_dn < 0.6 * without_dn, "{with_dn} {without_dn}");
}

#[test]
fn coordinates_of_the_sky_are_its_own_whatever_is_beside_it() {
    for (exposure_ms, phase) in [(0.0, 0.0), (6.0, 0.0), (6.0, -0.5)] {
        let case = past_a_wall(exposure_ms, &[Channel::Color, Channel::Coords, Channel::Depth]);
        assert!(case.plan.sky_reach_px > 1.0);
        let (_, truth) = case.render(phase);
        let mut sky = 0;
        for (i, [x, y]) in case.pixels().filter(|(i, _)| truth[*i].depth_m == 0.0) {
            let dt_s = case.plan.shutter.dt_pixel_s(x, y) + phase * case.plan.shutter.exposure_s();
            let pose = case.sequence.path.pose(case.plan.stamp_s + dt_s);
            let (rotation, _) = pose.relative_to(&case.plan.key_pose);
            let uv = DVec2::from_array(truth[i].uv.map(f64::from));
            let exact_px = case.plan.ideal.px_from_point(rotation * uv.extend(1.0));
            let found_px = DVec2::from_array(truth[i].source_px.map(f64::from));
            assert!(found_px.distance(exact_px) < 1e-3, "({x}, {y}): {found_px} {exact_px}");
            assert_eq!(truth[i].point_ned_m, [0.0; 3]);
            sky += 1;
        }
        assert!(sky > 1500, "{sky}");
    }
}

#[test]
fn a_picture_may_have_a_single_pixel() {
    let solvers = [Auto::Auto, Auto::Value(Solver::Linear), Auto::Value(Solver::Rk2)];
    for size_px in [[1, 1], [1, 2], [2, 1], [3, 1]] {
        let mut with_rays = 0;
        for (exposure_ms, solver) in
            [0.0, 10.0].into_iter().flat_map(|exposure_ms| solvers.map(|solver| (exposure_ms, solver)))
        {
            let mut scenario = by_rays(30.0, exposure_ms, 2);
            scenario.camera.size_px = size_px;
            scenario.camera.mount.angles_deg = [0.0, -90.0, 0.0];
            scenario.quality.solver = solver;
            let scene = ground_and_roof(900.0, 60.0, 15.0);
            let case = Case::new(sequence(scenario, steady(120.0, EAST, TURN), scene));
            let picture = case.render(0.0).0;
            let shown = picture.chunks_exact(4).filter(|rgba| rgba[3] == 1.0 && rgba[0] > 0.0).count();
            assert_eq!(shown as u32, size_px[0] * size_px[1], "{size_px:?} {exposure_ms} ms {solver:?}");
            with_rays += u32::from(case.plan.edges.has_rays());
        }
        assert!(with_rays > 0, "{size_px:?}");
    }
}
