//! A rendered frame as plain data, passed from renderers to writers.

use glam::{DQuat, DVec2, DVec3};

use crate::{pose::CameraPose, scenario::Channel};

/// Time, pose and velocity of one row of the readout at its mid-exposure. With sideways readout it is a
/// column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowRecord {
    /// Row number from 0.
    pub row: u32,
    /// Mid-exposure, nanoseconds on the log's clock.
    pub t_mid_ns: i64,
    /// Optical centre in NED.
    pub position_ned_m: DVec3,
    /// Takes optical camera coordinates to NED.
    pub ned_from_camera: DQuat,
    /// Velocity of the optical centre in NED.
    pub velocity_ned_m_s: DVec3,
    /// Exposure time, nanoseconds.
    pub exposure_ns: i64,
}

/// Floats per pixel of [`RenderedFrame::coords`].
pub const COORDS_CHANNELS: usize = 8;

/// Direction of a ray (u, v) of a camera in NED, of length 1. `coords` has it in place of a point where the
/// ray shows the sky.
#[must_use]
pub fn sky_direction_ned(pose: &CameraPose, uv: DVec2) -> DVec3 {
    pose.ned_from_camera * uv.extend(1.0).normalize()
}

/// A finished frame. Images are row-major from the top-left pixel.
#[derive(Clone, Debug, Default)]
pub struct RenderedFrame {
    /// Frame number of the sequence.
    pub index: u64,
    /// Stamp t_i, nanoseconds on the log's clock.
    pub stamp_ns: i64,
    /// Width, height.
    pub size_px: [u32; 2],
    /// Linear R G B A, four floats per pixel; A is 1 where a ray exists, else 0.
    pub color_rgba: Vec<f32>,
    /// Planar depth in the row's own camera, metres; 0 = nothing.
    pub depth_m: Option<Vec<f32>>,
    /// Per pixel: ideal ray u, v; source x, y in the ideal frame (pixels); Delta t (s); and n, e, d of the
    /// ray's point at mid-exposure (m), or, for the sky (depth 0), its direction of length 1. All 0 where
    /// there is no ray.
    pub coords: Option<Vec<[f32; COORDS_CHANNELS]>>,
    /// One record per row of the readout.
    pub rows: Vec<RowRecord>,
    /// The other truth channels ([`Channel::plane`]).
    pub planes: Vec<Plane>,
    /// Digital numbers of the image sensor, if the camera has one; `color_rgba` is developed of them then.
    pub raw: Option<RawPicture>,
}

/// Digital numbers of an image sensor, row-major.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RawPicture {
    /// Numbers of each pixel, side by side: 1 of a mosaic, 3 of a sensor that measures all colours.
    pub channels: u32,
    /// Bits of each number.
    pub bits: u32,
    /// The numbers.
    pub values: Vec<u16>,
}

/// A truth channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Which one.
    pub channel: Channel,
    /// Its values.
    pub values: PlaneValues,
}

/// Values of a plane, row-major.
#[derive(Clone, Debug, PartialEq)]
pub enum PlaneValues {
    /// All components of a pixel side by side.
    Float(Vec<f32>),
    /// One number a pixel.
    Index(Vec<u32>),
}

impl RenderedFrame {
    /// Floats of a channel, the components of a pixel side by side.
    #[must_use]
    pub fn floats(&self, channel: Channel) -> Option<&[f32]> {
        self.planes.iter().find(|plane| plane.channel == channel).and_then(|plane| match &plane.values {
            PlaneValues::Float(values) => Some(values.as_slice()),
            PlaneValues::Index(_) => None,
        })
    }

    /// Numbers of a channel of indices.
    #[must_use]
    pub fn indices(&self, channel: Channel) -> Option<&[u32]> {
        self.planes.iter().find(|plane| plane.channel == channel).and_then(|plane| match &plane.values {
            PlaneValues::Index(values) => Some(values.as_slice()),
            PlaneValues::Float(_) => None,
        })
    }
}
