//! Texture prefilter of the ideal frame, with as many taps as the plan says: twin of
//! camsim-gpu/shaders/ideal/surface.wgsl and camsim-gpu/shaders/ideal/prefilter.

use camsim_plan::PrefilterTaps;

use super::texture::{MipImage, NO_SUMS, Sums, colors as sums_of};
use crate::simd::{
    lanes::{LANES, Lanes, ZERO, fast_max, fast_min, per_lane},
    vectors::Vectors,
};

/// R G B A of each pixel.
pub(super) type Colors = [[f32; 4]; LANES];

/// Taps up to this distance apart, texels, need no coarser mip level.
const CLOSE_TEXELS: f32 = 0.8;
/// Variance (times 12) of the mip level for taps a texel apart.
const CELL_VARIANCE: f32 = 1.5;
/// Ratio of the longer axis to the shorter one (at least a texel) from which four taps form a row.
const ROW_RATIO: f32 = 1.6;
/// Grid: maximum number of taps along the longer axis, number along a wide shorter axis, and the width from
/// which that is wide, texels.
const MAX_TAPS: f32 = 32.0;
const SHORT_TAPS: f32 = 2.0;
const ONE_TAP: f32 = 0.5;
/// Bound of mip levels, which no texture reaches.
const MAX_LEVEL: f32 = 31.0;

/// Texture coordinates of pixels and their derivatives along x and y.
pub(super) struct TexCoords {
    pub uv: [Lanes; 2],
    pub across: [Lanes; 2],
    pub down: [Lanes; 2],
}

/// Footprints of pixels on the texture, as ellipses: axes in texels, and direction of the longer one.
struct Footprints {
    longer: Lanes,
    shorter: Lanes,
    direction: [Lanes; 2],
}

impl Footprints {
    #[inline(always)]
    fn new(tex_coords: &TexCoords, size: [f32; 2]) -> Self {
        let [across, down] = [&tex_coords.across, &tex_coords.down];
        let dx = [per_lane(|i| across[0][i] * size[0]), per_lane(|i| across[1][i] * size[1])];
        let dy = [per_lane(|i| down[0][i] * size[0]), per_lane(|i| down[1][i] * size[1])];
        let a = per_lane(|i| dx[0][i].mul_add(dx[0][i], dy[0][i] * dy[0][i]));
        let b = per_lane(|i| dx[0][i].mul_add(dx[1][i], dy[0][i] * dy[1][i]));
        let c = per_lane(|i| dx[1][i].mul_add(dx[1][i], dy[1][i] * dy[1][i]));
        let mean = per_lane(|i| 0.5 * (a[i] + c[i]));
        let half = per_lane(|i| 0.5 * (a[i] - c[i]));
        let spread = per_lane(|i| half[i].mul_add(half[i], b[i] * b[i]).sqrt());
        // Of the two expressions of the eigenvector, the one without cancellation; a circle has no longer
        // axis, any direction serves.
        let x = per_lane(|i| if half[i] >= 0.0 { half[i] + spread[i] } else { b[i] });
        let y = per_lane(|i| if half[i] >= 0.0 { b[i] } else { spread[i] - half[i] });
        let per_length = per_lane(|i| 1.0 / fast_max(x[i].mul_add(x[i], y[i] * y[i]).sqrt(), 1e-20));
        let direction = [
            per_lane(|i| if spread[i] > 1e-6 * mean[i] { x[i] * per_length[i] } else { 1.0 }),
            per_lane(|i| if spread[i] > 1e-6 * mean[i] { y[i] * per_length[i] } else { 0.0 }),
        ];
        Self {
            longer: per_lane(|i| (mean[i] + spread[i]).sqrt()),
            shorter: per_lane(|i| fast_max(mean[i] - spread[i], 0.0).sqrt()),
            direction,
        }
    }
}

/// Mip level for taps `cell` texels apart: its variance (times 12) beyond that of bilinear texels, and the
/// level.
#[inline(always)]
fn mip_level_for(cell: f32) -> [f32; 2] {
    let variance = CELL_VARIANCE * cell * cell;
    let texels2 = variance * (1.0 / 3.0) + 1.0;
    // Half of the binary exponent, rounded down, and 4 to its negative.
    let below = ((texels2.to_bits() >> 23) as i32 - 127) >> 1;
    let level =
        below as f32 + (texels2 * f32::from_bits(((127 - 2 * below) as u32) << 23) - 1.0) * (1.0 / 3.0);
    // Exactly 0 reads one level instead of two.
    if cell <= CLOSE_TEXELS { [0.0; 2] } else { [variance, level] }
}

