//! `camsim verify`: measured errors of frames against predicted ones.

mod lines;

use std::time::Duration;

use anyhow::anyhow;
use camsim_core::{
    scenario::{Auto, CameraSpec, Solver},
    shutter::Shutter,
};
use camsim_engine::verify::{
    FrameReport, JudgedBy, MOST_INSTANTS, Measured, PictureReport, Progress, Verification, VerifyError,
    VerifyReport,
};
use camsim_plan::Predicted;

use crate::{
    backend::BackendArgs,
    console::Console,
    failure::{Failure, OrFail},
    frame_list::FrameList,
    inputs::{self, ScenarioArgs},
    progress::frames_bar,
};

use lines::{channel_lines, describe_truth};

/// Measure the errors of frames against the reference renderer, and compare them with the predicted errors
///
/// The source error is the distance, in pixels of the ideal frame, between the source that was used for a
/// pixel and that of its exact ray. Pixels within 3 px of a silhouette, and pixels whose point the ideal
/// frame does not show, are listed separately. With an exposure, several of its instants are measured, and
/// the worst is shown. The exit code is 1 if the 99th percentile of any frame is above quality.max_error_px,
/// and with --pictures if the picture error is above quality.max_error_dn. If fewer than one pixel in twenty
/// is away from silhouettes, the 99th percentile is that of all pixels. If more than one in a hundred is
/// missing or falsely valid, or none can be compared, there is no percentile and the tolerance is exceeded. A
/// second line shows the disoccluded fraction of the picture, predicted and measured.
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
    if scenario.quality.solver == Auto::Value(Solver::Reference) {
        return Err(VerifyError::Solver.into());
    }
    let loaded = inputs::load(&scenario, console)?;
    let sequence = &loaded.sequence;
    let frames = args.frames.as_ref().map(|list| list.resolve(sequence.frames)).transpose().or_bad_input()?;
    let engine = args.backend.open()?;
    let verification = Verification::new(&engine, sequence, frames, args.pictures)?;
    if !args.json {
        let (allowed_px, allowed_terrain_px) =
            (scenario.quality.max_error_px, scenario.quality.max_terrain_error_px);
        console.line(format_args!(
            "source errors in px of the ideal frame; tolerance {allowed_px} px (99th percentile)"
        ))?;
        console.line(format_args!(
            "terrain detail: bound on the displacement by the terrain's level of detail, output px; \
             quality.max_terrain_error_px = {allowed_terrain_px}"
        ))?;
        console.line(HEADER)?;
    }
    console.note(work(&scenario.camera, verification.pictures(), args.pictures));
    let bar = frames_bar(verification.pictures() as u64, console.is_quiet());
    bar.enable_steady_tick(Duration::from_millis(500));
    let report = verification.run::<Failure>(&mut |progress| {
        match progress {
            Progress::Step(what) => bar.set_message(format!("{what} ")),
            Progress::Face(face) if !args.json => {
                bar.suspend(|| console.line(format_args!("face {face}")))?;
            }
            Progress::Face(_) => {}
            Progress::Frame(frame) => {
                bar.inc(1);
                if !args.json {
                    bar.suspend(|| print(frame, scenario.quality.max_error_dn, console))?;
                }
            }
        }
        Ok(())
    })?;
    bar.finish_and_clear();
    if args.json {
        console.json(&report)?;
    }
    if report.kept { Ok(()) } else { Err(Failure::failed(exceeded(&report))) }
}

/// How much there is to trace, as each pixel is traced by the reference renderer.
fn work(camera: &CameraSpec, pictures: usize, with_pictures: bool) -> String {
    let [width, height] = camera.size_px;
    let is_exposed = Shutter::longest_of(camera).is_ok_and(|shutter| shutter.exposure_s() > 0.0);
    let instants = if is_exposed { MOST_INSTANTS } else { 1 };
    let pixels = (pictures * instants) as u64 * u64::from(width) * u64::from(height);
    format!(
        "tracing {:.3} million pixels on the CPU: {pictures} picture{} of {width}x{height}{}{}",
        1e-6 * pixels as f64,
        if pictures == 1 { "" } else { "s" },
        if is_exposed { format!(" at up to {instants} instants of the exposure") } else { String::new() },
        if with_pictures { ", and many rays more of each pixel for --pictures" } else { "" }
    )
}

/// What is exceeded, and in which frames: the source error first, then truth, then the picture error.
fn exceeded(report: &VerifyReport) -> anyhow::Error {
    let VerifyReport { tolerance_px, tolerance_dn, .. } = report;
    let frames_where = |is_exceeded: &dyn Fn(&FrameReport) -> bool| {
        let frames = report.frames.iter().filter(|frame| is_exceeded(frame));
        frames.map(|frame| frame.frame.to_string()).collect::<Vec<_>>().join(", ")
    };
    if let Some(first) = report.frames.iter().find(|frame| !frame.kept) {
        let frames = frames_where(&|frame| !frame.kept);
        let reason = exceeded_reason(first);
        return anyhow!(
            "frame {frames}: the source error exceeds the tolerance of {tolerance_px} px: {reason}"
        );
    }
    let frames = frames_where(&|frame| !frame.keeps_truth());
    if !frames.is_empty() {
        return anyhow!(
            "frame {frames}: depths, points or other truth belong to no surface within {tolerance_px} px of their \
             pixel"
        );
    }
    let frames = frames_where(&|frame| frame.picture.is_some_and(|picture| !picture.kept));
    anyhow!("frame {frames}: the picture error exceeds quality.max_error_dn = {tolerance_dn}")
}

