//! What a frame of `benches/all_effects.toml` costs by size, by length of blur, by effect and by file format,
//! each table with the paper's preset of the same frames in the same rounds; what the houses of
//! `benches/houses.toml` add to their terrain; and what the plan takes ways of sampling to cost beside what
//! they take.
//!
//! `cargo bench --bench sweep` makes all tables, `cargo bench --bench sweep -- blur files` these two (`size`,
//! `blur`, `effects`, `alike`, `passes`, `houses`, `costs`, `files`); `CAMSIM_ADAPTER=part-of-a-name` picks
//! the adapter.

#![allow(clippy::print_stdout, reason = "the tables are what this program is for")]

use std::{convert::Infallible, path::PathBuf, process::Command, sync::Arc, time::Duration};

use camsim::{
    core::{
        frame::COORDS_CHANNELS,
        scenario::{Auto, Channel, Silhouettes},
        scene::{ModelLod, SceneLods},
        sequence::Sequence,
    },
    engine::{AdapterChoice, Backend, Engine},
    io::{load::load_sequence, scenario_file::read_scenario},
    lab::{
        cases::cases,
        timing::{peak_memory_mb, quantile, quartiles},
    },
    plan::FramePlan,
};

mod flight;

use flight::{
    Outcome, Without,
    rounds::{Effort, Variant, measure, ratio, say_rounds, times},
};

const EFFORT: Effort = Effort { burst: 8, rounds: 25, budget: Duration::from_secs(90) };
/// Large frames take seconds.
const EFFORT_LARGE: Effort = Effort { burst: 4, rounds: 9, budget: Duration::from_secs(120) };
const EFFORT_HOUSES: Effort = Effort { burst: 8, rounds: 5, budget: Duration::from_secs(60) };
/// The paper's preset, as it is called in the tables.
const PRESET: &str = "the paper's preset";
/// Of files: programs run one after the other, so many times.
const FILE_ROUNDS: usize = 5;
const FILE_FRAMES: &str = "32..64";

fn main() -> Outcome<()> {
    // Cargo passes `--bench`; anything else that runs the program (`cargo test --benches`) only wants to know
    // whether it works.
    let (measuring, wanted): (Vec<String>, Vec<String>) =
        std::env::args().skip(1).partition(|argument| argument == "--bench");
    let is_measuring = !measuring.is_empty();
    let engine = Engine::new(AdapterChoice::Best)?;
    println!("adapter   {}", engine);
    println!(
        "frames    of benches/all_effects.toml, 640x480 unless told otherwise; read back, nothing encoded but for the last table"
    );
    let tables = [
        ("renderers", renderers as fn(&Engine, bool) -> Outcome<()>),
        ("size", size),
        ("blur", blur),
        ("effects", effects),
        ("alike", alike),
        ("passes", passes),
        ("houses", houses),
        ("costs", costs),
    ];
    for (name, table) in tables {
        if wanted.is_empty() || wanted.iter().any(|wanted| wanted == name) {
            table(&engine, is_measuring)?;
        }
    }
    drop(engine);
    if wanted.is_empty() || wanted.iter().any(|wanted| wanted == "files") {
        files(is_measuring)?;
    }
    Ok(())
}

