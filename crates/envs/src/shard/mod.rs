//! The learner's interface to an environment: blocks of sixteen agents, stepped by one thread.
//!
//! A *block* is sixteen agents, regardless of the machine's vector width. Every array of a block has the layout
//! `[feature][16]`. It is the layout of the physics and of the narrow networks, so nothing is transposed between them.
//! A *shard* is a range of consecutive blocks owned by one thread.
//!
//! Agent `i` of block `b` is agent `16 b + i` of the environment. Its random numbers depend on this number and the seed
//! only, not on the distribution of blocks over shards and threads.

mod agent_shard;
mod context;
mod demonstrations;
mod role;
pub(crate) mod spec;

pub use agent_shard::{AgentShard, AgentShards, AgentState};
pub use context::AgentContext;
pub use demonstrations::Demonstrations;
pub use role::{Role, role_id, task_of_role};
pub use spec::{Metric, MetricSource, ObsGroup, Spec, scale_action};

use crate::error::EnvError;
use marathon_physics::budget::AGENTS_MEMORY;

/// Agents per block.
pub const BLOCK: usize = 16;

/// Results of one decision of a block.
#[derive(Clone, Debug, Default)]
pub struct BlockStep {
    /// Reward per agent. In a task with several roles, it is the first role's.
    pub reward: [f32; BLOCK],
    /// Bit per agent: the episode ended in a terminal state (do not bootstrap).
    pub terminated: u16,
    /// Bit per agent: the episode ended by its time limit (bootstrap from the observation written by `step`).
    pub truncated: u16,
    /// Distance that the agent moved along +x in this decision, m.
    pub forward: [f32; BLOCK],
    /// Bit per agent: its state was not finite. The agent is quarantined: it counts as terminated with reward 0, and
    /// its observation is zero. The next `reset` repairs it like any other ended episode.
    pub diverged: u16,
    /// Terms of the reward, `[term][16]`, length `16 * reward_terms.len()`. The terms of a role add up to its reward.
    pub terms: Vec<f32>,
    /// Infos about the new state, `[info][16]`.
    pub info: Vec<f32>,
    /// For each role of [`Spec::roles`], a bit per agent for which the role acts next.
    pub decides: Vec<u16>,
    /// For each role of [`Spec::roles`], a bit per agent for which this decision ended the role's part of the episode
    /// early: with failure and without.
    pub leaves: Vec<[u16; 2]>,
}

impl BlockStep {
    /// A metric of [`Spec::metrics`], per agent.
    pub fn metric(&self, metric: &Metric) -> &[f32] {
        match metric.source {
            MetricSource::Forward => &self.forward,
            MetricSource::Info(i) => &self.info[i * BLOCK..][..BLOCK],
        }
    }
}

/// A range of blocks owned by one thread.
pub trait Shard: Send {
    /// Facts of the task.
    fn spec(&self) -> &Spec;
    /// Number of blocks.
    fn blocks(&self) -> usize;
    /// Starts new episodes for the agents in `mask` and writes their first observations into `obs` (`[obs][16]`). Other
    /// lanes are unchanged.
    fn reset(&mut self, block: usize, mask: u16, obs: &mut [f32]);
    /// Passes the actions of all blocks, `[block][act][16]`, before the [`Shard::step`] of each block. Only tasks that
    /// step all agents at once need it, such as those of [`BatchAdapter`](crate::BatchAdapter).
    fn announce(&mut self, actions: &[f32]) {
        let _ = actions;
    }
    /// Advances every agent of a block by one decision. `action` is `[act][16]`, see [`Spec::action_low`]. Writes the
    /// observation of the new state into `obs` (`[obs][16]`), also for ended episodes. The caller then calls `reset`
    /// for those.
    fn step(&mut self, block: usize, action: &[f32], obs: &mut [f32], out: &mut BlockStep);
    /// Appends a block's complete state to `bytes`.
    fn save(&self, block: usize, bytes: &mut Vec<u8>);
    /// Restores the state that [`Shard::save`] wrote, and returns the rest of `bytes`.
    ///
    /// # Errors
    /// If they do not begin with a block of this task. Then nothing has changed.
    fn load<'a>(&mut self, block: usize, bytes: &'a [u8]) -> Result<&'a [u8], EnvError>;
}

/// Checks before any agent is created that all agents fit the memory budget. A failed allocation would end the process.
///
/// # Errors
/// [`EnvError::Memory`] if the agents do not fit.
pub fn check_memory(factory: &dyn ShardFactory, agents: usize) -> Result<(), EnvError> {
    let bytes = agents as f64 * factory.agent_bytes() as f64;
    AGENTS_MEMORY.check(bytes).map_err(|source| EnvError::Memory { agents, source })
}

/// Creates shards of a task.
pub trait ShardFactory: Send + Sync {
    /// Facts of the task.
    fn spec(&self) -> &Spec;
    /// A shard of blocks `first .. first + blocks`, all agents before their first reset.
    fn shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn Shard>;
    /// Number of agents, if they can only be stepped all at once, as in [`BatchAdapter`](crate::BatchAdapter). The shards in
    /// use must then cover all blocks. `None` if the number of agents is free.
    fn lockstep(&self) -> Option<usize> {
        None
    }
    /// Upper bound on the memory of one agent, bytes. See [`check_memory`].
    fn agent_bytes(&self) -> usize {
        self.spec().agent_bytes()
    }
    /// Demonstrations of the task, if it has any. For an agent with clips, they are its observations if it moved
    /// exactly as they do.
    fn demonstrations(&self) -> Option<Demonstrations> {
        None
    }
}
