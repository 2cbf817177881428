//! Prompts before unsaved changes are lost.

use toml::Value;

use super::harness::{Window, has, long_flight, pattern, send};
use crate::{message::Message, state::UnsavedPrompt};

fn window_with_changes() -> Window {
    let mut window = Window::open(Some(pattern()));
    window.settle();
    send(&mut window, Message::Set("camera.shutter.exposure_ms".into(), Some(Value::Float(2.0)), false));
    window.settle();
    window
}

fn exposure_ms(window: &Window) -> f64 {
    window.state().document.as_ref().expect("open").scenario.camera.shutter.exposure_ms
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn opening_another_scenario_asks_first() {
    let mut window = window_with_changes();
    for message in [Message::Open(pattern()), Message::Drop(pattern())] {
        send(&mut window, message);
        (0..3).for_each(|_| window.step());
        assert_eq!(exposure_ms(&window), 2.0, "nothing is lost yet");
        window.click("Cancel");
        assert_eq!((window.state().unsaved_prompt.clone(), exposure_ms(&window)), (None, 2.0));
    }
    send(&mut window, Message::Open(pattern()));
    (0..3).for_each(|_| window.step());
    window.click("Open without saving");
    assert_eq!((window.state().unsaved_prompt.clone(), exposure_ms(&window)), (None, 8.0));
    send(&mut window, Message::Open(pattern()));
    assert_eq!(window.state().unsaved_prompt, None, "no prompt without changes");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn closing_asks_first_and_a_second_request_closes() {
    use eframe::egui::{ViewportCommand, ViewportEvent};
    let mut window = window_with_changes();
    let close = |window: &mut Window| {
        window
            .harness
            .input_mut()
            .viewports
            .entry(eframe::egui::ViewportId::ROOT)
            .or_default()
            .events
            .push(ViewportEvent::Close);
        window.step();
        window
            .harness
            .input_mut()
            .viewports
            .entry(eframe::egui::ViewportId::ROOT)
            .or_default()
            .events
            .clear();
        let output = window.harness.output();
        output
            .viewport_output
            .values()
            .flat_map(|viewport| &viewport.commands)
            .any(|command| *command == ViewportCommand::CancelClose)
    };
    assert!(close(&mut window), "the close is cancelled");
    assert_eq!(window.state().unsaved_prompt, Some(UnsavedPrompt::Close));
    (0..3).for_each(|_| window.step());
    assert!(has(&window, "Close without saving"));
    assert!(!close(&mut window), "the second request closes");
    window.click("Cancel");
    send(&mut window, Message::Undo);
    assert!(!close(&mut window), "no prompt without changes");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn another_scenario_opens_while_a_long_log_is_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut window = Window::open(Some(long_flight(folder.path())));
    window.wait("reading", |state| state.engine.busy.contains("long.csv"));
    send(&mut window, Message::Open(pattern()));
    window.settle();
    assert!(
        window.state().timeline.frames < 1_000_000
            && window.state().engine.fault.is_none()
            && window.state().notices.is_empty()
    );
    assert_eq!(window.state().document.as_ref().expect("open").path, pattern());
    window.wait("the end of the busy state", |state| state.engine.busy.is_empty());
}