/// The same frames by the cpu alone, by the adapter alone, and by the paper's preset on the adapter, in turn.
fn renderers(_: &Engine, is_measuring: bool) -> Outcome<()> {
    let cpu = Engine::cpu();
    let gpu = Engine::open(Backend::Gpu)?;
    let whole = changed(&[])?;
    let truth = [Channel::Color, Channel::Depth, Channel::Coords, Channel::Valid];
    let color = &truth[..1];
    let rows = [
        ("all effects", Without::Nothing, color),
        ("all effects, color, depth, coords, valid", Without::Nothing, &truth),
        ("- motion blur", Without::Blur, color),
        ("- lens", Without::Lens, color),
        ("- all effects: a perfect camera", Without::Anything, color),
    ];
    let rows = &rows[..if is_measuring { rows.len() } else { 1 }];
    let mut variants = Vec::new();
    for (name, without, channels) in rows {
        let sequence = without.of(&whole)?;
        for engine in [&cpu, &gpu] {
            variants.push(Variant::open(*name, engine, sequence.clone(), channels)?);
        }
    }
    variants.push(Variant::open(PRESET, &gpu, preset()?, color)?);
    let effort = effort(EFFORT, is_measuring);
    measure(&mut variants, 96, effort)?;
    println!("{}", say_rounds(&variants, effort));
    println!("frames/s; in brackets those of the quartiles. gpu: {gpu}\n");
    println!("| variant | {cpu} | gpu | gpu, {PRESET} |\n|---|---|---|---|");
    let rate = |variant: &Variant<'_>| {
        let [fast_ms, median_ms, slow_ms] = quartiles(&variant.ms);
        format!("{:.1} ({:.1} .. {:.1})", 1e3 / median_ms, 1e3 / slow_ms, 1e3 / fast_ms)
    };
    let (of_preset, pairs) = variants.split_last().ok_or("no variants")?;
    for (row, pair) in pairs.chunks_exact(2).enumerate() {
        let last = if row == 0 { rate(of_preset) } else { String::new() };
        println!("| {} | {} | {} | {last} |", pair[0].name, rate(&pair[0]), rate(&pair[1]));
    }
    Ok(())
}

/// Frames of several sizes, the path over the exposure the same in pixels.
fn size(engine: &Engine, is_measuring: bool) -> Outcome<()> {
    let sizes: &[[u32; 2]] = if is_measuring {
        &[[640, 480], [320, 240], [1280, 960], [2560, 1920], [3840, 2160]]
    } else {
        &[[320, 240]]
    };
    let mut variants = Vec::new();
    for &[width, height] in sizes {
        let k = f64::from(width) / 640.0;
        // 3840x2160 is a strip across the middle of 3840x2880.
        let principal_y = 226.2 * k - 0.5 * (480.0 * k - f64::from(height));
        let sequence = changed(&[
            ("camera.size_px", format!("[{width}, {height}]")),
            ("camera.focal_px", format!("[{0}, {0}]", 307.6 * k)),
            ("camera.principal_point_px", format!("[{}, {principal_y}]", 305.1 * k)),
            ("camera.shutter.exposure_ms", (24.0 / k).to_string()),
        ])?;
        variants.push(Variant::open(format!("{width} x {height}"), engine, sequence, &[Channel::Color])?);
    }
    variants.push(Variant::open(PRESET, engine, preset()?, &[Channel::Color])?);
    let effort = effort(EFFORT_LARGE, is_measuring);
    measure(&mut variants, 96, effort)?;
    println!("{}", say_rounds(&variants, effort));
    println!(
        "| frame | ms a frame | frames/s | processor ms a frame | processor ns a pixel | to the first, a pixel, in the same round |"
    );
    println!("|---|---|---|---|---|---|");
    let pixels = |variant: &Variant<'_>| {
        let [width, height] = variant.session.planner().sequence().scenario.camera.size_px;
        f64::from(width) * f64::from(height)
    };
    for variant in &variants {
        let [wall, rate, _, processor, _] = times(variant, &variants[0]);
        let ns = 1e6 * quartiles(&variant.processor_ms)[1] / pixels(variant);
        let to_first =
            ratio(&variant.processor_ms, &variants[0].processor_ms) * pixels(&variants[0]) / pixels(variant);
        println!("| {} | {wall} | {rate} | {processor} | {ns:.0} | {to_first:.2} |", variant.name);
    }
    Ok(())
}

/// Exposures from none to a path of some 100 px.
fn blur(engine: &Engine, is_measuring: bool) -> Outcome<()> {
    let exposures_ms: &[f64] = if is_measuring { &[24.0, 0.0, 2.4, 7.2, 72.0, 240.0] } else { &[24.0] };
    let mut variants = Vec::new();
    for exposure_ms in exposures_ms {
        let sequence = changed(&[("camera.shutter.exposure_ms", exposure_ms.to_string())])?;
        let path_px = median_path_px(engine, &sequence)?;
        variants.push(Variant::open(
            format!("{exposure_ms} ms | {path_px:.1}"),
            engine,
            sequence,
            &[Channel::Color],
        )?);
    }
    // The preset samples paths of any length as often as it is told.
    for samples in [100, 10] {
        let sequence = changed(&[
            ("quality.preset", "\"paper\"".into()),
            ("quality.blur_samples", samples.to_string()),
        ])?;
        variants.push(Variant::open(
            format!("24 ms, {PRESET}, {samples} samples | "),
            engine,
            sequence,
            &[Channel::Color],
        )?);
    }
    let effort = effort(EFFORT, is_measuring);
    measure(&mut variants, 96, effort)?;
    println!("{}", say_rounds(&variants, effort));
    print_against(&variants, "exposure | path of a pixel, median, px");
    Ok(())
}

