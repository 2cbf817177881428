//! Files in, files out: scenarios, flight logs, calibrations, terrain, pictures; EXR, PNG, tables, manifests.
//!
//! Readers give plain data of `camsim-core`; every error names the file and, where there is one, the line or
//! the key, and says what to do.

#![warn(missing_docs)]

pub mod scenario_file;

pub mod camera_file;

pub mod frame_file;

pub mod flight_log;

pub mod terrain;

pub mod pictures;

pub mod board_file;

pub mod gltf_file;

pub mod load;

pub mod builtin;

pub mod write;

pub mod inputs;

pub mod portable;

pub mod manifest;

pub mod compare;

#[cfg(test)]
mod inputs_page;
