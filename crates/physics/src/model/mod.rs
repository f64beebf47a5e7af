//! The compiled model: everything that stays constant while a simulation runs.
//!
//! It corresponds to MuJoCo's `mjModel` and uses its names and conventions: SI units, radians, quaternions as `[w, x,
//! y, z]`, and body 0 as the world. Positions and orientations of a body, geom or site are relative to its parent
//! body's frame. Numbers are `f64`; the lane kernels convert them once to their own precision.

use serde::{Deserialize, Serialize};

mod actuator;
mod coupling;
mod hull;
pub(crate) mod same_frame;
mod sensor;
mod shape;
pub(crate) mod vector;
mod view;

pub use actuator::{Actuator, Dynamics, Muscle, Transmission};
pub use coupling::{Equality, EqualityKind, PathPart, PathSpan, Tendon, TendonKind};
pub use hull::Hull;
pub use sensor::{Sensor, SensorObject, SensorType};
pub use shape::{EllipsoidFluid, Geom, GeomType, HField, Mesh, Pair, Site};
pub use view::{Camera, Light, TrackMode};

/// A point or direction in meters (or unit free), `[x, y, z]`.
pub type Vec3 = [f64; 3];
/// A unit quaternion `[w, x, y, z]`.
pub type Quat = [f64; 4];

/// A compiled model. [`Model::from_xml_file`] and related functions create it; it never changes afterward.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// Name from `<mujoco model="...">`.
    pub name: String,
    /// Physics options (`<option>`).
    pub opt: Options,
    /// Length of `qpos`: 7 per free joint, 4 per ball joint, 1 per hinge or slide.
    pub nq: usize,
    /// Length of `qvel`: 6 per free joint, 3 per ball joint, 1 per hinge or slide.
    pub nv: usize,
    /// Number of actuators, the length of `ctrl`.
    pub nu: usize,
    /// Number of activation states, the length of `act`.
    pub na: usize,
    /// Bodies in depth-first order; a parent always precedes its children. `[0]` is the world.
    pub bodies: Vec<Body>,
    /// Joints, grouped by body, in the order of their addresses in `qpos`.
    pub joints: Vec<Joint>,
    /// Degrees of freedom, one per entry of `qvel`.
    pub dofs: Vec<Dof>,
    /// Geoms, grouped by body.
    pub geoms: Vec<Geom>,
    /// Sites, grouped by body.
    pub sites: Vec<Site>,
    /// Cameras; kept for viewers.
    pub cameras: Vec<Camera>,
    /// Lights; kept for viewers.
    pub lights: Vec<Light>,
    /// Height fields (`<asset><hfield>`).
    pub hfields: Vec<HField>,
    /// Meshes of the geoms, to draw them.
    pub meshes: Vec<Mesh>,
    /// Convex hulls of the meshes that collide.
    pub hulls: Vec<Hull>,
    /// Tendons.
    pub tendons: Vec<Tendon>,
    /// Equality constraints.
    pub equalities: Vec<Equality>,
    /// Actuators in the order of `ctrl`.
    pub actuators: Vec<Actuator>,
    /// Sensors in the order of their values.
    pub sensors: Vec<Sensor>,
    /// Keyframes.
    pub keyframes: Vec<Keyframe>,
    /// Geom pairs declared by `<contact><pair>`, with fully resolved parameters.
    pub pairs: Vec<Pair>,
    /// Body pairs (indices, lower first) that never collide: `<contact><exclude>`.
    pub excludes: Vec<[usize; 2]>,
    /// Custom numbers (`<custom><numeric>`), by name, in document order.
    pub numerics: Vec<(String, Vec<f64>)>,
    /// The geom of the world that stands for an agent's [obstacles](crate::Obstacle), if agents touch them.
    pub obstacles: Option<usize>,
    /// Reference configuration, length `nq`.
    pub qpos0: Vec<f64>,
    /// Configuration in which the joint springs are at rest, length `nq`.
    pub qpos_spring: Vec<f64>,
    /// Statistics of the model in its reference configuration.
    pub stat: Statistics,
}

impl Model {
    /// Indices of the mocap bodies: bodies that the user may move.
    pub fn mocap_bodies(&self) -> impl Iterator<Item = usize> + '_ {
        self.bodies.iter().enumerate().filter(|(_, b)| b.mocap).map(|(i, _)| i)
    }
}

