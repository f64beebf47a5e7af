//! MuJoCo's physics, one agent per SIMD lane.
//!
//! * [`mjcf`] reads an MJCF file and compiles it to a [`Model`], equal to MuJoCo's.
//! * [`Sim`] holds the model's constants in lane precision, [`Group`] the state of as many agents as a vector has lanes,
//!   [`Work`] the scratch memory of a step. [`Sim::step`] advances a group.
//! * [`lanes`] has the number type that carries every kernel: `f64`, `f32`, or 4, 8, 16 agents in one vector.

mod articulated;
mod batch;
mod collision;
mod equality;
mod fluid;
mod forces;
mod inverse;
mod kinematics;
pub mod lanes;
pub mod mjcf;
pub mod model;
mod narrow;
mod readings;
mod rigid;
mod sim;
mod solver;
mod space;
pub mod spatial;
mod step;
mod support;
mod tendon;
mod variation;
mod work;
pub mod workload;

pub use batch::{AgentState, Batch, BatchOptions, Blowup, BodyReading, Quantity, Replay, Snapshot};
pub use lanes::{Isa, Real};
pub use model::Model;
pub use readings::{Readings, rot_to_quat};
pub use sim::{Sim, SimError, SimOptions};
#[doc(hidden)]
pub use step::Stage;
pub use variation::Variation;
pub use work::{Group, SolverStats, Work};
