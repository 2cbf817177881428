//! Planes of EXR files by name, from all layers and parts.
//!
//! The full name of a plane is `layer.channel`, as in Blender's multilayer files (`ViewLayer.Depth.Z`). In
//! files of several parts the name of the part comes first, unless the channel already has it. A plane is
//! found by its full name, or by the end of it if that is unique.

use std::path::{Path, PathBuf};

use exr::prelude::read_all_flat_layers_from_file;

use super::{FrameFileError, images::failure};

/// One channel of one part of a file.
pub(crate) struct ExrPlane {
    /// Full name.
    pub(crate) name: String,
    /// Width, height.
    pub(crate) size_px: [u32; 2],
    /// Position of the first pixel of the data window in the pixels of the file.
    pub(crate) origin_px: [i32; 2],
    /// Samples, row by row.
    pub(crate) values: Vec<f32>,
}

impl ExrPlane {
    /// Splits the name: `a.b.Z` is channel `Z` of layer `a.b`.
    fn layer_and_channel(&self) -> (&str, &str) {
        self.name.rsplit_once('.').unwrap_or(("", &self.name))
    }
}

/// Layers of Blender whose channel Z is not a depth in metres.
const NO_DEPTH: [&str; 2] = ["Mist", "Denoising Depth"];

/// All planes of a file.
pub(crate) struct ExrPlanes {
    /// Planes in the order of the file.
    pub(crate) planes: Vec<ExrPlane>,
    /// Centre of the display window in the pixels of the file: the optical axis, also of a cropped picture.
    pub(crate) display_centre_px: [f64; 2],
    /// Width of a pixel divided by its height.
    pixel_aspect: f64,
    /// Whether the chromaticities differ from those of sRGB.
    other_primaries: bool,
    path: PathBuf,
}

/// Reads all parts of a file.
pub(crate) fn read_exr(path: &Path) -> Result<ExrPlanes, FrameFileError> {
    read(path).map_err(|error| {
        let fix = match &error {
            exr::error::Error::NotSupported(_) => "write it with ZIP compression, and not deep",
            exr::error::Error::Io(_) => "paths are relative to FRAME.toml",
            _ => "it is cut off, or no EXR",
        };
        failure(path, format!("cannot be read as EXR: {error}; {fix}"))
    })
}

/// As [`read_exr`], with the bare error.
pub(crate) fn read(path: &Path) -> exr::error::Result<ExrPlanes> {
    let image = read_all_flat_layers_from_file(path)?;
    let has_several_parts = image.layer_data.len() > 1;
    let display = image.attributes.display_window;
    let middle = |from: i32, length: usize| f64::from(from) + 0.5 * (length as f64 - 1.0);
    let display_centre_px =
        [middle(display.position.0, display.size.0), middle(display.position.1, display.size.1)];
    let mut planes = Vec::new();
    for part in &image.layer_data {
        let part_name = part
            .attributes
            .layer_name
            .as_ref()
            .filter(|_| has_several_parts)
            .map(ToString::to_string)
            .unwrap_or_default();
        for channel in &part.channel_data.list {
            let name = channel.name.to_string();
            let is_full_name = part_name.is_empty()
                || name.strip_prefix(&part_name).is_some_and(|rest| rest.starts_with('.'));
            planes.push(ExrPlane {
                name: if is_full_name { name } else { format!("{part_name}.{name}") },
                size_px: [part.size.0 as u32, part.size.1 as u32],
                origin_px: [part.attributes.layer_position.0, part.attributes.layer_position.1],
                values: channel.sample_data.values_as_f32().collect(),
            });
        }
    }
    let pixel_aspect = f64::from(image.attributes.pixel_aspect);
    let other_primaries = image.attributes.chromaticities.is_some_and(|stated| {
        let stated = [stated.red, stated.green, stated.blue, stated.white];
        stated.iter().zip(REC709).any(|(xy, [x, y])| (xy.x() - x).abs() > 2e-3 || (xy.y() - y).abs() > 2e-3)
    });
    Ok(ExrPlanes { planes, display_centre_px, pixel_aspect, other_primaries, path: path.into() })
}

/// Chromaticities of sRGB: red, green, blue, white.
const REC709: [[f32; 2]; 4] = [[0.64, 0.33], [0.3, 0.6], [0.15, 0.06], [0.3127, 0.329]];

