//! The size of pictures, for files that state none.

use serde_json::{Value, json};

use crate::text::document::KeyProblem;

/// Adds a size to a value. Whether the size that is read is this one is checked later.
pub(crate) fn add_size(value: &mut Value, keys: [&str; 2], [width, height]: [u32; 2]) {
    if let Value::Object(map) = value {
        map.insert(keys[0].to_owned(), json!(width));
        map.insert(keys[1].to_owned(), json!(height));
    }
}

/// Refuses a size that is not that of the file.
pub(crate) fn check(wanted: Option<[u32; 2]>, [width, height]: [u32; 2]) -> Result<(), KeyProblem> {
    match wanted {
        Some(wanted) if wanted != [width, height] => Err(KeyProblem::new(
            "--size",
            format!(
                "is {} x {}, but the file states {width} x {height}: leave --size out, it is for files without a size",
                wanted[0], wanted[1]
            ),
        )),
        _ => Ok(()),
    }
}
