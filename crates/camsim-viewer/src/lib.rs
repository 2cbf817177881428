//! The egui viewer: for now a window that shows the first frame, rendered by the same engine and plan as `camsim render`.
//!
//! The engine works on its own thread and sends typed messages; the window never waits for it.

#![warn(missing_docs)]

mod app;

mod engine_thread;

use std::path::PathBuf;

use anyhow::{Context, anyhow};

/// Opens the viewer on a scenario, or on the built-in flight, and returns when its window is closed.
///
/// # Errors
/// No display, or no scenario that can be read. Errors of rendering are shown in the window.
pub fn run(scenario: Option<PathBuf>) -> anyhow::Result<()> {
    let path = match scenario {
        Some(path) => path,
        None => {
            let folder = std::env::temp_dir().join(format!("camsim-builtin-{}", env!("CARGO_PKG_VERSION")));
            camsim_io::builtin::unpack(&folder).with_context(|| format!("cannot write the built-in flight to {}", folder.display()))?
        }
    };
    let options = eframe::NativeOptions {
        viewport: eframe::egui::ViewportBuilder::default().with_inner_size([960.0, 720.0]).with_title("camsim"),
        renderer: eframe::Renderer::Wgpu,
        ..Default::default()
    };
    eframe::run_native("camsim", options, Box::new(move |creation| Ok(Box::new(app::Viewer::new(&creation.egui_ctx, path))))).map_err(
        |error| anyhow!("the viewer's window cannot be opened: {error}; it needs a display (on a remote machine use `camsim render`)"),
    )
}
