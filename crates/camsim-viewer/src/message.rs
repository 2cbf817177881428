//! What panes ask for. They draw from the state and change nothing of it themselves.

use std::path::PathBuf;

use camsim_core::scenario::CameraSpec;
use toml::Value;

use crate::{
    timeline::Timeline,
    view::{Tab, View},
};

/// A wish.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// To a frame.
    Seek(u64),
    /// So many frames on or back.
    Step(i64),
    /// Play, or stop.
    TogglePlay,
    /// Other settings of the timeline: speed, loop, whether it is dragged.
    Timeline(Timeline),
    /// Other settings of the picture pane.
    View(View),
    /// A page on the right.
    Tab(Tab),
    /// The pixel under the cursor, of the camera; `None` for none.
    Hover(Option<[u32; 2]>),
    /// Keeps the pixel in the inspector, or lets it go.
    Pin(Option<[u32; 2]>),
    /// Another value for a key; `None` leaves it out. `bool`: a hand still drags it.
    Set(String, Option<Value>, bool),
    /// What was asked for was not taken as it was.
    Refused(Refusal),
    /// The hand has let go.
    EndGesture,
    /// The value at opening.
    Reset(String),
    /// Another camera.
    Camera(Box<CameraSpec>),
    /// One step back.
    Undo,
    /// One step on.
    Redo,
    /// Opens a scenario; asks first if that loses changes.
    Open(PathBuf),
    /// The same, whatever it loses.
    OpenAnyway(PathBuf),
    /// The hand wants to close the window: asks first if that loses changes.
    Close,
    /// What was asked for stays undone.
    Stay,
    /// Something dropped on the window.
    Drop(PathBuf),
    /// Reads all files again.
    Reload,
    /// Saves under a name.
    Save(PathBuf),
    /// The scenario as TOML, to the clipboard.
    CopyToml,
    /// The command line that renders it, to the clipboard.
    CopyCommand,
    /// Renders frames to a folder.
    Export(ExportWish),
    /// Stops that.
    CancelExport,
    /// A notice has been read.
    Dismiss(usize),
    /// What a dropped picture is for: the key, or nothing.
    UsePicture(Option<&'static str>),
    /// The list of shortcuts.
    Help(bool),
    /// The desktop's own file dialog for what is asked.
    Browse,
    /// The window with the path to open or to save to; `None` closes it.
    Ask(Option<Question>),
}

impl Message {
    /// Whether it gives the scenario other values.
    pub fn edits_scenario(&self) -> bool {
        matches!(
            self,
            Self::Set(..)
                | Self::Reset(_)
                | Self::Camera(_)
                | Self::Undo
                | Self::Redo
                | Self::Open(_)
                | Self::OpenAnyway(_)
                | Self::Drop(_)
        )
    }

    /// Whether it sets something of the window alone.
    pub fn edits_window(&self) -> bool {
        matches!(self, Self::Seek(_) | Self::Step(_) | Self::Timeline(_) | Self::View(_))
    }
}

/// A value that was not taken as a hand gave it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// The key, with the place in its list, or another field's name.
    pub name: String,
    /// What was wrong, what is legal, and which value is in force.
    pub text: String,
}

impl Refusal {
    /// The name without a place in a list.
    pub fn key(&self) -> &str {
        self.name.split('[').next().unwrap_or(&self.name)
    }
}

/// What a path is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    /// Whether it is to be saved to, not opened.
    pub saves: bool,
    /// As typed so far.
    pub path: String,
}

/// Frames to render to files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportWish {
    /// Folder.
    pub folder: PathBuf,
    /// First frame, and the one after the last.
    pub frames: [u64; 2],
}

/// Wishes of one pass over all panes, in order.
pub type Outbox = Vec<Message>;
