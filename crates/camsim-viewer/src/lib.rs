//! The egui viewer: scrub a flight, compare the stages of the camera's imperfections, and inspect single
//! pixels. It shows the pixels that `camsim render` writes, by the same planner and renderers.
//!
//! ```no_run
//! camsim_viewer::run(Some("demo.toml".into()), None)?;
//! # Ok::<(), anyhow::Error>(())
//! ```
//!
//! The data flow of one pass; panes never wait for the engine:
//!
//! ```text
//! panes (draw from State) -> Message -> State -> FrameRequest -> engine threads -> Reply -> State
//! ```
//!
//! | module | holds |
//! |---|---|
//! | `app` | the window: one pass of egui |
//! | `state`, `engine_state`, `document`, `timeline`, `view`, `settings` | what panes draw from |
//! | `message` | what panes request |
//! | `panes` | the panes and their widgets |
//! | `engine` | threads that load and render |
//! | `series`, `motion`, `orbit` | computations for plots, overlays and the 3D view |
//! | `display_image`, `fonts` | images and glyphs on the screen |
//! | `dropped_files`, `file_dialog`, `export` | files in and out |
//! | `headless`, `frame_rate` | pictures without a window, and measurements |

#![warn(missing_docs)]

mod app;
mod display_image;
mod document;
mod engine;
mod engine_state;
mod export;
mod file_dialog;
mod fonts;
mod frame_rate;
mod headless;
mod message;
mod motion;
mod orbit;
mod panes;
mod series;
mod settings;
mod state;
mod timeline;
mod view;

#[cfg(test)]
mod tests;

use std::path::PathBuf;

use anyhow::{Context, anyhow};

pub use export::{ExportJob, Exporter, Progress};
pub use headless::{HeadlessFrame, render_headless};

/// Opens the viewer on a scenario, or on the built-in flight, and returns when its window is closed.
/// `exporter` renders frames to files; without one the export page is empty.
///
/// # Errors
/// No display, or no graphics adapter. Faults of a scenario are shown in the window.
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
        // Screen pixels must have the codes of the picture.
        dithering: false,
        ..Default::default()
    };
    let start = move |creation: &eframe::CreationContext<'_>| {
        let viewer = app::Viewer::from_eframe(creation, Some(path), exporter);
        Ok(Box::new(viewer) as Box<dyn eframe::App>)
    };
    eframe::run_native("camsim", options, Box::new(start)).map_err(|error| {
        anyhow!(
            "cannot open the viewer's window: {error}; it needs a display (on a remote machine use \
             `camsim render`) and a Vulkan, Metal or DirectX 12 adapter (`camsim info` lists them)"
        )
    })
}

/// The error on Unix systems without a display server.
fn no_display() -> Option<&'static str> {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let needed = cfg!(all(unix, not(target_os = "macos")));
    (needed && !["WAYLAND_DISPLAY", "WAYLAND_SOCKET", "DISPLAY"].into_iter().any(is_set)).then_some(
        "the viewer needs a display, and neither WAYLAND_DISPLAY nor DISPLAY is set: open it from a desktop \
         session, over `ssh -X`, or in `xvfb-run`; `camsim render` needs none",
    )
}
