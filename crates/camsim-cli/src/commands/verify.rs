//! `camsim verify`: measured errors of frames against predicted ones.

mod planes;
mod report;

use std::{convert::Infallible, time::Duration};

use anyhow::anyhow;
use camsim_core::{
    reference::{
        CoordErrors, Disocclusion, ErrorVerdict, IdealView, Oracle, RenderOptions, coord_errors,
        disocclusion, image_errors, silhouettes, truth_errors,
    },
    scenario::{Auto, CameraSpec, Channel, Face, Solver},
    shutter::Shutter,
};
use camsim_engine::{Finished, Session};
use camsim_plan::{FramePlan, Planner, Predicted};
use indicatif::ProgressBar;

use super::explain::level_of_detail;
use crate::{
    backend::BackendArgs,
    console::Console,
    failure::{Failure, OrFail},
    frame_list::FrameList,
    inputs::{self, ScenarioArgs},
    progress::frames_bar,
};

use planes::{Planes, planes};
use report::{Measured, Picture, Truth, Verified, VerifyReport, describe_plane, describe_truth};

/// Number of frames to verify by default.
const DEFAULT_FRAMES: u64 = 5;

/// Number of instants of an exposure that are measured besides its middle.
const PHASES: usize = 5;

/// Channels from which errors of sources, depths and points are measured.
const MEASURED: [Channel; 2] = [Channel::Color, Channel::Coords];

/// Measure the errors of frames against the reference renderer, and compare them with the predicted errors
///
/// The source error is the distance, in pixels of the ideal frame, between the source that was used for a
/// pixel and that of its exact ray. Pixels within 3 px of a silhouette, and pixels whose point the ideal
/// frame does not show, are listed separately. With an exposure, several of its instants are measured, and
/// the worst is shown. The exit code is 1 if the 99th percentile of any frame is above quality.max_error_px,
/// and with --pictures if the picture error is above quality.max_error_dn. If fewer than one pixel in twenty
/// is away from silhouettes, the 99th percentile is that of all pixels. If more than one in a hundred is
/// missing or falsely valid, or none can be compared, there is no percentile and the tolerance is exceeded. A
/// second line shows the disoccluded share of the picture, predicted and measured.
///
/// The terrain is drawn at a level of detail within quality.max_terrain_error_px. The bound has its own
/// column, because the source errors contain only its effect on parallax. Its effect on the picture is part
/// of the predicted picture error, and --pictures measures it.
///
/// Depth and point (north, east, down) of every pixel, silhouettes included, are compared with the surface
/// that the pixel's exact ray hits. A depth or point that is off by more than 0.1 % of the depth is a fault
/// if no surface within quality.max_error_px of the pixel's centre has it. A single fault gives exit code 1.
/// The channels range, normal, normal_world, object and class are compared in the same way if output.channels
/// has them: a range may be off by 0.1 %, a normal by 0.1 degrees, and a number not at all. So are flow,
/// flow_back, flow_global, motion and blur_path in at most 20000 pixels of a frame: a displacement may be off
/// by 0.01 px, a velocity by 0.1 % and 0.05 px/s, a state not at all. Coverage is compared in about 4000
/// pixels, and may differ by 0.15, or more where an object is in a pixel that no pixel beside shows.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  camsim verify flight.toml                            five frames, evenly spread over the sequence
  camsim verify flight.toml --frames 0..10 --pictures  the picture error too, against reference frames (slow)
  camsim verify flight.toml --set quality.max_error_px=0.001 --json")]
pub struct VerifyArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Frames: 7, 10..20 (without 20), 10..=20, 10.. or several with commas [default: five, evenly spread]
    #[arg(long, value_name = "LIST", allow_hyphen_values = true)]
    frames: Option<FrameList>,
    /// Measure the picture error too; the reference renderer casts many rays per pixel
    #[arg(long)]
    pictures: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    backend: BackendArgs,
}

