//! Scenes of users, stage by stage; frame rates of `benches/all_effects.toml` by frame size, blur, effect and
//! file format; the cost of the houses of `benches/houses.toml`; and the planner's cost model beside measured
//! times. Each table has the cpu renderer, the gpu renderer and the paper's preset side by side, measured in
//! the same rounds.
//!
//! `cargo bench --bench sweep` makes all tables, `cargo bench --bench sweep -- blur files` these two (`scenes`,
//! `renderers`, `size`, `blur`, `effects`, `alike`, `features`, `passes`, `houses`, `costs`, `files`).
//! `CAMSIM_ADAPTER=part-of-a-name` picks the adapter.

#![allow(clippy::print_stdout, reason = "the tables are what this program is for")]

mod cameras;
mod features;
mod files;
#[path = "../flight/mod.rs"]
mod flight;
mod houses;
mod passes;
mod scenario;
mod scenes;
mod truth;

use flight::{Outcome, comparison::Renderers};

/// Prints a table; a single row with one frame unless the program measures.
type Table = fn(&Renderers, bool) -> Outcome<()>;

const TABLES: [(&str, Table); 12] = [
    ("scenes", scenes::scenes),
    ("truth", truth::truth),
    ("renderers", cameras::renderers),
    ("size", cameras::size),
    ("blur", cameras::blur),
    ("effects", cameras::effects),
    ("alike", cameras::alike),
    ("features", features::features),
    ("passes", passes::passes),
    ("houses", houses::houses),
    ("costs", passes::costs),
    ("files", files::files),
];

fn main() -> Outcome<()> {
    // Cargo passes `--bench`. Without it (`cargo test --benches`) the program only shows that it works.
    let (bench, names): (Vec<String>, Vec<String>) =
        std::env::args().skip(1).partition(|argument| argument == "--bench");
    let is_measuring = !bench.is_empty();
    if let Some(unknown) = names.iter().find(|name| !TABLES.iter().any(|(known, _)| known == name)) {
        let known = TABLES.map(|(name, _)| name).join(", ");
        return Err(format!("there is no table `{unknown}`: name some of {known}").into());
    }
    let renderers = Renderers::open()?;
    println!("{}", renderers.text());
    println!(
        "frames of {}, 640x480 unless a table says otherwise; read back, nothing encoded but for files",
        scenario::ALL_EFFECTS
    );
    for (name, table) in TABLES {
        if names.is_empty() || names.iter().any(|wanted| wanted == name) {
            println!("\n## {name}");
            table(&renderers, is_measuring)?;
        }
    }
    Ok(())
}
