//! Frames' plans and what else the host computes for them, on threads of their own while the device works on earlier frames. All of it is
//! a function of sequence and frame number: who computes it, and when, does not show.

use std::{
    sync::{
        Arc,
        mpsc::{Receiver, Sender, channel},
    },
    thread::Scope,
    time::Instant,
};

use camsim_core::{
    plan::{FramePlan, LinePoses, LineTimes, PlanError, Planner, TemporalStage, line_poses, line_times},
    pose::CameraPose,
    scene::{TerrainDetail, TerrainMesh},
    temporal::IdealGeometry,
};

use super::ms_since;

/// Threads that plan, at most. Each plan uses all processors in parts; a second thread fills the parts that do not.
const MOST_PLANNERS: usize = 4;
/// Frames that a planner has been asked for and that nobody has taken yet: one to be taken, one at work.
const ASKED_OF_A_PLANNER: usize = 2;

/// A frame before anything of it is recorded.
#[derive(Debug)]
pub(super) struct Prepared {
    pub plan: FramePlan,
    /// Triangles of the terrain for each key; none without a terrain.
    pub meshes: Arc<[TerrainMesh]>,
    pub lines: Lines,
    pub plan_ms: f64,
}

/// Poses of a frame's lines, or their times for the solvers that take the motion as constant.
#[derive(Debug)]
pub(super) enum Lines {
    Poses(LinePoses),
    Times(LineTimes),
}

impl Lines {
    fn of(plan: &FramePlan, planner: &Planner) -> Self {
        match plan.temporal {
            TemporalStage::Linear | TemporalStage::Rk2 => Self::Times(line_times(plan)),
            _ => Self::Poses(line_poses(plan, &planner.sequence().path)),
        }
    }

    pub fn bytes(&self) -> &[u8] {
        match self {
            Self::Poses(poses) => bytemuck::cast_slice(&poses.entries),
            Self::Times(times) => bytemuck::cast_slice(&times.dt_s),
        }
    }
}

/// What the choice of triangles depends on.
#[derive(Debug, PartialEq)]
struct View {
    poses: Vec<CameraPose>,
    ideal: IdealGeometry,
    terrain_error_px: f64,
}

/// Prepares frames; the triangles of the last one are kept for as long as they are seen in the same way.
#[derive(Debug)]
struct Preparer<'a> {
    planner: &'a Planner,
    seen: Option<(View, Arc<[TerrainMesh]>)>,
}

impl Preparer<'_> {
    fn prepare(&mut self, frame: u64) -> Result<Prepared, PlanError> {
        let begun = Instant::now();
        let plan = self.planner.plan(frame)?;
        let meshes = self.meshes(&plan);
        let lines = Lines::of(&plan, self.planner);
        Ok(Prepared { plan, meshes, lines, plan_ms: ms_since(begun) })
    }

    fn meshes(&mut self, plan: &FramePlan) -> Arc<[TerrainMesh]> {
        let poses = plan.keys.iter().map(|key| key.pose).collect();
        let view = View { poses, ideal: plan.ideal, terrain_error_px: plan.terrain_error_px };
        if let Some((_, meshes)) = self.seen.as_ref().filter(|(seen, _)| *seen == view) {
            return meshes.clone();
        }
        let focal_px = plan.ideal.focal_px.max_element();
        let terrain = self.planner.sequence().scene.terrain.iter();
        let meshes = terrain.flat_map(|terrain| {
            view.poses.iter().map(|pose| TerrainDetail::new(terrain, pose, plan.tangents(), focal_px, view.terrain_error_px).mesh())
        });
        let meshes: Arc<[TerrainMesh]> = meshes.collect();
        self.seen = Some((view, meshes.clone()));
        meshes
    }
}

/// Frames in the order asked for, each prepared before it is taken.
pub(super) struct Ahead<I> {
    frames: I,
    /// They take turns, so that frames come in order without being sorted.
    planners: Vec<(Sender<u64>, Receiver<Result<Prepared, PlanError>>)>,
    asked: usize,
    taken: usize,
}

impl<I: Iterator<Item = u64>> Ahead<I> {
    /// Starts the planners. They end when this is dropped.
    pub fn start<'scope>(scope: &'scope Scope<'scope, '_>, planner: &'scope Planner, frames: I) -> Self {
        let threads = std::thread::available_parallelism().map_or(1, usize::from).div_ceil(2).min(MOST_PLANNERS);
        let threads = frames.size_hint().1.map_or(threads, |most| most.clamp(1, threads));
        let planners = (0..threads).map(|_| {
            let (ask, asked) = channel();
            let (give, given) = channel();
            let mut preparer = Preparer { planner, seen: None };
            // Nobody takes what is given after a fault: no more is needed then.
            scope.spawn(move || asked.into_iter().map(|frame| preparer.prepare(frame)).try_for_each(|prepared| give.send(prepared)));
            (ask, given)
        });
        let mut ahead = Self { frames, planners: planners.collect(), asked: 0, taken: 0 };
        ahead.ask();
        ahead
    }

    /// The next frame; `None` after the last.
    pub fn next(&mut self) -> Option<Result<Prepared, PlanError>> {
        let (_, given) = &self.planners[self.taken % self.planners.len()];
        // A planner that panics gives no answer; the scope then panics too, when it ends.
        let prepared = (self.taken < self.asked).then(|| given.recv().ok()).flatten()?;
        self.taken += 1;
        self.ask();
        Some(prepared)
    }

    fn ask(&mut self) {
        while self.asked - self.taken < ASKED_OF_A_PLANNER * self.planners.len() {
            let Some(frame) = self.frames.next() else { return };
            let (ask, _) = &self.planners[self.asked % self.planners.len()];
            // A planner that is gone shows when its frame is to be taken.
            let _ = ask.send(frame);
            self.asked += 1;
        }
    }
}
