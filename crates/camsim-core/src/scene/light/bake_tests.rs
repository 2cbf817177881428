#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::Light;
use crate::scene::{Encoding, Terrain, Texture, linear_from_srgb};

fn sun() -> Light {
    Light::new(2.1, 0.7, 0.75, 0.25)
}

fn uniform(rgba: [u8; 4], encoding: Encoding) -> Option<Arc<Texture>> {
    Some(Arc::new(Texture::uniform(rgba, encoding)))
}

#[test]
fn a_tilted_plane_has_one_colour_to_its_border() {
    // 20 % up to the north, 35 % down to the east.
    let heights: Vec<f64> =
        (0..90 * 70).map(|k| -0.2 * 10.0 * f64::from(k / 90) - 0.35 * 10.0 * f64::from(k % 90)).collect();
    let upwards = DVec3::new(-0.2, 0.35, -1.0).normalize();
    let factor = sun().factor(upwards);
    assert!((factor - (0.75 * upwards.dot(sun().to_sun_ned) + 0.125 * (1.0 - upwards.z))).abs() < 1e-12);
    let mut terrain =
        Terrain::from_heights(90, 70, 10.0, &heights, uniform([200, 100, 5, 77], Encoding::Linear)).unwrap();
    // One texel per height, upsampled from a texture of a single texel.
    assert_eq!(terrain.bake_light(&sun()), 90);
    assert_eq!(terrain.texture.size_px, [90, 90]);
    for pixel in terrain.texture.rgba8.chunks_exact(4) {
        for (byte, before) in pixel.iter().zip([200.0, 100.0, 5.0]) {
            assert!((f64::from(*byte) - before * factor).abs() <= 0.51, "{pixel:?} {factor}");
        }
        assert_eq!(pixel[3], 77);
    }
    let mut srgb =
        Terrain::from_heights(90, 70, 10.0, &heights, uniform([200, 100, 5, 255], Encoding::Srgb)).unwrap();
    srgb.bake_light(&sun());
    let decode = |byte: f64| f64::from(linear_from_srgb(byte as f32 / 255.0));
    for (byte, before) in srgb.texture.rgba8[..3].iter().zip([200.0, 100.0, 5.0]) {
        let wanted = factor * decode(before);
        assert!(
            decode(f64::from(*byte) - 0.51) <= wanted && wanted <= decode(f64::from(*byte) + 0.51),
            "{byte} {before}"
        );
    }
}

/// Hills on a grid of 10 m; the texture is rotated, so that its rows are not parallel to rows of heights.
fn hills(turn: f64, side_px: u32, void: impl Fn(u32, u32) -> bool) -> (Terrain, Vec<DVec3>) {
    let point = |k: u32| {
        let (i, j) = (k % 40, k / 40);
        let height = 25.0 * (0.3 * f64::from(i)).sin() * (0.2 * f64::from(j)).cos();
        let position = DVec3::new(-10.0 * f64::from(j), 10.0 * f64::from(i), -height);
        if void(i, j) { DVec3::NAN } else { position }
    };
    let points: Vec<DVec3> = (0..40 * 30).map(point).collect();
    let uv = |k: u32| {
        (0.5 + DVec2::from_angle(turn).rotate(DVec2::new(f64::from(k % 40) - 20.0, f64::from(k / 40) - 15.0))
            / 60.0)
            .as_vec2()
    };
    let uvs: Vec<[f32; 2]> = (0..40 * 30).map(|k| uv(k).to_array()).collect();
    let texture = Texture {
        size_px: [side_px; 2],
        rgba8: vec![255; 4 * (side_px * side_px) as usize],
        encoding: Encoding::Linear,
    };
    (Terrain::new(40, 30, &points, &uvs, Arc::new(texture)).unwrap(), points)
}

