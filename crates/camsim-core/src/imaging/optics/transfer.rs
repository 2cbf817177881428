//! The transfer function of a lens: what its image keeps of a sine wave.

use std::{f64::consts::PI, sync::Arc};

use glam::DVec2;
use rayon::prelude::*;
use rustfft::num_complex::{Complex32, Complex64};

use super::{bessel::jinc, kernel::SpreadKernel};
use crate::{
    imaging::with_facts,
    scenario::{CameraSpec, LoadedFile, PointSpreadSpec},
};

/// Width of a diffraction pattern beyond which its faint rings are cut off, in units of wavelength times
/// f-number: 2 % of the light is outside.
const AIRY_REACH: f64 = 12.0;
/// Reach of a Gaussian, standard deviations.
const GAUSSIAN_REACH: f64 = 4.0;
/// Reach that the end of the spectrum at the Nyquist frequency adds, pixels.
const RINGING_PX: f64 = 12.0;

/// The transfer function of a lens with `[camera.point_spread]`, without its glare.
#[derive(Clone, Debug)]
pub struct LensTransfer {
    sigma_px: f64,
    /// Wavelength times f-number of red, green and blue, pixels; 0 without diffraction.
    airy_px: [f64; 3],
    defocus_px: f64,
    /// With the distance of its values, pixels.
    kernel: Option<(Arc<SpreadKernel>, f64)>,
}

impl LensTransfer {
    /// That of a camera; 1 everywhere without a point spread.
    #[must_use]
    pub fn new(camera: &CameraSpec) -> Self {
        let pixel_um = camera.sensor.as_ref().and_then(|sensor| with_facts(sensor).pixel_um);
        Self::of_spec(&camera.point_spread.clone().unwrap_or_default(), pixel_um)
    }

    pub(super) fn of_spec(spec: &PointSpreadSpec, sensor_pixel_um: Option<f64>) -> Self {
        let pixel_um = spec.pixel_um.or(sensor_pixel_um).unwrap_or(f64::INFINITY);
        let [red, green, blue] = spec.wavelength_nm.rgb();
        let f_number = spec.f_number.unwrap_or(0.0);
        let kernel = spec.kernel.as_ref().and_then(LoadedFile::content::<SpreadKernel>);
        Self {
            sigma_px: spec.sigma_px.unwrap_or(0.0),
            airy_px: [red, green, blue].map(|nm| 1e-3 * nm * f_number / pixel_um),
            defocus_px: spec.defocus_px.unwrap_or(0.0),
            kernel: kernel.map(|kernel| (kernel, 1.0 / f64::from(spec.kernel_oversampling.max(1)))),
        }
    }

    /// At a frequency in cycles per pixel, of red (0), green (1) or blue (2).
    #[must_use]
    pub fn at(&self, channel: usize, cycles_px: DVec2) -> Complex64 {
        let formula = self.formula(channel, cycles_px.length());
        self.kernel.as_ref().map_or(formula.into(), |(kernel, step_px)| {
            let along = [&[cycles_px.x][..], &[cycles_px.y]];
            kernel.transfer(channel, *step_px, along).iter().sum::<Complex64>() * formula
        })
    }

    /// What is the same in all directions.
    fn formula(&self, channel: usize, cycles_px: f64) -> f64 {
        let gaussian = (-2.0 * (PI * self.sigma_px * cycles_px).powi(2)).exp();
        gaussian * diffraction(self.airy_px[channel] * cycles_px) * jinc(PI * self.defocus_px * cycles_px)
    }

    /// On a grid of frequencies: those of `along_y` fastest.
    pub(super) fn on_grid(&self, channel: usize, [along_x, along_y]: [&[f64]; 2]) -> Vec<Complex32> {
        let mut values: Vec<Complex32> = along_x
            .par_iter()
            .flat_map_iter(|&x| {
                let at = |y: &f64| Complex32::new(self.formula(channel, x.hypot(*y)) as f32, 0.0);
                along_y.iter().map(at).collect::<Vec<_>>()
            })
            .collect();
        if let Some((kernel, step_px)) = &self.kernel {
            let measured = kernel.transfer(channel, *step_px, [along_x, along_y]);
            values.par_iter_mut().zip(measured).for_each(|(value, factor)| {
                *value *= Complex32::new(factor.re as f32, factor.im as f32);
            });
        }
        values
    }

    /// Whether all colours have the same.
    pub(crate) fn is_gray(&self) -> bool {
        self.airy_px[0] == self.airy_px[1]
            && self.airy_px[1] == self.airy_px[2]
            && self.kernel.as_ref().is_none_or(|(kernel, _)| kernel.is_gray())
    }

    /// Whether nothing is blurred.
    pub(super) fn is_sharp(&self) -> bool {
        self.sigma_px == 0.0 && self.airy_px == [0.0; 3] && self.defocus_px == 0.0 && self.kernel.is_none()
    }

    /// The standard deviation, if there is a Gaussian and nothing else.
    pub(super) fn gaussian_alone_px(&self) -> Option<f64> {
        let others = Self { sigma_px: 0.0, ..self.clone() };
        (self.sigma_px > 0.0 && others.is_sharp()).then_some(self.sigma_px)
    }

    /// How far almost all light of a point reaches, along x and y.
    #[must_use]
    pub fn reach_px(&self) -> [f64; 2] {
        if self.is_sharp() {
            return [0.0; 2];
        }
        let airy_px = self.airy_px.iter().copied().fold(0.0, f64::max);
        let round =
            GAUSSIAN_REACH * self.sigma_px + AIRY_REACH * airy_px + 0.5 * self.defocus_px + RINGING_PX;
        let of_kernel = |side: usize| {
            self.kernel.as_ref().map_or(0.0, |(kernel, step_px)| 0.5 * step_px * kernel.size()[side] as f64)
        };
        [round + of_kernel(0), round + of_kernel(1)]
    }
}

/// Transfer function of a circular aperture without aberrations, of a frequency in fractions of its cut-off.
fn diffraction(fraction: f64) -> f64 {
    if fraction >= 1.0 {
        return 0.0;
    }
    2.0 / PI * (fraction.acos() - fraction * (1.0 - fraction * fraction).sqrt())
}
