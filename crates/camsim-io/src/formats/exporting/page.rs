//! `README.md` of an export: which convention it turned how.

use std::fmt::Write as _;

use camsim_core::scenario::{Readout, Reset};

use super::ExportJob;
use super::run_folder::RunCamera;

/// The page, as it is put together.
pub(crate) struct Page {
    text: String,
}

impl Page {
    /// Begins with what it is and where it comes from.
    pub(crate) fn new(title: &str, job: &ExportJob<'_>) -> Self {
        let run = job.run;
        let manifest = run.manifest();
        let mut text = format!(
            "# {title}\n\nWritten by camsim {} from {} pictures of a run (seed {}). All of it is simulated; the truth \
             is exact.\n",
            manifest.version,
            run.frames(),
            manifest.seed
        );
        for (i, camera) in run.cameras.iter().enumerate().filter(|(_, camera)| !camera.name.is_empty()) {
            let _ = write!(text, "\n- cam{i}: camera `{}`", camera.name);
        }
        for name in &run.empty {
            let _ = write!(text, "\n- camera `{name}` has no frames in this run, and is skipped");
        }
        if run.cameras.len() + run.empty.len() > 1 {
            text.push('\n');
        }
        job.notes.iter().for_each(|note| {
            let _ = write!(text, "\n{note}\n");
        });
        text += "\n## Conventions\n\n| what | here |\n|---|---|\n";
        Self { text }
    }

    /// A line of the table of conventions.
    pub(crate) fn line(&mut self, what: &str, here: &str) -> &mut Self {
        let _ = writeln!(self.text, "| {what} | {here} |");
        self
    }

    /// When the rows of each camera are exposed.
    pub(crate) fn shutters(&mut self, job: &ExportJob<'_>) -> &mut Self {
        for (i, camera) in job.run.cameras.iter().enumerate() {
            self.line(&format!("shutter of cam{i}"), &timing(camera));
        }
        self
    }

    /// A paragraph after the table.
    pub(crate) fn note(&mut self, text: &str) -> &mut Self {
        let _ = write!(self.text, "\n{text}\n");
        self
    }

    /// The text, with paragraphs at its end.
    pub(crate) fn ending(&self, notes: &[String]) -> String {
        notes.iter().fold(self.text.clone(), |text, note| text + "\n" + note + "\n")
    }
}

/// World axes of every export.
pub(crate) const WORLD: &str = "x east, y north, z up, metres, from the run's origin; camsim's own are north, east, \
                                down: (x, y, z) = (e, n, -d)";
/// Optical axes.
pub(crate) const OPTICAL: &str = "x right, y down, z forward, as in camsim";
/// Masks of estimators.
pub(crate) const MASK: &str =
    "255 where the lens shows something, 0 elsewhere; without one it shows something everywhere";
/// Pixel coordinates as in OpenCV.
pub(crate) const PIXEL_CENTRE_0: &str =
    "(0, 0) is the centre of the first pixel, as in camsim and OpenCV; nothing is shifted";
/// Pixel coordinates from the corner.
pub(crate) const PIXEL_CENTRE_HALF: &str = "(0.5, 0.5) is the centre of the first pixel: 0.5 is added to camsim's cx, cy and to all pixel coordinates";

/// When rows are exposed, in words.
pub(crate) fn timing(camera: &RunCamera) -> String {
    let shutter = &camera.shutter;
    let [delay_ms, readout_ms] = [shutter.delay_s(), shutter.readout_s()].map(|s| 1e3 * s);
    let centre = if delay_ms == 0.0 {
        "the image's centre is exposed at the stamp (middle of the exposure)".to_owned()
    } else {
        format!("the image's centre is exposed {delay_ms} ms before the stamp (middle of the exposure)")
    };
    let offset_ms = camera.spec.clock_offset_ms;
    let centre = match offset_ms == 0.0 {
        true => centre,
        false => format!("{centre}, by the camera's own clock, which is {offset_ms} ms ahead of the run's"),
    };
    let centre = match camera.spec.timing {
        None => centre,
        Some(_) => format!(
            "{centre}; stamps have the faults of camera.timing, poses and trajectories the true times"
        ),
    };
    if readout_ms == 0.0 {
        return format!("{centre}; global shutter");
    }
    // With a global reset mid-exposures are half as far apart as rows are read.
    let (resets_globally, lines, direction) =
        (shutter.reset() == Reset::Global, shutter.lines(), direction(camera));
    let apart_ms = if resets_globally { 0.5 * readout_ms } else { readout_ms };
    let fraction = match camera.spec.shutter.readout {
        Readout::MiddleOutward => "(|2y + 1 - N| - 1)/N",
        Readout::EdgesInward => "(1 - |2y + 1 - N|)/N",
        _ => "((y + 0.5)/N - 0.5)",
    };
    let growing = match resets_globally {
        true => {
            format!("; exposures begin at once and are {readout_ms} ms longer from the first row to the last")
        }
        false => String::new(),
    };
    format!(
        "{centre}; row (or column) y of N = {lines} is exposed {fraction} {apart_ms} ms later, read \
         {direction}{growing}"
    )
}

fn direction(camera: &RunCamera) -> &'static str {
    match camera.spec.shutter.readout {
        Readout::TopToBottom => "from top to bottom",
        Readout::BottomToTop => "from bottom to top (y from there)",
        Readout::LeftToRight => "from left to right",
        Readout::RightToLeft => "from right to left (y from there)",
        Readout::MiddleOutward => "in halves at once, from the middle outward",
        Readout::EdgesInward => "in halves at once, from the edges inward",
    }
}
