//! The frames of a point.

use std::path::PathBuf;

use anyhow::anyhow;
use camsim_core::scenario::DatasetFormat;
use camsim_lab::study::Study;

use crate::{
    commands::{
        export::{self, ExportArgs},
        render::{self, RenderArgs, RenderBackend},
    },
    console::Console,
    failure::{Failure, OrFail},
    frame_list::FrameList,
    inputs::Changes,
};

/// Which frames a study renders, and in which layout.
pub struct Frames {
    list: Option<FrameList>,
    layout: Option<DatasetFormat>,
    backend: Option<RenderBackend>,
}

impl Frames {
    /// Those of a study.
    pub fn of(study: &Study, backend: Option<RenderBackend>) -> Result<Self, Failure> {
        let list = study.frames.as_deref().map(str::parse).transpose().or_bad_input()?;
        let layout = |name: &str| {
            let known = DatasetFormat::NAMES.join(", ");
            let unknown = || anyhow!("export = \"{name}\" is not a layout: there are {known}");
            DatasetFormat::named(name).ok_or_else(unknown).or_bad_input()
        };
        Ok(Self { list, layout: study.layout().map(layout).transpose()?, backend })
    }

    /// Renders what is missing of a scenario's frames.
    pub fn render(
        &self,
        scenario: PathBuf,
        changes: Changes,
        data: PathBuf,
        console: &mut Console<'_>,
    ) -> Result<(), Failure> {
        let (list, backend) = (self.list.clone(), self.backend);
        match self.layout {
            None => render::run(&RenderArgs::of_scenario(scenario, data, list, changes, backend), console),
            Some(layout) => {
                export::run(&ExportArgs::of_scenario(scenario, layout, data, list, changes, backend), console)
            }
        }
    }
}
