//! Options of a `VecEnv`.

use marathon_physics::lanes::Isa;

use crate::agent::Options;

/// Handling of an agent whose episode has ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Autoreset {
    /// It starts a new episode within the same step: `obs` is the first of the new episode, `final_obs` the last of the
    /// old one.
    #[default]
    SameStep,
    /// It starts a new episode at the next step, which ignores its action. That step returns the first observation,
    /// reward 0, and neither end.
    NextStep,
    /// No reset: the caller uses [`VecEnv::reset_agents`](super::VecEnv::reset_agents).
    Disabled,
}

/// Options of a [`VecEnv`](super::VecEnv).
#[derive(Clone, Debug)]
pub struct VecEnvOptions {
    /// Number of agents, at least 1.
    pub agents: usize,
    /// Seed until [`VecEnv::reset`](super::VecEnv::reset) sets another one.
    pub seed: u64,
    /// Number of threads, at most 1024. 0 means one per processor core. The number of blocks is another upper bound.
    pub threads: usize,
    /// Instruction set. `None` means the widest one of the processor.
    pub isa: Option<Isa>,
    /// Handling of the end of an episode.
    pub autoreset: Autoreset,
    /// Decisions after which an episode is truncated. `None` means the task's own limit.
    pub max_episode_steps: Option<usize>,
    /// Arguments of the agent that differ from its defaults.
    pub options: Options,
}

impl Default for VecEnvOptions {
    fn default() -> Self {
        VecEnvOptions {
            agents: 1,
            seed: 0,
            threads: 0,
            isa: None,
            autoreset: Autoreset::SameStep,
            max_episode_steps: None,
            options: Options::new(),
        }
    }
}
