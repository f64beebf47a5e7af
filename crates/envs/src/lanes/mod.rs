//! Runs agents on the physics kernels, with one agent per lane of a vector.

mod agent_kernel;
mod commands;
mod context;
mod decision;
mod demonstrations;
mod factory;
mod group;
mod perception;
mod roles;
mod saved;
mod shard;
mod start_cache;
mod task;

pub(crate) use factory::AgentFactory;
pub use factory::TERMINATION_TERM;
