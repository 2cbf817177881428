//! Switching between the cameras of a rig.

use std::path::{Path, PathBuf};

use eframe::egui::{Rect, pos2};
use egui_kittest::kittest::Queryable;
use toml::Value;

use super::harness::{Window, has, pattern, pattern_with, send, shown_request};
use crate::message::Message;

/// Two cameras over the pattern: the second has other optics, and a third of the rate.
fn pair(folder: &Path) -> PathBuf {
    let cameras = "[[cameras]]\nname = \"left\"\nsize_px = [160, 120]\nfocal_px = [100.0, 100.0]\n\
        mount = { angles_deg = [0.0, -90.0, 0.0] }\n\
        [[cameras]]\nname = \"right\"\nsize_px = [120, 120]\nfocal_px = [60.0, 60.0]\nfps = 10.0\nphase = 0.2\n\
        mount = { angles_deg = [0.0, -90.0, 0.0], offset_m = [0.0, 1.0, 0.0] }\n";
    pattern_with(folder, cameras)
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn another_camera_shows_the_same_time() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut window = Window::open(Some(pair(folder.path())));
    window.settle();
    window.state_mut().timeline.seek(30);
    send(&mut window, Message::Pin(Some([150, 10])));
    window.settle();
    let shown = |window: &Window| {
        let request = shown_request(window.state()).expect("a picture");
        let timeline = &window.state().timeline;
        (request.scenario.camera.name.clone(), request.frame, timeline.frames)
    };
    assert_eq!(shown(&window), ("left".to_owned(), 30, 60));
    let picture = window.harness.get_by_label("picture").rect();
    let top = window.harness.get_by_label("shown camera").rect().top() - 3.0;
    let bar = Rect::from_min_max(pos2(picture.left(), top), picture.right_top());
    window.snapshot("cameras", bar);
    window.click("shown camera");
    window.click("right");
    window.settle();
    // 1 s after the begin: 9.8 periods of 0.1 s after the first stamp.
    assert_eq!(shown(&window), ("right".to_owned(), 10, 20));
    assert_eq!(window.state().engine.picture().expect("a picture").frame.size_px, [120, 120]);
    assert_eq!(window.state().pinned, None, "the pixel is of the other camera");
    // Edits go to the shown camera.
    send(&mut window, Message::Set("camera.fps".into(), Some(Value::Float(5.0)), false));
    window.settle();
    let fps: Vec<f64> = window
        .state()
        .document
        .as_ref()
        .expect("open")
        .rig()
        .scenarios()
        .iter()
        .map(|s| s.camera.fps)
        .collect();
    assert_eq!(fps, [30.0, 5.0]);
    send(&mut window, Message::ShowCamera(0));
    window.settle();
    let (name, _, frames) = shown(&window);
    assert_eq!((name.as_str(), frames), ("left", 60));
    window.harness.check_accessibility();
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn one_camera_has_no_choice() {
    let mut window = Window::open(Some(pattern()));
    window.settle();
    assert!(!has(&window, "shown camera"));
}
