//! Messages of ROS 2, as far as exports send them, in CDR.

use serde::{Serialize, Serializer};

use crate::formats::axes::Rigid;
use crate::formats::exporting::DatasetError;
use crate::text::numbers::xyzw;

/// CDR, little-endian, with its four bytes of encapsulation.
pub(super) fn encode<T: Serialize>(message: &T) -> Result<Vec<u8>, DatasetError> {
    let mut bytes = Vec::with_capacity(4 + 2 * size_of::<T>());
    bytes.extend([0, 1, 0, 0]);
    let body = cdr_encoding::to_vec::<T, byteorder::LittleEndian>(message)
        .map_err(|error| DatasetError::Piece(std::io::Error::other(error.to_string())))?;
    bytes.extend(body);
    Ok(bytes)
}

/// `builtin_interfaces/msg/Time`.
#[derive(Clone, Copy, Serialize)]
pub(super) struct Time {
    sec: i32,
    nanosec: u32,
}

impl Time {
    pub(super) fn new(t_ns: i64) -> Self {
        let sec = t_ns.div_euclid(1_000_000_000);
        // Beyond 2038 the type of ROS ends.
        Self { sec: i32::try_from(sec).unwrap_or(i32::MAX), nanosec: t_ns.rem_euclid(1_000_000_000) as u32 }
    }
}

/// `std_msgs/msg/Header`.
#[derive(Clone, Serialize)]
pub(super) struct Header {
    pub(super) stamp: Time,
    pub(super) frame_id: String,
}

impl Header {
    pub(super) fn new(t_ns: i64, frame: impl Into<String>) -> Self {
        Self { stamp: Time::new(t_ns), frame_id: frame.into() }
    }
}

/// A sequence of bytes.
pub(super) struct Bytes(pub(crate) Vec<u8>);

impl Serialize for Bytes {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(&self.0)
    }
}

/// `sensor_msgs/msg/CompressedImage`.
#[derive(Serialize)]
pub(super) struct CompressedImage {
    pub(super) header: Header,
    pub(super) format: String,
    pub(super) data: Bytes,
}

/// `sensor_msgs/msg/Image`.
#[derive(Serialize)]
pub(super) struct Image {
    pub(super) header: Header,
    pub(super) height: u32,
    pub(super) width: u32,
    pub(super) encoding: String,
    pub(super) is_bigendian: u8,
    pub(super) step: u32,
    pub(super) data: Bytes,
}

/// `sensor_msgs/msg/RegionOfInterest`.
#[derive(Clone, Copy, Default, Serialize)]
pub(super) struct RegionOfInterest {
    x_offset: u32,
    y_offset: u32,
    height: u32,
    width: u32,
    do_rectify: bool,
}

/// `sensor_msgs/msg/CameraInfo`.
#[derive(Clone, Serialize)]
pub(super) struct CameraInfo {
    pub(super) header: Header,
    pub(super) height: u32,
    pub(super) width: u32,
    pub(super) distortion_model: String,
    pub(super) d: Vec<f64>,
    pub(super) k: [f64; 9],
    pub(super) r: [f64; 9],
    pub(super) p: [f64; 12],
    pub(super) binning_x: u32,
    pub(super) binning_y: u32,
    pub(super) roi: RegionOfInterest,
}

/// `sensor_msgs/msg/Imu`.
#[derive(Serialize)]
pub(super) struct Imu {
    pub(super) header: Header,
    /// x, y, z, w.
    pub(super) orientation: [f64; 4],
    pub(super) orientation_covariance: [f64; 9],
    pub(super) angular_velocity: [f64; 3],
    pub(super) angular_velocity_covariance: [f64; 9],
    pub(super) linear_acceleration: [f64; 3],
    pub(super) linear_acceleration_covariance: [f64; 9],
}

/// `sensor_msgs/msg/NavSatFix`.
#[derive(Serialize)]
pub(super) struct NavSatFix {
    pub(super) header: Header,
    /// -1 without a fix, 0 with one.
    pub(super) status: i8,
    pub(super) service: u16,
    pub(super) latitude: f64,
    pub(super) longitude: f64,
    pub(super) altitude: f64,
    pub(super) position_covariance: [f64; 9],
    pub(super) position_covariance_type: u8,
}

/// `geometry_msgs/msg/Pose`: position, then x, y, z, w.
#[derive(Clone, Copy, Serialize)]
pub(super) struct Pose {
    position: [f64; 3],
    orientation: [f64; 4],
}

impl Pose {
    pub(super) fn new(pose: &Rigid) -> Self {
        Self { position: pose.translation_m.to_array(), orientation: xyzw(pose.rotation) }
    }
}

/// `geometry_msgs/msg/PoseStamped`.
#[derive(Serialize)]
pub(super) struct PoseStamped {
    pub(super) header: Header,
    pub(super) pose: Pose,
}

/// `geometry_msgs/msg/TransformStamped`.
#[derive(Serialize)]
pub(super) struct StampedTransform<'a> {
    header: Header,
    child_frame_id: std::borrow::Cow<'a, str>,
    /// Laid out as a pose.
    transform: Pose,
}

impl<'a> StampedTransform<'a> {
    /// Axes of `child` in `parent`.
    pub(super) fn new(
        t_ns: i64,
        parent: &str,
        child: impl Into<std::borrow::Cow<'a, str>>,
        parent_from_child: &Rigid,
    ) -> Self {
        let header = Header::new(t_ns, parent);
        Self { header, child_frame_id: child.into(), transform: Pose::new(parent_from_child) }
    }
}

/// `tf2_msgs/msg/TFMessage`.
#[derive(Serialize)]
pub(super) struct TransformMessage<'a> {
    pub(super) transforms: Vec<StampedTransform<'a>>,
}
