//! `camsim study`: what it runs, keeps and writes.

#![cfg(unix)]
#![allow(clippy::unwrap_used)]

use std::{
    fs,
    path::{Path, PathBuf},
};

fn camsim(args: &[&str]) -> (u8, String, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = ["camsim", "-q"].iter().chain(args).map(Into::into);
    let code = camsim_cli::run(args, &mut out, &mut err);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
}

/// A study of small frames of the demo, whose command is `script`: `$0` is the data's folder, `$1` the result.
fn study(folder: &Path, script: &str, rest: &str) -> PathBuf {
    let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/demo.toml");
    let path = folder.join("sweep.toml");
    let text = format!(
        "scenario = {:?}\nframes = \"0..2\"\ncommand = [\"sh\", \"-c\", '''{script}''', \"{{data}}\", \"{{result}}\"]\n\
         set = {{ \"camera.resized.scale\" = 0.05 }}\n{rest}",
        demo
    );
    fs::write(&path, text).unwrap();
    path
}

fn run(study: &Path, output: &Path, more: &[&str]) -> (u8, String, String) {
    let paths = [study, output].map(|path| path.to_str().unwrap().to_owned());
    camsim(&[&["study", &paths[0], "-o", &paths[1], "--backend", "cpu"][..], more].concat())
}

