//! Counter-based noise: a pure function of (seed, frame, pixel, stream), independent of order, machine and
//! restarts.
//!
//! f64 twin of `camsim-gpu/shaders/common/noise.wgsl`. It uses integer hashes and multiply-add only, so both
//! agree to rounding.

/// Octaves of tail probability that 24 bits reach.
const OCTAVES: usize = 24;
/// Linear segments per octave.
pub const SEGMENTS: usize = 16;
/// Stream of the sensor's additive Gaussian noise.
pub const NOISE_STREAM: u32 = 1;

/// Seed of the noise of a camera or another sensor. Without a name it is `seed`; with one it is
/// `splitmix64(seed ^ fnv1a64(name))`, the 64-bit FNV-1a hash of the name's UTF-8 bytes and the finaliser of
/// SplitMix64, so that the cameras of one run have different noise.
#[must_use]
pub(crate) fn camera_seed(seed: u64, name: &str) -> u64 {
    if name.is_empty() {
        return seed;
    }
    let hash = name.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    });
    let z = (seed ^ hash).wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Four well-mixed words from four key words (pcg4d: Jarzynski & Olano, JCGT 9(3), 2020).
///
/// The low 8 bits have a pattern; use bits 8 and up.
#[must_use]
#[inline(always)]
pub fn pcg4d(key: [u32; 4]) -> [u32; 4] {
    let [mut x, mut y, mut z, mut w] = key.map(|k| k.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    let mut mix = |fold: bool| {
        x = x.wrapping_add(y.wrapping_mul(w));
        y = y.wrapping_add(z.wrapping_mul(x));
        z = z.wrapping_add(x.wrapping_mul(y));
        w = w.wrapping_add(y.wrapping_mul(z));
        if fold {
            x ^= x >> 16;
            y ^= y >> 16;
            z ^= z >> 16;
            w ^= w >> 16;
        }
    };
    mix(true);
    mix(false);
    [x, y, z, w]
}

/// Quantiles `z(p)` of the upper tail of the standard normal at `p = 2^-(k+2) (1 + s/16)`, index `17 k + s`,
/// `s = 0..=16`.
#[must_use]
pub fn tail_table() -> Vec<f32> {
    let quantile = |octave: usize, segment: usize| {
        let p = (1.0 + segment as f64 / SEGMENTS as f64) * 0.5_f64.powi(octave as i32 + 2);
        upper_quantile(p) as f32
    };
    (0..OCTAVES).flat_map(|octave| (0..=SEGMENTS).map(move |segment| quantile(octave, segment))).collect()
}

/// [`tail_table`] as a shader reads it: the value at the begin of each segment and its increment, index `16 k
/// + s`, `s = 0..16`.
#[must_use]
pub fn tail_segments() -> Vec<[f32; 2]> {
    let table = tail_table();
    let of_octave =
        |octave: &[f32]| octave.windows(2).map(|ends| [ends[0], ends[1] - ends[0]]).collect::<Vec<_>>();
    table.chunks_exact(SEGMENTS + 1).flat_map(of_octave).collect()
}

/// Standard normal variate from 32 random bits by interpolation in [`tail_table`]. Bit 31 is the sign, bits
/// 30..8 the tail probability.
///
/// The values reach about 5.5 sigma.
#[must_use]
pub fn normal_from_bits(bits: u32, table: &[f32]) -> f32 {
    let m = (bits >> 8) & 0x7f_ffff;
    let x = 2 * m + 1;
    let lead = x.leading_zeros() - 8;
    let mantissa = (x << lead) & 0x7f_ffff;
    let t = (mantissa & 0x7_ffff) as f32 * (1.0 / 524_288.0);
    let i = lead as usize * (SEGMENTS + 1) + (mantissa >> 19) as usize;
    let value = table[i] + t * (table[i + 1] - table[i]);
    if bits >> 31 == 1 { -value } else { value }
}

/// Four independent standard normals of a pixel.
#[must_use]
pub(crate) fn normal4(pixel: [u32; 2], frame: u32, seed: u64, stream: u32, table: &[f32]) -> [f32; 4] {
    let key = [
        pixel[0] | (pixel[1] << 16),
        frame,
        seed as u32,
        (seed >> 32) as u32 ^ stream.wrapping_mul(0x9e37_79b9),
    ];
    pcg4d(key).map(|bits| normal_from_bits(bits, table))
}

/// Four words of sample `index` of a sensor, as [`pcg4d`].
#[must_use]
pub(crate) fn sample_words(index: i64, seed: u64, stream: u32) -> [u32; 4] {
    let index = index as u64;
    let stream = stream.wrapping_mul(0x9e37_79b9);
    pcg4d([index as u32, (index >> 32) as u32, seed as u32, (seed >> 32) as u32 ^ stream])
}

/// `z` with `1 - Phi(z) = p` for `0 < p <= 0.5`: Newton on an erfc continued fraction or series, to f64
/// rounding.
pub(crate) fn upper_quantile(p: f64) -> f64 {
    if p >= 0.5 {
        return 0.0;
    }
    // The formula 26.2.23 of Abramowitz & Stegun is accurate to 4.5e-4; Newton does the rest.
    let t = (-2.0 * p.ln()).sqrt();
    let numerator = 2.515_517 + t * (0.802_853 + t * 0.010_328);
    let denominator = 1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308));
    let mut z = t - numerator / denominator;
    for _ in 0..4 {
        let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
        z += (upper_tail(z) - p) / density;
    }
    z
}

