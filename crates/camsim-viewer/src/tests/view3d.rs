//! The 3D view.

use eframe::egui::{
    Event, Modifiers, MouseWheelSource, MouseWheelUnit, PointerButton, Pos2, TouchPhase, Vec2, vec2,
};
use egui_kittest::kittest::Queryable;

use super::harness::{Window, demo, has, pattern, send};
use crate::{
    message::Message,
    orbit::Orbit,
    panes::view3d::screen_position,
    view::{Tab, View},
};

const PANE: &str = "3D view: drag to turn, click to jump";

fn open(scenario: std::path::PathBuf) -> Window {
    let mut window = Window::with(Some(scenario), None, [1280.0, 800.0]);
    window.settle();
    window.click("3D");
    assert_eq!(window.state().view.tab, Tab::View3d);
    window.step();
    window
}

fn orbit(window: &Window) -> Orbit {
    window.state().view.orbit
}

fn middle(window: &Window) -> Pos2 {
    window.harness.get_by_label(PANE).rect().center()
}

fn button(window: &mut Window, pos: Pos2, button: PointerButton, pressed: bool) {
    window.harness.event(Event::PointerButton { pos, button, pressed, modifiers: Modifiers::NONE });
    window.step();
}

fn drag(window: &mut Window, with: PointerButton, by: Vec2) {
    let from = middle(window);
    window.harness.event(Event::PointerMoved(from));
    window.step();
    button(window, from, with, true);
    for step in 1..=4_u8 {
        window.harness.event(Event::PointerMoved(from + by * f32::from(step) / 4.0));
        window.step();
    }
    button(window, from + by, with, false);
    window.step();
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn the_view_rotates_pans_and_zooms_by_mouse_and_controls() {
    let mut window = open(pattern());
    window.harness.check_accessibility();
    let before = orbit(&window);
    drag(&mut window, PointerButton::Primary, vec2(50.0, 20.0));
    let turned = orbit(&window);
    let expected = [(before.azimuth_deg + 20.0).rem_euclid(360.0), before.depression_deg + 8.0];
    assert!(
        (turned.azimuth_deg - expected[0]).abs() < 0.01 && (turned.depression_deg - expected[1]).abs() < 0.01,
        "{turned:?}"
    );
    drag(&mut window, PointerButton::Secondary, vec2(30.0, 0.0));
    let moved = orbit(&window);
    assert_eq!((moved.azimuth_deg, moved.depression_deg), (turned.azimuth_deg, turned.depression_deg));
    assert!(
        moved.target != turned.target && (moved.target[2] - turned.target[2]).abs() < 1e-9,
        "to the side: {moved:?}"
    );
    // The wheel zooms the view and does not scroll the page.
    let centre = middle(&window);
    window.harness.event(Event::PointerMoved(centre));
    window.harness.event(Event::MouseWheel {
        unit: MouseWheelUnit::Point,
        delta: vec2(0.0, 120.0),
        phase: TouchPhase::Move,
        source: MouseWheelSource::Unknown,
        modifiers: Modifiers::NONE,
    });
    (0..30).for_each(|_| window.step());
    let nearer = orbit(&window).zoom / moved.zoom;
    assert!((nearer - 0.6_f64.exp()).abs() < 0.05, "by {nearer}");
    assert_eq!(middle(&window), centre);
    window.click("farther");
    assert!(orbit(&window).zoom < nearer * moved.zoom);
    window.click("from above");
    assert_eq!(orbit(&window), Orbit::from_above());
    window.harness.get_by_label("view azimuth").set_value_accesskit(123.0);
    (0..3).for_each(|_| window.step());
    assert_eq!(orbit(&window).azimuth_deg, 123.0);
    window.harness.get_by_label("view depression").set_value_accesskit(200.0);
    (0..3).for_each(|_| window.step());
    assert_eq!(orbit(&window).depression_deg, 90.0);
    assert!(
        has(&window, "view depression: 200 is not within its range, -30 to 90 deg: 90 is used"),
        "{:?}",
        window.state().rejected_input
    );
    window.click("whole scene");
    assert_eq!(orbit(&window), Orbit::default());
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn the_view_shows_camera_and_field_of_view_and_a_click_jumps() {
    let mut window = open(demo());
    let loaded = window.state().engine.loaded.clone().expect("loaded");
    let camera = &loaded.sequence.scenario.camera;
    let position_ned_m = |frame: u64| {
        loaded.sequence.path.pose(loaded.sequence.start_s + frame as f64 / camera.fps).position_ned_m
    };
    let [north, east, down] = position_ned_m(0).to_array().map(|m| format!("{m:.1}"));
    assert!(has(&window, &format!("{north} N, {east} E, {down} D m")));
    // Barrel distortion: wider than a pinhole of the same focal length.
    let field: String = {
        let node =
            window.harness.query_all_by_label_contains(" between corners").next().expect("a field of view");
        use egui_kittest::kittest::NodeT;
        let node = node.accesskit_node();
        node.label().or_else(|| node.value()).expect("text")
    };
    let across: f64 = field.split(' ').next().and_then(|number| number.parse().ok()).expect("a number");
    let pinhole_deg = 2.0 * (0.5 * f64::from(camera.size_px[0]) / camera.focal_px[0]).atan().to_degrees();
    assert!(across > pinhole_deg && across < pinhole_deg + 25.0, "{across} of {pinhole_deg}");
    // Zoomed in, so that frames are points apart, and from above, so that nothing hides the path.
    let last = window.state().timeline.last();
    let target = position_ned_m(last / 2);
    window.click("from above");
    window.click("to the camera");
    let view = View { orbit: Orbit { zoom: 40.0, ..orbit(&window) }, ..window.state().view.clone() };
    send(&mut window, Message::View(view));
    (0..2).for_each(|_| window.step());
    let rect = window.harness.get_by_label(PANE).rect();
    let position = screen_position(&window.harness.ctx, &orbit(&window), rect, target);
    assert!(rect.contains(position), "{position} in {rect}");
    window.harness.event(Event::PointerMoved(position));
    window.step();
    button(&mut window, position, PointerButton::Primary, true);
    button(&mut window, position, PointerButton::Primary, false);
    (0..2).for_each(|_| window.step());
    let frame = window.state().timeline.frame;
    assert!(frame.abs_diff(last / 2) <= 3, "{frame} of {}", last / 2);
    // The camera's dot is there. The pointer is moved away, because it is drawn, too.
    window.harness.event(Event::PointerMoved(Pos2::new(700.0, 400.0)));
    window.step();
    let picture = window.picture();
    let spot = screen_position(&window.harness.ctx, &orbit(&window), rect, position_ned_m(frame));
    let [r, g, b, _] = picture.get_pixel(spot.x.round() as u32, spot.y.round() as u32).0;
    assert!(r > 200 && g < 120 && b < 120, "{r} {g} {b} at {spot}");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn ground_path_log_and_frustum_are_drawn() {
    for (scenario, zoom, has_terrain) in [(demo(), 40.0, true), (pattern(), 3.0, false)] {
        let mut window = open(scenario);
        window.click("to the camera");
        let view = View { orbit: Orbit { zoom, ..orbit(&window) }, ..window.state().view.clone() };
        send(&mut window, Message::View(view));
        (0..2).for_each(|_| window.step());
        let rect = window.harness.get_by_label(PANE).rect();
        let picture = window.picture();
        let (mut behind, mut path, mut log, mut seen) = (0, 0, 0, 0);
        for y in rect.top() as u32..rect.bottom() as u32 {
            for x in rect.left() as u32..rect.right() as u32 {
                let [r, g, b, _] = picture.get_pixel(x, y).0.map(i32::from);
                let is = |color: [i32; 3]| [r, g, b].iter().zip(color).all(|(a, b)| (a - b).abs() < 12);
                behind += i32::from(is([24, 28, 34]));
                // Less blue behind the translucent frustum.
                path += i32::from(b > 170 && b - r > 60 && b > g);
                log += i32::from(is([255, 225, 70]));
                seen += i32::from(is([255, 140, 40]));
            }
        }
        let all = (rect.width() * rect.height()) as i32;
        assert!(
            path > 20 && log > 20 && seen > 100,
            "path {path}, log {log}, camera {seen}, terrain {has_terrain}"
        );
        assert!(behind < 8 * all / 10, "{behind} of {all} are empty, terrain {has_terrain}");
    }
}
