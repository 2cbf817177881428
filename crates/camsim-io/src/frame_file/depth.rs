//! Depth pictures as inverse planar depth.

use std::path::Path;

use camsim_core::temporal::IdealGeometry;
use glam::DVec2;
use image::{DynamicImage, ImageFormat};

use super::{
    DepthEncoding, DepthKind, FrameFileError, FrameSpec,
    exr_planes::read_exr,
    floats::{self, Stored},
    images::{failure, is_exr, open},
};

/// Depth of the reference program's cleared buffer, metres: all three bytes full.
const PACKED24_SKY_M: f64 = 65_281.0;
/// Stored values of one metre that 16 bits make sense of: steps from a kilometre to a micrometre.
const PER_METRE: std::ops::RangeInclusive<f64> = 1e-3..=1e6;
/// No camera sees anything nearer, metres. Its inverse and the slant of any ray fit an f32.
const NEAREST_M: f64 = 1e-6;

/// What is at least as far is no depth, metres, unless `depth_max_m` says less: no scene is as large, and Blender's background is 1e10.
const FARTHEST_M: f64 = 1e9;

/// 1/z in 1/m, 0 where there is no depth.
pub(super) fn read_inverse_depth(
    path: &Path,
    spec: &FrameSpec,
    geometry: &IdealGeometry,
    color_origin_px: Option<[i32; 2]>,
    frame_path: &Path,
) -> Result<Vec<f32>, FrameFileError> {
    let Stored { size_px, values, whole } = stored(path, spec, color_origin_px, frame_path)?;
    let per_metre = per_metre(spec.depth_per_metre, whole, frame_path)?;
    if size_px != geometry.size_px {
        let [w, h] = geometry.size_px;
        return Err(failure(
            path,
            format!("is {}x{}, but the colour is {w}x{h}: depth must have the colour's size and place", size_px[0], size_px[1]),
        ));
    }
    refuse_without_any(&values, per_metre, path)?;
    let most_m = spec.depth_max_m.unwrap_or(FARTHEST_M).min(FARTHEST_M);
    let planar = |(i, value): (usize, f64)| {
        let depth_m = value / per_metre;
        let pixel = DVec2::new((i as u32 % size_px[0]).into(), (i as u32 / size_px[0]).into());
        let slant = match spec.depth_kind {
            DepthKind::Planar => 1.0,
            DepthKind::Range => ((pixel - geometry.principal_px) / geometry.focal_px).extend(1.0).length(),
        };
        let inverse = slant / depth_m;
        if usable(depth_m) && depth_m < most_m { inverse as f32 } else { 0.0 }
    };
    Ok(values.into_iter().enumerate().map(planar).collect())
}

/// The numbers of a depth picture, in whatever kind of file.
fn stored(path: &Path, spec: &FrameSpec, color_origin_px: Option<[i32; 2]>, frame_path: &Path) -> Result<Stored, FrameFileError> {
    let fail = |key, message: &str| FrameFileError::Key { path: frame_path.into(), key, message: message.to_owned() };
    let packed = spec.depth_encoding == DepthEncoding::Packed24;
    let exr = is_exr(path);
    if let (false, Some(key)) = (exr, spec.depth_key()) {
        return Err(fail(key, "is for EXR, and depth is none; leave it out"));
    }
    let floats = if exr { Some(read_exr_depth(path, spec, color_origin_px)?) } else { floats::read(path, spec.depth_rows, frame_path)? };
    if let Some(found) = floats {
        let message = "\"packed24\" is of 8-bit RGB pictures, and depth is an EXR, PFM or TIFF; leave it out";
        return if packed { Err(fail("depth_encoding", message)) } else { Ok(found) };
    }
    let (picture, format) = open(path)?;
    if packed && !matches!(format, ImageFormat::Png | ImageFormat::Bmp | ImageFormat::Pnm) {
        let message = "is not lossless: depth packed into bytes must be stored byte by byte; give it as PNG, BMP or PPM";
        return Err(failure(path, message));
    }
    let size_px = [picture.width(), picture.height()];
    let values = if packed { packed24(&picture, path)? } else { whole_numbers(&picture, path)? };
    Ok(Stored { size_px, values, whole: !packed })
}

fn read_exr_depth(path: &Path, spec: &FrameSpec, color_origin_px: Option<[i32; 2]>) -> Result<Stored, FrameFileError> {
    let picture = read_exr(path)?;
    let plane = picture.depth(spec.depth_channel.as_deref(), spec.depth_layer.as_deref()).map_err(|message| failure(path, message))?;
    if color_origin_px.is_some_and(|origin_px| origin_px != plane.origin_px) {
        let message = format!(
            "{}: begins at pixel {:?} of its file, the colour elsewhere: they must cover the same pixels",
            plane.name, plane.origin_px
        );
        return Err(failure(path, message));
    }
    Ok(Stored { size_px: plane.size_px, values: plane.values.iter().map(|&z| f64::from(z)).collect(), whole: false })
}

