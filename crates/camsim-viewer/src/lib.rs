//! The egui viewer.
