//! Second measurement of suspected violations. A case has hundreds of pairs of rows with few rounds each, so
//! some pairs differ by chance. Each suspected pair is measured again alone, and reported only if both
//! measurements agree.

use camsim_engine::Engine;

use super::{
    BenchError, Violation,
    methods::Method,
    pareto::is_slower,
    rounds::{self, RoundLimits, TimedSequence},
};
use crate::timing::quantile;

/// Smallest and largest number of rounds of a pair.
const ROUNDS: [usize; 2] = [9, 21];

/// Returns the violations in `suspected` that the second measurement confirms.
///
/// # Errors
/// Any error of rendering.
pub fn confirmed(
    engine: &Engine,
    methods: &[Method],
    suspected: Vec<Violation>,
    limits: RoundLimits,
) -> Result<Vec<Violation>, BenchError> {
    let [min_rounds, max_rounds] = ROUNDS;
    let limits = RoundLimits { min_rounds, max_rounds, ..limits };
    let mut confirmed = Vec::new();
    for violation in suspected {
        let timed = |name: &str| {
            let method = methods.iter().find(|method| method.name == name)?;
            Some(TimedSequence { engine, sequence: method.sequence.clone(), is_still: false })
        };
        let Some(pair) = timed(&violation.row).zip(timed(&violation.better)) else { continue };
        let measured = rounds::measure(&[pair.0, pair.1], limits)?;
        let [row, better] = measured.as_slice() else { continue };
        let ratios = row.times.ratios(&better.times);
        if is_slower(&ratios) {
            confirmed.push(Violation { time_ratio: quantile(&ratios, 0.5), ..violation });
        }
    }
    Ok(confirmed)
}
