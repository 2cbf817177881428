//! What becomes of each extension and property of a file: done, refused, or named.

use std::{collections::BTreeSet, path::Path};

use serde_json::Value;

use super::{GltfError, checks::list};

/// What becomes of a thing that a file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum How {
    /// It does what it says.
    Applied,
    /// There is nothing to show without it.
    Refused,
    /// Left out: a note says so, and a file that requires it is refused.
    Named,
    /// Changes nothing that is seen.
    NoMatter,
}

/// An extension or property, and what it is or what to do without it.
pub(super) type Treatment = (&'static str, How, &'static str);

use How::*;

const UNCOMPRESSED: &str = "write the file again without compression";
const AS_PNG: &str = "write its pictures as PNG or JPEG";

/// By the whole name, or by its beginning where that ends with `*`.
pub(super) const EXTENSIONS: &[Treatment] = &[
    ("KHR_mesh_quantization", Applied, "positions, normals and texture coordinates of 8 and 16 bits"),
    ("KHR_texture_transform", Applied, "offset, rotation, scale and set of texture coordinates"),
    (
        "KHR_materials_unlit",
        Applied,
        "its base colour alone: the scene's light does not fall on it, and nothing is emitted",
    ),
    (
        "KHR_materials_pbrSpecularGlossiness",
        Applied,
        "its diffuse colour is the base colour; its gloss is named",
    ),
    ("KHR_materials_emissive_strength", Applied, "times emissiveFactor; more than white is white, and named"),
    ("KHR_node_visibility", Applied, "of what is not visible nothing is shown, its children included"),
    ("EXT_mesh_gpu_instancing", Applied, "TRANSLATION, ROTATION and SCALE"),
    ("EXT_texture_webp", Applied, "the WebP picture, not the one beside it"),
    ("KHR_draco_mesh_compression", Refused, UNCOMPRESSED),
    ("EXT_meshopt_compression", Refused, UNCOMPRESSED),
    ("KHR_meshopt_compression", Refused, UNCOMPRESSED),
    ("KHR_texture_basisu", Refused, AS_PNG),
    ("EXT_texture_avif", Refused, AS_PNG),
    ("MSFT_texture_dds", Refused, AS_PNG),
    ("KHR_materials_variants", Named, "the materials of the mesh itself are shown"),
    ("KHR_materials_*", Named, "gloss, glass, coats and the like"),
    ("KHR_lights_punctual", Named, "lights are the scenario's"),
    ("EXT_lights_*", Named, "lights are the scenario's"),
    ("KHR_animation_pointer", Named, "animations move nodes, skins and morph targets"),
    ("CESIUM_primitive_outline", Named, "lines are not drawn"),
    ("CESIUM_RTC", Named, "the model's origin is its centre: place it with at or geodetic"),
    ("EXT_structural_metadata", NoMatter, "data about things"),
    ("EXT_feature_metadata", NoMatter, "data about things"),
    ("EXT_mesh_features", NoMatter, "data about things"),
    ("EXT_instance_features", NoMatter, "data about things"),
    ("KHR_xmp*", NoMatter, "data about the file"),
    ("KHR_audio*", NoMatter, "sound"),
    ("KHR_physics_rigid_bodies", NoMatter, "nothing moves by itself"),
    ("MSFT_audio_emitter", NoMatter, "sound"),
    ("MSFT_lod", NoMatter, "the finest level is shown"),
];

