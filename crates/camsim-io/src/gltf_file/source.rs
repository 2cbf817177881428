//! A file's JSON, its buffers, and the pictures' bytes: embedded, in data URIs, or beside it.

use std::path::{Path, PathBuf};

use glam::{DAffine3, DMat3, DQuat, DVec3};
use serde_json::Value;

use super::{GltfError, accessor, checks, mend, treatments};

/// A file with everything that it needs.
#[derive(Debug)]
pub(super) struct Source {
    path: PathBuf,
    pub document: gltf::Document,
    buffers: Vec<Vec<u8>>,
    json: Value,
    /// What of the file is left out, or not as it seems.
    pub notes: Vec<String>,
}

impl Source {
    pub fn read(path: &Path) -> Result<Self, GltfError> {
        let bytes = read_file(path)?;
        let broken = |message: String| GltfError::Broken { path: path.into(), message };
        if bytes.is_empty() {
            return Err(broken("is empty".into()));
        }
        let is_glb = bytes.starts_with(b"glTF");
        let (text, blob) = if is_glb { split_glb(&bytes).map_err(broken)? } else { (&bytes[..], None) };
        let mut json: Value = serde_json::from_slice(without_mark(text))
            .map_err(|error| broken(format!("is no glTF: {error}")))?;
        checks::check_extensions(path, &json, blob.is_some())?;
        checks::check_version(&json).map_err(broken)?;
        checks::check_numbers(&json).map_err(broken)?;
        let mut notes = treatments::notes(&json);
        let mended = mend::mend(&mut json).map_err(broken)?;
        notes.extend(mended.notes);
        let root = serde_json::from_value(json.clone())
            .map_err(|error| broken(format!("is no glTF 2.0: {error}")))?;
        let document = gltf::Document::from_json(root).map_err(|error| broken(checks::in_words(error)))?;
        let mut buffers = Vec::new();
        for buffer in document.buffers() {
            let index = buffer.index();
            let mut bytes = match buffer.source() {
                _ if mended.zeros == Some((index, buffer.length())) => vec![0; buffer.length()],
                gltf::buffer::Source::Bin if index == 0 && is_glb => blob.unwrap_or_default().to_vec(),
                gltf::buffer::Source::Bin => {
                    let fix = "only the first buffer of a .glb file may have none: give it one, or write the file again";
                    return Err(broken(format!(
                        "buffers.{index}: has no uri, so that its bytes are nowhere; {fix}"
                    )));
                }
                gltf::buffer::Source::Uri(uri) => fetch(path, uri, &format!("buffers.{index}"))?,
            };
            if bytes.len() < buffer.length() {
                let (has, wants) = (bytes.len(), buffer.length());
                return Err(broken(format!(
                    "buffers.{index}: has {has} bytes where {wants} should be: the file is cut off"
                )));
            }
            bytes.truncate(buffer.length());
            buffers.push(bytes);
        }
        Ok(Self { path: path.into(), document, buffers, json, notes })
    }

    pub fn broken(&self, message: impl Into<String>) -> GltfError {
        GltfError::Broken { path: self.path.clone(), message: message.into() }
    }

    /// Bytes of a view from `offset` on.
    pub fn view(&self, view: &gltf::buffer::View<'_>, offset: usize) -> Result<&[u8], GltfError> {
        let of = self.buffers.get(view.buffer().index());
        let within = view
            .offset()
            .checked_add(view.length())
            .and_then(|end| of?.get(view.offset()..end))
            .and_then(|view| view.get(offset..));
        within.ok_or_else(|| self.broken(format!("bufferViews.{}: reaches beyond its buffer", view.index())))
    }

    /// Bytes of a picture's file.
    pub fn image(&self, image: &gltf::Image<'_>) -> Result<Vec<u8>, GltfError> {
        // The glTF crate takes for granted that a picture in a view says what it is.
        let of = |key: &str| {
            self.json
                .pointer(&format!("/images/{}/{key}", image.index()))
                .is_some_and(|value| !value.is_null())
        };
        let complete = of("uri") || (of("bufferView") && of("mimeType"));
        if !complete {
            return Err(self.broken(format!(
                "images.{}: has neither a uri nor a bufferView with a mimeType",
                image.index()
            )));
        }
        match image.source() {
            gltf::image::Source::View { view, .. } => Ok(self.view(&view, 0)?.to_vec()),
            gltf::image::Source::Uri { uri, .. } => {
                fetch(&self.path, uri, &format!("images.{}", image.index()))
            }
        }
    }

