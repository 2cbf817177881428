//! MCAP with messages of ROS 2: pictures, calibrations, depth, inertial units, satellite receivers, transformations
//! and the true pose, by ascending time.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, BufWriter},
};

use camsim_core::pose::FLU_FROM_FRD;
use mcap::records::MessageHeader;
use serde::Serialize;

use crate::formats::exporting::imu::imus;
use crate::formats::exporting::page::{OPTICAL, PIXEL_CENTRE_0, Page, WORLD, timing};
use crate::formats::exporting::{DatasetError, ExportJob, Layout, stereo};
use crate::formats::writing::lens_names::{Family, lens};

mod messages;
mod pictures;
mod schemas;
mod sensors;

use messages::{StampedTransform, TransformMessage};

/// Name of the file.
const FILE: &str = "camsim.mcap";
/// Bytes of messages that are held before they are written.
const CHUNK: u64 = 8 << 20;

/// Something that sends messages by ascending time.
trait Source {
    /// Time of its next message; `None` at the end.
    fn next_ns(&self) -> Option<i64>;
    /// Sends the messages of that time.
    fn send(&mut self, bag: &mut Bag<'_>) -> Result<(), DatasetError>;
}

/// A file of messages that is being written.
struct Bag<'w> {
    writer: mcap::Writer<&'w mut BufWriter<File>>,
    channels: BTreeMap<String, (u16, u32)>,
}

fn failed(error: mcap::McapError) -> DatasetError {
    match error {
        mcap::McapError::Io(error) => DatasetError::Piece(error),
        error => DatasetError::Piece(io::Error::other(error.to_string())),
    }
}

/// Quality of service of transformations that hold for good: late subscribers get them.
const LATCHED: &str = "- history: 3\n  depth: 0\n  reliability: 1\n  durability: 1\n  deadline:\n    sec: 9223372036\n    \
                       nsec: 854775807\n  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n  liveliness: 1\n  \
                       liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n  \
                       avoid_ros_namespace_conventions: false\n";

impl<'w> Bag<'w> {
    fn create(out: &'w mut BufWriter<File>) -> Result<Self, DatasetError> {
        let writer = mcap::WriteOptions::new()
            .profile("ros2")
            .library(format!("camsim {}", env!("CARGO_PKG_VERSION")))
            // Pictures are compressed already.
            .compression(None)
            .chunk_size(Some(CHUNK))
            .create(out)
            .map_err(failed)?;
        Ok(Self { writer, channels: BTreeMap::new() })
    }

    /// Writes a message of this type; the first one of a topic makes its channel.
    fn send<T: Serialize>(
        &mut self,
        topic: &str,
        kind: &str,
        t_ns: i64,
        message: &T,
    ) -> Result<(), DatasetError> {
        let time = u64::try_from(t_ns).map_err(|_| {
            DatasetError::Refused(format!(
                "{topic} has a message at {t_ns} ns, and MCAP has no times before 0: set output.stamps = \"zero\" with an \
                 output.epoch_ns such as 1000000000"
            ))
        })?;
        if !self.channels.contains_key(topic) {
            let schema =
                self.writer.add_schema(kind, "ros2msg", schemas::text(kind).as_bytes()).map_err(failed)?;
            let qos = if topic == "/tf_static" { LATCHED } else { "" };
            let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), qos.to_owned())]);
            let channel = self.writer.add_channel(schema, topic, "cdr", &metadata).map_err(failed)?;
            self.channels.insert(topic.to_owned(), (channel, 0));
        }
        let Some((channel_id, sequence)) = self.channels.get_mut(topic) else { return Ok(()) };
        *sequence += 1;
        let header = MessageHeader {
            channel_id: *channel_id,
            sequence: *sequence,
            log_time: time,
            publish_time: time,
        };
        let data = messages::encode(message)?;
        self.writer.write_to_known_channel(&header, &data).map_err(failed)
    }
}

pub(crate) const LAYOUT: Layout = Layout {
    judge: Some(|camera| lens(Family::Ros, camera).map(drop)),
    begins_at_zero: true,
    ..Layout::new(write)
};

