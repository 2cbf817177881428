//! `camsim explain`: the plan of one frame, without rendering it.

mod camera;
mod sensors;
mod twins;

use std::path::PathBuf;

use camsim_core::{
    scenario::{Auto, Face, LightSpec, Solver},
    scene::{self, ModelLod, SceneLods, TerrainDetail, TerrainTiles, TexelForm, tile_bytes},
    sequence::Sequence,
    timing_faults::Delivery,
    tracker::{ResolvedLimits, Saturation},
};
use camsim_engine::{MOVING_RAYS, SMALL_LAMP_PX};
use camsim_io::{load::Loaded, terrain::TerrainSummary, write::SourceFrame};
use camsim_plan::{FramePlan, Placement, PlanSummary, Planner};
use serde::Serialize;

use crate::{
    backend::BackendArgs,
    console::Console,
    failure::{Failure, OrFail},
    frame_list::{FrameListError, whole_number},
    inputs::{self, ScenarioArgs},
    render_run::source_frame,
};

/// Largest texture side assumed for the plan. Every adapter of the last decade supports it, and `explain`
/// needs no adapter.
const MAX_SIDE_PX: u32 = 16_384;

/// Show the plan of a frame: passes, sizes, samples, error bounds, and what is skipped and why
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: camsim explain flight.toml --frame 7 --set camera.shutter.exposure_ms=0")]
pub struct ExplainArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Frame number, from 0
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = whole_number, allow_hyphen_values = true)]
    frame: u64,
    /// Print JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    backend: BackendArgs,
}

#[derive(Serialize)]
struct ExplainReport<'a> {
    frames: u64,
    log: LogFacts,
    tracker: TrackerFacts,
    terrain: Option<TerrainFacts>,
    camera: camera::CameraFacts<'a>,
    warnings: &'a [String],
    plan: PlanSummary<'a>,
    /// The face that `plan` is of, where a wide field is divided among several.
    #[serde(skip_serializing_if = "Option::is_none")]
    face: Option<&'static str>,
    /// The plans of the other faces.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    faces: Vec<FaceFacts<'a>>,
    placement: Placement,
    source_frame: SourceFrameFields,
    level_of_detail: Option<LevelOfDetail>,
    models: Option<ModelFacts>,
    memory: Option<MemoryFacts>,
    /// Objects that move: their pixels are rays of their own, which `plan` predicts nothing of.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    moving: Vec<&'a str>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    sensors: Vec<sensors::SensorFacts<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    twins: Vec<twins::TwinReport<'a>>,
}

/// The frame to which the source coordinates x, y of `coords` refer, with the names of `frames.csv`.
#[derive(Serialize)]
struct SourceFrameFields {
    ideal_width_px: u32,
    ideal_height_px: u32,
    ideal_fx_px: f64,
    ideal_fy_px: f64,
    ideal_cx_px: f64,
    ideal_cy_px: f64,
    ideal_t_ns: i64,
    ideal_ned_m: [f64; 3],
    /// Rotation `ned_from_camera`.
    ideal_q_wxyz: [f64; 4],
}

impl SourceFrameFields {
    fn of(frame: &SourceFrame) -> Self {
        let SourceFrame { size_px, focal_px, principal_px, t_ns, pose } = *frame;
        let q = pose.ned_from_camera;
        Self {
            ideal_width_px: size_px[0],
            ideal_height_px: size_px[1],
            ideal_fx_px: focal_px[0],
            ideal_fy_px: focal_px[1],
            ideal_cx_px: principal_px[0],
            ideal_cy_px: principal_px[1],
            ideal_t_ns: t_ns,
            ideal_ned_m: pose.position_ned_m.to_array(),
            ideal_q_wxyz: [q.w, q.x, q.y, q.z],
        }
    }
}

/// A face beside the first that a wide field is divided among.
#[derive(Serialize)]
struct FaceFacts<'a> {
    face: &'static str,
    #[serde(flatten)]
    plan: PlanSummary<'a>,
    placement: Placement,
}

