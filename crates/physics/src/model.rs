//! The compiled model: everything that stays constant while a simulation runs.
//!
//! It is the counterpart of MuJoCo's `mjModel` and uses its names and conventions: SI units, radians, quaternions as
//! `[w, x, y, z]`, body 0 is the world, positions and orientations of a body, geom or site are relative to its parent
//! body's frame. Numbers are `f64`; the lane kernels convert them once to their own precision.

use serde::{Deserialize, Serialize};

/// A point or direction in metres (or unit free), `[x, y, z]`.
pub type Vec3 = [f64; 3];
/// A unit quaternion `[w, x, y, z]`.
pub type Quat = [f64; 4];

/// A compiled model. Made by [`Model::from_xml_file`](crate::mjcf) and friends, then never changed.
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
    /// Reference configuration, length `nq`.
    pub qpos0: Vec<f64>,
    /// Configuration in which the joint springs are at rest, length `nq`.
    pub qpos_spring: Vec<f64>,
    /// Statistics of the model in its reference configuration.
    pub stat: Statistics,
}

/// `<option>` after defaults are applied.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Options {
    /// Simulation step in seconds.
    pub timestep: f64,
    /// Gravity in m/s^2, world frame.
    pub gravity: Vec3,
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
    /// `<flag>` switches that this engine honours.
    pub flags: Flags,
}

/// Parts of the pipeline that `<option><flag .../>` may switch off. `true` means enabled, the default.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Flags {
    /// All constraints.
    pub constraint: bool,
    /// Joint limits.
    pub limit: bool,
    /// Contacts.
    pub contact: bool,
    /// Dry friction in joints.
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
    /// `solref` time constants are kept at or above twice the timestep.
    pub refsafe: bool,
    /// Implicit treatment of joint damping in the Euler integrator.
    pub eulerdamp: bool,
    /// Parents and children are excluded from colliding with each other.
    pub filterparent: bool,
}

/// How the state is advanced in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Integrator {
    /// Semi-implicit Euler, joint damping implicit.
    Euler,
    /// Fourth-order Runge-Kutta.
    Rk4,
    /// `implicit`; parsed and refused by the simulator for now.
    Implicit,
    /// `implicitfast`; parsed and refused by the simulator for now.
    ImplicitFast,
}

/// Shape of the friction cone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Cone {
    /// Four edges for `condim` 3.
    Pyramidal,
    /// Exact cone; parsed and refused by the simulator for now.
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
    /// Centre of mass in the body's frame.
    pub ipos: Vec3,
    /// Orientation of the principal axes of inertia in the body's frame.
    pub iquat: Quat,
    /// Mass in kg.
    pub mass: f64,
    /// Principal moments of inertia about the centre of mass, kg m^2, in the frame of `iquat`.
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
    /// Body whose motion this one follows rigidly: itself if it has joints, else its parent's `weld_id`.
    pub weld_id: usize,
    /// Index of the first body of this body's kinematic tree (the child of the world), 0 for the world.
    pub root_id: usize,
    /// Mean inverse inertia at the reference configuration: `[translational 1/kg, rotational 1/(kg m^2)]`.
    pub invweight0: [f64; 2],
    /// Gravity compensation factor; must be 0 for now.
    pub gravcomp: f64,
    /// `mocap="true"`: a static body that the user may move.
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
    /// `solreflimit`.
    pub solref_limit: SolRef,
    /// `solimplimit`.
    pub solimp_limit: SolImp,
    /// Limits of the total actuator force on this joint (`actuatorfrcrange`), if any.
    pub actuator_force_range: Option<[f64; 2]>,
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
    /// Rotor inertia added to the diagonal of the mass matrix.
    pub armature: f64,
    /// Viscous damping, N s/m or N m s/rad.
    pub damping: f64,
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

