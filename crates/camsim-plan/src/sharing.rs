//! One ideal frame for several output frames. A key frame may be taken at any instant that shows what the
//! pixels look for: from one frame to the next the camera turns and moves little, and what the temporal
//! inverse does for the lines of one frame it does for those of the next.
//!
//! Frames are looked at in groups that begin at multiples of `quality.frames_per_ideal`, so that which of
//! them share depends on the scenario alone. The ideal frame is taken in the middle of their time, wide and
//! fine enough for all of them. Each of them is then planned as any other: from this one key frame, with the
//! same dry runs and the same tolerances. If all of them keep what a frame of their own would, for less time,
//! the group shares; otherwise, or where halves could save more, each of its halves is tried, and so on.
//! Where silhouettes have rays of their own nothing is shared: another instant sees more of what is behind
//! them.

use std::{
    ops::Range,
    sync::{Arc, OnceLock},
};

use rayon::prelude::*;

use super::{
    FramePlan, KeyFrame, LensReach, Motion, Planner, Predicted, Skip, bounds,
    bounds::View,
    levels::{FINEST_SCALE, NEARLY, Sampling, for_sampling_dn},
    look::{Look, Scenery},
    picture::Picture,
};
use camsim_core::scenario::{Auto, Preset, Silhouettes};

/// Sharing must spare this part of the time.
const WORTH: f64 = 0.1;
/// Largest ideal frame for several, in pixels of one for a single frame.
const MOST_AREA: f64 = 4.0;
/// Parts of `quality.max_error_dn` that a frame is sampled for, one after the other, so that the others keep
/// all of it. Neighbours differ by a few percent.
const SHARES: [f64; 3] = [0.95, 1.0, 0.85];
/// Threads for each group that is looked at at once, and such groups at most.
const THREADS_A_GROUP: usize = 2;
const MOST_AT_ONCE: usize = 8;
/// From so many frames on the halves of a group are tried each for itself.
const FAR: u64 = 8;

/// The ideal frame of several output frames.
#[derive(Debug)]
pub(super) struct Common {
    frames: Range<u64>,
    pub key_s: f64,
    pub view: View,
}

/// What is asked of the way in which a frame is sampled.
#[derive(Clone, Copy, Debug)]
pub(super) struct Asked {
    /// Part of `quality.max_error_dn` that it is to keep.
    pub share_of_dn: f64,
    /// The way itself; `None` as long as that is to be found.
    pub given: Option<Sampling>,
}

impl Default for Asked {
    fn default() -> Self {
        Self { share_of_dn: 1.0, given: None }
    }
}

/// Frames that may be made from one ideal frame. What each of them sees is looked at once, however often it
/// is planned.
struct Candidates<'a> {
    planner: &'a Planner,
    common: &'a Common,
    seen: Vec<OnceLock<Option<(Look<'a>, Scenery<'a>)>>>,
}

impl<'a> Candidates<'a> {
    fn new(planner: &'a Planner, common: &'a Common) -> Self {
        Self { planner, common, seen: common.frames.clone().map(|_| OnceLock::new()).collect() }
    }

    /// What a frame sees from the common ideal frame; `None` where silhouettes would cost too much with such
    /// a sampling, and for a fault.
    fn see(&self, frame: u64, given: Option<Sampling>) -> Option<(Look<'a>, &Scenery<'a>)> {
        let place = self.seen.get((frame - self.common.frames.start) as usize)?;
        let see = || {
            let look = self.planner.look(frame, Some(self.common)).ok()?;
            let scenery = look.scenery();
            Some((look, scenery))
        };
        let seen = if let Some(seen) = place.get() {
            seen
        } else {
            // Looking is parallel in itself: nobody waits for it, as whoever does may have a part of it to
            // do.
            let seen = see();
            place.get_or_init(|| seen)
        };
        let (look, scenery) = seen.as_ref()?;
        let scale = given.map_or(FINEST_SCALE, |sampling| sampling.scale);
        scenery.may_be_shared(&self.planner.sequence.scenario.quality, scale).then(|| (look.clone(), scenery))
    }

