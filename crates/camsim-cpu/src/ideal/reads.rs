//! Reads of a surface's picture, as many as the plan says: twin of shaders/ideal/surface.wgsl and
//! shaders/ideal/reads.

use camsim_plan::PrefilterTaps;

use super::picture::{NO_SUMS, Sums, Texels, colors as sums_of};
use crate::simd::{
    lanes::{LANES, Lanes, ZERO, each, higher, lower},
    vectors::Vectors,
};

/// R G B A of each pixel.
pub(super) type Colors = [[f32; 4]; LANES];

/// Reads this far apart, texels, or less need no smaller version of the picture.
const CLOSE_TEXELS: f32 = 0.8;
/// Variance (times 12) of the version for reads a texel apart.
const CELL_VARIANCE: f32 = 1.5;
/// Four reads: longer by this than wide (at least a texel), and one read across is enough.
const IN_A_ROW: f32 = 1.6;
/// A grid: most reads along the longer axis, those along a shorter one, and the side from which on it has
/// them, texels.
const MAX_TAPS: f32 = 32.0;
const SHORT_TAPS: f32 = 2.0;
const ONE_TAP: f32 = 0.5;
/// Of a version; no picture has so many.
const MAX_LEVEL: f32 = 31.0;

/// Texture coordinates of pixels, and how they change across and down.
pub(super) struct Places {
    pub uv: [Lanes; 2],
    pub across: [Lanes; 2],
    pub down: [Lanes; 2],
}

/// The ellipse that stands for a pixel on the picture: its axes in texels, and the direction of the longer
/// one.
struct Pixels {
    longer: Lanes,
    shorter: Lanes,
    along: [Lanes; 2],
}

impl Pixels {
    #[inline(always)]
    fn new(places: &Places, size: [f32; 2]) -> Self {
        let [across, down] = [&places.across, &places.down];
        let dx = [each(|i| across[0][i] * size[0]), each(|i| across[1][i] * size[1])];
        let dy = [each(|i| down[0][i] * size[0]), each(|i| down[1][i] * size[1])];
        let a = each(|i| dx[0][i].mul_add(dx[0][i], dy[0][i] * dy[0][i]));
        let b = each(|i| dx[0][i].mul_add(dx[1][i], dy[0][i] * dy[1][i]));
        let c = each(|i| dx[1][i].mul_add(dx[1][i], dy[1][i] * dy[1][i]));
        let mean = each(|i| 0.5 * (a[i] + c[i]));
        let half = each(|i| 0.5 * (a[i] - c[i]));
        let spread = each(|i| half[i].mul_add(half[i], b[i] * b[i]).sqrt());
        // Of the two expressions of the eigenvector, the one without cancellation; a circle has no longer
        // axis, any will do.
        let x = each(|i| if half[i] >= 0.0 { half[i] + spread[i] } else { b[i] });
        let y = each(|i| if half[i] >= 0.0 { b[i] } else { spread[i] - half[i] });
        let per_length = each(|i| 1.0 / higher(x[i].mul_add(x[i], y[i] * y[i]).sqrt(), 1e-20));
        let along = [
            each(|i| if spread[i] > 1e-6 * mean[i] { x[i] * per_length[i] } else { 1.0 }),
            each(|i| if spread[i] > 1e-6 * mean[i] { y[i] * per_length[i] } else { 0.0 }),
        ];
        Self {
            longer: each(|i| (mean[i] + spread[i]).sqrt()),
            shorter: each(|i| higher(mean[i] - spread[i], 0.0).sqrt()),
            along,
        }
    }
}

/// Variance (times 12) of the version for reads `cell` texels apart, beyond what the picture has between its
/// texels, and its level.
#[inline(always)]
fn version_for(cell: f32) -> [f32; 2] {
    let variance = CELL_VARIANCE * cell * cell;
    let texels2 = variance * (1.0 / 3.0) + 1.0;
    // Half of its exponent, rounded down, and 4 to the minus that.
    let below = ((texels2.to_bits() >> 23) as i32 - 127) >> 1;
    let level =
        below as f32 + (texels2 * f32::from_bits(((127 - 2 * below) as u32) << 23) - 1.0) * (1.0 / 3.0);
    // Exactly 0 needs one version instead of two.
    if cell <= CLOSE_TEXELS { [0.0; 2] } else { [variance, level] }
}

