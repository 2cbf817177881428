//! Frame rates of the built-in flight: of the whole camera, and without each of its effects.
//!
//! A second table has terrains of different sizes seen straight down: the visible ground is the same, so only
//! what is out of sight differs. `CAMSIM_TERRAIN_SIDES` sets their sides ("513 1025 4097"; 16385 takes 10 GB
//! of memory and some minutes to make).
//!
//! Each table has the cpu renderer, the gpu renderer and the paper's preset side by side, measured in the
//! same rounds. `cargo bench --bench frames`; `CAMSIM_ADAPTER=part-of-a-name` picks the adapter.

#![allow(clippy::print_stdout, reason = "the tables are what this program is for")]

use std::time::{Duration, Instant};

use camsim::{
    core::{scenario::Channel, sequence::Sequence},
    engine::{Backend, Engine},
};

mod flight;

use flight::{
    Ablation, Outcome,
    comparison::{Comparison, MS_TO_FIRST, PROCESSOR_MS, Renderers, START_S, TIMES_PRESET},
    rounds::RoundLimits,
    with_paper_preset,
};

/// A burst has as many frames as may share an ideal frame.
const LIMITS: RoundLimits = RoundLimits { burst: 8, rounds: 15, budget: Duration::from_secs(90) };
/// Side above which textures are tiled, in the row that measures tiles.
const MAX_PICTURE_PX: u32 = 256;

fn main() -> Outcome<()> {
    // Cargo passes `--bench`. Without it (`cargo test --benches`) the program only shows that it works.
    let is_measuring = std::env::args().any(|argument| argument == "--bench");
    let loaded = flight::load()?;
    let demo = &loaded.sequence;
    let renderers = Renderers::open()?;
    let [width, height] = demo.scenario.camera.size_px;
    println!("{}", renderers.text());
    println!("frames    {width}x{height} of the built-in flight, read back, nothing encoded");
    effects(&renderers, demo, is_measuring)?;
    terrain_sizes(&renderers, demo, is_measuring)
}

/// The whole camera, and without each of its effects.
fn effects(renderers: &Renderers, demo: &Sequence, is_measuring: bool) -> Outcome<()> {
    let color = &demo.scenario.output.channels;
    let with_truth = [color.as_slice(), &[Channel::Depth, Channel::Coords]].concat();
    let rows = [
        ("the full camera", Ablation::None, color, false),
        ("+ depth and coords", Ablation::None, &with_truth, false),
        ("- ideal frame (drawn once)", Ablation::None, color, true),
        ("- vignette and noise", Ablation::Photometric, color, false),
        ("- motion blur", Ablation::Blur, color, false),
        ("- rolling shutter", Ablation::RollingShutter, color, false),
        ("- blur and rolling shutter", Ablation::Time, color, false),
        ("- lens", Ablation::Lens, color, false),
        ("- silhouette rays", Ablation::SilhouetteRays, color, false),
        ("- all of these: a perfect camera", Ablation::All, color, false),
    ];
    let mut table = Comparison::new(renderers);
    for (i, (name, ablation, channels, is_still)) in rows.into_iter().enumerate() {
        table.add(name, &ablation.apply(demo)?, channels, is_still)?;
        if i == 0 {
            table.add_preset(None, &with_paper_preset(demo), color)?;
        }
    }
    if let Some(variant) = table.variant(0, 0) {
        let plan = variant.session.planner().plan(0)?;
        let [width, height] = plan.ideal.size_px;
        let nodes = plan.blur.map_or(1, |blur| blur.nodes);
        println!("ideal     {width}x{height} px in frame 0, {nodes} exposure nodes");
    }
    let limits = LIMITS.or_smoke_test(is_measuring);
    table.measure(demo.frames, limits)?;
    table.print("variant", limits, &[MS_TO_FIRST, TIMES_PRESET, PROCESSOR_MS, START_S]);
    Ok(())
}

/// Terrains of different sizes; on the gpu the smallest also with its texture in tiles.
fn terrain_sizes(renderers: &Renderers, demo: &Sequence, is_measuring: bool) -> Outcome<()> {
    let color = &demo.scenario.output.channels;
    let sides = std::env::var("CAMSIM_TERRAIN_SIDES").unwrap_or("513 1025 4097".into());
    let tiling_engine = match renderers.gpu {
        Some(_) => {
            let mut engine = Engine::open(Backend::Gpu)?;
            engine.limit_pictures(MAX_PICTURE_PX);
            Some(engine)
        }
        None => None,
    };
    let mut table = Comparison::new(renderers);
    println!();
    for (i, side) in sides.split_whitespace().take(if is_measuring { usize::MAX } else { 1 }).enumerate() {
        let begin = Instant::now();
        let sequence = flight::ground::looking_down(demo, side.parse()?)?;
        println!("{side} x {side} heights: made in {:.1} s", begin.elapsed().as_secs_f64());
        table.add(format!("{side} x {side} heights"), &sequence, color, false)?;
        if i == 0 {
            table.add_preset(None, &with_paper_preset(&sequence), color)?;
            let name = format!("{side} x {side} heights, the texture in tiles");
            table.add_on([None, tiling_engine.as_ref()], name, &sequence, color, false)?;
        }
    }
    let limits = LIMITS.or_smoke_test(is_measuring);
    table.measure(demo.frames, limits)?;
    table.print("terrain", limits, &[MS_TO_FIRST, TIMES_PRESET, PROCESSOR_MS, START_S]);
    Ok(())
}
