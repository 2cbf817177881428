//! Support of each glTF extension and property: applied, refused, reported in a note, or irrelevant.

use std::{collections::BTreeSet, path::Path};

use serde_json::Value;

use super::{GltfError, validation::list};

/// How the reader treats an extension or property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Treatment {
    /// Has its effect on the picture.
    Applied,
    /// The file is refused: there is nothing to show without it.
    Refused,
    /// Ignored with a note; a file that requires it is refused.
    Reported,
    /// Ignored: it changes nothing in the picture.
    Irrelevant,
}

/// Name of an extension or property, its treatment, and an explanation or remedy.
pub(super) type SupportRow = (&'static str, Treatment, &'static str);

use Treatment::*;

const UNCOMPRESSED: &str = "export the file without compression";
const AS_PNG: &str = "export its images as PNG or JPEG";

/// Extensions by name; a name that ends with `*` matches every extension with that prefix.
pub(super) const EXTENSIONS: &[SupportRow] = &[
    ("KHR_mesh_quantization", Applied, "positions, normals and texture coordinates of 8 and 16 bits"),
    ("KHR_texture_transform", Applied, "offset, rotation, scale and set of texture coordinates"),
    (
        "KHR_materials_unlit",
        Applied,
        "base colour alone, without the scene's light and without emissive light",
    ),
    (
        "KHR_materials_pbrSpecularGlossiness",
        Applied,
        "its diffuse colour is the base colour; its gloss is reported",
    ),
    (
        "KHR_materials_emissive_strength",
        Applied,
        "factor of emissiveFactor, up to 65504; with an emissiveTexture more than white is clamped, and reported",
    ),
    ("KHR_node_visibility", Applied, "invisible nodes and their descendants are not shown"),
    ("EXT_mesh_gpu_instancing", Applied, "TRANSLATION, ROTATION and SCALE"),
    ("EXT_texture_webp", Applied, "the WebP image instead of the fallback image"),
    ("KHR_draco_mesh_compression", Refused, UNCOMPRESSED),
    ("EXT_meshopt_compression", Refused, UNCOMPRESSED),
    ("KHR_meshopt_compression", Refused, UNCOMPRESSED),
    ("KHR_texture_basisu", Refused, AS_PNG),
    ("EXT_texture_avif", Refused, AS_PNG),
    ("MSFT_texture_dds", Refused, AS_PNG),
    ("KHR_materials_variants", Reported, "the materials of the mesh itself are shown"),
    ("KHR_materials_*", Reported, "gloss, glass, coats and similar: colour is albedo alone"),
    ("KHR_lights_punctual", Reported, "lights are the scenario's"),
    ("EXT_lights_*", Reported, "lights are the scenario's"),
    ("KHR_animation_pointer", Reported, "animations move nodes, skins and morph targets"),
    ("CESIUM_primitive_outline", Reported, "lines are not drawn"),
    ("CESIUM_RTC", Reported, "the centre is the model's origin: place it with at or geodetic"),
    ("EXT_structural_metadata", Irrelevant, "metadata of features"),
    ("EXT_feature_metadata", Irrelevant, "metadata of features"),
    ("EXT_mesh_features", Irrelevant, "metadata of features"),
    ("EXT_instance_features", Irrelevant, "metadata of features"),
    ("KHR_xmp*", Irrelevant, "metadata of the file"),
    ("KHR_audio*", Irrelevant, "sound"),
    ("KHR_physics_rigid_bodies", Irrelevant, "there is no simulation of physics"),
    ("MSFT_audio_emitter", Irrelevant, "sound"),
    ("MSFT_lod", Irrelevant, "the finest level is shown"),
];

