//! `camsim study`.

use std::{
    collections::{HashMap, HashSet},
    fs,
    path::{Path, PathBuf},
};

use anyhow::anyhow;
use camsim_io::{
    inputs::{file_fingerprints, scenario_fingerprints},
    write::write_atomic,
};
use camsim_lab::study::{
    ALGORITHMS, Algorithm, COMMON, Done, Numbers, Point, Study, is_plot, plots, summary, table,
};

use super::render::RenderBackend;
use crate::{
    console::Console,
    failure::{Failure, INTERRUPTED, OrFail},
    frame_list::Shard,
    inputs::{Changes, read_changed},
    interrupt,
};

mod command;
mod frames;

use command::Command;
use frames::Frames;

/// Run an algorithm on the frames of many scenarios
///
/// A study names a scenario, keys with several values, and a command or one of camsim's algorithms. Each combination of
/// values is rendered, the command runs on its frames and writes numbers, and these are collected: study.csv has all,
/// study.md the means with their ranges over the seeds, plots/ a plot of each. The same command again goes on where the
/// last one stopped; points that are done stay, also when the study gets more values.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  camsim study readout.toml                  all points, into ./readout-study
  camsim study readout.toml --dry-run        which points there are, and what each runs
  camsim study readout.toml -o out --shard 2/4
                                             the second of four machines; without --shard, the rest and the tables
  camsim study --algorithms                  the algorithms that come with camsim

A study that sweeps the readout time against tracked features:
  scenario = \"flight.toml\"
  algorithm = \"tracking\"                     # or command = [\"python3\", \"my.py\", \"{data}\", \"{result}\"]
  seeds = [1, 2, 3]
  [[vary]]
  key = \"camera.shutter.readout_ms\"
  values = [0, 10, 20, 30, 40]")]
pub struct StudyArgs {
    /// Study (TOML)
    #[arg(required_unless_present = "algorithms")]
    study: Option<PathBuf>,
    /// Output folder [default: the study's name, that of --algorithm, and "-study"]
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Run only the I-th of N parts of the points, with I from 1
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Renderer
    #[arg(long, value_enum)]
    backend: Option<RenderBackend>,
    /// One of camsim's algorithms, instead of the study's algorithm or command
    #[arg(long, value_name = "NAME", value_parser = clap::builder::PossibleValuesParser::new(Algorithm::names()))]
    algorithm: Option<String>,
    /// Python for camsim's algorithms
    #[arg(long, value_name = "PROGRAM", default_value = "python3")]
    python: String,
    /// Print the points and their commands, and exit
    #[arg(long)]
    dry_run: bool,
    /// Print the algorithms that come with camsim, and exit
    #[arg(long, exclusive = true)]
    algorithms: bool,
}

/// Runs a study.
pub fn run(args: &StudyArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let Some(path) = &args.study else {
        for algorithm in ALGORITHMS {
            console.line(format_args!("{:<12} {}", algorithm.name, algorithm.about))?;
            console.line(format_args!("{:<12} needs {}", "", algorithm.packages))?;
        }
        return Ok(());
    };
    let algorithm = args.algorithm.as_deref();
    let study = Study::read(path, algorithm).or_bad_input()?;
    let folder = path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
    let output = args.output.clone().unwrap_or_else(|| default_folder(path, algorithm));
    let frames = Frames::of(&study, args.backend)?;
    let runner = Runner { study: &study, frames, folder, output: &output, args };
    let tasks = runner.tasks(console)?;
    if args.dry_run {
        for task in &tasks {
            console.line(format_args!("{}\n  {}", task.point.label(), runner.command(task).describe()))?;
        }
        return Ok(());
    }
    runner.prepare(&tasks)?;
    let [shard, of] = args.shard.map_or([1, 1], |shard| shard.0);
    let mine: Vec<&Task> =
        (0..).zip(&tasks).filter(|(index, _)| index % of == shard - 1).map(|(_, task)| task).collect();
    let mut problems = HashMap::new();
    let stop = interrupt::watch();
    for (number, task) in (1..).zip(&mine) {
        if task.result().is_some() {
            continue;
        }
        console.note(format_args!("point {number} of {}: {}", mine.len(), task.point.label()));
        match runner.run(task, &stop, console) {
            Ok(()) => {}
            Err(PointFailure::Point(problem)) => {
                console.warn(format_args!("{}: {problem}", task.point.label()));
                problems.insert(task.folder.clone(), problem);
            }
            Err(PointFailure::Stopped) => {
                return Err(Failure::interrupted(anyhow!(
                    "{} of {} points have their results; continue: {}",
                    mine.iter().filter(|task| task.result().is_some()).count(),
                    mine.len(),
                    console.command()
                )));
            }
        }
    }
    if let Some(shard) = args.shard {
        console.note(format_args!(
            "shard {shard}: {} of its {} points are done; without --shard, the same command writes the tables",
            mine.len() - problems.len(),
            mine.len()
        ));
    } else {
        let done = |task: &Task| {
            let problem = || problems.get(&task.folder).cloned().unwrap_or_else(|| "not run".to_owned());
            Done { point: task.point.clone(), result: task.result().ok_or_else(problem) }
        };
        let all: Vec<Done> = tasks.iter().map(done).collect();
        write_tables(&study, &all, &output, console)?;
    }
    match problems.len() {
        0 => Ok(()),
        failed => Err(Failure::failed(anyhow!(
            "{failed} of {} points failed; the same command tries them again",
            mine.len()
        ))),
    }
}

