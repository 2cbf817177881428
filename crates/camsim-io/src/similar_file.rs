//! Names of files that were probably meant.

use std::path::Path;

use strsim::normalized_damerau_levenshtein;

/// Similarity above which a name is suggested.
const MIN_SIMILARITY: f64 = 0.7;

/// For a file that is missing: `; did you mean "flight.csv"?` if its folder has a file of a similar name, else
/// nothing.
pub(crate) fn suggestion(path: &Path) -> String {
    let Some(name) = path.file_name().map(|name| name.to_string_lossy()).filter(|_| !path.exists()) else {
        return String::new();
    };
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let names = folder.read_dir().into_iter().flatten().flatten();
    let names = names.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let scored = names.map(|other| (normalized_damerau_levenshtein(&name, &other), other));
    let nearest = scored.max_by(|a, b| a.0.total_cmp(&b.0).then_with(|| b.1.cmp(&a.1)));
    nearest
        .filter(|(similarity, _)| *similarity > MIN_SIMILARITY)
        .map_or_else(String::new, |(_, other)| format!("; did you mean \"{other}\"?"))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn a_missing_file_gets_a_similar_name_of_its_folder() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["flight.csv", "notes.txt"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let found = |name: &str| suggestion(&folder.path().join(name));
        assert_eq!(found("fligth.csv"), "; did you mean \"flight.csv\"?");
        assert_eq!(found("flight.csv"), "");
        assert_eq!(found("terrain.tif"), "");
        assert_eq!(suggestion(Path::new("/no/such/folder/flight.csv")), "");
    }
}
