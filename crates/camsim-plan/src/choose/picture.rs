//! How a frame's picture is made: what reads the ideal frame and how fine that is, and whether pixels at
//! silhouettes have rays of their own.

use camsim_core::{
    scenario::{Auto, QualitySpec, Silhouettes},
    temporal::SAMPLES,
};

use super::{
    edges,
    exposure_samples::unbounded_blur_stage,
    frame_context::{FrameContext, FrameScene},
    prices::Price,
    sampling::{FINEST_SCALE, MOST_SCALE, SamplingChoice, SamplingSearch, SamplingTask},
    shared_ideal::SamplingRequest,
};
use crate::{
    ir::{
        budget::{ErrorBudget, NEARLY, are_affordable},
        predicted::SilhouetteError,
        sampling_plan::SamplingPlan,
    },
    picture_error::silhouettes::SilhouetteModel,
};

/// Largest scale of an ideal frame of 4 samples a pixel: more pixels, whose samples have depth alone, cost
/// less than finer ones.
const MOST_SCALE_WITH_RAYS: f64 = 2.83;
/// Pixels of the largest ideal frame with several samples a pixel, of 12 bytes each on a device, and those
/// along a side: the CPU renderer draws twice as many there, in coordinates up to 32 768.
const MOST_SAMPLED_PX: u64 = 1 << 24;
const MOST_SAMPLED_SIDE_PX: u32 = 16_000;
/// Rays a pixel of an exposure where `quality.blur_samples` says how many samples it has.
const LEAST_RAYS_BY_HAND: u32 = 32;
const MOST_RAYS_BY_HAND: u32 = 256;
/// Part of what samples leave of borders, squared, that their rays may add: where that does, and where it
/// does not.
const FEW_ADD: f64 = 0.3;
const MANY_ADD: f64 = 0.03;

/// What was chosen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PictureChoice {
    pub plan: SamplingPlan,
    /// What silhouettes cost then.
    pub silhouettes: Option<SilhouetteError>,
    /// Whether silhouettes are left as they are.
    pub is_plain: bool,
    /// Fine pixels along a side of each ideal one.
    pub fine: u32,
    /// Rays of a pixel at silhouettes.
    pub rays: u32,
    pub price: Price,
    /// RMS error over the picture as far as that is expected, 1/255 of the linear range.
    pub total_dn: f64,
}

impl PictureChoice {
    /// What silhouettes cost, 1/255 of the linear range.
    pub fn silhouettes_dn(&self) -> f64 {
        self.silhouettes.map_or(0.0, |silhouettes| silhouettes.error_dn)
    }

    fn new(
        choice: &SamplingChoice,
        silhouettes: Option<SilhouetteError>,
        is_plain: bool,
        [fine, rays]: [u32; 2],
    ) -> Self {
        let SamplingChoice { plan, price, total_dn, .. } = *choice;
        Self { plan, silhouettes, is_plain, fine, rays, price, total_dn }
    }

    fn of_paper() -> Self {
        Self {
            plan: SamplingPlan::of_paper(),
            silhouettes: None,
            is_plain: true,
            fine: 1,
            rays: 0,
            price: Price::default(),
            total_dn: 0.0,
        }
    }
}

/// Scale of the ideal frame of a scene with shadows, of the least: no prediction knows their borders, and at
/// scale 1 a border of contrast 0.3 keeps 37 dB only (`camsim-engine/tests/shadows`).
const SHADOW_SCALE: f64 = 1.4;

/// The cheapest picture within `quality.max_error_dn`, or the best there is.
pub(crate) fn choose(context: &FrameContext<'_>, scene: &FrameScene<'_>) -> PictureChoice {
    if context.is_paper() {
        return PictureChoice::of_paper();
    }
    let quality = context.quality();
    let light = context.inputs.sequence.scene.light;
    let most_error_dn = ErrorBudget::new(quality).sampling_dn(&context.inputs.sequence.scene);
    let task = SamplingTask {
        quality,
        max_error_dn: most_error_dn * context.request.fraction_of_dn,
        most_error_dn,
        least_scale: context.reach.least_scale(),
        wished_scale: if light.is_some_and(|light| light.shadows) { SHADOW_SCALE } else { 1.0 },
        most_scale: scale_of(context, scene, context.inputs.max_ideal_px, context.inputs.max_side_px),
        ideal_fraction: ideal_fraction(context, scene),
        may_have_samples: false,
        is_drawing_cheap: context.inputs.is_drawing_cheap,
        exposure: context.exposed(scene.motion, &scene.ideal).path(quality, &mut Vec::new()),
    };
    let Some(model) = &scene.silhouettes else {
        let blended_dn = scene.blended_dn();
        let others_dn =
            |plan: &SamplingPlan, _| is_up_to(MOST_SCALE, plan.scale, &task).then_some(blended_dn);
        let search = SamplingSearch { prices: scene.prices(), task: &task, others_dn: &others_dn };
        let choice = context.request.given.map_or_else(|| search.choose(), |given| search.given(&given));
        return PictureChoice::new(&choice, None, false, [1, 0]);
    };
    SilhouetteSearch { context, scene, task, model }.choose()
}

