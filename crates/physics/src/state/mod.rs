//! State of agents, and the scratch memory of a step.

mod agent;
mod clearance;
mod coupling;
mod group;
mod obstacle;
mod obstacles;
mod scratch;
mod solids;
mod stats;
mod sweep;
mod variation;
mod weights;

pub use agent::AgentState;
pub(crate) use clearance::{RelativePose, clearance};
pub(crate) use coupling::Coupling;
pub use group::Group;
pub use obstacle::{Obstacle, ObstacleShape};
pub use scratch::Work;
pub(crate) use scratch::{Capped, DofWork, Forces, GeomContacts, Motion, Solver, net_bias_force};
pub(crate) use scratch::{Law, MOST_ROWS, Patch, Place, Slip, SlipLane};
pub use stats::SolverStats;
pub(crate) use sweep::{Sweep, nowhere};
pub use variation::Variation;
