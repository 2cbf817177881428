//! `camsim new`: a scenario that renders, from what there is.

use std::{
    fmt::Write as _,
    io::{BufRead, IsTerminal, Write},
    path::{Path, PathBuf},
};

use anyhow::anyhow;
use camsim_core::scenario::FlightHeight;
use camsim_io::{builtin, load, portable::relative_to, write::write_atomic};

use crate::{
    console::Console,
    failure::{Failure, OrFail},
    inputs::{Changes, load_cameras, read_changed_rig},
};

/// Write a commented scenario that renders
///
/// Without --log and --terrain it has the built-in flight and terrain, without --camera the camera of --like. In a
/// terminal and without options it asks. What it has written is loaded at once: it prints how many frames there
/// are, and how high above ground they are taken.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  camsim new                                             asks, and writes ./flight.toml
  camsim new survey.toml --like mapping                  a survey of the built-in terrain
  camsim new --log flight.ulg --terrain dem.tif --ortho ortho.jpg
  camsim new --log poses.csv --terrain dem.tif --camera cam0.toml --for learning
  camsim new board.toml --like euroc --for calibration   a stereo pair before a board")]
pub struct NewArgs {
    /// File to write
    #[arg(value_name = "SCENARIO", default_value = "flight.toml")]
    output: PathBuf,
    /// Camera to begin with, and what it is for
    #[arg(long, value_enum)]
    like: Option<Like>,
    /// Flight log of any format that is read
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// What the heights of --log are above: "takeoff" and "ground" are those of the terrain
    #[arg(long, value_name = "SURFACE", default_value = "msl", requires = "log")]
    #[arg(value_parser = clap::builder::PossibleValuesParser::new(FlightHeight::NAMES))]
    height: String,
    /// Elevation model: a GeoTIFF, ASCII grid or HGT file
    #[arg(long, value_name = "FILE")]
    terrain: Option<PathBuf>,
    /// Picture of the ground: a GeoTIFF, or a picture of the same extent as the terrain
    #[arg(long, value_name = "FILE", requires = "terrain")]
    ortho: Option<PathBuf>,
    /// Camera file; `camsim camera import` makes one of other programs' calibrations
    #[arg(long, value_name = "FILE", conflicts_with = "like")]
    camera: Option<PathBuf>,
    /// What the frames are for: channels, sensors and target follow
    #[arg(long = "for", value_enum, value_name = "PURPOSE")]
    purpose: Option<Purpose>,
}

/// Log of the camera that moves before a board.
const BOARD_MOTION: &str = "board_motion.csv";

/// Cameras that need no file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Like {
    /// A small drone's camera with a rolling shutter, 30 frames a second
    Drone,
    /// A stereo pair as in the EuRoC data set, 20 frames a second
    Euroc,
    /// A survey camera that looks straight down, a frame every two seconds
    Mapping,
}

/// What frames are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Purpose {
    /// Visual odometry and SLAM: an inertial unit, depth, times of rows
    Odometry,
    /// Calibration: a board that the camera moves before
    Calibration,
    /// Maps and reconstruction: depth and world coordinates
    Mapping,
    /// Training: depth, flow, normals, objects
    Learning,
}

impl Like {
    fn camera(self) -> &'static str {
        match self {
            Self::Drone => include_str!("new/drone.toml"),
            Self::Euroc => include_str!("new/euroc.toml"),
            Self::Mapping => include_str!("new/mapping.toml"),
        }
    }

    /// Pitch of its mount. A board stands ahead.
    fn pitch_deg(self, purpose: Purpose) -> &'static str {
        match self {
            _ if purpose == Purpose::Calibration => "0.0",
            Self::Drone | Self::Euroc => "-40.0",
            Self::Mapping => "-90.0",
        }
    }

    fn purpose(self) -> Purpose {
        match self {
            Self::Drone | Self::Euroc => Purpose::Odometry,
            Self::Mapping => Purpose::Mapping,
        }
    }
}

