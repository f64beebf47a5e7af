//! How an agent runs: on the physics kernels, as many agents side by side as a vector has lanes.

mod agent_kernel;
mod context;
mod demonstrations;
mod group;
mod roles;
mod saved;
mod shard;
mod start_cache;
mod task;

pub(crate) use task::AgentFactory;
pub use task::TERMINATION_TERM;