impl<'a> FaceFacts<'a> {
    fn of(plan: &'a FramePlan) -> Self {
        let face = plan.camera.lens.face().map_or("", Face::name);
        Self { face, plan: plan.summary(), placement: plan.placement }
    }
}

fn print_faces(first: Face, others: &[FramePlan], console: &mut Console<'_>) -> Result<(), Failure> {
    let others = others.iter().filter_map(|plan| plan.camera.lens.face());
    let names: Vec<&str> = std::iter::once(first).chain(others).map(Face::name).collect();
    console.line(format_args!(
        "faces: the field is wider than a flat ideal frame holds; {} sides of a cube make it: {}",
        names.len(),
        names.join(", ")
    ))?;
    Ok(console.line(format_args!("face {}", first.name()))?)
}

#[derive(Serialize)]
struct LogFacts {
    file: String,
    rows: usize,
    span_s: [f64; 2],
    cleaning: String,
}

#[derive(Serialize)]
struct TrackerFacts {
    rate_hz: f64,
    limits: ResolvedLimits,
    saturation: Saturation,
}

/// Level of detail of the terrain in the ideal frame.
#[derive(Serialize)]
pub(super) struct LevelOfDetail {
    pub(super) triangles: u64,
    /// Back-facing triangles in sight, which are not drawn.
    pub(super) away: u64,
    /// Bound on the displacement by the level of detail, output px.
    pub(super) max_error_px: f64,
    pub(super) tolerance_px: f64,
    /// Bound on the depth error seen from straight above, as a share of the depth.
    pub(super) depth_share: f64,
    /// GPU memory of the triangles, bytes.
    pub(super) triangle_bytes: u64,
}

/// Level of detail of models and patterns in the ideal frame.
#[derive(Serialize)]
struct ModelFacts {
    #[serde(flatten)]
    detail: ModelLod,
    /// Bound on the displacement by the level of detail, output px.
    tolerance_px: f64,
}

/// MemoryFacts for a terrain and its texture, bytes. The GPU holds only what is in sight, except for a
/// texture that is not tiled.
#[derive(Serialize)]
struct MemoryFacts {
    /// Host memory: heights, with the data of the level of detail.
    heights_bytes: u64,
    /// Host memory: the texture, with its mip levels if it is tiled.
    texture_bytes: u64,
    /// GPU memory: the texture, or the tiles that this frame may read.
    texture_gpu_bytes: u64,
    /// For a tiled texture: the number of tiles that this frame may read, and of all tiles.
    tiles: Option<[u64; 2]>,
}

#[derive(Serialize)]
struct TerrainFacts {
    files: Vec<PathBuf>,
    epsg: u16,
    size: [u32; 2],
    south_west_deg: [f64; 2],
    north_east_deg: [f64; 2],
    height_range_m: [f64; 2],
    void_heights: u64,
    outside_ortho: u64,
    finest_triangles: u64,
}

/// Says where a frame does not arrive, or with another picture.
fn warn_of_delivery(sequence: &Sequence, frame: u64, console: &mut Console<'_>) {
    match sequence.timing_faults().map(|faults| faults.delivery(frame)) {
        Some(Delivery::Dropped) => console.warn(format_args!(
            "frame {frame} is dropped by camera.timing: `render` leaves it out; this is the plan that it would have"
        )),
        Some(Delivery::Doubled(picture)) => console.warn(format_args!(
            "frame {frame} is doubled by camera.timing: it has the picture of frame {picture}, whose plan this is"
        )),
        Some(Delivery::Missed) => console.warn(format_args!(
            "frame {frame} has no trigger by camera.timing: `render` leaves it out; this is the plan that it would have"
        )),
        Some(Delivery::Own) | None => {}
    }
}

