//! `README.md` of an export: which convention it turned how.

use std::fmt::Write as _;

use super::ExportJob;

/// The page, as it is put together.
pub(super) struct Page {
    text: String,
}

impl Page {
    /// Begins with what it is and where it comes from.
    pub(super) fn new(title: &str, job: &ExportJob<'_>) -> Self {
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
            let _ = write!(text, "\n- camera `{name}` has no frames in this run, and is left out");
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
    pub(super) fn line(&mut self, what: &str, here: &str) -> &mut Self {
        let _ = writeln!(self.text, "| {what} | {here} |");
        self
    }

    /// A paragraph after the table.
    pub(super) fn note(&mut self, text: &str) -> &mut Self {
        let _ = write!(self.text, "\n{text}\n");
        self
    }

    pub(super) fn text(&self) -> &str {
        &self.text
    }
}

/// World axes of every export.
pub(super) const WORLD: &str = "x east, y north, z up, metres, from the run's origin; camsim's own are north, east, \
                                down: (x, y, z) = (e, n, -d)";
/// Optical axes.
pub(super) const OPTICAL: &str = "x right, y down, z forward, as in camsim";
/// Pixel coordinates as in OpenCV.
pub(super) const PIXEL_CENTRE_0: &str =
    "(0, 0) is the centre of the first pixel, as in camsim and OpenCV; nothing is shifted";
/// Pixel coordinates from the corner.
pub(super) const PIXEL_CENTRE_HALF: &str = "(0.5, 0.5) is the centre of the first pixel: 0.5 is added to camsim's cx, cy and to all pixel coordinates";
