//! Words of commands in messages and scripts.

use std::ffi::OsStr;

/// A word quoted for a POSIX shell.
#[must_use]
pub fn quoted(word: impl AsRef<OsStr>) -> String {
    let text = word.as_ref().to_string_lossy();
    let is_plain = |c: char| c.is_alphanumeric() || "_./=:,@%+-".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        text.into_owned()
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_a_shell_would_change_is_quoted() {
        for (word, wanted) in [
            ("flüge/a-1.toml", "flüge/a-1.toml"),
            ("", "''"),
            ("two words", "'two words'"),
            ("it's", r"'it'\''s'"),
            ("a|b*?<>~#`\\", r"'a|b*?<>~#`\'"),
        ] {
            assert_eq!(quoted(word), wanted);
        }
    }
}