/// Loads the scenario and prints the plan of one frame.
pub fn run(args: &ExplainArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let scenario = args.scenario.read(console)?;
    let loaded = inputs::load(&scenario, console)?;
    let frames = loaded.sequence.frames;
    if args.frame >= frames {
        return Err(Failure::bad_input(FrameListError::Outside {
            asked_by: "--frame",
            frame: args.frame,
            frames,
        }));
    }
    if scenario.quality.solver == Auto::Value(Solver::Oracle) {
        console.warn(
            "quality.solver is \"oracle\": `render` casts every ray without a plan; this is the plan \
                   of the default solver",
        );
    }
    warn_of_delivery(&loaded.sequence, args.frame, console);
    let engine = args.backend.open()?;
    let planner = Planner::new(loaded.sequence.clone(), &scenario.output.channels, engine.max_side_px())
        .or_bad_input()?;
    let planner = planner.with_capabilities(engine.capabilities());
    let mut faces = planner.plans(args.frame).or_bad_input()?;
    let plan = faces.remove(0);
    let twins = twins::plans(&loaded.sequence, &planner, args.frame)?;
    let (log, terrain) = (log_facts(&loaded), loaded.terrain.as_ref().map(terrain_facts));
    let level_of_detail = level_of_detail(&loaded.sequence, &plan);
    let models = models(&loaded.sequence, &plan);
    let memory = memory(&loaded.sequence, &plan);
    let source_frame = SourceFrameFields::of(&source_frame(&loaded.sequence, &plan));
    let camera = camera::facts(&loaded.sequence.scenario.camera, plan.zoom)?;
    let moving = loaded.sequence.scene.moving_objects();
    let sensors = sensors::facts(&loaded.sensors);
    let tracked = &loaded.tracked;
    let tracker =
        TrackerFacts { rate_hz: tracked.rate_hz, limits: tracked.limits, saturation: tracked.saturation };
    if args.json {
        let warnings = &loaded.warnings;
        return Ok(console.json(&ExplainReport {
            frames,
            log,
            tracker,
            terrain,
            camera,
            warnings,
            plan: plan.summary(),
            face: plan.camera.lens.face().map(Face::name),
            faces: faces.iter().map(FaceFacts::of).collect(),
            placement: plan.placement,
            source_frame,
            level_of_detail,
            models,
            memory,
            moving,
            sensors,
            twins: twins.iter().map(twins::TwinPlan::report).collect(),
        })?);
    }
    let [first_s, last_s] = log.span_s;
    console.line(format_args!("log {}", log.file))?;
    console.line(format_args!(
        "  {} rows from {first_s:.3} to {last_s:.3} s; cleaning: {}",
        log.rows, log.cleaning
    ))?;
    console.line(format_args!("tracker at {} Hz", tracker.rate_hz))?;
    let limits = tracker.limits;
    console.line(format_args!(
        "  at most {:.3} m/s, {:.3} m/s^2",
        limits.max_speed_m_s, limits.max_acceleration_m_s2
    ))?;
    let angular =
        [limits.max_angular_rate_rad_s, limits.max_angular_acceleration_rad_s2].map(f64::to_degrees);
    console.line(format_args!("  at most {:.3} deg/s, {:.3} deg/s^2", angular[0], angular[1]))?;
    if let Some(terrain) = &terrain {
        print_terrain(terrain, console)?;
    }
    print_light(&loaded, console)?;
    camera::print(&camera, console)?;
    sensors::print(&sensors, console)?;
    let s = if frames == 1 { "" } else { "s" };
    console.line(format_args!("sequence of {frames} frame{s}"))?;
    if let Some(face) = plan.camera.lens.face() {
        print_faces(face, &faces, console)?;
    }
    console.print(&plan.to_string())?;
    for plan in &faces {
        console.line(format_args!("face {}", plan.camera.lens.face().map_or("", Face::name)))?;
        console.print(&plan.to_string())?;
    }
    print_moving(&moving, console)?;
    print_lamps(&loaded.sequence.scene, console)?;
    print_source(&source_frame, &plan, console)?;
    let Placement { ideal, reverse } = plan.placement;
    console.line(format_args!("rendered on {engine}"))?;
    console.line(format_args!("  ideal frames by the {ideal}, output frame by the {reverse}"))?;
    if let Some(LevelOfDetail { triangles, away, max_error_px, tolerance_px, depth_share, triangle_bytes }) =
        level_of_detail
    {
        console.line("terrain in this frame")?;
        console.line(format_args!(
            "  {triangles} triangles, displaced by at most {max_error_px:.3} output px (tolerance \
             {tolerance_px:.3})"
        ))?;
        console.line(format_args!(
            "  seen from straight above, depth is off by at most {depth_share:.1e} of itself"
        ))?;
        if away > 0 {
            console.line(format_args!("  {away} back-facing triangles are not drawn"))?;
        }
        if let Some(memory) = memory {
            print_memory(&memory, triangle_bytes, console)?;
        }
    }
    if let Some(ModelFacts { detail: ModelLod { meshes, triangles, finest_triangles }, tolerance_px }) =
        models
    {
        console.line("models in this frame")?;
        console.line(format_args!(
            "  {meshes} meshes with {triangles} triangles, displaced by at most {tolerance_px:.3} output px; \
             {finest_triangles} triangles at the finest level"
        ))?;
    }
    twins::print(&twins, console)
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

/// Level of detail that the ideal pass chooses.
pub(super) fn level_of_detail(sequence: &Sequence, plan: &FramePlan) -> Option<LevelOfDetail> {
    let terrain = sequence.scene.terrain.as_ref()?;
    let scale = plan.ideal.scale(&plan.camera);
    let placed =
        detail(terrain, plan).visible_mesh().placed(terrain, plan.ideal_pose().position_ned_m.round());
    let (lod, triangle_bytes) = (placed.lod, placed.bytes());
    let depth_share = plan.terrain_error_px / plan.ideal.focal_px.max_element();
    Some(LevelOfDetail {
        triangles: lod.triangles,
        away: lod.back_facing,
        max_error_px: lod.max_error_px / scale,
        tolerance_px: plan.terrain_error_px / scale,
        depth_share,
        triangle_bytes,
    })
}

fn detail<'a>(terrain: &'a scene::Terrain, plan: &FramePlan) -> TerrainDetail<'a> {
    TerrainDetail::new(
        terrain,
        &plan.ideal_pose(),
        plan.tangents(),
        plan.ideal.focal_px.max_element(),
        plan.terrain_error_px,
    )
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
    let tiles = detail(terrain, plan).tiles(&ground, plan.surface_reads).len() as u64;
    let all = u64::from(ground.grid.count);
    Some(MemoryFacts {
        heights_bytes,
        texture_bytes: 4 * picture / 3,
        texture_gpu_bytes: tiles * tile_bytes(TexelForm::Light),
        tiles: Some([tiles, all]),
    })
}

