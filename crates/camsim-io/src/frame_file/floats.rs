//! Depth in PFM files (as AirSim writes) and TIFF files of floats or 16-bit integers (as OpenCV writes).

use std::path::Path;

use super::{DepthKind, DepthRows, FrameFileError, FrameSpec, images::failure};
use crate::raster::{
    TerrainFileError,
    decoded::{Raster, is_tiff},
    metres_per_unit_name, read_sidecar_mask, read_sidecar_tags,
};

/// The stored numbers of a depth picture.
pub(super) struct StoredDepth {
    /// Width, height.
    pub(super) size_px: [u32; 2],
    /// Numbers, row by row from the top.
    pub(super) values: Vec<f64>,
    /// Unit of the numbers.
    pub(super) unit: DepthUnit,
    /// Notes about the file.
    pub(super) notes: Vec<String>,
}

/// Unit of the numbers of a depth picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DepthUnit {
    /// Integers, which need `depth_per_metre`.
    Integers,
    /// Floats: metres, unless `depth_per_metre` is given.
    Floats,
    /// Metres, by the scale and unit that the file states.
    Stated,
    /// Metres, decoded from packed bytes.
    Packed,
}

/// Reads a PFM or TIFF file, detected by content; `None` for other formats.
pub(super) fn read(
    path: &Path,
    spec: &FrameSpec,
    frame_path: &Path,
) -> Result<Option<StoredDepth>, FrameFileError> {
    let key = |message: &str| FrameFileError::Key {
        path: frame_path.into(),
        key: "depth_rows",
        message: message.to_owned(),
    };
    // Files that cannot be opened are reported by the reader of other pictures.
    let Ok(tiff) = is_tiff(path) else { return Ok(None) };
    let pfm = !tiff && is_pfm(path);
    match spec.depth_rows {
        Some(_) if !pfm => Err(key("is for PFM, and depth is none; leave it out")),
        Some(rows) => read_pfm(path, rows).map(Some),
        None if pfm => Err(key(
            "is missing: a PFM begins with the bottom row by its definition (\"bottom-up\"), and with the \
                top one as AirSim writes it (\"top-down\")",
        )),
        None if tiff => read_tiff(path, spec, frame_path).map(Some),
        None => Ok(None),
    }
}

fn read_tiff(path: &Path, spec: &FrameSpec, frame_path: &Path) -> Result<StoredDepth, FrameFileError> {
    let mut raster = Raster::read(path).map_err(|error| failure(path, error.reason()))?;
    read_sidecar_tags(path, &mut raster.geo).map_err(|error| match error {
        TerrainFileError::Meaning { path, problem } => failure(&path, problem),
        other => failure(path, other.to_string()),
    })?;
    read_sidecar_mask(path, &mut raster)
        .map_err(|error| failure(path, format!("has a mask beside it that {}", error.reason())))?;
    let Some(is_integer) = raster.is_integer_depth() else {
        return Err(failure(
            path,
            "is a TIFF that is not of one channel of floats or 16-bit whole numbers: save depth as one of \
                these",
        ));
    };
    let unit = if is_integer { DepthUnit::Integers } else { DepthUnit::Floats };
    let pixels = raster.size[0] as usize * raster.size[1] as usize;
    let stated = stated_scale(&raster, path, spec, frame_path)?;
    let [scale, offset] = stated.as_ref().map_or([1.0, 0.0], |stated| stated.metres);
    // GDAL_NODATA applies to the numbers before scaling.
    let metres =
        |value: f64| if raster.geo.nodata == Some(value) { f64::NAN } else { scale * value + offset };
    let values = (0..pixels)
        .map(|pixel| if raster.is_valid(pixel) { metres(raster.value(pixel)) } else { f64::NAN })
        .collect();
    let unit =
        if stated.is_some() && spec.depth_kind != DepthKind::Inverse { DepthUnit::Stated } else { unit };
    Ok(StoredDepth {
        size_px: raster.size,
        values,
        unit,
        notes: stated.map(|stated| stated.note).into_iter().collect(),
    })
}

/// Scale and offset that a TIFF states.
struct StatedScale {
    /// Scale and offset: depth in metres is `scale * number + offset`. For inverse depth the result is still
    /// to be divided by `depth_per_metre`.
    metres: [f64; 2],
    /// Note about what is applied.
    note: String,
}