/// Measures and compares.
pub fn run(args: &VerifyArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let scenario = args.scenario.read(console)?;
    if scenario.quality.solver == Auto::Value(Solver::Oracle) {
        return Err(Failure::bad_input(anyhow!(
            "quality.solver is \"oracle\", the reference of this command: leave it out, or add --set \
             quality.solver=auto"
        )));
    }
    let loaded = inputs::load(&scenario, console)?;
    let sequence = &loaded.sequence;
    let frames = match &args.frames {
        Some(list) => list.resolve(sequence.frames).or_bad_input()?,
        None => spread(sequence.frames),
    };
    let engine = args.backend.open()?;
    check_size(scenario.camera.size_px, engine.most_pixels_with_truth())?;
    let adapter = engine.to_string();
    let planner =
        Planner::new(sequence.clone(), &scenario.output.channels, engine.max_side_px()).or_bad_input()?;
    let tolerance_px = scenario.quality.max_error_px;
    let tolerance_dn = scenario.quality.max_error_dn;
    let mut report = VerifyReport { adapter, tolerance_px, tolerance_dn, kept: true, frames: Vec::new() };
    if !args.json {
        let allowed_px = scenario.quality.max_terrain_error_px;
        console.line(format_args!(
            "source errors in px of the ideal frame; tolerance {tolerance_px} px (99th percentile)"
        ))?;
        console.line(format_args!(
            "terrain detail: bound on the displacement by the terrain's level of detail, output px; \
             quality.max_terrain_error_px = {allowed_px}"
        ))?;
        console.line(HEADER)?;
    }
    console.note(work(&scenario.camera, frames.len() * planner.lanes(), args.pictures));
    let bar = frames_bar((frames.len() * planner.lanes()) as u64, console.is_quiet());
    bar.enable_steady_tick(Duration::from_millis(500));
    // A face is verified as the camera that it is, in its own ideal frame.
    for lane in 0..planner.lanes() {
        let sequence = planner.lane(lane).sequence();
        let face = sequence.scenario.camera.face.map(Face::name);
        let oracle = Oracle::new(sequence.clone()).or_bad_input()?;
        let mut session = engine.session::<Infallible>(sequence.clone(), &MEASURED)?;
        if let Some(face) = face.filter(|_| !args.json) {
            bar.suspend(|| console.line(format_args!("face {face}")))?;
        }
        for &frame in &frames {
            let verified = verify(frame, face, &mut session, &oracle, tolerance_px, args.pictures, &bar)?;
            bar.inc(1);
            report.kept &= verified.kept
                && verified.picture.as_ref().is_none_or(|picture| picture.kept)
                && verified.truth.as_ref().is_none_or(|truth| truth.kept)
                && verified.planes.kept();
            if !args.json {
                bar.suspend(|| print(&verified, tolerance_dn, console))?;
            }
            report.frames.push(verified);
        }
    }
    bar.finish_and_clear();
    if args.json {
        console.json(&report)?;
    }
    if report.kept {
        return Ok(());
    }
    let frames_where = |is_exceeded: &dyn Fn(&Verified) -> bool| {
        let frames: Vec<String> = report
            .frames
            .iter()
            .filter(|frame| is_exceeded(frame))
            .map(|frame| frame.frame.to_string())
            .collect();
        frames.join(", ")
    };
    let has_truth_fault =
        |frame: &Verified| frame.truth.as_ref().is_some_and(|truth| !truth.kept) || !frame.planes.kept();
    if report.frames.iter().all(|frame| frame.kept) && report.frames.iter().any(has_truth_fault) {
        let frames = frames_where(&has_truth_fault);
        return Err(Failure::failed(anyhow!(
            "frame {frames}: depths, points or other truth belong to no surface within {tolerance_px} px of their \
             pixel"
        )));
    }
    let Some(first) = report.frames.iter().find(|frame| !frame.kept) else {
        let frames = frames_where(&|frame| frame.picture.as_ref().is_some_and(|picture| !picture.kept));
        return Err(Failure::failed(anyhow!(
            "frame {frames}: the picture error exceeds quality.max_error_dn = {tolerance_dn}"
        )));
    };
    let frames = frames_where(&|frame| !frame.kept);
    Err(Failure::failed(anyhow!(
        "frame {frames}: the source error exceeds the tolerance of {tolerance_px} px: {}",
        exceeded_reason(first)
    )))
}

