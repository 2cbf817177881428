//! Files that are given in place of a scenario, and what to do with each.

use std::path::Path;

use super::schema::KEYS;

/// What a file is that cannot be a scenario, and the way on; `None` if its own errors say more.
pub(super) fn mistaken(path: &Path, bytes: &[u8]) -> Option<String> {
    let shown = path.display();
    let name = path.file_name()?.to_string_lossy().into_owned();
    let told = |what: &str, way: String| Some(format!("{shown} is {what}, not a scenario: {way}"));
    if path.is_dir() {
        let run = path.join("run.json");
        let way = if run.is_file() {
            format!("its own is {}", run.display())
        } else {
            "name the .toml file in it".to_owned()
        };
        return told("a folder", way);
    }
    if let Some(kind) = picture(bytes) {
        let way = format!(
            "a picture on the ground goes into one as scene.pattern = {{ image = {name:?}, width_m = 100.0 }}, one that another program rendered \
             through a camera with `camsim apply CAMERA.toml FRAME.toml -o out.png` (`camsim apply --help` says what FRAME.toml holds)"
        );
        return told(&format!("a picture ({kind})"), way);
    }
    if bytes.starts_with(b"II*\0") || bytes.starts_with(b"MM\0*") || bytes.starts_with(b"II+\0") {
        return told(
            "a TIFF",
            format!(
                "heights go into one as scene.terrain = {{ dem = {name:?} }}, a picture of the ground beside them as ortho"
            ),
        );
    }
    if bytes.starts_with(b"glTF")
        || (bytes.starts_with(b"{")
            && path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("gltf")))
    {
        return told("a model", format!("it goes into one as scene.gltf = [{{ file = {name:?} }}]"));
    }
    if bytes.starts_with(b"ULog") || bytes.starts_with(&[0xa3, 0x95]) {
        return told("a flight log", scenario_for(path, &name));
    }
    let text = std::str::from_utf8(bytes).ok()?.trim_start_matches('\u{feff}');
    if let Ok(root) = text.parse::<toml::Table>() {
        return of_toml(&root).and_then(|kind| match kind {
            Toml::Frame => told(
                "a FRAME.toml",
                format!("it goes with a camera: `camsim apply CAMERA.toml {shown} -o out.png`"),
            ),
            Toml::Camera => told(
                "a camera file",
                format!("name it in one:\n\n{}", lines(&format!("camera = {name:?}\n"), "flight.csv")),
            ),
        });
    }
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) {
        return None;
    }
    if text.starts_with("frame,stamp_ns,") {
        let run = path.with_file_name("run.json");
        return told("the table of a run's frames", format!("the scenario of that run is {}", run.display()));
    }
    let calibration = [
        "distortion",
        "intrinsics",
        "camera_matrix",
        "camera_model",
        "Camera_Matrix",
        "<calibration",
        "fisheye_params",
    ];
    if calibration.iter().any(|mark| text.contains(mark)) {
        return told(
            "a calibration",
            format!(
                "`camsim camera import {shown} -o CAMERA.toml` makes a camera file of it, and a scenario names that"
            ),
        );
    }
    is_log(text).then(|| told("a flight log", scenario_for(path, &name))).flatten()
}

fn picture(bytes: &[u8]) -> Option<&'static str> {
    let marks: [(&[u8], &str); 7] = [
        (b"\x89PNG", "PNG"),
        (b"\xff\xd8\xff", "JPEG"),
        (b"\x76\x2f\x31\x01", "EXR"),
        (b"GIF8", "GIF"),
        (b"P5", "PGM"),
        (b"P6", "PPM"),
        (b"Pf\n", "PFM"),
    ];
    let webp = bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP");
    // Two letters alone may begin a text; the length of the file stands behind them.
    let bmp = bytes.starts_with(b"BM")
        && bytes.get(2..6).is_some_and(|length| length == (bytes.len() as u32).to_le_bytes());
    let known = marks.into_iter().find(|(mark, _)| bytes.starts_with(mark)).map(|(_, kind)| kind);
    known.or(webp.then_some("WebP")).or(bmp.then_some("BMP"))
}