impl Purpose {
    fn text(self) -> &'static str {
        match self {
            Self::Odometry => include_str!("new/for_odometry.toml"),
            Self::Calibration => include_str!("new/for_calibration.toml"),
            Self::Mapping => include_str!("new/for_mapping.toml"),
            Self::Learning => include_str!("new/for_learning.toml"),
        }
    }

    /// A command that goes on from the scenario, and what it does.
    fn next(self) -> (&'static str, &'static str) {
        match self {
            Self::Odometry => ("export SCENARIO --as euroc -o seq", "the folder that VIO programs read"),
            Self::Calibration => {
                ("board SCENARIO -o board.png --points points.csv", "the board and its corners")
            }
            Self::Mapping => ("export SCENARIO --as colmap -o model", "cameras and poses for COLMAP"),
            Self::Learning => ("export SCENARIO --as webdataset -o shards", "samples for training"),
        }
    }
}

/// Runs `camsim new`.
pub fn run(mut args: NewArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let has_options = args.like.is_some() || args.purpose.is_some() || args.camera.is_some();
    let is_bare = !has_options && args.log.is_none() && args.terrain.is_none();
    if is_bare && std::io::stdin().is_terminal() {
        ask_for_all(&mut args)?;
    }
    if args.output.exists() {
        let output = args.output.display();
        return Err(Failure::bad_input(anyhow!(
            "{output} is there already: remove it, or name another file"
        )));
    }
    let like = args.like.unwrap_or(match args.purpose {
        Some(Purpose::Mapping) => Like::Mapping,
        _ => Like::Drone,
    });
    let purpose = args.purpose.unwrap_or_else(|| like.purpose());
    refuse_missing(&args)?;
    let is_above_ground = FlightHeight::named(&args.height).is_some_and(|height| height.datum().is_none());
    if is_above_ground && args.terrain.is_none() {
        return Err(Failure::bad_input(anyhow!(
            "--height {} needs --terrain, whose heights are the ground's",
            args.height
        )));
    }
    if purpose == Purpose::Calibration && (args.log.is_some() || args.terrain.is_some()) {
        return Err(Failure::bad_input(anyhow!(
            "--for calibration moves the camera before a board: leave out --log and --terrain"
        )));
    }
    let folder = args.output.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).or_failed()?;
    let text = scenario(&args, like, purpose, folder)?;
    write_atomic(&args.output, text.as_bytes()).or_failed()?;
    let checked = check(&args.output, console);
    if let Err(failure) = checked {
        // The corrected command writes it again.
        let _ = std::fs::remove_file(&args.output);
        let is_of_height = failure.to_string().contains("flight.height = ");
        return Err(if is_of_height { failure.of("--height names what heights are above") } else { failure });
    }
    say_next(&args.output, purpose, console)
}

/// Refuses files that are not there, before anything is written.
fn refuse_missing(args: &NewArgs) -> Result<(), Failure> {
    for path in [&args.log, &args.terrain, &args.ortho, &args.camera].into_iter().flatten() {
        path.metadata().map_err(|error| Failure::bad_input(anyhow!("{}: {error}", path.display())))?;
    }
    Ok(())
}