/// Properties of glTF 2.0 itself that change the picture, or look as if they did: for the page.
#[cfg(test)]
pub(super) const PROPERTIES: &[Treatment] = &[
    ("baseColorFactor, baseColorTexture", Applied, "albedo"),
    (
        "COLOR_0",
        Applied,
        "times albedo; not under a picture of emitted light that lies on the base colour's, which is named",
    ),
    (
        "emissiveFactor, emissiveTexture",
        Applied,
        "added, whichever set of texture coordinates it has; what cannot be is named with its material",
    ),
    ("alphaMode, alphaCutoff", Applied, "masks cut, blended surfaces are mixed"),
    ("doubleSided", Applied, "one-sided surfaces are not there from behind"),
    ("TEXCOORD_n, texCoord", Applied, "any set"),
    ("wrapS, wrapT, magFilter", Applied, "repeat, mirror, clamp; sharp or smooth texels"),
    ("minFilter", NoMatter, "a pixel has the mean over its area"),
    ("bufferView left out", Applied, "numbers are 0, but for the sparse ones; a note says so where all are"),
    ("sparse, normalized, byteStride", Applied, "as stored"),
    ("mode", Applied, "triangles, strips, fans; points and lines are named"),
    ("NORMAL", Applied, "in light; otherwise nothing is shaded"),
    ("skins, JOINTS_n, WEIGHTS_n", Applied, "at time_s"),
    ("weights, targets", Applied, "POSITION and NORMAL; other targets are named"),
    ("animations", Applied, "at time_s; without it a note says that nodes are as they stand"),
    ("scene, scenes", Applied, "scene.gltf.scene, or the file's own choice"),
    ("metallicFactor, metallicRoughnessTexture", Named, "colour is albedo"),
    ("roughnessFactor", NoMatter, "gloss alone: nothing shines without a metallic or clear coat"),
    ("normalTexture", Named, "light falls on the surface itself"),
    ("occlusionTexture", Named, "there are no shadows"),
    ("COLOR_1, COLOR_2, ...", Named, "glTF gives them no meaning"),
    ("TANGENT", NoMatter, "for normalTexture"),
    ("cameras", NoMatter, "the camera is the scenario's"),
    ("minVersion, version", Refused, "other than 2.0"),
];

/// The row of an extension.
pub(super) fn treatment(name: &str) -> Option<&'static Treatment> {
    let is = |known: &str| known.strip_suffix('*').map_or(known == name, |start| name.starts_with(start));
    EXTENSIONS.iter().find(|(known, ..)| is(known))
}

/// Refuses a file for an extension.
pub(super) fn refuse(path: &Path, name: &str) -> GltfError {
    let fix = match treatment(name) {
        Some((_, Refused, fix)) => fix,
        Some((_, Named, _)) => {
            "write the file again without it, or take it out of extensionsRequired to have all but what it adds"
        }
        _ => "write the file again without it",
    };
    GltfError::Extension { path: path.into(), extension: name.into(), fix }
}

/// Names of extensions that the file holds anywhere, whatever it says that it uses.
fn present<'a>(value: &'a Value, found: &mut BTreeSet<&'a str>) {
    match value {
        Value::Object(map) => {
            for (key, value) in map {
                match (key.as_str(), value) {
                    // Anybody's own data: no part of the model.
                    ("extras", _) => {}
                    ("extensions", Value::Object(extensions)) => {
                        found.extend(extensions.keys().map(String::as_str));
                        extensions.values().for_each(|value| present(value, found));
                    }
                    _ => present(value, found),
                }
            }
        }
        Value::Array(values) => values.iter().for_each(|value| present(value, found)),
        _ => {}
    }
}

/// What of a file is left out, in words, each thing once.
pub(super) fn notes(json: &Value) -> Vec<String> {
    let mut found = BTreeSet::new();
    present(json, &mut found);
    let (mut gloss, mut notes) = (albedo_only(json), Vec::new());
    for name in found {
        match treatment(name) {
            Some(("KHR_materials_*", ..)) => drop(gloss.insert(name)),
            Some((_, Named, what)) => notes.push(format!("{name} is left out: {what}")),
            Some(_) => {}
            None => notes.push(format!("the extension {name} is not known: what it adds is left out")),
        }
    }
    if !gloss.is_empty() {
        let names: Vec<&str> = gloss.into_iter().collect();
        notes.push(format!("colour is albedo alone: {} left out", joined(&names)));
    }
    for (number, mesh) in list(json, "meshes").iter().enumerate() {
        for primitive in list(mesh, "primitives") {
            let attributes = primitive.get("attributes").and_then(Value::as_object).into_iter().flatten();
            let more = attributes.filter(|(name, _)| name.starts_with("COLOR_") && *name != "COLOR_0");
            notes.extend(
                more.map(|(name, _)| {
                    format!("meshes.{number}: {name} is left out: COLOR_0 is the only colour that glTF has a meaning for")
                }),
            );
            let targets = list(primitive, "targets").iter().filter_map(Value::as_object).flatten();
            let other =
                targets.filter(|(name, _)| !matches!(name.as_str(), "POSITION" | "NORMAL" | "TANGENT"));
            notes.extend(other.map(|(name, _)| {
                format!(
                    "meshes.{number}: {name} of its morph targets is left out: they move and turn corners"
                )
            }));
        }
    }
    notes
}

