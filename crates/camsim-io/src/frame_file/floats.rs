//! Depth in PFM files (AirSim) and TIFF files (what OpenCV makes of an array of floats, or of 16-bit
//! numbers).

use std::path::Path;

use super::{DepthKind, DepthRows, FrameFileError, FrameSpec, images::failure};
use crate::terrain::{
    TerrainFileError, metres_per_unit_name,
    raster::{Raster, is_tiff},
    read_sidecar_mask, read_sidecar_tags,
};

/// The numbers of a depth picture, row by row from the top.
pub(super) struct Stored {
    pub(super) size_px: [u32; 2],
    pub(super) values: Vec<f64>,
    pub(super) unit: Unit,
    /// What there is to say about the file.
    pub(super) notes: Vec<String>,
}

/// What the numbers are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unit {
    /// Whole numbers, whose unit must be said.
    Whole,
    /// Metres, unless something else is said.
    Floats,
    /// Metres by what the file states of scale and unit.
    Stated,
    /// Metres out of bytes, by a formula.
    Packed,
}

/// The numbers of a PFM or a TIFF file, told by content; `None` if it is neither.
pub(super) fn read(
    path: &Path,
    spec: &FrameSpec,
    frame_path: &Path,
) -> Result<Option<Stored>, FrameFileError> {
    let key = |message: &str| FrameFileError::Key {
        path: frame_path.into(),
        key: "depth_rows",
        message: message.to_owned(),
    };
    // What cannot be opened is told of by whoever reads pictures.
    let Ok(tiff) = is_tiff(path) else { return Ok(None) };
    let pfm = !tiff && begins_as_pfm(path);
    match spec.depth_rows {
        Some(_) if !pfm => Err(key("is for PFM, and depth is none; leave it out")),
        Some(rows) => read_pfm(path, rows).map(Some),
        None if pfm => Err(key(
            "is missing: a PFM begins with the bottom row by its definition (\"bottom-up\"), and with the top one as AirSim writes it (\"top-down\")",
        )),
        None if tiff => read_tiff(path, spec, frame_path).map(Some),
        None => Ok(None),
    }
}

fn read_tiff(path: &Path, spec: &FrameSpec, frame_path: &Path) -> Result<Stored, FrameFileError> {
    let mut raster = Raster::read(path).map_err(|error| failure(path, error.reason()))?;
    read_sidecar_tags(path, &mut raster.geo).map_err(|error| match error {
        TerrainFileError::Meaning { path, problem } => failure(&path, problem),
        other => failure(path, other.to_string()),
    })?;
    read_sidecar_mask(path, &mut raster)
        .map_err(|error| failure(path, format!("has a mask beside it that {}", error.reason())))?;
    let Some(whole) = raster.is_integer_depth() else {
        return Err(failure(
            path,
            "is a TIFF that is not of one channel of floats or 16-bit whole numbers: save depth as one of these",
        ));
    };
    let unit = if whole { Unit::Whole } else { Unit::Floats };
    let pixels = raster.size[0] as usize * raster.size[1] as usize;
    let stated = stated(&raster, path, spec, frame_path)?;
    let [scale, offset] = stated.as_ref().map_or([1.0, 0.0], |stated| stated.metres);
    // GDAL's mark for what is not known, of the number before its scale.
    let known = |value: f64| if raster.geo.nodata == Some(value) { f64::NAN } else { scale * value + offset };
    let values = (0..pixels)
        .map(|pixel| if raster.is_valid(pixel) { known(raster.value(pixel)) } else { f64::NAN })
        .collect();
    let unit = if stated.is_some() && spec.depth_kind != DepthKind::Inverse { Unit::Stated } else { unit };
    Ok(Stored {
        size_px: raster.size,
        values,
        unit,
        notes: stated.map(|stated| stated.note).into_iter().collect(),
    })
}

/// What a TIFF states of its numbers.
struct Stated {
    /// Depth in metres is the first times the number stored, and the second more; of inverse depth, what
    /// depth_per_metre is for.
    metres: [f64; 2],
    note: String,
}

