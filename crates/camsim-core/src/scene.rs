//! The scene as plain data.

/// What there is to see.
#[derive(Clone, Debug)]
pub struct Scene;
