//! What resampling and the samples of the exposure cost in grey levels, and the cheapest of them that keep
//! `quality.max_error_dn`.
//!
//! At a few places of the image (`prospect.rs`) the surface in view, its texture's power spectrum
//! (`grain.rs`) and the two maps from the texture over the ideal frame to the output pixel are known. What
//! each stage leaves of a wave of the texture has a closed form (`transfer.rs`): the filter of the ideal
//! frame's surfaces, the reads between its pixels with what they alias, the grid of reads, the samples over
//! the exposure. The exact pixel is the mean over its area and over the exposure. The squared difference of
//! the two, weighed by the spectrum, is the expected squared error. Not a bound: textures are taken to be
//! equally grainy in all directions, and silhouettes are not in it. Measured against the oracle's pictures
//! away from silhouettes: docs/ACCURACY.md.

use rayon::prelude::*;

use super::{
    BlurStage, Predicted, SurfaceReads,
    costs::Price,
    exposure::ExposurePath,
    prospect::{Prospect, Sight},
};
use camsim_core::{
    scenario::{Auto, Preset, QualitySpec},
    scene::Scene,
    temporal::{Footprint, SAMPLES, TENT_PX2, TapStage, WIDEST_AREA_PX, samples_for},
};

/// One place in so many is asked first, and so far above the tolerance these then settle it.
const FEW: usize = 4;
const FAR: f64 = 1.7;
/// Part of what these find that all of them find at least.
const SURE: f64 = 0.8;
/// Places that one thread asks at a time: fewer are not worth another.
const AT_ONCE: usize = 8;
/// Times what is expected: textures are not equally grainy everywhere.
pub(super) const SAFETY: f64 = 1.2;
/// Eight-bit textures, their smaller versions and the filter's weights, 1/255 of the linear range.
const FORMAT_DN: f64 = 0.12;
/// Scales of the ideal frame that are tried, of the camera's.
const SCALES: [f64; 14] =
    [1.0, 1.2, 1.41, 1.6, 1.8, MOST_SCALE, 2.25, 2.5, 2.83, 3.2, 3.6, 4.0, 4.5, FINEST_SCALE];
/// Beyond it only for silhouettes.
pub(super) const MOST_SCALE: f64 = 2.0;
/// As many pixels along a side of one of the camera's as are read.
pub(super) const FINEST_SCALE: f64 = MOST_TAPS as f64;
/// Samples a pixel of path that are tried.
const SAMPLES_PER_PX: [f64; 14] = [0.25, 0.33, 0.4, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0];
/// Part of `quality.max_error_dn` that is always left for sources beside their place, so that all else may
/// take 0.995 of it; with a terrain for its level of detail too, so that all else may take 0.954; and of an
/// error that is above it anyway the part that these may be.
const LEFT_FOR_DISPLACED: f64 = 0.1;
const LEFT_WITH_GROUND: f64 = 0.3;
const OF_BROKEN: f64 = 0.3;
/// What is left of a tolerance and what is taken of it may add up to a little more.
const ROUNDED: f64 = 1.0 + 1e-9;
/// Most samples on one polynomial of the path.
const MAX_SAMPLES: u32 = 512;
/// Most reads along a side of a pixel, unless `quality.footprint_taps` says otherwise.
const MOST_TAPS: u32 = 5;
/// How far pixels may be from rectangles along the axes that are read by such: what is told of borders is of
/// squares. Of pixels 1.2 times as long along a diagonal as across it 1.03 to 1.19 times that is left, the
/// more the wider they are (RMS, four samples an ideal pixel), which the safety of borders has room for.
const MOST_LEAN: f64 = 0.2;
/// Those that are tried.
const CAPS: [u32; 4] = [2, 3, 4, MOST_TAPS];
/// Where no way keeps a tolerance: times the least error there is.
pub(super) const NEARLY: f64 = 1.15;
/// By how much a way may cost more because it leaves no error: costs are not known better, and of two that
/// are alike the more exact one wins.
const WORTH: f64 = 0.2;