/// Scale, offset and unit of GDAL, from the file or from beside it; `None` where it states none.
fn stated(
    raster: &Raster,
    path: &Path,
    spec: &FrameSpec,
    frame_path: &Path,
) -> Result<Option<Stated>, FrameFileError> {
    let Some(band) = raster.geo.bands.first() else { return Ok(None) };
    if band.scale.is_none() && band.offset.is_none() && band.unit.is_none() {
        return Ok(None);
    }
    let key = |key, message: String| FrameFileError::Key { path: frame_path.into(), key, message };
    let (scale, offset) = (band.scale.unwrap_or(1.0), band.offset.unwrap_or(0.0));
    let plain = scale == 1.0 && offset == 0.0;
    // Writers put a scale of 1 beside numbers of any unit.
    if plain && band.unit.is_none() {
        return Ok(None);
    }
    if scale == 0.0 {
        return Err(failure(path, "states a scale of 0 (GDAL_METADATA): correct the file"));
    }
    let unit_m = band.unit.as_deref().map(metres_per_unit_name);
    let said = format!(
        "SCALE {scale}, OFFSET {offset}, UNITTYPE {} (GDAL_METADATA)",
        band.unit.as_ref().map_or("none".to_owned(), |unit| format!("`{unit}`"))
    );
    let name = path.display();
    if spec.depth_kind == DepthKind::Inverse {
        if let Some(Some(_)) = unit_m {
            return Err(key(
                "depth_kind",
                format!("is \"inverse\", but {name} states a length: {said}; correct one of them"),
            ));
        }
        let note = format!("{name}: its {said} are applied ahead of depth_per_metre");
        return Ok(Some(Stated { metres: [scale, offset], note }));
    }
    let unit_m = match (unit_m, spec.depth_per_metre) {
        // The key says what the unit's name does not.
        (Some(None), Some(_)) if plain => return Ok(None),
        (Some(None), _) => {
            let fix =
                "write the unit as m, cm, mm, km or ft, or take these marks away and set depth_per_metre";
            return Err(failure(path, format!("states a unit that is not known: {said}: {fix}")));
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
                "is {per_metre}, but {name} states another: {said}; leave the key out, or take these marks out of the file"
            ),
        ));
    }
    let unit = if band.unit.is_none() { "; without a unit they are metres" } else { "" };
    let note = format!(
        "{name}: its {said} are applied: depth in metres is {} times the number stored plus {}{unit}",
        metres[0], metres[1]
    );
    Ok(Some(Stated { metres, note }))
}

fn begins_as_pfm(path: &Path) -> bool {
    use std::io::Read;
    let mut start = [0; 3];
    let read = std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut start));
    read.is_ok() && matches!(start, [b'P', b'f' | b'F', next] if next.is_ascii_whitespace())
}

/// `Pf`, width, height, a number whose sign tells the byte order and whose magnitude is a factor, one white
/// space, and the rows.
fn read_pfm(path: &Path, rows: DepthRows) -> Result<Stored, FrameFileError> {
    let bytes = std::fs::read(path).map_err(|error| failure(path, format!("cannot be read: {error}")))?;
    let wrong = |message: String| failure(path, message);
    let (words, data) =
        header(&bytes).ok_or_else(|| wrong("is a PFM that ends within its header".to_owned()))?;
    if words[0] == "PF" {
        return Err(wrong("is a PFM of three channels (PF): depth is of one (Pf)".to_owned()));
    }
    let side = |word: &str| word.parse::<u32>().ok().filter(|side| *side > 0);
    let order = words[3].parse::<f64>().ok().filter(|scale| scale.is_finite() && *scale != 0.0);
    let (Some(width), Some(height), Some(order)) = (side(words[1]), side(words[2]), order) else {
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
        f64::from(if order < 0.0 { f32::from_le_bytes(bytes) } else { f32::from_be_bytes(bytes) })
    };
    let mut lines: Vec<&[u8]> = data.chunks_exact(4 * width as usize).collect();
    if rows == DepthRows::BottomUp {
        lines.reverse();
    }
    let factor = order.abs();
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
    Ok(Stored { size_px: [width, height], values, unit: Unit::Floats, notes })
}

/// Four words, and what follows the one white space after them.
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