#[test]
fn texels_have_the_light_of_their_ground_point() {
    for turn in [0.0, 0.6, 2.5] {
        let side = 300_u32;
        let (mut terrain, points) = hills(turn, side, |_, _| false);
        terrain.bake_light(&sun());
        assert_eq!(terrain.texture.size_px, [side; 2]);
        let light = |i: usize, j: usize| {
            let point = |i: usize, j: usize| points[j.min(29) * 40 + i.min(39)];
            let (east, south) =
                (point(i + 1, j) - point(i.max(1) - 1, j), point(i, j + 1) - point(i, j.max(1) - 1));
            sun().factor(south.cross(east).normalize())
        };
        let (mut inside, mut least, mut most) = (0, 255, 0);
        for y in 0..side {
            for x in 0..side {
                // Back to columns and rows of heights.
                let from_middle = (DVec2::new(f64::from(x), f64::from(y)) + 0.5) / f64::from(side) - 0.5;
                let position = DVec2::from_angle(-turn).rotate(from_middle * 60.0) + DVec2::new(20.0, 15.0);
                let byte = terrain.texture.rgba8[4 * (y * side + x) as usize];
                if position.x < 0.0 || position.y < 0.0 || position.x > 39.0 || position.y > 29.0 {
                    continue;
                }
                let (i, j) = ((position.x as usize).min(38), (position.y as usize).min(28));
                let (s, t) = (position.x - i as f64, position.y - j as f64);
                let [nw, ne, sw, se] = [light(i, j), light(i + 1, j), light(i, j + 1), light(i + 1, j + 1)];
                // The diagonal runs from north-west to south-east.
                let wanted = if s > t {
                    nw + s * (ne - nw) + t * (se - ne)
                } else {
                    nw + s * (se - sw) + t * (sw - nw)
                };
                assert!(
                    (f64::from(byte) - 255.0 * wanted).abs() <= 0.55,
                    "{turn} {x} {y}: {byte} {}",
                    255.0 * wanted
                );
                (inside, least, most) = (inside + 1, least.min(byte), most.max(byte));
            }
        }
        assert!(inside > 25_000 && most - least > 80, "{inside} {least} {most}");
    }
}

#[test]
fn voids_are_lit_like_their_surroundings() {
    let (mut whole, _) = hills(0.3, 240, |_, _| false);
    let (mut holed, _) =
        hills(0.3, 240, |i, j| (10..16).contains(&i) && (8..14).contains(&j) || i == 30 && j == 20);
    whole.bake_light(&sun());
    holed.bake_light(&sun());
    let level = (255.0 * sun().factor(DVec3::NEG_Z)).round();
    let mut other = 0;
    for (a, b) in whole.texture.rgba8.chunks_exact(4).zip(holed.texture.rgba8.chunks_exact(4)) {
        let (a, b) = (f64::from(a[0]), f64::from(b[0]));
        other += u32::from(a != b);
        // Slopes beside a void are one-sided; beyond it the ground counts as level.
        assert!((a - b).abs() < 60.0 || (b - level).abs() < 60.0, "{a} {b}");
    }
    // Some 50 heights of 16 texels each, and their neighbours.
    assert!((300..2500).contains(&other), "{other}");
}

#[test]
fn parts_of_sun_and_sky_add_up_to_the_baked_light() {
    let (cols, rows) = (150, 90);
    let heights: Vec<f64> = (0..cols * rows)
        .map(|k| 30.0 * (f64::from(k % cols) * 0.3).sin() * (f64::from(k / cols) * 0.2).cos())
        .collect();
    let white = Texture {
        size_px: [cols, rows],
        rgba8: vec![255; 4 * (cols * rows) as usize],
        encoding: Encoding::Linear,
    };
    let baked = |light: &Light| {
        let mut terrain =
            Terrain::from_heights(cols, rows, 5.0, &heights, Some(Arc::new(white.clone()))).unwrap();
        terrain.bake_light(light);
        terrain
    };
    assert!(baked(&sun()).light_parts.is_empty());
    let light = sun().with_shadows(true);
    let terrain = baked(&light);
    assert_eq!(terrain.texture.rgba8, baked(&sun()).texture.rgba8);
    assert_eq!(terrain.light_parts.len(), terrain.vertices.len());
    let mut dark = 0;
    for (vertex, [of_sun, of_sky]) in terrain.vertices.iter().zip(&terrain.light_parts) {
        let [x, y] = [(vertex.uv[0] * cols as f32) as usize, (vertex.uv[1] * rows as f32) as usize];
        let byte = terrain.texture.rgba8[4 * (y * cols as usize + x)];
        let off = (of_sun + of_sky) * 255.0 - f32::from(byte);
        assert!(off.abs() < 0.51, "{off} at {x}, {y}");
        assert!(*of_sun >= 0.0 && *of_sky > 0.0);
        dark += u32::from(*of_sun == 0.0);
    }
    assert!(dark > 100, "{dark}");
    // Ground that is all sky's stays as it is in the shadow.
    assert_eq!(Terrain::sky_fraction(&baked(&sun()), [0, 1, 2], [0.2, 0.3, 0.5]), 1.0);
}
