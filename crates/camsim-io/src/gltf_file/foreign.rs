//! Files of other kinds that are given as a model: what each is, and how to make glTF of it.

use std::path::Path;

use camsim_core::geodesy::{Geodetic, LocalFrame};
use glam::DVec3;
use serde_json::Value;

use crate::terrain::quoted;

/// Bytes of a text that are looked at.
const START: usize = 4096;
/// Length of the header of a binary STL file, and of each of its triangles.
const STL_HEADER: usize = 84;
const STL_TRIANGLE: usize = 50;
/// The equatorial radius of WGS-84, metres.
const SEMI_AXIS_M: f64 = 6_378_137.0;

/// How a kind of file is used.
enum Use {
    /// A command with IN and OUT for the paths converts it.
    Command(&'static str),
    /// Words that say what to do.
    Words(&'static str),
}

/// Reads and writes most formats of triangles.
const ASSIMP: Use = Use::Command("assimp export IN OUT");
const BLENDER: Use = Use::Words("open it in Blender and export it as glTF 2.0 (File > Export)");
const DEM: Use =
    Use::Words("points are not shown; make heights of them, and give those as scene.terrain.dem");

/// Beginnings of binary files and of texts, with what they are. Of texts the case does not matter.
const SIGNATURES: [(&[u8], &str, Use); 32] = [
    (
        b"i3dm",
        "a tile of 3D Tiles with instances (i3dm)",
        Use::Command("npx 3d-tiles-tools i3dmToGlb -i IN -o OUT"),
    ),
    (
        b"cmpt",
        "a tile of 3D Tiles with several in it (cmpt)",
        Use::Command("npx 3d-tiles-tools cmptToGlb -i IN -o OUT"),
    ),
    (b"pnts", "a point cloud of 3D Tiles (pnts)", DEM),
    (b"subt", "a list of 3D Tiles (subtree)", Use::Words("give the .glb of one of its tiles")),
    (b"LASF", "a point cloud (LAS or LAZ)", DEM),
    (b"ASTM-E57", "a point cloud (E57)", DEM),
    (b"# .PCD", "a point cloud (PCD)", DEM),
    (b"Kaydara FBX Binary", "an FBX model", Use::Command("FBX2glTF -b -i IN -o OUT")),
    (b"; FBX", "an FBX model", ASSIMP),
    (b"BLENDER", "a file of Blender", BLENDER),
    (b"PXR-USDC", "a model of USD", BLENDER),
    (b"#usda", "a model of USD", BLENDER),
    (b"ply\n", "a PLY model", ASSIMP),
    (b"ply\r", "a PLY model", ASSIMP),
    (
        b"ISO-10303-21",
        "a STEP or IFC model",
        Use::Words("convert it to glTF, for an IFC file with `IfcConvert IN OUT.glb`"),
    ),
    (b"#VRML", "a VRML model", ASSIMP),
    (b"AC10", "a drawing of AutoCAD (DWG)", BLENDER),
    (b"\x89PNG", "a picture (PNG)", Use::Words("give it as scene.pattern")),
    (b"\xff\xd8\xff", "a picture (JPEG)", Use::Words("give it as scene.pattern")),
    (b"II*\0", "a TIFF", Use::Words("give heights as scene.terrain.dem, a picture as scene.terrain.ortho")),
    (b"MM\0*", "a TIFF", Use::Words("give heights as scene.terrain.dem, a picture as scene.terrain.ortho")),
    (b"PK\x03\x04", "a compressed archive", Use::Words("unpack it, and give the model that it holds")),
    (b"\x1f\x8b", "a compressed file (gzip)", Use::Words("unpack it")),
    (
        b"\x28\xb5\x2f\xfd",
        "a compressed file (Zstandard)",
        Use::Words("unpack it; a .blend file: open it in Blender and export it as glTF 2.0"),
    ),
    (b"<!doctype html", "a page of the web", Use::Words("download the model itself")),
    (b"<html", "a page of the web", Use::Words("download the model itself")),
    (
        b"version https://git-lfs",
        "a pointer of Git LFS",
        Use::Words("get the file itself with `git lfs pull`"),
    ),
    (
        b"newmtl",
        "a list of materials of an OBJ model",
        Use::Words("give the model, made of the .obj file beside it"),
    ),
    (b"mtllib", "an OBJ model", Use::Command("npx obj2gltf -i IN -o OUT")),
    (b"solid ", "an STL model", ASSIMP),
    (b"OFF\n", "an OFF model", ASSIMP),
    (b"xof 0", "a DirectX model", ASSIMP),
];

/// What a file that is no glTF is, and what to do with it; `None` for glTF and for what is not known.
pub(super) fn message(path: &Path, bytes: &[u8]) -> Option<String> {
    if bytes.starts_with(b"glTF") {
        return None;
    }
    if bytes.starts_with(b"b3dm") {
        return Some(b3dm(path, bytes));
    }
    let start = &bytes[..bytes.len().min(START)];
    let has_ending = |ending: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending));
    let trimmed = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start).trim_ascii_start();
    if trimmed.first() == Some(&b'{') {
        return json(path, bytes);
    }
    let text = String::from_utf8_lossy(trimmed);
    let (kind, usage) = if has_ending("usdz") && bytes.starts_with(b"PK") {
        ("a model of USD (usdz)", &BLENDER)
    } else if text.contains("<COLLADA") {
        ("a COLLADA model", &ASSIMP)
    } else if text.contains("CityGML") || text.contains("citygml") {
        (
            "a CityGML model",
            &Use::Words("convert it with `citygml-tools to-cityjson` and a converter of CityJSON to glTF"),
        )
    } else if text.contains("<X3D") {
        ("an X3D model", &ASSIMP)
    } else if is_binary_stl(bytes) {
        ("an STL model", &ASSIMP)
    } else if is_3ds(bytes) {
        ("a 3DS model", &ASSIMP)
    } else if let Some((_, kind, usage)) =
        SIGNATURES.iter().find(|(signature, ..)| begins(trimmed, signature))
    {
        (*kind, usage)
    } else if is_obj(&text) {
        ("an OBJ model", &Use::Command("npx obj2gltf -i IN -o OUT"))
    } else if is_dxf(&text) {
        ("a drawing (DXF)", &BLENDER)
    } else {
        return None;
    };
    Some(match usage {
        Use::Command(command) => {
            format!("is {kind}, not glTF: convert it with `{}`", with_paths(command, path))
        }
        Use::Words(words) => format!("is {kind}, not glTF: {words}"),
    })
}