/// How much there is to trace, as each pixel is traced by the reference renderer.
fn work(camera: &CameraSpec, pictures: usize, with_pictures: bool) -> String {
    let [width, height] = camera.size_px;
    let is_exposed = Shutter::longest_of(camera).is_ok_and(|shutter| shutter.exposure_s() > 0.0);
    let instants = if is_exposed { 1 + PHASES as u64 } else { 1 };
    let pixels = pictures as u64 * instants * u64::from(width) * u64::from(height);
    format!(
        "tracing {:.3} million pixels on the CPU: {pictures} picture{} of {width}x{height}{}{}",
        1e-6 * pixels as f64,
        if pictures == 1 { "" } else { "s" },
        if is_exposed { format!(" at up to {instants} instants of the exposure") } else { String::new() },
        if with_pictures { ", and many rays more of each pixel for --pictures" } else { "" }
    )
}

/// Checks the number of pixels. Coordinates are always rendered here, regardless of `output.channels`.
fn check_size(size_px: [u32; 2], most: u64) -> Result<(), Failure> {
    let [width, height] = size_px.map(u64::from);
    if width * height <= most {
        return Ok(());
    }
    Err(Failure::bad_input(anyhow!(
        "camera.size_px = [{width}, {height}] is {} pixels, and this adapter can measure at most {most} in \
         one frame: make camera.size_px smaller, and camera.focal_px and camera.principal_point_px in \
         proportion",
        width * height
    )))
}

/// Why a frame exceeds its tolerance.
fn exceeded_reason(frame: &Verified) -> String {
    let more = if is_more_than_predicted(frame.as_predicted, frame.measured.judged_by) {
        ", and the error is larger than predicted"
    } else {
        ""
    };
    match (&frame.predicted.source_error_obstacle, frame.measured.judged_by) {
        (Some(cause), _) => format!("limited by {cause}{more}"),
        (None, VOID) => {
            "too many pixels have a source in one of the two frames only, or none can be compared".to_owned()
        }
        _ => "this was not predicted".to_owned(),
    }
}

/// Whether the error exceeds the prediction; false without a measured error.
fn is_more_than_predicted(as_predicted: bool, judged_by: &str) -> bool {
    !as_predicted && judged_by != VOID
}

/// Evenly spread frames, including the first and the last.
fn spread(frames: u64) -> Vec<u64> {
    let count = frames.min(DEFAULT_FRAMES);
    (0..count).map(|i| if count > 1 { i * (frames - 1) / (count - 1) } else { 0 }).collect()
}

fn verify(
    frame: u64,
    face: Option<&'static str>,
    session: &mut Session<'_>,
    oracle: &Oracle,
    tolerance_px: f64,
    pictures: bool,
    bar: &ProgressBar,
) -> Result<Verified, Failure> {
    bar.set_message(format!("frame {frame} "));
    let first = render_at_phase(session, frame, 0.0)?;
    let mut errors = measure(oracle, &first, 0.0)?;
    let phases = phases(&first.plan);
    for (i, &phase) in phases.iter().enumerate() {
        bar.set_message(format!("frame {frame}, instant {} of {} ", i + 2, phases.len() + 1));
        let candidate = measure(oracle, &render_at_phase(session, frame, phase)?, f64::from(phase))?;
        if candidate.verdict().p99_px() > errors.verdict().p99_px() {
            errors = candidate;
        }
    }
    let verdict = errors.verdict();
    let p99_px = verdict.p99_px();
    let picture = pictures.then(|| {
        bar.set_message(format!("frame {frame}, picture "));
        picture(oracle, &first)
    });
    let disocclusion_share = disocclusion_of(oracle, &first.plan).share();
    let is_exact = first.plan.has_exact_truth();
    let truth = truth_errors(oracle, first.plan.frame, &first.frame, tolerance_px)
        .filter(|_| is_exact)
        .map(Truth::from);
    let planes = planes(frame, session, oracle, tolerance_px)?;
    Ok(Verified {
        frame,
        face,
        planes,
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
            judged_by: match verdict {
                ErrorVerdict::Smooth(_) => "smooth",
                ErrorVerdict::Everywhere(_) => "all",
                ErrorVerdict::Void => VOID,
            },
            falsely_valid: errors.falsely_valid,
            missing: errors.missing,
            disocclusion_share,
        },
        picture,
    })
}

