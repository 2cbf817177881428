//! Many frames in one FRAME.toml: folders, lists and tables.
//!
//! ```toml
//! color = "rgb/*.png"                # every picture of that name, in the order of what stands for the *
//! depth = "depth/*.png"              # the one where the same stands for the *; or, with name_unit, the nearest in time
//! name_unit = "s"                    # what stands for the * is a time, in s, ms, us or ns
//! max_gap_ms = 20.0                  # depth may be so far from its colour in time; colour without depth is left out
//! ```
//! ```toml
//! color = "rgb.txt"                  # a list of `time file`, as the TUM benchmarks have it; seconds
//! depth = "depth.txt"
//! ```
//! ```toml
//! frames = "associations.txt"        # `time color` or `time color time depth` a line
//! frames = "frames.csv"              # columns color (or color_exr, color_png), depth, t_s (t_ms, t_us, t_ns) or stamp_ns: camsim's own too
//! ```
//! `fps`, with `motion.stamp_s` for the first, gives times to frames that have none. Times count where there
//! is a trajectory; a twist is the same for all. A frame's stamp is that of its colour.

use std::path::{Path, PathBuf};

use super::{FrameFileError, FrameSpec};

mod sources;

use sources::{Item, pattern_of, read_list, read_pattern, read_table};

/// How far depth may be from its colour in time where nothing is said: as the TUM benchmarks have it.
const MAX_GAP_MS: f64 = 20.0;

/// One frame's pictures.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Colour.
    pub color: PathBuf,
    /// Depth, if there is any.
    pub depth: Option<PathBuf>,
    /// When, on the clock of the trajectory.
    pub stamp_ns: Option<i64>,
}

/// The frames that a file names.
pub(super) struct Listed {
    pub(super) entries: Vec<Entry>,
    /// Colour pictures without depth of about the same time.
    pub(super) left_out: usize,
    /// A folder or a table, rather than one picture.
    pub(super) several: bool,
    /// What of a table is not read.
    pub(super) notes: Vec<String>,
}

/// A key of FRAME.toml and what is wrong with it.
fn key(path: &Path, key: &'static str, message: impl Into<String>) -> FrameFileError {
    FrameFileError::Key { path: path.into(), key, message: message.into() }
}

/// All frames that `spec` names, in order.
pub(super) fn frames(spec: &FrameSpec, path: &Path) -> Result<Listed, FrameFileError> {
    let mut listed = match (&spec.frames, &spec.color) {
        (Some(_), Some(_)) => {
            return Err(key(
                path,
                "frames",
                "is a table that names the pictures: leave color and depth out, or frames",
            ));
        }
        (Some(_), None) if spec.depth.is_some() => {
            return Err(key(path, "frames", "names depth pictures too: leave depth out, or frames"));
        }
        (Some(table), None) => {
            let (entries, notes) = read_table(table)?;
            Listed { entries, left_out: 0, several: true, notes }
        }
        (None, None) => {
            return Err(key(
                path,
                "color",
                "is missing, and has no default; add it, or frames = \"frames.csv\"",
            ));
        }
        (None, Some(color)) => match Pictures::of(color) {
            Pictures::One => return one(spec, color, path),
            pictures => paired(spec, color, &pictures, path)?,
        },
    };
    let with_names = spec.frames.is_none()
        && spec.color.as_deref().is_some_and(|color| Pictures::of(color) == Pictures::Pattern);
    if spec.name_unit.is_some() && !with_names {
        return Err(key(
            path,
            "name_unit",
            "is for names with a *; a list or table has times of its own: leave it out",
        ));
    }
    give_times(spec, &mut listed.entries, path)?;
    Ok(listed)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pictures {
    One,
    Pattern,
    List,
}

impl Pictures {
    fn of(path: &Path) -> Self {
        if path.to_string_lossy().contains('*') {
            Self::Pattern
        } else if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("txt")) {
            Self::List
        } else {
            Self::One
        }
    }
}

fn one(spec: &FrameSpec, color: &Path, path: &Path) -> Result<Listed, FrameFileError> {
    let several = [
        ("name_unit", spec.name_unit.is_some()),
        ("fps", spec.fps.is_some()),
        ("max_gap_ms", spec.max_gap_ms.is_some()),
    ];
    if let Some((name, _)) = several.into_iter().find(|(_, given)| *given) {
        return Err(key(
            path,
            name,
            "is for many frames, and color names one picture; leave it out, or write color = \
                \"folder/*.png\"",
        ));
    }
    if spec.depth.as_deref().is_some_and(|depth| Pictures::of(depth) != Pictures::One) {
        return Err(key(path, "depth", "names many pictures, and color names one"));
    }
    let entry = Entry { color: color.into(), depth: spec.depth.clone(), stamp_ns: None };
    Ok(Listed { entries: vec![entry], left_out: 0, several: false, notes: Vec::new() })
}