/// Stored value of one metre.
fn per_metre(given: Option<f64>, whole: bool, frame_path: &Path) -> Result<f64, FrameFileError> {
    let message = match (given, whole) {
        (Some(per_metre), true) if PER_METRE.contains(&per_metre) => return Ok(per_metre),
        (None, false) => return Ok(1.0),
        (Some(_), true) => "must be 0.001 to 1e6: the stored value of one metre, for example 1000 for millimetres or 5000 for TUM",
        (Some(_), false) => "is for whole numbers (PNG, PGM, TIFF); EXR, PFM, TIFF of floats and packed24 are in metres: leave it out",
        (None, true) => "is missing: whole numbers need the stored value of one metre, for example 1000 for millimetres or 5000 for TUM",
    };
    Err(FrameFileError::Key { path: frame_path.into(), key: "depth_per_metre", message: message.to_owned() })
}

/// Nothing is nearer than [`NEAREST_M`]; what claims to be is no measurement either.
fn usable(depth_m: f64) -> bool {
    depth_m.is_finite() && depth_m > NEAREST_M
}

/// Gives each pixel without depth that of the nearest one with, counted in steps to the four neighbours; of several at one distance the farthest
/// surface, since what hides from a depth camera is behind what it sees. Without any depth nothing changes.
pub(super) fn fill_holes(inverse_depth: &mut [f32], [width, height]: [u32; 2]) {
    let (width, height) = (width as usize, height as usize);
    let mut front: Vec<usize> = (0..inverse_depth.len()).filter(|&i| inverse_depth[i] > 0.0).collect();
    while !front.is_empty() {
        let mut found: Vec<(usize, f32)> = Vec::new();
        for &i in &front {
            let (x, y) = (i % width, i / width);
            let neighbours = [
                (x > 0).then(|| i - 1),
                (x + 1 < width).then_some(i + 1),
                (y > 0).then(|| i - width),
                (y + 1 < height).then_some(i + width),
            ];
            found.extend(neighbours.into_iter().flatten().filter(|&at| inverse_depth[at] == 0.0).map(|at| (at, inverse_depth[i])));
        }
        // Of a pixel that is found several times the smallest inverse depth stays.
        found.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        found.dedup_by_key(|(at, _)| *at);
        found.iter().for_each(|&(at, inverse)| inverse_depth[at] = inverse);
        front = found.into_iter().map(|(at, _)| at).collect();
    }
}

/// Zeros and infinities alone may be sky. Without any depth, whatever else is there shows that the picture is in another sign or unit.
fn refuse_without_any(values: &[f64], per_metre: f64, path: &Path) -> Result<(), FrameFileError> {
    if values.iter().any(|value| usable(value / per_metre)) {
        return Ok(());
    }
    let count = |what: &dyn Fn(f64) -> bool| values.iter().filter(|value| what(**value)).count();
    let (negative, nan, near) = (count(&|z| z < 0.0), count(&f64::is_nan), count(&|z| z > 0.0 && z.is_finite()));
    if negative + nan + near == 0 {
        return Ok(());
    }
    let all = values.len();
    Err(failure(
        path,
        format!(
            "has no depth: of {all} pixels {negative} are negative, {nan} not a number, {near} nearer than a micrometre; depth is in metres and \
             positive forward (OpenGL's z is the negative of it), 0 where it is unknown"
        ),
    ))
}

fn whole_numbers(picture: &DynamicImage, path: &Path) -> Result<Vec<f64>, FrameFileError> {
    match picture {
        DynamicImage::ImageLuma16(gray) => Ok(gray.as_raw().iter().map(|&v| f64::from(v)).collect()),
        _ => Err(failure(
            path,
            "is no 16-bit grey picture: give depth as 16-bit PNG, PGM or TIFF, as EXR, PFM or TIFF of floats, or set depth_encoding = \"packed24\"",
        )),
    }
}

/// Decoded texel by texel: packed bytes must never be filtered.
fn packed24(picture: &DynamicImage, path: &Path) -> Result<Vec<f64>, FrameFileError> {
    if !matches!(picture, DynamicImage::ImageRgb8(_) | DynamicImage::ImageRgba8(_)) {
        let message = "is no 8-bit RGB picture, which depth_encoding = \"packed24\" is for; leave that key out for 16-bit grey";
        return Err(failure(path, message));
    }
    let depth_m = |[r, g, b]: [u8; 3]| f64::from(r) * 255.0 + f64::from(g) + f64::from(b) / 255.0;
    let metres = picture.to_rgb8().pixels().map(|pixel| depth_m(pixel.0)).collect::<Vec<_>>();
    Ok(metres.into_iter().map(|z| if z >= PACKED24_SKY_M { 0.0 } else { z }).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holes_take_the_nearest_and_of_two_the_farther() {
        let mut depth = [1.0, 0.0, 0.0, 0.0, 0.25, 0.0, 0.0, 0.0, 0.0, 0.0];
        fill_holes(&mut depth, [5, 2]);
        assert_eq!(depth, [1.0, 1.0, 0.25, 0.25, 0.25, 1.0, 1.0, 0.25, 0.25, 0.25]);
        let mut none = [0.0; 6];
        fill_holes(&mut none, [3, 2]);
        assert_eq!(none, [0.0; 6]);
        let mut whole = [0.5; 6];
        fill_holes(&mut whole, [2, 3]);
        assert_eq!(whole, [0.5; 6]);
    }
}
