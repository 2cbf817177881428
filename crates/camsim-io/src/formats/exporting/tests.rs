//! Exports of a small run, read back by readers of their own.

#![allow(clippy::unwrap_used, reason = "tests")]

mod bags;
mod estimators;
mod folders;
mod learning;
mod models;
mod sample;

use std::{fs, path::Path};

use camsim_core::scenario::{Channel, DatasetFormat, Scenario};

use super::*;
use crate::{scenario_file::parse_scenario, write::VARIATIONS_CSV};
use sample::Sample;

/// Exports all frames without a stop.
fn exported(sample: &Sample, format: DatasetFormat) -> Result<ExportReport, DatasetError> {
    export_of(&RunFolder::open(&sample.run())?, sample, format, &ExportOptions::default())
}

/// Exports a run, or some of its cameras, without a stop.
fn export_of(
    run: &RunFolder,
    sample: &Sample,
    format: DatasetFormat,
    options: &ExportOptions,
) -> Result<ExportReport, DatasetError> {
    let watch = Watch { advance: &|| (), is_stopped: &|| false };
    export(run, format, &sample.out(), options, &watch)
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Names of all files below a folder.
fn names(folder: &Path) -> Vec<String> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        if path.is_dir() {
            all.extend(names(&path).into_iter().map(|below| format!("{name}/{below}")));
        } else {
            all.push(name);
        }
    }
    all.sort();
    all
}

fn scenario(keys: &str) -> Scenario {
    let text = format!("[flight]\nlog = \"a.csv\"\n[scene.pattern]\nimage = \"g.png\"\nwidth_m = 10\n{keys}");
    parse_scenario(&text, Path::new("s.toml"), &[]).unwrap()
}

#[test]
fn a_scenario_gets_what_a_layout_needs_and_no_more() {
    let lens =
        "[camera.lens]\nmodel = \"brown-conrady\"\ncoefficients = [-0.1]\n[camera.shutter]\ndelay_ms = 3.0\n";
    let mut kitti = scenario(lens);
    let added = require(&mut kitti, DatasetFormat::Kitti).unwrap();
    let twin = &kitti.output.twin[0];
    assert_eq!((twin.name.as_str(), twin.lens), ("pinhole", Some(false)));
    let truth = [Channel::Color, Channel::Rows, Channel::Depth, Channel::Flow];
    assert_eq!(twin.channels.as_deref(), Some(&truth[..]));
    assert_eq!(added, ["twin pinhole", "channel rows", "format png"]);
    assert!(require(&mut kitti, DatasetFormat::Kitti).unwrap().is_empty(), "it has all of it");
    assert_eq!(camsim_core::validate::validate(&kitti), []);

    let mut pinhole = scenario("");
    require(&mut pinhole, DatasetFormat::Kitti).unwrap();
    assert!(pinhole.output.twin.is_empty() && pinhole.output.channels.contains(&Channel::Flow));

    let mut own = scenario("[[output.twin]]\nname = \"clear\"\nexposure = false\nchannels = [\"depth\"]\n");
    require(&mut own, DatasetFormat::Gopro).unwrap();
    let channels = own.output.twin[0].channels.clone().unwrap();
    assert_eq!((own.output.twin.len(), channels), (1, vec![Channel::Depth, Channel::Color]));

    let mut other = scenario("[[output.twin]]\nname = \"sharp\"\nnoise = false\n");
    let text = require(&mut other, DatasetFormat::Gopro).unwrap_err().to_string();
    assert!(text.contains("\"sharp\"") && text.contains("rename"), "{text}");

    let mut board = scenario("");
    assert!(!require(&mut board, DatasetFormat::Colmap).unwrap().contains(&"tracks".to_owned()));
    board.scene.board = parse_scenario(
        "[flight]\nlog = \"a.csv\"\n[scene.board]\nkind = \"chessboard\"\ncolumns = 5\nrows = 4\nsize_m = 0.1\n",
        Path::new("s.toml"),
        &[],
    )
    .unwrap()
    .scene
    .board;
    assert!(require(&mut board, DatasetFormat::Colmap).unwrap().contains(&"tracks".to_owned()));
}

