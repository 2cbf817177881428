//! One wave at a time, in double precision and sample by sample: what `lanes.rs` and `waves.rs` are held to.

use std::f64::consts::PI;

use glam::DVec2;

use super::{Over, Path, UNSEEN, Wave, catmull_rom, turned_by};
use camsim_core::temporal::{Footprint, Kernel};
use camsim_core::waves::{evenly, sinc};

/// What is left of a wave, read beside ideal pixels by so much.
pub(super) fn read_wave(f: DVec2, area: &Footprint, over: Over, beside_px: DVec2) -> Wave {
    reads_of(f, area, beside_px).map(|Read { f, leaves }| leaves.rotate(sampled(area, over, f))).sum()
}

/// What the grid of taps and the samples of an exposure leave.
pub(super) fn sampled(area: &Footprint, over: Over, f: DVec2) -> Wave {
    let grid = evenly(area.taps[0], area.dx.dot(f)) * evenly(area.taps[1], area.dy.dot(f));
    match over {
        Over::Instant => Wave::new(grid, 0.0),
        Over::All(along) => Wave::new(grid * sinc(along.dot(f)), 0.0),
        // So many that all taps have as good as all of them.
        Over::Samples(Path { along, samples }) if samples > 8 * area.taps[0] * area.taps[1] => {
            Wave::new(grid * evenly(samples, along.dot(f)), 0.0)
        }
        Over::Samples(Path { along, samples }) => {
            let at = |k: u32| area.offset_px(k) + along * ((f64::from(k) + 0.5) / f64::from(samples) - 0.5);
            (0..samples).map(|k| Wave::from_angle(2.0 * PI * at(k).dot(f))).sum::<Wave>() / f64::from(samples)
        }
    }
}

/// A read of the ideal frame along x (0) or y (1).
pub(super) fn read(kernel: Kernel, axis: usize, f: f64) -> f64 {
    match kernel {
        Kernel::Bilinear => sinc(f).powi(2),
        Kernel::Spline(softness) => {
            (1.0 - softness[axis]) * catmull_rom(f) + softness[axis] * sinc(f).powi(4)
        }
        Kernel::Area(sides_px) => sinc(f) * sinc(sides_px[axis] * f),
    }
}

/// One axis of a wave that looks like another on the grid of ideal pixels.
struct Alias {
    seen: f64,
    /// What a read leaves of it, turned as the read's place turns it.
    read: Wave,
}

/// A wave along one axis and the slowest two that look like it.
fn aliases(kernel: Kernel, axis: usize, f: f64, beside_px: f64) -> [Alias; 3] {
    [-1.0, 0.0, 1.0].map(|step: f64| {
        let away = step - f.round();
        let seen = f + away;
        Alias { seen, read: read(kernel, axis, seen) * turned_by(away * beside_px) }
    })
}

/// A read of a wave or of one that looks like it on the grid of ideal pixels.
struct Read {
    /// Cycles an ideal pixel.
    f: DVec2,
    /// What one read leaves.
    leaves: Wave,
}

/// The wave itself, and those that it looks like on the grid of ideal pixels, the slow ones foremost, as far
/// as they count.
fn reads_of(f: DVec2, area: &Footprint, beside_px: DVec2) -> impl Iterator<Item = Read> {
    let [x, y] = [0, 1].map(|k| aliases(area.kernel, k, f[k], beside_px[k]));
    let both = (0..9).map(move |i| {
        let (x, y) = (&x[i / 3], &y[i % 3]);
        Read { f: DVec2::new(x.seen, y.seen), leaves: x.read.rotate(y.read) }
    });
    both.filter(|read| read.leaves.length_squared() >= UNSEEN * UNSEEN)
}
