//! Rewrites the parts of a valid file's JSON that the glTF crate does not support.

use serde_json::{Value, json};

use super::{accessor::MAX_ELEMENTS_WITHOUT_DATA, validation::list};

/// What [`preprocess`] added to the JSON.
#[derive(Debug, Default)]
pub(super) struct Preprocessed {
    /// Index and length in bytes of a buffer of zeros that has no data in the file.
    pub zero_buffer: Option<(usize, usize)>,
    /// Notes for the user about parts that were dropped or filled.
    pub notes: Vec<String>,
}

/// Changes the JSON in place.
///
/// # Errors
/// An accessor without data that claims too many elements.
pub(super) fn preprocess(json: &mut Value) -> Result<Preprocessed, String> {
    if let Some(root) = json.as_object_mut() {
        // `validation` has checked them; the crate would refuse those it does not know.
        root.remove("extensionsRequired");
    }
    use_webp(json);
    let mut result = Preprocessed::default();
    drop_channels_without_node(json, &mut result.notes);
    fill_accessors_without_data(json, &mut result)?;
    Ok(result)
}

/// Replaces each texture's fallback image by the one of `EXT_texture_webp`.
fn use_webp(json: &mut Value) {
    for texture in elements_mut(json, "textures") {
        if let Some(source) = texture.pointer("/extensions/EXT_texture_webp/source").cloned() {
            texture["source"] = source;
        }
    }
}

/// Drops animation channels that move no node: those of `KHR_animation_pointer`, and those without a target,
/// which glTF 2.0 says to ignore.
fn drop_channels_without_node(json: &mut Value, notes: &mut Vec<String>) {
    for (number, animation) in elements_mut(json, "animations").enumerate() {
        let Some(Value::Array(channels)) = animation.get_mut("channels") else { continue };
        let count_before = channels.len();
        let moves_node = |channel: &Value| {
            let target = channel.get("target");
            target.is_none_or(|target| {
                target.get("node").is_some_and(|node| !node.is_null())
                    && target.get("path") != Some(&json!("pointer"))
            })
        };
        channels.retain(moves_node);
        let dropped = count_before - channels.len();
        if dropped > 0 {
            notes.push(format!(
                "animations.{number}: {dropped} of its {count_before} channels move no node and are ignored"
            ));
        }
    }
}

/// Gives accessors without `bufferView` a buffer of zeros, as glTF 2.0 defines them.
fn fill_accessors_without_data(json: &mut Value, result: &mut Preprocessed) -> Result<(), String> {
    let (view, buffer) = (list(json, "bufferViews").len(), list(json, "buffers").len());
    let mut longest: Option<usize> = None;
    for (number, accessor) in elements_mut(json, "accessors").enumerate() {
        let has = |key: &str| accessor.get(key).is_some_and(|value| !value.is_null());
        if has("bufferView") || has("sparse") {
            continue;
        }
        let count = accessor.get("count").and_then(Value::as_u64).unwrap_or(0);
        if count > MAX_ELEMENTS_WITHOUT_DATA as u64 {
            return Err(format!(
                "accessors.{number}: has {count} elements and no bufferView: its data are missing"
            ));
        }
        let components = match accessor.get("type").and_then(Value::as_str) {
            Some("SCALAR") => 1,
            Some("VEC2") => 2,
            Some("VEC3") => 3,
            Some("VEC4" | "MAT2") => 4,
            Some("MAT3") => 9,
            _ => 16,
        };
        longest = longest.max(Some((4 * components * count as usize).max(4)));
        let Some(accessor) = accessor.as_object_mut() else { continue };
        accessor.insert("bufferView".into(), json!(view));
        accessor.remove("byteOffset");
        result.notes.push(format!("accessors.{number}: has no bufferView: its values are 0"));
    }
    let Some(longest) = longest else { return Ok(()) };
    push(json, "buffers", json!({ "byteLength": longest }));
    push(json, "bufferViews", json!({ "buffer": buffer, "byteLength": longest }));
    result.zero_buffer = Some((buffer, longest));
    Ok(())
}

fn elements_mut<'a>(json: &'a mut Value, key: &str) -> impl Iterator<Item = &'a mut Value> {
    json.get_mut(key).and_then(Value::as_array_mut).into_iter().flatten()
}

fn push(json: &mut Value, key: &str, value: Value) {
    match json.get_mut(key).and_then(Value::as_array_mut) {
        Some(list) => list.push(value),
        None => json[key] = json!([value]),
    }
}
