//! Writes output folders: one folder per channel, one file per frame, each file completely or not at all.
//!
//! ```text
//! OUT/run.json                    version, adapter, resolved scenario, seed, counts
//! OUT/camera.toml                 the camera, as a camera file
//! OUT/inputs/vignette.png         copies of its files, unless they are in OUT already
//! OUT/trajectory.csv              motion of the platform
//! OUT/camera_trajectory.csv       motion of the camera, with mount and vibration
//! OUT/frames.csv                  stamp, pose, ideal frame and files of every written frame
//! OUT/sensors/imu0.csv            samples of the sensors beside the camera, with their truth
//! OUT/sensors/imu0.toml           what they are; imu0_kalibr.yaml is for Kalibr
//! OUT/points.csv                  tracked points, if asked for
//! OUT/tracks.csv                  where every written frame shows them
//! OUT/color/frame_000123.exr      R G B A, linear   (.png: in the encoding of camera.photometric.output)
//! OUT/color.mp4                   a video of all frames (.mkv, .y4m)
//! OUT/depth/frame_000123.exr      Z, metres, 0 = nothing
//! OUT/valid/frame_000123.png      255 where a ray exists, else 0
//! OUT/coords/frame_000123.exr     u v x y dt n e d; n e d is the direction where depth is 0 (sky)
//! OUT/rows/frame_000123.csv       time, pose and velocity of each row
//! OUT/raw/frame_000123.png        digital numbers of the image sensor   (.tiff, .exr)
//! OUT/sharp/...                   a twin of every frame: run.json, camera.toml, frames.csv and channels of its own
//! OUT/burst/color/frame_000123_7.png   a burst of each frame
//! ```
//!
//! Of a rig (`[[cameras]]`) each camera has such a folder:
//!
//! ```text
//! OUT/run.json                    the scenario with all cameras
//! OUT/rig.toml                    extrinsics, optics and times of all cameras
//! OUT/trajectory.csv              motion of the platform
//! OUT/left/...                    all of the above, of the camera `left`
//! ```
//!
//! Variations of a scenario with `[randomize]` have such a folder each, of one camera or of a rig:
//!
//! ```text
//! OUT/variations.csv              what each variation has drawn
//! OUT/variation_000017/...        all of the above
//! ```
//!
//! Paths in these files are relative to the file that holds them ([`crate::portable`]).
//!
//! `output.format` selects the formats of colour; the other channels have one format each. If it is empty, no
//! frame files are written.

use std::{io, path::PathBuf};

use thiserror::Error;

mod atomic;
mod channel_pictures;
#[cfg(test)]
mod channels_page;
mod encode;
mod exr_file;
mod frame_table;
mod frames;
mod lists;
mod picture;
mod png_file;
mod raw_picture;
mod rig;
mod sensors;
mod tables;
mod timing;
mod tracks;
mod variations;
mod video;

pub use crate::text::number::Number;
pub(crate) use crate::text::number::seconds;
pub use atomic::{is_special, open_special, write_atomic};
pub(crate) use atomic::{remove_all_temporaries, temporary_path, write_atomic_with};
pub use channel_pictures::channel_pictures;
pub use encode::srgb8;
pub(crate) use exr_file::encode as encode_exr;
pub use frame_table::{
    FRAMES_CSV, FrameRecord, FrameTable, SourceFrame, TableKind, frames_path, listed_frames,
};
pub use frames::{FrameFiles, FrameWriter, WriteSummary, unlisted_frame_files};
pub use picture::write_picture;
pub(crate) use png_file::encode as encode_png;
pub use png_file::{contact_sheet, palette_rgb8};
pub use rig::{RIG_TOML, rig_names, rig_toml, write_rig};
pub(crate) use sensors::{KalibrFigures, SensorFile, imu_yaml};
pub use sensors::{SENSORS_FOLDER, SensorSummary, kalibr_yaml, write_sensors};
pub(crate) use tables::ObjectRecord;
pub use tables::{OBJECTS_CSV, Stamped, TRAJECTORY_CSV, objects_csv, rows_csv, trajectory_csv};
pub(crate) use timing::TimingRecord;
pub use timing::{TIMING_CSV, timing_csv};
pub use tracks::{POINTS_CSV, TRACKS_CSV, TrackFiles, points_csv, tracks_rows};
pub(crate) use tracks::{PointRecord, TrackRecord};
pub use variations::{VARIATIONS_CSV, VariationsError, variation_folder, write_variations};
pub use video::{Y4mStream, has_ffmpeg};

/// Why a file was not written.
#[derive(Debug, Error)]
pub enum WriteError {
    /// The system reported an error.
    #[error("cannot write {}: {source}; {}", path.display(), advice(source))]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
    /// A file that is to be copied into the folder cannot be read.
    #[error("cannot copy {} beside camera.toml, which needs it: {source}", path.display())]
    Copy {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
    /// The encoder reported an error.
    #[error("cannot encode {}: {message}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// Message of the encoder.
        message: String,
    },
    /// A frame lacks a channel of the scenario, or a channel does not match its size.
    #[error("frame {frame} cannot be written: {message}")]
    Frame {
        /// Frame number.
        frame: u64,
        /// What is missing or does not match.
        message: String,
    },
    /// The writer threads ended without an error of their own.
    #[error("the writer threads ended early; run again")]
    Ended,
    /// The caller requested a stop.
    #[error("stopped on request; frames that are written stay as they are")]
    Stopped,
}

/// What to do about an error of the system.
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
