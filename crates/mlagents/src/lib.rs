//! Marathon's environments as a player of Unity's ML-Agents.
//!
//! `mlagents-learn` and everything else that is built on `mlagents_envs` (its Gymnasium and PettingZoo wrappers, TorchRL,
//! RLlib) train on whatever speaks ML-Agents' protocol. [`Player`] does, so they train on Marathon unmodified. The program
//! `marathon-player` is this crate on a command line.
//!
//! * [`Player`] serves [behaviors](Behavior), one per agent type and each of its roles, each any number of agents, to a trainer
//!   on this computer.
//! * [`Demonstration`] is a file of recorded decisions for ML-Agents' imitation learning.
//! * [`wire`], [`rpc`], [`channels`] are the protocol: messages, transport, side channels. Its readers take any bytes
//!   without a panic.
//!
//! # What a trainer may rely on
//!
//! * **Every batch has a decision of every agent**, but for roles that do not decide every time: they are in a batch when they
//!   do, and where an episode ends. There the message has its last observation and reward, and beside it the first observation
//!   of the next episode. (Unity sends ends of episodes between decisions, in batches of their own.)
//! * **Failure and time limit differ**: `max_step_reached` (in Python `interrupted`) tells the time limit, at which trainers
//!   bootstrap.
//! * **The same seed, the same run**: with `mlagents-learn --seed`, the exported policy is the same, byte for byte.
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
