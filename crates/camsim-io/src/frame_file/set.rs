//! The frames of a FRAME.toml, one or several, and the motion of each.

use std::path::{Path, PathBuf};

use camsim_core::{
    apply::{Motion, PoseRow, PoseTrack},
    temporal::displacement::Twist,
};
use glam::DVec3;

use super::{
    FrameFile, FrameFileError, FrameSpec,
    flow::read_flow,
    images::{failure, is_exr},
    list::{FrameEntry, frames},
    poses::read_poses,
    read_pictures, read_spec,
};

/// The frames of a FRAME.toml. Their pictures are read one frame at a time.
#[derive(Clone, Debug)]
pub struct FrameSet {
    path: PathBuf,
    spec: FrameSpec,
    entries: Vec<FrameEntry>,
    left_out: usize,
    several: bool,
    motion_source: MotionSource,
    notes: Vec<String>,
}

/// What determines the motion of the frames.
#[derive(Clone, Debug)]
enum MotionSource {
    /// A constant twist.
    Twist(Twist),
    /// A file of optical flow.
    Flow(PathBuf),
    /// Poses of a table, with times relative to `base_s`.
    Poses { table: PathBuf, rows: Vec<PoseRow>, base_s: f64 },
}

/// Reads a frame file and the tables that it names; its pictures are read by [`FrameSet::read`].
///
/// # Errors
/// [`FrameFileError`] names the file, the line or key where there is one, and what to do.
pub fn read_frame_set(path: &Path) -> Result<FrameSet, FrameFileError> {
    let spec = read_spec(path)?;
    let listed = frames(&spec, path)?;
    let mut notes = listed.notes;
    let motion_source = read_motion_source(&spec, &listed.entries, listed.several, path, &mut notes)?;
    Ok(FrameSet {
        path: path.into(),
        entries: listed.entries,
        left_out: listed.left_out,
        several: listed.several,
        spec,
        motion_source,
        notes,
    })
}

impl FrameSet {
    /// The frames in order, at least one.
    #[must_use]
    pub fn entries(&self) -> &[FrameEntry] {
        &self.entries
    }

    /// Number of colour pictures skipped because no depth is near in time.
    #[must_use]
    pub fn left_out(&self) -> usize {
        self.left_out
    }

    /// Notes about columns that are not read.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Instant at which the pictures were taken, seconds from their stamps.
    #[must_use]
    pub fn instant_s(&self) -> f64 {
        1e-3 * self.spec.instant_ms
    }

    /// The file of poses or of optical flow, if there is one.
    #[must_use]
    pub fn motion_file(&self) -> Option<&Path> {
        match &self.motion_source {
            MotionSource::Twist(_) => None,
            MotionSource::Flow(path) | MotionSource::Poses { table: path, .. } => Some(path),
        }
    }

    /// Whether the file names a pattern, list or table of frames (which may hold a single frame).
    #[must_use]
    pub fn is_several(&self) -> bool {
        self.several
    }

    /// Motion of the camera relative to the stamp of frame `index`.
    ///
    /// # Errors
    /// The flow cannot be read, or the poses make no trajectory.
    pub fn motion(&self, index: usize) -> Result<Motion, FrameFileError> {
        match &self.motion_source {
            MotionSource::Twist(twist) => Ok(Motion::Twist(*twist)),
            MotionSource::Flow(flow) => Ok(Motion::Flow(read_flow(flow, &self.spec.motion)?.0)),
            MotionSource::Poses { table, rows, base_s } => {
                let stamp_s = self.stamp_s(index).unwrap_or(*base_s);
                let track = PoseTrack::new(rows.clone(), stamp_s - base_s);
                Ok(Motion::Poses(
                    track.map_err(|source| FrameFileError::Track { path: table.clone(), source })?,
                ))
            }
        }
    }

    /// Reads the pictures of frame `index`.
    ///
    /// # Errors
    /// A picture cannot be used, or there is no such frame.
    pub fn read(&self, index: usize) -> Result<FrameFile, FrameFileError> {
        let Some(entry) = self.entries.get(index) else {
            let message = format!("has {} frames; there is none of number {index}", self.entries.len());
            return Err(FrameFileError::Key { path: self.path.clone(), key: "frames", message });
        };
        let (motion, flow_origin_px) = match &self.motion_source {
            MotionSource::Flow(flow) => {
                let (flow, origin_px) = read_flow(flow, &self.spec.motion)?;
                (Motion::Flow(flow), origin_px)
            }
            _ => (self.motion(index)?, None),
        };
        let (file, color_origin_px) =
            read_pictures(&self.spec, &entry.color, entry.depth.as_deref(), motion, &self.path)?;
        if let (MotionSource::Flow(path), Motion::Flow(flow)) = (&self.motion_source, &file.motion) {
            let [[w, h], [width, height]] = [flow.size_px, file.frame.geometry.size_px];
            if [w, h] != [width, height] {
                return Err(failure(
                    path,
                    format!(
                        "is of {w}x{h} pixels, and the colour of {width}x{height}: flow and colour must have \
                            one size"
                    ),
                ));
            }
            if let (Some(flow_px), Some(color_px)) = (flow_origin_px, color_origin_px)
                && flow_px != color_px
            {
                let message = format!(
                    "begins at pixel {flow_px:?} of its file, the colour at {color_px:?}: they must cover \
                        the same pixels"
                );
                return Err(failure(path, message));
            }
        }
        Ok(file)
    }