/// Mean colours of the pixels that are asked for.
#[inline(always)]
pub(super) fn colors(
    vectors: impl Vectors,
    picture: &Texels,
    reads: PrefilterTaps,
    places: &Places,
    is_asked: &[bool; LANES],
) -> Colors {
    let pixels = Pixels::new(places, picture.size());
    let [u, v] = &places.uv;
    let mut sums = NO_SUMS;
    match reads {
        PrefilterTaps::One => {
            let level = each(|i| version_for(pixels.longer[i])[1]);
            picture.add_reads(vectors, u, v, &level, &[1.0; LANES], is_asked, &mut sums);
        }
        PrefilterTaps::Two => {
            let (mut level, mut long) = (ZERO, ZERO);
            for i in 0..LANES {
                let [variance, of] = version_for(higher(0.5 * pixels.longer[i], pixels.shorter[i]));
                level[i] = of;
                // +-x has the variance x^2, a mean over the length l has l^2 / 12.
                long[i] = (higher(pixels.longer[i] * pixels.longer[i] - variance, 0.0) * (1.0 / 12.0)).sqrt();
            }
            add_both(vectors, picture, places, &pixels, [&long, &ZERO], &level, 0.5, is_asked, &mut sums);
        }
        PrefilterTaps::Four => add_four(vectors, picture, places, &pixels, is_asked, &mut sums),
        PrefilterTaps::Grid => add_grid(vectors, picture, places, &pixels, is_asked, &mut sums),
    }
    sums_of(&sums)
}

/// Adds reads so far along the longer axis and across it, texels, on both sides of each pixel.
#[inline(always)]
fn add_both(
    vectors: impl Vectors,
    picture: &Texels,
    places: &Places,
    pixels: &Pixels,
    [long, short]: [&Lanes; 2],
    level: &Lanes,
    weight: f32,
    is_asked: &[bool; LANES],
    sums: &mut Sums,
) {
    let per_texel = picture.size().map(f32::recip);
    let ([x, y], [u, v]) = (&pixels.along, &places.uv);
    let du = each(|i| (x[i] * long[i] - y[i] * short[i]) * per_texel[0]);
    let dv = each(|i| (y[i] * long[i] + x[i] * short[i]) * per_texel[1]);
    for sign in [1.0_f32, -1.0] {
        let (u, v) = (each(|i| sign.mul_add(du[i], u[i])), each(|i| sign.mul_add(dv[i], v[i])));
        picture.add_reads(vectors, &u, &v, level, &[weight; LANES], is_asked, sums);
    }
}

/// Two by two where a pixel is about as wide as long, four in a row where it is longer.
#[inline(always)]
fn add_four(
    vectors: impl Vectors,
    picture: &Texels,
    places: &Places,
    pixels: &Pixels,
    is_asked: &[bool; LANES],
    sums: &mut Sums,
) {
    let (mut level, mut first, mut second) = (ZERO, [ZERO; 2], [ZERO; 2]);
    for i in 0..LANES {
        let (longer, shorter) = (pixels.longer[i], pixels.shorter[i]);
        let is_square = longer < IN_A_ROW * higher(shorter, 1.0);
        let [variance, of] =
            version_for(if is_square { 0.5 * longer } else { higher(0.25 * longer, shorter) });
        level[i] = of;
        // +-x has the variance x^2, and +-x with +-3 x has 5 x^2; a mean over the length l has l^2 / 12.
        let long2 = higher(longer * longer - variance, 0.0) * (1.0 / 12.0);
        let short2 = higher(shorter * shorter - variance, 0.0) * (1.0 / 12.0);
        let long = (if is_square { long2 } else { 0.2 * long2 }).sqrt();
        let short = if is_square { short2.sqrt() } else { 0.0 };
        (first[0][i], first[1][i]) = (if is_square { long } else { 3.0 * long }, short);
        (second[0][i], second[1][i]) = (long, -short);
    }
    for [long, short] in [&first, &second] {
        add_both(vectors, picture, places, pixels, [long, short], &level, 0.25, is_asked, sums);
    }
}

/// Variance (times 12) that a version of 2^level texels adds to what the picture has between its texels.
#[inline(always)]
fn version_variance(level: f32) -> f32 {
    let below = level.floor();
    // 4 to the power of it; levels are below 32.
    let power = f32::from_bits(((127 + 2 * below as i32) as u32) << 23);
    3.0 * (power + (level - below) * 3.0 * power - 1.0)
}