/// Exposure phases to measure besides mid-exposure: the begin, the middles between two pairs of nodes, where
/// the path deviates most, and two more.
fn phases(plan: &FramePlan) -> Vec<f32> {
    let Some(blur) = plan.blur else { return Vec::new() };
    let steps = f64::from(blur.solved() - 1);
    let middle_of = |share: f64| (((share * steps).floor() + 0.5) / steps - 0.5) as f32;
    // Exactly 0 would be mid-exposure. The last two are incommensurate with vibrations.
    let phases: [f32; PHASES] = [-0.5, middle_of(0.25), middle_of(0.75), -0.309, 0.191];
    phases.map(|phase| if phase == 0.0 { 1e-4 } else { phase }).to_vec()
}

/// Disocclusion of a frame, at mid-exposure and, with motion blur, at both ends, like the planner's probes.
fn disocclusion_of(oracle: &Oracle, plan: &FramePlan) -> Disocclusion {
    let phases: &[f64] = if plan.blur.is_some() { &[-0.5, 0.0, 0.5] } else { &[0.0] };
    disocclusion(oracle, plan.frame, &plan.key_poses(), phases)
}

fn render_at_phase(session: &mut Session<'_>, frame: u64, phase: f32) -> Result<Finished, Failure> {
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

/// `judged_by` of a frame without a percentile.
const VOID: &str = "nothing";

const HEADER: &str = concat!(
    " frame |  predicted   measured        rms        max | at silhouettes        rms        max ",
    "| falsely valid  missing | terrain detail |"
);

fn print(verified: &Verified, tolerance_dn: f64, console: &mut Console<'_>) -> Result<(), Failure> {
    let Verified { frame, predicted, measured, .. } = verified;
    let Measured { smooth, silhouettes, all, judged_by, falsely_valid, missing, disocclusion_share } =
        measured;
    let terrain_off = verified
        .level_of_detail
        .as_ref()
        .map_or_else(|| "-".to_owned(), |detail| format!("{:.3}", detail.max_error_px));
    let share = 100.0 * silhouettes.pixels as f64 / all.pixels.max(1) as f64;
    let verdict = verdict([verified.kept, verified.as_predicted, predicted.source_error_kept], judged_by);
    let why = match *judged_by {
        "all" => format!(": hardly any pixel is away from silhouettes, {:.2e} px over all", all.p99_px),
        VOID => ": too many pixels without a source".to_owned(),
        _ => String::new(),
    };
    console.line(format_args!(
        "{frame:>6} | {:>10.2e} {:>10.2e} {:>10.2e} {:>10.2e} | {share:>12.1} % {:>10.2e} {:>10.2e} | \
         {falsely_valid:>13} {missing:>8} | {terrain_off:>14} | {verdict}{why}",
        predicted.total_px,
        smooth.p99_px,
        smooth.rms_px,
        smooth.max_px,
        silhouettes.rms_px,
        silhouettes.max_px
    ))?;
    let Predicted {
        resampling_dn, blur_dn, misregistration_dn, terrain, blended_depth, disocclusion, ..
    } = predicted;
    let surface_dn = terrain.map_or(0.0, |terrain| terrain.surface_dn);
    let blended_dn = blended_depth.map_or(0.0, |blended| blended.error_dn);
    let expected = disocclusion.map_or_else(
        || "not predicted".to_owned(),
        |disocclusion| format!("predicted {:.4} %", 100.0 * disocclusion.share),
    );
    console.line(format_args!(
        "       | disoccluded: {expected}, measured {:.4} % of the picture",
        100.0 * disocclusion_share
    ))?;
    if let Some(truth) = &verified.truth {
        console.line(format_args!("       | {}", describe_truth(truth)))?;
    }
    let Planes { planes, .. } = &verified.planes;
    for line in planes.iter().map(describe_plane).chain(planes::describe(&verified.planes)) {
        console.line(format_args!("       | {line}"))?;
    }
    if let Some(Picture { rms_dn, predicted_dn, kept, psnr_db, smooth_psnr_db, silhouettes_psnr_db, max }) =
        &verified.picture
    {
        let db = |db: &Option<f64>| db.map_or_else(|| "-".to_owned(), |db| format!("{db:.2} dB"));
        let (all, smooth, silhouettes) = (db(psnr_db), db(smooth_psnr_db), db(silhouettes_psnr_db));
        console.line(format_args!(
            "       | picture: PSNR {all}, away from silhouettes {smooth}, at silhouettes {silhouettes}, \
             largest difference {max:.3}"
        ))?;
        let verdict = match (*kept, *predicted_dn > tolerance_dn) {
            (true, _) => "kept",
            (false, true) => "EXCEEDED as predicted",
            (false, false) => "EXCEEDED, not predicted",
        };
        console.line(format_args!(
            "       | picture error {rms_dn:.3} DN (RMS), predicted {predicted_dn:.3}: quality.max_error_dn \
             = {tolerance_dn} is {verdict}; away from silhouettes, predicted {}",
            estimate(
                resampling_dn.hypot(*blur_dn).hypot(*misregistration_dn).hypot(surface_dn).hypot(blended_dn)
            )
        ))?;
        for cause in &verified.not_in_the_picture {
            console.line(format_args!("       | not predicted: {cause}"))?;
        }
    }
    Ok(())
}

/// Verdict on the tolerance and on the prediction.
fn verdict([kept, as_predicted, predicted_kept]: [bool; 3], judged_by: &str) -> &'static str {
    match (kept, predicted_kept) {
        (true, _) if as_predicted => "kept",
        (true, _) => "kept, but more than predicted",
        (false, true) => "EXCEEDED, not predicted",
        (false, false) if is_more_than_predicted(as_predicted, judged_by) => {
            "EXCEEDED, and more than predicted"
        }
        (false, false) => "EXCEEDED as predicted",
    }
}

