//! Warnings about keys of `[flight]` that a file's format has no use for.

use camsim_core::{
    flight_log::Note,
    scenario::{AngleUnit, FlightSpec, HeightSource, TimeUnit},
};

/// A warning if `flight.height_from` is set for a file whose heights have one instrument.
pub(super) fn unused_height_note(spec: &FlightSpec) -> Option<Note> {
    (spec.height_from == HeightSource::Pressure).then(|| {
        Note::warning(
            "flight.height_from = \"pressure\" is not used: heights of this format are no such heights",
        )
    })
}

/// A warning if `flight.topic` is set for a file that has no topics.
pub(super) fn unused_topic_note(spec: &FlightSpec) -> Option<Note> {
    spec.topic.as_ref().map(|topic| {
        Note::warning(format!("flight.topic = \"{topic}\" is not used: the file has one stream"))
    })
}

/// Warnings about keys of text tables, which files with units and names of their own do not use.
pub(super) fn unused_unit_notes(spec: &FlightSpec) -> impl Iterator<Item = Note> {
    let time = "flight.time_unit is not used: the format defines its times";
    let angle = "flight.angle_unit is not used: the format defines its angles";
    let unused = [(spec.time_unit != TimeUnit::Auto, time), (spec.angle_unit != AngleUnit::Auto, angle)];
    unused.into_iter().filter(|(is_set, _)| *is_set).map(|(_, text)| Note::warning(text))
}
