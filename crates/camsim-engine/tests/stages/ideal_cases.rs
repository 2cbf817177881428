//! Ideal frames.

use std::{path::Path, sync::Arc};

use camsim_core::{
    reference::ReferenceRenderer,
    scenario::{Auto, MountSpec, Scenario, Silhouettes},
    scene::{Encoding, Light, Mesh, MeshVertex, PrefilterTaps, Scene, Shape, Texture, Wrap},
    sequence::Sequence,
};
use camsim_io::{load::load_sequence, scenario_file::read_scenario};
use camsim_plan::{FramePlan, KeyFrame};
use glam::{DMat3, DQuat, DVec2, DVec3};

use super::{
    cases::{Case, Input, Output},
    common::{
        city,
        fixtures::gallery::{self, key, opaque_scene, planned},
        pattern, scenario, sequence, steady,
    },
    ideal_twin::TwinSource,
    planned_cases::SIZE_PX,
    stage::OtherSurface,
};

/// Of frames of one sample a pixel: where rounding decides at borders of triangles.
const OTHER_SURFACE: OtherSurface = OtherSurface { dn: 8.0, depth: 1e-3 };
/// Of casts beside the rasteriser: the corners of that stand on a grid of 1/256 px.
const OTHER_THAN_RASTER: OtherSurface = OtherSurface { dn: 0.02 * 255.0, depth: 1.99e-3 };

fn camera(pitch_deg: f64) -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = SIZE_PX;
    scenario.camera.focal_px = [150.0, 140.0];
    scenario.camera.mount = MountSpec { angles_deg: [3.0, pitch_deg, 10.0], ..MountSpec::default() };
    scenario.quality.silhouettes = Silhouettes::Plain;
    scenario.quality.ideal_samples = Auto::Value(1);
    scenario
}

fn with(mut scenario: Scenario, change: impl Fn(&mut Scenario)) -> Scenario {
    change(&mut scenario);
    scenario
}

fn scale(scale: f64) -> impl Fn(&mut Scenario) {
    move |scenario| scenario.quality.ideal_scale = Auto::Value(scale)
}

fn finest(scenario: &mut Scenario) {
    scenario.quality.max_terrain_error_px = 1e-5;
}

fn four_samples(scenario: &mut Scenario) {
    scenario.quality.ideal_samples = Auto::Value(4);
}

fn light() -> Light {
    Light::new(2.5, 0.6, 0.7, 0.3)
}

/// At a height, 30 m/s fast.
fn from_height(scenario: Scenario, height_m: f64, scene: Scene) -> Arc<Sequence> {
    sequence(scenario, steady(height_m, 10.0, DVec3::new(5.0, 30.0, 2.0), DVec3::new(0.1, 0.05, 0.3)), scene)
}

/// A ball of `n` by `2 n` facets, tinted from pole to pole.
fn ball(n: u32) -> Shape {
    let vertex = |row: u32, column: u32| {
        let (sin, cos) = (std::f64::consts::PI * f64::from(row) / f64::from(n)).sin_cos();
        let (east, north) = (std::f64::consts::PI * f64::from(column) / f64::from(n)).sin_cos();
        [(north * sin) as f32, (east * sin) as f32, -cos as f32]
    };
    let mut shape = Shape::default();
    for row in 0..=n {
        for column in 0..=2 * n {
            let (position_m, fraction) = (vertex(row, column), row as f32 / n as f32);
            let uv = [column as f32 / n as f32, 2.0 * fraction];
            shape.vertices.push(MeshVertex {
                position_m,
                uv,
                tint: [1.0 - 0.5 * fraction, 0.4 + 0.6 * fraction, 0.7, 1.0],
            });
            shape.normals.push(position_m);
        }
    }
    for row in 0..n {
        for column in 0..2 * n {
            let [a, b] = [row, row + 1].map(|row| row * (2 * n + 1) + column);
            shape.indices.extend([a, b, b + 1, a, b + 1, a + 1]);
        }
    }
    shape
}

fn stripes() -> Arc<Texture> {
    let rgba8 = (0..64 * 64_u32).flat_map(|i| {
        [(128.0 + 100.0 * f64::from(i % 64).mul_add(0.4, 0.1).sin()) as u8, (3 * (i / 64)) as u8, 90, 255]
    });
    Arc::new(Texture { size_px: [64, 64], rgba8: rgba8.collect(), encoding: Encoding::Srgb })
}

