//! What can go wrong before an environment runs.

use marathon_physics::SimError;
use marathon_physics::budget::OverBudget;
use marathon_physics::hint::listed;
use marathon_physics::mjcf::MjcfError;
use thiserror::Error;

/// Errors of the registry, of agents and of [`VecEnv`](crate::VecEnv).
#[derive(Debug, Error)]
pub enum EnvError {
    /// No agent of this name is registered.
    #[error("agent '{name}' does not exist{}", listed(.nearest.as_ref(), known))]
    UnknownAgent {
        /// What was asked for.
        name: String,
        /// The registered name closest to it, if any is close.
        nearest: Option<String>,
        /// All registered names, comma separated.
        known: String,
    },
    /// A name is registered twice.
    #[error("agent '{id}' is registered already; give the new one another id, such as '{suggestion}'")]
    DuplicateAgent {
        /// The name.
        id: String,
        /// A free name.
        suggestion: String,
    },
    /// An agent does not take an argument.
    #[error("agent '{id}' takes no option '{name}'{}", listed(.nearest.as_ref(), known))]
    UnknownOption {
        /// Registry name of the agent.
        id: String,
        /// What was given.
        name: String,
        /// The argument closest to it, if any is close.
        nearest: Option<String>,
        /// All arguments that it takes, comma separated.
        known: String,
    },
    /// An argument cannot have this value.
    #[error("agent '{id}': option {option} is {found}, expected {expected}")]
    OptionValue {
        /// Registry name of the agent.
        id: String,
        /// The argument.
        option: String,
        /// What was given.
        found: String,
        /// What is allowed.
        expected: &'static str,
    },
    /// An agent cannot be told this.
    #[error("agent '{id}': command {name} is {found}, expected {low} to {high} {unit}")]
    Command {
        /// Registry name of the agent.
        id: String,
        /// Name of the number.
        name: String,
        /// What was given.
        found: f64,
        /// Lowest value.
        low: f64,
        /// Highest value.
        high: f64,
        /// Unit.
        unit: String,
    },
    /// An agent and its model do not fit together.
    #[error("agent '{id}': {problem}")]
    Agent {
        /// Registry name of the agent.
        id: String,
        /// What was found and what was expected.
        problem: String,
    },
    /// The agent's model file cannot be read.
    #[error("model of agent '{id}': {source}")]
    Model {
        /// Registry name of the agent.
        id: String,
        /// The loader's complaint.
        source: Box<MjcfError>,
    },
    /// The agent's model cannot be simulated.
    #[error("agent '{id}': {source}")]
    Sim {
        /// Registry name of the agent.
        id: String,
        /// The simulator's complaint.
        source: SimError,
    },
    /// The processor lacks an instruction set.
    #[error("this processor cannot run '{isa}'; the best it has is '{best}'")]
    Isa {
        /// What was asked for.
        isa: &'static str,
        /// What there is.
        best: &'static str,
    },
    /// An array handed over by the caller has the wrong length.
    #[error("{what} has {found} numbers, expected {expected}")]
    Shape {
        /// Which array, with its shape.
        what: String,
        /// Its length.
        found: usize,
        /// The length it should have.
        expected: usize,
    },
    /// An option has a value that makes no sense.
    #[error("{option} is {found}, expected {expected}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Its value.
        found: String,
        /// What is allowed.
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
    /// A snapshot does not fit the environment it is loaded into.
    #[error("snapshot: {0}")]
    Snapshot(String),
}