/// `1 - Phi(z)` for `z >= 0`.
pub(crate) fn upper_tail(z: f64) -> f64 {
    let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
    if z < 3.0 {
        // Phi(z) = 1/2 + density * (z + z^3/3 + z^5/(3*5) + ...)
        let (mut term, mut sum) = (z, z);
        for k in 1..200 {
            term *= z * z / (2.0 * f64::from(k) + 1.0);
            sum += term;
            if term < 1e-18 * sum {
                break;
            }
        }
        0.5 - density * sum
    } else {
        // Laplace's continued fraction: density / (z + 1/(z + 2/(z + 3/(z + ...)))).
        density / (1..=120).rev().fold(z, |tail, k| z + f64::from(k) / tail)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_agree_with_published_values() {
        for (p, z) in [
            (0.25, 0.674_489_750_196_082),
            (0.025, 1.959_963_984_540_054),
            (1e-3, 3.090_232_306_167_813),
            (1e-6, 4.753_424_308_822_899),
        ] {
            assert!((upper_quantile(p) - z).abs() < 1e-9, "{p}: {}", upper_quantile(p));
        }
    }

    #[test]
    fn camera_name_changes_the_seed() {
        assert_eq!(camera_seed(12, ""), 12);
        let seeds = ["left", "right", "lefu", "a", "b"].map(|name| camera_seed(12, name));
        for (i, seed) in seeds.iter().enumerate() {
            assert!(*seed != 12 && !seeds[..i].contains(seed), "{seeds:?}");
        }
        // FNV-1a of "a" is af63dc4c8601ec8c (table of its authors); SplitMix64 begins with e220a8397b1dcdaf
        // from state 0 (Vigna's program).
        assert_eq!(camera_seed(0xaf63_dc4c_8601_ec8c, "a"), 0xe220_a839_7b1d_cdaf);
        // Different seeds stay different with the same name.
        assert_ne!(camera_seed(12, "left"), camera_seed(13, "left"));
    }

    #[test]
    fn tail_segments_match_the_table() {
        let (table, segments) = (tail_table(), tail_segments());
        assert_eq!(segments.len(), OCTAVES * SEGMENTS);
        for (i, [begin, adds]) in segments.into_iter().enumerate() {
            let first = i / SEGMENTS * (SEGMENTS + 1) + i % SEGMENTS;
            assert_eq!((begin, adds), (table[first], table[first + 1] - table[first]), "{i}");
        }
    }

    #[test]
    fn moments_and_tails_are_normal() {
        let table = tail_table();
        let (mut sums, mut beyond_3, n) = ([0.0_f64; 4], 0_u32, 1_000_000_u32);
        for i in 0..n / 4 {
            for z in normal4([i % 640, i / 640], 3, 12, NOISE_STREAM, &table) {
                let z = f64::from(z);
                for (power, sum) in sums.iter_mut().enumerate() {
                    *sum += z.powi(power as i32 + 1);
                }
                beyond_3 += u32::from(z.abs() > 3.0);
            }
        }
        let moment = sums.map(|s| s / f64::from(n));
        // Five standard errors of each estimate at n = 1e6.
        assert!(
            moment[0].abs() < 5e-3
                && (moment[1] - 1.0).abs() < 7.1e-3
                && moment[2].abs() < 0.02
                && (moment[3] - 3.0).abs() < 0.05,
            "{moment:?}"
        );
        assert!((f64::from(beyond_3) / f64::from(n) - 0.002_7).abs() < 2.6e-4, "{beyond_3}");
    }

    #[test]
    fn neighbours_frames_and_seeds_are_uncorrelated() {
        let table = tail_table();
        let noise = |x: u32, y: u32, frame: u32, seed: u64| {
            f64::from(normal4([x, y], frame, seed, NOISE_STREAM, &table)[0])
        };
        let mut sums = [0.0; 4];
        for y in 0..300 {
            for x in 0..300 {
                let z = noise(x, y, 7, 12);
                for (sum, other) in sums.iter_mut().zip([
                    noise(x + 1, y, 7, 12),
                    noise(x, y + 1, 7, 12),
                    noise(x, y, 8, 12),
                    noise(x, y, 7, 13),
                ]) {
                    *sum += z * other;
                }
            }
        }
        for sum in sums {
            assert!((sum / 90_000.0).abs() < 5.0 / 300.0, "{sums:?}");
        }
    }

    /// In place, unnormalised; the length is a power of two.
    fn fourier(values: &mut [[f64; 2]]) {
        let n = values.len();
        for i in 0..n {
            let j = i.reverse_bits() >> (usize::BITS - n.trailing_zeros());
            if i < j {
                values.swap(i, j);
            }
        }
        let mut half = 1;
        while half < n {
            for start in (0..n).step_by(2 * half) {
                for k in 0..half {
                    let (sin, cos) = (-std::f64::consts::PI * k as f64 / half as f64).sin_cos();
                    let (a, b) = (values[start + k], values[start + half + k]);
                    let turned = [b[0] * cos - b[1] * sin, b[0] * sin + b[1] * cos];
                    values[start + k] = [a[0] + turned[0], a[1] + turned[1]];
                    values[start + half + k] = [a[0] - turned[0], a[1] - turned[1]];
                }
            }
            half *= 2;
        }
    }

    /// Largest power of a bit plane at any frequency but 0, relative to its mean power: exponentially
    /// distributed for ideal noise.
    fn strongest_wave(bit: impl Fn(u32, u32) -> bool) -> f64 {
        const SIDE: usize = 64;
        let mut rows: Vec<Vec<[f64; 2]>> = (0..SIDE as u32)
            .map(|y| (0..SIDE as u32).map(|x| [if bit(x, y) { 1.0 } else { -1.0 }, 0.0]).collect())
            .collect();
        rows.iter_mut().for_each(|row| fourier(row));
        let mut strongest = 0.0_f64;
        for x in 0..SIDE {
            let mut column: Vec<[f64; 2]> = rows.iter().map(|row| row[x]).collect();
            fourier(&mut column);
            for ([re, im], y) in column.into_iter().zip(0..) {
                // At self-conjugate frequencies all power is in one real number, so half of it counts the
                // same on average.
                let real = x % (SIDE / 2) == 0 && y % (SIDE / 2) == 0;
                let power = (re * re + im * im) / (SIDE * SIDE) as f64;
                if (x, y) != (0, 0) {
                    strongest = strongest.max(if real { 0.5 * power } else { power });
                }
            }
        }
        strongest
    }

    #[test]
    fn used_bit_planes_have_no_pattern() {
        // 96 planes of 4096 frequencies: the strongest exceeds 27 once in a million times (4e5 exp(-27) =
        // 7e-7).
        const LIMIT: f64 = 27.0;
        let wave = |lane: usize, bit: u32| {
            let key = |x: u32, y: u32| [x | (y << 16), 7, 12, NOISE_STREAM.wrapping_mul(0x9e37_79b9)];
            strongest_wave(|x, y| pcg4d(key(x, y))[lane] >> bit & 1 == 1)
        };
        for lane in 0..4 {
            for bit in 8..32 {
                let power = wave(lane, bit);
                assert!(power < LIMIT, "lane {lane} bit {bit}: {power}");
            }
            // The low bits, which are not used, do have a pattern.
            assert!(wave(lane, 1) > 2.0 * LIMIT, "lane {lane}: {}", wave(lane, 1));
        }
    }
}
