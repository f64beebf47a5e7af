//! What the study keeps of a finished run.

use super::Job;
use crate::error::CliError;
use crate::study::kept;
use marathon_learn::checksum;
use marathon_runs::{Imitation, RunFile};
use serde::{Deserialize, Serialize};
use std::path::Path;

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

impl Found {
    /// What is kept of a run, if anything is. `expected`: what would be trained today.
    ///
    /// # Errors
    /// If the file cannot be read, or is of another configuration or clip.
    pub fn read(path: &Path, job: &Job, expected: &RunFile) -> Result<Option<Self>, CliError> {
        let Some(found) = kept::read::<Found>(path)? else { return Ok(None) };
        let clip = clip(job);
        if found.clip != clip {
            let expected = format!("{clip}, that of the clip {}; delete the file to train again", job.clip);
            return Err(CliError::file(path, "clip", found.clip, expected));
        }
        kept::check(path, &found.run, expected)?;
        Ok(Some(found))
    }
}

/// Checksum of a task's clip.
pub fn clip(job: &Job) -> String {
    checksum(&job.motion)
}
