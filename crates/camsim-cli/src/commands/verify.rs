//! `camsim verify`: the measured error of frames beside the predicted one.

use std::convert::Infallible;

use anyhow::anyhow;
use camsim_core::{
    reference::{
        CoordErrors, DEPTH_TOLERANCE, ErrorStats, Holes, IdealView, Judged, Oracle, RenderOptions,
        TruthErrors, coord_errors, holes, image_errors, silhouettes, truth_errors,
    },
    scenario::{Auto, Channel, Solver},
};
use camsim_gpu::{
    AdapterChoice, Engine,
    engine::{Finished, Session},
};
use camsim_plan::{FramePlan, Predicted};
use serde::Serialize;

use super::explain::{LevelOfDetail, level_of_detail};
use crate::{
    console::Console,
    failure::{Failure, OrFail},
    frame_list::FrameList,
    inputs::{self, ScenarioArgs},
};

/// Frames that are looked at if none are named.
const DEFAULT_FRAMES: u64 = 5;

/// Render frames with their plan and with the exact oracle, and show the measured error beside the predicted
/// one
///
/// The error is that of the source coordinates: how far from the point that a pixel's own ray meets at its
/// own instant the plan has looked, in pixels of the ideal frame. Pixels within 3 px of a silhouette, or
/// whose point the ideal frame does not see, are counted apart. With an exposure several of its instants are
/// measured and the worst is shown. The exit code is 1 if the 99th percentile of any frame is above
/// quality.max_error_px, and with --pictures if a picture is farther off than quality.max_error_dn. Beneath
/// stands how much of the picture shows what no ideal frame sees, as predicted and as found. Where less than
/// a twentieth of the pixels is away from silhouettes it is that of all pixels; where more than a hundredth
/// is missing or falsely valid, or none can be compared, there is none, and the tolerance is broken.
///
/// The terrain is drawn coarser than it is, by up to quality.max_terrain_error_px. The bound on that stands
/// in a column of its own: the measured errors of sources hold only what it does to parallax. What it does to
/// the picture is in the predicted error of that and measured by --pictures.
///
/// Depth and points (north, east, down) of every pixel, at silhouettes too, are compared with the surface
/// that the pixel's own ray meets. A depth or point that is off by more than 0.1 % of the depth, and that no
/// surface within quality.max_error_px of the pixel's centre has, is a fault: one is enough for exit code 1.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  camsim verify flight.toml                            five frames spread over the sequence
  camsim verify flight.toml --frames 0..10 --pictures  the light as well, against the oracle's own picture (slow)
  camsim verify flight.toml --set quality.max_error_px=0.001 --json")]
pub struct Args {
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Which frames: 7, 10..20 (without 20), 10..=20, 10.. or several with commas; five spread evenly if left
    /// out
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
    tolerance_dn: f64,
    /// Whether every frame keeps the tolerances: `quality.max_error_px`, and with pictures
    /// `quality.max_error_dn`.
    kept: bool,
    frames: Vec<Verified>,
}

#[derive(Serialize)]
struct Verified {
    frame: u64,
    predicted: Predicted,
    measured: Measured,
    /// Depths and points of all pixels; `None` where the solver tells where it looks and not what is there.
    truth: Option<Truth>,
    /// The terrain as drawn.
    level_of_detail: Option<LevelOfDetail>,
    /// Whether the 99th percentile that the frame is judged by is within the tolerance, and within the
    /// prediction.
    kept: bool,
    as_predicted: bool,
    picture: Option<Picture>,
    /// What the prediction for the picture leaves out.
    not_in_the_picture: Vec<String>,
}

#[derive(Serialize)]
struct Measured {
    /// Without those at silhouettes.
    smooth: Figures,
    silhouettes: Figures,
    all: Figures,
    /// Whose 99th percentile is held to the tolerance: "smooth", "all" where hardly any pixel is smooth, or
    /// "nothing" where too many are falsely valid or missing.
    judged_by: &'static str,
    falsely_valid: u64,
    missing: u64,
    /// Share of the picture that shows what no ideal frame sees.
    hole_share: f64,
}

