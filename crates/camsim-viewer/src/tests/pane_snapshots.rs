//! Snapshot of each pane.

use std::sync::Arc;

use eframe::egui::{self, Rect, pos2};
use egui_kittest::kittest::Queryable;

use super::harness::{Window, pattern, send};
use crate::{message::Message, view::Tab};

/// Rectangle from the top of one label to the bottom of another, between two horizontal positions.
fn rows(window: &Window, x: [f32; 2], first: &str, last: &str) -> Rect {
    let rect = |label: &str| {
        window.harness.query_all_by_label(label).next().unwrap_or_else(|| panic!("no {label}")).rect()
    };
    Rect::from_min_max(pos2(x[0], rect(first).top() - 3.0), pos2(x[1], rect(last).bottom() + 3.0))
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn panes_match_their_snapshots() {
    let exporter: crate::Exporter = Arc::new(|_| Ok("nothing".into()));
    let mut window = Window::with(Some(pattern()), Some(exporter), [1200.0, 800.0]);
    window.settle_reference();
    let right = window.harness.get_by_label("picture").rect().right() + 10.0;
    let page = [right, 1192.0];

    let menu = window.harness.get_by_label("Open").rect().union(window.harness.get_by_label("?").rect());
    window.snapshot("menu", menu.expand(4.0));
    send(
        &mut window,
        Message::Set("camera.shutter.exposure_ms".into(), Some(toml::Value::Float(-1.0)), false),
    );
    window.step();
    window.settle();
    let part = rows(&window, [4.0, 304.0], "camera.lens", "interlace_ms");
    window.snapshot("parameters", part);
    let notice = "a notice, until somebody reads it";
    window.state_mut().notice(notice.into());
    window.step();
    let part = Rect::from_min_max(
        pos2(308.0, 28.0),
        window.harness.get_by_label(notice).rect().right_bottom() + egui::vec2(4.0, 4.0),
    );
    window.snapshot("notices", part);
    send(&mut window, Message::Dismiss(0));
    send(&mut window, Message::Undo);
    window.settle_reference();
    let part =
        window.harness.get_by_label("single").rect().union(window.harness.get_by_label("depth").rect());
    let pane = window.harness.get_by_label("picture").rect();
    window.snapshot("toolbar", Rect::from_x_y_ranges(pane.x_range(), part.expand(3.0).y_range()));
    window.state_mut().pinned = Some([400, 300]);
    window.step();
    let part = rows(&window, page, "row time", "source");
    window.snapshot("pixel", part);
    window.state_mut().view.tab = Tab::Plan;
    (0..2).for_each(|_| window.step());
    let part = rows(&window, page, "predicted error", "single precision");
    window.snapshot("plan", part.with_max_x(right + 180.0));
    window.state_mut().view.tab = Tab::Export;
    (0..2).for_each(|_| window.step());
    let part = rows(&window, page, "all 60 frames; set a loop in the timeline, or type, for fewer", "Render");
    window.snapshot("export", part);
}
