//! Normalisation of quaternions.

use camsim_core::flight_log::Note;

use super::{columns::AttitudeKind, rows::ParsedRow};

/// Relative tolerance of the norm: the error of components that are rounded to two decimals is smaller.
const NORM_TOLERANCE: f64 = 0.01;

/// Divides quaternions by their common norm, if that is not 1.
///
/// # Errors
/// Their norms vary, so they are no quaternions.
pub(super) fn normalised(
    mut rows: Vec<ParsedRow>,
    kind: AttitudeKind,
    notes: &mut Vec<Note>,
) -> Result<Vec<ParsedRow>, String> {
    let norm = |row: &ParsedRow| row.attitude.iter().map(|q| q * q).sum::<f64>().sqrt();
    let mut norms: Vec<f64> = rows.iter().map(norm).filter(|norm| norm.is_finite() && *norm > 0.0).collect();
    if norms.is_empty() || kind != AttitudeKind::Quaternion {
        return Ok(rows);
    }
    norms.sort_by(f64::total_cmp);
    let (smallest, median, largest) = (norms[0], norms[norms.len() / 2], norms[norms.len() - 1]);
    let most_near = |reference: f64| {
        norms.iter().filter(|&&norm| (norm / reference - 1.0).abs() <= NORM_TOLERANCE).count() * 10
            >= norms.len() * 9
    };
    if most_near(1.0) {
        return Ok(rows);
    }
    if !most_near(median) {
        return Err(format!(
            "the columns of the quaternion have lengths from {smallest:.3} to {largest:.3}, not 1: they are \
                no quaternions, or in another order"
        ));
    }
    for row in &mut rows {
        row.attitude = row.attitude.map(|q| q / median);
    }
    notes.push(Note::warning(format!(
        "the quaternions have the length {median:.3}, not 1: they are brought to 1"
    )));
    Ok(rows)
}
