//! What a study keeps of a finished run: a small file beside the run's folder, which is enough for the study's page.

use super::Job;
use crate::error::CliError;
use marathon_learn::checksum;
use marathon_runs::folder::{difference_of_runs, write_json};
use marathon_runs::{Imitation, RunFile};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// What a finished run has found.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Found {
    /// What was trained.
    pub run: RunFile,
    /// Checksum of the clip.
    pub clip: String,
    /// Agent-steps done.
    pub steps: u64,
    /// Processor seconds of the training.
    pub cpu_seconds: f64,
    /// How well the policy follows its clip.
    pub imitation: Imitation,
    /// Agent-steps, processor seconds, and share of the longest time that is followed from the clip's beginning.
    pub curve: Vec<[f64; 3]>,
}

/// Where a run's findings are: beside its folder.
pub fn file(folder: &Path) -> PathBuf {
    let mut name = folder.file_name().unwrap_or_default().to_os_string();
    name.push(".json");
    folder.with_file_name(name)
}

impl Found {
    /// What is kept of a run, if anything is. `expected`: what would be trained today.
    ///
    /// # Errors
    /// If the file cannot be read, or is of another configuration or clip.
    pub fn read(path: &Path, job: &Job, expected: &RunFile) -> Result<Option<Self>, CliError> {
        let text = match std::fs::read_to_string(path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            text => text.map_err(CliError::io(path, "read"))?,
        };
        let found: Found =
            serde_json::from_str(&text).map_err(|error| CliError::file(path, "findings", error, "those of a run"))?;
        let clip = clip(job);
        if found.clip != clip {
            let expected = format!("{clip}, that of the clip {}; delete the file to train again", job.clip);
            return Err(CliError::file(path, "clip", found.clip, expected));
        }
        if let Some((place, found, expected)) = difference_of_runs(&found.run, expected) {
            let expected = format!("{expected}, as the task's configuration says now; delete the file to train again");
            return Err(CliError::file(path, place, found, expected));
        }
        Ok(Some(found))
    }

    /// Writes the file.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), CliError> {
        Ok(write_json(path, self)?)
    }
}

/// Checksum of a task's clip.
pub fn clip(job: &Job) -> String {
    checksum(&job.motion)
}
