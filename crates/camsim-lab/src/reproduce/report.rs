//! Results of an experiment, and their files.

use std::path::{Path, PathBuf};

use camsim_core::frame::RenderedFrame;
use camsim_io::write::{contact_sheet, write_atomic};

use super::{ReproduceError, table::Table};
use crate::plot::Plot;

/// Frames side by side.
#[derive(Clone, Debug)]
pub struct Picture {
    /// File name without extension.
    pub name: &'static str,
    /// Caption; `(a)`, `(b)` ... count the frames by rows.
    pub caption: String,
    /// Frames of one size.
    pub frames: Vec<RenderedFrame>,
    /// Number of frames in a row.
    pub columns: u32,
    /// Reduction factor.
    pub shrink: u32,
}

/// Result of an experiment.
#[derive(Clone, Debug, Default)]
pub struct ExperimentReport {
    /// Notes on inputs and methods.
    pub notes: Vec<String>,
    /// Tables, with the names of their files.
    pub tables: Vec<(&'static str, Table)>,
    /// Plots, with the names of their files.
    pub plots: Vec<(&'static str, Plot)>,
    /// Pictures.
    pub pictures: Vec<Picture>,
}

impl ExperimentReport {
    /// Writes each table as CSV, each plot as SVG, each picture as PNG (invalid pixels are red, as in the
    /// paper), and `report.md` with `title`. Returns the paths of the files.
    ///
    /// # Errors
    /// A file cannot be written, or a plot has no point.
    pub fn write(&self, folder: &Path, title: &str) -> Result<Vec<PathBuf>, ReproduceError> {
        let mut files = Vec::new();
        for (name, table) in &self.tables {
            files.push(folder.join(format!("{name}.csv")));
            write_atomic(&folder.join(format!("{name}.csv")), table.csv().as_bytes())?;
        }
        for (name, plot) in &self.plots {
            files.push(folder.join(format!("{name}.svg")));
            write_atomic(&folder.join(format!("{name}.svg")), plot.svg()?.as_bytes())?;
        }
        for picture in &self.pictures {
            let frames: Vec<RenderedFrame> = picture.frames.iter().map(with_red_invalid_pixels).collect();
            files.push(folder.join(format!("{}.png", picture.name)));
            contact_sheet(
                &folder.join(format!("{}.png", picture.name)),
                &frames,
                picture.columns,
                picture.shrink,
            )?;
        }
        files.push(folder.join("report.md"));
        write_atomic(&folder.join("report.md"), self.markdown(title).as_bytes())?;
        Ok(files)
    }

    /// The report as Markdown, with links to the files of plots and pictures.
    #[must_use]
    pub fn markdown(&self, title: &str) -> String {
        let mut text = format!("# {title}\n");
        for note in &self.notes {
            text += &format!("\n{note}\n");
        }
        for (_, table) in &self.tables {
            text += &format!("\n{}", table.markdown());
        }
        for (name, plot) in &self.plots {
            text += &format!("\n![{}]({name}.svg)\n", plot.title);
        }
        for picture in &self.pictures {
            text += &format!("\n![{}]({}.png)\n\n{}\n", picture.name, picture.name, picture.caption);
        }
        text
    }
}

/// The frame with invalid pixels in red, as in the paper.
fn with_red_invalid_pixels(frame: &RenderedFrame) -> RenderedFrame {
    let mut frame = frame.clone();
    for pixel in frame.color_rgba_mut().chunks_exact_mut(4).filter(|pixel| pixel[3] <= 0.0) {
        pixel.copy_from_slice(&[1.0, 0.0, 0.0, 1.0]);
    }
    frame
}
