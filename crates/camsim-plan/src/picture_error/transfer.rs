//! What the stages between a texture and a pixel leave of a wave: transfer functions.
//!
//! Frequencies `f` are cycles an ideal pixel, `nu` cycles a texel; `sinc(x) = sin(pi x) / (pi x)`.
//!
//! | stage | leaves |
//! |---|---|
//! | texture, bilinear between texels | `sinc^2(nu_x) sinc^2(nu_y)` |
//! | surface filter, some reads of a smaller version | mean over the reads, times what a version of 2^m texels has |
//! | bilinear read between ideal pixels | `sinc^2(f_x) sinc^2(f_y)`, and as much of `f + k` for whole `k` |
//! | spline | that of Catmull and Rom's kernel and of the B-spline, mixed by softness; the same aliases |
//! | mean over an area of the sides `a` | `sinc(f_x) sinc(a_x f_x) sinc(f_y) sinc(a_y f_y)`; the same aliases |
//! | grid of reads, samples on a path | `sin(pi n x) / (n sin(pi x))` of the step along each |
//! | exact: mean over the pixel's sides and the path | `sinc` of each |

mod alias;
#[cfg(test)]
mod exact;
mod lanes;
mod reads;
mod waves;

pub(crate) use alias::{PlacedWave, ReadSpan, SampledPath, Transfer};
pub(crate) use reads::read_waves;
pub(crate) use waves::{TextureWaves, error2};

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use camsim_core::{
        temporal::{ColorImage, Footprint, Kernel},
        transfer::sin_pi,
    };
    use glam::DVec2;

    use super::exact::read;

    /// A wave read between the pixels of a picture, over positions and phases: mean squared difference from
    /// `exact` times the wave itself.
    fn measured(f: DVec2, kernel: Kernel, at: DVec2, exact: f64) -> f64 {
        let turns = 12;
        let size_px = [24, 24];
        let area = Footprint { dx: DVec2::ZERO, dy: DVec2::ZERO, taps: [1, 1], kernel };
        let wave = |px: DVec2, phase: f64| (2.0 * PI * f.dot(px) + phase).cos();
        let squares = (0..turns).map(|turn| {
            let phase = 2.0 * PI * f64::from(turn) / f64::from(turns);
            let value = |i: u32| wave(DVec2::new(f64::from(i % 24), f64::from(i / 24)), phase) as f32;
            let rgba: Vec<f32> = (0..24 * 24).flat_map(|i| [value(i), 0.0, 0.0, 1.0]).collect();
            let px = DVec2::new(11.0, 12.0) + at;
            (area.tap_color(&ColorImage { size_px, rgba: &rgba }, px, 0).x - exact * wave(px, phase)).powi(2)
        });
        squares.sum::<f64>() / f64::from(turns)
    }

    #[test]
    fn reads_between_pixels_have_the_transfer_and_aliases_of_their_kernels() {
        let splines = [0.0, 0.4].map(|softness| Kernel::Spline(DVec2::splat(softness)));
        let areas = [[1.0, 1.0], [1.3, 2.1], [3.0, 4.2]].map(|sides_px| Kernel::Area(sides_px.into()));
        for kernel in [Kernel::Bilinear].into_iter().chain(splines).chain(areas) {
            for f in [DVec2::new(0.11, 0.05), DVec2::new(0.3, -0.2), DVec2::new(0.45, 0.4)] {
                for at in [DVec2::ZERO, DVec2::new(0.5, 0.5), DVec2::new(0.2, 0.7)] {
                    let exact = 0.8;
                    let left: DVec2 = (-40..=40)
                        .flat_map(|x| (-40..=40).map(move |y| DVec2::new(f64::from(x), f64::from(y))))
                        .map(|away| {
                            read(kernel, 0, (f + away).x)
                                * read(kernel, 1, (f + away).y)
                                * DVec2::from_angle(2.0 * PI * away.dot(at))
                        })
                        .sum();
                    // The mean square of a real wave is half of its squared amplitude.
                    let expected = 0.5 * (left - DVec2::new(exact, 0.0)).length_squared();
                    let found = measured(f, kernel, at, exact);
                    // Further aliases, and the four corners that the spline leaves out.
                    assert!(
                        (found.sqrt() - expected.sqrt()).abs() < 0.01,
                        "{kernel:?} {f} {at}: {found:.5} {expected:.5}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_polynomial_sine_is_exact_to_its_bound() {
        for i in -4000..4000 {
            let x = f64::from(i) * 0.003_7;
            assert!((sin_pi(x) - (PI * x).sin()).abs() < 3e-11, "{x}: {}", sin_pi(x) - (PI * x).sin());
        }
        assert!((sin_pi(1e6 + 0.25) - 0.5_f64.sqrt()).abs() < 3e-11);
    }
}
