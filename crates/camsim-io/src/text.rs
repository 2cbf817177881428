//! Texts: trees of values, their syntaxes, numbers for other programs, words of messages.

pub(crate) mod document;
pub(crate) mod numbers;
pub(crate) mod syntax;
pub(crate) mod wording;