enum Toml {
    Camera,
    Frame,
}

/// By the keys at the root, if all of them belong to the one.
fn of_toml(root: &toml::Table) -> Option<Toml> {
    const OF_FRAME: [&str; 4] = ["color", "depth", "frames", "motion"];
    if root.keys().any(|key| OF_FRAME.contains(&key.as_str()))
        && !root.contains_key("flight")
        && !root.contains_key("scene")
    {
        return Some(Toml::Frame);
    }
    let of_camera = |key: &String| {
        KEYS.iter().any(|(known, _)| {
            known.strip_prefix("camera.").is_some_and(|rest| rest.split('.').next() == Some(key))
        })
    };
    (!root.is_empty() && root.keys().all(of_camera)).then_some(Toml::Camera)
}

/// Whether a text is a table with times and numbers: a row of four numbers or more, below a header at most;
/// or a GPX track.
fn is_log(text: &str) -> bool {
    if text.contains("<gpx") || text.contains("<trkpt") {
        return true;
    }
    let numbers = |line: &str| {
        let cells: Vec<&str> = line
            .split([',', ';', '\t', ' '])
            .map(|cell| cell.trim().trim_matches('"'))
            .filter(|cell| !cell.is_empty())
            .collect();
        cells.len() >= 4 && cells.iter().filter(|cell| cell.parse::<f64>().is_ok()).count() * 2 > cells.len()
    };
    let rows = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with(['#', '%']));
    rows.take(3).any(numbers)
}

/// The scenario that a log wants.
fn scenario_for(path: &Path, log: &str) -> String {
    let scenario = path.with_extension("toml");
    format!(
        "write one beside it, as {}:\n\n{}\nthen `camsim render {}`; `camsim render --print-default` lists all keys",
        scenario.display(),
        lines("camera = \"camera.toml\"   # left out: a pinhole of 640x480 that looks along the nose\n", log),
        scenario.display()
    )
}

fn lines(camera: &str, log: &str) -> String {
    format!(
        "    {camera}    [flight]\n    log = {log:?}\n    [scene]\n    terrain = {{ dem = \"dem.tif\", ortho = \"ortho.tif\" }}\n"
    )
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    fn said(name: &str, bytes: &[u8]) -> String {
        mistaken(Path::new(name), bytes).unwrap_or_default()
    }

    #[test]
    fn what_a_file_is_and_what_to_do_with_it_is_said() {
        let log = said("dir/flight.csv", b"t,lat,lon,alt,roll,pitch,yaw\n0,46.5,7.2,900,0,0,0\n");
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
        // The lines are a scenario.
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
            let said = said(name, bytes);
            assert!(said.contains(wanted), "{name}: {said}");
        }
        let folder = tempfile::tempdir().unwrap();
        assert!(
            mistaken(folder.path(), b"")
                .unwrap()
                .ends_with("is a folder, not a scenario: name the .toml file in it")
        );
        std::fs::write(folder.path().join("run.json"), "{}").unwrap();
        assert!(mistaken(folder.path(), b"").unwrap().ends_with("/run.json"));
        for (name, bytes) in [
            ("s.toml", &b"[flight]\nlogg = \"a.csv\"\n"[..]),
            ("s.toml", b""),
            ("s.toml", b"[flight\nlog = 3"),
            ("s.toml", b"size_px = [1, 2]\nnonsense = 3\n"),
            ("s.toml", b"1,2,3,4\n"),
            ("notes.txt", b"all that I know\nabout it\n"),
            ("s.toml", b"\x01\x02\0"),
        ] {
            assert_eq!(said(name, bytes), "", "{name}");
        }
    }
}
