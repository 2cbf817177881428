//! `checksums.csv`: size and CRC-32 of each file of a folder, so that what a disk or a transfer damaged is found.

use std::{
    fs::{self, File},
    io::{self, Read},
    path::Path,
};

use rayon::prelude::*;

use super::{MergeError, files_below};
use crate::write::write_atomic;

/// Name of the table in an output folder.
pub const CHECKSUMS_FILE: &str = "checksums.csv";

/// Columns of the table. Paths are relative to the folder; the CRC-32 is that of zip and PNG files, hexadecimal.
const COLUMNS: &str = "path,bytes,crc32";

/// Writes `checksums.csv` for all files of an output folder; the number of files.
///
/// # Errors
/// A file cannot be read, or the table not be written.
pub fn write_checksums(folder: &Path) -> Result<u64, MergeError> {
    let mut files = files_below(folder)?;
    files.sort();
    let rows: Vec<String> = files
        .par_iter()
        .map(|file| {
            let path = folder.join(file);
            let (bytes, crc) = checksum(&path).map_err(|source| MergeError::Read { path, source })?;
            Ok(format!("{},{bytes},{crc:08x}\n", portable(file)))
        })
        .collect::<Result<_, MergeError>>()?;
    write_atomic(&folder.join(CHECKSUMS_FILE), format!("{COLUMNS}\n{}", rows.concat()).as_bytes())?;
    Ok(rows.len() as u64)
}

/// Checks all files in the table of a folder; `false` if there is no table.
pub(super) fn check(folder: &Path) -> Result<bool, MergeError> {
    let table = folder.join(CHECKSUMS_FILE);
    let text = match fs::read_to_string(&table) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        Err(source) => return Err(MergeError::Read { path: table, source }),
    };
    let rows: Vec<(usize, &str)> = text.lines().enumerate().skip(1).collect();
    rows.into_par_iter().try_for_each(|(line, row)| {
        let mut fields = row.rsplitn(3, ',');
        let (Some(crc), Some(bytes), Some(file)) = (fields.next(), fields.next(), fields.next()) else {
            let message = format!("line {} is not `{COLUMNS}`: render the shard again with --resume", line + 1);
            return Err(MergeError::File { path: table.clone(), message });
        };
        let path = folder.join(file);
        let (found_bytes, found_crc) =
            checksum(&path).map_err(|source| MergeError::Read { path: path.clone(), source })?;
        if bytes == found_bytes.to_string() && crc == format!("{found_crc:08x}") {
            return Ok(());
        }
        let message = format!(
            "has {found_bytes} bytes and CRC-32 {found_crc:08x} where {CHECKSUMS_FILE} says {bytes} and {crc}: remove \
             it and render the shard again with --resume"
        );
        Err(MergeError::File { path, message })
    })?;
    Ok(true)
}

/// Size and CRC-32 of a file.
fn checksum(path: &Path) -> io::Result<(u64, u32)> {
    let mut file = File::open(path)?;
    let (mut hasher, mut size, mut buffer) = (crc32fast::Hasher::new(), 0, vec![0; 1 << 20]);
    loop {
        let count = file.read(&mut buffer)?;
        if count == 0 {
            return Ok((size, hasher.finalize()));
        }
        hasher.update(&buffer[..count]);
        size += count as u64;
    }
}

/// A relative path with `/` between its parts.
fn portable(path: &Path) -> String {
    path.iter().map(|part| part.to_string_lossy()).collect::<Vec<_>>().join("/")
}
