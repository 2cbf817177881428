//! How a frame's picture is made: what reads the ideal frame and how fine that is, and whether pixels at
//! silhouettes have rays of their own.

use super::{
    contours::{Contours, Outlook},
    costs::Price,
    edges,
    levels::{Choice, FINEST_SCALE, MOST_SCALE, NEARLY, Sampling, Task, for_sampling_dn},
    look::{Look, Scenery},
    prospect::Prospect,
};
use camsim_core::{
    scenario::{Auto, QualitySpec, Silhouettes},
    temporal::SAMPLES,
};

/// Largest scale of an ideal frame of 4 samples a pixel: more pixels, whose samples have depth alone, cost
/// less than finer ones.
const MOST_SCALE_WITH_RAYS: f64 = 2.83;

/// Pixels of the largest ideal frame with several samples a pixel, of 12 bytes each on a device, and those
/// along a side: the host draws twice as many there, whose places it knows up to 32 768.
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
pub(super) struct Picture {
    pub sampling: Sampling,
    /// What silhouettes cost then.
    pub silhouettes: Option<Contours>,
    /// Whether they are left as they are, and if not, fine pixels along a side of each ideal one.
    pub is_plain: bool,
    pub fine: u32,
    pub rays: u32,
    pub price: Price,
    /// RMS error over the picture as far as that is expected, 1/255 of the linear range.
    pub total_dn: f64,
}

impl Picture {
    /// What silhouettes cost, 1/255 of the linear range.
    pub fn silhouettes_dn(&self) -> f64 {
        self.silhouettes.map_or(0.0, |silhouettes| silhouettes.error_dn)
    }

    fn of(choice: &Choice, silhouettes: Option<Contours>, is_plain: bool, [fine, rays]: [u32; 2]) -> Self {
        Self {
            sampling: choice.sampling,
            silhouettes,
            is_plain,
            fine,
            rays,
            price: choice.price,
            total_dn: choice.total_dn,
        }
    }
}