/// Filtered colours of the active pixels.
#[inline(always)]
pub(super) fn filtered_colors(
    vectors: impl Vectors,
    texture: &MipImage,
    taps: PrefilterTaps,
    tex_coords: &TexCoords,
    is_active: &[bool; LANES],
) -> Colors {
    let footprints = Footprints::new(tex_coords, texture.size());
    let [u, v] = &tex_coords.uv;
    let mut sums = NO_SUMS;
    match taps {
        PrefilterTaps::One => {
            let level = per_lane(|i| mip_level_for(footprints.longer[i])[1]);
            texture.add_trilinear(vectors, u, v, &level, &[1.0; LANES], is_active, &mut sums);
        }
        PrefilterTaps::Two => {
            let (mut level, mut long) = (ZERO, ZERO);
            for i in 0..LANES {
                let [variance, of] =
                    mip_level_for(fast_max(0.5 * footprints.longer[i], footprints.shorter[i]));
                level[i] = of;
                // Taps at +-x have the variance x^2, a box of length l has l^2 / 12.
                long[i] = (fast_max(footprints.longer[i] * footprints.longer[i] - variance, 0.0)
                    * (1.0 / 12.0))
                    .sqrt();
            }
            add_pair(
                vectors,
                texture,
                tex_coords,
                &footprints,
                [&long, &ZERO],
                &level,
                0.5,
                is_active,
                &mut sums,
            );
        }
        PrefilterTaps::Four => add_four(vectors, texture, tex_coords, &footprints, is_active, &mut sums),
        PrefilterTaps::Grid => add_grid(vectors, texture, tex_coords, &footprints, is_active, &mut sums),
    }
    sums_of(&sums)
}

/// Adds two taps per pixel, at plus and minus an offset along both axes of the footprint, texels.
#[inline(always)]
fn add_pair(
    vectors: impl Vectors,
    texture: &MipImage,
    tex_coords: &TexCoords,
    footprints: &Footprints,
    [long, short]: [&Lanes; 2],
    level: &Lanes,
    weight: f32,
    is_active: &[bool; LANES],
    sums: &mut Sums,
) {
    let per_texel = texture.size().map(f32::recip);
    let ([x, y], [u, v]) = (&footprints.direction, &tex_coords.uv);
    let du = per_lane(|i| (x[i] * long[i] - y[i] * short[i]) * per_texel[0]);
    let dv = per_lane(|i| (y[i] * long[i] + x[i] * short[i]) * per_texel[1]);
    for sign in [1.0_f32, -1.0] {
        let (u, v) = (per_lane(|i| sign.mul_add(du[i], u[i])), per_lane(|i| sign.mul_add(dv[i], v[i])));
        texture.add_trilinear(vectors, &u, &v, level, &[weight; LANES], is_active, sums);
    }
}

/// Four taps: two by two for a footprint that is about square, four in a row for an elongated one.
#[inline(always)]
fn add_four(
    vectors: impl Vectors,
    texture: &MipImage,
    tex_coords: &TexCoords,
    footprints: &Footprints,
    is_active: &[bool; LANES],
    sums: &mut Sums,
) {
    let (mut level, mut first, mut second) = (ZERO, [ZERO; 2], [ZERO; 2]);
    for i in 0..LANES {
        let (longer, shorter) = (footprints.longer[i], footprints.shorter[i]);
        let is_square = longer < ROW_RATIO * fast_max(shorter, 1.0);
        let [variance, of] =
            mip_level_for(if is_square { 0.5 * longer } else { fast_max(0.25 * longer, shorter) });
        level[i] = of;
        // Taps at +-x have the variance x^2, taps at +-x and +-3 x have 5 x^2; a box of length l has l^2 /
        // 12.
        let long2 = fast_max(longer * longer - variance, 0.0) * (1.0 / 12.0);
        let short2 = fast_max(shorter * shorter - variance, 0.0) * (1.0 / 12.0);
        let long = (if is_square { long2 } else { 0.2 * long2 }).sqrt();
        let short = if is_square { short2.sqrt() } else { 0.0 };
        (first[0][i], first[1][i]) = (if is_square { long } else { 3.0 * long }, short);
        (second[0][i], second[1][i]) = (long, -short);
    }
    for [long, short] in [&first, &second] {
        add_pair(vectors, texture, tex_coords, footprints, [long, short], &level, 0.25, is_active, sums);
    }
}

