//! Where text goes: answers to standard output, everything about the work to standard error.

use std::{
    fmt,
    io::{self, Write},
};

use serde::Serialize;

use crate::failure::{DONE, Failure};

/// The two streams, and how much the user wants to hear.
pub struct Console<'a> {
    out: io::BufWriter<&'a mut dyn Write>,
    err: &'a mut dyn Write,
    quiet: bool,
    verbose: bool,
}

impl fmt::Debug for Console<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Console").field("quiet", &self.quiet).field("verbose", &self.verbose).finish_non_exhaustive()
    }
}

impl<'a> Console<'a> {
    /// Answers to `out`, the rest to `err`.
    pub fn new(out: &'a mut dyn Write, err: &'a mut dyn Write) -> Self {
        Self { out: io::BufWriter::new(out), err, quiet: false, verbose: false }
    }

    /// `-q` and `-v`.
    pub fn set_volume(&mut self, quiet: bool, verbose: bool) {
        self.quiet = quiet;
        self.verbose = verbose;
    }

    /// Whether notes and progress are unwanted.
    #[must_use]
    pub fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// Text as it is, to standard output.
    ///
    /// # Errors
    /// The stream's.
    pub fn print(&mut self, text: &str) -> io::Result<()> {
        self.out.write_all(text.as_bytes())
    }

    /// One line to standard output.
    ///
    /// # Errors
    /// The stream's.
    pub fn line(&mut self, text: impl fmt::Display) -> io::Result<()> {
        writeln!(self.out, "{text}")
    }

    /// Indented JSON to standard output.
    ///
    /// # Errors
    /// The stream's.
    pub fn json(&mut self, value: &impl Serialize) -> io::Result<()> {
        serde_json::to_writer_pretty(&mut self.out, value)?;
        writeln!(self.out)
    }

    /// Standard output, for writers.
    pub fn stdout(&mut self) -> &mut dyn Write {
        &mut self.out
    }

    /// Writes out what is buffered.
    ///
    /// # Errors
    /// The stream's.
    pub fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }

    /// A line about the work to standard error, unless `-q`.
    pub fn note(&mut self, text: impl fmt::Display) {
        if !self.quiet {
            self.complain(&format!("{text}\n"));
        }
    }

    /// The same, only with `-v`.
    pub fn detail(&mut self, text: impl fmt::Display) {
        if self.verbose {
            self.complain(&format!("{text}\n"));
        }
    }

    /// Something the user should look at, unless `-q`.
    pub fn warn(&mut self, text: impl fmt::Display) {
        self.note(format_args!("warning: {text}"));
    }

    /// Text to standard error, `-q` or not. If that stream fails there is nobody left to tell.
    pub fn complain(&mut self, text: &str) {
        let _ = self.err.write_all(text.as_bytes());
    }

    /// Says why a command failed and gives the exit code.
    pub fn report(&mut self, failure: &Failure) -> u8 {
        // What was answered before the fault comes before it.
        let _ = self.out.flush();
        if failure.is_broken_pipe() {
            return DONE;
        }
        self.complain(&format!("{failure}\n"));
        failure.code()
    }
}