    /// Whether `KHR_node_visibility` lets a node, and what is below it, be seen.
    pub fn is_visible(&self, node: usize) -> bool {
        let pointer = format!("/nodes/{node}/extensions/KHR_node_visibility/visible");
        self.json.pointer(&pointer).and_then(Value::as_bool).unwrap_or(true)
    }

    /// The first nodes that it hides, as messages call them.
    pub fn hidden_nodes(&self) -> Vec<String> {
        let hidden = self.document.nodes().map(|node| node.index()).filter(|&node| !self.is_visible(node));
        hidden.take(4).map(|node| format!("nodes.{node}")).collect()
    }

    /// `KHR_materials_emissive_strength`: what emitted light is multiplied by.
    pub fn emissive_strength(&self, material: Option<usize>) -> f32 {
        let at = |material| {
            format!("/materials/{material}/extensions/KHR_materials_emissive_strength/emissiveStrength")
        };
        material.and_then(|material| self.json.pointer(&at(material))?.as_f64()).unwrap_or(1.0) as f32
    }

    /// A material as messages call it: by number, and by name where it has one.
    pub fn material_name(&self, material: Option<usize>) -> String {
        let Some(index) = material else { return "the material of what has none".to_owned() };
        match self.json.pointer(&format!("/materials/{index}/name")).and_then(Value::as_str) {
            Some(name) => format!("materials.{index} ({name})"),
            None => format!("materials.{index}"),
        }
    }

    /// Where `EXT_mesh_gpu_instancing` puts a node's mesh.
    pub fn instances(&self, node: usize) -> Result<Option<Vec<DAffine3>>, GltfError> {
        let pointer = format!("/nodes/{node}/extensions/EXT_mesh_gpu_instancing/attributes");
        let Some(attributes) = self.json.pointer(&pointer) else { return Ok(None) };
        let of = |name: &str| -> Result<Option<Vec<[f64; 4]>>, GltfError> {
            let Some(index) = attributes.get(name).and_then(Value::as_u64) else { return Ok(None) };
            let accessor = self.document.accessors().nth(index as usize);
            let accessor = accessor.ok_or_else(|| {
                self.broken(format!(
                    "nodes.{node}: {name} of its instances names accessor {index}, which is not there"
                ))
            })?;
            accessor::rows(self, &accessor).map(Some)
        };
        let (shifts, turns, scales) = (of("TRANSLATION")?, of("ROTATION")?, of("SCALE")?);
        let mut counts = [&shifts, &turns, &scales].into_iter().flatten().map(Vec::len);
        let count = counts.next().unwrap_or(0);
        if let Some(other) = counts.find(|&other| other != count) {
            return Err(self.broken(format!(
                "nodes.{node}: its instances have attributes of {count} and of {other} elements: TRANSLATION, ROTATION and SCALE need one of each"
            )));
        }
        let instance = |i: usize| {
            let [x, y, z, _] = shifts.as_ref().map_or([0.0; 4], |rows| rows[i]);
            let turn = turns.as_ref().map_or(DQuat::IDENTITY, |rows| DQuat::from_array(rows[i]).normalize());
            let [a, b, c, _] = scales.as_ref().map_or([1.0; 4], |rows| rows[i]);
            DAffine3 {
                matrix3: DMat3::from_quat(turn) * DMat3::from_diagonal(DVec3::new(a, b, c)),
                translation: DVec3::new(x, y, z),
            }
        };
        Ok(Some((0..count).map(instance).collect()))
    }
}

/// JSON and, if there is one, the binary part of a .glb file.
fn split_glb(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let cut = || "is cut off within its header".to_owned();
    let version = word(4).ok_or_else(cut)?;
    if version != 2 {
        return Err(format!("is a .glb file of version {version}, not 2: convert it"));
    }
    let end = (word(8).ok_or_else(cut)? as usize).min(bytes.len());
    let chunk = |at: usize| -> Option<(&[u8], u32)> {
        let length = word(at)? as usize;
        Some((bytes.get(at + 8..(at + 8).checked_add(length)?)?, word(at + 4)?))
    };
    match chunk(12) {
        Some((json, 0x4E4F_534A)) => {
            let next = 20 + json.len().next_multiple_of(4);
            let blob = if next + 8 <= end { chunk(next) } else { None };
            Ok((json, blob.filter(|(_, kind)| *kind == 0x004E_4942).map(|(bytes, _)| bytes)))
        }
        Some(_) => Err("does not begin with JSON".into()),
        None => Err("is cut off within its JSON".into()),
    }
}

