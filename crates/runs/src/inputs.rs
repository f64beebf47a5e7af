//! Files outside a run's folder that the run depends on: the task's model, demonstrations, and the initial policy.
//! `run.json` lists their absolute paths, so that a run resumes from any folder, and their checksums, so that it
//! resumes with the same bits.

use crate::error::RunError;
use crate::folder::policy_path;
use crate::run_file::{Inputs, RunFile};
use crate::task_config::TaskConfig;
use crate::text::{path_word, whole};
use marathon_envs::ModelSource;
use marathon_learn::{TrainConfig, checksum};
use marathon_physics::Model;
use marathon_physics::budget::{self, Limit};
use std::cell::RefCell;
use std::path::{Path, PathBuf};

/// Makes the paths of a configuration's demonstrations absolute.
pub fn name_wholly(config: &mut TrainConfig) {
    let roles = config.roles.values_mut().flat_map(|role| &mut role.rewards);
    for reward in config.rewards.iter_mut().chain(roles) {
        let imitation = reward.kind.imitation_mut();
        if let Some(file) = imitation.and_then(|imitation| imitation.demonstrations.as_mut()) {
            *file = whole(Path::new(file)).to_string_lossy().into_owned();
        }
    }
}

/// The files that a task and its configuration name, with their current checksums.
///
/// # Errors
/// If a file cannot be read.
pub fn of(task_config: &TaskConfig, config: &TrainConfig) -> Result<Inputs, RunError> {
    let mut inputs = Inputs::new();
    if let Some(path) = task_config.model().as_ref().and_then(ModelSource::file) {
        inputs.extend(of_model(path)?);
    }
    for file in demonstrations(config) {
        inputs.insert(file.into(), sum(Path::new(file), &budget::DEMONSTRATION_FILE)?);
    }
    Ok(inputs)
}

/// The demonstrations that a configuration names.
pub fn demonstrations(config: &TrainConfig) -> impl Iterator<Item = &str> {
    let rewards = config.rewards.iter().chain(config.roles.values().flat_map(|role| &role.rewards));
    rewards.filter_map(|reward| reward.kind.imitation()?.demonstrations.as_deref())
}

/// A model file and all files that it names.
fn of_model(path: &Path) -> Result<Inputs, RunError> {
    let bytes = budget::read(path, &budget::MODEL_FILE).map_err(RunError::io(path, "read"))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let inputs = RefCell::new(Inputs::from([(path.to_path_buf(), checksum(&bytes))]));
    let read = |name: &str| {
        let file = folder.join(name);
        let bytes = budget::read(&file, &budget::MODEL_FILE).map_err(|error| error.to_string())?;
        inputs.borrow_mut().insert(file, checksum(&bytes));
        Ok(bytes)
    };
    // creating the task reports errors in the model
    let _ = Model::from_xml_str_with(&String::from_utf8_lossy(&bytes), &path.display().to_string(), &read);
    Ok(inputs.into_inner())
}

/// The checksum of the initial policy, which is a file or the folder of a run.
///
/// # Errors
/// If there is no policy.
pub fn of_start(policy: &Path) -> Result<String, RunError> {
    sum(&policy_path(policy)?, &budget::POLICY_FILE)
}

/// Refuses files that have changed since the run began.
///
/// # Errors
/// If a file has changed or cannot be read.
pub fn check(inputs: &Inputs) -> Result<(), RunError> {
    inputs.iter().try_for_each(|(path, expected)| agree(path, &sum(path, &budget::DEMONSTRATION_FILE)?, expected))
}

/// A note about the model of a task that has changed, or is gone, since the run began that a policy is from. `given`: the folder
/// of the run, or a policy in it. `None` for a model that the run did not use.
pub fn changed(given: &Path, task_config: &TaskConfig) -> Option<String> {
    let folder = if given.is_dir() { given } else { given.parent()? };
    let run = RunFile::read(&folder.join("run.json")).ok()?;
    let model = task_config.model()?.file()?.to_path_buf();
    run.files.get(&whole(&model))?;
    let is_other = |path: &&PathBuf| sum(path, &budget::DEMONSTRATION_FILE).ok().as_ref() != run.files.get(*path);
    let changed = of_model(&model).ok()?.into_keys().chain([model]).collect::<Vec<_>>();
    let path = changed.iter().find(is_other)?;
    Some(format!("{} has changed since the policy was trained", path_word(path)))
}

/// Refuses an initial policy that has changed since the run began.
///
/// # Errors
/// If the policy has changed or is gone.
pub fn check_start(policy: &Path, expected: &str) -> Result<(), RunError> {
    agree(policy, &of_start(policy)?, expected)
}

fn agree(path: &Path, found: &str, expected: &str) -> Result<(), RunError> {
    if found == expected {
        return Ok(());
    }
    let expected = format!("{expected}, as in run.json; the file has changed since the run began");
    Err(RunError::file(path, "checksum", found, expected))
}

fn sum(path: &Path, limit: &Limit) -> Result<String, RunError> {
    Ok(checksum(&budget::read(path, limit).map_err(RunError::io(path, "read"))?))
}