/// The picture sampled as that of a frame that sees nearly the same, which was searched for; `None` where it then
/// does not keep `quality.max_error_dn`, or come as near as that does, or where rays are better.
pub(crate) fn choose_alike(
    context: &FrameContext<'_>,
    scene: &FrameScene<'_>,
    alike: &PictureChoice,
) -> Option<PictureChoice> {
    if alike.rays > 0 || context.is_paper() {
        return None;
    }
    let quality = context.quality();
    let request = SamplingRequest { given: Some(alike.plan), ..SamplingRequest::default() };
    let picture = choose(&context.clone().requesting(request), scene);
    let most_dn = ErrorBudget::new(quality).sampling_dn(&context.inputs.sequence.scene);
    let is_affordable = |picture: &PictureChoice| {
        picture.silhouettes.is_none_or(|silhouettes| are_affordable(&silhouettes, quality.max_error_dn))
    };
    let does = picture.total_dn <= most_dn.max(NEARLY * alike.total_dn)
        && (is_affordable(&picture) || !is_affordable(alike));
    does.then_some(picture)
}

/// Scale from which on the ideal frame has more pixels, or more along a side.
fn scale_of(context: &FrameContext<'_>, scene: &FrameScene<'_>, pixels: u64, side_px: u32) -> f64 {
    let [width, height] = scene.ideal.size_px.map(f64::from);
    let by_area = (pixels as f64 / (width * height)).sqrt();
    by_area.min(f64::from(side_px) / width.max(height)) * context.reach.least_scale()
}

/// Pixels that are drawn of the ideal frame at scale 1 for each of the camera's.
fn ideal_fraction(context: &FrameContext<'_>, scene: &FrameScene<'_>) -> f64 {
    let pixels = |[width, height]: [u32; 2]| f64::from(width) * f64::from(height);
    let frames = context.shared.map_or(1.0, |shared| shared.count() as f64);
    let reach = &context.reach;
    pixels(scene.ideal.size_px) / (pixels(reach.camera.size_px) * reach.least_scale().powi(2) * frames)
}

/// Pictures with silhouettes in view, left as they are or with rays of their own.
struct SilhouetteSearch<'a> {
    context: &'a FrameContext<'a>,
    scene: &'a FrameScene<'a>,
    task: SamplingTask<'a>,
    model: &'a SilhouetteModel,
}

