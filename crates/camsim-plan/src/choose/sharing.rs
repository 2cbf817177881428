//! One ideal frame for several output frames. A key frame may be taken at any instant that shows what the
//! pixels look for: from one frame to the next the camera turns and moves little, and what the temporal
//! inverse does for the rows of one frame it does for those of the next.
//!
//! Frames are planned in groups that begin at multiples of `quality.frames_per_ideal`, so that which of them
//! share depends on the scenario alone. The ideal frame is taken in the middle of their time, wide and fine
//! enough for all of them. Each of them is then planned as any other: from this one key frame, with the same
//! dry runs and the same tolerances. If all of them keep what a frame of their own would, for less time, the
//! group shares; otherwise, or where halves could save more, each of its halves is tried, and so on. Where
//! silhouettes have rays of their own nothing is shared: another instant sees more of what is behind them.

mod merge;

use std::{ops::Range, sync::OnceLock};

use rayon::prelude::*;

use super::{
    frame_context::{FrameContext, FrameScene},
    picture::{self, PictureChoice},
    plan_inputs::PlanInputs,
    sampling::FINEST_SCALE,
    shared_ideal::{SamplingRequest, SharedIdeal},
};
use crate::{
    ir::{
        budget::{ErrorBudget, GROUP_SHARES, NEARLY},
        frame_plan::FramePlan,
        key_frame::KeyFrame,
        plan_error::PlanError,
        sampling_plan::SamplingPlan,
    },
    view::{
        ideal_extent::{TangentBounds, ideal_extent},
        lens_reach::LensReach,
    },
};
use merge::merged;

/// Sharing must spare this part of the time.
const WORTH: f64 = 0.1;
/// Largest ideal frame for several, in pixels of one for a single frame.
const MOST_AREA: f64 = 4.0;
/// From so many frames on the halves of a group are tried each for itself.
const FAR: u64 = 8;

/// Plans a frame in its context.
pub(crate) type PlanFrame =
    fn(&FrameContext<'_>, &FrameScene<'_>, &PictureChoice) -> Result<FramePlan, PlanError>;

/// Frames that were planned together.
#[derive(Debug)]
pub(crate) struct FrameGroup {
    first: u64,
    /// In order; `None` where a frame is to be planned by itself.
    plans: Vec<Option<FramePlan>>,
}

impl FrameGroup {
    /// The group of that number. Sharing is compared with what the middle frame would do by itself. A fault
    /// of that frame is its own: the others are then planned by themselves, and so is it, when it is asked
    /// for.
    pub fn new(
        inputs: &PlanInputs,
        plan_frame: PlanFrame,
        plan_alone: impl Fn(u64) -> Option<FramePlan>,
        number: u64,
    ) -> Self {
        let size = u64::from(inputs.quality().frames_per_ideal);
        let first = number * size;
        let frames = first..(first + size).min(inputs.sequence.frames);
        let mut plans = vec![None; (frames.end - first) as usize];
        if frames.end - first > 1 {
            let middle = (first + frames.end) / 2;
            if let Some(own) = plan_alone(middle).filter(|own| !own.edges.has_rays()) {
                plans = Sharing { inputs, plan_frame, own: &own }.fraction(frames);
            }
        }
        Self { first, plans }
    }

    /// The plan of a frame; `None` where it is to be planned by itself.
    pub fn plan(&self, frame: u64) -> Option<FramePlan> {
        self.plans.get((frame - self.first) as usize).cloned().flatten()
    }
}

/// Why a frame that does not share its ideal frame does not.
pub(crate) fn unshared_reason(inputs: &PlanInputs, plan: &FramePlan) -> &'static str {
    match inputs.reason_against_sharing() {
        Some(reason) => reason,
        None if plan.edges.has_rays() => {
            "rays at its silhouettes: another instant sees more of what is behind them"
        }
        None if inputs.sequence.frames == 1 => "there is no other",
        None => "from a shared one it or its neighbours would not keep the tolerances, or not for less time",
    }
}

/// Sharing among frames of a group, compared with the plan of one frame by itself.
struct Sharing<'a> {
    inputs: &'a PlanInputs,
    plan_frame: PlanFrame,
    own: &'a FramePlan,
}

