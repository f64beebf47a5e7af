//! MuJoCo's physics, one agent per SIMD lane.
//!
//! * [`mjcf`] reads an MJCF file and compiles it to a [`Model`], equal to MuJoCo's.
//! * [`spec`] edits a model before it is compiled: MuJoCo's `mjSpec`.
//! * [`Sim`] holds the model's constants in lane precision, [`Group`] the state of as many agents as a vector has lanes,
//!   [`Work`] the scratch memory of a step. [`Sim::step`] advances a group.
//! * [`lanes`] has the number type that carries every kernel: `f64`, `f32`, or 4, 8, 16 agents in one vector.
//!
//! * [`hint`] suggests a known name for an unknown one in an error.
//! * [`threads()`] chooses a number of threads.
//! * [`budget`] limits the memory and time that a file or a message can use.
//!
//! Each folder imports only from folders above it in this list:
//!
//! | folder | contents |
//! |---|---|
//! | `lanes` | numbers: one agent, or several side by side in a vector register |
//! | `algebra` | vectors, rotations, spatial vectors and inertias |
//! | `model` | the compiled model, MuJoCo's `mjModel` |
//! | `geometry` | contacts of two shapes |
//! | `mesh` | mesh files, their mass and their convex hulls |
//! | `mjcf` | from an MJCF file to a model |
//! | `sim` | the constants of a model as the kernels see them, in lane precision |
//! | `rows` | constraint rows: their values, costs and forces |
//! | `multifrontal` | a sparse factorization for one agent with many contacts between its links |
//! | `state` | the state of agents, and the scratch memory of a step |
//! | `dynamics` | kinematics, passive and applied forces, the articulated-body recursion |
//! | `collision` | contacts, and their rows |
//! | `constraint` | rows of limits, friction, equality constraints and tendons |
//! | `solver` | Newton's method over all rows |
//! | `step` | the stages of a step, and the integrators |
//! | `readings` | quantities that can be read from a group after a step |
//! | `batch` | any number of agents on any number of threads |

pub mod hint;

mod threads;
pub use threads::{process_id, threads};

pub mod budget;

pub mod lanes;

mod algebra;
pub mod model;

mod geometry;
mod mesh;
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
pub use mjcf::spec;
pub use model::Model;
pub use readings::{ContactReading, MeasurePlan, Readings};
pub use sim::{Sim, SimError, SimOptions};
pub use state::{AgentState, Group, Obstacle, ObstacleShape, SolverStats, Variation, Work};
#[doc(hidden)]
pub use step::Stage;
