//! Several frames in one FRAME.toml: patterns, lists and tables.
//!
//! ```toml
//! color = "rgb/*.png"                # all pictures of this pattern, ordered by what stands for the *
//! depth = "depth/*.png"              # paired by equal text for the *; with name_unit, by nearest time
//! name_unit = "s"                    # the text for the * is a time in s, ms, us or ns
//! max_gap_ms = 20.0                  # maximum time from colour to depth; colour without depth is skipped
//! ```
//! ```toml
//! color = "rgb.txt"                  # a list of `time file` in seconds, as in the TUM benchmarks
//! depth = "depth.txt"
//! ```
//! ```toml
//! frames = "associations.txt"        # lines of `time color` or `time color time depth`
//! frames = "frames.csv"              # columns color (or color_exr, color_png), depth, and t_s (t_ms, t_us,
//!                                    # t_ns) or stamp_ns; also a frames.csv that camsim wrote
//! ```
//! `fps`, with `motion.stamp_s` for the first frame, sets the times of frames without times. Only a
//! trajectory needs times; a twist is the same for all frames. The stamp of a frame is that of its colour
//! picture.

use std::path::{Path, PathBuf};

use super::{FrameFileError, FrameSpec};

mod sources;

use sources::{TimedPicture, read_list, read_pattern, read_table, split_pattern};

/// Default of `max_gap_ms`, as in the tools of the TUM benchmarks.
const DEFAULT_MAX_GAP_MS: f64 = 20.0;

/// The pictures of one frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameEntry {
    /// Colour picture.
    pub color: PathBuf,
    /// Depth picture, if there is one.
    pub depth: Option<PathBuf>,
    /// Stamp on the clock of the trajectory, nanoseconds.
    pub stamp_ns: Option<i64>,
}

/// The frames that a FRAME.toml names.
pub(super) struct FrameList {
    /// Frames in order.
    pub(super) entries: Vec<FrameEntry>,
    /// Number of colour pictures skipped because no depth is near in time.
    pub(super) left_out: usize,
    /// Whether it names a pattern, list or table, not one picture.
    pub(super) several: bool,
    /// Notes about columns that are not read.
    pub(super) notes: Vec<String>,
}

/// An error about a key of FRAME.toml.
fn key_error(path: &Path, key: &'static str, message: impl Into<String>) -> FrameFileError {
    FrameFileError::Key { path: path.into(), key, message: message.into() }
}

/// All frames that `spec` names, in order.
pub(super) fn frames(spec: &FrameSpec, path: &Path) -> Result<FrameList, FrameFileError> {
    let mut listed = match (&spec.frames, &spec.color) {
        (Some(_), Some(_)) => {
            return Err(key_error(
                path,
                "frames",
                "is a table that names the pictures: leave color and depth out, or frames",
            ));
        }
        (Some(_), None) if spec.depth.is_some() => {
            return Err(key_error(path, "frames", "names depth pictures too: leave depth out, or frames"));
        }
        (Some(table), None) => {
            let (entries, notes) = read_table(table)?;
            FrameList { entries, left_out: 0, several: true, notes }
        }
        (None, None) => {
            return Err(key_error(
                path,
                "color",
                "is missing, and has no default; add it, or frames = \"frames.csv\"",
            ));
        }
        (None, Some(color)) => match PathKind::detect(color) {
            PathKind::Picture => return single(spec, color, path),
            kind => paired(spec, color, &kind, path)?,
        },
    };
    let with_names = spec.frames.is_none()
        && spec.color.as_deref().is_some_and(|color| PathKind::detect(color) == PathKind::Pattern);
    if spec.name_unit.is_some() && !with_names {
        return Err(key_error(
            path,
            "name_unit",
            "is for names with a *; a list or table has times of its own: leave it out",
        ));
    }
    set_times(spec, &mut listed.entries, path)?;
    Ok(listed)
}

/// What a path of FRAME.toml names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PathKind {
    /// One picture.
    Picture,
    /// Pictures by a pattern with *.
    Pattern,
    /// A text file with a list of pictures.
    List,
}

