//! Fewer triangles for what is small: the device with them against the reference, which never has them.
//!
//! What rules it is `quality.max_terrain_error_px`: a quarter of it is how far a model's surface, with its
//! colours, may be displaced in the picture, however fine the ideal frame is.

mod common;

use std::{f64::consts::FRAC_PI_2, sync::Arc};

use camsim_core::{
    pose::CameraPose,
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{Auto, Channel, MountSpec},
    scene::{Encoding, Light, Mesh, MeshVertex, ModelLod, Scene, SceneLods, Shape, Texture, Wrap},
};
use camsim_plan::Planner;
use common::{engine, render, scenario, sequence, steady};
use glam::{DMat3, DVec2, DVec3};

const SIZE_PX: [u32; 2] = [160, 120];
const FOCAL_PX: f64 = 300.0;
const HEIGHT_M: f64 = 600.0;
const RADIUS_M: f64 = 6.0;
/// `quality.max_terrain_error_px`: more than the default, so that what it allows is seen beside all else.
const ALLOWED_PX: f64 = 0.5;

/// A sphere of 3888 triangles, a cube's sides blown up, its colour all around it, with the normals of a
/// sphere or without.
fn ball(normals: bool) -> Shape {
    const N: u32 = 18;
    let side = |k: u32| {
        let turn = match k {
            0..4 => DMat3::from_rotation_z(f64::from(k) * FRAC_PI_2),
            _ => DMat3::from_rotation_y(if k == 4 { FRAC_PI_2 } else { -FRAC_PI_2 }),
        };
        // Even steps of angle make triangles of one size. Rounded, so that sides meet to the bit.
        let step = |i: u32| (FRAC_PI_2 * (f64::from(i) / f64::from(N) - 0.5)).tan();
        let at = move |i: u32, j: u32| {
            ((turn * DVec3::new(1.0, step(i), step(j))).normalize() * 1e6).round() * 1e-6
        };
        (0..=N).flat_map(move |j| (0..=N).map(move |i| at(i, j)))
    };
    let corners: Vec<DVec3> = (0..6).flat_map(side).collect();
    let index = |k: u32, i: u32, j: u32| (k * (N + 1) + j) * (N + 1) + i;
    let cell = |k: u32, i: u32, j: u32| {
        let [a, b, c, d] = [index(k, i, j), index(k, i + 1, j), index(k, i + 1, j + 1), index(k, i, j + 1)];
        [a, b, c, a, c, d]
    };
    let vertex = |corner: &DVec3| MeshVertex {
        position_m: (RADIUS_M * corner).as_vec3().to_array(),
        uv: [0.0; 2],
        tint: (0.5 + 0.45 * corner).as_vec3().extend(1.0).to_array(),
    };
    Shape {
        vertices: corners.iter().map(vertex).collect(),
        indices: (0..6)
            .flat_map(|k| (0..N).flat_map(move |j| (0..N).flat_map(move |i| cell(k, i, j))))
            .collect(),
        normals: if normals {
            corners.iter().map(|corner| corner.as_vec3().to_array()).collect()
        } else {
            Vec::new()
        },
    }
}

/// Many of them below, turned, before the sky.
fn scene(light: Option<Light>) -> Scene {
    let one = Mesh {
        shape: Arc::new(ball(light.is_some())),
        ..Mesh::new(
            vec![],
            vec![],
            Arc::new(Texture::uniform([255; 4], Encoding::Linear)),
            DVec3::ZERO,
            Wrap::Clamp,
        )
    };
    let place = |k: u32| {
        let part = |step: f64| (f64::from(k) * step).fract() - 0.5;
        Mesh {
            origin_ned_m: DVec3::new(200.0 * part(0.618_034), 280.0 * part(0.754_878), 40.0 * part(0.569_84)),
            ned_from_shape: DMat3::from_rotation_z(7.0 * part(0.31))
                * DMat3::from_rotation_x(2.0 * part(0.47)),
            ..one.clone()
        }
    };
    Scene { meshes: (0..40).map(place).collect(), sky_linear: [0.05, 0.1, 0.3], light, ..Scene::default() }
}

/// A frame and what was drawn of the models.
struct Drawn {
    color_rgba: Vec<f32>,
    depth_m: Vec<f32>,
    detail: ModelLod,
    /// Farthest that a level which was drawn is from the full shape, metres; what that is in pixels at the
    /// nearest model, at most.
    error_m: f64,
    error_px: f64,
}