fn print_memory(memory: &MemoryFacts, triangle_bytes: u64, console: &mut Console<'_>) -> Result<(), Failure> {
    let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    let (heights, picture) = (mib(memory.heights_bytes), mib(memory.texture_bytes));
    console.line(format_args!("  memory: {heights:.1} MiB of heights, {picture:.1} MiB of texture"))?;
    let (triangles, picture) = (mib(triangle_bytes), mib(memory.texture_gpu_bytes));
    match memory.tiles {
        None => console.line(format_args!(
            "  gpu memory, if the gpu renders it: {triangles:.1} MiB of \
             triangles, {picture:.1} MiB of texture"
        ))?,
        Some([tiles, all]) => console.line(format_args!(
            "  gpu memory, if the gpu renders it: {triangles:.1} MiB of triangles, {tiles} of {all} texture \
             tiles in {picture:.1} MiB (the cache holds at most twice the largest need of a frame, plus 32 \
             MiB)"
        ))?,
    }
    Ok(())
}

fn print_terrain(terrain: &TerrainFacts, console: &mut Console<'_>) -> Result<(), Failure> {
    let TerrainFacts { epsg, size: [columns, rows], south_west_deg, north_east_deg, height_range_m, .. } =
        terrain;
    console.line(format_args!("terrain of {columns}x{rows} heights, EPSG:{epsg}"))?;
    if let [_, _, ..] = &terrain.files[..] {
        console.line(format_args!("  {} tiles", terrain.files.len()))?;
        for file in &terrain.files {
            console.line(format_args!("    {}", file.display()))?;
        }
    }
    console.line(format_args!(
        "  latitude {:.5} to {:.5}, longitude {:.5} to {:.5} deg, heights {:.1} to {:.1} m",
        south_west_deg[0],
        north_east_deg[0],
        south_west_deg[1],
        north_east_deg[1],
        height_range_m[0],
        height_range_m[1]
    ))?;
    let (voids, outside) = (terrain.void_heights, terrain.outside_ortho);
    console.line(format_args!(
        "  {voids} heights missing, {outside} outside of the ortho-image, {} triangles at the finest level",
        terrain.finest_triangles
    ))?;
    Ok(())
}