fn begins(bytes: &[u8], signature: &[u8]) -> bool {
    bytes.get(..signature.len()).is_some_and(|start| start.eq_ignore_ascii_case(signature))
}

fn with_paths(command: &str, path: &Path) -> String {
    command.replace("IN", &quoted(path)).replace("OUT", &quoted(&path.with_extension("glb")))
}

/// A tile of a batched model: a header, a feature table, a batch table, and a .glb.
fn b3dm(path: &Path, bytes: &[u8]) -> String {
    let command = with_paths("npx 3d-tiles-tools b3dmToGlb -i IN -o OUT", path);
    let start = format!("is a tile of 3D Tiles (b3dm), not glTF: convert it with `{command}`");
    match rtc_center(bytes) {
        None => format!("{start}; the tileset that names it says where it stands"),
        Some(centre) => {
            let [x, y, z] = centre;
            let equator = LocalFrame::new(Geodetic::from_deg(0.0, 0.0, 0.0));
            let at = equator.geodetic_from_ned(DVec3::new(z, y, SEMI_AXIS_M - x));
            format!(
                "{start}. Its vertices lie about its RTC_CENTER, {x} {y} {z} m from the Earth's centre, which the .glb \
                 does not have: place that with geodetic = [{:.7}, {:.7}, {:.2}]. Its axes may be those of the Earth \
                 too: then turn it in Blender so that up is +Y",
                at.lat_deg(),
                at.lon_deg(),
                at.height_m
            )
        }
    }
}

