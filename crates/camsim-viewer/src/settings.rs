//! Settings stored between runs, beside egui's own memory of windows and panels.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::view::View;

/// Settings of the viewer.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Settings of the picture pane.
    pub view: View,
    /// Recently opened files, the latest first.
    pub recent: Vec<PathBuf>,
}
