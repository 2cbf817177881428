//! Similarity of words, for "did you mean".

/// Similarity above which a key is suggested: `fsp` and `fps` have 0.82, words of four or five letters with
/// one letter in common up to 0.79.
pub(super) const MIN_KEY_SIMILARITY: f64 = 0.8;

/// Similarity above which a word is suggested.
const MIN_WORD_SIMILARITY: f64 = 0.65;

/// The word of `words` most similar to `word`, if it is similar enough to suggest.
pub(super) fn nearest_word<'a>(word: &str, words: &[&'a str]) -> Option<&'a str> {
    let word = word.to_lowercase();
    let score = |candidate: &&str| similarity(&word, candidate);
    words
        .iter()
        .copied()
        .max_by(|a, b| score(a).total_cmp(&score(b)))
        .filter(|best| score(best) > MIN_WORD_SIMILARITY)
}

/// Similarity of two words, 0..=1: the larger of Jaro-Winkler, which favours common prefixes, and
/// Damerau-Levenshtein, which finds swapped letters in short words.
pub(super) fn similarity(a: &str, b: &str) -> f64 {
    strsim::jaro_winkler(a, b).max(strsim::normalized_damerau_levenshtein(a, b))
}
