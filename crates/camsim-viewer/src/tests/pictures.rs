//! Pictures: stages, comparison, overlays, the reference.

use std::{convert::Infallible, sync::Arc};

use camsim_core::scenario::{CameraSpec, LensModel, LensSpec};
use camsim_engine::{AdapterChoice, Engine};
use camsim_io::{load::load_sequence, scenario_file::read_scenario, write::write_picture};
use eframe::egui;
use egui_kittest::kittest::Queryable;

use super::harness::{Window, demo, has, pattern, send};
use crate::{
    engine::Stage,
    message::Message,
    state::State,
    view::{Compare, Overlays, View},
};

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn the_shown_picture_equals_the_png_of_render() {
    let mut window = Window::open(Some(demo()));
    window.settle();
    window.state_mut().timeline.seek(17);
    window.settle();
    let shown_image = window.state().engine.picture().expect("a picture").image.clone();

    let scenario = read_scenario(&demo(), &[], None).expect("legal");
    let sequence = load_sequence(&scenario).expect("loaded").sequence;
    let engine = Engine::new(AdapterChoice::Best).expect("an adapter");
    let mut session =
        engine.session::<Infallible>(Arc::clone(&sequence), &scenario.output.channels).expect("a session");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("frame.png");
    let mut write = |finished: camsim_engine::Finished| {
        write_picture(&path, &finished.frame, scenario.camera.photometric.output).expect("written");
        Ok(())
    };
    session.render::<Infallible>([17], &mut write).expect("rendered");
    let written = image::open(&path).expect("a picture").to_rgba8();
    assert_eq!(shown_image.size, [written.width() as usize, written.height() as usize]);
    for (index, (shown, written)) in shown_image.pixels.iter().zip(written.pixels()).enumerate() {
        assert_eq!(shown.to_array(), written.0, "pixel {index}");
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn at_1_to_1_the_screen_has_the_codes_of_the_picture() {
    for (own_pipeline, pixels_per_point) in [(true, 1.0), (false, 1.0), (true, 2.0), (false, 2.0)] {
        let mut window = Window::with_pipeline(Some(pattern()), None, [1600.0, 1000.0], own_pipeline);
        window.harness.set_pixels_per_point(pixels_per_point);
        codes_on_the_screen(&mut window, pixels_per_point);
    }
}

fn codes_on_the_screen(window: &mut Window, pixels_per_point: f32) {
    window.settle();
    window.click("1:1");
    assert!(has(window, "100 %"));
    // The middle of the picture may lie between two screen pixels.
    let rect = window.harness.get_by_label("picture").rect();
    let image = window.state().engine.picture().expect("a picture").image.clone();
    let [width, height] = image.size;
    let screen = window.picture();
    let origin = rect.center() * pixels_per_point - egui::vec2(width as f32, height as f32) * 0.5;
    assert!(rect.width() * pixels_per_point >= 64.0 && rect.height() * pixels_per_point >= 64.0);
    let (mut same, mut all) = (0, 0);
    for y in 0..40 {
        for x in 0..40 {
            let (px, py) = (width / 2 - 20 + x, height / 2 - 20 + y);
            let [screen_x, screen_y] =
                [origin.x + px as f32 + 0.5, origin.y + py as f32 + 0.5].map(|v| v.floor() as u32);
            all += 1;
            same += u32::from(
                screen.get_pixel(screen_x, screen_y).0[..3] == image.pixels[py * width + px].to_array()[..3],
            );
        }
    }
    assert_eq!(same, all, "pixels with the codes of the picture");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn own_pipeline_and_egui_agree_at_any_zoom() {
    let [own, egui_screens] = [true, false].map(|own_pipeline| {
        let mut window = Window::with_pipeline(Some(pattern()), None, [1000.0, 700.0], own_pipeline);
        window.settle();
        // Invalid pixels show the red background.
        window.state_mut().view.overlays.invalid = true;
        let mut screens = Vec::new();
        for (compare, zoom) in
            [(Compare::Single, Some(0.4)), (Compare::Wipe, Some(3.0)), (Compare::SideBySide, Some(17.0))]
        {
            window.state_mut().view =
                View { compare, zoom, centre: [0.31, 0.62], b: Stage::Lens, ..window.state().view.clone() };
            window.settle();
            window.step();
            let pane = window.harness.get_by_label("picture").rect();
            let [x, y, width, height] =
                [pane.left(), pane.top(), pane.width(), pane.height()].map(|v| v.round() as u32);
            screens.push(image::imageops::crop_imm(&window.picture(), x, y, width, height).to_image());
        }
        screens
    });
    for (step, (own, egui_screens)) in own.iter().zip(&egui_screens).enumerate() {
        // Borders of texels within a screen pixel and filtered values are rounded differently.
        let differs =
            |(a, b): &(&image::Rgba<u8>, &image::Rgba<u8>)| (0..3).any(|k| a.0[k].abs_diff(b.0[k]) > 2);
        let differing = own.pixels().zip(egui_screens.pixels()).filter(differs).count();
        assert!(differing * 500 < own.pixels().len(), "{differing} of {} in step {step}", own.pixels().len());
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn stages_are_compared_by_wipe_difference_and_side_by_side() {
    let mut window = Window::open(Some(demo()));
    window.settle();
    window.click("wipe");
    window.click("B: + lens");
    window.settle();
    assert_eq!(window.state().view.stages(), [Stage::Photometric, Stage::Lens]);
    let pair = &window.state().engine.shown.as_ref().expect("shown").reply.pictures;
    assert_eq!(pair.len(), 2);
    assert_ne!(pair[0].frame.color_rgba(), pair[1].frame.color_rgba());
    // Only A has noise and vignette.
    assert!(pair[1].plan.skipped.iter().any(|skip| skip.what == "noise"));
    assert!(!pair[0].plan.skipped.iter().any(|skip| skip.what == "noise"));
    window.click("A: ideal");
    window.click("difference");
    window.settle();
    let (difference, _) = window.state().engine.difference(false).expect("a difference");
    assert!(difference.rms_dn > 1.0, "the lens changes the picture: {}", difference.rms_dn);
    window.click("side by side");
    window.settle();
    let picture = window.picture();
    let pane = window.harness.get_by_label("picture").rect();
    let row = (pane.center().y + 20.0) as u32;
    let halves = [pane.left() + 20.0, pane.center().x + 20.0].map(|x| picture.get_pixel(x as u32, row).0);
    assert_ne!(halves[0], halves[1], "two pictures");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn overlays_are_drawn_and_depth_replaces_colour() {
    let mut window = Window::open(Some(pattern()));
    window.settle_reference();
    let plain = window.picture();
    let overlays =
        Overlays { invalid: true, grid: true, motion: true, rows: true, error: true, ..Overlays::default() };
    for (name, only) in [
        ("grid", Overlays { grid: true, ..Overlays::default() }),
        ("motion", Overlays { motion: true, ..Overlays::default() }),
        ("rows", Overlays { rows: true, ..Overlays::default() }),
        ("error", Overlays { error: true, ..Overlays::default() }),
    ] {
        window.state_mut().view.overlays = only;
        // Some overlays need another request.
        window.settle();
        window.wait("errors", |state| !only.error || has_errors(state));
        assert_ne!(window.picture(), plain, "{name} shows");
    }
    window.state_mut().view.overlays = overlays;
    window.settle();
    window.wait("errors", has_errors);
    let part = window.harness.get_by_label("picture").rect();
    window.snapshot("overlays", egui::Rect::from_center_size(part.center(), egui::vec2(160.0, 120.0)));
    // Right of the wipe line, too, where the stage with row times is.
    let half = View { compare: Compare::Wipe, a: Stage::Ideal, b: Stage::Time, ..View::default() };
    let [without, with] = [false, true].map(|rows| {
        window.state_mut().view = View { overlays: Overlays { rows, ..Overlays::default() }, ..half.clone() };
        window.settle();
        window.step();
        window.picture()
    });
    let pane = window.harness.get_by_label("picture").rect();
    let differs = |(x, _, pixel): &(u32, u32, &image::Rgba<u8>)| {
        f64::from(*x) > f64::from(pane.center().x) + 2.0
            && f64::from(*x) < f64::from(pane.right())
            && without.get_pixel(*x, (pane.center().y + 20.0) as u32) != *pixel
    };
    let row = (pane.center().y + 20.0) as u32;
    assert!(
        with.enumerate_pixels().filter(|(_, y, _)| *y == row).filter(differs).count() >= 5,
        "row times right of the line"
    );
    window.state_mut().view =
        View { overlays: Overlays { depth: true, ..Overlays::default() }, ..View::default() };
    window.settle();
    let depth = window
        .state()
        .engine
        .shown
        .as_ref()
        .and_then(|shown| shown.reply.depths.first().cloned())
        .expect("depth");
    assert_eq!(depth.depth_m.len(), 640 * 480);
    assert!(depth.depth_m.iter().any(|depth| *depth > 100.0));
}

/// Whether predicted errors of the shown pictures have arrived.
fn has_errors(state: &State) -> bool {
    state.engine.shown.as_ref().is_some_and(|shown| {
        !shown.reply.errors.is_empty() && shown.errors.len() == shown.reply.pictures.len()
    })
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn the_reference_picture_agrees_with_the_rendered_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut window = Window::open(Some(small(folder.path())));
    let difference = window.difference_from_reference();
    let predicted_dn = window.state().engine.picture().expect("a picture").plan.predicted.picture_dn();
    // The reference's pixels have a standard error of a quarter of max_error_dn, which is 1.
    assert!(
        difference.rms_dn < predicted_dn.max(1.0) + 0.5,
        "{} of {predicted_dn} predicted",
        difference.rms_dn
    );
    assert_eq!(window.state().view.compare, Compare::Difference);
}

/// [`pattern`] with a camera of 32 x 24 pixels.
fn small(folder: &std::path::Path) -> std::path::PathBuf {
    let sets = [
        ("camera.size_px", "[32, 24]"),
        ("camera.focal_px", "[28.0, 28.0]"),
        ("camera.principal_point_px", "[15.5, 11.5]"),
    ];
    let sets: Vec<_> = sets.map(|(key, value)| (key.to_owned(), value.to_owned())).into();
    let scenario = read_scenario(&pattern(), &sets, None).expect("legal");
    let path = folder.join("small.toml");
    std::fs::write(&path, toml::to_string(&scenario).expect("text")).expect("written");
    path
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_camera_that_cannot_be_rendered_leaves_the_last_picture() {
    let mut window = Window::open(Some(pattern()));
    window.settle();
    let shown_px = window.state().document.as_ref().expect("open").scenario.camera.size_px;
    let middle = window.harness.get_by_label("picture").rect().center();
    // The picture lies beyond the fold of the lens.
    let lens = LensSpec { model: LensModel::BrownConrady, coefficients: vec![-1.0] };
    let camera = CameraSpec {
        size_px: [512, 512],
        principal_point_px: Some([9000.0, 9000.0]),
        lens,
        ..CameraSpec::default()
    };
    send(&mut window, Message::Camera(Box::new(camera)));
    window.wait("the fault", |state| {
        state
            .engine
            .fault
            .as_ref()
            .is_some_and(|fault| fault.contains("no pixel of the camera has an ideal ray"))
    });
    // The text of the fault has moved the pane.
    let pane = window.harness.get_by_label("picture").rect();
    assert!(pane.contains(middle));
    window.harness.event(egui::Event::PointerMoved(pane.center()));
    (0..2).for_each(|_| window.step());
    let [x, y] = window.state().hovered.expect("on the picture");
    assert!(x.abs_diff(shown_px[0] / 2) <= 1 && y.abs_diff(shown_px[1] / 2) <= 1, "{x} {y} of {shown_px:?}");
    send(&mut window, Message::Undo);
    window.wait("a picture without fault", |state| state.engine.fault.is_none());
    window.settle();
}
