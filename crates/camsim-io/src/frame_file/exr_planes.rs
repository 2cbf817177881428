//! Planes of EXR files by name, of every layer and part.
//!
//! A plane's whole name is `layer.channel`, as Blender's multilayer files have it (`ViewLayer.Depth.Z`); in a
//! file of several parts the part's name comes before, unless the channel has it already. A name is found
//! whole, or by its end where only one ends so.

use std::path::{Path, PathBuf};

use exr::prelude::read_all_flat_layers_from_file;

use super::{FrameFileError, images::failure};

/// One channel of one part.
pub(super) struct Plane {
    pub(super) name: String,
    pub(super) size_px: [u32; 2],
    /// Where the part's first pixel is in the file's own pixels.
    pub(super) origin_px: [i32; 2],
    pub(super) values: Vec<f32>,
}

impl Plane {
    /// `a.b.Z` is channel `Z` of layer `a.b`.
    fn layer_and_channel(&self) -> (&str, &str) {
        self.name.rsplit_once('.').unwrap_or(("", &self.name))
    }
}

/// Layers of Blender's whose Z is not in metres.
const NO_DEPTH: [&str; 2] = ["Mist", "Denoising Depth"];

/// All planes of a file.
pub(super) struct Planes {
    pub(super) planes: Vec<Plane>,
    /// Middle of the display window, in the file's own pixels: where the optical axis is, whatever part of
    /// the picture the file holds.
    pub(super) display_centre_px: [f64; 2],
    /// Width of a pixel over its height.
    pixel_aspect: f64,
    /// Whether red, green, blue and white are others than those of sRGB.
    other_primaries: bool,
    path: PathBuf,
}

/// Reads every part.
pub(super) fn read_exr(path: &Path) -> Result<Planes, FrameFileError> {
    let image = read_all_flat_layers_from_file(path).map_err(|error| {
        let fix = match &error {
            exr::error::Error::NotSupported(_) => "write it with ZIP compression, and not deep",
            exr::error::Error::Io(_) => "paths are relative to FRAME.toml",
            _ => "it is cut off, or no EXR",
        };
        failure(path, format!("cannot be read as EXR: {error}; {fix}"))
    })?;
    let several = image.layer_data.len() > 1;
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
            .filter(|_| several)
            .map(ToString::to_string)
            .unwrap_or_default();
        for channel in &part.channel_data.list {
            let name = channel.name.to_string();
            let whole = part_name.is_empty()
                || name.strip_prefix(&part_name).is_some_and(|rest| rest.starts_with('.'));
            planes.push(Plane {
                name: if whole { name } else { format!("{part_name}.{name}") },
                size_px: [part.size.0 as u32, part.size.1 as u32],
                origin_px: [part.attributes.layer_position.0, part.attributes.layer_position.1],
                values: channel.sample_data.values_as_f32().collect(),
            });
        }
    }
    let pixel_aspect = f64::from(image.attributes.pixel_aspect);
    let other_primaries = image.attributes.chromaticities.is_some_and(|found| {
        let of = [found.red, found.green, found.blue, found.white];
        of.iter().zip(REC709).any(|(at, [x, y])| (at.x() - x).abs() > 2e-3 || (at.y() - y).abs() > 2e-3)
    });
    Ok(Planes { planes, display_centre_px, pixel_aspect, other_primaries, path: path.into() })
}

/// Red, green, blue and white of sRGB.
const REC709: [[f32; 2]; 4] = [[0.64, 0.33], [0.3, 0.6], [0.15, 0.06], [0.3127, 0.329]];

