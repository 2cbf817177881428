//! Files of other kinds that are given as a model: what each is, and how to make glTF of it.

use std::path::Path;

use camsim_core::geodesy::Geodetic;
use glam::DVec3;
use serde_json::Value;

use crate::shell::quoted;

/// Bytes of a text that are looked at.
const START: usize = 4096;
/// Length of the header of a binary STL file, and of each of its triangles.
const STL_HEADER: usize = 84;
const STL_TRIANGLE: usize = 50;

// What to do with a file. {in} and {out} stand for its path and that of the .glb file.
/// Assimp reads most formats of triangles.
const ASSIMP: &str = "convert it with `assimp export {in} {out}`";
const BLENDER: &str = "open it in Blender and export it as glTF 2.0";
const OBJ: &str = "convert it with `npx obj2gltf -i {in} -o {out}`";
const POINTS: &str = "points are not shown; make heights of them, and give those as scene.terrain.dem";
const PICTURE: &str = "give it as image of scene.pattern";
const TIFF: &str = "give heights as scene.terrain.dem, a picture as scene.terrain.ortho";
const UNPACK: &str = "unpack it, and give the model that it holds";
const DOWNLOAD: &str = "download the model itself";

/// Beginnings of files, of texts in any case, with what they are and what to do.
const SIGNATURES: [(&[u8], &str, &str); 26] = [
    (
        b"i3dm",
        "a tile of 3D Tiles with instances (i3dm)",
        "convert it with `npx 3d-tiles-tools i3dmToGlb -i {in} -o {out}`",
    ),
    (
        b"cmpt",
        "several tiles of 3D Tiles (cmpt)",
        "convert it with `npx 3d-tiles-tools cmptToGlb -i {in} -o {out}`",
    ),
    (b"pnts", "a point cloud of 3D Tiles (pnts)", POINTS),
    (b"LASF", "a point cloud (LAS or LAZ)", POINTS),
    (b"ASTM-E57", "a point cloud (E57)", POINTS),
    (b"# .PCD", "a point cloud (PCD)", POINTS),
    (b"Kaydara FBX Binary", "an FBX model", "convert it with `FBX2glTF -b -i {in} -o {out}`"),
    (b"; FBX", "an FBX model", ASSIMP),
    (b"BLENDER", "a file of Blender", BLENDER),
    (b"\x28\xb5\x2f\xfd", "compressed (Zstandard), as files of Blender are", BLENDER),
    (b"PXR-USDC", "a USD model", BLENDER),
    (b"#usda", "a USD model", BLENDER),
    (b"ply\n", "a PLY model", ASSIMP),
    (b"ply\r", "a PLY model", ASSIMP),
    (b"solid ", "an STL model", ASSIMP),
    (
        b"ISO-10303-21",
        "an IFC or STEP model",
        "convert an IFC file with `IfcConvert {in} {out}`, a STEP file with FreeCAD",
    ),
    (b"mtllib", "an OBJ model", OBJ),
    (b"\x89PNG", "a picture (PNG)", PICTURE),
    (b"\xff\xd8\xff", "a picture (JPEG)", PICTURE),
    (b"II*\0", "a TIFF", TIFF),
    (b"MM\0*", "a TIFF", TIFF),
    (b"PK\x03\x04", "a ZIP archive", UNPACK),
    (b"\x1f\x8b", "compressed (gzip)", UNPACK),
    (b"<!doctype html", "a web page", DOWNLOAD),
    (b"<html", "a web page", DOWNLOAD),
    (b"version https://git-lfs", "a pointer of Git LFS", "get the file itself with `git lfs pull`"),
];

/// Words near the beginning of XML, with what they are and what to do.
const MARKS: [(&str, &str, &str); 3] = [
    ("<COLLADA", "a COLLADA model", ASSIMP),
    (
        "citygml",
        "a CityGML model",
        "convert it with `citygml-tools to-cityjson {in}` and `cjio IN.json export glb {out}`",
    ),
    ("<X3D", "an X3D model", ASSIMP),
];

/// What a file that cannot be read as glTF is, and what to do with it; `None` for what is not known.
pub(super) fn message(path: &Path, bytes: &[u8]) -> Option<String> {
    if bytes.starts_with(b"b3dm") {
        return Some(b3dm(path, bytes));
    }
    let (kind, advice) = kind(path, bytes)?;
    Some(format!("is {kind}, not glTF: {}", with_paths(advice, path)))
}

