//! What one read leaves of a wave, and of those that look like it on the grid of ideal pixels.

use std::f64::consts::PI;

use camsim_core::{
    temporal::Kernel,
    transfer::{sin_pi, sinc},
};
use glam::DVec2;

/// A complex transfer factor: what is left of a wave, and how far it is shifted.
pub(crate) type Transfer = DVec2;

/// Phase factor of so many turns.
pub(crate) fn turned_by(turns: f64) -> Transfer {
    Transfer::new(sin_pi(2.0 * turns + 0.5), sin_pi(2.0 * turns))
}

/// Catmull and Rom's kernel: the transform of Keys's cubic convolution with a = -1/2 (1981).
pub(crate) fn catmull_rom(f: f64) -> f64 {
    if f.abs() < 0.02 {
        return 1.0;
    }
    let (one, two) = (sinc(f), sinc(2.0 * f));
    (3.0 * (one * one - two) - (3.0 * two * two - 2.0 * two - sinc(4.0 * f))) / (PI * f).powi(2)
}

/// Samples on the path of an exposure, ideal pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SampledPath {
    pub along: DVec2,
    pub samples: u32,
}

/// What reads are taken over.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ReadSpan {
    /// One instant.
    Instant,
    /// A whole path.
    All(DVec2),
    /// Samples of a path.
    Samples(SampledPath),
}

/// One axis of a wave that looks like another on the grid of ideal pixels.
#[derive(Clone, Copy)]
pub(crate) struct AxisAlias {
    /// Whole cycles between the alias and the wave.
    pub away: i32,
    /// Frequency of the alias, cycles an ideal pixel.
    pub frequency: f64,
    /// Transfer of a mean over a pixel.
    mean: f64,
    /// Transfer of a bilinear read.
    bilinear: f64,
    /// Transfer of Catmull and Rom's kernel.
    sharp: f64,
    /// Transfer of the B-spline.
    soft: f64,
}

impl AxisAlias {
    /// The slowest three.
    pub fn all(f: f64) -> [Self; 3] {
        [-1, 0, 1].map(|step| Self::new(f, step))
    }

    fn new(f: f64, step: i32) -> Self {
        let away = step - f.round() as i32;
        let frequency = f + f64::from(away);
        let mean = sinc(frequency);
        Self {
            away,
            frequency,
            mean,
            bilinear: mean.powi(2),
            sharp: catmull_rom(frequency),
            soft: mean.powi(4),
        }
    }

    /// What a read leaves of it along x (0) or y (1).
    pub fn read(&self, kernel: Kernel, axis: usize) -> f64 {
        match kernel {
            Kernel::Bilinear => self.bilinear,
            Kernel::Spline(softness) => self.sharp + softness[axis] * (self.soft - self.sharp),
            Kernel::Area(sides_px) => self.mean * sinc(sides_px[axis] * self.frequency),
        }
    }
}

/// A wave that is always read at the same position between ideal pixels.
pub(crate) struct PlacedWave {
    pub aliases: [[AxisAlias; 3]; 2],
    /// Turns of each alias along x and y by that position.
    pub turned: [[Transfer; 3]; 2],
}

impl PlacedWave {
    /// Cycles an ideal pixel, and the position beside an ideal pixel.
    pub fn new(f: DVec2, beside_px: DVec2) -> Self {
        let aliases = [AxisAlias::all(f.x), AxisAlias::all(f.y)];
        let turned =
            [0, 1].map(|k: usize| aliases[k].map(|alias| turned_by(f64::from(alias.away) * beside_px[k])));
        Self { aliases, turned }
    }
}
