//! The folder that an export writes to.

use std::{
    fs::{self, File},
    io::{self, BufWriter},
    path::{Path, PathBuf},
};

use super::{DatasetError, Watch};
use crate::write::{WriteError, write_atomic, write_atomic_with};

/// Writes files below a folder, each whole or not at all. Pictures that exist are kept: those of another run
/// were refused before.
#[derive(Clone, Copy)]
pub(crate) struct Target<'a> {
    pub(crate) folder: &'a Path,
    pub(crate) watch: &'a Watch<'a>,
}

impl Target<'_> {
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Writes a small file.
    pub(crate) fn text(&self, name: &str, text: &str) -> Result<(), DatasetError> {
        Ok(write_atomic(&self.path(name), text.as_bytes())?)
    }

    /// Writes a file piece by piece.
    pub(crate) fn stream(
        &self,
        name: &str,
        fill: &mut dyn FnMut(&mut BufWriter<File>) -> Result<(), DatasetError>,
    ) -> Result<(), DatasetError> {
        let mut failed = None;
        let written = write_atomic_with(&self.path(name), &mut |out| match fill(out) {
            Ok(()) => Ok(()),
            Err(DatasetError::Piece(error)) => Err(error),
            Err(error) => {
                failed = Some(error);
                Err(io::ErrorKind::Other.into())
            }
        });
        match failed {
            Some(error) => Err(error),
            None => Ok(written?),
        }
    }

    /// Puts a file of the run here: the same file by another name where the file system allows it, else a
    /// copy.
    pub(crate) fn link(&self, source: &Path, name: &str) -> Result<(), DatasetError> {
        let path = self.path(name);
        if path.is_file() {
            return Ok(());
        }
        let fail = |source: io::Error| WriteError::Io { path: path.clone(), source };
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(fail)?;
        }
        if fs::hard_link(source, &path).is_ok() {
            return Ok(());
        }
        let mut input = File::open(source).map_err(|error| DatasetError::Input {
            path: source.into(),
            message: format!("cannot be read: {error}; render it again with --resume"),
        })?;
        Ok(write_atomic_with(&path, &mut |out| io::copy(&mut input, out).map(drop))?)
    }

    /// Makes a picture, unless it exists.
    pub(crate) fn make(
        &self,
        name: &str,
        bytes: impl FnOnce() -> Result<Vec<u8>, DatasetError>,
    ) -> Result<(), DatasetError> {
        let path = self.path(name);
        if path.is_file() { Ok(()) } else { Ok(write_atomic(&path, &bytes()?)?) }
    }

    /// Counts a picture that is done; an error if the caller wants an end.
    pub(crate) fn advance(&self) -> Result<(), DatasetError> {
        (self.watch.advance)();
        if (self.watch.is_stopped)() { Err(DatasetError::Stopped) } else { Ok(()) }
    }
}
