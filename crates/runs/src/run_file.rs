//! The description of a run: its task, its configuration and the files that it depends on.

use crate::clips;
use crate::error::RunError;
use crate::task_config::TaskConfig;
use marathon_config::Loaded;
use marathon_envs::Options;
use marathon_learn::policy::options;
use marathon_learn::{Checkpoint, RunConfig, TrainConfig, checksum, read_description};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const FORMAT: &str = "marathon-run";
const VERSION: u32 = 3;

/// Files outside the run's folder, with their checksums.
pub type Inputs = BTreeMap<PathBuf, String>;

/// The description of a run. A resumed run must agree on all of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunFile {
    /// Kind of file: `marathon-run`.
    pub format: String,
    /// Version of the format.
    pub version: u32,
    /// Registry name of the agent.
    pub agent: String,
    /// Options of its task. Empty for a task without options. Clips are stored by name.
    #[serde(default, skip_serializing_if = "Options::is_empty", with = "options")]
    pub options: Options,
    /// Clips that the options name and that do not ship with Marathon: files in the run's folder, with their checksums.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub clips: BTreeMap<String, String>,
    /// Files outside the run's folder that the run depends on, with their checksums.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub files: Inputs,
    /// Policy that the run starts from, if not from random weights.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub initialize_from: Option<PathBuf>,
    /// Checksum of that policy. It no longer matters once there is a checkpoint.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub initialize_from_checksum: Option<String>,
    /// Steps between progress lines without a terminal.
    pub summary_freq: u64,
    /// Steps between checkpoints.
    pub checkpoint_interval: u64,
    /// Number of policies kept in `policies/`.
    pub keep_checkpoints: usize,
    /// The trainer's configuration.
    pub config: TrainConfig,
}

impl RunFile {
    /// Describes a new run.
    pub fn new(task: &TaskConfig, loaded: &Loaded) -> Self {
        Self {
            format: FORMAT.into(),
            version: VERSION,
            agent: task.agent.clone(),
            options: task.options.clone(),
            clips: task
                .options
                .given_clips()
                .into_iter()
                .map(|(name, clip)| (name.into(), checksum(&clip.to_bytes())))
                .collect(),
            files: Inputs::new(),
            initialize_from: None,
            initialize_from_checksum: None,
            summary_freq: loaded.summary_freq,
            checkpoint_interval: loaded.checkpoint_interval,
            keep_checkpoints: loaded.keep_checkpoints,
            config: loaded.config.clone(),
        }
    }

    /// Reads a description and checks every value.
    ///
    /// # Errors
    /// If the file cannot be read, or a value is invalid.
    pub fn read(path: &Path) -> Result<Self, RunError> {
        let run: RunFile = read_description(path, FORMAT, VERSION)?;
        run.config.validate_in(path, "config")?;
        run.clips.keys().try_for_each(|name| clips::check_name(name))?;
        for (key, n) in [("summary_freq", run.summary_freq), ("checkpoint_interval", run.checkpoint_interval)] {
            if n == 0 {
                return Err(RunError::file(path, key, n, "at least 1"));
            }
        }
        Ok(run)
    }

    /// Refuses a configuration that differs from that of a checkpoint of the run. Only steps and threads may differ.
    pub(crate) fn check(&self, path: &Path, checkpoint: &Checkpoint) -> Result<(), RunError> {
        let known = checkpoint.config();
        let RunConfig { total_steps, threads, .. } = self.config.run;
        let known = known.clone().with(|c| {
            c.run.total_steps = total_steps;
            c.run.threads = threads;
        });
        let keys = |config: &TrainConfig| serde_json::to_value(config).unwrap_or_default();
        let (found, expected) = (keys(&self.config), keys(&known));
        match difference("config", &found, &expected) {
            None => Ok(()),
            Some((place, found, expected)) => {
                Err(RunError::file(path, place, found, format!("{expected}, as in checkpoint/checkpoint.json")))
            }
        }
    }
}

/// The first difference between two runs, with both values. Threads and the paths of outside files do not count,
/// because they change no result.
pub fn difference_of_runs(found: &RunFile, expected: &RunFile) -> Option<(String, Value, Value)> {
    let keys = |run: &RunFile| {
        let mut run = run.clone();
        run.config.run.threads = 1;
        let name = |path: &PathBuf| path.file_name().map(PathBuf::from);
        run.initialize_from = run.initialize_from.as_ref().and_then(name);
        run.files = run.files.into_iter().filter_map(|(path, sum)| Some((name(&path)?, sum))).collect();
        serde_json::to_value(run).unwrap_or_default()
    };
    let (found, expected) = (keys(found), keys(expected));
    difference("run", &found, &expected).map(|(place, a, b)| (place, a.clone(), b.clone()))
}

/// The first place where two documents differ, with both values.
pub(crate) fn difference<'v>(
    place: &str,
    found: &'v Value,
    expected: &'v Value,
) -> Option<(String, &'v Value, &'v Value)> {
    match (found, expected) {
        (Value::Object(keys), Value::Object(_)) => {
            keys.iter().find_map(|(key, found)| difference(&format!("{place}.{key}"), found, &expected[key.as_str()]))
        }
        (Value::Array(list), Value::Array(others)) if list.len() == others.len() => {
            let pairs = list.iter().zip(others).enumerate();
            pairs.into_iter().find_map(|(i, (found, expected))| difference(&format!("{place}[{i}]"), found, expected))
        }
        _ => (found != expected).then(|| (place.to_string(), found, expected)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use marathon_learn::write_description;

    /// A flipped bit in the description, as from a bad disk, is either detected or has no effect.
    #[test]
    fn a_flipped_bit_of_a_description_is_refused_or_changes_nothing() {
        let temp = tempfile::tempdir().unwrap();
        let path = temp.path().join("run.json");
        let run = RunFile::new(&TaskConfig::named("Hopper-v0").unwrap(), &marathon_config::default_for("Hopper-v0"));
        write_description(&path, &run).unwrap();
        assert_eq!(RunFile::read(&path).unwrap(), run);
        let bytes = std::fs::read(&path).unwrap();
        let mut refused = 0;
        // two bits of every byte, covering all eight in turn
        for (place, bit) in (0..bytes.len()).flat_map(|place| [place % 4, place % 4 + 4].map(|bit| (place, bit))) {
            let mut flipped = bytes.clone();
            flipped[place] ^= 1 << bit;
            std::fs::write(&path, &flipped).unwrap();
            match RunFile::read(&path) {
                Ok(read) => assert_eq!(read, run, "bit {bit} of byte {place}"),
                Err(_) => refused += 1,
            }
        }
        assert!(refused > bytes.len(), "{refused} of {}", 2 * bytes.len());
    }
}