/// The full camera, and with each effect left out.
fn effects(engine: &Engine, is_measuring: bool) -> Outcome<()> {
    without_each(engine, &changed(&[])?, Some(preset()?), "variant", is_measuring)
}

/// The same, but sampled alike whatever the error: what stages cost, where `effects` tells what frames do.
fn alike(engine: &Engine, is_measuring: bool) -> Outcome<()> {
    let one_way = [
        ("quality.ideal_scale", "1.0"),
        ("quality.ideal_samples", "1"),
        ("quality.footprint_taps", "1"),
        ("quality.silhouettes", "\"plain\""),
        ("quality.frames_per_ideal", "4"),
        ("quality.max_error_dn", "8"),
    ];
    let whole = changed(&one_way.map(|(key, value)| (key, value.to_owned())))?;
    without_each(engine, &whole, None, "variant, all sampled alike", is_measuring)
}

fn without_each(
    engine: &Engine,
    whole: &Arc<Sequence>,
    preset: Option<Arc<Sequence>>,
    head: &str,
    is_measuring: bool,
) -> Outcome<()> {
    let mut variants = Vec::new();
    for (name, without) in EFFECTS.into_iter().take(if is_measuring { EFFECTS.len() } else { 1 }) {
        variants.push(Variant::open(name, engine, without.of(whole)?, &[Channel::Color])?);
    }
    if let Some(preset) = preset {
        variants.push(Variant::open(PRESET, engine, preset, &[Channel::Color])?);
    }
    let effort = effort(EFFORT, is_measuring);
    measure(&mut variants, 96, effort)?;
    println!("{}", say_rounds(&variants, effort));
    print_against(&variants, head);
    Ok(())
}

const EFFECTS: [(&str, Without); 7] = [
    ("all effects", Without::Nothing),
    ("- vignette and noise", Without::Photometric),
    ("- motion blur", Without::Blur),
    ("- rolling shutter", Without::RollingShutter),
    ("- blur and rolling shutter", Without::Time),
    ("- lens", Without::Lens),
    ("- all of these: a perfect camera", Without::Anything),
];

/// Where the time goes: the device's by its own clock.
fn passes(engine: &Engine, is_measuring: bool) -> Outcome<()> {
    let whole = changed(&[])?;
    let kinds = [
        ("all effects", whole.clone()),
        ("a perfect camera", Without::Anything.of(&whole)?),
        ("max_error_dn = 2", changed(&[("quality.max_error_dn", "2".into())])?),
        (PRESET, preset()?),
    ];
    let mut columns: Vec<Vec<(String, Vec<f64>)>> = Vec::new();
    for (_, sequence) in &kinds {
        let mut session = engine.session::<Infallible>(sequence.clone(), &[Channel::Color])?;
        if !session.time_passes() {
            println!("\nthe adapter has no time stamps: no passes");
            return Ok(());
        }
        let mut column: Vec<(String, Vec<f64>)> = Vec::new();
        session.render::<Infallible>(32..if is_measuring { 64 } else { 33 }, &mut |finished| {
            let times = &finished.times;
            let host = [
                ("cpu: plan", times.plan_ms),
                ("cpu: record", times.record_ms),
                ("cpu: read", times.read_ms),
            ];
            let device = times.passes.iter().map(|pass| (format!("gpu: {}", pass.name), pass.ms));
            let by_host = [("cpu: ideal", times.ideal_ms), ("cpu: reverse", times.reverse_ms)];
            let by_host = by_host.into_iter().filter_map(|(name, ms)| Some((name, ms?)));
            for (name, ms) in
                host.into_iter().chain(by_host).map(|(name, ms)| (name.to_owned(), ms)).chain(device)
            {
                match column.iter_mut().find(|(known, _)| *known == name) {
                    Some((_, all)) => all.push(ms),
                    None => column.push((name, vec![ms])),
                }
            }
            Ok(())
        })?;
        columns.push(column);
    }
    let mut names: Vec<&str> = columns.iter().flatten().map(|(name, _)| name.as_str()).collect();
    let mut seen = Vec::new();
    names.retain(|name| {
        !seen.contains(name) && {
            seen.push(*name);
            true
        }
    });
    println!("\nmedian ms where a frame has the pass, and in how many of the frames it is\n");
    println!("| part | {} |", kinds.each_ref().map(|(name, _)| *name).join(" | "));
    println!("|---{}|", "|---".repeat(kinds.len()));
    for name in names {
        let cells = columns.iter().map(|column| match column.iter().find(|(known, _)| known == name) {
            Some((_, all)) => format!("{:.1}, {}", quartiles(all)[1], all.len()),
            None => String::new(),
        });
        println!("| {name} | {} |", cells.collect::<Vec<_>>().join(" | "));
    }
    Ok(())
}

