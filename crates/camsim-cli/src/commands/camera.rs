//! `camsim camera`: calibrations of other programs in and out.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use camsim_core::scenario::CameraSpec;
use camsim_io::{
    formats::reading::{
        BodyAxes, CameraFormat, ImportOptions, LensfunQuery, import_camera_with, import_lensfun, import_rig,
    },
    formats::writing::{CalibrationFormat, export},
    kernel_file::load_kernel,
    lens_table::load_lens_table,
    scenario_file::read_cameras,
    write::write_atomic,
};

use crate::{
    console::Console,
    failure::{Failure, OrFail},
    output::write_output,
};

/// Work with camera files
#[derive(Debug, clap::Args)]
pub struct CameraArgs {
    #[command(subcommand)]
    command: CameraCommand,
}

#[derive(Debug, clap::Subcommand)]
enum CameraCommand {
    Import(ImportArgs),
    Export(ExportArgs),
}

/// Convert a calibration of another program to a CAMERA.toml
///
/// Reads OpenCV YAML/XML, Kalibr camchain, EuRoC sensor.yaml, ROS camera_info (file, message, .ini),
/// camodocal (VINS) YAML, COLMAP cameras.txt, Agisoft Metashape XML, OpenSfM and OpenDroneMap JSON, ORB-SLAM,
/// OKVIS, Basalt, maplab, rpg_svo and ESIM files, nerfstudio's transforms.json, the reference program's XML and
/// Gyroflow lens profiles, and lenses of lensfun's database. The
/// format is detected by content. If a file is ambiguous, it is not guessed: use --format or --camera.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  camsim camera import cam0.yaml -o CAMERA.toml
  camsim camera import camchain.yaml --rig -o RIG.toml    # then, in a scenario: cameras = \"RIG.toml\"
  camsim camera import TUM1.yaml --size 640x480 -o CAMERA.toml
  camsim camera import slr-canon.xml --lens 'EF 24-70mm f/2.8L USM' --focal 35 --aperture 4 --size 6000x4000 -o CAMERA.toml")]
struct ImportArgs {
    /// Calibration file
    file: PathBuf,
    /// Output file [default: standard output]
    #[arg(short, long, value_name = "CAMERA.toml")]
    output: Option<PathBuf>,
    /// Read the file as this format
    #[arg(long, value_parser = clap::builder::PossibleValuesParser::new(CameraFormat::ALL.map(CameraFormat::name)))]
    format: Option<String>,
    /// Name of the camera, if the file has several
    #[arg(long, value_name = "NAME", conflicts_with = "rig")]
    camera: Option<String>,
    /// Import all cameras, with poses, clocks and readouts, as [[cameras]]
    #[arg(long)]
    rig: bool,
    /// Apply the file's pose and clock of the camera, which refer to a body or IMU with these axes: forward, left,
    /// up or forward, right, down [with --rig: flu]
    #[arg(long, value_enum, value_name = "AXES")]
    body: Option<BodyArg>,
    /// Size of the pictures, for files that state none
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// Lens of a lensfun database (XML), by its name or a part of it
    #[arg(long, value_name = "NAME", requires_all = ["focal", "size"], conflicts_with_all = ["rig", "camera", "format", "body"])]
    lens: Option<String>,
    /// Focal length of that lens, mm
    #[arg(long, value_name = "MM", requires = "lens")]
    focal: Option<f64>,
    /// Crop factor of the camera with that lens [default: that of the calibration]
    #[arg(long, value_name = "FACTOR", requires = "lens")]
    crop: Option<f64>,
    /// f-number of that lens, on which its vignetting depends
    #[arg(long, value_name = "N", requires = "lens")]
    aperture: Option<f64>,
    /// Distance of what is in focus, m, on which its vignetting depends
    #[arg(long, value_name = "M", requires = "aperture", default_value_t = 1000.0)]
    distance: f64,
}

/// `--body`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum BodyArg {
    /// Forward, left, up
    Flu,
    /// Forward, right, down
    Frd,
}

/// Write cameras in the format of another program
///
/// Reads a CAMERA.toml, a file with [[cameras]], a scenario or a run.json. What the format cannot hold is
/// named in a note; a lens that it does not have is an error.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  camsim camera export CAMERA.toml --as opencv -o calibration.yaml
  camsim camera export flight.toml --as kalibr -o camchain.yaml
  camsim camera export RIG.toml --camera left --as stmap -o maps")]
struct ExportArgs {
    /// Camera file, file with [[cameras]], scenario or run.json
    file: PathBuf,
    /// Format
    #[arg(long = "as", value_name = "FORMAT", value_parser = clap::builder::PossibleValuesParser::new(CalibrationFormat::ALL.map(CalibrationFormat::name)))]
    format: String,
    /// Output file; a folder for stmap [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// One of several cameras, by its name
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
}

fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let sides = text
        .split_once(['x', 'X', '*'])
        .and_then(|(width, height)| Some([width.trim().parse().ok()?, height.trim().parse().ok()?]));
    sides.filter(|sides| !sides.contains(&0)).ok_or_else(|| "write WIDTHxHEIGHT, such as 640x480".to_owned())
}

