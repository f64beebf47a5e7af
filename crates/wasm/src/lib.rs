//! Marathon as a WebAssembly module for web pages and Node: environments with policies, single models, training and motion
//! clips.
//!
//! The interface consists of plain functions over numbers, and two buffers. JavaScript writes a request into the
//! `input` buffer: the length of a JSON text, the text, then files. The answer, or the message of an error, is in
//! the `output` buffer. Functions that can fail return a negative number then. Objects are numbered; each has
//! functions that return the places of its arrays in memory. `npm/src` wraps all this in classes.
//!
//! The module imports nothing and has one thread. A worker has its own instance.

mod abi;
mod answer;
mod clip;
mod env;
mod hash;
mod objects;
mod simulation;
mod task_info;
#[cfg(feature = "full")]
mod trainer;

pub use hash::hash;

/// Version of the crate.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
