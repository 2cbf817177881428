//! Scenarios with `[randomize]` through the command line: folders, bytes, tables, shards.

#![allow(clippy::unwrap_used)]

use std::{collections::BTreeMap, fs, path::Path};

/// Runs camsim. Returns exit code, standard output and standard error.
fn camsim(args: &[&str]) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = std::iter::once("camsim").chain(args.iter().copied()).map(Into::into);
    let code = camsim_cli::run(args, &mut out, &mut err);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
}

const CAMERA: &str = "[camera]\nsize_px = [48, 36]\nfocal_px = [40.0, 40.0]\nfps = 10.0\n\
    mount = { angles_deg = [0.0, -90.0, 0.0] }\nphotometric = { noise_sigma = 0.02 }\n\
    shutter = { readout_ms = 20.0 }\n";
const RIG: &str = "[[cameras]]\nname = \"left\"\nsize_px = [48, 36]\nfocal_px = [40.0, 40.0]\nfps = 10.0\n\
    mount = { angles_deg = [0.0, -90.0, 0.0] }\n[[cameras]]\nname = \"right\"\nsize_px = [40, 30]\nfps = 5.0\n\
    mount = { angles_deg = [0.0, -90.0, 0.0] }\n";
const DRAWN: &str = "[randomize]\nvariations = 6\n\"camera.shutter.exposure_ms\" = { uniform = [0, 20] }\n\
    \"camera.size_px\" = { choice = [[48, 36], [36, 48]] }\n\
    \"camera.lens\" = { choice = [{ model = \"pinhole\" }, { model = \"brown-conrady\", coefficients = [-0.1] }] }\n\
    \"scene.pattern.width_m\" = { log_uniform = [1000, 8000] }\n\"flight.window_s\" = { piece_s = 0.25 }\n";

/// A scenario over the pattern with these cameras, in a folder of its own.
fn scenario(base: &Path, name: &str, cameras: &str, more: &str) -> String {
    camsim_io::builtin::unpack(base).unwrap();
    let text = fs::read_to_string(base.join("pattern.toml")).unwrap();
    let (head, tail) = (&text[..text.find("[camera]").unwrap()], &text[text.find("[scene]").unwrap()..]);
    let path = base.join(name);
    fs::write(&path, format!("{head}{cameras}{}{more}", tail.replace("\"exr\", \"png\"", "\"png\"")))
        .unwrap();
    path.to_str().unwrap().to_owned()
}

fn render(scenario: &str, folder: &Path, more: &[&str]) -> (u8, String, String) {
    let common = ["render", scenario, "-o", folder.to_str().unwrap(), "--backend", "cpu"];
    camsim(&[&common[..], more].concat())
}

/// Files below a folder by their names, without the records of runs.
fn results(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        if path.is_dir() {
            all.extend(results(&path).into_iter().map(|(below, bytes)| (format!("{name}/{below}"), bytes)));
        } else if !name.ends_with(".json") {
            all.insert(name, fs::read(&path).unwrap());
        }
    }
    all
}

#[track_caller]
fn assert_alike(a: &BTreeMap<String, Vec<u8>>, b: &BTreeMap<String, Vec<u8>>) {
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    a.iter().for_each(|(name, bytes)| assert!(b[name] == *bytes, "{name}"));
}

fn run_json(folder: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(folder.join("run.json")).unwrap()).unwrap()
}

#[test]
fn variations_are_the_same_alone_in_shards_and_from_their_own_run() {
    let base = tempfile::tempdir().unwrap();
    let path = |name: &str| base.path().join(name);
    let scenario = scenario(base.path(), "random.toml", CAMERA, DRAWN);
    let (code, out, err) = render(&scenario, &path("all"), &[]);
    assert_eq!(code, 0, "{err}");
    assert!(out.starts_with("6 variations: "), "{out}");
    let all = results(&path("all"));
    let table = String::from_utf8(all["variations.csv"].clone()).unwrap();
    assert_eq!(table.lines().count(), 7, "{table}");
    let pictures: Vec<&Vec<u8>> =
        all.iter().filter(|(name, _)| name.ends_with("frame_000000.png")).map(|(_, bytes)| bytes).collect();
    assert_eq!(pictures.len(), 6);
    for (i, picture) in pictures.iter().enumerate() {
        assert!(!pictures[..i].contains(picture), "variation {i} repeats another");
    }

    // In another order, as shards that share a folder; what exists is kept.
    for args in [["--variations", "5,2"], ["--shard", "1/2"], ["--shard", "2/2"]] {
        let (code, _, err) = render(&scenario, &path("parts"), &[&args[..], &["--resume"]].concat());
        assert_eq!(code, 0, "{err}");
    }
    assert_alike(&all, &results(&path("parts")));

    // The concrete scenario renders the same bytes, and its record names the values.
    for index in [0, 3] {
        let folder = path("all").join(format!("variation_{index:06}"));
        let run = run_json(&folder);
        assert_eq!(run["variation"]["index"], index);
        assert_eq!(
            run["variation"]["values"]["camera.shutter.exposure_ms"],
            run["scenario"]["camera"]["shutter"]["exposure_ms"]
        );
        assert_eq!(run["variation"]["values"]["seed"], run["seed"]);
        let again = path(&format!("again{index}"));
        let (code, _, err) = render(folder.join("run.json").to_str().unwrap(), &again, &[]);
        assert_eq!(code, 0, "{err}");
        assert_alike(&results(&folder), &results(&again));
    }
}