/// Pitch angles of the mount from which houses are looked at, degrees.
const PITCHES_DEG: [f64; 3] = [-35.0, -50.0, -65.0];
/// Scale of the ideal frame where terrain and houses are to be sampled alike.
const ALIKE: f64 = 2.83;

/// Terrain with 5000 houses on it beside the terrain alone: as the plan makes each of them, and both from
/// ideal frames of one scale without rays.
fn houses(engine: &Engine, is_measuring: bool) -> Outcome<()> {
    println!(
        "\nbenches/houses.toml: terrain with 5000 houses beside the terrain alone; houses in view, scales and predicted errors are those of frame 40\n"
    );
    println!(
        "| mount, sampling | houses in view | scales | 1/255, predicted | terrain, processor ms a frame | with houses | times | ms a frame | with houses | times |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let alike = [
        ("quality.ideal_scale", ALIKE.to_string()),
        ("quality.ideal_samples", "1".to_owned()),
        ("quality.silhouettes", "\"plain\"".to_owned()),
        ("quality.frames_per_ideal", "1".to_owned()),
    ];
    for pitch_deg in PITCHES_DEG.into_iter().take(if is_measuring { PITCHES_DEG.len() } else { 1 }) {
        for (way, sets) in
            [("as planned", &[][..]), ("alike", &alike[..3]), ("alike, an ideal frame each", &alike)]
        {
            let pitch = ("camera.mount.angles_deg", format!("[0.0, {pitch_deg:?}, 0.0]"));
            let with_houses = sequence_of("benches/houses.toml", &[&[pitch], sets].concat())?;
            let mut terrain = Sequence::clone(&with_houses);
            Arc::make_mut(&mut terrain.scene).meshes.clear();
            let mut variants = [Arc::new(terrain), with_houses]
                .map(|sequence| Variant::open("", engine, sequence, &[Channel::Color]))
                .into_iter()
                .collect::<Outcome<Vec<_>>>()?;
            let plans = [0, 1].map(|i| plan_of(&mut variants[i])).into_iter().collect::<Outcome<Vec<_>>>()?;
            let effort = effort(EFFORT_HOUSES, is_measuring);
            measure(&mut variants, 96, effort)?;
            let both =
                |of: &dyn Fn(&FramePlan) -> String| plans.iter().map(of).collect::<Vec<_>>().join(", ");
            let scales = both(&|plan| format!("{:.2}", plan.ideal.focal_px.x / plan.camera.focal_px.x));
            let dn = both(&|plan| format!("{:.2}", predicted_dn(plan)));
            let [terrain, houses] = [0, 1].map(|i| &variants[i]);
            let pair = |of: &dyn Fn(&Variant<'_>) -> Vec<f64>| {
                let [alone, with] =
                    [of(terrain), of(houses)].map(|ms| (format!("{:.0}", quartiles(&ms)[1]), ms));
                format!("{} | {} | {:.2}", alone.0, with.0, ratio(&with.1, &alone.1))
            };
            let [processor, wall] =
                [pair(&|variant| variant.processor_ms.clone()), pair(&|variant| variant.ms.clone())];
            println!(
                "| {pitch_deg} degrees, {way} | {} | {scales} | {dn} | {processor} | {wall} |",
                in_view(&plans[1], houses)
            );
        }
    }
    println!(
        "\nrounds    of {} frames, with and without in turn; medians, of ratios too",
        EFFORT_HOUSES.burst
    );
    Ok(())
}

