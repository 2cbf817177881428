//! Textures and their mip levels.

use std::{
    borrow::Cow,
    fmt,
    ops::{Add, Mul},
};

use half::f16;
use rayon::prelude::*;

/// Encoding of the colour bytes of a [`Texture`]. Alpha is always linear.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Encoding {
    /// IEC 61966-2-1 transfer curve.
    #[default]
    Srgb,
    /// Linear light.
    Linear,
}

impl Encoding {
    /// Linear light of each of the 256 byte values.
    pub fn decode_table(self) -> [f32; 256] {
        std::array::from_fn(|byte| {
            let stored = byte as f32 / 255.0;
            match self {
                Self::Srgb => linear_from_srgb(stored),
                Self::Linear => stored,
            }
        })
    }

    fn encode_byte(self, linear: f32) -> u8 {
        let stored = match self {
            Self::Srgb => srgb_from_linear(linear),
            Self::Linear => linear,
        };
        (stored.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
    }
}

/// Wrap mode: the continuation of a texture outside of 0..=1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The nearest border pixel.
    #[default]
    Clamp,
    /// Periodic repetition.
    Repeat,
    /// Periodic repetition, mirrored every other time.
    Mirror,
}

impl Wrap {
    /// Pixel of a row of `size` pixels at a position of the endless row.
    pub fn texel(self, at: f64, size: u32) -> usize {
        let last = f64::from(size) - 1.0;
        let within = match self {
            Self::Clamp => at,
            Self::Repeat => at.rem_euclid(f64::from(size)),
            Self::Mirror => {
                let twice = at.rem_euclid(2.0 * f64::from(size));
                twice.min(2.0 * f64::from(size) - 1.0 - twice)
            }
        };
        // NaN gives the first pixel.
        within.clamp(0.0, last.max(0.0)) as usize
    }
}

/// The curve of sRGB (IEC 61966-2-1), and luminance, in one precision.
macro_rules! srgb_curve {
    ($real:ty, $linear_from_srgb:ident, $srgb_from_linear:ident, $luminance:ident) => {
        /// Luminance of linear red, green and blue with the primaries of sRGB (Rec. 709).
        pub const $luminance: [$real; 3] = [0.2126, 0.7152, 0.0722];

        /// Linear light of an sRGB value in 0..=1 (IEC 61966-2-1).
        pub fn $linear_from_srgb(stored: $real) -> $real {
            if stored <= 0.04045 { stored / 12.92 } else { ((stored + 0.055) / 1.055).powf(2.4) }
        }

        /// sRGB value of linear light in 0..=1 (IEC 61966-2-1).
        pub fn $srgb_from_linear(linear: $real) -> $real {
            if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
        }
    };
}

srgb_curve!(f32, linear_from_srgb, srgb_from_linear, LUMINANCE);
srgb_curve!(f64, linear_from_srgb_f64, srgb_from_linear_f64, LUMINANCE_F64);

/// Rec. 709 luminance of linear RGB.
#[must_use]
pub fn luminance(rgb: [f32; 3]) -> f32 {
    LUMINANCE[0] * rgb[0] + LUMINANCE[1] * rgb[1] + LUMINANCE[2] * rgb[2]
}

/// A texture, row-major from its top-left pixel, four bytes per pixel. Alpha 0 marks pixels without content.
#[derive(Clone, PartialEq)]
pub struct Texture {
    /// Width, height; both at least 1.
    pub size_px: [u32; 2],
    /// `4 * width * height` bytes, R G B A, not premultiplied.
    pub rgba8: Vec<u8>,
    /// Meaning of the colour bytes.
    pub encoding: Encoding,
}

/// Form in which the GPU holds the texels of a [`Texture`]: R G B A, not premultiplied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TexelForm {
    /// Bytes in the texture's [`Encoding`], which the GPU decodes.
    Stored,
    /// Half floats of linear light. GPUs decode sRGB approximately, with errors of up to 0.35/255 of the
    /// linear range in Mesa's software driver and 1.08/255 on an NVIDIA H200. Half floats round by at most
    /// 2^-11 of the value, and mip levels are not rounded to bytes.
    Light,
}

