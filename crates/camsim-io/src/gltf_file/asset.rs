//! A glTF asset: the JSON, its buffers and its images, embedded, in data URIs, or in files beside it.

use std::path::{Path, PathBuf};

use glam::{DAffine3, DMat3, DQuat, DVec3};
use serde_json::Value;

use super::{GltfError, accessor, foreign, preprocess::preprocess, treatments, validation};
use crate::similar_file::suggestion;

/// A parsed file with its buffers.
#[derive(Debug)]
pub(super) struct Asset {
    path: PathBuf,
    pub document: gltf::Document,
    buffers: Vec<Vec<u8>>,
    json: Value,
    /// Notes for the user about parts of the file that are not shown as stored.
    pub notes: Vec<String>,
}

impl Asset {
    /// Reads a file. `is_lit` is whether it is shown in a scene with light.
    pub fn read(path: &Path, is_lit: bool) -> Result<Self, GltfError> {
        let bytes = read_file(path)?;
        let broken = |message: String| GltfError::Broken { path: path.into(), message };
        if bytes.is_empty() {
            return Err(broken("is empty".into()));
        }
        let is_glb = bytes.starts_with(b"glTF");
        let (text, binary_chunk) =
            if is_glb { split_glb(&bytes).map_err(broken)? } else { (&bytes[..], None) };
        let mut json: Value = serde_json::from_slice(without_byte_order_mark(text)).map_err(|error| {
            broken(foreign::message(path, &bytes).unwrap_or_else(|| format!("is no glTF: {error}")))
        })?;
        if let Some(message) = foreign::json_message(path, &json) {
            return Err(broken(message));
        }
        validation::check_extensions(path, &json, binary_chunk.is_some())?;
        validation::check_version(&json).map_err(broken)?;
        validation::check_indices(&json).map_err(broken)?;
        let mut notes = treatments::notes(&json, is_lit);
        let preprocessed = preprocess(&mut json).map_err(broken)?;
        notes.extend(preprocessed.notes);
        let root = serde_json::from_value(json.clone())
            .map_err(|error| broken(format!("is no glTF 2.0: {error}")))?;
        let document = gltf::Document::from_json(root).map_err(|error| broken(validation::message(error)))?;
        let mut buffers = Vec::new();
        for buffer in document.buffers() {
            let index = buffer.index();
            let mut bytes = match buffer.source() {
                _ if preprocessed.zero_buffer == Some((index, buffer.length())) => vec![0; buffer.length()],
                gltf::buffer::Source::Bin if index == 0 && is_glb => {
                    binary_chunk.unwrap_or_default().to_vec()
                }
                gltf::buffer::Source::Bin => {
                    return Err(broken(format!(
                        "buffers.{index}: has no uri, which only the first buffer of a .glb file may leave \
                         out: add it, or export the file again"
                    )));
                }
                gltf::buffer::Source::Uri(uri) => resolve_uri(path, uri, &format!("buffers.{index}"))?,
            };
            if bytes.len() < buffer.length() {
                let (actual, expected) = (bytes.len(), buffer.length());
                return Err(broken(format!(
                    "buffers.{index}: has {actual} bytes instead of {expected}: the file is truncated"
                )));
            }
            bytes.truncate(buffer.length());
            buffers.push(bytes);
        }
        Ok(Self { path: path.into(), document, buffers, json, notes })
    }

    /// An error of this file.
    pub fn error(&self, message: impl Into<String>) -> GltfError {
        GltfError::Broken { path: self.path.clone(), message: message.into() }
    }

    /// Bytes of a buffer view from `offset` on.
    pub fn view(&self, view: &gltf::buffer::View<'_>, offset: usize) -> Result<&[u8], GltfError> {
        let buffer = self.buffers.get(view.buffer().index());
        let bytes = view
            .offset()
            .checked_add(view.length())
            .and_then(|end| buffer?.get(view.offset()..end))
            .and_then(|view| view.get(offset..));
        bytes.ok_or_else(|| self.error(format!("bufferViews.{}: reaches beyond its buffer", view.index())))
    }

    /// Encoded bytes of an image (PNG, JPEG or WebP).
    pub fn image(&self, image: &gltf::Image<'_>) -> Result<Vec<u8>, GltfError> {
        // The glTF crate panics on an image in a buffer view without a mimeType.
        let has = |key: &str| {
            self.json
                .pointer(&format!("/images/{}/{key}", image.index()))
                .is_some_and(|value| !value.is_null())
        };
        let is_complete = has("uri") || (has("bufferView") && has("mimeType"));
        if !is_complete {
            return Err(self.error(format!(
                "images.{}: has neither a uri nor a bufferView with a mimeType",
                image.index()
            )));
        }
        match image.source() {
            gltf::image::Source::View { view, .. } => Ok(self.view(&view, 0)?.to_vec()),
            gltf::image::Source::Uri { uri, .. } => {
                resolve_uri(&self.path, uri, &format!("images.{}", image.index()))
            }
        }
    }

