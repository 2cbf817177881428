//! A lens beyond 90 degrees off axis, whose frames are made of the faces of a cube: all panes know them.

use std::path::{Path, PathBuf};

use camsim_core::camera::CameraModel;
use eframe::egui;
use egui_kittest::kittest::Queryable;

use super::harness::{Window, has, pattern_with, send};
use crate::{
    engine::Stage,
    message::Message,
    view::{Overlays, Tab, View},
};

/// Side of the picture, pixels.
const SIDE: u32 = 64;

/// An equidistant fisheye of 200 degrees across, which looks forwards.
fn fisheye(folder: &Path) -> PathBuf {
    let camera = format!(
        "[camera]\nsize_px = [{SIDE}, {SIDE}]\nfocal_px = [18.335, 18.335]\n\
         lens = {{ model = \"kannala-brandt\" }}\nshutter = {{ readout_ms = 20.0 }}\n\
         image_circle = {{ half_angle_deg = 100.0 }}\n"
    );
    pattern_with(folder, &camera)
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn pixel_page_has_rays_beyond_90_degrees() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut window = Window::open(Some(fisheye(folder.path())));
    window.settle_reference();
    // 97 degrees off axis, towards the sky.
    send(&mut window, Message::Pin(Some([32, 0])));
    (0..2).for_each(|_| window.step());
    let camera = camera(&window);
    let ray = camera.ray(glam::DVec2::new(32.0, 0.0)).expect("a ray");
    let off_axis_deg = ray.truncate().length().atan2(ray.z).to_degrees();
    assert!(off_axis_deg > 95.0);
    assert!(has(&window, &format!("{off_axis_deg:.3} deg")) && has(&window, "sky"));
    assert!(has(&window, &format!("{:.6}, {:.6}, {:.6}", ray.x, ray.y, ray.z)), "the unit vector");
    assert!(!has(&window, "invalid "), "alpha is 1");
    // Straight down, at the lower border: the pattern, behind the plane of the picture.
    send(&mut window, Message::Pin(Some([32, 63])));
    (0..2).for_each(|_| window.step());
    let sample = window.state().engine.sample([32, 63]).expect("a ray");
    let range_m = sample.hit.expect("the pattern").point_ned_m.distance(sample.pose.position_ned_m);
    assert!(has(&window, &format!("{range_m:.3} m")));
    let pattern = window.harness.query_all_by_label_contains("pattern").next();
    assert!(pattern.is_some(), "the pattern is named");
    // Outside the circle.
    send(&mut window, Message::Pin(Some([1, 1])));
    (0..2).for_each(|_| window.step());
    assert!(has(&window, "the pixel lies outside the image circle"));
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn reference_covers_the_whole_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut window = Window::open(Some(fisheye(folder.path())));
    let difference = window.difference_from_reference();
    assert_eq!(difference.one_sided, 0.0, "the same pixels are valid");
    // At borders of cells, of which this picture has many, a coarse picture differs more.
    let plans = window.state().engine.picture().expect("a picture").plans();
    let predicted_dn = plans.map(|plan| plan.predicted.picture_dn()).fold(1.0, f64::max);
    assert!(difference.rms_dn < 1.6 * predicted_dn, "{} of {predicted_dn}", difference.rms_dn);
    let reference = window.state().engine.current_reference_picture().expect("shown");
    let valid = reference.picture.color_rgba.chunks_exact(4).filter(|rgba| rgba[3] > 0.0).count();
    // A disc over the whole width.
    assert!(valid as f64 > 0.75 * f64::from(SIDE * SIDE), "{valid}");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn plan_errors_grid_and_3d_are_of_all_faces() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut window = Window::open(Some(fisheye(folder.path())));
    window.settle();
    let plain = window.picture();
    window.state_mut().view.overlays = Overlays { grid: true, ..Overlays::default() };
    (0..2).for_each(|_| window.step());
    // Near the upper border of the picture, where no ideal image plane reaches.
    let pane = window.harness.get_by_label("picture").rect();
    let side = pane.width().min(pane.height());
    let top = egui::Rect::from_center_size(
        pane.center() - egui::vec2(0.0, 0.485 * side),
        egui::vec2(0.2 * side, 0.02 * side),
    );
    let with_grid = window.picture();
    let changed = (top.top() as u32..top.bottom() as u32)
        .flat_map(|y| (top.left() as u32..top.right() as u32).map(move |x| (x, y)))
        .filter(|(x, y)| plain.get_pixel(*x, *y) != with_grid.get_pixel(*x, *y));
    assert!(changed.count() > 5, "the grid reaches the border");

    window.state_mut().view.overlays = Overlays { error: true, ..Overlays::default() };
    window.settle();
    window.wait("errors", |state| {
        state.engine.shown.as_ref().is_some_and(|shown| !shown.reply.errors.is_empty())
    });
    let shown = window.state().engine.shown.as_ref().expect("shown");
    let map = &shown.reply.errors[0].map;
    for rows in [0..8, 28..36, 56..64] {
        let known = map.known().filter(|([_, y], _)| rows.contains(y)).count();
        assert!(known > 0, "errors in rows {rows:?}");
    }
    let faces = shown.reply.pictures[0].plans().count();
    assert!(faces >= 5, "{faces} faces");

    window.state_mut().view = View { tab: Tab::Plan, a: Stage::Photometric, ..View::default() };
    window.settle();
    window.step();
    assert!(has(&window, "front face") && has(&window, "bottom face"));

    window.state_mut().view.tab = Tab::View3d;
    (0..2).for_each(|_| window.step());
    let [across, down, corners] = camera(&window).field_deg().map(|deg| format!("{deg:.2}"));
    assert!(across.starts_with("199") || across.starts_with("200"), "{across}");
    assert!(has(&window, &format!("{across} x {down} deg, {corners} between corners")));
}

fn camera(window: &Window) -> CameraModel {
    let scenario = &window.state().document.as_ref().expect("open").scenario;
    CameraModel::from_spec(&scenario.camera).expect("a camera")
}
