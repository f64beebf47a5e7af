//! Marathon's environments: active ragdolls that learn to run.
//!
//! * [`factory`] gives a learner the blocks of a task by name: [`ShardFactory`], [`Shard`], [`Spec`].
//! * [`VecEnv`] is for everybody else: any number of agents, plain row-major arrays, threads, automatic resets.
//! * [`Agent`] is what one implements to add a creature; [`register`] makes it known by name.
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
pub mod memory;
mod random;
pub mod registry;
pub mod senses;
pub mod shard;
pub mod vec_env;
mod write;

pub use agent::{Agent, AnyAgent, Facts, Motors, Part, ResetNoise};
pub use error::EnvError;
pub use lane_env::{AgentShard, AgentShards, AgentState, TERMINATION_TERM};
pub use registry::{Registry, agent, factory, ids, register};
pub use senses::Senses;
pub use shard::{BLOCK, BlockStep, Shard, ShardFactory, Spec};
pub use vec_env::{Autoreset, Step, StepMut, VecEnv, VecEnvOptions};
pub use write::{Obs, Terms};
