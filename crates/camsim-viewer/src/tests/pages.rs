//! Pages of the right panel, shortcuts, window sizes.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, Mutex, mpsc::channel},
};

use camsim_core::{
    camera::CameraModel,
    scenario::{Channel, ExrCompression, ExrPixel, ImageFormat, OutputSpec},
    shutter::Shutter,
};
use eframe::egui::{self, Key};
use egui_kittest::kittest::Queryable;
use glam::DVec2;

use super::harness::{Window, demo, has, long_flight, pattern, send};
use crate::{message::Message, motion, view::Tab};

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn the_inspector_shows_the_geometry_of_the_pixel() {
    let mut window = Window::open(Some(demo()));
    window.settle_reference();
    let pixel = [300, 400];
    send(&mut window, Message::Pin(Some(pixel)));
    window.step();
    // Expected values by the formulas of the paper: eqs. 8 and 9 for the lens, section 6 for the row time.
    let scenario = window.state().document.as_ref().expect("open").scenario.clone();
    let camera = CameraModel::from_spec(&scenario.camera).expect("a camera");
    let uv = camera.unproject(DVec2::new(300.0, 400.0)).expect("a ray");
    assert!(has(&window, &format!("{:.6}, {:.6}", uv.x, uv.y)), "the ray");
    let shutter = Shutter::from_spec(&scenario.camera.shutter, scenario.camera.fps, scenario.camera.size_px)
        .expect("a shutter");
    assert!(has(&window, &format!("{:+.4} ms", 1e3 * shutter.dt_row_s(400))), "the row's time");
    assert!(has(&window, "terrain (object 1)"));
    let [r, g, b, a] =
        window.state().engine.picture().expect("a picture").image.pixels[400 * 640 + 300].to_array();
    assert_eq!(a, 255);
    assert!(has(&window, &format!("{r} {g} {b}")), "the codes");
    // Pinning a pixel requests the predicted errors near it.
    window.settle_reference();
    window.wait("its errors", |state| {
        state.engine.shown.as_ref().is_some_and(|shown| !shown.reply.errors.is_empty())
    });
    let reply = &window.state().engine.shown.as_ref().expect("shown").reply;
    let (map, plan) = (&reply.errors.first().expect("asked for").map, &reply.pictures[0].plan);
    let near_px = map.near_px(pixel).expect("ground");
    // The plan's bound also covers other frames of its group.
    assert!(
        near_px > 0.0 && near_px <= map.largest_px() && map.largest_px() <= plan.predicted.total_px + 1e-9
    );
    assert!(has(&window, &format!("{near_px:.5} px")), "the predicted error here");
    window.harness.key_press(Key::Escape);
    window.step();
    assert_eq!(window.state().pinned, None);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn the_middle_of_each_exposure_path_is_the_pixel() {
    let mut window = Window::open(Some(demo()));
    window.settle_reference();
    let reference = Arc::clone(window.state().engine.current_reference().expect("the reference"));
    let paths = motion::grid_paths(&reference, 0);
    assert!(paths.len() > 100, "{}", paths.len());
    for path in paths.iter() {
        // A pixel's time is its mid-exposure.
        let middle = path.exposure_px[path.exposure_px.len() / 2];
        assert!(middle.distance(path.pixel) < 1e-6, "{middle} {}", path.pixel);
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn plan_plots_map_and_export_show_their_contents() {
    let mut window = Window::open(Some(demo()));
    window.settle();
    window.click("Plan");
    assert!(has(&window, "- readback"), "the last pass");
    assert!(has(&window, "predicted error"));
    let is_broken = |window: &Window| {
        window.harness.query_all_by_label_contains("the tolerance is EXCEEDED: ").next().is_some()
    };
    assert!(!is_broken(&window));
    send(&mut window, Message::Set("quality.max_error_dn".into(), Some(toml::Value::Float(0.02)), false));
    window.settle();
    assert!(is_broken(&window), "the tolerance in DN");
    send(&mut window, Message::Undo);
    window.settle();
    window.click("Plots");
    window.wait_for("north, m");
    assert!(has(&window, "speed, m/s"));
    window.snapshot("plots", window.page().with_max_y(330.0));
    window.click("Map");
    window.step();
    let map = window.harness.get_by_label("map: click to jump").rect();
    window.snapshot("map", egui::Rect::from_center_size(map.center(), egui::vec2(170.0, 150.0)));
    window.click("map: click to jump");
    assert_eq!(window.state().view.tab, Tab::Map);
    window.settle();
    window.click("Export");
    assert!(has(&window, "this window has no exporter; use `camsim render`"));
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn an_export_shows_progress_and_can_be_cancelled() {
    // Finishes a frame for each message.
    let (finish, finished) = channel::<()>();
    let finished = Mutex::new(finished);
    let exporter: crate::Exporter = Arc::new(move |job| {
        for _ in job.frames[0]..job.frames[1] {
            let _ = finished.lock().expect("one export at a time").recv();
            if !job.tick() {
                return Err("stopped on request".into());
            }
        }
        Ok("all written".into())
    });
    let mut window = Window::with(Some(pattern()), Some(exporter), [1000.0, 900.0]);
    window.settle();
    window.click("Export");
    window.click("Render");
    (0..3).for_each(|_| finish.send(()).expect("the exporter listens"));
    window.wait("progress", |state| state.export.as_ref().is_some_and(|job| job.progress().done == 3));
    window.click("Cancel");
    drop(finish);
    window.wait("the end", |state| state.export.as_ref().is_some_and(|job| job.progress().ended.is_some()));
    assert!(has(&window, "stopped on request"));
    window.click("Render");
    window.wait("the end", |state| state.export.as_ref().is_some_and(|job| job.progress().ended.is_some()));
    assert!(has(&window, "all written"));
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn an_export_uses_channels_formats_frames_and_folder_of_its_page() {
    type ExportCall = (OutputSpec, [u64; 2], PathBuf);
    let calls: Arc<Mutex<Vec<ExportCall>>> = Arc::default();
    let exporter_calls = calls.clone();
    let exporter: crate::Exporter = Arc::new(move |job| {
        exporter_calls.lock().expect("one at a time").push((
            job.rig.first().output.clone(),
            job.frames,
            job.folder.clone(),
        ));
        Ok("all written".into())
    });
    let mut window = Window::with(Some(pattern()), Some(exporter), [1280.0, 800.0]);
    window.settle();
    let before = window.state().document.as_ref().expect("open").scenario.output.clone();
    window.click("Export");
    for name in ["output.channels: depth", "output.channels: coords", "output.format: png"] {
        window.click(name);
    }
    for (name, choice) in [("output.exr_pixel", "float"), ("output.exr_compression", "piz")] {
        window.click(name);
        window.click(choice);
    }
    for (name, frame) in [("first frame to render", 3.0), ("last frame to render", 7.0)] {
        window.harness.get_by_label(name).set_value_accesskit(frame);
        (0..3).for_each(|_| window.step());
    }
    assert!(has(&window, "5 of 60 frames"));
    window.harness.get_by_label("folder").set_text_value_accesskit("/tmp/some where");
    window.step();
    window.click("as a command line");
    (0..40).for_each(|_| window.step());
    let flip = |set: bool| !set;
    let mut expected = before.clone();
    for channel in [Channel::Depth, Channel::Coords] {
        if flip(before.channels.contains(&channel)) {
            expected.channels.push(channel)
        } else {
            expected.channels.retain(|c| *c != channel)
        }
    }
    let png = ImageFormat::Png;
    if flip(before.format.contains(&png)) {
        expected.format.push(png)
    } else {
        expected.format.retain(|f| *f != png)
    }
    (expected.exr_pixel, expected.exr_compression) = (ExrPixel::Float, ExrCompression::Piz);
    expected.channels.sort_by_key(|channel| *channel as u8);
    // The page shows the equivalent `camsim render`.
    let commands: Vec<_> =
        window.harness.query_all_by_label_contains("--frames 3..8 -o '/tmp/some where'").collect();
    assert_eq!(commands.len(), 1);
    window.click("Render");
    window.wait("the end", |state| state.export.as_ref().is_some_and(|job| job.progress().ended.is_some()));
    assert_eq!(*calls.lock().expect("over"), [(expected, [3, 8], PathBuf::from("/tmp/some where"))]);
    assert_eq!(window.state().timeline.range, None, "the loop is unchanged");
    window.click("as the timeline");
    assert!(has(&window, "all 60 frames; set a loop in the timeline, or type, for fewer"));
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn shortcuts_are_listed_and_the_theme_changes() {
    let mut window = Window::open(Some(pattern()));
    window.settle();
    window.click("?");
    assert!(has(&window, "play or stop"));
    let list = window.harness.get_by_label("play or stop").rect();
    let part = egui::Rect::from_center_size(list.center(), egui::vec2(320.0, 200.0));
    window.snapshot("shortcuts", part);
    window.harness.key_press(Key::Escape);
    window.step();
    assert!(!window.state().shows_shortcuts);
    window.click("Light");
    assert!(!window.harness.ctx.global_style().visuals.dark_mode);
    let part = window.harness.get_by_label("timeline").rect().expand2(egui::vec2(0.0, 36.0));
    window.snapshot("light", part);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn small_large_and_minimised_windows_keep_the_picture() {
    let mut window = Window::open(Some(pattern()));
    window.settle();
    for size in [[60.0, 40.0], [480.0, 320.0], [1.0, 1.0], [2500.0, 1400.0], [1000.0, 700.0]] {
        window.harness.set_size(egui::Vec2::from(size));
        window.step();
        window.step();
    }
    // Narrow windows leave out the pages, then the parameters, before they would cover the picture.
    for (width, pages, parameters) in
        [(500.0, false, false), (700.0, false, true), (900.0, true, true), (1000.0, true, true)]
    {
        window.harness.set_size(egui::vec2(width, 700.0));
        (0..3).for_each(|_| window.step());
        assert_eq!(
            (has(&window, "Export"), has(&window, "camera preset")),
            (pages, parameters),
            "at {width}"
        );
        let picture = window.harness.get_by_label("picture").rect();
        assert!(picture.width() > 100.0, "{picture} at {width}");
        if pages {
            assert!(window.harness.get_by_label("Pixel").rect().left() > picture.right(), "at {width}");
        }
        if parameters {
            assert!(
                window.harness.get_by_label("camera preset").rect().right() < picture.left(),
                "at {width}"
            );
        }
    }
    // A minimised window has no passes; when the clock jumps afterwards, play continues from its frame.
    window.click("play");
    let before = window.state().timeline.frame;
    window.state_mut().tick(1e4);
    assert!(window.state().timeline.frame <= before + 31);
    window.settle_stopped();
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_log_of_ten_hours_opens_in_an_empty_window() {
    let mut window = Window::open(None);
    window.step();
    assert!(has(&window, "nothing open"));
    let folder = tempfile::tempdir().expect("a folder");
    let path = long_flight(folder.path());
    send(&mut window, Message::Open(path));
    window.settle();
    assert!(window.state().timeline.frames > 1_000_000, "{:?}", window.state().timeline);
    send(&mut window, Message::Seek(900_000));
    window.settle();
    for tab in ["Plots", "Map", "3D", "Pixel"] {
        window.click(tab);
        window.step();
        if tab == "Plots" {
            window.wait_for("north, m");
        }
    }
    assert_eq!(window.state().engine.gaps_s, [[4999.0, 5060.0]]);
    assert_eq!(window.state().engine.shown.as_ref().expect("shown").reply.frame, 900_000);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn files_dragged_over_the_window_are_named() {
    let mut window = Window::open(Some(pattern()));
    window.settle();
    let held = egui::HoveredFile { path: Some(pattern()), mime: String::new() };
    window.harness.input_mut().hovered_files.push(held);
    (0..3).for_each(|_| window.step());
    assert!(has(&window, "drop to open or use pattern.toml"));
    window.harness.input_mut().hovered_files.clear();
    window.step();
    assert!(!has(&window, "drop to open or use pattern.toml"));
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn what_moves_is_named() {
    let propeller = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/propeller/propeller.toml");
    let mut window = Window::open(Some(propeller));
    window.settle_reference();
    let engine = &window.state().engine;
    let scene = &engine.sequence().expect("loaded").scene;
    let moves = |pixel: &[u32; 2]| {
        let hit = engine.sample(*pixel).and_then(|sample| sample.hit);
        hit.is_some_and(|hit| scene.motion_of_surface(hit.surface).is_some())
    };
    let pixels = (0..480).step_by(8).flat_map(|y| (0..640).step_by(8).map(move |x| [x, y]));
    let pixel = pixels.into_iter().find(|pixel| moves(pixel)).expect("a blade");
    let name = scene.moving_objects()[0].to_owned();
    send(&mut window, Message::Pin(Some(pixel)));
    (0..2).for_each(|_| window.step());
    assert!(has(&window, "moves at"));
    assert!(
        window.harness.query_all_by_label_contains(&format!("{name} (object")).next().is_some(),
        "{name}"
    );
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn times_of_the_plan_add_up() {
    let mut window = Window::open(Some(demo()));
    window.settle();
    let picture = window.state().engine.picture().expect("a picture");
    let times = &picture.times;
    let stages = [
        Some(times.plan_ms),
        Some(times.record_ms),
        Some(times.submit_ms),
        times.ideal_ms,
        Some(times.wait_ms),
        times.reverse_ms,
        Some(times.read_ms),
    ];
    let sum_ms: f64 = stages.into_iter().flatten().sum();
    assert!(sum_ms > 0.0 && sum_ms <= picture.took_ms, "{sum_ms} of {}", picture.took_ms);
    window.click("Plan");
    assert!(has(&window, "the rest") && has(&window, "in all"));
}