impl Look<'_> {
    /// The cheapest picture within `quality.max_error_dn`, or the best there is.
    pub fn picture(&self, scenery: &Scenery<'_>) -> Picture {
        if self.is_paper() {
            return Picture {
                sampling: Sampling::of_paper(),
                silhouettes: None,
                is_plain: true,
                fine: 1,
                rays: 0,
                price: Price::default(),
                total_dn: 0.0,
            };
        }
        let quality = &self.planner.sequence.scenario.quality;
        let most_error_dn = for_sampling_dn(quality, &self.planner.sequence.scene);
        let max_error_dn = most_error_dn * self.asked.share_of_dn;
        let task = Task {
            quality,
            max_error_dn,
            most_error_dn,
            least_scale: self.reach.least_scale(),
            most_scale: self.scale_of(scenery, self.planner.max_ideal_px, self.planner.max_side_px),
            ideal_share: self.ideal_share(scenery),
            may_have_samples: false,
            exposure: self.exposed(scenery.motion, &scenery.ideal).path(quality, &mut Vec::new()),
        };
        let Scenery { prospect, outlook, .. } = scenery;
        let layers_dn = scenery.layers_dn();
        let given = self.asked.given;
        let Some(outlook) = outlook else {
            let usual =
                |sampling: &Sampling, _| is_up_to(MOST_SCALE, sampling.scale, &task).then_some(layers_dn);
            let choice = given.map_or_else(
                || prospect.choose(&task, &usual),
                |given| prospect.given(&given, &task, &usual),
            );
            return Picture::of(&choice, None, false, [1, 0]);
        };
        let of_plain = Task { may_have_samples: scenery.may_have_samples, ..task };
        let most_sampled_scale =
            self.scale_of(scenery, MOST_SAMPLED_PX, MOST_SAMPLED_SIDE_PX.min(self.planner.max_side_px));
        let may_be_plain = |sampling: &Sampling| {
            let (is_one, is_small) = (sampling.samples_a_pixel == 1, sampling.scale <= most_sampled_scale);
            // Several that are asked for are taken wherever they can be.
            let is_asked = is_small != is_one
                || quality.ideal_samples != Auto::Value(SAMPLES)
                || !scenery.may_have_samples;
            (is_one || is_small) && is_asked && is_up_to(FINEST_SCALE, sampling.scale, &of_plain)
        };
        // Samples that are asked for are for silhouettes that are left as they are.
        let is_plain_by_hand =
            quality.silhouettes == Silhouettes::Plain || quality.ideal_samples == Auto::Value(SAMPLES);
        let plain_if = |is_wanted: &dyn Fn(&Contours) -> bool| match given {
            Some(given) => prospect.given(&given, &of_plain, &|sampling, blur| {
                Some(outlook.plain(sampling, blur).error_dn.hypot(layers_dn))
            }),
            None => prospect.choose(&of_plain, &|sampling, blur| {
                let plain =
                    may_be_plain(sampling).then(|| outlook.plain(sampling, blur)).filter(is_wanted)?;
                Some(plain.error_dn.hypot(layers_dn))
            }),
        };
        let plain = || plain_if(&|plain| is_plain_by_hand || plain.are_affordable(max_error_dn));
        let rays = |scale: f64, &Rays { fine, most_part }: &Rays| match (quality.blur_samples, task.exposure)
        {
            (Auto::Value(samples), Some(_)) => {
                samples.clamp(LEAST_RAYS_BY_HAND * fine, MOST_RAYS_BY_HAND).next_power_of_two()
            }
            _ => outlook.rays(scale, fine, most_part),
        };
        let with_rays = || {
            let most_fine = |scale: f64| {
                let size_px =
                    scenery.ideal.size_px.map(|side| (f64::from(side) * scale / task.least_scale) as u32);
                edges::most_fine(size_px, self.planner.max_side_px)
            };
            WithRays { prospect, task: &task, outlook, layers_dn, most_fine: &most_fine, count: &rays }
                .choose()
        };
        let (choice, kind) = match quality.silhouettes {
            Silhouettes::Plain => (plain(), None),
            Silhouettes::Auto if is_plain_by_hand && scenery.may_have_samples => (plain(), None),
            // Another instant sees more of what is behind a silhouette than rays could make up for.
            Silhouettes::Auto if self.common.is_some() => (plain(), None),
            Silhouettes::Auto if quality.key_frames == Auto::Auto => {
                let plain = plain();
                let fewest = rays(task.least_scale, &Rays::FEWEST);
                if plain.within
                    && plain.price.ms
                        < prospect.rays_ms(outlook.share, task.least_scale, 1, fewest, task.ideal_share)
                {
                    (plain, None)
                } else {
                    let (with_rays, kind) = with_rays();
                    // Where nothing keeps the tolerance silhouettes may take all of it.
                    let plain = if plain.within || with_rays.within { plain } else { plain_if(&|_| true) };
                    if is_better(&plain, &with_rays) { (plain, None) } else { (with_rays, Some(kind)) }
                }
            }
            Silhouettes::Auto | Silhouettes::Rays => {
                let (with_rays, kind) = with_rays();
                (with_rays, Some(kind))
            }
        };
        let (sampling, blur) = (&choice.sampling, choice.sampling.tried(quality, task.exposure));
        let (fine, rays) = kind.map_or((1, 0), |kind| (kind.fine, rays(sampling.scale, &kind)));
        let silhouettes = Some(if rays == 0 {
            outlook.plain(sampling, blur)
        } else {
            outlook.with_rays(sampling, blur, fine, rays)
        });
        Picture::of(&choice, silhouettes, rays == 0, [fine, rays])
    }

    /// Scale from which on the ideal frame has more pixels, or more along a side.
    fn scale_of(&self, scenery: &Scenery<'_>, pixels: u64, side_px: u32) -> f64 {
        let [width, height] = scenery.ideal.size_px.map(f64::from);
        let by_area = (pixels as f64 / (width * height)).sqrt();
        by_area.min(f64::from(side_px) / width.max(height)) * self.reach.least_scale()
    }

    /// Pixels that are drawn of the ideal frame at scale 1 for each of the camera's.
    fn ideal_share(&self, scenery: &Scenery<'_>) -> f64 {
        let pixels = |[width, height]: [u32; 2]| f64::from(width) * f64::from(height);
        let frames = self.common.map_or(1.0, |common| common.count() as f64);
        pixels(scenery.ideal.size_px)
            / (pixels(self.reach.camera.size_px) * self.reach.least_scale().powi(2) * frames)
    }
}

/// Whether one is the better choice: within the tolerance, or where neither is, near the least error that
/// there is; and of two that are, the cheaper one.
fn is_better(one: &Choice, other: &Choice) -> bool {
    let least_dn = one.least_dn.min(other.least_dn);
    let is_good = |choice: &Choice| {
        if one.within || other.within { choice.within } else { choice.total_dn <= NEARLY * least_dn }
    };
    is_good(one) && (!is_good(other) || one.price.ms < other.price.ms)
}

