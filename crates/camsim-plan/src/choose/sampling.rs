//! The cheapest sampling plan that keeps `quality.max_error_dn`.

mod failed;

use camsim_core::{
    scenario::{Auto, QualitySpec},
    temporal::{MAX_AREA_SIDE_PX, SAMPLES, TENT_PX2, TapStage},
};

use super::{
    exposure_samples::unbounded_blur_stage,
    prices::{Price, Prices},
};
use crate::{
    ir::{
        budget::NEARLY,
        sampling_plan::SamplingPlan,
        stages::{BlurStage, PrefilterTaps},
    },
    picture_error::resampling::dn,
    view::exposure::ExposurePath,
};
use failed::{FailedSampling, SURE, least_dn};

/// One probe in so many is tried first, and so far above the tolerance these then settle it.
const FEW: usize = 4;
const FAR: f64 = 1.7;
/// Scales of the ideal frame that are tried, of the camera's.
const SCALES: [f64; 14] =
    [1.0, 1.2, 1.41, 1.6, 1.8, MOST_SCALE, 2.25, 2.5, 2.83, 3.2, 3.6, 4.0, 4.5, FINEST_SCALE];
/// Finer ideal frames are for silhouettes alone.
pub(crate) const MOST_SCALE: f64 = 2.0;
/// As many pixels along a side of one of the camera's as are read.
pub(crate) const FINEST_SCALE: f64 = MOST_TAPS as f64;
/// Samples a pixel of path that are tried.
const SAMPLES_PER_PX: [f64; 14] = [0.25, 0.33, 0.4, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0];
/// Most reads along a side of a pixel, unless `quality.footprint_taps` says otherwise.
const MOST_TAPS: u32 = 5;
/// Reads along a side that are tried.
const CAPS: [u32; 4] = [2, 3, 4, MOST_TAPS];
/// How far pixels may be from rectangles along the axes that are read by such: the aliasing of silhouettes is
/// known for squares. Of pixels 1.2 times as long along a diagonal as across it 1.03 to 1.19 times that is
/// left, the more the wider they are (RMS, four samples an ideal pixel), which the safety of silhouettes has
/// room for.
const MOST_LEAN: f64 = 0.2;
/// Where drawing is cheap: scales of the ideal frame, in order, and samples a pixel of path, of the plans that
/// are taken without a search if they keep the tolerance.
const FINE_SCALES: [f64; 4] = [1.41, MOST_SCALE, 2.83, 4.0];
const FINE_SAMPLES_PER_PX: f64 = 4.0;
/// By how much a plan may cost more because it leaves no error: costs are not known better, and of two that
/// are alike the more exact one wins.
const WORTH: f64 = 0.2;

/// What a sampling plan is chosen for.
#[derive(Clone, Copy)]
pub(crate) struct SamplingTask<'a> {
    pub quality: &'a QualitySpec,
    /// Tolerance, 1/255 of the linear range, over the picture.
    pub max_error_dn: f64,
    /// Tolerance of a plan that another frame has chosen.
    pub most_error_dn: f64,
    /// Least scale of the ideal frame.
    pub least_scale: f64,
    /// Least scale that is wished for, of the least: finer where shadows have borders.
    pub wished_scale: f64,
    /// Scale of the ideal frame that is too fine already.
    pub most_scale: f64,
    /// Pixels that are drawn of the ideal frame at scale 1 for each of the camera's.
    pub ideal_fraction: f64,
    /// Whether ideal pixels may have several samples.
    pub may_have_samples: bool,
    /// Whether fine sampling costs less time than the search for the cheapest.
    pub is_drawing_cheap: bool,
    pub exposure: Option<ExposurePath>,
}

/// Error of a sampling plan over the picture by all other causes, 1/255 of the linear range; `None` where the
/// plan is not to be taken.
pub(crate) type OtherErrors<'a> = dyn Fn(&SamplingPlan, Option<BlurStage>) -> Option<f64> + 'a;

