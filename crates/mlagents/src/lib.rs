//! Marathon's environments as a player for Unity's ML-Agents.
//!
//! `mlagents-learn` and all software based on `mlagents_envs` (its Gymnasium and PettingZoo wrappers, TorchRL, RLlib)
//! train on programs that implement ML-Agents' protocol. [`Player`] does, so they train on Marathon unmodified. The
//! program `marathon-player` runs this crate from a command line.
//!
//! * [`Player`] serves [behaviors](Behavior) to a trainer on this computer: one per agent type and role, each with any
//!   number of agents.
//! * [`Demonstration`] is a file of recorded decisions for ML-Agents' imitation learning.
//! * [`wire`], [`rpc`], [`channels`] are the protocol: messages, transport, side channels. Its readers never panic on
//!   invalid bytes.
//!
//! # Guarantees for trainers
//!
//! * **Every batch has a decision of every agent.** Roles that skip decisions are an exception: they are in a batch
//!   when they decide, and when an episode ends. The message then has its last observation and reward, and also the
//!   first observation of the next episode. (Unity sends ends of episodes between decisions, in batches of their own.)
//! * **Failure and time limit differ**: `max_step_reached` (in Python `interrupted`) marks the time limit, at which
//!   trainers bootstrap.
//! * **Runs are reproducible**: with the same `mlagents-learn --seed`, the exported policy is the same, byte for byte.
//! * **Environment parameters are drawn for each agent and episode** from the distributions that the trainer sends.

pub mod args;
mod behavior;
pub mod channels;
mod demo;
mod error;
mod face;
mod log;
mod parameters;
mod player;
mod program;
pub mod rpc;
mod trainer;
pub mod wire;

pub use behavior::{Behavior, BehaviorOptions};
pub use demo::{DemoError, Demonstration, Episode, read_demonstrations};
pub use error::PlayerError;
pub use log::Log;
pub use parameters::{Names, Parameters};
pub use player::{EngineSettings, Player, PlayerOptions, Turn};
pub use program::main;
pub use trainer::{COMMUNICATION_VERSION, MESSAGE_LIMIT, Setup, Trainer};
