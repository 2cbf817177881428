//! Channels of a frame: the picture, and what is true of each of its pixels.

use serde::{Deserialize, Serialize};

use super::keys::Words;

/// A channel of a frame (`output.channels`). Its line in [`CHANNELS`] has its facts.
///
/// All truth is that of the pixel's centre at the mid-exposure of its own row, on the distorted grid of the
/// output frame, where nothing else is said. Pixels without a ray have zeros. Blended surfaces count where
/// their alpha is 1/2 or more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, Words)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// The picture: linear R, G, B and A; A is 1 where a ray exists, else 0.
    Color,
    /// Planar depth along the optical axis, metres; 0 = sky, negative beyond 90 degrees off axis. Never
    /// interpolated across an edge.
    Depth,
    /// 255 where a ray exists, else 0.
    Valid,
    /// Time, pose and velocity of each row, in a table.
    Rows,
    /// Digital numbers of the image sensor (`[camera.sensor]`): the mosaic, or three of a sensor without one.
    Raw,
    /// Ideal ray u, v; source x, y in the ideal frame, pixels; time after the stamp, s; point or, for the sky,
    /// direction: north, east, down.
    Coords,
    /// Distance from the optical centre along the ray, metres; 0 = sky.
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
    /// Fraction of the pixel's area and exposure that its `object` has, 0 to 1; 0 without a ray.
    Coverage,
    /// Optical flow to frame i + `output.flow_step`, pixels: where that frame, at the time of its own rows,
    /// shows the point that the pixel sees. With a state: 1 seen, 2 hidden, 3 outside,
    /// 4 several times, 0 none.
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

/// Facts of a channel. Its files, checks and pictures follow from them, its attribute in Python and its line in
/// docs/reference/CHANNELS.md; what it holds is said at the variant.
#[derive(Clone, Copy, Debug)]
pub struct ChannelFacts {
    /// Which one.
    pub channel: Channel,
    /// Values of a pixel, and with them the files.
    pub kind: PlaneKind,
    /// Unit; empty without one.
    pub unit: &'static str,
    /// What gives the values.
    pub source: ChannelSource,
    /// What `camsim verify` allows a value to be off by.
    pub check: Check,
    /// How it is drawn for people.
    pub colors: Colors,
}

/// Values that a channel has at each pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaneKind {
    /// Colour: floats with these component names, in the files of `output.format`.
    Color(&'static [&'static str]),
    /// 32 bit floats with these component names: EXR.
    Float(&'static [&'static str]),
    /// Unsigned integers of up to 32 bits, of which files hold 16: PNG.
    Index,
    /// 255 where the colour is valid, else 0: PNG.
    Mask,
    /// Digital numbers of 16 bits, in files of `output.raw_format`.
    Raw,
    /// No plane, but a table with a line for each row: CSV.
    Table,
}

/// What gives the values of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChannelSource {
    /// The picture, or the plan.
    Picture,
    /// A ray for every pixel; with the paper's solvers the renderers.
    Renderer,
    /// A ray for every pixel.
    Rays,
}

/// How a channel is compared with the reference renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Check {
    /// By the errors of the picture and of its sources alone.
    Picture,
    /// As depth and point: relative to the depth.
    Point,
    /// Relative to the value.
    Relative,
    /// By the angle to a unit vector.
    Direction,
    /// No difference is allowed.
    Exact,
    /// Absolute difference; larger where an object is in a pixel but in no pixel beside it.
    Fraction,
    /// Distance of displacements; their states are equal.
    Displacement,
    /// Distance of velocities, in part relative.
    Velocity,
}

/// How a channel is drawn for people.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Colors {
    /// Not at all.
    None,
    /// As the picture that it is.
    Picture,
    /// A scale by the logarithm, near red and far blue.
    Distance,
    /// Red, green and blue by the components of a unit vector times these signs.
    Direction([f32; 3]),
    /// A colour for each number.
    Palette,
    /// Grey from 0 to 1.
    Grey,
    /// Hue by direction, pale where short, dark where a state says that the point is not seen.
    Displacement,
}

/// What channels of truth by rays have alike.
const RAYS: ChannelFacts = ChannelFacts {
    channel: Channel::Range,
    kind: PlaneKind::Float(&["range"]),
    unit: "m",
    source: ChannelSource::Rays,
    check: Check::Relative,
    colors: Colors::Distance,
};
const INDEX: ChannelFacts =
    ChannelFacts { kind: PlaneKind::Index, unit: "", check: Check::Exact, colors: Colors::Palette, ..RAYS };
