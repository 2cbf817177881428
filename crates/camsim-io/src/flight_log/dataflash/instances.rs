//! Which sensor or core of several is flown: the one that the autopilot used at each time.
//!
//! | messages | of several | primary |
//! |---|---|---|
//! | `XKF1`, `XKQ`, `NKF1`, `NKQ` | cores: column `C`; in old logs `NKF6` is core 1 of `NKF1`, `NKQ2` of `NKQ1` | `PI` of `XKF4`, `NKF4` |
//! | `GPS` | receivers: column `I`; in old logs `GPS2`, and `GPSB` for their blend | `U` |

use std::collections::BTreeSet;

use camsim_core::flight_log::Note;

use super::{
    super::streams,
    file::{Column, DataflashFile, Message},
    time_reader,
};

/// Messages of one quantity in logs that have no column for the instance, by instance.
const FAMILIES: [&[&str]; 5] = [
    &["GPS", "GPS2", "GPSB"],
    &["XKF1", "XKF6", "XKF11"],
    &["NKF1", "NKF6", "NKF11"],
    &["XKQ1", "XKQ2", "XKQ3"],
    &["NKQ1", "NKQ2", "NKQ3"],
];

/// A message of the chosen quantity.
#[derive(Clone, Copy)]
pub(super) struct Part<'a, 'b> {
    pub(super) message: &'b Message<'a>,
    /// The column of the instance, else the instance itself.
    column: Option<Column>,
    instance: u32,
}

/// A record of one of several parts.
#[derive(Clone, Copy)]
pub(super) struct Selected<'a> {
    pub(super) number: usize,
    pub(super) record: &'a [u8],
    /// Index of its part.
    pub(super) part: usize,
    instance: u32,
}

/// The messages that hold the instances of one.
pub(super) fn parts<'a, 'b>(file: &'b DataflashFile<'a>, message: &'b Message<'a>) -> Vec<Part<'a, 'b>> {
    let column = message.column(&["I", "C"]);
    let family = FAMILIES.iter().find(|family| family[0] == message.name).filter(|_| column.is_none());
    let Some(family) = family else { return vec![Part { message, column, instance: 0 }] };
    let known = family.iter().zip(0_u32..);
    known
        .filter_map(|(name, instance)| {
            file.find(name).map(|message| Part { message, column: None, instance })
        })
        .collect()
}

/// The records to fly: those of an instance, else of the primary one at each time.
///
/// # Errors
/// There is no such instance, or the messages have no time.
pub(super) fn select<'a>(
    file: &DataflashFile<'a>,
    parts: &[Part<'a, '_>],
    instance: Option<u32>,
    notes: &mut Vec<Note>,
) -> Result<Vec<Selected<'a>>, String> {
    let Some(name) = parts.first().map(|part| part.message.name.clone()) else { return Ok(Vec::new()) };
    let mut all = Vec::new();
    for (index, part) in parts.iter().enumerate() {
        all.extend(part.message.records.iter().map(|&(number, record)| Selected {
            number,
            record,
            part: index,
            instance: part.column.map_or(part.instance, |column| column.read(record) as u32),
        }));
    }
    all.sort_by_key(|selected| selected.number);
    let instances: BTreeSet<u32> = all.iter().map(|selected| selected.instance).collect();
    let list = instances.iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
    if let Some(wanted) = instance {
        if !instances.contains(&wanted) {
            return Err(format!("flight.topic: `{name}` has no instance {wanted}; there are: {list}"));
        }
        all.retain(|selected| selected.instance == wanted);
        return Ok(all);
    }
    let (Some(&lowest), true) = (instances.first(), instances.len() > 1) else { return Ok(all) };
    let primary = primary(file, parts, &all)?;
    let chosen: Vec<Selected<'a>> = match &primary {
        Some((_, is_primary)) => {
            all.iter().zip(is_primary).filter(|(_, yes)| **yes).map(|(selected, _)| *selected).collect()
        }
        None => Vec::new(),
    };
    let (Some((source, _)), Some(first)) = (primary, chosen.first()) else {
        let flown =
            all.iter().filter(|one| has_fix(&parts[one.part], one.record)).map(|one| one.instance).min();
        let flown = flown.unwrap_or(lowest);
        notes.push(streams::instance_note(&name, &list, flown));
        all.retain(|selected| selected.instance == flown);
        return Ok(all);
    };
    let mut changes = chosen.windows(2).filter(|pair| pair[0].instance != pair[1].instance);
    let change = changes.next().map(|pair| {
        let time = parts.get(pair[1].part).and_then(|part| time_reader(part.message).ok());
        let time = time.and_then(|time| time(pair[1].record)).map_or(0.0, |ns| ns as f64 * 1e-9);
        format!(
            ", {} until {time:.1} s of the log's clock, then {}{}",
            pair[0].instance,
            pair[1].instance,
            match changes.clone().count() {
                0 => String::new(),
                more => format!(", and {more} more changes"),
            }
        )
    });
    notes.push(Note {
        is_warning: change.is_some(),
        text: format!(
            "`{name}` has the instances {list}: the one that the vehicle used is flown ({source}){}",
            change.unwrap_or_else(|| format!(", {}", first.instance))
        ),
    });
    Ok(chosen)
}

/// Whether a record is none of a receiver without a fix.
pub(super) fn has_fix(part: &Part<'_, '_>, record: &[u8]) -> bool {
    let status = part.message.column(&["Status"]).filter(|_| part.message.name.starts_with("GPS"));
    status.is_none_or(|status| status.read(record) >= 3.0)
}

/// Whether each record is of the instance that the vehicle used, with the name of what says so.
fn primary(
    file: &DataflashFile<'_>,
    parts: &[Part<'_, '_>],
    all: &[Selected<'_>],
) -> Result<Option<(String, Vec<bool>)>, String> {
    let Some(name) = parts.first().map(|part| part.message.name.as_str()) else { return Ok(None) };
    if name == "GPS" {
        let used: Option<Vec<Column>> = parts.iter().map(|part| part.message.column(&["U"])).collect();
        let is_used = used.map(|used| all.iter().map(|one| used[one.part].read(one.record) != 0.0).collect());
        return Ok(is_used.map(|is_used| ("GPS.U".to_owned(), is_used)));
    }
    let Some(family) = ["XK", "NK"].into_iter().find(|family| name.starts_with(family)) else {
        return Ok(None);
    };
    let status = format!("{family}F4");
    let Some((message, column)) =
        file.find(&status).and_then(|message| Some((message, message.column(&["PI"])?)))
    else {
        return Ok(None);
    };
    let time = time_reader(message)?;
    // The cores of one instant write the same number.
    let mut cores: Vec<(i128, f64)> = message
        .records
        .iter()
        .filter_map(|(_, record)| time(record).map(|time| (time, column.read(record))))
        .filter(|(_, core)| *core >= 0.0)
        .collect();
    cores.sort_by_key(|(time, _)| *time);
    let mut is_primary = Vec::with_capacity(all.len());
    let times = parts.iter().map(|part| time_reader(part.message)).collect::<Result<Vec<_>, _>>()?;
    for one in all {
        let at = times[one.part](one.record)
            .map(|time| cores.partition_point(|(other, _)| *other <= time).saturating_sub(1));
        let core = at.and_then(|at| cores.get(at)).map(|(_, core)| *core);
        is_primary.push(core == Some(f64::from(one.instance)));
    }
    Ok(Some((format!("{status}.PI"), is_primary)))
}
