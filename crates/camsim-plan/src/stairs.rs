//! What is left of a border's stairs by what reads the ideal frame.
//!
//! The ideal frame shows one surface or the other in each of its pixels; the exact pixel has its share of
//! both. How far apart the two are depends on what reads the ideal frame: reads all over a pixel's area mend
//! stairs, one bilinear read of a frame three times as fine hardly does.
//!
//! Straight borders that run every way have a spectrum: of length L in an area A and contrast C, `C^2 L / A /
//! (4 pi^3 f^3)` for each square cycle. Nothing filters it before the ideal frame but the samples of its
//! pixels, if these have several, and with what the reads leave of its waves and of those that look like them
//! (`transfer.rs`) the squared error of a pixel is a sum over frequencies, as that of textures is.

use std::{
    collections::HashMap,
    f64::consts::{LN_2, PI},
    mem::{Discriminant, discriminant},
    sync::{LazyLock, PoisonError, RwLock},
};

use glam::DVec2;

use super::{
    BlurStage,
    levels::{Sampling, sample_count},
    transfer::{Over, Path, PlacedWave, read_waves},
};
use camsim_core::temporal::{Footprint, Kernel, SAMPLE_PLACES, SAMPLES, TapStage};
use camsim_core::waves::sinc;

/// Frequencies that count, cycles an ideal pixel.
const LOWEST: f64 = 0.031_25;
const OCTAVES: f64 = 9.0;
/// Waves that stand for all: of 252 ways to read borders whose pixels have one sample their RMS is 0.96 to
/// 1.10 times that of 30 000 waves, 2 % off in the RMS.
const WAVES: u32 = 288;
/// Means over areas leave so little that each wave that is not looked at is more: of wide ones with four
/// samples a pixel 288 told 0.56 to 0.92 times what is measured, these 0.94 to 1.19 times.
const WAVES_OF_AREAS: u32 = 1152;
/// And what looks like a wave from farther away than is counted (`transfer.rs`) is a tenth of that little:
/// without it 0.94 to 0.96 times what is measured is told of borders that do not move.
const FARTHER_OF_AREAS: f64 = 1.1;
/// From one wave to the next, as parts of the range: direction, and where the source lies between ideal
/// pixels.
const STEP_OF_WAVES: [f64; 3] = [0.618_033_988_749_895, 0.754_877_666_246_693, 0.569_840_290_998_053];
/// Direction of the path for the first wave, a quarter of a turn further for each next one: each cell of a
/// grid is read at an instant of its own, so that its directions are not alike.
const ALONG: f64 = 0.5;
const DIRECTIONS: usize = 4;
/// Steps of a doubling that widths are told apart by, and paths and samples.
const STEPS: f64 = 8.0;
const STEPS_OF_PATH: f64 = 4.0;

/// What reads the ideal frame for a pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reading {
    /// Side of the pixel, ideal pixels.
    pub width_px: f64,
    pub taps: TapStage,
    /// Samples of each ideal pixel, 1 or [`SAMPLES`].
    pub samples_a_pixel: u32,
    /// Path over the exposure, ideal pixels, and the samples on it.
    pub exposure: Option<(f64, u32)>,
}

/// Steps of a doubling that widths and paths of pixels with borders are told apart by.
const STEPS_ALIKE: f64 = 3.0;

/// Where the borders of a picture are.
#[derive(Clone, Debug)]
pub(super) struct Places(Vec<Place>);

/// Pixels with borders that are alike.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Part of all that have borders, by squared contrast.
    part: f64,
    /// Side of the pixel and path over the exposure, pixels of the camera's focal length.
    sides_px: [f64; 2],
}