/// A sampling plan with the samples of its exposure.
type Sampled = (SamplingPlan, Option<BlurStage>);

impl SamplingTask<'_> {
    /// Samples of each ideal pixel that are tried.
    fn samples(&self) -> &'static [u32] {
        match (self.may_have_samples, self.quality.ideal_samples) {
            (false, _) | (_, Auto::Value(1)) => &[1],
            (true, _) => &[1, SAMPLES],
        }
    }

    /// Samples a pixel of path that are tried, in ascending order.
    fn samples_per_px(&self, scale: f64) -> Vec<f64> {
        match (self.exposure, self.quality.blur_samples.value()) {
            (None, _) => vec![0.0],
            (Some(_), Some(samples)) => vec![f64::from(samples)],
            (Some(_), None) => SAMPLES_PER_PX.iter().map(|samples| samples / scale).collect(),
        }
    }

    /// A plan with so many samples a pixel of path.
    fn sampled(&self, plan: &SamplingPlan, samples_per_px: f64) -> Sampled {
        let plan = SamplingPlan { samples_per_px, ..*plan };
        (plan, unbounded_blur_stage(&plan, self.quality, self.exposure))
    }

    /// A price that is lower by a part of [`WORTH`] the less error is left.
    fn worth_ms(&self, ms: f64, total_dn: f64) -> f64 {
        ms * (1.0 - WORTH * (1.0 - total_dn / self.max_error_dn))
    }
}

/// What was chosen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SamplingChoice {
    pub plan: SamplingPlan,
    pub price: Price,
    /// RMS error over the picture by sampling and all other causes, 1/255.
    pub total_dn: f64,
    /// Whether that is within the tolerance.
    pub within: bool,
    /// Where it is not: the least that any plan of its kind has.
    pub least_dn: f64,
}

/// Sampling plans of a frame by price and error.
pub(crate) struct SamplingSearch<'a> {
    pub prices: Prices<'a>,
    pub task: &'a SamplingTask<'a>,
    pub others_dn: &'a OtherErrors<'a>,
}