/// Properties of glTF 2.0 for the documentation page.
#[cfg(test)]
pub(super) const PROPERTIES: &[SupportRow] = &[
    ("baseColorFactor, baseColorTexture", Applied, "albedo"),
    (
        "COLOR_0",
        Applied,
        "factor of albedo; ignored, and reported, where an emissive texture shares the base colour's texture \
         coordinates",
    ),
    (
        "emissiveFactor, emissiveTexture",
        Applied,
        "added, with any set of texture coordinates; where that is not possible it is reported with its \
         material",
    ),
    ("alphaMode, alphaCutoff", Applied, "masks and blending"),
    ("doubleSided", Applied, "back faces of one-sided surfaces are not shown"),
    ("TEXCOORD_n, texCoord", Applied, "any set"),
    ("wrapS, wrapT, magFilter", Applied, "repeat, mirror, clamp; nearest or linear"),
    ("minFilter", Irrelevant, "textures are averaged over the pixel"),
    ("bufferView omitted", Applied, "values are 0, except sparse ones; reported where all are 0"),
    ("sparse, normalized, byteStride", Applied, "as stored"),
    ("mode", Applied, "triangles, strips, fans; points and lines are reported"),
    ("NORMAL", Applied, "with the scene's light; else nothing is shaded"),
    ("skins, JOINTS_n, WEIGHTS_n", Applied, "at time_s"),
    ("weights, targets", Applied, "POSITION and NORMAL; other targets are reported"),
    ("animations", Applied, "at time_s; without it nodes keep their static transforms, and that is reported"),
    ("scene, scenes", Applied, "scene.gltf.scene, or the file's default scene"),
    ("metallicFactor", Reported, "with the scene's light; else irrelevant: colour is albedo"),
    ("metallicRoughnessTexture", Reported, "colour is albedo"),
    ("roughnessFactor", Irrelevant, "gloss alone: colour is albedo"),
    ("normalTexture", Reported, "the scene's light uses the surface's own normals"),
    ("occlusionTexture", Reported, "the sky is hidden from nothing"),
    ("COLOR_1, COLOR_2, ...", Reported, "glTF defines no meaning"),
    ("TANGENT", Irrelevant, "for normalTexture"),
    ("cameras", Irrelevant, "the camera is the scenario's"),
    ("minVersion, version", Refused, "other than 2.0"),
];

/// The row of an extension; `None` for one that is not listed.
pub(super) fn extension_row(name: &str) -> Option<&'static SupportRow> {
    let matches =
        |pattern: &str| pattern.strip_suffix('*').map_or(pattern == name, |prefix| name.starts_with(prefix));
    EXTENSIONS.iter().find(|(pattern, ..)| matches(pattern))
}

/// The error for a file that needs an unsupported extension.
pub(super) fn extension_error(path: &Path, name: &str) -> GltfError {
    let fix = match extension_row(name) {
        Some((_, Refused, fix)) => fix,
        Some((_, Reported, _)) => {
            "export the file without it, or remove it from extensionsRequired to show the rest"
        }
        _ => "export the file without it",
    };
    GltfError::Extension { path: path.into(), extension: name.into(), fix }
}

/// Collects the names of extensions that occur in the JSON, whatever extensionsUsed lists.
fn collect_extensions<'a>(value: &'a Value, names: &mut BTreeSet<&'a str>) {
    match value {
        Value::Object(map) => {
            for (key, value) in map {
                match (key.as_str(), value) {
                    // Application-specific data, not part of the model.
                    ("extras", _) => {}
                    ("extensions", Value::Object(extensions)) => {
                        names.extend(extensions.keys().map(String::as_str));
                        extensions.values().for_each(|value| collect_extensions(value, names));
                    }
                    _ => collect_extensions(value, names),
                }
            }
        }
        Value::Array(values) => values.iter().for_each(|value| collect_extensions(value, names)),
        _ => {}
    }
}

/// Notes about parts of the file that are ignored, each once.
pub(super) fn notes(json: &Value, is_lit: bool) -> Vec<String> {
    let mut names = BTreeSet::new();
    collect_extensions(json, &mut names);
    let (mut shading, mut notes) = (shading_properties(json, is_lit), Vec::new());
    for name in names {
        match extension_row(name) {
            Some(("KHR_materials_*", ..)) => drop(shading.insert(name)),
            Some((_, Reported, what)) => notes.push(format!("{name} is ignored: {what}")),
            Some(_) => {}
            None => notes.push(format!("the extension {name} is unknown and ignored")),
        }
    }
    if !shading.is_empty() {
        let names: Vec<&str> = shading.into_iter().collect();
        notes.push(format!("colour is albedo alone: {} ignored", joined(&names)));
    }
    for (number, mesh) in list(json, "meshes").iter().enumerate() {
        for primitive in list(mesh, "primitives") {
            let attributes = primitive.get("attributes").and_then(Value::as_object).into_iter().flatten();
            let further_colors =
                attributes.filter(|(name, _)| name.starts_with("COLOR_") && *name != "COLOR_0");
            notes.extend(further_colors.map(|(name, _)| {
                format!("meshes.{number}: {name} is ignored: glTF defines a meaning for COLOR_0 alone")
            }));
            let targets = list(primitive, "targets").iter().filter_map(Value::as_object).flatten();
            let unsupported =
                targets.filter(|(name, _)| !matches!(name.as_str(), "POSITION" | "NORMAL" | "TANGENT"));
            notes.extend(unsupported.map(|(name, _)| {
                format!(
                    "meshes.{number}: {name} of its morph targets is ignored: POSITION and NORMAL are applied"
                )
            }));
        }
    }
    notes
}

