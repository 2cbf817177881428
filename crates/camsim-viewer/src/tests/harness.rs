//! A headless window for tests.

use std::{
    path::{Path, PathBuf},
    sync::{
        Arc,
        mpsc::{Receiver, channel},
    },
    time::{Duration, Instant},
};

use eframe::{egui, egui_wgpu::RendererOptions};
use egui_kittest::{
    Harness, SnapshotOptions,
    kittest::{NodeT, Queryable},
    wgpu::{WgpuTestRenderer, create_render_state, default_wgpu_setup},
};

use crate::{
    app::Viewer,
    display_image,
    engine::{Difference, FrameRequest, Size},
    export::Exporter,
    settings::Settings,
    state::State,
};

/// Longest wait for a picture: debug builds on two busy processor cores are slow.
const TIMEOUT: Duration = Duration::from_secs(240);

/// The built-in flight.
pub fn demo() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/demo.toml")
}

/// A flat scene with every effect, quick to render.
pub fn pattern() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/pattern.toml")
}

/// [`pattern`] with other cameras, given as their tables, in `folder`.
pub fn pattern_with(folder: &Path, cameras: &str) -> PathBuf {
    camsim_io::builtin::unpack(folder).expect("unpacked");
    let text = std::fs::read_to_string(folder.join("pattern.toml")).expect("text");
    let [head, tail] = ["[camera]", "[scene]"].map(|table| text.find(table).expect("a table"));
    let path = folder.join("cameras.toml");
    std::fs::write(&path, format!("{}{cameras}{}", &text[..head], &text[tail..])).expect("written");
    path
}

/// Ten hours of circles over the scene of [`pattern`], one row per second with a gap of a minute, in
/// `folder`.
pub fn long_flight(folder: &Path) -> PathBuf {
    camsim_io::builtin::unpack(folder).expect("unpacked");
    let mut log = String::from("t_s,north_m,east_m,down_m,roll_deg,pitch_deg,yaw_deg\n");
    for second in (0..36_000).filter(|second| !(5_000..5_060).contains(second)) {
        let angle = f64::from(second) * 0.01;
        let [north_m, east_m] = [900.0 * angle.cos(), 900.0 * angle.sin()];
        log += &format!(
            "{second},{north_m:.3},{east_m:.3},-500,0,0,{:.3}\n",
            (angle.to_degrees() + 90.0) % 360.0
        );
    }
    std::fs::write(folder.join("long.csv"), log).expect("written");
    let pattern = std::fs::read_to_string(folder.join("pattern.toml")).expect("text");
    let mut table: toml::Table = pattern.parse().expect("toml");
    table["flight"] = toml::Value::Table("log = \"long.csv\"\nformat = \"csv-ned\"".parse().expect("toml"));
    let path = folder.join("long.toml");
    std::fs::write(&path, table.to_string()).expect("written");
    path
}

/// A viewer in a headless window.
pub struct Window {
    pub harness: Harness<'static, Option<Viewer>>,
    /// A message for each repaint request; the engine sends one with each reply.
    repaints: Receiver<()>,
}

impl Window {
    /// A window of 1000 x 700 points.
    pub fn open(scenario: Option<PathBuf>) -> Self {
        Self::with(scenario, None, [1000.0, 700.0])
    }

    /// A window with an exporter and a size in points.
    pub fn with(scenario: Option<PathBuf>, exporter: Option<Exporter>, size: [f32; 2]) -> Self {
        Self::with_pipeline(scenario, exporter, size, true)
    }

    /// A window whose images are drawn by their own pipeline, as in eframe's window, or by egui.
    pub fn with_pipeline(
        scenario: Option<PathBuf>,
        exporter: Option<Exporter>,
        size: [f32; 2],
        own_pipeline: bool,
    ) -> Self {
        let mut start = Some((scenario, exporter));
        // egui's predictable filter reads the nearest texel also of reduced images, unlike eframe's window.
        let eframe_options = RendererOptions { dithering: false, ..RendererOptions::default() };
        let render = create_render_state(
            default_wgpu_setup(),
            if own_pipeline { RendererOptions::PREDICTABLE } else { eframe_options },
        );
        let render_state = render.clone();
        let show = move |ui: &mut egui::Ui, viewer: &mut Option<Viewer>| {
            if let Some((scenario, exporter)) = start.take() {
                if own_pipeline {
                    display_image::register(ui.ctx(), &render_state);
                }
                *viewer = Some(Viewer::new(ui.ctx(), scenario, Settings::default(), exporter));
            }
            // eframe clears the window in this colour.
            ui.painter().rect_filled(ui.ctx().content_rect(), 0.0, ui.visuals().panel_fill);
            viewer.as_mut().expect("created in the first pass").show(ui);
        };
        let builder = Harness::builder().with_size(size).with_step_dt(0.02).with_theme(egui::Theme::Dark);
        let harness =
            builder.renderer(WgpuTestRenderer::from_render_state(render)).build_ui_state(show, None);
        let (sender, repaints) = channel();
        harness.ctx.set_request_repaint_callback(move |_| {
            // The window may have been dropped.
            let _ = sender.send(());
        });
        Self { harness, repaints }
    }