/// The scenario's text; what it names and has no file is written beside it.
fn scenario(args: &NewArgs, like: Like, purpose: Purpose, folder: &Path) -> Result<String, Failure> {
    let has_board = purpose == Purpose::Calibration;
    let folder = Folder(folder);
    let top = match &args.camera {
        Some(camera) => format!("camera = {}\n", folder.file(camera)?),
        None => String::new(),
    };
    let flight = match &args.log {
        Some(log) => format!(
            "log = {}\n\
             height = {:<25} # what the log's heights are above: {}\n\
             # window_s = [0.0, 10.0]           # a part of the log, from its first row on\n",
            folder.file(log)?,
            format!("\"{}\"", args.height),
            FlightHeight::NAMES.join(", "),
        ),
        None if has_board => {
            folder.write(BOARD_MOTION, board_motion().as_bytes())?;
            format!("log = \"{BOARD_MOTION}\"\n")
        }
        None => format!(
            "log = {}\n\
             height = \"msl\"                     # above mean sea level\n\
             window_s = [20.0, 30.0]            # a part of the log's 46 s\n",
            folder.built_in("demo_flight.csv")?
        ),
    };
    let camera = match &args.camera {
        Some(_) => String::new(),
        None => format!("{}\n", like.camera().replace("PITCH_DEG", like.pitch_deg(purpose))),
    };
    let scene = if has_board { String::new() } else { scene(args, &folder)? };
    Ok(format!(
        "# `camsim explain` shows what a frame takes, `camsim render --print-default` every key there is.\n\
         {top}\n\
         [flight]\n{flight}\n\
         [tracker]\n\
         kind = \"spline\"                    # smooth velocities and accelerations\n\n\
         {camera}{scene}{}",
        purpose.text()
    ))
}

fn scene(args: &NewArgs, folder: &Folder) -> Result<String, Failure> {
    let (dem, ortho) = match &args.terrain {
        Some(dem) => (folder.file(dem)?, args.ortho.as_ref().map(|ortho| folder.file(ortho)).transpose()?),
        None => (folder.built_in("demo_dem.tif")?, Some(folder.built_in("demo_ortho.jpg")?)),
    };
    let ortho = ortho.map_or_else(String::new, |ortho| format!("ortho = {ortho}, "));
    Ok(format!("[scene]\nterrain = {{ dem = {dem}, {ortho}height = \"msl\" }}\nsky = [0.74, 0.83, 0.92]\n\n"))
}

/// The scenario's folder.
struct Folder<'a>(&'a Path);

impl Folder<'_> {
    /// The path of a file from this folder on, as a TOML string.
    fn file(&self, path: &Path) -> Result<String, Failure> {
        let relative = relative_to(path, self.0);
        let text = relative.to_str().ok_or_else(|| {
            Failure::bad_input(anyhow!("{}: a scenario holds Unicode only: rename it", path.display()))
        })?;
        Ok(toml::Value::String(text.to_owned()).to_string())
    }

    fn built_in(&self, name: &str) -> Result<String, Failure> {
        for (_, bytes) in builtin::FILES.iter().filter(|(of, _)| *of == name) {
            self.write(name, bytes)?;
        }
        self.file(&self.0.join(name))
    }

    /// Writes a file, but over no other.
    fn write(&self, name: &str, bytes: &[u8]) -> Result<(), Failure> {
        let path = self.0.join(name);
        match std::fs::read(&path) {
            Ok(existing) if existing == bytes => Ok(()),
            Ok(_) => Err(Failure::bad_input(anyhow!(
                "{} is there already and is another file: write the scenario into another folder",
                path.display()
            ))),
            Err(_) => write_atomic(&path, bytes).or_failed(),
        }
    }
}

/// A platform that looks north at the origin from all sides, within 25 degrees and from 0.9 to 1.5 m: CSV of 20 s.
fn board_motion() -> String {
    let mut csv = String::from("t_s,north_m,east_m,down_m,roll_deg,pitch_deg,yaw_deg\n");
    for k in 0..=200 {
        let t_s = 0.1 * f64::from(k);
        let (yaw, pitch) = (25.0 * (0.9 * t_s).sin(), 20.0 * (0.57 * t_s).sin());
        let (roll, away_m) = (15.0 * (0.4 * t_s).sin(), 1.2 - 0.3 * (0.31 * t_s).cos());
        let (sin_yaw, cos_yaw) = yaw.to_radians().sin_cos();
        let (sin_pitch, cos_pitch) = pitch.to_radians().sin_cos();
        let _ = writeln!(
            csv,
            "{t_s:.1},{:.5},{:.5},{:.5},{roll:.4},{pitch:.4},{yaw:.4}",
            -away_m * cos_pitch * cos_yaw,
            -away_m * cos_pitch * sin_yaw,
            away_m * sin_pitch,
        );
    }
    csv
}

