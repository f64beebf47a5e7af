//! Marathon's environments: active ragdolls that learn to run.
//!
//! * [`factory`] gives a learner the blocks of a task by name: [`ShardFactory`], [`Shard`], [`Spec`].
//! * [`VecEnv`] is for everybody else: any number of agents, plain row-major arrays, threads, automatic resets.
//! * [`Agent`] is what one implements to add a creature; [`register`] makes it known by name. [`Options`] are named
//!   arguments that an agent may take.
//! * [`Lockstep`] gives a learner the blocks of a [`Crowd`]: a task from elsewhere, whose agents are stepped all at once.
//!
//! The same seed gives the same bits on every machine, for every number of threads, agents and lanes.
//!
//! ```
//! use marathon_envs::{VecEnv, VecEnvOptions};
//!
//! let mut env = VecEnv::new("hopper", &VecEnvOptions { agents: 3, ..Default::default() })?;
//! let mut out = env.buffers();
//! env.reset(Some(7), &mut out.obs)?;
//! let actions = vec![0.0; 3 * env.spec().act];
//! env.step(&actions, &mut out.as_mut())?;
//! assert!(out.reward.iter().all(|r| r.is_finite()));
//! # Ok::<(), marathon_envs::EnvError>(())
//! ```

pub mod agent;
pub mod agents;
mod anatomy;
pub mod error;
mod lane_env;
mod lane_group;
pub mod lockstep;
pub mod memory;
mod mind;
pub mod options;
mod pool;
mod prepared;
mod random;
pub mod registry;
pub mod rows;
mod saved;
pub mod senses;
pub mod shard;
mod start;
pub mod tolerance;
pub mod vec_env;
mod write;

pub use agent::{
    Agent, AnyAgent, Body, Controls, Elsewhere, Facts, ModelSource, Motors, Part, ResetNoise, View, names,
};
pub use error::{EnvError, nearest};
pub use lane_env::{AgentShard, AgentShards, AgentState, TERMINATION_TERM};
pub use lockstep::{Crowd, CrowdError, Lockstep};
pub use options::{OptionInfo, Options, Value};
pub use random::EpisodeRng;
pub use registry::{Registry, agent, factory, factory_with, ids, register};
pub use rows::{ObsNumber, Step, StepMut};
pub use senses::Senses;
pub use shard::{BLOCK, BlockStep, Shard, ShardFactory, Spec};
pub use start::Start;
pub use tolerance::{Sigmoid, Tolerance};
pub use vec_env::{Autoreset, VecEnv, VecEnvOptions};
pub use write::{Obs, Terms};