impl SilhouetteSearch<'_> {
    fn choose(&self) -> PictureChoice {
        let Self { context, scene, task, model } = self;
        let quality = task.quality;
        let (choice, kind) = match quality.silhouettes {
            Silhouettes::Plain => (self.plain(), None),
            Silhouettes::Auto if self.is_plain_by_hand() && scene.may_have_samples => (self.plain(), None),
            // Another instant sees more of what is behind a silhouette than rays could make up for.
            Silhouettes::Auto if context.shared.is_some() || context.request.given.is_some() => {
                (self.plain(), None)
            }
            Silhouettes::Auto if quality.key_frames == Auto::Auto => self.cheaper_of_both(),
            Silhouettes::Auto | Silhouettes::Rays => {
                let (with_rays, kind) = self.with_rays();
                (with_rays, Some(kind))
            }
        };
        let plan = &choice.plan;
        let blur = unbounded_blur_stage(plan, quality, task.exposure);
        let (fine, rays) = kind.map_or((1, 0), |kind| (kind.fine, self.ray_count(plan.scale, &kind)));
        let silhouettes =
            Some(if rays == 0 { model.plain(plan, blur) } else { model.with_rays(plan, blur, fine, rays) });
        PictureChoice::new(&choice, silhouettes, rays == 0, [fine, rays])
    }

    fn cheaper_of_both(&self) -> (SamplingChoice, Option<RayKind>) {
        let Self { scene, task, model, .. } = self;
        let plain = self.plain();
        let fewest = self.ray_count(task.least_scale, &RayKind::FEWEST);
        let rays_ms =
            scene.prices().rays_ms(model.fraction, task.least_scale, 1, fewest, task.ideal_fraction);
        if plain.within && plain.price.ms < rays_ms {
            return (plain, None);
        }
        let (with_rays, kind) = self.with_rays();
        // Where nothing keeps the tolerance silhouettes may take all of it.
        let plain = if plain.within || with_rays.within { plain } else { self.plain_if(&|_| true) };
        if is_better(&plain, &with_rays) { (plain, None) } else { (with_rays, Some(kind)) }
    }

    /// Samples of ideal pixels that the scenario gives are for silhouettes that are left as they are.
    fn is_plain_by_hand(&self) -> bool {
        let quality = self.task.quality;
        quality.silhouettes == Silhouettes::Plain || quality.ideal_samples == Auto::Value(SAMPLES)
    }

    /// Silhouettes left as they are, where they are affordable.
    fn plain(&self) -> SamplingChoice {
        self.plain_if(&|plain| self.is_plain_by_hand() || are_affordable(plain, self.task.max_error_dn))
    }

    fn plain_if(&self, is_wanted: &dyn Fn(&SilhouetteError) -> bool) -> SamplingChoice {
        let Self { context, scene, model, .. } = self;
        let task = SamplingTask { may_have_samples: scene.may_have_samples, ..self.task };
        let side_px = MOST_SAMPLED_SIDE_PX.min(context.inputs.max_side_px);
        let most_sampled_scale = scale_of(context, scene, MOST_SAMPLED_PX, side_px);
        let may_be_plain = |plan: &SamplingPlan| {
            let (is_one, is_small) = (plan.samples_a_pixel == 1, plan.scale <= most_sampled_scale);
            // Several that the scenario gives are taken wherever they can be.
            let is_given = is_small != is_one
                || task.quality.ideal_samples != Auto::Value(SAMPLES)
                || !scene.may_have_samples;
            (is_one || is_small) && is_given && is_up_to(FINEST_SCALE, plan.scale, &task)
        };
        let (prices, blended_dn) = (scene.prices(), scene.blended_dn());
        match context.request.given {
            Some(given) => {
                let others_dn =
                    |plan: &SamplingPlan, blur| Some(model.plain(plan, blur).error_dn.hypot(blended_dn));
                SamplingSearch { prices, task: &task, others_dn: &others_dn }.given(&given)
            }
            None => {
                let others_dn = |plan: &SamplingPlan, blur| {
                    let plain = may_be_plain(plan).then(|| model.plain(plan, blur)).filter(is_wanted)?;
                    Some(plain.error_dn.hypot(blended_dn))
                };
                SamplingSearch { prices, task: &task, others_dn: &others_dn }.choose()
            }
        }
    }

    /// Rays a pixel.
    fn ray_count(&self, scale: f64, &RayKind { fine, most_part }: &RayKind) -> u32 {
        match (self.task.quality.blur_samples, self.task.exposure) {
            (Auto::Value(samples), Some(_)) => {
                samples.clamp(LEAST_RAYS_BY_HAND * fine, MOST_RAYS_BY_HAND).next_power_of_two()
            }
            _ => self.model.rays(scale, fine, most_part),
        }
    }

    /// The first kind of rays with which a picture keeps the tolerance, or comes near the best there is.
    fn with_rays(&self) -> (SamplingChoice, RayKind) {
        let mut failed = Vec::new();
        for kind in RayKind::all(self.model.has_motion()) {
            let choice = self.with_rays_of(kind);
            if choice.within {
                return (choice, kind);
            }
            failed.push((choice, kind));
        }
        let least_dn = failed.iter().map(|(choice, _)| choice.least_dn).fold(f64::INFINITY, f64::min);
        let near = failed.into_iter().find(|(choice, _)| choice.total_dn <= NEARLY * least_dn);
        near.map_or_else(
            || (self.with_rays_of(RayKind::FEWEST), RayKind::FEWEST),
            |(choice, kind)| (SamplingChoice { least_dn, ..choice }, kind),
        )
    }

    fn with_rays_of(&self, kind: RayKind) -> SamplingChoice {
        let Self { context, scene, task, model } = self;
        let (prices, blended_dn, fine) = (scene.prices(), scene.blended_dn(), kind.fine);
        let most_scale = if fine == 1 { MOST_SCALE_WITH_RAYS } else { MOST_SCALE };
        let most_fine = |scale: f64| {
            let size_px = scene.ideal.size_px.map(|side| (f64::from(side) * scale / task.least_scale) as u32);
            edges::most_fine(size_px, context.inputs.max_side_px)
        };
        let may = |scale: f64| fine <= most_fine(scale) && is_up_to(most_scale, scale, task);
        let others_dn = |plan: &SamplingPlan, blur| {
            let count = self.ray_count(plan.scale, &kind);
            may(plan.scale).then(|| model.with_rays(plan, blur, fine, count).error_dn.hypot(blended_dn))
        };
        let choice = SamplingSearch { prices, task, others_dn: &others_dn }.choose();
        let scale = choice.plan.scale;
        let rays_ms =
            prices.rays_ms(model.fraction, scale, fine, self.ray_count(scale, &kind), task.ideal_fraction);
        SamplingChoice { price: choice.price.with_rays(rays_ms), ..choice }
    }
}

