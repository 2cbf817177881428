//! `camsim apply`: the reverse pipeline on ideal frames of other programs.

use std::{path::PathBuf, time::Instant};

use anyhow::anyhow;
use camsim_core::{
    apply::{ApplyError, NoSourceCounts, Pipeline, Settings},
    scenario::{CameraSpec, MAX_BLUR_SAMPLES, Preset, Solver, VignettingSpec},
};
use camsim_io::{
    frame_file::{FrameFile, FrameSet, read_frame_set},
    load::vignette_warnings,
    raster::pictures::read_vignette,
    scenario_file::read_checked_camera,
    write::write_picture,
};

use crate::{
    console::Console,
    failure::{Failure, OrFail},
    frame_list::{FrameList, whole_number},
    inputs::PresetArg,
};

mod folder;

/// Apply a camera to an ideal RGB-D image of any origin
///
/// Reads an image with depth from Blender, AirSim, Gazebo or a depth camera, and renders the frame of the
/// camera: lens, delay, rolling shutter, exposure, interlacing, vignette, light, noise. Runs in f64 on all
/// CPU cores, without a graphics adapter. Pixels whose source is outside of the ideal image have alpha 0. A
/// FRAME.toml with a folder or a table of images gives a folder of frames.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
FRAME.toml (paths relative to it):
  color = \"ideal.png\"          EXR (linear), PNG, JPEG, BMP, TIFF, WebP; color_space = \"srgb\" | \"linear\"
  color_channels = [\"R\", \"G\", \"B\"], color_layer; depth_channel = \"Depth.Z\", depth_layer
                               of an EXR with several layers or parts: full names, or their ends; an unknown name is
                               answered with a list
  depth = \"depth.exr\"          EXR Z, PFM, TIFF or .npy of floats in metres, or 16-bit PNG, PGM, TIFF or .npy of whole numbers
                               with depth_per_metre (0.001 to 1e6), or 8-bit RGB PNG with depth_encoding = \"packed24\"
                               ((65025 R + 255 G + B) / 255 m) | \"carla\" (1000 (R + 256 G + 65536 B) / 16777215 m); positive
                               forward, 0 is unknown or sky: infinitely far
  depth_rows = \"bottom-up\"     row order of a PFM | \"top-down\", as AirSim writes them
  depth_max_m = 1e9            stored depths from this value on mean sky
  depth_kind = \"planar\"        | \"range\", along the ray | \"inverse\": depth_per_metre / z, of disparities focal length in
                               pixels times baseline in metres
  holes = \"far\"               unknown depth is infinitely far | \"nearest\": that of the nearest pixel with a depth | \"mark\": alpha 0
  focal_px = [307.6, 307.6]    of the ideal image, which may be larger than the output
  principal_point_px = [543.5, 407.5]   by default the image centre, of an EXR that of the display window
  instant_ms = 0.0             instant of the ideal image relative to the stamp
  [motion]                     a constant twist in camera axes (x right, y down, z forward): a screw motion, whose velocity
                               rotates with the camera ...
  velocity_m_s = [0.0, 0.0, 0.0]
  angular_rate_rad_s = [0.0, 0.0, 0.628]
  trajectory = \"poses.csv\"     ... or any motion, as poses t_s,x,y,z,qw,qx,qy,qz (world_from_camera; units by name: t_ms, x_mm),
                               and stamp_s; trajectory_format = \"tum\": t x y z qx qy qz qw without a header
  flow = \"flow.flo\"            ... or optical flow over flow_interval_ms, by camera and objects together: Middlebury .flo, .npy, or an EXR
                               of two channels (of more: flow_channels = [\"X\", \"Y\"], right and down); flow_scale = [1, -1]
                               if y is up
  [fog]                        end_m, color: with --preset paper only

Several frames, instead of color, depth and stamp_s:
  color = \"rgb/*.png\", depth = \"depth/*.png\"   paired by the text of the *; with name_unit = \"s\" | \"ms\" | \"us\" | \"ns\" it is a time,
                               paired with the nearest within max_gap_ms = 20
  color = \"rgb.txt\", depth = \"depth.txt\"       lists of `time file`
  frames = \"associations.txt\"                   a table of `time color time depth`, or a .csv of t_s (t_ms, t_us, t_ns), color, depth
  fps = 30                     times for frames without one, starting at motion.stamp_s

Examples:
  camsim apply CAMERA.toml FRAME.toml -o picture.png
  camsim apply CAMERA.toml FRAME.toml --solver rk2 -o linear.exr
  camsim apply CAMERA.toml FRAME.toml --preset paper --blur-samples 10 -o paper.png
  camsim apply CAMERA.toml FRAMES.toml -o out --frames 0..100 --resume")]
pub struct ApplyArgs {
    /// Camera file: the keys of [camera] at its root
    camera: PathBuf,
    /// The ideal image and the motion of its camera
    frame: PathBuf,
    /// Output file: .exr is linear R G B A with depth Z, .png is encoded as photometric.output; a folder for
    /// several frames
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Temporal inverse: reproject is exact, linear and rk2 are eqs. 16 and 18 of the paper [default:
    /// reproject; --preset paper always uses rk2]
    #[arg(long, value_enum)]
    solver: Option<SolverArg>,
    /// Set of methods: camsim's own, or the paper's
    #[arg(long, value_enum, default_value = "default")]
    preset: PresetArg,
    /// Exposure samples [default: by the length of the path; 100 with --preset paper]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_BLUR_SAMPLES)))]
    blur_samples: Option<u32>,
    /// Seed of the noise
    #[arg(long, default_value_t = 0, value_parser = whole_number, allow_hyphen_values = true)]
    seed: u64,
    /// For several frames, a selection: 7, 10..20 (without 20), 10..=20, 10.. or several with commas
    /// [default: all]
    #[arg(long, value_name = "LIST", allow_hyphen_values = true)]
    frames: Option<FrameList>,
    /// For several frames: keep those that exist already; refused if the folder belongs to other inputs
    #[arg(long)]
    resume: bool,
    /// For several frames: colour formats [default: exr]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_enum)]
    format: Vec<folder::ImageFormatArg>,
    /// Number of the (first) frame, which the noise depends on
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = whole_number, allow_hyphen_values = true)]
    frame_number: u64,
}

/// `--solver`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum SolverArg {
    /// One straight step at constant velocity and depth (eq. 16)
    Linear,
    /// Heun's steps of at most 2.5 deg at constant velocity and depth (eq. 18)
    Rk2,
    /// Exact relative pose of each row and sample, with depth
    Reproject,
}

/// Names what one lens for all colours leaves out.
fn warn_of_one_lens(spec: &CameraSpec, args: &ApplyArgs, console: &mut Console<'_>) {
    let is_colored = spec.photometric.vignetting.as_ref().is_some_and(VignettingSpec::is_colored);
    for (present, key) in [
        (spec.is_chromatic(), "chromatic"),
        (is_colored, "photometric.vignetting: a polynomial of red or blue"),
    ] {
        if present {
            console.warn(format_args!(
                "{}: {key} is ignored: all colours have what green has; `camsim render` makes them apart",
                args.camera.display()
            ));
        }
    }
}

/// Reads, renders, writes.
pub fn run(args: &ApplyArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    // The same rule as for a scenario.
    if args.preset == PresetArg::Paper && args.solver.is_some_and(|solver| solver != SolverArg::Rk2) {
        return Err(Failure::bad_input(anyhow!(
            "--solver is rk2 with --preset paper; leave it out, or leave --preset out"
        )));
    }
    let is_picture = is_picture_path(args);
    if !is_picture && args.output.extension().is_some() && !args.output.is_dir() {
        return Err(Failure::bad_input(anyhow!(
            "-o {}: the name must end in .exr or .png, which selects the format; for several frames it is a \
             folder, whose name has no ending",
            args.output.display()
        )));
    }
    let spec = read_checked_camera(&args.camera).or_bad_input()?;
    for (present, key) in
        [(!spec.zoom.is_empty(), "zoom"), (!spec.mount.vibration.is_empty(), "mount.vibration")]
    {
        if present {
            console.warn(format_args!(
                "{}: {key} is ignored: the frame has one calibration and its own motion",
                args.camera.display()
            ));
        }
    }
    warn_of_one_lens(&spec, args, console);
    let set = read_frame_set(&args.frame).or_bad_input()?;
    set.notes().iter().for_each(|note| console.warn(note));
    let vignette = read_vignette(&spec).or_bad_input()?;
    vignette.iter().flat_map(|map| vignette_warnings(&spec, map)).for_each(|warning| console.warn(warning));
    if set.is_several() {
        return folder::run(args, &spec, &set, vignette.as_ref(), console);
    }
    refuse_folder_options(args, is_picture)?;
    let file = read(args, &set, 0, console)?;
    file.notes.iter().for_each(|note| console.warn(note));
    let begin = Instant::now();
    let settings = settings(args, &file, 0);
    let pipeline = Pipeline::new(&spec, &file.frame, &file.motion, &settings)
        .map_err(|error| in_file(args, &error))
        .or_bad_input()?;
    let (picture, no_source) = pipeline.render_and_count(vignette.as_ref());
    let elapsed_s = begin.elapsed().as_secs_f64();
    folder::warn_of_gaps(args, &spec, &set, &[0], console)?;
    write_picture(&args.output, &picture, spec.photometric.output).or_failed()?;

    let [width, height] = spec.size_px;
    console.note(format_args!("{}: {width}x{height}, {elapsed_s:.2} s", args.output.display()));
    warn_no_source(&no_source, f64::from(width) * f64::from(height), console);
    warn_of_extrapolation(args, &pipeline, console);
    console.detail(format_args!("{:.1} % of the ideal image has no depth", 100.0 * file.without_depth));
    console.detail(format_args!("{} exposure nodes", pipeline.nodes()));
    Ok(())
}

fn is_picture_path(args: &ApplyArgs) -> bool {
    let ending = args.output.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    ["exr", "png"].iter().any(|known| ending.eq_ignore_ascii_case(known))
}

/// Checks the options for a single frame, which cannot be selected or resumed.
fn refuse_folder_options(args: &ApplyArgs, is_picture: bool) -> Result<(), Failure> {
    if !is_picture {
        let message =
            "a single frame is an image, whose name must end in .exr or .png, which selects the format";
        return Err(Failure::bad_input(anyhow!("-o {}: {message}", args.output.display())));
    }
    let given = [
        ("--frames", args.frames.is_some()),
        ("--resume", args.resume),
        ("--format", !args.format.is_empty()),
    ];
    match given.into_iter().find(|(_, given)| *given) {
        Some((option, _)) => Err(Failure::bad_input(anyhow!(
            "{option} is for several frames, and {} names one; leave it out",
            args.frame.display()
        ))),
        None => Ok(()),
    }
}

/// Frame `index`, with a warning if it has no depth.
fn read(
    args: &ApplyArgs,
    set: &FrameSet,
    index: usize,
    console: &mut Console<'_>,
) -> Result<FrameFile, Failure> {
    let file = set.read(index).or_bad_input()?;
    if file.without_depth == 1.0 && file.motion.translates() {
        let frame = args.frame.display();
        console.warn(format_args!(
            "{frame}: no pixel has a depth: everything is taken as infinitely far, and \
                                the camera's velocity has no effect"
        ));
    }
    Ok(file)
}

fn settings(args: &ApplyArgs, file: &FrameFile, index: u64) -> Settings {
    Settings {
        preset: if args.preset == PresetArg::Paper { Preset::Paper } else { Preset::Default },
        solver: args.solver.map(|solver| match solver {
            SolverArg::Linear => Solver::Linear,
            SolverArg::Rk2 => Solver::Rk2,
            SolverArg::Reproject => Solver::Reproject,
        }),
        blur_samples: args.blur_samples,
        fog: file.fog,
        seed: args.seed,
        frame: args.frame_number.saturating_add(index),
    }
}

/// Warns of pixels without a source, with the reasons.
fn warn_no_source(no_source: &NoSourceCounts, pixels: f64, console: &mut Console<'_>) {
    let percent = |count: u64| 100.0 * count as f64 / pixels;
    let reasons = [
        (no_source.no_ray, "the lens has no ray there"),
        (no_source.outside, "outside of the ideal image, which should be larger"),
        (no_source.holes, "where the ideal image has no depth (holes = \"mark\")"),
        (no_source.unknown_flow, "where the flow is unknown (not a number, or above 1e9)"),
        (
            no_source.torn_flow,
            "where the flow is too irregular to be inverted: is it in pixels, right and down?",
        ),
    ];
    let reasons: Vec<String> = reasons
        .iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, why)| format!("{:.2} % {why}", percent(*count)))
        .collect();
    if no_source.all() > 0 {
        console.warn(format_args!(
            "{:.2} % of the picture is empty (alpha 0): {}",
            percent(no_source.all()),
            reasons.join("; ")
        ));
    }
}

