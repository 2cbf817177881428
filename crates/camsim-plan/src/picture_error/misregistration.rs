//! Misregistration: picture error by sources beside their position.
//!
//! A pixel shows the waves of its texture, of frequencies `f` (cycles a pixel of the camera) and with the
//! power that its area and the exposure leave of them. Moved by `e` pixels in any direction a wave differs
//! from itself, squared and in the mean over directions, by
//!
//! ```text
//! mean |exp(2 pi i f.e) - 1|^2 = 2 (1 - J0(2 pi |f| |e|))
//! ```
//!
//! of its power: `(2 pi f e)^2 / 2` for small `e`, twice the power where nothing is as it was. Where sources
//! are displaced and by how much are taken to have nothing to do with what is seen there; where a
//! displacement changes within the exposure, a part of it that the mean takes back is counted, on the safe
//! side. Silhouettes are not in it (`silhouettes.rs`).

use std::f64::consts::{FRAC_PI_4, LN_2, PI, TAU};

use camsim_core::transfer::sinc;
use glam::{DMat2, DVec2};

use super::texture_probes::{TextureProbe, TextureProbes};
use crate::ir::margins;

/// Frequencies that count: two an octave from the lowest up, cycles a pixel, in so many directions of a
/// half-plane.
const LOWEST: f64 = 1.0 / 256.0;
const AN_OCTAVE: u32 = 2;
const OCTAVES: u32 = 9;
const DIRECTIONS: u32 = 4;
/// Arguments below which three terms of the series of J0 are exact to 1e-9, where the polynomials leave
/// hardly a digit of what it lacks of 1.
const SMALL: f64 = 0.3;

/// Power of what the pixels of a frame show, mean over the picture, by frequency.
pub(crate) struct ShownSpectrum {
    /// Cycles a pixel, and power of the linear range.
    rings: Vec<(f64, f64)>,
}

impl ShownSpectrum {
    pub fn new(probes: &TextureProbes<'_>, exposed: bool) -> Self {
        let ring = |i: u32| {
            let cycles = LOWEST * ((f64::from(i) + 0.5) / f64::from(AN_OCTAVE)).exp2();
            let ring_power = |probe: &TextureProbe<'_>| {
                probe.weight * probe.gain * probe.gain * probe.power_at(cycles, exposed)
            };
            (cycles, probes.probes.iter().map(ring_power).sum::<f64>() / (probes.counted as f64).max(1.0))
        };
        Self { rings: (0..OCTAVES * AN_OCTAVE).map(ring).collect() }
    }

    /// RMS error over the picture, 1/255 of the linear range, of sources that are so far off, pixels of the
    /// camera.
    pub fn misregistration_dn(&self, px: impl ExactSizeIterator<Item = f64>) -> f64 {
        let count = px.len().max(1) as f64;
        // Of nothing at all `sum` is -0.
        margins::TEXTURES * 255.0 * (px.fold(0.0, |sum, px| sum + self.misregistration2(px)) / count).sqrt()
    }

    /// Mean squared error of a pixel whose source is so far off, of the linear range.
    fn misregistration2(&self, px: f64) -> f64 {
        self.rings.iter().fold(0.0, |sum, (cycles, power)| sum + power * moved2(TAU * cycles * px))
    }
}

/// `2 (1 - J0(x))`.
fn moved2(x: f64) -> f64 {
    let x2 = x * x;
    if x < SMALL { 0.5 * x2 * (1.0 - x2 / 16.0 + x2 * x2 / 576.0) } else { 2.0 * (1.0 - bessel_j0(x)) }
}

impl TextureProbe<'_> {
    /// Power that a pixel shows of the waves of a frequency, cycles a pixel of the camera, of the ring that
    /// it stands for.
    fn power_at(&self, cycles: f64, exposed: bool) -> f64 {
        let texel_cycles: DMat2 = self.texel_from_key.inverse().transpose();
        let sides = self.key_from_camera * self.camera_from_px;
        // A half-plane: the other half is its mirror image.
        let area = 2.0 * cycles * cycles * LN_2 / f64::from(AN_OCTAVE) * PI / f64::from(DIRECTIONS);
        let of_direction = |j: u32| {
            let f = cycles * DVec2::from_angle(PI * (f64::from(j) + 0.5) / f64::from(DIRECTIONS));
            let nu = texel_cycles * f;
            let over_exposure = if exposed { sinc(self.path.dot(f)) } else { 1.0 };
            let left = (sinc(nu.x) * sinc(nu.y)).powi(2)
                * sinc(sides.x_axis.dot(f))
                * sinc(sides.y_axis.dot(f))
                * over_exposure;
            self.spectrum.density_at(nu) * left * left
        };
        area / self.texel_from_key.determinant().abs() * (0..DIRECTIONS).map(of_direction).sum::<f64>()
    }
}