/// What is expected of one way of sampling, RMS over the picture, 1/255 of the linear range.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Expected {
    pub resampling_dn: f64,
    pub blur_dn: f64,
}

impl Expected {
    pub fn total_dn(self) -> f64 {
        self.resampling_dn.hypot(self.blur_dn)
    }
}

/// A way of sampling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sampling {
    /// Ideal pixels for each of the camera's.
    pub scale: f64,
    pub surface_reads: SurfaceReads,
    /// Of each ideal pixel.
    pub samples_a_pixel: u32,
    pub taps: TapStage,
    pub samples_per_px: f64,
    pub expected: Expected,
}

/// What a sampling is chosen for.
#[derive(Clone, Copy)]
pub(super) struct Task<'a> {
    pub quality: &'a QualitySpec,
    /// 1/255 of the linear range, over the picture; and what a way may leave that another frame has chosen.
    pub max_error_dn: f64,
    pub most_error_dn: f64,
    /// Scales of the ideal frame: not below the one, and below the other.
    pub least_scale: f64,
    pub most_scale: f64,
    /// Pixels that are drawn of the ideal frame at scale 1 for each of the camera's.
    pub ideal_share: f64,
    /// Whether ideal pixels may have several samples.
    pub may_have_samples: bool,
    pub exposure: Option<ExposurePath>,
}

/// What comes to the error of a way of sampling over the picture, 1/255 of the linear range; `None` where
/// that is not to be.
pub(super) type Beside<'a> = dyn Fn(&Sampling, Option<BlurStage>) -> Option<f64> + 'a;

impl Task<'_> {
    /// Of each ideal pixel, those that are tried.
    fn samples(&self) -> &'static [u32] {
        match (self.may_have_samples, self.quality.ideal_samples) {
            (false, _) | (_, Auto::Value(1)) => &[1],
            (true, _) => &[1, SAMPLES],
        }
    }
}

/// What was chosen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Choice {
    pub sampling: Sampling,
    pub price: Price,
    /// RMS error over the picture, 1/255, what comes to it included, and whether that is within the
    /// tolerance.
    pub total_dn: f64,
    pub within: bool,
    /// Where it is not: the least that any way of its kind has.
    pub least_dn: f64,
}