/// Warns if a flow is extrapolated far beyond its interval.
fn warn_of_extrapolation(args: &ApplyArgs, pipeline: &Pipeline<'_>, console: &mut Console<'_>) {
    let Some([first, last]) = pipeline.flow_fractions() else { return };
    let reach = format!(
        "the shutter is open from {first:+.2} to {last:+.2} of the flow's interval after the ideal image"
    );
    if first.abs().max(last.abs()) > 1.0 + 1e-9 {
        let frame = args.frame.display();
        console.warn(format_args!(
            "{frame}: {reach}: the flow is extrapolated by more than its own interval; check instant_ms and \
             flow_interval_ms, or use a flow over a longer interval"
        ));
    } else {
        let beyond = if first < 0.0 || last > 1.0 { ": outside of it the flow is extrapolated" } else { "" };
        console.detail(format_args!("{reach}{beyond}"));
    }
}

/// Prefixes an error with the file that it concerns.
fn in_file(args: &ApplyArgs, error: &ApplyError) -> anyhow::Error {
    let file = match error {
        ApplyError::Camera(_)
        | ApplyError::Shutter(_)
        | ApplyError::AutoExposure
        | ApplyError::Reset
        | ApplyError::PointSpread => &args.camera,
        ApplyError::Frame { .. } | ApplyError::Motion(_) | ApplyError::Fog => &args.frame,
        ApplyError::Flow => return anyhow!("{error}"),
        ApplyError::Reference => return anyhow!("--solver: {error}"),
    };
    anyhow!("{}: {error}", file.display())
}
