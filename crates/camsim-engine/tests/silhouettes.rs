//! Pixels at silhouettes against rays cast in f64, each at its own instant: what fraction of a pixel's area and
//! exposure each surface has.

mod common;

use camsim_core::{
    reference::ReferenceRenderer,
    scenario::{Auto, Channel, MountSpec, Scenario, ShutterSpec, Silhouettes, Solver},
    scene::{Scene, Terrain},
    temporal::{edge_mask::edge_mask, supersampled::PixelCentre},
    trajectory::Trajectory,
};
use camsim_engine::{Engine, Finished};
use camsim_plan::EdgeStage;
use common::{
    barrel_lens, both_engines, gpu_engine, pattern,
    rays::{assert_silhouettes_of_twin, black_ground_and_roof, expected, linear_psnr},
    render, roof, scenario, sequence, steady,
};
use glam::{DVec2, DVec3};

/// A tolerance that 4 samples a pixel keep at edges of full contrast.
const COARSE_DN: f64 = 8.0;
const EAST: DVec3 = DVec3::new(0.0, 40.0, 0.0);
const TURN: DVec3 = DVec3::new(0.2, -0.3, 0.5);

/// Compares with 36 and with 4 samples a pixel, and prints what one would give. PSNR against full scale 1.
fn check(name: &str, scenario: &Scenario, trajectory: &Trajectory, scene: &Scene, at_least_db: [f64; 2]) {
    for (who, engine) in both_engines() {
        check_by(&engine, &format!("{name}, {who}"), scenario, trajectory, scene, at_least_db);
    }
}

fn check_by(
    engine: &Engine,
    name: &str,
    scenario: &Scenario,
    trajectory: &Trajectory,
    scene: &Scene,
    [at_least_db, four_at_least_db]: [f64; 2],
) {
    let made = |max_error_dn: f64, silhouettes: Silhouettes| {
        let mut scenario = scenario.clone();
        scenario.quality.max_error_dn = max_error_dn;
        scenario.quality.silhouettes = silhouettes;
        let sequence = sequence(scenario, trajectory.clone(), scene.clone());
        (render(engine, &sequence, &[Channel::Color], 0), sequence)
    };
    let (done, sequence) = made(0.5, Silhouettes::Rays);
    let expected = expected(&sequence, &done.plan);
    let psnr = |done: &Finished| linear_psnr(&done.frame, &expected);
    let (found, four, one) = (
        psnr(&done),
        psnr(&made(COARSE_DN, Silhouettes::Rays).0),
        psnr(&made(COARSE_DN, Silhouettes::Plain).0),
    );
    let edges = done.plan.edges;
    eprintln!(
        "{name}: {found:.1} dB over {} pixels at silhouettes ({edges:?}); 4 samples a pixel {four:.1} dB, 1 \
         sample {one:.1} dB",
        expected.len()
    );
    assert!(
        matches!(edges, EdgeStage::Supersampled { .. }) && expected.len() > 500,
        "{name}: {edges:?} {}",
        expected.len()
    );
    assert!(found >= at_least_db && four >= four_at_least_db, "{name}: {found:.1} dB, {four:.1} dB");
}

fn camera() -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = [200, 150];
    scenario.camera.focal_px = [160.0, 160.0];
    scenario.camera.mount = MountSpec { angles_deg: [0.0, -90.0, 0.0], ..MountSpec::default() };
    scenario
}

