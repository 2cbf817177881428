//! The ROS messages that hold a pose, or a part of one.

use std::{collections::HashSet, sync::Arc};

use super::cdr::Decoder;

/// Kind of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(in super::super) enum RosKind {
    Pose,
    PoseWithCovariance,
    Odometry,
    Transform,
    Transforms,
    NavSatFix,
    Imu,
}

impl RosKind {
    const ALL: [Self; 7] = [
        Self::Pose,
        Self::PoseWithCovariance,
        Self::Odometry,
        Self::Transform,
        Self::Transforms,
        Self::NavSatFix,
        Self::Imu,
    ];

    /// Name as ROS 1 writes it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Pose => "geometry_msgs/PoseStamped",
            Self::PoseWithCovariance => "geometry_msgs/PoseWithCovarianceStamped",
            Self::Odometry => "nav_msgs/Odometry",
            Self::Transform => "geometry_msgs/TransformStamped",
            Self::Transforms => "tf2_msgs/TFMessage",
            Self::NavSatFix => "sensor_msgs/NavSatFix",
            Self::Imu => "sensor_msgs/Imu",
        }
    }

    /// The kind of a schema's name, as `nav_msgs/msg/Odometry`.
    pub(super) fn of_schema(name: &str) -> Option<Self> {
        let plain = name.replace("/msg/", "/");
        let plain = if plain == "tf/tfMessage" { "tf2_msgs/TFMessage" } else { &plain };
        Self::ALL.into_iter().find(|kind| kind.name() == plain)
    }

    pub(super) fn has_position(self) -> bool {
        self != Self::Imu
    }
}

/// What a message states.
#[derive(Clone, Debug, PartialEq)]
pub(in super::super) struct Sample {
    /// Number of the message in the file, from 1.
    pub(in super::super) number: usize,
    /// Stamp of the header.
    pub(in super::super) stamp_ns: i128,
    /// Time at which it was recorded.
    pub(in super::super) recorded_ns: i128,
    /// x, y, z, or latitude, longitude, height.
    pub(in super::super) position: Option<[f64; 3]>,
    /// x, y, z, w.
    pub(in super::super) rotation: Option<[f64; 4]>,
    /// Whether a receiver had a fix; true of other messages.
    pub(in super::super) is_valid: bool,
    /// Frame of the header, without the slash that ROS 1 had before it.
    pub(in super::super) frame: Arc<str>,
    /// Frame whose pose it is, where the message names it.
    pub(in super::super) child: Option<Arc<str>>,
}

impl Sample {
    /// The stamp, or the time of the recording where it is 0.
    pub(super) fn time_ns(&self) -> i128 {
        if self.stamp_ns == 0 { self.recorded_ns } else { self.stamp_ns }
    }
}

/// Names of frames, each once.
#[derive(Debug, Default)]
pub(super) struct Names(HashSet<Arc<str>>);

impl Names {
    fn intern(&mut self, name: &str) -> Arc<str> {
        let name = name.trim_start_matches('/');
        if let Some(known) = self.0.get(name) {
            return known.clone();
        }
        let new = Arc::<str>::from(name);
        self.0.insert(new.clone());
        new
    }
}

/// The samples of a message; `None` if the message is too short.
pub(super) fn decode(
    kind: RosKind,
    mut decoder: Decoder<'_>,
    number: usize,
    recorded_ns: i128,
    names: &mut Names,
) -> Option<Vec<Sample>> {
    let sample = |(stamp_ns, frame), child, position, rotation, is_valid| Sample {
        number,
        stamp_ns,
        recorded_ns,
        position,
        rotation,
        is_valid,
        frame,
        child,
    };
    let d = &mut decoder;
    match kind {
        RosKind::Transforms => {
            let count = d.u32()?;
            let mut samples = Vec::new();
            for _ in 0..count {
                let header = header(d, names)?;
                let child = names.intern(&d.text()?);
                let (position, rotation) = (d.f64s()?, d.f64s()?);
                samples.push(sample(header, Some(child), Some(position), Some(rotation), true));
            }
            Some(samples)
        }
        RosKind::Pose | RosKind::PoseWithCovariance | RosKind::Odometry | RosKind::Transform => {
            let header = header(d, names)?;
            let child = if matches!(kind, RosKind::Odometry | RosKind::Transform) {
                Some(names.intern(&d.text()?)).filter(|name| !name.is_empty())
            } else {
                None
            };
            let (position, rotation) = (d.f64s()?, d.f64s()?);
            Some(vec![sample(header, child, Some(position), Some(rotation), true)])
        }
        RosKind::NavSatFix => {
            let header = header(d, names)?;
            let status = d.u8()?.cast_signed();
            d.u16()?;
            let position = d.f64s()?;
            Some(vec![sample(header, None, Some(position), None, status >= 0)])
        }
        RosKind::Imu => {
            let header = header(d, names)?;
            let rotation = d.f64s()?;
            let covariance: [f64; 9] = d.f64s()?;
            // A first element of -1 says that there is no orientation.
            let has_rotation = covariance[0] != -1.0 && rotation != [0.0; 4];
            Some(vec![sample(header, None, None, has_rotation.then_some(rotation), true)])
        }
    }
}

/// Stamp and frame of a header.
fn header(decoder: &mut Decoder<'_>, names: &mut Names) -> Option<(i128, Arc<str>)> {
    if decoder.is_ros1 {
        decoder.u32()?;
    }
    let (seconds, nanoseconds) = (decoder.u32()?, decoder.u32()?);
    let frame = names.intern(&decoder.text()?);
    Some((i128::from(seconds.cast_signed()) * 1_000_000_000 + i128::from(nanoseconds), frame))
}