impl Prospect<'_> {
    /// What is to be expected of a way of sampling.
    pub fn expected(&self, sampling: &Sampling, blur: Option<BlurStage>) -> Expected {
        self.expected_at(1, sampling, blur)
    }

    /// The same from one place of `every`.
    fn expected_at(&self, every: usize, sampling: &Sampling, blur: Option<BlurStage>) -> Expected {
        let exact = self.exact2(every, sampling, blur.is_some());
        let sampled = blur.map_or(exact, |blur| self.sampled2(every, sampling, blur));
        Expected { resampling_dn: dn(exact), blur_dn: SAFETY * 255.0 * (sampled - exact).max(0.0).sqrt() }
    }

    /// Mean squared error with the exposure exact.
    fn exact2(
        &self,
        every: usize,
        &Sampling { scale, surface_reads, taps, .. }: &Sampling,
        exposed: bool,
    ) -> f64 {
        self.mean_square(every, |sight| sight.exact2(scale, surface_reads, taps, exposed, self.principal_px))
    }

    /// The same with its samples.
    fn sampled2(
        &self,
        every: usize,
        &Sampling { scale, surface_reads, taps, .. }: &Sampling,
        blur: BlurStage,
    ) -> f64 {
        self.mean_square(every, |sight| {
            let sides = scale * sight.camera_from_px;
            let area = Footprint::new(sides.x_axis, sides.y_axis, taps);
            let samples = sight.apart(sample_count(&blur, scale * sight.path_px, &area));
            sight.sampled2(scale, surface_reads, taps, samples, self.principal_px)
        })
    }

    /// Over the picture, from one place of `every`.
    fn mean_square(&self, every: usize, square: impl Fn(&Sight<'_>) -> f64 + Sync) -> f64 {
        let of = |sight: &Sight<'_>| [sight.weight, sight.weight * sight.gain * sight.gain * square(sight)];
        // Summed in their order: a plan does not depend on how threads share work.
        let squares: Vec<[f64; 2]> =
            self.sights.par_iter().step_by(every).with_min_len(AT_ONCE).map(of).collect();
        let [weight, square] =
            squares.iter().fold([0.0; 2], |sum, square| [0, 1].map(|k: usize| sum[k] + square[k]));
        square / (weight / self.weight() * self.counted as f64).max(1.0)
    }

    /// The least that may be expected with all that comes to it, 1/255, as a few places tell; where that is
    /// far from a tolerance the rest is not looked at.
    fn roughly_dn(
        &self,
        sampling: &Sampling,
        blur: Option<BlurStage>,
        beside_dn: f64,
        max_error_dn: f64,
    ) -> f64 {
        let exact_dn = dn(self.exact2(FEW, sampling, blur.is_some())).hypot(beside_dn);
        let is_far = exact_dn > FAR * max_error_dn;
        if is_far { exact_dn } else { self.expected_at(FEW, sampling, blur).total_dn().hypot(beside_dn) }
    }

    /// Of all places.
    pub(super) fn weight(&self) -> f64 {
        self.sights.iter().map(|sight| sight.weight).sum::<f64>().max(1e-9)
    }

    /// The cheapest sampling within the tolerance, or one that is nearly the best there is. `beside_dn` is
    /// what comes to it over the picture with a way of sampling, 1/255; `None` where that is not to be.
    pub fn choose(&self, task: &Task<'_>, beside_dn: &Beside<'_>) -> Choice {
        let &Task { quality, max_error_dn, least_scale, most_scale, ideal_share, exposure, .. } = task;
        let forced = quality.ideal_scale.value();
        let scales = SCALES.iter().filter(|&&scale| scale > 1.05 * least_scale && scale < most_scale);
        let scales: Vec<f64> = forced.map_or_else(
            || std::iter::once(least_scale).chain(scales.copied()).collect(),
            |scale| vec![scale],
        );
        let per_px = |scale: f64| match quality.blur_samples.value() {
            Some(samples) => vec![f64::from(samples)],
            None => SAMPLES_PER_PX.iter().map(|samples| samples / scale).collect(),
        };
        let way = |sampling: Sampling, samples_per_px: f64| {
            let sampling = Sampling { samples_per_px, ..sampling };
            (sampling, sampling.tried(quality, exposure))
        };
        let choices = |scale: f64| if exposure.is_some() { per_px(scale) } else { vec![0.0] };
        let cost =
            |(sampling, blur): &(Sampling, Option<BlurStage>)| self.price(sampling, *blur, ideal_share).ms;
        // Each with the fewest samples first: it may not be cheaper than that, and without any error.
        let fewest =
            |sampling: Sampling| way(sampling, choices(sampling.scale).first().copied().unwrap_or(0.0)).1;
        let mut ways: Vec<(f64, Sampling)> = Vec::new();
        for &scale in &scales {
            let ideals = SurfaceReads::ALL
                .into_iter()
                .flat_map(|reads| task.samples().iter().map(move |&samples| (reads, samples)));
            let ideals: Vec<Sampling> =
                ideals.map(|(reads, samples)| Sampling::of_ideal(scale, reads, samples)).collect();
            let ideals: Vec<(f64, Sampling)> =
                ideals.into_iter().map(|ideal| (self.ideal_ms(&ideal, ideal_share), ideal)).collect();
            for taps in self.stages(quality, scale) {
                let read_ms =
                    self.read_ms(scale, taps, fewest(Sampling::new(scale, SurfaceReads::One, taps)));
                ways.extend(
                    ideals.iter().map(|&(ideal_ms, ideal)| (ideal_ms + read_ms, Sampling { taps, ..ideal })),
                );
            }
        }
        ways.sort_by(|a, b| a.0.total_cmp(&b.0));
        let price = |cost: f64, total_dn: f64| cost * (1.0 - WORTH * (1.0 - total_dn / max_error_dn));
        let exactly = |(sampling, blur): (Sampling, _)| {
            let expected = self.expected(&sampling, blur);
            Sampling { expected, ..sampling }
        };
        let mut failed: Vec<Failed> = Vec::new();
        let mut cheapest: Option<(f64, f64, Sampling)> = None;
        for (least_cost, sampling) in ways {
            let below = cheapest.map_or(f64::INFINITY, |(price, ..)| price);
            if price(least_cost, 0.0) >= below {
                break;
            }
            // The most samples first: if those do not do, fewer need not be tried.
            let choices = choices(sampling.scale);
            let Some((&last, fewer)) = choices.split_last() else { continue };
            let most = way(sampling, last);
            let Some(beside_most_dn) = beside_dn(&most.0, most.1) else { continue };
            let rough_dn = self.roughly_dn(&most.0, most.1, beside_most_dn, max_error_dn);
            if price(least_cost, SURE * rough_dn.min(max_error_dn)) >= below {
                continue;
            }
            let tried = Some(most).filter(|_| rough_dn <= FAR * max_error_dn).map(exactly);
            let total_dn = tried
                .as_ref()
                .map_or(rough_dn, |sampling| sampling.expected.total_dn().hypot(beside_most_dn));
            match tried.filter(|_| total_dn <= max_error_dn) {
                None => failed.push(Failed {
                    sampling,
                    beside_dn: beside_most_dn,
                    roughly_dn: rough_dn,
                    known_dn: tried.map(|_| total_dn),
                }),
                Some(tried) => {
                    let priced = |samples: f64, dn: f64| price(cost(&way(sampling, samples)), dn);
                    // Fewer samples leave no less than the most.
                    let cheaper = fewer.partition_point(|&samples| priced(samples, total_dn) < below);
                    let enough = self
                        .with_fewer(&sampling, &fewer[..cheaper], task, beside_dn)
                        .into_iter()
                        .chain([(total_dn, tried)]);
                    let priced =
                        enough.map(|(dn, sampling)| (priced(sampling.samples_per_px, dn), dn, sampling));
                    let found =
                        priced.filter(|(price, ..)| *price < below).min_by(|a, b| a.0.total_cmp(&b.0));
                    cheapest = found.or(cheapest);
                }
            }
        }
        let choice = |sampling: Sampling, total_dn: f64, within: bool, least_dn: f64| {
            let price = self.price(&sampling, sampling.tried(quality, exposure), ideal_share);
            Choice { sampling, price, total_dn, within, least_dn: least_dn.min(total_dn) }
        };
        if let Some((_, total_dn, sampling)) = cheapest {
            return choice(sampling, total_dn, true, total_dn);
        }
        // The cheapest of those that come near the best, with no more samples than that takes.
        let exactly_dn = |failed: &Failed| {
            let most = way(failed.sampling, choices(failed.sampling.scale).last().copied().unwrap_or(0.0));
            self.expected(&most.0, most.1).total_dn().hypot(failed.beside_dn)
        };
        let least_dn = least_dn(&mut failed, &exactly_dn);
        let enough_dn = NEARLY * least_dn;
        let is_near = |failed: &mut Failed| {
            failed.at_least_dn() <= enough_dn && failed.found_dn(&exactly_dn) <= enough_dn
        };
        let nearest = failed.iter_mut().find_map(|failed| is_near(failed).then_some(failed.sampling));
        let sampling = nearest.unwrap_or(Sampling::new(least_scale, SurfaceReads::Grid, TapStage::Spline));
        let of = |way: (Sampling, Option<BlurStage>)| {
            let sampling = exactly(way);
            let beside_dn = beside_dn(&way.0, way.1).unwrap_or(f64::INFINITY);
            choice(sampling, sampling.expected.total_dn().hypot(beside_dn), false, least_dn)
        };
        let tried: Vec<Choice> =
            choices(sampling.scale).into_iter().map(|samples| of(way(sampling, samples))).collect();
        let most = tried.last().copied();
        tried
            .into_iter()
            .find(|choice| choice.total_dn <= enough_dn)
            .or(most)
            .unwrap_or_else(|| of(way(sampling, 0.0)))
    }

    /// The same with fewer samples, in ascending order, as far as that keeps the tolerance: halving finds the
    /// fewest that do.
    fn with_fewer(
        &self,
        sampling: &Sampling,
        fewer: &[f64],
        task: &Task<'_>,
        beside_dn: &Beside<'_>,
    ) -> Vec<(f64, Sampling)> {
        let mut found = Vec::new();
        let mut untried = fewer;
        while let Some(&samples_per_px) = untried.get(untried.len() / 2) {
            let (before, after) = untried.split_at(untried.len() / 2);
            let tried = Sampling { samples_per_px, ..*sampling };
            let within = self.within((tried, tried.tried(task.quality, task.exposure)), task, beside_dn);
            untried = if within.is_some() { before } else { &after[1..] };
            found.extend(within);
        }
        found
    }

    /// A way and its error with all that comes to it, 1/255, if that is within the tolerance. A few places
    /// tell what is far from it.
    fn within(
        &self,
        (sampling, blur): (Sampling, Option<BlurStage>),
        task: &Task<'_>,
        beside_dn: &Beside<'_>,
    ) -> Option<(f64, Sampling)> {
        let beside_dn = beside_dn(&sampling, blur)?;
        if self.roughly_dn(&sampling, blur, beside_dn, task.max_error_dn) > FAR * task.max_error_dn {
            return None;
        }
        let expected = self.expected(&sampling, blur);
        let total_dn = expected.total_dn().hypot(beside_dn);
        (total_dn <= task.max_error_dn).then_some((total_dn, Sampling { expected, ..sampling }))
    }

    /// A way of sampling that another frame has chosen.
    pub fn given(&self, sampling: &Sampling, task: &Task<'_>, beside_dn: &Beside<'_>) -> Choice {
        let blur = sampling.tried(task.quality, task.exposure);
        let expected = self.expected(sampling, blur);
        let total_dn = expected.total_dn().hypot(beside_dn(sampling, blur).unwrap_or(f64::INFINITY));
        let price = self.price(sampling, blur, task.ideal_share);
        let within = total_dn <= task.most_error_dn;
        Choice { sampling: Sampling { expected, ..*sampling }, price, total_dn, within, least_dn: total_dn }
    }

    /// Ways of reading the ideal frame at a scale.
    fn stages(&self, quality: &QualitySpec, scale: f64) -> Vec<TapStage> {
        // By their longer sides: whether any pixel has one read, and whether any has several.
        let [is_any_narrow, is_any_wide] =
            [scale * self.widths[0] <= TENT_PX2.sqrt(), scale * self.widths[1] > TENT_PX2.sqrt()];
        let most = |cap: u32| cap.min((scale * self.widths[1]).ceil() as u32);
        let most_of = |cap: u32| match (is_any_narrow, is_any_wide) {
            (_, false) => TapStage::Spline,
            (true, true) => TapStage::SplineOrGrid { most: most(cap) },
            (false, true) => TapStage::Grid { most: most(cap) },
        };
        match quality.footprint_taps.value() {
            Some(1) => vec![TapStage::Spline],
            Some(taps) => vec![most_of(taps)],
            // Bilinear reads farther apart than a pixel leave less to be read, and for borders mostly do.
            None => {
                let mut stages = vec![TapStage::Bilinear, TapStage::Spline];
                stages.extend(CAPS.map(most_of));
                stages.dedup();
                // Narrower ones are splines, and of wider or slanted ones areas along the axes are not what
                // they cover.
                let width = scale * self.widths[1];
                let fits = width > 2.0_f64.sqrt() && width <= WIDEST_AREA_PX && self.lean <= MOST_LEAN;
                stages.extend(Some(TapStage::Area).filter(|_| fits));
                stages
            }
        }
    }
}

