//! Speed measurements: processor time per step, and throughput of the environments.

mod env;
mod sample;

pub use env::{EnvSpeed, env_speed};
pub use sample::{Sample, median, on_threads, spread, thread_cpu};
