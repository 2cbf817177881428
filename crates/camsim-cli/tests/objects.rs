//! Numbers of objects and classes, `objects.csv` and pictures in colour, from the command line.

#![allow(clippy::unwrap_used)]

use std::{ffi::OsString, fs, path::Path};

/// Runs camsim. Returns exit code, standard output and standard error.
fn camsim(args: &[&str]) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = std::iter::once("camsim").chain(args.iter().copied()).map(OsString::from);
    let code = camsim_cli::run(args, &mut out, &mut err);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
}

/// Hills of Sertig with houses on them: the first frames of a flight over it.
#[test]
fn truth_over_a_town_in_mountains_is_that_of_the_reference_renderer() {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../benches/houses.toml");
    let channels = "output.channels=[\"object\", \"flow\", \"flow_back\"]";
    let args = [
        ["verify", scenario.to_str().unwrap()],
        ["--frames", "40"],
        ["--backend", "cpu"],
        ["--json", "--set"],
        [channels, "--set"],
        ["camera.size_px=[160, 120]", "--set"],
        ["camera.focal_px=[125, 125]", "--set"],
        ["camera.principal_point_px=[79.5, 59.5]", "--set"],
        // Eight metres of flight.
        ["output.flow_step=8", "--set"],
        ["camera.shutter.readout_ms=33", "--set"],
    ];
    let (code, out, err) = camsim(&[args.as_flattened(), &["seed=3"]].concat());
    assert_eq!(code, 0, "{out}{err}");
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    let frame = &report["frames"][0];
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    let object = &frame["planes"][0];
    assert!(number(&object["beyond_away"]) <= 1e-4 * number(&object["pixels_away"]), "{object}");
    for flow in frame["flows"].as_array().unwrap() {
        let away = &flow["away"];
        assert!(number(&away["p99"]) <= 0.02, "{flow}");
        assert!(number(&away["wrong_states"]) <= 1e-3 * number(&away["looked_at"]), "{flow}");
        assert!(flow["states"][2].as_array().unwrap().iter().map(number).sum::<f64>() > 10.0, "{flow}");
    }
}

/// A small picture from 496 m above a pattern of 500 m, whose border is in view.
const SMALL: [&str; 10] = [
    "--set",
    "camera.size_px=[64, 48]",
    "--set",
    "camera.focal_px=[30, 30]",
    "--set",
    "camera.principal_point_px=[31.5, 23.5]",
    "--set",
    "scene.pattern.width_m=500",
    "--set",
    "scene.pattern.at=[-266, 728, 0]",
];

fn render(folder: &Path, more: &[&str]) -> (u8, String, String) {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/pattern.toml");
    let common = ["render", scenario.to_str().unwrap(), "-o", folder.to_str().unwrap(), "--frames", "2"];
    camsim(&[&common[..], &SMALL, more].concat())
}

fn numbers(folder: &Path, channel: &str) -> Vec<u16> {
    let picture = image::open(folder.join(format!("{channel}/frame_000002.png"))).unwrap();
    assert_eq!(picture.color(), image::ColorType::L16, "{channel}");
    picture.into_luma16().into_raw()
}

