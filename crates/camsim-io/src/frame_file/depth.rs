//! Reads depth pictures as inverse planar depth.

use std::path::Path;

use camsim_core::temporal::IdealGeometry;
use glam::DVec2;
use image::{DynamicImage, ImageFormat};

use super::{
    DepthEncoding, DepthKind, FrameFileError, FrameSpec,
    exr_planes::read_exr,
    floats::{self, DepthUnit, StoredDepth},
    images::{failure, is_exr, open},
    npy,
    packed::{self, Packing},
    png_chunks::PngChunks,
};

/// Allowed values of `depth_per_metre`: steps of 16-bit integers from a kilometre to a micrometre.
const PER_METRE: std::ops::RangeInclusive<f64> = 1e-3..=1e6;
/// Depths up to this are no measurement, metres. Its inverse, times the slant of any ray, fits an f32.
const NEAREST_M: f64 = 1e-6;

/// Depths from this on are no depth, metres, unless `depth_max_m` is smaller. No scene is as large; Blender
/// writes 1e10 for the background.
const FARTHEST_M: f64 = 1e9;

/// If all depths are integers above this, they are probably not metres.
const INTEGER_DEPTH_MIN: f64 = 100.0;

/// A depth picture.
pub(super) struct Depth {
    /// 1/z in 1/m, 0 where there is no depth.
    pub(super) inverse: Vec<f32>,
    /// Notes about the picture.
    pub(super) notes: Vec<String>,
}

/// Reads a depth picture and converts it to inverse planar depth.
pub(super) fn read_depth(
    path: &Path,
    spec: &FrameSpec,
    geometry: &IdealGeometry,
    color_origin_px: Option<[i32; 2]>,
    frame_path: &Path,
) -> Result<Depth, FrameFileError> {
    let stored = read_stored(path, spec, color_origin_px, frame_path)?;
    let per_metre = per_metre(spec, &stored, frame_path)?;
    let StoredDepth { size_px, values, notes, .. } = stored;
    if size_px != geometry.size_px {
        let [w, h] = geometry.size_px;
        return Err(failure(
            path,
            format!(
                "is {}x{}, but the colour is {w}x{h}: depth must have the colour's size and position",
                size_px[0], size_px[1]
            ),
        ));
    }
    let in_metres = |value: f64| {
        if spec.depth_kind == DepthKind::Inverse { per_metre / value } else { value / per_metre }
    };
    refuse_impossible_depths(&values, in_metres, path)?;
    let max_m = spec.depth_max_m.unwrap_or(FARTHEST_M).min(FARTHEST_M);
    let planar = |(i, value): (usize, f64)| {
        let depth_m = in_metres(value);
        let pixel = DVec2::new((i as u32 % size_px[0]).into(), (i as u32 / size_px[0]).into());
        let slant = match spec.depth_kind {
            DepthKind::Planar | DepthKind::Inverse => 1.0,
            DepthKind::Range => ((pixel - geometry.principal_px) / geometry.focal_px).extend(1.0).length(),
        };
        let inverse = slant / depth_m;
        if is_measurement(depth_m) && depth_m < max_m { inverse as f32 } else { 0.0 }
    };
    Ok(Depth { inverse: values.into_iter().enumerate().map(planar).collect(), notes })
}

/// Reads the stored numbers of a depth picture of any format.
fn read_stored(
    path: &Path,
    spec: &FrameSpec,
    color_origin_px: Option<[i32; 2]>,
    frame_path: &Path,
) -> Result<StoredDepth, FrameFileError> {
    let fail = |key, message: &str| FrameFileError::Key {
        path: frame_path.into(),
        key,
        message: message.to_owned(),
    };
    let packing = match spec.depth_encoding {
        DepthEncoding::Plain => None,
        DepthEncoding::Packed24 => Some(Packing::Packed24),
        DepthEncoding::Carla => Some(Packing::Carla),
    };
    let exr = is_exr(path);
    if let (false, Some(key)) = (exr, spec.depth_key()) {
        return Err(fail(key, "is for EXR, and depth is none; leave it out"));
    }
    let floats = if exr {
        Some(read_exr_depth(path, spec, color_origin_px)?)
    } else {
        floats::read(path, spec, frame_path)?
    };
    let array = match floats {
        None if !exr => read_npy(path)?,
        floats => floats,
    };
    if let Some(array) = array {
        let Some(packing) = packing else { return Ok(array) };
        let message = format!(
            "\"{}\" is of 8-bit RGB pictures, and depth is an EXR, PFM, TIFF or .npy; leave it out",
            packing.word()
        );
        return Err(fail("depth_encoding", &message));
    }
    let (picture, format) = open(path)?;
    let note = if format == ImageFormat::Png && packing.is_none() {
        PngChunks::read(path).depth_note()
    } else {
        None
    };
    let size_px = [picture.width(), picture.height()];
    let (values, unit) = match packing {
        Some(packing) => (packed::metres(&picture, format, packing, path)?, DepthUnit::Packed),
        None => (integers(&picture, path)?, DepthUnit::Integers),
    };
    let notes = note.map(|note| format!("{}: {note}", path.display())).into_iter().collect();
    Ok(StoredDepth { size_px, values, unit, notes })
}

