//! Physical characters that learn to move: simulate, train and run active ragdolls.
//!
//! [`Trainer`] learns a policy for a task, [`VecEnv`] steps many agents at once, and [`Policy`] maps observations to actions.
//! The crate chooses the widest instruction set of the processor by itself.
//!
//! Train a hopper and save its policy:
//!
//! ```no_run
//! use marathon_rl::prelude::*;
//!
//! let run = Trainer::new("hopper")?.steps(4_000_000).run()?;
//! run.policy.save("hopper.safetensors".as_ref())?;
//! # Ok::<(), marathon_rl::Error>(())
//! ```
//!
//! Step 1,000 hoppers:
//!
//! ```
//! use marathon_rl::prelude::*;
//!
//! let mut env = VecEnv::new("hopper", &VecEnvOptions { agents: 1000, ..Default::default() })?;
//! let mut step = env.buffers();
//! env.reset(Some(1), &mut step.obs)?;
//! let actions = vec![0.0; 1000 * env.spec().act];
//! for _ in 0..1000 {
//!     env.step(&actions, &mut step)?;
//! }
//! # Ok::<(), marathon_rl::Error>(())
//! ```
//!
//! `marathon list` prints the tasks. To add one, implement [`Agent`](envs::Agent) and [`register`](envs::register) it.
//!
//! The modules are the crates below: [`physics`] (MuJoCo's dynamics), [`motion`] (clips and retargeting), [`envs`] (tasks),
//! [`learn`] (algorithms), [`render`] (pictures without a graphics card) and [`runs`] (run folders and reports). Characters in
//! a Bevy app are in the crate `bevy_marathon`.

mod trainer;

pub use marathon_envs as envs;
pub use marathon_learn as learn;
pub use marathon_motion as motion;
pub use marathon_physics as physics;
pub use marathon_render as render;
pub use marathon_runs as runs;

pub use marathon_envs::{Options, Step, VecEnv, VecEnvOptions};
pub use marathon_learn::{Control, EvalOptions, Evaluation, IterationStats, Policy};
pub use marathon_physics::Model;
pub use marathon_runs::{Outcome, RunError as Error};
pub use trainer::{Trainer, evaluate};

/// The result of a function of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// The items that most programs use.
pub mod prelude {
    pub use crate::{
        Control, EvalOptions, Evaluation, IterationStats, Model, Options, Outcome, Policy, Step, Trainer, VecEnv,
        VecEnvOptions, evaluate,
    };
}
