//! That nothing lies on anything: lines of controls fit, and explanations stand beside what they explain.

use eframe::egui::{Event, Pos2, Rect, vec2};
use egui_kittest::kittest::Queryable;

use super::harness::{Window, pattern};
use crate::view::{Compare, Tab};

const OVERLAYS: [&str; 6] = ["invalid", "grid", "motion", "row times", "predicted error", "depth"];

fn rect(window: &Window, label: &str) -> Rect {
    window.harness.get_by_label(label).rect()
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn overlays_stand_in_one_line_at_1280_points_and_wrap_in_narrower_windows() {
    let mut window = Window::with(Some(pattern()), None, [1280.0, 800.0]);
    window.settle();
    for compare in Compare::ALL {
        window.state_mut().view.compare = compare;
        (0..2).for_each(|_| window.step());
        let pane = rect(&window, "picture");
        let rects = OVERLAYS.map(|label| rect(&window, label));
        for (label, of) in OVERLAYS.iter().zip(&rects) {
            assert!(
                (of.center().y - rects[0].center().y).abs() < 1.0 && of.right() <= pane.right(),
                "{label} at {of} in {compare:?}"
            );
        }
    }
    window.harness.set_size(vec2(900.0, 700.0));
    (0..3).for_each(|_| window.step());
    let pane = rect(&window, "picture");
    for label in OVERLAYS {
        let of = rect(&window, label);
        assert!(
            of.right() <= pane.right() && of.bottom() <= pane.top(),
            "{label} at {of}, the picture at {pane}"
        );
    }
}

/// Rests on a place until its explanation is there; where that is.
fn explanation(window: &mut Window, at: Pos2, begins: &str) -> Rect {
    window.harness.event(Event::PointerMoved(at));
    let shown =
        |window: &Window| window.harness.query_all_by_label_contains(begins).next().map(|node| node.rect());
    // 0.02 s a step.
    for _ in 0..20 {
        window.step();
        assert!(shown(window).is_none(), "\"{begins}\" comes before the hand rests");
    }
    (0..60).for_each(|_| window.step());
    shown(window).unwrap_or_else(|| panic!("no \"{begins}\""))
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn explanations_cover_neither_their_control_nor_those_beside_it() {
    let exporter: crate::Exporter = std::sync::Arc::new(|_| Ok("nothing".into()));
    let mut window = Window::with(Some(pattern()), Some(exporter), [1280.0, 800.0]);
    window.settle();
    let center = |window: &Window, label: &str| rect(window, label).center();
    let of_toolbar = [
        ("single", "how A and B are held"),
        ("motion", "8 times as large"),
        ("A: ideal", "A pinhole with an instant shutter"),
    ];
    for (label, begins) in of_toolbar {
        let at = center(&window, label);
        let shown = explanation(&mut window, at, begins);
        for other in OVERLAYS.into_iter().chain(["single", "1:1", "A: ideal"]) {
            assert!(!shown.intersects(rect(&window, other)), "{label}'s at {shown} lies on {other}");
        }
    }
    let at = center(&window, "camera.shutter.readout_ms");
    let shown = explanation(&mut window, at, "rolling shutter t_r");
    for other in ["camera.shutter.readout_ms", "camera.shutter.exposure_ms", "camera.shutter.delay_ms"] {
        assert!(shown.left() > rect(&window, other).right(), "{shown} beside the parameters");
    }
    let at = center(&window, "loop from");
    let shown = explanation(&mut window, at, "the loop begins at this frame");
    assert!(
        shown.bottom() < rect(&window, "loop from").top() && shown.bottom() < rect(&window, "play").top(),
        "{shown} above the timeline"
    );
    window.state_mut().view.tab = Tab::Export;
    (0..2).for_each(|_| window.step());
    let at = center(&window, "Render");
    let shown = explanation(&mut window, at, "to this folder");
    assert!(shown.right() < rect(&window, "folder").left(), "{shown} on the left of the page");
}