impl ExrPlanes {
    /// Notes on attributes of the header that are not applied.
    pub(crate) fn notes(&self, [fx, fy]: [f64; 2]) -> Vec<String> {
        let mut notes = Vec::new();
        // In wide pixels the horizontal focal length is shorter.
        let implied_aspect = fy / fx;
        // An aspect of 1 is the default of writers, and no statement.
        if self.pixel_aspect != 1.0 && (implied_aspect / self.pixel_aspect - 1.0).abs() > 0.01 {
            let (path, aspect) = (self.path.display(), self.pixel_aspect);
            notes.push(format!(
                "{path}: its header says that a pixel is {aspect} times as wide as high (pixelAspectRatio), \
                    focal_px = [{fx}, {fy}] that it is {implied_aspect:.4} times: \
                 focal_px counts"
            ));
        }
        if self.other_primaries {
            let path = self.path.display();
            notes.push(format!(
                "{path}: its chromaticities are not those of sRGB: colours are left as they are stored; \
                    convert the picture if they matter"
            ));
        }
        notes
    }

    /// The two planes of a flow (right, down), if the file has no others.
    pub(crate) fn pair(&self) -> Result<[&ExrPlane; 2], String> {
        match &self.planes[..] {
            // Channels are sorted by name: X before Y and U before V, but G before R.
            [a, b] if a.name.ends_with('G') && b.name.ends_with('R') => Ok([complete(b)?, complete(a)?]),
            [a, b] => Ok([complete(a)?, complete(b)?]),
            _ => Err(format!(
                "has the channels {}: say with motion.flow_channels which two are the flow right and down",
                self.all_names()
            )),
        }
    }

    /// All names, for messages.
    fn all_names(&self) -> String {
        self.planes.iter().map(|plane| plane.name.as_str()).collect::<Vec<_>>().join(" ")
    }

    /// The plane of this full name, or the only one whose name ends with it.
    pub(crate) fn plane(&self, wanted: &str) -> Result<&ExrPlane, String> {
        if let Some(plane) = self.planes.iter().find(|plane| plane.name == wanted) {
            return complete(plane);
        }
        let has_ending =
            |plane: &&ExrPlane| plane.name.strip_suffix(wanted).is_some_and(|rest| rest.ends_with('.'));
        let matching: Vec<&ExrPlane> = self.planes.iter().filter(has_ending).collect();
        match matching[..] {
            [plane] => complete(plane),
            [] => Err(format!("has no channel {wanted}, but {}", self.all_names())),
            _ => Err(format!("has several channels {wanted}: {}; give the whole name", names(&matching))),
        }
    }

    /// Planes of red, green and blue: the given channels (one for grey), else the only ones of the file.
    pub(crate) fn colors(
        &self,
        channels: Option<&[String]>,
        layer: Option<&str>,
    ) -> Result<[&ExrPlane; 3], String> {
        let full_name = |name: &str| layer.map_or_else(|| name.to_owned(), |layer| format!("{layer}.{name}"));
        let colors = match channels {
            Some([gray]) => [self.plane(&full_name(gray))?; 3],
            Some([r, g, b]) => {
                [self.plane(&full_name(r))?, self.plane(&full_name(g))?, self.plane(&full_name(b))?]
            }
            Some(_) => {
                return Err(
                    "takes one channel (grey) or three (red, green, blue) in color_channels".to_owned()
                );
            }
            None => {
                let layer = match layer {
                    Some(layer) => layer.to_owned(),
                    None => self.color_layer()?,
                };
                let in_layer = |channel: &str| {
                    self.plane(&if layer.is_empty() {
                        channel.to_owned()
                    } else {
                        format!("{layer}.{channel}")
                    })
                };
                match in_layer("R") {
                    Ok(r) => [r, in_layer("G")?, in_layer("B")?],
                    Err(error) => in_layer("Y").map(|gray| [gray; 3]).map_err(|_| error)?,
                }
            }
        };
        let first = colors[0];
        if colors.iter().any(|plane| plane.size_px != first.size_px || plane.origin_px != first.origin_px) {
            return Err(format!("has colour channels of different sizes or positions: {}", names(&colors)));
        }
        Ok(colors)
    }

