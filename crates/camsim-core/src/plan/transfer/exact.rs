//! One wave at a time, in double precision and sample by sample: what `lanes.rs` and `waves.rs` are held to.

use std::f64::consts::PI;

use glam::DVec2;

use super::{Over, Path, Read, Wave, evenly, reads_of, sinc};
use crate::temporal::Footprint;

/// What is left of a wave, read beside ideal pixels by so much.
pub(super) fn read_wave(f: DVec2, area: &Footprint, over: Over, beside_px: DVec2) -> Wave {
    reads_of(0, f, area, beside_px).map(|Read { f, leaves, .. }| leaves.rotate(sampled(area, over, f))).sum()
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
