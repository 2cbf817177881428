//! `camsim demo`: the built-in flight.

use std::{ops::ControlFlow, path::PathBuf, sync::Arc};

use camsim_core::{
    frame::RenderedFrame,
    mount::CameraPath,
    scenario::{Channel, LensSpec},
    sequence::Sequence,
};
use camsim_engine::Engine;
use camsim_io::{
    builtin,
    write::{WriteError, channel_pictures, contact_sheet},
};

use crate::{
    backend::BackendArgs,
    channel_sheet::write_channel_sheet,
    console::Console,
    failure::{Failure, OrFail},
    frame_source::EngineSource,
    inputs::{self, ScenarioArgs},
    render_run::{self, Job},
};

/// Every n-th frame of the built-in flight is rendered, so that its turn is covered within a few seconds.
const FRAME_STEP: usize = 4;
/// Number of thumbnails on the contact sheet, and per row.
const SHEET_FRAMES: usize = 12;
const SHEET_COLUMNS: u32 = 4;
/// Reduction factor of the thumbnails.
const SHEET_SHRINK: u32 = 2;

/// Channels of `channels.png`.
const SHEET_CHANNELS: [Channel; 12] = [
    Channel::Color,
    Channel::Depth,
    Channel::Range,
    Channel::Normal,
    Channel::NormalWorld,
    Channel::Object,
    Channel::Coverage,
    Channel::Flow,
    Channel::FlowBack,
    Channel::FlowGlobal,
    Channel::Motion,
    Channel::BlurPath,
];

/// Render the built-in flight; no input is needed
///
/// Writes EXR and PNG frames, a contact sheet, one frame of the perfect and the imperfect camera side by side,
/// and its truth channels in colour.
#[derive(Debug, clap::Args)]
pub struct DemoArgs {
    /// Output folder
    #[arg(short, long, value_name = "DIR", default_value = "camsim-demo")]
    output: PathBuf,
    #[command(flatten)]
    backend: BackendArgs,
}

/// Renders the built-in flight.
pub fn run(args: &DemoArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let folder = &args.output;
    // The adapter first: without one there is no need to read anything.
    let engine = args.backend.open()?;
    console.note(format_args!("rendering on {engine}"));
    let scene = builtin::unpack(&folder.join("scene")).or_failed()?;
    let scenario = ScenarioArgs {
        scenario: scene.clone(),
        changes: inputs::Changes::default(),
        camera: None,
        variation: None,
    }
    .read(console)?;
    let loaded = inputs::load(&scenario, console)?;
    let frames: Vec<u64> = (0..loaded.sequence.frames).step_by(FRAME_STEP).collect();
    let resume_command = console.command();
    let warnings = &loaded.warnings;
    let job = Job {
        variation: None,
        camera: None,
        sequence: &loaded.sequence,
        earth: loaded.log.frame,
        tracks: &loaded.tracks,
        sensors: Some(&loaded.sensors),
        folder,
        frames: &frames,
        shard: None,
        resume: false,
        warnings,
        resume_command: &resume_command,
    };
    let mut thumbnails = Vec::new();
    let every = (frames.len() / SHEET_FRAMES).max(1);
    let mut seen = 0;
    let outcome = render_run::run(
        &[job],
        None,
        &mut EngineSource::new(&engine, &loaded.sequence)?,
        console,
        &mut |_, finished| {
            if seen % every == 0 && thumbnails.len() < SHEET_FRAMES {
                thumbnails.push(finished.frame.clone());
            }
            seen += 1;
            ControlFlow::Continue(())
        },
    )?;
    let sheet = folder.join("contact-sheet.png");
    contact_sheet(&sheet, &thumbnails, SHEET_COLUMNS, SHEET_SHRINK).or_failed()?;
    let pair = folder.join("perfect-and-real.png");
    let middle = frames[frames.len() / 2];
    let flawless = Arc::new(without_flaws(&loaded.sequence)?);
    let only_color = [Channel::Color];
    let both = [&flawless, &loaded.sequence]
        .map(|sequence| render_one(&engine, sequence, &only_color, middle))
        .into_iter()
        .collect::<Result<Vec<_>, _>>()?;
    contact_sheet(&pair, &both, 2, 1).or_failed()?;
    let all = render_one(&engine, &loaded.sequence, &SHEET_CHANNELS, middle)?;
    let channels = write_channel_sheet(folder, channel_pictures(&all))?;

    let (seconds, folder_name) = (outcome.time.as_secs_f64(), folder.display());
    console.line(format_args!(
        "{} in {seconds:.2} s, {}, in {folder_name}",
        outcome.pictures(),
        outcome.rate()
    ))?;
    console.line(format_args!("  {}/   linear EXR and sRGB PNG", folder.join("color").display()))?;
    console.line(format_args!("  {}/    time and pose of each row", folder.join("rows").display()))?;
    console.line(format_args!("  {}   contact sheet of the flight", sheet.display()))?;
    console.line(format_args!(
        "  {}   frame {middle} without and with the camera's imperfections",
        pair.display()
    ))?;
    console.line(format_args!("  {}   what is true of its pixels, in colour", channels.display()))?;
    console.line("next")?;
    console.line(format_args!("  camsim explain {}", scene.display()))?;
    console
        .line(format_args!("  camsim render {} -o all --set camera.shutter.readout_ms=0", scene.display()))?;
    let how = if cfg!(feature = "viewer") {
        ""
    } else {
        "   after `cargo build --release`: this build has no window"
    };
    console.line(format_args!("  camsim viewer {}{how}", scene.display()))?;
    Ok(())
}

/// The same flight through a pinhole with an instant global shutter on a still mount, without noise and
/// vignette.
fn without_flaws(sequence: &Sequence) -> Result<Sequence, Failure> {
    let mut flawless = sequence.clone();
    let camera = &mut flawless.scenario.camera;
    camera.lens = LensSpec::default();
    camera.shutter = Default::default();
    camera.photometric.vignette = None;
    camera.photometric.noise_sigma = 0.0;
    camera.mount.vibration.clear();
    flawless.vignette = None;
    flawless.path =
        Arc::new(CameraPath::new(sequence.path.trajectory.clone(), &camera.mount).or_bad_input()?);
    Ok(flawless)
}

fn render_one(
    engine: &Engine,
    sequence: &Arc<Sequence>,
    channels: &[Channel],
    frame: u64,
) -> Result<RenderedFrame, Failure> {
    let mut rendered = RenderedFrame::default();
    let mut session = engine.session::<WriteError>(sequence.clone(), channels)?;
    session.render::<WriteError>([frame], &mut |finished| {
        rendered = finished.frame;
        Ok(())
    })?;
    Ok(rendered)
}