const NORMAL: ChannelFacts = ChannelFacts {
    kind: PlaneKind::Float(&["x", "y", "z"]),
    unit: "",
    check: Check::Direction,
    colors: Colors::Direction([1.0, -1.0, -1.0]),
    ..RAYS
};
/// Displacement, and one of [`FlowState`].
const FLOW: ChannelFacts = ChannelFacts {
    kind: PlaneKind::Float(&["dx", "dy", "state"]),
    unit: "px",
    check: Check::Displacement,
    colors: Colors::Displacement,
    ..RAYS
};
/// What belongs to the picture.
const PICTURE: ChannelFacts = ChannelFacts {
    channel: Channel::Color,
    kind: PlaneKind::Color(&["R", "G", "B", "A"]),
    unit: "",
    source: ChannelSource::Picture,
    check: Check::Picture,
    colors: Colors::None,
};
/// What the renderers deliver beside the picture.
const RENDERER: ChannelFacts =
    ChannelFacts { source: ChannelSource::Renderer, check: Check::Point, unit: "m", ..PICTURE };

/// The channels, in the order of [`Channel::ALL`].
pub static CHANNELS: [ChannelFacts; Channel::ALL.len()] = [
    ChannelFacts { colors: Colors::Picture, ..PICTURE },
    ChannelFacts {
        channel: Channel::Depth,
        kind: PlaneKind::Float(&["Z"]),
        colors: Colors::Distance,
        ..RENDERER
    },
    ChannelFacts { channel: Channel::Valid, kind: PlaneKind::Mask, ..PICTURE },
    ChannelFacts { channel: Channel::Rows, kind: PlaneKind::Table, ..PICTURE },
    ChannelFacts { channel: Channel::Raw, kind: PlaneKind::Raw, unit: "DN", ..PICTURE },
    ChannelFacts {
        channel: Channel::Coords,
        kind: PlaneKind::Float(&["u", "v", "x", "y", "dt", "n", "e", "d"]),
        unit: "1, px, s, m",
        ..RENDERER
    },
    RAYS,
    ChannelFacts { channel: Channel::Normal, ..NORMAL },
    ChannelFacts {
        channel: Channel::NormalWorld,
        kind: PlaneKind::Float(&["n", "e", "d"]),
        colors: Colors::Direction([1.0; 3]),
        ..NORMAL
    },
    ChannelFacts { channel: Channel::Object, ..INDEX },
    ChannelFacts { channel: Channel::Class, ..INDEX },
    ChannelFacts {
        channel: Channel::Coverage,
        kind: PlaneKind::Float(&["coverage"]),
        unit: "",
        check: Check::Fraction,
        colors: Colors::Grey,
        ..RAYS
    },
    ChannelFacts { channel: Channel::Flow, ..FLOW },
    ChannelFacts { channel: Channel::FlowBack, ..FLOW },
    ChannelFacts { channel: Channel::FlowGlobal, ..FLOW },
    ChannelFacts {
        channel: Channel::Motion,
        kind: PlaneKind::Float(&["vx", "vy"]),
        unit: "px/s",
        check: Check::Velocity,
        ..FLOW
    },
    ChannelFacts { channel: Channel::BlurPath, kind: PlaneKind::Float(&["x0", "y0", "x1", "y1"]), ..FLOW },
];

// A channel's index in the table is its number.
const _: () = {
    let mut i = 0;
    while i < CHANNELS.len() {
        assert!(CHANNELS[i].channel as usize == i);
        i += 1;
    }
};

impl Channel {
    /// Its line in [`CHANNELS`].
    #[must_use]
    pub const fn facts(self) -> &'static ChannelFacts {
        &CHANNELS[self as usize]
    }

    /// What its plane holds.
    #[must_use]
    pub const fn kind(self) -> PlaneKind {
        self.facts().kind
    }

    /// Names of the components of a pixel that files have by name; none of a plane of whole numbers.
    #[must_use]
    pub const fn components(self) -> &'static [&'static str] {
        match self.kind() {
            PlaneKind::Color(names) | PlaneKind::Float(names) => names,
            PlaneKind::Index | PlaneKind::Mask | PlaneKind::Raw | PlaneKind::Table => &[],
        }
    }

    /// Whether the surface of every pixel has to be known by a ray of its own.
    #[must_use]
    pub fn needs_every_ray(self) -> bool {
        self.facts().source == ChannelSource::Rays
    }

    /// Whether the renderers deliver depth and coordinates for it.
    #[must_use]
    pub fn needs_truth(self) -> bool {
        self.facts().source != ChannelSource::Picture
    }
}

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
