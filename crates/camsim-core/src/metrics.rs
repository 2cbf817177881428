//! Metrics of the difference of two images.
//!
//! RMSE and the largest difference are over all samples of all colour channels, with values as stored (1 is
//! white). SSIM is that of Wang, Bovik, Sheikh & Simoncelli, "Image quality assessment: from error visibility
//! to structural similarity", IEEE TIP 13(4), 2004: Gaussian window of 11 x 11 with sigma 1.5, K1 = 0.01, K2
//! = 0.03, L = 1, over windows entirely inside the image.

use thiserror::Error;

use crate::scene::LUMINANCE_F64;

/// Interleaved samples, row-major from the top-left pixel.
#[derive(Clone, Copy, Debug)]
pub struct ImageView<'a> {
    /// Width, height.
    pub size_px: [u32; 2],
    /// Samples per pixel, at least 1.
    pub channels: usize,
    /// Index of the alpha or validity channel, which counts for `differing` only.
    pub alpha: Option<usize>,
    /// `size_px[0] * size_px[1] * channels` samples.
    pub samples: &'a [f32],
}

/// Why two images cannot be compared.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum MetricError {
    /// Different sizes.
    #[error("the sizes differ: {}x{} against {}x{}; compare images of equal size", a[0], a[1], b[0], b[1])]
    Size {
        /// Size of the first image.
        a: [u32; 2],
        /// Size of the second image.
        b: [u32; 2],
    },
    /// Different channel counts.
    #[error("the channels differ: {a} against {b} per pixel; write both with the same channels")]
    Channels {
        /// Channels of the first image.
        a: usize,
        /// Channels of the second image.
        b: usize,
    },
    /// The samples do not fill the image, or there are none.
    #[error("an image of {}x{} with {channels} channels needs {needed} samples (at least one), and has {found}", size_px[0], size_px[1])]
    Samples {
        /// Size stated.
        size_px: [u32; 2],
        /// Channels stated.
        channels: usize,
        /// Number of samples needed.
        needed: usize,
        /// Number of samples given.
        found: usize,
    },
}

/// Differences between two images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Root of the mean square difference over colour samples that are finite in both images. NaN, as `max` and
    /// `ssim`, if a NaN or an infinity of one image faces another value.
    pub rmse: f64,
    /// Largest absolute difference over the same samples.
    pub max: f64,
    /// Structural similarity of luminance; `None` below 11 pixels of width or height.
    pub ssim: Option<f64>,
    /// Fraction of pixels in which any sample differs, including alpha, 0..=1.
    pub differing: f64,
    /// Number of pixels with a NaN or an infinity in either image. `rmse`, `max` and `ssim` leave out those that
    /// are alike.
    pub non_finite: u64,
    /// Pixels compared.
    pub pixels: u64,
    /// Number of colour samples in `rmse`.
    pub samples: u64,
}

impl Comparison {
    /// Peak signal-to-noise ratio in decibels for a peak of 1; infinite for equal images.
    pub fn psnr_db(&self) -> f64 {
        -20.0 * self.rmse.log10()
    }

    /// Pooled comparison of a set of images: RMSE, fraction and counts over all, largest maximum, mean SSIM.
    /// `None` for an empty set.
    pub fn pooled(set: &[Self]) -> Option<Self> {
        let pixels: u64 = set.iter().map(|c| c.pixels).sum();
        let samples: u64 = set.iter().map(|c| c.samples).sum();
        if set.is_empty() {
            return None;
        }
        let squares: f64 = set.iter().map(|c| c.rmse * c.rmse * c.samples as f64).sum();
        let differing: f64 = set.iter().map(|c| c.differing * c.pixels as f64).sum();
        let ssims: Vec<f64> = set.iter().filter_map(|c| c.ssim).collect();
        Some(Self {
            rmse: if samples == 0 { squares } else { (squares / samples as f64).sqrt() },
            max: set
                .iter()
                .map(|c| c.max)
                .fold(0.0, |a, b| if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }),
            ssim: (!ssims.is_empty()).then(|| ssims.iter().sum::<f64>() / ssims.len() as f64),
            differing: differing / pixels as f64,
            non_finite: set.iter().map(|c| c.non_finite).sum(),
            pixels,
            samples,
        })
    }
}

