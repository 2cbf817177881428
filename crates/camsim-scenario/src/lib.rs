//! What is known of the keys of a scenario, as data: the schema, the checks of values, the viewer's fields and the
//! reference pages are made from it.

// The macros name this crate by its path, here too.
extern crate self as camsim_scenario;

pub mod keys;
