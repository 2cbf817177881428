//! TIFF directories: tags and their values.

use std::{
    fs::File,
    io::{Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

use super::tag;
use crate::raster::pictures::PictureError;

/// Largest number of directories.
const MAX_DIRECTORIES: usize = 4096;

/// A TIFF file that is open for reading.
#[derive(Debug)]
pub(crate) struct TiffFile {
    pub path: PathBuf,
    /// Length of the file.
    pub bytes: u64,
    file: File,
    is_big_endian: bool,
    pub directories: Vec<Directory>,
}

/// Tags of one picture, mask or overview.
#[derive(Clone, Debug, Default)]
pub(crate) struct Directory {
    entries: Vec<Entry>,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    tag: u16,
    kind: u16,
    count: u64,
    /// The value, or its offset in the file.
    inline: [u8; 8],
    /// Number of bytes of `inline` that the file has: 4, or 8 in BigTIFF.
    inline_bytes: u64,
}

impl Directory {
    pub fn has(&self, tag: u16) -> bool {
        self.entries.iter().any(|entry| entry.tag == tag)
    }
}

const TRUNCATED: &str = "the file is truncated";

/// Whether a file begins with the TIFF or BigTIFF signature.
pub(crate) fn is_tiff(path: &Path) -> Result<bool, PictureError> {
    let mut start = Vec::new();
    let file = File::open(path).map_err(|source| PictureError::open(path, source))?;
    file.take(4).read_to_end(&mut start).map_err(|source| PictureError::open(path, source))?;
    Ok(matches!(start[..], [b'I', b'I', 42 | 43, 0] | [b'M', b'M', 0, 42 | 43]))
}

impl TiffFile {
    pub fn open(path: &Path) -> Result<Self, PictureError> {
        if !is_tiff(path)? {
            return Err(PictureError::decode(path, "not a TIFF file"));
        }
        let file = File::open(path).map_err(|source| PictureError::open(path, source))?;
        let bytes = file.metadata().map_err(|source| PictureError::open(path, source))?.len();
        let mut tiff = Self { path: path.into(), bytes, file, is_big_endian: false, directories: Vec::new() };
        tiff.read_directories().map_err(|reason| PictureError::decode(path, reason))?;
        Ok(tiff)
    }

    pub fn is_big_endian(&self) -> bool {
        self.is_big_endian
    }

    /// Bytes at an offset of the file.
    pub fn read_at(&mut self, offset: u64, count: u64) -> Result<Vec<u8>, String> {
        if offset.checked_add(count).is_none_or(|end| end > self.bytes) {
            return Err(TRUNCATED.into());
        }
        let mut bytes = vec![0; usize::try_from(count).map_err(|_| TRUNCATED)?];
        self.file
            .seek(SeekFrom::Start(offset))
            .and_then(|_| self.file.read_exact(&mut bytes))
            .map_err(|error| error.to_string())?;
        Ok(bytes)
    }

    fn read_directories(&mut self) -> Result<(), String> {
        let header = self.read_at(0, 8)?;
        self.is_big_endian = header[0] == b'M';
        let is_big = header[2..4].contains(&43);
        let mut next = self.unsigned(&header[4..8]);
        if is_big {
            // Offsets have eight bytes; two bytes of zero follow.
            if next != if self.is_big_endian { 8 << 16 } else { 8 } {
                return Err("not a BigTIFF with offsets of 8 bytes".into());
            }
            let offset = self.read_at(8, 8)?;
            next = self.unsigned(&offset);
        }
        let mut visited = Vec::new();
        while next != 0 {
            if visited.contains(&next) || visited.len() == MAX_DIRECTORIES {
                return Err("its directories form a loop".into());
            }
            visited.push(next);
            let [count_bytes, entry_bytes, inline_bytes] = if is_big { [8, 20, 8] } else { [2, 12, 4] };
            let count = self.read_at(next, count_bytes)?;
            let count = self.unsigned(&count);
            let length = count
                .checked_mul(entry_bytes)
                .and_then(|bytes| bytes.checked_add(inline_bytes))
                .ok_or(TRUNCATED)?;
            let table = self.read_at(next + count_bytes, length)?;
            let (entries, link) = table.split_at((length - inline_bytes) as usize);
            let entries = entries.chunks_exact(entry_bytes as usize).map(|entry| {
                let (header, value) = entry.split_at(entry.len() - inline_bytes as usize);
                let mut inline = [0; 8];
                inline[..value.len()].copy_from_slice(value);
                let [tag, kind] = [&header[..2], &header[2..4]].map(|bytes| self.unsigned(bytes) as u16);
                Entry { tag, kind, count: self.unsigned(&header[4..]), inline, inline_bytes }
            });
            let directory = Directory { entries: entries.collect() };
            self.directories.push(directory);
            next = self.unsigned(link);
        }
        if self.directories.is_empty() { Err("it has no picture".into()) } else { Ok(()) }
    }

    /// The bytes of a value, with the number of its type.
    fn value(&mut self, directory: &Directory, tag: u16) -> Result<Option<(u16, Vec<u8>)>, String> {
        let Some(entry) = directory.entries.iter().find(|entry| entry.tag == tag).copied() else {
            return Ok(None);
        };
        let bytes = (size_of_kind(entry.kind) as u64).checked_mul(entry.count).ok_or(TRUNCATED)?;
        if bytes <= entry.inline_bytes {
            return Ok(Some((entry.kind, entry.inline[..bytes as usize].to_vec())));
        }
        let offset = self.unsigned(&entry.inline[..entry.inline_bytes as usize]);
        Ok(Some((entry.kind, self.read_at(offset, bytes)?)))
    }

    /// A tag's integers.
    pub fn integers(&mut self, directory: &Directory, tag: u16) -> Result<Option<Vec<u64>>, String> {
        let Some((kind, bytes)) = self.value(directory, tag)? else { return Ok(None) };
        if !matches!(kind, 1 | 3 | 4 | 13 | 16 | 18) {
            return Err(format!("tag {tag} is not a list of integers"));
        }
        Ok(Some(bytes.chunks_exact(size_of_kind(kind)).map(|bytes| self.unsigned(bytes)).collect()))
    }

    /// A tag's first integer.
    pub fn integer(&mut self, directory: &Directory, tag: u16) -> Result<Option<u64>, String> {
        Ok(self.integers(directory, tag)?.and_then(|list| list.first().copied()))
    }

    /// A tag's numbers.
    pub fn reals(&mut self, directory: &Directory, tag: u16) -> Result<Option<Vec<f64>>, String> {
        let Some((kind, bytes)) = self.value(directory, tag)? else { return Ok(None) };
        let real = |bytes: &[u8]| match kind {
            11 => f64::from(f32::from_bits(self.unsigned(bytes) as u32)),
            12 => f64::from_bits(self.unsigned(bytes)),
            _ => self.unsigned(bytes) as f64,
        };
        if !matches!(kind, 1 | 3 | 4 | 11 | 12 | 16) {
            return Err(format!("tag {tag} is not a list of numbers"));
        }
        Ok(Some(bytes.chunks_exact(size_of_kind(kind)).map(real).collect()))
    }

    /// A tag's bytes.
    pub fn bytes_of(&mut self, directory: &Directory, tag: u16) -> Result<Option<Vec<u8>>, String> {
        Ok(self.value(directory, tag)?.map(|(_, bytes)| bytes))
    }

    /// A tag's text, up to the first zero byte.
    pub fn text(&mut self, directory: &Directory, tag: u16) -> Result<Option<String>, String> {
        let text = |bytes: Vec<u8>| {
            let end = bytes.iter().position(|&byte| byte == 0).unwrap_or(bytes.len());
            String::from_utf8_lossy(&bytes[..end]).into_owned()
        };
        Ok(self.bytes_of(directory, tag)?.map(text))
    }

    /// Width and height; both at least 1.
    pub fn size(&mut self, directory: &Directory) -> Result<[u32; 2], String> {
        let mut side = |tag| match self.integer(directory, tag)? {
            Some(side @ 1..) if side <= u64::from(u32::MAX) => Ok(side as u32),
            Some(side) => Err(format!("a side of {side} pixels is impossible")),
            None => Err("it has no size".to_owned()),
        };
        Ok([side(tag::IMAGE_WIDTH)?, side(tag::IMAGE_LENGTH)?])
    }

    /// An unsigned integer in the file's byte order.
    fn unsigned(&self, bytes: &[u8]) -> u64 {
        let add = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
        if self.is_big_endian { bytes.iter().fold(0, add) } else { bytes.iter().rev().fold(0, add) }
    }
}

/// Size of a value of a type, bytes.
fn size_of_kind(kind: u16) -> usize {
    match kind {
        3 | 8 => 2,
        4 | 9 | 11 | 13 => 4,
        5 | 10 | 12 | 16 | 17 | 18 => 8,
        _ => 1,
    }
}