/// Shape of a geom or site.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum GeomType {
    /// Infinite plane, normal along its z axis.
    Plane,
    /// Height field; refused by the simulator for now.
    Hfield,
    /// `size[0]` radius.
    Sphere,
    /// `size[0]` radius, `size[1]` half length of the straight part, along z.
    Capsule,
    /// `size` semi-axes.
    Ellipsoid,
    /// `size[0]` radius, `size[1]` half length, along z.
    Cylinder,
    /// `size` half lengths.
    Box,
    /// Triangle mesh; refused by the loader.
    Mesh,
}

/// A geometric shape attached to a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Geom {
    /// Name; empty when the file gives none.
    pub name: String,
    /// Shape.
    pub kind: GeomType,
    /// Body it is attached to.
    pub body: usize,
    /// Position in the body's frame.
    pub pos: Vec3,
    /// Orientation in the body's frame.
    pub quat: Quat,
    /// Size, see [`GeomType`].
    pub size: Vec3,
    /// Bit mask: what this geom is.
    pub contype: u32,
    /// Bit mask: what this geom collides with.
    pub conaffinity: u32,
    /// Dimension of the contact space: 1, 3, 4 or 6.
    pub condim: usize,
    /// Priority in the combination of contact parameters.
    pub priority: i32,
    /// Sliding, torsional, rolling friction.
    pub friction: Vec3,
    /// Weight in the mix of solver parameters.
    pub solmix: f64,
    /// Solver reference.
    pub solref: SolRef,
    /// Solver impedance.
    pub solimp: SolImp,
    /// Distance below which contacts are made.
    pub margin: f64,
    /// Contacts are reported up to margin + gap; beyond the margin they exert no force.
    pub gap: f64,
    /// Colour, each in 0..=1.
    pub rgba: [f32; 4],
    /// Material name, if any; for viewers.
    pub material: Option<String>,
    /// User group, for viewers.
    pub group: i32,
}

/// A point of interest fixed to a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Site {
    /// Name; empty when the file gives none.
    pub name: String,
    /// Shape, used by touch sensors and viewers.
    pub kind: GeomType,
    /// Body it is attached to.
    pub body: usize,
    /// Position in the body's frame.
    pub pos: Vec3,
    /// Orientation in the body's frame.
    pub quat: Quat,
    /// Size, see [`GeomType`].
    pub size: Vec3,
    /// Colour.
    pub rgba: [f32; 4],
    /// User group, for viewers.
    pub group: i32,
}

/// How a camera or light moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum TrackMode {
    /// Fixed in the body's frame.
    Fixed,
    /// Keeps its offset from the body in world axes.
    Track,
    /// Keeps its offset from the subtree's centre of mass in world axes.
    TrackCom,
    /// Looks at a target body.
    TargetBody,
    /// Looks at a target's centre of mass.
    TargetBodyCom,
}

/// A camera; it looks along its negative z axis, x to the right.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Name; empty when the file gives none.
    pub name: String,
    /// Body it is attached to.
    pub body: usize,
    /// Position in the body's frame.
    pub pos: Vec3,
    /// Orientation in the body's frame.
    pub quat: Quat,
    /// How it moves.
    pub mode: TrackMode,
    /// Vertical field of view in degrees.
    pub fovy: f64,
}

/// A light; kept for viewers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// Name; empty when the file gives none.
    pub name: String,
    /// Body it is attached to.
    pub body: usize,
    /// Position in the body's frame.
    pub pos: Vec3,
    /// Direction in the body's frame.
    pub dir: Vec3,
    /// How it moves.
    pub mode: TrackMode,
    /// Parallel rays.
    pub directional: bool,
    /// Diffuse colour.
    pub diffuse: [f32; 3],
}