impl TexelForm {
    /// Bytes per texel.
    #[must_use]
    pub const fn bytes(self) -> usize {
        match self {
            Self::Stored => 4,
            Self::Light => 8,
        }
    }
}

/// A mip level of a [`Texture`].
#[derive(Clone, PartialEq)]
pub struct MipLevel {
    /// Width, height.
    pub size_px: [u32; 2],
    /// Row-major texels in the requested form.
    pub texels: Vec<u8>,
}

impl fmt::Debug for Texture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Texture")
            .field("size_px", &self.size_px)
            .field("encoding", &self.encoding)
            .finish_non_exhaustive()
    }
}

impl fmt::Debug for MipLevel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("MipLevel").field("size_px", &self.size_px).finish_non_exhaustive()
    }
}

/// Colour in linear light, premultiplied by alpha: the form in which pixels may be averaged.
struct LinearImage {
    size_px: [usize; 2],
    premultiplied: Vec<[f32; 4]>,
}

impl Texture {
    /// A texture of one pixel.
    pub fn uniform(rgba: [u8; 4], encoding: Encoding) -> Self {
        Self { size_px: [1, 1], rgba8: rgba.to_vec(), encoding }
    }

    /// Alpha at texture coordinates, 0..=1: bilinear, or nearest.
    pub fn alpha_at(&self, uv: [f64; 2], wrap: [Wrap; 2], nearest: bool) -> f64 {
        self.sample_at(uv, wrap, nearest, |pixel| f64::from(pixel[3]) / 255.0)
    }

    /// Value at texture coordinates, interpolated bilinearly over the results of `value`, or that of the
    /// nearest pixel.
    pub fn sample_at<T>(&self, uv: [f64; 2], wrap: [Wrap; 2], nearest: bool, value: impl Fn(&[u8]) -> T) -> T
    where
        T: Add<Output = T> + Mul<f64, Output = T>,
    {
        let texel = [0, 1].map(|k: usize| uv[k] * f64::from(self.size_px[k]) - 0.5);
        let read = |x: f64, y: f64| {
            let index = wrap[1].texel(y, self.size_px[1]) * self.size_px[0] as usize
                + wrap[0].texel(x, self.size_px[0]);
            value(self.rgba8.get(4 * index..4 * index + 4).unwrap_or(&[0, 0, 0, 255]))
        };
        if nearest {
            return read((texel[0] + 0.5).floor(), (texel[1] + 0.5).floor());
        }
        let (x, y) = (texel[0].floor(), texel[1].floor());
        let (tx, ty) = (texel[0] - x, texel[1] - y);
        let row = |y: f64| read(x, y) * (1.0 - tx) + read(x + 1.0, y) * tx;
        row(y) * (1.0 - ty) + row(y + 1.0) * ty
    }

    /// Mip levels 1, 2, ... down to 1x1 (level 0 is the texture itself). Each side is half of that of the
    /// level above, rounded down, at least 1.
    ///
    /// The filter is an area-weighted box in linear light: a pixel averages exactly the rectangle that it
    /// covers, so odd sizes cause no shift. Colour is weighted by alpha, so pixels without content do not
    /// darken their neighbours.
    pub fn mips(&self, form: TexelForm) -> Vec<MipLevel> {
        self.mips_with_border(form, None)
    }