/// `<option>` after defaults are applied.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Options {
    /// Simulation step in seconds.
    pub timestep: f64,
    /// Gravity in m/s^2, world frame.
    pub gravity: Vec3,
    /// Density of the medium, kg/m^3; 0: no lift and drag.
    pub density: f64,
    /// Viscosity of the medium, Pa s; 0: no viscous forces.
    pub viscosity: f64,
    /// Velocity of the medium, m/s, world frame.
    pub wind: Vec3,
    /// Magnetic flux, world frame; seen by magnetometers.
    pub magnetic: Vec3,
    /// Integrator.
    pub integrator: Integrator,
    /// Friction cone.
    pub cone: Cone,
    /// Ratio of frictional to normal constraint impedance.
    pub impratio: f64,
    /// Cap on the solver's Newton iterations.
    pub iterations: usize,
    /// Cap on the line search's iterations.
    pub ls_iterations: usize,
    /// Solver tolerance: scaled cost improvement at which a lane counts as converged.
    pub tolerance: f64,
    /// Tolerance of the line search, as a fraction of the solver's.
    pub ls_tolerance: f64,
    /// Sweeps of the second solver for friction (MuJoCo `noslip_iterations`); 0: none.
    pub noslip_iterations: usize,
    /// Scaled cost improvement below which the second solver ends.
    pub noslip_tolerance: f64,
    /// Cap on the iterations that find the contacts of convex shapes.
    pub ccd_iterations: usize,
    /// Error of the depths of those contacts, m.
    pub ccd_tolerance: f64,
    /// Solver set in the file.
    pub solver: Solver,
    /// Parameters that replace those of every contact (`<flag override="enable"/>`), if any.
    pub contact_override: Option<ContactOverride>,
    /// `<flag>` switches that this engine supports.
    pub flags: Flags,
}

/// The constraint solver set in the file. All algorithms find the same minimum, but a low cap that stops them early
/// gives different results.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Solver {
    /// Projected Gauss-Seidel.
    Pgs,
    /// Conjugate gradients.
    Cg,
    /// Newton's method.
    #[default]
    Newton,
}

/// Parameters of all contacts with `<flag override="enable"/>` (MuJoCo `o_margin`, `o_solref`...).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactOverride {
    /// Margin, m.
    pub margin: f64,
    /// Solver reference.
    pub solref: SolRef,
    /// Solver impedance.
    pub solimp: SolImp,
    /// Two sliding, one torsional, two rolling friction coefficients.
    pub friction: [f64; 5],
}

/// Parts of the pipeline that `<option><flag .../>` may disable. `true`, the default, means enabled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Flags {
    /// All constraints.
    pub constraint: bool,
    /// Equality constraints.
    pub equality: bool,
    /// Joint and tendon limits.
    pub limit: bool,
    /// Contacts.
    pub contact: bool,
    /// Dry friction in joints and tendons.
    pub frictionloss: bool,
    /// Joint springs (and dampers before MuJoCo 3.4 merged them under `passive`).
    pub spring: bool,
    /// Joint dampers.
    pub damper: bool,
    /// Gravity.
    pub gravity: bool,
    /// Clamping of controls to `ctrlrange`.
    pub clampctrl: bool,
    /// Warm start of the constraint solver.
    pub warmstart: bool,
    /// Actuator forces.
    pub actuation: bool,
    /// Whether `solref` time constants are kept at or above twice the timestep.
    pub refsafe: bool,
    /// Implicit treatment of joint damping in the Euler integrator.
    pub eulerdamp: bool,
    /// Whether parents and children do not collide with each other.
    pub filterparent: bool,
    /// Whether pairs of convex shapes with flat faces have several contacts.
    pub multiccd: bool,
    /// Whether MuJoCo finds contacts of convex shapes with its own functions instead of the library libccd. The
    /// simulator refuses contacts that need libccd.
    pub nativeccd: bool,
    /// Whether trees that no constraint connects are solved separately.
    pub island: bool,
    /// MuJoCo's middle phase of collision. It only decides the order of contacts, which the second solver for friction
    /// depends on.
    pub midphase: bool,
}

/// Integration method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Integrator {
    /// Semi-implicit Euler, joint damping implicit.
    Euler,
    /// Fourth-order Runge-Kutta.
    Rk4,
    /// Forces that depend on velocities are taken at the end of the step.
    Implicit,
    /// The same without Coriolis and centripetal forces, except for free bodies that stand alone.
    ImplicitFast,
}

/// Shape of the friction cone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Cone {
    /// Four edges for `condim` 3.
    Pyramidal,
    /// Exact cone.
    Elliptic,
}

/// A rigid body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// Name; empty when the file gives none.
    pub name: String,
    /// Index of the parent body (0 for the world itself).
    pub parent: usize,
    /// Position in the parent's frame.
    pub pos: Vec3,
    /// Orientation in the parent's frame.
    pub quat: Quat,
    /// Center of mass in the body's frame.
    pub ipos: Vec3,
    /// Orientation of the principal axes of inertia in the body's frame.
    pub iquat: Quat,
    /// Mass in kg.
    pub mass: f64,
    /// Principal moments of inertia about the center of mass, kg m^2, in the frame of `iquat`.
    pub inertia: Vec3,
    /// Mass of the subtree rooted here, kg.
    pub subtree_mass: f64,
    /// First joint of this body in [`Model::joints`] and their number.
    pub joint_start: usize,
    /// Number of joints.
    pub joint_count: usize,
    /// First degree of freedom and their number.
    pub dof_start: usize,
    /// Number of degrees of freedom.
    pub dof_count: usize,
    /// First geom and their number.
    pub geom_start: usize,
    /// Number of geoms.
    pub geom_count: usize,
    /// Body that this one is rigidly attached to: itself if it has joints, else its parent's `weld_id`.
    pub weld_id: usize,
    /// Index of the first body of this body's kinematic tree (the child of the world), 0 for the world.
    pub root_id: usize,
    /// Mean inverse inertia at the reference configuration: `[translational 1/kg, rotational 1/(kg m^2)]`.
    pub invweight0: [f64; 2],
    /// Fraction of the body's weight that gravity compensation carries (1: weightless).
    pub gravcomp: f64,
    /// Whether it is a mocap body: a static body that the user may move.
    pub mocap: bool,
}

