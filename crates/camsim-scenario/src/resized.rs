//! `[camera.resized]`: a camera that delivers a part of the calibrated picture, or that picture at another size.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::{MAX_SIDE_PX, keys::Table};

/// Part and scale of the picture that the camera delivers; the other keys follow (docs/guide/CAMERA_FILES.md).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct ResizedSpec {
    /// Part of the calibrated picture: left, top, width, height, in its pixels. Omitted: all of it.
    #[key(
        unit = "px",
        min = 0,
        max = MAX_SIDE_PX,
        hint = "give [left, top, width, height]",
        example = "[64, 48, 512, 384]",
        names = "left top width height"
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crop_px: Option<[u32; 4]>,
    /// Pixels across and down that make one: a number, or one of each. Those that are left over on the right
    /// and below are not used. Omitted: one pixel stays one.
    #[key(step = 0.05, min = 1, max = MAX_SIDE_PX, hint = "2 makes one of 2 x 2", example = "2")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub binning: Option<Binning>,
    /// Factor on width and height, which are rounded, instead of `binning`. Omitted: no change.
    #[key(step = 0.005, above = 0.0, max = MAX_SIDE_PX, hint = "0.5 halves both", example = "0.5")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// Width and height of the delivered picture, instead of `binning` and `scale`. Omitted: by these.
    #[key(
        unit = "px",
        min = 1,
        max = MAX_SIDE_PX,
        hint = "give [width, height]",
        example = "[320, 240]",
        names = "W H"
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_px: Option<[u32; 2]>,
}

/// Numbers of pixels that make one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Binning {
    /// Across and down.
    Both(f64),
    /// Across, and down.
    Each([f64; 2]),
}

/// Picture that the files of `lens_table` and `vignette` are of, where a resized camera was written.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct FilesOfSpec {
    /// Width and height of the picture that the files are of.
    #[key(
        required,
        unit = "px",
        min = 1,
        hint = "give [width, height]",
        example = "[640, 480]",
        names = "W H"
    )]
    pub size_px: [u32; 2],
    /// Focal lengths in that picture.
    #[key(
        required,
        unit = "px",
        step = 0.5,
        above = 0.0,
        hint = "a 60 degree lens on 640 px has about 554",
        example = "[500.0, 500.0]",
        names = "fx fy"
    )]
    pub focal_px: [f64; 2],
    /// Principal point in that picture.
    #[key(required, unit = "px", step = 0.05, example = "[319.5, 239.5]", names = "cx cy")]
    pub principal_point_px: [f64; 2],
    /// The camera's picture in that of the files: left, top, width, height, in its pixels.
    #[key(
        required,
        unit = "px",
        min = 0.0,
        hint = "give [left, top, width, height]",
        example = "[64.0, 48.0, 512.0, 384.0]",
        names = "left top width height"
    )]
    pub part_px: [f64; 4],
}

/// What of a resized camera cannot be told from its keys.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MadeOf {
    /// Whether it has a part of a picture, so that its axis may be anywhere.
    pub is_part: bool,
    /// Factor across over that down: pixels that were square have this ratio of focal lengths.
    pub squeeze: f64,
    /// By how much its rows are later than the same rows of the whole picture, milliseconds: the centre of a
    /// part takes the time that the centre of the whole picture had.
    pub rows_later_ms: f64,
}

impl Default for MadeOf {
    fn default() -> Self {
        Self { is_part: false, squeeze: 1.0, rows_later_ms: 0.0 }
    }
}

impl FilesOfSpec {
    /// The point of its picture that a point of the camera's picture, of this size, is.
    #[must_use]
    pub fn point(&self, at: DVec2, size_px: [u32; 2]) -> DVec2 {
        let [left, top, width, height] = self.part_px;
        let size = DVec2::from(size_px.map(f64::from));
        (at + 0.5) * DVec2::new(width, height) / size + DVec2::new(left, top) - 0.5
    }
}
