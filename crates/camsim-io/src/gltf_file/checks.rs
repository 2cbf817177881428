//! What is wrong with a file's JSON, before anything is read by it: said by place, in words, with what to do.

use std::path::Path;

use gltf::json::validation::Error as Wrong;
use serde_json::Value;

use super::GltfError;

/// Extensions that a file may require: what they add is done here, or by the glTF crate.
const DONE: &[&str] = &[
    "KHR_mesh_quantization",
    "EXT_mesh_gpu_instancing",
    "KHR_texture_transform",
    "KHR_materials_unlit",
    "KHR_materials_pbrSpecularGlossiness",
];
/// Extensions that only change light and shade, which are not shown.
const NO_MATTER: &[&str] = &["KHR_materials_", "KHR_lights_punctual", "KHR_animation_pointer"];
/// Places that are told of; what is wrong in one is often wrong in all.
const TOLD: usize = 3;

/// Refuses what is no glTF 2.0.
pub(super) fn check_version(json: &Value) -> Result<(), String> {
    let of = |key: &str| json.pointer(&format!("/asset/{key}")).and_then(Value::as_str);
    match (of("version"), of("minVersion")) {
        (None, _) => Err("has no asset.version: it is no glTF 2.0, or not the file that was meant".into()),
        (Some(version), _) if !version.starts_with("2.") => Err(format!("is glTF of version `{version}`, not 2.0: convert it")),
        (_, Some(least)) if least != "2.0" => Err(format!("needs glTF {least} (asset.minVersion), and 2.0 is what is read: convert it")),
        _ => Ok(()),
    }
}

/// Refuses extensions that a file requires, or that its textures or primitives have nothing but.
pub(super) fn check_extensions(path: &Path, json: &Value) -> Result<(), GltfError> {
    let required = list(json, "extensionsRequired").iter().filter_map(Value::as_str);
    let known = |name: &str| DONE.contains(&name) || NO_MATTER.iter().any(|known| name.starts_with(known));
    let alone = list(json, "textures").iter().filter(|texture| texture.get("source").is_none());
    let alone = alone.filter_map(|texture| texture.get("extensions")?.as_object()?.keys().next().map(String::as_str));
    let compressed = list(json, "meshes").iter().flat_map(|mesh| list(mesh, "primitives")).any(|primitive| is_compressed(json, primitive));
    let compressed = compressed.then_some("KHR_draco_mesh_compression");
    let Some(name) = required.filter(|name| !known(name)).chain(alone).chain(compressed).next() else { return Ok(()) };
    let fix = match name {
        "KHR_draco_mesh_compression" | "EXT_meshopt_compression" | "KHR_meshopt_compression" => "write the file again without compression",
        "KHR_texture_basisu" | "EXT_texture_webp" | "EXT_texture_avif" => "write its pictures as PNG or JPEG",
        _ => "write the file again without it",
    };
    Err(GltfError::Extension { path: path.into(), extension: name.into(), fix })
}

/// Whether a primitive's corners are in no buffer but that of the extension.
fn is_compressed(json: &Value, primitive: &Value) -> bool {
    let position = primitive.pointer("/attributes/POSITION").and_then(Value::as_u64);
    let has_data = |accessor: &Value| accessor.get("bufferView").is_some() || accessor.get("sparse").is_some();
    primitive.pointer("/extensions/KHR_draco_mesh_compression").is_some()
        && position.and_then(|index| list(json, "accessors").get(index as usize)).is_some_and(|accessor| !has_data(accessor))
}

/// What the glTF crate takes for granted: accessors that it looks at before it knows that they are there, and nodes that are animated.
pub(super) fn check_numbers(json: &Value) -> Result<(), String> {
    let count = list(json, "accessors").len() as u64;
    for (i, mesh) in list(json, "meshes").iter().enumerate() {
        for (k, primitive) in list(mesh, "primitives").iter().enumerate() {
            if let Some(index) = primitive.pointer("/attributes/POSITION").and_then(Value::as_u64).filter(|&index| index >= count) {
                return Err(format!("meshes.{i}.primitives.{k}: POSITION names accessor {index}, but there are {count}"));
            }
        }
    }
    let nodes = list(json, "nodes").len() as u64;
    for (i, animation) in list(json, "animations").iter().enumerate() {
        for (k, channel) in list(animation, "channels").iter().enumerate() {
            if let Some(node) = channel.pointer("/target/node").and_then(Value::as_u64).filter(|&node| node >= nodes) {
                return Err(format!("animations.{i}.channels.{k}: moves node {node}, but there are {nodes}"));
            }
        }
    }
    Ok(())
}

fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
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
