//! One file per command.

pub mod bench;
pub mod eval;
pub mod list;
pub mod render;
pub mod train;

use crate::error::CliError;
use crate::folder::policy_path;
use marathon_envs::{ShardFactory, registry};
use marathon_learn::Policy;
use marathon_physics::lanes::Isa;
use std::path::Path;
use std::sync::Arc;

/// Reads a policy for a task: the one that the user names, or the one that the policy is for.
fn load_policy(given: &Path, agent: Option<&str>) -> Result<(Policy, Arc<dyn ShardFactory>), CliError> {
    let path = policy_path(given)?;
    let factory = match agent {
        Some(agent) => registry::factory(agent, Isa::best())?,
        None => registry::factory(&Policy::load(&path)?.meta().agent, Isa::best())?,
    };
    Ok((Policy::load_for(&path, factory.spec())?, factory))
}