impl Planes {
    /// What the header says that the keys do not go with, or that is left out.
    pub(super) fn notes(&self, [fx, fy]: [f64; 2]) -> Vec<String> {
        let mut notes = Vec::new();
        // Pixels that are wide have a focal length that is short in them.
        let implied = fy / fx;
        // 1 is what writers leave there without a thought.
        if self.pixel_aspect != 1.0 && (implied / self.pixel_aspect - 1.0).abs() > 0.01 {
            let (path, aspect) = (self.path.display(), self.pixel_aspect);
            notes.push(format!(
                "{path}: its header says that a pixel is {aspect} times as wide as high (pixelAspectRatio), \
                    focal_px = [{fx}, {fy}] that it is {implied:.4} times: \
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

    /// The only two planes of a file.
    pub(super) fn pair(&self) -> Result<[&Plane; 2], String> {
        match &self.planes[..] {
            // Channels are sorted by name: X before Y, U before V, but R after G.
            [a, b] if a.name.ends_with('G') && b.name.ends_with('R') => Ok([whole(b)?, whole(a)?]),
            [a, b] => Ok([whole(a)?, whole(b)?]),
            _ => Err(format!(
                "has the channels {}: say with motion.flow_channels which two are the flow right and down",
                self.list()
            )),
        }
    }

    /// All names, for messages.
    fn list(&self) -> String {
        self.planes.iter().map(|plane| plane.name.as_str()).collect::<Vec<_>>().join(" ")
    }

    /// The plane of that name, or the only one whose name ends with it.
    pub(super) fn named(&self, wanted: &str) -> Result<&Plane, String> {
        if let Some(plane) = self.planes.iter().find(|plane| plane.name == wanted) {
            return whole(plane);
        }
        let ends = |plane: &&Plane| plane.name.strip_suffix(wanted).is_some_and(|rest| rest.ends_with('.'));
        let found: Vec<&Plane> = self.planes.iter().filter(ends).collect();
        match found[..] {
            [plane] => whole(plane),
            [] => Err(format!("has no channel {wanted}, but {}", self.list())),
            _ => Err(format!("has several channels {wanted}: {}; give the whole name", names(&found))),
        }
    }

    /// Red, green and blue: those asked for (one is grey), or the only ones there are.
    pub(super) fn colors(
        &self,
        channels: Option<&[String]>,
        layer: Option<&str>,
    ) -> Result<[&Plane; 3], String> {
        let full = |name: &str| layer.map_or_else(|| name.to_owned(), |layer| format!("{layer}.{name}"));
        let colors = match channels {
            Some([gray]) => [self.named(&full(gray))?; 3],
            Some([r, g, b]) => [self.named(&full(r))?, self.named(&full(g))?, self.named(&full(b))?],
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
                let of_layer = |channel: &str| {
                    self.named(&if layer.is_empty() {
                        channel.to_owned()
                    } else {
                        format!("{layer}.{channel}")
                    })
                };
                match of_layer("R") {
                    Ok(r) => [r, of_layer("G")?, of_layer("B")?],
                    Err(error) => of_layer("Y").map(|gray| [gray; 3]).map_err(|_| error)?,
                }
            }
        };
        let first = colors[0];
        if colors.iter().any(|plane| plane.size_px != first.size_px || plane.origin_px != first.origin_px) {
            return Err(format!("has colour channels of different sizes or places: {}", names(&colors)));
        }
        Ok(colors)
    }

    /// The layer with R G B (or Y alone), where one can be told from the others: without a name, or Blender's
    /// `Combined`.
    fn color_layer(&self) -> Result<String, String> {
        let has = |layer: &str, channel: &str| {
            self.planes.iter().any(|plane| plane.layer_and_channel() == (layer, channel))
        };
        let mut layers: Vec<&str> = self.planes.iter().map(|plane| plane.layer_and_channel().0).collect();
        layers.sort_unstable();
        layers.dedup();
        let rgb = |layer: &&str| ["R", "G", "B"].iter().all(|channel| has(layer, channel));
        // A Y beside an X is a coordinate, beside RY a luminance without its chroma.
        let gray = |layer: &&str| has(layer, "Y") && !has(layer, "X") && !has(layer, "RY");
        let mut found: Vec<&str> = layers.iter().copied().filter(rgb).collect();
        if found.is_empty() {
            found = layers.into_iter().filter(gray).collect();
        }
        if found.is_empty() {
            return Err(format!(
                "has no channels R G B or Y, but {}; name them with color_channels",
                self.list()
            ));
        }
        only(&found, |layer| layer.is_empty(), |layer| last(layer) == "Combined")
            .map(|layer| (*layer).to_owned())
            .ok_or_else(|| {
                format!("has several layers with colour: {}; choose one with color_layer", found.join(", "))
            })
    }

    /// Depth: the channel asked for, or the only one that can be it.
    pub(super) fn depth(&self, channel: Option<&str>, layer: Option<&str>) -> Result<&Plane, String> {
        match (channel, layer) {
            (Some(channel), Some(layer)) => return self.named(&format!("{layer}.{channel}")),
            (Some(channel), None) => return self.named(channel),
            (None, Some(layer)) => {
                return self.named(&format!("{layer}.Z")).or_else(|_| self.named(&format!("{layer}.V")));
            }
            (None, None) => {}
        }
        if let [plane] = &self.planes[..] {
            return whole(plane);
        }
        let beside = |plane: &Plane, other: &str| {
            let layer = plane.layer_and_channel().0;
            self.planes.iter().any(|plane| plane.layer_and_channel() == (layer, other))
        };
        // A Z beside an X is a coordinate. Blender's depth pass is called `Depth.V` when it has a file of its
        // own; its mist is a Z too, and no depth.
        let is = |plane: &&Plane, channel: &str, not_beside: &str| {
            let (layer, name) = plane.layer_and_channel();
            name == channel && !beside(plane, not_beside) && !NO_DEPTH.contains(&last(layer))
        };
        let mut found: Vec<&Plane> = self.planes.iter().filter(|plane| is(plane, "Z", "X")).collect();
        if found.is_empty() {
            found = self.planes.iter().filter(|plane| is(plane, "V", "U")).collect();
        }
        if found.is_empty() {
            return Err(format!("has no channel Z, but {}; name it with depth_channel", self.list()));
        }
        let layer = |plane: &&Plane| plane.layer_and_channel().0.to_owned();
        match only(&found, |plane| layer(plane).is_empty(), |plane| last(&layer(plane)) == "Depth") {
            Some(plane) => whole(plane),
            None => Err(format!(
                "has several channels that may be depth: {}; choose one with depth_channel",
                names(&found)
            )),
        }
    }
}

/// The only one there is, or the only one that is preferred by the first rule, or by the second.
fn only<T>(found: &[T], first: impl Fn(&T) -> bool, second: impl Fn(&T) -> bool) -> Option<&T> {
    let alone = |rule: &dyn Fn(&T) -> bool| {
        let mut by_rule = found.iter().filter(|item| rule(item));
        by_rule.next().filter(|_| by_rule.next().is_none())
    };
    alone(&|_| true).or_else(|| alone(&first)).or_else(|| alone(&second))
}

fn last(layer: &str) -> &str {
    layer.rsplit('.').next().unwrap_or_default()
}

fn names(planes: &[&Plane]) -> String {
    planes.iter().map(|plane| plane.name.as_str()).collect::<Vec<_>>().join(" ")
}

fn whole(plane: &Plane) -> Result<&Plane, String> {
    let [width, height] = plane.size_px;
    if width == 0 || height == 0 || plane.values.len() != width as usize * height as usize {
        return Err(format!("has a channel {} that is subsampled, or has no pixel", plane.name));
    }
    Ok(plane)
}

#[cfg(test)]
mod tests;
