//! Errors of this crate.

use marathon_physics::SimError;
use marathon_physics::budget::OverBudget;
use marathon_physics::hint::{did_you_mean, listed};
use marathon_physics::mjcf::MjcfError;
use thiserror::Error;

/// The names like an unknown one, or where all are.
fn others(similar: &str, count: usize) -> String {
    match similar {
        "" => format!("`marathon list` lists all {count}"),
        similar => format!("the most similar of {count}: {similar}"),
    }
}

/// The options of an agent behind the name of one that it lacks.
fn options(near: Option<&String>, known: &str) -> String {
    if known.is_empty() { "; it has no options".into() } else { listed(near, known) }
}

/// Errors of the registry, of agents and of [`VecEnv`](crate::VecEnv).
#[derive(Debug, Error)]
pub enum EnvError {
    /// No agent of this name is registered.
    #[error("agent '{name}' does not exist{}; {}", did_you_mean(.nearest.as_ref()), others(similar, *count))]
    UnknownAgent {
        /// The requested name.
        name: String,
        /// The closest registered name, if any is close.
        nearest: Option<String>,
        /// The most similar registered names, comma separated; empty if none is like it.
        similar: String,
        /// Number of registered names.
        count: usize,
    },
    /// The name of an agent is the path of something that is no model.
    #[error("'{path}' is {found}, expected the name of an agent, or a model in MJCF with the ending .xml{hint}")]
    NotAModel {
        /// The name.
        path: String,
        /// A description of the path.
        found: &'static str,
        /// A way to make a model of it.
        hint: &'static str,
    },
    /// The name is registered already.
    #[error("agent '{id}' is registered already; give the new one another id, such as '{suggestion}'")]
    DuplicateAgent {
        /// The name.
        id: String,
        /// A free name.
        suggestion: String,
    },
    /// The agent has no such argument.
    #[error("agent '{id}' takes no option '{name}'{}", options(.nearest.as_ref(), known))]
    UnknownOption {
        /// Registry name of the agent.
        id: String,
        /// The given name.
        name: String,
        /// The closest argument, if any is close.
        nearest: Option<String>,
        /// All arguments of the agent, comma separated; empty if it has none.
        known: String,
    },
    /// The value is invalid for the argument.
    #[error("agent '{id}': option {option} is {found}, expected {expected}")]
    OptionValue {
        /// Registry name of the agent.
        id: String,
        /// The argument.
        option: String,
        /// The given value.
        found: String,
        /// The valid values.
        expected: &'static str,
    },
    /// A command is out of its range.
    #[error("agent '{id}': command {name} is {found}, expected {low} to {high} {unit}")]
    Command {
        /// Registry name of the agent.
        id: String,
        /// Name of the number.
        name: String,
        /// The given value.
        found: f64,
        /// Lowest value.
        low: f64,
        /// Highest value.
        high: f64,
        /// Unit.
        unit: String,
    },
    /// An agent does not match its model.
    #[error("agent '{id}': {problem}")]
    Agent {
        /// Registry name of the agent.
        id: String,
        /// The problem: found and expected values.
        problem: String,
    },
    /// The agent's model file cannot be read.
    #[error("model of agent '{id}': {source}")]
    Model {
        /// Registry name of the agent.
        id: String,
        /// The loader's error.
        source: Box<MjcfError>,
    },
    /// The agent's model cannot be simulated.
    #[error("agent '{id}': {source}")]
    Sim {
        /// Registry name of the agent.
        id: String,
        /// The simulator's error.
        source: SimError,
    },
    /// An instruction set that cannot be used.
    #[error("cannot run '{isa}': {obstacle}; the best is '{best}'")]
    Isa {
        /// The requested instruction set.
        isa: &'static str,
        /// The reason.
        obstacle: &'static str,
        /// The best available one.
        best: &'static str,
    },
    /// An array of the caller has the wrong length.
    #[error("{what} has {found} numbers, expected {expected}")]
    Shape {
        /// The array, with its shape.
        what: String,
        /// Its length.
        found: usize,
        /// The required length.
        expected: usize,
    },
    /// An option has an invalid value.
    #[error("{option} is {found}, expected {expected}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Its value.
        found: String,
        /// The valid values.
        expected: &'static str,
    },
    /// The memory budget is too small for this number of agents.
    #[error("agents is {agents}, which {source}")]
    Memory {
        /// Number of agents.
        agents: usize,
        /// The limit.
        source: OverBudget,
    },
    /// A snapshot does not match the environment.
    #[error("snapshot: {0}")]
    Snapshot(String),
}
