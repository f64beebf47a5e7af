//! Marathon's trainer: PPO, A2C, ACKTR and SAC on the processor, in the lane layout of the physics.
//!
//! A rollout of thousands of agents and the network updates on it run on the same cores, in the same layout: blocks of
//! sixteen agents, `[feature][16]`, from the physics through observations, networks and gradients, so nothing is ever
//! transposed or copied to a device.
//!
//! * [`train`] learns a policy for the task of a [`ShardFactory`](marathon_envs::ShardFactory). [`TrainConfig`] says how, its
//!   [`Algorithm`] by what; an [`Observer`] follows the run and may stop it.
//! * [`Trainer`] is the same run, made an iteration at a time by its caller.
//! * [`train_with`] has the rollouts played by others, such as [`Player`]s on other machines.
//! * [`Policy`] is the result: it acts, and it is a file. [`evaluate`] tells how good it is.
//! * [`Checkpoint`] is an interrupted run. Resumed, it gives the bits of a run that was never interrupted.
//!
//! # The same bits
//!
//! A policy depends on the task, the configuration and its seed alone: not on the number of threads, not on the vector
//! width, not on interruptions. Four rules make it so:
//!
//! 1. Elementary operations round alike on every backend of [`marathon_physics::lanes`], and transcendental functions
//!    are made of them.
//! 2. A sum over samples runs within each of sixteen lanes first and then over the lanes in one fixed tree.
//! 3. Whatever is summed over blocks or groups of samples is kept per block or group, and added up in their order.
//! 4. Every agent has its own stream of random numbers, and shuffles come from the seed and the iteration.
//!
//! # Reading the code
//!
//! [`algorithms`] has `ppo`, `a2c`, `acktr` and `sac`: what each does with a rollout, from top to bottom. The folders below
//! are what they stand on, each on those before it: [`lanes`] (memory and random numbers, sixteen agents side by side),
//! [`nets`] (networks and distributions), [`optim`] (optimizers), [`policy`] (the result), [`rewards`], and [`rollout`]
//! (collecting, and what is kept). `trainer` is around the algorithms: threads, iterations, files, reports.
//!
//! To add an algorithm, implement [`Learner`](algorithms::Learner) and give it a place in [`Algorithm`]. To add a reward,
//! implement [`Reward`](rewards::Reward).
//!
//! # Example
//!
//! ```no_run
//! use marathon_learn::{Control, IterationStats, Snapshot, TrainConfig, evaluate, train};
//! use marathon_physics::lanes::Isa;
//!
//! fn learn(factory: &dyn marathon_envs::ShardFactory) -> Result<(), marathon_learn::Error> {
//!     let config = TrainConfig::default().with(|config| (config.run.total_steps, config.run.seed) = (4_000_000, 7));
//!     let mut progress = |stats: &IterationStats, _: &Snapshot<'_>| {
//!         println!("{:9} steps, return {:.1?}", stats.steps, stats.learned.return_mean);
//!         Control::Continue
//!     };
//!     let output = train(factory, Isa::best(), &config, None, &mut progress)?;
//!     println!("{:?}", evaluate(factory, Isa::best(), &output.policy, &Default::default())?);
//!     output.policy.save("hopper.safetensors".as_ref())
//! }
//! ```

pub mod algorithms;
pub mod distill;
mod error;
mod files;
pub mod lanes;
pub mod nets;
pub mod optim;
pub mod policy;
pub mod rewards;
pub mod rollout;
mod trainer;

pub use algorithms::Algorithm;
pub use algorithms::a2c::A2c;
pub use algorithms::acktr::Acktr;
pub use algorithms::actor_critic::Deviations;
pub use algorithms::ppo::Ppo;
pub use algorithms::sac::Sac;
pub use algorithms::schedule::{Moving, Schedule};
pub use distill::{Distiller, Halfway, Lessons};
pub use error::Error;
pub use files::{AtomicFile, checksum, read_description, write_atomic, write_description};
pub use lanes::BLOCK;
pub use nets::NetworkConfig;
pub use nets::activation::Activation;
pub use nets::gaussian::Ratio;
pub use nets::init::Init;
pub use nets::normalize::Normalizer;
pub use policy::evaluation::Evaluation;
pub use policy::{BlockPolicy, Cast, Policy, PolicyMeta, Training};
pub use rewards::discriminator::{Form, Imitation};
pub use rewards::{Novelty, RewardConfig, RewardKind};
pub use rollout::statistics::StatisticsConfig;
pub use trainer::checkpoint::Checkpoint;
pub use trainer::config::{RoleConfig, RunConfig, TrainConfig};
pub use trainer::evaluate::{EvalOptions, evaluate, evaluate_roles};
pub use trainer::initialize::initialized;
pub use trainer::memory::can_be_had;
pub use trainer::observer::{Control, Observer, Snapshot};
pub use trainer::remote::{Deliver, Player, Players};
pub use trainer::stats::{IterationStats, Learned};
pub use trainer::{TrainOutput, Trainer, train, train_with};
