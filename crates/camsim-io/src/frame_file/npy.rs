//! NumPy's `.npy` files: arrays of numbers, in either byte order and either order of axes.

use std::path::Path;

use half::f16;

use super::{FrameFileError, images::failure};

/// An array, its last axis fastest.
#[derive(Debug)]
pub(super) struct Array {
    pub shape: Vec<usize>,
    pub values: Vec<f64>,
    /// Of integers.
    pub whole: bool,
}

/// Elements that a file may have.
const MOST: usize = 1 << 29;

/// Reads a `.npy` file, told by its first bytes; `None` if it is none.
///
/// # Errors
/// An archive of arrays, a kind of elements that is no number, a file that is cut off.
pub(super) fn read(path: &Path) -> Result<Option<Array>, FrameFileError> {
    use std::io::Read;
    let mut start = [0; 6];
    // What cannot be opened is told of by whoever reads pictures.
    let Ok(()) = std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut start)) else {
        return Ok(None);
    };
    let named_npz = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("npz"));
    if named_npz || start.starts_with(b"PK\x03\x04") {
        let of = "is an archive of arrays (.npz): take the array out of it, `numpy.save(\"depth.npy\", \
            numpy.load(\"FILE.npz\")[\"NAME\"])`";
        return Err(failure(path, of));
    }
    if start != *b"\x93NUMPY" {
        return Ok(None);
    }
    let bytes = std::fs::read(path).map_err(|error| failure(path, format!("cannot be read: {error}")))?;
    parse(&bytes).map(Some).map_err(|message| failure(path, message))
}

fn parse(bytes: &[u8]) -> Result<Array, String> {
    let cut = || "is a .npy file that ends within its header".to_owned();
    let word = |at: usize, size: usize| {
        bytes
            .get(at..at + size)
            .map(|b| b.iter().rev().fold(0_usize, |sum, byte| sum << 8 | usize::from(*byte)))
    };
    let (length, from): (usize, usize) = match bytes.get(6).ok_or_else(cut)? {
        1 => (word(8, 2).ok_or_else(cut)?, 10),
        _ => (word(8, 4).ok_or_else(cut)?, 12),
    };
    let header = from.checked_add(length).and_then(|end| bytes.get(from..end)).ok_or_else(cut)?;
    let header =
        std::str::from_utf8(header).map_err(|_| "is a .npy file whose header is no text".to_owned())?;
    let wrong =
        |key: &str| format!("is a .npy file whose header has no {key} that can be read: {}", header.trim());
    let kind = entry(header, "descr")
        .and_then(|text| text.strip_prefix('\'')?.split('\'').next())
        .ok_or_else(|| wrong("descr"))?;
    let fortran = match entry(header, "fortran_order") {
        Some(text) if text.starts_with("True") => true,
        Some(text) if text.starts_with("False") => false,
        _ => return Err(wrong("fortran_order")),
    };
    let shape = entry(header, "shape")
        .and_then(|text| text.strip_prefix('(')?.split(')').next())
        .ok_or_else(|| wrong("shape"))?;
    let sides = shape.split(',').map(str::trim).filter(|side| !side.is_empty()).map(str::parse);
    let shape: Vec<usize> = sides.collect::<Result<_, _>>().map_err(|_| wrong("shape"))?;
    let count = shape
        .iter()
        .try_fold(1_usize, |all, side| all.checked_mul(*side))
        .filter(|count| (1..=MOST).contains(count));
    let count = count.ok_or_else(|| format!("is a .npy file of shape {shape:?}: that is no picture"))?;
    let (size, number, whole) = reader(kind).ok_or_else(|| {
        format!(
            "is a .npy file of elements `{kind}`: floats (f2, f4, f8) and integers (u2, u4, i2, i4, i8) \
            are read; convert with `.astype(\"float32\")`"
        )
    })?;
    let data = &bytes[from + length..];
    if data.len() != count * size {
        return Err(format!(
            "says {shape:?} elements of {size} bytes and holds {} bytes: it is cut off or damaged",
            data.len()
        ));
    }
    let stored: Vec<f64> = data.chunks_exact(size).map(number).collect();
    Ok(Array { values: if fortran { turned(&stored, &shape) } else { stored }, shape, whole })
}

/// What follows a key of the header, which is a Python dictionary.
fn entry<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let (_, after) = header.split_once(&format!("'{key}'"))?;
    Some(after.trim_start().strip_prefix(':')?.trim_start())
}

type Number = fn(&[u8]) -> f64;

/// Bytes of an element, how it is read, and whether it is whole.
fn reader(kind: &str) -> Option<(usize, Number, bool)> {
    macro_rules! of {
        ($type:ty, $from:ident, $whole:expr) => {
            Some((
                size_of::<$type>(),
                |b| <$type>::$from(b.try_into().unwrap_or_default()).into_f64(),
                $whole,
            ))
        };
    }
    match kind {
        "<f2" => of!(f16, from_le_bytes, false),
        ">f2" => of!(f16, from_be_bytes, false),
        "<f4" => of!(f32, from_le_bytes, false),
        ">f4" => of!(f32, from_be_bytes, false),
        "<f8" => of!(f64, from_le_bytes, false),
        ">f8" => of!(f64, from_be_bytes, false),
        "<u2" => of!(u16, from_le_bytes, true),
        ">u2" => of!(u16, from_be_bytes, true),
        "<i2" => of!(i16, from_le_bytes, true),
        ">i2" => of!(i16, from_be_bytes, true),
        "<u4" => of!(u32, from_le_bytes, true),
        ">u4" => of!(u32, from_be_bytes, true),
        "<i4" => of!(i32, from_le_bytes, true),
        ">i4" => of!(i32, from_be_bytes, true),
        "<i8" => of!(i64, from_le_bytes, true),
        ">i8" => of!(i64, from_be_bytes, true),
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

/// From the first axis fastest to the last axis fastest.
fn turned(stored: &[f64], shape: &[usize]) -> Vec<f64> {
    let mut at = vec![0; shape.len()];
    let mut out = Vec::with_capacity(stored.len());
    for _ in 0..stored.len() {
        let (index, _) = at
            .iter()
            .zip(shape)
            .fold((0, 1), |(index, stride), (place, side)| (index + place * stride, stride * side));
        out.push(stored[index]);
        for (place, side) in at.iter_mut().zip(shape).rev() {
            *place += 1;
            if *place < *side {
                break;
            }
            *place = 0;
        }
    }
    out
}

impl Array {
    /// As one channel of a picture: rows and columns, with an axis of 1 before or after them or without.
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

    /// As pixels of two numbers: (H, W, 2), or (2, H, W).
    pub(super) fn pairs(&self) -> Result<([u32; 2], Vec<[f32; 2]>), String> {
        let (height, width, apart) = match self.shape[..] {
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
        let pair = |i: usize| if apart { [i, pixels + i] } else { [2 * i, 2 * i + 1] };
        let values = (0..pixels).map(|i| pair(i).map(|at| self.values[at] as f32)).collect();
        Ok(([width, height].map(|side| u32::try_from(side).unwrap_or(u32::MAX)), values))
    }
}

#[cfg(test)]
mod tests;