    /// Whether `KHR_node_visibility` shows a node and its descendants.
    pub fn is_visible(&self, node: usize) -> bool {
        let pointer = format!("/nodes/{node}/extensions/KHR_node_visibility/visible");
        self.json.pointer(&pointer).and_then(Value::as_bool).unwrap_or(true)
    }

    /// The first four nodes that `KHR_node_visibility` hides, as messages name them.
    pub fn hidden_nodes(&self) -> Vec<String> {
        let hidden = self.document.nodes().map(|node| node.index()).filter(|&node| !self.is_visible(node));
        hidden.take(4).map(|node| format!("nodes.{node}")).collect()
    }

    /// Factor of a material's emissive light: `KHR_materials_emissive_strength`, or 1.
    pub fn emissive_strength(&self, material: Option<usize>) -> f32 {
        let pointer = |material| {
            format!("/materials/{material}/extensions/KHR_materials_emissive_strength/emissiveStrength")
        };
        material.and_then(|material| self.json.pointer(&pointer(material))?.as_f64()).unwrap_or(1.0) as f32
    }

    /// A material as messages name it: by index, and by name where it has one.
    pub fn material_name(&self, material: Option<usize>) -> String {
        let Some(index) = material else { return "the default material".to_owned() };
        match self.json.pointer(&format!("/materials/{index}/name")).and_then(Value::as_str) {
            Some(name) => format!("materials.{index} ({name})"),
            None => format!("materials.{index}"),
        }
    }

    /// The name that the file gives to a node or material; `nodes.3` without one.
    pub fn name_of(&self, list: &str, index: usize) -> String {
        self.given_name(list, index).map_or_else(|| format!("{list}.{index}"), str::to_owned)
    }

    /// The name that the file gives to a node or material, if it gives one.
    pub fn given_name(&self, list: &str, index: usize) -> Option<&str> {
        let name = self.json.pointer(&format!("/{list}/{index}/name")).and_then(Value::as_str);
        name.filter(|name| !name.trim().is_empty())
    }

    /// Transforms of a node's instances by `EXT_mesh_gpu_instancing`; `None` without the extension.
    pub fn instances(&self, node: usize) -> Result<Option<Vec<DAffine3>>, GltfError> {
        let pointer = format!("/nodes/{node}/extensions/EXT_mesh_gpu_instancing/attributes");
        let Some(attributes) = self.json.pointer(&pointer) else { return Ok(None) };
        let attribute = |name: &str| -> Result<Option<Vec<[f64; 4]>>, GltfError> {
            let Some(index) = attributes.get(name).and_then(Value::as_u64) else { return Ok(None) };
            let accessor = self.document.accessors().nth(index as usize);
            let accessor = accessor.ok_or_else(|| {
                self.error(format!(
                    "nodes.{node}: {name} of its instances refers to accessor {index}, which does not exist"
                ))
            })?;
            accessor::vectors(self, &accessor).map(Some)
        };
        let (translations, rotations, scales) =
            (attribute("TRANSLATION")?, attribute("ROTATION")?, attribute("SCALE")?);
        let mut counts = [&translations, &rotations, &scales].into_iter().flatten().map(Vec::len);
        let count = counts.next().unwrap_or(0);
        if let Some(other) = counts.find(|&other| other != count) {
            return Err(self.error(format!(
                "nodes.{node}: its instances have attributes of {count} and of {other} elements: \
                 TRANSLATION, ROTATION and SCALE must have the same number of elements"
            )));
        }
        let instance = |i: usize| {
            let [x, y, z, _] = translations.as_ref().map_or([0.0; 4], |rows| rows[i]);
            let rotation =
                rotations.as_ref().map_or(DQuat::IDENTITY, |rows| DQuat::from_array(rows[i]).normalize());
            let [a, b, c, _] = scales.as_ref().map_or([1.0; 4], |rows| rows[i]);
            DAffine3 {
                matrix3: DMat3::from_quat(rotation) * DMat3::from_diagonal(DVec3::new(a, b, c)),
                translation: DVec3::new(x, y, z),
            }
        };
        Ok(Some((0..count).map(instance).collect()))
    }
}