/// Cases of `camsim bench` and scenarios of this folder, and the scales, reads along a side and samples with
/// which each is made.
const COSTLY: [&str; 7] =
    ["plane-30", "terrain-100", "lens-s3", "lens-tangential", "blender-plane", "exposure-100", "all-effects"];
const COSTLY_FILES: [&str; 2] = ["benches/all_effects.toml", "benches/houses.toml"];
const COST_SCALES: [f64; 3] = [1.0, 1.6, 2.5];
const COST_TAPS: [Auto<u32>; 4] = [Auto::Auto, Auto::Value(1), Auto::Value(2), Auto::Value(4)];
const COST_SAMPLES: [u32; 2] = [3, 16];
/// Frames of each, one by one so that nothing overlaps; the first compiles.
const COST_FRAMES: u64 = 4;

/// What the plan takes the ideal and the reverse pass to cost beside what they take, by the clock of the
/// device or of the host, whichever runs them: many ways of sampling, silhouettes left as they are. Only
/// where its milliseconds come from the ratio should be near 1; anywhere ratios should be alike.
fn costs(engine: &Engine, is_measuring: bool) -> Outcome<()> {
    let mut sequences = Vec::new();
    for case in cases()?.into_iter().filter(|case| COSTLY.contains(&case.name)).take(if is_measuring {
        COSTLY.len()
    } else {
        1
    }) {
        sequences.push((case.name, case.sequence, 0));
    }
    for file in COSTLY_FILES.into_iter().filter(|_| is_measuring) {
        sequences.push((file, sequence_of(file, &[])?, 40));
    }
    println!("\n| case | ways | ideal, ms | foretold, times | reverse, ms | foretold, times |");
    println!("|---|---|---|---|---|---|");
    for (name, sequence, first) in sequences {
        let exposed = sequence.scenario.camera.shutter.exposure_ms > 0.0;
        let samples = if exposed { COST_SAMPLES.map(Auto::Value).to_vec() } else { vec![Auto::Auto] };
        let (mut taken, mut foretold) = ([vec![], vec![]], [vec![], vec![]]);
        let ideals = || COST_SCALES.iter().flat_map(|scale| [1, 4].map(|samples| (*scale, samples)));
        let ways = || ideals().flat_map(|ideal| COST_TAPS.iter().map(move |taps| (ideal, *taps)));
        for (((scale, ideal_samples), taps), samples) in
            samples.into_iter().flat_map(|samples| ways().map(move |way| (way, samples)))
        {
            let mut forced = Sequence::clone(&sequence);
            let quality = &mut forced.scenario.quality;
            (quality.frames_per_ideal, quality.silhouettes, quality.ideal_scale) =
                (1, Silhouettes::Plain, Auto::Value(scale));
            (quality.ideal_samples, quality.footprint_taps, quality.blur_samples) =
                (Auto::Value(ideal_samples), taps, samples);
            let Some(way) = pass_times(engine, Arc::new(forced), first)? else {
                println!("\nthe adapter has no time stamps: no passes");
                return Ok(());
            };
            for (k, [ms, price]) in way.into_iter().enumerate() {
                taken[k].push(ms);
                foretold[k].push(price / ms);
            }
        }
        let cells = [0, 1].map(|k: usize| {
            let ([least, most], [low, middle, high]) =
                ([0.0, 1.0].map(|part| quantile(&taken[k], part)), quartiles(&foretold[k]));
            format!("{least:.1} .. {most:.1} | {middle:.2} ({low:.2} .. {high:.2})")
        });
        println!("| {name} | {} | {} |", taken[0].len(), cells.join(" | "));
    }
    println!(
        "\ntime of each way, on the device or the host: median of {} frames, rendered one by one; medians and quartiles over the ways",
        COST_FRAMES - 1
    );
    Ok(())
}

