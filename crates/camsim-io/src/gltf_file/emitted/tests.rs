#![allow(clippy::unwrap_used)]

use camsim_core::scene::{MeshVertex, linear_from_srgb};

use super::*;

fn layer(size_px: [u32; 2], rgba8: Vec<u8>, encoding: Encoding, wrap: Wrap) -> Layer {
    let rule = UvRule {
        set: 0,
        offset: [0.0; 2],
        rotation: 0.0,
        scale: [1.0; 2],
        factor: [1.0; 4],
        vertex_colors: true,
        loses_colors: false,
        takes_light: true,
    };
    Layer::new(Arc::new(Texture { size_px, rgba8, encoding }), [wrap; 2], false, rule)
}

#[test]
fn light_adds_in_linear_values() {
    let base = layer([2, 1], vec![255, 128, 0, 7, 0, 0, 0, 9], Encoding::Linear, Wrap::Clamp);
    let emitted = layer([2, 1], vec![255, 128, 188, 0, 10, 0, 0, 0], Encoding::Srgb, Wrap::Clamp);
    let both = on_top(&base, [0.5, 0.25, 1.0], &emitted, [0.75, 1.0, 0.5]);
    let expected = [
        1.25_f32.min(1.0),
        0.25 * 128.0 / 255.0 + linear_from_srgb(128.0 / 255.0),
        0.5 * linear_from_srgb(188.0 / 255.0),
    ];
    for (channel, light) in expected.into_iter().enumerate() {
        assert!(
            (f32::from(both.rgba8[channel]) - 255.0 * srgb_from_linear(light)).abs() <= 0.5,
            "{channel}: {:?}",
            both.rgba8
        );
    }
    assert_eq!([both.rgba8[3], both.rgba8[7]], [7, 9]);
    let white =
        Layer::new(Arc::new(Texture::uniform([255; 4], Encoding::Linear)), base.wrap, false, base.rule);
    assert_eq!(on_top(&white, [0.0; 3], &emitted, [1.0; 3]).rgba8[..3], [255, 128, 188]);
}

#[test]
fn of_two_sizes_the_finer_counts() {
    let base = layer([1, 2], vec![0, 0, 0, 255, 255, 255, 255, 255], Encoding::Linear, Wrap::Clamp);
    let emitted = layer(
        [4, 1],
        [[0, 0, 0, 255], [80, 0, 0, 255], [160, 0, 0, 255], [240, 0, 0, 255]].concat(),
        Encoding::Linear,
        Wrap::Clamp,
    );
    let both = on_top(&base, [0.0; 3], &emitted, [1.0; 3]);
    assert_eq!(both.size_px, [4, 2]);
    for (pixel, red) in both.rgba8.chunks_exact(4).zip([0.0, 80.0, 160.0, 240.0].repeat(2)) {
        assert!((linear_from_srgb(f32::from(pixel[0]) / 255.0) - red / 255.0).abs() < 0.004, "{pixel:?}");
    }
}

/// Two triangles of a square of one metre, whose base coordinates are `uv` times its place.
fn square(uv: f32) -> (Shape, Vec<[f32; 2]>) {
    let corner = |x: f32, y: f32| MeshVertex::new([x, y, 0.0], [uv * x, uv * y]);
    let vertices = vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)];
    let places = vertices.iter().map(|vertex| [vertex.position_m[0], vertex.position_m[1]]).collect();
    (Shape { vertices, indices: vec![0, 1, 2, 1, 3, 2], normals: Vec::new() }, places)
}

/// A smooth picture in linear values.
fn waves(size: u32, channel: usize, turns: f64) -> Layer {
    let value = |x: u32| {
        127.5 + 100.0 * (std::f64::consts::TAU * turns * (f64::from(x) + 0.5) / f64::from(size)).sin()
    };
    let pixel = |i: u32| {
        let mut rgba = [0, 0, 0, 255];
        rgba[channel] = value(i % size).round() as u8;
        rgba
    };
    layer([size, size], (0..size * size).flat_map(pixel).collect(), Encoding::Linear, Wrap::Repeat)
}

