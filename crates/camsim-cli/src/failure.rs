//! Failures of commands: an error with its exit code.

use std::{fmt, io};

use camsim_engine::{GpuError, RenderError, verify::VerifyError};

/// Exit code of success.
pub const DONE: u8 = 0;
/// Exit code of a failure during the run.
pub const FAILED: u8 = 1;
/// Exit code of wrong usage or bad input.
pub const BAD_INPUT: u8 = 2;
/// Exit code of a machine without an adapter.
pub const NO_ADAPTER: u8 = 3;

/// Exit code of a run that the user stopped by Ctrl-C or SIGTERM (128 + SIGINT, as in shells).
pub const INTERRUPTED: u8 = 130;

/// An error with its exit code.
#[derive(Debug)]
pub struct Failure {
    code: u8,
    error: anyhow::Error,
}

impl Failure {
    /// Wrong usage or bad input.
    pub fn bad_input(error: impl Into<anyhow::Error>) -> Self {
        Self { code: BAD_INPUT, error: error.into() }
    }

    /// A failure with valid input.
    pub fn failed(error: impl Into<anyhow::Error>) -> Self {
        Self { code: FAILED, error: error.into() }
    }

    /// Stopped by the user; the error tells what was completed.
    pub fn interrupted(error: impl Into<anyhow::Error>) -> Self {
        Self { code: INTERRUPTED, error: error.into() }
    }

    /// Says of which variation it is; an interruption says so itself.
    #[must_use]
    pub fn of_variation(self, index: u64) -> Self {
        self.of(format_args!("variation {index}"))
    }

    /// Says what it is of; an interruption says so itself.
    #[must_use]
    pub fn of(self, what: impl fmt::Display) -> Self {
        if self.code == INTERRUPTED {
            return self;
        }
        let text = format!("{what}: {}", self.error);
        Self { code: self.code, error: self.error.context(text) }
    }

    /// With advice at the end of the message.
    #[cfg(feature = "lab")]
    #[must_use]
    pub fn with_advice(self, advice: &str) -> Self {
        let text = format!("{}{advice}", self.error);
        Self { code: self.code, error: self.error.context(text) }
    }

    /// The exit code.
    #[must_use]
    pub fn code(&self) -> u8 {
        self.code
    }

    /// The error alone, without its causes.
    #[cfg(feature = "lab")]
    #[must_use]
    pub fn message(&self) -> String {
        self.error.to_string()
    }

    /// Whether the reader of the output has closed it, which is no failure (`camsim ... | head`).
    #[must_use]
    pub fn is_broken_pipe(&self) -> bool {
        let is_of_pipe = |cause: &(dyn std::error::Error + 'static)| {
            cause.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
        };
        self.error.chain().any(is_of_pipe)
    }
}

impl fmt::Display for Failure {
    /// `error: ...`, then a line `caused by: ...` for each cause that is not part of the lines before.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut printed = self.error.to_string();
        let begin = if self.code == INTERRUPTED { "stopped" } else { "error" };
        write!(f, "{begin}: {printed}")?;
        for cause in self.error.chain().skip(1).map(ToString::to_string) {
            if !printed.contains(&cause) {
                write!(f, "\n  caused by: {cause}")?;
                printed.push_str(&cause);
            }
        }
        Ok(())
    }
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::failed(error)
    }
}

impl From<GpuError> for Failure {
    fn from(error: GpuError) -> Self {
        let code = match error {
            GpuError::NotBuilt | GpuError::NoAdapter(_) | GpuError::UnknownAdapter { .. } => NO_ADAPTER,
            GpuError::TooLarge { .. } => BAD_INPUT,
            _ => FAILED,
        };
        Self { code, error: error.into() }
    }
}

impl<E: std::error::Error + Send + Sync + 'static> From<RenderError<E>> for Failure {
    fn from(error: RenderError<E>) -> Self {
        match error {
            RenderError::Gpu(error) => error.into(),
            RenderError::Plan(error) => Self::bad_input(error),
            moving @ RenderError::Moving => Self::bad_input(moving),
            cancelled @ RenderError::Cancelled => Self::failed(cancelled),
            RenderError::Sink(error) => Self::failed(error),
        }
    }
}

impl From<VerifyError> for Failure {
    fn from(error: VerifyError) -> Self {
        match error {
            VerifyError::Render(error) => error.into(),
            VerifyError::NoCoords(_) => Self::failed(error),
            VerifyError::Solver | VerifyError::TooLarge { .. } | VerifyError::Reference(_) => {
                Self::bad_input(error)
            }
        }
    }
}

/// Maps library errors to exit codes.
pub trait OrFail<T> {
    /// The error is caused by the user's input.
    fn or_bad_input(self) -> Result<T, Failure>;
    /// The error occurred during the run.
    fn or_failed(self) -> Result<T, Failure>;
}

impl<T, E: Into<anyhow::Error>> OrFail<T> for Result<T, E> {
    fn or_bad_input(self) -> Result<T, Failure> {
        self.map_err(Failure::bad_input)
    }

    fn or_failed(self) -> Result<T, Failure> {
        self.map_err(Failure::failed)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use anyhow::Context;

    use super::*;

    #[test]
    fn causes_are_listed_once() {
        let deep = anyhow::anyhow!("disk full")
            .context("frame_000001.exr: cannot be written: disk full")
            .context("rendering stopped");
        assert_eq!(
            Failure::failed(deep).to_string(),
            "error: rendering stopped\n  caused by: frame_000001.exr: cannot be written: disk full"
        );
    }

    #[test]
    fn broken_pipes_are_no_failure() {
        let left = Err::<(), _>(io::Error::from(io::ErrorKind::BrokenPipe))
            .context("writing to standard output")
            .unwrap_err();
        assert!(Failure::failed(left).is_broken_pipe());
        assert!(!Failure::from(io::Error::from(io::ErrorKind::StorageFull)).is_broken_pipe());
    }

    #[test]
    fn missing_adapter_has_its_own_exit_code() {
        assert_eq!(Failure::from(GpuError::NoAdapter(String::new())).code(), NO_ADAPTER);
        assert_eq!(Failure::from(GpuError::Device("lost".into())).code(), FAILED);
    }
}
