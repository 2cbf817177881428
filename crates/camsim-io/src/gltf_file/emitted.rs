//! A picture of emitted light on top of a base colour, as one picture.

use camsim_core::scene::{Encoding, Texture, linear_from_srgb, srgb_from_linear};

/// `base` times its factor plus `emitted` times its own, linear light, as sRGB; alpha is the base's. More than white is white. `None` for
/// pictures of different size, unless one of them has one colour.
pub(super) fn on_top(base: &Texture, base_factor: [f32; 3], emitted: &Texture, emitted_factor: [f32; 3]) -> Option<Texture> {
    let size_px = match (base.size_px, emitted.size_px) {
        (base_px, [1, 1]) => base_px,
        ([1, 1], emitted_px) => emitted_px,
        (base_px, emitted_px) => Some(base_px).filter(|_| base_px == emitted_px)?,
    };
    let pixels = size_px[0] as usize * size_px[1] as usize;
    let mut rgba8 = Vec::with_capacity(4 * pixels);
    for pixel in 0..pixels {
        let (below, above) = (of(base, pixel), of(emitted, pixel));
        for channel in 0..3 {
            let light = base_factor[channel] * linear(base, below[channel]) + emitted_factor[channel] * linear(emitted, above[channel]);
            rgba8.push((255.0 * srgb_from_linear(light.clamp(0.0, 1.0))).round() as u8);
        }
        rgba8.push(below[3]);
    }
    Some(Texture { size_px, rgba8, encoding: Encoding::Srgb })
}

/// The pixel of that number, or the only one.
fn of(texture: &Texture, pixel: usize) -> [u8; 4] {
    let first = if texture.size_px == [1, 1] { 0 } else { 4 * pixel };
    std::array::from_fn(|channel| texture.rgba8.get(first + channel).copied().unwrap_or_default())
}

fn linear(texture: &Texture, byte: u8) -> f32 {
    let stored = f32::from(byte) / 255.0;
    if texture.encoding == Encoding::Srgb { linear_from_srgb(stored) } else { stored }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_adds_in_linear_values() {
        let base = Texture { size_px: [2, 1], rgba8: vec![255, 128, 0, 7, 0, 0, 0, 9], encoding: Encoding::Linear };
        let emitted = Texture { size_px: [2, 1], rgba8: vec![255, 128, 188, 0, 10, 0, 0, 0], encoding: Encoding::Srgb };
        let both = on_top(&base, [0.5, 0.25, 1.0], &emitted, [0.75, 1.0, 0.5]).expect("one size");
        let expected = [1.25_f32.min(1.0), 0.25 * 128.0 / 255.0 + linear_from_srgb(128.0 / 255.0), 0.5 * linear_from_srgb(188.0 / 255.0)];
        for (channel, light) in expected.into_iter().enumerate() {
            assert!((f32::from(both.rgba8[channel]) - 255.0 * srgb_from_linear(light)).abs() <= 0.5, "{channel}: {:?}", both.rgba8);
        }
        assert_eq!([both.rgba8[3], both.rgba8[7]], [7, 9]);
        let white = Texture::uniform([255; 4], Encoding::Linear);
        assert_eq!(on_top(&white, [0.0; 3], &emitted, [1.0; 3]).expect("one colour").rgba8[..3], [255, 128, 188]);
        let larger = Texture { size_px: [1, 2], ..base.clone() };
        assert!(on_top(&base, [1.0; 3], &larger, [1.0; 3]).is_none());
    }
}