fn kind(path: &Path, bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    let start = &bytes[..bytes.len().min(START)];
    let trimmed = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start).trim_ascii_start();
    let text = String::from_utf8_lossy(trimmed);
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("usdz")) {
        return Some(("a USD model", BLENDER));
    }
    if let Some((_, kind, advice)) = MARKS.iter().find(|(mark, ..)| text.contains(mark)) {
        return Some((*kind, *advice));
    }
    // Binary STL files may begin with `solid`, too.
    if is_binary_stl(bytes) {
        return Some(("an STL model", ASSIMP));
    }
    let begins =
        |signature: &[u8]| trimmed.get(..signature.len()).is_some_and(|s| s.eq_ignore_ascii_case(signature));
    if let Some((_, kind, advice)) = SIGNATURES.iter().find(|(signature, ..)| begins(signature)) {
        return Some((*kind, *advice));
    }
    let is_3ds = bytes.starts_with(b"MM") && bytes.get(2..6) == Some(&(bytes.len() as u32).to_le_bytes());
    if is_3ds {
        Some(("a 3DS model", ASSIMP))
    } else if is_obj(&text) {
        Some(("an OBJ model", OBJ))
    } else if text.lines().map(str::trim).take(2).eq(["0", "SECTION"]) {
        Some(("a drawing (DXF)", ASSIMP))
    } else {
        None
    }
}

fn with_paths(advice: &str, path: &Path) -> String {
    advice.replace("{in}", &quoted(path)).replace("{out}", &quoted(path.with_extension("glb")))
}

/// A tile of a batched model: a header, a feature table, a batch table, and a .glb.
fn b3dm(path: &Path, bytes: &[u8]) -> String {
    let start = with_paths(
        "is a tile of 3D Tiles (b3dm), not glTF: convert it with `npx 3d-tiles-tools b3dmToGlb -i {in} -o {out}`",
        path,
    );
    let Some(centre) = rtc_center(bytes) else {
        return format!("{start}; its tileset says where it stands");
    };
    let at = Geodetic::from_ecef(centre);
    format!(
        "{start}, and place it with geodetic = [{:.7}, {:.7}, {:.2}], its RTC_CENTER {} {} {}, which the .glb lacks; if \
         it then lies on its side, it has the axes of the Earth: turn it so that up is +Y",
        at.lat_deg(),
        at.lon_deg(),
        at.height_m,
        centre.x,
        centre.y,
        centre.z
    )
}

/// `RTC_CENTER` of the feature table, metres from the Earth's centre.
fn rtc_center(bytes: &[u8]) -> Option<DVec3> {
    let table: Value = serde_json::from_slice(bytes.get(28..28 + word(bytes, 12)?)?).ok()?;
    let [x, y, z] = &table.get("RTC_CENTER")?.as_array()?[..] else { return None };
    Some(DVec3::new(x.as_f64()?, y.as_f64()?, z.as_f64()?))
}

fn word(bytes: &[u8], offset: usize) -> Option<usize> {
    let word = bytes.get(offset..)?.first_chunk::<4>()?;
    Some(u32::from_le_bytes(*word) as usize)
}

/// As [`message`], of JSON.
pub(super) fn json_message(path: &Path, json: &Value) -> Option<String> {
    if json.get("type").and_then(Value::as_str) == Some("CityJSON") {
        let command = with_paths("`cjio {in} export glb {out}`", path);
        return Some(format!("is a CityJSON model, not glTF: convert it with {command}"));
    }
    let root = json.get("root").filter(|_| json.get("geometricError").is_some())?;
    let tile = first_uri(root).map(|uri| path.with_file_name(uri));
    let advice = tile.map_or_else(String::new, |tile| {
        let of_tile = with_paths("; convert it with `npx 3d-tiles-tools b3dmToGlb -i {in} -o {out}`", &tile);
        let is_b3dm = tile.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("b3dm"));
        format!(", for example {}{}", tile.display(), if is_b3dm { of_tile } else { String::new() })
    });
    Some(format!("is a tileset of 3D Tiles, a list of tiles, not glTF: give one of these as .glb{advice}"))
}

/// The first uri within a value of a tileset.
fn first_uri(value: &Value) -> Option<&str> {
    match value {
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
    let length = word(bytes, STL_HEADER - 4).and_then(|count| count.checked_mul(STL_TRIANGLE));
    length.is_some_and(|length| STL_HEADER + length == bytes.len())
}

/// Whether the first lines begin with the words of OBJ files.
fn is_obj(text: &str) -> bool {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    let mut words = lines.take(20).filter_map(|line| line.split_ascii_whitespace().next()).peekable();
    words.peek().is_some()
        && words.all(|word| ["v", "vn", "vt", "f", "o", "g", "s", "l", "usemtl", "mtllib"].contains(&word))
}
