//! Which of several cameras in a file.

use serde_json::Value;

use super::document::{Document, Problem};

/// A camera in a file.
#[derive(Debug)]
pub(super) struct Entry<'a> {
    /// What the file calls it; empty for the only camera of a file that gives no name.
    pub(super) name: String,
    /// What else it answers to.
    pub(super) also: Vec<String>,
    /// Its own part of the tree.
    pub(super) value: &'a Value,
    /// Where its own keys are in the tree; empty if they are the whole of it.
    pub(super) roots: Vec<String>,
}

impl<'a> Entry<'a> {
    pub(super) fn new(name: String, value: &'a Value, root: String) -> Self {
        Self { name, also: Vec::new(), value, roots: vec![root] }
    }

    /// The camera of a file that has only one and gives no name.
    pub(super) fn only(value: &'a Value) -> Vec<Self> {
        vec![Self { name: String::new(), also: Vec::new(), value, roots: Vec::new() }]
    }

    fn is_called(&self, name: &str) -> bool {
        self.name == name || self.also.iter().any(|also| also == name)
    }

    /// A problem with the whole path of its key.
    pub(super) fn placed(&self, document: &Document, problem: Problem) -> Problem {
        match self.roots.first() {
            Some(root) if !std::ptr::eq(self.value, &document.value) => {
                Problem { key: format!("{root}.{}", problem.key), ..problem }
            }
            _ => problem,
        }
    }

    /// Whether a place in the tree is below one of its roots.
    pub(super) fn holds(&self, path: &str) -> bool {
        self.roots.iter().any(|root| {
            path.strip_prefix(root.as_str())
                .is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        })
    }
}

/// The index of the camera that is meant.
pub(super) fn choose(entries: &[Entry<'_>], wanted: Option<&str>) -> Result<usize, Problem> {
    let names = || {
        let names: Vec<String> = entries.iter().map(|entry| format!("`{}`", entry.name)).collect();
        names.join(", ")
    };
    let Some(wanted) = wanted else {
        return match entries.len() {
            0 => Err(Problem::new("cameras", "there is none in the file")),
            1 => Ok(0),
            count => Err(Problem::new(
                "cameras",
                format!(
                    "there are {count} ({}): name the one that is meant, as in `--camera {}`",
                    names(),
                    quoted(&entries[0].name)
                ),
            )),
        };
    };
    let mut called =
        entries.iter().enumerate().filter(|(_, entry)| entry.is_called(wanted)).map(|(index, _)| index);
    match (called.next(), called.next()) {
        (Some(index), None) => Ok(index),
        (Some(_), Some(_)) => {
            Err(Problem::new("cameras", format!("several are called `{wanted}`: rename them in the file")))
        }
        (None, _) if entries.iter().all(|entry| entry.name.is_empty()) => Err(Problem::new(
            "cameras",
            format!("there is one, without a name, and no `{wanted}`: leave `--camera` out"),
        )),
        (None, _) => {
            Err(Problem::new("cameras", format!("none is called `{wanted}`; there are {}", names())))
        }
    }
}

fn quoted(name: &str) -> String {
    if name.contains(|c: char| c.is_whitespace() || "'\"$&;()".contains(c)) {
        format!("'{}'", name.replace('\'', "'\\''"))
    } else {
        name.to_owned()
    }
}
