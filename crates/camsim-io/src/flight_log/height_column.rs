//! Selection of the column that holds the height.

use camsim_core::{
    flight_log::Note,
    scenario::{FlightHeight, HeightSource},
};

use super::{
    column_meaning::ColumnMeaning::{Height, PressureHeight, RelativeHeight},
    header::HeaderColumns,
    missing_columns::missing_columns_message,
};

/// The column of the height. `wanted` is `flight.height`, or `None` for local coordinates, where it does not
/// matter; `source` is `flight.height_from`.
///
/// # Errors
/// There is no height above a datum, or several among which none can be preferred.
pub(super) fn height_column(
    header: &HeaderColumns,
    wanted: Option<FlightHeight>,
    source: HeightSource,
    notes: &mut Vec<Note>,
) -> Result<usize, String> {
    if source == HeightSource::Pressure {
        let column = header.unique(PressureHeight)?;
        let column =
            column.ok_or("flight.height_from is \"pressure\", but no column is a height by air pressure")?;
        notes.push(pressure_warning(header, column));
        return Ok(column);
    }
    if let Some(column) = wanted.map_or(Ok(None), |wanted| header.unique(RelativeHeight(wanted)))? {
        header.check_usable(column)?;
        return Ok(column);
    }
    let all = header.columns_where(|meaning| matches!(meaning, Height(_)));
    let column = match (&all[..], wanted) {
        ([], _) => without_datum(header, source, notes)?,
        ([column], _) => *column,
        (_, Some(wanted)) => of_several(header, &all, wanted, notes)?,
        (_, None) => return Err(header.ambiguity_message(&all)),
    };
    header.check_usable(column)?;
    notes.extend(wanted.and_then(|wanted| datum_warning(header, column, wanted)));
    let pressure = header.columns(PressureHeight);
    if !all.is_empty() && !pressure.is_empty() {
        notes.push(Note::information(format!(
            "the height is `{}`, not {}, which is by air pressure",
            header.name(column),
            header.describe(&pressure)
        )));
    }
    Ok(column)
}

fn pressure_warning(header: &HeaderColumns, column: usize) -> Note {
    Note::warning(format!(
        "the height, `{}`, is by air pressure: it may be off by 100 m and more",
        header.name(column)
    ))
}

/// The column of the height by air pressure, where no other is above a datum.
fn without_datum(
    header: &HeaderColumns,
    source: HeightSource,
    notes: &mut Vec<Note>,
) -> Result<usize, String> {
    let relative = [FlightHeight::Takeoff, FlightHeight::Ground]
        .into_iter()
        .find_map(|above| Some((*header.columns(RelativeHeight(above)).first()?, above)));
    match (header.unique(PressureHeight)?, relative) {
        (Some(_), _) if source == HeightSource::Gnss => {
            Err("flight.height_from is \"gnss\", but the only height is by air pressure".to_owned())
        }
        (Some(column), _) => {
            notes.push(pressure_warning(header, column));
            Ok(column)
        }
        (None, Some((column, above))) => Err(format!(
            "the only height, `{}`, is above {}: set flight.height = \"{}\", with a scene.terrain, or add the height \
                of the ground and name the column alt",
            header.name(column),
            above.surface(),
            above.name()
        )),
        (None, None) => Err(missing_columns_message(header)),
    }
}

/// The column that states the datum of flight.height; or, if there is none, the only column without a datum
/// where one other column states the other datum.
fn of_several(
    header: &HeaderColumns,
    all: &[usize],
    wanted: FlightHeight,
    notes: &mut Vec<Note>,
) -> Result<usize, String> {
    let of_wanted = wanted.datum().map_or_else(Vec::new, |datum| header.columns(Height(Some(datum))));
    let without = header.columns(Height(None));
    let others = all.len() - of_wanted.len() - without.len();
    let column = match (&of_wanted[..], &without[..], others) {
        ([column], ..) | ([], [column], 1) => *column,
        _ => return Err(header.ambiguity_message(all)),
    };
    notes.push(Note::warning(format!(
        "of the heights {} `{}` counts, because flight.height is \"{}\"",
        header.describe(all),
        header.name(column),
        wanted.name()
    )));
    Ok(column)
}

/// A warning if a column states another datum than `flight.height`.
fn datum_warning(header: &HeaderColumns, column: usize, wanted: FlightHeight) -> Option<Note> {
    let Height(Some(datum)) = header.parsed(column)?.meaning else { return None };
    (wanted.datum() != Some(datum)).then(|| {
        Note::warning(format!(
            "the column `{}` says above {}, flight.height says \"{}\": set flight.height = \"{}\", or rename \
                the column",
            header.name(column),
            FlightHeight::from(datum).surface(),
            wanted.name(),
            datum.name()
        ))
    })
}
