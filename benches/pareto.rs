//! Run time against error, the short form of `camsim bench`: four cases at 320x240 with every method, the
//! paper's preset among them. Main renderer is the cpu; the gpu is timed beside it in the same rounds.
//!
//! `cargo bench --bench pareto`; `CAMSIM_ADAPTER=part-of-a-name` picks the adapter. The long form is
//! `camsim bench -o DIR`.

#![allow(clippy::print_stdout, reason = "the table is what this program is for")]

use camsim::lab::bench::{BenchError, Compared, Options, Step, run};

mod flight;

use flight::{Outcome, comparison::Renderers};

fn main() -> Outcome<()> {
    // Cargo passes `--bench`. Without it (`cargo test --benches`) the program only shows that it works.
    let is_measuring = std::env::args().any(|argument| argument == "--bench");
    let renderers = Renderers::open()?;
    println!("{}\n", renderers.text());
    let compared = [Compared { name: "gpu", engine: renderers.gpu.as_ref() }];
    let cases = if is_measuring { Vec::new() } else { vec!["plane-30".to_owned()] };
    let options = Options { cases, quick: true, compared: &compared };
    let report = run::<BenchError>(&renderers.cpu, &options, &mut |step| {
        if let Step::Begins(name) = step {
            eprintln!("{name}");
        }
        Ok(())
    })?;
    println!("{}", report.markdown());
    println!("{}", report.summary());
    Ok(())
}