/// Variance (times 12) of a mip level beyond that of bilinear texels, blended between whole levels.
#[inline(always)]
fn mip_variance(level: f32) -> f32 {
    let below = level.floor();
    // 4 to its power; levels are below 32.
    let power = f32::from_bits(((127 + 2 * below as i32) as u32) << 23);
    3.0 * (power + (level - below) * 3.0 * power - 1.0)
}

/// Grid: one or two taps across, and as many along the longer axis as keep the cells square.
#[inline(always)]
fn add_grid(
    vectors: impl Vectors,
    texture: &MipImage,
    tex_coords: &TexCoords,
    footprints: &Footprints,
    is_active: &[bool; LANES],
    sums: &mut Sums,
) {
    let (mut level, mut taps, mut lengths) = (ZERO, [ZERO; 2], [ZERO; 2]);
    let tap_length = |side: f32, taps: f32, variance: f32| {
        (fast_max(side * side - variance, 0.0) / fast_max(1.0 - 1.0 / (taps * taps), 0.5)).sqrt()
    };
    for i in (0..LANES).filter(|&i| is_active[i]) {
        let (longer, shorter) = (footprints.longer[i], footprints.shorter[i]);
        let short_taps = if shorter > ONE_TAP { SHORT_TAPS } else { 1.0 };
        let covered = fast_max(shorter / short_taps, 1.0);
        let long_taps = fast_min(fast_max((longer / covered - 0.1).ceil(), short_taps), MAX_TAPS);
        let side = fast_max(longer / long_taps, covered);
        level[i] = if side > 1.0 { fast_min(side.log2(), MAX_LEVEL) } else { 0.0 };
        let variance = mip_variance(level[i]);
        (taps[0][i], taps[1][i]) = (long_taps, short_taps);
        (lengths[0][i], lengths[1][i]) =
            (tap_length(longer, long_taps, variance), tap_length(shorter, short_taps, variance));
    }
    let per_texel = texture.size().map(f32::recip);
    let ([x, y], [u, v]) = (&footprints.direction, &tex_coords.uv);
    let most = |of: &Lanes| of.iter().fold(0.0, |most, &taps| fast_max(most, taps)) as u32;
    let weight = per_lane(|i| 1.0 / fast_max(taps[0][i] * taps[1][i], 1.0));
    for (direction, across) in (0..most(&taps[0]))
        .flat_map(|direction| (0..most(&taps[1])).map(move |across| (direction as f32, across as f32)))
    {
        let mut is_taken = [false; LANES];
        for i in 0..LANES {
            is_taken[i] = is_active[i] & (direction < taps[0][i]) & (across < taps[1][i]);
        }
        let long = per_lane(|i| lengths[0][i] * ((direction + 0.5) / fast_max(taps[0][i], 1.0) - 0.5));
        let short = per_lane(|i| lengths[1][i] * ((across + 0.5) / fast_max(taps[1][i], 1.0) - 0.5));
        let u = per_lane(|i| u[i] + (x[i] * long[i] - y[i] * short[i]) * per_texel[0]);
        let v = per_lane(|i| v[i] + (y[i] * long[i] + x[i] * short[i]) * per_texel[1]);
        texture.add_trilinear(vectors, &u, &v, &level, &weight, &is_taken, sums);
    }
}

/// Transmittance of fog: `exp(-density length)`, to 3e-7.
#[inline(always)]
pub(super) fn fog_transmittance(density: f32, length: &Lanes) -> Lanes {
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
    per_lane(|i| {
        let power = fast_max(-density * std::f32::consts::LOG2_E * length[i], -126.0);
        let integer = (power + 0.5).floor();
        let rest = power - integer;
        let mut value = TERMS[6];
        for k in (0..6).rev() {
            value = value.mul_add(rest, TERMS[k]);
        }
        value * f32::from_bits(((fast_min(integer, 0.0) as i32 + 127) as u32) << 23)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fog_transmittance_equals_the_exponential() {
        for (density, step_m) in [(2e-4_f32, 0.37_f32), (0.01, 3.1), (1.0, 0.9)] {
            for block in 0..400 {
                let length = per_lane(|i| step_m * (block * LANES + i) as f32);
                let found = fog_transmittance(density, &length);
                for i in 0..LANES {
                    let exact = (-f64::from(density) * f64::from(length[i])).exp();
                    // Plus the rounding of the exponent.
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
        let nothing_left =
            fog_transmittance(1.0, &per_lane(|i| if i % 2 == 0 { f32::INFINITY } else { 1e30 }));
        assert!(nothing_left.iter().all(|&left| (0.0..1e-37).contains(&left)));
    }
}
