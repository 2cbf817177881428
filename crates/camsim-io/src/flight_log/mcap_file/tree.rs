//! The tree of transforms: poses in their root, composed over the frames between.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use camsim_core::flight_log::Note;
use glam::{DQuat, DVec3};

use super::{
    frames,
    messages::{RosKind, Sample},
    records::Topics,
};

/// Longer chains are loops.
const MAX_LINKS: usize = 64;
/// A pose nearer to none is none.
const NO_MOTION_M: f64 = 1e-3;
const NO_TURN_RAD: f64 = 1e-4;

/// Poses of a frame in its parent, by time.
#[derive(Debug, Default)]
struct Link {
    parents: BTreeSet<Arc<str>>,
    /// Time, position, rotation; sorted.
    poses: Vec<(i128, DVec3, DQuat)>,
    is_static: bool,
}

impl Link {
    /// The pose at a time; that of the nearest instant outside of the span, with `false`.
    fn at(&self, time: i128) -> (DVec3, DQuat, bool) {
        let after = self.poses.partition_point(|(other, ..)| *other < time);
        let before = after.checked_sub(1).and_then(|before| self.poses.get(before));
        match (before, self.poses.get(after)) {
            (Some(a), Some(b)) => {
                let fraction = (time - a.0) as f64 / (b.0 - a.0) as f64;
                (a.1.lerp(b.1, fraction), a.2.slerp(b.2, fraction), true)
            }
            (None, Some(one)) => (one.1, one.2, one.0 == time || self.is_constant()),
            (Some(one), None) => (one.1, one.2, self.is_constant()),
            (None, None) => (DVec3::ZERO, DQuat::IDENTITY, true),
        }
    }

    fn is_constant(&self) -> bool {
        self.is_static || self.poses.len() == 1
    }

    /// Whether the frame lies elsewhere than the origin of its parent.
    fn moves(&self) -> bool {
        self.poses.iter().any(|(_, position, _)| position.length() > NO_MOTION_M)
    }

    /// Whether the frame is turned in its parent.
    fn turns(&self) -> bool {
        self.poses.iter().any(|(.., rotation)| rotation.angle_between(DQuat::IDENTITY) > NO_TURN_RAD)
    }

    fn is_identity(&self) -> bool {
        !self.moves() && !self.turns()
    }

    /// Whether it only turns axes about, as `map` and `map_ned`.
    fn turns_axes_only(&self, child: &str) -> bool {
        frames::states_axes(child) && self.is_constant() && !self.moves()
    }
}

/// The transforms of a vehicle.
#[derive(Debug, Default)]
pub(super) struct Tree {
    links: BTreeMap<Arc<str>, Link>,
}

impl Tree {
    /// Those that concern a topic: `/tf`, and `/uav1/tf` for `/uav1/odom`.
    pub(super) fn new(topics: &Topics, topic: &str) -> Self {
        let mut tree = Self::default();
        for (key, samples) in &topics.samples {
            let (space, name) = key.topic.rsplit_once('/').unwrap_or(("", &key.topic));
            let is_near =
                topic.strip_prefix(space).is_some_and(|rest| rest.starts_with('/') || space.is_empty());
            if topics.kinds.get(key) != Some(&RosKind::Transforms) || !is_near {
                continue;
            }
            let is_static = name == "tf_static";
            for sample in samples {
                let (Some(child), Some(position), Some(rotation)) =
                    (&sample.child, sample.position, sample.rotation)
                else {
                    continue;
                };
                let rotation = DQuat::from_array(rotation);
                let is_usable = position.iter().all(|value| value.is_finite())
                    && rotation.is_finite()
                    && rotation.length() > 0.5;
                if !is_usable {
                    continue;
                }
                let link = tree.links.entry(child.clone()).or_default();
                link.is_static |= is_static;
                link.parents.insert(sample.frame.clone());
                link.poses.push((sample.time_ns(), DVec3::from_array(position), rotation.normalize()));
            }
        }
        for link in tree.links.values_mut() {
            link.poses.sort_by_key(|(time, ..)| *time);
            // A static one that is sent again replaces the one before.
            if link.is_static {
                link.poses.drain(..link.poses.len().saturating_sub(1));
            }
        }
        tree
    }