/// Loads what was written, and says what its cameras see.
fn check(path: &Path, console: &mut Console<'_>) -> Result<(), Failure> {
    let rig = read_changed_rig(path, &Changes::default(), None, console)?;
    let cameras = load_cameras(&rig, &[], console)?;
    console.line(path.display())?;
    for loaded in cameras {
        let sequence = &loaded.sequence;
        let name = match sequence.scenario.camera.name.as_str() {
            "" => "camera".to_owned(),
            name => format!("camera {name}"),
        };
        let seconds = sequence.frames as f64 / sequence.scenario.camera.fps;
        let mut line = format!("  {name}: {} frames, {seconds:.1} s", sequence.frames);
        if let Some(load::Outlook { above_ground_m: [low, high], sky }) = load::outlook(sequence) {
            let _ = write!(line, ", {low:.0} to {high:.0} m above ground, {:.0} % sky", 100.0 * sky);
        }
        console.line(line)?;
    }
    Ok(())
}

fn say_next(path: &Path, purpose: Purpose, console: &mut Console<'_>) -> Result<(), Failure> {
    let scenario = path.display().to_string();
    let (next, what) = purpose.next();
    console.line("next")?;
    console.line(format_args!("  camsim render {scenario} -o frames --frames 0..5"))?;
    console.line(format_args!("  camsim {}   {what}", next.replace("SCENARIO", &scenario)))?;
    Ok(())
}

/// Asks for what the options give.
fn ask_for_all(args: &mut NewArgs) -> Result<(), Failure> {
    let file = |question: &str| -> Result<Option<PathBuf>, Failure> {
        Ok(Some(ask(question)?).filter(|answer| !answer.is_empty()).map(PathBuf::from))
    };
    args.log = file("flight log (Enter: the built-in flight)")?;
    if args.log.is_some() {
        args.height = choose_word("what its heights are above", FlightHeight::NAMES, "msl")?;
    }
    args.terrain = file("elevation model (Enter: the built-in terrain)")?;
    if args.terrain.is_some() {
        args.ortho = file("picture of the ground (Enter: none)")?;
    }
    args.camera = file("camera file (Enter: a built-in one)")?;
    if args.camera.is_none() {
        args.like = Some(choose("camera", Like::Drone)?);
    }
    args.purpose = Some(choose("purpose", args.like.map_or(Purpose::Odometry, Like::purpose))?);
    Ok(())
}

/// Asks for one of the values.
fn choose<T: clap::ValueEnum>(what: &str, default: T) -> Result<T, Failure> {
    let name =
        |value: &T| value.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned());
    let names: Vec<String> = T::value_variants().iter().map(name).collect();
    let answer = choose_word(what, &names, &name(&default))?;
    Ok(T::from_str(&answer, true).unwrap_or(default))
}

/// Asks for one of the words.
fn choose_word<S: AsRef<str>>(what: &str, words: &[S], default: &str) -> Result<String, Failure> {
    let list = words.iter().map(AsRef::as_ref).collect::<Vec<&str>>().join(", ");
    let answer = ask(&format!("{what}: {list} (Enter: {default})"))?.to_lowercase();
    match answer.as_str() {
        "" => Ok(default.to_owned()),
        answer if words.iter().any(|word| word.as_ref() == answer) => Ok(answer.to_owned()),
        answer => Err(Failure::bad_input(anyhow!("`{answer}` is not one of {list}"))),
    }
}

fn ask(question: &str) -> Result<String, Failure> {
    let mut terminal = std::io::stderr();
    write!(terminal, "{question}: ").and_then(|()| terminal.flush()).or_failed()?;
    let mut answer = String::new();
    std::io::stdin().lock().read_line(&mut answer).or_failed()?;
    Ok(answer.trim().to_owned())
}