/// An actuator acting on a joint: `force = gain * ctrl + bias`, torque = gear * force.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Actuator {
    /// Name; empty when the file gives none.
    pub name: String,
    /// Joint it acts on.
    pub joint: usize,
    /// Transmission ratio per degree of freedom of the joint.
    pub gear: [f64; 6],
    /// Whether `ctrl` is clamped to `ctrl_range`.
    pub ctrl_limited: bool,
    /// Range of the control signal.
    pub ctrl_range: [f64; 2],
    /// Whether the force is clamped to `force_range`.
    pub force_limited: bool,
    /// Range of the scalar force.
    pub force_range: [f64; 2],
    /// Gain: `gain[0] + gain[1] * length + gain[2] * velocity` (fixed gain: the last two are 0).
    pub gain: [f64; 3],
    /// Bias: `bias[0] + bias[1] * length + bias[2] * velocity`; all 0 for a motor.
    pub bias: [f64; 3],
}

/// What a sensor measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SensorType {
    /// Sum of contact normal forces (N) inside a site's volume; on a geom's whole body when the object is a geom.
    Touch,
    /// Position of a frame, 3.
    FramePos,
    /// Orientation of a frame, quaternion, 4.
    FrameQuat,
    /// X axis of a frame, 3.
    FrameXAxis,
    /// Y axis of a frame, 3.
    FrameYAxis,
    /// Z axis of a frame, 3.
    FrameZAxis,
    /// Linear velocity of a frame, world axes, 3.
    FrameLinVel,
    /// Angular velocity of a frame, world axes, 3.
    FrameAngVel,
    /// Linear acceleration of a frame, world axes, 3.
    FrameLinAcc,
    /// Angular acceleration of a frame, world axes, 3.
    FrameAngAcc,
    /// Centre of mass of a body's subtree, 3.
    SubtreeCom,
    /// Linear velocity of a subtree's centre of mass, 3.
    SubtreeLinVel,
    /// Linear velocity in a site's own axes, 3.
    Velocimeter,
    /// Angular velocity in a site's own axes, 3.
    Gyro,
    /// Acceleration minus gravity in a site's own axes, 3.
    Accelerometer,
    /// Position of a scalar joint.
    JointPos,
    /// Velocity of a scalar joint.
    JointVel,
    /// Force of an actuator.
    ActuatorFrc,
    /// A sensor that is kept by name but cannot be evaluated yet; reading it is an error.
    Unsupported,
}

/// The object a sensor is attached to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SensorObject {
    /// Body frame at its inertial frame (`objtype="body"`), by index.
    Body(usize),
    /// Body frame proper (`objtype="xbody"`), by index.
    XBody(usize),
    /// Geom, by index.
    Geom(usize),
    /// Site, by index.
    Site(usize),
    /// Camera, by index.
    Camera(usize),
    /// Joint, by index.
    Joint(usize),
    /// Actuator, by index.
    Actuator(usize),
    /// Nothing (only for [`SensorType::Unsupported`]).
    None,
}

/// A sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sensor {
    /// Name; empty when the file gives none.
    pub name: String,
    /// XML element name, such as `touch`.
    pub element: String,
    /// Quantity.
    pub kind: SensorType,
    /// Object it is attached to.
    pub object: SensorObject,
    /// First value in the sensor vector.
    pub adr: usize,
    /// Number of values.
    pub dim: usize,
    /// Values are clamped to `+-cutoff` (or `[0, cutoff]` for touch) when positive.
    pub cutoff: f64,
}

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
}

/// A declared geom pair and its contact parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pair {
    /// The two geoms.
    pub geoms: [usize; 2],
    /// Contact dimension.
    pub condim: usize,
    /// Two sliding, one torsional, two rolling friction coefficients.
    pub friction: [f64; 5],
    /// Solver reference.
    pub solref: SolRef,
    /// Solver impedance.
    pub solimp: SolImp,
    /// Margin.
    pub margin: f64,
    /// Gap.
    pub gap: f64,
}

/// `<statistic>`: given in the file or computed at the reference configuration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// Mean diagonal of the mass matrix; scales the solver's tolerance.
    pub mean_inertia: f64,
    /// Mean body mass, kg.
    pub mean_mass: f64,
    /// Size of the model, m; for viewers.
    pub extent: f64,
    /// Centre of the model, m; for viewers.
    pub center: Vec3,
}
