//! Selection of the columns that hold the attitude.

use camsim_core::flight_log::Note;

use super::{
    column_meaning::ColumnMeaning::{MagneticYaw, Pitch, Qw, Qx, Qy, Qz, Roll, Yaw},
    columns::AttitudeColumns,
    header::HeaderColumns,
};

/// The columns of the attitude; [`AttitudeColumns::None`] where the header names no complete one.
///
/// # Errors
/// Several columns hold the same quantity, or a unit makes no sense.
// Long because every incomplete attitude gets its own note.
pub(super) fn attitude_columns(
    header: &HeaderColumns,
    notes: &mut Vec<Note>,
) -> Result<AttitudeColumns, String> {
    let yaws = header.columns_where(|meaning| matches!(meaning, Yaw | MagneticYaw));
    let has_angles = header.has(Roll) && header.has(Pitch) && !yaws.is_empty();
    if let Some(columns) = header.unique_each([Qx, Qy, Qz, Qw])? {
        if has_angles {
            notes.push(Note::warning("of the attitude's quaternion and angles the quaternion counts"));
        }
        return Ok(AttitudeColumns::Quaternion(columns));
    }
    if !has_angles {
        let incomplete: Vec<usize> = header
            .columns_where(|meaning| matches!(meaning, Roll | Pitch | Yaw | MagneticYaw | Qx | Qy | Qz | Qw));
        if !incomplete.is_empty() {
            notes.push(Note::information(format!(
                "an attitude needs roll, pitch and yaw, or qx, qy, qz and qw: {} alone is none",
                header.describe(&incomplete)
            )));
        }
        let numbered = header.columns_by_name(|name| ["q0", "q1", "q2", "q3", "q4"].contains(&name));
        if !numbered.is_empty() {
            notes.push(Note::warning(format!(
                "{} are no attitude, as their order is not known: rename them to qw, qx, qy, qz (PX4 \
                        numbers them in this order)",
                header.describe(&numbered)
            )));
        }
        return Ok(AttitudeColumns::None);
    }
    let yaw = one_yaw(header, &yaws, notes)?;
    header.check_usable(yaw)?;
    if header.has(MagneticYaw) {
        notes.push(Note::warning(format!(
            "`{}` is from magnetic north, but taken as from true north: add the declination",
            header.name(yaw)
        )));
    }
    let [roll, pitch] = header.unique_each([Roll, Pitch])?.unwrap_or_default();
    Ok(AttitudeColumns::Euler([roll, pitch, yaw].map(|column| header.source(column))))
}

/// The column of the yaw. Of two of which one counts from 0 to 360 in its name, the other one counts: DJI's
/// exports state both.
fn one_yaw(header: &HeaderColumns, yaws: &[usize], notes: &mut Vec<Note>) -> Result<usize, String> {
    if let &[yaw] = yaws {
        return Ok(yaw);
    }
    let plain: Vec<usize> =
        yaws.iter().copied().filter(|&yaw| !header.name(yaw).trim_end().ends_with("[360]")).collect();
    match plain[..] {
        [yaw] if yaws.len() == 2 => {
            notes.push(header.choice_note("yaws", yaws, yaw));
            Ok(yaw)
        }
        _ => Err(header.ambiguity_message(yaws)),
    }
}
