//! Pixels at silhouettes against rays cast in f64, each at its own instant: what share of a pixel's area and exposure each surface has.

mod common;

use std::sync::Arc;

use camsim_core::{
    plan::{EdgeStage, FramePlan},
    scenario::{Channel, LensModel, LensSpec, MountSpec, Scenario, ShutterSpec},
    scene::{Encoding, Mesh, MeshVertex, Scene, Terrain, Texture, Wrap},
    sequence::Sequence,
    temporal::edges::{FineImage, FineSample, gather_edges},
    trajectory::Trajectory,
};
use camsim_gpu::engine::Finished;
use common::{engine, pattern, render, scenario, sequence, steady};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

const EAST: DVec3 = DVec3::new(0.0, 40.0, 0.0);
const TURN: DVec3 = DVec3::new(0.2, -0.3, 0.5);
/// Samples along each side of a pixel, and as many instants, that the reference takes.
const REFERENCE_SIDE: u32 = 16;
/// Distance from a silhouette, pixels, within which pixels are compared.
const NEAR_PX: i64 = 3;

/// Colour and number of the surface that a ray meets first.
fn cast(scene: &Scene, origin: DVec3, direction: DVec3) -> (DVec3, usize) {
    let mut best = (f64::INFINITY, DVec3::from_array(scene.sky_linear.map(f64::from)), 0);
    if let Some((terrain, hit)) =
        scene.terrain.as_ref().and_then(|terrain| Some((terrain, terrain.intersect(origin, direction, f64::INFINITY)?)))
    {
        // Slopes to either side of a ridge are different surfaces where one hides the other.
        best = (hit.t, texel(&terrain.texture, hit.uv), 1 + usize::from(hit.normal_ned.x > 0.0));
    }
    for (i, mesh) in scene.meshes.iter().enumerate() {
        if let Some((t, uv)) = mesh.intersect(origin, direction, best.0) {
            best = (t, texel(&mesh.texture, uv), 10 + i);
        }
    }
    (best.1, best.2)
}

fn texel(texture: &Texture, uv: [f64; 2]) -> DVec3 {
    let [width, height] = texture.size_px;
    let at = DVec2::new(uv[0] * f64::from(width) - 0.5, uv[1] * f64::from(height) - 0.5);
    let base = at.floor();
    let load = |dx: f64, dy: f64| {
        let x = (base.x + dx).clamp(0.0, f64::from(width - 1)) as usize;
        let y = (base.y + dy).clamp(0.0, f64::from(height - 1)) as usize;
        let i = 4 * (y * width as usize + x);
        DVec3::from_array([0, 1, 2].map(|c: usize| f64::from(texture.rgba8[i + c]) / 255.0))
    };
    let t = at - base;
    load(0.0, 0.0).lerp(load(1.0, 0.0), t.x).lerp(load(0.0, 1.0).lerp(load(1.0, 1.0), t.x), t.y)
}

/// The ray of a place on the sensor at an exposure phase in [-0.5, 0.5]; lines keep their own time all over their pixels.
fn cast_at(sequence: &Sequence, plan: &FramePlan, [x, y]: [u32; 2], offset: DVec2, phase: f64) -> Option<(DVec3, usize)> {
    let uv = plan.camera.unproject(DVec2::new(f64::from(x), f64::from(y)) + offset)?;
    let t_s = plan.stamp_s + plan.shutter.dt_pixel_s(x, y) + phase * plan.shutter.exposure_s();
    let pose = sequence.path.pose(t_s);
    Some(cast(&sequence.scene, pose.position_ned_m, pose.ned_from_camera * uv.extend(1.0)))
}

/// Mean over the area and the exposure: every place of a fine grid, each at one of as many instants.
fn reference(sequence: &Sequence, plan: &FramePlan, pixel: [u32; 2]) -> Option<DVec3> {
    let n = REFERENCE_SIDE;
    let mut sum = DVec3::ZERO;
    for i in 0..n * n {
        let offset = (DVec2::new(f64::from(i % n), f64::from(i / n)) + 0.5) / f64::from(n) - 0.5;
        // 101 is prime to 256: neighbours in space are far apart in time.
        let phase = (f64::from(i * 101 % (n * n)) + 0.5) / f64::from(n * n) - 0.5;
        sum += cast_at(sequence, plan, pixel, offset, phase)?.0;
    }
    Some(sum / f64::from(n * n))
}