    fn stamp_s(&self, index: usize) -> Option<f64> {
        let stamp_ns = self.entries.get(index)?.stamp_ns?;
        Some(seconds(stamp_ns))
    }
}

/// Converts nanoseconds to seconds. Whole seconds are converted apart, which loses the least of Unix times.
fn seconds(stamp_ns: i64) -> f64 {
    stamp_ns.div_euclid(1_000_000_000) as f64 + stamp_ns.rem_euclid(1_000_000_000) as f64 * 1e-9
}

/// Reads the motion: a flow, a table of poses, or a twist (zero by default).
///
/// # Errors
/// Several of them are given, or a value is missing or not finite.
// Long because it is one sequence of checks of keys.
fn read_motion_source(
    spec: &FrameSpec,
    entries: &[FrameEntry],
    several: bool,
    path: &Path,
    notes: &mut Vec<String>,
) -> Result<MotionSource, FrameFileError> {
    let motion = &spec.motion;
    let fail =
        |key, message: &str| Err(FrameFileError::Key { path: path.into(), key, message: message.to_owned() });
    if let Some(flow) = &motion.flow {
        check_flow(spec, several, path)?;
        return Ok(MotionSource::Flow(flow.clone()));
    }
    let flow_keys = [
        ("motion.flow_channels", motion.flow_channels.is_some()),
        ("motion.flow_scale", motion.flow_scale.is_some()),
        ("motion.flow_interval_ms", motion.flow_interval_ms.is_some()),
    ];
    if let Some((key, _)) = flow_keys.into_iter().find(|(_, given)| *given) {
        return fail(key, "is for motion.flow, which is missing; add it, or leave this out");
    }
    let Some(trajectory) = &motion.trajectory else {
        if motion.stamp_s.is_some() && spec.fps.is_none() {
            return fail(
                "motion.stamp_s",
                "is the stamp on the clock of motion.trajectory, which is missing; add it, or leave this out",
            );
        }
        let [velocity, rate] = [motion.velocity_m_s, motion.angular_rate_rad_s]
            .map(|v| DVec3::from_array(v.unwrap_or_default()));
        for (key, value) in [("motion.velocity_m_s", velocity), ("motion.angular_rate_rad_s", rate)] {
            if !value.is_finite() {
                return fail(key, "must be three finite numbers, in camera axes: x right, y down, z forward");
            }
        }
        return Ok(MotionSource::Twist(Twist { velocity_m_s: velocity, rate_rad_s: rate }));
    };
    if motion.velocity_m_s.is_some() || motion.angular_rate_rad_s.is_some() {
        return fail("motion", "has both a twist and a trajectory; give one of them");
    }
    let base_s = match (several, motion.stamp_s) {
        (false, Some(stamp_s)) => stamp_s,
        (false, None) => {
            return fail(
                "motion.stamp_s",
                "is missing: give the stamp of the frame on the clock of motion.trajectory",
            );
        }
        (true, _) => match entries.first().and_then(|entry| entry.stamp_ns) {
            Some(stamp_ns) => seconds(stamp_ns),
            None => {
                let fix = "is there, but the frames have no times: say what their names count with name_unit \
                    (\"s\", \"ms\", \"us\" or \"ns\"), \
                           or give fps, with motion.stamp_s for the first";
                return fail("motion.trajectory", fix);
            }
        },
    };
    if !base_s.is_finite() {
        return fail(
            "motion.stamp_s",
            "must be a finite number of seconds on the clock of motion.trajectory",
        );
    }
    let (rows, table_notes) = read_poses(trajectory, motion.trajectory_format, base_s)?;
    notes.extend(table_notes);
    Ok(MotionSource::Poses { table: trajectory.clone(), rows, base_s })
}

/// Checks the keys of `motion.flow`, which excludes other motion.
fn check_flow(spec: &FrameSpec, several: bool, path: &Path) -> Result<(), FrameFileError> {
    let motion = &spec.motion;
    let fail =
        |key, message: &str| Err(FrameFileError::Key { path: path.into(), key, message: message.to_owned() });
    let others =
        motion.velocity_m_s.is_some() || motion.angular_rate_rad_s.is_some() || motion.trajectory.is_some();
    if others || motion.stamp_s.is_some() {
        return fail(
            "motion.flow",
            "says where everything goes, the camera's part included; leave twist, trajectory and stamp_s out",
        );
    }
    if several {
        return fail("motion.flow", "is of one frame: give each frame a FRAME.toml of its own");
    }
    if motion.flow_channels.as_ref().is_some_and(|names| names.len() != 2) {
        return fail("motion.flow_channels", "must be two names: the flow to the right, and down");
    }
    if motion.flow_channels.is_some() && !motion.flow.as_deref().is_some_and(is_exr) {
        return fail("motion.flow_channels", "is for EXR, and motion.flow is none; leave it out");
    }
    if motion.flow_scale.is_some_and(|scale| !scale.iter().all(|part| part.is_finite() && *part != 0.0)) {
        return fail("motion.flow_scale", "must be two finite numbers that are not 0; [1, -1] where y is up");
    }
    match motion.flow_interval_ms {
        Some(ms) if ms.is_finite() && ms != 0.0 => Ok(()),
        Some(_) => fail(
            "motion.flow_interval_ms",
            "must be a finite number of milliseconds that is not 0: the time between the two instants that \
                the flow joins",
        ),
        None => fail(
            "motion.flow_interval_ms",
            "is missing: give the time between the two instants that the flow joins, 1000 / fps for \
                successive frames",
        ),
    }
}