/// Errors are shares of the depth; `null` where a surface is told for the sky or the sky for a surface.
#[derive(Serialize)]
struct Truth {
    /// Whether every depth and point belongs to a surface that the pixel may see.
    kept: bool,
    pixels: u64,
    /// Depths off by more than 0.1 %, and those among them that no surface near the pixel has.
    depth_beyond: u64,
    depth_faults: u64,
    depth_max: Option<f64>,
    points_beyond: u64,
    point_faults: u64,
    point_max: Option<f64>,
}

impl From<TruthErrors> for Truth {
    fn from(errors: TruthErrors) -> Self {
        let finite = |error: f64| error.is_finite().then_some(error);
        Self {
            kept: errors.kept(),
            pixels: errors.pixels,
            depth_beyond: errors.depth_beyond,
            depth_faults: errors.depth_faults,
            depth_max: finite(errors.depth_max),
            points_beyond: errors.points_beyond,
            point_faults: errors.point_faults,
            point_max: finite(errors.point_max),
        }
    }
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
    /// RMS over the whole picture, 1/255 of the linear range: what `quality.max_error_dn` bounds.
    rms_dn: f64,
    predicted_dn: f64,
    /// Whether that is within the tolerance.
    kept: bool,
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
    let scenario = args.scenario.read(console)?;
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
    check_size(scenario.camera.size_px, engine.most_pixels_with_truth())?;
    let adapter = engine.gpu().describe();
    let mut session = engine.session::<Infallible>(sequence.clone(), &[Channel::Color, Channel::Coords])?;
    let tolerance_px = scenario.quality.max_error_px;
    let tolerance_dn = scenario.quality.max_error_dn;
    let mut report = Report { adapter, tolerance_px, tolerance_dn, kept: true, frames: Vec::new() };
    if !args.json {
        let allowed_px = scenario.quality.max_terrain_error_px;
        console
            .line(format_args!("errors of source coordinates in px of the ideal frame; tolerance {tolerance_px} px (99th percentile)"))?;
        console.line(format_args!(
            "terrain off: bound on how far the drawn terrain is from the full one, px of the picture; quality.max_terrain_error_px allows {allowed_px}"
        ))?;
        console.line(HEADER)?;
    }
    for &frame in &frames {
        let verified = verify(frame, &mut session, &oracle, tolerance_px, args.pictures)?;
        report.kept &= verified.kept
            && verified.picture.as_ref().is_none_or(|picture| picture.kept)
            && verified.truth.as_ref().is_none_or(|truth| truth.kept);
        if !args.json {
            print(&verified, tolerance_dn, console)?;
        }
        report.frames.push(verified);
    }
    if args.json {
        console.json(&report)?;
    }
    if report.kept {
        return Ok(());
    }
    let frames_where = |is_broken: &dyn Fn(&Verified) -> bool| {
        let broken: Vec<String> = report
            .frames
            .iter()
            .filter(|frame| is_broken(frame))
            .map(|frame| frame.frame.to_string())
            .collect();
        broken.join(", ")
    };
    let of_truth = |frame: &Verified| frame.truth.as_ref().is_some_and(|truth| !truth.kept);
    if report.frames.iter().all(|frame| frame.kept) && report.frames.iter().any(of_truth) {
        let frames = frames_where(&of_truth);
        return Err(Failure::failed(anyhow!(
            "depths or points of frame {frames} belong to no surface within {tolerance_px} px of their pixel"
        )));
    }
    let Some(first) = report.frames.iter().find(|frame| !frame.kept) else {
        let frames = frames_where(&|frame| frame.picture.as_ref().is_some_and(|picture| !picture.kept));
        return Err(Failure::failed(anyhow!(
            "quality.max_error_dn = {tolerance_dn} is broken in frame {frames}"
        )));
    };
    let frames = frames_where(&|frame| !frame.kept);
    Err(Failure::failed(anyhow!(
        "the tolerance of {tolerance_px} px is broken in frame {frames}: {}",
        why_broken(first)
    )))
}

/// Coordinates are asked for here whatever `output.channels` says, so that leaving them out is no way out.
fn check_size(size_px: [u32; 2], most: u64) -> Result<(), Failure> {
    let [width, height] = size_px.map(u64::from);
    if width * height <= most {
        return Ok(());
    }
    Err(Failure::bad_input(anyhow!(
        "camera.size_px = [{width}, {height}] is {} pixels, and this adapter can measure at most {most} in one frame: make camera.size_px smaller, \
         and camera.focal_px and camera.principal_point_px in proportion",
        width * height
    )))
}

