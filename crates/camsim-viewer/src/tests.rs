//! The whole window, headless, against the real engine on a software adapter.

mod editing;
pub mod harness;
mod pages;
mod pictures;
mod scrubbing;
