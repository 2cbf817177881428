//! The reference against what is known without it: closed forms, every triangle looked at, planted faults, its
//! own convergence.

#![allow(clippy::unwrap_used)]

mod blended_layers;
mod casting;
mod closed_form;
mod convergence;
mod disocclusion;
mod fixtures;
mod hostile;
mod measuring;
mod moving;
mod planted_faults;
mod tracks;
