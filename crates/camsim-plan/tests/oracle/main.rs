//! The oracle against what is known without it: closed forms, every triangle looked at, planted faults, its
//! own convergence.

#![allow(clippy::unwrap_used)]

mod casting;
mod closed_form;
mod convergence;
mod fixtures;
mod holes;
mod hostile;
mod layers;
mod measuring;
mod planted_faults;
