//! Selects one of several cameras in a file.

use serde_json::Value;

use crate::shell::quoted;
use crate::text::document::{Document, KeyProblem};

/// Most names in a message.
const MOST_NAMES: usize = 12;

/// A camera in a file.
#[derive(Debug)]
pub(crate) struct CameraEntry<'a> {
    /// Name in the file; empty for a single camera without a name.
    pub(crate) name: String,
    /// Further names that select it.
    pub(crate) aliases: Vec<String>,
    /// Its part of the document.
    pub(crate) value: &'a Value,
    /// Paths of its keys in the document; empty if it is the whole document.
    pub(crate) roots: Vec<String>,
}

impl<'a> CameraEntry<'a> {
    /// A camera below one path.
    pub(crate) fn new(name: String, value: &'a Value, root: String) -> Self {
        Self { name, aliases: Vec::new(), value, roots: vec![root] }
    }

    fn has_name(&self, name: &str) -> bool {
        self.name == name || self.aliases.iter().any(|alias| alias == name)
    }

    /// A problem with the full path of its key.
    pub(crate) fn with_full_key(&self, document: &Document, problem: KeyProblem) -> KeyProblem {
        match self.roots.first() {
            Some(root) if !std::ptr::eq(self.value, &document.value) => {
                KeyProblem { key: format!("{root}.{}", problem.key), ..problem }
            }
            _ => problem,
        }
    }

    /// Whether a path belongs to this camera.
    pub(crate) fn contains(&self, path: &str) -> bool {
        self.roots.iter().any(|root| {
            path.strip_prefix(root.as_str())
                .is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        })
    }
}

/// The camera of a file with a single camera without a name.
pub(crate) fn single(document: &Document) -> Result<Vec<CameraEntry<'_>>, KeyProblem> {
    let value = &document.value;
    Ok(vec![CameraEntry { name: String::new(), aliases: Vec::new(), value, roots: Vec::new() }])
}

/// Index of the camera with a name, or of the only camera.
pub(crate) fn select(entries: &[CameraEntry<'_>], name: Option<&str>) -> Result<usize, KeyProblem> {
    let names = || {
        let first: Vec<String> =
            entries.iter().take(MOST_NAMES).map(|entry| format!("`{}`", entry.name)).collect();
        let rest = entries.len().saturating_sub(MOST_NAMES);
        first.join(", ") + &if rest > 0 { format!(" and {rest} more") } else { String::new() }
    };
    let Some(name) = name else {
        return match entries.len() {
            0 => Err(KeyProblem::new("cameras", "the file has none")),
            1 => Ok(0),
            count => Err(KeyProblem::new(
                "cameras",
                format!(
                    "there are {count} ({}): select one with `--camera {}`, or all with `--rig`",
                    names(),
                    quoted(&entries[0].name)
                ),
            )),
        };
    };
    let mut matching =
        entries.iter().enumerate().filter(|(_, entry)| entry.has_name(name)).map(|(index, _)| index);
    match (matching.next(), matching.next()) {
        (Some(index), None) => Ok(index),
        (Some(_), Some(_)) => Err(KeyProblem::new(
            "cameras",
            format!("several have the name `{name}`: rename them in the file"),
        )),
        (None, _) if entries.iter().all(|entry| entry.name.is_empty()) => Err(KeyProblem::new(
            "cameras",
            format!("the only camera has no name, and there is no `{name}`: omit `--camera`"),
        )),
        (None, _) => {
            Err(KeyProblem::new("cameras", format!("there is no `{name}`; the names are {}", names())))
        }
    }
}