/// Colour and depth from patterns or lists.
fn paired(
    spec: &FrameSpec,
    color: &Path,
    pictures: &Pictures,
    path: &Path,
) -> Result<Listed, FrameFileError> {
    let read = |name, of: &Path| match Pictures::of(of) {
        Pictures::One => {
            Err(key(path, name, "names one picture, and color many: write it with a *, or as a list"))
        }
        Pictures::Pattern => read_pattern(of, spec.name_unit, path, name),
        Pictures::List => read_list(of),
    };
    let colors = read("color", color)?;
    let Some(depth) = &spec.depth else {
        let entries = colors
            .into_iter()
            .map(|item| Entry { color: item.path, depth: None, stamp_ns: item.stamp_ns })
            .collect();
        return Ok(Listed { entries, left_out: 0, several: true, notes: Vec::new() });
    };
    let by_name = *pictures == Pictures::Pattern
        && Pictures::of(depth) == Pictures::Pattern
        && spec.name_unit.is_none();
    if by_name {
        if spec.max_gap_ms.is_some() {
            return Err(key(
                path,
                "max_gap_ms",
                "is for times, and these names are none: say what they count with name_unit, or leave it out",
            ));
        }
        return by_names(colors, depth, path);
    }
    let depths = read("depth", depth)?;
    let max_gap_ms = spec.max_gap_ms.unwrap_or(MAX_GAP_MS);
    if !(max_gap_ms.is_finite() && max_gap_ms >= 0.0) {
        return Err(key(path, "max_gap_ms", "must be a finite number of milliseconds, 0 or more"));
    }
    by_times(colors, depths, max_gap_ms, path)
}

/// What stands for the * in the colour's name stands for it in the depth's.
fn by_names(colors: Vec<Item>, depth: &Path, path: &Path) -> Result<Listed, FrameFileError> {
    let (folder, [before, after]) = pattern_of(depth).map_err(|message| key(path, "depth", message))?;
    let mut entries = Vec::with_capacity(colors.len());
    for item in colors {
        let depth = folder.join(format!("{before}{}{after}", item.star));
        if !depth.is_file() {
            let message = format!("{} has none: there is no {}", item.path.display(), depth.display());
            return Err(key(path, "depth", message));
        }
        entries.push(Entry { color: item.path, depth: Some(depth), stamp_ns: item.stamp_ns });
    }
    Ok(Listed { entries, left_out: 0, several: true, notes: Vec::new() })
}

/// Each depth picture goes to one colour at most, the nearest pairs first.
fn by_times(
    colors: Vec<Item>,
    depths: Vec<Item>,
    max_gap_ms: f64,
    path: &Path,
) -> Result<Listed, FrameFileError> {
    let mut pairs: Vec<(i64, usize, usize)> = Vec::new();
    for (i, color) in colors.iter().enumerate() {
        let Some(stamp_ns) = color.stamp_ns else {
            return Err(key(
                path,
                "name_unit",
                "is missing: depth is a list with times, so the colours' names must be times too",
            ));
        };
        let after = depths.partition_point(|depth| depth.stamp_ns < Some(stamp_ns));
        // Two on each side: the nearest may go to a neighbour.
        for (j, depth) in depths.iter().enumerate().take(after + 2).skip(after.saturating_sub(2)) {
            let Some(depth_ns) = depth.stamp_ns else {
                return Err(key(
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
        return Err(key(path, "depth", message));
    }
    let with_depth = colors.into_iter().zip(depth_of);
    let entry = |(color, depth): (Item, Option<usize>)| {
        depth.map(|j| Entry {
            color: color.path,
            depth: Some(depths[j].path.clone()),
            stamp_ns: color.stamp_ns,
        })
    };
    Ok(Listed { entries: with_depth.filter_map(entry).collect(), left_out, several: true, notes: Vec::new() })
}

/// Times by `fps` for frames that have none.
fn give_times(spec: &FrameSpec, entries: &mut [Entry], path: &Path) -> Result<(), FrameFileError> {
    let timed = entries.iter().any(|entry| entry.stamp_ns.is_some());
    let Some(fps) = spec.fps else {
        if spec.motion.stamp_s.is_some() {
            let fix = "is of one frame, or of the first one with fps; these frames have times of their own, \
                or none: leave it out, or add fps";
            return Err(key(path, "motion.stamp_s", fix));
        }
        return Ok(());
    };
    if timed {
        return Err(key(path, "fps", "is for frames without times, and these have them: leave it out"));
    }
    let first_s = spec.motion.stamp_s.unwrap_or(0.0);
    if !(fps.is_finite() && fps > 0.0 && first_s.abs() < 9e9) {
        return Err(key(path, "fps", "must be above 0, and motion.stamp_s a number of seconds"));
    }
    for (i, entry) in entries.iter_mut().enumerate() {
        entry.stamp_ns = Some((first_s * 1e9).round() as i64 + (i as f64 * 1e9 / fps).round() as i64);
    }
    Ok(())
}

#[cfg(test)]
mod tests;
