//! The picture that the window would show of a frame, rendered without a window.

use std::{path::Path, sync::Arc};

use anyhow::{Context, anyhow};
use camsim_io::scenario_file::read_scenario;

use crate::engine::{EngineHandle, FrameRequest, Reply, Size, Stage};

/// A frame as the window shows it at one screen pixel per camera pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HeadlessFrame {
    /// Width, height.
    pub size_px: [usize; 2],
    /// sRGB codes R G B A, row-major; alpha is 0 where a pixel has no ray, else 255.
    pub rgba: Vec<u8>,
}

/// Renders a frame in full size on the threads that serve the window.
///
/// # Errors
/// Whatever the window would report instead of the picture.
pub fn render_headless(scenario: &Path, frame: u64) -> anyhow::Result<HeadlessFrame> {
    let scenario = Arc::new(read_scenario(scenario, &[], None)?);
    let (wake, woken) = std::sync::mpsc::channel();
    let engine = EngineHandle::start(move || {
        // Replies after the picture are ignored.
        let _ = wake.send(());
    });
    let request = FrameRequest {
        scenario,
        reload_count: 0,
        frame,
        stages: vec![Stage::Photometric],
        size: Size::Full,
        depth: false,
        raw: false,
        histogram: false,
        errors: false,
        gain: None,
    };
    engine.request_frame(request, false);
    loop {
        woken.recv().context("the renderer's threads have ended")?;
        for reply in engine.replies() {
            match reply {
                Reply::Failed(fault) => return Err(anyhow!(fault)),
                Reply::Frame(reply) => {
                    let image = &reply.pictures.first().context("a frame without a picture")?.image;
                    let rgba = image.pixels.iter().flat_map(|pixel| pixel.to_array()).collect();
                    return Ok(HeadlessFrame { size_px: image.size, rgba });
                }
                _ => {}
            }
        }
    }
}