/// Type of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum JointType {
    /// 7 coordinates (position, quaternion), 6 velocities (linear in world axes, angular in body axes).
    Free,
    /// 4 coordinates (quaternion), 3 velocities (angular, body axes).
    Ball,
    /// Translation along `axis`.
    Slide,
    /// Rotation about `axis`.
    Hinge,
}

impl JointType {
    /// Number of degrees of freedom: entries of `qvel`.
    pub fn dofs(self) -> usize {
        match self {
            JointType::Free => 6,
            JointType::Ball => 3,
            JointType::Slide | JointType::Hinge => 1,
        }
    }
}

/// A joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// Name; empty when the file gives none.
    pub name: String,
    /// Type.
    pub kind: JointType,
    /// Body that it moves.
    pub body: usize,
    /// Anchor in the body's frame.
    pub pos: Vec3,
    /// Unit axis in the body's frame (hinge, slide).
    pub axis: Vec3,
    /// First coordinate in `qpos`.
    pub qpos_adr: usize,
    /// First velocity in `qvel`.
    pub dof_adr: usize,
    /// Whether `range` is enforced.
    pub limited: bool,
    /// Limits, rad or m; for a ball joint `[0, largest angle]`.
    pub range: [f64; 2],
    /// Distance from the limit at which the constraint becomes active.
    pub margin: f64,
    /// Spring stiffness, N/m or N m/rad.
    pub stiffness: f64,
    /// Higher orders of the stiffness (MuJoCo `jnt_stiffnesspoly`): at the displacement `x` from rest the spring's
    /// stiffness is `stiffness + poly[0] x + poly[1] x^2`.
    pub stiffness_poly: [f64; 2],
    /// `solreflimit`.
    pub solref_limit: SolRef,
    /// `solimplimit`.
    pub solimp_limit: SolImp,
    /// Limits of the total actuator force on this joint (`actuatorfrcrange`), if any.
    pub actuator_force_range: Option<[f64; 2]>,
    /// Whether gravity compensation of this joint counts as an actuator force (`actuatorgravcomp`).
    pub actuator_gravcomp: bool,
    /// User group, for viewers.
    pub group: i32,
}

/// One degree of freedom.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Dof {
    /// Body that it moves.
    pub body: usize,
    /// Joint that it belongs to.
    pub joint: usize,
    /// Next degree of freedom towards the root, if any.
    pub parent: Option<usize>,
    /// Rotor inertia added to the diagonal of the mass matrix, including that of actuators (times gear squared).
    pub armature: f64,
    /// Viscous damping, N s/m or N m s/rad, including that of actuators (times gear squared).
    pub damping: f64,
    /// Higher orders of the damping (MuJoCo `dof_dampingpoly`): at the velocity `v` the damping is
    /// `damping + poly[0] |v| + poly[1] v^2`.
    pub damping_poly: [f64; 2],
    /// Whether an actuator adds armature or damping. Euler's method then takes the damping at the end of the step, even if it
    /// is zero. That matters if a low cap ends the solver before the forces match the accelerations.
    pub geared: bool,
    /// Dry friction, N or N m.
    pub frictionloss: f64,
    /// `solreffriction` for the dry friction.
    pub solref_friction: SolRef,
    /// `solimpfriction` for the dry friction.
    pub solimp_friction: SolImp,
    /// Mean diagonal of the inverse mass matrix at the reference configuration.
    pub invweight0: f64,
}

/// `solref`: time constant and damping ratio, or, if both are negative, stiffness and damping.
pub type SolRef = [f64; 2];
/// `solimp`: dmin, dmax, width, midpoint, power.
pub type SolImp = [f64; 5];

/// A stored state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Keyframe {
    /// Name; empty when the file gives none.
    pub name: String,
    /// Time, s.
    pub time: f64,
    /// Configuration, length `nq`.
    pub qpos: Vec<f64>,
    /// Velocity, length `nv`.
    pub qvel: Vec<f64>,
    /// Controls, length `nu`.
    pub ctrl: Vec<f64>,
    /// Activations, length `na`.
    pub act: Vec<f64>,
    /// Positions of the mocap bodies, in the order of the bodies.
    pub mpos: Vec<Vec3>,
    /// Orientations of the mocap bodies.
    pub mquat: Vec<Quat>,
}

/// `<statistic>`: from the file, or computed at the reference configuration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// Mean diagonal of the mass matrix; scales the solver's tolerance.
    pub mean_inertia: f64,
    /// Mean body mass, kg.
    pub mean_mass: f64,
    /// Size of the model, m; for viewers.
    pub extent: f64,
    /// Center of the model, m; for viewers.
    pub center: Vec3,
}
