//! Work that a frame does not need.

use serde::Serialize;

/// Work that this frame does not need.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Skip {
    /// What is omitted.
    pub what: &'static str,
    /// Why nothing is lost.
    pub reason: String,
}
