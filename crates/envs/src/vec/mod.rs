//! Any number of agents with plain arrays.

mod arrays;
mod deciders;
mod options;
mod pool;
mod snapshot;
mod vec_env;
mod worker;

pub use arrays::{ObsNumber, Step, StepMut};
pub use options::{Autoreset, VecEnvOptions};
pub use vec_env::VecEnv;
