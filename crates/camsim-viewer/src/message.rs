//! Messages from panes to the state. Panes draw from the state and do not change it.

use std::path::PathBuf;

use camsim_core::scenario::CameraSpec;
use toml::Value;

use crate::{
    timeline::Timeline,
    view::{Tab, View},
};

/// An action that a pane requests.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// Shows a frame.
    Seek(u64),
    /// Steps by a number of frames, forwards or backwards.
    Step(i64),
    /// Starts or stops play.
    TogglePlay,
    /// Changes settings of the timeline: speed, loop, whether it is dragged.
    Timeline(Timeline),
    /// Changes settings of the picture pane.
    View(View),
    /// Shows a page of the right panel.
    Tab(Tab),
    /// Sets the camera pixel under the cursor.
    Hover(Option<[u32; 2]>),
    /// Pins a pixel in the inspector, or unpins it.
    Pin(Option<[u32; 2]>),
    /// Sets a key to a value, or removes it (`None`). `true` while a drag is in progress.
    Set(String, Option<Value>, bool),
    /// Reports an input that was not accepted as given.
    InputRejected(RejectedInput),
    /// Ends a drag: later edits of the key are a new undo step.
    EndGesture,
    /// Resets a key to its value when the file was opened.
    Reset(String),
    /// Shows another camera of the rig, by its number.
    ShowCamera(usize),
    /// Replaces the camera.
    Camera(Box<CameraSpec>),
    /// Undoes one step.
    Undo,
    /// Redoes one step.
    Redo,
    /// Opens a scenario; asks first if unsaved changes would be lost.
    Open(PathBuf),
    /// Opens a scenario and discards unsaved changes.
    OpenDiscarding(PathBuf),
    /// Asks before the window closes with unsaved changes.
    Close,
    /// Cancels opening or closing, and keeps the changes.
    CancelLeaving,
    /// Opens or uses a file that was dropped on the window.
    Drop(PathBuf),
    /// Reads all files again.
    Reload,
    /// Saves the scenario to a file.
    Save(PathBuf),
    /// Copies the scenario as TOML to the clipboard.
    CopyToml,
    /// Copies the command line that renders the scenario to the clipboard.
    CopyCommand,
    /// Renders frames to a folder.
    Export(ExportRequest),
    /// Cancels the export.
    CancelExport,
    /// Dismisses a notice, by its index.
    Dismiss(usize),
    /// Uses the dropped picture for a key, or for nothing.
    UsePicture(Option<&'static str>),
    /// Shows or hides the list of shortcuts.
    ShowShortcuts(bool),
    /// Opens the desktop's file dialog for the path that is asked for.
    Browse,
    /// Shows the prompt for a path to open or to save to; `None` closes it.
    Prompt(Option<PathPrompt>),
}

impl Message {
    /// Whether the message may change values of the scenario.
    pub fn edits_scenario(&self) -> bool {
        matches!(
            self,
            Self::Set(..)
                | Self::Reset(_)
                | Self::Camera(_)
                | Self::Undo
                | Self::Redo
                | Self::Open(_)
                | Self::OpenDiscarding(_)
                | Self::Drop(_)
        )
    }

    /// Whether the message changes settings of the window only.
    pub fn edits_window(&self) -> bool {
        matches!(self, Self::Seek(_) | Self::Step(_) | Self::Timeline(_) | Self::View(_))
    }
}

/// An input that was not accepted as given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RejectedInput {
    /// The key, with an index in brackets for an element of a list, or the name of another field.
    pub name: String,
    /// What was wrong, the legal range, and the value in force.
    pub text: String,
}

impl RejectedInput {
    /// The name without an index.
    pub fn key(&self) -> &str {
        self.name.split('[').next().unwrap_or(&self.name)
    }
}

/// Prompt for a path.
#[derive(Clone, Debug, PartialEq)]
pub struct PathPrompt {
    /// Whether the path is to be saved to, not opened.
    pub saves: bool,
    /// Path typed so far.
    pub path: String,
}

/// Frames to render to files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportRequest {
    /// Output folder.
    pub folder: PathBuf,
    /// First frame, and the frame after the last.
    pub frames: [u64; 2],
}

/// Messages of one pass over all panes, in order.
pub type Outbox = Vec<Message>;
