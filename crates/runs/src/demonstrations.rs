//! Demonstrations that a configuration names.

use crate::error::RunError;
use marathon_envs::{Demonstrations, Shard, ShardFactory, Spec};
use marathon_learn::{RewardConfig, TrainConfig};
use marathon_mlagents::{DemoError, read_demonstrations};
use std::path::Path;
use std::sync::Arc;

/// A task with demonstrations of somebody else's.
struct Shown {
    task: Arc<dyn ShardFactory>,
    demonstrations: Demonstrations,
}

impl ShardFactory for Shown {
    fn spec(&self) -> &Spec {
        self.task.spec()
    }
    fn shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn Shard> {
        self.task.shard(first, blocks, seed)
    }
    fn lockstep(&self) -> Option<usize> {
        self.task.lockstep()
    }
    fn demonstrations(&self) -> Option<Demonstrations> {
        Some(self.demonstrations.clone())
    }
}

/// The task with the demonstrations of the file that the configuration's rewards name, if they name one.
///
/// # Errors
/// If the file cannot be read or does not fit the task, or rewards name several.
pub fn with_demonstrations(
    task: Arc<dyn ShardFactory>,
    config: &TrainConfig,
) -> Result<Arc<dyn ShardFactory>, RunError> {
    let rewards = config.rewards.iter().chain(config.roles.values().flat_map(|role| &role.rewards));
    let of = |reward: &RewardConfig| reward.kind.imitation().and_then(|imitation| imitation.demonstrations.clone());
    let mut files: Vec<String> = rewards.filter_map(of).collect();
    files.dedup();
    let file = match &files[..] {
        [] => return Ok(task),
        [file] => file,
        [first, second, ..] => {
            let problem =
                format!("names demonstrations in '{first}' and '{second}', expected one file for all rewards");
            return Err(RunError::option("config", problem));
        }
    };
    let path = Path::new(file);
    let bytes = std::fs::read(path).map_err(RunError::io(path, "read"))?;
    let demonstrations = read_demonstrations(path, &bytes, task.spec())
        .map_err(|DemoError { path, place, found, expected }| RunError::file(&path, place, found, expected))?;
    Ok(Arc::new(Shown { task, demonstrations }))
}