    /// As [`Texture::mips`], with a border of one colour (R G B A as stored) instead of the outermost texels
    /// of each level. If the outermost texels of the texture have that colour too, a clamped texture
    /// continues with the same colour at every level.
    pub fn mips_with_border(&self, form: TexelForm, border: Option<[u8; 4]>) -> Vec<MipLevel> {
        let border = border.map(|color| self.texels(&color, form).into_owned());
        let mut levels = Vec::new();
        if self.size_px == [1, 1] {
            return levels;
        }
        let table = self.encoding.decode_table();
        // The full level is never converted to floats, which would take four times the memory of a large
        // texture.
        let mut image = LinearImage::half_of(self.size_px.map(|n| n as usize), |at| {
            linear(&table, &self.rgba8[4 * at..4 * at + 4])
        });
        loop {
            let mut texels = match form {
                TexelForm::Stored => image.encode(self.encoding),
                TexelForm::Light => image.halves(),
            };
            if let Some(border) = &border {
                let [width, height] = image.size_px;
                for (index, texel) in texels.chunks_exact_mut(form.bytes()).enumerate() {
                    let [x, y] = [index % width, index / width];
                    if x == 0 || y == 0 || x + 1 == width || y + 1 == height {
                        texel.copy_from_slice(border);
                    }
                }
            }
            levels.push(MipLevel { size_px: image.size_px.map(|n| n as u32), texels });
            if image.size_px == [1, 1] {
                return levels;
            }
            image = image.half();
        }
    }

    /// Texels of the texture, or of a part of it (`rgba8`), in a form.
    pub fn texels<'a>(&self, rgba8: &'a [u8], form: TexelForm) -> Cow<'a, [u8]> {
        if form == TexelForm::Stored {
            return Cow::Borrowed(rgba8);
        }
        let [color, alpha] = [self.encoding, Encoding::Linear]
            .map(|encoding| encoding.decode_table().map(|value| f16::from_f32(value).to_ne_bytes()));
        let mut halves = vec![0; 2 * rgba8.len()];
        halves.par_chunks_exact_mut(TexelForm::Light.bytes()).zip(rgba8.par_chunks_exact(4)).for_each(
            |(out, texel)| {
                for (k, (half, &byte)) in out.chunks_exact_mut(2).zip(texel).enumerate() {
                    half.copy_from_slice(&if k < 3 { &color } else { &alpha }[usize::from(byte)]);
                }
            },
        );
        Cow::Owned(halves)
    }

    /// Sets the outermost pixels to a colour.
    pub(crate) fn fill_border(&mut self, color: [u8; 4]) {
        let [width, height] = self.size_px.map(|side| side as usize);
        for (index, pixel) in self.rgba8.chunks_exact_mut(4).enumerate() {
            let [x, y] = [index % width, index / width];
            if x == 0 || y == 0 || x + 1 == width || y + 1 == height {
                pixel.copy_from_slice(&color);
            }
        }
    }

    /// A larger texture with a margin of one colour on each side.
    #[must_use]
    pub fn padded(&self, margin_px: u32, color: [u8; 4]) -> Self {
        let size_px = self.size_px.map(|side| side + 2 * margin_px);
        let mut rgba8 = color.repeat(size_px[0] as usize * size_px[1] as usize);
        let (row_bytes, margin) = (4 * self.size_px[0] as usize, margin_px as usize);
        for (row, from) in self.rgba8.chunks_exact(row_bytes).enumerate() {
            let to = 4 * ((row + margin) * size_px[0] as usize + margin);
            rgba8[to..to + row_bytes].copy_from_slice(from);
        }
        Self { size_px, rgba8, encoding: self.encoding }
    }

    /// Linear R G B A of a pixel, not premultiplied.
    ///
    /// # Panics
    /// If the pixel is outside of the texture.
    #[must_use]
    pub fn linear_at(&self, [x, y]: [u32; 2]) -> [f32; 4] {
        let first_byte = 4 * (y as usize * self.size_px[0] as usize + x as usize);
        let pixel = &self.rgba8[first_byte..first_byte + 4];
        let light = self.encoding.decode_table();
        [
            light[usize::from(pixel[0])],
            light[usize::from(pixel[1])],
            light[usize::from(pixel[2])],
            f32::from(pixel[3]) / 255.0,
        ]
    }

    /// Gives pixels of alpha 0 the colour of the nearest coarser level with content, so that bilinear reads
    /// at the border of the content do not blend in black. Alpha is unchanged. No effect on opaque or empty
    /// textures.
    pub fn bleed_into_transparent(&mut self) {
        let mut transparent = self.rgba8.chunks_exact(4).filter(|pixel| pixel[3] == 0).peekable();
        if transparent.peek().is_none() {
            return;
        }
        let levels = self.mips(TexelForm::Stored);
        let width = self.size_px[0] as usize;
        let [full_width, full_height] = self.size_px.map(|n| n as usize);
        for (index, pixel) in self.rgba8.chunks_exact_mut(4).enumerate().filter(|(_, pixel)| pixel[3] == 0) {
            let (x, y) = (index % width, index / width);
            let donor = levels.iter().find_map(|level| {
                let [w, h] = level.size_px.map(|n| n as usize);
                let first_byte = 4 * ((y * h / full_height).min(h - 1) * w + (x * w / full_width).min(w - 1));
                (level.texels[first_byte + 3] > 0).then(|| &level.texels[first_byte..first_byte + 3])
            });
            if let Some(rgb) = donor {
                pixel[..3].copy_from_slice(rgb);
            }
        }
    }
}

