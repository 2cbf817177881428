//! FRAME.toml: an ideal RGB-D frame of another program, and the motion of its camera, for `camsim apply`.
//!
//! ```toml
//! color = "ideal.png"                # EXR (linear), PNG, JPEG, BMP, TIFF, WebP; alpha is not read
//! color_space = "srgb"               # or "linear"; default linear for EXR, else srgb; float TIFF needs it
//! color_channels = ["R", "G", "B"]   # of an EXR, or one name (grey): whole names, or the ends of names
//! color_layer = "ViewLayer.Combined" # layer of an EXR that has these channels
//! depth = "depth.exr"                # metres: EXR Z, PFM, TIFF or .npy of floats; with depth_per_metre also
//!                                    # 16-bit PNG, PGM, TIFF or .npy; or packed bytes
//! depth_channel = "Depth.Z"          # of an EXR; depth_layer as color_layer
//! depth_encoding = "plain"           # "packed24": z = 65025 R/255 + 255 G/255 + B/255 (bytes);
//!                                    # "carla": z = 1000 (R + 256 G + 65536 B) / (256^3 - 1)
//! depth_per_metre = 1000.0           # stored value of one metre, 0.001 to 1e6; default 1 for floats
//! depth_rows = "bottom-up"           # row order of a PFM; "top-down" as AirSim writes it
//! depth_kind = "planar"              # along the optical axis; "range": along the ray;
//!                                    # "inverse": depth_per_metre / z
//! depth_max_m = 1e9                  # values at or above this are no depth but the sky
//! holes = "far"                      # pixels without depth: "far", "nearest" (depth of the nearest pixel
//!                                    # with depth) or "mark" (invalid)
//! focal_px = [307.6, 307.6]          # of the ideal frame, which may be larger than the output
//! principal_point_px = [543.5, 407.5]  # default: the centre; of an EXR, of the display window
//! instant_ms = 0.0                   # when it was taken, from the stamp t_i
//! [motion]                           # a twist about the frame's instant, in camera axes ...
//! velocity_m_s = [0.0, 0.0, 0.0]
//! angular_rate_rad_s = [0.0, 0.0, 0.628]
//! # trajectory = "poses.csv"         # ... or poses t_s,x,y,z,qw,qx,qy,qz (world_from_camera);
//!                                    #     other units by name: t_ms, x_mm
//! # trajectory_format = "csv"        #     or "tum": t x y z qx qy qz qw, or the order that a comment names
//! # stamp_s = 12.5                   #     and the stamp of the frame on their clock
//! # flow = "flow.flo"              # ... or the optical flow: Middlebury .flo, EXR or .npy
//! # flow_channels = ["X", "Y"]     #     of an EXR with more than two: right and down
//! # flow_scale = [1.0, 1.0]        #     factors that convert to pixels; [1.0, -1.0] where y is up
//! # flow_interval_ms = 33.3        #     time over which it is measured; negative for backward flow
//! # [fog]                            # preset "paper" only: linear fog, added after the blur
//! # end_m = 12000.0
//! # color = [0.5, 0.6, 0.7]          # stored values
//! ```
//!
//! [`list`] documents how one file names many frames.
//!
//! Depth that is 0, negative, infinite, not a number, or at least `depth_max_m` is **unknown or sky**. It is
//! taken as infinitely far, so that it moves with the rotation only. With `holes = "nearest"` it is that of
//! the nearest pixel with depth (for the shadows of depth cameras; not for pictures with sky). With `holes =
//! "mark"` output pixels that see it are invalid. A picture of zeros and infinities only may be sky. One
//! without any possible depth (negative, not a number, below a micrometre) is refused: its sign or unit is
//! wrong.
//!
//! A twist is constant **in the camera's own axes**, a screw motion: the velocity turns with the camera. With
//! velocity v perpendicular to rate w the camera flies a circle of radius |v|/|w|. A camera that rotates on a
//! straight path needs a trajectory.

use std::path::{Path, PathBuf};

use camsim_core::{
    apply::{IdealFrame, Motion, PoseTrackError, paper::LinearFog},
    temporal::IdealGeometry,
};
use glam::{DVec2, DVec3};
use serde::Deserialize;
use thiserror::Error;

use crate::scenario_file::{ScenarioError, check, deserialize, tree::Tree};

pub(crate) mod columns;
mod depth;
pub(crate) mod exr_planes;
mod floats;
mod flow;
mod images;
pub mod list;
mod npy;
mod packed;
mod png_chunks;
mod poses;
mod schema;
mod set;
#[cfg(test)]
mod treatments;

pub use set::{FrameSet, read_frame_set};

