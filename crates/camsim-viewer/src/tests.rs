//! Tests of the whole window, headless, with the real engine on a software adapter.

mod accessibility;
mod cameras;
mod dropped_files;
mod editing;
pub mod harness;
mod layout;
mod pages;
mod pane_snapshots;
mod pictures;
mod scrubbing;
mod sensor;
mod unsaved_changes;
mod value_ranges;
mod view3d;
mod wide;
