//! Errors of runs. They carry the names of options, not their spelling.

use crate::text::{path_word, thousands};
use marathon_config::ConfigError;
use marathon_envs::EnvError;
use marathon_learn::Error;
use marathon_motion::MotionError;
use marathon_physics::hint::did_you_mean;
use std::fmt;
use std::path::{Path, PathBuf};

/// How a front end spells options and advice in messages.
pub trait Spelling {
    /// The spelling of an option, such as `--steps` for `steps`.
    fn option(&self, name: &str) -> String;
    /// The spelling of an option with a suggested value.
    fn with_value(&self, name: &str, value: &str) -> String;
    /// The advice on how to resume the run in a folder.
    fn resume(&self, folder: &Path) -> String;
}

/// Plain names.
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
    /// An error of the environments, usually an unknown agent.
    Env(#[from] EnvError),
    /// An error of the trainer, or of a file, whose text comes from there.
    Learn(#[from] Error),
    /// An error of a configuration file.
    Config(#[from] ConfigError),
    /// An option has an invalid value.
    Option {
        /// Name of the option.
        name: &'static str,
        /// The problem: the found value and the valid values.
        problem: String,
    },
    /// An option of new runs was given when resuming.
    NewRunOnly {
        /// Name of the option.
        name: &'static str,
    },
    /// The folder of a new run already holds one.
    HoldsRun(PathBuf),
    /// There is no run to resume.
    NoRun {
        /// The folder.
        folder: PathBuf,
        /// Its contents.
        found: &'static str,
        /// The folder of a run with a similar name.
        nearest: Option<String>,
    },
    /// The run has done all its steps.
    Complete {
        /// Its folder.
        folder: PathBuf,
        /// Its steps.
        steps: u64,
    },
    /// The task has no speed command.
    NoSpeed {
        /// The task.
        task: String,
        /// Tasks with a speed command.
        others: Vec<String>,
    },
    /// A picture of the results cannot be drawn.
    Draw {
        /// The picture.
        path: PathBuf,
        /// Reason.
        reason: String,
    },
    /// An error of a motion clip or a recording.
    Motion(#[from] MotionError),
    /// A recording cannot be converted to a clip automatically.
    Recording {
        /// Reason.
        error: MotionError,
        /// The recording.
        path: PathBuf,
        /// Name of the agent that should follow it.
        agent: String,
    },
    /// A rollout process has failed.
    Process(String),
    /// The system does not report Ctrl-C.
    Signal(String),
    /// A stage of a recipe is not what it was when its results were made.
    StageChanged {
        /// Name of the stage.
        stage: String,
        /// Its folder.
        folder: PathBuf,
        /// The first place that differs.
        place: String,
        /// The value that it was made with.
        made: String,
        /// The value now.
        now: String,
    },
    /// Training stopped because its results could no longer be written.
    Stopped {
        /// The first failure.
        cause: Box<RunError>,
        /// The folder of the run.
        folder: PathBuf,
        /// Number of steps done.
        steps: u64,
        /// Steps of the last complete checkpoint. `None` without a checkpoint.
        saved: Option<u64>,
    },
}

impl RunError {
    /// Converts an I/O error of an action on a file, for `map_err`.
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

    /// Whether the error lies in the options, not in files or the machine.
    pub fn is_usage(&self) -> bool {
        matches!(
            self,
            RunError::Option { .. } | RunError::NewRunOnly { .. } | RunError::HoldsRun(_) | RunError::Complete { .. }
        )
    }

    /// The text, with options and advice in a front end's spelling.
    pub fn spelled(&self, spelling: &dyn Spelling) -> String {
        match self {
            RunError::Env(error) => error.to_string(),
            RunError::Learn(error) => error.to_string(),
            RunError::Config(error) => error.to_string(),
            RunError::Option { name, problem } => format!("{} {problem}", spelling.option(name)),
            RunError::NewRunOnly { name } => format!(
                "{} is for new runs, not for one that {} continues",
                spelling.option(name),
                spelling.option("resume")
            ),
            RunError::HoldsRun(folder) => format!(
                "{} {} already holds a run; continue it by {}, or choose another folder",
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
                "{}: the run is complete with {} steps; to train longer, set more, such as {}",
                folder.display(),
                thousands(*steps),
                spelling.with_value("steps", &thousands(steps.saturating_mul(2)))
            ),
            RunError::NoSpeed { task, others } => {
                format!("{task} has no speed command; expected a policy for one of {}", others.join(", "))
            }
            RunError::Draw { path, reason } => format!("{}: {reason}", path.display()),
            RunError::Motion(error) => error.to_string(),
            RunError::Recording { error, path, agent } => format!(
                "{error}\n`marathon motion import {} --model {agent} --mapping F.json --out F.motion` makes a clip of it \
                 with a mapping of your own",
                path_word(path)
            ),
            RunError::Process(text) | RunError::Signal(text) => text.clone(),
            RunError::StageChanged { stage, folder, place, made, now } => format!(
                "{}: {place}: found {now}, expected {made}, which the stage '{stage}' was made with; {} discards its results \
                 and makes it again, {} starts in another folder",
                folder.display(),
                spelling.with_value("redo", stage),
                spelling.with_value("out", "DIR")
            ),
            RunError::Stopped { cause, folder, steps, saved } => {
                let (done, resume) = (thousands(*steps), spelling.resume(folder));
                let advice = match saved {
                    Some(saved) if saved == steps => {
                        format!(
                            "training stopped; its {done} steps are saved: fix the problem and continue by {resume}"
                        )
                    }
                    Some(saved) => format!(
                        "training stopped; the last complete checkpoint has {} of {done} steps: fix the problem and continue by {resume}",
                        thousands(*saved)
                    ),
                    None => {
                        format!(
                            "training stopped before its first checkpoint: fix the problem and start again by {resume}"
                        )
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
