//! `[output]`: channels and file formats.

use serde::{Deserialize, Serialize};

use super::{
    Channel, DatasetFormat, FlowInstant, ImageFormat, RawFormat, TracksSpec, TwinSpec, VideoSpec,
    keys::{Table, Words},
};

/// Channels and file formats.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct OutputSpec {
    /// Channels written for each frame.
    #[key(default = vec![Channel::Color])]
    pub channels: Vec<Channel>,
    /// File formats of colour. With none, frames are rendered and read back, but not encoded.
    #[key(default = vec![ImageFormat::Exr])]
    pub format: Vec<ImageFormat>,
    /// Clock of all written stamps.
    pub stamps: Stamps,
    /// Time of the written clock at the begin of the window, with `stamps = "zero"`.
    #[key(unit = "ns")]
    pub epoch_ns: u64,
    /// Time that `trajectory.csv` and `camera_trajectory.csv` cover.
    #[serde(skip_serializing_if = "crate::is_default")]
    pub trajectory: TrajectorySpan,
    /// Pixel type of EXR colour.
    pub exr_pixel: ExrPixel,
    /// Compression of EXR files.
    pub exr_compression: ExrCompression,
    /// File format of the channel `raw`.
    #[serde(skip_serializing_if = "crate::is_default")]
    pub raw_format: RawFormat,
    /// Encoding of `mp4` and `mkv`, by ffmpeg.
    #[serde(skip_serializing_if = "crate::is_default")]
    pub video: VideoSpec,
    /// Frames from one to the other of `flow` and `flow_back`.
    #[key(
        default = 1,
        unit = "frames",
        step = 0.1,
        min = 1,
        hint = "flow leads from frame i to frame i + flow_step"
    )]
    pub flow_step: u32,
    /// Instant of the picture that `flow_global` leads to.
    pub flow_instant: FlowInstant,
    /// Pictures of `object` and `class` in colour, in `object_palette` and `class_palette`.
    #[serde(skip_serializing_if = "crate::is_default")]
    pub palette: bool,
    /// Points whose pixel `tracks.csv` has for every frame that sees them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tracks: Option<TracksSpec>,
    /// The same frames by a better camera, each twin in a folder of its own.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub twin: Vec<TwinSpec>,
    /// Layouts of other programs, made of the frames at the end of a run. Each has a folder of its own in
    /// `datasets`.
    #[key(example = "[\"euroc\", \"mcap\"]")]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub datasets: Vec<DatasetFormat>,
}

/// Clocks of stamps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum Stamps {
    /// The clock of the log.
    #[default]
    Log,
    /// A clock that shows `output.epoch_ns` at the begin of `flight.window_s`.
    Zero,
}

/// Time that `trajectory.csv` and `camera_trajectory.csv` cover.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum TrajectorySpan {
    /// That of the frames in the folder; with sensors beside the camera, that of the flight.
    #[default]
    Frames,
    /// All of `flight.window_s`.
    Flight,
}

impl OutputSpec {
    /// Channels of the frames and of their twins, some of them twice.
    pub fn all_channels(&self) -> impl Iterator<Item = Channel> {
        self.channels
            .iter()
            .chain(self.twin.iter().filter_map(|twin| twin.channels.as_ref()).flatten())
            .copied()
    }

    /// Time of the written clock at path time 0, nanoseconds. The log's clock shows `log_epoch_ns` there, and
    /// the window begins at `start_s` of path time.
    #[must_use]
    pub fn stamp_epoch_ns(&self, log_epoch_ns: i64, start_s: f64) -> i64 {
        match self.stamps {
            Stamps::Log => log_epoch_ns,
            Stamps::Zero => i64::try_from(self.epoch_ns)
                .unwrap_or(i64::MAX)
                .saturating_sub((start_s * 1e9).round() as i64),
        }
    }
}

/// Pixel type of EXR colour channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum ExrPixel {
    /// 16 bit floating point.
    #[default]
    Half,
    /// 32 bit floating point.
    Float,
}

/// EXR compression methods.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum ExrCompression {
    /// Uncompressed.
    None,
    /// Run-length encoding.
    Rle,
    /// Deflate, one row per block.
    #[default]
    Zip1,
    /// Deflate, 16 rows per block.
    Zip16,
    /// Wavelet.
    Piz,
}