/// Of a frame whose tolerance is broken.
fn why_broken(frame: &Verified) -> String {
    let more = if is_more_than_predicted(frame.as_predicted, frame.measured.judged_by) {
        ", and the error is larger than predicted"
    } else {
        ""
    };
    match (&frame.predicted.in_the_way, frame.measured.judged_by) {
        (Some(cause), _) => format!("in the way is {cause}{more}"),
        (None, VOID) => {
            "too many pixels have a source only in one of the two pictures, or there is none".to_owned()
        }
        _ => "the plan did not expect it".to_owned(),
    }
}

/// Where there is no error to compare there is none larger.
fn is_more_than_predicted(as_predicted: bool, judged_by: &str) -> bool {
    !as_predicted && judged_by != VOID
}

/// Frames spread evenly, the first and the last among them.
fn spread(frames: u64) -> Vec<u64> {
    let count = frames.min(DEFAULT_FRAMES);
    (0..count).map(|i| if count > 1 { i * (frames - 1) / (count - 1) } else { 0 }).collect()
}

fn verify(
    frame: u64,
    session: &mut Session<'_>,
    oracle: &Oracle,
    tolerance_px: f64,
    pictures: bool,
) -> Result<Verified, Failure> {
    let first = at_phase(session, frame, 0.0)?;
    let mut errors = measure(oracle, &first, 0.0)?;
    for phase in phases(&first.plan) {
        let found = measure(oracle, &at_phase(session, frame, phase)?, f64::from(phase))?;
        if found.judged().p99_px() > errors.judged().p99_px() {
            errors = found;
        }
    }
    let judged = errors.judged();
    let p99_px = judged.p99_px();
    let picture = pictures.then(|| picture(oracle, &first));
    let hole_share = unseen(oracle, &first.plan).share();
    let is_exact = first.plan.tells_exact_truth();
    let truth = truth_errors(oracle, first.plan.frame, &first.frame, tolerance_px)
        .filter(|_| is_exact)
        .map(Truth::from);
    Ok(Verified {
        frame,
        level_of_detail: level_of_detail(oracle.sequence(), &first.plan),
        kept: p99_px <= tolerance_px,
        truth,
        as_predicted: p99_px <= first.plan.predicted.total_px,
        not_in_the_picture: first.plan.not_in_the_picture(),
        predicted: first.plan.predicted,
        measured: Measured {
            smooth: errors.smooth.into(),
            silhouettes: errors.silhouettes.into(),
            all: errors.all.into(),
            judged_by: match judged {
                Judged::Smooth(_) => "smooth",
                Judged::Everywhere(_) => "all",
                Judged::Void => VOID,
            },
            falsely_valid: errors.falsely_valid,
            missing: errors.missing,
            hole_share,
        },
        picture,
    })
}

/// Besides mid-exposure, which is solved for itself: the begin, the middles between two pairs of nodes, where
/// the path is off most, and two more.
fn phases(plan: &FramePlan) -> Vec<f32> {
    let Some(blur) = plan.blur else { return Vec::new() };
    let steps = f64::from(blur.solved() - 1);
    let middle_of = |share: f64| (((share * steps).floor() + 0.5) / steps - 0.5) as f32;
    // Exactly 0 would be mid-exposure. The last two are in step with no vibration.
    [-0.5, middle_of(0.25), middle_of(0.75), -0.309, 0.191]
        .map(|phase| if phase == 0.0 { 1e-4 } else { phase })
        .to_vec()
}

/// Over the exposure, if it shows: its middle and both ends, as the probes of the plan look.
fn unseen(oracle: &Oracle, plan: &FramePlan) -> Holes {
    let phases: &[f64] = if plan.blur.is_some() { &[-0.5, 0.0, 0.5] } else { &[0.0] };
    holes(oracle, plan.frame, &plan.key_poses(), phases)
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
    coord_errors(oracle, done.plan.frame, &done.plan.ideal_view(), &done.frame, phase, 1)
        .ok_or_else(|| Failure::failed(anyhow!("frame {} has no source coordinates", done.plan.frame)))
}

