//! Joins tables whose first column is a frame number, in ascending order. Memory does not grow with their length.

use std::{
    fs::File,
    io::{self, BufRead, BufReader, Write},
    path::{Path, PathBuf},
};

use super::MergeError;
use crate::write::write_atomic_with;

/// A table that is read row by row.
struct Rows {
    path: PathBuf,
    reader: BufReader<File>,
    /// The next row with its line feed, and its frame.
    next: Option<(u64, String)>,
}

impl Rows {
    /// Opens a table; returns its header, too.
    fn open(path: &Path) -> Result<(Self, String), MergeError> {
        let file = File::open(path).map_err(|source| MergeError::Read { path: path.into(), source })?;
        let mut rows = Self { path: path.into(), reader: BufReader::new(file), next: None };
        let header = rows.line()?.unwrap_or_default();
        rows.advance()?;
        Ok((rows, header))
    }

    fn line(&mut self) -> Result<Option<String>, MergeError> {
        let mut line = String::new();
        let read = self.reader.read_line(&mut line);
        let count = read.map_err(|source| MergeError::Read { path: self.path.clone(), source })?;
        Ok((count > 0).then_some(line))
    }

    /// Reads the row after the next one.
    fn advance(&mut self) -> Result<(), MergeError> {
        self.next = match self.line()? {
            None => None,
            Some(row) => {
                let frame = row.split(',').next().and_then(|frame| frame.parse().ok());
                let frame = frame.ok_or_else(|| MergeError::File {
                    path: self.path.clone(),
                    message: format!("a row does not begin with a frame number: {}", row.trim_end()),
                })?;
                Some((frame, row))
            }
        };
        Ok(())
    }
}

/// Writes the rows of all tables to one, in the order of frames.
pub(super) fn join(paths: &[PathBuf], out: &Path) -> Result<(), MergeError> {
    let mut tables = Vec::new();
    let mut header: Option<String> = None;
    for path in paths {
        let (rows, columns) = Rows::open(path)?;
        if header.get_or_insert_with(|| columns.clone()) != &columns {
            return Err(MergeError::File {
                path: path.clone(),
                message: format!("has other columns than {}: render the shard again", paths[0].display()),
            });
        }
        tables.push(rows);
    }
    let mut failure = None;
    let written = write_atomic_with(out, &mut |file| {
        file.write_all(header.as_deref().unwrap_or_default().as_bytes())?;
        while let Some(table) = first_of(&mut tables) {
            if let Some((_, row)) = &table.next {
                file.write_all(row.as_bytes())?;
            }
            if let Err(error) = table.advance() {
                failure = Some(error);
                return Err(io::Error::other("a table cannot be read"));
            }
        }
        Ok(())
    });
    failure.map_or(Ok(()), Err)?;
    Ok(written?)
}

/// The table with the lowest frame.
fn first_of(tables: &mut [Rows]) -> Option<&mut Rows> {
    tables
        .iter_mut()
        .filter(|table| table.next.is_some())
        .min_by_key(|table| table.next.as_ref().map(|row| row.0))
}
