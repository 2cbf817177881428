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

    /// Runs it in a folder; its output goes to `command.log` of the point.
    pub fn run(&self, folder: &Path, timeout_s: Option<f64>, stop: &interrupt::Watch) -> Result<(), Problem> {
        let log = self.point.join("command.log");
        let failed = |what: String| Problem::Failed(what);
        let file = |path: &Path| {
            fs::File::create(path).map_err(|error| failed(format!("{}: {error}", path.display())))
        };
        let out = file(&log)?;
        let err = out.try_clone().map_err(|error| failed(format!("{}: {error}", log.display())))?;
        let (program, arguments) =
            self.words.split_first().ok_or_else(|| failed("the command is empty".into()))?;
        let mut child = process::Command::new(program)
            .args(arguments)
            .current_dir(folder)
            .stdin(Stdio::null())
            .stdout(out)
            .stderr(err)
            .spawn()
            .map_err(|error| failed(format!("{program}: {error}: check command in the study")))?;
        let begin = Instant::now();
        let status = loop {
            match child.try_wait() {
                Ok(Some(status)) => break status,
                Ok(None) => {}
                Err(error) => return Err(failed(format!("{program}: {error}"))),
            }
            let is_late = timeout_s.is_some_and(|limit_s| begin.elapsed().as_secs_f64() > limit_s);
            if is_late || stop.is_asked() {
                let _ = child.kill();
                let _ = child.wait();
                return Err(match is_late {
                    true => failed(format!("took longer than timeout_s = {}", timeout_s.unwrap_or(0.0))),
                    false => Problem::Stopped,
                });
            }
            #[allow(clippy::disallowed_methods, reason = "a program that ends tells no channel")]
            std::thread::sleep(LOOK);
        };
        if stop.is_asked() {
            return Err(Problem::Stopped);
        }
        if status.success() {
            return Ok(());
        }
        let text = fs::read_to_string(&log).unwrap_or_default();
        let last: String =
            text.trim().lines().next_back().unwrap_or("it said nothing").chars().take(LAST_WORDS).collect();
        Err(failed(format!("the command ended with {status}: {last} ({})", log.display())))
    }
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
