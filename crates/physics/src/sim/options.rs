//! Options for building a [`Sim`](super::Sim), and the reasons why that may fail.

use crate::budget::OverBudget;
use thiserror::Error;

/// Maximum number of rows between moving links (and over several joints) for which an agent is solved by a low-rank
/// correction. It equals eight contacts with friction: more than a character has with itself, except in rare cases.
pub(crate) const MOST_COUPLED_ROWS: usize = 24;

/// Reason why a model cannot be simulated.
#[derive(Debug, Error, PartialEq)]
pub enum SimError {
    /// The model uses something that this engine does not support.
    #[error("model '{model}': {what} is not supported by the simulator; {remedy}")]
    Unsupported {
        /// Model name.
        model: String,
        /// The offending element by name.
        what: String,
        /// A remedy for the user.
        remedy: String,
    },
    /// The lists of a simulation would take more memory than the [budget](crate::budget) allows.
    #[error("model '{model}': the list of its contacts {over}")]
    Budget {
        /// Model name.
        model: String,
        /// The amount and the limit.
        over: OverBudget,
    },
}

/// Options for building a [`Sim`](crate::Sim).
#[derive(Clone, Debug, Default)]
pub struct SimOptions {
    /// Simulate only contacts with the static world, even if the model's moving geoms could collide with each other (by
    /// their contype and conaffinity).
    pub ground_contacts_only: bool,
    /// Overrides the model's cap on the solver's iterations. Below 50, the solver follows MuJoCo's iteration step by
    /// step and stops where MuJoCo stops.
    pub max_newton: Option<usize>,
    /// Overrides the number of rows between moving bodies above which an agent is solved as a crowd (24). It changes
    /// the time of a step, and its results by rounding.
    pub most_coupled_rows: Option<usize>,
}
