//! `camsim apply`: the reverse pipeline on somebody else's ideal frame.

use std::{path::PathBuf, time::Instant};

use anyhow::anyhow;
use camsim_core::{
    apply::{ApplyError, Pipeline, Settings},
    scenario::{MAX_BLUR_SAMPLES, Preset, Solver},
};
use camsim_io::{frame_file::read_frame, pictures::read_gray_image, scenario_file::read_checked_camera, write::write_picture};

use crate::{
    console::Console,
    failure::{Failure, OrFail},
    inputs::PresetArg,
};

/// Put an ideal RGB-D picture of any origin through a camera
///
/// Takes a picture with depth from Blender, AirSim, Gazebo or a depth camera, and gives what the camera would have taken: lens, delay,
/// rolling shutter, exposure, interlacing, vignette, light, noise. In f64 on all cores; needs no graphics adapter. What the ideal picture
/// does not show (beyond its border) is alpha 0.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
FRAME.toml (paths relative to it):
  color = \"ideal.png\"          EXR (linear), PNG, JPEG, BMP; color_space = \"srgb\" | \"linear\"
  depth = \"depth.exr\"          EXR Z in metres, or 16-bit PNG or PGM with depth_per_metre (0.001 to 1e6), or 8-bit RGB PNG
                               with depth_encoding = \"packed24\"; positive forward, 0 is unknown or sky: infinitely far
  depth_kind = \"planar\"        | \"range\"
  holes = \"far\"               | \"nearest\": where there is no depth, that of the nearest pixel that has one
  focal_px = [307.6, 307.6]    of the ideal picture, which may be larger than the output
  principal_point_px = [543.5, 407.5]
  instant_ms = 0.0             when it was taken, from the stamp
  [motion]                     a twist, constant in camera axes (x right, y down, z forward): a screw, whose velocity turns
                               with the camera ...
  velocity_m_s = [0.0, 0.0, 0.0]
  angular_rate_rad_s = [0.0, 0.0, 0.628]
  trajectory = \"poses.csv\"     ... or any motion, as poses t_s,x,y,z,qw,qx,qy,qz (world_from_camera), and stamp_s
  [fog]                        end_m, color: with --preset paper only

Examples:
  camsim apply CAMERA.toml FRAME.toml -o picture.png
  camsim apply CAMERA.toml FRAME.toml --solver rk2 -o linear.exr
  camsim apply CAMERA.toml FRAME.toml --preset paper --blur-samples 10 -o paper.png")]
pub struct Args {
    /// Camera file: the keys of [camera] at its root
    camera: PathBuf,
    /// The ideal picture and how its camera moved
    frame: PathBuf,
    /// Where the picture goes: .exr is linear R G B A with depth Z, .png is encoded as photometric.output says
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Temporal inverse: reproject is exact, linear and rk2 are the paper's eqs. 16 and 18 [default: reproject; rk2, and no other, with
    /// --preset paper]
    #[arg(long, value_enum)]
    solver: Option<SolverArg>,
    /// Methods: camsim's own, or the paper's
    #[arg(long, value_enum, default_value = "default")]
    preset: PresetArg,
    /// Samples over the exposure; by the length of the path if left out (100 with --preset paper)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_BLUR_SAMPLES)))]
    blur_samples: Option<u32>,
    /// Seed of the noise
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Frame number, which the noise depends on
    #[arg(long, default_value_t = 0, value_name = "N")]
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

/// Reads, renders, writes.
pub fn run(args: &Args, console: &mut Console<'_>) -> Result<(), Failure> {
    let ending = args.output.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    if !["exr", "png"].iter().any(|known| ending.eq_ignore_ascii_case(known)) {
        return Err(Failure::bad_input(anyhow!(
            "-o {}: the name must end in .exr or .png, which chooses the format",
            args.output.display()
        )));
    }
    // As a scenario does.
    if args.preset == PresetArg::Paper && args.solver.is_some_and(|solver| solver != SolverArg::Rk2) {
        return Err(Failure::bad_input(anyhow!("--solver is rk2 with --preset paper; leave it out, or leave --preset out")));
    }
    let spec = read_checked_camera(&args.camera).or_bad_input()?;
    for (present, key) in [(!spec.zoom.is_empty(), "zoom"), (!spec.mount.vibration.is_empty(), "mount.vibration")] {
        if present {
            console.warn(format_args!("{}: {key} is not used: the frame has one calibration and its own motion", args.camera.display()));
        }
    }
    let file = read_frame(&args.frame).or_bad_input()?;
    if file.without_depth == 1.0 && file.motion.translates() {
        let frame = args.frame.display();
        console
            .warn(format_args!("{frame}: no pixel has a depth: all is taken as infinitely far, and the camera's velocity changes nothing"));
    }
    let vignette = spec.photometric.vignette.as_deref().map(read_gray_image).transpose().or_bad_input()?;
    let settings = Settings {
        preset: if args.preset == PresetArg::Paper { Preset::Paper } else { Preset::Default },
        solver: args.solver.map(|solver| match solver {
            SolverArg::Linear => Solver::Linear,
            SolverArg::Rk2 => Solver::Rk2,
            SolverArg::Reproject => Solver::Reproject,
        }),
        blur_samples: args.blur_samples,
        fog: file.fog,
        seed: args.seed,
        frame: args.frame_number,
    };
    let begin = Instant::now();
    let pipeline = Pipeline::new(&spec, &file.frame, &file.motion, &settings).map_err(|error| in_file(args, &error)).or_bad_input()?;
    let picture = pipeline.render(vignette.as_ref());
    let elapsed_s = begin.elapsed().as_secs_f64();
    write_picture(&args.output, &picture, spec.photometric.output).or_failed()?;

    let all = f64::from(spec.size_px[0]) * f64::from(spec.size_px[1]);
    let blind = picture.color_rgba.iter().skip(3).step_by(4).filter(|alpha| **alpha == 0.0).count() as f64;
    console.note(format_args!("{}: {}x{}, {elapsed_s:.2} s", args.output.display(), spec.size_px[0], spec.size_px[1]));
    if blind > 0.0 {
        console.warn(format_args!(
            "{:.2} % of the picture is empty (alpha 0): the lens has no ray there, or the ideal picture does not show what it looks at; a larger ideal picture helps against the latter",
            100.0 * blind / all
        ));
    }
    console.detail(format_args!("{:.1} % of the ideal picture has no depth and counts as infinitely far", 100.0 * file.without_depth));
    console.detail(format_args!("{} exposure nodes", pipeline.nodes()));
    Ok(())
}

/// The file that an error is about, before its words.
fn in_file(args: &Args, error: &ApplyError) -> anyhow::Error {
    let file = match error {
        ApplyError::Camera(_) | ApplyError::Shutter(_) => &args.camera,
        ApplyError::Frame { .. } | ApplyError::Motion(_) | ApplyError::Fog => &args.frame,
        ApplyError::Oracle => return anyhow!("--solver: {error}"),
    };
    anyhow!("{}: {error}", file.display())
}
