//! `camsim explain`: what one frame takes, without rendering it.

use camsim_core::{
    scenario::{Auto, LightSpec, Solver},
    scene::{self, GroundTiles, ModelDetail, SceneLevels, TerrainDetail, TexelForm, tile_bytes},
    sequence::Sequence,
    tracker::{ResolvedLimits, Saturation},
};
use camsim_gpu::{
    ideal::host::draws,
    reverse::host::{self, ReverseOn},
};
use camsim_io::{load::Loaded, terrain::TerrainSummary, write::SourceFrame};
use camsim_plan::{FramePlan, PlanSummary, Planner};
use serde::Serialize;

use crate::{
    console::Console,
    failure::{Failure, OrFail},
    frame_list::FrameListError,
    inputs::{self, ScenarioArgs},
    render_run::source_frame,
};

/// Largest texture side that plans are made for here: every adapter of the last decade has it, and `explain`
/// needs none.
const MAX_SIDE_PX: u32 = 16_384;

/// Show what a frame takes: passes, sizes, samples, bounds, and each thing skipped with its reason
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: camsim explain flight.toml --frame 7 --set camera.shutter.exposure_ms=0")]
pub struct Args {
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Frame number, from 0
    #[arg(long, default_value_t = 0, value_name = "N", allow_negative_numbers = true)]
    frame: u64,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Explained<'a> {
    frames: u64,
    log: Log,
    tracker: Tracker,
    terrain: Option<Terrain>,
    warnings: &'a [String],
    plan: PlanSummary<'a>,
    source_frame: Source,
    level_of_detail: Option<LevelOfDetail>,
    models: Option<Models>,
    memory: Option<Memory>,
}

/// What the source coordinates x, y of `coords` are in, by the names that `frames.csv` has for it.
#[derive(Serialize)]
struct Source {
    ideal_width_px: u32,
    ideal_height_px: u32,
    ideal_fx_px: f64,
    ideal_fy_px: f64,
    ideal_cx_px: f64,
    ideal_cy_px: f64,
    ideal_t_ns: i64,
    ideal_ned_m: [f64; 3],
    /// ned_from_camera.
    ideal_q_wxyz: [f64; 4],
}

