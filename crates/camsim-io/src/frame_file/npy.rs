//! Reads NumPy `.npy` files: arrays of numbers in either byte order, row-major or column-major.

use std::path::Path;

use half::f16;

use super::{FrameFileError, images::failure};

/// An array.
#[derive(Debug)]
pub(super) struct NpyArray {
    /// Lengths of the axes.
    pub shape: Vec<usize>,
    /// Elements in row-major order.
    pub values: Vec<f64>,
    /// Whether the elements are stored as integers.
    pub is_integer: bool,
}

/// Maximum number of elements of a file.
const MAX_ELEMENTS: usize = 1 << 29;

/// Reads a `.npy` file, detected by its signature; `None` for other files.
///
/// # Errors
/// The file is an archive of arrays (`.npz`), is cut off, or has elements of an unsupported type.
pub(super) fn read(path: &Path) -> Result<Option<NpyArray>, FrameFileError> {
    use std::io::Read;
    let mut start = [0; 6];
    // Files that cannot be opened are reported by the reader of other pictures.
    let Ok(()) = std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut start)) else {
        return Ok(None);
    };
    let named_npz = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("npz"));
    if named_npz || start.starts_with(b"PK\x03\x04") {
        let message = "is an archive of arrays (.npz): take the array out of it, `numpy.save(\"depth.npy\", \
            numpy.load(\"FILE.npz\")[\"NAME\"])`";
        return Err(failure(path, message));
    }
    if start != *b"\x93NUMPY" {
        return Ok(None);
    }
    let bytes = std::fs::read(path).map_err(|error| failure(path, format!("cannot be read: {error}")))?;
    parse(&bytes).map(Some).map_err(|message| failure(path, message))
}

fn parse(bytes: &[u8]) -> Result<NpyArray, String> {
    let truncated = || "is a .npy file that ends within its header".to_owned();
    let unsigned = |offset: usize, size: usize| {
        bytes
            .get(offset..offset + size)
            .map(|b| b.iter().rev().fold(0_usize, |sum, byte| sum << 8 | usize::from(*byte)))
    };
    let (length, start): (usize, usize) = match bytes.get(6).ok_or_else(truncated)? {
        1 => (unsigned(8, 2).ok_or_else(truncated)?, 10),
        _ => (unsigned(8, 4).ok_or_else(truncated)?, 12),
    };
    let header = start.checked_add(length).and_then(|end| bytes.get(start..end)).ok_or_else(truncated)?;
    let header =
        std::str::from_utf8(header).map_err(|_| "is a .npy file whose header is no text".to_owned())?;
    let header_error =
        |key: &str| format!("is a .npy file whose header has no {key} that can be read: {}", header.trim());
    let kind = header_value(header, "descr")
        .and_then(|text| text.strip_prefix('\'')?.split('\'').next())
        .ok_or_else(|| header_error("descr"))?;
    let is_fortran_order = match header_value(header, "fortran_order") {
        Some(text) if text.starts_with("True") => true,
        Some(text) if text.starts_with("False") => false,
        _ => return Err(header_error("fortran_order")),
    };
    let shape = header_value(header, "shape")
        .and_then(|text| text.strip_prefix('(')?.split(')').next())
        .ok_or_else(|| header_error("shape"))?;
    let sides = shape.split(',').map(str::trim).filter(|side| !side.is_empty()).map(str::parse);
    let shape: Vec<usize> = sides.collect::<Result<_, _>>().map_err(|_| header_error("shape"))?;
    let count = shape
        .iter()
        .try_fold(1_usize, |all, side| all.checked_mul(*side))
        .filter(|count| (1..=MAX_ELEMENTS).contains(count));
    let count = count.ok_or_else(|| format!("is a .npy file of shape {shape:?}: that is no picture"))?;
    let (size, number, is_integer) = element_type(kind).ok_or_else(|| {
        format!(
            "is a .npy file of elements `{kind}`: floats (f2, f4, f8) and integers (u2, u4, i2, i4, i8) \
            are read; convert with `.astype(\"float32\")`"
        )
    })?;
    let data = &bytes[start + length..];
    if data.len() != count * size {
        return Err(format!(
            "says {shape:?} elements of {size} bytes and holds {} bytes: it is cut off or damaged",
            data.len()
        ));
    }
    let stored: Vec<f64> = data.chunks_exact(size).map(number).collect();
    Ok(NpyArray {
        values: if is_fortran_order { to_row_major(&stored, &shape) } else { stored },
        shape,
        is_integer,
    })
}

