//! Errors that end a command.

use crate::program;
use marathon_config::ConfigError;
use marathon_envs::EnvError;
use marathon_learn::Error;
use marathon_motion::MotionError;
use marathon_physics::mjcf::MjcfError;
use marathon_render::RenderError;
use marathon_runs::RunError;
use marathon_skin::SkinError;
use marathon_viewer::ViewerError;
use std::path::Path;

/// An error with a text for the user: which file or option, what was found, what was expected.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// An error of a run, a policy or a video.
    #[error("{}", program::spelled(|flags| .0.spelled(flags)))]
    Run(#[from] RunError),
    /// An error of a model file.
    #[error(transparent)]
    Model(#[from] MjcfError),
    /// An error of a motion or a mapping.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// An error of a picture.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// An error of a skin.
    #[error("{model}: {source}")]
    Skin {
        /// The model as the command line names it.
        model: String,
        /// Names the model's parts.
        source: SkinError,
    },
    /// The page cannot be shown.
    #[error(transparent)]
    Viewer(#[from] ViewerError),
    /// A rollout process is lost. The learned policy is saved.
    #[error("{cause}\n{advice}")]
    Lost {
        /// The first failure.
        cause: RunError,
        /// Names the saved files, and how to continue.
        advice: String,
    },
    /// A Python process does not start or answer.
    #[error("{0}")]
    Python(String),
    /// The game cannot be started, or failed.
    #[error("{0}")]
    Game(String),
    /// The processor lacks an instruction that this program was built for.
    #[error("{0}")]
    Processor(&'static str),
    /// The command line is wrong.
    #[error("{0}")]
    Usage(String),
    /// A check has found faults; its report is on stdout.
    #[error("{0}")]
    Found(String),
    /// The user pressed Ctrl-C. The text says what is saved and how to continue.
    #[error("interrupted: {0}")]
    Interrupted(String),
}

impl CliError {
    /// Converts an I/O error of an operation on a file, for `map_err`.
    pub fn io(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        move |source| RunError::io(path, action)(source).into()
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