/// Pixels near silhouettes and their colour by the reference.
fn expected(sequence: &Sequence, plan: &FramePlan) -> Vec<(usize, DVec3)> {
    let [width, height] = plan.camera.size_px.map(i64::from);
    let pixel = |x: i64, y: i64| [x as u32, y as u32];
    let surfaces: Vec<Vec<usize>> = (0..width * height)
        .into_par_iter()
        .map(|i| {
            [-0.5, 0.0, 0.5]
                .iter()
                .filter_map(|&phase| Some(cast_at(sequence, plan, pixel(i % width, i / width), DVec2::ZERO, phase)?.1))
                .collect()
        })
        .collect();
    let near = |x: i64, y: i64| {
        let mut around = (-NEAR_PX..=NEAR_PX).flat_map(|dy| (-NEAR_PX..=NEAR_PX).map(move |dx| (x + dx, y + dy)));
        let first = surfaces[(y * width + x) as usize].first();
        around.any(|(x, y)| surfaces[(y * width + x) as usize].iter().any(|s| Some(s) != first))
    };
    let inner = (NEAR_PX..height - NEAR_PX).flat_map(|y| (NEAR_PX..width - NEAR_PX).map(move |x| (x, y)));
    let chosen: Vec<(i64, i64)> = inner.filter(|&(x, y)| near(x, y)).collect();
    chosen.into_par_iter().filter_map(|(x, y)| Some(((y * width + x) as usize, reference(sequence, plan, pixel(x, y))?))).collect()
}

/// Compares at the default quality, and prints what fewer samples would give. PSNR against full scale 1.
fn check(name: &str, scenario: &Scenario, trajectory: &Trajectory, scene: &Scene, at_least_db: f64) {
    let engine = engine();
    let made = |max_error_dn: f64| {
        let mut scenario = scenario.clone();
        scenario.quality.max_error_dn = max_error_dn;
        let sequence = sequence(scenario, trajectory.clone(), scene.clone());
        (render(&engine, &sequence, &[Channel::Color], 0), sequence)
    };
    let (done, sequence) = made(0.5);
    let expected = expected(&sequence, &done.plan);
    let psnr = |done: &Finished| {
        let error2 = |&(i, expected): &(usize, DVec3)| {
            let found = DVec3::from_array([0, 1, 2].map(|c: usize| f64::from(done.frame.color_rgba[4 * i + c])));
            (found - expected).length_squared() / 3.0
        };
        -10.0 * (expected.iter().map(error2).sum::<f64>() / expected.len() as f64).log10()
    };
    let (found, four, one) = (psnr(&done), psnr(&made(8.0).0), psnr(&made(20.0).0));
    let edges = done.plan.edges;
    eprintln!(
        "{name}: {found:.1} dB over {} pixels at silhouettes ({edges:?}); 4 samples a pixel {four:.1} dB, 1 sample {one:.1} dB",
        expected.len()
    );
    assert!(matches!(edges, EdgeStage::Supersampled { .. }) && expected.len() > 500, "{name}: {edges:?} {}", expected.len());
    assert!(found >= at_least_db, "{name}: {found:.1} dB");
}

/// A level square above the ground, turned by 17 degrees.
fn roof(height_m: f64, half_m: f64) -> Mesh {
    let (sin, cos) = 17_f64.to_radians().sin_cos();
    let corner = |n: f64, e: f64| MeshVertex {
        position_m: [((n * cos - e * sin) * half_m) as f32, ((n * sin + e * cos) * half_m) as f32, 0.0],
        uv: [0.5, 0.5],
    };
    Mesh {
        vertices: vec![corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)],
        indices: vec![0, 1, 2, 0, 2, 3],
        texture: Arc::new(Texture::uniform([255; 4], Encoding::Linear)),
        origin_ned_m: DVec3::new(3.0, -2.0, -height_m),
        wrap: Wrap::Clamp,
    }
}

fn black_ground_and_roof() -> Scene {
    let mut scene = pattern(6000.0);
    scene.meshes[0].texture = Arc::new(Texture::uniform([0, 0, 0, 255], Encoding::Linear));
    scene.meshes.push(roof(60.0, 15.0));
    scene
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

fn lens() -> LensSpec {
    LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.3, 0.09, 0.001, -0.002] }
}