    /// The frame above another one in which positions are a flight.
    fn above(&self, frame: &str) -> Result<Option<(&Link, &Arc<str>)>, String> {
        let Some(link) = self.links.get(frame) else { return Ok(None) };
        if link.parents.len() > 1 {
            let list: Vec<String> = link.parents.iter().map(|name| format!("`{name}`")).collect();
            return Err(format!(
                "the frame `{frame}` has several parents in the transforms, {}: record those of one",
                list.join(" and ")
            ));
        }
        let parent = link.parents.first();
        Ok(parent
            .filter(|parent| !frames::is_geocentric(parent) && !frames::is_grid(parent))
            .map(|parent| (link, parent)))
    }

    /// Brings the poses of one frame to the root of its tree, at the instants of the samples.
    ///
    /// # Errors
    /// A frame between has several parents.
    pub(super) fn compose(
        &self,
        topic: &str,
        samples: &mut [Sample],
        notes: &mut Vec<Note>,
    ) -> Result<(), String> {
        let Some(mut frame) = samples.first().map(|sample| sample.frame.clone()) else { return Ok(()) };
        if samples.iter().any(|sample| sample.frame != frame) {
            // Refused later, with the names.
            return Ok(());
        }
        let (mut chain, mut outside) = (vec![frame.to_string()], vec![false; samples.len()]);
        while let Some((link, parent)) = self.above(&frame)? {
            if chain.len() > MAX_LINKS || chain.contains(&parent.to_string()) {
                return Err(format!("the transforms above `{frame}` go in a circle"));
            }
            for (sample, outside) in samples.iter_mut().zip(&mut outside) {
                let (position, rotation, is_inside) = link.at(sample.time_ns());
                *outside |= !is_inside;
                sample.position =
                    sample.position.map(|p| (position + rotation * DVec3::from_array(p)).to_array());
                sample.rotation = sample.rotation.map(|q| (rotation * DQuat::from_array(q)).to_array());
                sample.frame = parent.clone();
            }
            frame = parent.clone();
            chain.push(frame.to_string());
        }
        if chain.len() > 1 {
            let text = format!(
                "`{topic}` is composed to the root of its transforms, in time: {}",
                chain.iter().rev().map(String::as_str).collect::<Vec<_>>().join(" -> ")
            );
            notes.push(Note::information(text));
        }
        let outside = outside.into_iter().filter(|outside| *outside).count();
        if outside > 0 {
            let text = format!(
                "{outside} poses of `{topic}` are before the first or after the last transform of a frame \
                    above: that nearest in time counts"
            );
            notes.push(Note::warning(text));
        }
        Ok(())
    }

    /// A warning that the frame of a topic has a pose of its own, which is not applied.
    pub(super) fn unused_parent_note(&self, topic: &str, frame: &str, topics: &Topics) -> Option<Note> {
        let (frame, _, parent) = self.links_above(frame).find(|(_, link, _)| !link.is_identity())?;
        let others: Vec<String> = topics
            .kinds
            .iter()
            .filter(|(key, kind)| **kind == RosKind::Transforms && key.child.as_ref() != Some(frame))
            .map(|(key, _)| key.to_string())
            .collect();
        let advice = if others.is_empty() {
            String::new()
        } else {
            format!(": for poses in the root set flight.topic to one of: {}", others.join(", "))
        };
        let text =
            format!("`{topic}` is in the frame `{frame}`, whose pose in `{parent}` is not applied{advice}");
        Some(Note::warning(text))
    }

    /// A note that the body of a topic is mounted in another one; a warning if it is turned there.
    pub(super) fn mount_note(&self, topic: &str, body: &str) -> Option<Note> {
        let (frame, link, parent) = self
            .links_above(body)
            .take_while(|(_, link, _)| link.is_constant())
            .find(|(_, link, _)| !link.is_identity())?;
        Some(Note {
            is_warning: link.turns(),
            text: format!(
                "`{topic}` is of `{body}`, and the pose of `{frame}` in `{parent}` is not applied: camera.mount \
                    counts from `{body}`"
            ),
        })
    }

    /// A frame and those above it, each with its pose in its parent; poses that only turn axes about, as those of
    /// `map_ned` in `map`, are passed over.
    fn links_above(&self, frame: &str) -> impl Iterator<Item = (&Arc<str>, &Link, &Arc<str>)> {
        let above = |frame: &str| {
            let (frame, link) = self.links.get_key_value(frame)?;
            Some((frame, link, link.parents.first()?))
        };
        std::iter::successors(above(frame), move |(_, _, parent)| above(parent))
            .take(MAX_LINKS)
            .filter(|(frame, link, _)| !link.turns_axes_only(frame))
    }
}
