//! File formats of camsim: reads scenarios, flight logs, cameras, terrain, models and pictures; writes
//! frames, tables and manifests.
//!
//! Readers return plain data of `camsim-core`. Every error names the file, the line or key if there is one,
//! and what to do.
//!
//! ```no_run
//! use camsim_io::{load::load_sequence, scenario_file::read_scenario};
//!
//! let scenario = read_scenario("scenario.toml".as_ref(), &[], None)?;
//! let loaded = load_sequence(&scenario)?;
//! println!("{} frames", loaded.sequence.frames);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | reads or writes |
//! |---|---|
//! | [`scenario_file`] | scenarios and camera files (TOML), `--set` |
//! | [`formats`] | calibrations of and for other programs; output folders in their layouts |
//! | [`flight_log`] | flight logs of all formats |
//! | [`raster`] | heights, ortho-images, textures, grey images |
//! | [`gltf_file`] | models |
//! | [`board_file`] | calibration boards |
//! | [`load`] | everything that a scenario names |
//! | [`lens_table`], [`kernel_file`] | files of a camera: lens tables, kernels of the point spread |
//! | [`frame_file`] | RGB-D frames for `camsim apply` |
//! | [`write`](mod@write) | frames and tables |
//! | [`columns`] | columns of the tables |
//! | [`manifest`] | `run.json`; resuming of runs |
//! | [`merge`](mod@merge) | joining of shards |
//! | [`inputs`] | fingerprints of input files |
//! | [`portable`] | relative paths in output folders |
//! | [`compare`] | comparison of pictures |
//! | [`shell`] | quotes words of commands |
//! | [`builtin`] | the built-in demo flight |

#![warn(missing_docs)]

pub mod board_file;
pub mod builtin;
pub mod columns;
pub mod compare;
pub mod flight_log;
pub mod formats;
pub mod frame_file;
pub mod gltf_file;
pub mod inputs;
pub mod kernel_file;
pub mod lens_table;
pub mod load;
pub mod manifest;
pub mod merge;
pub mod portable;
pub mod raster;
pub mod scenario_file;
pub mod shell;
pub mod write;

#[cfg(test)]
mod inputs_page;
mod median;
mod similar_file;
mod table;
mod text;
mod unlikely_camera;