fn default_folder(study: &Path, algorithm: Option<&str>) -> PathBuf {
    let mut name = study.file_stem().unwrap_or("camsim".as_ref()).to_owned();
    if let Some(algorithm) = algorithm {
        name.push(format!("-{algorithm}"));
    }
    name.push("-study");
    PathBuf::from(name)
}

/// Writes the tables and plots, and prints the summary.
fn write_tables(
    study: &Study,
    all: &[Done],
    output: &Path,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let markdown = summary(all);
    write_atomic(&output.join("study.csv"), table(all).as_bytes()).or_failed()?;
    write_atomic(&output.join("study.md"), markdown.as_bytes()).or_failed()?;
    let folder = output.join("plots");
    fs::create_dir_all(&folder).or_failed()?;
    // Plots of numbers and keys that the study no longer has; other files of the folder stay.
    for entry in fs::read_dir(&folder).or_failed()?.flatten() {
        if is_plot(&entry.file_name().to_string_lossy()) {
            fs::remove_file(entry.path()).or_failed()?;
        }
    }
    for (name, svg) in plots(study, all) {
        match svg {
            Ok(svg) => write_atomic(&folder.join(name), svg.as_bytes()).or_failed()?,
            Err(error) => console.warn(error),
        }
    }
    console.print(&markdown)?;
    console.note(format_args!("{}: study.csv, study.md, plots", output.display()));
    Ok(())
}

/// A point with what its frames and its result depend on.
struct Task {
    point: Point,
    folder: PathBuf,
    /// Keys, inputs, frames and layout.
    of_frames: String,
    /// These, and the command with its files.
    of_result: String,
}

impl Task {
    /// The numbers of a point that is done, by this command on these frames.
    fn result(&self) -> Option<Numbers> {
        let stated = fs::read_to_string(self.folder.join("result.txt")).ok()?;
        (stated == self.of_result).then(|| Numbers::read(&self.folder.join("result")).ok()).flatten()
    }

    /// Removes what an earlier study has left that is not of these frames or of this command.
    fn clear(&self) -> std::io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        for old in ["result", "result.txt"] {
            let _ = fs::remove_file(self.folder.join(old));
        }
        let (data, stated) = (self.folder.join("data"), self.folder.join("data.txt"));
        if data.exists() && !fs::read_to_string(&stated).is_ok_and(|text| text == self.of_frames) {
            fs::remove_dir_all(&data)?;
        }
        fs::write(stated, &self.of_frames)
    }
}

/// What a point's failure ends.
enum PointFailure {
    /// The point alone.
    Point(String),
    /// The study, as the user wants.
    Stopped,
}

/// What points are run with.
struct Runner<'a> {
    study: &'a Study,
    frames: Frames,
    /// The study's.
    folder: &'a Path,
    output: &'a Path,
    args: &'a StudyArgs,
}

