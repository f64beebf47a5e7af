//! Marathon's trainer: PPO, A2C, ACKTR and SAC on the CPU, in the lane layout of the physics.
//!
//! Rollouts of thousands of agents and the network updates run on the same cores and in the same layout: blocks of
//! sixteen agents, `[feature][16]`. This holds from the physics through observations, networks and gradients, so data
//! is never transposed or copied to a device.
//!
//! * [`train`] trains a policy for the task of a [`ShardFactory`](marathon_envs::ShardFactory). [`TrainConfig`] holds
//!   the settings, its [`Algorithm`] the method. An [`Observer`] follows the run and may stop it.
//! * [`TrainLoop`] is the same run, one iteration per call.
//! * [`train_with`] lets others play the rollouts, such as [`Player`]s on other machines.
//! * [`Policy`] is the result. It acts, and you can save it to a file. [`evaluate`] measures it.
//! * [`Checkpoint`] is an interrupted run. When resumed, it gives the same bits as an uninterrupted run.
//!
//! # Reproducibility
//!
//! A policy depends only on the task, the configuration and its seed. The number of threads, the vector width and
//! interruptions do not change it. Four rules ensure this:
//!
//! 1. Elementary operations round alike on every backend of [`marathon_physics::lanes`], and transcendental functions
//!    are composed of them.
//! 2. A sum over samples runs within each of sixteen lanes first and then over the lanes in one fixed tree.
//! 3. Sums over blocks or groups of samples are kept per block or group, and added up in their order.
//! 4. Every agent has its own stream of random numbers, and shuffles depend on the seed and the iteration.
//!
//! # Reading the code
//!
//! [`algorithms`] has `ppo`, `a2c`, `acktr` and `sac`, each from top to bottom. They build on the folders below, each
//! of which builds on those before it: [`lanes`] (memory and random numbers, sixteen agents side by side), [`nets`]
//! (networks and distributions), [`optim`] (optimizers), [`policy`] (the result), [`rewards`], and [`rollout`]
//! (collecting and storing). `trainer` runs the algorithms: threads, iterations, files, reports.
//!
//! To add an algorithm, implement [`Learner`](algorithms::Learner) and add it to [`Algorithm`]. To add a reward,
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
pub use algorithms::actor_critic::ActionStd;
pub use algorithms::ppo::Ppo;
pub use algorithms::sac::Sac;
pub use algorithms::schedule::{LrSchedule, Progress, Schedule};
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
pub use policy::{Ancestor, BlockPolicy, Cast, Policy, PolicyMeta, Training};
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
pub use trainer::{TrainLoop, TrainOutput, check_demonstrations, train, train_with};
