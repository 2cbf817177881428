//! Whether a row that another one dominates does so for good. A case has hundreds of pairs of rows and a few
//! rounds of each: by chance alone some pairs look as if one were slower. What is suspected is measured once
//! more, two by two, and only what both measurements say is told.

use camsim_engine::Engine;

use super::{
    BenchError, Violation,
    knobs::Variant,
    pareto::is_slower,
    rounds::{self, Effort},
};
use crate::timing::quantile;

/// Rounds of a pair beside those of the table, at least and at most.
const ROUNDS: [usize; 2] = [9, 21];

/// Of `suspected`, those whose times say the same when the two rows are alone.
///
/// # Errors
/// Whatever the renderer meets.
pub fn confirmed(
    engine: &Engine,
    variants: &[Variant],
    suspected: Vec<Violation>,
    effort: Effort,
) -> Result<Vec<Violation>, BenchError> {
    let [min_rounds, max_rounds] = ROUNDS;
    let effort = Effort { min_rounds, max_rounds, ..effort };
    let mut found = Vec::new();
    for violation in suspected {
        let of = |knob: &str| {
            variants
                .iter()
                .find(|variant| variant.knob == knob)
                .map(|variant| (variant.sequence.clone(), false))
        };
        let Some(pair) = of(&violation.row).zip(of(&violation.better)) else { continue };
        let alone = rounds::measure(engine, &[pair.0, pair.1], effort)?;
        let [row, better] = alone.as_slice() else { continue };
        let ratios = row.times.ratios(&better.times);
        if is_slower(&ratios) {
            found.push(Violation { time_ratio: quantile(&ratios, 0.5), ..violation });
        }
    }
    Ok(found)
}