/// Whether a scale is not above a usual one; those that are asked for, or the lens needs, always are.
fn is_up_to(most_scale: f64, scale: f64, task: &Task<'_>) -> bool {
    scale <= task.least_scale.max(most_scale) || task.quality.ideal_scale.value().is_some()
}

/// A kind of rays at silhouettes.
#[derive(Clone, Copy)]
struct Rays {
    /// Fine pixels along a side of an ideal one.
    fine: u32,
    /// Part of the error, squared, that too few of them may add.
    most_part: f64,
}

impl Rays {
    const FEWEST: Self = Self { fine: 1, most_part: FEW_ADD };

    /// In the order in which they are tried: more pixels cost less than finer ones, so that these are for
    /// what the finest ideal frame does not do. Where nothing moves the fewest add nothing.
    fn all(moves: bool) -> impl Iterator<Item = Self> {
        let parts: &[f64] = if moves { &[FEW_ADD, MANY_ADD] } else { &[FEW_ADD] };
        (1..=edges::MOST_FINE)
            .flat_map(move |fine| parts.iter().map(move |&most_part| Self { fine, most_part }))
    }
}

/// Pictures whose silhouettes have rays of their own.
struct WithRays<'a> {
    prospect: &'a Prospect<'a>,
    task: &'a Task<'a>,
    outlook: &'a Outlook,
    layers_dn: f64,
    /// By the ideal frame's scale, most fine pixels along a side of an ideal one, and rays a pixel.
    most_fine: &'a dyn Fn(f64) -> u32,
    count: &'a dyn Fn(f64, &Rays) -> u32,
}

impl WithRays<'_> {
    /// The first kind of rays with which a picture keeps the tolerance, or comes near the best there is.
    fn choose(&self) -> (Choice, Rays) {
        let mut failed = Vec::new();
        for rays in Rays::all(self.outlook.moves()) {
            let choice = self.choose_of(rays);
            if choice.within {
                return (choice, rays);
            }
            failed.push((choice, rays));
        }
        let least_dn = failed.iter().map(|(choice, _)| choice.least_dn).fold(f64::INFINITY, f64::min);
        let near = failed.into_iter().find(|(choice, _)| choice.total_dn <= NEARLY * least_dn);
        near.map_or_else(
            || (self.choose_of(Rays::FEWEST), Rays::FEWEST),
            |(choice, rays)| (Choice { least_dn, ..choice }, rays),
        )
    }

    fn choose_of(&self, rays: Rays) -> Choice {
        let Self { prospect, task, outlook, layers_dn, most_fine, count } = *self;
        let fine = rays.fine;
        let most_scale = if fine == 1 { MOST_SCALE_WITH_RAYS } else { MOST_SCALE };
        let may = |scale: f64| fine <= most_fine(scale) && is_up_to(most_scale, scale, task);
        let choice = prospect.choose(task, &|sampling, blur| {
            let count = count(sampling.scale, &rays);
            may(sampling.scale)
                .then(|| outlook.with_rays(sampling, blur, fine, count).error_dn.hypot(layers_dn))
        });
        let scale = choice.sampling.scale;
        let rays_ms = prospect.rays_ms(outlook.share, scale, fine, count(scale, &rays), task.ideal_share);
        Choice { price: choice.price.with_rays(rays_ms), ..choice }
    }
}

/// Why pixels of the ideal frame have one sample.
pub(super) fn why_one_sample(
    scenery: &Scenery<'_>,
    picture: &Picture,
    quality: &QualitySpec,
) -> &'static str {
    match (&scenery.outlook, quality.ideal_samples) {
        _ if !scenery.may_have_samples => {
            "surfaces have holes by their pictures, or are mixed with what is behind them: samples do not show such borders"
        }
        (None, _) => "nothing depends on where borders are",
        _ if !picture.is_plain => "silhouettes have rays of their own",
        (_, Auto::Value(1)) => "quality.ideal_samples is 1",
        (_, Auto::Value(_)) => "an ideal frame of that scale has too many pixels for them",
        (_, Auto::Auto) => "one keeps quality.max_error_dn, or comes as near, for less time",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_keeps_the_tolerance_is_taken_then_what_is_most_exact_then_what_is_cheaper() {
        let choice = |total_dn: f64, within: bool, ms: f64| Choice {
            sampling: Sampling::of_paper(),
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
                Choice { least_dn: 0.70, ..choice(0.78, false, 50.0) },
                choice(0.88, false, 10.0),
            ),
        ];
        for (what, better, worse) in cases {
            assert!(is_better(&better, &worse) && !is_better(&worse, &better), "{what}");
        }
    }
}
