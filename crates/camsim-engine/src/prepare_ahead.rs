//! Plans, terrain triangles and row tables of frames, computed on rayon threads while earlier frames are
//! rendered. All of it is a function of sequence and frame number, so thread and time do not change it.

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
    scene::{PlacedMesh, TerrainTiles},
    temporal::IdealGeometry,
};
use camsim_cpu::RowTable;
use camsim_plan::{FramePlan, PlanError, Planner, PrefilterTaps};

use camsim_plan::uniforms::base_ned_m;

/// Most frames that are prepared ahead, one per thread, if each is planned alone: a few megabytes of
/// triangles and poses. Frames of a group share an ideal frame; of them [`Planner::groups_at_once`] groups
/// are prepared.
const MOST_AHEAD: usize = 16;
/// Most frames of a group that one task prepares.
const MOST_PER_TASK: usize = 16;

/// Inputs of the passes of a frame.
#[derive(Debug)]
pub(super) struct Prepared {
    pub plan: FramePlan,
    /// Terrain triangles of each key frame; empty without a terrain.
    pub meshes: Arc<[PlacedMesh]>,
    pub rows: RowTable,
    pub plan_ms: f64,
}

impl Prepared {
    /// Itself, followed by the passes of red and blue where their lenses are others.
    pub fn with_other_colors(self) -> impl Iterator<Item = Self> {
        let others: Vec<Self> = self
            .plan
            .other_colors()
            .map(|plan| Self { plan, meshes: self.meshes.clone(), rows: self.rows.clone(), plan_ms: 0.0 })
            .collect();
        std::iter::once(self).chain(others)
    }
}

/// Inputs of the choice of terrain triangles.
#[derive(Debug, PartialEq)]
struct TerrainView {
    poses: Vec<CameraPose>,
    ideal: IdealGeometry,
    terrain_error_px: f64,
    reads: PrefilterTaps,
}

/// A frame of one lane of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Job {
    pub lane: usize,
    pub frame: u64,
}

/// Prepares frames. The triangles of the last groups are cached for frames with the same view.
#[derive(Debug)]
pub(super) struct Preparer {
    planner: Arc<Planner>,
    lane: usize,
    /// Tiles of the terrain texture, if it is tiled.
    tiles: Option<Arc<TerrainTiles>>,
    mesh_cache: Mutex<VecDeque<(TerrainView, Arc<[PlacedMesh]>)>>,
}

impl Preparer {
    pub fn new(planner: Arc<Planner>, lane: usize, tiles: Option<Arc<TerrainTiles>>) -> Self {
        Self { planner, lane, tiles, mesh_cache: Mutex::default() }
    }

    fn planner(&self) -> &Planner {
        self.planner.lane(self.lane)
    }

    fn prepare(&self, frame: u64) -> Result<Prepared, PlanError> {
        let begin = Instant::now();
        let plan = self.planner().plan(frame)?;
        let meshes = self.meshes(&plan);
        let rows = RowTable::new(&plan, &self.planner().sequence().path);
        Ok(Prepared { plan, meshes, rows, plan_ms: ms_since(begin) })
    }

    fn meshes(&self, plan: &FramePlan) -> Arc<[PlacedMesh]> {
        let poses = plan.keys.iter().map(|key| key.pose).collect();
        let view = TerrainView {
            poses,
            ideal: plan.ideal,
            terrain_error_px: plan.terrain_error_px,
            reads: plan.surface_reads,
        };
        // Entries are replaced as a whole, so a panic on another thread leaves the cache valid.
        let cache = || self.mesh_cache.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, meshes)) = cache().iter().find(|(cached, _)| *cached == view) {
            return meshes.clone();
        }
        let terrain = self.planner.sequence().scene.terrain.iter();
        let meshes = terrain.flat_map(|terrain| {
            view.poses.iter().map(|pose| {
                let detail = plan.terrain_detail(terrain, pose);
                let tiles =
                    self.tiles.as_ref().map_or_else(Vec::new, |tiles| detail.tiles(tiles, view.reads));
                PlacedMesh { tiles, ..detail.visible_mesh().placed(terrain, base_ned_m(pose)) }
            })
        });
        let meshes: Arc<[PlacedMesh]> = meshes.collect();
        let mut cache = cache();
        while cache.len() >= Planner::groups_at_once() {
            cache.pop_front();
        }
        cache.push_back((view, meshes.clone()));
        meshes
    }
}