fn draw(scene: &Scene, max_terrain_error_px: f64) -> (Drawn, Drawn) {
    let mut scenario = scenario();
    scenario.camera.size_px = SIZE_PX;
    scenario.camera.focal_px = [FOCAL_PX; 2];
    scenario.camera.mount = MountSpec { angles_deg: [0.0, -90.0, 0.0], ..MountSpec::default() };
    scenario.quality.max_error_dn = 0.5;
    // What else is off must not depend on what silhouettes cost.
    scenario.quality.ideal_scale = Auto::Value(2.0);
    scenario.quality.max_terrain_error_px = max_terrain_error_px;
    let sequence = sequence(scenario, steady(HEIGHT_M, 0.0, DVec3::ZERO, DVec3::ZERO), scene.clone());
    let channels = [Channel::Color, Channel::Depth];
    let done = render(&engine(), &sequence, &channels, 0);
    let (levels, tolerance) = (SceneLods::new(scene), done.plan.model_tolerance(&sequence.scenario.quality));
    let pose: CameraPose = done.plan.key_pose;
    let of_shape = levels.shape_lods(&scene.meshes[0].shape);
    let error_of = |mesh: &Mesh| {
        of_shape.levels()[of_shape.coarsest_within(tolerance.error_m(&mesh.bounds(), &pose))].error_m
    };
    let errors = scene.meshes.iter().map(|mesh| {
        let error_m = error_of(mesh);
        // Of the output picture: the ideal frame may be finer. To the corner of the picture a metre has more
        // pixels by the secant.
        let widest = (1.0 + (100.0 / FOCAL_PX).powi(2)).sqrt();
        (error_m, error_m * FOCAL_PX * widest / (mesh.origin_ned_m.z + HEIGHT_M - RADIUS_M))
    });
    let (error_m, error_px) = errors.fold((0.0_f64, 0.0_f64), |(m, px), of| (m.max(of.0), px.max(of.1)));
    let detail = ModelLod::new(scene, &levels, &pose, &tolerance);
    let device = Drawn {
        depth_m: done.frame.depth_m().expect("depth").to_vec(),
        color_rgba: done.frame.into_color(),
        detail,
        error_m,
        error_px,
    };
    let options =
        RenderOptions { channels: channels.to_vec(), tolerance_dn: 0.5, ..RenderOptions::default() };
    let truth = ReferenceRenderer::new(sequence).expect("a reference").render(0, &options);
    (
        device,
        Drawn {
            depth_m: truth.depth_m().expect("depth").to_vec(),
            color_rgba: truth.into_color(),
            detail,
            error_m: 0.0,
            error_px: 0.0,
        },
    )
}

