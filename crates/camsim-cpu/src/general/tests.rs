#![allow(clippy::unwrap_used)]

//! The reverse pass against rays cast in f64, each at its own instant. Ideal frames are cast too. Stages are
//! compared with their twins in `camsim-engine/tests/stages`.

mod frames;
mod paper;
mod scenes;
mod silhouettes;
