//! Output streams: results go to standard output, messages to standard error.

use std::{
    collections::HashSet,
    ffi::OsString,
    fmt,
    io::{self, Write},
    path::{Path, PathBuf},
};

use camsim_io::shell::quoted;
use serde::Serialize;

use crate::failure::{DONE, Failure};

/// The two streams, and the verbosity.
pub struct Console<'a> {
    out: io::BufWriter<&'a mut dyn Write>,
    err: &'a mut dyn Write,
    quiet: bool,
    verbose: bool,
    /// The command line, with the program's name first.
    typed: Vec<OsString>,
    /// The scenario file, and the options of the command line that change it.
    scenario: Option<(PathBuf, Vec<String>)>,
    /// The camera of several that messages are about.
    camera: Option<String>,
    /// The variation of a random scenario that messages are about.
    variation: Option<u64>,
    /// What has been said, and is not said again: warnings and, of a series of variations, all notes.
    said: HashSet<String>,
    /// Whether notes are about a series of variations.
    is_series: bool,
}

impl fmt::Debug for Console<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Console")
            .field("quiet", &self.quiet)
            .field("verbose", &self.verbose)
            .finish_non_exhaustive()
    }
}

impl<'a> Console<'a> {
    /// Results go to `out`, messages to `err`.
    pub fn new(out: &'a mut dyn Write, err: &'a mut dyn Write) -> Self {
        Self {
            out: io::BufWriter::new(out),
            err,
            quiet: false,
            verbose: false,
            typed: Vec::new(),
            scenario: None,
            camera: None,
            variation: None,
            said: HashSet::new(),
            is_series: false,
        }
    }

    /// Sets the command line, for hints that repeat it.
    pub fn set_typed(&mut self, typed: Vec<OsString>) {
        self.typed = typed;
    }

    /// Sets the scenario of the command, and the options that change it.
    pub fn set_scenario(&mut self, scenario: &Path, changes: Vec<String>) {
        self.scenario = Some((scenario.into(), changes));
    }

    /// Sets the camera of several that messages are about.
    pub fn set_camera(&mut self, name: Option<&str>) {
        self.camera = name.map(str::to_owned);
    }

    /// Sets the variation of a random scenario that messages are about.
    pub fn set_variation(&mut self, index: Option<u64>) {
        self.variation = index;
    }

    /// From now on a note that several variations have is printed once, with the number of the first.
    pub fn begin_series(&mut self) {
        self.is_series = true;
    }

    /// The command line as typed.
    #[must_use]
    pub fn command(&self) -> String {
        self.typed.iter().map(quoted).collect::<Vec<_>>().join(" ")
    }

    /// The command line with one more option.
    #[must_use]
    pub fn command_with(&self, option: &str) -> String {
        let words = self.typed.iter().map(OsString::as_os_str).filter(|word| *word != option);
        words.chain([option.as_ref()]).map(quoted).collect::<Vec<_>>().join(" ")
    }

    /// Replaces `SCENARIO.toml` in the commands of a text by the scenario, with the options that change it
    /// where the command accepts them.
    #[must_use]
    pub fn whole(&self, text: &str) -> String {
        let Some((scenario, changes)) = &self.scenario else { return text.to_owned() };
        let camera = self.camera.as_ref().map(|name| format!(" --camera {name}")).unwrap_or_default();
        let path = quoted(scenario) + &camera;
        let variation = self.variation.map(|index| ["--variation".to_owned(), index.to_string()]);
        let words = changes.iter().chain(variation.iter().flatten()).map(quoted);
        let with_changes = std::iter::once(path.clone()).chain(words).collect::<Vec<_>>().join(" ");
        text.replace("camsim lens SCENARIO.toml", &format!("camsim lens {path}"))
            .replace("SCENARIO.toml", &with_changes)
    }

    /// Sets the verbosity, `-q` and `-v`.
    pub fn set_volume(&mut self, quiet: bool, verbose: bool) {
        self.quiet = quiet;
        self.verbose = verbose;
    }

    /// Whether notes and progress are suppressed.
    #[must_use]
    pub fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// Prints a text to standard output.
    ///
    /// # Errors
    /// Errors of the stream.
    pub fn print(&mut self, text: &str) -> io::Result<()> {
        self.out.write_all(text.as_bytes())
    }

    /// Prints a line to standard output.
    ///
    /// # Errors
    /// Errors of the stream.
    pub fn line(&mut self, text: impl fmt::Display) -> io::Result<()> {
        writeln!(self.out, "{text}")
    }