/// Compares two images of equal size and layout.
///
/// # Errors
/// If sizes or channel counts differ, or an image is empty or incomplete.
pub fn compare(a: ImageView<'_>, b: ImageView<'_>) -> Result<Comparison, MetricError> {
    if a.size_px != b.size_px {
        return Err(MetricError::Size { a: a.size_px, b: b.size_px });
    }
    if a.channels != b.channels {
        return Err(MetricError::Channels { a: a.channels, b: b.channels });
    }
    for view in [a, b] {
        let needed = view.size_px[0] as usize * view.size_px[1] as usize * view.channels;
        if needed == 0 || view.samples.len() != needed {
            return Err(MetricError::Samples {
                size_px: view.size_px,
                channels: view.channels,
                needed,
                found: view.samples.len(),
            });
        }
    }

    let (mut squares, mut max, mut samples, mut differing, mut non_finite) =
        (0.0_f64, 0.0_f64, 0_u64, 0_u64, 0_u64);
    let mut comparable = true;
    let mut usable = Vec::with_capacity(a.samples.len() / a.channels);
    for (pixel_a, pixel_b) in a.samples.chunks_exact(a.channels).zip(b.samples.chunks_exact(b.channels)) {
        let same = |(x, y): (&f32, &f32)| x == y || x.to_bits() == y.to_bits();
        differing += u64::from(!pixel_a.iter().zip(pixel_b).all(same));
        let finite = pixel_a.iter().chain(pixel_b).all(|value| value.is_finite());
        usable.push(finite);
        if !finite {
            non_finite += 1;
            comparable &= pixel_a.iter().zip(pixel_b).all(|(x, y)| are_comparable(*x, *y));
            continue;
        }
        for (channel, (&x, &y)) in pixel_a.iter().zip(pixel_b).enumerate() {
            if a.alpha != Some(channel) {
                let difference = f64::from(x) - f64::from(y);
                squares += difference * difference;
                max = max.max(difference.abs());
                samples += 1;
            }
        }
    }
    let pixels = usable.len() as u64;
    // No number says how far a picture is from one with NaN.
    let told = |figure: f64| if comparable { figure } else { f64::NAN };
    let ssim = ssim(&luminance(a, &usable), &luminance(b, &usable), a.size_px);
    Ok(Comparison {
        rmse: told(if samples == 0 { 0.0 } else { (squares / samples as f64).sqrt() }),
        max: told(max),
        ssim: ssim.map(told),
        differing: differing as f64 / pixels as f64,
        non_finite,
        pixels,
        samples,
    })
}

/// Whether two samples have a difference, or are alike without one.
fn are_comparable(x: f32, y: f32) -> bool {
    x == y || x.is_finite() && y.is_finite() || x.is_nan() && y.is_nan()
}

/// Rec. 709 luminance of three or more channels, else the first channel; unusable pixels are 0 in both
/// images.
fn luminance(view: ImageView<'_>, usable: &[bool]) -> Vec<f64> {
    let value = |pixel: &[f32]| match pixel {
        [r, g, b, ..] => {
            let [of_r, of_g, of_b] = LUMINANCE_F64;
            of_r * f64::from(*r) + of_g * f64::from(*g) + of_b * f64::from(*b)
        }
        [first, ..] => f64::from(*first),
        [] => 0.0,
    };
    view.samples
        .chunks_exact(view.channels)
        .zip(usable)
        .map(|(pixel, &ok)| if ok { value(pixel) } else { 0.0 })
        .collect()
}

const WINDOW: usize = 11;
const SIGMA_PX: f64 = 1.5;

fn ssim(a: &[f64], b: &[f64], size_px: [u32; 2]) -> Option<f64> {
    let [width, height] = size_px.map(|side| side as usize);
    if width < WINDOW || height < WINDOW {
        return None;
    }
    let product = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).collect::<Vec<_>>();
    let mean_a = blur(a, width);
    let mean_b = blur(b, width);
    let square_a = blur(&product(a, a), width);
    let square_b = blur(&product(b, b), width);
    let cross = blur(&product(a, b), width);
    let (c1, c2) = (0.01_f64.powi(2), 0.03_f64.powi(2));
    let sum: f64 = (0..mean_a.len())
        .map(|i| {
            let (ma, mb) = (mean_a[i], mean_b[i]);
            let (va, vb, vab) = (square_a[i] - ma * ma, square_b[i] - mb * mb, cross[i] - ma * mb);
            (2.0 * ma * mb + c1) * (2.0 * vab + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2))
        })
        .sum();
    Some(sum / mean_a.len() as f64)
}