    /// How a frame's picture would be made from the common ideal frame, sampled as it needs for a part of
    /// `quality.max_error_dn`.
    fn picture(&self, frame: u64, share_of_dn: f64) -> Option<Picture> {
        let (look, scenery) = self.see(frame, None)?;
        Some(look.asking(Asked { share_of_dn, given: None }).picture(scenery))
    }

    /// The plan of a frame that is sampled so.
    fn plan(&self, frame: u64, sampling: Sampling) -> Option<FramePlan> {
        let (look, scenery) = self.see(frame, Some(sampling))?;
        self.planner.plan_of(&look.asking(Asked { given: Some(sampling), ..Asked::default() }), scenery).ok()
    }

    /// The frame that is sampled most too coarsely so, by its picture alone. `Err` where one may not be
    /// sampled so at all.
    fn too_coarse(&self, sampling: Sampling, own: &FramePlan) -> Result<Option<u64>, CannotShare> {
        let asked = Asked { given: Some(sampling), ..Asked::default() };
        let picture_dn = |frame: u64| {
            let (look, scenery) = self.see(frame, Some(sampling)).ok_or(CannotShare)?;
            Ok((frame, look.asking(asked).picture(scenery).total_dn))
        };
        let all: Vec<(u64, f64)> =
            self.common.frames.clone().into_par_iter().map(picture_dn).collect::<Result<_, _>>()?;
        let sequence = &self.planner.sequence;
        let most_dn = if own.predicted.levels_kept {
            for_sampling_dn(&sequence.scenario.quality, &sequence.scene)
        } else {
            own.predicted.picture_dn()
        };
        let worst = all.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
        Ok(worst.filter(|(_, dn)| *dn > most_dn).map(|(frame, _)| frame))
    }

    /// The plans of all, in order, sampled as the plan of the first is; `None` where one of them does not
    /// keep `quality.max_error_px`.
    fn plan_others(&self, first: FramePlan, sampling: Sampling, own: &FramePlan) -> Option<Vec<FramePlan>> {
        let frames = &self.common.frames;
        let plan = |frame: u64| self.plan(frame, sampling).filter(|plan| keeps_px(plan, own));
        // What does for the outermost mostly does for those between.
        let last = plan(frames.end - 1)?;
        let between: Vec<u64> = (frames.start + 1..frames.end - 1).collect();
        let between = between.into_par_iter().map(plan).collect::<Option<Vec<_>>>()?;
        Some(std::iter::once(first).chain(between).chain([last]).collect())
    }
}

/// Frames that are better not made from one ideal frame.
struct CannotShare;

impl Common {
    /// Output frames made from it.
    pub fn count(&self) -> u64 {
        self.frames.end - self.frames.start
    }
}

/// Frames that were looked at together.
#[derive(Debug)]
pub(super) struct Group {
    first: u64,
    /// In order; `None` where a frame is to be planned by itself.
    plans: Vec<Option<FramePlan>>,
}

impl Planner {
    /// Number of the group of a frame: frames of one are best planned one after the other, by the same
    /// thread.
    #[must_use]
    pub fn group_of(&self, frame: u64) -> u64 {
        if self.may_share() {
            frame / u64::from(self.sequence.scenario.quality.frames_per_ideal)
        } else {
            frame
        }
    }

    /// Groups that are best planned at once, each by a thread of its own: looking at one is parallel in
    /// itself, but not all of it.
    #[must_use]
    pub fn groups_at_once() -> usize {
        (rayon::current_num_threads() / THREADS_A_GROUP).clamp(1, MOST_AT_ONCE)
    }

    /// Forgets the groups that were planned. Plans stay the same: for benchmarks, which plan the same frames
    /// over and over.
    pub fn forget(&self) {
        self.surroundings.forget();
        self.surroundings_by_half.forget();
        self.groups.forget();
        self.last.forget();
    }

    /// What frames of a group look at: neighbours in time are nearly alike, and have other probes each.
    pub(super) fn half_the_probes(&self, frame: u64) -> Option<Arc<LensReach>> {
        self.halves
            .as_ref()
            .map(|[even, odd]| if frame.is_multiple_of(2) { even.clone() } else { odd.clone() })
    }

