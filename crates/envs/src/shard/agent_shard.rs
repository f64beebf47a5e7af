//! Shards with access to single agents.

use marathon_physics::Variation;

use super::{AgentContext, Shard, ShardFactory};
use crate::error::EnvError;

/// State of one agent.
#[derive(Clone, Debug, PartialEq)]
pub struct AgentState {
    /// Configuration in MuJoCo's layout.
    pub qpos: Vec<f64>,
    /// Velocity in MuJoCo's layout.
    pub qvel: Vec<f64>,
}

/// A [`Shard`] with access to single agents, for viewers, tests and tools. Agents are numbered within the shard.
pub trait AgentShard: Shard {
    /// State of an agent.
    fn state(&self, agent: usize) -> AgentState;
    /// Configuration of the agent's clip at the present frame, in MuJoCo's layout and world coordinates. `None` if the
    /// task follows no clips.
    fn reference(&self, agent: usize) -> Option<Vec<f64>>;
    /// Writes the positions of the agents' roots along x, m, as many as fit.
    /// [`BlockStep::forward`](crate::BlockStep::forward) is their difference between decisions. Returns whether roots
    /// can move along x.
    fn x_positions(&self, out: &mut [f64]) -> bool;
    /// Sets an agent's state, as if an episode began there.
    ///
    /// # Errors
    /// If lengths are wrong or a number is not finite.
    fn set_state(&mut self, agent: usize, state: &AgentState) -> Result<(), EnvError>;
    /// Appends the complete state of one agent to `bytes`, see [`Shard::save`].
    fn save_agent(&self, agent: usize, bytes: &mut Vec<u8>);
    /// Restores the state that [`AgentShard::save_agent`] wrote, and returns the rest of `bytes`. Other agents are
    /// unchanged.
    ///
    /// # Errors
    /// If they do not begin with an agent of this task. Then nothing has changed.
    fn load_agent<'a>(&mut self, agent: usize, bytes: &'a [u8]) -> Result<&'a [u8], EnvError>;
    /// Controls of an agent during its last decision, in the actuators' units.
    fn ctrl(&self, agent: usize) -> Vec<f64>;
    /// Inputs of an agent besides actions: commands, pushes, constants and ground.
    fn context(&mut self, agent: usize) -> Box<dyn AgentContext + '_>;
    /// Feet ([`Facts::feet`](crate::Facts::feet)) of an agent that touched the ground during its last decision, one bit
    /// each. Only the first 32 are included.
    fn feet(&self, agent: usize) -> u32;
    /// Writes the infos of the agents in `mask` at their present states into `info` (`[info][16]`), see
    /// [`Facts::info`](crate::Facts::info). Other lanes are unchanged.
    fn info(&self, block: usize, mask: u16, info: &mut [f32]);
    /// Restarts all random streams from a seed. The next reset begins every agent's first episode with it.
    fn reseed(&mut self, seed: u64);
    /// The same for one agent, which gets the streams of agent `number`.
    fn reseed_agent(&mut self, agent: usize, seed: u64, number: u64);
    /// Writes the observations of the agents in `mask` into `obs` (`[obs][16]`), as if their episodes began at their
    /// present states. Other lanes are unchanged.
    fn observe(&mut self, block: usize, mask: u16, obs: &mut [f32]);
    /// Sets the number of decisions after which an episode is truncated.
    fn limit_episodes(&mut self, max_episode_steps: usize);
}

/// A [`ShardFactory`] that also creates [`AgentShard`]s.
pub trait AgentShards: ShardFactory {
    /// Same as [`ShardFactory::shard`].
    fn agent_shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn AgentShard>;
    /// The model's own constants, which [`AgentContext::vary`] can change.
    fn unvaried(&self) -> Variation;
}
