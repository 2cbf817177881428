//! What a valid file may say and the glTF crate does not know, said so that it does.

use serde_json::{Value, json};

use super::{accessor::MOST_EMPTY, checks::list};

/// What was changed.
#[derive(Debug, Default)]
pub(super) struct Mended {
    /// A buffer of zeros that the file does not have: its number and length.
    pub zeros: Option<(usize, usize)>,
    /// What there is to say about it.
    pub notes: Vec<String>,
}

/// Changes the JSON.
///
/// # Errors
/// An accessor that would be zeros without end.
pub(super) fn mend(json: &mut Value) -> Result<Mended, String> {
    if let Some(root) = json.as_object_mut() {
        // They have been checked.
        root.remove("extensionsRequired");
    }
    use_webp(json);
    let mut mended = Mended::default();
    drop_channels(json, &mut mended.notes);
    fill_with_zeros(json, &mut mended)?;
    Ok(mended)
}

/// The picture of `EXT_texture_webp` in place of the one for readers without it.
fn use_webp(json: &mut Value) {
    for texture in each(json, "textures") {
        if let Some(source) = texture.pointer("/extensions/EXT_texture_webp/source").cloned() {
            texture["source"] = source;
        }
    }
}

/// Channels of animations that move no node: those of `KHR_animation_pointer`, which are named, and those
/// without a target, which glTF says to leave.
fn drop_channels(json: &mut Value, notes: &mut Vec<String>) {
    for (number, animation) in each(json, "animations").enumerate() {
        let Some(Value::Array(channels)) = animation.get_mut("channels") else { continue };
        let before = channels.len();
        let moves = |channel: &Value| {
            let target = channel.get("target");
            target.is_none_or(|target| {
                target.get("node").is_some_and(|node| !node.is_null())
                    && target.get("path") != Some(&json!("pointer"))
            })
        };
        channels.retain(moves);
        let left_out = before - channels.len();
        if left_out > 0 {
            notes.push(format!(
                "animations.{number}: {left_out} of its {before} channels move no node and are left out"
            ));
        }
    }
}

/// Accessors without data are of zeros.
fn fill_with_zeros(json: &mut Value, mended: &mut Mended) -> Result<(), String> {
    let (view, buffer) = (list(json, "bufferViews").len(), list(json, "buffers").len());
    let mut longest: Option<usize> = None;
    for (number, accessor) in each(json, "accessors").enumerate() {
        let has = |key: &str| accessor.get(key).is_some_and(|value| !value.is_null());
        if has("bufferView") || has("sparse") {
            continue;
        }
        let count = accessor.get("count").and_then(Value::as_u64).unwrap_or(0);
        if count > MOST_EMPTY as u64 {
            return Err(format!(
                "accessors.{number}: has {count} elements and no bufferView for them: there are no such data"
            ));
        }
        let width = match accessor.get("type").and_then(Value::as_str) {
            Some("SCALAR") => 1,
            Some("VEC2") => 2,
            Some("VEC3") => 3,
            Some("VEC4" | "MAT2") => 4,
            Some("MAT3") => 9,
            _ => 16,
        };
        longest = longest.max(Some((4 * width * count as usize).max(4)));
        let Some(accessor) = accessor.as_object_mut() else { continue };
        accessor.insert("bufferView".into(), json!(view));
        accessor.remove("byteOffset");
        mended.notes.push(format!("accessors.{number}: has no bufferView: its numbers are 0"));
    }
    let Some(longest) = longest else { return Ok(()) };
    push(json, "buffers", json!({ "byteLength": longest }));
    push(json, "bufferViews", json!({ "buffer": buffer, "byteLength": longest }));
    mended.zeros = Some((buffer, longest));
    Ok(())
}

fn each<'a>(json: &'a mut Value, key: &str) -> impl Iterator<Item = &'a mut Value> {
    json.get_mut(key).and_then(Value::as_array_mut).into_iter().flatten()
}

fn push(json: &mut Value, key: &str, value: Value) {
    match json.get_mut(key).and_then(Value::as_array_mut) {
        Some(list) => list.push(value),
        None => json[key] = json!([value]),
    }
}