    /// Prints indented JSON to standard output.
    ///
    /// # Errors
    /// Errors of the stream.
    pub fn json(&mut self, value: &impl Serialize) -> io::Result<()> {
        serde_json::to_writer_pretty(&mut self.out, value)?;
        writeln!(self.out)
    }

    /// Standard output as a writer.
    pub fn stdout(&mut self) -> &mut dyn Write {
        &mut self.out
    }

    /// Flushes standard output.
    ///
    /// # Errors
    /// Errors of the stream.
    pub fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }

    /// Prints a note to standard error, unless `-q`.
    pub fn note(&mut self, text: impl fmt::Display) {
        let once = self.is_series && self.variation.is_some();
        self.say(text.to_string(), once);
    }

    /// Prints a note to standard error with `-v` only.
    pub fn detail(&mut self, text: impl fmt::Display) {
        if self.verbose {
            self.complain(&format!("{}\n", visible(&text.to_string())));
        }
    }

    /// Prints a warning to standard error, unless `-q`: once, however often a command comes across it.
    pub fn warn(&mut self, text: impl fmt::Display) {
        self.say(format!("warning: {text}"), true);
    }

    fn say(&mut self, text: String, once: bool) {
        if self.quiet || once && !self.said.insert(text.clone()) {
            return;
        }
        match self.variation.filter(|_| self.is_series) {
            Some(index) => self.complain(&format!("variation {index}: {text}\n")),
            None => self.complain(&format!("{text}\n")),
        }
    }

    /// Prints a text to standard error, even with `-q`. Errors of that stream are ignored.
    pub fn complain(&mut self, text: &str) {
        let _ = self.err.write_all(text.as_bytes());
    }

    /// Prints the reason of a failure and returns the exit code.
    pub fn report(&mut self, failure: &Failure) -> u8 {
        // Results printed before the failure come first.
        let _ = self.out.flush();
        if failure.is_broken_pipe() {
            return DONE;
        }
        self.complain(&format!("{}\n", self.whole(&visible(&failure.to_string()))));
        failure.code()
    }
}

/// A text with its control characters as escapes: they may be those of a file's name.
fn visible(text: &str) -> String {
    let shown =
        |c: char| if c.is_control() && c != '\n' { c.escape_default().collect() } else { c.to_string() };
    text.chars().map(shown).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warning_is_printed_once() {
        let (mut out, mut err) = (Vec::new(), Vec::new());
        let mut console = Console::new(&mut out, &mut err);
        for _ in 0..2 {
            console.warn("the log has a gap");
            console.note("10 frames");
        }
        console.begin_series();
        for index in [3, 4] {
            console.set_variation(Some(index));
            console.warn("the log has a gap");
            console.note("11 frames");
        }
        drop(console);
        let wanted = "warning: the log has a gap\n10 frames\n10 frames\nvariation 3: 11 frames\n";
        assert_eq!(String::from_utf8_lossy(&err), wanted);
    }

    #[test]
    fn hints_contain_complete_commands() {
        let (mut out, mut err) = (Vec::new(), Vec::new());
        let mut console = Console::new(&mut out, &mut err);
        let hint = "see `camsim lens SCENARIO.toml check` and `camsim explain SCENARIO.toml --frame 5`";
        assert_eq!(console.whole(hint), hint);
        console.set_scenario(
            Path::new("my flights/a.toml"),
            vec!["--set".into(), "camera.size_px=[9, 9]".into()],
        );
        let whole = "see `camsim lens 'my flights/a.toml' check` and `camsim explain 'my flights/a.toml' \
                     --set 'camera.size_px=[9, 9]' --frame 5`";
        assert_eq!(console.whole(hint), whole);
        console.set_camera(Some("left"));
        assert_eq!(
            console.whole("`camsim lens SCENARIO.toml check`"),
            "`camsim lens 'my flights/a.toml' --camera left check`"
        );
        console.set_typed(["target/camsim", "render", "it's.toml", "-o", "out"].map(OsString::from).to_vec());
        assert_eq!(console.command_with("--resume"), "target/camsim render 'it'\\''s.toml' -o out --resume");
        console.set_typed(["camsim", "render", "a.toml", "--resume", "-q"].map(OsString::from).to_vec());
        assert_eq!(console.command_with("--resume"), "camsim render a.toml -q --resume");
    }
}
