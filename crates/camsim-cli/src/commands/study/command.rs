//! The command of a point.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{self, Stdio},
    time::{Duration, Instant},
};

use anyhow::anyhow;
use camsim_io::{shell::quoted, write::write_atomic};
use camsim_lab::study::{Algorithm, COMMON, Study};

use crate::{
    failure::{Failure, OrFail},
    interrupt,
};

/// How often a running command is looked at.
const LOOK: Duration = Duration::from_millis(30);

/// How long a command may take to end after it was asked to.
#[cfg(unix)]
const GRACE: Duration = Duration::from_secs(2);

/// Characters of a command's last words that a message has.
const LAST_WORDS: usize = 400;

/// Program and arguments, with their folders.
pub struct Command {
    words: Vec<String>,
    point: PathBuf,
}

/// Why a command left no result.
pub enum Problem {
    /// The user wants an end.
    Stopped,
    /// What it said.
    Failed(String),
}

/// The absolute form of a path, as a command runs in the study's folder.
fn absolute(path: &Path) -> String {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned()).display().to_string()
}

impl Command {
    /// The command of a study for the point with a folder.
    pub fn new(study: &Study, point: &Path, output: &Path, python: &str) -> Self {
        let words = match study.algorithm() {
            Some(algorithm) => {
                let script = scripts(output).join(format!("{}.py", algorithm.name));
                [python, &absolute(&script), "{data}", "{result}"].map(str::to_owned).to_vec()
            }
            None => study.command.clone(),
        };
        let fill = |word: String| {
            word.replace("{data}", &absolute(&point.join("data")))
                .replace("{result}", &absolute(&point.join("result")))
        };
        Self { words: words.into_iter().map(fill).collect(), point: point.to_owned() }
    }

    /// As typed in a shell.
    pub fn describe(&self) -> String {
        self.words.iter().map(quoted).collect::<Vec<_>>().join(" ")
    }

    /// Refuses a program that is not there.
    pub fn check_program(&self, folder: &Path) -> Result<(), Failure> {
        let Some(program) = self.words.first() else { return Ok(()) };
        let is_there = match program.contains(std::path::MAIN_SEPARATOR) {
            true => folder.join(program).is_file(),
            // Elsewhere the names of programs have endings that the search adds.
            false if cfg!(unix) => std::env::var_os("PATH")
                .is_some_and(|all| std::env::split_paths(&all).any(|path| path.join(program).is_file())),
            false => true,
        };
        if is_there {
            return Ok(());
        }
        Err(Failure::bad_input(anyhow!(
            "command: there is no program `{program}`: check the study, or install it"
        )))
    }

    fn log(&self) -> PathBuf {
        self.point.join("command.log")
    }

    /// A problem with the last line that the command has printed.
    pub fn with_last_words(&self, problem: &str) -> String {
        let text = fs::read_to_string(self.log()).unwrap_or_default();
        match text.trim().lines().next_back() {
            None => format!("{problem} (it printed nothing)"),
            Some(last) => {
                format!("{problem}; its last line: {}", last.chars().take(LAST_WORDS).collect::<String>())
            }
        }
    }

    /// Runs it in a folder; its output goes to `command.log` of the point.
    pub fn run(&self, folder: &Path, timeout_s: Option<f64>, stop: &interrupt::Watch) -> Result<(), Problem> {
        let mut child = self.spawn(folder).map_err(Problem::Failed)?;
        let begin = Instant::now();
        let status = loop {
            match child.try_wait() {
                Ok(Some(status)) => break status,
                Ok(None) => {}
                Err(error) => return Err(Problem::Failed(error.to_string())),
            }
            if stop.is_asked() {
                end(&mut child);
                return Err(Problem::Stopped);
            }
            if let Some(limit_s) = timeout_s.filter(|limit_s| begin.elapsed().as_secs_f64() > *limit_s) {
                end(&mut child);
                let problem = format!("the command took longer than timeout_s = {limit_s}");
                return Err(Problem::Failed(self.with_last_words(&problem)));
            }
            #[allow(clippy::disallowed_methods, reason = "a program that ends tells no channel")]
            std::thread::sleep(LOOK);
        };
        match status.success() {
            true => Ok(()),
            false => Err(Problem::Failed(self.with_last_words(&format!("the command ended with {status}")))),
        }
    }

    /// Starts it in a process group of its own, so that all it starts can be ended, and Ctrl-C is for camsim.
    fn spawn(&self, folder: &Path) -> Result<process::Child, String> {
        let in_words = |path: &Path, error: std::io::Error| format!("{}: {error}", path.display());
        let log = self.log();
        let out = fs::File::create(&log).map_err(|error| in_words(&log, error))?;
        let err = out.try_clone().map_err(|error| in_words(&log, error))?;
        let (program, arguments) = self.words.split_first().ok_or("the command is empty")?;
        let mut command = process::Command::new(program);
        command.args(arguments).current_dir(folder).stdin(Stdio::null()).stdout(out).stderr(err);
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        command.spawn().map_err(|error| in_words(Path::new(program), error))
    }
}

/// Ends a command and what it has started.
fn end(child: &mut process::Child) {
    #[cfg(unix)]
    {
        use rustix::process::{Pid, Signal, kill_process_group};

        if let Some(group) = Pid::from_raw(child.id() as i32) {
            let _ = kill_process_group(group, Signal::TERM);
            let begin = Instant::now();
            while begin.elapsed() < GRACE && matches!(child.try_wait(), Ok(None)) {
                #[allow(clippy::disallowed_methods, reason = "a program that ends tells no channel")]
                std::thread::sleep(LOOK);
            }
            let _ = kill_process_group(group, Signal::KILL);
        }
    }
    let _ = child.kill();
    let _ = child.wait();
}

fn scripts(output: &Path) -> PathBuf {
    output.join("algorithms")
}

/// Writes an algorithm's scripts into the study's output.
pub fn write_scripts(algorithm: &Algorithm, output: &Path) -> Result<(), Failure> {
    let folder = scripts(output);
    fs::create_dir_all(&folder).or_failed()?;
    write_atomic(&folder.join("common.py"), COMMON.as_bytes()).or_failed()?;
    write_atomic(&folder.join(format!("{}.py", algorithm.name)), algorithm.script.as_bytes()).or_failed()
}

/// Refuses a Python that lacks what an algorithm imports.
pub fn check_modules(algorithm: &Algorithm, python: &str) -> Result<(), Failure> {
    let imports =
        format!("import sys, {}; sys.exit(sys.version_info < (3, 11))", algorithm.modules.join(", "));
    let tried = process::Command::new(python).args(["-c", &imports]).stdin(Stdio::null()).output();
    if tried.is_ok_and(|output| output.status.success()) {
        return Ok(());
    }
    Err(Failure::bad_input(anyhow!(
        "algorithm `{}` needs Python 3.11 or newer with {packages}, which `{python}` is not or lacks: \
         `python3 -m venv study-venv && study-venv/bin/pip install {packages}`, then add --python study-venv/bin/python",
        algorithm.name,
        packages = algorithm.packages
    )))
}
