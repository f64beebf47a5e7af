//! What keeps a run from beginning, going on or being read. Errors carry the names of options, not their spelling.

use crate::text::{path_word, thousands};
use marathon_config::ConfigError;
use marathon_envs::EnvError;
use marathon_learn::Error;
use marathon_motion::MotionError;
use marathon_physics::hint::did_you_mean;
use std::fmt;
use std::path::{Path, PathBuf};

/// How a front end spells what a message speaks of.
pub trait Spelling {
    /// An option by its name, such as `steps`.
    fn option(&self, name: &str) -> String;
    /// An option with a value that it could be given.
    fn with_value(&self, name: &str, value: &str) -> String;
    /// What goes on with the run in a folder.
    fn resume(&self, folder: &Path) -> String;
}

/// Names as they are.
pub struct Plain;

impl Spelling for Plain {
    fn option(&self, name: &str) -> String {
        name.into()
    }
    fn with_value(&self, name: &str, value: &str) -> String {
        format!("{name} {value}")
    }
    fn resume(&self, folder: &Path) -> String {
        format!("resuming {}", path_word(folder))
    }
}

/// Options as flags of a command line, advice as commands of the program with this name.
pub struct Flags<'a>(pub &'a str);

impl Spelling for Flags<'_> {
    fn option(&self, name: &str) -> String {
        format!("--{}", name.replace('_', "-"))
    }
    fn with_value(&self, name: &str, value: &str) -> String {
        format!("--{name} {value}")
    }
    fn resume(&self, folder: &Path) -> String {
        format!("`{} train --resume {}`", self.0, path_word(folder))
    }
}

/// An error with a text for the user: which file or option, what was found, what was expected.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// Of the environments: an unknown agent, most likely.
    Env(#[from] EnvError),
    /// Of the trainer; or of a file, whose errors are worded there.
    Learn(#[from] Error),
    /// Of a configuration file.
    Config(#[from] ConfigError),
    /// An option has a value that makes no sense here.
    Option {
        /// Name of the option.
        name: &'static str,
        /// What is said of it: what it is and what was expected.
        problem: String,
    },
    /// An option of new runs was given for one that is to go on.
    NewRunOnly {
        /// Name of the option.
        name: &'static str,
    },
    /// The folder of a new run holds another.
    HoldsRun(PathBuf),
    /// There is no run to go on with.
    NoRun {
        /// Where it was looked for.
        folder: PathBuf,
        /// What is there.
        found: &'static str,
        /// A run whose folder is called almost like that.
        nearest: Option<String>,
    },
    /// The run has done all its steps.
    Complete {
        /// Its folder.
        folder: PathBuf,
        /// Its steps.
        steps: u64,
    },
    /// A task cannot be told how fast to go.
    NoSpeed {
        /// The task.
        task: String,
        /// Tasks that can.
        others: Vec<String>,
    },
    /// A picture of the results cannot be drawn.
    Draw {
        /// The picture.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// Of a motion clip or a recording.
    Motion(#[from] MotionError),
    /// A recording does not become a clip by itself.
    Recording {
        /// Why.
        error: MotionError,
        /// The recording.
        path: PathBuf,
        /// Name of the agent that is to follow it.
        agent: String,
    },
    /// A process that plays has failed.
    Process(String),
    /// The system does not report Ctrl-C.
    Signal(String),
    /// Training stopped because its results could no longer be written.
    Stopped {
        /// What failed first.
        cause: Box<RunError>,
        /// The folder of the run.
        folder: PathBuf,
        /// Steps that were done.
        steps: u64,
        /// Steps of the last whole checkpoint; none if there is none.
        saved: Option<u64>,
    },
}

impl RunError {
    /// For `map_err` after something was tried on a file.
    pub fn io(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        move |source| Error::Io { path: path.into(), action, source }.into()
    }

    /// A file with wrong contents.
    pub fn file(path: &Path, place: impl ToString, found: impl ToString, expected: impl ToString) -> Self {
        let (place, found, expected) = (place.to_string(), found.to_string(), expected.to_string());
        Error::File { path: path.into(), place, found, expected }.into()
    }

    /// An option with a wrong value.
    pub fn option(name: &'static str, problem: impl Into<String>) -> Self {
        RunError::Option { name, problem: problem.into() }
    }

    /// Whether the options are at fault, not the files or the machine.
    pub fn is_usage(&self) -> bool {
        matches!(
            self,
            RunError::Option { .. } | RunError::NewRunOnly { .. } | RunError::HoldsRun(_) | RunError::Complete { .. }
        )
    }

    /// The text with options and advice as a front end spells them.
    pub fn spelled(&self, spelling: &dyn Spelling) -> String {
        match self {
            RunError::Env(error) => error.to_string(),
            RunError::Learn(error) => error.to_string(),
            RunError::Config(error) => error.to_string(),
            RunError::Option { name, problem } => format!("{} {problem}", spelling.option(name)),
            RunError::NewRunOnly { name } => format!(
                "{} belongs to a new run, not to one that {} goes on with",
                spelling.option(name),
                spelling.option("resume")
            ),
            RunError::HoldsRun(folder) => format!(
                "{} {} holds a run already; go on with it by {}, or choose another folder",
                spelling.option("out"),
                path_word(folder),
                spelling.resume(folder)
            ),
            RunError::NoRun { folder, found, nearest } => {
                let nearest = did_you_mean(nearest.as_ref());
                format!(
                    "{}: {}: found {found}, expected the folder of a run{nearest}",
                    folder.display(),
                    spelling.option("resume")
                )
            }
            RunError::Complete { folder, steps } => format!(
                "{}: the run is complete with {} steps; to let it learn on, give it more, such as {}",
                folder.display(),
                thousands(*steps),
                spelling.with_value("steps", &thousands(steps.saturating_mul(2)))
            ),
            RunError::NoSpeed { task, others } => {
                format!("{task} cannot be told a speed; expected a policy for one of {}", others.join(", "))
            }
            RunError::Draw { path, reason } => format!("{}: {reason}", path.display()),
            RunError::Motion(error) => error.to_string(),
            RunError::Recording { error, path, agent } => format!(
                "{error}\n`marathon motion import {} --model {agent} --mapping F.json --out F.motion` makes a clip of it \
                 with a mapping of your own",
                path_word(path)
            ),
            RunError::Process(text) | RunError::Signal(text) => text.clone(),
            RunError::Stopped { cause, folder, steps, saved } => {
                let (done, resume) = (thousands(*steps), spelling.resume(folder));
                let advice = match saved {
                    Some(saved) if saved == steps => {
                        format!("training stopped; its {done} steps are saved: mend that and go on by {resume}")
                    }
                    Some(saved) => format!(
                        "training stopped; the last whole checkpoint has {} of {done} steps: mend that and go on by {resume}",
                        thousands(*saved)
                    ),
                    None => {
                        format!("training stopped before its first checkpoint: mend that and start again by {resume}")
                    }
                };
                format!("{}\n{advice}", cause.spelled(spelling))
            }
        }
    }
}

impl fmt::Display for RunError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.spelled(&Plain))
    }
}