/// Writes the export; returns notes.
fn write(job: &ExportJob<'_>) -> Result<Vec<String>, DatasetError> {
    for camera in &job.run.cameras {
        camera.require(job.name(), &["color_png"])?;
    }
    let imus = imus(job.run)?;
    job.target.stream(FILE, &mut |out| {
        let mut sources: Vec<Box<dyn Source + '_>> = Vec::new();
        sources.push(Box::new(sensors::TruePoses::new(job)?));
        for (i, imu) in imus.iter().enumerate() {
            sources.push(Box::new(sensors::ImuMessages::new(i, imu)?));
        }
        for (i, receiver) in sensors::receivers(job.run)?.into_iter().enumerate() {
            sources.push(Box::new(sensors::Fixes::new(i, &receiver, job.run.shift_ns())?));
        }
        for (i, camera) in job.run.cameras.iter().enumerate() {
            sources.push(Box::new(pictures::Pictures::new(job, i, camera)?));
        }
        let mut bag = Bag::create(out)?;
        let first_ns = sources.iter().filter_map(|source| source.next_ns()).min();
        let fixed = TransformMessage { transforms: fixed(job, &imus, first_ns.unwrap_or(0)) };
        bag.send("/tf_static", "tf2_msgs/msg/TFMessage", first_ns.unwrap_or(0), &fixed)?;
        loop {
            let next =
                sources.iter_mut().filter(|source| source.next_ns().is_some()).min_by_key(|s| s.next_ns());
            let Some(source) = next else { break };
            source.send(&mut bag)?;
        }
        bag.writer.finish().map_err(failed)?;
        Ok(())
    })?;
    for (i, camera) in job.run.cameras.iter().enumerate() {
        if let Some(mask) = crate::formats::exporting::pictures::mask(camera)? {
            mask.write(job, &format!("mask_cam{i}.png"), 255)?;
        }
    }
    let late = imus.first().and_then(|imu| imu.begins_late(job.run));
    let notes: Vec<String> = late.into_iter().chain(stereo::note(&job.run.cameras)?).collect();
    job.target.text("README.md", &page(job, &notes))?;
    Ok(notes)
}

/// Transformations that hold for good.
fn fixed<'a>(
    job: &ExportJob<'_>,
    imus: &[crate::formats::exporting::imu::ImuSensor],
    t_ns: i64,
) -> Vec<StampedTransform<'a>> {
    let base_from_body = crate::formats::exporting::Rigid::turn(FLU_FROM_FRD);
    let cameras = job.run.cameras.iter().enumerate().filter(|(_, camera)| !camera.vibrates());
    let cameras = cameras.map(|(i, camera)| (format!("cam{i}"), camera.body_from_camera()));
    let imus = imus
        .iter()
        .enumerate()
        .filter(|(_, imu)| !imu.shakes)
        .map(|(i, imu)| (format!("imu{i}"), imu.body_from_imu));
    cameras
        .chain(imus)
        .map(|(name, body_from_it)| {
            StampedTransform::new(t_ns, "base_link", name, &base_from_body.of(&body_from_it))
        })
        .collect()
}

fn page(job: &ExportJob<'_>, notes: &[String]) -> String {
    let mut page = Page::new(&format!("MCAP with messages of ROS 2: `{FILE}`"), job);
    page.line("`map`", WORLD)
        .line("`base_link`", "the platform, x forward, y left, z up; camsim's own is forward, right, down")
        .line("`camN`", &format!("optical axes: {OPTICAL}"))
        .line("quaternions", "x y z w, as ROS has them")
        .line("pixels", PIXEL_CENTRE_0)
        .line(
            "`/camN/camera_info`",
            "`plumb_bob` (k1 k2 p1 p2 k3), `rational_polynomial` (k1 k2 p1 p2 k3 k4 k5 k6) or `equidistant` (k1 to k4), \
             coefficients as they are. R is the identity and P has the same focal lengths; of a rectified pair the right \
             (lower) camera has P[3] = -fx b (P[7] = -fy b)",
        )
        .line(
            "`/camN/image_raw/compressed`",
            "PNG without alpha, of as many bits as the run's; `mask_camN.png` beside the bag is 0 where the lens shows \
             nothing",
        )
        .line("`/camN/depth/image_raw`", "32FC1, planar z in metres, 0 = none (with the channel depth)")
        .line("`/imuN`", "as measured, in the sensor's axes; no orientation; covariances are the white noise's")
        .line("`/gnssN/fix`", "WGS-84, height above the ellipsoid")
        .line(
            "`/tf`, `/ground_truth/pose`",
            "`base_link` in `map`, exact, at the rate of trajectory.csv. A camera whose mount vibrates is a child of \
             `map`, with its pose at each picture, and an IMU on it has no transformation; the others are children of \
             `base_link` in `/tf_static`",
        )
        .line("stamps", "on the run's clock, as the camera gives them: its delay is in them");
    for (i, camera) in job.run.cameras.iter().enumerate() {
        page.line(&format!("time of cam{i}"), &timing(camera));
    }
    page.ending(notes)
}