/// Separable Gaussian over windows entirely inside: the result is smaller by `WINDOW - 1`.
fn blur(values: &[f64], width: usize) -> Vec<f64> {
    let half = (WINDOW / 2) as f64;
    let mut kernel: [f64; WINDOW] =
        std::array::from_fn(|i| (-(i as f64 - half).powi(2) / (2.0 * SIGMA_PX * SIGMA_PX)).exp());
    let total: f64 = kernel.iter().sum();
    kernel.iter_mut().for_each(|k| *k /= total);
    let weigh =
        |taps: &mut dyn Iterator<Item = f64>| taps.zip(&kernel).map(|(value, k)| value * k).sum::<f64>();

    let narrow = width + 1 - WINDOW;
    let rows: Vec<f64> = values
        .chunks_exact(width)
        .flat_map(|row| row.windows(WINDOW).map(|taps| weigh(&mut taps.iter().copied())).collect::<Vec<_>>())
        .collect();
    let height = rows.len() / narrow + 1 - WINDOW;
    (0..height * narrow).map(|i| weigh(&mut rows[i..].iter().step_by(narrow).take(WINDOW).copied())).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    fn view(size_px: [u32; 2], channels: usize, samples: &[f32]) -> ImageView<'_> {
        ImageView { size_px, channels, alpha: (channels == 4).then_some(3), samples }
    }

    fn ramp(n: usize) -> Vec<f32> {
        (0..n).map(|i| ((i * 37) % 101) as f32 / 101.0).collect()
    }

    #[test]
    fn equal_pictures() {
        let a = ramp(16 * 12 * 3);
        let c = compare(view([16, 12], 3, &a), view([16, 12], 3, &a)).unwrap();
        assert_eq!((c.rmse, c.max, c.differing, c.non_finite), (0.0, 0.0, 0.0, 0));
        assert_eq!(c.psnr_db(), f64::INFINITY);
        assert!((c.ssim.unwrap() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_constant_offset_has_a_known_rmse_and_psnr() {
        let a = vec![0.25_f32; 400];
        let b = vec![0.35_f32; 400];
        let c = compare(view([20, 20], 1, &a), view([20, 20], 1, &b)).unwrap();
        assert!((c.rmse - 0.1).abs() < 1e-7 && (c.max - 0.1).abs() < 1e-7);
        assert!((c.psnr_db() - 20.0).abs() < 1e-5);
        assert_eq!(c.differing, 1.0);
        // Constants have no variance, so SSIM reduces to its luminance term.
        let expected = (2.0 * 0.25 * 0.35 + 1e-4) / (0.25 * 0.25 + 0.35 * 0.35 + 1e-4);
        assert!((c.ssim.unwrap() - expected).abs() < 1e-6);
    }

    #[test]
    fn ssim_agrees_with_its_definition_by_direct_summation() {
        let (w, h) = (14_usize, 13_usize);
        let a: Vec<f32> = ramp(w * h);
        let b: Vec<f32> = a.iter().enumerate().map(|(i, v)| v * 0.8 + 0.1 * ((i % 5) as f32 / 5.0)).collect();
        let weight = |dx: i32, dy: i32| (-f64::from(dx * dx + dy * dy) / 4.5).exp();
        let norm: f64 = (-5..=5).flat_map(|y| (-5..=5).map(move |x| weight(x, y))).sum();
        let mut sum = 0.0;
        for cy in 5..h - 5 {
            for cx in 5..w - 5 {
                let mut m = [0.0_f64; 5];
                for dy in -5_i32..=5 {
                    for dx in -5_i32..=5 {
                        let i = (cy as i32 + dy) as usize * w + (cx as i32 + dx) as usize;
                        let (x, y, k) = (f64::from(a[i]), f64::from(b[i]), weight(dx, dy) / norm);
                        for (m, v) in m.iter_mut().zip([x, y, x * x, y * y, x * y]) {
                            *m += k * v;
                        }
                    }
                }
                let [ma, mb, aa, bb, ab] = m;
                sum += (2.0 * ma * mb + 1e-4) * (2.0 * (ab - ma * mb) + 9e-4)
                    / ((ma * ma + mb * mb + 1e-4) * (aa - ma * ma + bb - mb * mb + 9e-4));
            }
        }
        let expected = sum / ((w - 10) * (h - 10)) as f64;
        let c = compare(view([w as u32, h as u32], 1, &a), view([w as u32, h as u32], 1, &b)).unwrap();
        assert!((c.ssim.unwrap() - expected).abs() < 1e-12);
    }

    #[test]
    fn alpha_counts_for_differing_only() {
        let a = vec![0.5_f32; 16];
        let mut b = a.clone();
        b[3] = 0.0;
        let c = compare(view([2, 2], 4, &a), view([2, 2], 4, &b)).unwrap();
        assert_eq!((c.rmse, c.differing, c.ssim), (0.0, 0.25, None));
    }

    #[test]
    fn values_that_are_not_finite_are_counted_and_left_out_where_alike() {
        let mut a = vec![0.5_f32; 4];
        let mut b = a.clone();
        a[0] = f32::NAN;
        b[0] = -f32::NAN;
        (a[1], b[1]) = (f32::INFINITY, f32::INFINITY);
        b[2] = 0.75;
        let alike = compare(view([4, 1], 1, &a), view([4, 1], 1, &b)).unwrap();
        assert_eq!((alike.non_finite, alike.differing, alike.max, alike.samples), (2, 0.5, 0.25, 2));
        for other in [0.5, f32::NAN, f32::NEG_INFINITY] {
            b[1] = other;
            let c = compare(view([4, 1], 1, &a), view([4, 1], 1, &b)).unwrap();
            assert!(c.rmse.is_nan() && c.max.is_nan() && c.psnr_db().is_nan() && c.non_finite == 2);
            for set in [[c, alike], [alike, c]] {
                let both = Comparison::pooled(&set).unwrap();
                assert!(both.rmse.is_nan() && both.max.is_nan(), "{both:?}");
            }
        }
        let (empty, black) = (vec![f32::NAN; 144], vec![0.0; 144]);
        let c = compare(view([12, 12], 1, &empty), view([12, 12], 1, &black)).unwrap();
        assert!(
            c.rmse.is_nan() && c.ssim.unwrap().is_nan() && Comparison::pooled(&[c]).unwrap().rmse.is_nan()
        );
        assert_eq!(compare(view([12, 12], 1, &empty), view([12, 12], 1, &empty)).unwrap().rmse, 0.0);
    }

    #[test]
    fn mismatched_images_are_refused() {
        let a = vec![0.0_f32; 6];
        assert!(matches!(compare(view([3, 2], 1, &a), view([2, 3], 1, &a)), Err(MetricError::Size { .. })));
        assert!(matches!(
            compare(view([3, 2], 1, &a), view([3, 2], 3, &a)),
            Err(MetricError::Channels { .. })
        ));
        assert!(matches!(
            compare(view([3, 3], 1, &a), view([3, 3], 1, &a)),
            Err(MetricError::Samples { .. })
        ));
        assert!(matches!(
            compare(view([0, 0], 1, &[]), view([0, 0], 1, &[])),
            Err(MetricError::Samples { .. })
        ));
    }

    #[test]
    fn a_set_is_pooled_by_samples() {
        let (a, b) = (vec![0.0_f32; 4], vec![0.3_f32; 4]);
        let equal = compare(view([4, 1], 1, &a), view([4, 1], 1, &a)).unwrap();
        let far = compare(view([4, 1], 1, &a), view([4, 1], 1, &b)).unwrap();
        let both = Comparison::pooled(&[equal, far]).unwrap();
        assert!((both.rmse - 0.3 / 2.0_f64.sqrt()).abs() < 1e-7);
        assert_eq!((both.differing, both.pixels), (0.5, 8));
        assert_eq!(Comparison::pooled(&[]), None);
    }
}