fn picture(oracle: &Oracle, done: &Finished) -> Picture {
    let key = IdealView { pose: done.plan.key_pose, ideal: done.plan.ideal };
    let truth = oracle.render(done.plan.frame, &RenderOptions { key: Some(key), ..RenderOptions::default() });
    let near = silhouettes(oracle, done.plan.frame, &[-0.5, 0.0, 0.5]);
    let finite = |db: f64| db.is_finite().then_some(db);
    let predicted = &done.plan.predicted;
    let predicted_dn = predicted.picture_dn();
    let tolerance_dn = oracle.sequence().scenario.quality.max_error_dn;
    match image_errors(&truth, &done.frame, &near) {
        Some(errors) => Picture {
            rms_dn: rms_dn(errors.all_db),
            predicted_dn,
            kept: rms_dn(errors.all_db) <= tolerance_dn,
            psnr_db: finite(errors.all_db),
            smooth_psnr_db: finite(errors.smooth_db),
            silhouettes_psnr_db: finite(errors.silhouettes_db),
            max: errors.max,
        },
        None => Picture {
            rms_dn: f64::NAN,
            predicted_dn,
            kept: false,
            psnr_db: None,
            smooth_psnr_db: None,
            silhouettes_psnr_db: None,
            max: f64::NAN,
        },
    }
}

/// Where no percentile stands for the frame.
const VOID: &str = "nothing";

const HEADER: &str = " frame |  predicted   measured        rms        max | at silhouettes        rms        max | falsely valid  missing | terrain off |";

fn print(verified: &Verified, tolerance_dn: f64, console: &mut Console<'_>) -> Result<(), Failure> {
    let Verified { frame, predicted, measured, .. } = verified;
    let Measured { smooth, silhouettes, all, judged_by, falsely_valid, missing, hole_share } = measured;
    let terrain_off = verified
        .level_of_detail
        .as_ref()
        .map_or_else(|| "-".to_owned(), |detail| format!("{:.3}", detail.max_error_px));
    let share = 100.0 * silhouettes.pixels as f64 / all.pixels.max(1) as f64;
    let verdict = verdict([verified.kept, verified.as_predicted, predicted.kept], judged_by);
    let why = match *judged_by {
        "all" => format!(": hardly a pixel away from silhouettes, {:.2e} px of all", all.p99_px),
        VOID => ": too many pixels without a source".to_owned(),
        _ => String::new(),
    };
    console.line(format_args!(
        "{frame:>6} | {:>10.2e} {:>10.2e} {:>10.2e} {:>10.2e} | {share:>12.1} % {:>10.2e} {:>10.2e} | {falsely_valid:>13} {missing:>8} | {terrain_off:>11} | {verdict}{why}",
        predicted.total_px, smooth.p99_px, smooth.rms_px, smooth.max_px, silhouettes.rms_px, silhouettes.max_px
    ))?;
    let Predicted { resampling_dn, blur_dn, displaced_dn, ground, layers, holes, .. } = predicted;
    let (surface_dn, layers_dn) =
        (ground.map_or(0.0, |ground| ground.surface_dn), layers.map_or(0.0, |layers| layers.error_dn));
    let expected = holes.map_or_else(
        || "nobody looks for them".to_owned(),
        |holes| format!("predicted {:.4} %", 100.0 * holes.share),
    );
    console.line(format_args!(
        "       | holes, hidden from every ideal frame: {expected}, measured {:.4} % of the picture",
        100.0 * hole_share
    ))?;
    if let Some(truth) = &verified.truth {
        console.line(format_args!("       | {}", describe_truth(truth)))?;
    }
    if let Some(Picture { rms_dn, predicted_dn, kept, psnr_db, smooth_psnr_db, silhouettes_psnr_db, max }) =
        &verified.picture
    {
        let db = |db: &Option<f64>| db.map_or_else(|| "-".to_owned(), |db| format!("{db:.2} dB"));
        let (all, smooth, silhouettes) = (db(psnr_db), db(smooth_psnr_db), db(silhouettes_psnr_db));
        console.line(format_args!(
            "       | picture: PSNR {all}, without silhouettes {smooth}, at silhouettes {silhouettes}, largest difference {max:.3}"
        ))?;
        let verdict = match (*kept, *predicted_dn > tolerance_dn) {
            (true, _) => "kept",
            (false, true) => "BROKEN as predicted",
            (false, false) => "BROKEN against the prediction",
        };
        console.line(format_args!(
            "       | in all {rms_dn:.3}/255 (RMS), predicted {predicted_dn:.3}: quality.max_error_dn = {tolerance_dn} is {verdict}; without silhouettes predicted {}",
            estimate(resampling_dn.hypot(*blur_dn).hypot(*displaced_dn).hypot(surface_dn).hypot(layers_dn))
        ))?;
        for cause in &verified.not_in_the_picture {
            console.line(format_args!("       | not in that prediction: {cause}"))?;
        }
    }
    Ok(())
}