#[test]
fn what_is_missing_is_one_error_with_its_key() {
    for (format, keys) in [
        (DatasetFormat::Tum, ["\"depth\" to output.channels"].as_slice()),
        (DatasetFormat::Flo, &["\"flow\" to output.channels"]),
        (DatasetFormat::Gopro, &["[[output.twin]]", "exposure = false"]),
        (DatasetFormat::CarlaRs, &["camera.shutter.readout_ms"]),
    ] {
        let sample = Sample::new("");
        sample.write(&["color_png"]);
        let text = exported(&sample, format).unwrap_err().to_string();
        assert!(keys.iter().all(|key| text.contains(key)), "{format:?}: {text}");
    }
    let sample = Sample::new("");
    sample.write(&["depth"]);
    let text = exported(&sample, DatasetFormat::Euroc).unwrap_err().to_string();
    assert!(text.contains("\"png\" to output.format") && text.contains("frame 4 is the first"), "{text}");
    let text = RunFolder::open(&sample.out()).unwrap_err().to_string();
    assert!(text.contains("run.json") && text.contains("camsim render"), "{text}");
    fs::create_dir_all(sample.out()).unwrap();
    fs::write(sample.out().join(VARIATIONS_CSV), "").unwrap();
    let text = RunFolder::open(&sample.out()).unwrap_err().to_string();
    assert!(text.contains("has variations"), "{text}");
}

#[test]
fn an_export_is_completed_and_never_mixed() {
    let sample = Sample::new("");
    sample.write(&["color_png"]);
    let run = RunFolder::open(&sample.run()).unwrap();
    let done = std::sync::atomic::AtomicU64::new(0);
    let count = || {
        done.fetch_add(1, std::sync::atomic::Ordering::SeqCst);
    };
    let stopped = Watch { advance: &count, is_stopped: &|| true };
    let options = ExportOptions::default();
    let first = export(&run, DatasetFormat::Euroc, &sample.out(), &options, &stopped);
    assert!(matches!(first, Err(DatasetError::Stopped)));
    assert!(!sample.out().join("mav0/cam0/data.csv").exists());
    // What a killed export leaves.
    fs::write(sample.out().join("mav0/cam0/.data.csv.12-3.tmp"), "half").unwrap();
    assert!(!exported(&sample, DatasetFormat::Euroc).unwrap().was_complete);
    assert!(names(&sample.out()).iter().all(|name| !name.ends_with(".tmp")), "{:?}", names(&sample.out()));
    assert!(exported(&sample, DatasetFormat::Euroc).unwrap().was_complete);
    assert!(sample.out().join("mav0/cam0/data/0000000001000000000.png").is_file());

    let text = exported(&sample, DatasetFormat::Kalibr).unwrap_err().to_string();
    assert!(text.contains("another run, layout") && text.contains("-o"), "{text}");
    let other = Sample::new("seed = 9\n");
    other.write(&["color_png"]);
    let run = RunFolder::open(&other.run()).unwrap();
    let watch = Watch { advance: &|| (), is_stopped: &|| false };
    let refused = export(&run, DatasetFormat::Euroc, &sample.out(), &options, &watch);
    assert!(matches!(refused, Err(DatasetError::Refused(_))));
    let replace = ExportOptions { replace: true, ..options };
    assert!(!export(&run, DatasetFormat::Euroc, &sample.out(), &replace, &watch).unwrap().was_complete);
}

#[test]
fn every_page_says_where_the_first_pixel_is() {
    let layouts = [
        (DatasetFormat::Euroc, "(0, 0) is the centre of the first pixel"),
        (DatasetFormat::Kalibr, "(0, 0) is the centre of the first pixel"),
        (DatasetFormat::Mcap, "(0, 0) is the centre of the first pixel"),
        (DatasetFormat::Webdataset, "(0, 0) is the centre of the first pixel"),
        (DatasetFormat::Colmap, "(0.5, 0.5) is the centre of the first pixel"),
        (DatasetFormat::Nerfstudio, "(0.5, 0.5) is the centre of the first pixel"),
    ];
    for (format, pixel) in layouts {
        let sample = Sample::new("");
        sample.write(&["color_png"]);
        exported(&sample, format).unwrap();
        let page = text(&sample.out().join("README.md"));
        assert!(page.contains(pixel) && page.contains("global shutter"), "{format:?}: {page}");
    }
}