impl Sharing<'_> {
    /// Plans of `frames` from one ideal frame, or from those of its halves, whichever takes less time; `None`
    /// for those that do not share.
    fn fraction(&self, frames: Range<u64>) -> Vec<Option<FramePlan>> {
        let own = self.own;
        let count = (frames.end - frames.start) as usize;
        let whole: Option<Vec<_>> =
            self.shared(frames.clone()).map(|plans| plans.into_iter().map(Some).collect());
        let price = |plans: &[Option<FramePlan>]| -> f64 {
            plans.iter().map(|plan| plan.as_ref().map_or(own.price_ms, |plan| plan.price_ms)).sum()
        };
        let half = count as u64 / 2;
        // Halves are sampled no more coarsely than a frame by itself is, and save as much of its ideal frame
        // as so many can.
        let least_of_halves =
            count as f64 * (own.price_ms - own.ideal_price_ms * (1.0 - 1.0 / half.max(1) as f64));
        if half < 2 || whole.as_ref().is_some_and(|whole| price(whole) <= least_of_halves) {
            return whole.unwrap_or_else(|| vec![None; count]);
        }
        let middle = frames.start + half;
        let mut halves = self.fraction(frames.start..middle);
        // What the first half cannot do the second hardly can, unless it is far away.
        let is_worth_a_try = halves.iter().any(Option::is_some) || half >= FAR;
        halves.extend(if is_worth_a_try {
            self.fraction(middle..frames.end)
        } else {
            vec![None; count - halves.len()]
        });
        whole.filter(|whole| price(whole) <= price(&halves)).unwrap_or(halves)
    }

    /// Plans of `frames` from one ideal frame, if each is as good as one by itself and cheaper.
    fn shared(&self, frames: Range<u64>) -> Option<Vec<FramePlan>> {
        let own = self.own;
        let shared = self.shared_ideal(frames.clone())?;
        let candidates = SharingCandidates::new(self, &shared);
        let is_worth_it = |price: f64, count: u64| price < (1.0 - WORTH) * own.price_ms * count as f64;
        // The outermost have the most silhouettes elsewhere: what even the finest of ideal frames cannot show
        // them needs no sampling.
        candidates.scene_of(frames.end - 1, None)?;
        // All are sampled as the first needs it; if that is too coarse for another, as that one does.
        let mut coarsest = frames.start;
        for fraction_of_dn in GROUP_SHARES {
            // What is dearer than frames by themselves already is no cheaper with its solver.
            let picture = candidates
                .picture(coarsest, fraction_of_dn)
                .filter(|picture| is_worth_it(picture.price.ms, 1))?;
            let sampling = picture.plan;
            candidates.scene_of(frames.end - 1, Some(sampling))?;
            // Pictures take less time than plans, and more often show that it does not do.
            let by_pictures = candidates.too_coarse(sampling).ok()?;
            let plans = if by_pictures.is_none() {
                let first = candidates.plan(frames.start, sampling);
                let first = first.filter(|plan| keeps_px(plan, own) && is_worth_it(plan.price_ms, 1))?;
                Some(candidates.plan_others(first, sampling)?)
            } else {
                None
            };
            match by_pictures.or_else(|| most_wrong(plans.as_ref()?, own)) {
                // Nothing that was tried does for it.
                Some(frame) if frame == coarsest => return None,
                Some(frame) => coarsest = frame,
                None => {
                    let price = |plans: &[FramePlan]| plans.iter().map(|plan| plan.price_ms).sum();
                    return plans.filter(|plans| is_worth_it(price(plans), shared.count())).map(merged);
                }
            }
        }
        None
    }

    /// The ideal frame that shows all that `frames` look at; `None` where it would be too large to be worth
    /// it.
    fn shared_ideal(&self, frames: Range<u64>) -> Option<SharedIdeal> {
        let (inputs, own) = (self.inputs, self.own);
        let reach: &LensReach = inputs.fixed.as_ref()?;
        let path = inputs.path();
        let (begin_s, end_s) = inputs.shutter.window_s();
        let key_s = 0.5 * (inputs.stamp_s(frames.start) + begin_s + inputs.stamp_s(frames.end - 1) + end_s);
        let keys = [KeyFrame { t_s: key_s, pose: path.pose(key_s) }];
        let surfaces = &inputs.scene.surfaces;
        let extent = |frame: u64| {
            let shutter = inputs.shutter_of(frame);
            ideal_extent(reach, path, &shutter, inputs.stamp_s(frame), key_s, &keys, surfaces, None)
        };
        let extent = frames.clone().map(extent).reduce(TangentBounds::and)?;
        let scale = own.ideal.scale(&own.camera);
        let area = |[width, height]: [u32; 2]| f64::from(width) * f64::from(height);
        let times = area(extent.pixels(&reach.camera, scale).size_px) / area(own.ideal.size_px);
        let count = (frames.end - frames.start) as f64;
        (times < MOST_AREA && times < (1.0 - WORTH) * count).then_some(SharedIdeal { frames, key_s, extent })
    }
}

/// Frames that may be made from one ideal frame. What each of them sees is found once, however often it is
/// planned.
struct SharingCandidates<'a> {
    sharing: &'a Sharing<'a>,
    shared: &'a SharedIdeal,
    scenes: Vec<OnceLock<Option<(FrameContext<'a>, FrameScene<'a>)>>>,
}

impl<'a> SharingCandidates<'a> {
    fn new(sharing: &'a Sharing<'a>, shared: &'a SharedIdeal) -> Self {
        Self { sharing, shared, scenes: shared.frames.clone().map(|_| OnceLock::new()).collect() }
    }

