//! What is told of a frame, as text for people.

use camsim_core::{
    scenario::{Face, LightSpec},
    scene::{self, ModelLod},
};
use camsim_engine::{MOVING_RAYS, SMALL_LAMP_PX};
use camsim_io::load::Loaded;
use camsim_plan::{FramePlan, LevelOfDetail, Placement};

use super::{
    camera,
    report::{
        ExplainReport, LogFacts, MemoryFacts, ModelFacts, Plans, SourceFrameFields, TerrainFacts,
        TrackerFacts,
    },
    sensors, twins,
};
use crate::{console::Console, failure::Failure};

/// Prints all of it.
pub(super) fn print(
    plans: &Plans,
    report: &ExplainReport<'_>,
    loaded: &Loaded,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    print_flight(&report.log, &report.tracker, console)?;
    if let Some(terrain) = &report.terrain {
        print_terrain(terrain, console)?;
    }
    print_light(loaded, console)?;
    camera::print(&report.camera, console)?;
    sensors::print(&report.sensors, console)?;
    let s = if report.frames == 1 { "" } else { "s" };
    console.line(format_args!("sequence of {} frame{s}", report.frames))?;
    print_plans(plans, console)?;
    print_moving(&report.moving, console)?;
    print_lamps(&loaded.sequence.scene, console)?;
    print_source(&report.source_frame, &plans.plan, console)?;
    let Placement { ideal, reverse } = report.placement;
    console.line(format_args!("rendered on {}", plans.renderer))?;
    console.line(format_args!("  ideal frames by the {ideal}, output frame by the {reverse}"))?;
    if let Some(detail) = report.level_of_detail {
        print_level_of_detail(detail, report.memory.as_ref(), console)?;
    }
    if let Some(models) = &report.models {
        print_models(models, console)?;
    }
    twins::print(&plans.twins, console)
}

fn print_flight(log: &LogFacts, tracker: &TrackerFacts, console: &mut Console<'_>) -> Result<(), Failure> {
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
    Ok(())
}

/// Prints the plan of the camera, or of each of its faces.
fn print_plans(plans: &Plans, console: &mut Console<'_>) -> Result<(), Failure> {
    if let Some(face) = plans.plan.camera.lens.face() {
        print_faces(face, &plans.faces, console)?;
    }
    console.print(&plans.plan.to_string())?;
    for plan in &plans.faces {
        console.line(format_args!("face {}", plan.camera.lens.face().map_or("", Face::name)))?;
        console.print(&plan.to_string())?;
    }
    Ok(())
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

fn print_level_of_detail(
    detail: LevelOfDetail,
    memory: Option<&MemoryFacts>,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let LevelOfDetail { triangles, away, max_error_px, tolerance_px, depth_fraction, triangle_bytes } =
        detail;
    console.line("terrain in this frame")?;
    console.line(format_args!(
        "  {triangles} triangles, displaced by at most {max_error_px:.3} output px (tolerance {tolerance_px:.3})"
    ))?;
    console.line(format_args!(
        "  seen from straight above, depth is off by at most {depth_fraction:.1e} of itself"
    ))?;
    if away > 0 {
        console.line(format_args!("  {away} back-facing triangles are not drawn"))?;
    }
    match memory {
        Some(memory) => print_memory(memory, triangle_bytes, console),
        None => Ok(()),
    }
}

fn print_models(models: &ModelFacts, console: &mut Console<'_>) -> Result<(), Failure> {
    let ModelFacts { detail: ModelLod { meshes, triangles, finest_triangles }, tolerance_px } = models;
    console.line("models in this frame")?;
    console.line(format_args!(
        "  {meshes} meshes with {triangles} triangles, displaced by at most {tolerance_px:.3} output px; \
         {finest_triangles} triangles at the finest level"
    ))?;
    Ok(())
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