/// Balls on the ground, turned and stretched.
fn balls(count: u32, light: Option<Light>, change: impl Fn(&mut Mesh)) -> Scene {
    let (shape, texture) = (Arc::new(ball(12)), stripes());
    let mut scene = pattern(2000.0);
    scene.light = light;
    for k in 0..count {
        let vary = |m: f64| (12.9898 * m * f64::from(k + 1)).sin();
        let turn = DMat3::from_quat(
            DQuat::from_rotation_y(3.0 * vary(1.1)) * DQuat::from_rotation_z(3.0 * vary(1.3)),
        );
        let mut mesh = Mesh::new(
            Vec::new(),
            Vec::new(),
            texture.clone(),
            60.0 * DVec3::new(vary(1.7), vary(1.9), 0.0),
            Wrap::Repeat,
        );
        mesh.shape = shape.clone();
        mesh.ned_from_shape = turn * DMat3::from_diagonal(DVec3::new(3.0, 4.0 + vary(2.3), 6.0));
        change(&mut mesh);
        scene.meshes.push(mesh);
    }
    scene
}

/// A frame of a sequence, compared with those of other implementations.
fn case(name: &str, sequence: Arc<Sequence>, frame: u64) -> Case {
    let case = Case::new(name, sequence, Input::Frame(frame), Output::Ideal);
    Case { other_surface: OTHER_SURFACE, ..case }
}

/// Level ground with a pattern.
pub fn patterns() -> Vec<Case> {
    let all = [
        ("large triangles", camera(-60.0), 120.0, 6000.0),
        ("larger pixels than texels", camera(-60.0), 120.0, 150.0),
        ("much larger pixels", camera(-50.0), 600.0, 900.0),
        ("all but level", camera(-20.0), 30.0, 300.0),
        ("down to the horizon", camera(-8.0), 40.0, 20_000.0),
        ("camera 30 cm above the ground", camera(-15.0), 0.3, 200.0),
        ("coarse", with(camera(-60.0), scale(1.0)), 120.0, 400.0),
        ("fine", with(camera(-60.0), scale(3.1)), 120.0, 400.0),
    ];
    let case = |(name, scenario, height_m, width_m)| Case {
        ideal_twin: TwinSource::Pattern { width_m },
        ..Case::new(name, from_height(scenario, height_m, pattern(width_m)), Input::Frame(2), Output::Ideal)
    };
    all.map(case).into()
}

/// Boxes and balls.
pub fn scenes() -> Vec<Case> {
    let fog = |mut scene: Scene| {
        scene.fog_visibility_m = Some(900.0);
        scene
    };
    let lit = Some(light());
    let own_color = |mesh: &mut Mesh| {
        mesh.material.texture = Arc::new(Texture::uniform([200, 90, 40, 255], Encoding::Srgb));
        mesh.material.emissive = [0.05, 0.1, 0.02];
    };
    [
        ("boxes", camera(-50.0), 90.0, city(6)),
        ("among boxes", camera(-10.0), 9.0, city(6)),
        ("fog", camera(-10.0), 60.0, fog(city(8))),
        ("tints", camera(-50.0), 70.0, balls(60, None, |_| ())),
        ("light", camera(-50.0), 70.0, balls(60, lit, |_| ())),
        ("inner sides in light", camera(-50.0), 70.0, balls(60, lit, |mesh| mesh.ned_from_shape *= -1.0)),
        // More than are drawn at once.
        ("a million triangles", with(camera(-50.0), finest), 70.0, balls(2000, lit, |_| ())),
        ("one side", camera(-50.0), 70.0, balls(60, None, |mesh| mesh.material.one_sided = true)),
        ("one colour, light of its own", camera(-50.0), 70.0, balls(60, lit, own_color)),
    ]
    .map(|(name, scenario, height_m, scene)| case(name, from_height(scenario, height_m, scene), 2))
    .into()
}

/// Boxes and balls with four samples a pixel.
pub fn samples() -> Vec<Case> {
    let camera = |pitch_deg: f64| with(camera(pitch_deg), four_samples);
    let lit = Some(light());
    [
        ("boxes", camera(-50.0), 90.0, city(6)),
        ("among boxes", camera(-10.0), 9.0, city(6)),
        ("light", camera(-50.0), 70.0, balls(60, lit, |_| ())),
        ("one side", camera(-50.0), 70.0, balls(60, None, |mesh| mesh.material.one_sided = true)),
        // More than are drawn at once.
        ("a million triangles", with(camera(-50.0), finest), 70.0, balls(2000, lit, |_| ())),
    ]
    .map(|(name, scenario, height_m, scene)| case(name, from_height(scenario, height_m, scene), 2))
    .into()
}

