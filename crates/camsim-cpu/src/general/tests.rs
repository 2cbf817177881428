#![allow(clippy::unwrap_used)]

//! The reverse pass against rays cast in f64, each at its own instant, and stage by stage against its twins.
//! Ideal frames are cast too.

mod frames;
mod paper;
mod scenes;
mod silhouettes;
mod stages;
