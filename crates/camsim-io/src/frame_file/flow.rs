//! Reads optical flow: Middlebury `.flo`, two channels of an EXR, or a `.npy` with two numbers per pixel.

use std::path::Path;

use camsim_core::apply::FlowField;

use super::{
    FrameFileError, MotionSpec,
    exr_planes::read_exr,
    images::{failure, is_exr},
    npy,
};

/// Size in pixels; flow of each pixel, row by row; and for an EXR the position of the first pixel in the
/// pixels of the file.
type FlowValues = ([u32; 2], Vec<[f32; 2]>, Option<[i32; 2]>);

/// Signature of a `.flo` file: this number, little-endian.
const FLO_TAG: f32 = 202_021.25;
/// Larger values mark unknown flow, by the definition of `.flo`.
const UNKNOWN_PX: f32 = 1e9;

/// Reads `motion.flow`, whose keys have been checked. Returns the flow, and for an EXR the position of its
/// first pixel in the pixels of the file.
pub(super) fn read_flow(
    path: &Path,
    motion: &MotionSpec,
) -> Result<(FlowField, Option<[i32; 2]>), FrameFileError> {
    let (size_px, values, origin_px) = if is_exr(path) {
        read_exr_flow(path, motion)?
    } else if let Some(array) = npy::read(path)? {
        let (size_px, values) = array.pairs().map_err(|message| failure(path, message))?;
        (size_px, values, None)
    } else {
        read_flo(path)?
    };
    let scale = motion.flow_scale.unwrap_or([1.0; 2]);
    let known = |[u, v]: [f32; 2]| u.abs() <= UNKNOWN_PX && v.abs() <= UNKNOWN_PX;
    let scaled = |uv: [f32; 2]| [0, 1].map(|k: usize| (f64::from(uv[k]) * scale[k]) as f32);
    let px: Vec<[f32; 2]> =
        values.into_iter().map(|uv| if known(uv) { scaled(uv) } else { [f32::NAN; 2] }).collect();
    // Unknown flow has become NaN above, so other values beyond the limit come from the scale.
    if px.iter().any(|uv| !uv[0].is_nan() && !known(*uv)) {
        return Err(failure(
            path,
            format!(
                "times motion.flow_scale = {scale:?} is more than 1e9 pixels: the scale makes pixels of what \
                    the file holds"
            ),
        ));
    }
    if px.iter().all(|uv| uv[0].is_nan()) {
        return Err(failure(
            path,
            "has no pixel whose flow is known: values are pixels, and more than 1e9 is none",
        ));
    }
    Ok((FlowField { size_px, px, interval_s: 1e-3 * motion.flow_interval_ms.unwrap_or_default() }, origin_px))
}

/// Reads two channels of an EXR.
fn read_exr_flow(path: &Path, motion: &MotionSpec) -> Result<FlowValues, FrameFileError> {
    let picture = read_exr(path)?;
    let error = |message: String| failure(path, message);
    let [u, v] = match motion.flow_channels.as_deref() {
        Some([u, v]) => [picture.plane(u).map_err(error)?, picture.plane(v).map_err(error)?],
        _ => picture.pair().map_err(error)?,
    };
    if u.name == v.name {
        return Err(failure(
            path,
            format!(
                "has one channel {} for both names of motion.flow_channels: give that to the right, and that \
                    down",
                u.name
            ),
        ));
    }
    if u.size_px != v.size_px || u.origin_px != v.origin_px {
        return Err(failure(
            path,
            format!("has flow channels of different sizes or positions: {} {}", u.name, v.name),
        ));
    }
    Ok((u.size_px, u.values.iter().zip(&v.values).map(|(u, v)| [*u, *v]).collect(), Some(u.origin_px)))
}

/// Reads a Middlebury `.flo` file.
fn read_flo(path: &Path) -> Result<FlowValues, FrameFileError> {
    let bytes = std::fs::read(path).map_err(|error| {
        failure(path, format!("cannot be read: {error}; paths are relative to FRAME.toml"))
    })?;
    let mut words = bytes.chunks_exact(4).map(|word| [word[0], word[1], word[2], word[3]]);
    if words.next().map(f32::from_le_bytes) != Some(FLO_TAG) {
        return Err(failure(
            path,
            "is no Middlebury .flo file (they begin with PIEH), no .npy, and no EXR by its name: a flow is \
                one of these",
        ));
    }
    let side = |word: Option<[u8; 4]>| word.map_or(0, u32::from_le_bytes);
    let size_px = [side(words.next()), side(words.next())];
    let values: Vec<f32> = words.map(f32::from_le_bytes).collect();
    let pixels = u64::from(size_px[0]) * u64::from(size_px[1]);
    if pixels == 0 || pixels.checked_mul(2) != Some(values.len() as u64) || bytes.len() % 4 != 0 {
        let [width, height] = size_px;
        return Err(failure(
            path,
            format!(
                "says {width}x{height} pixels and holds {} numbers: it is cut off or damaged",
                values.len()
            ),
        ));
    }
    Ok((size_px, values.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect(), None))
}
