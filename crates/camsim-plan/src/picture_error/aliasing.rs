//! Aliasing: what is left of the stair-steps of a border by what reads the ideal frame.
//!
//! The ideal frame shows one surface or the other in each of its pixels; the exact pixel has its fraction of
//! both. How far apart the two are depends on what reads the ideal frame: reads all over a pixel's area mend
//! stairs, one bilinear read of a frame three times as fine hardly does.
//!
//! Straight borders that run in every direction have a spectrum: of length L in an area A and contrast C, `C^2 L / A /
//! (4 pi^3 f^3)` for each square cycle. Nothing filters it before the ideal frame but the samples of its
//! pixels, if these have several, and with what the reads leave of its waves and of those that look like them
//! (`transfer.rs`) the squared error of a pixel is a sum over frequencies, as that of textures is.

#[cfg(test)]
mod tests;

use std::{
    collections::HashMap,
    f64::consts::{LN_2, PI},
    mem::{Discriminant, discriminant},
    sync::{LazyLock, PoisonError, RwLock},
};

use camsim_core::{
    temporal::{Footprint, Kernel, SAMPLE_POSITIONS, SAMPLES, TapStage},
    transfer::sinc,
};
use glam::DVec2;

use super::transfer::{PlacedWave, ReadSpan, SampledPath, read_waves};
use crate::ir::{
    sampling_plan::SamplingPlan,
    stages::{BlurStage, sample_count},
};

/// Frequencies that count, cycles an ideal pixel.
const LOWEST: f64 = 0.031_25;
const OCTAVES: f64 = 9.0;
/// Waves that stand for all: of 252 methods to read borders whose pixels have one sample their RMS is 0.96 to
/// 1.10 times that of 30 000 waves, 2 % off in the RMS.
const WAVES: u32 = 288;
/// Waves for means over areas, which leave so little that each missing wave weighs more: of wide ones with
/// four samples a pixel 288 waves found 0.56 to 0.92 times what is measured, these 0.94 to 1.19 times.
const WAVES_OF_AREAS: u32 = 1152;
/// Aliases from farther away than are counted (`transfer.rs`) are a tenth of what means over areas leave:
/// without them 0.94 to 0.96 times what is measured is found of borders that do not move.
const DISTANT_ALIASES_OF_AREAS: f64 = 1.1;
/// From one wave to the next, as parts of the range: direction, and where the source lies between ideal
/// pixels.
const STEP_OF_WAVES: [f64; 3] = [0.618_033_988_749_895, 0.754_877_666_246_693, 0.569_840_290_998_053];
/// Direction of the path for the first wave, a quarter of a turn further for each next one: each cell of a
/// grid is read at an instant of its own, so that its directions are not alike.
const ALONG: f64 = 0.5;
const DIRECTIONS: usize = 4;
/// Steps of a doubling by which widths are distinguished, and paths and samples.
const STEPS: f64 = 8.0;
const STEPS_OF_PATH: f64 = 4.0;

/// What reads the ideal frame for a pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BorderReading {
    /// Side of the pixel, ideal pixels.
    pub width_px: f64,
    pub taps: TapStage,
    /// Samples of each ideal pixel, 1 or [`SAMPLES`].
    pub samples_a_pixel: u32,
    /// Path over the exposure, ideal pixels, and the samples on it.
    pub exposure: Option<(f64, u32)>,
}

/// Steps of a doubling by which widths and paths of pixels with borders are distinguished.
const STEPS_ALIKE: f64 = 3.0;

/// The pixels of a picture that have borders, in groups.
#[derive(Clone, Debug)]
pub(crate) struct BorderPixels(Vec<BorderGroup>);

/// Pixels with borders that are alike.
#[derive(Clone, Copy, Debug)]
struct BorderGroup {
    /// Part of all that have borders, by squared contrast.
    part: f64,
    /// Side of the pixel and path over the exposure, pixels of the camera's focal length.
    footprint_px: [f64; 2],
}

impl BorderPixels {
    /// From squared contrasts of borders and the sides of pixels and paths there; pixels that are alike make
    /// one group.
    pub fn new(borders: impl Iterator<Item = (f64, [f64; 2])>) -> Self {
        let alike =
            |footprint_px: [f64; 2]| footprint_px.map(|px| (STEPS_ALIKE * (1.0 + px).log2()).round() as i64);
        let mut groups: Vec<([i64; 2], BorderGroup)> = Vec::new();
        for (part, footprint_px) in borders {
            match groups.iter_mut().find(|(key, _)| *key == alike(footprint_px)) {
                Some((_, group)) => group.part += part,
                None => groups.push((alike(footprint_px), BorderGroup { part, footprint_px })),
            }
        }
        let all: f64 = groups.iter().map(|(_, group)| group.part).sum();
        Self(
            groups
                .into_iter()
                .map(|(_, group)| BorderGroup { part: group.part / all.max(1e-30), ..group })
                .collect(),
        )
    }

