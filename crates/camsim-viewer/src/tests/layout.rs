//! Layout: controls fit into their lines, and tooltips cover no controls.

use eframe::egui::{Event, Pos2, Rect, vec2};
use egui_kittest::kittest::Queryable;

use super::harness::{Window, pattern};
use crate::view::{Compare, Tab};

const OVERLAYS: [&str; 7] =
    ["invalid", "grid", "motion", "row times", "predicted error", "depth", "histogram"];

fn rect(window: &Window, label: &str) -> Rect {
    window.harness.get_by_label(label).rect()
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn overlay_buttons_fit_one_line_at_1280_points_and_wrap_below() {
    let mut window = Window::with(Some(pattern()), None, [1280.0, 800.0]);
    window.settle();
    for compare in Compare::ALL {
        window.state_mut().view.compare = compare;
        (0..2).for_each(|_| window.step());
        let pane = rect(&window, "picture");
        let rects = OVERLAYS.map(|label| rect(&window, label));
        for (label, button) in OVERLAYS.iter().zip(&rects) {
            assert!(
                (button.center().y - rects[0].center().y).abs() < 1.0 && button.right() <= pane.right(),
                "{label} at {button} in {compare:?}"
            );
        }
    }
    window.harness.set_size(vec2(900.0, 700.0));
    (0..3).for_each(|_| window.step());
    let pane = rect(&window, "picture");
    for label in OVERLAYS {
        let button = rect(&window, label);
        assert!(
            button.right() <= pane.right() && button.bottom() <= pane.top(),
            "{label} at {button}, the picture at {pane}"
        );
    }
}

/// Rests the pointer at a position until the tooltip appears; returns its rectangle.
fn tooltip_rect(window: &mut Window, position: Pos2, begins: &str) -> Rect {
    window.harness.event(Event::PointerMoved(position));
    let shown =
        |window: &Window| window.harness.query_all_by_label_contains(begins).next().map(|node| node.rect());
    // 0.02 s per step.
    for _ in 0..20 {
        window.step();
        assert!(shown(window).is_none(), "\"{begins}\" appears before the pointer rests");
    }
    (0..60).for_each(|_| window.step());
    shown(window).unwrap_or_else(|| panic!("no \"{begins}\""))
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn tooltips_cover_neither_their_control_nor_its_neighbours() {
    let exporter: crate::Exporter = std::sync::Arc::new(|_| Ok("nothing".into()));
    let mut window = Window::with(Some(pattern()), Some(exporter), [1280.0, 800.0]);
    window.settle();
    let center = |window: &Window, label: &str| rect(window, label).center();
    let toolbar_tips = [
        ("single", "how A and B are compared"),
        ("motion", "magnified 8 times"),
        ("A: ideal", "pinhole with an instant shutter"),
    ];
    for (label, begins) in toolbar_tips {
        let control = center(&window, label);
        let shown = tooltip_rect(&mut window, control, begins);
        for other in OVERLAYS.into_iter().chain(["single", "1:1", "A: ideal"]) {
            assert!(!shown.intersects(rect(&window, other)), "{label}'s at {shown} lies on {other}");
        }
    }
    let control = center(&window, "camera.shutter.readout_ms");
    let shown = tooltip_rect(&mut window, control, "Rolling shutter");
    for other in ["camera.shutter.readout_ms", "camera.shutter.exposure_ms", "camera.shutter.delay_ms"] {
        assert!(shown.left() > rect(&window, other).right(), "{shown} beside the parameters");
    }
    let control = center(&window, "loop from");
    let shown = tooltip_rect(&mut window, control, "begin the loop at this frame");
    assert!(
        shown.bottom() < rect(&window, "loop from").top() && shown.bottom() < rect(&window, "play").top(),
        "{shown} above the timeline"
    );
    window.state_mut().view.tab = Tab::Export;
    (0..2).for_each(|_| window.step());
    let control = center(&window, "Render");
    let shown = tooltip_rect(&mut window, control, "render to this folder");
    assert!(shown.right() < rect(&window, "folder").left(), "{shown} on the left of the page");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn long_texts_do_not_widen_the_panels() {
    let mut window = Window::with(Some(pattern()), None, [1280.0, 800.0]);
    window.settle();
    let before = rect(&window, "picture");
    for tab in Tab::ALL {
        window.state_mut().view.tab = tab;
        window.state_mut().pinned = Some([320, 240]);
        // Without a place to break.
        window.state_mut().engine.adapter = "a".repeat(400);
        window.state_mut().notices = Vec::new();
        (0..3).for_each(|_| window.step());
        assert_eq!(rect(&window, "picture").x_range(), before.x_range(), "{tab:?}");
    }
    let text = "camera.shutter.readout_ms ".repeat(20);
    window.state_mut().rejected_input =
        Some(crate::message::RejectedInput { name: "camera.shutter.readout_ms".into(), text });
    (0..3).for_each(|_| window.step());
    assert_eq!(rect(&window, "picture").x_range(), before.x_range(), "a rejected input");
}
