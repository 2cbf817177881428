//! Lengths of quaternions.

use camsim_core::flight_log::Note;

use super::rows::Row;

/// Rounded to two decimals, quaternions are off by less.
const NEAR: f64 = 0.01;

/// Gives quaternions that are all of one other length the length 1.
///
/// # Errors
/// Their lengths vary: they are no quaternions.
pub(super) fn normalise(rows: &mut [Row], notes: &mut Vec<Note>) -> Result<(), String> {
    let length = |row: &Row| row.attitude.iter().map(|q| q * q).sum::<f64>().sqrt();
    let mut lengths: Vec<f64> =
        rows.iter().map(length).filter(|length| length.is_finite() && *length > 0.0).collect();
    if lengths.is_empty() {
        return Ok(());
    }
    lengths.sort_by(f64::total_cmp);
    let (least, usual, most) = (lengths[0], lengths[lengths.len() / 2], lengths[lengths.len() - 1]);
    let share_near = |of: f64| {
        lengths.iter().filter(|&&length| (length / of - 1.0).abs() <= NEAR).count() * 10 >= lengths.len() * 9
    };
    if share_near(1.0) {
        return Ok(());
    }
    if !share_near(usual) {
        return Err(format!(
            "the columns of the quaternion have lengths from {least:.3} to {most:.3}, not 1: they are no quaternions, or in another order"
        ));
    }
    for row in rows.iter_mut() {
        row.attitude = row.attitude.map(|q| q / usual);
    }
    notes.push(Note {
        is_warning: true,
        text: format!("the quaternions have the length {usual:.3}, not 1: they are brought to 1"),
    });
    Ok(())
}
