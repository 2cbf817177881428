//! Frames a second of the built-in flight: as a whole, and with each effect left out.
//!
//! A second table is of terrains of different sizes: the same ground seen straight down, so that only what is
//! out of sight differs. Sides are those of `CAMSIM_TERRAIN_SIDES` ("513 1025 4097"; 16385 takes 10 GB and
//! some minutes to make).
//!
//! `cargo bench --bench frames`; `CAMSIM_ADAPTER=part-of-a-name` picks the adapter.

#![allow(clippy::print_stdout, reason = "the table is what this program is for")]

use std::time::{Duration, Instant};

use camsim::{
    core::scenario::Channel,
    engine::{AdapterChoice, Engine},
};

mod flight;

use flight::{
    Outcome, Without,
    rounds::{Effort, Variant, measure, say_rounds, times},
};

/// As many frames as may share an ideal frame.
const EFFORT: Effort = Effort { burst: 8, rounds: 25, budget: Duration::from_secs(90) };
/// Pictures of larger sides are in tiles, where that is measured.
const SMALL_PICTURE_PX: u32 = 256;

fn main() -> Outcome<()> {
    // Cargo passes `--bench`; anything else that runs the program (`cargo test --benches`) only wants to know
    // whether it works.
    let measuring = std::env::args().any(|argument| argument == "--bench");
    let effort = if measuring { EFFORT } else { Effort::TRY };
    let loaded = flight::load()?;
    let demo = &loaded.sequence;
    let engine = Engine::new(AdapterChoice::Best)?;
    let [width, height] = demo.scenario.camera.size_px;
    println!("adapter   {}", engine);
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
        variants.push(Variant { still, ..Variant::open(name, &engine, without.of(demo)?, channels)? });
    }
    let plan = variants[0].session.planner().plan(0)?;
    let [ideal_width, ideal_height] = plan.ideal.size_px;
    println!(
        "ideal     {ideal_width}x{ideal_height} px in frame 0, {} exposure nodes",
        plan.blur.map_or(1, |blur| blur.nodes)
    );

    measure(&mut variants, demo.frames, effort)?;
    print_table(&variants, "the full camera", effort);
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
        for (engine, what) in [(&engine, "heights"), (&with_tiles, "heights, the picture in tiles")]
            .into_iter()
            .take(2 - sizes.len().min(1))
        {
            sizes.push(Variant::open(format!("{side} x {side} {what}"), engine, sequence.clone(), plain)?);
        }
    }
    measure(&mut sizes, demo.frames, effort)?;
    print_table(&sizes, "the first", effort);
    Ok(())
}

fn print_table(variants: &[Variant<'_>], first: &str, effort: Effort) {
    println!("{}", say_rounds(variants, effort));
    println!(
        "| variant | ms a frame | frames/s | to {first} | processor ms a frame | to {first} | start, s |"
    );
    println!("|---|---|---|---|---|---|---|");
    for variant in variants {
        println!(
            "| {} | {} | {:.2} |",
            variant.name,
            times(variant, &variants[0]).join(" | "),
            variant.start.as_secs_f64()
        );
    }
}
