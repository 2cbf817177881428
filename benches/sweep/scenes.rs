//! Scenes as users have them, stage by stage.

use std::{
    convert::Infallible,
    sync::Arc,
    time::{Duration, Instant},
};

use camsim::{
    core::{scenario::Channel, sequence::Sequence, validate::validate},
    engine::Engine,
    lab::timing::{ms, processor_ms, quartiles},
};

use crate::{
    files::Program,
    flight::{
        Outcome,
        comparison::{NO_ADAPTER, PRESET, Renderers, frame_rate},
        rounds::{RoundLimits, Variant, measure, median_ratio},
        with_paper_preset,
    },
    passes::{StageTimes, stage_times},
    scenario::{ALL_EFFECTS, FRAMES, HOUSES, VIO_TOWN, rig},
};

const LIMITS: RoundLimits = RoundLimits { burst: 8, rounds: 5, budget: Duration::from_secs(60) };
/// Rounds of `camsim render` with and without files.
const FILE_ROUNDS: usize = 3;
const FILE_FRAMES: &str = "8..24";

/// Name and file. The last, with several cameras, is the smoke test.
const SCENES: [(&str, &str); 7] = [
    ("alpine", ALL_EFFECTS),
    ("houses", HOUSES),
    ("vio_town", VIO_TOWN),
    ("mapping", "benches/scenes/mapping.toml"),
    ("fpv", "benches/scenes/fpv.toml"),
    ("fisheye", "benches/scenes/fisheye.toml"),
    ("rig", "benches/scenes/rig.toml"),
];

/// All scenes with what each stage takes.
pub fn scenes(renderers: &Renderers, is_measuring: bool) -> Outcome<()> {
    let limits = LIMITS.or_smoke_test(is_measuring);
    println!(
        "\nup to {} rounds of {} frames of each camera, all renderers and channels of a scene in turn; medians, \
         quartiles in brackets.\nAll times are ms a picture but for the first plan and the first frame. plan: \
         processor time of all threads, for a burst\nwith nothing known of it; first plan, first frame: of a \
         scenario that is not yet loaded; ideal, output: passes, over all\npictures of {} frames; truth: rate \
         with depth, coords, valid over that of colour (a field divided among faces: without\ncoords); files: \
         rate of the program with the scenario's files over that without\n",
        limits.rounds,
        limits.burst,
        2 * limits.burst
    );
    let titles = [
        "scene",
        "renderer",
        "pictures/s",
        &format!("{PRESET} ({}), pictures/s", renderers.preset().0),
        "times the preset's rate",
        "plan",
        "first plan",
        "first frame",
        "ideal",
        "output",
        "truth",
        "files",
    ];
    println!("| {} |\n|{}", titles.join(" | "), "---|".repeat(titles.len()));
    for (name, path) in &SCENES[if is_measuring { 0 } else { SCENES.len() - 1 }..] {
        scene(renderers, name, path, limits, is_measuring)?;
    }
    Ok(())
}

/// Prints the rows of a scene.
fn scene(
    renderers: &Renderers,
    name: &str,
    path: &'static str,
    limits: RoundLimits,
    is_measuring: bool,
) -> Outcome<()> {
    let engines = [("cpu", renderers.columns()[0]), ("gpu", renderers.columns()[1])];
    let mut starts = Vec::new();
    for (_, engine) in engines {
        starts.push(engine.map(|engine| start(engine, path)).transpose()?);
    }
    let mut cameras = rig(path)?;
    cameras.truncate(if is_measuring { cameras.len() } else { 2 });
    let colour = open(&renderers.cpu, &cameras, &[Channel::Color])?;
    let is_divided = colour.session.planner().lanes() > 1;
    let truth: &[Channel] = if is_divided {
        &[Channel::Color, Channel::Depth, Channel::Valid]
    } else {
        &[Channel::Color, Channel::Depth, Channel::Coords, Channel::Valid]
    };
    // Colour and truth of each renderer, and the preset.
    let mut variants = vec![colour, open(&renderers.cpu, &cameras, truth)?];
    if let Some(gpu) = &renderers.gpu {
        variants.extend([open(gpu, &cameras, &[Channel::Color])?, open(gpu, &cameras, truth)?]);
    }
    // The paper's methods do not have all parts of a camera.
    let paper: Vec<_> = cameras.iter().map(|camera| with_paper_preset(camera)).collect();
    let has_preset = paper.iter().all(|camera| validate(&camera.scenario).is_empty());
    let preset_at = has_preset.then_some(variants.len());
    if has_preset {
        variants.push(open(renderers.preset().1, &paper, &[Channel::Color])?);
    }
    let frames = cameras.iter().map(|camera| camera.frames).min().unwrap_or(0).min(FRAMES);
    measure(&mut variants, frames, limits)?;
    let preset_ms = preset_at.map(|at| variants[at].ms.clone());
    for (row, ((renderer, engine), start)) in engines.into_iter().zip(starts).enumerate() {
        let (Some(engine), Some([first_plan_ms, first_frame_ms])) = (engine, start) else {
            println!("| {name} | {renderer} | {NO_ADAPTER} |{}", " |".repeat(9));
            continue;
        };
        let truth = median_ratio(&variants[2 * row].ms, &variants[2 * row + 1].ms);
        let colour = &mut variants[2 * row];
        let plan_ms = plan_ms(colour, frames, limits)?;
        let [ideal_ms, output_ms] = pass_times(engine, colour, 2 * limits.burst)?;
        let cells = [
            name.to_owned(),
            renderer.to_owned(),
            frame_rate(colour),
            preset_at.filter(|_| row == 0).map_or(String::new(), |at| frame_rate(&variants[at])),
            preset_ms.as_ref().map_or(String::new(), |preset_ms| {
                format!("{:.2}", median_ratio(preset_ms, &variants[2 * row].ms))
            }),
            plan_ms,
            format!("{first_plan_ms:.0}"),
            format!("{first_frame_ms:.0}"),
            ideal_ms,
            output_ms,
            format!("{truth:.2}"),
            format!("{:.2}", files(renderer, path, is_measuring)?),
        ];
        println!("| {} |", cells.join(" | "));
    }
    Ok(())
}

