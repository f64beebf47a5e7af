//! Files of a stage: `stage.json` says what the stage is made from, `done` what came out. `done` is written last.

use crate::error::RunError;
use crate::run_file::difference;
use marathon_learn::{checksum, read_description, write_description};
use marathon_physics::budget;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Name of the description of a stage.
pub const STAGE: &str = "stage.json";
/// Name of the result of a stage.
pub const DONE: &str = "done";
/// Name of the policy of a stage.
pub const POLICY: &str = "policy.safetensors";

const FORMAT: &str = "marathon-stage";
const FORMAT_DONE: &str = "marathon-stage-done";
const VERSION: u32 = 1;

/// Everything that affects the result of a stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StageFile {
    format: String,
    version: u32,
    /// The stage as the recipe describes it, and checksums of all files that it uses.
    pub stage: Value,
}

/// The result of a stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Done {
    format: String,
    version: u32,
    /// Checksum of the policy.
    pub policy: String,
    /// Seed of the run that the policy is from.
    pub seed: Option<u64>,
    /// Agent-steps of that run.
    pub steps: u64,
    /// Processor seconds of all runs of the stage.
    pub cpu_seconds: f64,
    /// Measured values by seed, if the stage picks one.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub measured: BTreeMap<u64, Option<f64>>,
}

/// A place at which a stage is not what it was, with both values.
#[derive(Clone, Debug, PartialEq)]
pub struct Changed {
    /// The place.
    pub place: String,
    /// The value that the stage was made with.
    pub made: String,
    /// The value now.
    pub now: String,
}

/// How far a stage is.
#[derive(Clone, Debug, PartialEq)]
pub enum State {
    /// Nothing is there.
    Waiting,
    /// It has begun, or is about to.
    Begun,
    /// It is complete.
    Done(Done),
    /// It was made from something else.
    Changed(Changed),
}

impl StageFile {
    /// A description.
    pub fn new(stage: Value) -> Self {
        StageFile { format: FORMAT.into(), version: VERSION, stage }
    }

    /// Checksum of the description, and so of everything that the stage comes from.
    pub fn hash(&self) -> String {
        checksum(self.stage.to_string().as_bytes())
    }

    /// Writes it to the folder of the stage.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), RunError> {
        Ok(write_description(&folder.join(STAGE), self)?)
    }
}

impl Done {
    /// The result of a stage whose policy lies in its folder.
    ///
    /// # Errors
    /// If the policy cannot be read.
    pub fn of(folder: &Path, seed: Option<u64>, steps: u64, cpu_seconds: f64) -> Result<Self, RunError> {
        let policy = sum(&folder.join(POLICY))?;
        let measured = BTreeMap::new();
        Ok(Done { format: FORMAT_DONE.into(), version: VERSION, policy, seed, steps, cpu_seconds, measured })
    }

    /// Writes it to the folder of the stage.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), RunError> {
        Ok(write_description(&folder.join(DONE), self)?)
    }

    /// Reads the result of a stage, if it has one.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn read(folder: &Path) -> Result<Option<Self>, RunError> {
        let path = folder.join(DONE);
        if !path.exists() {
            return Ok(None);
        }
        Ok(Some(read_description(&path, FORMAT_DONE, VERSION)?))
    }
}

/// How far the stage in a folder is. `now`: the stage as it is described today.
///
/// # Errors
/// If a file is damaged.
pub fn state(folder: &Path, now: &StageFile) -> Result<State, RunError> {
    let path = folder.join(STAGE);
    if !path.exists() {
        return Ok(State::Waiting);
    }
    let made: StageFile = read_description(&path, FORMAT, VERSION)?;
    // a key that only one of them has shows in one direction only
    let found = difference("", &made.stage, &now.stage).map(|(place, made, now)| (place, made.clone(), now.clone()));
    let other = || difference("", &now.stage, &made.stage).map(|(place, now, made)| (place, made.clone(), now.clone()));
    if let Some((place, made, now)) = found.or_else(other) {
        let text = |value: Value| if value.is_null() { "nothing".into() } else { value.to_string() };
        let place = place.trim_start_matches('.').into();
        return Ok(State::Changed(Changed { place, made: text(made), now: text(now) }));
    }
    let Some(done) = Done::read(folder)? else { return Ok(State::Begun) };
    let policy = folder.join(POLICY);
    let found = if policy.exists() { sum(&policy)? } else { "no such file".into() };
    if found != done.policy {
        let place = format!("checksum of {POLICY}");
        return Ok(State::Changed(Changed { place, made: done.policy, now: found }));
    }
    Ok(State::Done(done))
}

