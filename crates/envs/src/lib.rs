//! Marathon's environments: active ragdolls that learn to run.
//!
//! - [`factory`] returns the blocks of a task by name, for learners: [`ShardFactory`], [`Shard`], [`Spec`].
//! - [`VecEnv`] is the general interface: any number of agents, plain row-major arrays, threads, automatic resets.
//! - [`Agent`] is the trait to implement for a new creature or task; [`register`] adds it by name. [`Options`] are an
//!   agent's named arguments.
//! - [`BatchAdapter`] returns the blocks of a [`BatchTask`]: an external task whose agents are stepped all at once.
//!
//! Modules from bottom to top, each importing only from those before it: `error`, `episode_rng`; `agent` (the trait);
//! `shard` (the learner's interface); `lanes` (runs agents); `any_agent` (agents as trait objects); `agents` (the
//! agents of this crate); `registry`; `vec` (plain arrays); `external` (external tasks).
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
//! env.step(&actions, &mut out)?;
//! assert!(out.reward.iter().all(|r| r.is_finite()));
//! # Ok::<(), marathon_envs::EnvError>(())
//! ```

pub mod agent;
pub mod agents;
mod any_agent;
mod episode_rng;
pub mod error;
mod external;
mod lanes;
pub mod registry;
pub mod shard;
mod vec;

pub use agent::{
    Agent, Body, Clips, CommandRange, Controls, Ctrl, Facts, Following, Frame, ModelSource, Motors, NamedClip, Obs,
    OptionInfo, Options, Part, ResetNoise, RoleFacts, Senses, Sigmoid, Site, Start, Terms, Tolerance, Value, View,
    memory, names, options, senses, tolerance,
};
pub use any_agent::{AnyAgent, WithModel, obstacle};
pub use episode_rng::EpisodeRng;
pub use error::EnvError;
pub use external::{BatchAdapter, BatchTask, BatchTaskError, BatchTaskFailed};
pub use lanes::TERMINATION_TERM;
pub use registry::{Registry, agent, factory, factory_with, ids, register};
pub use shard::{
    AgentContext, AgentShard, AgentShards, AgentState, BLOCK, BlockStep, Demonstrations, Metric, MetricSource,
    ObsGroup, Role, Shard, ShardFactory, Spec, check_memory,
};
pub use vec::{Autoreset, ObsNumber, Step, StepMut, VecEnv, VecEnvOptions};
