//! States of agents in files.

use crate::error::Error;
use crate::files::{TensorReader, TensorWriter};
use crate::rollout::states::AgentStates;

/// Names of the lists.
pub const NAMES: [&str; 5] = ["noise", "obs", "tallies", "env", "env_ends"];

/// Adds states to a file.
pub fn write(states: &AgentStates, file: &mut TensorWriter) {
    file.list("noise", &states.noise);
    file.list("obs", &states.obs);
    file.list("tallies", &states.tallies);
    file.list("env", &states.env);
    file.list("env_ends", &states.env_ends);
}

/// The inverse of [`write()`].
pub fn read(file: &TensorReader<'_>) -> Result<AgentStates, Error> {
    Ok(AgentStates {
        noise: file.list("noise")?,
        obs: file.list("obs")?,
        tallies: file.list("tallies")?,
        env: file.list("env")?,
        env_ends: file.list("env_ends")?,
    })
}
