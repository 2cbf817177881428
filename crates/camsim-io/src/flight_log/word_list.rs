//! Lists of words in one text, with blanks between them.

/// Whether a list has a word.
pub(super) fn has_word(list: &str, word: &str) -> bool {
    list.split(' ').any(|other| other == word)
}
