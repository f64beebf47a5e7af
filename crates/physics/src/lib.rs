//! MuJoCo's physics, one agent per SIMD lane.
//!
//! * [`mjcf`] reads an MJCF file and compiles it to a [`Model`], equal to MuJoCo's.
//! * [`Sim`] holds the model's constants in lane precision, [`Group`] the state of as many agents as a vector has lanes,
//!   [`Work`] the scratch memory of a step. [`Sim::step`] advances a group.
//! * [`lanes`] has the number type that carries every kernel: `f64`, `f32`, or 4, 8, 16 agents in one vector.
//!
//! The folders stand on each other in the order in which they are listed: each knows only those above it in the list.

pub mod lanes;

mod algebra;
pub mod model;

mod geometry;
pub mod mjcf;

mod sim;

mod rows;

mod multifrontal;

mod state;

mod dynamics;

mod collision;
mod constraint;

mod solver;

mod step;

mod readings;

mod batch;

pub use algebra::spatial;
pub use algebra::spatial::rot_to_quat;
pub use batch::workload;
pub use batch::{Batch, BatchOptions, Blowup, BodyReading, Quantity, Replay, Snapshot};
pub use lanes::{Isa, Real};
pub use model::Model;
pub use readings::Readings;
pub use sim::{Sim, SimError, SimOptions};
pub use state::{AgentState, Group, SolverStats, Variation, Work};
#[doc(hidden)]
pub use step::Stage;
