//! Which instance of a PX4 topic is flown: the named one, else that of the estimator which flew the vehicle at
//! each time (`estimator_selector_status.primary_instance`), else the first with valid values.

use std::collections::BTreeSet;

use camsim_core::flight_log::Note;

use super::{
    super::streams,
    file::{Topic, UlogFile},
    positions::{time_field, time_ns},
};

/// A topic that may be flown, and what is to be said of the choice.
pub(super) struct Candidate<'a> {
    pub(super) topic: Topic<'a>,
    pub(super) note: Option<Note>,
}

/// The topics of a name that have messages, the best first. Several subscriptions of one are one here: the
/// longest counts.
pub(super) fn candidates<'a>(file: &UlogFile<'a>, name: &str) -> Vec<Candidate<'a>> {
    let (stem, instance) = streams::split_instance(name);
    let of_name = || file.topics.iter().filter(|topic| topic.name == stem && !topic.messages.is_empty());
    let longest = |wanted: u8| {
        of_name().filter(|topic| topic.instance == wanted).max_by_key(|topic| topic.messages.len()).cloned()
    };
    let plain = |topic: Option<Topic<'a>>| topic.map(|topic| Candidate { topic, note: None });
    if let Some(instance) = instance {
        return plain(u8::try_from(instance).ok().and_then(longest)).into_iter().collect();
    }
    let instances: BTreeSet<u8> = of_name().map(|topic| topic.instance).collect();
    let topics: Vec<Topic<'a>> = instances.iter().filter_map(|&instance| longest(instance)).collect();
    if topics.len() < 2 {
        return topics.into_iter().filter_map(|topic| plain(Some(topic))).collect();
    }
    if let Some(primary) = primary(file, &topics) {
        return vec![primary];
    }
    let list = instances.iter().map(u8::to_string).collect::<Vec<_>>().join(", ");
    topics
        .into_iter()
        .map(|topic| {
            let note = Some(streams::instance_note(stem, &list, topic.instance.into()));
            Candidate { topic, note }
        })
        .collect()
}

/// The messages of the estimator that flew, of all of its instances.
fn primary<'a>(file: &UlogFile<'a>, topics: &[Topic<'a>]) -> Option<Candidate<'a>> {
    let first = topics.first().filter(|topic| topic.name.starts_with("estimator_"))?;
    let status = file.topics.iter().find(|topic| topic.name == "estimator_selector_status")?;
    let (time, field) = (status.field("timestamp")?, status.field("primary_instance")?);
    let mut chosen: Vec<(f64, f64)> = status
        .messages
        .iter()
        .map(|(_, message)| (time.read(message), field.read(message)))
        // 255 is none.
        .filter(|(_, instance)| *instance < 255.0)
        .collect();
    chosen.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut merged: Vec<(usize, &'a [u8], u8)> = Vec::new();
    for topic in topics {
        let time = time_field(topic).ok()?;
        merged.extend(
            topic
                .messages
                .iter()
                .filter(|(_, message)| {
                    let at = chosen.partition_point(|(other, _)| *other <= time.read(message));
                    chosen
                        .get(at.saturating_sub(1))
                        .is_some_and(|(_, instance)| *instance == f64::from(topic.instance))
                })
                .map(|&(number, message)| (number, message, topic.instance)),
        );
    }
    merged.sort_by_key(|(number, ..)| *number);
    let &(_, _, begin) = merged.first()?;
    let change = merged.windows(2).find(|pair| pair[0].2 != pair[1].2).map(|pair| pair[1]);
    let change = change.map(|(_, message, instance)| {
        let at_s = time_field(first).ok().and_then(|time| time_ns(time.read(message))).unwrap_or(0);
        format!("{begin} until {:.1} s of the log's clock, then {instance}", at_s as f64 * 1e-9)
    });
    let text = format!(
        "`{}` has {} instances: that of the estimator which flew is taken (estimator_selector_status), {}",
        first.name,
        topics.len(),
        change.clone().unwrap_or_else(|| begin.to_string())
    );
    let messages = merged.into_iter().map(|(number, message, _)| (number, message)).collect();
    let mut topic = first.clone();
    (topic.messages, topic.instance, topic.is_merged) = (messages, 0, true);
    Some(Candidate { topic, note: Some(Note { is_warning: change.is_some(), text }) })
}
