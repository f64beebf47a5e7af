//! How a `VecEnv` is made.

use marathon_physics::lanes::Isa;

use crate::agent::Options;

/// What happens to an agent whose episode ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Autoreset {
    /// It starts a new episode within the same step: `obs` is the first of the new, `final_obs` the last of the old.
    #[default]
    SameStep,
    /// It starts a new episode at the next step, which ignores its action and gives the first observation, reward 0 and
    /// neither end.
    NextStep,
    /// Nothing: the caller resets it with [`VecEnv::reset_agents`](super::VecEnv::reset_agents).
    Disabled,
}

/// How a [`VecEnv`](super::VecEnv) is made.
#[derive(Clone, Debug)]
pub struct VecEnvOptions {
    /// Number of agents, at least 1.
    pub agents: usize,
    /// Seed until [`VecEnv::reset`](super::VecEnv::reset) gives another.
    pub seed: u64,
    /// Number of threads, at most 1024. 0 means one per processor core. The number of blocks is another upper bound.
    pub threads: usize,
    /// Instruction set; `None` means the widest that the processor has.
    pub isa: Option<Isa>,
    /// What happens at the end of an episode.
    pub autoreset: Autoreset,
    /// Decisions after which an episode is truncated; `None` means the task's own number.
    pub max_episode_steps: Option<usize>,
    /// Arguments of the agent that differ from its defaults.
    pub options: Options,
}

impl Default for VecEnvOptions {
    fn default() -> Self {
        VecEnvOptions {
            agents: 1,
            seed: 0,
            threads: 1,
            isa: None,
            autoreset: Autoreset::SameStep,
            max_episode_steps: None,
            options: Options::new(),
        }
    }
}