/// The linear value that a baked shape shows at (x, y) of the square.
fn shown(baked: &Baked, x: f64, y: f64) -> [f32; 4] {
    let uv = |corner: usize| baked.shape.vertices[corner].uv.map(f64::from);
    let at = [0, 1].map(|k: usize| uv(0)[k] + x * (uv(1)[k] - uv(0)[k]) + y * (uv(2)[k] - uv(0)[k]));
    let picture = layer(baked.texture.size_px, baked.texture.rgba8.clone(), Encoding::Srgb, Wrap::Clamp);
    picture.at(at)
}

#[test]
fn light_in_a_layout_of_its_own_is_added_where_it_lies() {
    // The base colour four times across the square, green; the light once, red, and half as strong.
    let (mut shape, light_uvs) = square(4.0);
    shape.vertices[1].tint = [1.0, 0.0, 1.0, 1.0];
    shape.vertices[3].tint = [1.0, 0.0, 1.0, 1.0];
    let of = Bake { base: waves(16, 1, 1.0), light: waves(32, 0, 1.0), emitted: [0.5; 3] };
    let baked = bake(&shape, &light_uvs, &of, MOST_TEXELS).unwrap();
    assert!(baked.coarser <= 1.05, "{}", baked.coarser);
    assert!(baked.shape.vertices.iter().all(|vertex| vertex.tint == [1.0; 4]));
    for i in 1..20 {
        let (x, y) = (f64::from(i) / 20.0, 0.31);
        let found = shown(&baked, x, y);
        let light = 0.5 * of.light.at([x, y])[0];
        // Its vertex colour fades the base alone.
        let base = of.base.at([4.0 * x, 4.0 * y])[1] * (1.0 - x as f32);
        assert!(
            (found[0] - light).abs() < 0.01 && (found[1] - base).abs() < 0.02,
            "{x}: {found:?} is not {light}, {base}"
        );
    }
}

#[test]
fn where_the_light_repeats_the_layout_of_the_base_is_taken() {
    let (shape, mut light_uvs) = square(1.0);
    // All of the light's picture is on each of the two triangles.
    light_uvs[3] = [0.0, 0.0];
    let of = Bake { base: waves(16, 1, 1.0), light: waves(16, 0, 1.0), emitted: [1.0; 3] };
    let baked = bake(&shape, &light_uvs, &of, MOST_TEXELS).unwrap();
    // A place of the first triangle, and one of the second: there u is 1 - y.
    assert!((shown(&baked, 0.25, 0.25)[0] - of.light.at([0.25, 0.25])[0]).abs() < 0.02);
    assert!(
        (shown(&baked, 0.8, 0.7)[0] - of.light.at([0.3, 0.2])[0]).abs() < 0.02,
        "{:?} {:?}",
        shown(&baked, 0.8, 0.7),
        of.light.at([0.3, 0.2])
    );
    assert!((shown(&baked, 0.8, 0.7)[1] - of.base.at([0.8, 0.7])[1]).abs() < 0.02);
}

#[test]
fn what_lies_on_itself_in_both_layouts_is_not_baked() {
    let (mut shape, mut light_uvs) = square(1.0);
    // The base's second triangle lies on its first one, and so does the light's, in another way.
    shape.vertices[3].uv = [0.0, 0.0];
    light_uvs[3] = [0.0, 0.0];
    light_uvs.swap(0, 1);
    let of = Bake { base: waves(16, 1, 1.0), light: waves(16, 0, 1.0), emitted: [1.0; 3] };
    assert!(bake(&shape, &light_uvs, &of, MOST_TEXELS).is_none());
    // What would be too large is coarser, and at last not there.
    let (shape, light_uvs) = square(4.0);
    let of = Bake { base: waves(64, 1, 1.0), light: waves(16, 0, 1.0), emitted: [1.0; 3] };
    let sizes = [1 << 20, 18 * 18 * 16, 10].map(|most| {
        bake(&shape, &light_uvs, &of, most).map(|baked| (baked.texture.size_px, baked.coarser.round()))
    });
    assert_eq!(sizes, [Some(([144, 144], 2.0)), Some(([72, 72], 4.0)), None]);
    // A layout without area shows one texel all over: there is nothing to lay the other by, but the other has
    // a place for everything.
    let (shape, _) = square(1.0);
    let baked = bake(&shape, &[[0.25, 0.5]; 4], &of, MOST_TEXELS).unwrap();
    assert!((shown(&baked, 0.9, 0.4)[0] - of.light.at([0.25, 0.5])[0]).abs() < 0.01);
}
