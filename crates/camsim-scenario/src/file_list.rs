//! One file, or several that belong together.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

/// One file, or several that make one raster together. A scenario has a path or a list of paths. A path may be
/// a folder, or have `*` and `?` in it; `camsim-io` looks up which files those are.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "Written", into = "Written")]
pub struct FileList(Vec<PathBuf>);

/// A list as a scenario has it.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Written {
    One(PathBuf),
    Several(Vec<PathBuf>),
}

impl FileList {
    /// The paths as they are written.
    #[must_use]
    pub fn paths(&self) -> &[PathBuf] {
        &self.0
    }
}

impl From<PathBuf> for FileList {
    fn from(path: PathBuf) -> Self {
        Self(vec![path])
    }
}

impl From<&Path> for FileList {
    fn from(path: &Path) -> Self {
        Self(vec![path.into()])
    }
}

impl From<Vec<PathBuf>> for FileList {
    fn from(paths: Vec<PathBuf>) -> Self {
        Self(paths)
    }
}

impl From<Written> for FileList {
    fn from(written: Written) -> Self {
        match written {
            Written::One(path) => path.into(),
            Written::Several(paths) => paths.into(),
        }
    }
}

impl From<FileList> for Written {
    fn from(mut list: FileList) -> Self {
        match (list.0.len(), list.0.pop()) {
            (1, Some(only)) => Self::One(only),
            (_, last) => Self::Several(list.0.into_iter().chain(last).collect()),
        }
    }
}