/// Converts a PSNR to an RMS error in DN.
fn rms_dn(psnr_db: f64) -> f64 {
    255.0 * 10_f64.powf(-psnr_db / 20.0)
}

/// Converts an RMS error in DN to a PSNR.
fn estimate(rms_dn: f64) -> String {
    if rms_dn > 0.0 { format!("{:.2} dB", -20.0 * (rms_dn / 255.0).log10()) } else { "no error".to_owned() }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn no_error_is_written_in_words() {
        assert_eq!(estimate(2.55), "40.00 dB");
        assert_eq!(estimate(0.0), "no error");
        assert!((rms_dn(40.0) - 2.55).abs() < 1e-12 && rms_dn(f64::INFINITY) == 0.0);
    }

    #[test]
    fn verdicts_separate_tolerance_and_prediction() {
        assert_eq!(verdict([true, true, true], "smooth"), "kept");
        assert_eq!(verdict([true, false, true], "smooth"), "kept, but more than predicted");
        assert_eq!(verdict([false, false, true], "smooth"), "EXCEEDED, not predicted");
        assert_eq!(verdict([false, true, false], "all"), "EXCEEDED as predicted");
        assert_eq!(verdict([false, false, false], "smooth"), "EXCEEDED, and more than predicted");
        assert_eq!(verdict([false, false, false], VOID), "EXCEEDED as predicted");
    }

    #[test]
    fn too_large_frames_are_refused_with_the_limit() {
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
    fn the_work_is_told_in_pixels() {
        let mut camera = CameraSpec { size_px: [640, 480], ..CameraSpec::default() };
        camera.shutter.exposure_ms = 0.0;
        assert_eq!(work(&camera, 1, false), "tracing 0.307 million pixels on the CPU: 1 picture of 640x480");
        camera.shutter.exposure_ms = 5.0;
        let all = work(&camera, 5, true);
        assert!(
            all.starts_with("tracing 9.216 million pixels on the CPU: 5 pictures of 640x480 at up to 6"),
            "{all}"
        );
        assert!(all.ends_with("for --pictures"), "{all}");
    }

    #[test]
    fn frames_are_spread_from_the_first_to_the_last() {
        assert_eq!(spread(1), [0]);
        assert_eq!(spread(3), [0, 1, 2]);
        assert_eq!(spread(101), [0, 25, 50, 75, 100]);
    }
}
