//! What becomes of each kind of file that is dropped. Without an engine: whether a file can be read is told
//! by whoever loads it.

use std::path::{Path, PathBuf};

use camsim_core::scenario::BoardSpec;
use eframe::egui;

use super::harness::demo;
use crate::{drop, message::Message, settings::Settings, state::State};

fn state(scenario: Option<PathBuf>) -> State {
    let mut state = State::new(Settings::default(), None);
    if let Some(path) = scenario {
        state.open(path);
        assert!(state.document.is_some(), "{:?}", state.notices);
    }
    state
}

fn send(state: &mut State, message: Message) {
    state.apply(message, &egui::Context::default());
}

fn write(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("written");
    path
}

/// A file of each kind that becomes part of a scenario, and a word that the scenario then has in it.
fn parts(folder: &Path) -> Vec<(PathBuf, &'static str)> {
    vec![
        (write(folder, "town.glb", "glTF"), "town.glb"),
        (write(folder, "TREE.GLTF", "{}"), "TREE.GLTF"),
        (write(folder, "target.yaml", "target_type: 'checkerboard'\n"), "target.yaml"),
        (write(folder, "mylog.csv", "t_s\n"), "mylog.csv"),
        (write(folder, "mylog.tum", "0\n"), "mylog.tum"),
        (write(folder, "heights.tif", "II"), "heights.tif"),
        (write(folder, "lens.toml", "size_px = [321, 240]\nfocal_px = [200.0, 200.0]\n"), "321"),
        (
            write(
                folder,
                "sensor.yaml",
                "sensor_type: camera\ncamera_model: pinhole\nrate_hz: 20\nresolution: [752, 481]\nintrinsics: [458.654, 457.296, 367.215, 248.375]\n\
                 distortion_model: radial-tangential\ndistortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n\
                 T_BS:\n  cols: 4\n  rows: 4\n  data: [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]\n",
            ),
            "481",
        ),
    ]
}

#[test]
fn each_kind_of_file_becomes_what_it_is() {
    let folder = tempfile::tempdir().expect("a folder");
    for (path, word) in parts(folder.path()) {
        let mut state = state(Some(demo()));
        drop::take(&mut state, &path);
        let document = state.document.as_ref().expect("open");
        // Of the calibration, that its pose is not taken.
        assert!(
            state.notices.iter().all(|notice| word == "481" && notice.contains("T_BS")),
            "{}: {:?}",
            path.display(),
            state.notices
        );
        let text = toml::to_string(&*document.scenario).expect("text");
        assert!(text.contains(word), "{}: {text}", path.display());
        assert!(state.is_unsaved(), "and it can be undone: {}", path.display());
        send(&mut state, Message::Undo);
        assert!(
            !toml::to_string(&*state.document.as_ref().expect("open").scenario).expect("text").contains(word),
            "{}",
            path.display()
        );
    }
}

#[test]
fn a_target_takes_the_place_of_a_board_that_has_parameters_of_its_own() {
    let folder = tempfile::tempdir().expect("a folder");
    let target = write(
        folder.path(),
        "target.yaml",
        "target_type: 'checkerboard'\ntargetCols: 6\ntargetRows: 7\nrowSpacingMeters: 0.06\ncolSpacingMeters: 0.07\n",
    );
    for own in [
        "kind = \"chessboard\"\ncolumns = 9\nrows = 6\nsize_m = 2.0\nmargin_m = 1.0",
        "target = \"other.yaml\"\nmargin_m = 1.0",
    ] {
        let mut state = state(Some(demo()));
        let place = "at = [10.0, 20.0, -30.0]\nangles_deg = [0.0, 90.0, 45.0]";
        let board: toml::Value = toml::Value::Table(format!("{own}\n{place}").parse().expect("toml"));
        send(&mut state, Message::Set("scene.board".into(), Some(board), false));
        let before = state.document.as_ref().expect("open").scenario.clone();
        assert!(before.scene.board.is_some());
        drop::take(&mut state, &target);
        assert!(state.notices.is_empty(), "{:?}", state.notices);
        let scenario = state.document.as_ref().expect("open").scenario.clone();
        let board = scenario.scene.board.as_ref().expect("a board");
        let there = before.scene.board.as_ref().expect("a board");
        let expected = BoardSpec {
            target: Some(target.clone()),
            at: there.at,
            angles_deg: there.angles_deg,
            ..BoardSpec::default()
        };
        assert_eq!(board, &expected, "what was on the other board is gone, its place stays");
        camsim_io::board_file::read_board(board).expect("Kalibr's board");
        send(&mut state, Message::Undo);
        assert_eq!(state.document.as_ref().expect("open").scenario, before, "in one step");
    }
}