/// Why a frame exceeds its tolerance.
fn exceeded_reason(frame: &FrameReport) -> String {
    let more = if frame.is_more_than_predicted() { ", and the error is larger than predicted" } else { "" };
    match (&frame.predicted.source_error_obstacle, frame.measured.judged_by) {
        (Some(cause), _) => format!("limited by {cause}{more}"),
        (None, JudgedBy::Nothing) => {
            "too many pixels have a source in one of the two frames only, or none can be compared".to_owned()
        }
        _ => "this was not predicted".to_owned(),
    }
}

const HEADER: &str = concat!(
    " frame |  predicted   measured        rms        max | at silhouettes        rms        max ",
    "| falsely valid  missing | terrain detail |"
);

fn print(verified: &FrameReport, tolerance_dn: f64, console: &mut Console<'_>) -> Result<(), Failure> {
    let FrameReport { frame, predicted, measured, .. } = verified;
    let Measured { smooth, silhouettes, all, judged_by, falsely_valid, missing, disocclusion_fraction } =
        measured;
    let terrain_off = verified
        .level_of_detail
        .as_ref()
        .map_or_else(|| "-".to_owned(), |detail| format!("{:.3}", detail.max_error_px));
    let fraction = 100.0 * silhouettes.count as f64 / all.count.max(1) as f64;
    let why = match judged_by {
        JudgedBy::All => {
            format!(": hardly any pixel is away from silhouettes, {:.2e} px over all", all.p99_px)
        }
        JudgedBy::Nothing => ": too many pixels without a source".to_owned(),
        JudgedBy::Smooth => String::new(),
    };
    console.line(format_args!(
        "{frame:>6} | {:>10.2e} {:>10.2e} {:>10.2e} {:>10.2e} | {fraction:>12.1} % {:>10.2e} {:>10.2e} | \
         {falsely_valid:>13} {missing:>8} | {terrain_off:>14} | {}{why}",
        predicted.total_px,
        smooth.p99_px,
        smooth.rms_px,
        smooth.max_px,
        silhouettes.rms_px,
        silhouettes.max_px,
        verdict([verified.kept, verified.as_predicted, predicted.source_error_kept], *judged_by)
    ))?;
    let Predicted {
        resampling_dn, blur_dn, misregistration_dn, terrain, blended_depth, disocclusion, ..
    } = predicted;
    let surface_dn = terrain.map_or(0.0, |terrain| terrain.surface_dn);
    let blended_dn = blended_depth.map_or(0.0, |blended| blended.error_dn);
    let expected = disocclusion.map_or_else(
        || "not predicted".to_owned(),
        |disocclusion| format!("predicted {:.4} %", 100.0 * disocclusion.fraction),
    );
    console.line(format_args!(
        "       | disoccluded: {expected}, measured {:.4} % of the picture",
        100.0 * disocclusion_fraction
    ))?;
    for line in verified.truth.iter().map(describe_truth).chain(channel_lines(verified)) {
        console.line(format_args!("       | {line}"))?;
    }
    if let Some(PictureReport {
        rms_dn,
        predicted_dn,
        kept,
        psnr_db,
        smooth_psnr_db,
        silhouettes_psnr_db,
        max,
    }) = &verified.picture
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
fn verdict([kept, as_predicted, predicted_kept]: [bool; 3], judged_by: JudgedBy) -> &'static str {
    match (kept, predicted_kept) {
        (true, _) if as_predicted => "kept",
        (true, _) => "kept, but more than predicted",
        (false, true) => "EXCEEDED, not predicted",
        (false, false) if !as_predicted && judged_by != JudgedBy::Nothing => {
            "EXCEEDED, and more than predicted"
        }
        (false, false) => "EXCEEDED as predicted",
    }
}

/// Converts an RMS error in DN to a PSNR.
fn estimate(rms_dn: f64) -> String {
    if rms_dn > 0.0 { format!("{:.2} dB", -20.0 * (rms_dn / 255.0).log10()) } else { "no error".to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_error_is_written_in_words() {
        assert_eq!(estimate(2.55), "40.00 dB");
        assert_eq!(estimate(0.0), "no error");
    }

    #[test]
    fn verdicts_separate_tolerance_and_prediction() {
        assert_eq!(verdict([true, true, true], JudgedBy::Smooth), "kept");
        assert_eq!(verdict([true, false, true], JudgedBy::Smooth), "kept, but more than predicted");
        assert_eq!(verdict([false, false, true], JudgedBy::Smooth), "EXCEEDED, not predicted");
        assert_eq!(verdict([false, true, false], JudgedBy::All), "EXCEEDED as predicted");
        assert_eq!(verdict([false, false, false], JudgedBy::Smooth), "EXCEEDED, and more than predicted");
        assert_eq!(verdict([false, false, false], JudgedBy::Nothing), "EXCEEDED as predicted");
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
}
