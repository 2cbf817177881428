//! The whole window, headless, against the real engine on a software adapter.

mod drops;
mod editing;
pub mod harness;
mod leaving;
mod limits;
mod looks;
mod names;
mod pages;
mod pictures;
mod room;
mod scrubbing;
mod space;
