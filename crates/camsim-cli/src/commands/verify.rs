//! `camsim verify`: the measured error of frames beside the predicted one.

use std::convert::Infallible;

use anyhow::anyhow;
use camsim_core::{
    plan::{FramePlan, Predicted},
    reference::{CoordErrors, ErrorStats, KeyFrame, Oracle, RenderOptions, coord_errors, image_errors, silhouettes},
    scenario::{Auto, Channel, Solver},
};
use camsim_gpu::{
    AdapterChoice, Engine,
    engine::{Finished, Session},
};
use serde::Serialize;

use crate::{
    console::Console,
    failure::{Failure, OrFail},
    frame_list::FrameList,
    inputs::{self, ScenarioArgs},
};

/// Frames that are looked at if none are named.
const DEFAULT_FRAMES: u64 = 5;

/// Render frames with their plan and with the exact oracle, and show the measured error beside the predicted one
///
/// The error is that of the source coordinates: how far from the point that a pixel's own ray meets at its own instant the plan has looked,
/// in pixels of the ideal frame. Pixels within 3 px of a silhouette, or whose point the ideal frame does not see, are counted apart. With an
/// exposure several of its instants are measured and the worst is shown. The exit code is 1 if the 99th percentile of any frame is
/// above quality.max_error_px.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  camsim verify flight.toml                            five frames spread over the sequence
  camsim verify flight.toml --frames 0..10 --pictures  the light as well, against the oracle's own picture (slow)
  camsim verify flight.toml --set quality.max_error_px=0.001 --json")]
