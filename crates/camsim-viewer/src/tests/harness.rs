//! A window without a screen.

use std::{
    path::{Path, PathBuf},
    sync::mpsc::{Receiver, channel},
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
    engine::{Size, Wanted},
    export::Exporter,
    settings::Settings,
    sheet,
    state::State,
};

/// Longest wait for a picture: debug builds on two busy processors are slow.
const PATIENCE: Duration = Duration::from_secs(240);

/// The built-in flight.
pub fn demo() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/demo.toml")
}

/// A small flat scene with every effect, quick to render: the tests of panes need no mountains.
pub fn pattern() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/pattern.toml")
}

/// Ten hours in circles over that scene, a row a second with a gap of a minute; in a folder of its own.
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

/// A viewer and its window.
pub struct Window {
    pub harness: Harness<'static, Option<Viewer>>,
    /// A word for each repaint that is asked for: by the engine with each reply.
    repaints: Receiver<()>,
}

impl Window {
    /// Of 1000 x 700 points, on a scenario.
    pub fn open(scenario: Option<PathBuf>) -> Self {
        Self::with(scenario, None, [1000.0, 700.0])
    }

    pub fn with(scenario: Option<PathBuf>, exporter: Option<Exporter>, size: [f32; 2]) -> Self {
        Self::drawn(scenario, exporter, size, true)
    }

    /// With pictures drawn by their own pipeline, as in a window of eframe's, or by egui.
    pub fn drawn(
        scenario: Option<PathBuf>,
        exporter: Option<Exporter>,
        size: [f32; 2],
        by_own_pipeline: bool,
    ) -> Self {
        let mut start = Some((scenario, exporter));
        // egui's predictable filter takes the nearest texel also where a picture is made smaller; a window of
        // eframe's does not.
        let of_window = RendererOptions { dithering: false, ..RendererOptions::default() };
        let render = create_render_state(
            default_wgpu_setup(),
            if by_own_pipeline { RendererOptions::PREDICTABLE } else { of_window },
        );
        let of_window = render.clone();
        let show = move |ui: &mut egui::Ui, viewer: &mut Option<Viewer>| {
            if let Some((scenario, exporter)) = start.take() {
                if by_own_pipeline {
                    sheet::register(ui.ctx(), &of_window);
                }
                *viewer = Some(Viewer::new(ui.ctx(), scenario, Settings::default(), exporter));
            }
            // What eframe does by clearing.
            ui.painter().rect_filled(ui.ctx().content_rect(), 0.0, ui.visuals().panel_fill);
            viewer.as_mut().expect("made in the first pass").show(ui);
        };
        let builder = Harness::builder().with_size(size).with_step_dt(0.02).with_theme(egui::Theme::Dark);
        let harness =
            builder.renderer(WgpuTestRenderer::from_render_state(render)).build_ui_state(show, None);
        let (sender, repaints) = channel();
        harness.ctx.set_request_repaint_callback(move |_| {
            // The window may be gone.
            let _ = sender.send(());
        });
        Self { harness, repaints }
    }

    pub fn state(&self) -> &State {
        &self.harness.state().as_ref().expect("open").state
    }

    pub fn state_mut(&mut self) -> &mut State {
        &mut self.harness.state_mut().as_mut().expect("open").state
    }

    pub fn step(&mut self) {
        self.harness.step();
    }

    /// Lets the window run until something is so.
    #[track_caller]
    pub fn wait(&mut self, what: &str, mut is_so: impl FnMut(&State) -> bool) {
        let begun = Instant::now();
        while !is_so(self.state()) {
            assert!(
                begun.elapsed() < PATIENCE,
                "{what}: not within {PATIENCE:?}; fault {:?}, notices {:?}",
                self.state().heard.fault,
                self.state().notices
            );
            self.step();
            // Time goes on by the steps, too: that a hand rests is not told by a repaint.
            let _ = self.repaints.recv_timeout(Duration::from_millis(5));
        }
        self.step();
    }

    /// Lets the window run until a node of that name is there.
    #[track_caller]
    pub fn wait_for(&mut self, label: &str) {
        let begun = Instant::now();
        while !has(self, label) {
            assert!(begun.elapsed() < PATIENCE, "{label}: not within {PATIENCE:?}");
            self.step();
            let _ = self.repaints.recv_timeout(Duration::from_millis(5));
        }
    }

    /// Until what is wanted is on show, in full size.
    #[track_caller]
    pub fn settle(&mut self) {
        self.wait("the full picture", |state| {
            let wanted = state.wanted();
            wanted.as_ref().is_some_and(|wanted| wanted.size == Size::Full) && shown(state) == wanted.as_ref()
        });
    }

    /// Stops play, then as [`Window::settle`].
    #[track_caller]
    pub fn settle_stopped(&mut self) {
        self.state_mut().timeline.playing = false;
        self.settle();
    }

    /// Until the oracle answers for what is on show.
    #[track_caller]
    pub fn settle_exact(&mut self) {
        self.settle();
        self.wait("looks", |state| state.heard.current_looks().is_some());
    }

    #[track_caller]
    pub fn click(&mut self, label: &str) {
        self.harness.get_by_label(label).click();
        // Pressed, let go, done, shown.
        (0..3).for_each(|_| self.step());
    }

    /// What a screen would show.
    pub fn picture(&mut self) -> image::RgbaImage {
        self.harness.render().expect("rendered")
    }

    /// Holds a part of the window against its picture in `tests/snapshots`: what tells times, paths or noise
    /// is left out. Fonts and lines may differ a little between drivers.
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

    /// The panel on the right, below its tabs.
    pub fn page(&self) -> egui::Rect {
        let tabs = self.harness.get_by_label("Export").rect();
        egui::Rect::from_min_max(
            egui::pos2(self.harness.get_by_label("picture").rect().right() + 12.0, tabs.bottom() + 6.0),
            egui::pos2(984.0, 590.0),
        )
    }
}

/// What the pictures on show were made for.
pub fn shown(state: &State) -> Option<&Wanted> {
    state.heard.shown.as_ref().map(|shown| &shown.reply.wanted)
}

/// Whether a node of that name is there.
pub fn has(window: &Window, label: &str) -> bool {
    window.harness.query_all_by_label(label).next().is_some_and(|node| !node.accesskit_node().is_hidden())
}

/// What a pane would wish.
pub fn send(window: &mut Window, message: crate::message::Message) {
    let context = window.harness.ctx.clone();
    window.state_mut().apply(message, &context);
}
