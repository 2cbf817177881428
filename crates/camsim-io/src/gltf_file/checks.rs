//! What is wrong with a file's JSON, before anything is read by it: said by place, in words, with what to do.

use std::path::Path;

use gltf::json::validation::Error as Wrong;
use serde_json::Value;

use super::{
    GltfError,
    treatments::{How, refuse, treatment},
};

/// Places that are told of; what is wrong in one is often wrong in all.
const TOLD: usize = 3;

/// Refuses what is no glTF 2.0.
pub(super) fn check_version(json: &Value) -> Result<(), String> {
    let of = |key: &str| json.pointer(&format!("/asset/{key}")).and_then(Value::as_str);
    match (of("version"), of("minVersion")) {
        (None, _) => Err("has no asset.version: it is no glTF 2.0, or not the file that was meant".into()),
        (Some(version), _) if !version.starts_with("2.") => {
            Err(format!("is glTF of version `{version}`, not 2.0: convert it"))
        }
        (_, Some(least)) if least != "2.0" => {
            Err(format!("needs glTF {least} (asset.minVersion), and 2.0 is what is read: convert it"))
        }
        _ => Ok(()),
    }
}

/// Refuses extensions that a file requires, or that its textures, primitives or buffer views have nothing
/// but.
pub(super) fn check_extensions(path: &Path, json: &Value, has_blob: bool) -> Result<(), GltfError> {
    let known =
        |name: &str| treatment(name).is_some_and(|(_, how, _)| matches!(how, How::Applied | How::NoMatter));
    let required =
        list(json, "extensionsRequired").iter().filter_map(Value::as_str).filter(|name| !known(name));
    let textures = list(json, "textures").iter().filter(|texture| texture.get("source").is_none());
    let textures = textures.filter_map(|texture| texture.get("extensions")?.as_object());
    let alone = textures
        .filter(|of| !of.contains_key("EXT_texture_webp"))
        .filter_map(|of| of.keys().next().map(String::as_str));
    let draco = list(json, "meshes")
        .iter()
        .flat_map(|mesh| list(mesh, "primitives"))
        .any(|primitive| is_draco_alone(json, primitive));
    let draco = draco.then_some("KHR_draco_mesh_compression");
    let meshopt = list(json, "bufferViews").iter().filter_map(|view| meshopt_alone(json, view, has_blob));
    // The file itself is named first for what it says of itself.
    match required.chain(alone).chain(draco).chain(meshopt).next() {
        Some(name) => Err(refuse(path, name)),
        None => Ok(()),
    }
}

/// Whether some of a primitive's corners or indices are in no buffer but that of the extension.
fn is_draco_alone(json: &Value, primitive: &Value) -> bool {
    let has_data =
        |accessor: &Value| accessor.get("bufferView").is_some() || accessor.get("sparse").is_some();
    let attributes = primitive.get("attributes").and_then(Value::as_object);
    let used = attributes
        .into_iter()
        .flat_map(|of| of.values())
        .chain(primitive.get("indices"))
        .filter_map(Value::as_u64);
    primitive.pointer("/extensions/KHR_draco_mesh_compression").is_some()
        && used
            .filter_map(|index| list(json, "accessors").get(index as usize))
            .any(|accessor| !has_data(accessor))
}

/// The extension of a buffer view whose bytes are compressed and nowhere else: its own buffer is a stand-in
/// without any.
fn meshopt_alone<'a>(json: &Value, view: &'a Value, has_blob: bool) -> Option<&'a str> {
    let name =
        view.get("extensions")?.as_object()?.keys().find(|name| name.ends_with("_meshopt_compression"))?;
    let index = view.get("buffer").and_then(Value::as_u64)? as usize;
    let buffer = list(json, "buffers").get(index)?;
    let is_fallback =
        buffer.pointer(&format!("/extensions/{name}/fallback")).and_then(Value::as_bool) == Some(true);
    let is_blob = index == 0 && has_blob && !is_fallback;
    (buffer.get("uri").is_none_or(Value::is_null) && !is_blob).then_some(name)
}

/// What the glTF crate takes for granted: accessors that it looks at before it knows that they are there, and
/// nodes that are animated.
pub(super) fn check_numbers(json: &Value) -> Result<(), String> {
    let count = list(json, "accessors").len() as u64;
    for (i, mesh) in list(json, "meshes").iter().enumerate() {
        for (k, primitive) in list(mesh, "primitives").iter().enumerate() {
            if let Some(index) = primitive
                .pointer("/attributes/POSITION")
                .and_then(Value::as_u64)
                .filter(|&index| index >= count)
            {
                return Err(format!(
                    "meshes.{i}.primitives.{k}: POSITION names accessor {index}, but there are {count}"
                ));
            }
        }
    }
    let nodes = list(json, "nodes").len() as u64;
    for (i, animation) in list(json, "animations").iter().enumerate() {
        for (k, channel) in list(animation, "channels").iter().enumerate() {
            if let Some(node) =
                channel.pointer("/target/node").and_then(Value::as_u64).filter(|&node| node >= nodes)
            {
                return Err(format!("animations.{i}.channels.{k}: moves node {node}, but there are {nodes}"));
            }
        }
    }
    Ok(())
}

pub(super) fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value.get(key).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

/// What the glTF crate found.
pub(super) fn in_words(error: gltf::Error) -> String {
    let gltf::Error::Validation(places) = error else { return format!("is not valid: {error}") };
    let place = |(place, wrong): &(gltf::json::Path, Wrong)| {
        let what = match wrong {
            Wrong::IndexOutOfBounds => "names what is not there",
            Wrong::Invalid => "has a value that there is not",
            Wrong::Missing => "is missing",
            Wrong::Oversize => "is larger than can be held",
            Wrong::Unsupported => "is not supported",
        };
        format!("{place} {what}")
    };
    let told: Vec<String> = places.iter().take(TOLD).map(place).collect();
    let more = match places.len().saturating_sub(TOLD) {
        0 => String::new(),
        more => format!(", and {more} more"),
    };
    format!("is not valid: {}{more}; write the file again", told.join("; "))
}
