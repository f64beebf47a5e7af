//! What ends a command early.

use crate::config::ConfigError;
use marathon_envs::EnvError;
use marathon_learn::Error;
use marathon_physics::mjcf::MjcfError;
use marathon_render::RenderError;
use std::path::{Path, PathBuf};

/// An error with a text for the user: which file or option, what was found, what was expected.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// Of the environments: an unknown agent, most likely.
    #[error(transparent)]
    Env(#[from] EnvError),
    /// Of the trainer; or of a file, whose errors are worded there.
    #[error(transparent)]
    Learn(#[from] Error),
    /// Of a configuration file.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// Of a model file.
    #[error(transparent)]
    Model(#[from] MjcfError),
    /// Of the pictures.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A picture of the results cannot be drawn.
    #[error("{}: {reason}", path.display())]
    Draw {
        /// The picture.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// Training stopped because its results could no longer be written.
    #[error("{cause}\n{advice}")]
    Stopped {
        /// What failed first.
        cause: Box<CliError>,
        /// What is left and how to go on.
        advice: String,
    },
    /// A Python program cannot be asked.
    #[error("{0}")]
    Python(String),
    /// A process of this program has failed.
    #[error("{0}")]
    Process(String),
    /// The game cannot be started, or failed.
    #[error("{0}")]
    Game(String),
    /// The command line makes no sense.
    #[error("{0}")]
    Usage(String),
    /// The user pressed Ctrl-C; the text says what is left and how to go on.
    #[error("interrupted: {0}")]
    Interrupted(String),
}

impl CliError {
    /// For `map_err` after something was tried on a file.
    pub fn io(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        move |source| Error::Io { path: path.into(), action, source }.into()
    }

    /// A file with wrong contents.
    pub fn file(path: &Path, place: impl ToString, found: impl ToString, expected: impl ToString) -> Self {
        let (place, found, expected) = (place.to_string(), found.to_string(), expected.to_string());
        Error::File { path: path.into(), place, found, expected }.into()
    }

    /// Exit code of the program.
    pub fn exit_code(&self) -> u8 {
        match self {
            CliError::Usage(_) => 2,
            CliError::Interrupted(_) => 130,
            _ => 1,
        }
    }
}
