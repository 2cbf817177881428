//! Unit of angles whose header names none: from `flight.angle_unit`, or from the values where only one unit
//! is plausible.

use camsim_core::{
    flight_log::Note,
    scenario::{AngleKind, AngleUnit, FlightSpec},
};

use super::{
    columns::{AttitudeColumns, FieldSource, Frame},
    layout::TableLayout,
    rows::ParsedRow,
    time_unit::format_short,
};
use crate::median::median;

/// Converts roll, pitch and yaw to degrees where the header names no unit.
///
/// # Errors
/// The key contradicts the header, or the unit is not known: the error message.
pub(super) fn in_degrees(
    mut rows: Vec<ParsedRow>,
    layout: &TableLayout,
    spec: &FlightSpec,
    notes: &mut Vec<Note>,
) -> Result<Vec<ParsedRow>, String> {
    let AttitudeColumns::Euler(sources) = layout.attitude else {
        if spec.angle_unit != AngleUnit::Auto {
            notes.push(Note::warning("flight.angle_unit is not used: no roll, pitch and yaw are read"));
        }
        return Ok(rows);
    };
    let key_factor = unit_of_angle_key(spec.angle_unit);
    let contradicts = |source: &&FieldSource| source.factor.is_some() && source.factor != key_factor;
    if let (Some(_), Some(source)) = (key_factor, sources.iter().find(contradicts)) {
        return Err(format!(
            "the header names another unit{} than flight.angle_unit; remove the key or correct the header",
            layout.bracketed_name(source.column)
        ));
    }
    let unitless: Vec<usize> = (0..3).filter(|&axis| sources[axis].factor.is_none()).collect();
    let factor = match key_factor {
        _ if unitless.is_empty() => return Ok(rows),
        Some(factor) => factor,
        None => infer_degrees_per_unit(
            &rows,
            &unitless,
            layout,
            sources.map(|source| source.column),
            spec,
            notes,
        )?,
    };
    if factor != 1.0 {
        for row in &mut rows {
            for &axis in &unitless {
                row.attitude[axis] *= factor;
            }
        }
    }
    Ok(rows)
}

/// Degrees per unit that `flight.angle_unit` names; `None` for `auto`.
pub(super) fn unit_of_angle_key(key: AngleUnit) -> Option<f64> {
    match key {
        AngleUnit::Auto => None,
        AngleUnit::Deg => Some(1.0),
        AngleUnit::Rad => Some(180.0 / std::f64::consts::PI),
    }
}

/// Infers degrees per unit of the `unitless` axes (0 roll, 1 pitch, 2 yaw): radians, with a warning, where
/// yaw wraps around by a turn of radians; degrees where angles exceed the domain of radians.
// Long because each ambiguity has its own message.
fn infer_degrees_per_unit(
    rows: &[ParsedRow],
    unitless: &[usize],
    layout: &TableLayout,
    columns: [usize; 3],
    spec: &FlightSpec,
    notes: &mut Vec<Note>,
) -> Result<f64, String> {
    use std::f64::consts::{FRAC_PI_2, PI, TAU};
    let column =
        |axis: usize| rows.iter().map(move |row| row.attitude[axis]).filter(|value| value.is_finite());
    if spec.angles != AngleKind::Continuous {
        for &axis in unitless {
            let steps = column(axis).zip(column(axis).skip(1)).map(|(a, b)| (b - a).abs());
            if column(axis).next().is_some_and(|first| first.abs() > 720.0)
                || steps.into_iter().any(|step| step > 10_000.0)
            {
                return Err(format!(
                    "{} holds {}, which is no angle in degrees: name the unit in the header \
                        (yaw_cdeg), or set flight.angles = \"continuous\" if turns count",
                    layout.describe(columns[axis]),
                    format_short(column(axis).fold(0.0, |largest: f64, value| {
                        if value.abs() > largest.abs() { value } else { largest }
                    }))
                ));
            }
        }
    }
    // Radians of two decimals may exceed pi by this.
    const SLACK: f64 = 0.005;
    let domain = [-PI..=PI, -FRAC_PI_2..=FRAC_PI_2, -PI..=TAU];
    let within = |axis: usize| {
        column(axis).all(|value| (domain[axis].start() - SLACK..=domain[axis].end() + SLACK).contains(&value))
    };
    let all_zero = unitless.iter().all(|&axis| column(axis).all(|value| value == 0.0));
    if all_zero || !unitless.iter().all(|&axis| within(axis)) {
        let max_abs = |axis: usize| column(axis).fold(0.0, |max: f64, value| max.max(value.abs()));
        let (low, high) = column(2)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), yaw| (yaw.min(low), yaw.max(high)));
        let tilt = max_abs(0).max(max_abs(1));
        if unitless.len() == 3 && tilt > 0.0 && tilt <= 1.6 && high - low > 6.3 {
            notes.push(Note::warning(format!(
                "roll and pitch are read as degrees like yaw, but never exceed {}: if they are radians, \
                        set flight.angle_unit or name the units in the header (roll_rad, yaw_deg)",
                format_short(tilt)
            )));
        }
        return Ok(1.0);
    }
    let wraps = |a: f64, b: f64| {
        (b - a).abs() > 5.2 && ((a.abs() > 2.6 && b.abs() > 2.6 && a * b < 0.0) || (a - b).abs() > 5.5)
    };
    let yaw_is_unitless = unitless.contains(&2);
    let jumps = if yaw_is_unitless {
        column(2).zip(column(2).skip(1)).filter(|&(a, b)| wraps(a, b)).count()
    } else {
        0
    };
    if jumps > 0 {
        notes.push(Note::warning(format!(
            "roll, pitch and yaw are read as radians: their columns name no unit, all stay within a turn \
                    of radians, and yaw jumps by one {jumps} times; flight.angle_unit decides"
        )));
        return Ok(180.0 / PI);
    }
    Err(format!(
        "roll, pitch and yaw name no unit and stay within pi throughout ({}): set flight.angle_unit \
            = \"deg\" or \"rad\", or name the unit in the header (yaw_deg, yaw_rad)",
        layout.describe(columns[2])
    ))
}

/// Refuses latitudes and longitudes without a unit that may be radians.
pub(super) fn check_degrees(rows: &[ParsedRow], layout: &TableLayout) -> Result<(), String> {
    use std::f64::consts::{FRAC_PI_2, PI};
    let [latitude, longitude, _] = layout.position;
    if layout.frame != Frame::Geodetic || latitude.factor.is_some() || longitude.factor.is_some() {
        return Ok(());
    }
    let column =
        |axis: usize| rows.iter().filter(|row| row.has_position()).map(move |row| row.position[axis]);
    let mut latitudes: Vec<f64> = column(0).map(f64::abs).filter(|value| *value > 0.0).collect();
    // Such degrees lie in the Gulf of Guinea, where no land is. Close to the equator they are a made-up
    // position.
    let far_from_equator = median(&mut latitudes, f64::total_cmp).is_some_and(|latitude| latitude > 0.05);
    if far_from_equator
        && column(0).all(|value| value.abs() <= FRAC_PI_2)
        && column(1).all(|value| value.abs() <= PI)
    {
        return Err(format!(
            "latitude and longitude (columns {} and {}) name no unit and stay within pi: name them lat_rad \
                and lon_rad, or lat_deg and lon_deg, in a header line",
            latitude.column + 1,
            longitude.column + 1
        ));
    }
    Ok(())
}
