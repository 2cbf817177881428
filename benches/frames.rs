//! Frames a second of the built-in flight: as a whole, and with each effect left out.
//!
//! A machine is never quite idle, so what is compared is measured in turn: each round renders the same few frames with every variant,
//! and a stage's cost is the median over the rounds of the difference to the full camera *in the same round*. A time a frame is that of
//! a burst, two frames in flight, divided by its frames: plan, poses, passes and read-back are in it, files are not. On Linux the time
//! that this program's threads had a processor stands beside it: with a software adapter that is the work itself, whatever else runs.
//!
//! A second table is of terrains of different sizes: the same ground seen straight down, so that only what is out of sight differs. Sides are
//! those of `CAMSIM_TERRAIN_SIDES` ("513 1025 4097"; 16385 takes 10 GB and some minutes to make).
//!
//! `cargo bench --bench frames`; `CAMSIM_ADAPTER=part-of-a-name` picks the adapter.

#![allow(clippy::print_stdout, reason = "the table is what this program is for")]

use std::{
    convert::Infallible,
    time::{Duration, Instant},
};

use camsim::{
    core::scenario::Channel,
    gpu::{AdapterChoice, Engine, engine::Session},
    lab::timing::{ms, processor_ms, quartiles},
};

mod flight;

use flight::{Outcome, Without};

/// Frames of a burst: as many as may share an ideal frame.
const BURST: u64 = 8;
/// Rounds, unless time runs out before.
const ROUNDS: usize = 25;
/// Pictures of larger sides are in tiles, where that is measured.
const SMALL_PICTURE_PX: u32 = 256;
/// No round begins after this.
const BUDGET: Duration = Duration::from_secs(90);

/// One row of the table.
struct Variant<'a> {
    name: String,
    session: Session<'a>,
    /// Renders one frame over and over: its ideal frame is drawn once and kept.
    still: bool,
    /// Session and first frame: upload, pipelines, lens map.
    start: Duration,
    /// Milliseconds a frame, one entry a round.
    ms: Vec<f64>,
    /// The same on processors, over all threads.
    processor_ms: Vec<f64>,
}

fn main() -> Outcome<()> {
    // Cargo passes `--bench`; anything else that runs the program (`cargo test --benches`) only wants to know whether it works.
    let measuring = std::env::args().any(|argument| argument == "--bench");
    let loaded = flight::load()?;
    let demo = &loaded.sequence;
    let engine = Engine::new(AdapterChoice::Best)?;
    let [width, height] = demo.scenario.camera.size_px;
    println!("adapter   {}", engine.gpu().adapter);
    println!("frames    {width}x{height} of the built-in flight, read back, nothing encoded");
    let plain = &demo.scenario.output.channels;
    let with_truth = [plain.as_slice(), &[Channel::Depth, Channel::Coords]].concat();
    let mut variants = Vec::new();
    for (name, without, channels, still) in [
        ("the full camera", Without::Nothing, plain, false),
        ("+ depth and coords", Without::Nothing, &with_truth, false),
        ("- ideal render (frame kept)", Without::Nothing, plain, true),
        ("- vignette and noise", Without::Photometric, plain, false),
        ("- motion blur", Without::Blur, plain, false),
        ("- rolling shutter", Without::RollingShutter, plain, false),
        ("- blur and rolling shutter", Without::Time, plain, false),
        ("- lens", Without::Lens, plain, false),
        ("- samples at silhouettes", Without::SilhouetteSamples, plain, false),
        ("- all of these: a perfect camera", Without::Anything, plain, false),
    ] {
        let begin = Instant::now();
        let mut session = engine.session::<Infallible>(without.of(demo)?, channels)?;
        // The first dispatch of a pipeline compiles it.
        render(&mut session, 0..2)?;
        variants.push(Variant { name: name.to_owned(), session, still, start: begin.elapsed(), ms: Vec::new(), processor_ms: Vec::new() });
    }
    let plan = variants[0].session.planner().plan(0)?;
    let [ideal_width, ideal_height] = plan.ideal.size_px;
    println!("ideal     {ideal_width}x{ideal_height} px in frame 0, {} exposure nodes", plan.blur.map_or(1, |blur| blur.nodes));

    measure(&mut variants, demo.frames, measuring)?;
    print_table(&variants, "the full camera");
    drop(variants);

    let sides = std::env::var("CAMSIM_TERRAIN_SIDES").unwrap_or("513 1025 4097".into());
    let mut with_tiles = Engine::new(AdapterChoice::Best)?;
    with_tiles.limit_pictures(SMALL_PICTURE_PX);
    let mut sizes = Vec::new();
    for side in sides.split_whitespace().take(if measuring { usize::MAX } else { 1 }) {
        let begin = Instant::now();
        let sequence = flight::ground::looking_down(demo, side.parse()?)?;
        println!("{side} x {side} heights: made in {:.1} s", begin.elapsed().as_secs_f64());
        // The smallest also with its picture in tiles.
        for (engine, what) in
            [(&engine, "heights"), (&with_tiles, "heights, the picture in tiles")].into_iter().take(2 - sizes.len().min(1))
        {
            let begin = Instant::now();
            let mut session = engine.session::<Infallible>(sequence.clone(), plain)?;
            render(&mut session, 0..2)?;
            let name = format!("{side} x {side} {what}");
            sizes.push(Variant { name, session, still: false, start: begin.elapsed(), ms: Vec::new(), processor_ms: Vec::new() });
        }
    }
    measure(&mut sizes, demo.frames, measuring)?;
    print_table(&sizes, "the first");
    Ok(())
}