/// The text after a key of the header, which is a Python dictionary.
fn header_value<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let (_, after) = header.split_once(&format!("'{key}'"))?;
    Some(after.trim_start().strip_prefix(':')?.trim_start())
}

/// Converts the bytes of an element.
type ParseNumber = fn(&[u8]) -> f64;

/// Size of an element in bytes, the function that reads it, and whether it is an integer.
fn element_type(kind: &str) -> Option<(usize, ParseNumber, bool)> {
    macro_rules! element {
        ($type:ty, $from:ident, $is_integer:expr) => {
            Some((
                size_of::<$type>(),
                |b| <$type>::$from(b.try_into().unwrap_or_default()).into_f64(),
                $is_integer,
            ))
        };
    }
    match kind {
        "<f2" => element!(f16, from_le_bytes, false),
        ">f2" => element!(f16, from_be_bytes, false),
        "<f4" => element!(f32, from_le_bytes, false),
        ">f4" => element!(f32, from_be_bytes, false),
        "<f8" => element!(f64, from_le_bytes, false),
        ">f8" => element!(f64, from_be_bytes, false),
        "<u2" => element!(u16, from_le_bytes, true),
        ">u2" => element!(u16, from_be_bytes, true),
        "<i2" => element!(i16, from_le_bytes, true),
        ">i2" => element!(i16, from_be_bytes, true),
        "<u4" => element!(u32, from_le_bytes, true),
        ">u4" => element!(u32, from_be_bytes, true),
        "<i4" => element!(i32, from_le_bytes, true),
        ">i4" => element!(i32, from_be_bytes, true),
        "<i8" => element!(i64, from_le_bytes, true),
        ">i8" => element!(i64, from_be_bytes, true),
        _ => None,
    }
}

trait IntoF64 {
    fn into_f64(self) -> f64;
}

macro_rules! into_f64 {
    ($($type:ty),*) => { $(impl IntoF64 for $type { fn into_f64(self) -> f64 { self as f64 } })* };
}
into_f64!(f32, f64, u16, i16, u32, i32, i64);

impl IntoF64 for f16 {
    fn into_f64(self) -> f64 {
        self.to_f64()
    }
}

/// Converts column-major to row-major order.
fn to_row_major(stored: &[f64], shape: &[usize]) -> Vec<f64> {
    let mut position = vec![0; shape.len()];
    let mut out = Vec::with_capacity(stored.len());
    for _ in 0..stored.len() {
        let (index, _) = position
            .iter()
            .zip(shape)
            .fold((0, 1), |(index, stride), (coordinate, side)| (index + coordinate * stride, stride * side));
        out.push(stored[index]);
        for (coordinate, side) in position.iter_mut().zip(shape).rev() {
            *coordinate += 1;
            if *coordinate < *side {
                break;
            }
            *coordinate = 0;
        }
    }
    out
}

impl NpyArray {
    /// Width and height of a picture of one channel: shape (H, W), (H, W, 1) or (1, H, W).
    pub(super) fn plane(&self) -> Result<[u32; 2], String> {
        let [height, width] = match self.shape[..] {
            [height, width] | [height, width, 1] | [1, height, width] => [height, width],
            _ => {
                let fix = "depth is of rows and columns, (H, W), with an axis of 1 or without; take one \
                    channel or one frame out of it";
                return Err(format!("is a .npy file of shape {:?}: {fix}", self.shape));
            }
        };
        Ok([width, height].map(|side| u32::try_from(side).unwrap_or(u32::MAX)))
    }

    /// Size and pixels of a picture of two channels: shape (H, W, 2) or (2, H, W).
    pub(super) fn pairs(&self) -> Result<([u32; 2], Vec<[f32; 2]>), String> {
        let (height, width, is_planar) = match self.shape[..] {
            [height, width, 2] if height != 2 => (height, width, false),
            [2, height, width] if width != 2 => (height, width, true),
            _ => {
                return Err(format!(
                    "is a .npy file of shape {:?}: a flow is of rows, columns and two numbers, (H, W, 2) or \
                        (2, H, W)",
                    self.shape
                ));
            }
        };
        let pixels = height * width;
        let pair = |i: usize| if is_planar { [i, pixels + i] } else { [2 * i, 2 * i + 1] };
        let values = (0..pixels).map(|i| pair(i).map(|index| self.values[index] as f32)).collect();
        Ok(([width, height].map(|side| u32::try_from(side).unwrap_or(u32::MAX)), values))
    }
}

#[cfg(test)]
mod tests;
