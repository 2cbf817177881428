//! Files out. One folder a channel, one file a frame, each written whole or not at all:
//!
//! ```text
//! OUT/run.json                    version, adapter, resolved scenario, seed, counts
//! OUT/camera.toml                 the camera, as a camera file
//! OUT/inputs/vignette.png         copies of what it needs, where that was not in OUT before
//! OUT/trajectory.csv              the platform's motion
//! OUT/camera_trajectory.csv       the camera's, with mount and vibration
//! OUT/frames.csv                  stamp, pose, ideal frame and files of every frame that is written
//! OUT/color/frame_000123.exr      R G B A, linear   (.png: in the encoding of camera.photometric.output)
//! OUT/depth/frame_000123.exr      Z, metres, 0 = nothing
//! OUT/valid/frame_000123.png      255 where a ray exists, else 0
//! OUT/coords/frame_000123.exr     u v x y dt n e d; of the sky, whose depth is 0, n e d is its direction
//! OUT/rows/frame_000123.csv       time, pose and velocity of each row
//! ```
//!
//! Paths in these files are relative to the file that holds them ([`crate::portable`]).
//!
//! `output.format` chooses the formats of colour; the other channels have one each. An empty `format` writes
//! no frame files at all.

use std::{io, path::PathBuf};

use thiserror::Error;

mod atomic;
mod encode;
mod exr_file;
mod frame_table;
mod frames;
mod picture;
mod png_file;
mod tables;

pub use atomic::write_atomic;
pub use encode::{luminance, srgb_from_linear, srgb8};
pub use frame_table::{FRAMES_COLUMNS, FrameRecord, FrameTable, SourceFrame, frames_path};
pub use frames::{FrameFiles, FrameWriter, WriteSummary};
pub use picture::write_picture;
pub use png_file::contact_sheet;
pub use tables::{
    CAMERA_TRAJECTORY_COLUMNS, CameraRecord, ROWS_COLUMNS, TRAJECTORY_COLUMNS, TrajectoryRecord,
    camera_trajectory_csv, rows_csv, trajectory_csv,
};

/// Why a file was not written.
#[derive(Debug, Error)]
pub enum WriteError {
    /// The system refused.
    #[error("cannot write {}: {source}; {}", path.display(), advice(source))]
    Io {
        /// The file.
        path: PathBuf,
        /// Reason.
        source: io::Error,
    },
    /// A file that belongs into the folder cannot be read.
    #[error("cannot copy {} beside camera.toml, which needs it: {source}", path.display())]
    Copy {
        /// The file.
        path: PathBuf,
        /// Reason.
        source: io::Error,
    },
    /// The encoder refused.
    #[error("cannot encode {}: {message}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// The encoder's words.
        message: String,
    },
    /// A frame lacks what the scenario asks for, or its planes do not fill its size.
    #[error("frame {frame} cannot be written: {message}")]
    Frame {
        /// Frame number.
        frame: u64,
        /// What does not fit.
        message: String,
    },
    /// The threads are gone without an error of their own.
    #[error("the writer threads ended early; run again")]
    Ended,
    /// Somebody has asked for it.
    #[error("stopped on request; frames that are written stay as they are")]
    Stopped,
}

fn advice(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "make room on the disk and run again",
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "choose a folder that you may write to, with -o"
        }
        io::ErrorKind::NotADirectory | io::ErrorKind::AlreadyExists | io::ErrorKind::IsADirectory => {
            "something else has that name; choose another folder with -o"
        }
        _ => "check the path, then run again",
    }
}

#[cfg(test)]
mod tests;
