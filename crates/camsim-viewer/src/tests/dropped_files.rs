//! Files dropped on the window, by kind. Without an engine, which reports files that cannot be read.

use std::path::{Path, PathBuf};

use camsim_core::scenario::BoardSpec;
use eframe::egui;

use super::harness::demo;
use crate::{
    message::Message,
    settings::Settings,
    state::{State, dropped_files},
};

fn new_state(scenario: Option<PathBuf>) -> State {
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

/// A file of each kind that becomes part of a scenario, with a word that the scenario then contains.
fn part_files(folder: &Path) -> Vec<(PathBuf, &'static str)> {
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
                "sensor_type: camera\ncamera_model: pinhole\nrate_hz: 20\nresolution: [752, 481]\n\
                 intrinsics: [458.654, 457.296, 367.215, 248.375]\n\
                 distortion_model: radial-tangential\n\
                 distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n\
                 T_BS:\n  cols: 4\n  rows: 4\n  data: [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, \
                 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]\n",
            ),
            "481",
        ),
    ]
}

#[test]
fn each_kind_of_file_changes_the_scenario_undoably() {
    let folder = tempfile::tempdir().expect("a folder");
    for (path, word) in part_files(folder.path()) {
        let mut state = new_state(Some(demo()));
        dropped_files::apply_dropped(&mut state, &path);
        let document = state.document.as_ref().expect("open");
        // The calibration gives a notice that its pose is ignored.
        assert!(
            state.notices.iter().all(|notice| word == "481" && notice.contains("T_BS")),
            "{}: {:?}",
            path.display(),
            state.notices
        );
        let text = toml::to_string(&*document.scenario).expect("text");
        assert!(text.contains(word), "{}: {text}", path.display());
        assert!(state.is_unsaved(), "changed: {}", path.display());
        send(&mut state, Message::Undo);
        assert!(
            !toml::to_string(&*state.document.as_ref().expect("open").scenario).expect("text").contains(word),
            "{}",
            path.display()
        );
    }
}

#[test]
fn a_dropped_target_replaces_the_board_but_not_its_pose() {
    let folder = tempfile::tempdir().expect("a folder");
    let target = write(
        folder.path(),
        "target.yaml",
        "target_type: 'checkerboard'\ntargetCols: 6\ntargetRows: 7\n\
         rowSpacingMeters: 0.06\ncolSpacingMeters: 0.07\n",
    );
    for own in [
        "kind = \"chessboard\"\ncolumns = 9\nrows = 6\nsize_m = 2.0\nmargin_m = 1.0",
        "target = \"other.yaml\"\nmargin_m = 1.0",
    ] {
        let mut state = new_state(Some(demo()));
        let pose = "at = [10.0, 20.0, -30.0]\nangles_deg = [0.0, 90.0, 45.0]";
        let board: toml::Value = toml::Value::Table(format!("{own}\n{pose}").parse().expect("toml"));
        send(&mut state, Message::Set("scene.board".into(), Some(board), false));
        let before = state.document.as_ref().expect("open").scenario.clone();
        assert!(before.scene.board.is_some());
        dropped_files::apply_dropped(&mut state, &target);
        assert!(state.notices.is_empty(), "{:?}", state.notices);
        let scenario = state.document.as_ref().expect("open").scenario.clone();
        let board = scenario.scene.board.as_ref().expect("a board");
        let old_board = before.scene.board.as_ref().expect("a board");
        let expected = BoardSpec {
            target: Some(target.clone()),
            at: old_board.at,
            angles_deg: old_board.angles_deg,
            ..BoardSpec::default()
        };
        assert_eq!(board, &expected, "parameters of the old board are gone, its pose stays");
        camsim_io::board_file::read_board(board).expect("Kalibr's board");
        send(&mut state, Message::Undo);
        assert_eq!(state.document.as_ref().expect("open").scenario, before, "in one step");
    }
}

#[test]
fn without_a_scenario_each_file_asks_for_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = write(folder.path(), "picture.png", "x");
    for path in part_files(folder.path()).into_iter().map(|(path, _)| path).chain([picture]) {
        let mut state = new_state(None);
        dropped_files::apply_dropped(&mut state, &path);
        assert!(
            state.notices.len() == 1 && state.notices[0].contains("open a scenario first"),
            "{}: {:?}",
            path.display(),
            state.notices
        );
        assert!(state.document.is_none() && state.dropped_picture.is_none());
    }
    let mut state = new_state(None);
    dropped_files::apply_dropped(&mut state, &demo());
    assert_eq!(state.document.as_ref().expect("open").path, demo());
}

