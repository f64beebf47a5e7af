//! Marathon's trainer: PPO, A2C, ACKTR and SAC on the processor, in the lane layout of the physics.
//!
//! A rollout of thousands of agents and the network updates on it run on the same cores, in the same layout: blocks of
//! sixteen agents, `[feature][16]`, from the physics through observations, networks and gradients, so nothing is ever
//! transposed or copied to a device.
//!
//! * [`train`] learns a policy for the task of a [`ShardFactory`](marathon_envs::ShardFactory); [`PpoConfig`] says how,
//!   its [`Algorithm`] by what, an [`Observer`] follows it and may stop it.
//! * [`train_with`] does the same with rollouts that others play, such as [`Player`]s on other machines.
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
//! `ppo`, `a2c`, `acktr` and `sac` are the algorithms: what each does with a rollout, from top to bottom. `run` is around them:
//! threads, iterations, reports. They stand on `rollout` (acting), `advantage` (returns), [`loss`] (the objective), [`mlp`]
//! with `tiles` (networks), `adam` (the optimizer), [`kfac`] (the Fisher matrix), [`signal`] (rewards for novelty) and `normalize` (statistics); `learner`
//! holds what learning changes.
//!
//! # Example
//!
//! ```no_run
//! use marathon_learn::{Control, IterationStats, PpoConfig, Snapshot, evaluate, train};
//! use marathon_physics::lanes::Isa;
//!
//! fn learn(factory: &dyn marathon_envs::ShardFactory) -> Result<(), marathon_learn::Error> {
//!     let config = PpoConfig { total_steps: 4_000_000, seed: 7, ..Default::default() };
//!     let mut progress = |stats: &IterationStats, _: &Snapshot<'_>| {
//!         println!("{:9} steps, return {:.1?}", stats.steps, stats.return_mean);
//!         Control::Continue
//!     };
//!     let output = train(factory, Isa::best(), &config, None, &mut progress)?;
//!     println!("{:?}", evaluate(factory, Isa::best(), &output.policy, &Default::default())?);
//!     output.policy.save("hopper.safetensors".as_ref())
//! }
//! ```

mod a2c;
mod acktr;
mod activation;
mod adam;
mod advantage;
mod agents;
pub mod buffer;
mod checkpoint;
mod clock;
mod config;
pub mod curiosity;
mod error;
mod eval;
mod files;
pub mod gaussian;
mod init;
pub mod kfac;
mod learner;
pub mod loss;
mod memory;
mod mirror;
pub mod mlp;
mod noise;
mod normalize;
mod observer;
mod onnx;
mod policy;
mod ppo;
mod remote;
mod replay;
pub mod rnd;
mod rollout;
mod run;
mod sac;
pub mod signal;
pub mod squash;
mod sums;
mod sync;
mod tiles;
mod update;

pub use a2c::A2c;
pub use acktr::Acktr;
pub use activation::Activation;
pub use checkpoint::Checkpoint;
pub use config::{Algorithm, Init, PpoConfig, Ratio, Schedule};
pub use error::Error;
pub use eval::{EvalOptions, Evaluation, evaluate};
pub use files::{read_description, write_atomic, write_description};
pub use marathon_envs::BLOCK;
pub use normalize::Normalizer;
pub use observer::{Control, IterationStats, Observer, Snapshot};
pub use policy::{BlockPolicy, Policy, PolicyMeta, Training};
pub use remote::{Deliver, Player, Players};
pub use run::{TrainOutput, train, train_with};
pub use sac::Sac;
pub use signal::{Signal, SignalKind};

/// Runs `$body` with `$T` bound to the single-precision lane type of an `Isa`.
macro_rules! f32_lanes {
    ($isa:expr, $T:ident => $body:expr) => {{
        use marathon_physics::lanes;
        match $isa {
            #[cfg(target_arch = "x86_64")]
            lanes::Isa::X16 => {
                type $T = lanes::F32x16;
                $body
            }
            #[cfg(target_arch = "x86_64")]
            lanes::Isa::X8 => {
                type $T = lanes::F32x8;
                $body
            }
            lanes::Isa::F32 => {
                type $T = f32;
                $body
            }
            _ => {
                type $T = lanes::F32x4;
                $body
            }
        }
    }};
}
pub(crate) use f32_lanes;
