//! What an experiment gives, and its files.

use std::path::{Path, PathBuf};

use camsim_core::frame::RenderedFrame;
use camsim_io::write::{contact_sheet, write_atomic};

use super::{ReproduceError, table::Table};
use crate::plot::Plot;

/// Frames side by side.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Name of its file, without extension.
    pub name: &'static str,
    /// What it shows; `(a)`, `(b)` ... count its frames by rows.
    pub caption: String,
    /// The frames, of one size.
    pub frames: Vec<RenderedFrame>,
    /// How many stand side by side.
    pub columns: u32,
    /// By how much they are made smaller.
    pub shrink: u32,
}

/// Result of an experiment.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// What to know before reading on.
    pub notes: Vec<String>,
    /// Tables, with the names of their files.
    pub tables: Vec<(&'static str, Table)>,
    /// Plots, with the names of their files.
    pub plots: Vec<(&'static str, Plot)>,
    /// Pictures.
    pub pictures: Vec<Picture>,
}

impl Report {
    /// Writes every table as CSV, every plot as SVG, every picture as PNG (pixels without a ray are red, as
    /// in the paper), and all of it as `report.md` under `title`. Gives the files.
    ///
    /// # Errors
    /// A file cannot be written, or there is nothing to plot.
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
            let frames: Vec<RenderedFrame> = picture.frames.iter().map(with_red_void).collect();
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

    /// Everything as Markdown; plots and pictures are named by their files.
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

/// The paper's red where no ray exists.
fn with_red_void(frame: &RenderedFrame) -> RenderedFrame {
    let mut frame = frame.clone();
    for pixel in frame.color_rgba.chunks_exact_mut(4).filter(|pixel| pixel[3] <= 0.0) {
        pixel.copy_from_slice(&[1.0, 0.0, 0.0, 1.0]);
    }
    frame
}
