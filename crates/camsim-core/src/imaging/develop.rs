//! From digital numbers to the colours of a picture: black level, companding, white balance, interpolation of
//! the mosaic, colour matrix and response curve.

use glam::Mat3;
use rayon::prelude::*;

use super::{
    demosaic::{Candidates, GREEN, Mosaicked, color_at},
    settings::{Settings, between},
};
use crate::{
    frame::RawPicture,
    scenario::{Demosaic, ImageSensorSpec, Mosaic, ResponseCurve},
    scene::srgb_from_linear,
};

/// How raw pictures become colours.
#[derive(Clone, Debug)]
pub(super) struct Development {
    mosaic: Mosaic,
    method: Demosaic,
    /// Gains of red, green, blue and white.
    gains: [f32; 4],
    /// `None` where colours stay as they are.
    matrix: Option<Mat3>,
    fraction_of_code: Vec<f32>,
    response: Response,
}

#[derive(Clone, Debug)]
enum Response {
    Linear,
    Srgb,
    Power(f32),
    Table(Vec<[f64; 2]>),
}

impl Development {
    pub fn new(spec: &ImageSensorSpec, settings: &Settings) -> Self {
        let seen = matrix(&spec.spectral_matrix);
        // White as the channels see it.
        let white = seen * glam::Vec3::ONE;
        let channels = [white.x, white.y, white.z, 1.0];
        let levels = [0, 1, 2, 3].map(|k: usize| f64::from(channels[k]) * settings.white_e[k]);
        let gains = match (spec.mosaic, spec.white_balance) {
            (Mosaic::Mono, _) => [1.0; 4],
            (_, Some([r, g, b])) => [r, g, b, levels[GREEN as usize] * g / levels[3]],
            // No gain is below 1, so that what is saturated stays white.
            (mosaic, None) => {
                let counted = if mosaic == Mosaic::Rgbw { &levels[..] } else { &levels[..3] };
                let most = counted.iter().copied().fold(0.0, f64::max);
                levels.map(|level| if level > 0.0 { most / level } else { 1.0 })
            }
        };
        let matrix = match spec.color_matrix {
            Some(rows) => matrix(&rows),
            None => (Mat3::from_diagonal(white.recip()) * seen).inverse(),
        };
        let is_unit = matrix == Mat3::IDENTITY || spec.mosaic == Mosaic::Mono;
        let largest = settings.largest_fraction as f32;
        Self {
            mosaic: spec.mosaic,
            method: spec.demosaic,
            gains: gains.map(|gain| gain as f32 / largest),
            matrix: (!is_unit).then_some(matrix),
            fraction_of_code: settings.fraction_of_code.clone(),
            response: match spec.response {
                ResponseCurve::Linear => Response::Linear,
                ResponseCurve::Srgb => Response::Srgb,
                ResponseCurve::Gamma => Response::Power(1.0 / spec.gamma as f32),
                ResponseCurve::Table => Response::Table(spec.response_points.clone()),
            },
        }
    }

    /// Colours of the pixels with a ray; the others stay as they are.
    pub fn develop(&self, raw: &RawPicture, size_px: [u32; 2], color_rgba: &mut [f32]) {
        let width = size_px[0] as usize;
        let fraction = |code: u16| self.fraction_of_code[code as usize];
        match self.mosaic {
            Mosaic::None => {
                let rows = raw.values.par_chunks(3 * width).zip(color_rgba.par_chunks_mut(4 * width));
                rows.for_each(|(codes, rgba)| {
                    for (code, rgba) in codes.chunks_exact(3).zip(rgba.chunks_exact_mut(4)) {
                        self.finish([0, 1, 2].map(|k: usize| self.gains[k] * fraction(code[k])), rgba);
                    }
                });
            }
            Mosaic::Mono => {
                let rows = raw.values.par_chunks(width).zip(color_rgba.par_chunks_mut(4 * width));
                rows.for_each(|(codes, rgba)| {
                    for (code, rgba) in codes.iter().zip(rgba.chunks_exact_mut(4)) {
                        self.finish([self.gains[3] * fraction(*code); 3], rgba);
                    }
                });
            }
            mosaic => {
                let value = |x: usize, y: usize| {
                    let gain = self.gains[color_at(mosaic, [x as u32, y as u32]) as usize];
                    gain * fraction(raw.values[y * width + x])
                };
                let values = Mosaicked::new(mosaic, size_px, value);
                let memory = || (Candidates::new(width), vec![[0.0; 3]; width]);
                color_rgba.par_chunks_mut(4 * width).enumerate().for_each_init(
                    memory,
                    |(candidates, colors), (y, rgba)| {
                        values.colors(y, self.method, candidates, colors);
                        for (color, rgba) in colors.iter().zip(rgba.chunks_exact_mut(4)) {
                            self.finish(*color, rgba);
                        }
                    },
                );
            }
        }
    }

    #[inline(always)]
    fn finish(&self, color: [f32; 3], rgba: &mut [f32]) {
        if rgba[3] <= 0.0 {
            return;
        }
        let color = match &self.matrix {
            Some(matrix) => (*matrix * glam::Vec3::from_array(color)).to_array(),
            None => color,
        };
        let color = color.map(|value| value.clamp(0.0, 1.0));
        let color = match &self.response {
            Response::Linear => color,
            curve => color.map(|value| curve.at(value)),
        };
        rgba[..3].copy_from_slice(&color);
    }
}

impl Response {
    fn at(&self, value: f32) -> f32 {
        match self {
            Self::Linear => value,
            Self::Srgb => srgb_from_linear(value),
            Self::Power(exponent) => value.powf(*exponent),
            Self::Table(points) => between(points, 0, f64::from(value)) as f32,
        }
    }
}

/// A matrix of rows.
fn matrix(rows: &[f64; 9]) -> Mat3 {
    Mat3::from_cols_array(&rows.map(|value| value as f32)).transpose()
}