impl SamplingSearch<'_> {
    /// The cheapest plan within the tolerance, or one that is nearly the best there is.
    pub fn choose(&self) -> SamplingChoice {
        if let Some((total_dn, plan)) = self.fine() {
            return self.choice(plan, total_dn, true, total_dn);
        }
        match self.cheapest() {
            Ok((total_dn, plan)) => self.choice(plan, total_dn, true, total_dn),
            Err(failed) => self.nearest(failed),
        }
    }

    /// Where drawing is cheap, the first fine plan that keeps the tolerance, and its error.
    fn fine(&self) -> Option<(f64, SamplingPlan)> {
        let task = self.task;
        if !task.is_drawing_cheap {
            return None;
        }
        let samples_a_pixel = *task.samples().last()?;
        let scales: Vec<f64> = match task.quality.ideal_scale.value() {
            Some(scale) => vec![scale],
            None => FINE_SCALES.iter().map(|scale| scale.max(task.wished_scale) * task.least_scale).collect(),
        };
        scales.into_iter().filter(|&scale| scale < task.most_scale).find_map(|scale| {
            let taps = self.tap_stages(scale).into_iter().rfind(|stage| *stage != TapStage::Area)?;
            let ideal = SamplingPlan::of_ideal(scale, PrefilterTaps::Grid, samples_a_pixel);
            let samples_per_px = match (task.exposure, task.quality.blur_samples.value()) {
                (None, _) => 0.0,
                (Some(_), Some(samples)) => f64::from(samples),
                (Some(_), None) => FINE_SAMPLES_PER_PX / scale,
            };
            self.within(&task.sampled(&SamplingPlan { taps, ..ideal }, samples_per_px))
        })
    }

    /// A plan that another frame has chosen.
    pub fn given(&self, plan: &SamplingPlan) -> SamplingChoice {
        let Self { prices, task, others_dn } = self;
        let blur = unbounded_blur_stage(plan, task.quality, task.exposure);
        let expected = prices.probes.expected(plan, blur);
        let total_dn = expected.total_dn().hypot(others_dn(plan, blur).unwrap_or(f64::INFINITY));
        let price = prices.price(plan, blur, task.ideal_fraction);
        let within = total_dn <= task.most_error_dn;
        SamplingChoice {
            plan: SamplingPlan { expected, ..*plan },
            price,
            total_dn,
            within,
            least_dn: total_dn,
        }
    }

    fn choice(&self, plan: SamplingPlan, total_dn: f64, within: bool, least_dn: f64) -> SamplingChoice {
        let blur = unbounded_blur_stage(&plan, self.task.quality, self.task.exposure);
        let price = self.prices.price(&plan, blur, self.task.ideal_fraction);
        SamplingChoice { plan, price, total_dn, within, least_dn: least_dn.min(total_dn) }
    }

    /// The plan with what is expected of it at all probes.
    fn exactly(&self, (plan, blur): Sampled) -> SamplingPlan {
        SamplingPlan { expected: self.prices.probes.expected(&plan, blur), ..plan }
    }

    /// All plans that are tried, each with the least that it may cost: with the fewest samples. The cheapest
    /// comes first.
    fn candidates(&self) -> Vec<(f64, SamplingPlan)> {
        let Self { prices, task, .. } = self;
        let scales =
            SCALES.iter().filter(|&&scale| scale > 1.05 * task.least_scale && scale < task.most_scale);
        let mut scales: Vec<f64> = task.quality.ideal_scale.value().map_or_else(
            || std::iter::once(task.least_scale).chain(scales.copied()).collect(),
            |scale| vec![scale],
        );
        let is_coarse = |scale: &f64| *scale < task.wished_scale * task.least_scale;
        scales.drain(..scales.partition_point(is_coarse).min(scales.len() - 1));
        let fewest = |plan: SamplingPlan| {
            task.sampled(&plan, task.samples_per_px(plan.scale).first().copied().unwrap_or(0.0)).1
        };
        let mut candidates: Vec<(f64, SamplingPlan)> = Vec::new();
        for &scale in &scales {
            let ideals: Vec<(f64, SamplingPlan)> = PrefilterTaps::ALL
                .into_iter()
                .flat_map(|reads| task.samples().iter().map(move |&samples| (reads, samples)))
                .map(|(reads, samples)| SamplingPlan::of_ideal(scale, reads, samples))
                .map(|ideal| (prices.ideal_ms(&ideal, task.ideal_fraction), ideal))
                .collect();
            for taps in self.tap_stages(scale) {
                let read_ms =
                    prices.read_ms(scale, taps, fewest(SamplingPlan::new(scale, PrefilterTaps::One, taps)));
                candidates.extend(
                    ideals
                        .iter()
                        .map(|&(ideal_ms, ideal)| (ideal_ms + read_ms, SamplingPlan { taps, ..ideal })),
                );
            }
        }
        candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
        candidates
    }

    /// The cheapest plan within the tolerance and its error, or all that are not.
    fn cheapest(&self) -> Result<(f64, SamplingPlan), Vec<FailedSampling>> {
        let task = self.task;
        let mut failed: Vec<FailedSampling> = Vec::new();
        let mut cheapest: Option<(f64, f64, SamplingPlan)> = None;
        for (least_ms, plan) in self.candidates() {
            let below_ms = cheapest.map_or(f64::INFINITY, |(ms, ..)| ms);
            if task.worth_ms(least_ms, 0.0) >= below_ms {
                break;
            }
            match self.cheapest_of(&plan, least_ms, below_ms) {
                Trial::Dearer => {}
                Trial::Failed(plan) => failed.push(plan),
                Trial::Within(found) => cheapest = found.or(cheapest),
            }
        }
        cheapest.map(|(_, total_dn, plan)| (total_dn, plan)).ok_or(failed)
    }

    /// A plan with the number of samples that makes it cheapest.
    fn cheapest_of(&self, plan: &SamplingPlan, least_ms: f64, below_ms: f64) -> Trial {
        let Self { prices, task, others_dn } = self;
        let max_error_dn = task.max_error_dn;
        // The most samples first: if those do not do, fewer need not be tried.
        let counts = task.samples_per_px(plan.scale);
        let Some((&last, fewer)) = counts.split_last() else { return Trial::Dearer };
        let most = task.sampled(plan, last);
        let Some(others_most_dn) = others_dn(&most.0, most.1) else { return Trial::Dearer };
        let rough_dn = self.roughly_dn(&most, others_most_dn);
        if task.worth_ms(least_ms, SURE * rough_dn.min(max_error_dn)) >= below_ms {
            return Trial::Dearer;
        }
        let tried = Some(most).filter(|_| rough_dn <= FAR * max_error_dn).map(|most| self.exactly(most));
        let total_dn = tried.as_ref().map_or(rough_dn, |plan| plan.expected.total_dn().hypot(others_most_dn));
        let Some(within) = tried.filter(|_| total_dn <= max_error_dn) else {
            return Trial::Failed(FailedSampling {
                plan: *plan,
                others_dn: others_most_dn,
                roughly_dn: rough_dn,
                known_dn: tried.map(|_| total_dn),
            });
        };
        let worth_ms = |samples: f64, dn: f64| {
            let (plan, blur) = task.sampled(plan, samples);
            task.worth_ms(prices.price(&plan, blur, task.ideal_fraction).ms, dn)
        };
        // Fewer samples leave no less than the most.
        let cheaper = fewer.partition_point(|&samples| worth_ms(samples, total_dn) < below_ms);
        let enough = self.with_fewer(plan, &fewer[..cheaper]).into_iter().chain([(total_dn, within)]);
        let priced = enough.map(|(dn, plan)| (worth_ms(plan.samples_per_px, dn), dn, plan));
        Trial::Within(priced.filter(|(ms, ..)| *ms < below_ms).min_by(|a, b| a.0.total_cmp(&b.0)))
    }

    /// Where no plan keeps the tolerance: the cheapest of those that come near the best, with no more samples
    /// than that takes.
    fn nearest(&self, mut failed: Vec<FailedSampling>) -> SamplingChoice {
        let Self { task, others_dn, .. } = self;
        let exactly_dn = |failed: &FailedSampling| {
            let counts = task.samples_per_px(failed.plan.scale);
            let most = task.sampled(&failed.plan, counts.last().copied().unwrap_or(0.0));
            self.prices.probes.expected(&most.0, most.1).total_dn().hypot(failed.others_dn)
        };
        let least_dn = least_dn(&mut failed, &exactly_dn);
        let enough_dn = NEARLY * least_dn;
        let is_near = |failed: &mut FailedSampling| {
            failed.at_least_dn() <= enough_dn && failed.exact_dn(&exactly_dn) <= enough_dn
        };
        let nearest = failed.iter_mut().find_map(|failed| is_near(failed).then_some(failed.plan));
        let plan =
            nearest.unwrap_or(SamplingPlan::new(task.least_scale, PrefilterTaps::Grid, TapStage::Spline));
        let of_samples = |samples: f64| {
            let sampled = task.sampled(&plan, samples);
            let exactly = self.exactly(sampled);
            let others_dn = others_dn(&sampled.0, sampled.1).unwrap_or(f64::INFINITY);
            self.choice(exactly, exactly.expected.total_dn().hypot(others_dn), false, least_dn)
        };
        let tried: Vec<SamplingChoice> =
            task.samples_per_px(plan.scale).into_iter().map(of_samples).collect();
        let most = tried.last().copied();
        tried
            .into_iter()
            .find(|choice| choice.total_dn <= enough_dn)
            .or(most)
            .unwrap_or_else(|| of_samples(0.0))
    }

    /// A plan with fewer samples, of these in ascending order, as far as that keeps the tolerance: halving
    /// finds the fewest that do.
    fn with_fewer(&self, plan: &SamplingPlan, fewer: &[f64]) -> Vec<(f64, SamplingPlan)> {
        let mut enough = Vec::new();
        let mut untried = fewer;
        while let Some(&samples_per_px) = untried.get(untried.len() / 2) {
            let (before, after) = untried.split_at(untried.len() / 2);
            let within = self.within(&self.task.sampled(plan, samples_per_px));
            untried = if within.is_some() { before } else { &after[1..] };
            enough.extend(within);
        }
        enough
    }

    /// A plan and its error by all causes, 1/255, if that is within the tolerance. A few probes rule out
    /// what is far from it.
    fn within(&self, sampled: &Sampled) -> Option<(f64, SamplingPlan)> {
        let max_error_dn = self.task.max_error_dn;
        let others_dn = (self.others_dn)(&sampled.0, sampled.1)?;
        if self.roughly_dn(sampled, others_dn) > FAR * max_error_dn {
            return None;
        }
        let plan = self.exactly(*sampled);
        let total_dn = plan.expected.total_dn().hypot(others_dn);
        (total_dn <= max_error_dn).then_some((total_dn, plan))
    }

    /// Error by all causes, 1/255, as a few probes give it; a lower bound where that is far from the
    /// tolerance.
    fn roughly_dn(&self, (plan, blur): &Sampled, others_dn: f64) -> f64 {
        let probes = self.prices.probes;
        let exact_dn = dn(probes.exact2(FEW, plan, blur.is_some())).hypot(others_dn);
        let is_far = exact_dn > FAR * self.task.max_error_dn;
        if is_far { exact_dn } else { probes.expected_at(FEW, plan, *blur).total_dn().hypot(others_dn) }
    }

    /// Tap stages that are tried at a scale.
    fn tap_stages(&self, scale: f64) -> Vec<TapStage> {
        let (probes, quality) = (self.prices.probes, self.task.quality);
        // By their longer sides: whether any pixel has one read, and whether any has several.
        let [is_any_narrow, is_any_wide] =
            [scale * probes.widths[0] <= TENT_PX2.sqrt(), scale * probes.widths[1] > TENT_PX2.sqrt()];
        let most = |cap: u32| cap.min((scale * probes.widths[1]).ceil() as u32);
        let most_of = |cap: u32| match (is_any_narrow, is_any_wide) {
            (_, false) => TapStage::Spline,
            (true, true) => TapStage::SplineOrGrid { most: most(cap) },
            (false, true) => TapStage::Grid { most: most(cap) },
        };
        match quality.footprint_taps.value() {
            Some(1) => vec![TapStage::Spline],
            Some(taps) => vec![most_of(taps)],
            // Bilinear reads farther apart than a pixel leave less to be read, and for silhouettes mostly do.
            None => {
                let mut stages = vec![TapStage::Bilinear, TapStage::Spline];
                stages.extend(CAPS.map(most_of));
                stages.dedup();
                // Narrower ones are splines, and of wider or slanted ones areas along the axes are not what
                // they cover.
                let width = scale * probes.widths[1];
                let fits = width > 2.0_f64.sqrt() && width <= MAX_AREA_SIDE_PX && probes.lean <= MOST_LEAN;
                stages.extend(Some(TapStage::Area).filter(|_| fits));
                stages
            }
        }
    }
}

/// What trying a plan led to.
enum Trial {
    /// It is not to be taken, or not cheaper than another.
    Dearer,
    Failed(FailedSampling),
    /// Price, error and plan, if it is cheaper than another.
    Within(Option<(f64, f64, SamplingPlan)>),
}
