#![allow(clippy::unwrap_used)]

//! Which pixels have the sun, against a ray for each.

use camsim_core::scene::{Light, Mesh, Scene, Terrain};
use glam::{DMat3, DVec3};

use super::*;
use crate::fixtures::{
    block,
    gallery::{SIZE_PX, key, planned},
};

/// Hills of 4 m cells, with blocks on them and above them.
fn hills(light: Light) -> Scene {
    let height = |k: u32| {
        let (i, j) = (f64::from(k % 97), f64::from(k / 97));
        12.0 * (0.21 * i + 0.5).sin() * (0.17 * j).cos() + 3.0 * (0.6 * i - 0.4 * j).sin()
    };
    let heights: Vec<f64> = (0..97 * 97).map(height).collect();
    let mut terrain = Terrain::from_heights(97, 97, 4.0, &heights, None).unwrap();
    terrain.bake_light(&light);
    let block = |north_m: f64, east_m: f64, above_m: f64| {
        let down_m = terrain.down_at(north_m, east_m).unwrap() - above_m;
        let block = block(DVec3::new(north_m, east_m, down_m), [5.0, 3.0], 6.0, 200);
        Mesh { ned_from_shape: DMat3::from_rotation_z(0.4 + north_m), ..block }
    };
    let meshes = vec![block(20.0, 3.0, -1.0), block(45.0, -20.0, 8.0), block(60.0, 30.0, -2.0)];
    Scene { terrain: Some(terrain), meshes, light: Some(light), ..Scene::default() }
}

#[test]
fn pixels_have_the_sun_that_their_rays_have() {
    let [width, height] = SIZE_PX.map(|side| side as usize);
    let (mut skipped, mut shaded, mut on_models) = (0, 0, 0);
    for (elevation_deg, pitch, off) in
        [(30.0, 0.4, 0.0), (12.0, 0.2, 0.0), (12.0, 0.3, 5e-4), (55.0, 1.2, 0.0), (4.0, 0.3, 0.0)]
    {
        let light = Light::new(4.0, f64::to_radians(elevation_deg), 0.8, 0.2).with_shadows(true);
        let (sequence, plan) = planned(hills(light));
        assert!(plan.shadows.is_some());
        let cast = CastScene::new(&sequence.scene);
        let key = key(DVec3::new(-40.0, 0.0, -45.0), 0.1, pitch);
        let caster = FrameCaster::without_textures(&cast, &plan, &key, 1);
        let by_rays = FrameCaster { sun_map: None, ..FrameCaster::without_textures(&cast, &plan, &key, 1) };
        let mut hits = Hits::default();
        let mut expected = Vec::new();
        for i in 0..width * height {
            let position_px = DVec2::new((i % width) as f64, (i / width) as f64);
            by_rays.trace(position_px, &mut hits);
            let ray = by_rays.shader.camera.ray(position_px);
            let triangle = hits.opaque.and_then(|_| by_rays.opaque_triangle(&hits, &ray));
            let met = triangle.zip(hits.opaque).map(|(triangle, hit)| Met::new(triangle, hit.t()));
            expected.push(met.map(|met| (met, by_rays.sun(&met, &ray))));
        }
        // A terrain drawn with fewer triangles is a little off.
        let depth = |(i, of): (usize, &Option<(Met, _)>)| {
            let wave = off * (i as f64 * 0.7).sin();
            of.as_ref().map_or(0.0, |(met, _)| (NEAR_M / met.t * (1.0 + wave)) as f32)
        };
        let depth: Vec<f32> = expected.iter().enumerate().map(depth).collect();
        let middles = caster.middles(&Drawn { depth: &depth, stride: width, size_px: [width, height] });
        for (i, (middle, expected)) in middles.iter().zip(&expected).enumerate() {
            let at = format!("{elevation_deg} deg, pitch {pitch}: {}, {}", i % width, i / width);
            let Some((met, sun)) = expected else {
                assert_eq!((middle.surface, middle.sun), (None, 1.0), "{at}");
                continue;
            };
            assert_eq!(middle.surface, Some(met.triangle.surface), "{at}");
            let fraction = fraction_of_sun(met.triangle.surface, *sun, None) as f32;
            assert_eq!(middle.sun, fraction, "{at}: {sun:?}");
            skipped += u32::from(middle.triangle.is_none());
            shaded += u32::from(fraction < 1.0);
            on_models += u32::from(met.triangle.surface > 0);
        }
    }
    eprintln!("{skipped} pixels in squares without shadows, {shaded} in shadow, {on_models} on models");
    assert!(skipped > 2000 && shaded > 2000 && on_models > 500, "{skipped} {shaded} {on_models}");
}