/// Of the ideal and the reverse pass what they take and what the plan takes them to cost, milliseconds;
/// `None` without time stamps.
fn pass_times(engine: &Engine, sequence: Arc<Sequence>, first: u64) -> Outcome<Option<[[f64; 2]; 2]>> {
    let frames = sequence.frames;
    let mut session = engine.session::<Infallible>(sequence, &[Channel::Color])?;
    if !session.time_passes() {
        return Ok(None);
    }
    let (mut taken, mut price) = ([vec![], vec![]], [0.0; 2]);
    for k in 0..COST_FRAMES {
        session.forget();
        session.render::<Infallible>([(first + k) % frames], &mut |finished| {
            let plan = &finished.plan;
            price = [plan.ideal_price_ms, plan.price_ms - plan.ideal_price_ms];
            let by_host = [finished.times.ideal_ms, finished.times.reverse_ms];
            for ((times, name), by_host) in
                taken.iter_mut().zip(["ideal", "reverse"]).zip(by_host).filter(|_| k > 0)
            {
                times.extend(
                    finished
                        .times
                        .passes
                        .iter()
                        .filter(|pass| pass.name == name)
                        .map(|pass| pass.ms)
                        .chain(by_host),
                );
            }
            Ok(())
        })?;
    }
    Ok(Some([0, 1].map(|k: usize| [quartiles(&taken[k])[1], price[k]])))
}

/// How frame 40 is made.
fn plan_of(variant: &mut Variant<'_>) -> Outcome<FramePlan> {
    let mut found = None;
    variant.session.render::<Infallible>([40], &mut |finished| {
        found = Some(FramePlan::clone(&finished.plan));
        Ok(())
    })?;
    found.ok_or_else(|| "no frame".into())
}

/// Over the picture, by all causes, 1/255 of the linear range.
fn predicted_dn(plan: &FramePlan) -> f64 {
    let predicted = &plan.predicted;
    predicted
        .resampling_dn
        .hypot(predicted.blur_dn)
        .hypot(predicted.silhouettes.map_or(0.0, |silhouettes| silhouettes.error_dn))
}

fn in_view(plan: &FramePlan, variant: &Variant<'_>) -> u64 {
    let sequence = variant.session.planner().sequence();
    let tolerance = plan.model_tolerance(&sequence.scenario.quality);
    ModelLod::new(&sequence.scene, &SceneLods::new(&sequence.scene), &plan.ideal_pose(), &tolerance).meshes
}

/// The program itself, with and without files.
fn files(is_measuring: bool) -> Outcome<()> {
    let folder = tempfile::tempdir()?;
    let kinds: [(&str, &[&str]); 6] = [
        ("none", &["--format", "none"]),
        ("EXR, uncompressed", &["--format", "exr", "--set", "output.exr_compression=none"]),
        ("EXR, zip1 (default)", &["--format", "exr"]),
        ("EXR, piz", &["--format", "exr", "--set", "output.exr_compression=piz"]),
        ("PNG", &["--format", "png"]),
        (PRESET, &["--format", "none", "--set", "quality.preset=paper"]),
    ];
    let mut rates = vec![Vec::new(); kinds.len()];
    let mut peaks = vec![Vec::new(); kinds.len()];
    for round in 0..if is_measuring { FILE_ROUNDS } else { 1 } {
        for place in 0..kinds.len() {
            let i = (place + round) % kinds.len();
            let out = folder.path().join(i.to_string());
            let run = Command::new(env!("CARGO_BIN_EXE_camsim"))
                .args(["render".as_ref(), in_repository(ALL_EFFECTS).as_os_str()])
                .args(kinds[i].1)
                .args(["--frames", if is_measuring { FILE_FRAMES } else { "32" }, "--times", "-o"])
                .arg(&out)
                .output()?;
            let said = String::from_utf8_lossy(&run.stdout).into_owned();
            let number_before = |mark: &str| {
                said.split(mark)
                    .next()
                    .and_then(|before| before.split_whitespace().last()?.parse::<f64>().ok())
            };
            let rate = number_before(" frames/s")
                .ok_or_else(|| format!("no rate in: {said}{}", String::from_utf8_lossy(&run.stderr)))?;
            rates[i].push(rate);
            peaks[i].extend(number_before(" MB at most"));
            std::fs::remove_dir_all(&out)?;
        }
    }
    println!(
        "\nrounds    {} of frames {FILE_FRAMES}, one program after the other; medians, quartiles in brackets\n",
        rates[0].len()
    );
    println!("| files | frames/s | to none, in the same round | memory at most, MB |");
    println!("|---|---|---|---|");
    for ((name, _), (rate, peak)) in kinds.iter().zip(rates.iter().zip(&peaks)) {
        let [low, median, high] = quartiles(rate);
        println!(
            "| {name} | {median:.1} ({low:.1} .. {high:.1}) | {:.2} | {:.0} |",
            ratio(rate, &rates[0]),
            quartiles(peak)[1]
        );
    }
    if let Some(mb) = peak_memory_mb() {
        println!("\nmemory of this program, with the sessions of the tables above: {mb:.0} MB at most");
    }
    Ok(())
}

