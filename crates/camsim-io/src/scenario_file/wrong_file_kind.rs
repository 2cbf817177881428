//! Recognises files that are given instead of a scenario, and says how each is used.

use std::path::Path;

use super::schema::keys;

/// Substrings that only calibration files have.
const CALIBRATION_MARKS: [&str; 7] = [
    "distortion",
    "intrinsics",
    "camera_matrix",
    "camera_model",
    "Camera_Matrix",
    "<calibration",
    "fisheye_params",
];

/// The error message for a file that is no scenario but of another known kind; `None` if it may be a
/// scenario.
pub(super) fn wrong_kind_message(path: &Path, bytes: &[u8]) -> Option<String> {
    let (kind, advice) = kind_and_advice(path, bytes)?;
    Some(format!("{} is {kind}, not a scenario: {advice}", path.display()))
}

/// The kind of a file, with its article, and how it is used.
fn kind_and_advice(path: &Path, bytes: &[u8]) -> Option<(String, String)> {
    let name = path.file_name()?.to_string_lossy().into_owned();
    if path.is_dir() {
        return Some(("a folder".to_owned(), folder_advice(path)));
    }
    if let Some(format) = picture_format(bytes) {
        let advice = format!(
            "a picture on the ground goes into one as scene.pattern = {{ image = {name:?}, width_m = 100.0 \
                }}, \
             one that another program rendered through a camera with `camsim apply CAMERA.toml FRAME.toml -o \
             out.png` (`camsim apply --help` says what FRAME.toml holds)"
        );
        return Some((format!("a picture ({format})"), advice));
    }
    if bytes.starts_with(b"II*\0") || bytes.starts_with(b"MM\0*") || bytes.starts_with(b"II+\0") {
        let advice = format!(
            "heights go into one as scene.terrain = {{ dem = {name:?} }}, a picture of the ground beside \
                them \
             as ortho"
        );
        return Some(("a TIFF".to_owned(), advice));
    }
    let has_ending =
        |wanted: &str| path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(wanted));
    if bytes.starts_with(b"glTF") || (bytes.starts_with(b"{") && has_ending("gltf")) {
        return Some((
            "a model".to_owned(),
            format!("it goes into one as scene.gltf = [{{ file = {name:?} }}]"),
        ));
    }
    if bytes.starts_with(b"ULog") || bytes.starts_with(&[0xa3, 0x95]) {
        return Some(("a flight log".to_owned(), log_advice(path, &name)));
    }
    let text = std::str::from_utf8(bytes).ok()?.trim_start_matches('\u{feff}');
    if let Ok(root) = text.parse::<toml::Table>() {
        return toml_kind(&root).map(|kind| toml_kind_and_advice(kind, path, &name));
    }
    if has_ending("toml") {
        return None;
    }
    if text.starts_with("frame,stamp_ns,") {
        let run = path.with_file_name("run.json");
        let advice = format!("the scenario of that run is {}", run.display());
        return Some(("the table of a run's frames".to_owned(), advice));
    }
    if CALIBRATION_MARKS.iter().any(|mark| text.contains(mark)) {
        let advice = format!(
            "`camsim camera import {} -o CAMERA.toml` makes a camera file of it, and a scenario names that",
            path.display()
        );
        return Some(("a calibration".to_owned(), advice));
    }
    is_log(text).then(|| ("a flight log".to_owned(), log_advice(path, &name)))
}

fn folder_advice(path: &Path) -> String {
    let run = path.join("run.json");
    if run.is_file() {
        format!("its own is {}", run.display())
    } else {
        "name the .toml file in it".to_owned()
    }
}

fn toml_kind_and_advice(kind: TomlKind, path: &Path, name: &str) -> (String, String) {
    match kind {
        TomlKind::Frame => (
            "a FRAME.toml".to_owned(),
            format!("it goes with a camera: `camsim apply CAMERA.toml {} -o out.png`", path.display()),
        ),
        TomlKind::Camera => (
            "a camera file".to_owned(),
            format!("name it in one:\n\n{}", example(&format!("camera = {name:?}\n"), "flight.csv")),
        ),
    }
}

/// Format of a picture, by its signature.
fn picture_format(bytes: &[u8]) -> Option<&'static str> {
    let signatures: [(&[u8], &str); 7] = [
        (b"\x89PNG", "PNG"),
        (b"\xff\xd8\xff", "JPEG"),
        (b"\x76\x2f\x31\x01", "EXR"),
        (b"GIF8", "GIF"),
        (b"P5", "PGM"),
        (b"P6", "PPM"),
        (b"Pf\n", "PFM"),
    ];
    let is_webp = bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP");
    // A text may begin with BM too; in a bitmap the length of the file follows.
    let is_bmp = bytes.starts_with(b"BM")
        && bytes.get(2..6).is_some_and(|length| length == (bytes.len() as u32).to_le_bytes());
    let by_signature = signatures.into_iter().find(|(signature, _)| bytes.starts_with(signature));
    by_signature.map(|(_, format)| format).or(is_webp.then_some("WebP")).or(is_bmp.then_some("BMP"))
}

/// Kinds of TOML files other than scenarios.
enum TomlKind {
    Camera,
    Frame,
}

/// The kind of a TOML file by the keys at its root: a FRAME.toml if it has one of its keys and neither flight
/// nor scene, a camera file if all keys are those of `[camera]`.
fn toml_kind(root: &toml::Table) -> Option<TomlKind> {
    const FRAME_KEYS: [&str; 4] = ["color", "depth", "frames", "motion"];
    if root.keys().any(|key| FRAME_KEYS.contains(&key.as_str()))
        && !root.contains_key("flight")
        && !root.contains_key("scene")
    {
        return Some(TomlKind::Frame);
    }
    let is_camera_key = |key: &String| {
        keys().iter().any(|known| {
            known.name.strip_prefix("camera.").is_some_and(|rest| rest.split('.').next() == Some(key))
        })
    };
    (!root.is_empty() && root.keys().all(is_camera_key)).then_some(TomlKind::Camera)
}

