//! A file of a scenario with what was read from it.

use std::{any::Any, fmt, path::PathBuf, sync::Arc};

use serde::{Deserialize, Serialize};

/// The path of a file, and its content once the loader has read it. The content is of a type of other crates, which
/// know what the file is. Equal paths are equal, as with other files.
#[derive(Clone, Default, Serialize, Deserialize)]
#[serde(from = "PathBuf", into = "PathBuf")]
pub struct LoadedFile {
    /// The file.
    pub path: PathBuf,
    content: Option<Arc<dyn Any + Send + Sync>>,
}

impl LoadedFile {
    /// A file that has been read.
    pub fn new<T: Any + Send + Sync>(path: impl Into<PathBuf>, content: T) -> Self {
        Self { path: path.into(), content: Some(Arc::new(content)) }
    }

    /// The content; `None` before it is read, and where it is of another type.
    #[must_use]
    pub fn content<T: Any + Send + Sync>(&self) -> Option<Arc<T>> {
        self.content.clone()?.downcast().ok()
    }

    /// Whether the file has been read.
    #[must_use]
    pub fn is_read(&self) -> bool {
        self.content.is_some()
    }
}

impl From<PathBuf> for LoadedFile {
    fn from(path: PathBuf) -> Self {
        Self { path, content: None }
    }
}

impl From<LoadedFile> for PathBuf {
    fn from(file: LoadedFile) -> Self {
        file.path
    }
}

impl PartialEq for LoadedFile {
    fn eq(&self, other: &Self) -> bool {
        self.path == other.path
    }
}

impl fmt::Debug for LoadedFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}{}", self.path, if self.is_read() { "" } else { " (not read)" })
    }
}