fn read_npy(path: &Path) -> Result<Option<StoredDepth>, FrameFileError> {
    let Some(array) = npy::read(path)? else { return Ok(None) };
    let size_px = array.plane().map_err(|message| failure(path, message))?;
    let unit = if array.is_integer { DepthUnit::Integers } else { DepthUnit::Floats };
    Ok(Some(StoredDepth { size_px, values: array.values, unit, notes: Vec::new() }))
}

fn read_exr_depth(
    path: &Path,
    spec: &FrameSpec,
    color_origin_px: Option<[i32; 2]>,
) -> Result<StoredDepth, FrameFileError> {
    let picture = read_exr(path)?;
    let plane = picture
        .depth(spec.depth_channel.as_deref(), spec.depth_layer.as_deref())
        .map_err(|message| failure(path, message))?;
    if color_origin_px.is_some_and(|origin_px| origin_px != plane.origin_px) {
        let message = format!(
            "{}: begins at pixel {:?} of its file, the colour elsewhere: they must cover the same pixels",
            plane.name, plane.origin_px
        );
        return Err(failure(path, message));
    }
    // Inverse depth read as depth would swap near and far, so a channel with such a name is refused.
    let lower = plane.name.to_lowercase();
    if let Some(word) = ["disp", "inv"]
        .into_iter()
        .find(|word| lower.contains(word))
        .filter(|_| spec.depth_kind != DepthKind::Inverse)
    {
        let fix =
            "set depth_kind = \"inverse\" if it is of 1/z, or name the channel of metres with depth_channel";
        return Err(failure(
            path,
            format!("{}: is a disparity or an inverse depth by its name (`{word}`): {fix}", plane.name),
        ));
    }
    Ok(StoredDepth {
        size_px: plane.size_px,
        values: plane.values.iter().map(|&z| f64::from(z)).collect(),
        unit: DepthUnit::Floats,
        notes: picture.notes(spec.focal_px),
    })
}

/// Stored value of one metre, or of one inverse metre for inverse depth.
///
/// # Errors
/// `depth_per_metre` is missing, not allowed, or out of range.
fn per_metre(spec: &FrameSpec, stored: &StoredDepth, frame_path: &Path) -> Result<f64, FrameFileError> {
    let (given, inverse) = (spec.depth_per_metre, spec.depth_kind == DepthKind::Inverse);
    let message = match (given, stored.unit) {
        // The scale of the file, which agrees with depth_per_metre if that is given, has been applied.
        (_, DepthUnit::Stated) => return Ok(1.0),
        (Some(_), DepthUnit::Packed) => "is for numbers; bytes of depth_encoding have their own formula in \
            metres: leave it out"
            .to_owned(),
        (Some(per_metre), _) if PER_METRE.contains(&per_metre) => return Ok(per_metre),
        (Some(_), _) => "must be 0.001 to 1e6: the stored value of one metre, for example 1000 for \
            millimetres or 5000 for TUM"
            .to_owned(),
        (None, DepthUnit::Integers | DepthUnit::Floats) if inverse => {
            "is missing: with depth_kind = \"inverse\" give the stored value of 1/m; of disparities in \
                pixels that is focal length in pixels times \
             baseline in metres"
                .to_owned()
        }
        (None, DepthUnit::Integers) => {
            "is missing: whole numbers need the stored value of one metre, for example 1000 for millimetres \
                or 5000 for TUM"
                .to_owned()
        }
        (None, DepthUnit::Floats) => match integer_range(&stored.values) {
            Some([min, max]) => format!(
                "is missing: depth is of floats, which are metres, but all of them are whole numbers from \
                    {min} to {max}, as millimetres are: give \
                 1000 for millimetres, 1 for metres"
            ),
            None => return Ok(1.0),
        },
        (None, DepthUnit::Packed) => return Ok(1.0),
    };
    Err(FrameFileError::Key { path: frame_path.into(), key: "depth_per_metre", message })
}

