//! Kept runs of long studies. An interrupted study continues with them. A small file next to each run's folder has its
//! results, which are enough for the study's page.

use crate::args::Options;
use crate::error::StudyError;
use marathon_config::Loaded;
use marathon_learn::{Control, IterationStats};
use marathon_physics::budget;
use marathon_runs::folder::write_json;
use marathon_runs::run_file::difference_of_runs;
use marathon_runs::terminal::interrupt;
use marathon_runs::{LearnOptions, RunError, RunFile, RunFolder, RunOptions, Session, Summary, Task, TaskOptions};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

/// A training of a study.
pub struct Job {
    /// Registry name of the task.
    pub task: String,
    /// Options of the task.
    pub arguments: TaskOptions,
    pub seed: u64,
    /// Its configuration; `--steps` of the study overrides the steps of the configuration.
    pub loaded: Loaded,
    /// The policy that training starts from; `None` for random weights.
    pub initialize_from: Option<PathBuf>,
}

impl Job {
    /// Options of a new run.
    fn new_run(&self, options: &Options) -> RunOptions {
        let learn = LearnOptions {
            steps: options.steps,
            seed: Some(self.seed),
            threads: Some(options.threads),
            ..LearnOptions::default()
        };
        let (task, initialize_from) = (self.arguments.clone(), self.initialize_from.clone());
        RunOptions { learn, task, initialize_from, ..RunOptions::default() }
    }

    /// The run that a new training would create.
    ///
    /// # Errors
    /// If there is no such task, or it does not take the options.
    pub fn expected(&self, options: &Options) -> Result<RunFile, StudyError> {
        let new = self.new_run(options);
        Ok(Session::open(Some(Task::named(&self.task)?), &new, Some(self.loaded.clone()), true)?.0.run)
    }

    /// Trains the run of a folder, or the rest of it.
    ///
    /// # Errors
    /// If it cannot be trained, or the user interrupts it.
    pub fn train(&self, folder: &Path, options: &Options) -> Result<(), StudyError> {
        let opened = if folder.join("run.json").exists() {
            let mut run = RunOptions { resume: Some(folder.into()), ..RunOptions::default() };
            run.learn.steps = options.steps;
            Session::open(None, &run, None, false)
        } else {
            let run = RunOptions { out: Some(folder.into()), ..self.new_run(options) };
            Session::open(Some(Task::named(&self.task)?), &run, Some(self.loaded.clone()), false)
        };
        let session = match opened {
            Ok((session, _)) => session,
            Err(RunError::Complete { .. }) => return Ok(()),
            Err(error) => return Err(error.into()),
        };
        let stop = |_: &IterationStats| if interrupt::requested() { Control::Stop } else { Control::Continue };
        let outcome = session.carry_out(true, &mut { stop })?;
        match outcome.evaluation {
            Some(_) => Ok(()),
            None => Err(StudyError::Interrupted("finished work is kept; the same command continues".into())),
        }
    }
}

/// The file with the results of a run, next to its folder.
pub fn file(folder: &Path) -> PathBuf {
    let mut name = folder.file_name().unwrap_or_default().to_os_string();
    name.push(".json");
    folder.with_file_name(name)
}

/// The summary of a run.
///
/// # Errors
/// If the file cannot be read.
pub fn summary(folder: &RunFolder) -> Result<Summary, StudyError> {
    let file = folder.summary();
    let text = budget::read_to_string(&file, &budget::TABLE_FILE).map_err(StudyError::io(&file, "read"))?;
    serde_json::from_str(&text).map_err(|error| StudyError::file(&file, "summary", error, "that of a run"))
}

/// Kept results. `None` if there is no file.
///
/// # Errors
/// If the file cannot be read.
pub fn read<T: DeserializeOwned>(path: &Path) -> Result<Option<T>, StudyError> {
    let text = match budget::read_to_string(path, &budget::TABLE_FILE) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        text => text.map_err(StudyError::io(path, "read"))?,
    };
    let found =
        serde_json::from_str(&text).map_err(|error| StudyError::file(path, "findings", error, "those of a run"));
    found.map(Some)
}

/// Refuses results of a run with another configuration.
///
/// # Errors
/// Names the difference.
pub fn check(path: &Path, found: &RunFile, expected: &RunFile) -> Result<(), StudyError> {
    match difference_of_runs(found, expected) {
        None => Ok(()),
        Some((place, found, expected)) => {
            let expected = format!("{expected}, as the task's configuration says now; delete the file to train again");
            Err(StudyError::file(path, place, found, expected))
        }
    }
}

/// Writes results.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: &Path, found: &impl Serialize) -> Result<(), StudyError> {
    Ok(write_json(path, found)?)
}
