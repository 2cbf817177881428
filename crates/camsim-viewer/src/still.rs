//! What the window would show of a frame, without a window.

use std::{path::Path, sync::Arc};

use anyhow::{Context, anyhow};
use camsim_io::scenario_file::read_scenario;

use crate::engine::{Handle, Reply, Size, Stage, Wanted};

/// A picture as the window shows it at one point of the screen a pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Still {
    /// Width, height.
    pub size_px: [usize; 2],
    /// Its sRGB codes R G B A, row by row; alpha is 0 where a pixel has no ray, else 255.
    pub rgba: Vec<u8>,
}

/// The full picture of a frame, by the threads that serve the window.
///
/// # Errors
/// What the window would tell in its place.
pub fn still(scenario: &Path, frame: u64) -> anyhow::Result<Still> {
    let scenario = Arc::new(read_scenario(scenario, &[], None)?);
    let (bell, rung) = std::sync::mpsc::channel();
    let engine = Handle::start(move || {
        // Rings also for what is said after the picture.
        let _ = bell.send(());
    });
    let stages = vec![Stage::Photometric];
    engine.want(Wanted {
        scenario,
        reading: 0,
        frame,
        stages,
        size: Size::Full,
        truth: false,
        errors: false,
        gain: None,
    });
    loop {
        rung.recv().context("the renderer's threads have ended")?;
        for reply in engine.replies() {
            match reply {
                Reply::Failed(fault) => return Err(anyhow!(fault)),
                Reply::Frame(reply) => {
                    let image = &reply.pictures.first().context("a frame without a picture")?.image;
                    let rgba = image.pixels.iter().flat_map(|pixel| pixel.to_array()).collect();
                    return Ok(Still { size_px: image.size, rgba });
                }
                _ => {}
            }
        }
    }
}
