//! Errors that end a player.

use crate::rpc::RpcError;
use marathon_envs::EnvError;
use std::path::PathBuf;
use thiserror::Error;

/// Errors of a player.
#[derive(Debug, Error)]
pub enum PlayerError {
    /// An invalid flag.
    #[error("{0}")]
    Usage(String),
    /// An environment error, usually an unknown agent.
    #[error(transparent)]
    Env(#[from] EnvError),
    /// The log file cannot be written.
    #[error("{}: cannot write the log: {source}", path.display())]
    Log {
        /// The file.
        path: PathBuf,
        /// Its cause.
        source: std::io::Error,
    },
    /// No trainer listens.
    #[error(
        "no trainer listens on port {port} of this computer ({source}); start `mlagents-learn CONFIG.yaml` first, which waits \
         on port 5004"
    )]
    Connect {
        /// The port.
        port: u16,
        /// Its cause.
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
    /// The trainer is gone or refuses the message.
    #[error(transparent)]
    Rpc(#[from] RpcError),
    /// The trainer's message cannot be decoded.
    #[error("the trainer's message cannot be read: {0}")]
    Decode(#[from] prost::DecodeError),
    /// The trainer's message is incomplete.
    #[error("the trainer's message {0}")]
    Message(&'static str),
    /// The trainer uses another major version of the protocol.
    #[error("the trainer uses version {found} of ML-Agents' protocol, expected {expected}")]
    Version {
        /// Version of the trainer.
        found: String,
        /// Version of this player.
        expected: &'static str,
    },
    /// The actions do not fit the agents.
    #[error("received {} actions of {} numbers for {name}, expected {} of {}", found.0, found.1, expected.0, expected.1)]
    Actions {
        /// Behavior.
        name: String,
        /// Number of actions, and their length.
        found: (usize, usize),
        /// Expected number and length.
        expected: (usize, usize),
    },
    /// An environment parameter would change a behavior's observations or actions.
    #[error(
        "environment parameters would change {name} from {} observations and {} actions to {} and {}, which a trainer cannot \
         follow; they stay as they are",
        expected.0, expected.1, found.0, found.1
    )]
    Sizes {
        /// Behavior.
        name: String,
        /// Current numbers of observations and actions.
        expected: (usize, usize),
        /// Numbers after the change.
        found: (usize, usize),
    },
    /// An environment parameter would change which roles of a behavior's task decide.
    #[error(
        "environment parameters would change the roles of {name} from {expected} to {found}, which a trainer cannot follow; they \
         stay as they are"
    )]
    Roles {
        /// Behavior of the first role.
        name: String,
        /// Current roles.
        expected: String,
        /// Roles after the change.
        found: String,
    },
    /// The messages of so many agents would be too long.
    #[error(
        "{agents} agents of {name} are too many: when all their episodes end at once, a message takes {bytes} bytes, and \
         ML-Agents accepts {limit}; use at most {most} in one player (--num-spawn-envs, times --num-areas), or more players \
         (mlagents-learn --num-envs)"
    )]
    TooManyAgents {
        /// Agents of the behavior with the most bytes.
        agents: usize,
        /// The behavior.
        name: String,
        /// Bytes of the longest message.
        bytes: usize,
        /// Bytes that the trainer accepts.
        limit: usize,
        /// Maximum number of agents of the behavior.
        most: usize,
    },
}
