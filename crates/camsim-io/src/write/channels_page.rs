//! `docs/reference/CHANNELS.md`, and the attributes of frames in Python.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::{fmt::Write as _, path::Path};

use camsim_core::{
    reference::{
        COVERAGE_TOLERANCE, DEPTH_TOLERANCE, FLOW_TOLERANCE_PX, MOTION_TOLERANCE, NORMAL_TOLERANCE_RAD,
    },
    scenario::{
        CHANNELS, Channel, ChannelFacts, Check, Colors, ImageFormat, OutputEncoding, OutputSpec, PlaneKind,
        RawFormat, keys::Value,
    },
};

use super::FrameFiles;

const PAGE: &str = "\
# Channels

What camsim knows of every pixel of an output frame: on the distorted grid that the camera really has, at the instant \
at which the pixel's own row is exposed. Made from the table of channels by `CAMSIM_BLESS=1 cargo test -p camsim-io \
--lib channels`.

```sh
camsim render flight.toml --outputs color,range,normal,flow --sheet -o out
```

writes those, and `channels.png`, a picture of each.

![Colour, depth, range and normal; normal in the world, object, coverage and flow; flow back, flow to a global \
shutter, motion and blur path](../pictures/channels.png)

All values are those of the pixel's centre at the mid-exposure of its row, if nothing else is said. Pixels without a \
ray (beyond the lens) have zeros. Of blended surfaces the nearest whose alpha is 1/2 or more counts; masked surfaces \
count where their texture keeps them. EXR files have a layer for each component. [TRUTH](../theory/TRUTH.md) has the \
definitions in full, how each value is found, and how it is checked.

| channel | file | in Python | unit | holds | in colour | [`verify`](../theory/TRUTH.md#measured) allows |
|---|---|---|---|---|---|---|
";

const MODULE: &str = "\
\"\"\"The channels of a frame as attributes.

Made from the table of channels by `CAMSIM_BLESS=1 cargo test -p camsim-io --lib channels`.
\"\"\"

from typing import Any

import numpy as np
from numpy.typing import NDArray


class Channels:
    \"\"\"An array for each channel; that of one that was not asked for is an `AttributeError`.\"\"\"

    __slots__ = ()

    def _attribute(self, channel: str) -> NDArray[Any]:
        raise NotImplementedError
";

/// What the words of `output.channels` say.
fn about(channel: Channel) -> &'static str {
    Channel::WORDS[channel as usize].about
}

fn files(channel: Channel) -> String {
    let output = OutputSpec {
        channels: vec![channel],
        format: ImageFormat::ALL.to_vec(),
        palette: true,
        ..OutputSpec::default()
    };
    let of_format = |raw_format: &RawFormat| {
        let output = OutputSpec { raw_format: *raw_format, ..output.clone() };
        FrameFiles::new(Path::new(""), &output, OutputEncoding::default()).paths(&[123])
    };
    let mut files: Vec<String> = Vec::new();
    for file in RawFormat::ALL.iter().flat_map(of_format) {
        if !files.contains(&file) {
            files.push(file);
        }
    }
    let layers = channel.components().join(" ");
    let layers = if layers.is_empty() { layers } else { format!(": `{layers}`") };
    format!("`{}`{layers}", files.join("` `"))
}

/// Name of the attribute, numpy's type, and the shape of the array; `None` of a table.
fn array(channel: Channel) -> Option<(String, &'static str, String)> {
    let of = |components: usize| match components {
        1 => String::new(),
        _ => format!(" x {components}"),
    };
    let (dtype, shape) = match channel.kind() {
        PlaneKind::Color(names) | PlaneKind::Float(names) => ("float32", of(names.len())),
        PlaneKind::Index => ("uint16", of(1)),
        PlaneKind::Raw => ("uint16", " (x 3 without a mosaic)".to_owned()),
        PlaneKind::Mask => ("uint8", of(1)),
        PlaneKind::Table => return None,
    };
    let attribute = if channel == Channel::Class { "class_" } else { channel.name() };
    Some((attribute.to_owned(), dtype, format!("height x width{shape}")))
}

fn has_state(channel: Channel) -> bool {
    channel.components().contains(&"state")
}

fn allowed(channel: Channel, check: Check) -> String {
    let percent = |fraction: f64| format!("{} %", 100.0 * fraction);
    match check {
        Check::Picture => String::new(),
        Check::Point => format!("{} of the depth", percent(DEPTH_TOLERANCE)),
        Check::Relative => percent(DEPTH_TOLERANCE),
        Check::Direction => format!("{:.1} degrees", NORMAL_TOLERANCE_RAD.to_degrees()),
        Check::Exact => "nothing".to_owned(),
        Check::Fraction => COVERAGE_TOLERANCE.to_string(),
        Check::Displacement if has_state(channel) => format!("{FLOW_TOLERANCE_PX} px, states equal"),
        Check::Displacement => format!("{FLOW_TOLERANCE_PX} px"),
        Check::Velocity => format!("{} and {} px/s", percent(MOTION_TOLERANCE.0), MOTION_TOLERANCE.1),
    }
}

fn drawn(channel: Channel, colors: Colors) -> String {
    let text = match colors {
        Colors::None => "",
        Colors::Picture => "as it is",
        Colors::Distance => "turbo by the logarithm between the 1st and 99th percentile, near red",
        Colors::Palette => "a colour for each number",
        Colors::Grey => "grey",
        Colors::Displacement if has_state(channel) => {
            "hue by direction (red right, green-yellow down), pale where short, dark where not seen"
        }
        Colors::Displacement => "hue by direction, pale where short",
        Colors::Direction(signs) => {
            let axes = channel.components().iter().zip(signs);
            let axes: Vec<String> =
                axes.map(|(name, sign)| format!("{}{name}", if sign < 0.0 { "-" } else { "" })).collect();
            return format!("red, green, blue: {}", axes.join(", "));
        }
    };
    text.to_owned()
}

fn page() -> String {
    let mut page = PAGE.to_owned();
    for &ChannelFacts { channel, unit, check, colors, .. } in &CHANNELS {
        let (name, files, about) = (channel.name(), files(channel), about(channel));
        let python = array(channel).map_or_else(
            || format!("`frame.{name}`: [columns](COLUMNS.md#{name})"),
            |(attribute, dtype, shape)| format!("`frame.{attribute}`: {dtype}, {shape}"),
        );
        let (allowed, drawn) = (allowed(channel, check), drawn(channel, colors));
        writeln!(page, "| `{name}` | {files} | {python} | {unit} | {about} | {drawn} | {allowed} |").unwrap();
    }
    page
}

fn module() -> String {
    let mut module = MODULE.to_owned();
    for &ChannelFacts { channel, .. } in &CHANNELS {
        let Some((attribute, dtype, shape)) = array(channel) else { continue };
        let (name, about) = (channel.name(), about(channel));
        write!(
            module,
            "
    @property
    def {attribute}(self) -> NDArray[np.{dtype}]:
        \"\"\"{about} An array of {dtype}, {shape}.\"\"\"
        return self._attribute({name:?})
"
        )
        .unwrap();
    }
    module
}

#[test]
fn the_page_of_channels_is_up_to_date() {
    crate::inputs_page::check("../CHANNELS.md", &page());
    crate::inputs_page::check("../../../python/camsim/_channels.py", &module());
}