impl Places {
    /// Of how much there is of borders, by squared contrast, where pixels and paths have these sides: those
    /// that are alike together.
    pub fn new(borders: impl Iterator<Item = (f64, [f64; 2])>) -> Self {
        let alike = |sides_px: [f64; 2]| sides_px.map(|px| (STEPS_ALIKE * (1.0 + px).log2()).round() as i64);
        let mut found: Vec<([i64; 2], Place)> = Vec::new();
        for (part, sides_px) in borders {
            match found.iter_mut().find(|(key, _)| *key == alike(sides_px)) {
                Some((_, place)) => place.part += part,
                None => found.push((alike(sides_px), Place { part, sides_px })),
            }
        }
        let all: f64 = found.iter().map(|(_, place)| place.part).sum();
        Self(
            found
                .into_iter()
                .map(|(_, place)| Place { part: place.part / all.max(1e-30), ..place })
                .collect(),
        )
    }

    /// What reads of an ideal frame leave of borders, for a squared contrast of 1 times their length in each
    /// pixel.
    pub fn left(&self, sampling: &Sampling, blur: Option<BlurStage>) -> f64 {
        let of = |place: &Place| {
            let [width_px, path_px] = place.sides_px.map(|px| sampling.scale * px);
            let area = square(width_px, sampling.taps);
            let exposure = blur.map(|blur| (path_px, sample_count(&blur, path_px, &area)));
            place.part
                * left(&Reading {
                    width_px,
                    taps: sampling.taps,
                    samples_a_pixel: sampling.samples_a_pixel,
                    exposure,
                })
        };
        self.0.iter().map(of).sum()
    }

    /// Whether they move over an exposure.
    pub fn move_on(&self) -> bool {
        self.0.iter().any(|place| place.sides_px[1] > 0.0)
    }

    /// The same of so many rays of their own through borders that are known exactly, but for what `still`
    /// rays leave of borders that do not move.
    pub fn missed_by_rays(&self, rays: u32, still: u32) -> f64 {
        let of = |&Place { part, sides_px: [width_px, path_px] }: &Place| {
            let path = path_px / width_px;
            part * (missed_by_rays(rays, path) - (1.0 - path).max(0.0) * missed_by_rays(still, 0.0)).max(0.0)
        };
        self.0.iter().map(of).sum()
    }

    /// The same where each output pixel has what one whole pixel of an ideal frame shows.
    ///
    /// Where the border truly is within such a pixel is any place alike, so that one pixel of each line
    /// across has 1/12 of the squared contrast. The path over the exposure spreads that over its length, as
    /// many times less of the contrast in as many times more pixels; half of that, since many paths run along
    /// the border.
    pub fn along_whole_pixels(&self, scale: f64) -> f64 {
        let of = |place: &Place| place.part / (12.0 * scale * scale * (1.0 + place.sides_px[1]).sqrt());
        self.0.iter().map(of).sum()
    }
}

/// Squared error that as many rays of their own leave in the pixels that a border passes over, as [`left`]
/// counts it; path over the exposure in sides of the pixel. Fitted to borders drawn at random. Without a path
/// only the rays' places within the pixel count, which are more even than these and their instants together.
fn missed_by_rays(rays: u32, path_px: f64) -> f64 {
    (1.0 + 3.0 * path_px.min(1.0) + 0.2 * path_px) * 0.12 / f64::from(rays).powf(1.5)
}

/// Side of the pixel, reads along it and what each of them is, and of an exposure its path and samples.
type Key = (i32, u32, Discriminant<Kernel>, Option<(i32, u32)>);

/// What has been worked out, for ideal pixels of one sample and of several: the frames of a scene share most
/// of it.
static KNOWN: LazyLock<RwLock<HashMap<Key, [f64; 2]>>> = LazyLock::new(RwLock::default);

