//! Texts: trees of values, numbers for other programs, words of messages.

pub(crate) mod document;
pub(crate) mod number;
pub(crate) mod numbers;
pub(crate) mod wording;