/// A way of sampling that does not keep the tolerance, with the most samples.
struct Failed {
    sampling: Sampling,
    /// What comes to its error.
    beside_dn: f64,
    /// Error as a few places tell it, and as all do, if they were asked.
    roughly_dn: f64,
    known_dn: Option<f64>,
}

impl Failed {
    fn at_least_dn(&self) -> f64 {
        self.known_dn.unwrap_or(SURE * self.roughly_dn)
    }

    fn found_dn(&mut self, exactly_dn: &dyn Fn(&Failed) -> f64) -> f64 {
        let found_dn = self.known_dn.unwrap_or_else(|| exactly_dn(self));
        self.known_dn = Some(found_dn);
        found_dn
    }
}

/// The least error of all: those that may be better than the best known are looked at, the most promising
/// first.
fn least_dn(failed: &mut [Failed], exactly_dn: &dyn Fn(&Failed) -> f64) -> f64 {
    let mut order: Vec<&mut Failed> = failed.iter_mut().collect();
    order.sort_by(|a, b| a.at_least_dn().total_cmp(&b.at_least_dn()));
    let mut least_dn = f64::INFINITY;
    for failed in order {
        if failed.at_least_dn() >= least_dn {
            break;
        }
        least_dn = least_dn.min(failed.found_dn(exactly_dn));
    }
    least_dn
}