/// Squared error that a border leaves in the picture: mean over pixels, for a contrast of 1 and as many pixel
/// sides of border as pixels.
pub(super) fn left(reading: &Reading) -> f64 {
    let step = |steps: f64, px: f64| (steps * px.max(1e-3).log2()).round() as i32;
    let px = |steps: f64, step: i32| (f64::from(step) / steps).exp2();
    let of_path = |(path_px, samples): (f64, u32)| (step(STEPS_OF_PATH, path_px + 1.0), fewer(samples));
    // Of the steps themselves: what is known does not depend on who asked first.
    let width = step(STEPS, reading.width_px);
    let (width_px, path) = (px(STEPS, width), reading.exposure.map(of_path));
    let area = square(width_px, reading.taps);
    let key = (width, area.taps[0], discriminant(&area.kernel), path);
    let of_samples = usize::from(reading.samples_a_pixel > 1);
    if let Some(known) = KNOWN.read().unwrap_or_else(PoisonError::into_inner).get(&key) {
        return known[of_samples];
    }
    let found =
        worked_out(width_px, &area, path.map(|(path, samples)| (px(STEPS_OF_PATH, path) - 1.0, samples)));
    // What is kept is replaced whole.
    KNOWN.write().unwrap_or_else(PoisonError::into_inner).insert(key, found);
    found[of_samples]
}

fn square(width_px: f64, taps: TapStage) -> Footprint {
    Footprint::new(width_px * DVec2::X, width_px * DVec2::Y, taps)
}

/// Of many samples a round number of no more.
fn fewer(samples: u32) -> u32 {
    if samples <= 8 {
        samples
    } else {
        ((STEPS_OF_PATH * f64::from(samples).log2() + 1e-9).floor() / STEPS_OF_PATH).exp2() as u32
    }
}

/// A wave of the borders' spectrum.
struct Wave {
    /// Cycles an ideal pixel.
    f: DVec2,
    /// What it stands for, squared.
    weight: f64,
    /// What the samples of an ideal pixel leave of it, if it has several: they lie as far on one side of its
    /// middle as on the other.
    left_by_samples: f64,
    placed: PlacedWave,
}

impl Wave {
    /// Of so many.
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
            left_by_samples: SAMPLE_PLACES.map(|place| (2.0 * PI * place.dot(f)).cos()).iter().sum::<f64>()
                / f64::from(SAMPLES),
            placed: PlacedWave::new(f, DVec2::new(beside_x, beside_y)),
        }
    }
}

/// Waves of each direction of the path.
type Table = [Vec<Wave>; DIRECTIONS];

static TABLE: LazyLock<Table> = LazyLock::new(|| table(WAVES));
static TABLE_OF_AREAS: LazyLock<Table> = LazyLock::new(|| table(WAVES_OF_AREAS));

fn table(count: u32) -> Table {
    std::array::from_fn(|first| {
        (first as u32..count).step_by(DIRECTIONS).map(|i| Wave::new(i, count)).collect()
    })
}

