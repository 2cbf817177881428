use camsim_core::scene::linear_from_srgb;

use super::*;

pub(in super::super) fn layer(size_px: [u32; 2], rgba8: Vec<u8>, encoding: Encoding, wrap: Wrap) -> Layer {
    let rule = VertexRule {
        set: 0,
        offset: [0.0; 2],
        rotation_rad: 0.0,
        scale: [1.0; 2],
        factor: [1.0; 4],
        uses_vertex_colors: true,
        ignores_vertex_colors: false,
        is_lit: true,
    };
    Layer::new(Arc::new(Texture { size_px, rgba8, encoding }), [wrap; 2], false, rule)
}

#[test]
fn emissive_light_is_added_in_linear_values() {
    let base = layer([2, 1], vec![255, 128, 0, 7, 0, 0, 0, 9], Encoding::Linear, Wrap::Clamp);
    let emitted = layer([2, 1], vec![255, 128, 188, 0, 10, 0, 0, 0], Encoding::Srgb, Wrap::Clamp);
    let both = add_emissive(&base, [0.5, 0.25, 1.0], &emitted, [0.75, 1.0, 0.5]);
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
    assert_eq!(add_emissive(&white, [0.0; 3], &emitted, [1.0; 3]).rgba8[..3], [255, 128, 188]);
}

#[test]
fn combined_texture_has_the_larger_size() {
    let base = layer([1, 2], vec![0, 0, 0, 255, 255, 255, 255, 255], Encoding::Linear, Wrap::Clamp);
    let emitted = layer(
        [4, 1],
        [[0, 0, 0, 255], [80, 0, 0, 255], [160, 0, 0, 255], [240, 0, 0, 255]].concat(),
        Encoding::Linear,
        Wrap::Clamp,
    );
    let both = add_emissive(&base, [0.0; 3], &emitted, [1.0; 3]);
    assert_eq!(both.size_px, [4, 2]);
    for (pixel, red) in both.rgba8.chunks_exact(4).zip([0.0, 80.0, 160.0, 240.0].repeat(2)) {
        assert!((linear_from_srgb(f32::from(pixel[0]) / 255.0) - red / 255.0).abs() < 0.004, "{pixel:?}");
    }
}