/// Rounds in which each variant renders the same frames.
fn measure(variants: &mut [Variant<'_>], frames: u64, measuring: bool) -> Outcome<()> {
    let begin = Instant::now();
    for round in 0..if measuring { ROUNDS } else { 1 } {
        if begin.elapsed() > BUDGET {
            break;
        }
        let burst = if measuring { BURST } else { 1 };
        let first = (round as u64 * BURST) % (frames / BURST * BURST);
        // Each variant takes each place in the round once in a while.
        let count = variants.len();
        for place in 0..count {
            let variant = &mut variants[(place + round) % count];
            if variant.still {
                render(&mut variant.session, [first])?;
            } else {
                variant.session.forget();
            }
            let busy = processor_ms();
            let begin = Instant::now();
            render(&mut variant.session, (first..first + burst).map(|frame| if variant.still { first } else { frame }))?;
            variant.ms.push(ms(begin.elapsed()) / burst as f64);
            variant.processor_ms.extend(busy.zip(processor_ms()).map(|(before, after)| (after - before) / burst as f64));
        }
    }
    Ok(())
}

fn render(session: &mut Session<'_>, frames: impl IntoIterator<Item = u64>) -> Outcome<()> {
    Ok(session.render::<Infallible>(frames, &mut |finished| {
        std::hint::black_box(finished);
        Ok(())
    })?)
}

fn print_table(variants: &[Variant<'_>], first: &str) {
    let full = &variants[0];
    println!();
    println!("rounds    {} of {BURST} frames, variants in turn; medians, quartiles in brackets", full.ms.len());
    println!();
    println!("| variant | ms a frame | frames/s | to {first} | processor ms a frame | to {first} | start, s |");
    println!("|---|---|---|---|---|---|---|");
    for variant in variants {
        let rate = 1e3 / quartiles(&variant.ms)[1];
        let own = [(&variant.ms, &full.ms), (&variant.processor_ms, &full.processor_ms)];
        let [wall, processor] = own.map(|(own, full)| match own.is_empty() {
            true => "not known | ".to_owned(),
            false => {
                let [low, median, high] = quartiles(own);
                let [_, difference, _] = quartiles(&own.iter().zip(full).map(|(own, full)| own - full).collect::<Vec<_>>());
                format!("{median:.1} ({low:.1} .. {high:.1}) | {difference:+.1}")
            }
        });
        let (time, difference) = wall.split_once('|').unwrap_or_default();
        println!("| {} | {time}| {rate:.1} |{difference} | {processor} | {:.2} |", variant.name, variant.start.as_secs_f64());
    }
}
