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
pub const COORDS_CHANNELS: usize = Channel::Coords.components().len();

/// Direction of a ray (u, v) of a camera in NED, of length 1. `coords` has it instead of a point where the
/// ray shows the sky.
#[must_use]
pub fn sky_direction_ned(pose: &CameraPose, uv: DVec2) -> DVec3 {
    pose.ned_from_camera * uv.extend(1.0).normalize()
}

/// A finished frame. Planes are row-major from the top-left pixel.
#[derive(Clone, Debug, Default)]
pub struct RenderedFrame {
    /// Frame number of the sequence.
    pub index: u64,
    /// Stamp t_i, nanoseconds on the log's clock.
    pub stamp_ns: i64,
    /// Width, height.
    pub size_px: [u32; 2],
    /// One record per row of the readout.
    pub rows: Vec<RowRecord>,
    /// Colour, and what else was asked for or had to be known for it, no channel twice.
    pub planes: Vec<Plane>,
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

/// A channel of a frame.
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
    /// Digital numbers.
    Raw(RawPicture),
}

impl PlaneValues {
    /// Number of values.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Float(values) => values.len(),
            Self::Index(values) => values.len(),
            Self::Raw(raw) => raw.values.len(),
        }
    }

    /// Whether it has no value.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl Plane {
    /// A plane of floats.
    #[must_use]
    pub fn float(channel: Channel, values: Vec<f32>) -> Self {
        Self { channel, values: PlaneValues::Float(values) }
    }

    /// The picture: linear R G B A, four floats per pixel; A is 1 where a ray exists, else 0.
    #[must_use]
    pub fn color(rgba: Vec<f32>) -> Self {
        Self::float(Channel::Color, rgba)
    }

    /// Planar depth in the row's own camera, metres; 0 = nothing.
    #[must_use]
    pub fn depth(depth_m: Vec<f32>) -> Self {
        Self::float(Channel::Depth, depth_m)
    }

    /// Per pixel: ideal ray u, v; source x, y in the ideal frame (pixels); Delta t (s); and n, e, d of the
    /// ray's point at mid-exposure (m), or, for the sky (depth 0), its direction of length 1. All 0 where
    /// there is no ray.
    #[must_use]
    pub fn coords(values: Vec<[f32; COORDS_CHANNELS]>) -> Self {
        Self::float(Channel::Coords, values.into_flattened())
    }
}

impl RenderedFrame {
    /// A picture alone: linear R G B A, four floats per pixel.
    #[must_use]
    pub fn picture(size_px: [u32; 2], color_rgba: Vec<f32>) -> Self {
        Self { size_px, planes: vec![Plane::color(color_rgba)], ..Self::default() }
    }

    /// Values of a channel.
    #[must_use]
    pub fn values(&self, channel: Channel) -> Option<&PlaneValues> {
        self.planes.iter().find(|plane| plane.channel == channel).map(|plane| &plane.values)
    }

    /// Values of a channel, to change them.
    pub fn values_mut(&mut self, channel: Channel) -> Option<&mut PlaneValues> {
        self.planes.iter_mut().find(|plane| plane.channel == channel).map(|plane| &mut plane.values)
    }

    /// Adds a channel, instead of the values that it has.
    pub fn set(&mut self, channel: Channel, values: PlaneValues) {
        match self.values_mut(channel) {
            Some(old) => *old = values,
            None => self.planes.push(Plane { channel, values }),
        }
    }

    /// Floats of a channel, the components of a pixel side by side.
    #[must_use]
    pub fn floats(&self, channel: Channel) -> Option<&[f32]> {
        match self.values(channel)? {
            PlaneValues::Float(values) => Some(values),
            _ => None,
        }
    }

    /// Floats of a channel, to change them.
    pub fn floats_mut(&mut self, channel: Channel) -> Option<&mut [f32]> {
        match self.values_mut(channel)? {
            PlaneValues::Float(values) => Some(values),
            _ => None,
        }
    }

    /// Floats of a channel, of which nothing else is kept.
    #[must_use]
    pub fn into_floats(self, channel: Channel) -> Option<Vec<f32>> {
        self.planes.into_iter().find(|plane| plane.channel == channel).and_then(|plane| match plane.values {
            PlaneValues::Float(values) => Some(values),
            _ => None,
        })
    }

    /// Numbers of a channel of indices.
    #[must_use]
    pub fn indices(&self, channel: Channel) -> Option<&[u32]> {
        match self.values(channel)? {
            PlaneValues::Index(values) => Some(values),
            _ => None,
        }
    }

    /// The picture ([`Plane::color`]); empty without one.
    #[must_use]
    pub fn color_rgba(&self) -> &[f32] {
        self.floats(Channel::Color).unwrap_or_default()
    }

    /// The picture, to change it; empty without one.
    pub fn color_rgba_mut(&mut self) -> &mut [f32] {
        self.floats_mut(Channel::Color).unwrap_or_default()
    }

    /// The picture, of which nothing else is kept.
    #[must_use]
    pub fn into_color(self) -> Vec<f32> {
        self.into_floats(Channel::Color).unwrap_or_default()
    }

    /// Depths ([`Plane::depth`]).
    #[must_use]
    pub fn depth_m(&self) -> Option<&[f32]> {
        self.floats(Channel::Depth)
    }

    /// Coordinates ([`Plane::coords`]).
    #[must_use]
    pub fn coords(&self) -> Option<&[[f32; COORDS_CHANNELS]]> {
        self.floats(Channel::Coords).map(|values| values.as_chunks().0)
    }

    /// Digital numbers of the image sensor, if the camera has one; the picture is developed of them then.
    #[must_use]
    pub fn raw(&self) -> Option<&RawPicture> {
        match self.values(Channel::Raw)? {
            PlaneValues::Raw(raw) => Some(raw),
            _ => None,
        }
    }
}