impl PathKind {
    fn detect(path: &Path) -> Self {
        if path.to_string_lossy().contains('*') {
            Self::Pattern
        } else if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("txt")) {
            Self::List
        } else {
            Self::Picture
        }
    }
}

/// The frame of a FRAME.toml that names one colour picture.
fn single(spec: &FrameSpec, color: &Path, path: &Path) -> Result<FrameList, FrameFileError> {
    let keys_of_several = [
        ("name_unit", spec.name_unit.is_some()),
        ("fps", spec.fps.is_some()),
        ("max_gap_ms", spec.max_gap_ms.is_some()),
    ];
    if let Some((name, _)) = keys_of_several.into_iter().find(|(_, given)| *given) {
        return Err(key_error(
            path,
            name,
            "is for many frames, and color names one picture; leave it out, or write color = \
                \"folder/*.png\"",
        ));
    }
    if spec.depth.as_deref().is_some_and(|depth| PathKind::detect(depth) != PathKind::Picture) {
        return Err(key_error(path, "depth", "names many pictures, and color names one"));
    }
    let entry = FrameEntry { color: color.into(), depth: spec.depth.clone(), stamp_ns: None };
    Ok(FrameList { entries: vec![entry], left_out: 0, several: false, notes: Vec::new() })
}

/// Pairs colour and depth pictures of patterns or lists.
fn paired(
    spec: &FrameSpec,
    color: &Path,
    color_kind: &PathKind,
    path: &Path,
) -> Result<FrameList, FrameFileError> {
    let read = |name, pictures: &Path| match PathKind::detect(pictures) {
        PathKind::Picture => {
            Err(key_error(path, name, "names one picture, and color many: write it with a *, or as a list"))
        }
        PathKind::Pattern => read_pattern(pictures, spec.name_unit, path, name),
        PathKind::List => read_list(pictures),
    };
    let colors = read("color", color)?;
    let Some(depth) = &spec.depth else {
        let entries = colors
            .into_iter()
            .map(|item| FrameEntry { color: item.path, depth: None, stamp_ns: item.stamp_ns })
            .collect();
        return Ok(FrameList { entries, left_out: 0, several: true, notes: Vec::new() });
    };
    let by_name = *color_kind == PathKind::Pattern
        && PathKind::detect(depth) == PathKind::Pattern
        && spec.name_unit.is_none();
    if by_name {
        if spec.max_gap_ms.is_some() {
            return Err(key_error(
                path,
                "max_gap_ms",
                "is for times, and these names are none: say what they count with name_unit, or leave it out",
            ));
        }
        return pair_by_name(colors, depth, path);
    }
    let depths = read("depth", depth)?;
    let max_gap_ms = spec.max_gap_ms.unwrap_or(DEFAULT_MAX_GAP_MS);
    if !(max_gap_ms.is_finite() && max_gap_ms >= 0.0) {
        return Err(key_error(path, "max_gap_ms", "must be a finite number of milliseconds, 0 or more"));
    }
    pair_by_time(colors, depths, max_gap_ms, path)
}

/// Pairs pictures by the text that stands for the * in their names.
fn pair_by_name(colors: Vec<TimedPicture>, depth: &Path, path: &Path) -> Result<FrameList, FrameFileError> {
    let (folder, [before, after]) =
        split_pattern(depth).map_err(|message| key_error(path, "depth", message))?;
    let mut entries = Vec::with_capacity(colors.len());
    for item in colors {
        let depth = folder.join(format!("{before}{}{after}", item.star));
        if !depth.is_file() {
            let message = format!("{} has none: there is no {}", item.path.display(), depth.display());
            return Err(key_error(path, "depth", message));
        }
        entries.push(FrameEntry { color: item.path, depth: Some(depth), stamp_ns: item.stamp_ns });
    }
    Ok(FrameList { entries, left_out: 0, several: true, notes: Vec::new() })
}

