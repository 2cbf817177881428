//! File formats of colour, and `[output.video]`.

use serde::{Deserialize, Serialize};

use super::keys::{Table, Words};

/// File formats of colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum ImageFormat {
    /// OpenEXR, linear, unquantised.
    Exr,
    /// PNG in the encoding of `camera.photometric.output`.
    Png,
    /// A video of all frames, encoded by ffmpeg.
    Mp4,
    /// As `mp4`, in a Matroska file.
    Mkv,
    /// An uncompressed video (YUV4MPEG2).
    Y4m,
}

impl ImageFormat {
    /// The formats that hold all frames in one file.
    pub const VIDEOS: [Self; 3] = [Self::Mp4, Self::Mkv, Self::Y4m];

    /// Whether one file holds all frames.
    #[must_use]
    pub fn is_video(self) -> bool {
        Self::VIDEOS.contains(&self)
    }

    /// Word in `output.format`, and ending of the files.
    #[must_use]
    pub fn ending(self) -> &'static str {
        match self {
            Self::Exr => "exr",
            Self::Png => "png",
            Self::Mp4 => "mp4",
            Self::Mkv => "mkv",
            Self::Y4m => "y4m",
        }
    }
}

/// File formats of raw pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum RawFormat {
    /// PNG of 16 bits.
    #[default]
    Png,
    /// TIFF of 16 bits.
    Tiff,
    /// OpenEXR with numbers of 32 bits.
    Exr,
}

impl RawFormat {
    /// Word in `output.raw_format`, and ending of the files.
    #[must_use]
    pub fn ending(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Tiff => "tiff",
            Self::Exr => "exr",
        }
    }
}

/// Encoding of videos.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct VideoSpec {
    /// Encoder of `mp4` and `mkv`.
    pub codec: VideoCodec,
    /// Bits of each code value, 8 or 10.
    #[key(default = 8, step = 0.1, only = [8, 10])]
    pub bits: u32,
    /// Constant rate factor of H.264 and H.265: 0 is best, 51 smallest.
    #[key(default = 18, step = 0.1, min = 0, max = VideoSpec::WORST_CRF, hint = "18 is the default")]
    pub crf: u32,
}

impl VideoSpec {
    /// Largest value of `crf`.
    pub const WORST_CRF: u32 = 51;
}

/// Encoders of videos.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum VideoCodec {
    /// H.264 by x264.
    #[default]
    H264,
    /// H.265 by x265.
    H265,
    /// FFV1, which loses nothing of the code values; in `mkv` only.
    Ffv1,
}