/// Times of all variants, and of each how many times as fast as the preset it is.
fn print_against(variants: &[Variant<'_>], head: &str) {
    let preset = variants.iter().find(|variant| variant.name.contains(PRESET));
    let base = if preset.is_some() { "preset" } else { "first" };
    println!(
        "| {head} | ms a frame | frames/s | to the first | processor ms a frame | to the first | times the {base}'s rate |"
    );
    println!("|---{}|---|---|---|---|---|---|", "|---".repeat(head.matches('|').count()));
    for variant in variants {
        let faster = ratio(&preset.unwrap_or(&variants[0]).ms, &variant.ms);
        println!("| {} | {} | {faster:.2} |", variant.name, times(variant, &variants[0]).join(" | "));
    }
}

fn effort(effort: Effort, is_measuring: bool) -> Effort {
    if is_measuring { effort } else { Effort::TRY }
}

const ALL_EFFECTS: &str = "benches/all_effects.toml";

fn in_repository(path: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The scenario with some keys set.
fn changed(sets: &[(&str, String)]) -> Outcome<Arc<Sequence>> {
    sequence_of(ALL_EFFECTS, sets)
}

fn sequence_of(path: &str, sets: &[(&str, String)]) -> Outcome<Arc<Sequence>> {
    let sets: Vec<(String, String)> =
        sets.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
    Ok(load_sequence(&read_scenario(&in_repository(path), &sets, None)?)?.sequence)
}

fn preset() -> Outcome<Arc<Sequence>> {
    changed(&[("quality.preset", "\"paper\"".to_owned())])
}

/// Frames in which paths are measured, and parts of each.
const PATH_FRAMES: [u64; 4] = [40, 56, 72, 88];
const PATH_PARTS: u8 = 12;

/// Length of the path that a pixel's source takes over the exposure, in pixels of the camera: where
/// renderings say that the source is at instants of it.
fn median_path_px(engine: &Engine, sequence: &Arc<Sequence>) -> Outcome<f64> {
    let mut session = engine.session::<Infallible>(sequence.clone(), &[Channel::Coords])?;
    let mut medians = Vec::new();
    for frame in PATH_FRAMES {
        let mut before: Option<Vec<[f32; COORDS_CHANNELS]>> = None;
        let mut paths = Vec::new();
        for part in 0..=PATH_PARTS {
            session.set_coords_phase(f32::from(part) / f32::from(PATH_PARTS) - 0.5);
            session.render::<Infallible>([frame], &mut |finished| {
                let now = finished.frame.coords.unwrap_or_default();
                let scale = finished.plan.ideal.focal_px.x / sequence.scenario.camera.focal_px[0];
                paths.resize(now.len(), 0.0);
                for ((path, now), before) in paths.iter_mut().zip(&now).zip(before.iter().flatten()) {
                    *path += f64::from((now[2] - before[2]).hypot(now[3] - before[3])) / scale;
                }
                before = Some(now);
                Ok(())
            })?;
        }
        medians.push(quartiles(&paths.into_iter().filter(|path| path.is_finite()).collect::<Vec<_>>())[1]);
    }
    Ok(quartiles(&medians)[1])
}
