//! What distinguishes the pixels of a sensor in every frame: offsets, gains, hot and dead pixels.

use std::ops::Range;

use rayon::prelude::*;

use super::{
    draw::{Draws, two_words},
    settings::Settings,
    stream,
};

/// Number instead of a frame's.
const EVERY_FRAME: u32 = 0;

/// Fixed pattern of a sensor. Indices count the channels of a pixel, then pixels row by row.
#[derive(Clone, Debug)]
pub(super) struct FixedPattern {
    gains: Option<Vec<f32>>,
    offsets_e: Option<Vec<f32>>,
    /// Hot ones with their dark current, relative to the mean of hot pixels, ascending.
    hot: Vec<(u32, f32)>,
    /// Dead ones, ascending.
    dead: Vec<u32>,
}

impl FixedPattern {
    /// The pattern of the camera with this seed.
    pub fn new(settings: &Settings, draws: &Draws, size_px: [u32; 2], seed: u64) -> Self {
        let [width, height] = size_px;
        let channels = settings.channels() as u32;
        let rows = (0..height).into_par_iter();
        let words = move |x: u32, y: u32, stream: u32| two_words(x | (y << 16), EVERY_FRAME, seed, stream);
        let of_all = |value: &(dyn Fn(u32, u32, u32) -> f32 + Sync)| -> Vec<f32> {
            let row = |y| (0..width * channels).map(move |i| value(i / channels, y, i % channels));
            rows.clone().flat_map_iter(row).collect()
        };
        let gains = (settings.prnu > 0.0).then(|| {
            of_all(&|x, y, channel| {
                (1.0 + settings.prnu * draws.normal(words(x, y, stream::FIXED + channel)[0])).max(0.0)
            })
        });
        let shared = |sigma_e: f32, i: u32, stream: u32| match sigma_e {
            0.0 => 0.0,
            sigma_e => sigma_e * draws.normal(two_words(i, EVERY_FRAME, seed, stream)[0]),
        };
        let has_offsets = [settings.dsnu_e, settings.row_offset_e, settings.column_offset_e] != [0.0; 3];
        let offsets_e = has_offsets.then(|| {
            of_all(&|x, y, channel| {
                settings.dsnu_e * draws.normal(words(x, y, stream::FIXED + channel)[1])
                    + shared(settings.row_offset_e, y, stream::FIXED_ROW)
                    + shared(settings.column_offset_e, x, stream::FIXED_COLUMN)
            })
        });
        let (hot, dead) = defects(settings, draws, size_px, &words);
        Self { gains, offsets_e, hot, dead }
    }

    /// Gains from an index on.
    pub fn gains_from(&self, first: usize) -> Option<&[f32]> {
        self.gains.as_ref().and_then(|gains| gains.get(first..))
    }

    /// Offsets in electrons from an index on.
    pub fn offsets_from(&self, first: usize) -> Option<&[f32]> {
        self.offsets_e.as_ref().and_then(|offsets| offsets.get(first..))
    }

    /// Hot pixels of a range, with their dark current relative to the mean.
    pub fn hot_in(&self, range: Range<usize>) -> &[(u32, f32)] {
        let rank = |index: usize| self.hot.partition_point(|(i, _)| (*i as usize) < index);
        &self.hot[rank(range.start)..rank(range.end)]
    }

    /// Dead pixels of a range.
    pub fn dead_in(&self, range: Range<usize>) -> impl Iterator<Item = usize> {
        let rank = |index: usize| self.dead.partition_point(|i| (*i as usize) < index);
        self.dead[rank(range.start)..rank(range.end)].iter().map(|i| *i as usize)
    }
}

/// Hot and dead pixels, all channels of a pixel together.
fn defects(
    settings: &Settings,
    draws: &Draws,
    [width, height]: [u32; 2],
    words: &(impl Fn(u32, u32, u32) -> [u32; 2] + Sync),
) -> (Vec<(u32, f32)>, Vec<u32>) {
    if settings.hot_pixels == 0.0 && settings.dead_pixels == 0.0 {
        return (Vec::new(), Vec::new());
    }
    let channels = settings.channels() as u32;
    let (mut hot, mut dead) = (Vec::new(), Vec::new());
    for y in 0..height {
        for x in 0..width {
            let [is_hot, is_dead] = words(x, y, stream::DEFECT);
            let indices = (0..channels).map(|channel| (y * width + x) * channels + channel);
            if is_below(is_dead, settings.dead_pixels) {
                dead.extend(indices);
            } else if is_below(is_hot, settings.hot_pixels) {
                // Half the sum of two squared normals is exponentially distributed.
                let [a, b] = words(x, y, stream::HOT).map(|bits| draws.normal(bits));
                hot.extend(indices.map(|i| (i, 0.5 * (a * a + b * b))));
            }
        }
    }
    (hot, dead)
}

fn is_below(bits: u32, fraction: f64) -> bool {
    (f64::from(bits) + 0.5) / 4_294_967_296.0 < fraction
}
