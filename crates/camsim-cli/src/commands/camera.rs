//! `camsim camera import`.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use camsim_io::camera_file::{CameraFormat, ImportedCamera, import_camera_named};

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
}

/// Convert a calibration of another program to a CAMERA.toml
///
/// Reads OpenCV YAML/XML, Kalibr camchain, EuRoC sensor.yaml, ROS camera_info (file, message, .ini),
/// camodocal (VINS) YAML, COLMAP cameras.txt, Agisoft Metashape XML, OpenSfM and OpenDroneMap JSON, ORB-SLAM,
/// OKVIS, Basalt, maplab, rpg_svo and ESIM files, the reference program's XML and Gyroflow lens profiles. The
/// format is detected by content. If a file is ambiguous, it is not guessed: use --format or --camera.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: camsim camera import camchain.yaml -o CAMERA.toml")]
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
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
}

/// Runs a camera command.
pub fn run(args: &CameraArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    match &args.command {
        CameraCommand::Import(args) => import(args, console),
    }
}

fn import(args: &ImportArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let format = match &args.format {
        None => None,
        Some(name) => {
            let known = CameraFormat::ALL.into_iter().find(|format| format.name() == name);
            Some(known.ok_or_else(|| Failure::bad_input(anyhow!("--format {name} is not known")))?)
        }
    };
    let mut imported = import_camera_named(&args.file, format, args.camera.as_deref()).or_bad_input()?;
    keep_vignette_in_reach(&mut imported, &args.file);
    console.note(format_args!("{}: read as {}", args.file.display(), imported.format.name()));
    for note in &imported.notes {
        console.note(format_args!("note: {note}"));
    }
    let header = format!("# Imported from {} ({}).\n", file_name(&args.file), imported.format.name());
    let text = header + &toml::to_string(&imported.spec).or_failed()?;
    write_output(args.output.as_deref(), console, |out| out.write_all(text.as_bytes()))
}

/// A vignette is named relative to the calibration, and the CAMERA.toml may be written elsewhere. So the path
/// is made absolute if the file exists, and a note is printed otherwise.
fn keep_vignette_in_reach(imported: &mut ImportedCamera, calibration: &Path) {
    let Some(vignette) = &mut imported.spec.photometric.vignette else { return };
    match calibration.parent().unwrap_or(Path::new("")).join(&vignette).canonicalize() {
        Ok(found) => *vignette = found,
        Err(_) => imported.notes.push(format!(
            "the vignette map {} is not beside the calibration: put it there, or correct \
             photometric.vignette",
            vignette.display()
        )),
    }
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().replace(|c: char| c.is_control(), " ")
}
