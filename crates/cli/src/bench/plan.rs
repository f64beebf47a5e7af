//! The settings of `bench physics` that both engines share.

use clap::ValueEnum;
use marathon_physics::SolverStats;
use marathon_physics::lanes::Isa;
use serde::Serialize;

/// Contacts to simulate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Which {
    /// Contacts with bodies that cannot move.
    Ground,
    /// All contacts of the model.
    All,
}

/// Settings of all models and repetitions.
pub struct Plan {
    pub threads: usize,
    /// Agents of each thread.
    pub agents: usize,
    /// Steps before the timed ones.
    pub warmup: usize,
    /// Without actuators.
    pub limp: bool,
    pub contacts: Which,
    pub seconds: f64,
    pub isas: Vec<Isa>,
}

/// Sums over repetitions.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    pub stats: SolverStats,
    /// Agents whose state was not finite at the end.
    pub non_finite: u64,
}