/// Linear light, premultiplied by alpha.
fn linear(table: &[f32; 256], p: &[u8]) -> [f32; 4] {
    let alpha = f32::from(p[3]) / 255.0;
    [table[p[0] as usize] * alpha, table[p[1] as usize] * alpha, table[p[2] as usize] * alpha, alpha]
}

impl LinearImage {
    fn half(&self) -> Self {
        Self::half_of(self.size_px, |at| self.premultiplied[at])
    }

    /// Halves an image that is given by its pixels, row by row.
    fn half_of([width, height]: [usize; 2], pixel_at: impl Fn(usize) -> [f32; 4] + Sync) -> Self {
        let [to_width, to_height] = [(width / 2).max(1), (height / 2).max(1)];
        let columns: Vec<_> = (0..to_width).map(|x| cover(x, width, to_width)).collect();
        let mut premultiplied = vec![[0.0; 4]; to_width * to_height];
        premultiplied.par_chunks_exact_mut(to_width).enumerate().for_each(|(y, row)| {
            let (y0, y_weights) = cover(y, height, to_height);
            for (pixel, (x0, x_weights)) in row.iter_mut().zip(&columns) {
                for (dy, wy) in y_weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
                    for (dx, wx) in x_weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
                        let source = pixel_at((y0 + dy) * width + x0 + dx);
                        for (sum, value) in pixel.iter_mut().zip(source) {
                            *sum += wy * wx * value;
                        }
                    }
                }
            }
        });
        Self { size_px: [to_width, to_height], premultiplied }
    }

    fn encode(&self, encoding: Encoding) -> Vec<u8> {
        let mut bytes = vec![0; 4 * self.premultiplied.len()];
        bytes.par_chunks_exact_mut(4).zip(&self.premultiplied).for_each(|(out, &[r, g, b, alpha])| {
            if alpha > 0.0 {
                for (byte, value) in out.iter_mut().zip([r, g, b]) {
                    *byte = encoding.encode_byte(value / alpha);
                }
                // Any content must remain distinguishable from none.
                out[3] = ((alpha * 255.0 + 0.5) as u8).max(1);
            }
        });
        bytes
    }

    fn halves(&self) -> Vec<u8> {
        let mut bytes = vec![0; TexelForm::Light.bytes() * self.premultiplied.len()];
        bytes.par_chunks_exact_mut(TexelForm::Light.bytes()).zip(&self.premultiplied).for_each(
            |(out, &[r, g, b, alpha])| {
                if alpha > 0.0 {
                    for (half, value) in out.chunks_exact_mut(2).zip([r / alpha, g / alpha, b / alpha, alpha])
                    {
                        half.copy_from_slice(&f16::from_f32(value).to_ne_bytes());
                    }
                }
            },
        );
        bytes
    }
}

