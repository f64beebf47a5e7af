//! Any number of agents behind plain arrays.

mod arrays;
mod deciders;
mod pool;
mod snapshot;
mod vec_env;
mod worker;

pub use arrays::{ObsNumber, Step, StepMut};
pub use vec_env::{Autoreset, VecEnv, VecEnvOptions};
