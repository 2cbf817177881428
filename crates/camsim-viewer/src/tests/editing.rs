//! Editing of parameters, undo and redo, saving.

use std::path::PathBuf;

use eframe::egui::{self, Key, Modifiers};
use egui_kittest::kittest::Queryable;
use toml::Value;

use super::harness::{Window, demo, has, send, shown_request};
use crate::{engine::Size, message::Message};

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn an_edit_renders_a_new_frame_and_undo_restores_the_old_one() {
    let mut window = Window::open(Some(demo()));
    window.settle();
    let before = window.state().engine.picture().expect("a picture").frame.color_rgba().to_vec();
    let key = "camera.shutter.exposure_ms";
    window.harness.get_by_label(key).set_value_accesskit(30.0);
    window.step();
    window.step();
    assert_eq!(window.state().document.as_ref().expect("open").scenario.camera.shutter.exposure_ms, 30.0);
    assert!(has(&window, &format!("reset {key}")), "a changed key can be reset");
    window.wait("a preview", |state| {
        shown_request(state).is_some_and(|request| request.scenario.camera.shutter.exposure_ms == 30.0)
    });
    window.settle();
    let after = window.state().engine.picture().expect("a picture");
    assert_ne!(after.frame.color_rgba(), before);
    assert!(after.plan.motion.blur_px > 2.0, "{}", after.plan.motion.blur_px);
    window.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.step();
    window.settle();
    assert_eq!(
        window.state().engine.picture().expect("a picture").frame.color_rgba(),
        before,
        "undone to the last bit"
    );
    window.click("Redo");
    assert_eq!(window.state().document.as_ref().expect("open").scenario.camera.shutter.exposure_ms, 30.0);
    window.click(&format!("reset {key}"));
    assert_eq!(window.state().document.as_ref().expect("open").scenario.camera.shutter.exposure_ms, 8.0);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn an_illegal_value_is_reported_at_its_key_and_the_picture_stays() {
    let mut window = Window::open(Some(demo()));
    window.settle();
    send(&mut window, Message::Set("camera.shutter.exposure_ms".into(), Some(Value::Float(-1.0)), false));
    window.step();
    window.settle();
    let problem = window.state().document.as_ref().expect("open").problems[0].message.clone();
    assert!(window.harness.query_all_by_label(&problem).next().is_some(), "{problem}");
    assert!(shown_request(window.state()).is_some_and(|request| request.scenario.camera.shutter.exposure_ms
        == 8.0
        && request.size == Size::Full));
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_saved_scenario_opens_unchanged() {
    let folder = tempfile::tempdir().expect("a folder");
    let demo = camsim_io::builtin::unpack(folder.path()).expect("unpacked");
    let mut window = Window::open(Some(demo));
    window.settle();
    send(
        &mut window,
        Message::Set("camera.lens.coefficients".into(), Some(Value::Array(vec![Value::Float(0.1)])), false),
    );
    let saved = folder.path().join("mine.toml");
    window.click("Save");
    window.harness.get_by_label("path").set_text_value_accesskit(&saved.display().to_string());
    window.step();
    window.click("Save here");
    assert!(saved.is_file(), "{:?}", window.state().notices);
    // The confirmation disappears by itself.
    let confirmation = format!("saved {}", saved.display());
    assert!(has(&window, &confirmation) && window.state().notices.is_empty());
    for _ in 0..400 {
        window.step();
    }
    assert!(!has(&window, &confirmation));
    let scenario = window.state().document.as_ref().expect("open").scenario.clone();
    send(&mut window, Message::Open(saved.clone()));
    assert_eq!(window.state().document.as_ref().expect("open").scenario, scenario);
    window.settle();
    assert_eq!(window.state().recent[0], saved);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn dropped_files_are_used_and_bad_ones_reported() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        let path: PathBuf = folder.path().join(name);
        std::fs::write(&path, text).expect("written");
        path
    };
    let mut window = Window::open(Some(demo()));
    window.settle();
    let before = window.state().document.as_ref().expect("open").scenario.clone();
    // Bad files are reported, and the open scenario stays.
    for (name, text, expected) in [
        ("bad.toml", "[flight]\nlgo = \"x\"\n[scene]\n", "bad.toml:2"),
        ("bad.yaml", "nonsense: [", "bad.yaml"),
        ("picture.xyz", "x", "picture.xyz"),
    ] {
        let path = write(name, text);
        send(&mut window, Message::Drop(path));
        let notice = window.state().notices.last().cloned().unwrap_or_default();
        assert!(notice.contains(expected), "{name}: {notice}");
        assert_eq!(window.state().document.as_ref().expect("open").scenario, before, "{name}");
    }
    window.step();
    let dismiss = format!("dismiss: {}", window.state().notices[0]);
    let count = window.state().notices.len();
    window.click(&dismiss);
    assert_eq!(window.state().notices.len(), count - 1);
    // A camera file of camsim; then a file that is no log: the engine reports it, and undo renders again.
    let camera = write("camera.toml", "size_px = [320, 240]\nfocal_px = [200.0, 200.0]\n");
    send(&mut window, Message::Drop(camera));
    assert_eq!(
        window.state().document.as_ref().expect("open").scenario.camera.size_px,
        [320, 240],
        "{:?}",
        window.state().notices
    );
    let log = write("none.csv", "this is,no log\n");
    send(&mut window, Message::Drop(log));
    window.wait("the fault", |state| {
        state.engine.fault.as_deref().is_some_and(|fault| fault.contains("none.csv"))
    });
    send(&mut window, Message::Undo);
    window.settle();
    assert!(window.state().engine.fault.is_none());
    // A dropped picture opens a prompt for its use.
    let vignette = demo().with_file_name("vignette.png");
    send(&mut window, Message::Drop(vignette));
    // egui measures a window before it shows it.
    (0..3).for_each(|_| window.step());
    window.click("vignette map");
    assert!(window.state().dropped_picture.is_none());
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn scenario_and_command_line_are_copied_to_the_clipboard() {
    let mut window = Window::open(Some(demo()));
    window.settle();
    send(&mut window, Message::Set("camera.shutter.readout_ms".into(), Some(Value::Float(0.0)), false));
    let copied = |window: &Window| {
        window.harness.output().platform_output.commands.iter().find_map(|command| match command {
            egui::OutputCommand::CopyText(text) => Some(text.clone()),
            _ => None,
        })
    };
    for (button, expected) in
        [("as TOML", "readout_ms = 0.0"), ("as command line", "--set camera.shutter.readout_ms=0.0")]
    {
        window.click("Copy");
        window.harness.get_by_label(button).click();
        let mut text = None;
        for _ in 0..4 {
            window.step();
            text = text.or_else(|| copied(&window));
        }
        let text = text.unwrap_or_default();
        assert!(text.contains(expected), "{button}: {text}");
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn warnings_of_render_are_shown() {
    let mut window = Window::open(Some(demo()));
    window.settle();
    let shown = |window: &Window| window.harness.query_all_by_label_contains("warning").count();
    assert_eq!(
        (shown(&window), &window.state().engine.loaded.as_ref().expect("loaded").warnings),
        (0, &Vec::new())
    );
    send(&mut window, Message::Set("tracker.max_acceleration_m_s2".into(), Some(Value::Float(0.2)), false));
    window.settle();
    let warnings = window.state().engine.loaded.as_ref().expect("loaded").warnings.clone();
    let expected =
        warnings.iter().find(|warning| warning.contains("tracker.max_acceleration_m_s2")).expect("held back");
    assert!(!has(&window, expected));
    window.click(&if warnings.len() == 1 {
        "1 warning".to_owned()
    } else {
        format!("{} warnings", warnings.len())
    });
    assert!(has(&window, expected));
    send(&mut window, Message::Undo);
    window.settle();
    assert_eq!(shown(&window), 0);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn keys_are_sought_by_name_and_description() {
    let mut window = Window::open(Some(demo()));
    window.settle();
    let shows = |window: &Window, key: &str| window.harness.query_all_by_label(key).next().is_some();
    assert!(!shows(&window, "tracker.bandwidth_hz"));
    window.harness.get_by_label("search keys").set_text_value_accesskit("camera.MOUNT");
    (0..3).for_each(|_| window.step());
    // Sections that have a match are open, others are not there.
    assert!(shows(&window, "camera.mount") && !shows(&window, "camera.shutter"));
    assert!(!shows(&window, "camera.shutter.readout_ms"));
    window.harness.get_by_label("search keys").set_text_value_accesskit("no such key");
    (0..3).for_each(|_| window.step());
    assert!(shows(&window, "no key has \"no such key\" in its name or description"));
    window.click("clear the search");
    assert!(shows(&window, "camera.shutter.readout_ms"));
}

#[test]
fn lists_of_sensors_have_their_own_sections() {
    let names = crate::panes::parameters::section_names();
    for sensor in ["imu", "gnss", "barometer", "magnetometer"] {
        assert!(names.contains(&sensor), "{sensor} in {names:?}");
    }
}