    /// The state of the viewer.
    pub fn state(&self) -> &State {
        &self.harness.state().as_ref().expect("open").state
    }

    /// The state of the viewer, to change.
    pub fn state_mut(&mut self) -> &mut State {
        &mut self.harness.state_mut().as_mut().expect("open").state
    }

    /// Runs one pass.
    pub fn step(&mut self) {
        self.harness.step();
    }

    /// Runs passes until a condition holds.
    #[track_caller]
    pub fn wait(&mut self, description: &str, mut condition: impl FnMut(&State) -> bool) {
        let began = Instant::now();
        while !condition(self.state()) {
            assert!(
                began.elapsed() < TIMEOUT,
                "{description}: not within {TIMEOUT:?}; fault {:?}, notices {:?}",
                self.state().engine.fault,
                self.state().notices
            );
            self.step();
            // With a timeout: egui's time advances by steps, and idle input requests no repaint.
            let _ = self.repaints.recv_timeout(Duration::from_millis(5));
        }
        self.step();
    }

    /// Runs passes until a node has the label.
    #[track_caller]
    pub fn wait_for(&mut self, label: &str) {
        let began = Instant::now();
        while !has(self, label) {
            assert!(began.elapsed() < TIMEOUT, "{label}: not within {TIMEOUT:?}");
            self.step();
            let _ = self.repaints.recv_timeout(Duration::from_millis(5));
        }
    }

    /// Runs passes until the requested frame is shown in full size.
    #[track_caller]
    pub fn settle(&mut self) {
        self.wait("the full picture", |state| {
            let request = state.frame_request();
            request.as_ref().is_some_and(|request| request.size == Size::Full)
                && shown_request(state) == request.as_ref()
        });
    }

    /// Stops play, then as [`Window::settle`].
    #[track_caller]
    pub fn settle_stopped(&mut self) {
        self.state_mut().timeline.playing = false;
        self.settle();
    }

    /// Runs passes until the reference is ready for the shown sequence.
    #[track_caller]
    pub fn settle_reference(&mut self) {
        self.settle();
        self.wait("the reference", |state| state.engine.current_reference().is_some());
    }

    /// Shows the difference of the picture from the reference's, and waits for all rows.
    #[track_caller]
    pub fn difference_from_reference(&mut self) -> Arc<Difference> {
        self.settle();
        self.click("difference");
        self.click("B: reference");
        self.settle();
        self.wait("all rows", |state| {
            state.engine.current_reference_picture().is_some_and(|shown| {
                let [_, height] = shown.picture.sequence.scenario.camera.size_px;
                shown.picture.rows == height && shown.picture.difference.is_some()
            })
        });
        self.state().engine.difference(true).expect("a difference").0.clone()
    }

    #[track_caller]
    pub fn click(&mut self, label: &str) {
        self.harness.get_by_label(label).click();
        // Press, release, and a pass that shows the effect.
        (0..3).for_each(|_| self.step());
    }

    /// The rendered window.
    pub fn picture(&mut self) -> image::RgbaImage {
        self.harness.render().expect("rendered")
    }

    /// Compares a part of the window, without times, paths and noise, with its picture in `tests/snapshots`.
    /// Fonts and lines may differ slightly between drivers.
    #[track_caller]
    pub fn snapshot(&mut self, name: &str, part: egui::Rect) {
        self.harness.check_accessibility();
        let whole = self.picture();
        let [x, y, width, height] =
            [part.left(), part.top(), part.width(), part.height()].map(|v| v.max(0.0).round() as u32);
        let part = image::imageops::crop_imm(&whole, x, y, width, height).to_image();
        let options = SnapshotOptions::new().threshold(1.5).max_failed_pixels(200_usize);
        egui_kittest::image_snapshot_options(&part, name, &options);
    }

    /// The right panel below its tabs.
    pub fn page(&self) -> egui::Rect {
        let tabs = self.harness.get_by_label("Export").rect();
        egui::Rect::from_min_max(
            egui::pos2(self.harness.get_by_label("picture").rect().right() + 12.0, tabs.bottom() + 6.0),
            egui::pos2(984.0, 590.0),
        )
    }
}

/// The request of the shown frame.
pub fn shown_request(state: &State) -> Option<&FrameRequest> {
    state.engine.shown.as_ref().map(|shown| &shown.reply.request)
}

/// Whether a visible node has the label.
pub fn has(window: &Window, label: &str) -> bool {
    window.harness.query_all_by_label(label).next().is_some_and(|node| !node.accesskit_node().is_hidden())
}

/// Applies a message as if a pane had sent it.
pub fn send(window: &mut Window, message: crate::message::Message) {
    let context = window.harness.ctx.clone();
    window.state_mut().apply(message, &context);
}