/// Of ideal pixels of one sample and of several.
fn worked_out(width_px: f64, area: &Footprint, exposure: Option<(f64, u32)>) -> [f64; 2] {
    let of_direction = |(direction, waves): (u32, &Vec<Wave>)| {
        let along = DVec2::from_angle(ALONG + 0.5 * PI * f64::from(direction));
        let path = exposure.map(|(path_px, samples)| Path { along: path_px * along, samples });
        let found = read_waves(
            waves.iter().map(|wave| &wave.placed),
            area,
            path.map_or(Over::Instant, Over::Samples),
        );
        waves.iter().zip(found).fold(DVec2::ZERO, |sum, (&Wave { f, weight, left_by_samples, .. }, found)| {
            let exact = sinc(width_px * f.x)
                * sinc(width_px * f.y)
                * path.map_or(1.0, |path| sinc(path.along.dot(f)));
            let off2 = |left: f64| (left * found - DVec2::new(exact, 0.0)).length_squared();
            sum + weight * DVec2::new(off2(1.0), off2(left_by_samples))
        })
    };
    let (table, farther) = match area.kernel {
        Kernel::Area(_) => (&TABLE_OF_AREAS, FARTHER_OF_AREAS),
        Kernel::Bilinear | Kernel::Spline(_) => (&TABLE, 1.0),
    };
    let squares: DVec2 = (0..).zip(table.iter()).map(of_direction).sum::<DVec2>() * farther;
    // A border of a length in output pixels is as many times longer in ideal pixels as those are smaller,
    // their area by the square of it.
    (squares / width_px).to_array()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PathStage;
    use camsim_core::temporal::{ColorImage, edges::ray_place, gather};

    /// What is told of a reading itself.
    fn told(&Reading { width_px, taps, samples_a_pixel, exposure }: &Reading) -> f64 {
        worked_out(width_px, &square(width_px, taps), exposure)[usize::from(samples_a_pixel > 1)]
    }

    /// The same by drawing borders: in all places and directions, each read by the very gather of the twin,
    /// beside the area that it truly covers.
    fn measured(reading: &Reading) -> f64 {
        const SIDE: u32 = 40;
        const BORDERS: u32 = 2400;
        const PLACES: u32 = 24;
        let Reading { width_px, taps, samples_a_pixel, exposure } = *reading;
        let area = square(width_px, taps);
        let part = |k: u32, step: f64| (f64::from(k + 1) * step).fract();
        let path = exposure.map_or(0.0, |(path_px, _)| path_px);
        let reach_px = 0.5 * path + width_px + 3.0;
        let squares = (0..BORDERS).map(|k| {
            let normal = DVec2::from_angle(2.0 * PI * part(k, 0.754_877_666_246_693));
            let along = path * DVec2::from_angle(2.0 * PI * part(k, 0.324_717_957_244_746));
            let at = DVec2::splat(19.0)
                + DVec2::new(part(k, 0.618_033_988_749_895), part(k, 0.414_213_562_373_095));
            let border = at.dot(normal) + reach_px * (2.0 * part(k, 0.569_840_290_998_053) - 1.0);
            let lit = |px: DVec2| f64::from(px.dot(normal) < border);
            let places = if samples_a_pixel == 1 { vec![DVec2::ZERO] } else { SAMPLE_PLACES.to_vec() };
            let shown =
                |px: DVec2| places.iter().map(|&place| lit(px + place)).sum::<f64>() / places.len() as f64;
            let rgba: Vec<f32> = (0..SIDE * SIDE)
                .flat_map(|i| [shown(DVec2::new(f64::from(i % SIDE), f64::from(i / SIDE))) as f32; 4])
                .collect();
            let image = ColorImage { size_px: [SIDE; 2], rgba: &rgba };
            let nodes = [at - 0.5 * along, at + 0.5 * along];
            let found = match exposure {
                None => gather(&[at], PathStage::Straight, &area, &image, 1.0, 1),
                Some((_, samples)) => gather(&nodes, PathStage::Straight, &area, &image, 1e9, samples),
            };
            let instants = if exposure.is_some() { 16 } else { 1 };
            let inside = (0..PLACES * PLACES * instants).map(|i| {
                let [x, y] =
                    [i % PLACES, i / PLACES % PLACES].map(|n| (f64::from(n) + 0.5) / f64::from(PLACES) - 0.5);
                let share = (f64::from(i / (PLACES * PLACES)) + 0.5) / f64::from(instants) - 0.5;
                lit(at + share * along + width_px * DVec2::new(x, y))
            });
            (found.x - inside.sum::<f64>() / f64::from(PLACES * PLACES * instants)).powi(2)
        });
        // A border within reach of a pixel on both sides, in output pixels, crosses 1 of as many.
        squares.sum::<f64>() / f64::from(BORDERS) * 2.0 * reach_px / width_px
    }

    #[test]
    fn borders_leave_what_drawing_them_finds() {
        let grid = TapStage::Grid { most: 4 };
        for width_px in [1.0, 1.41, 2.0, 2.5, 3.0, 3.6] {
            // A single read of so wide a pixel is no way that is ever taken: a path counts up to 1.7 times
            // there.
            let covers = |taps: &TapStage| width_px <= 3.0 || [grid, TapStage::Area].contains(taps);
            for taps in
                [TapStage::Bilinear, TapStage::Spline, TapStage::Area, grid].into_iter().filter(covers)
            {
                let exposures = [None, Some((1.0, 2)), Some((6.0, 6)), Some((6.0, 20))];
                for (exposure, samples_a_pixel) in
                    exposures.into_iter().flat_map(|exposure| [(exposure, 1), (exposure, SAMPLES)])
                {
                    let area = square(width_px, taps);
                    let at_least =
                        |(path_px, samples): (f64, u32)| (path_px, samples.max(area.taps[0] * area.taps[1]));
                    let reading =
                        Reading { width_px, taps, samples_a_pixel, exposure: exposure.map(at_least) };
                    let (told, found) = (told(&reading), measured(&reading));
                    let off = (told / found).sqrt();
                    // Of long paths the waves across them count for too much. Sixteen reads ask for more
                    // waves: 4608 tell 0.96 of what is measured. Several samples leave little, of which each
                    // wave that is not looked at is more: 0.89 to 1.83 times, in the median 1.0. Most is for
                    // a path, as above.
                    let (least, most) = match samples_a_pixel {
                        1 if width_px > 3.0 => (0.92, 1.5),
                        1 => (0.95, 1.5),
                        _ => (0.88, 1.85),
                    };
                    assert!((least..most).contains(&off), "{reading:?}: {told:.2e}, measured {found:.2e}");
                }
            }
        }
    }

    #[test]
    fn rays_leave_what_drawing_borders_for_them_finds() {
        const BORDERS: u32 = 1500;
        const EXACT: u32 = 4096;
        let part = |k: u32, step: f64| (f64::from(k + 1) * step).fract();
        let all: Vec<(DVec2, f64)> = (0..EXACT)
            .map(|i| {
                let [x, y, share] = [1.0 / f64::from(EXACT), 0.754_877_666_246_693, 0.569_840_290_998_053]
                    .map(|step| part(i, step));
                (DVec2::new(x, y) - 0.5, share)
            })
            .collect();
        let lit = |places: &[(DVec2, f64)], normal: DVec2, along: f64, at: f64| {
            let lit =
                places.iter().filter(|(place, share)| place.dot(normal) + along * (share - 0.5) < at).count();
            lit as f64 / places.len() as f64
        };
        for rays in [16, 32, 64, 128, 256] {
            let places: Vec<(DVec2, f64)> = (0..rays).map(|i| ray_place(i, rays)).collect();
            for path_px in [0.0, 1.5, 3.0, 7.0, 15.0, 30.0] {
                let squares = (0..BORDERS).map(|k| {
                    let normal = DVec2::from_angle(2.0 * PI * part(k, 0.754_877_666_246_693));
                    let along = path_px * (2.0 * PI * part(k, 0.324_717_957_244_746)).cos();
                    let reach_px = 0.5 * (normal.abs().element_sum() + along.abs());
                    let at = reach_px * (2.0 * part(k, 0.569_840_290_998_053) - 1.0);
                    2.0 * reach_px * (lit(&places, normal, along, at) - lit(&all, normal, along, at)).powi(2)
                });
                let found = squares.sum::<f64>() / f64::from(BORDERS);
                let off = missed_by_rays(rays, path_px) / found;
                // Of the fewest too much is said of short paths.
                let most = if rays == 16 { 2.3 } else { 1.7 };
                assert!((0.6..most).contains(&off), "{rays} rays, {path_px} px: {off:.2} of {found:.2e}");
            }
        }
    }

    #[test]
    fn what_is_known_is_what_was_worked_out() {
        let reading =
            Reading { width_px: 2.0, taps: TapStage::Bilinear, samples_a_pixel: 1, exposure: Some((7.0, 8)) };
        assert_eq!([left(&reading), left(&reading)], [told(&reading); 2]);
        // What lies between the steps is as far off as these are apart, and not more sure of itself for
        // samples that are not counted.
        for (width_px, path_px, samples) in [(2.07, 6.2, 9), (1.03, 8.9, 31), (2.9, 2.3, 13)] {
            let between = Reading { width_px, exposure: Some((path_px, samples)), ..reading };
            let off = (left(&between) / told(&between)).sqrt();
            assert!((0.93..1.15).contains(&off), "{between:?}: {off:.3}");
        }
        assert!((1..400).all(|samples| fewer(samples) <= samples && 5 * fewer(samples) >= 4 * samples - 1));
    }
}