/// The supersampled ideal frame of a plan by rays cast in f64, and its largest inverse depth.
fn fine_samples(sequence: &Sequence, plan: &FramePlan, scale: u32) -> (Vec<FineSample>, f64) {
    let [width, height] = plan.ideal.size_px.map(|side| side * scale);
    let camera_from_ned = plan.key_pose.ned_from_camera.inverse();
    let samples: Vec<FineSample> = (0..width * height)
        .into_par_iter()
        .flat_map_iter(|i| {
            FineImage::SAMPLE_PLACES.map(|place| (DVec2::new(f64::from(i % width), f64::from(i / width)) + place) / f64::from(scale) - 0.5)
        })
        .map(|at_px| {
            let ray = plan.key_pose.ned_from_camera * ((at_px - plan.ideal.principal_px) / plan.ideal.focal_px).extend(1.0);
            let origin = plan.key_pose.position_ned_m;
            let mut hits = sequence
                .scene
                .meshes
                .iter()
                .filter_map(|mesh| mesh.intersect(origin, ray, f64::INFINITY))
                .map(|hit| hit.0)
                .collect::<Vec<_>>();
            hits.sort_by(f64::total_cmp);
            let depth_m = hits.first().map(|&t| (camera_from_ned * (t * ray)).z);
            FineSample { inverse_depth: depth_m.map_or(0.0, |z| 1.0 / z), color: cast(&sequence.scene, origin, ray).0 }
        })
        .collect();
    let nearest = samples.iter().map(|sample| sample.inverse_depth).fold(0.0, f64::max);
    (samples, nearest)
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn rays_at_silhouettes_agree_with_their_twin() {
    let mut scenario = camera();
    scenario.camera.size_px = [120, 90];
    scenario.camera.focal_px = [96.0, 96.0];
    scenario.camera.shutter = rolling(15.0);
    let sequence = sequence(scenario, steady(120.0, 0.0, EAST, TURN), black_ground_and_roof());
    let done = render(&engine(), &sequence, &[Channel::Color], 0);
    let plan = &done.plan;
    let EdgeStage::Supersampled { scale, samples } = plan.edges else { panic!("{:?}", plan.edges) };
    let (fine, nearest) = fine_samples(&sequence, plan, scale);
    let image = FineImage { size_px: plan.ideal.size_px, scale, samples: &fine };
    let nodes = plan.blur.expect("15 ms blur").nodes;
    let d_uv = [DVec2::new(1.0 / plan.camera.focal_px.x, 0.0), DVec2::new(0.0, 1.0 / plan.camera.focal_px.y)];
    let (mut sum, mut differing, mut compared) = (0.0, 0, 0);
    for (i, _) in expected(&sequence, plan) {
        let [x, y] = [i as u32 % 120, i as u32 / 120];
        let uv = (DVec2::new(f64::from(x), f64::from(y)) - plan.camera.principal_point_px) / plan.camera.focal_px;
        let poses: Vec<_> = (0..nodes)
            .map(|node| {
                let phase = f64::from(node) / f64::from(nodes - 1) - 0.5;
                let t_s = plan.stamp_s + plan.shutter.dt_pixel_s(x, y) + phase * plan.shutter.exposure_s();
                sequence.path.pose(t_s).relative_to(&plan.key_pose)
            })
            .collect();
        let twin = gather_edges(uv, d_uv, &poses, samples, 1.02 * nearest, &image, &plan.ideal);
        let error = (twin.x - f64::from(done.frame.color_rgba[4 * i])).abs();
        sum += error;
        compared += 1;
        differing += u32::from(error > 1.5 / f64::from(samples));
    }
    let mean = sum / f64::from(compared);
    eprintln!("twin: mean difference {mean:.1e}, {differing} of {compared} pixels differ by more than one ray");
    // In f32 a ray may round to the next sample; a pixel on the mark's border may be gathered plainly.
    assert!(compared > 300 && mean < 2e-3 && differing * 50 < compared, "{mean:.1e}, {differing} of {compared}");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_straight_edge_of_full_contrast() {
    let still = steady(120.0, 0.0, DVec3::ZERO, DVec3::ZERO);
    check("still", &camera(), &still, &black_ground_and_roof(), 38.0);
    let mut with_lens = camera();
    with_lens.camera.lens = lens();
    check("still, lens", &with_lens, &still, &black_ground_and_roof(), 36.0);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_roof_under_a_moving_camera() {
    let mut scenario = camera();
    scenario.camera.shutter = rolling(0.0);
    check("rolling shutter, translation", &scenario, &steady(120.0, 0.0, EAST, DVec3::ZERO), &black_ground_and_roof(), 37.0);
    scenario.camera.shutter = rolling(15.0);
    check("rolling shutter, blur", &scenario, &steady(120.0, 0.0, EAST, TURN), &black_ground_and_roof(), 35.0);
    scenario.camera.lens = lens();
    let mut scene = pattern(600.0);
    scene.meshes.push(roof(60.0, 15.0));
    check("rolling shutter, blur, lens, pattern", &scenario, &steady(120.0, 0.0, EAST, TURN), &scene, 40.0);
}

/// Ridges from west to east in front of the sky.
fn ridges() -> Scene {
    let heights: Vec<f64> = (0..129 * 129)
        .map(|i| {
            let (column, row) = (f64::from(i % 129), f64::from(i / 129));
            60.0 * (row * 0.35 + 0.4 * (column * 0.11).sin()).sin().abs() + 15.0 * (column * 0.21).cos()
        })
        .collect();
    let texture = pattern(1.0).meshes[0].texture.clone();
    Scene {
        terrain: Some(Terrain::from_heights(129, 129, 10.0, &heights, Some(texture)).expect("a terrain")),
        sky_linear: [1.0, 1.0, 1.0],
        ..Scene::default()
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
    check("ridges, still", &scenario, &steady(110.0, 0.0, DVec3::ZERO, DVec3::ZERO), &ridges(), 38.0);
    scenario.camera.shutter = rolling(10.0);
    scenario.camera.lens = lens();
    check("ridges, rolling shutter, blur, lens", &scenario, &steady(110.0, 0.0, EAST, TURN), &ridges(), 36.0);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_surface_that_fills_the_view_is_not_supersampled() {
    let sequence = sequence(camera(), steady(120.0, 0.0, EAST, TURN), pattern(6000.0));
    let done = render(&engine(), &sequence, &[Channel::Color], 0);
    assert_eq!(done.plan.edges, EdgeStage::None);
    assert!(done.plan.skipped.iter().any(|skip| skip.what == "silhouette supersampling"));
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn resolved_depth_is_that_of_one_surface() {
    let sequence = sequence(camera(), steady(120.0, 0.0, DVec3::ZERO, DVec3::ZERO), black_ground_and_roof());
    let engine = engine();
    let mut session = engine.session::<std::convert::Infallible>(sequence, &[Channel::Color]).expect("session");
    session.render::<std::convert::Infallible>([0], &mut |_| Ok(())).expect("render");
    let (_, color, inverse_depth) = session.read_ideal().expect("readable").expect("drawn");
    // Level surfaces under a camera that looks straight down: 60 and 120 m, nothing in between.
    for w in &inverse_depth {
        assert!((w * 60.0 - 1.0).abs() < 1e-5 || (w * 120.0 - 1.0).abs() < 1e-5, "{w}");
    }
    // Marked: a line of two or three pixels along the roof's border of 4 * 80 px, corners and the frame's own border apart.
    let marked = color.chunks_exact(4).filter(|c| c[3] < 1.0).count();
    assert!((600..1500).contains(&marked), "{marked}");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn bytes_do_not_depend_on_the_order_of_frames() {
    let mut scenario = camera();
    scenario.camera.shutter = rolling(10.0);
    let sequence = sequence(scenario, steady(120.0, 0.0, EAST, TURN), black_ground_and_roof());
    let engine = engine();
    let all = |order: [u64; 4]| {
        let mut session = engine.session::<std::convert::Infallible>(sequence.clone(), &[Channel::Color]).expect("session");
        let mut frames = Vec::new();
        let mut sink = |done: Finished| {
            frames.push((done.frame.index, done.frame.color_rgba));
            Ok(())
        };
        session.render::<std::convert::Infallible>(order, &mut sink).expect("render");
        frames.sort_by_key(|frame| frame.0);
        frames
    };
    assert!(all([0, 1, 2, 3]) == all([2, 0, 3, 1]), "order must not matter");
}
