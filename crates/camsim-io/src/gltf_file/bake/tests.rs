#![allow(clippy::unwrap_used, reason = "tests")]

use camsim_core::scene::{MeshVertex, Wrap};

use super::{super::emissive::tests::layer, *};

/// Two triangles of a square of one metre, whose base texture coordinates are `uv` times the position, and
/// its vertex positions as emissive texture coordinates.
fn square(uv: f32) -> (Shape, Vec<[f32; 2]>) {
    let corner = |x: f32, y: f32| MeshVertex::new([x, y, 0.0], [uv * x, uv * y]);
    let vertices = vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)];
    let positions = vertices.iter().map(|vertex| [vertex.position_m[0], vertex.position_m[1]]).collect();
    (Shape { vertices, indices: vec![0, 1, 2, 1, 3, 2], normals: Vec::new() }, positions)
}

/// A sine of `turns` periods in linear values of one channel.
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

/// The linear colour of a baked shape at (x, y) of the square.
fn baked_color(baked: &Baked, x: f64, y: f64) -> [f32; 4] {
    let uv = |corner: usize| baked.shape.vertices[corner].uv.map(f64::from);
    let uv = [0, 1].map(|k: usize| uv(0)[k] + x * (uv(1)[k] - uv(0)[k]) + y * (uv(2)[k] - uv(0)[k]));
    let picture = layer(baked.texture.size_px, baked.texture.rgba8.clone(), Encoding::Srgb, Wrap::Clamp);
    picture.sample(uv)
}

#[test]
fn emissive_texture_with_its_own_uvs_is_baked_in_place() {
    // The green base texture repeats four times across the square; the red emissive one appears once, at half
    // strength.
    let (mut shape, emissive_uvs) = square(4.0);
    shape.vertices[1].tint = [1.0, 0.0, 1.0, 1.0];
    shape.vertices[3].tint = [1.0, 0.0, 1.0, 1.0];
    let input = BakeInput { base: waves(16, 1, 1.0), emissive: waves(32, 0, 1.0), emissive_factor: [0.5; 3] };
    let baked = bake(&shape, &emissive_uvs, &input, MAX_TEXELS).unwrap();
    assert!(baked.coarser <= 1.05, "{}", baked.coarser);
    assert!(baked.shape.vertices.iter().all(|vertex| vertex.tint == [1.0; 4]));
    for i in 1..20 {
        let (x, y) = (f64::from(i) / 20.0, 0.31);
        let color = baked_color(&baked, x, y);
        let light = 0.5 * input.emissive.sample([x, y])[0];
        // The vertex colour applies to the base colour alone.
        let base = input.base.sample([4.0 * x, 4.0 * y])[1] * (1.0 - x as f32);
        assert!(
            (color[0] - light).abs() < 0.01 && (color[1] - base).abs() < 0.02,
            "{x}: {color:?} is not {light}, {base}"
        );
    }
}

#[test]
fn base_layout_is_used_where_the_emissive_layout_overlaps() {
    let (shape, mut emissive_uvs) = square(1.0);
    // Both triangles show the same half of the emissive texture.
    emissive_uvs[3] = [0.0, 0.0];
    let input = BakeInput { base: waves(16, 1, 1.0), emissive: waves(16, 0, 1.0), emissive_factor: [1.0; 3] };
    let baked = bake(&shape, &emissive_uvs, &input, MAX_TEXELS).unwrap();
    // A point of the first triangle, and one of the second, where u is 1 - y.
    assert!((baked_color(&baked, 0.25, 0.25)[0] - input.emissive.sample([0.25, 0.25])[0]).abs() < 0.02);
    assert!(
        (baked_color(&baked, 0.8, 0.7)[0] - input.emissive.sample([0.3, 0.2])[0]).abs() < 0.02,
        "{:?} {:?}",
        baked_color(&baked, 0.8, 0.7),
        input.emissive.sample([0.3, 0.2])
    );
    assert!((baked_color(&baked, 0.8, 0.7)[1] - input.base.sample([0.8, 0.7])[1]).abs() < 0.02);
}

#[test]
fn layouts_that_both_overlap_are_not_baked_and_large_textures_are_coarser() {
    let (mut shape, mut emissive_uvs) = square(1.0);
    // The two triangles overlap in both layouts, in different orientations.
    shape.vertices[3].uv = [0.0, 0.0];
    emissive_uvs[3] = [0.0, 0.0];
    emissive_uvs.swap(0, 1);
    let input = BakeInput { base: waves(16, 1, 1.0), emissive: waves(16, 0, 1.0), emissive_factor: [1.0; 3] };
    assert!(bake(&shape, &emissive_uvs, &input, MAX_TEXELS).is_none());
    // The fewer texels are allowed, the coarser the result, and none at last.
    let (shape, emissive_uvs) = square(4.0);
    let input = BakeInput { base: waves(64, 1, 1.0), emissive: waves(16, 0, 1.0), emissive_factor: [1.0; 3] };
    let sizes = [1 << 20, 18 * 18 * 16, 10].map(|max_texels| {
        bake(&shape, &emissive_uvs, &input, max_texels)
            .map(|baked| (baked.texture.size_px, baked.coarser.round()))
    });
    assert_eq!(sizes, [Some(([144, 144], 2.0)), Some(([72, 72], 4.0)), None]);
    // An emissive layout without area shows one texel everywhere; the base layout is used.
    let (shape, _) = square(1.0);
    let baked = bake(&shape, &[[0.25, 0.5]; 4], &input, MAX_TEXELS).unwrap();
    assert!((baked_color(&baked, 0.9, 0.4)[0] - input.emissive.sample([0.25, 0.5])[0]).abs() < 0.01);
}