fn rolling(exposure_ms: f64) -> ShutterSpec {
    ShutterSpec { readout_ms: 33.0, exposure_ms, ..ShutterSpec::default() }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn silhouette_rays_agree_with_their_twin() {
    let mut scenario = camera();
    scenario.camera.size_px = [120, 90];
    scenario.camera.focal_px = [96.0, 96.0];
    scenario.camera.shutter = rolling(15.0);
    scenario.quality.key_frames = Auto::Value(1);
    let sequence = sequence(scenario, steady(120.0, 0.0, EAST, TURN), black_ground_and_roof());
    for (_, engine) in both_engines() {
        assert_silhouettes_of_twin(&sequence, &render(&engine, &sequence, &[Channel::Color], 0));
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn straight_edge_of_full_contrast() {
    let still = steady(120.0, 0.0, DVec3::ZERO, DVec3::ZERO);
    check("still", &camera(), &still, &black_ground_and_roof(), [43.5, 33.0]);
    let mut with_lens = camera();
    with_lens.camera.lens = barrel_lens();
    check("still, lens", &with_lens, &still, &black_ground_and_roof(), [43.5, 34.0]);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn roof_under_a_moving_camera() {
    let mut scenario = camera();
    scenario.camera.shutter = rolling(0.0);
    check(
        "rolling shutter, translation",
        &scenario,
        &steady(120.0, 0.0, EAST, DVec3::ZERO),
        &black_ground_and_roof(),
        [43.5, 33.0],
    );
    scenario.camera.shutter = rolling(15.0);
    check(
        "rolling shutter, blur",
        &scenario,
        &steady(120.0, 0.0, EAST, TURN),
        &black_ground_and_roof(),
        [41.0, 35.3],
    );
    scenario.camera.lens = barrel_lens();
    let mut scene = pattern(600.0);
    scene.meshes.push(roof(60.0, 15.0));
    check(
        "rolling shutter, blur, lens, pattern",
        &scenario,
        &steady(120.0, 0.0, EAST, TURN),
        &scene,
        [45.5, 41.0],
    );
}

/// Ridges from west to east in front of the sky.
fn ridges() -> Scene {
    let heights: Vec<f64> = (0..129 * 129)
        .map(|i| {
            let (column, row) = (f64::from(i % 129), f64::from(i / 129));
            60.0 * (row * 0.35 + 0.4 * (column * 0.11).sin()).sin().abs() + 15.0 * (column * 0.21).cos()
        })
        .collect();
    let texture = pattern(1.0).meshes[0].material.texture.clone();
    Scene {
        terrain: Some(Terrain::from_heights(129, 129, 10.0, &heights, Some(texture)).expect("a terrain")),
        sky_linear: [1.0, 1.0, 1.0],
        ..Scene::default()
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn ridge_depths_belong_to_one_ridge() {
    let mut scenario = camera();
    scenario.quality.max_terrain_error_px = 0.02;
    scenario.camera.size_px = [120, 90];
    scenario.camera.focal_px = [96.0, 96.0];
    scenario.camera.mount.angles_deg = [4.0, -12.0, 0.0];
    scenario.camera.shutter = rolling(10.0);
    let engines = both_engines();
    let cases = [("still", DVec3::ZERO, DVec3::ZERO), ("turning", DVec3::ZERO, TURN), ("flying", EAST, TURN)];
    for (case, (who, engine)) in cases.iter().flat_map(|case| engines.iter().map(move |by| (case, by))) {
        let (name, velocity, turn) = *case;
        let sequence = sequence(scenario.clone(), steady(110.0, 0.0, velocity, turn), ridges());
        let done = render(engine, &sequence, &[Channel::Depth], 0);
        let reference = ReferenceRenderer::new(sequence).expect("a usable camera");
        let view = reference.view(0);
        let depths = done.frame.depth_m().expect("asked for");
        let (mut worst, mut sky) = (0.0_f64, 0);
        for (i, found) in (0..).zip(depths).map(|(i, found)| (i, f64::from(*found))) {
            let hit = view.sample([i % 120, i / 120], DVec2::ZERO, 0.0).and_then(|look| look.hit);
            let true_m = hit.map_or(0.0, |hit| hit.depth_m);
            worst = worst.max((found - true_m).abs() / found.max(true_m).max(1e-9));
            sky += u32::from(hit.is_none());
        }
        eprintln!("{name}, {who}: {:?}, depth off by {worst:.1e} at most", done.plan.temporal);
        // A step is more; a bend within a pixel less than the marks ask for.
        assert!(worst < 0.01 && (1000..9000).contains(&sky), "{name}, {who}: {worst:.1e}, {sky} px of sky");
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn ridges_before_ridges_and_sky() {
    let mut scenario = camera();
    scenario.quality.max_terrain_error_px = 0.02;
    scenario.camera.size_px = [120, 90];
    scenario.camera.focal_px = [96.0, 96.0];
    scenario.camera.mount.angles_deg = [4.0, -12.0, 0.0];
    check("ridges, still", &scenario, &steady(110.0, 0.0, DVec3::ZERO, DVec3::ZERO), &ridges(), [48.0, 35.0]);
    scenario.camera.shutter = rolling(10.0);
    scenario.camera.lens = barrel_lens();
    check(
        "ridges, rolling shutter, blur, lens",
        &scenario,
        &steady(110.0, 0.0, EAST, TURN),
        &ridges(),
        [44.0, 35.4],
    );
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn only_triangles_near_silhouettes_are_multisampled() {
    let mut scenario = camera();
    scenario.camera.size_px = [640, 480];
    scenario.camera.focal_px = [512.0, 512.0];
    scenario.camera.mount.angles_deg = [4.0, -35.0, 0.0];
    scenario.quality.silhouettes = Silhouettes::Rays;
    scenario.quality.max_error_dn = COARSE_DN;
    let sequence = sequence(scenario, steady(110.0, 0.0, DVec3::ZERO, DVec3::ZERO), ridges());
    let engine = gpu_engine();
    let mut session =
        engine.session::<std::convert::Infallible>(sequence, &[Channel::Color]).expect("session");
    let mut all = 0;
    let mut count = |done: Finished| {
        assert!(
            matches!(done.plan.edges, EdgeStage::Supersampled { thin: false, .. }),
            "{:?}",
            done.plan.edges
        );
        all = done.lod.triangles;
        Ok(())
    };
    session.render::<std::convert::Infallible>([0], &mut count).expect("render");
    let near = session.triangles_near_edges().expect("readable").expect("drawn");
    eprintln!("{near} of {all} triangles");
    assert!(near > 0 && 2 * near < all, "{near} of {all}");
}

/// The marks that a frame's colour carries, against the twin's on the depth of the same frame: over tiles,
/// workgroups and the frame's borders.
#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn edge_marks_agree_with_their_twin() {
    let mut scenario = camera();
    scenario.camera.size_px = [313, 241];
    scenario.camera.mount.angles_deg = [4.0, -35.0, 0.0];
    scenario.quality.silhouettes = Silhouettes::Rays;
    scenario.quality.max_error_dn = COARSE_DN;
    let sequence = sequence(scenario, steady(110.0, 0.0, DVec3::ZERO, DVec3::ZERO), ridges());
    let engine = gpu_engine();
    let mut session =
        engine.session::<std::convert::Infallible>(sequence, &[Channel::Color]).expect("session");
    session.render::<std::convert::Infallible>([0], &mut |_| Ok(())).expect("render");
    let (ideal, color, inverse_depth) = session.read_ideal().expect("readable").expect("drawn");
    assert!(ideal.size_px.iter().all(|side| !side.is_multiple_of(16)), "{:?}", ideal.size_px);
    let centres: Vec<_> = inverse_depth
        .iter()
        .map(|&w| PixelCentre { inverse_depth: f64::from(w), color: DVec3::ZERO })
        .collect();
    let expected = edge_mask(ideal.size_px, 1, &centres, &[]);
    let found = color.chunks_exact(4).map(|c| c[3] < 1.0);
    let (mut marked, mut differ) = (0, 0);
    for (expected, found) in expected.into_iter().zip(found) {
        marked += usize::from(expected);
        differ += usize::from(expected != found);
    }
    eprintln!("{marked} of {} pixels are marked, {differ} otherwise than by the twin", inverse_depth.len());
    // Steps that are a threshold's to seven digits.
    assert!(marked > 500 && differ <= 2, "{marked} {differ}");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn surface_that_fills_the_view_has_no_silhouette_rays() {
    let sequence = sequence(camera(), steady(120.0, 0.0, EAST, TURN), pattern(6000.0));
    let done = render(&gpu_engine(), &sequence, &[Channel::Color], 0);
    assert_eq!(done.plan.edges, EdgeStage::None);
    assert!(done.plan.skipped.iter().any(|skip| skip.what == "silhouette rays"));
}

/// Where colours at silhouettes are left as they are depth and coordinates are not, and asking for these
/// changes no colour.
#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn colours_do_not_depend_on_truth_channels() {
    let mut scenario = camera();
    scenario.camera.shutter = rolling(8.0);
    scenario.quality.silhouettes = Silhouettes::Plain;
    let sequence = sequence(scenario, steady(120.0, 0.0, EAST, TURN), black_ground_and_roof());
    let engine = gpu_engine();
    let plain = render(&engine, &sequence, &[Channel::Color], 0);
    let both = render(&engine, &sequence, &[Channel::Color, Channel::Depth], 0);
    assert_eq!(plain.plan.edges, EdgeStage::None);
    assert!(both.plan.edges == EdgeStage::None && both.plan.has_exact_truth());
    assert_eq!((plain.plan.keys.len(), plain.plan.temporal), (both.plan.keys.len(), both.plan.temporal));
    assert!(plain.frame.color_rgba() == both.frame.color_rgba(), "depth changed colours");
    // What each pixel's own ray meets at mid-exposure, pixel by pixel.
    let reference = ReferenceRenderer::new(sequence.clone()).expect("a usable camera");
    let view = reference.view(0);
    let depth_m = both.frame.depth_m().expect("depth");
    let [width, height] = both.frame.size_px;
    let differs = |&(x, y): &(u32, u32)| {
        let expected_m = view
            .sample([x, y], DVec2::ZERO, 0.0)
            .and_then(|look| look.hit)
            .map_or(f64::INFINITY, |hit| hit.depth_m);
        (f64::from(depth_m[(y * width + x) as usize]) / expected_m - 1.0).abs() > 1e-4
    };
    let wrong = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).filter(differs).count();
    assert_eq!(wrong, 0, "pixels with the depth of another surface");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn resolved_depth_belongs_to_one_surface() {
    let mut scenario = camera();
    scenario.quality.silhouettes = Silhouettes::Rays;
    scenario.quality.max_error_dn = COARSE_DN;
    let sequence = sequence(scenario, steady(120.0, 0.0, DVec3::ZERO, DVec3::ZERO), black_ground_and_roof());
    let engine = gpu_engine();
    let mut session =
        engine.session::<std::convert::Infallible>(sequence, &[Channel::Color]).expect("session");
    session.render::<std::convert::Infallible>([0], &mut |_| Ok(())).expect("render");
    let (_, color, inverse_depth) = session.read_ideal().expect("readable").expect("drawn");
    // Level surfaces under a camera that looks straight down: 60 and 120 m, nothing in between.
    for w in &inverse_depth {
        assert!((w * 60.0 - 1.0).abs() < 1e-5 || (w * 120.0 - 1.0).abs() < 1e-5, "{w}");
    }
    // Marked: a line of two or three pixels along the roof's border of 4 * 80 px, corners and the frame's own
    // border apart.
    let marked = color.chunks_exact(4).filter(|c| c[3] < 1.0).count();
    assert!((600..1500).contains(&marked), "{marked}");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn bytes_do_not_depend_on_the_order_of_frames() {
    let mut scenario = camera();
    scenario.camera.shutter = rolling(10.0);
    let sequence = sequence(scenario, steady(120.0, 0.0, EAST, TURN), black_ground_and_roof());
    let engine = gpu_engine();
    let all = |order: [u64; 4]| {
        let mut session =
            engine.session::<std::convert::Infallible>(sequence.clone(), &[Channel::Color]).expect("session");
        let mut frames = Vec::new();
        let mut sink = |done: Finished| {
            frames.push((done.frame.index, done.frame.into_color()));
            Ok(())
        };
        session.render::<std::convert::Infallible>(order, &mut sink).expect("render");
        frames.sort_by_key(|frame| frame.0);
        frames
    };
    assert!(all([0, 1, 2, 3]) == all([2, 0, 3, 1]), "order must not matter");
}

/// A camera of a few pixels, whose fields of view are wide: the roof's border is in all of them.
fn tiny(size_px: [u32; 2], exposure_ms: f64, solver: Auto<Solver>) -> Scenario {
    let mut scenario = camera();
    scenario.camera.size_px = size_px;
    scenario.camera.focal_px = [1.0, 1.0];
    scenario.camera.principal_point_px = size_px.map(|side| 0.5 * f64::from(side - 1)).into();
    scenario.camera.shutter = rolling(exposure_ms);
    scenario.quality.solver = solver;
    scenario
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn single_pixel_frame_is_rendered() {
    let engines = both_engines();
    let moving = (EAST, TURN);
    let forced = [Solver::Linear, Solver::Rk2, Solver::Reproject].map(|solver| (Auto::Value(solver), moving));
    let still = DVec3::ZERO;
    let cases = [(Auto::Auto, (still, still)), (Auto::Auto, (still, TURN)), (Auto::Auto, moving)]
        .into_iter()
        .chain(forced);
    for size_px in [[1, 1], [1, 2], [2, 1], [3, 1]] {
        let mut listed = 0;
        let methods = [Silhouettes::Auto, Silhouettes::Rays];
        let cases = cases
            .clone()
            .flat_map(|case| [(case, 0.0), (case, 10.0)])
            .flat_map(|case| methods.map(|method| (case, method)));
        for (((solver, (velocity, rate)), exposure_ms), method) in cases {
            let mut scenario = tiny(size_px, exposure_ms, solver);
            scenario.quality.silhouettes = method;
            let sequence = sequence(scenario, steady(120.0, 0.0, velocity, rate), black_ground_and_roof());
            for (who, engine) in &engines {
                let done = render(engine, &sequence, &[Channel::Color, Channel::Depth], 0);
                let alpha: Vec<f32> = done.frame.color_rgba().chunks_exact(4).map(|pixel| pixel[3]).collect();
                assert_eq!(
                    alpha,
                    vec![1.0; (size_px[0] * size_px[1]) as usize],
                    "{who} {size_px:?} {exposure_ms} ms {solver:?} {method:?} {velocity} {rate}"
                );
                listed += u32::from(done.plan.edges != EdgeStage::None);
            }
        }
        assert!(listed > 0, "{size_px:?}: no plan lists pixels");
    }
}
