//! Play, scrubbing and keys of the timeline.

use eframe::egui::{self, Key, PointerButton};
use egui_kittest::kittest::Queryable;

use super::harness::{Window, demo, pattern, pattern_with, send, shown_request};
use crate::{engine::Size, message::Message, state::State, view::Compare};

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_drag_shows_previews_and_its_end_the_full_frame() {
    let mut window = Window::open(Some(demo()));
    // Predicted errors must not delay previews.
    window.state_mut().view.overlays.error = true;
    window.settle();
    let bar = window.harness.get_by_label("timeline").rect();
    let bar_position =
        |fraction: f32| egui::pos2(bar.left() + 6.0 + fraction * (bar.width() - 12.0), bar.center().y);
    window.harness.event(egui::Event::PointerMoved(bar_position(0.25)));
    let button = |pressed, pos| egui::Event::PointerButton {
        pos,
        button: PointerButton::Primary,
        pressed,
        modifiers: egui::Modifiers::NONE,
    };
    window.harness.event(button(true, bar_position(0.25)));
    window.step();
    window.harness.event(egui::Event::PointerMoved(bar_position(0.5)));
    window.step();
    let target = (0.5_f64 * 119.0).round() as u64;
    assert!(window.state().timeline.dragged);
    assert_eq!(window.state().timeline.frame, target);
    window.wait("the preview", |state| {
        shown_request(state).is_some_and(|request| (request.frame, request.size) == (target, Size::Preview))
    });
    assert_eq!(window.state().engine.picture().expect("a picture").frame.size_px, [320, 240]);
    let request = window.state().frame_request().expect("open");
    assert!(
        request.size == Size::Preview
            && !request.errors
            && window.state().engine.shown.as_ref().expect("shown").errors.is_empty()
    );
    window.harness.event(button(false, bar_position(0.5)));
    window.step();
    assert!(!window.state().timeline.dragged);
    window.settle();
    let picture = window.state().engine.picture().expect("a picture");
    assert_eq!((picture.frame.size_px, picture.frame.index), ([640, 480], target));
    let errors_shown = |state: &State| {
        state.engine.shown.as_ref().map(|shown| (shown.reply.request.errors, shown.errors.len()))
    };
    window.wait("its errors", |state| errors_shown(state) == Some((true, 1)));
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn buttons_and_keys_step_play_and_loop() {
    let mut window = Window::open(Some(demo()));
    window.settle();
    window.click("next frame");
    window.click("next frame");
    window.click("previous frame");
    assert_eq!(window.state().timeline.frame, 1);
    window.harness.key_press(Key::ArrowRight);
    window.step();
    assert_eq!(window.state().timeline.frame, 2);
    window.harness.key_press_modifiers(egui::Modifiers::SHIFT, Key::ArrowRight);
    window.step();
    assert_eq!(window.state().timeline.frame, 12);
    window.click("loop from");
    window.click("last frame");
    assert_eq!(window.state().timeline.frame, 119);
    window.click("loop to");
    assert_eq!(window.state().timeline.range, Some([12, 119]));
    window.click("loop 12-119 off");
    window.click("first frame");
    // Slow enough that frames are rendered before the end on any machine.
    window.state_mut().timeline.speed = 0.1;
    window.click("play");
    window.wait("play advances", |state| state.timeline.frame > 3);
    window.wait("frames during play", |state| {
        state.engine.shown.as_ref().is_some_and(|shown| shown.reply.frame > 0)
    });
    window.click("stop");
    assert!(!window.state().timeline.playing);
    window.settle();
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn every_key_press_counts_within_one_pass() {
    // Long because: each step goes on from the state that the one before left.
    let mut window = Window::open(Some(pattern()));
    window.settle();
    let press = |window: &mut Window, key: Key, modifiers: egui::Modifiers, repeat: bool| {
        window.harness.event(egui::Event::Key { key, physical_key: None, pressed: true, repeat, modifiers });
        if !repeat {
            window.harness.event(egui::Event::Key {
                key,
                physical_key: None,
                pressed: false,
                repeat,
                modifiers,
            });
        }
    };
    let (none, shift, command) = (egui::Modifiers::NONE, egui::Modifiers::SHIFT, egui::Modifiers::COMMAND);
    (0..8).for_each(|_| press(&mut window, Key::ArrowRight, none, false));
    window.step();
    assert_eq!(window.state().timeline.frame, 8);
    // In order: to the first frame, then forward.
    for (key, modifiers) in
        [(Key::Home, none), (Key::ArrowRight, shift), (Key::ArrowRight, shift), (Key::ArrowLeft, none)]
    {
        press(&mut window, key, modifiers, false);
    }
    window.step();
    assert_eq!(window.state().timeline.frame, 19);
    // Two toggles in one pass both apply, one toggled twice is unchanged, and a held one does not repeat.
    let before = window.state().view.clone();
    for key in [Key::G, Key::I, Key::M, Key::M, Key::W] {
        press(&mut window, key, none, false);
    }
    window.step();
    let after = window.state().view.clone();
    assert_eq!(
        [after.overlays.grid, after.overlays.invalid],
        [!before.overlays.grid, !before.overlays.invalid]
    );
    assert_eq!((after.overlays.motion, after.compare), (before.overlays.motion, Compare::Wipe));
    for (key, repeats) in [(Key::G, 1), (Key::ArrowRight, 3)] {
        window.harness.event(egui::Event::Key {
            key,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers: none,
        });
        (0..repeats).for_each(|_| press(&mut window, key, none, true));
    }
    window.step();
    assert_eq!(
        (window.state().timeline.frame, window.state().view.overlays.grid),
        (23, before.overlays.grid)
    );
    window.harness.event(egui::Event::Key {
        key: Key::G,
        physical_key: None,
        pressed: false,
        repeat: false,
        modifiers: none,
    });
    // Undo and redo.
    let exposure_ms =
        |window: &Window| window.state().document.as_ref().expect("open").scenario.camera.shutter.exposure_ms;
    let initial_ms = exposure_ms(&window);
    for value in [3.0, 4.0, 5.0, 6.0] {
        send(
            &mut window,
            Message::Set("camera.shutter.exposure_ms".into(), Some(toml::Value::Float(value)), false),
        );
    }
    (0..3).for_each(|_| press(&mut window, Key::Z, command, false));
    window.step();
    assert_eq!(exposure_ms(&window), 3.0);
    (0..2).for_each(|_| press(&mut window, Key::Y, command, false));
    (0..3).for_each(|_| press(&mut window, Key::Z, command, false));
    window.step();
    assert_eq!(exposure_ms(&window), initial_ms);
    // Keys after one that opens a prompt go to the prompt.
    for (key, modifiers) in [(Key::S, command), (Key::ArrowRight, none)] {
        press(&mut window, key, modifiers, false);
    }
    window.step();
    assert!(window.state().path_prompt.is_some());
    assert_eq!(window.state().timeline.frame, 23);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_late_full_frame_does_not_replace_the_preview_of_the_wanted_one() {
    let mut window = Window::open(Some(demo()));
    window.settle();
    let late = window.state().engine.shown.as_ref().expect("shown").reply.clone();
    window.state_mut().timeline.dragged = true;
    send(&mut window, Message::Seek(50));
    window.wait("the preview", |state| shown_request(state).is_some_and(|request| request.frame == 50));
    window.state_mut().timeline.dragged = false;
    // The renderer was still busy with the frame before.
    let context = window.harness.ctx.clone();
    window.state_mut().receive(crate::engine::Reply::Frame(Box::new(late.clone())), &context);
    assert_eq!(window.state().engine.shown.as_ref().map(|shown| shown.reply.frame), Some(50));
    window.settle();
    assert_eq!(window.state().pending(), None);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_picture_that_is_not_the_wanted_one_says_so() {
    let folder = tempfile::tempdir().expect("a folder");
    // Large, so that a full frame takes longer than the mark waits.
    let camera = "[camera]\nsize_px = [2400, 1800]\nfocal_px = [1600.0, 1600.0]\n\
        mount = { angles_deg = [0.0, -90.0, 0.0] }\nshutter = { exposure_ms = 8.0 }\n";
    let mut window = Window::open(Some(pattern_with(folder.path(), camera)));
    window.settle();
    send(&mut window, Message::Seek(30));
    let mark = "rendering frame 30";
    let is_marked = |window: &Window| window.harness.query_all_by_label_contains(mark).next().is_some();
    let mut marked = false;
    while !marked && window.state().pending().is_some() {
        window.step();
        marked = is_marked(&window);
    }
    assert!(marked, "a mark while the frame is missing");
    window.settle();
    window.step();
    assert!(!is_marked(&window), "no mark once it is there");
}
