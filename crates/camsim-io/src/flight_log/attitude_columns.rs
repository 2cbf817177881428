//! Selection of the columns that hold the attitude.

use camsim_core::flight_log::Note;

use super::{
    column_meaning::ColumnMeaning,
    column_selection::{columns_by_name, push_information, push_warning},
    columns::{AttitudeColumns, FieldSource},
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
    use ColumnMeaning::{MagneticYaw, Pitch, Qw, Qx, Qy, Qz, Roll, Yaw};
    let has = |meaning: ColumnMeaning| !header.columns_where(|other| other == meaning).is_empty();
    let yaws = header.columns_where(|meaning| matches!(meaning, Yaw | MagneticYaw));
    let has_angles = has(Roll) && has(Pitch) && !yaws.is_empty();
    if let Some(columns) = header.unique_each([Qx, Qy, Qz, Qw])? {
        if has_angles {
            push_warning(notes, "of the attitude's quaternion and angles the quaternion counts".to_owned());
        }
        return Ok(AttitudeColumns::Quaternion(columns));
    }
    if !has_angles {
        let incomplete: Vec<usize> = header
            .columns_where(|meaning| matches!(meaning, Roll | Pitch | Yaw | MagneticYaw | Qx | Qy | Qz | Qw));
        if !incomplete.is_empty() {
            push_information(
                notes,
                format!(
                    "an attitude needs roll, pitch and yaw, or qx, qy, qz and qw: {} alone is none",
                    header.describe(&incomplete)
                ),
            );
        }
        let numbered = columns_by_name(header, |name| ["q0", "q1", "q2", "q3", "q4"].contains(&name));
        if !numbered.is_empty() {
            push_warning(
                notes,
                format!(
                    "{} are no attitude, as their order is not known: rename them to qw, qx, qy, qz (PX4 \
                        numbers them in this order)",
                    header.describe(&numbered)
                ),
            );
        }
        return Ok(AttitudeColumns::None);
    }
    let yaw = one_yaw(header, &yaws, notes)?;
    header.check_usable(yaw)?;
    if has(MagneticYaw) {
        push_warning(
            notes,
            format!(
                "`{}` is from magnetic north, but taken as from true north: add the declination",
                header.name(yaw)
            ),
        );
    }
    let [roll, pitch] = header.unique_each([Roll, Pitch])?.unwrap_or_default();
    Ok(AttitudeColumns::Euler(
        [roll, pitch, yaw].map(|column| FieldSource::whole(column, header.factor(column))),
    ))
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
            push_information(
                notes,
                format!("of the yaws {} `{}` counts", header.describe(yaws), header.name(yaw)),
            );
            Ok(yaw)
        }
        _ => Err(header.ambiguity_message(yaws)),
    }
}
