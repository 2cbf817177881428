//! Frames' plans and what else the host computes for them, made by rayon's threads while the device works on
//! earlier frames. All of it is a function of sequence and frame number: who computes it, and when, does not
//! show.

use std::{
    collections::VecDeque,
    iter::Peekable,
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Receiver, TryRecvError, channel},
    },
    time::Instant,
};

use camsim_core::{
    pose::CameraPose,
    scene::{PlacedMesh, TerrainDetail, TerrainTiles},
    temporal::IdealGeometry,
};
use camsim_cpu::RowTable;
use camsim_plan::{FramePlan, PlanError, Planner, PrefilterTaps};

use camsim_plan::uniforms::base_ned_m;

use crate::session::ms_since;

/// Frames that are prepared before they are asked for, at most, with as many threads, where each is planned
/// by itself: some megabytes of triangles and poses. Those of a group have one ideal frame's, and as many
/// groups are begun as are best planned at once.
const MOST_AHEAD: usize = 16;
/// Frames of one group that one thread prepares, at most: as many are ready while as many are begun.
const MOST_TOGETHER: usize = 16;

/// A frame before anything of it is recorded.
#[derive(Debug)]
pub(super) struct Prepared {
    pub plan: FramePlan,
    /// Triangles of the terrain for each key; none without a terrain.
    pub meshes: Arc<[PlacedMesh]>,
    pub rows: RowTable,
    pub plan_ms: f64,
}

/// What the choice of triangles depends on.
#[derive(Debug, PartialEq)]
struct View {
    poses: Vec<CameraPose>,
    ideal: IdealGeometry,
    terrain_error_px: f64,
    reads: PrefilterTaps,
}

/// Prepares frames; the last triangles are kept, of as many groups as are planned at once, for frames that
/// see them in the same way.
#[derive(Debug)]
pub(super) struct Preparer {
    planner: Arc<Planner>,
    /// Of the ground's picture, if it is in tiles.
    tiles: Option<Arc<TerrainTiles>>,
    seen: Mutex<VecDeque<(View, Arc<[PlacedMesh]>)>>,
}

impl Preparer {
    pub fn new(planner: Arc<Planner>, tiles: Option<Arc<TerrainTiles>>) -> Self {
        Self { planner, tiles, seen: Mutex::default() }
    }

    fn prepare(&self, frame: u64) -> Result<Prepared, PlanError> {
        let begun = Instant::now();
        let plan = self.planner.plan(frame)?;
        let meshes = self.meshes(&plan);
        let rows = RowTable::new(&plan, &self.planner.sequence().path);
        Ok(Prepared { plan, meshes, rows, plan_ms: ms_since(begun) })
    }

    fn meshes(&self, plan: &FramePlan) -> Arc<[PlacedMesh]> {
        let poses = plan.keys.iter().map(|key| key.pose).collect();
        let view = View {
            poses,
            ideal: plan.ideal,
            terrain_error_px: plan.terrain_error_px,
            reads: plan.surface_reads,
        };
        // What is kept is replaced whole: a panic elsewhere leaves nothing half done.
        let seen = || self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, meshes)) = seen().iter().find(|(seen, _)| *seen == view) {
            return meshes.clone();
        }
        let focal_px = plan.ideal.focal_px.max_element();
        let terrain = self.planner.sequence().scene.terrain.iter();
        let meshes = terrain.flat_map(|terrain| {
            view.poses.iter().map(|pose| {
                let detail =
                    TerrainDetail::new(terrain, pose, plan.tangents(), focal_px, view.terrain_error_px);
                let tiles =
                    self.tiles.as_ref().map_or_else(Vec::new, |tiles| detail.tiles(tiles, view.reads));
                PlacedMesh { tiles, ..detail.visible_mesh().placed(terrain, base_ned_m(pose)) }
            })
        });
        let meshes: Arc<[PlacedMesh]> = meshes.collect();
        let mut seen = seen();
        while seen.len() >= Planner::groups_at_once() {
            seen.pop_front();
        }
        seen.push_back((view, meshes.clone()));
        meshes
    }
}

/// Frames in the order asked for, each begun before it is taken.
pub(super) struct Ahead<'a, 'scope, I: Iterator<Item = u64>> {
    scope: &'a rayon::Scope<'scope>,
    preparer: &'scope Preparer,
    frames: Peekable<I>,
    begun: VecDeque<Receiver<Result<Prepared, PlanError>>>,
    /// Frames of the last group.
    together: usize,
}

impl<'a, 'scope, I: Iterator<Item = u64>> Ahead<'a, 'scope, I> {
    /// Begins with the first frames. The scope ends when those that have been begun are done.
    pub fn start(scope: &'a rayon::Scope<'scope>, preparer: &'scope Preparer, frames: I) -> Self {
        let mut ahead =
            Self { scope, preparer, frames: frames.peekable(), begun: VecDeque::new(), together: 0 };
        ahead.begin();
        ahead
    }

    /// The next frame; `None` after the last.
    pub fn next(&mut self) -> Option<Result<Prepared, PlanError>> {
        let given = self.begun.pop_front()?;
        // Planning that panics gives no answer; the scope then panics too, when it ends.
        let prepared = wait(&given)?;
        self.begin();
        Some(prepared)
    }

    /// The next frames that are planned together.
    fn next_group(&mut self) -> Vec<u64> {
        let planner = &self.preparer.planner;
        let mut frames: Vec<u64> = self.frames.next().into_iter().collect();
        let Some(number) = frames.first().map(|&frame| planner.group_of(frame)) else { return frames };
        while frames.len() < MOST_TOGETHER
            && let Some(frame) = self.frames.next_if(|&frame| planner.group_of(frame) == number)
        {
            frames.push(frame);
        }
        frames
    }

    fn begin(&mut self) {
        // One to be taken and one at work at least; more where there are threads for it.
        let ahead = rayon::current_num_threads().clamp(2, MOST_AHEAD);
        // Parts of one larger group would each look at all of it.
        let at_once = |together: usize| if together < MOST_TOGETHER { Planner::groups_at_once() } else { 1 };
        while self.begun.len() < ahead.max(at_once(self.together) * self.together) {
            let group = self.next_group();
            if group.is_empty() {
                return;
            }
            self.together = group.len();
            let (gives, given): (Vec<_>, Vec<_>) = group.iter().map(|_| channel()).unzip();
            let preparer = self.preparer;
            self.scope.spawn(move |_| {
                for (frame, give) in group.into_iter().zip(gives) {
                    // After a fault nobody takes it.
                    if give.send(preparer.prepare(frame)).is_err() {
                        return;
                    }
                }
            });
            self.begun.extend(given);
        }
    }
}

/// Waits. A thread of rayon's own first does what there is to do: it may be the only one.
fn wait<T>(given: &Receiver<T>) -> Option<T> {
    loop {
        match given.try_recv() {
            Ok(value) => return Some(value),
            Err(TryRecvError::Disconnected) => return None,
            Err(TryRecvError::Empty) if rayon::yield_now() == Some(rayon::Yield::Executed) => {}
            // Not of the pool, or others are at it.
            Err(TryRecvError::Empty) => return given.recv().ok(),
        }
    }
}