/// Samples of a pixel whose path is so long, if it is equally long in each of its stretches.
pub(super) fn sample_count(blur: &BlurStage, length_px: f64, area: &Footprint) -> u32 {
    let stretches = blur.stretches();
    let at_least = (area.taps[0] * area.taps[1]).div_ceil(stretches);
    stretches * samples_for(length_px / f64::from(stretches), blur.samples_per_px, at_least, blur.max_samples)
}

fn dn(square: f64) -> f64 {
    (SAFETY * 255.0 * square.sqrt()).hypot(FORMAT_DN)
}

/// What sampling, silhouettes and mixed light may take of `quality.max_error_dn`: the rest is kept for
/// sources beside their place.
pub(super) fn for_sampling_dn(quality: &QualitySpec, scene: &Scene) -> f64 {
    let left = if scene.terrain.is_some() { LEFT_WITH_GROUND } else { LEFT_FOR_DISPLACED };
    (1.0 - left * left).sqrt() * quality.max_error_dn
}

/// What the ground's level of detail and sources beside their place may cost beside all others, 1/255: what
/// these leave of the tolerance.
pub(super) fn for_displaced_dn(quality: &QualitySpec, scene: &Scene, others_dn: f64) -> f64 {
    if others_dn > for_sampling_dn(quality, scene) {
        return OF_BROKEN * others_dn;
    }
    (quality.max_error_dn.powi(2) - others_dn.powi(2)).max(0.0).sqrt()
}

