//! Checks of a file's JSON before its data are read. Messages name the JSON path and what to do.

use std::path::Path;

use gltf::json::validation::Error as ValidationError;
use serde_json::Value;

use super::{
    GltfError,
    treatments::{Treatment, extension_error, extension_row},
};

/// Number of locations that a message lists; the same error is often repeated in many.
const MAX_LISTED: usize = 3;

/// Refuses files that are not glTF 2.0.
pub(super) fn check_version(json: &Value) -> Result<(), String> {
    let text = |key: &str| json.pointer(&format!("/asset/{key}")).and_then(Value::as_str);
    match (text("version"), text("minVersion")) {
        (None, _) => Err("has no asset.version: it is not a glTF 2.0 file".into()),
        (Some(version), _) if !version.starts_with("2.") => Err(format!(
            "is glTF {version}, not 2.0: convert it with `npx gltf-pipeline -i IN -o OUT.gltf`, which writes 2.0"
        )),
        (_, Some(minimum)) if minimum != "2.0" => {
            Err(format!("needs glTF {minimum} (asset.minVersion), but 2.0 is supported: convert it"))
        }
        _ => Ok(()),
    }
}

/// Refuses unsupported extensions that the file requires, or without which a texture, primitive or buffer
/// view has no data.
pub(super) fn check_extensions(path: &Path, json: &Value, has_binary_chunk: bool) -> Result<(), GltfError> {
    let is_supported = |name: &str| {
        extension_row(name)
            .is_some_and(|(_, treatment, _)| matches!(treatment, Treatment::Applied | Treatment::Irrelevant))
    };
    let required =
        list(json, "extensionsRequired").iter().filter_map(Value::as_str).filter(|name| !is_supported(name));
    let textures = list(json, "textures").iter().filter(|texture| texture.get("source").is_none());
    let textures = textures.filter_map(|texture| texture.get("extensions")?.as_object());
    let texture_only = textures
        .filter(|extensions| !extensions.contains_key("EXT_texture_webp"))
        .filter_map(|extensions| extensions.keys().next().map(String::as_str));
    let draco = list(json, "meshes")
        .iter()
        .flat_map(|mesh| list(mesh, "primitives"))
        .any(|primitive| has_draco_data_only(json, primitive));
    let draco = draco.then_some("KHR_draco_mesh_compression");
    let meshopt =
        list(json, "bufferViews").iter().filter_map(|view| meshopt_data_only(json, view, has_binary_chunk));
    // Extensions that the file declares as required are reported first.
    match required.chain(texture_only).chain(draco).chain(meshopt).next() {
        Some(name) => Err(extension_error(path, name)),
        None => Ok(()),
    }
}

/// Whether some of a primitive's attributes or indices exist only in Draco-compressed form.
fn has_draco_data_only(json: &Value, primitive: &Value) -> bool {
    let has_data =
        |accessor: &Value| accessor.get("bufferView").is_some() || accessor.get("sparse").is_some();
    let attributes = primitive.get("attributes").and_then(Value::as_object);
    let used = attributes
        .into_iter()
        .flat_map(|attributes| attributes.values())
        .chain(primitive.get("indices"))
        .filter_map(Value::as_u64);
    primitive.pointer("/extensions/KHR_draco_mesh_compression").is_some()
        && used
            .filter_map(|index| list(json, "accessors").get(index as usize))
            .any(|accessor| !has_data(accessor))
}

/// The meshopt extension of a buffer view whose data exist only in compressed form: its buffer is a fallback
/// buffer without data.
fn meshopt_data_only<'a>(json: &Value, view: &'a Value, has_binary_chunk: bool) -> Option<&'a str> {
    let name =
        view.get("extensions")?.as_object()?.keys().find(|name| name.ends_with("_meshopt_compression"))?;
    let index = view.get("buffer").and_then(Value::as_u64)? as usize;
    let buffer = list(json, "buffers").get(index)?;
    let is_fallback =
        buffer.pointer(&format!("/extensions/{name}/fallback")).and_then(Value::as_bool) == Some(true);
    let is_binary_chunk = index == 0 && has_binary_chunk && !is_fallback;
    (buffer.get("uri").is_none_or(Value::is_null) && !is_binary_chunk).then_some(name)
}

/// Checks accessor and node indices that the glTF crate uses without checking.
pub(super) fn check_indices(json: &Value) -> Result<(), String> {
    let count = list(json, "accessors").len() as u64;
    for (i, mesh) in list(json, "meshes").iter().enumerate() {
        for (k, primitive) in list(mesh, "primitives").iter().enumerate() {
            if let Some(index) = primitive
                .pointer("/attributes/POSITION")
                .and_then(Value::as_u64)
                .filter(|&index| index >= count)
            {
                return Err(format!(
                    "meshes.{i}.primitives.{k}: POSITION refers to accessor {index}, but there are {count}"
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

/// The array under a key; empty if there is none.
pub(super) fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value.get(key).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

/// The glTF crate's validation errors as a message.
pub(super) fn message(error: gltf::Error) -> String {
    let gltf::Error::Validation(errors) = error else { return format!("is not valid: {error}") };
    let text = |(path, error): &(gltf::json::Path, ValidationError)| {
        let what = match error {
            ValidationError::IndexOutOfBounds => "refers to an element that does not exist",
            ValidationError::Invalid => "has an invalid value",
            ValidationError::Missing => "is missing",
            ValidationError::Oversize => "is too large",
            ValidationError::Unsupported => "is not supported",
        };
        format!("{path} {what}")
    };
    let listed: Vec<String> = errors.iter().take(MAX_LISTED).map(text).collect();
    let more = match errors.len().saturating_sub(MAX_LISTED) {
        0 => String::new(),
        more => format!(", and {more} more"),
    };
    format!("is not valid: {}{more}; export the file again", listed.join("; "))
}
