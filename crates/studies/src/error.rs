//! Errors that end a study.

use marathon_config::ConfigError;
use marathon_envs::EnvError;
use marathon_learn::Error;
use marathon_render::RenderError;
use marathon_runs::{Flags, RunError};
use std::path::Path;

/// An error with a text for the user: which file or option, what was found, what was expected.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// An error of a run, a policy or a file. Its advice names the command `marathon`, which continues runs.
    #[error("{}", .0.spelled(&Flags("marathon")))]
    Run(#[from] RunError),
    /// An error of a picture.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A Python process does not start or answer.
    #[error("{0}")]
    Python(String),
    /// A command of a recipe failed.
    #[error("{0}")]
    Recipe(String),
    /// The command line is wrong.
    #[error("{0}")]
    Usage(String),
    /// The user pressed Ctrl-C. The text says what is saved and how to continue.
    #[error("interrupted: {0}")]
    Interrupted(String),
}

impl StudyError {
    /// Converts an I/O error of an operation on a file, for `map_err`.
    pub fn io(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        move |source| RunError::io(path, action)(source).into()
    }

    /// A file with wrong contents.
    pub fn file(path: &Path, place: impl ToString, found: impl ToString, expected: impl ToString) -> Self {
        RunError::file(path, place, found, expected).into()
    }

    /// Exit code of the program.
    pub fn exit_code(&self) -> u8 {
        match self {
            StudyError::Usage(_) => 2,
            StudyError::Run(error) if error.is_usage() => 2,
            StudyError::Interrupted(_) => 130,
            _ => 1,
        }
    }
}

impl From<EnvError> for StudyError {
    fn from(error: EnvError) -> Self {
        RunError::from(error).into()
    }
}

impl From<Error> for StudyError {
    fn from(error: Error) -> Self {
        RunError::from(error).into()
    }
}

impl From<ConfigError> for StudyError {
    fn from(error: ConfigError) -> Self {
        RunError::from(error).into()
    }
}