#[test]
fn variations_of_a_rig_have_its_folders() {
    let base = tempfile::tempdir().unwrap();
    let drawn = "[randomize]\n\"cameras.*.shutter.exposure_ms\" = { uniform = [1, 9] }\n\
                 \"cameras.right.clock_offset_ms\" = { normal = [0, 1] }\n";
    let scenario = scenario(base.path(), "rig.toml", RIG, drawn);
    let out = base.path().join("out");
    let (code, _, err) = render(&scenario, &out, &["--variation", "12", "--frames", "0..2"]);
    assert_eq!(code, 0, "{err}");
    let folder = out.join("variation_000012");
    let [rig, left, right] =
        [&folder, &folder.join("left"), &folder.join("right")].map(|folder| run_json(folder));
    let exposure = |run: &serde_json::Value| run["scenario"]["camera"]["shutter"]["exposure_ms"].clone();
    assert_eq!(exposure(&left), exposure(&right));
    assert_eq!(rig["variation"]["values"]["cameras.left.shutter.exposure_ms"], exposure(&left));
    assert_eq!(rig["variation"], left["variation"]);
    let again = base.path().join("again");
    let (code, _, err) = render(folder.join("run.json").to_str().unwrap(), &again, &["--frames", "0..2"]);
    assert_eq!(code, 0, "{err}");
    assert_alike(&results(&folder), &results(&again));
}

#[test]
fn values_are_fixed_by_set_and_read_by_other_commands() {
    let base = tempfile::tempdir().unwrap();
    let scenario = scenario(base.path(), "random.toml", CAMERA, DRAWN);
    let explain = |more: &[&str]| camsim(&[&["explain", &scenario, "--json"][..], more].concat());
    let (code, out, err) = explain(&["--variation", "3"]);
    assert_eq!(code, 0, "{err}");
    assert_ne!(out, explain(&["--variation", "4"]).1);
    assert!(explain(&[]).2.contains("[randomize] is not applied: --variation K chooses values"));
    let out = base.path().join("out");
    let (code, _, err) = render(
        &scenario,
        &out,
        &["--variation", "1", "--set", "camera.shutter.exposure_ms=3", "--format", "none"],
    );
    assert_eq!(code, 0, "{err}");
    let table = fs::read_to_string(out.join("variations.csv")).unwrap();
    assert!(!table.contains("exposure_ms") && table.contains("width_m"), "{table}");
    // The same folder for another [randomize].
    let (code, _, err) = render(&scenario, &out, &["--variation", "1"]);
    assert!(code == 2 && err.contains("variations of another [randomize]"), "{err}");
}

#[test]
fn what_has_no_variation_is_refused() {
    let base = tempfile::tempdir().unwrap();
    let path = |name: &str| base.path().join(name);
    let plain = scenario(base.path(), "plain.toml", CAMERA, "");
    let drawn = DRAWN.replace("variations = 6\n", "");
    let open = scenario(base.path(), "open.toml", CAMERA, &drawn);
    let six = scenario(base.path(), "six.toml", CAMERA, DRAWN);
    let wild = DRAWN.replace("uniform = [0, 20]", "uniform = [-20, 20]");
    let wild = scenario(base.path(), "wild.toml", CAMERA, &wild);
    for (scenario, args, wanted) in [
        (&plain, &["--variations", "0..3"][..], "the scenario has no [randomize]"),
        (&open, &[], "choose variations by --variations 0..100, or state randomize.variations"),
        (&open, &["--variations", "3.."], "--variations has no end"),
        (&six, &["--variations", "4..8"], "variation 6 does not exist, the last one is 5"),
        (&six, &["--pipe"], "--pipe passes on the frames of one variation"),
        (&wild, &[], "): "),
    ] {
        let (code, _, err) = render(scenario, &path("out"), args);
        assert!(code == 2 && err.contains(wanted), "{args:?}: {err}");
        assert!(!path("out").exists(), "{args:?}: nothing is written");
    }
    let (_, _, err) = render(&wild, &path("out"), &[]);
    assert!(err.starts_with("error: variation ") && err.contains("camera.shutter.exposure_ms = -"), "{err}");
    let (code, _, err) = camsim(&["cluster", "local", &six, "-N", "2", "-o", path("job").to_str().unwrap()]);
    assert!(code == 2 && err.contains("renders every N-th variation"), "{err}");
    let (code, _, err) = render(&plain, &path("fixed"), &["--frames", "0"]);
    assert_eq!(code, 0, "{err}");
    let (code, _, err) = render(&six, &path("fixed"), &[]);
    assert!(code == 2 && err.contains("frames of a scenario without [randomize]"), "{err}");
}
