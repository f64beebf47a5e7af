//! What long studies share: runs that are kept, so that a study that was interrupted goes on, and beside each run's folder a
//! small file with what it has found, which is enough for the study's page.

use super::Options;
use crate::error::CliError;
use crate::interrupt;
use marathon_config::Loaded;
use marathon_learn::{Control, IterationStats};
use marathon_physics::budget;
use marathon_runs::folder::{difference_of_runs, write_json};
use marathon_runs::{LearnOptions, RunError, RunFile, RunFolder, RunOptions, Session, Summary, Task, TaskOptions};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

/// A training of a study.
pub struct Job {
    /// Registry name of the task, and its arguments.
    pub task: String,
    pub arguments: TaskOptions,
    pub seed: u64,
    /// Its configuration; a study's own number of steps comes before that of the configuration.
    pub loaded: Loaded,
    /// The policy that it starts from; none: random weights.
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

    /// What would be trained today.
    ///
    /// # Errors
    /// If there is no such task, or it does not take the arguments.
    pub fn expected(&self, options: &Options) -> Result<RunFile, CliError> {
        let new = self.new_run(options);
        Ok(Session::open(Some(Task::named(&self.task)?), &new, Some(self.loaded.clone()), true)?.0.run)
    }

    /// Makes the run that is to be in a folder, or what is missing of it.
    ///
    /// # Errors
    /// If it cannot be trained, or somebody interrupts it.
    pub fn train(&self, folder: &Path, options: &Options) -> Result<(), CliError> {
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
            None => Err(CliError::Interrupted("what is done is kept; the same command goes on from there".into())),
        }
    }
}

/// Where a run's findings are: beside its folder.
pub fn file(folder: &Path) -> PathBuf {
    let mut name = folder.file_name().unwrap_or_default().to_os_string();
    name.push(".json");
    folder.with_file_name(name)
}

/// The summary of a run.
///
/// # Errors
/// If the file cannot be read.
pub fn summary(folder: &RunFolder) -> Result<Summary, CliError> {
    let file = folder.summary();
    let text = budget::read_to_string(&file, &budget::TABLE_FILE).map_err(CliError::io(&file, "read"))?;
    serde_json::from_str(&text).map_err(|error| CliError::file(&file, "summary", error, "that of a run"))
}

/// Findings that are kept, if any are.
///
/// # Errors
/// If the file cannot be read.
pub fn read<T: DeserializeOwned>(path: &Path) -> Result<Option<T>, CliError> {
    let text = match budget::read_to_string(path, &budget::TABLE_FILE) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        text => text.map_err(CliError::io(path, "read"))?,
    };
    let found = serde_json::from_str(&text).map_err(|error| CliError::file(path, "findings", error, "those of a run"));
    found.map(Some)
}

/// Refuses findings of another run than would be made today.
///
/// # Errors
/// Names what differs.
pub fn check(path: &Path, found: &RunFile, expected: &RunFile) -> Result<(), CliError> {
    match difference_of_runs(found, expected) {
        None => Ok(()),
        Some((place, found, expected)) => {
            let expected = format!("{expected}, as the task's configuration says now; delete the file to train again");
            Err(CliError::file(path, place, found, expected))
        }
    }
}

/// Writes findings.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: &Path, found: &impl Serialize) -> Result<(), CliError> {
    Ok(write_json(path, found)?)
}

/// The middle one of some numbers.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let (low, high) = (values.len().checked_sub(1)? / 2, values.len() / 2);
    Some((values[low] + values[high]) / 2.0)
}

/// The median of the seeds' numbers, and each in brackets if they differ.
pub fn cell(values: &[Option<f64>], text: &dyn Fn(f64) -> String) -> String {
    let known: Vec<f64> = values.iter().flatten().copied().collect();
    // what some seeds never reach has no median
    let middle = if known.len() == values.len() { median(known) } else { None };
    let middle = middle.map_or("-".into(), text);
    let each: Vec<String> = values.iter().map(|value| value.map_or("-".into(), text)).collect();
    let differ = each.iter().any(|text| *text != middle);
    if differ { format!("{middle} ({})", each.join(", ")) } else { middle }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_in_the_middle() {
        assert_eq!(median(vec![]), None);
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), Some(2.5));
    }

    #[test]
    fn cells_tell_the_seeds_that_differ() {
        let text = |x: f64| format!("{x:.0}");
        assert_eq!(cell(&[Some(3.0), Some(1.0), Some(2.0)], &text), "2 (3, 1, 2)");
        assert_eq!(cell(&[Some(3.0), Some(3.0)], &text), "3");
        assert_eq!(cell(&[Some(3.0), None], &text), "- (3, -)");
    }
}