/// Properties of materials that shade, and are left out. What is unlit has none of them.
fn albedo_only(json: &Value) -> BTreeSet<&str> {
    let mut found = BTreeSet::new();
    for material in list(json, "materials") {
        if material.pointer("/extensions/KHR_materials_unlit").is_some() {
            continue;
        }
        let there = |pointer: &str| material.pointer(pointer).is_some_and(|value| !value.is_null());
        let older = |key: &str| there(&format!("/extensions/KHR_materials_pbrSpecularGlossiness/{key}"));
        let names = [
            ("specularFactor", older("specularFactor")),
            ("specularGlossinessTexture", older("specularGlossinessTexture")),
            ("normalTexture", there("/normalTexture")),
            ("occlusionTexture", there("/occlusionTexture")),
            ("metallicRoughnessTexture", there("/pbrMetallicRoughness/metallicRoughnessTexture")),
            (
                "metallicFactor",
                material
                    .pointer("/pbrMetallicRoughness/metallicFactor")
                    .and_then(Value::as_f64)
                    .is_some_and(|f| f > 0.0),
            ),
        ];
        found.extend(names.into_iter().filter(|(_, there)| *there).map(|(name, _)| name));
    }
    found
}

/// `a is`, `a and b are`, `a, b and c are`.
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

    /// `docs/inputs/MODELS.md`, from the tables above.
    fn page() -> String {
        let how = |how: &How| match how {
            Applied => "applied",
            Refused => "refused",
            Named => "named",
            NoMatter => "no matter",
        };
        let table = |head: &str, rows: &[Treatment]| {
            let rows = rows.iter().map(|(name, done, what)| format!("| {name} | {} | {what} |\n", how(done)));
            format!("| {head} | treatment | |\n|---|---|---|\n{}", rows.collect::<String>())
        };
        format!(
            "# What models hold, and what becomes of it\n\n\
             Made from `crates/camsim-io/src/gltf_file/treatments.rs`; [MODELS.md](../MODELS.md) tells how models are shown.\n\n\
             *Applied*: it does what it says. *Refused*: the file is not read, and the error names it and what to do. *Named*: it is left out, and a warning of \
             the render says so. *No matter*: it changes nothing that is seen.\n\n\
             ## Extensions\n\n\
             One that a file requires is refused by its name unless it is applied or no matter. What is named here as refused is read where the file brings \
             the same without it: fallback buffers, PNG or JPEG beside. `*` stands for any ending. Those that are not listed are named.\n\n{}\n\
             ## Properties\n\n{}",
            table("extension", EXTENSIONS),
            table("property", PROPERTIES)
        )
    }

    #[test]
    fn the_page_of_models_is_made_from_the_tables() {
        crate::inputs_page::check("MODELS.md", &page());
    }

    #[test]
    fn a_name_has_its_own_row_before_that_of_its_family() {
        let how = |name: &str| treatment(name).map(|(_, how, _)| *how);
        assert_eq!(how("KHR_materials_unlit"), Some(Applied));
        assert_eq!(how("KHR_materials_clearcoat"), Some(Named));
        assert_eq!(how("KHR_xmp_json_ld"), Some(NoMatter));
        assert_eq!(how("ACME_glow"), None);
    }
}