/// Prepared frames in the given order; preparation begins before a frame is taken.
pub(super) struct PrepareAhead<'a, 'scope, I: Iterator<Item = Job>> {
    scope: &'a rayon::Scope<'scope>,
    /// One a lane.
    preparers: &'scope [Preparer],
    jobs: Peekable<I>,
    pending: VecDeque<(Job, Receiver<Result<Prepared, PlanError>>)>,
    /// Number of frames in the last group.
    group_size: usize,
}

impl<'a, 'scope, I: Iterator<Item = Job>> PrepareAhead<'a, 'scope, I> {
    /// Begins to prepare the first frames. The scope ends when all begun frames are prepared.
    pub fn start(scope: &'a rayon::Scope<'scope>, preparers: &'scope [Preparer], jobs: I) -> Self {
        let mut ahead =
            Self { scope, preparers, jobs: jobs.peekable(), pending: VecDeque::new(), group_size: 0 };
        ahead.begin();
        ahead
    }

    /// The next frame; `None` after the last.
    pub fn next(&mut self) -> Option<(Job, Result<Prepared, PlanError>)> {
        let (job, receiver) = self.pending.pop_front()?;
        // After a panic in planning nothing is received, and the scope panics when it ends.
        let prepared = wait(&receiver)?;
        self.begin();
        Some((job, prepared))
    }

    /// The next frames for one task: those of one group.
    fn next_group(&mut self) -> Vec<Job> {
        let preparers = self.preparers;
        let group = |job: &Job| (job.lane, preparers[job.lane].planner().group_of(job.frame));
        let mut jobs: Vec<Job> = self.jobs.next().into_iter().collect();
        let Some(first) = jobs.first().map(group) else { return jobs };
        while jobs.len() < MOST_PER_TASK
            && let Some(job) = self.jobs.next_if(|job| group(job) == first)
        {
            jobs.push(job);
        }
        jobs
    }

    fn begin(&mut self) {
        // At least one frame to take and one in work.
        let ahead = rayon::current_num_threads().clamp(2, MOST_AHEAD);
        // Tasks for parts of a larger group would each plan the whole group.
        let at_once =
            |group_size: usize| if group_size < MOST_PER_TASK { Planner::groups_at_once() } else { 1 };
        while self.pending.len() < ahead.max(at_once(self.group_size) * self.group_size) {
            let group = self.next_group();
            if group.is_empty() {
                return;
            }
            self.group_size = group.len();
            let (senders, receivers): (Vec<_>, Vec<_>) = group.iter().map(|_| channel()).unzip();
            self.pending.extend(group.iter().copied().zip(receivers));
            let preparers = self.preparers;
            self.scope.spawn(move |_| {
                for (job, sender) in group.into_iter().zip(senders) {
                    // After an error elsewhere nothing is received.
                    if sender.send(preparers[job.lane].prepare(job.frame)).is_err() {
                        return;
                    }
                }
            });
        }
    }
}

/// Waits for a value. A rayon thread first executes pending tasks, since it may be the only thread.
fn wait<T>(receiver: &Receiver<T>) -> Option<T> {
    loop {
        match receiver.try_recv() {
            Ok(value) => return Some(value),
            Err(TryRecvError::Disconnected) => return None,
            Err(TryRecvError::Empty) if rayon::yield_now() == Some(rayon::Yield::Executed) => {}
            // Not a rayon thread, or other threads execute the tasks.
            Err(TryRecvError::Empty) => return receiver.recv().ok(),
        }
    }
}

pub(crate) fn ms_since(begin: Instant) -> f64 {
    begin.elapsed().as_secs_f64() * 1e3
}
