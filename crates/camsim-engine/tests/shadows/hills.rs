//! Hills and a house against the reference renderer.

use std::sync::Arc;

use camsim_core::{
    reference::ReferenceRenderer,
    scenario::Channel,
    scene::{Encoding, Light, Mesh, Scene, Terrain, Texture},
    sequence::Sequence,
};
use camsim_engine::{Backend, Engine};
use glam::{DMat3, DVec2, DVec3};

use crate::{
    SKY, SUN, block, by_reference,
    common::{engine, fixtures, render, sequence, steady},
    level_ground, light, looking_down, psnr_db,
};

/// Hills of 256 m with a texture of stripes, and a house of 12 m on them.
fn hills(light: Option<Light>) -> Scene {
    let height = |k: usize| {
        let (i, j) = ((k % 65) as f64, (k / 65) as f64);
        9.0 * (0.21 * i + 0.5).sin() * (0.17 * j).cos() + 4.0 * (0.6 * i - 0.4 * j).sin()
    };
    let heights: Vec<f64> = (0..65 * 65).map(height).collect();
    let level =
        |k: u32| (150.0 + 50.0 * (0.31 * f64::from(k % 128)).sin() * (0.23 * f64::from(k / 128)).cos()) as u8;
    let rgba8 = (0..128 * 128).flat_map(|k| [level(k), level(k) / 2 + 60, level(k) / 3 + 90, 255]).collect();
    let picture = Texture { size_px: [128, 128], rgba8, encoding: Encoding::Linear };
    let mut terrain = Terrain::from_heights(65, 65, 4.0, &heights, Some(Arc::new(picture))).expect("terrain");
    let ground_m = terrain.down_at(0.0, 0.0).expect("ground");
    let house = block(DVec3::new(0.0, 0.0, ground_m + 3.0), [6.0, 4.0], 15.0, 180);
    let house = Mesh { ned_from_shape: DMat3::from_rotation_z(0.4), ..house };
    light.iter().for_each(|light| {
        terrain.bake_light(light);
    });
    Scene {
        terrain: Some(terrain),
        meshes: vec![house],
        sky_linear: [0.1, 0.15, 0.3],
        light,
        ..Scene::default()
    }
}

/// Flight over the hills with a readout of 20 ms, looking 25 degrees off the vertical.
fn over_hills(scene: Scene) -> Arc<Sequence> {
    let mut scenario = looking_down([240, 180], 220.0);
    scenario.camera.mount.angles_deg[1] = -65.0;
    scenario.camera.lens = fixtures::barrel_lens();
    scenario.camera.shutter = fixtures::rolling(20.0, 0.0);
    let path = steady(110.0, 20.0, DVec3::new(20.0, 5.0, 0.0), DVec3::new(0.05, -0.1, 0.1));
    sequence(scenario, path, scene)
}

fn evening() -> Light {
    Light::new(250_f64.to_radians(), 24_f64.to_radians(), SUN, SKY).with_shadows(true)
}

/// Pixels within 3 px of a shadow's border, row-major: where rays through pixels beside each other differ.
fn near_borders(reference: &ReferenceRenderer) -> Vec<bool> {
    let [width, height] = reference.sequence().scenario.camera.size_px;
    let view = reference.view(0);
    let is_dark = |x: u32, y: u32| {
        let sample = view.sample([x, y], DVec2::ZERO, 0.0)?;
        Some(reference.is_in_shadow(sample.t_s, &sample.hit?))
    };
    let dark: Vec<Option<bool>> = (0..width * height).map(|i| is_dark(i % width, i / width)).collect();
    let at = |x: u32, y: u32| dark[(y * width + x) as usize];
    let borders: Vec<[u32; 2]> = (0..(width - 1) * (height - 1))
        .map(|i| [i % (width - 1), i / (width - 1)])
        .filter(|&[x, y]| at(x, y) != at(x + 1, y) || at(x, y) != at(x, y + 1))
        .collect();
    let mut near = vec![false; dark.len()];
    for [x, y] in borders {
        for v in y.saturating_sub(2)..(y + 4).min(height) {
            for u in x.saturating_sub(2)..(x + 4).min(width) {
                near[(v * width + u) as usize] = true;
            }
        }
    }
    near
}

fn expect_hills(who: &str, engine: &Engine, scene: Scene) {
    let sequence = over_hills(scene);
    let reference = ReferenceRenderer::new(sequence.clone()).expect("a reference");
    let near = near_borders(&reference);
    let truth = by_reference(&sequence);
    let done = render(engine, &sequence, &[Channel::Color], 0);
    let [borders_db, others_db] = psnr_db(&truth, done.frame.color_rgba(), &near);
    let fraction = near.iter().filter(|&&near| near).count() as f64 / near.len() as f64;
    eprintln!(
        "{who}: {borders_db:.1} dB within 3 px of borders ({fraction:.2} of the picture), {others_db:.1} dB elsewhere; {} px, {} samples",
        done.plan.ideal.size_px[0], done.plan.samples_a_pixel
    );
    assert!((0.05..0.8).contains(&fraction), "{fraction}");
    assert!(borders_db > 38.0 && others_db > 40.0, "{who}: {borders_db} {others_db}");
}

#[test]
fn cpu_has_the_hills_shadows_of_the_reference() {
    expect_hills("cpu", &Engine::cpu(), hills(Some(evening())));
    let bare = Scene { meshes: Vec::new(), ..hills(Some(evening())) };
    expect_hills("cpu, no house", &Engine::cpu(), bare);
    let misty = Scene { fog_visibility_m: Some(400.0), ..hills(Some(evening())) };
    expect_hills("cpu, in fog", &Engine::cpu(), misty);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn gpu_has_the_hills_shadows_of_the_reference() {
    let mut engine = engine();
    engine.set_backend(Backend::Gpu);
    expect_hills("gpu", &engine, hills(Some(evening())));
}

#[test]
fn without_shadows_pictures_keep_their_bytes() {
    // Where nothing is hidden from the sun, shadows change nothing either.
    let flat = |shadows: bool| {
        let light = light().with_shadows(shadows);
        let scene = Scene { terrain: Some(level_ground(&light)), light: Some(light), ..Scene::default() };
        let sequence =
            sequence(looking_down([64, 48], 90.0), steady(40.0, 0.0, DVec3::ZERO, DVec3::ZERO), scene);
        (render(&Engine::cpu(), &sequence, &[Channel::Color], 0).frame.into_color(), by_reference(&sequence))
    };
    assert_eq!(flat(true), flat(false));
    let house = |shadows: bool| {
        let sequence = over_hills(hills(Some(evening().with_shadows(shadows))));
        let done = render(&Engine::cpu(), &sequence, &[Channel::Color], 0);
        assert_eq!(done.plan.shadows.is_some(), shadows);
        assert_eq!(done.plan.skipped.iter().any(|skip| skip.what == "shadows"), !shadows);
        done.frame.into_color()
    };
    let differ = house(true).iter().zip(&house(false)).filter(|(a, b)| a != b).count();
    assert!(differ > 3 * 240 * 180 / 10, "{differ}");
}