/// Pairs pictures by time, nearest pairs first. Each depth picture belongs to at most one colour picture.
fn pair_by_time(
    colors: Vec<TimedPicture>,
    depths: Vec<TimedPicture>,
    max_gap_ms: f64,
    path: &Path,
) -> Result<FrameList, FrameFileError> {
    let mut pairs = candidate_pairs(&colors, &depths, max_gap_ms, path)?;
    pairs.sort_unstable();
    let mut depth_of: Vec<Option<usize>> = vec![None; colors.len()];
    let mut taken = vec![false; depths.len()];
    for (_, i, j) in pairs {
        if depth_of[i].is_none() && !taken[j] {
            (depth_of[i], taken[j]) = (Some(j), true);
        }
    }
    let left_out = depth_of.iter().filter(|depth| depth.is_none()).count();
    if left_out == colors.len() {
        let message = format!(
            "no picture is within {max_gap_ms} ms of a colour: check that both have one clock, or raise \
                max_gap_ms"
        );
        return Err(key_error(path, "depth", message));
    }
    let with_depth = colors.into_iter().zip(depth_of);
    let entry = |(color, depth): (TimedPicture, Option<usize>)| {
        depth.map(|j| FrameEntry {
            color: color.path,
            depth: Some(depths[j].path.clone()),
            stamp_ns: color.stamp_ns,
        })
    };
    Ok(FrameList {
        entries: with_depth.filter_map(entry).collect(),
        left_out,
        several: true,
        notes: Vec::new(),
    })
}

/// Pairs of colour and depth pictures within `max_gap_ms`: gap in nanoseconds, index of colour, index of depth.
fn candidate_pairs(
    colors: &[TimedPicture],
    depths: &[TimedPicture],
    max_gap_ms: f64,
    path: &Path,
) -> Result<Vec<(i64, usize, usize)>, FrameFileError> {
    let mut pairs: Vec<(i64, usize, usize)> = Vec::new();
    for (i, color) in colors.iter().enumerate() {
        let Some(stamp_ns) = color.stamp_ns else {
            return Err(key_error(
                path,
                "name_unit",
                "is missing: depth is a list with times, so the colours' names must be times too",
            ));
        };
        let after = depths.partition_point(|depth| depth.stamp_ns < Some(stamp_ns));
        // Two candidates on each side, as the nearest may belong to the neighbouring colour picture.
        for (j, depth) in depths.iter().enumerate().take(after + 2).skip(after.saturating_sub(2)) {
            let Some(depth_ns) = depth.stamp_ns else {
                return Err(key_error(
                    path,
                    "name_unit",
                    "is missing: color is a list with times, so the depths' names must be times too",
                ));
            };
            let gap_ns = depth_ns.abs_diff(stamp_ns);
            if gap_ns as f64 <= 1e6 * max_gap_ms {
                pairs.push((gap_ns as i64, i, j));
            }
        }
    }
    Ok(pairs)
}

/// Sets the times of frames without times by `fps`.
fn set_times(spec: &FrameSpec, entries: &mut [FrameEntry], path: &Path) -> Result<(), FrameFileError> {
    let have_times = entries.iter().any(|entry| entry.stamp_ns.is_some());
    let Some(fps) = spec.fps else {
        if spec.motion.stamp_s.is_some() {
            let fix = "is of one frame, or of the first one with fps; these frames have times of their own, \
                or none: leave it out, or add fps";
            return Err(key_error(path, "motion.stamp_s", fix));
        }
        return Ok(());
    };
    if have_times {
        return Err(key_error(path, "fps", "is for frames without times, and these have them: leave it out"));
    }
    let first_s = spec.motion.stamp_s.unwrap_or(0.0);
    if !(fps.is_finite() && fps > 0.0 && first_s.abs() < 9e9) {
        return Err(key_error(path, "fps", "must be above 0, and motion.stamp_s a number of seconds"));
    }
    for (i, entry) in entries.iter_mut().enumerate() {
        entry.stamp_ns = Some((first_s * 1e9).round() as i64 + (i as f64 * 1e9 / fps).round() as i64);
    }
    Ok(())
}

#[cfg(test)]
mod tests;