/// Runs a camera command.
pub fn run(args: &CameraArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    match &args.command {
        CameraCommand::Import(args) => import(args, console),
        CameraCommand::Export(args) => export_cameras(args, console),
    }
}

fn import(args: &ImportArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let (format, notes, text) = match (&args.lens, args.focal, args.size) {
        (Some(lens), Some(focal_mm), Some(size_px)) => {
            let query = LensfunQuery {
                lens,
                focal_mm,
                size_px,
                crop: args.crop,
                aperture: args.aperture,
                distance_m: args.distance,
            };
            let camera = import_lensfun(&args.file, &query).or_bad_input()?;
            ("lensfun", camera.notes, toml::to_string(&camera.spec).or_failed()?)
        }
        _ => import_file(args)?,
    };
    console.note(format_args!("{}: read as {format}", args.file.display()));
    for note in &notes {
        console.note(format_args!("note: {note}"));
    }
    let header = format!("# Imported from {} ({format}).\n", file_name(&args.file));
    let text = header + &text;
    write_output(args.output.as_deref(), console, |out| out.write_all(text.as_bytes()))
}

/// Name of the format, notes, and the TOML of one camera or of all.
fn import_file(args: &ImportArgs) -> Result<(&'static str, Vec<String>, String), Failure> {
    let format = match &args.format {
        None => None,
        Some(name) => {
            let known = CameraFormat::ALL.into_iter().find(|format| format.name() == name);
            Some(known.ok_or_else(|| Failure::bad_input(anyhow!("--format {name} is not known")))?)
        }
    };
    let body = args.body.map(|body| match body {
        BodyArg::Flu => BodyAxes::Flu,
        BodyArg::Frd => BodyAxes::Frd,
    });
    let options = ImportOptions { format, camera: args.camera.as_deref(), size_px: args.size, body };
    let (format, mut notes, text) = if args.rig {
        let mut rig = import_rig(&args.file, &options).or_bad_input()?;
        let missing: Vec<String> =
            rig.cameras.iter_mut().filter_map(|spec| keep_vignette_in_reach(spec, &args.file)).collect();
        rig.notes.extend(missing);
        let text = rig.to_toml().or_failed()?;
        (rig.format, rig.notes, text)
    } else {
        let mut imported = import_camera_with(&args.file, &options).or_bad_input()?;
        imported.notes.extend(keep_vignette_in_reach(&mut imported.spec, &args.file));
        (imported.format, imported.notes, toml::to_string(&imported.spec).or_failed()?)
    };
    if args.rig && body.is_none() {
        notes.push(
            "the file's body or IMU is read as x forward, y left, z up: --body frd is the other choice"
                .into(),
        );
    }
    Ok((format.name(), notes, text))
}

/// A vignette is named relative to the calibration, and the CAMERA.toml may be written elsewhere. So the path
/// is made absolute if the file exists, and a note is returned otherwise.
fn keep_vignette_in_reach(spec: &mut CameraSpec, calibration: &Path) -> Option<String> {
    let vignette = spec.photometric.vignette.as_mut()?;
    match calibration.parent().unwrap_or(Path::new("")).join(&vignette).canonicalize() {
        Ok(found) => {
            *vignette = found;
            None
        }
        Err(_) => Some(format!(
            "the vignette map {} is not beside the calibration: put it there, or correct \
             photometric.vignette",
            vignette.display()
        )),
    }
}

fn export_cameras(args: &ExportArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let format = CalibrationFormat::ALL.into_iter().find(|format| format.name() == args.format);
    let format = format.ok_or_else(|| Failure::bad_input(anyhow!("--as {} is not known", args.format)))?;
    let mut cameras = read_cameras(&args.file).or_bad_input()?;
    if let Some(name) = &args.camera {
        let names = cameras.iter().map(|camera| camera.name.as_str()).collect::<Vec<_>>().join(", ");
        let unknown =
            || Failure::bad_input(anyhow!("--camera {name}: there is no such camera; the names are {names}"));
        let index = cameras.iter().position(|camera| camera.name == *name).ok_or_else(unknown)?;
        cameras = vec![cameras.swap_remove(index)];
    }
    cameras.iter_mut().try_for_each(load_lens_table).or_bad_input()?;
    cameras.iter_mut().try_for_each(load_kernel).or_bad_input()?;
    let exported = export(&cameras, format).or_bad_input()?;
    for note in &exported.notes {
        console.note(format_args!("note: {note}"));
    }
    match (&exported.files[..], &args.output) {
        ([file], output) => write_output(output.as_deref(), console, |out| out.write_all(&file.bytes)),
        (files, Some(folder)) => {
            files.iter().try_for_each(|file| write_atomic(&folder.join(file.name), &file.bytes)).or_failed()
        }
        (_, None) => {
            Err(Failure::bad_input(anyhow!("{} has two files: name a folder with -o", format.name())))
        }
    }
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().replace(|c: char| c.is_control(), " ")
}