/// Why a frame file cannot be used.
#[derive(Debug, Error)]
pub enum FrameFileError {
    /// FRAME.toml cannot be read or parsed, or has wrong keys or types.
    #[error(transparent)]
    File(#[from] ScenarioError),
    /// A value of FRAME.toml contradicts others, or a file.
    #[error("{}: {key}: {message}", path.display())]
    Key {
        /// Path of FRAME.toml.
        path: PathBuf,
        /// The key.
        key: &'static str,
        /// What is wrong and what to do.
        message: String,
    },
    /// A picture cannot be used.
    #[error("{}: {message}", path.display())]
    Picture {
        /// The picture.
        path: PathBuf,
        /// What is wrong and what to do.
        message: String,
    },
    /// A table of poses or of frames cannot be read.
    #[error("{}{}: {message}", path.display(), line.map_or(String::new(), |line| format!(":{line}")))]
    Poses {
        /// The table.
        path: PathBuf,
        /// Line, from 1, where known.
        line: Option<u64>,
        /// What is wrong and what to do.
        message: String,
    },
    /// The poses of a table make no trajectory.
    #[error("{}: {source}", path.display())]
    Track {
        /// The table.
        path: PathBuf,
        /// What is wrong and what to do.
        source: PoseTrackError,
    },
}

/// The keys of FRAME.toml, with resolved paths.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct FrameSpec {
    frames: Option<PathBuf>,
    name_unit: Option<NameUnit>,
    fps: Option<f64>,
    max_gap_ms: Option<f64>,
    color: Option<PathBuf>,
    color_space: Option<ColorSpace>,
    color_channels: Option<Vec<String>>,
    color_layer: Option<String>,
    depth: Option<PathBuf>,
    depth_channel: Option<String>,
    depth_layer: Option<String>,
    #[serde(default)]
    depth_encoding: DepthEncoding,
    depth_per_metre: Option<f64>,
    depth_rows: Option<DepthRows>,
    depth_max_m: Option<f64>,
    #[serde(default)]
    depth_kind: DepthKind,
    #[serde(default)]
    holes: Holes,
    focal_px: [f64; 2],
    principal_point_px: Option<[f64; 2]>,
    #[serde(default)]
    instant_ms: f64,
    #[serde(default)]
    motion: MotionSpec,
    fog: Option<FogSpec>,
}

#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct MotionSpec {
    velocity_m_s: Option<[f64; 3]>,
    angular_rate_rad_s: Option<[f64; 3]>,
    trajectory: Option<PathBuf>,
    #[serde(default)]
    trajectory_format: TrajectoryFormat,
    stamp_s: Option<f64>,
    flow: Option<PathBuf>,
    flow_channels: Option<Vec<String>>,
    flow_scale: Option<[f64; 2]>,
    flow_interval_ms: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct FogSpec {
    end_m: f64,
    color: [f64; 3],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum ColorSpace {
    Srgb,
    Linear,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum DepthEncoding {
    #[default]
    Plain,
    Packed24,
    Carla,
}

/// Row order of a PFM file. The format defines bottom-up, but some programs write top-down.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum DepthRows {
    TopDown,
    BottomUp,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum DepthKind {
    #[default]
    Planar,
    Range,
    Inverse,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Holes {
    #[default]
    Far,
    Nearest,
    Mark,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum TrajectoryFormat {
    #[default]
    Csv,
    Tum,
}

/// Unit of the times in file names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum NameUnit {
    S,
    Ms,
    Us,
    Ns,
}

impl FrameSpec {
    /// The first key given that selects colour channels of an EXR.
    fn color_key(&self) -> Option<&'static str> {
        self.color_channels
            .as_ref()
            .map(|_| "color_channels")
            .or(self.color_layer.as_ref().map(|_| "color_layer"))
    }

    /// The first key given that selects the depth channel of an EXR.
    fn depth_key(&self) -> Option<&'static str> {
        self.depth_channel
            .as_ref()
            .map(|_| "depth_channel")
            .or(self.depth_layer.as_ref().map(|_| "depth_layer"))
    }
}

/// A frame with its pictures and its motion.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameFile {
    /// The ideal frame.
    pub frame: IdealFrame,
    /// Motion of its camera.
    pub motion: Motion,
    /// Fog, for the paper preset.
    pub fog: Option<LinearFog>,
    /// Fraction of the pixels whose depth is unknown or sky.
    pub without_depth: f64,
    /// Notes about what is not applied, or is unusual.
    pub notes: Vec<String>,
}