#[test]
fn objects_are_numbered_named_and_coloured() {
    let temporary = tempfile::tempdir().unwrap();
    let (cpu, reference) = (temporary.path().join("cpu"), temporary.path().join("reference"));
    let asked = ["--outputs", "object,class,coverage,range,normal", "--set", "scene.pattern.class=4"];
    let named = ["--set", "scene.pattern.name=a \"grid\", white", "--set", "output.palette=true"];
    let asked = [&asked[..], &named].concat();
    for (folder, backend) in [(&cpu, "cpu"), (&reference, "reference")] {
        let (code, out, err) = render(folder, &[&asked[..], &["--backend", backend]].concat());
        assert_eq!(code, 0, "{backend}: {out}{err}");
        let table = fs::read_to_string(folder.join("objects.csv")).unwrap();
        assert_eq!(table, "number,name,class\n1,\"a \"\"grid\"\", white\",4\n");
        let listed = fs::read_to_string(folder.join("frames.csv")).unwrap();
        for file in
            ["object/", "object_palette/", "class/", "class_palette/", "coverage/", "range/", "normal/"]
        {
            assert!(listed.contains(&format!("{file}frame_000002.")), "{backend}: {listed}");
        }
        let (objects, classes) = (numbers(folder, "object"), numbers(folder, "class"));
        for number in [0, 1] {
            let count = objects.iter().filter(|found| **found == number).count();
            assert!(count > 100, "{backend}: {count} pixels have {number}");
        }
        assert!(objects.iter().zip(&classes).all(|(object, class)| 4 * object == *class));
        let palette = image::open(folder.join("object_palette/frame_000002.png")).unwrap();
        assert_eq!(palette.color(), image::ColorType::Rgb8);
        let palette = palette.into_rgb8();
        for (pixel, &object) in palette.pixels().zip(&objects) {
            assert_eq!(pixel.0, camsim_io::write::palette_rgb8(object.into()));
        }
    }
    let differ =
        numbers(&cpu, "object").iter().zip(numbers(&reference, "object")).filter(|(a, b)| **a != *b).count();
    assert!(differ <= 2, "{differ} of 3072 pixels have another object");

    // A folder without numbers of objects has no table of them.
    let other = temporary.path().join("other");
    let colour = ["--outputs", "color", "--backend", "cpu", "--set", "output.palette=true"];
    let (code, _, err) = render(&other, &colour);
    assert!(code == 0 && err.contains("output.palette colours nothing"), "{err}");
    assert!(!other.join("objects.csv").exists());
}

#[test]
fn verify_compares_the_channels_that_a_scenario_asks_for() {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/pattern.toml");
    let verify = |more: &[&str]| {
        let common = ["verify", scenario.to_str().unwrap(), "--frames", "3", "--backend", "cpu"];
        camsim(&[&common[..], &SMALL, more].concat())
    };
    let channels = "output.channels=[\"range\", \"normal\", \"normal_world\", \"object\", \"class\"]";
    let (code, out, err) = verify(&["--set", channels, "--json"]);
    assert_eq!(code, 0, "{out}{err}");
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    let planes = report["frames"][0]["planes"].as_array().unwrap();
    let names: Vec<&str> = planes.iter().map(|plane| plane["channel"].as_str().unwrap()).collect();
    assert_eq!(names, ["range", "normal", "normal_world", "object", "class"]);
    for plane in planes {
        assert!(plane["kept"] == true && plane["pixels"].as_u64() > Some(2000), "{plane}");
        assert_eq!(plane["beyond_away"], 0, "{plane}");
    }
    assert!(planes[1]["p99"].as_f64() < Some(1e-3), "{}", planes[1]);
    let (code, out, err) = verify(&["--set", channels]);
    assert!(
        code == 0 && out.contains("object wrong: ") && out.contains("near the pixel's ray has: passed"),
        "{out}{err}"
    );
    let flows = "output.channels=[\"flow\", \"flow_global\", \"motion\", \"blur_path\", \"coverage\"]";
    let (code, out, err) = verify(&["--set", flows, "--json"]);
    assert_eq!(code, 0, "{out}{err}");
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    let frame = &report["frames"][0];
    let names = frame["flows"].as_array().unwrap().iter().map(|flow| flow["channel"].as_str().unwrap());
    assert_eq!(names.collect::<Vec<_>>(), ["flow", "flow_global", "motion", "blur_path"]);
    for flow in frame["flows"].as_array().unwrap() {
        assert!(flow["kept"] == true && flow["away"]["p99"].as_f64() < Some(0.05), "{flow}");
    }
    assert!(frame["flows"][0]["states"][1][1].as_u64() > Some(2000), "{frame}");
    assert!(
        frame["coverage"]["kept"] == true && frame["coverage"]["pixels"].as_u64() > Some(1000),
        "{frame}"
    );
    let (code, out, err) = verify(&["--set", flows]);
    assert!(
        code == 0 && out.contains("flow, wrong states: 0 of ") && out.contains("coverage against"),
        "{out}{err}"
    );
    let (_, out, _) = verify(&["--json"]);
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(report["frames"][0]["planes"].as_array().map(Vec::len), Some(0));
}