/// A variant with all cameras of a rig.
fn open<'a>(engine: &'a Engine, cameras: &[Arc<Sequence>], channels: &[Channel]) -> Outcome<Variant<'a>> {
    let first = cameras.first().ok_or("a scenario has a camera")?;
    let rig = if cameras.len() > 1 { cameras.to_vec() } else { Vec::new() };
    Ok(Variant { rig, ..Variant::open(engine, first.clone(), channels)? })
}

/// Milliseconds of the first plan, and from the scenario's file to the first frame.
fn start(engine: &Engine, path: &str) -> Outcome<[f64; 2]> {
    let begin = Instant::now();
    let camera = rig(path)?.into_iter().next().ok_or("a scenario has a camera")?;
    let mut first_plan_ms = 0.0;
    engine.session::<Infallible>(camera, &[Channel::Color])?.render::<Infallible>([0], &mut |finished| {
        first_plan_ms = finished.times.plan_ms;
        Ok(())
    })?;
    Ok([first_plan_ms, ms(begin.elapsed())])
}

/// Processor time of a plan, over bursts of frames of which nothing is known.
fn plan_ms(variant: &mut Variant<'_>, frames: u64, limits: RoundLimits) -> Outcome<String> {
    let RoundLimits { burst, rounds, .. } = limits;
    let mut all_ms = Vec::new();
    for round in 0..rounds {
        let first = (round as u64 * burst) % (frames / burst * burst);
        let of_cameras = variant.each_camera(|session| {
            session.forget();
            let begin_ms = processor_ms();
            for frame in first..first + burst {
                session.planner().plans(frame)?;
            }
            Ok(begin_ms.zip(processor_ms()).map(|(begin, end)| (end - begin) / burst as f64))
        })?;
        let cameras = of_cameras.len() as f64;
        all_ms.extend(of_cameras.into_iter().sum::<Option<f64>>().map(|sum| sum / cameras));
    }
    if all_ms.is_empty() {
        return Ok("not known".to_owned());
    }
    let [low, median, high] = quartiles(&all_ms);
    Ok(format!("{median:.1} ({low:.1} .. {high:.1})"))
}

/// Passes for ideal frames and for output frames, ms a picture.
fn pass_times(engine: &Engine, variant: &mut Variant<'_>, frames: u64) -> Outcome<[String; 2]> {
    let of_cameras = variant.each_camera(|session| {
        session.forget();
        stage_times(engine, session, 0..frames)
    })?;
    let of_cameras: Vec<StageTimes> = match of_cameras.into_iter().collect() {
        Ok(of_cameras) => of_cameras,
        Err(reason) => return Ok([reason, reason].map(str::to_owned)),
    };
    let pictures = (frames * of_cameras.len() as u64) as f64;
    let (mut ideal_ms, mut output_ms) = (0.0, 0.0);
    for (stage, all_ms) in of_cameras.iter().flatten() {
        match stage.as_str() {
            "cpu: plan" | "cpu: record" | "cpu: read" => {}
            "cpu: reverse" | "gpu: reverse" | "gpu: lens_inverse" => output_ms += all_ms.iter().sum::<f64>(),
            _ => ideal_ms += all_ms.iter().sum::<f64>(),
        }
    }
    Ok([ideal_ms, output_ms].map(|ms| format!("{:.1}", ms / pictures)))
}

/// Rate of the program that writes files over that of one that writes none.
fn files(backend: &'static str, path: &'static str, is_measuring: bool) -> Outcome<f64> {
    let folder = tempfile::tempdir()?;
    let frames = ["--frames", if is_measuring { FILE_FRAMES } else { "8" }];
    let mut with_files = Program::new(path, backend, &[&frames]);
    let mut without = Program::new(path, backend, &[&frames, &["--format", "none"]]);
    for _ in 0..if is_measuring { FILE_ROUNDS } else { 1 } {
        for program in [&mut with_files, &mut without] {
            program.run(&folder.path().join("frames"))?;
        }
    }
    Ok(median_ratio(&with_files.frames_per_s, &without.frames_per_s))
}