/// Frames of a scenario in a file of the repository, with settings and so many samples a pixel.
fn of_file(file: &str, settings: &[(&str, &str)], samples: &str, frames: [u64; 2]) -> [Case; 2] {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(file);
    let settings = [&[("quality.silhouettes", "\"plain\""), ("quality.ideal_samples", samples)], settings]
        .concat()
        .iter()
        .map(|&(key, value)| (key.into(), value.into()))
        .collect::<Vec<_>>();
    let loaded = load_sequence(&read_scenario(&path, &settings, None).expect("scenario")).expect("sequence");
    frames.map(|frame| case(&format!("{file}, frame {frame}"), loaded.sequence.clone(), frame))
}

/// Scenarios in files.
pub fn files() -> Vec<Case> {
    let coarse = &[("quality.ideal_scale", "1.0"), ("quality.max_error_dn", "0.1")][..];
    let sharp = &[("quality.ideal_scale", "1.41"), ("camera.shutter.exposure_ms", "0")];
    let exact = &[("quality.max_error_dn", "0.5")];
    [
        ("assets/demo.toml", &[][..], [3, 70]),
        ("assets/demo.toml", exact, [40, 52]),
        ("assets/demo.toml", coarse, [3, 70]),
        ("benches/all_effects.toml", &[], [52, 98]),
        ("benches/all_effects.toml", sharp, [52, 60]),
        ("benches/houses.toml", &[], [8, 40]),
        ("benches/houses.toml", coarse, [8, 40]),
    ]
    .into_iter()
    .flat_map(|(file, settings, frames)| of_file(file, settings, "1", frames))
    .collect()
}

/// Scenarios in files with four samples a pixel.
pub fn samples_of_files() -> Vec<Case> {
    [("benches/all_effects.toml", [52, 98]), ("benches/houses.toml", [8, 40])]
        .into_iter()
        .flat_map(|(file, frames)| of_file(file, &[], "4", frames))
        .collect()
}

/// Three views of all kinds of material.
pub fn gallery() -> Vec<Case> {
    let (sequence, plan) = planned(gallery::gallery());
    let keys = gallery::gallery_keys();
    assert_all_surfaces_are_seen(&sequence, &plan, &keys);
    let case = |(number, key): (usize, KeyFrame)| {
        let plan = FramePlan { keys: vec![key], ..plan.clone() };
        let input = Input::Plan(Box::new(plan));
        Case {
            ideal_twin: TwinSource::Rays,
            ..Case::new(format!("gallery, view {number}"), sequence.clone(), input, Output::Ideal)
        }
    };
    keys.into_iter().enumerate().map(case).collect()
}

/// The pane of glass without a cutoff has depth all over; every surface is seen.
fn assert_all_surfaces_are_seen(sequence: &Arc<Sequence>, plan: &FramePlan, keys: &[KeyFrame]) {
    let reference = ReferenceRenderer::new(sequence.clone()).expect("a usable camera");
    let (mut surfaces, mut sky) = (vec![0; 1 + sequence.scene.meshes.len()], 0);
    let [width, height] = plan.ideal.size_px;
    for (key, i) in keys.iter().flat_map(|key| (0..width * height).map(move |i| (key, i))) {
        let position_px = DVec2::new((i % width).into(), (i / width).into());
        let uv = (position_px - plan.ideal.principal_px) / plan.ideal.focal_px;
        match reference.cast(key.pose.position_ned_m, key.pose.ned_from_camera * uv.extend(1.0)) {
            Some(hit) => surfaces[hit.surface as usize] += 1,
            None => sky += 1,
        }
    }
    assert!(surfaces.iter().all(|&count| count > 20) && sky > 500, "{surfaces:?} {sky}");
}

/// Hills and panes that the rasteriser draws too, with so many samples a pixel.
pub fn opaque(samples_a_pixel: u32) -> Vec<Case> {
    // Where ground has a crease within a pixel the rasteriser shades one of its triangles: level ground has
    // none.
    let (relief, reads) = match samples_a_pixel {
        1 => (1.0, &PrefilterTaps::ALL[..]),
        _ => (0.0, &[PrefilterTaps::One, PrefilterTaps::Grid][..]),
    };
    let (sequence, mut plan) = planned(opaque_scene(relief));
    plan.keys = vec![key(DVec3::new(-5.0, 0.0, -16.0), 0.0, 0.45)];
    plan.samples_a_pixel = samples_a_pixel;
    let case = |&surface_reads: &PrefilterTaps| {
        let plan = FramePlan { surface_reads, ..plan.clone() };
        let name = format!("opaque scene, {surface_reads:?}, {samples_a_pixel} samples");
        Case {
            other_surface: OTHER_THAN_RASTER,
            ..Case::new(name, sequence.clone(), Input::Plan(Box::new(plan)), Output::Ideal)
        }
    };
    reads.iter().map(case).collect()
}