/// Source pixels covered by target pixel `to` of `to_size`, among `from_size`: the first one, and the weight
/// of each (sum 1). Halving covers at most 3 pixels: n / floor(n/2) <= 3.
fn cover(to: usize, from_size: usize, to_size: usize) -> (usize, [f32; 3]) {
    // In units of 1/to_size source pixels all borders are integers.
    let (begin, end) = (to * from_size, (to + 1) * from_size);
    let first = begin / to_size;
    let weights = std::array::from_fn(|i| {
        let pixel = (first + i) * to_size;
        let overlap = end.min(pixel + to_size).saturating_sub(begin.max(pixel));
        overlap as f32 / from_size as f32
    });
    (first, weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_round_trip_of_every_byte() {
        for byte in 0..=255u8 {
            let linear = linear_from_srgb(f32::from(byte) / 255.0);
            assert_eq!(Encoding::Srgb.encode_byte(linear), byte);
        }
    }

    #[test]
    fn wrap_modes_continue_a_texture() {
        let row = |wrap: Wrap| (-4..6).map(|at| wrap.texel(f64::from(at), 3)).collect::<Vec<_>>();
        assert_eq!(row(Wrap::Clamp), [0, 0, 0, 0, 0, 1, 2, 2, 2, 2]);
        assert_eq!(row(Wrap::Repeat), [2, 0, 1, 2, 0, 1, 2, 0, 1, 2]);
        assert_eq!(row(Wrap::Mirror), [2, 2, 1, 0, 0, 1, 2, 2, 1, 0]);
        assert_eq!(Wrap::Mirror.texel(f64::NAN, 3), 0);
    }

    #[test]
    fn mips_average_in_linear_light() {
        let texture = Texture {
            size_px: [2, 1],
            rgba8: vec![0, 0, 0, 255, 255, 255, 255, 255],
            encoding: Encoding::Srgb,
        };
        let mips = texture.mips(TexelForm::Stored);
        // Half of the light is sRGB 188, not 128.
        assert_eq!((mips.len(), &mips[0].texels[..]), (1, &[188, 188, 188, 255][..]));
        let linear = Texture { encoding: Encoding::Linear, ..texture };
        assert_eq!(linear.mips(TexelForm::Stored)[0].texels, [128, 128, 128, 255]);
    }

    #[test]
    fn mips_of_odd_sizes_are_weighted_by_area() {
        // 3 -> 1: equal thirds. 5 -> 2: 1, 1, 1/2 | 1/2, 1, 1 of 2.5.
        let texture = Texture {
            size_px: [5, 1],
            rgba8: [10, 20, 30, 40, 50].iter().flat_map(|&v| [v, v, v, 255]).collect(),
            encoding: Encoding::Linear,
        };
        let mips = texture.mips(TexelForm::Stored);
        assert_eq!(mips.iter().map(|m| m.size_px).collect::<Vec<_>>(), [[2, 1], [1, 1]]);
        assert_eq!((mips[0].texels[0], mips[0].texels[4]), (18, 42));
        assert_eq!(mips[1].texels[0], 30);
        for size in [2, 3, 5, 7, 100, 641, 917] {
            for to in 0..size / 2 {
                let (first, weights) = cover(to, size, size / 2);
                assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-6 && first < size);
                assert!(weights.iter().enumerate().all(|(i, w)| *w == 0.0 || first + i < size));
            }
        }
    }

    #[test]
    fn border_colour_is_kept_at_every_mip_level() {
        let texture =
            Texture { size_px: [12, 9], rgba8: [200, 100, 50, 255].repeat(108), encoding: Encoding::Srgb };
        let grey = [118, 118, 118, 255];
        let plain = texture.mips(TexelForm::Stored);
        for (level, plain) in texture.mips_with_border(TexelForm::Stored, Some(grey)).iter().zip(&plain) {
            let [width, height] = level.size_px;
            for y in 0..height {
                for x in 0..width {
                    let first_byte = 4 * (y * width + x) as usize;
                    let is_outermost = x == 0 || y == 0 || x + 1 == width || y + 1 == height;
                    assert_eq!(
                        level.texels[first_byte..first_byte + 4],
                        if is_outermost { grey } else { [200, 100, 50, 255] },
                        "{x} {y} of {width} {height}"
                    );
                    assert_eq!(plain.texels[first_byte..first_byte + 4], [200, 100, 50, 255]);
                }
            }
        }
        let larger = texture.padded(2, grey);
        assert_eq!((larger.size_px, larger.rgba8.len()), ([16, 13], 4 * 16 * 13));
        assert_eq!(
            [larger.linear_at([1, 6]), larger.linear_at([2, 2])],
            [grey, [200, 100, 50, 255]].map(|c| Texture::uniform(c, Encoding::Srgb).linear_at([0, 0]))
        );
        let halves = texture.mips_with_border(TexelForm::Light, Some(grey));
        assert_eq!(halves[0].texels[..8], *texture.texels(&grey, TexelForm::Light));
    }

    #[test]
    fn transparent_pixels_do_not_darken_mips() {
        let mut texture = Texture {
            size_px: [4, 1],
            rgba8: vec![0, 0, 0, 0, 200, 100, 50, 255, 0, 0, 0, 0, 0, 0, 0, 0],
            encoding: Encoding::Srgb,
        };
        let mips = texture.mips(TexelForm::Stored);
        assert_eq!(&mips[0].texels[..4], [200, 100, 50, 128]);
        assert_eq!(&mips[0].texels[4..], [0, 0, 0, 0]);
        assert_eq!(&mips[1].texels[..], [200, 100, 50, 64]);
        texture.bleed_into_transparent();
        for pixel in texture.rgba8.chunks_exact(4) {
            assert_eq!(pixel[..3], [200, 100, 50]);
        }
        assert_eq!(texture.rgba8.iter().skip(3).step_by(4).copied().collect::<Vec<_>>(), [0, 255, 0, 0]);
    }

    #[test]
    fn half_floats_hold_linear_light_and_mips_are_not_rounded_to_bytes() {
        let halves = |bytes: &[u8]| -> Vec<f64> {
            bytes.chunks_exact(2).map(|b| f16::from_ne_bytes([b[0], b[1]]).to_f64()).collect()
        };
        let exact = |byte: u8| {
            let stored = f64::from(byte) / 255.0;
            if stored <= 0.040_45 { stored / 12.92 } else { ((stored + 0.055) / 1.055).powf(2.4) }
        };
        // A half float has 11 bits, the last of which may be rounded up.
        let near = |found: f64, exact: f64| (found - exact).abs() <= exact / 2047.0;
        let rgba8: Vec<u8> = (0..=255).flat_map(|byte| [byte, byte, 255 - byte, byte]).collect();
        let texture = Texture { size_px: [16, 16], rgba8, encoding: Encoding::Srgb };
        let whole = halves(&texture.texels(&texture.rgba8, TexelForm::Light));
        for (byte, texel) in (0..=255_u8).zip(whole.chunks_exact(4)) {
            let expected = [exact(byte), exact(byte), exact(255 - byte), f64::from(byte) / 255.0];
            assert!((0..4).all(|k| near(texel[k], expected[k])), "{byte}: {texel:?} {expected:?}");
        }
        assert_eq!(*texture.texels(&texture.rgba8, TexelForm::Stored), texture.rgba8);
        // The mean of two neighbours, which bytes cannot represent.
        let pair = Texture {
            size_px: [2, 1],
            rgba8: vec![200, 40, 9, 255, 201, 41, 10, 255],
            encoding: Encoding::Srgb,
        };
        let mips = pair.mips(TexelForm::Light);
        let values = halves(&mips[0].texels);
        for (k, byte) in [200, 40, 9].into_iter().enumerate() {
            assert!(near(values[k], 0.5 * (exact(byte) + exact(byte + 1))), "{byte}: {}", values[k]);
        }
        assert_eq!((mips[0].size_px, values[3]), ([1, 1], 1.0));
    }
}