/// Scale, offset and unit in GDAL metadata, of the file or a sidecar file; `None` where there are none.
///
/// # Errors
/// The unit is unknown, or contradicts FRAME.toml.
// Long because it is one table of cases.
fn stated_scale(
    raster: &Raster,
    path: &Path,
    spec: &FrameSpec,
    frame_path: &Path,
) -> Result<Option<StatedScale>, FrameFileError> {
    let Some(band) = raster.geo.bands.first() else { return Ok(None) };
    if band.scale.is_none() && band.offset.is_none() && band.unit.is_none() {
        return Ok(None);
    }
    let key = |key, message: String| FrameFileError::Key { path: frame_path.into(), key, message };
    let (scale, offset) = (band.scale.unwrap_or(1.0), band.offset.unwrap_or(0.0));
    let is_identity = scale == 1.0 && offset == 0.0;
    // Writers state a scale of 1 for numbers of any unit, so that alone says nothing.
    if is_identity && band.unit.is_none() {
        return Ok(None);
    }
    if scale == 0.0 {
        return Err(failure(path, "states a scale of 0 (GDAL_METADATA): correct the file"));
    }
    let unit_m = band.unit.as_deref().map(metres_per_unit_name);
    let statement = format!(
        "SCALE {scale}, OFFSET {offset}, UNITTYPE {} (GDAL_METADATA)",
        band.unit.as_ref().map_or("none".to_owned(), |unit| format!("`{unit}`"))
    );
    let name = path.display();
    if spec.depth_kind == DepthKind::Inverse {
        if let Some(Some(_)) = unit_m {
            return Err(key(
                "depth_kind",
                format!("is \"inverse\", but {name} states a length: {statement}; correct one of them"),
            ));
        }
        let note = format!("{name}: its {statement} are applied ahead of depth_per_metre");
        return Ok(Some(StatedScale { metres: [scale, offset], note }));
    }
    let unit_m = match (unit_m, spec.depth_per_metre) {
        // The key replaces an unknown unit.
        (Some(None), Some(_)) if is_identity => return Ok(None),
        (Some(None), _) => {
            let fix =
                "write the unit as m, cm, mm, km or ft, or take these marks away and set depth_per_metre";
            return Err(failure(path, format!("states a unit that is not known: {statement}: {fix}")));
        }
        (unit_m, _) => unit_m.flatten().unwrap_or(1.0),
    };
    let metres = [unit_m * scale, unit_m * offset];
    if let Some(per_metre) =
        spec.depth_per_metre.filter(|per_metre| offset != 0.0 || (per_metre * metres[0] - 1.0).abs() > 1e-6)
    {
        return Err(key(
            "depth_per_metre",
            format!(
                "is {per_metre}, but {name} states another: {statement}; leave the key out, or take these \
                    marks \
                    out of the file"
            ),
        ));
    }
    let unit = if band.unit.is_none() { "; without a unit they are metres" } else { "" };
    let note = format!(
        "{name}: its {statement} are applied: depth in metres is {} times the number stored plus {}{unit}",
        metres[0], metres[1]
    );
    Ok(Some(StatedScale { metres, note }))
}

/// Whether a file has the signature of a PFM.
fn is_pfm(path: &Path) -> bool {
    use std::io::Read;
    let mut start = [0; 3];
    let read = std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut start));
    read.is_ok() && matches!(start, [b'P', b'f' | b'F', next] if next.is_ascii_whitespace())
}

/// Reads a PFM: `Pf`, width, height, a scale, one white space, and the rows. The sign of the scale is the
/// byte order (negative: little-endian), its magnitude a factor of the numbers.
fn read_pfm(path: &Path, rows: DepthRows) -> Result<StoredDepth, FrameFileError> {
    let bytes = std::fs::read(path).map_err(|error| failure(path, format!("cannot be read: {error}")))?;
    let wrong = |message: String| failure(path, message);
    let (words, data) =
        header(&bytes).ok_or_else(|| wrong("is a PFM that ends within its header".to_owned()))?;
    if words[0] == "PF" {
        return Err(wrong("is a PFM of three channels (PF): depth is of one (Pf)".to_owned()));
    }
    let side = |word: &str| word.parse::<u32>().ok().filter(|side| *side > 0);
    let scale = words[3].parse::<f64>().ok().filter(|scale| scale.is_finite() && *scale != 0.0);
    let (Some(width), Some(height), Some(scale)) = (side(words[1]), side(words[2]), scale) else {
        let [_, width, height, scale] = words;
        return Err(wrong(format!(
            "is a PFM of `{width}` by `{height}` pixels and scale `{scale}`: that is no header of one"
        )));
    };
    let pixels = u64::from(width) * u64::from(height);
    if pixels.checked_mul(4) != Some(data.len() as u64) {
        return Err(wrong(format!(
            "says {width}x{height} pixels and holds {} bytes of them: it is cut off or damaged",
            data.len()
        )));
    }
    let number = |b: &[u8]| {
        let bytes = [b[0], b[1], b[2], b[3]];
        f64::from(if scale < 0.0 { f32::from_le_bytes(bytes) } else { f32::from_be_bytes(bytes) })
    };
    let mut lines: Vec<&[u8]> = data.chunks_exact(4 * width as usize).collect();
    if rows == DepthRows::BottomUp {
        lines.reverse();
    }
    let factor = scale.abs();
    let values =
        lines.into_iter().flat_map(|line| line.chunks_exact(4).map(|bytes| factor * number(bytes))).collect();
    let scaled = || {
        format!(
            "{}: the scale {} of its header is applied: depth is {factor} times the numbers stored",
            path.display(),
            words[3]
        )
    };
    let notes = if factor == 1.0 { Vec::new() } else { vec![scaled()] };
    Ok(StoredDepth { size_px: [width, height], values, unit: DepthUnit::Floats, notes })
}

/// Splits a PFM into the four words of its header and the data.
fn header(bytes: &[u8]) -> Option<([&str; 4], &[u8])> {
    let mut rest = bytes;
    let mut words = [""; 4];
    for word in &mut words {
        rest = rest.get(rest.iter().take(32).position(|byte| !byte.is_ascii_whitespace())?..)?;
        let length = rest.iter().take(32).position(u8::is_ascii_whitespace)?;
        *word = std::str::from_utf8(rest.get(..length)?).ok()?;
        rest = rest.get(length..)?;
    }
    Some((words, rest.get(1..)?))
}

#[cfg(test)]
mod tests;
