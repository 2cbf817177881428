//! `camsim study`.

use std::{
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
};

use anyhow::anyhow;
use camsim_io::write::write_atomic;
use camsim_lab::study::{
    ALGORITHMS, Algorithm, Done, Numbers, Point, Study, StudyError, plots, summary, table,
};

use super::render::RenderBackend;
use crate::{
    console::Console,
    failure::{Failure, OrFail},
    frame_list::Shard,
    inputs::{Changes, read_changed},
    interrupt,
};

mod command;
mod frames;

use command::Command;

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
    /// Output folder [default: the study's name + "-study"]
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
    let study = Study::read(path).or_bad_input()?.with_algorithm(args.algorithm.as_deref());
    let folder = path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
    let output = args.output.clone().unwrap_or_else(|| default_folder(path));
    let runner = Runner { study: &study, folder, output: &output, args };
    let points = study.points();
    runner.check_all(&points, console)?;
    if args.dry_run {
        for point in &points {
            console.line(format_args!("{}\n  {}", point.label(), runner.command(point).describe()))?;
        }
        return Ok(());
    }
    runner.prepare()?;
    let [shard, of] = args.shard.map_or([1, 1], |shard| shard.0);
    let mine: Vec<&Point> =
        (0..).zip(&points).filter(|(index, _)| index % of == shard - 1).map(|(_, point)| point).collect();
    let mut problems = HashMap::new();
    let stop = interrupt::watch();
    for (number, point) in (1..).zip(&mine) {
        if runner.result(point).is_some() {
            continue;
        }
        console.note(format_args!("point {number} of {}: {}", mine.len(), point.label()));
        match runner.run(point, &stop, console) {
            Ok(()) => {}
            Err(PointFailure::Point(problem)) => {
                console.warn(format_args!("{}: {problem}", point.label()));
                problems.insert(point.folder(), problem);
            }
            Err(PointFailure::All(failure)) => return Err(failure),
        }
    }
    if let Some(shard) = args.shard {
        let failed = problems.len();
        console.note(format_args!(
            "shard {shard}: {} of its {} points are done; without --shard, the same command writes the tables",
            mine.len() - failed,
            mine.len()
        ));
    } else {
        let done = |point: Point| {
            let problem = || problems.get(&point.folder()).cloned().unwrap_or_else(|| "not run".to_owned());
            let result = runner.result(&point).ok_or_else(problem);
            Done { point, result }
        };
        let all: Vec<Done> = points.iter().cloned().map(done).collect();
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

fn default_folder(study: &Path) -> PathBuf {
    let mut name = study.file_stem().unwrap_or("camsim".as_ref()).to_owned();
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
    match plots(study, all) {
        Ok(plots) => {
            fs::create_dir_all(&folder).or_failed()?;
            for (name, svg) in plots {
                write_atomic(&folder.join(name), svg.as_bytes()).or_failed()?;
            }
        }
        Err(error) => console.warn(error),
    }
    console.print(&markdown)?;
    console.note(format_args!("{}: study.csv, study.md, plots", output.display()));
    Ok(())
}

/// What a point's failure ends.
enum PointFailure {
    /// The point alone.
    Point(String),
    /// The study: what it needs is missing, or the user has stopped it.
    All(Failure),
}

/// What points are run with.
struct Runner<'a> {
    study: &'a Study,
    /// The study's.
    folder: &'a Path,
    output: &'a Path,
    args: &'a StudyArgs,
}

impl Runner<'_> {
    fn point_folder(&self, point: &Point) -> PathBuf {
        self.output.join("points").join(point.folder())
    }

    fn scenario(&self) -> PathBuf {
        self.folder.join(&self.study.scenario)
    }

    fn changes(&self, point: &Point) -> Changes {
        Changes { sets: point.sets(self.study), preset: None }
    }

    fn command(&self, point: &Point) -> Command {
        Command::new(self.study, &self.point_folder(point), self.output, &self.args.python)
    }

    /// Refuses points whose scenario is wrong, before the first is rendered.
    fn check_all(&self, points: &[Point], console: &mut Console<'_>) -> Result<(), Failure> {
        for point in points {
            let read = read_changed(&self.scenario(), &self.changes(point), console);
            read.map_err(|failure| failure.of(point.label()))?;
        }
        Ok(())
    }

    /// Writes the algorithm's scripts, and checks that their modules are there.
    fn prepare(&self) -> Result<(), Failure> {
        fs::create_dir_all(self.output).or_failed()?;
        self.study.algorithm().map_or(Ok(()), |algorithm| {
            command::write_scripts(algorithm, self.output)?;
            command::check_modules(algorithm, &self.args.python)
        })
    }

    /// The numbers of a point that is done, by this command on these frames.
    fn result(&self, point: &Point) -> Option<Numbers> {
        let folder = self.point_folder(point);
        let stated = fs::read_to_string(folder.join("point.txt")).ok()?;
        if stated != self.statement(point) {
            return None;
        }
        Numbers::read(&folder.join("result")).ok()
    }

    /// What a point's result depends on.
    fn statement(&self, point: &Point) -> String {
        let study = self.study;
        let lines = point.sets(study).into_iter().map(|(key, value)| format!("{key} = {value}\n"));
        let rest = format!(
            "frames = {:?}\nlayout = {:?}\nalgorithm = {:?}\ncommand = {:?}\n",
            study.frames,
            study.layout(),
            study.algorithm().map(|algorithm| algorithm.script),
            study.command
        );
        lines.collect::<String>() + &rest
    }

    /// Renders a point and runs its command.
    fn run(
        &self,
        point: &Point,
        stop: &interrupt::Watch,
        console: &mut Console<'_>,
    ) -> Result<(), PointFailure> {
        let folder = self.point_folder(point);
        let all = |failure: Failure| PointFailure::All(failure);
        fs::create_dir_all(&folder).or_failed().map_err(all)?;
        for old in ["result", "point.txt"] {
            let _ = fs::remove_file(folder.join(old));
        }
        frames::render(self, point, &folder.join("data"), console).map_err(all)?;
        self.command(point).run(self.folder, self.study.timeout_s, stop).map_err(
            |problem| match problem {
                command::Problem::Stopped => PointFailure::All(Failure::interrupted(anyhow!(
                    "{} points have their results; continue: {}",
                    self.study.points().iter().filter(|point| self.result(point).is_some()).count(),
                    console.command()
                ))),
                command::Problem::Failed(problem) => PointFailure::Point(problem),
            },
        )?;
        Numbers::read(&folder.join("result"))
            .map_err(|error: StudyError| PointFailure::Point(error.to_string()))?;
        write_atomic(&folder.join("point.txt"), self.statement(point).as_bytes()).or_failed().map_err(all)?;
        if !self.study.keep_frames {
            let _ = fs::remove_dir_all(folder.join("data"));
        }
        Ok(())
    }
}
