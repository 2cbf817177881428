//! Run time against error, the short form of `camsim bench`: four cases at 320x240, times and errors in one
//! table.
//!
//! `cargo bench --bench pareto`; `CAMSIM_ADAPTER=part-of-a-name` picks the adapter. The whole table is
//! `camsim bench -o DIR`.

#![allow(clippy::print_stdout, reason = "the table is what this program is for")]

use camsim::{
    engine::{AdapterChoice, Engine},
    lab::bench::{BenchError, Options, Step, run},
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Cargo passes `--bench`; anything else that runs the program (`cargo test --benches`) only wants to know
    // whether it works.
    let measuring = std::env::args().any(|argument| argument == "--bench");
    let engine = Engine::new(AdapterChoice::Best)?;
    let cases = if measuring { Vec::new() } else { vec!["plane-30".to_owned()] };
    let report = run::<BenchError>(&engine, &Options { cases, quick: true }, &mut |step| {
        if let Step::Begins(what) = step {
            eprintln!("{what}");
        }
        Ok(())
    })?;
    println!("{}", report.markdown());
    println!("{}", report.summary());
    Ok(())
}