/// `RTC_CENTER` of the feature table, metres from the Earth's centre.
fn rtc_center(bytes: &[u8]) -> Option<[f64; 3]> {
    let word = |offset: usize| {
        bytes.get(offset..offset + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize)
    };
    let table: Value = serde_json::from_slice(bytes.get(28..28 + word(12)?)?).ok()?;
    let centre = table.get("RTC_CENTER")?.as_array()?;
    let [x, y, z] = &centre[..] else { return None };
    Some([x.as_f64()?, y.as_f64()?, z.as_f64()?])
}

/// JSON of other kinds.
fn json(path: &Path, bytes: &[u8]) -> Option<String> {
    let json: Value = serde_json::from_slice(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)).ok()?;
    let is_tileset = json.get("root").is_some() && json.get("geometricError").is_some();
    if is_tileset {
        let content = |key: &str| json.pointer(&format!("/root/content/{key}")).and_then(Value::as_str);
        let tile = content("uri").or_else(|| content("url")).or_else(|| first_uri(&json));
        let named = tile.map_or_else(String::new, |tile| format!(", for example {tile}"));
        return Some(format!(
            "is a tileset of 3D Tiles, a list of tiles, not glTF: give one of its tiles as .glb{named}; a .b3dm tile is \
             converted with `npx 3d-tiles-tools b3dmToGlb -i {} -o TILE.glb`",
            tile.filter(|tile| tile.ends_with(".b3dm")).map_or_else(
                || "TILE.b3dm".to_owned(),
                |tile| quoted(&path.parent().unwrap_or(Path::new("")).join(tile))
            )
        ));
    }
    match json.get("type").and_then(Value::as_str) {
        Some("CityJSON") => {
            Some("is a CityJSON model, not glTF: convert it with `cjio IN export glb OUT.glb`".to_owned())
        }
        Some("FeatureCollection") => Some(
            "is GeoJSON, not glTF: it has outlines and no model; make a model of it in Blender or QGIS"
                .to_owned(),
        ),
        _ => None,
    }
}

/// The first uri anywhere below the root of a tileset.
fn first_uri(json: &Value) -> Option<&str> {
    match json {
        Value::Object(map) => {
            let own = ["uri", "url"].iter().find_map(|key| map.get(*key)?.as_str());
            own.or_else(|| map.values().find_map(first_uri))
        }
        Value::Array(list) => list.iter().find_map(first_uri),
        _ => None,
    }
}

/// Whether the length is that of a binary STL file with as many triangles as it states.
fn is_binary_stl(bytes: &[u8]) -> bool {
    let count = bytes.get(80..STL_HEADER).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    count
        .and_then(|count| count.checked_mul(STL_TRIANGLE))
        .is_some_and(|length| STL_HEADER + length == bytes.len())
}

/// Whether the first chunk of a 3DS file holds the whole file.
fn is_3ds(bytes: &[u8]) -> bool {
    bytes.starts_with(b"MM") && bytes.get(2..6) == Some(&(bytes.len() as u32).to_le_bytes())
}

/// Whether lines begin with the words of OBJ files: vertices or faces.
fn is_obj(text: &str) -> bool {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    let mut lines = lines.take(20).peekable();
    let is_of_obj = |line: &str| {
        let word = line.split_ascii_whitespace().next().unwrap_or_default();
        ["v", "vn", "vt", "f", "o", "g", "s", "l", "usemtl", "mtllib"].contains(&word)
    };
    lines.peek().is_some() && lines.all(is_of_obj)
}

fn is_dxf(text: &str) -> bool {
    let mut lines = text.lines().map(str::trim);
    lines.next() == Some("0") && lines.next() == Some("SECTION")
}