/// Leaves the readout time and the number of pictures, and counts its calls in the study's folder.
const READOUT: &str = r#"
echo call >> calls
readout=$(sed -n 's/^readout_ms = //p' "$0/camera.toml")
pictures=$(ls "$0"/color/*.png | wc -l)
echo "{\"readout\": $readout, \"frames\": {\"count\": $pictures}}" > "$1"
"#;
const VARY: &str = "seeds = [1, 2]\n[[vary]]\nkey = \"camera.shutter.readout_ms\"\nvalues = [0, 10.5, 20]\n";

fn calls(folder: &Path) -> usize {
    fs::read_to_string(folder.join("calls")).unwrap_or_default().lines().count()
}

#[test]
fn every_point_is_run_once_and_new_values_are_added() {
    let folder = tempfile::tempdir().unwrap();
    let (sweep, output) = (study(folder.path(), READOUT, VARY), folder.path().join("out"));
    let (code, out, err) = run(&sweep, &output, &["--dry-run"]);
    assert_eq!((code, calls(folder.path()), err.as_str()), (0, 0, ""));
    assert_eq!(
        out.lines().filter(|line| line.starts_with("camera.shutter.readout_ms = ")).count(),
        6,
        "{out}"
    );

    let (code, out, err) = run(&sweep, &output, &[]);
    assert_eq!((code, calls(folder.path())), (0, 6), "{err}");
    assert!(out.contains("| 10.5 | 2 (2 .. 2) | 10.50 (10.50 .. 10.50) |"), "{out}");
    let table = fs::read_to_string(output.join("study.csv")).unwrap();
    let mut lines = table.lines();
    assert_eq!(lines.next().unwrap(), "camera.shutter.readout_ms,seed,frames.count,readout,folder,problem");
    assert!(lines.next().unwrap().starts_with("0,1,2,0,readout_ms=0_seed=1_"), "{table}");
    let plot = fs::read_to_string(output.join("plots/readout-over-camera.shutter.readout_ms.svg")).unwrap();
    assert!(plot.contains("mean and range of 2 seeds"));

    let more = VARY.replace("20]", "20, 30]");
    let sweep = study(folder.path(), READOUT, &more);
    let (code, _, err) = run(&sweep, &output, &[]);
    assert_eq!((code, calls(folder.path())), (0, 8), "{err}");
    let longer = fs::read_to_string(output.join("study.csv")).unwrap();
    assert!(longer.starts_with(&table) && longer.lines().count() == 9, "{longer}");

    // Another command has other results, of the same frames.
    let sweep = study(folder.path(), &format!("{READOUT} # other"), &more);
    assert_eq!((run(&sweep, &output, &[]).0, calls(folder.path())), (0, 16));
}

#[test]
fn points_whose_frames_keys_scenario_or_script_change_are_run_anew() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out");
    let vary = "[[vary]]\nkey = \"camera.shutter.readout_ms\"\nvalues = [5]\n";
    let own = folder.path().join("own.toml");
    let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets");
    let text = fs::read_to_string(demo.join("demo.toml")).unwrap();
    let absolute = |text: &str| {
        ["demo_camera.toml", "demo_flight.csv", "demo_dem.tif", "demo_ortho.jpg"]
            .iter()
            .fold(text.to_owned(), |text, name| text.replace(name, demo.join(name).to_str().unwrap()))
    };
    fs::write(&own, absolute(&text)).unwrap();
    let sweep = study(folder.path(), READOUT, vary);
    let of_own = |from: &str, to: &str| {
        let text = fs::read_to_string(&sweep).unwrap();
        let first = text.lines().next().unwrap();
        let text = text.replace(first, &format!("scenario = {own:?}"));
        fs::write(&sweep, text.replace(from, to)).unwrap();
        let (code, out, err) = run(&sweep, &output, &[]);
        assert_eq!(code, 0, "{out}{err}");
        out
    };
    assert!(of_own("", "").contains("| 5 | 2 |"));
    // Fewer frames: those of before are not handed over.
    assert!(of_own("0..2", "0..1").contains("| 5 | 1 |"));
    assert_eq!(calls(folder.path()), 2);
    of_own("\"camera.resized.scale\" = 0.05", "\"camera.resized.scale\" = 0.06");
    assert_eq!(calls(folder.path()), 3);
    fs::write(&own, absolute(&text.replace("20000.0", "500.0"))).unwrap();
    of_own("", "");
    assert_eq!(calls(folder.path()), 4);
    of_own("", "");
    assert_eq!(calls(folder.path()), 4);
}

#[test]
fn shards_make_the_table_of_one_run() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = study(folder.path(), READOUT, VARY);
    let [whole, parts] = ["whole", "parts"].map(|name| folder.path().join(name));
    assert_eq!(run(&sweep, &whole, &[]).0, 0);
    for shard in ["2/2", "1/2"] {
        assert_eq!(run(&sweep, &parts, &["--shard", shard]).0, 0);
        assert!(!parts.join("study.csv").exists());
    }
    assert_eq!((run(&sweep, &parts, &[]).0, calls(folder.path())), (0, 12));
    for file in ["study.csv", "study.md"] {
        assert_eq!(fs::read(whole.join(file)).unwrap(), fs::read(parts.join(file)).unwrap(), "{file}");
    }
}

#[test]
fn a_command_that_fails_hangs_or_writes_nonsense_is_told_and_the_rest_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let script = r#"
case $(sed -n 's/^readout_ms = //p' "$0/camera.toml") in
1.0) echo lost the horizon; exit 3 ;;
2.0) sleep 60 & echo $! > sleeper; wait ;;
3.0) echo "not numbers" > "$1" ;;
4.0) ;;
*) printf 'error\n1.5\n' > "$1" ;;
esac
"#;
    let rest = "timeout_s = 2.0\nkeep_frames = false\n[[point]]\n\"camera.shutter.readout_ms\" = 1\n\
                [[point]]\n\"camera.shutter.readout_ms\" = 2\n[[point]]\n\"camera.shutter.readout_ms\" = 3\n\
                [[point]]\n\"camera.shutter.readout_ms\" = 4\n[[point]]\n\"camera.shutter.readout_ms\" = 5\n\
                [[point]]\n\"flight.window_s\" = [900.0, 901.0]\n";
    let (sweep, output) = (study(folder.path(), script, rest), folder.path().join("out"));
    let (code, out, err) = run(&sweep, &output, &[]);
    assert!(code == 1 && err.contains("5 of 6 points failed"), "{err}");
    assert!(out.contains("| 5 |  | 1.500 |"), "{out}");
    let table = fs::read_to_string(output.join("study.csv")).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    for (line, wanted) in [
        (1, "exit status: 3; its last line: lost the horizon"),
        (2, "longer than timeout_s = 2"),
        (3, "nor a CSV table"),
        (4, "result"),
        (6, "flight.window_s: none of the"),
    ] {
        assert!(lines[line].contains(wanted), "{}", lines[line]);
    }
    // What a command has started ends with it.
    let sleeper = fs::read_to_string(folder.path().join("sleeper")).unwrap();
    let words = fs::read(format!("/proc/{}/cmdline", sleeper.trim())).unwrap_or_default();
    assert!(words.is_empty(), "{}", String::from_utf8_lossy(&words));
    // The frames of the point that is done are removed, those of the others are there to look at.
    let data = |readout: u32| {
        let points = fs::read_dir(output.join("points")).unwrap().map(|entry| entry.unwrap().path());
        let name = format!("readout_ms={readout}_");
        let mut points = points.filter(|path| path.file_name().unwrap().to_str().unwrap().starts_with(&name));
        points.next().unwrap().join("data")
    };
    assert!(!data(5).exists() && data(1).exists());
}

#[test]
fn a_wrong_study_is_refused_before_anything_is_rendered() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out");
    for (rest, wanted) in [
        ("", "[[vary]]"),
        ("[[vary]]\nkey = \"camera.nonsense\"\nvalues = [1]\n", "camera.nonsense = 1"),
        ("[[vary]]\nkey = \"camera.fps\"\nvalues = [10, -1]\n", "camera.fps = -1"),
        ("[[vary]]\nkey = \"camera.fps\"\nvalues = []\n", "no values"),
        ("[[vary]]\nkey = \"camera.lens.model\"\nvalues = [\"eucm\"]\n", "[[point]] instead of [[vary]]"),
        ("export = \"eurok\"\n[[vary]]\nkey = \"camera.fps\"\nvalues = [10]\n", "is not a layout"),
        (
            "[[vary]]\nkey = \"camera.fps\"\nvalues = [10]\n[[vary]]\nkey = \"camera.fps\"\nvalues = [20]\n",
            "two [[vary]] tables are of camera.fps",
        ),
        ("[[vary]]\nkey = \"camera.fps\"\nvalues = [10, 10]\n", "two points are the same"),
        ("[[vary]]\nkey = \"camera.fps\"\nvalue = [1]\n", "unknown field"),
        ("algorithm = \"tracking\"\n[[vary]]\nkey = \"camera.fps\"\nvalues = [1]\n", "remove one"),
        (
            "[[vary]]\nkey = \"camera.fps\"\nvalues = [1]\n[[plot]]\nx = \"camera.size\"\ny = \"e\"\n",
            "camera.size, which does not vary",
        ),
    ] {
        let sweep = study(folder.path(), READOUT, rest);
        let (code, _, err) = run(&sweep, &output, &[]);
        assert!(code == 2 && err.contains(wanted), "{rest}: {err}");
        assert!(!output.exists(), "{rest}");
    }
    let sweep = study(folder.path(), "true", VARY);
    let text = fs::read_to_string(&sweep).unwrap().replace(", \"{result}\"", "");
    fs::write(&sweep, text).unwrap();
    assert!(run(&sweep, &output, &[]).2.contains("does not name {result}"));
    let random = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tutorial/random.toml");
    let sweep = study(folder.path(), READOUT, VARY);
    let text = fs::read_to_string(&sweep).unwrap();
    let first = text.lines().next().unwrap();
    fs::write(&sweep, text.replace(first, &format!("scenario = {random:?}"))).unwrap();
    let (code, _, err) = run(&sweep, &output, &[]);
    assert!(code == 2 && err.contains("has [randomize]"), "{err}");
    let sweep = study(folder.path(), "true", VARY);
    let text = fs::read_to_string(&sweep).unwrap().replace("[\"sh\"", "[\"no-such-program\"");
    fs::write(&sweep, text).unwrap();
    assert!(run(&sweep, &output, &[]).2.contains("no program `no-such-program`"));
}

#[test]
fn an_algorithm_without_its_packages_says_what_installs_them() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = study(folder.path(), "", VARY);
    let text = fs::read_to_string(&sweep).unwrap();
    let command = text.lines().find(|line| line.starts_with("command")).unwrap();
    fs::write(&sweep, text.replace(command, "algorithm = \"tracking\"")).unwrap();
    let output = folder.path().join("out");
    let (code, _, err) = run(&sweep, &output, &["--python", "no-such-python"]);
    assert!(code == 2 && err.contains("pip install opencv-python-headless"), "{err}");
    assert!(!output.join("points").exists());
    let (code, out, _) = camsim(&["study", "--algorithms"]);
    assert!(
        code == 0
            && ["tracking", "flow", "pnp", "calibration", "mapping"].iter().all(|name| out.contains(name))
    );
}
