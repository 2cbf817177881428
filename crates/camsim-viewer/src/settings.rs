//! What is remembered from run to run, beside egui's own memory of windows and panels.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::view::View;

/// Settings of the viewer.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// How pictures are shown.
    pub view: View,
    /// Files opened lately, the last one first.
    pub recent: Vec<PathBuf>,
}
