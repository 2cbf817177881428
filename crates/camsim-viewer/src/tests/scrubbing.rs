//! The timeline.

use eframe::egui::{self, Key, PointerButton};
use egui_kittest::kittest::Queryable;

use super::harness::{Window, demo, pattern, send, shown};
use crate::{engine::Size, message::Message, state::State, view::Compare};

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_drag_shows_previews_and_a_resting_hand_the_full_frame() {
    let mut window = Window::open(Some(demo()));
    // Which must not hold up a preview.
    window.state_mut().view.overlays.error = true;
    window.settle();
    let bar = window.harness.get_by_label("timeline").rect();
    let at = |share: f32| egui::pos2(bar.left() + 6.0 + share * (bar.width() - 12.0), bar.center().y);
    window.harness.event(egui::Event::PointerMoved(at(0.25)));
    let button = |pressed, pos| egui::Event::PointerButton {
        pos,
        button: PointerButton::Primary,
        pressed,
        modifiers: egui::Modifiers::NONE,
    };
    window.harness.event(button(true, at(0.25)));
    window.step();
    window.harness.event(egui::Event::PointerMoved(at(0.5)));
    window.step();
    let there = (0.5_f64 * 119.0).round() as u64;
    assert!(window.state().timeline.dragged);
    assert_eq!(window.state().timeline.frame, there);
    window.wait("the preview", |state| {
        shown(state).is_some_and(|wanted| (wanted.frame, wanted.size) == (there, Size::Preview))
    });
    assert_eq!(window.state().heard.picture().expect("a picture").frame.size_px, [320, 240]);
    let wanted = window.state().wanted().expect("open");
    assert!(
        wanted.size == Size::Preview
            && !wanted.errors
            && window.state().heard.shown.as_ref().expect("shown").errors.is_empty()
    );
    window.harness.event(button(false, at(0.5)));
    window.step();
    assert!(!window.state().timeline.dragged);
    window.settle();
    let picture = window.state().heard.picture().expect("a picture");
    assert_eq!((picture.frame.size_px, picture.frame.index), ([640, 480], there));
    let shown = |state: &State| {
        state.heard.shown.as_ref().map(|shown| (shown.reply.wanted.errors, shown.errors.len()))
    };
    window.wait("its errors", |state| shown(state) == Some((true, 1)));
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
    // So slowly that frames come before the end on the slowest machine.
    window.state_mut().timeline.speed = 0.1;
    window.click("play");
    window.wait("time goes on", |state| state.timeline.frame > 3);
    window
        .wait("frames of it", |state| state.heard.shown.as_ref().is_some_and(|shown| shown.reply.frame > 0));
    window.click("stop");
    assert!(!window.state().timeline.playing);
    window.settle();
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn every_key_press_counts_also_within_one_pass() {
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
    // In the order in which they came: to the beginning first, then on.
    for (key, modifiers) in
        [(Key::Home, none), (Key::ArrowRight, shift), (Key::ArrowRight, shift), (Key::ArrowLeft, none)]
    {
        press(&mut window, key, modifiers, false);
    }
    window.step();
    assert_eq!(window.state().timeline.frame, 19);
    // Two switches in one pass are both thrown; one that is thrown twice is as it was; a held one does not
    // flicker.
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
    // Steps of the scenario.
    let exposure_ms =
        |window: &Window| window.state().document.as_ref().expect("open").scenario.camera.shutter.exposure_ms;
    let at_first_ms = exposure_ms(&window);
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
    assert_eq!(exposure_ms(&window), at_first_ms);
    // What follows a question that a key opens is typed into it.
    for (key, modifiers) in [(Key::S, command), (Key::ArrowRight, none)] {
        press(&mut window, key, modifiers, false);
    }
    window.step();
    assert!(window.state().question.is_some());
    assert_eq!(window.state().timeline.frame, 23);
}