#[test]
fn without_a_scenario_each_says_what_it_needs() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = write(folder.path(), "picture.png", "x");
    for path in parts(folder.path()).into_iter().map(|(path, _)| path).chain([picture]) {
        let mut state = state(None);
        drop::take(&mut state, &path);
        assert!(
            state.notices.len() == 1 && state.notices[0].contains("open a scenario first"),
            "{}: {:?}",
            path.display(),
            state.notices
        );
        assert!(state.document.is_none() && state.dropped_picture.is_none());
    }
    let mut state = state(None);
    drop::take(&mut state, &demo());
    assert_eq!(state.document.as_ref().expect("open").path, demo());
}

#[test]
fn folders_empty_files_and_those_that_are_gone_are_told_and_change_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    for (path, _) in parts(folder.path())
        .into_iter()
        .chain([(write(folder.path(), "p.png", "x"), ""), (write(folder.path(), "s.toml", "x"), "")])
    {
        let mut state = state(Some(demo()));
        let before = state.document.as_ref().expect("open").scenario.clone();
        for (step, told) in ["is empty", "put the file back", "is a folder"].into_iter().enumerate() {
            match step {
                0 => std::fs::write(&path, "").expect("written"),
                1 => std::fs::remove_file(&path).expect("removed"),
                _ => std::fs::create_dir(&path).expect("made"),
            }
            drop::take(&mut state, &path);
            let notice = state.notices.last().cloned().unwrap_or_default();
            assert!(
                notice.contains(told) && notice.contains(&path.display().to_string()),
                "{}: {notice}",
                path.display()
            );
            assert!(
                state.document.as_ref().expect("open").scenario == before && state.dropped_picture.is_none()
            );
        }
    }
}

#[test]
fn of_files_dropped_together_the_scenario_comes_first_and_pictures_wait_for_each_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let demo = camsim_io::builtin::unpack(folder.path()).expect("unpacked");
    let camera = write(folder.path(), "a_camera.toml", "size_px = [321, 240]\nfocal_px = [200.0, 200.0]\n");
    let log = write(folder.path(), "a_log.csv", "t_s\n");
    let mut paths = [log.clone(), camera, demo.clone()];
    paths.sort_by_key(|path| drop::rank(path));
    assert_eq!(paths[0], demo);
    let mut state = state(None);
    paths.into_iter().for_each(|path| send(&mut state, Message::Drop(path)));
    let scenario = state.document.as_ref().expect("open").scenario.clone();
    assert!(state.notices.is_empty(), "{:?}", state.notices);
    assert_eq!((scenario.camera.size_px, &scenario.flight.log), ([321, 240], &log));
    let [first, second] = ["1.png", "2.png"].map(|name| write(folder.path(), name, "x"));
    drop::take(&mut state, &first);
    drop::take(&mut state, &second);
    assert_eq!(state.dropped_picture.as_ref(), Some(&first));
    assert!(state.notices.len() == 1 && state.notices[0].contains("2.png"), "{:?}", state.notices);
    send(&mut state, Message::UsePicture(Some("camera.photometric.vignette")));
    assert_eq!(
        state.document.as_ref().expect("open").scenario.camera.photometric.vignette.as_ref(),
        Some(&first)
    );
    for (_, key) in drop::PICTURE_USES {
        let mut state = self::state(Some(demo.clone()));
        drop::take(&mut state, &second);
        send(&mut state, Message::UsePicture(Some(key)));
        let text = toml::to_string(&*state.document.as_ref().expect("open").scenario).expect("text");
        assert!(text.contains("2.png") || !state.notices.is_empty(), "{key}: {:?}", state.notices);
    }
}

#[test]
fn a_calibration_keeps_what_it_does_not_tell() {
    let folder = tempfile::tempdir().expect("a folder");
    let (calibration, _) = parts(folder.path())
        .into_iter()
        .find(|(path, _)| path.ends_with("sensor.yaml"))
        .expect("one of them");
    let mut state = state(Some(demo()));
    let before = state.document.as_ref().expect("open").scenario.camera.clone();
    assert!(
        before.shutter.readout_ms > 0.0
            && before.photometric.noise_sigma > 0.0
            && before.photometric.vignette.is_some()
    );
    drop::take(&mut state, &calibration);
    let after = state.document.as_ref().expect("open").scenario.camera.clone();
    assert_eq!((after.size_px, after.focal_px), ([752, 481], [458.654, 457.296]));
    assert_eq!((&after.shutter, after.fps, &after.mount), (&before.shutter, before.fps, &before.mount));
    assert_eq!(after.photometric.noise_sigma, before.photometric.noise_sigma);
    assert_eq!(after.photometric.vignette, None, "that was the other lens's");
    // A camera file of camsim's own tells all of it.
    let (own, _) =
        parts(folder.path()).into_iter().find(|(path, _)| path.ends_with("lens.toml")).expect("one of them");
    drop::take(&mut state, &own);
    assert_eq!(
        state.document.as_ref().expect("open").scenario.camera.shutter,
        camsim_core::scenario::ShutterSpec::default()
    );
}