fn read_file(path: &Path) -> Result<Vec<u8>, GltfError> {
    std::fs::read(path).map_err(|source| GltfError::Read { path: path.into(), source })
}

/// What a URI of the file stands for: a data URI, or a file beside it.
fn fetch(path: &Path, uri: &str, key: &str) -> Result<Vec<u8>, GltfError> {
    let broken =
        |message: &str| GltfError::Broken { path: path.into(), message: format!("{key}: {message}") };
    if let Some(data) = uri.strip_prefix("data:") {
        let (head, body) = data.split_once(',').ok_or_else(|| broken("its data URI has no data"))?;
        if !head.ends_with(";base64") {
            return Err(broken("its data URI is not base64"));
        }
        return base64(body.as_bytes()).ok_or_else(|| broken("its data URI is no base64"));
    }
    if uri.contains("://") {
        return Err(broken("lies on another machine: put it beside the file"));
    }
    let beside = beside(path, uri).ok_or_else(|| broken("its uri is no name of a file"))?;
    std::fs::read(&beside).map_err(|error| {
        broken(&format!("its file {} cannot be read: {error}; put it there", beside.display()))
    })
}

/// The file that a URI names.
fn beside(path: &Path, uri: &str) -> Option<PathBuf> {
    let name = percent_decoded(uri).filter(|name| !name.is_empty())?;
    Some(path.with_file_name("").join(name))
}

/// Files beside a model that it names, as far as it can be read.
pub fn files_beside(path: &Path) -> Vec<PathBuf> {
    let Ok(bytes) = read_file(path) else { return Vec::new() };
    let text = if bytes.starts_with(b"glTF") {
        split_glb(&bytes).map_or(&[][..], |(text, _)| text)
    } else {
        &bytes[..]
    };
    let Ok(json) = serde_json::from_slice::<Value>(without_mark(text)) else { return Vec::new() };
    let lists = ["buffers", "images"].into_iter().filter_map(|key| json.get(key)?.as_array());
    let uris = lists.flatten().filter_map(|of| of.get("uri")?.as_str());
    uris.filter(|uri| !uri.starts_with("data:") && !uri.contains("://"))
        .filter_map(|uri| beside(path, uri))
        .collect()
}

/// A byte order mark is not allowed, and editors write it nevertheless.
fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text)
}

fn base64(text: &[u8]) -> Option<Vec<u8>> {
    let value = |byte: u8| match byte {
        b'A'..=b'Z' => Some(byte - b'A'),
        b'a'..=b'z' => Some(byte - b'a' + 26),
        b'0'..=b'9' => Some(byte - b'0' + 52),
        b'+' | b'-' => Some(62),
        b'/' | b'_' => Some(63),
        _ => None,
    };
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut held) = (0_u32, 0);
    for &byte in text.iter().filter(|&&byte| byte != b'=' && !byte.is_ascii_whitespace()) {
        bits = bits << 6 | u32::from(value(byte)?);
        held += 6;
        if held >= 8 {
            held -= 8;
            out.push((bits >> held) as u8);
        }
    }
    Some(out)
}

fn percent_decoded(text: &str) -> Option<String> {
    let (mut out, mut rest) = (Vec::new(), text.as_bytes());
    while let Some((&byte, after)) = rest.split_first() {
        rest = after;
        let pair =
            after.get(..2).and_then(|pair| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok());
        match (byte, pair) {
            (b'%', Some(byte)) => {
                out.push(byte);
                rest = &after[2..];
            }
            _ => out.push(byte),
        }
    }
    String::from_utf8(out).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_decoded() {
        assert_eq!(base64(b"aGVsbG8="), Some(b"hello".to_vec()));
        assert_eq!(base64(b"aGVsbG8h"), Some(b"hello!".to_vec()));
        assert_eq!((base64(b""), base64(b"a!")), (Some(Vec::new()), None));
        assert_eq!(percent_decoded("Box%20With%20Spaces.bin").as_deref(), Some("Box With Spaces.bin"));
        assert_eq!(percent_decoded("100%").as_deref(), Some("100%"));
        assert_eq!(percent_decoded("%ff"), None);
    }
}