/// The JSON chunk of a .glb file and, if there is one, its binary chunk.
fn split_glb(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let word =
        |offset: usize| bytes.get(offset..offset + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let truncated = || "is truncated within its header".to_owned();
    let version = word(4).ok_or_else(truncated)?;
    if version != 2 {
        return Err(format!("is a .glb file of version {version}, not 2: convert it"));
    }
    let end = (word(8).ok_or_else(truncated)? as usize).min(bytes.len());
    let chunk = |offset: usize| -> Option<(&[u8], u32)> {
        let length = word(offset)? as usize;
        Some((bytes.get(offset + 8..(offset + 8).checked_add(length)?)?, word(offset + 4)?))
    };
    match chunk(12) {
        Some((json, 0x4E4F_534A)) => {
            let next = 20 + json.len().next_multiple_of(4);
            let binary = if next + 8 <= end { chunk(next) } else { None };
            Ok((json, binary.filter(|(_, kind)| *kind == 0x004E_4942).map(|(bytes, _)| bytes)))
        }
        Some(_) => Err("does not begin with JSON".into()),
        None => Err("is truncated within its JSON".into()),
    }
}

fn read_file(path: &Path) -> Result<Vec<u8>, GltfError> {
    std::fs::read(path).map_err(|source| GltfError::Read { path: path.into(), source })
}

/// Bytes of a URI: a data URI, or a file relative to `path`.
fn resolve_uri(path: &Path, uri: &str, key: &str) -> Result<Vec<u8>, GltfError> {
    let broken =
        |message: &str| GltfError::Broken { path: path.into(), message: format!("{key}: {message}") };
    if let Some(data) = uri.strip_prefix("data:") {
        let (media_type, body) = data.split_once(',').ok_or_else(|| broken("its data URI has no data"))?;
        if !media_type.ends_with(";base64") {
            return Err(broken("its data URI is not base64"));
        }
        return decode_base64(body.as_bytes()).ok_or_else(|| broken("its data URI is not valid base64"));
    }
    if uri.contains("://") {
        return Err(broken("has a remote uri, which is not read: put the file beside the model"));
    }
    let file = file_of_uri(path, uri).ok_or_else(|| broken("its uri is not a file name"))?;
    std::fs::read(&file).map_err(|error| {
        broken(&format!(
            "its file {} cannot be read: {error}; put it there{}",
            file.display(),
            suggestion(&file)
        ))
    })
}

/// The file that a relative URI names.
fn file_of_uri(path: &Path, uri: &str) -> Option<PathBuf> {
    let name = percent_decode(uri).filter(|name| !name.is_empty())?;
    Some(path.with_file_name("").join(name))
}

/// Files that a model refers to; empty if it cannot be read.
pub fn referenced_files(path: &Path) -> Vec<PathBuf> {
    let Ok(bytes) = read_file(path) else { return Vec::new() };
    let text = if bytes.starts_with(b"glTF") {
        split_glb(&bytes).map_or(&[][..], |(text, _)| text)
    } else {
        &bytes[..]
    };
    let Ok(json) = serde_json::from_slice::<Value>(without_byte_order_mark(text)) else { return Vec::new() };
    let lists = ["buffers", "images"].into_iter().filter_map(|key| json.get(key)?.as_array());
    let uris = lists.flatten().filter_map(|item| item.get("uri")?.as_str());
    uris.filter(|uri| !uri.starts_with("data:") && !uri.contains("://"))
        .filter_map(|uri| file_of_uri(path, uri))
        .collect()
}

/// glTF forbids a byte-order mark, but some editors write one.
fn without_byte_order_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text)
}

fn decode_base64(text: &[u8]) -> Option<Vec<u8>> {
    let value = |byte: u8| match byte {
        b'A'..=b'Z' => Some(byte - b'A'),
        b'a'..=b'z' => Some(byte - b'a' + 26),
        b'0'..=b'9' => Some(byte - b'0' + 52),
        b'+' | b'-' => Some(62),
        b'/' | b'_' => Some(63),
        _ => None,
    };
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut bit_count) = (0_u32, 0);
    for &byte in text.iter().filter(|&&byte| byte != b'=' && !byte.is_ascii_whitespace()) {
        bits = bits << 6 | u32::from(value(byte)?);
        bit_count += 6;
        if bit_count >= 8 {
            bit_count -= 8;
            out.push((bits >> bit_count) as u8);
        }
    }
    Some(out)
}

fn percent_decode(text: &str) -> Option<String> {
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
    fn base64_and_percent_encoding_are_decoded() {
        assert_eq!(decode_base64(b"aGVsbG8="), Some(b"hello".to_vec()));
        assert_eq!(decode_base64(b"aGVsbG8h"), Some(b"hello!".to_vec()));
        assert_eq!((decode_base64(b""), decode_base64(b"a!")), (Some(Vec::new()), None));
        assert_eq!(percent_decode("Box%20With%20Spaces.bin").as_deref(), Some("Box With Spaces.bin"));
        assert_eq!(percent_decode("100%").as_deref(), Some("100%"));
        assert_eq!(percent_decode("%ff"), None);
    }
}