/// One or two reads across and as many along the longer axis as keep them square.
#[inline(always)]
fn add_grid(
    vectors: impl Vectors,
    picture: &Texels,
    places: &Places,
    pixels: &Pixels,
    is_asked: &[bool; LANES],
    sums: &mut Sums,
) {
    let (mut level, mut taps, mut lengths) = (ZERO, [ZERO; 2], [ZERO; 2]);
    let tap_length = |side: f32, taps: f32, version: f32| {
        (higher(side * side - version, 0.0) / higher(1.0 - 1.0 / (taps * taps), 0.5)).sqrt()
    };
    for i in (0..LANES).filter(|&i| is_asked[i]) {
        let (longer, shorter) = (pixels.longer[i], pixels.shorter[i]);
        let short_taps = if shorter > ONE_TAP { SHORT_TAPS } else { 1.0 };
        let covered = higher(shorter / short_taps, 1.0);
        let long_taps = lower(higher((longer / covered - 0.1).ceil(), short_taps), MAX_TAPS);
        let side = higher(longer / long_taps, covered);
        level[i] = if side > 1.0 { lower(side.log2(), MAX_LEVEL) } else { 0.0 };
        let version = version_variance(level[i]);
        (taps[0][i], taps[1][i]) = (long_taps, short_taps);
        (lengths[0][i], lengths[1][i]) =
            (tap_length(longer, long_taps, version), tap_length(shorter, short_taps, version));
    }
    let per_texel = picture.size().map(f32::recip);
    let ([x, y], [u, v]) = (&pixels.along, &places.uv);
    let most = |of: &Lanes| of.iter().fold(0.0, |most, &taps| higher(most, taps)) as u32;
    let weight = each(|i| 1.0 / higher(taps[0][i] * taps[1][i], 1.0));
    for (along, across) in (0..most(&taps[0]))
        .flat_map(|along| (0..most(&taps[1])).map(move |across| (along as f32, across as f32)))
    {
        let mut is_taken = [false; LANES];
        for i in 0..LANES {
            is_taken[i] = is_asked[i] & (along < taps[0][i]) & (across < taps[1][i]);
        }
        let long = each(|i| lengths[0][i] * ((along + 0.5) / higher(taps[0][i], 1.0) - 0.5));
        let short = each(|i| lengths[1][i] * ((across + 0.5) / higher(taps[1][i], 1.0) - 0.5));
        let u = each(|i| u[i] + (x[i] * long[i] - y[i] * short[i]) * per_texel[0]);
        let v = each(|i| v[i] + (y[i] * long[i] + x[i] * short[i]) * per_texel[1]);
        picture.add_reads(vectors, &u, &v, &level, &weight, &is_taken, sums);
    }
}

/// Light that fog of a density lets through over a length: `exp(-density length)`, to 3e-7.
#[inline(always)]
pub(super) fn let_through(density: f32, length: &Lanes) -> Lanes {
    /// ln(2)^k / k!.
    const TERMS: [f32; 7] = [
        1.0,
        std::f32::consts::LN_2,
        0.240_226_5,
        0.055_504_11,
        0.009_618_129,
        0.001_333_356,
        0.000_154_035_3,
    ];
    each(|i| {
        let power = higher(-density * std::f32::consts::LOG2_E * length[i], -126.0);
        let whole = (power + 0.5).floor();
        let rest = power - whole;
        let mut value = TERMS[6];
        for k in (0..6).rev() {
            value = value.mul_add(rest, TERMS[k]);
        }
        value * f32::from_bits(((lower(whole, 0.0) as i32 + 127) as u32) << 23)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fog_lets_through_what_the_exponential_says() {
        for (density, step_m) in [(2e-4_f32, 0.37_f32), (0.01, 3.1), (1.0, 0.9)] {
            for block in 0..400 {
                let length = each(|i| step_m * (block * LANES + i) as f32);
                let found = let_through(density, &length);
                for i in 0..LANES {
                    let exact = (-f64::from(density) * f64::from(length[i])).exp();
                    // Of what the exponent itself is rounded to.
                    let allowed = 3e-7 + 2e-7 * f64::from(density * length[i]);
                    assert!(
                        (f64::from(found[i]) - exact).abs() <= allowed * exact + 2e-38,
                        "{density} {}: {} {exact}",
                        length[i],
                        found[i]
                    );
                }
            }
        }
        let nothing_left = let_through(1.0, &each(|i| if i % 2 == 0 { f32::INFINITY } else { 1e30 }));
        assert!(nothing_left.iter().all(|&left| (0.0..1e-37).contains(&left)));
    }
}
