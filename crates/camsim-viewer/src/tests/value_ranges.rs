//! Input out of range, or that is no number, and its messages.

use eframe::egui::{Event, Key, Modifiers, PointerButton, Pos2, vec2};
use egui_kittest::kittest::Queryable;
use toml::Value;

use super::harness::{Window, has, pattern, send};
use crate::message::Message;

const EXPOSURE: &str = "camera.shutter.exposure_ms";

/// Types a text into a field, and Enter.
fn type_into(window: &mut Window, name: &str, text: &str) {
    window.click(name);
    window.harness.event(Event::Text(text.into()));
    window.step();
    window.harness.key_press(Key::Enter);
    (0..3).for_each(|_| window.step());
}

fn press(window: &mut Window, at: Pos2, pressed: bool) {
    window.harness.event(Event::PointerButton {
        pos: at,
        button: PointerButton::Primary,
        pressed,
        modifiers: Modifiers::NONE,
    });
    window.step();
}

fn exposure_ms(window: &Window) -> f64 {
    window.state().document.as_ref().expect("open").scenario.camera.shutter.exposure_ms
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn out_of_range_input_is_reported_with_key_and_range_until_the_next_edit() {
    let mut window = Window::open(Some(pattern()));
    window.settle();
    let text = "-5 is not within its range, 0 ms or more: 0 is used";
    let expected = format!("{EXPOSURE}: {text}");
    for typed in [true, false] {
        if typed {
            type_into(&mut window, EXPOSURE, "-5");
        } else {
            window.harness.get_by_label(EXPOSURE).set_value_accesskit(-5.0);
            (0..3).for_each(|_| window.step());
        }
        assert_eq!(exposure_ms(&window), 0.0, "typed: {typed}");
        assert!(has(&window, &expected), "in the menu line, typed: {typed}");
        assert!(has(&window, text), "at the field, typed: {typed}");
        send(&mut window, Message::Set("camera.photometric.light".into(), Some(Value::Float(0.9)), false));
        window.step();
        assert!(!has(&window, &expected) && !has(&window, text), "gone, typed: {typed}");
        send(&mut window, Message::Undo);
        send(&mut window, Message::Undo);
        window.step();
        assert!(exposure_ms(&window) > 0.0);
    }
    // A legal value gives no message.
    type_into(&mut window, EXPOSURE, "12.5");
    assert_eq!((exposure_ms(&window), &window.state().rejected_input), (12.5, &None));
    // Elements of a list are named by index.
    type_into(&mut window, "camera.photometric.vignette_thresholds[0]", "-77");
    let expected =
        "camera.photometric.vignette_thresholds[0]: -77 is not within its range, 0 or more: 0 is used";
    assert!(has(&window, expected), "{:?}", window.state().rejected_input);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_drag_beyond_the_range_is_reported() {
    // Tall enough for the key to be on the page: a pointer drags what it sees.
    let mut window = Window::with(Some(pattern()), None, [1200.0, 3000.0]);
    window.settle();
    let name = "camera.photometric.light";
    let from = window.harness.get_by_label(name).rect().center();
    window.harness.event(Event::PointerMoved(from));
    window.step();
    press(&mut window, from, true);
    for step in 1..30_u8 {
        window.harness.event(Event::PointerMoved(from - vec2(60.0 * f32::from(step), 0.0)));
        window.step();
    }
    press(&mut window, from - vec2(1740.0, 0.0), false);
    window.step();
    let document = window.state().document.as_ref().expect("open");
    assert_eq!(document.scenario.camera.photometric.light, 0.0);
    assert!(
        has(&window, &format!("{name}: at the end of its range, 0 x or more")),
        "{:?}",
        window.state().rejected_input
    );
    send(&mut window, Message::Undo);
    window.step();
    assert!(
        window.state().rejected_input.is_none()
            && window.state().document.as_ref().expect("open").scenario.camera.photometric.light > 0.0
    );
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn text_that_is_no_number_is_reported_and_changes_nothing() {
    let mut window = Window::open(Some(pattern()));
    window.settle();
    let before = exposure_ms(&window);
    for text in ["abc", "nan", "1,5"] {
        type_into(&mut window, EXPOSURE, text);
        assert_eq!(exposure_ms(&window), before, "{text}");
        let expected = format!("{EXPOSURE}: \"{text}\" is not a number: {before} is kept (0 ms or more)");
        assert!(has(&window, &expected), "{text}: {:?}", window.state().rejected_input);
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_field_that_is_opened_and_left_keeps_all_digits() {
    let mut window = Window::open(Some(pattern()));
    window.settle();
    let k1 = -0.283_408_114_321;
    let value = Value::Array([k1, 0.06, 0.0, 0.0].map(Value::Float).into());
    send(&mut window, Message::Set("camera.lens.coefficients".into(), Some(value), false));
    window.step();
    for leave in [Key::Enter, Key::Escape, Key::Tab] {
        window.click("camera.lens.coefficients[0]");
        window.harness.key_press(leave);
        (0..3).for_each(|_| window.step());
        let now = window.state().document.as_ref().expect("open").scenario.camera.lens.coefficients[0];
        assert_eq!((now, &window.state().rejected_input), (k1, &None), "{leave:?}");
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn time_speed_and_integer_fields_report_rejected_input() {
    let mut window = Window::open(Some(pattern()));
    window.settle();
    let last = window.state().timeline.last();
    type_into(&mut window, "time", "1e6");
    assert_eq!(window.state().timeline.frame, last);
    assert!(
        window.state().rejected_input.as_ref().is_some_and(|rejected| rejected.name == "time"),
        "{:?}",
        window.state().rejected_input
    );
    window.harness.get_by_label("speed").set_value_accesskit(99.0);
    (0..3).for_each(|_| window.step());
    assert_eq!(window.state().timeline.speed, 10.0);
    assert!(
        has(&window, "speed: 99 is not within 0.1 to 10: 10 is used"),
        "{:?}",
        window.state().rejected_input
    );
    let exporter: crate::Exporter = std::sync::Arc::new(|_| Ok("nothing".into()));
    let mut window = Window::with(Some(pattern()), Some(exporter), [1000.0, 700.0]);
    window.settle();
    window.click("Export");
    type_into(&mut window, "first frame to render", "2.6");
    let expected = format!("first frame to render: 2.6 is not an integer (0 to {last}): 3 is used");
    assert!(has(&window, &expected), "{:?}", window.state().rejected_input);
}
