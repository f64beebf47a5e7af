//! Kept results of a finished run.

use super::Job;
use crate::error::StudyError;
use crate::kept;
use marathon_learn::checksum;
use marathon_runs::{Imitation, RunFile};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Results of a finished run.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Found {
    /// The run.
    pub run: RunFile,
    /// Checksum of the clip.
    pub clip: String,
    /// Agent-steps done.
    pub steps: u64,
    /// Processor seconds of the training.
    pub cpu_seconds: f64,
    /// How well the policy follows its clip.
    pub imitation: Imitation,
    /// For intermediate policies: agent-steps, processor seconds, and the fraction of the longest time for which the
    /// policy follows the clip from its beginning.
    pub curve: Vec<[f64; 3]>,
}

impl Found {
    /// The kept results of a run, if any. `expected`: the run that a new training would make.
    ///
    /// # Errors
    /// If the file cannot be read, or belongs to another configuration or clip.
    pub fn read(path: &Path, job: &Job, expected: &RunFile) -> Result<Option<Self>, StudyError> {
        let Some(found) = kept::read::<Found>(path)? else { return Ok(None) };
        let clip = clip(job);
        if found.clip != clip {
            let expected = format!("{clip}, that of the clip {}; delete the file to train again", job.clip);
            return Err(StudyError::file(path, "clip", found.clip, expected));
        }
        kept::check(path, &found.run, expected)?;
        Ok(Some(found))
    }
}

/// Checksum of a task's clip.
pub fn clip(job: &Job) -> String {
    checksum(&job.motion)
}
