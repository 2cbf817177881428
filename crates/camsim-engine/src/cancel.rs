//! Cancelling a frame.

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

/// Whether the frame in progress is not wanted any more.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cancel(pub Option<Arc<AtomicBool>>);

impl Cancel {
    pub fn is_set(&self) -> bool {
        self.0.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}
