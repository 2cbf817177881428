//! What is told of a frame; `camsim explain --json` prints it.

use std::path::PathBuf;

use camsim_core::{
    pose::wxyz,
    scenario::Face,
    scene::{self, ModelLod, SceneLods, TerrainTiles, TexelForm, tile_bytes},
    sequence::Sequence,
    tracker::{ResolvedLimits, Saturation},
};
use camsim_engine::Engine;
use camsim_io::{load::Loaded, raster::TerrainSummary, write::SourceFrame};
use camsim_plan::{FramePlan, LevelOfDetail, Placement, PlanSummary, Planner};
use serde::Serialize;

use super::{camera, sensors, twins};
use crate::{
    failure::{Failure, OrFail},
    render_run::source_frame,
};

/// Largest texture side assumed for the plan. Every adapter of the last decade supports it, and `explain`
/// needs no adapter.
const MAX_SIDE_PX: u32 = 16_384;

/// The plans of a frame.
pub(super) struct Plans {
    /// What renders, in words.
    pub(super) renderer: String,
    pub(super) plan: FramePlan,
    /// Of the other faces that a wide field is divided among.
    pub(super) faces: Vec<FramePlan>,
    pub(super) twins: Vec<twins::TwinPlan>,
}

impl Plans {
    pub(super) fn new(loaded: &Loaded, engine: &Engine, frame: u64) -> Result<Self, Failure> {
        let sequence = &loaded.sequence;
        let channels = &sequence.scenario.output.channels;
        let planner = Planner::new(sequence.clone(), channels, engine.max_side_px())
            .or_bad_input()?
            .with_capabilities(engine.capabilities());
        let mut faces = planner.plans(frame).or_bad_input()?;
        let plan = faces.remove(0);
        let twins = twins::plans(sequence, &planner, frame)?;
        Ok(Self { renderer: engine.to_string(), plan, faces, twins })
    }

    pub(super) fn report<'a>(&'a self, loaded: &'a Loaded) -> Result<ExplainReport<'a>, Failure> {
        let Self { plan, faces, twins, .. } = self;
        let Loaded { sequence, tracked, .. } = loaded;
        Ok(ExplainReport {
            frames: sequence.frames,
            log: log_facts(loaded),
            tracker: TrackerFacts {
                rate_hz: tracked.rate_hz,
                limits: tracked.limits,
                saturation: tracked.saturation,
            },
            terrain: loaded.terrain.as_ref().map(terrain_facts),
            camera: camera::facts(&sequence.scenario.camera, plan.zoom)?,
            warnings: &loaded.warnings,
            plan: plan.summary(),
            face: plan.camera.lens.face().map(Face::name),
            faces: faces.iter().map(FaceFacts::of).collect(),
            placement: plan.placement,
            source_frame: SourceFrameFields::of(&source_frame(sequence, plan)),
            level_of_detail: LevelOfDetail::of(plan, sequence),
            models: models(sequence, plan),
            memory: memory(sequence, plan),
            moving: sequence.scene.moving_objects(),
            sensors: sensors::facts(&loaded.sensors),
            twins: twins.iter().map(twins::TwinPlan::report).collect(),
        })
    }
}

#[derive(Serialize)]
pub(super) struct ExplainReport<'a> {
    pub(super) frames: u64,
    pub(super) log: LogFacts,
    pub(super) tracker: TrackerFacts,
    pub(super) terrain: Option<TerrainFacts>,
    pub(super) camera: camera::CameraFacts<'a>,
    pub(super) warnings: &'a [String],
    pub(super) plan: PlanSummary<'a>,
    /// The face that `plan` is of, where a wide field is divided among several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) face: Option<&'static str>,
    /// The plans of the other faces.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) faces: Vec<FaceFacts<'a>>,
    pub(super) placement: Placement,
    pub(super) source_frame: SourceFrameFields,
    pub(super) level_of_detail: Option<LevelOfDetail>,
    pub(super) models: Option<ModelFacts>,
    pub(super) memory: Option<MemoryFacts>,
    /// Objects that move: their pixels are rays of their own, which `plan` predicts nothing of.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) moving: Vec<&'a str>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) sensors: Vec<sensors::SensorFacts<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) twins: Vec<twins::TwinReport<'a>>,
}

/// The frame to which the source coordinates x, y of `coords` refer, with the names of `frames.csv`.
#[derive(Serialize)]
pub(super) struct SourceFrameFields {
    pub(super) ideal_width_px: u32,
    pub(super) ideal_height_px: u32,
    pub(super) ideal_fx_px: f64,
    pub(super) ideal_fy_px: f64,
    pub(super) ideal_cx_px: f64,
    pub(super) ideal_cy_px: f64,
    pub(super) ideal_t_ns: i64,
    pub(super) ideal_ned_m: [f64; 3],
    /// Rotation `ned_from_camera`.
    pub(super) ideal_q_wxyz: [f64; 4],
}

impl SourceFrameFields {
    fn of(frame: &SourceFrame) -> Self {
        let SourceFrame { size_px, focal_px, principal_px, t_ns, pose } = *frame;
        Self {
            ideal_width_px: size_px[0],
            ideal_height_px: size_px[1],
            ideal_fx_px: focal_px[0],
            ideal_fy_px: focal_px[1],
            ideal_cx_px: principal_px[0],
            ideal_cy_px: principal_px[1],
            ideal_t_ns: t_ns,
            ideal_ned_m: pose.position_ned_m.to_array(),
            ideal_q_wxyz: wxyz(pose.ned_from_camera),
        }
    }
}

