//! What ends a player.

use crate::rpc::RpcError;
use marathon_envs::EnvError;
use std::path::PathBuf;
use thiserror::Error;

/// Errors of a player.
#[derive(Debug, Error)]
pub enum PlayerError {
    /// A flag that makes no sense.
    #[error("{0}")]
    Usage(String),
    /// Of the environments: an unknown agent, most likely.
    #[error(transparent)]
    Env(#[from] EnvError),
    /// The log file cannot be written.
    #[error("{}: cannot write the log: {source}", path.display())]
    Log {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Nobody listens.
    #[error(
        "no trainer listens on port {port} of this computer ({source}); start `mlagents-learn CONFIG.yaml` first, which waits \
         on port 5004"
    )]
    Connect {
        /// The port.
        port: u16,
        /// Why.
        source: std::io::Error,
    },
    /// A program listens on the port but does not answer.
    #[error(
        "the program that listens on port {port} of this computer has not answered within {seconds} s (--connect-timeout); \
         is it mlagents-learn?"
    )]
    NoAnswer {
        /// The port.
        port: u16,
        /// The waiting time, s.
        seconds: u64,
    },
    /// A program listens on the port but closes the connection.
    #[error(
        "the program that listens on port {port} of this computer closed the connection before it answered ({source}); is it \
         mlagents-learn?"
    )]
    Closed {
        /// The port.
        port: u16,
        /// How the connection ended.
        source: RpcError,
    },
    /// The trainer is gone or refuses.
    #[error(transparent)]
    Rpc(#[from] RpcError),
    /// What the trainer sent is no message.
    #[error("the trainer's message cannot be read: {0}")]
    Decode(#[from] prost::DecodeError),
    /// The trainer left something out.
    #[error("the trainer's message {0}")]
    Message(&'static str),
    /// Another major version of the protocol.
    #[error("the trainer speaks version {found} of ML-Agents' protocol, expected {expected}")]
    Version {
        /// What it speaks.
        found: String,
        /// What we speak.
        expected: &'static str,
    },
    /// Actions that do not fit the agents.
    #[error("{} actions of {} numbers came for {name}, expected {} of {}", found.0, found.1, expected.0, expected.1)]
    Actions {
        /// Behavior.
        name: String,
        /// Number of actions, and their length.
        found: (usize, usize),
        /// The same as they should be.
        expected: (usize, usize),
    },
    /// An environment parameter would change what a behavior sees or does.
    #[error(
        "environment parameters would change {name} from {} observations and {} actions to {} and {}, which a trainer cannot \
         follow; they stay as they are",
        expected.0, expected.1, found.0, found.1
    )]
    Sizes {
        /// Behavior.
        name: String,
        /// Observations and actions as they are.
        expected: (usize, usize),
        /// As they would be.
        found: (usize, usize),
    },
    /// An environment parameter would change who decides in a behavior's task.
    #[error(
        "environment parameters would change the roles of {name} from {expected} to {found}, which a trainer cannot follow; they \
         stay as they are"
    )]
    Roles {
        /// Behavior of the first role.
        name: String,
        /// The roles as they are.
        expected: String,
        /// As they would be.
        found: String,
    },
    /// More agents than fit into a message.
    #[error(
        "{agents} agents of {name} are too many: when all their episodes end at once, a message takes {bytes} bytes, and \
         ML-Agents accepts {limit}; use at most {most} in one player (--num-spawn-envs, times --num-areas), or more players \
         (mlagents-learn --num-envs)"
    )]
    TooManyAgents {
        /// Agents of the behavior with most bytes.
        agents: usize,
        /// The behavior.
        name: String,
        /// Bytes of a longest message.
        bytes: usize,
        /// Bytes that the trainer takes.
        limit: usize,
        /// How many agents of the behavior there may be.
        most: usize,
    },
}
