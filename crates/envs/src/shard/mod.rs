//! What a learner sees of an environment: blocks of sixteen agents, stepped by one thread.
//!
//! A *block* is sixteen agents, whatever the vector width of the machine; every array of a block has the layout
//! `[feature][16]`, the layout of the physics and of the narrow networks, so nothing is transposed between them.
//! A *shard* is a run of consecutive blocks that one thread owns. Agent `i` of block `b` is agent `16 b + i` of the
//! whole environment: its random stream, and with it its whole life, depends on that number and the seed alone, never
//! on how the blocks are spread over shards and threads.

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

/// What one decision of a block led to.
#[derive(Clone, Debug, Default)]
pub struct BlockStep {
    /// Reward per agent: of a task with several roles, the first role's.
    pub reward: [f32; BLOCK],
    /// Bit per agent: the episode ended in a terminal state (do not bootstrap).
    pub terminated: u16,
    /// Bit per agent: the episode ended by its time limit (bootstrap from the observation written by `step`).
    pub truncated: u16,
    /// Distance that the agent moved along +x in this decision, m.
    pub forward: [f32; BLOCK],
    /// Bit per agent: its state was not finite; it was quarantined, counts as terminated with reward 0, and its
    /// observation was replaced by zeros. It is made whole by the `reset` that follows, like any other ended episode.
    pub diverged: u16,
    /// Terms of the reward, `[term][16]`, length `16 * reward_terms.len()`; those of a role add up to its reward.
    pub terms: Vec<f32>,
    /// Further numbers about the state reached, `[info][16]`.
    pub info: Vec<f32>,
    /// Per role of [`Spec::roles`], a bit per agent whose role decides next.
    pub decides: Vec<u16>,
    /// Per role of [`Spec::roles`], a bit per agent whose role's part of the episode has ended with this decision before the
    /// episode: where it has failed, and where it has not.
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

/// A run of blocks owned by one thread.
pub trait Shard: Send {
    /// Facts of the task.
    fn spec(&self) -> &Spec;
    /// Number of blocks.
    fn blocks(&self) -> usize;
    /// Starts new episodes for the agents in `mask` and writes their first observations into `obs`
    /// (`[obs][16]`; lanes outside the mask are left alone).
    fn reset(&mut self, block: usize, mask: u16, obs: &mut [f32]);
    /// Tells the actions of all blocks of a decision, `[block][act][16]`, before the [`Shard::step`] of each: for tasks whose
    /// agents are stepped all at once, such as [`Lockstep`](crate::Lockstep)'s. Others need not know.
    fn announce(&mut self, actions: &[f32]) {
        let _ = actions;
    }
    /// Advances every agent of a block by one decision. `action` is `[act][16]`, see [`Spec::action_low`]. Writes the
    /// observation of the state reached into `obs` (`[obs][16]`), for ended episodes too: the caller then calls `reset` for
    /// those.
    fn step(&mut self, block: usize, action: &[f32], obs: &mut [f32], out: &mut BlockStep);
    /// Appends everything that a block's future depends on to `bytes`.
    fn save(&self, block: usize, bytes: &mut Vec<u8>);
    /// Restores what [`Shard::save`] wrote and returns the rest of `bytes`.
    ///
    /// # Errors
    /// If they do not begin with a block of this task; then nothing has changed.
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

/// Makes shards of a task.
pub trait ShardFactory: Send + Sync {
    /// Facts of the task.
    fn spec(&self) -> &Spec;
    /// A shard of blocks `first .. first + blocks`, all agents before their first reset.
    fn shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn Shard>;
    /// Number of agents, if they can only be stepped all at once, as [`Lockstep`](crate::Lockstep)'s: then the shards in use
    /// must have all of their blocks together. None for a task with as many agents as one likes.
    fn lockstep(&self) -> Option<usize> {
        None
    }
    /// Upper bound on the memory of one agent, bytes. See [`check_memory`].
    fn agent_bytes(&self) -> usize {
        self.spec().agent_bytes()
    }
    /// How the task is done well, if it knows: of an agent with clips, what it would observe if it moved exactly like them.
    fn demonstrations(&self) -> Option<Demonstrations> {
        None
    }
}
