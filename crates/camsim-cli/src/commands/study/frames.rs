//! The frames of a point.

use std::path::Path;

use anyhow::anyhow;
use camsim_core::scenario::DatasetFormat;

use super::Runner;
use crate::{
    commands::{export, render},
    console::Console,
    failure::{Failure, OrFail},
    frame_list::FrameList,
};
use camsim_lab::study::Point;

/// Renders what is missing of a point's frames, in the layout of the study.
pub fn render(
    runner: &Runner<'_>,
    point: &Point,
    data: &Path,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let study = runner.study;
    let frames = study.frames.as_deref().map(str::parse::<FrameList>).transpose().or_bad_input()?;
    let (changes, backend) = (runner.changes(point), runner.args.backend);
    match study.layout() {
        None => {
            let args =
                render::RenderArgs::of_scenario(runner.scenario(), data.to_owned(), frames, changes, backend);
            render::run(&args, console)
        }
        Some(name) => {
            let format = DatasetFormat::named(name).ok_or_else(|| {
                let known = DatasetFormat::NAMES.join(", ");
                Failure::bad_input(anyhow!("export = \"{name}\" is not a layout: there are {known}"))
            })?;
            let args = export::ExportArgs::of_scenario(
                runner.scenario(),
                format,
                data.to_owned(),
                frames,
                changes,
                backend,
            );
            export::run(&args, console)
        }
    }
}
