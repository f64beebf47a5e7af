//! What ends a command early.

use crate::program;
use marathon_config::ConfigError;
use marathon_envs::EnvError;
use marathon_learn::Error;
use marathon_motion::MotionError;
use marathon_physics::mjcf::MjcfError;
use marathon_render::RenderError;
use marathon_runs::RunError;
use std::path::Path;

/// An error with a text for the user: which file or option, what was found, what was expected.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// Of a run, a policy or a film.
    #[error("{}", program::spelled(|flags| .0.spelled(flags)))]
    Run(#[from] RunError),
    /// Of a model file.
    #[error(transparent)]
    Model(#[from] MjcfError),
    /// Of a motion or a mapping.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// Of the pictures.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A process that plays is lost; what was learned is saved.
    #[error("{cause}\n{advice}")]
    Lost {
        /// What failed first.
        cause: RunError,
        /// What is left and how to go on.
        advice: String,
    },
    /// A Python program cannot be asked.
    #[error("{0}")]
    Python(String),
    /// The system refuses something.
    #[error("{0}")]
    Process(String),
    /// The game cannot be started, or failed.
    #[error("{0}")]
    Game(String),
    /// The command line makes no sense.
    #[error("{0}")]
    Usage(String),
    /// A check has found something; its report is on stdout.
    #[error("{0}")]
    Found(String),
    /// The user pressed Ctrl-C; the text says what is left and how to go on.
    #[error("interrupted: {0}")]
    Interrupted(String),
}

impl CliError {
    /// For `map_err` after something was tried on a file.
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
            CliError::Usage(_) => 2,
            CliError::Run(error) if error.is_usage() => 2,
            CliError::Interrupted(_) => 130,
            _ => 1,
        }
    }
}

impl From<EnvError> for CliError {
    fn from(error: EnvError) -> Self {
        RunError::from(error).into()
    }
}

impl From<Error> for CliError {
    fn from(error: Error) -> Self {
        RunError::from(error).into()
    }
}

impl From<ConfigError> for CliError {
    fn from(error: ConfigError) -> Self {
        RunError::from(error).into()
    }
}