/// Whether a text looks like a flight log: a GPX track, or a table one of whose first three rows has at least
/// four fields, most of them numbers.
fn is_log(text: &str) -> bool {
    if text.contains("<gpx") || text.contains("<trkpt") {
        return true;
    }
    let is_numeric = |line: &str| {
        let cells: Vec<&str> = line
            .split([',', ';', '\t', ' '])
            .map(|cell| cell.trim().trim_matches('"'))
            .filter(|cell| !cell.is_empty())
            .collect();
        cells.len() >= 4 && cells.iter().filter(|cell| cell.parse::<f64>().is_ok()).count() * 2 > cells.len()
    };
    let rows = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with(['#', '%']));
    rows.take(3).any(is_numeric)
}

/// Advice for a flight log: the scenario that reads it.
fn log_advice(path: &Path, log: &str) -> String {
    let scenario = path.with_extension("toml");
    format!(
        "write one beside it, as {}:\n\n{}\nthen `camsim render {}`; `camsim render --print-default` lists \
            all \
         keys",
        scenario.display(),
        example(
            "camera = \"camera.toml\"   # omitted: a pinhole of 640x480 that looks along the nose\n",
            log
        ),
        scenario.display()
    )
}

/// An indented scenario with a line for the camera and a log.
fn example(camera: &str, log: &str) -> String {
    let scene = "    [scene]\n    terrain = { dem = \"dem.tif\", ortho = \"ortho.tif\" }\n";
    format!("    {camera}    [flight]\n    log = {log:?}\n{scene}")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    fn message(name: &str, bytes: &[u8]) -> String {
        wrong_kind_message(Path::new(name), bytes).unwrap_or_default()
    }

    #[test]
    fn files_of_other_kinds_are_named_with_their_use() {
        let log = message("dir/flight.csv", b"t,lat,lon,alt,roll,pitch,yaw\n0,46.5,7.2,900,0,0,0\n");
        assert!(
            log.starts_with(
                "dir/flight.csv is a flight log, not a scenario: write one beside it, as dir/flight.toml:"
            ),
            "{log}"
        );
        assert!(
            log.contains("log = \"flight.csv\"") && log.contains("`camsim render dir/flight.toml`"),
            "{log}"
        );
        // The example is a valid scenario.
        let lines: Vec<&str> = log.lines().filter_map(|line| line.strip_prefix("    ")).collect();
        let scenario = lines.join("\n").parse::<toml::Table>().unwrap();
        assert!(lines.len() == 5 && scenario["flight"]["log"].as_str() == Some("flight.csv"), "{lines:?}");
        for (name, bytes, wanted) in [
            ("a.txt", &b"# timestamp tx ty tz qx qy qz qw\n1403.5 0 0 1 0 0 0 1\n"[..], "is a flight log"),
            ("a.gpx", b"<?xml version=\"1.0\"?>\n<gpx><trk/></gpx>", "is a flight log"),
            ("a.ulg", b"ULog\x01\x12\x35\x01", "is a flight log"),
            ("a.png", b"\x89PNG\r\n\x1a\n", "is a picture (PNG)"),
            ("a.jpg", b"\xff\xd8\xff\xe0", "is a picture (JPEG)"),
            ("a.exr", b"\x76\x2f\x31\x01", "is a picture (EXR)"),
            ("a.tif", b"II*\0", "scene.terrain = { dem = \"a.tif\" }"),
            ("a.glb", b"glTF\x02", "scene.gltf = [{ file = \"a.glb\" }]"),
            (
                "CAMERA.toml",
                b"size_px = [640, 480]\n[lens]\nmodel = \"pinhole\"\n",
                "is a camera file, not a scenario: name it in one:",
            ),
            (
                "F.toml",
                b"color = \"a.png\"\nfocal_px = [1.0, 1.0]\n",
                "`camsim apply CAMERA.toml F.toml -o out.png`",
            ),
            ("out/frames.csv", b"frame,stamp_ns,n,e\n0,0,1,2\n", "the scenario of that run is out/run.json"),
            (
                "c.yaml",
                b"cam0:\n  camera_model: pinhole\n  intrinsics: [1, 2, 3, 4]\n",
                "`camsim camera import c.yaml -o CAMERA.toml`",
            ),
        ] {
            let message = message(name, bytes);
            assert!(message.contains(wanted), "{name}: {message}");
        }
        let folder = tempfile::tempdir().unwrap();
        assert!(
            wrong_kind_message(folder.path(), b"")
                .unwrap()
                .ends_with("is a folder, not a scenario: name the .toml file in it")
        );
        std::fs::write(folder.path().join("run.json"), "{}").unwrap();
        assert!(wrong_kind_message(folder.path(), b"").unwrap().ends_with("/run.json"));
        for (name, bytes) in [
            ("s.toml", &b"[flight]\nlogg = \"a.csv\"\n"[..]),
            ("s.toml", b""),
            ("s.toml", b"[flight\nlog = 3"),
            ("s.toml", b"size_px = [1, 2]\nnonsense = 3\n"),
            ("s.toml", b"1,2,3,4\n"),
            ("notes.txt", b"all that I know\nabout it\n"),
            ("s.toml", b"\x01\x02\0"),
        ] {
            assert_eq!(message(name, bytes), "", "{name}");
        }
    }
}