    /// What they are run dry at: their neighbours are made the same way, or nearly, from the same ideal
    /// frame.
    pub(super) fn quarter_of_the_probes(&self, frame: u64) -> Option<Arc<LensReach>> {
        self.quarters
            .as_ref()
            .map(|quarters| quarters[(frame % 2) as usize][(frame / 2 % 2) as usize].clone())
    }

    /// The plan of a frame as its group has it; `None` where it is to be planned by itself.
    pub(super) fn shared_plan(&self, frame: u64) -> Option<FramePlan> {
        if !self.may_share() || frame >= self.sequence.frames {
            return None;
        }
        let number = self.group_of(frame);
        let group = self.groups.of(number, || self.group(number));
        group.plans.get((frame - group.first) as usize).cloned().flatten()
    }

    /// Whether the scenario leaves it to the plan how frames are made.
    fn may_share(&self) -> bool {
        self.forbids_sharing().is_none()
    }

    /// What in the scenario has each frame made by itself.
    fn forbids_sharing(&self) -> Option<&'static str> {
        let quality = &self.sequence.scenario.quality;
        let reasons = [
            (quality.preset == Preset::Paper, "quality.preset = \"paper\""),
            (quality.frames_per_ideal == 1, "quality.frames_per_ideal = 1"),
            (quality.solver != Auto::Auto, "quality.solver is given"),
            (quality.key_frames != Auto::Auto, "quality.key_frames is given"),
            (quality.silhouettes == Silhouettes::Rays, "quality.silhouettes = \"rays\""),
            (self.zoom.is_some(), "the lens zooms"),
        ];
        reasons.into_iter().find_map(|(holds, reason)| holds.then_some(reason))
    }

    /// Why a frame that does not share its ideal frame does not.
    pub(super) fn why_alone(&self, plan: &FramePlan) -> &'static str {
        match self.forbids_sharing() {
            Some(reason) => reason,
            None if plan.edges.has_rays() => {
                "rays at its silhouettes: another instant sees more of what is behind them"
            }
            None if self.sequence.frames == 1 => "there is no other",
            None => {
                "from a common one it or its neighbours would not keep the tolerances, or not for less time"
            }
        }
    }

    /// Sharing is compared with what the middle frame would do by itself. A fault of that frame is its own:
    /// the others are then planned by themselves, and so is it, when it is asked for.
    fn group(&self, number: u64) -> Group {
        let size = u64::from(self.sequence.scenario.quality.frames_per_ideal);
        let first = number * size;
        let frames = first..(first + size).min(self.sequence.frames);
        let mut plans = vec![None; (frames.end - first) as usize];
        if frames.end - first > 1 {
            let middle = (first + frames.end) / 2;
            let own = self.look_as_in_group(middle).and_then(|look| self.plan_of(&look, &look.scenery()));
            if let Some(own) = own.ok().filter(|own| !own.edges.has_rays()) {
                plans = self.share(frames, &own);
            }
        }
        Group { first, plans }
    }

    /// Plans of `frames` from one ideal frame, or from those of its halves, whichever takes less time; `None`
    /// for those that do not share.
    fn share(&self, frames: Range<u64>, own: &FramePlan) -> Vec<Option<FramePlan>> {
        let count = (frames.end - frames.start) as usize;
        let whole: Option<Vec<_>> =
            self.shared(frames.clone(), own).map(|plans| plans.into_iter().map(Some).collect());
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
        let mut halves = self.share(frames.start..middle, own);
        // What the first half cannot do the second hardly can, unless it is far away.
        let is_worth_a_try = halves.iter().any(Option::is_some) || half >= FAR;
        halves.extend(if is_worth_a_try {
            self.share(middle..frames.end, own)
        } else {
            vec![None; count - halves.len()]
        });
        whole.filter(|whole| price(whole) <= price(&halves)).unwrap_or(halves)
    }

    /// Plans of `frames` from one ideal frame, if each is as good as one by itself and cheaper. `own` is such
    /// a one.
    fn shared(&self, frames: Range<u64>, own: &FramePlan) -> Option<Vec<FramePlan>> {
        let common = self.common(frames.clone(), own)?;
        let candidates = Candidates::new(self, &common);
        let is_worth_it = |price: f64, count: u64| price < (1.0 - WORTH) * own.price_ms * count as f64;
        // The outermost have the most silhouettes elsewhere: what even the finest of ideal frames cannot show
        // them needs no sampling.
        candidates.see(frames.end - 1, None)?;
        // All are sampled as the first needs it; if that is too coarse for another, as that one does.
        let mut coarsest = frames.start;
        for share_of_dn in SHARES {
            // What is dearer than frames by themselves already is no cheaper with its solver.
            let picture = candidates
                .picture(coarsest, share_of_dn)
                .filter(|picture| is_worth_it(picture.price.ms, 1))?;
            let sampling = picture.sampling;
            candidates.see(frames.end - 1, Some(sampling))?;
            // Pictures take less than plans, and more often tell that it does not do.
            let by_pictures = candidates.too_coarse(sampling, own).ok()?;
            let plans = if by_pictures.is_none() {
                let first = candidates.plan(frames.start, sampling);
                let first = first.filter(|plan| keeps_px(plan, own) && is_worth_it(plan.price_ms, 1))?;
                Some(candidates.plan_others(first, sampling, own)?)
            } else {
                None
            };
            match by_pictures.or_else(|| most_wrong(plans.as_ref()?, own)) {
                // Nothing that was tried does for it.
                Some(frame) if frame == coarsest => return None,
                Some(frame) => coarsest = frame,
                None => {
                    let price = |plans: &[FramePlan]| plans.iter().map(|plan| plan.price_ms).sum();
                    return plans.filter(|plans| is_worth_it(price(plans), common.count())).map(together);
                }
            }
        }
        None
    }

    /// The ideal frame that shows all that `frames` look at; `None` where it would be too large to be worth
    /// it.
    fn common(&self, frames: Range<u64>, own: &FramePlan) -> Option<Common> {
        let reach: &LensReach = self.fixed.as_ref()?;
        let path = &*self.sequence.path;
        let (begin_s, end_s) = self.shutter.window_s();
        let key_s = 0.5 * (self.stamp_s(frames.start) + begin_s + self.stamp_s(frames.end - 1) + end_s);
        let keys = [KeyFrame { t_s: key_s, pose: path.pose(key_s) }];
        let view = |frame: u64| {
            bounds::view(reach, path, &self.shutter, self.stamp_s(frame), key_s, &keys, &self.surfaces, None)
        };
        let view = frames.clone().map(view).reduce(View::and)?;
        let scale = own.ideal.scale(&own.camera);
        let area = |[width, height]: [u32; 2]| f64::from(width) * f64::from(height);
        let times = area(view.pixels(&reach.camera, scale).size_px) / area(own.ideal.size_px);
        let count = (frames.end - frames.start) as f64;
        (times < MOST_AREA && times < (1.0 - WORTH) * count).then_some(Common { frames, key_s, view })
    }
}