/// Whether one is the better choice: within the tolerance, or where neither is, near the least error that
/// there is; and of two that are, the cheaper one.
fn is_better(one: &SamplingChoice, other: &SamplingChoice) -> bool {
    let least_dn = one.least_dn.min(other.least_dn);
    let is_good = |choice: &SamplingChoice| {
        if one.within || other.within { choice.within } else { choice.total_dn <= NEARLY * least_dn }
    };
    is_good(one) && (!is_good(other) || one.price.ms < other.price.ms)
}

/// Whether a scale is not above the given one; what the scenario gives, or the lens needs, always passes.
fn is_up_to(most_scale: f64, scale: f64, task: &SamplingTask<'_>) -> bool {
    scale <= task.least_scale.max(most_scale) || task.quality.ideal_scale.value().is_some()
}

/// A kind of rays at silhouettes.
#[derive(Clone, Copy)]
struct RayKind {
    /// Fine pixels along a side of an ideal one.
    fine: u32,
    /// Part of the error, squared, that too few of them may add.
    most_part: f64,
}

impl RayKind {
    const FEWEST: Self = Self { fine: 1, most_part: FEW_ADD };

    /// In the order in which they are tried: more pixels cost less than finer ones, so that these are for
    /// what the finest ideal frame does not do. Where nothing moves the fewest add nothing.
    fn all(has_motion: bool) -> impl Iterator<Item = Self> {
        let parts: &[f64] = if has_motion { &[FEW_ADD, MANY_ADD] } else { &[FEW_ADD] };
        (1..=edges::MOST_FINE)
            .flat_map(move |fine| parts.iter().map(move |&most_part| Self { fine, most_part }))
    }
}

/// Why pixels of the ideal frame have one sample.
pub(crate) fn why_one_sample(
    scene: &FrameScene<'_>,
    picture: &PictureChoice,
    quality: &QualitySpec,
) -> &'static str {
    match (&scene.silhouettes, quality.ideal_samples) {
        _ if !scene.may_have_samples => {
            "textures cut holes into surfaces, or surfaces are blended: samples do not show such silhouettes"
        }
        (None, _) => "nothing depends on where silhouettes are",
        _ if !picture.is_plain => "silhouettes have rays of their own",
        (_, Auto::Value(1)) => "quality.ideal_samples is 1",
        (_, Auto::Value(_)) => "an ideal frame of that scale has too many pixels for them",
        (_, Auto::Auto) => "one sample a pixel keeps quality.max_error_dn, or comes as close, in less time",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_are_ordered_by_tolerance_then_error_then_price() {
        let choice = |total_dn: f64, within: bool, ms: f64| SamplingChoice {
            plan: SamplingPlan::of_paper(),
            price: Price { ms, ..Price::default() },
            total_dn,
            within,
            least_dn: total_dn,
        };
        let cases = [
            ("the dear one keeps it", choice(0.9, true, 50.0), choice(1.1, false, 10.0)),
            ("both keep it", choice(0.9, true, 10.0), choice(0.3, true, 50.0)),
            ("none does, and the cheap one is far off", choice(0.60, false, 50.0), choice(0.95, false, 10.0)),
            ("none does, and both are near", choice(0.65, false, 10.0), choice(0.60, false, 50.0)),
            (
                "none does, and the cheap one is not near the least that the other could be",
                SamplingChoice { least_dn: 0.70, ..choice(0.78, false, 50.0) },
                choice(0.88, false, 10.0),
            ),
        ];
        for (what, better, worse) in cases {
            assert!(is_better(&better, &worse) && !is_better(&worse, &better), "{what}");
        }
    }
}