fn describe_truth(truth: &Truth) -> String {
    let Truth { kept, pixels, depth_beyond, depth_faults, depth_max, points_beyond, point_faults, point_max } =
        truth;
    let largest = |error: &Option<f64>| {
        error.map_or_else(|| "sky for a surface".to_owned(), |error| format!("{:.3} %", 100.0 * error))
    };
    let percent = 100.0 * DEPTH_TOLERANCE;
    format!(
        "off by more than {percent} % of the depth, of {pixels} pixels: {depth_beyond} depths (largest error {}), {points_beyond} points (largest {}); of no surface near the pixel: {depth_faults} and {point_faults}: {}",
        largest(depth_max),
        largest(point_max),
        if *kept { "kept" } else { "BROKEN" }
    )
}

/// The tolerance and the prediction are kept or broken each by itself.
fn verdict([kept, as_predicted, predicted_kept]: [bool; 3], judged_by: &str) -> &'static str {
    match (kept, predicted_kept) {
        (true, _) if as_predicted => "kept",
        (true, _) => "kept, but more than predicted",
        (false, true) => "BROKEN against the prediction",
        (false, false) if is_more_than_predicted(as_predicted, judged_by) => {
            "BROKEN, and more than predicted"
        }
        (false, false) => "BROKEN as predicted",
    }
}

/// A PSNR as RMS error in 1/255.
fn rms_dn(psnr_db: f64) -> f64 {
    255.0 * 10_f64.powf(-psnr_db / 20.0)
}

/// An RMS error in 1/255 as PSNR.
fn estimate(rms_dn: f64) -> String {
    if rms_dn > 0.0 { format!("{:.2} dB", -20.0 * (rms_dn / 255.0).log10()) } else { "no error".to_owned() }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn no_error_is_said_in_words() {
        assert_eq!(estimate(2.55), "40.00 dB");
        assert_eq!(estimate(0.0), "no error");
        assert!((rms_dn(40.0) - 2.55).abs() < 1e-12 && rms_dn(f64::INFINITY) == 0.0);
    }

    #[test]
    fn what_is_broken_and_what_was_foreseen_are_told_apart() {
        assert_eq!(verdict([true, true, true], "smooth"), "kept");
        assert_eq!(verdict([true, false, true], "smooth"), "kept, but more than predicted");
        assert_eq!(verdict([false, false, true], "smooth"), "BROKEN against the prediction");
        assert_eq!(verdict([false, true, false], "all"), "BROKEN as predicted");
        assert_eq!(verdict([false, false, false], "smooth"), "BROKEN, and more than predicted");
        assert_eq!(verdict([false, false, false], VOID), "BROKEN as predicted");
    }

    #[test]
    fn a_picture_that_cannot_be_measured_is_refused_with_the_most_that_can() {
        assert!(check_size([2048, 2048], 4_194_304).is_ok());
        let error = check_size([4000, 3000], 4_194_304).unwrap_err().to_string();
        assert!(
            error.contains("12000000 pixels")
                && error.contains("at most 4194304")
                && !error.contains("output.channels"),
            "{error}"
        );
    }

    #[test]
    fn frames_are_spread_from_the_first_to_the_last() {
        assert_eq!(spread(1), [0]);
        assert_eq!(spread(3), [0, 1, 2]);
        assert_eq!(spread(101), [0, 25, 50, 75, 100]);
    }
}