    /// What a frame sees from the shared ideal frame; `None` where silhouettes would cost too much with such
    /// a sampling, and for a fault.
    fn scene_of(
        &self,
        frame: u64,
        given: Option<SamplingPlan>,
    ) -> Option<(FrameContext<'a>, &FrameScene<'a>)> {
        let cell = self.scenes.get((frame - self.shared.frames.start) as usize)?;
        let find = || {
            let context = FrameContext::new(self.sharing.inputs, frame, Some(self.shared)).ok()?;
            let scene = context.scene();
            Some((context, scene))
        };
        let known = if let Some(known) = cell.get() {
            known
        } else {
            // Finding it is parallel in itself: no thread waits for it, as that may have a part of it to do.
            let scene = find();
            cell.get_or_init(|| scene)
        };
        let (context, scene) = known.as_ref()?;
        let scale = given.map_or(FINEST_SCALE, |sampling| sampling.scale);
        scene.may_be_shared(self.sharing.inputs.quality(), scale).then(|| (context.clone(), scene))
    }

    /// How a frame's picture would be made from the shared ideal frame, sampled as it needs for a part of
    /// `quality.max_error_dn`.
    fn picture(&self, frame: u64, fraction_of_dn: f64) -> Option<PictureChoice> {
        let (context, scene) = self.scene_of(frame, None)?;
        Some(picture::choose(&context.requesting(SamplingRequest { fraction_of_dn, given: None }), scene))
    }

    /// The plan of a frame that is sampled so.
    fn plan(&self, frame: u64, sampling: SamplingPlan) -> Option<FramePlan> {
        let (context, scene) = self.scene_of(frame, Some(sampling))?;
        let request = SamplingRequest { given: Some(sampling), ..SamplingRequest::default() };
        let context = context.requesting(request);
        (self.sharing.plan_frame)(&context, scene, &picture::choose(&context, scene)).ok()
    }

    /// The frame that is sampled most too coarsely so, by its picture alone. `Err` where one may not be
    /// sampled so at all.
    fn too_coarse(&self, sampling: SamplingPlan) -> Result<Option<u64>, CannotShare> {
        let request = SamplingRequest { given: Some(sampling), ..SamplingRequest::default() };
        let picture_dn = |frame: u64| {
            let (context, scene) = self.scene_of(frame, Some(sampling)).ok_or(CannotShare)?;
            Ok((frame, picture::choose(&context.requesting(request), scene).total_dn))
        };
        let all: Vec<(u64, f64)> =
            self.shared.frames.clone().into_par_iter().map(picture_dn).collect::<Result<_, _>>()?;
        let Sharing { inputs, own, .. } = self.sharing;
        let most_dn = if own.predicted.picture_error_kept {
            ErrorBudget::new(inputs.quality()).sampling_dn(&inputs.sequence.scene)
        } else {
            own.predicted.picture_dn()
        };
        let worst = all.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
        Ok(worst.filter(|(_, dn)| *dn > most_dn).map(|(frame, _)| frame))
    }

    /// The plans of all, in order, sampled as the plan of the first is; `None` where one of them does not
    /// keep `quality.max_error_px`.
    fn plan_others(&self, first: FramePlan, sampling: SamplingPlan) -> Option<Vec<FramePlan>> {
        let frames = &self.shared.frames;
        let plan = |frame: u64| self.plan(frame, sampling).filter(|plan| keeps_px(plan, self.sharing.own));
        // What does for the outermost mostly does for those between.
        let last = plan(frames.end - 1)?;
        let between: Vec<u64> = (frames.start + 1..frames.end - 1).collect();
        let between = between.into_par_iter().map(plan).collect::<Option<Vec<_>>>()?;
        Some(std::iter::once(first).chain(between).chain([last]).collect())
    }
}

/// Frames that are better not made from one ideal frame.
struct CannotShare;

/// Whether a frame from a shared ideal frame keeps `quality.max_error_px`, or comes as near as one from its
/// own does.
fn keeps_px(plan: &FramePlan, own: &FramePlan) -> bool {
    let (here, there) = (&plan.predicted, &own.predicted);
    !plan.edges.has_rays()
        && (here.source_error_kept || !there.source_error_kept && here.total_px <= NEARLY * there.total_px)
}

/// The frame that is farthest from keeping `quality.max_error_dn`, or from coming as near as one from its own
/// ideal frame does; `None` if all do.
fn most_wrong(plans: &[FramePlan], own: &FramePlan) -> Option<u64> {
    let keeps = |plan: &FramePlan| {
        let (here, there) = (&plan.predicted, &own.predicted);
        here.picture_error_kept || !there.picture_error_kept && here.picture_dn() <= there.picture_dn()
    };
    let wrong = plans.iter().filter(|plan| !keeps(plan));
    wrong.max_by(|a, b| a.predicted.picture_dn().total_cmp(&b.predicted.picture_dn())).map(|plan| plan.frame)
}
