//! Backslashes of paths: in `"..."` TOML takes them for escapes, and only Windows has them between folders.

use std::path::{Path, PathBuf};

/// Escapes of control characters in TOML, with what they are called.
const ESCAPES: [(char, &str, &str); 6] = [
    ('\u{8}', "\\b", "a backspace"),
    ('\t', "\\t", "a tab"),
    ('\n', "\\n", "a line break"),
    ('\u{c}', "\\f", "a form feed"),
    ('\r', "\\r", "a carriage return"),
    ('\u{1b}', "\\e", "an escape character"),
];

/// Why a path that was read from TOML cannot be the one that was meant; `None` if it may be. `resolved` is the
/// file that it leads to.
pub(super) fn path_problem(path: &str, resolved: &Path) -> Option<String> {
    let control = path.chars().find(|c| c.is_control())?;
    if resolved.exists() {
        return None;
    }
    let known = |c: char| ESCAPES.iter().find(|(escaped, ..)| *escaped == c);
    let escape = |c: char| match known(c) {
        Some((_, text, _)) => (*text).to_owned(),
        None if c.is_control() => format!("\\u{:04X}", u32::from(c)),
        None => c.to_string(),
    };
    let written: String = path.chars().map(escape).collect();
    let name = known(control).map_or("a control character", |(.., name)| name);
    Some(format!("the path holds {name} ({}): {}", escape(control), advice(&written)))
}

/// What to write instead of a text in double quotes with backslashes that are no escapes; `None` if a line has
/// none.
pub(super) fn backslash_advice(line: &str) -> Option<String> {
    let mut rest = line;
    while let Some(open) = rest.find(['"', '\'', '#']) {
        let quote = &rest[open..=open];
        if quote == "#" {
            return None;
        }
        let inside = &rest[open + 1..];
        let end = inside.find(quote).unwrap_or(inside.len());
        let text = &inside[..end];
        if quote == "\"" && text.replace("\\\\", "").contains('\\') {
            return Some(advice(text));
        }
        rest = inside.get(end + 1..).unwrap_or_default();
    }
    None
}

/// The two forms of a path with backslashes.
fn advice(written: &str) -> String {
    // A path may begin with the name of a server: two backslashes that are no escape.
    let slashes = match written.strip_prefix(r"\\") {
        Some(rest) if !rest.starts_with('\\') => format!("//{rest}"),
        _ => written.replace(r"\\", r"\"),
    };
    let slashes = slashes.replace('\\', "/");
    let literal = if written.contains('\'') { String::new() } else { format!("'{written}' or ") };
    format!("backslashes in \"...\" are escapes: write {literal}\"{slashes}\"")
}

/// A path of Windows on another system, if that has its folder and not the path as it is written.
pub(super) fn with_slashes(path: PathBuf) -> PathBuf {
    let text = path.to_string_lossy();
    if cfg!(windows) || !text.contains('\\') || path.exists() {
        return path;
    }
    let slashes = PathBuf::from(text.replace('\\', "/"));
    if slashes.exists() || slashes.parent().is_some_and(Path::exists) { slashes } else { path }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    #[test]
    fn control_characters_of_a_path_are_named_with_what_was_meant() {
        for (path, wanted) in [
            (
                "data\u{c}light.csv",
                r#"holds a form feed (\f): backslashes in "..." are escapes: write 'data\flight.csv' or "data/flight.csv""#,
            ),
            ("a\terrain.tif", r#"holds a tab (\t): backslashes in "..." are escapes: write 'a\terrain.tif'"#),
            ("a\u{8}oard.yaml", r"holds a backspace (\b)"),
            ("a\new.csv", r#""a/new.csv""#),
            ("a\run.csv", r"holds a carriage return (\r)"),
            ("a\u{1}.csv", r"holds a control character (\u0001)"),
            ("it's\t.csv", r#"write "it's/t.csv""#),
        ] {
            let problem = path_problem(path, Path::new(path)).unwrap();
            assert!(problem.contains(wanted), "{problem}");
            assert!(!problem.contains(char::is_control), "{problem}");
        }
        assert_eq!(path_problem("data/flight.csv", Path::new("none")), None);
        assert_eq!(path_problem(r"data\flight.csv", Path::new("none")), None);
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a\tb.csv");
        std::fs::write(&file, "").unwrap();
        assert_eq!(path_problem("a\tb.csv", &file), None);
    }

    #[test]
    fn backslashes_in_double_quotes_are_found() {
        let found = |line: &str| backslash_advice(line).unwrap_or_default();
        assert!(
            found(r#"log = "C:\Users\me.csv""#).ends_with(r#"write 'C:\Users\me.csv' or "C:/Users/me.csv""#)
        );
        assert!(found(r#"log = "C:\data\""#).contains(r"'C:\data\'"));
        assert!(
            found(r#"log = "\\server\logs\a.csv""#)
                .ends_with(r#"'\\server\logs\a.csv' or "//server/logs/a.csv""#)
        );
        assert!(found(r#"a = { dem = 'x', ortho = "d\o.tif" }"#).contains("\"d/o.tif\""));
        for line in [r"log = 'C:\Users'", r#"log = "a\\b""#, r#"log = "a" # "C:\x""#, "log = ", ""] {
            assert_eq!(found(line), "", "{line}");
        }
    }

    #[cfg(not(windows))]
    #[test]
    fn paths_of_windows_lead_to_files_of_other_systems() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("data")).unwrap();
        std::fs::write(folder.path().join("data/flight.csv"), "").unwrap();
        let found = |name: &str| with_slashes(folder.path().join(name));
        assert_eq!(found(r"data\flight.csv"), folder.path().join("data/flight.csv"));
        assert_eq!(found(r"data\*.csv"), folder.path().join("data/*.csv"));
        assert_eq!(found(r"none\flight.csv"), folder.path().join(r"none\flight.csv"));
    }
}