fn rms(a: &[f32], b: &[f32]) -> f64 {
    (a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
}

/// What a picture changes by, RMS, where what it shows is displaced by so many pixels: by its slopes, which
/// are at most its differences from pixel to pixel across and down.
fn by_displacement(rgba: &[f32], error_px: f64) -> f64 {
    let [width, height] = SIZE_PX.map(|side| side as usize);
    let at = |x: usize, y: usize, c: usize| {
        f64::from(rgba[4 * (y.min(height - 1) * width + x.min(width - 1)) + c])
    };
    let slope2 = |x: usize, y: usize, c: usize| {
        let [across, down] = [
            (at(x + 1, y, c) - at(x, y, c)).abs().max((at(x, y, c) - at(x.saturating_sub(1), y, c)).abs()),
            (at(x, y + 1, c) - at(x, y, c)).abs().max((at(x, y, c) - at(x, y.saturating_sub(1), c)).abs()),
        ];
        across * across + down * down
    };
    let sum: f64 = (0..height)
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .map(|(x, y)| (0..3).map(|c| slope2(x, y, c)).sum::<f64>())
        .sum();
    error_px * (sum / rgba.len() as f64).sqrt()
}

/// How far depths are from those with all triangles where the sphere that a pixel sees is turned by at most
/// 60 degrees, as the reference knows.
fn farthest_depth_m(scene: &Scene, found: &Drawn, full: &Drawn, truth: &Drawn) -> f64 {
    let mut farthest_m = 0.0_f64;
    for (i, truth_m) in truth.depth_m.iter().map(|depth_m| f64::from(*depth_m)).enumerate() {
        let pixel = DVec2::new(f64::from(i as u32 % SIZE_PX[0]), f64::from(i as u32 / SIZE_PX[0]));
        let uv = (pixel - DVec2::new(79.5, 59.5)) / FOCAL_PX;
        // North is up, east is right, and the camera looks down.
        let direction = DVec3::new(-uv.y, uv.x, 1.0);
        let point = DVec3::new(0.0, 0.0, -HEIGHT_M) + truth_m * direction;
        let near =
            scene.meshes.iter().find(|mesh| (point.distance(mesh.origin_ned_m) - RADIUS_M).abs() < 0.1);
        let Some(mesh) = near.filter(|_| truth_m > 0.0) else { continue };
        if (point - mesh.origin_ned_m).normalize().dot(-direction.normalize()) >= 0.5 {
            farthest_m = farthest_m.max(f64::from(found.depth_m[i] - full.depth_m[i]).abs());
        }
    }
    farthest_m
}

fn check(name: &str, light: Option<Light>) {
    let scene = scene(light);
    // As good as everything, and what is allowed.
    let ((full, truth), (some, _)) = (draw(&scene, 1e-4), draw(&scene, ALLOWED_PX));
    assert_eq!((full.detail.triangles, full.error_m), (full.detail.finest_triangles, 0.0), "{name}");
    assert!(
        3 * some.detail.triangles < 2 * some.detail.finest_triangles && some.error_m > 0.0,
        "{name}: {:?}",
        some.detail
    );
    assert!(some.error_px <= 0.25 * ALLOWED_PX, "{name}: {} px", some.error_px);
    // Along a ray a surface that is turned by so much moves by at most four times as much as across itself
    // (as `LodTolerance::error_m` has it). On balls of a few pixels inverse depth bends everywhere, so that
    // rays tell their depth, which know all triangles; the coarser ones show in the picture.
    let apart_m = farthest_depth_m(&scene, &some, &full, &truth);
    assert!(apart_m < 4.0 * some.error_m, "{name}: {apart_m} of {} m", some.error_m);
    // One picture displaced within itself, and colours that are off by their part of a metre's.
    let of_color = some.error_m / (2.0 * RADIUS_M * 3_f64.sqrt());
    let bound = by_displacement(&truth.color_rgba, some.error_px) + of_color;
    let between = rms(&some.color_rgba, &full.color_rgba);
    let [db_full, db_some] =
        [&full, &some].map(|drawn| -20.0 * rms(&drawn.color_rgba, &truth.color_rgba).log10());
    eprintln!(
        "{name}: {} of {} triangles, within {:.4} m or {:.4} px; depth off by {apart_m:.4} m; picture by \
         {:.2}/255 RMS of {:.2}/255; {db_some:.1} dB against the reference, {db_full:.1} dB with all triangles",
        some.detail.triangles,
        some.detail.finest_triangles,
        some.error_m,
        some.error_px,
        255.0 * between,
        255.0 * bound
    );
    assert!(between > 1e-5 && between < bound, "{name}: {between} {bound}");
    assert!(db_some > 50.0, "{name}: {db_some}");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn level_of_detail_is_within_its_bound() {
    check("colours", None);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn level_of_detail_in_light_is_within_its_bound() {
    check("light", Some(Light::new(2.3, 0.6, 0.7, 0.3)));
}

#[test]
fn model_tolerance_is_in_output_pixels() {
    // Pixels twice as high as wide: they bound what is across and what is down alike.
    for (ideal_scale, times) in [(0.5, 1.0), (1.0, 1.0), (2.0, 2.0)] {
        let mut scenario = scenario();
        scenario.camera.size_px = SIZE_PX;
        scenario.camera.focal_px = [FOCAL_PX, 0.5 * FOCAL_PX];
        scenario.quality.ideal_scale = Auto::Value(ideal_scale);
        scenario.quality.max_terrain_error_px = ALLOWED_PX;
        let sequence = sequence(scenario, steady(HEIGHT_M, 0.0, DVec3::ZERO, DVec3::ZERO), scene(None));
        let plan = Planner::new(sequence.clone(), &[Channel::Color], 16_384)
            .expect("a planner")
            .plan(0)
            .expect("a plan");
        let tolerance = plan.model_tolerance(&sequence.scenario.quality);
        assert!(
            (tolerance.focal_px - ideal_scale * FOCAL_PX).abs() < 1e-9,
            "{ideal_scale}: {}",
            tolerance.focal_px
        );
        assert!(
            (tolerance.error_px - times * 0.25 * ALLOWED_PX).abs() < 1e-12,
            "{ideal_scale}: {}",
            tolerance.error_px
        );
    }
}
