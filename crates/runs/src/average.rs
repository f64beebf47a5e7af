//! The mean of several policies of a run. Training steps are noisy to the end; the mean of the resulting policies is
//! less so.

use crate::error::RunError;
use crate::folder::POLICIES;
use crate::policy_file;
use crate::report::kept_policies;
use crate::task_config::TaskOptions;
use marathon_learn::Policy;
use std::path::{Path, PathBuf};

/// Returns the mean of policies, and their files. A folder is that of a run, and stands for all policies in its
/// `policies/`, in the order of their steps. The mean is for the task of the last policy, with the user's options.
///
/// # Errors
/// If a file is not a policy, there are fewer than two policies, one has another task, network or map of actions than
/// the last one, or the task does not take the options.
pub fn average(given: &[PathBuf], options: &TaskOptions) -> Result<(Policy, Vec<PathBuf>), RunError> {
    let mut paths = Vec::new();
    for path in given {
        match path.is_dir() {
            true => paths.extend(kept_by(path)?),
            false => paths.push(path.clone()),
        }
    }
    let [others @ .., last] = &paths[..] else {
        return Err(RunError::option("policies", "is none, expected two or more"));
    };
    if others.is_empty() {
        return Err(RunError::file(last, "policies", "one", "two or more"));
    }
    let (last, factory) = policy_file::load(last, None, options)?;
    let mut policies = Vec::new();
    for path in others {
        let policy = policy_file::read(path, Some(factory.spec()))?;
        policy.check_alike(&last).map_err(|error| error.of_file(path))?;
        policies.push(policy);
    }
    policies.push(last);
    Ok((Policy::mean(&policies)?, paths))
}

/// The policies in a run's folder, in the order of their steps.
fn kept_by(run: &Path) -> Result<Vec<PathBuf>, RunError> {
    let kept = kept_policies(run);
    if kept.is_empty() {
        return Err(RunError::file(&run.join(POLICIES), "policies", "none", "those that a run has kept"));
    }
    Ok(kept.into_iter().map(|(_, path)| path).collect())
}
