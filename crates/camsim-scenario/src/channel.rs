//! Channels of a frame: the picture, and what is true of each of its pixels.

use serde::{Deserialize, Serialize};

use super::keys::Words;

/// A channel of a frame (`output.channels`).
///
/// All truth is that of the pixel's centre at the mid-exposure of its own row, on the distorted grid of the
/// output frame, where nothing else is said. Pixels without a ray have zeros. Blended surfaces count where
/// their alpha is 1/2 or more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, Words)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// The picture.
    Color,
    /// Planar depth, metres; 0 = nothing.
    Depth,
    /// 1 where a ray exists, else 0.
    Valid,
    /// `rows.csv`: time, pose and velocity of each row.
    Rows,
    /// Digital numbers of the image sensor (`[camera.sensor]`).
    Raw,
    /// Ideal ray, source coordinate, time and world point of each pixel.
    Coords,
    /// Distance from the optical centre along the ray, metres; 0 = nothing.
    Range,
    /// Unit normal of the surface towards the camera, in optical camera axes of the row (x right, y down,
    /// z forwards); 0 = nothing.
    Normal,
    /// Unit normal of the surface towards the camera, north, east, down; 0 = nothing.
    NormalWorld,
    /// Number of the object, from `objects.csv`; 0 = sky.
    Object,
    /// Class of the object, as the scenario gives it; 0 = none.
    Class,
    /// Share of the pixel's area and exposure that its `object` has, 0 to 1; 0 without a ray.
    Coverage,
    /// Optical flow to frame i + `output.flow_step`, pixels: where that frame, at the time of its own rows,
    /// shows the point that the pixel sees. With a state: seen, hidden, outside, several times.
    Flow,
    /// Optical flow to frame i - `output.flow_step`, pixels, with a state.
    FlowBack,
    /// Displacement to the picture that a global shutter takes of the same point at `output.flow_instant`,
    /// pixels, with a state.
    FlowGlobal,
    /// Velocity of the point's image at the pixel's own instant, pixels a second.
    Motion,
    /// Displacement of the point's image at the begin and at the end of the exposure, pixels.
    BlurPath,
}

/// Values of a channel that is a plane of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaneKind {
    /// 32 bit floats, with these component names.
    Float(&'static [&'static str]),
    /// Unsigned integers of up to 32 bits.
    Index,
}

/// Components of a flow: displacement, and one of [`FlowState`].
const FLOW: &[&str] = &["dx", "dy", "state"];

/// Whether the target of a flow shows the point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum FlowState {
    /// No ray, or a point behind the target's camera or beyond its lens: the displacement is 0.
    None = 0,
    /// The target shows the point.
    Visible = 1,
    /// Something is in front of the point.
    Occluded = 2,
    /// The point is outside of the target's picture.
    Outside = 3,
    /// The target shows the point several times; the displacement is the smallest.
    Several = 4,
}

impl Channel {
    /// What its plane holds; `None` for the channels that have a
    /// field of their own.
    #[must_use]
    pub fn plane(self) -> Option<PlaneKind> {
        match self {
            Self::Color | Self::Depth | Self::Valid | Self::Rows | Self::Raw | Self::Coords => None,
            Self::Range => Some(PlaneKind::Float(&["range"])),
            Self::Normal => Some(PlaneKind::Float(&["x", "y", "z"])),
            Self::NormalWorld => Some(PlaneKind::Float(&["n", "e", "d"])),
            Self::Coverage => Some(PlaneKind::Float(&["coverage"])),
            Self::Object | Self::Class => Some(PlaneKind::Index),
            Self::Flow | Self::FlowBack | Self::FlowGlobal => Some(PlaneKind::Float(FLOW)),
            Self::Motion => Some(PlaneKind::Float(&["vx", "vy"])),
            Self::BlurPath => Some(PlaneKind::Float(&["x0", "y0", "x1", "y1"])),
        }
    }

    /// Whether the surface of every pixel has to be known by a ray of its own.
    #[must_use]
    pub fn needs_every_ray(self) -> bool {
        self.plane().is_some()
    }

    /// Whether the renderers deliver depth and coordinates for it.
    #[must_use]
    pub fn needs_truth(self) -> bool {
        matches!(self, Self::Depth | Self::Coords) || self.needs_every_ray()
    }
}

/// Instant of a picture with a global shutter: that `flow_global` leads to, or a twin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum FlowInstant {
    /// Mid-exposure of the row that is read first.
    FirstRow,
    /// Mid-exposure of the image's centre.
    #[default]
    Centre,
    /// Mid-exposure of the row that is read last.
    LastRow,
}
