//! The egui viewer: scrub a flight, see what each imperfection does, and ask any pixel why it is as it is. It
//! shows the pixels that `camsim render` writes, by the same engine and plan.
//!
//! ```text
//! panes (draw from State, send Messages) -> State -> Wanted -> engine threads -> Reply -> State
//! ```
//!
//! No pane touches the device, and the window never waits for it.

#![warn(missing_docs)]

mod app;

mod browse;

mod document;

mod drop;

mod engine;

mod export;

mod fonts;

mod heard;

mod message;

mod motion;

mod orbit;

mod panes;

mod params;

mod pulse;

mod series;

mod settings;

mod sheet;

mod state;

mod still;

mod timeline;

mod view;

#[cfg(test)]
mod tests;

use std::path::PathBuf;

use anyhow::{Context, anyhow};

pub use export::{ExportJob, Exporter, Progress};
pub use still::{Still, still};

/// Opens the viewer on a scenario, or on the built-in flight, and returns when its window is closed.
/// `exporter` renders to files.
///
/// # Errors
/// No display, or nothing that a window can be drawn with. What is wrong with a scenario, or on the way, is
/// shown in the window.
pub fn run(scenario: Option<PathBuf>, exporter: Option<Exporter>) -> anyhow::Result<()> {
    if let Some(text) = no_display() {
        return Err(anyhow!(text));
    }
    let path = match scenario {
        Some(path) => path,
        None => {
            let folder = std::env::temp_dir().join(format!("camsim-builtin-{}", env!("CARGO_PKG_VERSION")));
            camsim_io::builtin::unpack(&folder)
                .with_context(|| format!("cannot write the built-in flight to {}", folder.display()))?
        }
    };
    let options = eframe::NativeOptions {
        viewport: eframe::egui::ViewportBuilder::default()
            .with_inner_size([1280.0, 800.0])
            .with_min_inner_size([480.0, 320.0])
            .with_app_id("camsim")
            .with_title("camsim"),
        renderer: eframe::Renderer::Wgpu,
        // Pixels are shown as they are.
        dithering: false,
        ..Default::default()
    };
    let start = move |creation: &eframe::CreationContext<'_>| {
        let viewer = app::Viewer::restored(creation, Some(path), exporter);
        Ok(Box::new(viewer) as Box<dyn eframe::App>)
    };
    eframe::run_native("camsim", options, Box::new(start)).map_err(|error| {
        anyhow!(
            "the viewer's window cannot be opened: {error}; it needs a display (on a remote machine use `camsim render`) and a Vulkan, Metal or \
             DirectX 12 adapter (`camsim info` lists them)"
        )
    })
}

/// On systems whose windows are another program's: what to do where that is not there.
fn no_display() -> Option<&'static str> {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let needed = cfg!(all(unix, not(target_os = "macos")));
    (needed && !["WAYLAND_DISPLAY", "WAYLAND_SOCKET", "DISPLAY"].into_iter().any(is_set)).then_some(
        "the viewer needs a display, and neither WAYLAND_DISPLAY nor DISPLAY is set: open it from a desktop session, over `ssh -X`, or in `xvfb-run`; \
         `camsim render` needs none",
    )
}
