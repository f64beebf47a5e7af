//! MuJoCo's physics, one agent per SIMD lane.
//!
//! * [`mjcf`] reads an MJCF file and compiles it to a [`Model`], equal to MuJoCo's.
//! * [`Sim`] holds the model's constants in lane precision, [`Group`] the state of as many agents as a vector has lanes,
//!   [`Work`] the scratch memory of a step. [`Sim::step`] advances a group.
//! * [`lanes`] has the number type that carries every kernel: `f64`, `f32`, or 4, 8, 16 agents in one vector.

#[path = "dynamics/articulated.rs"]
mod articulated;
mod batch;
mod collision;
#[path = "constraint/equality.rs"]
mod equality;
#[path = "dynamics/external.rs"]
mod fluid;
#[path = "dynamics/actuation.rs"]
mod forces;
#[path = "readings/joint_space.rs"]
mod inverse;
#[path = "dynamics/kinematics.rs"]
mod kinematics;
pub mod lanes;
pub mod mjcf;
pub mod model;
#[path = "geometry/mod.rs"]
mod narrow;
mod readings;
#[path = "sim/weld.rs"]
mod rigid;
mod sim;
mod solver;
#[path = "algebra/planar.rs"]
mod space;
#[path = "algebra/spatial.rs"]
pub mod spatial;
mod step;
#[path = "sim/unsupported.rs"]
mod support;
#[path = "constraint/tendon.rs"]
mod tendon;
#[path = "state/variation.rs"]
mod variation;
#[path = "state/scratch.rs"]
mod work;
#[path = "batch/workload.rs"]
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