/// The smallest and the largest depth, if all are integers above [`INTEGER_DEPTH_MIN`]: they may be
/// millimetres.
fn integer_range(values: &[f64]) -> Option<[f64; 2]> {
    let known = || values.iter().copied().filter(|&z| is_measurement(z) && z < FARTHEST_M);
    let all_integers = known().all(|z| z.fract() == 0.0 && z > INTEGER_DEPTH_MIN);
    let [min, max] = known().fold([f64::INFINITY, 0.0], |[min, max], z| [z.min(min), z.max(max)]);
    (all_integers && max > 0.0).then_some([min, max])
}

/// Whether a depth is finite and above [`NEAREST_M`].
fn is_measurement(depth_m: f64) -> bool {
    depth_m.is_finite() && depth_m > NEAREST_M
}

/// Gives each pixel without depth that of the nearest pixel with depth, by breadth-first search over the four
/// neighbours. Of several at equal distance the farthest surface counts: what a depth camera cannot see is
/// hidden by the nearer one. Without any depth nothing changes.
pub(super) fn fill_holes(inverse_depth: &mut [f32], [width, height]: [u32; 2]) {
    let (width, height) = (width as usize, height as usize);
    let mut front: Vec<usize> = (0..inverse_depth.len()).filter(|&i| inverse_depth[i] > 0.0).collect();
    while !front.is_empty() {
        let mut filled: Vec<(usize, f32)> = Vec::new();
        for &i in &front {
            let (x, y) = (i % width, i / width);
            let neighbours = [
                (x > 0).then(|| i - 1),
                (x + 1 < width).then_some(i + 1),
                (y > 0).then(|| i - width),
                (y + 1 < height).then_some(i + width),
            ];
            filled.extend(
                neighbours
                    .into_iter()
                    .flatten()
                    .filter(|&pixel| inverse_depth[pixel] == 0.0)
                    .map(|pixel| (pixel, inverse_depth[i])),
            );
        }
        // A pixel with several filled neighbours gets the smallest inverse depth.
        filled.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        filled.dedup_by_key(|(pixel, _)| *pixel);
        filled.iter().for_each(|&(pixel, inverse)| inverse_depth[pixel] = inverse);
        front = filled.into_iter().map(|(pixel, _)| pixel).collect();
    }
}

/// Refuses a picture without any possible depth, unless it has zeros and infinities only, which may be sky.
/// Other values show that its sign or unit is wrong.
fn refuse_impossible_depths(
    values: &[f64],
    in_metres: impl Fn(f64) -> f64,
    path: &Path,
) -> Result<(), FrameFileError> {
    if values.iter().any(|value| is_measurement(in_metres(*value))) {
        return Ok(());
    }
    let count = |what: &dyn Fn(f64) -> bool| values.iter().filter(|value| what(**value)).count();
    let (negative, nan, near) =
        (count(&|z| z < 0.0), count(&f64::is_nan), count(&|z| z > 0.0 && z.is_finite()));
    if negative + nan + near == 0 {
        return Ok(());
    }
    let all = values.len();
    Err(failure(
        path,
        format!(
            "has no depth: of {all} pixels {negative} are negative, {nan} not a number, {near} nearer than a \
                micrometre; depth is in metres and \
             positive forward (OpenGL's z is the negative of it), 0 where it is unknown"
        ),
    ))
}

/// The values of a 16-bit grey picture.
fn integers(picture: &DynamicImage, path: &Path) -> Result<Vec<f64>, FrameFileError> {
    let kinds = "16-bit PNG, PGM or TIFF, or EXR, PFM, TIFF or .npy of floats";
    match picture {
        DynamicImage::ImageLuma16(gray) => Ok(gray.as_raw().iter().map(|&v| f64::from(v)).collect()),
        DynamicImage::ImageRgb8(_) | DynamicImage::ImageRgba8(_) => {
            let message = format!(
                "is an 8-bit RGB picture, whose bytes do not tell how depth was packed into them: set {}; or \
                    give it as {kinds}",
                packed::FORMULAS
            );
            Err(failure(path, message))
        }
        DynamicImage::ImageLuma8(_) | DynamicImage::ImageLumaA8(_) => {
            let message = format!(
                "is no 16-bit grey picture but an 8-bit one, as drawings of depth are, whose 256 steps are \
                    no distances: give depth as {kinds}"
            );
            Err(failure(path, message))
        }
        _ => Err(failure(path, format!("is no 16-bit grey picture of one channel: give depth as {kinds}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holes_are_filled_from_the_nearest_pixel_and_the_farther_surface() {
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
