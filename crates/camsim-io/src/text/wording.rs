//! Numbers and notes in messages.

use std::path::Path;

/// Notes of several files, each once, with the names of those that it is about.
pub(crate) fn joined_notes<'a>(files: impl Iterator<Item = (&'a Path, &'a [String])>) -> Vec<String> {
    let mut notes: Vec<(&str, Vec<&Path>)> = Vec::new();
    for (path, note) in files.flat_map(|(path, notes)| notes.iter().map(move |note| (path, note))) {
        match notes.iter_mut().find(|(known, _)| known == note) {
            Some((_, paths)) if !paths.contains(&path) => paths.push(path),
            Some(_) => {}
            None => notes.push((note, vec![path])),
        }
    }
    let text = |(note, paths): &(&str, Vec<&Path>)| format!("{}: {note}", named(paths));
    notes.iter().map(text).collect()
}

/// Paths in words: two of them, and how many more there are.
fn named(paths: &[&Path]) -> String {
    let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    match &names[..] {
        [first, second] => format!("{first} and {second}"),
        [first, second, others @ ..] => {
            let s = if others.len() == 1 { "" } else { "s" };
            format!("{first}, {second} and {} more file{s}", others.len())
        }
        names => names.concat(),
    }
}

/// A number of a message: without decimals from 100 on, else with two at most.
pub(crate) fn rounded(value: f64) -> String {
    let per_unit = if value.abs() >= 100.0 { 1.0 } else { 100.0 };
    // Plus zero: no negative zero.
    format!("{}", (value * per_unit).round() / per_unit + 0.0)
}

/// A range of numbers.
pub(crate) fn range([low, high]: [f64; 2]) -> String {
    format!("{} to {}", rounded(low), rounded(high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_notes_of_several_files_are_one() {
        let (same, own) = (vec!["same".to_owned()], vec!["same".to_owned(), "own".to_owned()]);
        let files = [("a", &same), ("b", &own), ("c", &same), ("c", &same)];
        let notes = joined_notes(files.iter().map(|(path, notes)| (Path::new(*path), &notes[..])));
        assert_eq!(notes, ["a, b and 1 more file: same", "b: own"]);
    }
}
