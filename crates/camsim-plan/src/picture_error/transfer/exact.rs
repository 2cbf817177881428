//! One wave at a time, in double precision and sample by sample: what `lanes.rs` and `waves.rs` are held to.

use std::f64::consts::PI;

use camsim_core::{
    temporal::{Footprint, Kernel},
    transfer::{sampled_box, sinc},
};
use glam::DVec2;

use super::{
    alias::{ReadSpan, SampledPath, Transfer, catmull_rom, turned_by},
    reads::UNSEEN,
};

/// What is left of a wave, read beside ideal pixels by so much.
pub(crate) fn read_wave(f: DVec2, area: &Footprint, over: ReadSpan, beside_px: DVec2) -> Transfer {
    reads_of(f, area, beside_px).map(|ExactRead { f, leaves }| leaves.rotate(sampled(area, over, f))).sum()
}

/// What the grid of taps and the samples of an exposure leave.
pub(crate) fn sampled(area: &Footprint, over: ReadSpan, f: DVec2) -> Transfer {
    let grid = sampled_box(area.taps[0], area.dx.dot(f)) * sampled_box(area.taps[1], area.dy.dot(f));
    match over {
        ReadSpan::Instant => Transfer::new(grid, 0.0),
        ReadSpan::All(along) => Transfer::new(grid * sinc(along.dot(f)), 0.0),
        // So many that all taps have as good as all of them.
        ReadSpan::Samples(SampledPath { along, samples }) if samples > 8 * area.taps[0] * area.taps[1] => {
            Transfer::new(grid * sampled_box(samples, along.dot(f)), 0.0)
        }
        ReadSpan::Samples(SampledPath { along, samples }) => {
            let tap_px =
                |k: u32| area.offset_px(k) + along * ((f64::from(k) + 0.5) / f64::from(samples) - 0.5);
            (0..samples).map(|k| Transfer::from_angle(2.0 * PI * tap_px(k).dot(f))).sum::<Transfer>()
                / f64::from(samples)
        }
    }
}

/// A read of the ideal frame along x (0) or y (1).
pub(crate) fn read(kernel: Kernel, axis: usize, f: f64) -> f64 {
    match kernel {
        Kernel::Bilinear => sinc(f).powi(2),
        Kernel::Spline(softness) => {
            (1.0 - softness[axis]) * catmull_rom(f) + softness[axis] * sinc(f).powi(4)
        }
        Kernel::Area(sides_px) => sinc(f) * sinc(sides_px[axis] * f),
    }
}

/// One axis of a wave that looks like another on the grid of ideal pixels.
struct ExactAlias {
    frequency: f64,
    /// What a read leaves of it, turned as the read's position turns it.
    read: Transfer,
}

/// A wave along one axis and the slowest two that look like it.
fn aliases(kernel: Kernel, axis: usize, f: f64, beside_px: f64) -> [ExactAlias; 3] {
    [-1.0, 0.0, 1.0].map(|step: f64| {
        let away = step - f.round();
        let frequency = f + away;
        ExactAlias { frequency, read: read(kernel, axis, frequency) * turned_by(away * beside_px) }
    })
}

/// A read of a wave or of one that looks like it on the grid of ideal pixels.
struct ExactRead {
    /// Cycles an ideal pixel.
    f: DVec2,
    /// What one read leaves.
    leaves: Transfer,
}

/// The wave itself, and those that it looks like on the grid of ideal pixels, the slow ones foremost, as far
/// as they count.
fn reads_of(f: DVec2, area: &Footprint, beside_px: DVec2) -> impl Iterator<Item = ExactRead> {
    let [x, y] = [0, 1].map(|k| aliases(area.kernel, k, f[k], beside_px[k]));
    let both = (0..9).map(move |i| {
        let (x, y) = (&x[i / 3], &y[i % 3]);
        ExactRead { f: DVec2::new(x.frequency, y.frequency), leaves: x.read.rotate(y.read) }
    });
    both.filter(|read| read.leaves.length_squared() >= UNSEEN * UNSEEN)
}
