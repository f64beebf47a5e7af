//! Shards whose agents can be looked at and handled one by one.

use marathon_physics::Variation;

use super::{AgentContext, Shard, ShardFactory};
use crate::error::EnvError;

/// A state of one agent.
#[derive(Clone, Debug, PartialEq)]
pub struct AgentState {
    /// Configuration, MuJoCo's layout.
    pub qpos: Vec<f64>,
    /// Velocity, MuJoCo's layout.
    pub qvel: Vec<f64>,
}

/// A [`Shard`] whose agents can be looked at: for viewers, tests and tools.
pub trait AgentShard: Shard {
    /// State of an agent, numbered within this shard.
    fn state(&self, agent: usize) -> AgentState;
    /// Configuration of the clip that an agent, numbered within this shard, follows: where it is now, MuJoCo's layout, world.
    /// `None` if its task follows none.
    fn reference(&self, agent: usize) -> Option<Vec<f64>>;
    /// Writes the positions of the agents' roots along x, m, which [`BlockStep::forward`](crate::BlockStep::forward) is a difference of; as many as
    /// fit. Returns whether roots can move along x.
    fn x_positions(&self, out: &mut [f64]) -> bool;
    /// Puts an agent into a state, as if an episode had begun there.
    ///
    /// # Errors
    /// If lengths are wrong or a number is not finite.
    fn set_state(&mut self, agent: usize, state: &AgentState) -> Result<(), EnvError>;
    /// Controls of an agent, numbered within this shard, during its last decision, in the actuators' units.
    fn ctrl(&self, agent: usize) -> Vec<f64>;
    /// What an agent, numbered within this shard, is given from outside: commands, pushes, constants and ground of its own.
    fn context(&mut self, agent: usize) -> Box<dyn AgentContext + '_>;
    /// Feet ([`Facts::feet`](crate::Facts::feet)) of an agent that touched the ground during its last decision: a bit each, of the first 32.
    fn feet(&self, agent: usize) -> u32;
    /// Writes what the agents in `mask` report about their present states into `info` (`[info][16]`, see
    /// [`Facts::info`](crate::Facts::info); lanes outside the mask are left alone).
    fn info(&self, block: usize, mask: u16, info: &mut [f32]);
    /// Starts all random streams anew from a seed; the next reset begins every agent's first episode under it.
    fn reseed(&mut self, seed: u64);
    /// The same for one agent, numbered within this shard, which gets the streams of agent `number`.
    fn reseed_agent(&mut self, agent: usize, seed: u64, number: u64);
    /// Writes the observations of the agents in `mask` as if their episodes began in their present states into `obs`
    /// (`[obs][16]`; lanes outside the mask are left alone).
    fn observe(&mut self, block: usize, mask: u16, obs: &mut [f32]);
    /// Sets the number of decisions after which an episode is truncated, in place of the task's own.
    fn limit_episodes(&mut self, max_episode_steps: usize);
}

/// A [`ShardFactory`] that can also make [`AgentShard`]s.
pub trait AgentShards: ShardFactory {
    /// Same as [`ShardFactory::shard`].
    fn agent_shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn AgentShard>;
    /// The model's own constants: what [`AgentContext::vary`] may deviate from.
    fn unvaried(&self) -> Variation;
}