/// Why the tolerance is not kept; `None` if it is.
pub(super) fn in_the_way(
    quality: &QualitySpec,
    sampling: &Sampling,
    predicted: &Predicted,
    is_plain: bool,
) -> Option<String> {
    let total_dn = predicted.picture_dn();
    if total_dn <= ROUNDED * quality.max_error_dn {
        return None;
    }
    if quality.preset == Preset::Paper {
        return Some(format!("quality.preset \"paper\": {total_dn:.2}/255 and what is not in it"));
    }
    let Predicted { resampling_dn, blur_dn, displaced_dn, ground, silhouettes, layers, .. } = *predicted;
    let sampled_dn = resampling_dn.hypot(blur_dn);
    let at_silhouettes_dn = silhouettes.map_or(0.0, |silhouettes| silhouettes.error_dn);
    let by_layers_dn = layers.map_or(0.0, |layers| layers.error_dn);
    let by_ground_dn = ground.map_or(0.0, |ground| ground.error_dn());
    if by_ground_dn > displaced_dn.max(sampled_dn).max(at_silhouettes_dn).max(by_layers_dn) {
        return Some(format!(
            "the terrain's level of detail (quality.max_terrain_error_px): {by_ground_dn:.2}/255"
        ));
    }
    if displaced_dn > sampled_dn.max(at_silhouettes_dn).max(by_layers_dn) {
        let by = if quality.solver == Auto::Auto { "" } else { " (quality.solver is given)" };
        return Some(format!("sources beside their place{by}: {displaced_dn:.2}/255"));
    }
    if by_layers_dn > sampled_dn.max(at_silhouettes_dn) {
        return Some(format!(
            "what is mixed of several surfaces moves with the depth of one: {by_layers_dn:.2}/255"
        ));
    }
    if at_silhouettes_dn > sampled_dn {
        let how = if is_plain { "where they are left as they are" } else { "with rays of their own" };
        return Some(format!("quality.silhouettes: {at_silhouettes_dn:.2}/255 {how}"));
    }
    Some(match (blur_dn > resampling_dn, quality.blur_samples, quality.footprint_taps, quality.ideal_scale) {
        (true, Auto::Value(_), ..) => format!("quality.blur_samples: {blur_dn:.2}/255"),
        (true, ..) => format!("samples over the exposure: {blur_dn:.2}/255"),
        (false, _, Auto::Value(_), _) => format!("quality.footprint_taps: {resampling_dn:.2}/255"),
        (false, _, _, Auto::Value(_)) => format!("quality.ideal_scale: {resampling_dn:.2}/255"),
        _ => format!(
            "detail finer than an ideal frame of {:.2} times the camera's scale holds (quality.ideal_scale may be more): {resampling_dn:.2}/255",
            sampling.scale
        ),
    })
}

