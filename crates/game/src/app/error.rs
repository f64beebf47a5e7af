//! Errors that keep the game from starting, with their remedies.

use marathon_physics::hint::did_you_mean;
use marathon_runs::text::printable;
use marathon_runs::{Flags, RunError};
use std::path::PathBuf;
use thiserror::Error;

/// Why the game does not start.
#[derive(Debug, Error)]
pub enum GameError {
    /// The processor lacks an instruction that this program was built for.
    #[error("{0}")]
    Processor(&'static str),
    /// A missing file.
    #[error("{}: there is no such file or folder{}", .path.display(), did_you_mean(.nearest.as_ref()))]
    Missing {
        /// The path.
        path: PathBuf,
        /// Something beside it with a similar name.
        nearest: Option<String>,
    },
    /// A file of another kind than a policy.
    #[error("{0}: this is {kind}, expected a policy; show it with: marathon-game {words}{0}", .path.display())]
    Kind {
        /// The file.
        path: PathBuf,
        /// Kind of the file.
        kind: &'static str,
        /// The words of the command line before the path.
        words: &'static str,
    },
    /// A recording of another agent, or none.
    #[error("{}: {problem}", .path.display())]
    Replay {
        /// The file.
        path: PathBuf,
        /// The problem: found and expected.
        problem: String,
    },
    /// A table of the longest runs that cannot be used.
    #[error("{}: {problem}", .path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// The problem, and the remedy.
        problem: String,
    },
    /// An agent that does not exist, or a model that is not valid.
    #[error(transparent)]
    Env(#[from] marathon_envs::EnvError),
    /// A model file that is not valid.
    #[error(transparent)]
    Model(#[from] Box<marathon_physics::mjcf::MjcfError>),
    /// A policy that is missing or for another agent, a run that cannot start, or wrong options.
    #[error("{}", .0.spelled(&Flags("marathon")))]
    Run(#[from] RunError),
    /// An error of the system.
    #[error("{0}")]
    System(String),
    /// The trainer of ML-Agents was not found, or failed.
    #[error(transparent)]
    Player(#[from] marathon_mlagents::PlayerError),
    /// The standard input does not have the states of an environment.
    #[error("the standard input: {0}; the Python package writes it, see render_mode=\"human\"")]
    Stream(String),
    /// Ctrl-C or SIGTERM ended the game.
    #[error("interrupted{}", .0.as_ref().map(|path| format!(": {} is not written", path.display())).unwrap_or_default())]
    Interrupted(Option<PathBuf>),
    /// The other program has failed, or sent wrong data.
    #[error("{0}")]
    Outside(String),
    /// There is no display.
    #[error(
        "there is no display to open a window on (DISPLAY is {0}); on a machine without a screen, record a video instead: \
         marathon-game hopper --record hop.mp4, or start a virtual one: xvfb-run marathon-game"
    )]
    NoDisplay(String),
    /// There is no graphics adapter.
    #[error(
        "no graphics adapter was found: Marathon draws with Vulkan. Install your card's driver, or the software renderer: \
         apt install mesa-vulkan-drivers libvulkan1 (Debian, Ubuntu), dnf install mesa-vulkan-drivers vulkan-loader \
         (Fedora); then `vulkaninfo --summary` lists a device"
    )]
    NoGraphics,
    /// A video or picture that cannot be written.
    #[error(transparent)]
    Video(#[from] marathon_render::RenderError),
    /// A file could not be written.
    #[error("cannot write {}: {source}", .path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: std::io::Error,
    },
}

/// Makes a text from a file safe for one line of a terminal.
pub fn printable_line(text: &str) -> String {
    printable(text).replace('\n', "\\n")
}

impl From<marathon_learn::Error> for GameError {
    fn from(error: marathon_learn::Error) -> Self {
        RunError::from(error).into()
    }
}