pub struct Args {
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Which frames: 7, 10..20 (without 20), 10..=20, 10.. or several with commas; five spread evenly if left out
    #[arg(long, value_name = "LIST")]
    frames: Option<FrameList>,
    /// Compare the picture too: the oracle renders it, many rays a pixel
    #[arg(long)]
    pictures: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Report {
    adapter: String,
    tolerance_px: f64,
    /// Whether every frame keeps the tolerance.
    kept: bool,
    frames: Vec<Verified>,
}

#[derive(Serialize)]
struct Verified {
    frame: u64,
    predicted: Predicted,
    measured: Measured,
    /// Whether the measured 99th percentile is within the tolerance, and within the prediction.
    kept: bool,
    as_predicted: bool,
    picture: Option<Picture>,
}

#[derive(Serialize)]
struct Measured {
    /// Without those at silhouettes.
    smooth: Figures,
    silhouettes: Figures,
    all: Figures,
    falsely_valid: u64,
    missing: u64,
}

#[derive(Serialize)]
struct Figures {
    pixels: u64,
    rms_px: f64,
    p99_px: f64,
    max_px: f64,
}

/// PSNR in dB on linear values, peak 1; `null` where there are no pixels or no difference.
#[derive(Serialize)]
struct Picture {
    psnr_db: Option<f64>,
    smooth_psnr_db: Option<f64>,
    silhouettes_psnr_db: Option<f64>,
    max: f64,
}

impl From<ErrorStats> for Figures {
    fn from(stats: ErrorStats) -> Self {
        Self { pixels: stats.count, rms_px: stats.rms_px, p99_px: stats.p99_px, max_px: stats.max_px }
    }
}

/// Measures and compares.
pub fn run(args: &Args, console: &mut Console<'_>) -> Result<(), Failure> {
    let scenario = args.scenario.read()?;
    if scenario.quality.solver == Auto::Value(Solver::Oracle) {
        return Err(Failure::bad_input(anyhow!(
            "quality.solver is \"oracle\", which is what plans are verified against: leave it out, or add --set quality.solver=auto"
        )));
    }
    let loaded = inputs::load(&scenario, console)?;
    let sequence = &loaded.sequence;
    let frames = match &args.frames {
        Some(list) => list.resolve(sequence.frames).or_bad_input()?,
        None => spread(sequence.frames),
    };
    let oracle = Oracle::new(sequence.clone()).or_bad_input()?;
    let engine = Engine::new(AdapterChoice::Best)?;
    let adapter = engine.gpu().adapter.to_string();
    let mut session = engine.session::<Infallible>(sequence.clone(), &[Channel::Color, Channel::Coords])?;
    let tolerance_px = scenario.quality.max_error_px;
    let mut report = Report { adapter, tolerance_px, kept: true, frames: Vec::new() };
    if !args.json {
        console
            .line(format_args!("errors of source coordinates in px of the ideal frame; tolerance {tolerance_px} px (99th percentile)"))?;
        console.line(HEADER)?;
    }
    for &frame in &frames {
        let verified = verify(frame, &mut session, &oracle, tolerance_px, args.pictures)?;
        report.kept &= verified.kept;
        if !args.json {
            print(&verified, console)?;
        }
        report.frames.push(verified);
    }
    if args.json {
        console.json(&report)?;
    }
    if report.kept {
        return Ok(());
    }
    let broken: Vec<String> = report.frames.iter().filter(|frame| !frame.kept).map(|frame| frame.frame.to_string()).collect();
    let planned = report.frames.iter().find(|frame| !frame.kept).and_then(|frame| frame.predicted.in_the_way.clone());
    let why = planned.map_or_else(|| "the plan did not expect it".to_owned(), |cause| format!("in the way is {cause}"));
    Err(Failure::failed(anyhow!("the tolerance of {tolerance_px} px is broken in frame {}: {why}", broken.join(", "))))
}

/// Frames spread evenly, the first and the last among them.
fn spread(frames: u64) -> Vec<u64> {
    let count = frames.min(DEFAULT_FRAMES);
    (0..count).map(|i| if count > 1 { i * (frames - 1) / (count - 1) } else { 0 }).collect()
}

fn verify(frame: u64, session: &mut Session<'_>, oracle: &Oracle, tolerance_px: f64, pictures: bool) -> Result<Verified, Failure> {
    let first = at_phase(session, frame, 0.0)?;
    let mut errors = measure(oracle, &first, 0.0)?;
    for phase in phases(&first.plan) {
        let found = measure(oracle, &at_phase(session, frame, phase)?, f64::from(phase))?;
        if found.smooth.p99_px > errors.smooth.p99_px {
            errors = found;
        }
    }
    let p99_px = errors.smooth.p99_px;
    let picture = pictures.then(|| picture(oracle, &first));
    Ok(Verified {
        frame,
        kept: p99_px <= tolerance_px,
        as_predicted: p99_px <= first.plan.predicted.total_px,
        predicted: first.plan.predicted,
        measured: Measured {
            smooth: errors.smooth.into(),
            silhouettes: errors.silhouettes.into(),
            all: errors.all.into(),
            falsely_valid: errors.falsely_valid,
            missing: errors.missing,
        },
        picture,
    })
}

/// Besides mid-exposure, which is solved for itself: the begin, and the middles of two straight stretches of the path.
fn phases(plan: &FramePlan) -> Vec<f32> {
    let Some(blur) = plan.blur else { return Vec::new() };
    let segments = f64::from(blur.nodes - 1);
    let middle_of = |share: f64| (((share * segments).floor() + 0.5) / segments - 0.5) as f32;
    // Exactly 0 would be mid-exposure.
    [-0.5, middle_of(0.25), middle_of(0.75)].map(|phase| if phase == 0.0 { 1e-4 } else { phase }).to_vec()
}

fn at_phase(session: &mut Session<'_>, frame: u64, phase: f32) -> Result<Finished, Failure> {
    session.set_coords_phase(phase);
    let mut finished = None;
    session.render::<Infallible>([frame], &mut |done| {
        finished = Some(done);
        Ok(())
    })?;
    finished.ok_or_else(|| Failure::failed(anyhow!("frame {frame} was not rendered")))
}

fn measure(oracle: &Oracle, done: &Finished, phase: f64) -> Result<CoordErrors, Failure> {
    coord_errors(oracle, &done.plan, &done.frame, phase, 1)
        .ok_or_else(|| Failure::failed(anyhow!("frame {} has no source coordinates", done.plan.frame)))
}

fn picture(oracle: &Oracle, done: &Finished) -> Picture {
    let key = KeyFrame { pose: done.plan.key_pose, ideal: done.plan.ideal };
    let truth = oracle.render(done.plan.frame, &RenderOptions { key: Some(key), ..RenderOptions::default() });
    let near = silhouettes(oracle, done.plan.frame, &[-0.5, 0.0, 0.5]);
    let finite = |db: f64| db.is_finite().then_some(db);
    match image_errors(&truth, &done.frame, &near) {
        Some(errors) => Picture {
            psnr_db: finite(errors.all_db),
            smooth_psnr_db: finite(errors.smooth_db),
            silhouettes_psnr_db: finite(errors.silhouettes_db),
            max: errors.max,
        },
        None => Picture { psnr_db: None, smooth_psnr_db: None, silhouettes_psnr_db: None, max: f64::NAN },
    }
}

const HEADER: &str =
    " frame |  predicted   measured        rms        max | at silhouettes        rms        max | falsely valid  missing |";

fn print(verified: &Verified, console: &mut Console<'_>) -> Result<(), Failure> {
    let Verified { frame, predicted, measured, .. } = verified;
    let Measured { smooth, silhouettes, all, falsely_valid, missing } = measured;
    let share = 100.0 * silhouettes.pixels as f64 / all.pixels.max(1) as f64;
    let verdict = match (verified.kept, verified.as_predicted) {
        (true, true) => "kept",
        (true, false) => "kept, but more than predicted",
        (false, _) if predicted.kept => "BROKEN against the prediction",
        (false, _) => "BROKEN as predicted",
    };
    console.line(format_args!(
        "{frame:>6} | {:>10.2e} {:>10.2e} {:>10.2e} {:>10.2e} | {share:>12.1} % {:>10.2e} {:>10.2e} | {falsely_valid:>13} {missing:>8} | {verdict}",
        predicted.total_px, smooth.p99_px, smooth.rms_px, smooth.max_px, silhouettes.rms_px, silhouettes.max_px
    ))?;
    let Predicted { resampling_dn, blur_dn, .. } = predicted;
    if let Some(Picture { psnr_db, smooth_psnr_db, silhouettes_psnr_db, max }) = &verified.picture {
        let db = |db: &Option<f64>| db.map_or_else(|| "-".to_owned(), |db| format!("{db:.2} dB"));
        let (all, smooth, silhouettes) = (db(psnr_db), db(smooth_psnr_db), db(silhouettes_psnr_db));
        console.line(format_args!(
            "       | picture: PSNR {all}, without silhouettes {smooth}, at silhouettes {silhouettes}, largest difference {max:.3}"
        ))?;
        // 1/255 RMS; the two estimates are independent of each other.
        let estimate_db = -20.0 * (resampling_dn.hypot(*blur_dn) / 255.0).log10();
        console.line(format_args!("       | estimated without silhouettes: {estimate_db:.2} dB"))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_spread_from_the_first_to_the_last() {
        assert_eq!(spread(1), [0]);
        assert_eq!(spread(3), [0, 1, 2]);
        assert_eq!(spread(101), [0, 25, 50, 75, 100]);
    }
}