impl Sampling {
    /// Of which nothing is expected yet.
    pub fn new(scale: f64, surface_reads: SurfaceReads, taps: TapStage) -> Self {
        Self {
            scale,
            surface_reads,
            samples_a_pixel: 1,
            taps,
            samples_per_px: 0.0,
            expected: Expected::default(),
        }
    }

    /// By its ideal frame.
    fn of_ideal(scale: f64, surface_reads: SurfaceReads, samples_a_pixel: u32) -> Self {
        Self { samples_a_pixel, ..Self::new(scale, surface_reads, TapStage::Bilinear) }
    }

    /// The paper's: one bilinear read a sample.
    pub fn of_paper() -> Self {
        Self::new(1.0, SurfaceReads::Grid, TapStage::Bilinear)
    }

    /// The exposure's samples where the longest path is not known yet.
    pub fn tried(&self, quality: &QualitySpec, exposure: Option<ExposurePath>) -> Option<BlurStage> {
        let max_samples = quality.blur_samples.value().unwrap_or(MAX_SAMPLES);
        exposure.map(|exposure| exposure.with_samples(self.samples_per_px, max_samples))
    }

    /// The exposure's samples for paths of up to `blur_px` ideal pixels.
    pub fn blur_stage(&self, exposure: ExposurePath, quality: &QualitySpec, blur_px: f64) -> BlurStage {
        let stretches = exposure.stretches;
        let (samples_per_px, max_samples) = match quality.blur_samples.value() {
            Some(samples) => (f64::from(samples), samples.div_ceil(stretches)),
            None => (
                self.samples_per_px,
                ((self.samples_per_px.max(1.0) * blur_px).ceil() as u32 / stretches + 2)
                    .clamp(2, MAX_SAMPLES),
            ),
        };
        exposure.with_samples(samples_per_px, max_samples)
    }
}