    /// What reads of an ideal frame leave of borders, for a squared contrast of 1 times their length in each
    /// pixel.
    pub fn aliasing2(&self, plan: &SamplingPlan, blur: Option<BlurStage>) -> f64 {
        let of_group = |group: &BorderGroup| {
            let [width_px, path_px] = group.footprint_px.map(|px| plan.scale * px);
            let area = square(width_px, plan.taps);
            let exposure = blur.map(|blur| (path_px, sample_count(&blur, path_px, &area)));
            group.part
                * aliasing2(&BorderReading {
                    width_px,
                    taps: plan.taps,
                    samples_a_pixel: plan.samples_a_pixel,
                    exposure,
                })
        };
        self.0.iter().map(of_group).sum()
    }

    /// Whether they move over an exposure.
    pub fn move_over_exposure(&self) -> bool {
        self.0.iter().any(|group| group.footprint_px[1] > 0.0)
    }

    /// What so many rays of their own leave of borders that are known exactly, but for what `still` rays
    /// leave of borders that do not move.
    pub fn missed_by_rays(&self, rays: u32, still: u32) -> f64 {
        let of_group = |&BorderGroup { part, footprint_px: [width_px, path_px] }: &BorderGroup| {
            let path = path_px / width_px;
            part * (missed_by_rays(rays, path) - (1.0 - path).max(0.0) * missed_by_rays(still, 0.0)).max(0.0)
        };
        self.0.iter().map(of_group).sum()
    }

    /// What is left of borders where each output pixel has what one whole pixel of an ideal frame shows.
    ///
    /// Where the border truly is within such a pixel is any group alike, so that one pixel of each line
    /// across has 1/12 of the squared contrast. The path over the exposure spreads that over its length, as
    /// many times less of the contrast in as many times more pixels; half of that, since many paths run along
    /// the border.
    pub fn along_whole_pixels(&self, scale: f64) -> f64 {
        let of_group =
            |group: &BorderGroup| group.part / (12.0 * scale * scale * (1.0 + group.footprint_px[1]).sqrt());
        self.0.iter().map(of_group).sum()
    }
}

/// Squared error that as many rays of their own leave in the pixels that a border passes over, as
/// [`aliasing2`] counts it; path over the exposure in sides of the pixel. Fitted to borders drawn at random.
/// Without a path only the rays' positions within the pixel count, which are more even than these and their
/// instants together.
fn missed_by_rays(rays: u32, path_px: f64) -> f64 {
    (1.0 + 3.0 * path_px.min(1.0) + 0.2 * path_px) * 0.12 / f64::from(rays).powf(1.5)
}

/// Side of the pixel, reads along it and what each of them is, and of an exposure its path and samples.
type ReadingKey = (i32, u32, Discriminant<Kernel>, Option<(i32, u32)>);

/// What has been worked out, for ideal pixels of one sample and of several: the frames of a scene share most
/// of it.
static KNOWN: LazyLock<RwLock<HashMap<ReadingKey, [f64; 2]>>> = LazyLock::new(RwLock::default);

/// Squared error that a border leaves in the picture: mean over pixels, for a contrast of 1 and as many pixel
/// sides of border as pixels.
pub(crate) fn aliasing2(reading: &BorderReading) -> f64 {
    let step = |steps: f64, px: f64| (steps * px.max(1e-3).log2()).round() as i32;
    let px = |steps: f64, step: i32| (f64::from(step) / steps).exp2();
    let of_path =
        |(path_px, samples): (f64, u32)| (step(STEPS_OF_PATH, path_px + 1.0), rounded_count(samples));
    // For the steps themselves: what is known does not depend on the order of calls.
    let width = step(STEPS, reading.width_px);
    let (width_px, path) = (px(STEPS, width), reading.exposure.map(of_path));
    let area = square(width_px, reading.taps);
    let key = (width, area.taps[0], discriminant(&area.kernel), path);
    let of_samples = usize::from(reading.samples_a_pixel > 1);
    if let Some(known) = KNOWN.read().unwrap_or_else(PoisonError::into_inner).get(&key) {
        return known[of_samples];
    }
    let both =
        sum_of_waves(width_px, &area, path.map(|(path, samples)| (px(STEPS_OF_PATH, path) - 1.0, samples)));
    // What is kept is replaced whole.
    KNOWN.write().unwrap_or_else(PoisonError::into_inner).insert(key, both);
    both[of_samples]
}