/// Reads a frame file of one frame, its pictures and its poses.
///
/// # Errors
/// [`FrameFileError`] names the file, the key where there is one, and what to do.
pub fn read_frame(path: &Path) -> Result<FrameFile, FrameFileError> {
    read_frame_set(path)?.read(0)
}

/// Reads FRAME.toml and checks each value by itself.
fn read_spec(path: &Path) -> Result<FrameSpec, FrameFileError> {
    let mut tree = Tree::read(path, "")?;
    let problems = check::check(&mut tree, &schema::FRAME, "");
    if !problems.is_empty() {
        return Err(ScenarioError::Problems(problems).into());
    }
    let spec: FrameSpec = deserialize(&tree)?;
    let fail =
        |key, message: &str| Err(FrameFileError::Key { path: path.into(), key, message: message.to_owned() });
    if !spec.focal_px.iter().all(|f| f.is_finite() && *f > 0.0) {
        return fail(
            "focal_px",
            "must be [fx, fy], both finite and above 0; for a mirrored axis flip the pictures instead",
        );
    }
    if !spec.instant_ms.is_finite() {
        return fail("instant_ms", "must be a finite number of milliseconds; 0 is the stamp");
    }
    if spec.depth_max_m.is_some_and(|max| max.is_nan() || max <= 0.0) {
        return fail(
            "depth_max_m",
            "must be above 0, in metres: what is stored as that far, or farther, is no depth",
        );
    }
    if spec.principal_point_px.is_some_and(|centre| centre.iter().any(|v| !v.is_finite())) {
        return fail(
            "principal_point_px",
            "must be two finite numbers; leave the key out for the picture's centre",
        );
    }
    if spec.color_channels.as_ref().is_some_and(|names| !matches!(names.len(), 1 | 3)) {
        return fail("color_channels", "must be one name (grey) or three (red, green, blue)");
    }
    Ok(spec)
}

/// Position of the first pixel of an EXR in the pixels of its display window; `None` for other formats.
type Origin = Option<[i32; 2]>;

/// Reads the pictures of one frame.
// Long because depth, holes and fog depend on colour and motion.
fn read_pictures(
    spec: &FrameSpec,
    color: &Path,
    depth: Option<&Path>,
    motion: Motion,
    path: &Path,
) -> Result<(FrameFile, Origin), FrameFileError> {
    let fail =
        |key, message: &str| FrameFileError::Key { path: path.into(), key, message: message.to_owned() };
    let color = images::read_color(color, spec, path)?;
    let size_px @ [width, height] = color.size_px;
    let principal_px = DVec2::from_array(spec.principal_point_px.unwrap_or(color.centre_px));
    let geometry = IdealGeometry { size_px, focal_px: DVec2::from_array(spec.focal_px), principal_px };
    let mut notes = color.notes;
    let mut inverse_depth = match depth {
        Some(depth) => {
            let depth::Depth { inverse, notes: depth_notes } =
                depth::read_depth(depth, spec, &geometry, color.origin_px, path)?;
            notes.extend(depth_notes.into_iter().filter(|note| !notes.contains(note)).collect::<Vec<_>>());
            inverse
        }
        None if motion.translates() => {
            return Err(fail(
                "depth",
                "is missing, and the camera moves: without depth nothing says by how much surfaces shift; \
                    add it, or leave only the rotation",
            ));
        }
        None => vec![0.0; (width * height) as usize],
    };
    let fog = match spec.fog {
        Some(FogSpec { end_m, color })
            if end_m.is_finite() && end_m > 0.0 && color.iter().all(|v| (0.0..=1.0).contains(v)) =>
        {
            Some(LinearFog { end_m, color: DVec3::from_array(color) })
        }
        Some(_) => {
            return Err(fail(
                "fog",
                "needs end_m above 0 in metres and color = [r, g, b] in 0..1 (stored values)",
            ));
        }
        None => None,
    };
    let without_depth =
        inverse_depth.iter().filter(|w| **w == 0.0).count() as f64 / inverse_depth.len() as f64;
    let mut holes = Vec::new();
    match spec.holes {
        Holes::Far => {}
        Holes::Nearest => depth::fill_holes(&mut inverse_depth, size_px),
        // Without a depth picture the camera only rotates, and no depth is missing.
        Holes::Mark if depth.is_some() => holes = inverse_depth.iter().map(|w| *w == 0.0).collect(),
        Holes::Mark => {}
    }
    let frame = IdealFrame {
        geometry,
        color_rgba: color.rgba,
        inverse_depth,
        holes,
        instant_s: 1e-3 * spec.instant_ms,
    };
    Ok((FrameFile { frame, motion, fog, without_depth, notes }, color.origin_px))
}

#[cfg(test)]
mod tests;