/// A face beside the first that a wide field is divided among.
#[derive(Serialize)]
pub(super) struct FaceFacts<'a> {
    pub(super) face: &'static str,
    #[serde(flatten)]
    pub(super) plan: PlanSummary<'a>,
    pub(super) placement: Placement,
}

impl<'a> FaceFacts<'a> {
    fn of(plan: &'a FramePlan) -> Self {
        let face = plan.camera.lens.face().map_or("", Face::name);
        Self { face, plan: plan.summary(), placement: plan.placement }
    }
}

#[derive(Serialize)]
pub(super) struct LogFacts {
    pub(super) file: String,
    pub(super) rows: usize,
    pub(super) span_s: [f64; 2],
    pub(super) cleaning: String,
}

#[derive(Serialize)]
pub(super) struct TrackerFacts {
    pub(super) rate_hz: f64,
    pub(super) limits: ResolvedLimits,
    pub(super) saturation: Saturation,
}

/// Level of detail of models and patterns in the ideal frame.
#[derive(Serialize)]
pub(super) struct ModelFacts {
    #[serde(flatten)]
    pub(super) detail: ModelLod,
    /// Bound on the displacement by the level of detail, output px.
    pub(super) tolerance_px: f64,
}

/// Memory for a terrain and its texture, bytes. The GPU holds only what is in sight, except for a
/// texture that is not tiled.
#[derive(Serialize)]
pub(super) struct MemoryFacts {
    /// Host memory: heights, with the data of the level of detail.
    pub(super) heights_bytes: u64,
    /// Host memory: the texture, with its mip levels if it is tiled.
    pub(super) texture_bytes: u64,
    /// GPU memory: the texture, or the tiles that this frame may read.
    pub(super) texture_gpu_bytes: u64,
    /// For a tiled texture: the number of tiles that this frame may read, and of all tiles.
    pub(super) tiles: Option<[u64; 2]>,
}

#[derive(Serialize)]
pub(super) struct TerrainFacts {
    pub(super) files: Vec<PathBuf>,
    pub(super) epsg: u16,
    pub(super) size: [u32; 2],
    pub(super) south_west_deg: [f64; 2],
    pub(super) north_east_deg: [f64; 2],
    pub(super) height_range_m: [f64; 2],
    pub(super) void_heights: u64,
    pub(super) outside_ortho: u64,
    pub(super) finest_triangles: u64,
}

/// Level of detail that the ideal pass chooses for its middle key frame.
fn models(sequence: &Sequence, plan: &FramePlan) -> Option<ModelFacts> {
    let scene = &sequence.scene;
    let tolerance = plan.model_tolerance(&sequence.scenario.quality);
    let detail = || ModelLod::new(scene, &SceneLods::new(scene), &plan.ideal_pose(), &tolerance);
    (!scene.meshes.is_empty()).then(|| ModelFacts {
        detail: detail(),
        tolerance_px: tolerance.error_px / plan.ideal.scale(&plan.camera),
    })
}

fn memory(sequence: &Sequence, plan: &FramePlan) -> Option<MemoryFacts> {
    let terrain = sequence.scene.terrain.as_ref()?;
    let picture = terrain.texture.rgba8.len() as u64;
    let heights_bytes = terrain.memory_bytes();
    if scene::is_whole(terrain.texture.size_px, MAX_SIDE_PX) {
        return Some(MemoryFacts {
            heights_bytes,
            texture_bytes: picture,
            texture_gpu_bytes: 8 * picture / 3,
            tiles: None,
        });
    }
    let ground = TerrainTiles::new(terrain);
    let tiles =
        plan.terrain_detail(terrain, &plan.ideal_pose()).tiles(&ground, plan.surface_reads).len() as u64;
    let all = u64::from(ground.grid.count);
    Some(MemoryFacts {
        heights_bytes,
        texture_bytes: 4 * picture / 3,
        texture_gpu_bytes: tiles * tile_bytes(TexelForm::Light),
        tiles: Some([tiles, all]),
    })
}

fn log_facts(loaded: &Loaded) -> LogFacts {
    let rows = &loaded.log.rows;
    let (first_s, last_s) = (rows.first().map_or(0.0, |row| row.t_s), rows.last().map_or(0.0, |row| row.t_s));
    LogFacts {
        file: loaded.sequence.scenario.flight.log.display().to_string(),
        rows: rows.len(),
        span_s: [first_s, last_s],
        cleaning: loaded.log.report.to_string(),
    }
}

fn terrain_facts(summary: &TerrainSummary) -> TerrainFacts {
    let [columns, rows] = summary.size.map(|heights| u64::from(heights.saturating_sub(1)));
    TerrainFacts {
        files: summary.files.clone(),
        epsg: summary.epsg,
        size: summary.size,
        south_west_deg: summary.south_west_rad.map(f64::to_degrees),
        north_east_deg: summary.north_east_rad.map(f64::to_degrees),
        height_range_m: summary.height_range_m,
        void_heights: summary.void_heights,
        outside_ortho: summary.outside_ortho,
        finest_triangles: 2 * columns * rows,
    }
}
