//! Experiments with the whole of camsim: run time against error, and the experiments of the paper.
//!
//! ```no_run
//! use camsim_engine::Engine;
//! use camsim_lab::bench::{self, BenchError, Options};
//!
//! fn main() -> Result<(), BenchError> {
//!     let options = Options { quick: true, ..Options::default() };
//!     let report = bench::run::<BenchError>(&Engine::cpu(), &options, &mut |_| Ok(()))?;
//!     println!("{}", report.markdown());
//!     Ok(())
//! }
//! ```
//!
//! * [`bench`](mod@bench): every case with every method (`camsim bench`).
//! * [`cases`]: scenes and motions in memory.
//! * [`reproduce`]: the experiments of section 8 of the paper (`camsim reproduce`).
//! * [`plot`]: line plots as SVG.
//! * [`study`]: a command on the frames of many scenarios (`camsim study`).
//! * [`timing`]: processor time, memory, quantiles.

pub mod bench;
pub mod cases;
pub mod plot;
pub mod reproduce;
pub mod study;
pub mod timing;