#[test]
fn folders_empty_and_missing_files_are_reported_and_change_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    for (path, _) in part_files(folder.path())
        .into_iter()
        .chain([(write(folder.path(), "p.png", "x"), ""), (write(folder.path(), "s.toml", "x"), "")])
    {
        let mut state = new_state(Some(demo()));
        let before = state.document.as_ref().expect("open").scenario.clone();
        for (step, expected) in ["is empty", "put the file back", "is a folder"].into_iter().enumerate() {
            match step {
                0 => std::fs::write(&path, "").expect("written"),
                1 => std::fs::remove_file(&path).expect("removed"),
                _ => std::fs::create_dir(&path).expect("made"),
            }
            dropped_files::apply_dropped(&mut state, &path);
            let notice = state.notices.last().cloned().unwrap_or_default();
            assert!(
                notice.contains(expected) && notice.contains(&path.display().to_string()),
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
fn a_scenario_is_opened_before_other_files_and_pictures_are_asked_about_one_by_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let demo = camsim_io::builtin::unpack(folder.path()).expect("unpacked");
    let camera = write(folder.path(), "a_camera.toml", "size_px = [321, 240]\nfocal_px = [200.0, 200.0]\n");
    let log = write(folder.path(), "a_log.csv", "t_s\n");
    let mut paths = [log.clone(), camera, demo.clone()];
    paths.sort_by_key(|path| dropped_files::drop_order(path));
    assert_eq!(paths[0], demo);
    let mut state = new_state(None);
    paths.into_iter().for_each(|path| send(&mut state, Message::Drop(path)));
    let scenario = state.document.as_ref().expect("open").scenario.clone();
    assert!(state.notices.is_empty(), "{:?}", state.notices);
    assert_eq!((scenario.camera.size_px, &scenario.flight.log), ([321, 240], &log));
    let [first, second] = ["1.png", "2.png"].map(|name| write(folder.path(), name, "x"));
    dropped_files::apply_dropped(&mut state, &first);
    dropped_files::apply_dropped(&mut state, &second);
    assert_eq!(state.dropped_picture.as_ref(), Some(&first));
    assert!(state.notices.len() == 1 && state.notices[0].contains("2.png"), "{:?}", state.notices);
    send(&mut state, Message::UsePicture(Some("camera.photometric.vignette")));
    assert_eq!(
        state.document.as_ref().expect("open").scenario.camera.photometric.vignette.as_ref(),
        Some(&first)
    );
    for (_, key) in dropped_files::PICTURE_USES {
        let mut state = new_state(Some(demo.clone()));
        dropped_files::apply_dropped(&mut state, &second);
        send(&mut state, Message::UsePicture(Some(key)));
        let text = toml::to_string(&*state.document.as_ref().expect("open").scenario).expect("text");
        assert!(text.contains("2.png") || !state.notices.is_empty(), "{key}: {:?}", state.notices);
    }
}

#[test]
fn a_calibration_keeps_shutter_and_noise_of_the_scenario() {
    let folder = tempfile::tempdir().expect("a folder");
    let (calibration, _) = part_files(folder.path())
        .into_iter()
        .find(|(path, _)| path.ends_with("sensor.yaml"))
        .expect("one of them");
    let mut state = new_state(Some(demo()));
    let before = state.document.as_ref().expect("open").scenario.camera.clone();
    assert!(
        before.shutter.readout_ms > 0.0
            && before.photometric.noise_sigma > 0.0
            && before.photometric.vignette.is_some()
    );
    dropped_files::apply_dropped(&mut state, &calibration);
    let after = state.document.as_ref().expect("open").scenario.camera.clone();
    assert_eq!((after.size_px, after.focal_px), ([752, 481], [458.654, 457.296]));
    assert_eq!((&after.shutter, after.fps, &after.mount), (&before.shutter, before.fps, &before.mount));
    assert_eq!(after.photometric.noise_sigma, before.photometric.noise_sigma);
    assert_eq!(after.photometric.vignette, None, "the vignette of the old lens");
    // A camera file of camsim has all keys.
    let (own, _) = part_files(folder.path())
        .into_iter()
        .find(|(path, _)| path.ends_with("lens.toml"))
        .expect("one of them");
    dropped_files::apply_dropped(&mut state, &own);
    assert_eq!(
        state.document.as_ref().expect("open").scenario.camera.shutter,
        camsim_core::scenario::ShutterSpec::default()
    );
}