/// Removes the folder of a stage. Its description goes last, so that a stage that is half removed still counts as changed.
///
/// # Errors
/// If an entry cannot be removed.
pub fn remove(folder: &Path) -> Result<(), RunError> {
    let done = folder.join(DONE);
    if done.exists() {
        fs::remove_file(&done).map_err(RunError::io(&done, "remove"))?;
    }
    for entry in fs::read_dir(folder).map_err(RunError::io(folder, "read folder"))? {
        let path = entry.map_err(RunError::io(folder, "read folder"))?.path();
        if path.file_name().is_some_and(|name| name == STAGE) {
            continue;
        }
        // a link is removed, not followed
        let is_folder = fs::symlink_metadata(&path).is_ok_and(|facts| facts.is_dir());
        let removed = if is_folder { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
        removed.map_err(RunError::io(&path, "remove"))?;
    }
    fs::remove_dir_all(folder).map_err(RunError::io(folder, "remove"))
}

/// Checksum of a policy file.
///
/// # Errors
/// If it cannot be read.
pub fn sum(path: &Path) -> Result<String, RunError> {
    Ok(checksum(&budget::read(path, &budget::POLICY_FILE).map_err(RunError::io(path, "read"))?))
}

/// Refuses a link in place of a folder: a folder of another person could lead anywhere.
///
/// # Errors
/// Names the link or file.
pub fn refuse_link(folder: &Path) -> Result<(), RunError> {
    match fs::symlink_metadata(folder) {
        Ok(facts) if !facts.is_dir() => {
            let found = if facts.is_symlink() { "a link" } else { "a file" };
            Err(RunError::file(folder, "kind", found, "a folder of the recipe's own"))
        }
        _ => Ok(()),
    }
}

/// The folder of a stage: `02-steady`.
pub fn folder(root: &Path, index: usize, name: &str) -> PathBuf {
    root.join(format!("{:02}-{name}", index + 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_changed_stage_names_the_first_difference() {
        let temp = tempfile::tempdir().unwrap();
        let folder = temp.path();
        let now = StageFile::new(json!({"settings": {"lr": 1.0}, "inputs": {}}));
        assert_eq!(state(folder, &now).unwrap(), State::Waiting);
        now.write(folder).unwrap();
        assert_eq!(state(folder, &now).unwrap(), State::Begun);
        std::fs::write(folder.join(POLICY), "bytes").unwrap();
        let done = Done::of(folder, Some(1), 10, 0.5).unwrap();
        done.write(folder).unwrap();
        assert_eq!(state(folder, &now).unwrap(), State::Done(done));
        let place = |stage: Value| match state(folder, &StageFile::new(stage)).unwrap() {
            State::Changed(Changed { place, made, now }) => (place, made, now),
            other => panic!("{other:?}"),
        };
        let found = place(json!({"settings": {"lr": 2.0}, "inputs": {}}));
        assert_eq!(found, ("settings.lr".into(), "1.0".into(), "2.0".into()));
        let found = place(json!({"settings": {"lr": 1.0, "epochs": 3}, "inputs": {}}));
        assert_eq!(found, ("settings.epochs".into(), "nothing".into(), "3".into()));
        std::fs::write(folder.join(POLICY), "others").unwrap();
        assert!(place(now.stage.clone()).0.contains(POLICY));
        remove(folder).unwrap();
        assert!(!folder.exists());
        std::fs::create_dir(folder).unwrap();
    }
}