/// Prints the frame to which x and y of `coords` refer.
fn print_source(
    source: &SourceFrameFields,
    plan: &FramePlan,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let SourceFrameFields {
        ideal_width_px,
        ideal_height_px,
        ideal_fx_px,
        ideal_fy_px,
        ideal_cx_px,
        ideal_cy_px,
        ideal_t_ns,
        ..
    } = source;
    console.line(format_args!(
        "source coordinates (x, y of coords) are in a frame of {ideal_width_px}x{ideal_height_px} px, focal \
         length {ideal_fx_px:.6}, {ideal_fy_px:.6}, principal point {ideal_cx_px:.6}, {ideal_cy_px:.6} px"
    ))?;
    let ([n, e, d], [w, x, y, z]) = (source.ideal_ned_m, source.ideal_q_wxyz);
    console.line(format_args!(
        "  of a pinhole at NED {n:.6}, {e:.6}, {d:.6} m, ned_from_camera w {w:.9}, x {x:.9}, y {y:.9}, z \
         {z:.9}, stamp {ideal_t_ns} ns"
    ))?;
    if plan.shared_frames.is_some() {
        console.line("  this is the frame's own geometry, although several frames share one ideal frame")?;
    }
    Ok(())
}

/// Prints what moves, whose pixels the plan knows nothing of.
fn print_moving(moving: &[&str], console: &mut Console<'_>) -> Result<(), Failure> {
    if !moving.is_empty() {
        let names = moving.join(", ");
        console.line(format_args!(
            "moves: {names}; pixels that show it, or its shadow, are means of {MOVING_RAYS} rays of their own, which \
             the predicted errors do not cover"
        ))?;
    }
    Ok(())
}

/// Prints how many lamps there are, whose light the plan knows nothing of.
fn print_lamps(scene: &scene::Scene, console: &mut Console<'_>) -> Result<(), Failure> {
    let count = scene.lamps().count();
    if count > 0 {
        console.line(format_args!(
            "lamps: {count} meshes emit light above white; pixels that those of at most {SMALL_LAMP_PX} px may reach \
             are means of rays of their own"
        ))?;
    }
    Ok(())
}

/// Prints the light, with its errors that are not predicted.
fn print_light(loaded: &Loaded, console: &mut Console<'_>) -> Result<(), Failure> {
    let Some(light) = &loaded.sequence.scenario.scene.light else { return Ok(()) };
    let LightSpec { sun_azimuth_deg, sun_elevation_deg, sun, sky, shadows } = light;
    let from = format!(
        "light: sun {sun} from {sun_azimuth_deg} deg east of north, {sun_elevation_deg} deg high, and sky \
         {sky}, {}",
        if *shadows { "with shadows" } else { "without shadows" }
    );
    let ground = match (&loaded.terrain, &loaded.sequence.scene.terrain) {
        (Some(summary), Some(terrain)) => {
            let [width, height] = terrain.texture.size_px;
            let finer = match summary.texture_scale {
                1 => String::new(),
                times => format!(", upsampled {times} times"),
            };
            format!(
                "; baked into the terrain texture of {width}x{height} px{finer}, in steps of 8 bits that are \
                 not in the predicted error"
            )
        }
        _ => String::new(),
    };
    console.line(format_args!("{from}{ground}"))?;
    Ok(())
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
