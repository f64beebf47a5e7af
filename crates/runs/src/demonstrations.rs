//! Demonstrations in a configuration.

use crate::error::RunError;
use crate::inputs;
use marathon_envs::{Demonstrations, Shard, ShardFactory, Spec};
use marathon_learn::TrainConfig;
use marathon_mlagents::{DemoError, read_demonstrations};
use marathon_physics::budget;
use std::path::Path;
use std::sync::Arc;

/// A task with demonstrations from a file.
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

/// The task with the demonstrations of the file that the rewards of the configuration name, if any.
///
/// # Errors
/// If the file cannot be read or does not fit the task, or rewards name several files.
pub fn with_demonstrations(
    task: Arc<dyn ShardFactory>,
    config: &TrainConfig,
) -> Result<Arc<dyn ShardFactory>, RunError> {
    let mut files: Vec<&str> = inputs::demonstrations(config).collect();
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
    let bytes = budget::read(path, &budget::DEMONSTRATION_FILE).map_err(RunError::io(path, "read"))?;
    let demonstrations = read_demonstrations(path, &bytes, task.spec())
        .map_err(|DemoError { path, place, found, expected }| RunError::file(&path, place, found, expected))?;
    Ok(Arc::new(Shown { task, demonstrations }))
}