fn square(width_px: f64, taps: TapStage) -> Footprint {
    Footprint::new(width_px * DVec2::X, width_px * DVec2::Y, taps)
}

/// A round number of samples, no more than these.
fn rounded_count(samples: u32) -> u32 {
    if samples <= 8 {
        samples
    } else {
        ((STEPS_OF_PATH * f64::from(samples).log2() + 1e-9).floor() / STEPS_OF_PATH).exp2() as u32
    }
}

/// A wave of the borders' spectrum.
struct BorderWave {
    /// Cycles an ideal pixel.
    f: DVec2,
    /// Power that it stands for.
    weight: f64,
    /// What the samples of an ideal pixel leave of it, if it has several: they lie as far on one side of its
    /// middle as on the other.
    left_by_samples: f64,
    placed: PlacedWave,
}

impl BorderWave {
    /// Wave `i` of `count`.
    fn new(i: u32, count: u32) -> Self {
        let i = f64::from(i) + 0.5;
        let [direction, beside_x, beside_y] = STEP_OF_WAVES.map(|step| (i * step).fract());
        let length = LOWEST * (OCTAVES * i / f64::from(count)).exp2();
        let f = length * DVec2::from_angle(PI * direction);
        // The other half-plane is its mirror image.
        let stands_for = 2.0 * length * length * LN_2 * OCTAVES * PI / f64::from(count);
        Self {
            f,
            weight: stands_for / (4.0 * (PI * length).powi(3)),
            left_by_samples: SAMPLE_POSITIONS
                .map(|position| (2.0 * PI * position.dot(f)).cos())
                .iter()
                .sum::<f64>()
                / f64::from(SAMPLES),
            placed: PlacedWave::new(f, DVec2::new(beside_x, beside_y)),
        }
    }
}

/// Waves of each direction of the path.
type BorderWaves = [Vec<BorderWave>; DIRECTIONS];

static TABLE: LazyLock<BorderWaves> = LazyLock::new(|| table(WAVES));
static TABLE_OF_AREAS: LazyLock<BorderWaves> = LazyLock::new(|| table(WAVES_OF_AREAS));

fn table(count: u32) -> BorderWaves {
    std::array::from_fn(|first| {
        (first as u32..count).step_by(DIRECTIONS).map(|i| BorderWave::new(i, count)).collect()
    })
}

/// Squared error for ideal pixels of one sample and of several.
fn sum_of_waves(width_px: f64, area: &Footprint, exposure: Option<(f64, u32)>) -> [f64; 2] {
    let of_direction = |(direction, waves): (u32, &Vec<BorderWave>)| {
        let along = DVec2::from_angle(ALONG + 0.5 * PI * f64::from(direction));
        let path = exposure.map(|(path_px, samples)| SampledPath { along: path_px * along, samples });
        let transfers = read_waves(
            waves.iter().map(|wave| &wave.placed),
            area,
            path.map_or(ReadSpan::Instant, ReadSpan::Samples),
        );
        waves.iter().zip(transfers).fold(
            DVec2::ZERO,
            |sum, (&BorderWave { f, weight, left_by_samples, .. }, transfer)| {
                let exact = sinc(width_px * f.x)
                    * sinc(width_px * f.y)
                    * path.map_or(1.0, |path| sinc(path.along.dot(f)));
                let off2 = |left: f64| (left * transfer - DVec2::new(exact, 0.0)).length_squared();
                sum + weight * DVec2::new(off2(1.0), off2(left_by_samples))
            },
        )
    };
    let (table, farther) = match area.kernel {
        Kernel::Area(_) => (&TABLE_OF_AREAS, DISTANT_ALIASES_OF_AREAS),
        Kernel::Bilinear | Kernel::Spline(_) => (&TABLE, 1.0),
    };
    let squares: DVec2 = (0..).zip(table.iter()).map(of_direction).sum::<DVec2>() * farther;
    // A border of a length in output pixels is as many times longer in ideal pixels as those are smaller,
    // their area by the square of it.
    (squares / width_px).to_array()
}
