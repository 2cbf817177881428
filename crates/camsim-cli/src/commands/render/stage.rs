//! Renders one scenario after the other with one renderer.

use std::{cell::OnceCell, ops::ControlFlow, path::Path};

use anyhow::anyhow;
use camsim_core::{
    scenario::{DatasetFormat, Rig},
    sequence::Sequence,
};
use camsim_engine::{Engine, Finished};
use camsim_io::{
    load::Loaded,
    merge::write_checksums,
    scenario_file::VariationRecord,
    write::{Y4mStream, channel_pictures},
};

use super::{
    RenderArgs, RenderBackend,
    cameras::{chosen_cameras, frames_of_cameras, piped_camera},
    refuse_parts_of_videos, with_backend, with_outputs,
};
use crate::{
    backend,
    channel_sheet::write_channel_sheet,
    commands::export::{judge_lenses, with_needs},
    console::Console,
    failure::{FAILED, Failure, OrFail},
    frame_list::Shard,
    frame_source::{EngineSource, FrameSource, ReferenceSource, is_reference},
    inputs,
    render_run::{Outcome, Selected},
    times_table::TimesTable,
};

/// A scenario and its folder.
#[derive(Debug)]
pub struct Part<'p> {
    /// The scenario, as it is read.
    pub rig: Rig,
    /// Output folder.
    pub folder: &'p Path,
    /// Which variation it is.
    pub variation: Option<VariationRecord>,
    /// The dataset for which it is rendered, instead of its own.
    pub export: Option<DatasetFormat>,
    /// The fraction of its frames.
    pub shard: Option<Shard>,
}

/// What stays from one scenario to the next: the renderer, and files that were read.
pub struct Stage<'e> {
    engine: &'e OnceCell<Engine>,
    /// The renderer of frames, and whether it is the reference renderer.
    source: Option<(bool, Box<dyn FrameSource + 'e>)>,
    loaded: Vec<Loaded>,
    times: TimesTable,
}

impl<'e> Stage<'e> {
    /// `engine` is empty, and filled when it is needed.
    pub fn new(engine: &'e OnceCell<Engine>) -> Self {
        Self { engine, source: None, loaded: Vec::new(), times: TimesTable::default() }
    }

    /// Renders a scenario with all that its datasets need.
    pub fn render(
        &mut self,
        args: &RenderArgs,
        part: Part<'_>,
        console: &mut Console<'_>,
    ) -> Result<Outcome, Failure> {
        let Part { rig, folder, variation, export, shard } = part;
        let rig = rig.try_map(|scenario| {
            with_needs(with_backend(with_outputs(scenario, args)?, args.backend)?, export, console)
        })?;
        let cameras = chosen_cameras(&rig, &args.camera)?;
        judge_lenses(cameras.iter().map(|&camera| &rig.scenarios()[camera]), export)?;
        refuse_parts_of_videos(&rig, shard)?;
        let piped = piped_camera(args.pipe, &rig, &cameras)?;
        let is_quiet = console.is_quiet();
        let before = std::mem::take(&mut self.loaded);
        self.loaded =
            self.times.timed("scenario files", is_quiet, || inputs::load_cameras(&rig, &before, console))?;
        let selected = Selected {
            rig: &rig,
            loaded: &self.loaded,
            folder,
            frames: frames_of_cameras(args.frames.as_ref(), &cameras, &self.loaded, console)?,
            cameras,
            shard,
            resume: args.resume,
            resume_command: match export {
                Some(_) => console.command(),
                None => console.command_with("--resume"),
            },
            variation,
        };
        let sequence = selected.first();
        let source = open(self.engine, &mut self.source, sequence, args, (&mut self.times, is_quiet))?;
        console.detail(format_args!("adapter: {}", source.adapter()));
        let times = &mut self.times;
        let (fps, bits) = (sequence.scenario.camera.fps, sequence.scenario.output.video.bits);
        let mut pipe = args.pipe.then(|| Y4mStream::new(std::io::stdout(), fps, bits));
        let (mut broken_pipe, mut sheet) = (None, None);
        let mut on_frame = |name: Option<&str>, finished: &Finished| {
            times.add(name, &finished.times);
            if args.sheet && sheet.is_none() {
                sheet = Some(channel_pictures(&finished.frame));
            }
            let pipe = pipe.as_mut().filter(|_| name == piped);
            broken_pipe = pipe.and_then(|pipe| pipe.write(&finished.frame).err());
            if broken_pipe.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let outcome = selected.run(source, console, &mut on_frame);
        if let Some(error) = broken_pipe {
            return Err(anyhow!("--pipe: standard output takes no more frames: {error}")).or_failed();
        }
        let outcome = outcome.inspect_err(|failure| {
            if failure.code() == FAILED && folder.join("run.json").is_file() {
                let command = &selected.resume_command;
                console.note(format_args!("written frames are kept; to resume: {command}"));
            }
        })?;
        if let Some(pictures) = sheet {
            write_channel_sheet(folder, pictures)?;
        }
        if args.checksums {
            write_checksums(folder).or_failed()?;
        }
        Ok(outcome)
    }

    /// Prints a summary and, if asked for, the times.
    pub fn report(
        &mut self,
        args: &RenderArgs,
        outcome: &Outcome,
        summary: &str,
        console: &mut Console<'_>,
    ) -> Result<(), Failure> {
        if !console.is_quiet() {
            if args.pipe { console.note(summary) } else { console.line(summary)? }
        }
        if args.times {
            self.times.add_start("plan of the first frame", outcome.first_plan);
            console.print(&self.times.text())?;
        }
        Ok(())
    }
}

/// Turns the renderer to a sequence, or opens one.
fn open<'s, 'e>(
    engine: &'e OnceCell<Engine>,
    slot: &'s mut Option<(bool, Box<dyn FrameSource + 'e>)>,
    sequence: &std::sync::Arc<Sequence>,
    args: &RenderArgs,
    (times, is_quiet): (&mut TimesTable, bool),
) -> Result<&'s mut dyn FrameSource, Failure> {
    let is_exact = is_reference(&sequence.scenario);
    match slot {
        Some((exact, source)) if *exact == is_exact => {
            times.timed("scene upload", is_quiet, || source.renew(sequence))?;
        }
        _ if is_exact => {
            let opened =
                times.timed("ray-casting structures", is_quiet, || ReferenceSource::new(sequence))?;
            *slot = Some((true, Box::new(opened)));
        }
        _ => {
            if engine.get().is_none() {
                let renderer = args.backend.and_then(RenderBackend::renderer);
                let opened = times.timed("adapter", is_quiet, || backend::open(renderer))?;
                let _ = engine.set(opened);
            }
            let Some(engine) = engine.get() else { return Err(anyhow!("no renderer")).or_failed() };
            let mut opened = times.timed("scene upload", is_quiet, || EngineSource::new(engine, sequence))?;
            if args.times {
                opened.time_passes();
            }
            *slot = Some((false, Box::new(opened)));
        }
    }
    match slot {
        Some((_, source)) => Ok(&mut **source),
        None => Err(anyhow!("no renderer")).or_failed(),
    }
}
