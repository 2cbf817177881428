//! FRAME.toml: somebody else's ideal RGB-D frame and how its camera moved, for `camsim apply`.
//!
//! ```toml
//! color = "ideal.png"                # EXR (linear), PNG, JPEG, BMP, TIFF, WebP; alpha is not read
//! color_space = "srgb"               # or "linear"; default: srgb, but linear for EXR; TIFF of floats must say
//! color_channels = ["R", "G", "B"]   # of an EXR, one is grey; a whole name, or the end of one: "Combined.R"
//! color_layer = "ViewLayer.Combined" # of an EXR: its channels are taken from there
//! depth = "depth.exr"                # EXR Z, PFM, TIFF or .npy of floats in metres, 16-bit PNG, PGM, TIFF or whole .npy with depth_per_metre, or packed
//! depth_channel = "Depth.Z"          # of an EXR, and depth_layer, as above
//! depth_encoding = "plain"           # or "packed24", the reference program's: z = 65025 R/255 + 255 G/255 + B/255 (bytes);
//!                                    # or "carla": z = 1000 (R + 256 G + 65536 B) / (256^3 - 1)
//! depth_per_metre = 1000.0           # stored value of one metre, 0.001 to 1e6; of floats 1 if left out
//! depth_rows = "bottom-up"           # of a PFM: the row that it begins with; "top-down" as AirSim writes them
//! depth_kind = "planar"              # z along the optical axis; or "range", along the ray; or "inverse": depth_per_metre / z
//! depth_max_m = 1e9                  # what is stored as that far, or farther, is no depth: the value that stands for the sky
//! holes = "far"                      # where there is no depth; "nearest": that of the nearest pixel that has one; "mark": nothing is shown
//! focal_px = [307.6, 307.6]          # of the ideal frame, which may be larger than the output
//! principal_point_px = [543.5, 407.5]  # default: its centre; of an EXR that of the display window
//! instant_ms = 0.0                   # when it was taken, from the stamp t_i
//! [motion]                           # a twist about the frame's instant, in camera axes ...
//! velocity_m_s = [0.0, 0.0, 0.0]
//! angular_rate_rad_s = [0.0, 0.0, 0.628]
//! # trajectory = "poses.csv"         # ... or poses: t_s,x,y,z,qw,qx,qy,qz (world_from_camera), units by name: t_ms, x_mm,
//! # trajectory_format = "csv"        #     or "tum": t x y z qx qy qz qw without a header, or with a comment that names another order
//! # stamp_s = 12.5                   #     and the stamp on their clock
//! # flow = "flow.flo"              # ... or where each pixel goes, whatever moves it: Middlebury .flo, or an EXR
//! # flow_channels = ["X", "Y"]     #     of an EXR with more than two: right and down
//! # flow_scale = [1.0, 1.0]        #     times this are pixels; [1.0, -1.0] where y is up
//! # flow_interval_ms = 33.3        #     after how long; negative: where it was so long before
//! # [fog]                            # preset "paper" only: linear fog, added after the blur
//! # end_m = 12000.0
//! # color = [0.5, 0.6, 0.7]          # stored values
//! ```
//!
//! Many frames in one file: [`list`] says how they are named.
//!
//! Depth that is 0, negative, infinite, at least `depth_max_m` or not a number is **unknown or sky: taken as
//! infinitely far**, so it moves with the rotation alone, or, with `holes = "nearest"`, as what is beside it
//! (a depth camera's shadows; not for pictures with sky), or, with `holes = "mark"`, not at all: output
//! pixels that look there are invalid. A picture of nothing but 0 and infinity may be sky; one of nothing but
//! what no depth can be (negative, not a number, nearer than a micrometre) is refused: it is in another sign
//! or unit.
//!
//! A twist is constant **in the camera's own axes**: a screw, whose velocity turns with the camera. With
//! velocity v across rate w the camera flies a circle of radius |v|/|w|; a camera that turns on a straight
//! flight needs a trajectory.

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
mod exr_planes;
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
    /// The file itself: not readable, not TOML, keys or types.
    #[error(transparent)]
    File(#[from] ScenarioError),
    /// A value that does not go with the others.
    #[error("{}: {key}: {message}", path.display())]
    Key {
        /// FRAME.toml.
        path: PathBuf,
        /// The key.
        key: &'static str,
        /// What is wrong and what to do.
        message: String,
    },
    /// A picture.
    #[error("{}: {message}", path.display())]
    Picture {
        /// The picture.
        path: PathBuf,
        /// What is wrong and what to do.
        message: String,
    },
    /// A table of poses or of frames.
    #[error("{}{}: {message}", path.display(), line.map_or(String::new(), |line| format!(":{line}")))]
    Poses {
        /// The table.
        path: PathBuf,
        /// Line from 1, where known.
        line: Option<u64>,
        /// What is wrong and what to do.
        message: String,
    },
    /// What the table says.
    #[error("{}: {source}", path.display())]
    Track {
        /// The table.
        path: PathBuf,
        /// What is wrong and what to do.
        source: PoseTrackError,
    },
}

/// The keys as written, paths resolved.
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

/// Which row a PFM file begins with: the format says the bottom one, and not everybody keeps to it.
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

/// What a whole number in a file's name counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum NameUnit {
    S,
    Ms,
    Us,
    Ns,
}

impl FrameSpec {
    /// The first key that chooses a channel of an EXR's colour.
    fn color_key(&self) -> Option<&'static str> {
        self.color_channels
            .as_ref()
            .map(|_| "color_channels")
            .or(self.color_layer.as_ref().map(|_| "color_layer"))
    }

    /// The same of its depth.
    fn depth_key(&self) -> Option<&'static str> {
        self.depth_channel
            .as_ref()
            .map(|_| "depth_channel")
            .or(self.depth_layer.as_ref().map(|_| "depth_layer"))
    }
}

/// A frame file, read with everything that it names.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameFile {
    /// The ideal frame.
    pub frame: IdealFrame,
    /// How its camera moved.
    pub motion: Motion,
    /// Fog of the paper's preset.
    pub fog: Option<LinearFog>,
    /// Share of the pixels whose depth is unknown or sky.
    pub without_depth: f64,
    /// What of the pictures is not as it seems, or left out.
    pub notes: Vec<String>,
}

/// Reads a frame file of one frame, its pictures and its poses.
///
/// # Errors
/// [`FrameFileError`] names the file, the key where there is one, and what to do.
pub fn read_frame(path: &Path) -> Result<FrameFile, FrameFileError> {
    read_frame_set(path)?.read(0)
}

/// The keys of a frame file, each by itself as it should be.
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
    if spec.depth_max_m.is_some_and(|most| most.is_nan() || most <= 0.0) {
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

/// Where the first pixel of an EXR is in the file's own pixels; `None` of other pictures.
type Origin = Option<[i32; 2]>;

/// Reads the pictures of one frame.
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
            let depth::Depth { inverse, notes: of_depth } =
                depth::read_depth(depth, spec, &geometry, color.origin_px, path)?;
            notes.extend(of_depth.into_iter().filter(|note| !notes.contains(note)).collect::<Vec<_>>());
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
        // Of a picture without depth, which only turns, nothing is missing.
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