/// Whether a frame from a common ideal frame keeps `quality.max_error_px`, or comes as near as one from its
/// own does.
fn keeps_px(plan: &FramePlan, own: &FramePlan) -> bool {
    let (here, there) = (&plan.predicted, &own.predicted);
    !plan.edges.has_rays() && (here.kept || !there.kept && here.total_px <= NEARLY * there.total_px)
}

/// The frame that is farthest from keeping `quality.max_error_dn`, or from coming as near as one from its own
/// ideal frame does; `None` if all do.
fn most_wrong(plans: &[FramePlan], own: &FramePlan) -> Option<u64> {
    let keeps = |plan: &FramePlan| {
        let (here, there) = (&plan.predicted, &own.predicted);
        here.levels_kept || !there.levels_kept && here.picture_dn() <= there.picture_dn()
    };
    let wrong = plans.iter().filter(|plan| !keeps(plan));
    wrong.max_by(|a, b| a.predicted.picture_dn().total_cmp(&b.predicted.picture_dn())).map(|plan| plan.frame)
}

/// Plans from one ideal frame: what that is made by is the strictest of all.
fn together(mut plans: Vec<FramePlan>) -> Vec<FramePlan> {
    let (Some(first), Some(last)) =
        (plans.first().map(|plan| plan.frame), plans.last().map(|plan| plan.frame))
    else {
        return plans;
    };
    let terrain_error_px = plans.iter().map(|plan| plan.terrain_error_px).fold(f64::INFINITY, f64::min);
    let motion = plans.iter().map(|plan| plan.motion).reduce(Motion::and).unwrap_or_default();
    let sources: Vec<OfSources> = plans.iter().map(|plan| OfSources::of(plan, &plans)).collect();
    for (plan, sources) in plans.iter_mut().zip(sources) {
        sources.write(&mut plan.predicted);
        plan.shared_by = Some([first, last]);
        plan.predicted.ground =
            plan.predicted.ground.map(|ground| ground.times(terrain_error_px / plan.terrain_error_px));
        plan.terrain_error_px = terrain_error_px;
        plan.motion = motion;
        plan.skipped.push(Skip {
            what: "ideal frame of its own",
            reason: format!("frames {first} to {last} are made from one"),
        });
    }
    plans
}

