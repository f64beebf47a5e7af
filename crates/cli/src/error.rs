//! What ends a command early.

use crate::config::ConfigError;
use marathon_envs::EnvError;
use marathon_physics::mjcf::MjcfError;
use marathon_render::RenderError;
use std::path::{Path, PathBuf};

/// An error with a text for the user: which file or option, what was found, what was expected.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// Of the environments: an unknown agent, most likely.
    #[error(transparent)]
    Env(#[from] EnvError),
    /// Of the trainer.
    #[error(transparent)]
    Learn(#[from] marathon_learn::Error),
    /// Of a configuration file.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// Of a model file.
    #[error(transparent)]
    Model(#[from] MjcfError),
    /// Of the pictures.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A file or folder cannot be read or written.
    #[error("{}: {action}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// Why it failed.
        source: std::io::Error,
    },
    /// A file is not what it should be.
    #[error("{}: {place}: found {found}, expected {expected}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Where in the file.
        place: String,
        /// What is there.
        found: String,
        /// What should be there.
        expected: String,
    },
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
        move |source| CliError::Io { path: path.into(), action, source }
    }

    /// A file with wrong contents.
    pub fn file(path: &Path, place: impl ToString, found: impl ToString, expected: impl ToString) -> Self {
        let (place, found, expected) = (place.to_string(), found.to_string(), expected.to_string());
        CliError::File { path: path.into(), place, found, expected }
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
