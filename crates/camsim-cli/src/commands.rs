//! One file per command, with its arguments, its help and `run`.

pub mod apply;
#[cfg(feature = "lab")]
pub mod bench;
pub mod board;
pub mod camera;
pub mod cluster;
pub mod compare;
pub mod completions;
pub mod demo;
pub mod explain;
pub mod export;
pub mod info;
pub mod lens;
pub mod man;
pub mod merge;
pub mod new;
pub mod render;
#[cfg(feature = "lab")]
pub mod reproduce;
pub mod schema;
#[cfg(feature = "lab")]
pub mod study;
pub mod track;
pub mod verify;
#[cfg(feature = "viewer")]
pub mod viewer;
