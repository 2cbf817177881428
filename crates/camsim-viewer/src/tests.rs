//! The whole window, headless, against the real engine on a software adapter.

pub mod harness;
mod pictures;