/// How far sources are off in frames from one ideal frame that are solved in the same way: each has been run
/// dry at a part of the probes, and they are alike, so that all answer for the largest error that any has
/// found.
struct OfSources {
    most: Predicted,
    probes: u32,
    kept: bool,
}

impl OfSources {
    fn of(plan: &FramePlan, plans: &[FramePlan]) -> Self {
        let is_alike = |other: &&FramePlan| other.temporal == plan.temporal && other.blur == plan.blur;
        let all = || plans.iter().filter(is_alike).map(|plan| &plan.predicted);
        let most = |of: fn(&Predicted) -> f64| all().map(of).fold(0.0, f64::max);
        let worst = all().max_by(|a, b| a.total_px.total_cmp(&b.total_px));
        Self {
            most: Predicted {
                lens_px: most(|of| of.lens_px),
                temporal_px: most(|of| of.temporal_px),
                depth_px: most(|of| of.depth_px),
                level_of_detail_px: most(|of| of.level_of_detail_px),
                nodes_px: most(|of| of.nodes_px),
                format_px: most(|of| of.format_px),
                total_px: most(|of| of.total_px),
                void_share: most(|of| of.void_share),
                in_the_way: worst.and_then(|worst| worst.in_the_way.clone()),
                ..Predicted::default()
            },
            probes: all().map(|of| of.probes).sum(),
            kept: all().all(|of| of.kept),
        }
    }

    fn write(self, into: &mut Predicted) {
        let Predicted {
            lens_px,
            temporal_px,
            depth_px,
            level_of_detail_px,
            nodes_px,
            format_px,
            total_px,
            void_share,
            in_the_way,
            ..
        } = self.most;
        (into.lens_px, into.temporal_px, into.depth_px, into.level_of_detail_px) =
            (lens_px, temporal_px, depth_px, level_of_detail_px);
        (into.nodes_px, into.format_px, into.total_px, into.void_share) =
            (nodes_px, format_px, total_px, void_share);
        (into.in_the_way, into.probes, into.kept) = (in_the_way, self.probes, self.kept);
    }
}

impl Motion {
    /// Bounds on both.
    fn and(self, other: Self) -> Self {
        Self {
            nearest_m: self.nearest_m.min(other.nearest_m),
            travel_m: self.travel_m.max(other.travel_m),
            rotation_rad: self.rotation_rad.max(other.rotation_rad),
            parallax_px: self.parallax_px.max(other.parallax_px),
            rotation_px: self.rotation_px.max(other.rotation_px),
            blur_px: self.blur_px.max(other.blur_px),
            blur_sagitta_px: self.blur_sagitta_px.max(other.blur_sagitta_px),
        }
    }
}