/// Shading properties of the materials that are not unlit; they are ignored. Without light a metal looks as it is
/// painted: how much of one it is changes nothing.
fn shading_properties(json: &Value, is_lit: bool) -> BTreeSet<&str> {
    let mut names = BTreeSet::new();
    for material in list(json, "materials") {
        if material.pointer("/extensions/KHR_materials_unlit").is_some() {
            continue;
        }
        let has = |pointer: &str| material.pointer(pointer).is_some_and(|value| !value.is_null());
        let has_specular_glossiness =
            |key: &str| has(&format!("/extensions/KHR_materials_pbrSpecularGlossiness/{key}"));
        let properties = [
            ("specularFactor", has_specular_glossiness("specularFactor")),
            ("specularGlossinessTexture", has_specular_glossiness("specularGlossinessTexture")),
            ("normalTexture", has("/normalTexture")),
            ("occlusionTexture", has("/occlusionTexture")),
            ("metallicRoughnessTexture", has("/pbrMetallicRoughness/metallicRoughnessTexture")),
            (
                "metallicFactor",
                is_lit
                    && material
                        .pointer("/pbrMetallicRoughness/metallicFactor")
                        .and_then(Value::as_f64)
                        .is_some_and(|f| f > 0.0),
            ),
        ];
        names.extend(properties.into_iter().filter(|(_, has)| *has).map(|(name, _)| name));
    }
    names
}

/// Joins names with their verb: `a is`, `a and b are`, `a, b and c are`.
fn joined(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [one] => format!("{one} is"),
        [first @ .., last] => format!("{} and {last} are", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Contents of `docs/reference/inputs/MODELS.md`.
    fn page() -> String {
        let text = |treatment: &Treatment| match treatment {
            Applied => "applied",
            Refused => "refused",
            Reported => "reported",
            Irrelevant => "irrelevant",
        };
        let table = |head: &str, rows: &[SupportRow]| {
            let rows = rows
                .iter()
                .map(|(name, treatment, what)| format!("| {name} | {} | {what} |\n", text(treatment)));
            format!("| {head} | treatment | |\n|---|---|---|\n{}", rows.collect::<String>())
        };
        format!(
            "# Support of glTF extensions and properties\n\nMade from \
             `crates/camsim-io/src/gltf_file/treatments.rs`; [MODELS.md](../../guide/MODELS.md) describes \
             how models are shown.\n\n*Applied*: it has its effect. *Refused*: the file is not read; the \
             error names it and a remedy. *Reported*: it is ignored with a warning. *Irrelevant*: it changes nothing \
             in the picture.\n\n## Extensions\n\nA file that requires an extension is refused unless it is applied \
             or irrelevant. An extension that is listed as refused is accepted where the file has a \
             fallback: uncompressed buffers, PNG or JPEG images. `*` matches any ending. Extensions that are \
             not listed are reported.\n\n{}\n## Properties\n\n{}",
            table("extension", EXTENSIONS),
            table("property", PROPERTIES)
        )
    }

    #[test]
    fn documentation_page_matches_the_tables() {
        crate::inputs_page::check("MODELS.md", &page());
    }

    #[test]
    fn exact_extension_name_precedes_its_prefix_pattern() {
        let treatment = |name: &str| extension_row(name).map(|(_, treatment, _)| *treatment);
        assert_eq!(treatment("KHR_materials_unlit"), Some(Applied));
        assert_eq!(treatment("KHR_materials_clearcoat"), Some(Reported));
        assert_eq!(treatment("KHR_xmp_json_ld"), Some(Irrelevant));
        assert_eq!(treatment("ACME_glow"), None);
    }
}
