//! `channels.png`: the channels of a frame as pictures on one sheet.

use std::path::{Path, PathBuf};

use camsim_core::{frame::RenderedFrame, scenario::Channel};
use camsim_io::write::contact_sheet;

use crate::failure::{Failure, OrFail};

/// Pictures in a row, and their reduction.
const COLUMNS: u32 = 4;
const SHRINK: u32 = 2;

/// Writes `channels.png` into a folder, and returns its path.
pub fn write_channel_sheet(
    folder: &Path,
    pictures: Vec<(Channel, RenderedFrame)>,
) -> Result<PathBuf, Failure> {
    let path = folder.join("channels.png");
    let pictures: Vec<RenderedFrame> = pictures.into_iter().map(|(_, picture)| picture).collect();
    contact_sheet(&path, &pictures, COLUMNS, SHRINK).or_failed()?;
    Ok(path)
}