impl Runner<'_> {
    fn scenario(&self) -> PathBuf {
        self.folder.join(&self.study.scenario)
    }

    fn changes(&self, point: &Point) -> Changes {
        Changes { sets: point.sets(self.study), preset: None }
    }

    fn command(&self, task: &Task) -> Command {
        Command::new(self.study, &task.folder, self.output, &self.args.python)
    }

    /// All points. Refuses those whose scenario is wrong, and points that are the same, before the first is rendered.
    fn tasks(&self, console: &mut Console<'_>) -> Result<Vec<Task>, Failure> {
        let study = self.study;
        let command = format!(
            "algorithm = {:?}\ncommand = {:?}\n{:?}\n",
            study.algorithm().map(|algorithm| (algorithm.script, COMMON)),
            study.command,
            // A script that changes makes other results.
            file_fingerprints(
                study
                    .command
                    .iter()
                    .map(|word| self.folder.join(word))
                    .filter(|path| path.is_file())
                    .collect()
            )
        );
        let mut known = HashSet::new();
        let mut tasks = Vec::new();
        for point in study.points() {
            if !known.insert(point.folder()) {
                return Err(Failure::bad_input(anyhow!("two points are the same: {}", point.label())));
            }
            let read = read_changed(&self.scenario(), &self.changes(&point), console);
            // Values of one key may need values of another one.
            let advice = match study.vary.is_empty() {
                true => "",
                false => "; for keys that change together, list points with [[point]] instead of [[vary]]",
            };
            let read = read.map_err(|failure| failure.of(point.label()).with_advice(advice))?;
            if read.is_random() {
                return Err(Failure::bad_input(anyhow!(
                    "{} has [randomize], whose values a study would not know: remove it, and name the values in \
                     [[vary]] or [[point]]",
                    self.scenario().display()
                )));
            }
            let rig = read.into_base();
            let mut of_frames = format!(
                "{}\nframes = {:?}\nlayout = {:?}\nbackend = {:?}\n",
                point.label(),
                study.frames,
                study.layout(),
                self.args.backend
            );
            for scenario in rig.scenarios() {
                of_frames += &serde_json::to_string(scenario).or_failed()?;
                of_frames += &format!("\n{:?}\n", scenario_fingerprints(scenario));
            }
            let of_result = format!("{of_frames}{command}");
            let folder = self.output.join("points").join(point.folder());
            tasks.push(Task { point, folder, of_frames, of_result });
        }
        Ok(tasks)
    }

    /// Writes the algorithm's scripts; refuses a program that is not there, and a Python without the modules.
    fn prepare(&self, tasks: &[Task]) -> Result<(), Failure> {
        fs::create_dir_all(self.output)
            .map_err(|error| Failure::failed(anyhow!("{}: {error}", self.output.display())))?;
        if let Some(algorithm) = self.study.algorithm() {
            command::write_scripts(algorithm, self.output)?;
            return command::check_modules(algorithm, &self.args.python);
        }
        tasks.first().map_or(Ok(()), |task| self.command(task).check_program(self.folder))
    }

    /// Renders a point and runs its command.
    fn run(
        &self,
        task: &Task,
        stop: &interrupt::Watch,
        console: &mut Console<'_>,
    ) -> Result<(), PointFailure> {
        if stop.is_asked() {
            return Err(PointFailure::Stopped);
        }
        let failed =
            |error: std::io::Error| PointFailure::Point(format!("{}: {error}", task.folder.display()));
        task.clear().map_err(failed)?;
        self.frames
            .render(self.scenario(), self.changes(&task.point), task.folder.join("data"), console)
            .map_err(|failure| match failure.code() {
                INTERRUPTED => PointFailure::Stopped,
                _ => PointFailure::Point(failure.message()),
            })?;
        let command = self.command(task);
        command.run(self.folder, self.study.timeout_s, stop).map_err(|problem| match problem {
            command::Problem::Stopped => PointFailure::Stopped,
            command::Problem::Failed(problem) => PointFailure::Point(problem),
        })?;
        Numbers::read(&task.folder.join("result"))
            .map_err(|error| PointFailure::Point(command.with_last_words(&error.to_string())))?;
        write_atomic(&task.folder.join("result.txt"), task.of_result.as_bytes())
            .map_err(|error| PointFailure::Point(error.to_string()))?;
        if !self.study.keep_frames {
            let _ = fs::remove_dir_all(task.folder.join("data"));
        }
        Ok(())
    }
}
