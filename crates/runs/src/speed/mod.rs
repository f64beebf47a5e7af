//! Speed of computations: processor time of a step, and how many steps the environments make.

mod env;
mod sample;

pub use env::{EnvSpeed, env_speed};
pub use sample::{Sample, median, on_threads, spread, thread_cpu};