/// Bessel function of the first kind and order 0, to 1e-7: Abramowitz and Stegun, 9.4.1 and 9.4.3.
fn bessel_j0(x: f64) -> f64 {
    let polynomial = |coefficients: &[f64], x: f64| {
        coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient)
    };
    if !x.is_finite() {
        return 0.0;
    }
    let x = x.abs();
    if x <= 3.0 {
        const NEAR: [f64; 7] =
            [1.0, -2.249_999_7, 1.265_620_8, -0.316_386_6, 0.044_447_9, -0.003_944_4, 0.000_210_0];
        return polynomial(&NEAR, (x / 3.0).powi(2));
    }
    const SIZE: [f64; 7] = [
        0.797_884_56,
        -0.000_000_77,
        -0.005_527_40,
        -0.000_095_12,
        0.001_372_37,
        -0.000_728_05,
        0.000_144_76,
    ];
    const PHASE: [f64; 7] =
        [-FRAC_PI_4, -0.041_663_97, -0.000_039_54, 0.002_625_73, -0.000_541_25, -0.000_293_33, 0.000_135_58];
    let inverse = 3.0 / x;
    polynomial(&SIZE, inverse) / x.sqrt() * (x + polynomial(&PHASE, inverse)).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of cos(x cos a) over directions is J0(x): its own definition, by the midpoint rule, which is
    /// exact for such to 1e-15.
    #[test]
    fn j0_is_the_mean_over_directions() {
        for x in [0.0, 1e-3, 0.1, 1.0, 2.404_825_557_7, 2.999, 3.001, 10.0, 100.0] {
            let mean =
                (0..400).map(|i| (x * (TAU * (f64::from(i) + 0.5) / 400.0).cos()).cos()).sum::<f64>() / 400.0;
            assert!((bessel_j0(x) - mean).abs() < 1e-7, "{x}: {} {mean}", bessel_j0(x));
            assert_eq!(bessel_j0(-x), bessel_j0(x));
        }
        assert_eq!(bessel_j0(f64::INFINITY), 0.0);
    }

    #[test]
    fn misregistration_of_a_wave_is_that_of_drawn_waves() {
        // Of variance 0.02, eight pixels long.
        let one = ShownSpectrum { rings: vec![(0.125, 0.02)] };
        let drawn2 = |px: f64| {
            let amplitude = (2.0 * 0.02_f64).sqrt();
            let count = 64;
            let error2 = |direction: u32, phase: u32| {
                let moved = px * (TAU * f64::from(direction) / f64::from(count)).cos();
                let at = |x: f64| amplitude * (TAU * (0.125 * x + f64::from(phase) / f64::from(count))).sin();
                (at(moved) - at(0.0)).powi(2)
            };
            (0..count)
                .flat_map(|direction| (0..count).map(move |phase| error2(direction, phase)))
                .sum::<f64>()
                / f64::from(count * count)
        };
        for px in [0.001, 0.05, 0.3, 1.0, 4.0, 9.0, 40.0] {
            let (found, drawn) = (one.misregistration2(px), drawn2(px));
            assert!((found / drawn - 1.0).abs() < 1e-5, "{px}: {found} {drawn}");
        }
        let dn = one.misregistration_dn([0.3, 4.0].into_iter());
        let expected = margins::TEXTURES * 255.0 * (0.5 * (drawn2(0.3) + drawn2(4.0))).sqrt();
        assert!(
            (dn / expected - 1.0).abs() < 1e-5 && one.misregistration_dn([].into_iter()) == 0.0,
            "{dn} {expected}"
        );
    }
}