impl Source {
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

#[derive(Serialize)]
struct Log {
    file: String,
    rows: usize,
    span_s: [f64; 2],
    cleaning: String,
}

#[derive(Serialize)]
struct Tracker {
    rate_hz: f64,
    limits: ResolvedLimits,
    saturation: Saturation,
}

/// What the ideal frame draws of the terrain.
#[derive(Serialize)]
pub(super) struct LevelOfDetail {
    pub(super) triangles: u64,
    /// Triangles in sight that are left out because they face away.
    pub(super) away: u64,
    /// Bound on how far the drawn terrain is from the full one, px of the picture.
    pub(super) max_error_px: f64,
    pub(super) tolerance_px: f64,
    /// How far depth may be off for it where the camera looks straight down, as a share of it.
    pub(super) depth_share: f64,
    /// What the device holds of its triangles.
    pub(super) triangle_bytes: u64,
}

/// What the ideal frame draws of models and patterns.
#[derive(Serialize)]
struct Models {
    #[serde(flatten)]
    detail: ModelDetail,
    /// Bound on how far what is drawn is from the full models, px of the picture.
    tolerance_px: f64,
}

/// Memory for a terrain and its picture, bytes. Only what is in sight of a frame is on the device, but for a
/// picture that is held whole.
#[derive(Serialize)]
struct Memory {
    /// On the host: heights with what the level of detail needs.
    heights_on_host: u64,
    /// On the host: the picture, with its smaller versions if it is in tiles.
    picture_on_host: u64,
    /// On the device: the picture, whole or as many tiles as this frame may read.
    picture_on_device: u64,
    /// For a picture in tiles: those that this frame may read, and all.
    tiles: Option<[u64; 2]>,
}

#[derive(Serialize)]
struct Terrain {
    epsg: u16,
    size: [u32; 2],
    south_west_deg: [f64; 2],
    north_east_deg: [f64; 2],
    height_range_m: [f64; 2],
    void_heights: u64,
    outside_ortho: u64,
    finest_triangles: u64,
}

/// Loads the scenario and prints the plan of one frame.
pub fn run(args: &Args, console: &mut Console<'_>) -> Result<(), Failure> {
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
        console
            .warn("quality.solver is \"oracle\": `render` casts every ray and needs no plan; this is the one that the engine would make");
    }
    let planner =
        Planner::new(loaded.sequence.clone(), &scenario.output.channels, MAX_SIDE_PX).or_bad_input()?;
    let plan = planner.plan(args.frame).or_bad_input()?;
    let (log, terrain) = (log_facts(&loaded), loaded.terrain.as_ref().map(terrain_facts));
    let level_of_detail = level_of_detail(&loaded.sequence, &plan);
    let models = models(&loaded.sequence, &plan);
    let memory = memory(&loaded.sequence, &plan);
    let source_frame = Source::of(&source_frame(&loaded.sequence, &plan));
    let tracked = &loaded.tracked;
    let tracker =
        Tracker { rate_hz: tracked.rate_hz, limits: tracked.limits, saturation: tracked.saturation };
    if args.json {
        let warnings = &loaded.warnings;
        return Ok(console.json(&Explained {
            frames,
            log,
            tracker,
            terrain,
            warnings,
            plan: plan.summary(),
            source_frame,
            level_of_detail,
            models,
            memory,
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
    console.line(format_args!("sequence of {frames} frames"))?;
    console.print(&plan.to_string())?;
    print_source(&source_frame, &plan, console)?;
    if let Some(part) = part_of_host(&loaded.sequence, &plan) {
        console.line(format_args!(
            "on a software adapter the host {part} of this frame (`camsim info --help`)"
        ))?;
    }
    if let Some(LevelOfDetail { triangles, away, max_error_px, tolerance_px, depth_share, triangle_bytes }) =
        level_of_detail
    {
        console.line("terrain in this frame")?;
        console.line(format_args!(
            "  {triangles} triangles, off by at most {max_error_px:.3} px of the picture, of {tolerance_px:.3} allowed"
        ))?;
        console.line(format_args!(
            "  the depth of what is seen from straight above is off by at most {depth_share:.1e} of it"
        ))?;
        if away > 0 {
            console.line(format_args!(
                "  {away} more face away and are not drawn: from above they are hidden"
            ))?;
        }
        if let Some(memory) = memory {
            print_memory(&memory, triangle_bytes, console)?;
        }
    }
    if let Some(Models { detail: ModelDetail { meshes, triangles, finest_triangles }, tolerance_px }) = models
    {
        console.line("models in this frame")?;
        console.line(format_args!(
            "  {meshes} meshes of {triangles} triangles, off by at most {tolerance_px:.3} px of the picture; {finest_triangles} at the finest level"
        ))?;
    }
    Ok(())
}

/// What the host does there in place of the device.
fn part_of_host(sequence: &Sequence, plan: &FramePlan) -> Option<&'static str> {
    match host::serves(plan) && draws(&sequence.scene, MAX_SIDE_PX) {
        true => Some("draws the ideal frame and runs the reverse pipeline"),
        false => ReverseOn::Best.is_host(plan).then_some("runs the reverse pipeline"),
    }
}

/// As the ideal pass chooses for its middle key.
fn models(sequence: &Sequence, plan: &FramePlan) -> Option<Models> {
    let scene = &sequence.scene;
    let tolerance = plan.model_tolerance(&sequence.scenario.quality);
    let detail = || ModelDetail::new(scene, &SceneLevels::new(scene), &plan.ideal_pose(), &tolerance);
    (!scene.meshes.is_empty()).then(|| Models {
        detail: detail(),
        tolerance_px: tolerance.error_px / plan.ideal.scale(&plan.camera),
    })
}

/// The choice that the ideal pass makes.
pub(super) fn level_of_detail(sequence: &Sequence, plan: &FramePlan) -> Option<LevelOfDetail> {
    let terrain = sequence.scene.terrain.as_ref()?;
    let scale = plan.ideal.scale(&plan.camera);
    let placed =
        detail(terrain, plan).mesh_to_draw().placed(terrain, plan.ideal_pose().position_ned_m.round());
    let (lod, triangle_bytes) = (placed.lod, placed.bytes());
    let depth_share = plan.terrain_error_px / plan.ideal.focal_px.max_element();
    Some(LevelOfDetail {
        triangles: lod.triangles,
        away: lod.away,
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

fn memory(sequence: &Sequence, plan: &FramePlan) -> Option<Memory> {
    let terrain = sequence.scene.terrain.as_ref()?;
    let picture = terrain.texture.rgba8.len() as u64;
    let heights_on_host = terrain.host_bytes();
    if scene::is_whole(terrain.texture.size_px, MAX_SIDE_PX) {
        return Some(Memory {
            heights_on_host,
            picture_on_host: picture,
            picture_on_device: 8 * picture / 3,
            tiles: None,
        });
    }
    let ground = GroundTiles::new(terrain);
    let tiles = detail(terrain, plan).tiles(&ground, plan.surface_reads).len() as u64;
    let all = u64::from(ground.grid.count);
    Some(Memory {
        heights_on_host,
        picture_on_host: 4 * picture / 3,
        picture_on_device: tiles * tile_bytes(TexelForm::Light),
        tiles: Some([tiles, all]),
    })
}

fn print_memory(memory: &Memory, triangle_bytes: u64, console: &mut Console<'_>) -> Result<(), Failure> {
    let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    let (heights, picture) = (mib(memory.heights_on_host), mib(memory.picture_on_host));
    console.line(format_args!("  host: {heights:.1} MiB of heights, {picture:.1} MiB of picture"))?;
    let (triangles, picture) = (mib(triangle_bytes), mib(memory.picture_on_device));
    match memory.tiles {
        None => console.line(format_args!("  device: {triangles:.1} MiB of triangles, the picture whole in {picture:.1} MiB, where the device draws it"))?,
        Some([tiles, all]) => console.line(format_args!(
            "  device: {triangles:.1} MiB of triangles, {tiles} of {all} tiles of the picture in {picture:.1} MiB (at most twice of what any frame needs, and 32 MiB), where the device draws it"
        ))?,
    }
    Ok(())
}

fn print_terrain(terrain: &Terrain, console: &mut Console<'_>) -> Result<(), Failure> {
    let Terrain { epsg, size: [columns, rows], south_west_deg, north_east_deg, height_range_m, .. } = terrain;
    console.line(format_args!("terrain of {columns}x{rows} heights, EPSG:{epsg}"))?;
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

/// What x and y of `coords` are in.
fn print_source(source: &Source, plan: &FramePlan, console: &mut Console<'_>) -> Result<(), Failure> {
    let Source {
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
        "source coordinates (x, y of coords) are in a frame of {ideal_width_px}x{ideal_height_px} px, focal length {ideal_fx_px:.6}, {ideal_fy_px:.6}, principal point {ideal_cx_px:.6}, {ideal_cy_px:.6} px"
    ))?;
    let ([n, e, d], [w, x, y, z]) = (source.ideal_ned_m, source.ideal_q_wxyz);
    console.line(format_args!(
        "  of a pinhole at NED {n:.6}, {e:.6}, {d:.6} m, ned_from_camera w {w:.9}, x {x:.9}, y {y:.9}, z {z:.9}, stamp {ideal_t_ns} ns"
    ))?;
    if plan.shared_by.is_some() {
        console.line("  which is this frame's own, though several are made from one ideal frame")?;
    }
    Ok(())
}

/// What light does, and what of it no figure below counts.
fn print_light(loaded: &Loaded, console: &mut Console<'_>) -> Result<(), Failure> {
    let Some(light) = &loaded.sequence.scenario.scene.light else { return Ok(()) };
    let LightSpec { sun_azimuth_deg, sun_elevation_deg, sun, sky } = light;
    let from = format!(
        "light: sun {sun} from {sun_azimuth_deg} deg east of north, {sun_elevation_deg} deg high, and sky {sky}"
    );
    let ground = match (&loaded.terrain, &loaded.sequence.scene.terrain) {
        (Some(summary), Some(terrain)) => {
            let [width, height] = terrain.texture.size_px;
            let finer = match summary.picture_times {
                1 => String::new(),
                times => format!(", made {times} times finer for it"),
            };
            format!(
                "; in the ground's picture of {width}x{height} px{finer}, in steps of 8 bits that no error below counts"
            )
        }
        _ => String::new(),
    };
    console.line(format_args!("{from}{ground}"))?;
    Ok(())
}

fn log_facts(loaded: &Loaded) -> Log {
    let rows = &loaded.log.rows;
    let (first_s, last_s) = (rows.first().map_or(0.0, |row| row.t_s), rows.last().map_or(0.0, |row| row.t_s));
    Log {
        file: loaded.sequence.scenario.flight.log.display().to_string(),
        rows: rows.len(),
        span_s: [first_s, last_s],
        cleaning: loaded.log.report.to_string(),
    }
}

fn terrain_facts(summary: &TerrainSummary) -> Terrain {
    let [columns, rows] = summary.size.map(|heights| u64::from(heights.saturating_sub(1)));
    Terrain {
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