    /// The layer with R, G, B (or Y alone). Of several, the one without a name or Blender's `Combined`.
    fn color_layer(&self) -> Result<String, String> {
        let has = |layer: &str, channel: &str| {
            self.planes.iter().any(|plane| plane.layer_and_channel() == (layer, channel))
        };
        let mut layers: Vec<&str> = self.planes.iter().map(|plane| plane.layer_and_channel().0).collect();
        layers.sort_unstable();
        layers.dedup();
        let has_rgb = |layer: &&str| ["R", "G", "B"].iter().all(|channel| has(layer, channel));
        // Y together with X is a coordinate; together with RY it is the luminance of a luminance-chroma
        // picture.
        let has_gray = |layer: &&str| has(layer, "Y") && !has(layer, "X") && !has(layer, "RY");
        let mut candidates: Vec<&str> = layers.iter().copied().filter(has_rgb).collect();
        if candidates.is_empty() {
            candidates = layers.into_iter().filter(has_gray).collect();
        }
        if candidates.is_empty() {
            return Err(format!(
                "has no channels R G B or Y, but {}; name them with color_channels",
                self.all_names()
            ));
        }
        preferred(&candidates, |layer| layer.is_empty(), |layer| last_component(layer) == "Combined")
            .map(|layer| (*layer).to_owned())
            .ok_or_else(|| {
                format!(
                    "has several layers with colour: {}; choose one with color_layer",
                    candidates.join(", ")
                )
            })
    }

    /// The plane of depth: the given channel, else the only one that can be depth.
    pub(crate) fn depth(&self, channel: Option<&str>, layer: Option<&str>) -> Result<&ExrPlane, String> {
        match (channel, layer) {
            (Some(channel), Some(layer)) => return self.plane(&format!("{layer}.{channel}")),
            (Some(channel), None) => return self.plane(channel),
            (None, Some(layer)) => {
                return self.plane(&format!("{layer}.Z")).or_else(|_| self.plane(&format!("{layer}.V")));
            }
            (None, None) => {}
        }
        if let [plane] = &self.planes[..] {
            return complete(plane);
        }
        let layer_has = |plane: &ExrPlane, other: &str| {
            let layer = plane.layer_and_channel().0;
            self.planes.iter().any(|plane| plane.layer_and_channel() == (layer, other))
        };
        // Z together with X is a coordinate. Blender's depth pass is `Depth.V` in a file of its own. Its mist
        // pass has a Z that is no depth.
        let is_depth = |plane: &&ExrPlane, channel: &str, excluded: &str| {
            let (layer, name) = plane.layer_and_channel();
            name == channel && !layer_has(plane, excluded) && !NO_DEPTH.contains(&last_component(layer))
        };
        let mut candidates: Vec<&ExrPlane> =
            self.planes.iter().filter(|plane| is_depth(plane, "Z", "X")).collect();
        if candidates.is_empty() {
            candidates = self.planes.iter().filter(|plane| is_depth(plane, "V", "U")).collect();
        }
        if candidates.is_empty() {
            return Err(format!("has no channel Z, but {}; name it with depth_channel", self.all_names()));
        }
        let layer = |plane: &&ExrPlane| plane.layer_and_channel().0.to_owned();
        match preferred(
            &candidates,
            |plane| layer(plane).is_empty(),
            |plane| last_component(&layer(plane)) == "Depth",
        ) {
            Some(plane) => complete(plane),
            None => Err(format!(
                "has several channels that may be depth: {}; choose one with depth_channel",
                names(&candidates)
            )),
        }
    }
}

/// The only item, else the only one that fulfils the first rule, else the only one that fulfils the second.
fn preferred<T>(items: &[T], first: impl Fn(&T) -> bool, second: impl Fn(&T) -> bool) -> Option<&T> {
    let only = |rule: &dyn Fn(&T) -> bool| {
        let mut by_rule = items.iter().filter(|item| rule(item));
        by_rule.next().filter(|_| by_rule.next().is_none())
    };
    only(&|_| true).or_else(|| only(&first)).or_else(|| only(&second))
}

/// The last component of a dotted layer name.
fn last_component(layer: &str) -> &str {
    layer.rsplit('.').next().unwrap_or_default()
}

/// Names of planes, for messages.
fn names(planes: &[&ExrPlane]) -> String {
    planes.iter().map(|plane| plane.name.as_str()).collect::<Vec<_>>().join(" ")
}

/// Refuses subsampled and empty planes.
fn complete(plane: &ExrPlane) -> Result<&ExrPlane, String> {
    let [width, height] = plane.size_px;
    if width == 0 || height == 0 || plane.values.len() != width as usize * height as usize {
        return Err(format!("has a channel {} that is subsampled, or has no pixel", plane.name));
    }
    Ok(plane)
}

#[cfg(test)]
mod tests;
