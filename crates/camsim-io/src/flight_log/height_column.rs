//! Selection of the column that holds the height.

use camsim_core::{
    flight_log::Note,
    scenario::{HeightReference, HeightSource},
};

use super::{
    column_meaning::ColumnMeaning,
    column_selection::{push_information, push_warning},
    header::HeaderColumns,
    missing_columns::missing_columns_message,
    units::VerticalDatum,
};

/// Whether a column is a height, of any kind.
pub(super) fn is_height(meaning: ColumnMeaning) -> bool {
    matches!(
        meaning,
        ColumnMeaning::Height(_) | ColumnMeaning::PressureHeight | ColumnMeaning::RelativeHeight
    )
}

fn push_pressure_warning(header: &HeaderColumns, column: usize, notes: &mut Vec<Note>) {
    push_warning(
        notes,
        format!("the height, `{}`, is by air pressure: it may be off by 100 m and more", header.name(column)),
    );
}

/// The column of the height. `reference` is `flight.height`, or `None` for local coordinates, where it does
/// not matter; `source` is `flight.height_from`.
///
/// # Errors
/// There is no height above a datum, or several among which none can be preferred.
// Long because it is one table of cases.
pub(super) fn height_column(
    header: &HeaderColumns,
    reference: Option<HeightReference>,
    source: HeightSource,
    notes: &mut Vec<Note>,
) -> Result<usize, String> {
    if source == HeightSource::Pressure {
        let column = header.unique(ColumnMeaning::PressureHeight)?;
        let column =
            column.ok_or("flight.height_from is \"pressure\", but no column is a height by air pressure")?;
        push_pressure_warning(header, column, notes);
        return Ok(column);
    }
    let wanted = reference.map(|height| match height {
        HeightReference::Msl => VerticalDatum::MeanSeaLevel,
        HeightReference::Ellipsoid => VerticalDatum::Ellipsoid,
    });
    let heights_above = |datum: Option<VerticalDatum>| {
        header.columns_where(|meaning| meaning == ColumnMeaning::Height(datum))
    };
    let all = header.columns_where(|meaning| matches!(meaning, ColumnMeaning::Height(_)));
    let other_datum = |datum: VerticalDatum| {
        if datum == VerticalDatum::Ellipsoid { VerticalDatum::MeanSeaLevel } else { VerticalDatum::Ellipsoid }
    };
    let key_value = |datum: Option<VerticalDatum>| {
        if datum == Some(VerticalDatum::Ellipsoid) { "ellipsoid" } else { "msl" }
    };
    let column = match (all.len(), wanted) {
        (0, _) => match (
            header.unique(ColumnMeaning::PressureHeight)?,
            header.columns_where(|meaning| meaning == ColumnMeaning::RelativeHeight).first().copied(),
        ) {
            (Some(_), _) if source == HeightSource::Gnss => {
                return Err(
                    "flight.height_from is \"gnss\", but the only height is by air pressure".to_owned()
                );
            }
            (Some(column), _) => {
                push_pressure_warning(header, column, notes);
                column
            }
            (None, Some(column)) => {
                return Err(format!(
                    "the only height, `{}`, is above take-off or ground: add the height of the place of \
                        take-off and name the column alt",
                    header.name(column)
                ));
            }
            (None, None) => return Err(missing_columns_message(header)),
        },
        (1, _) => all[0],
        (_, Some(wanted)) => {
            // The column that states the datum of flight.height; or, if there is none, the only column
            // without a datum where one other column states the other datum.
            let column = match (
                &heights_above(Some(wanted))[..],
                &heights_above(None)[..],
                &heights_above(Some(other_datum(wanted)))[..],
            ) {
                ([column], ..) => *column,
                ([], [column], [_]) => *column,
                _ => return Err(header.ambiguity_message(&all)),
            };
            push_warning(
                notes,
                format!(
                    "of the heights {} `{}` counts, because flight.height is \"{}\"",
                    header.describe(&all),
                    header.name(column),
                    key_value(Some(wanted))
                ),
            );
            column
        }
        (_, None) => return Err(header.ambiguity_message(&all)),
    };
    header.check_usable(column)?;
    let meaning = header.parsed(column).map(|parsed| parsed.meaning);
    if let (Some(ColumnMeaning::Height(Some(datum))), Some(wanted)) = (meaning, wanted)
        && datum != wanted
    {
        push_warning(
            notes,
            format!(
                "the column `{}` says {}, flight.height says \"{}\": set flight.height = \"{}\", or rename \
                    the column",
                header.name(column),
                if datum == VerticalDatum::Ellipsoid {
                    "above the ellipsoid"
                } else {
                    "above mean sea level"
                },
                key_value(Some(wanted)),
                key_value(Some(datum))
            ),
        );
    }
    let pressure = header.columns_where(|meaning| meaning == ColumnMeaning::PressureHeight);
    if !all.is_empty() && !pressure.is_empty() {
        push_information(
            notes,
            format!(
                "the height is `{}`, not {}, which is by air pressure",
                header.name(column),
                header.describe(&pressure)
            ),
        );
    }
    Ok(column)
}
