//! Sensors.

use serde::{Deserialize, Serialize};

/// Quantity that a sensor measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SensorType {
    /// Sum of contact normal forces (N) inside a site's volume; on a geom's whole body when the object is a geom.
    Touch,
    /// Acceleration minus gravity in a site's own axes, 3.
    Accelerometer,
    /// Linear velocity in a site's own axes, 3.
    Velocimeter,
    /// Angular velocity in a site's own axes, 3.
    Gyro,
    /// Force between a site's body and its parent, in the site's axes, 3.
    Force,
    /// Torque between a site's body and its parent about the site, in the site's axes, 3.
    Torque,
    /// Magnetic flux in a site's own axes, 3.
    Magnetometer,
    /// Distance along a site's z axis to the nearest geom; -1 for none.
    RangeFinder,
    /// Position of a scalar joint.
    JointPos,
    /// Velocity of a scalar joint.
    JointVel,
    /// Length of a tendon.
    TendonPos,
    /// Velocity of a tendon.
    TendonVel,
    /// Length of an actuator's transmission, times the gear.
    ActuatorPos,
    /// Velocity of an actuator's transmission, times the gear.
    ActuatorVel,
    /// Force of an actuator.
    ActuatorFrc,
    /// Total actuator force on a scalar joint.
    JointActuatorFrc,
    /// Total actuator force on a tendon.
    TendonActuatorFrc,
    /// Orientation of a ball joint, quaternion, 4.
    BallQuat,
    /// Angular velocity of a ball joint, 3.
    BallAngVel,
    /// Distance from the limit of a joint, margin subtracted.
    JointLimitPos,
    /// Velocity towards the limit of a joint.
    JointLimitVel,
    /// Force of the limit of a joint.
    JointLimitFrc,
    /// Distance from the limit of a tendon, margin subtracted.
    TendonLimitPos,
    /// Velocity towards the limit of a tendon.
    TendonLimitVel,
    /// Force of the limit of a tendon.
    TendonLimitFrc,
    /// Position of a frame, 3. Like all frame sensors, in the axes of the reference frame if there is one.
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
    /// Center of mass of a body's subtree, 3.
    SubtreeCom,
    /// Linear velocity of a subtree's center of mass, 3.
    SubtreeLinVel,
    /// Angular momentum of a subtree about its center of mass, 3.
    SubtreeAngMom,
    /// 1 if a frame (`object`) is inside a site (`reference`), else 0.
    InsideSite,
    /// Smallest distance between the geoms of `object` and of `reference`, at most `cutoff`.
    Distance,
    /// Unit vector along that distance, 3.
    Normal,
    /// The two closest points, 6.
    FromTo,
    /// Contacts between `object` and `reference`, see [`Sensor::intprm`].
    Contact,
    /// Potential energy.
    PotentialEnergy,
    /// Kinetic energy.
    KineticEnergy,
    /// Simulation time, s.
    Clock,
    /// A sensor that is kept by name but cannot be evaluated. Reading it is an error.
    Unsupported,
}

/// The object of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SensorObject {
    /// Body frame at its inertial frame (`objtype="body"`), by index.
    Body(usize),
    /// Body frame proper (`objtype="xbody"`), by index; for a contact sensor the body with its subtree.
    XBody(usize),
    /// Geom, by index.
    Geom(usize),
    /// Site, by index.
    Site(usize),
    /// Camera, by index.
    Camera(usize),
    /// Joint, by index.
    Joint(usize),
    /// Tendon, by index.
    Tendon(usize),
    /// Actuator, by index.
    Actuator(usize),
    /// Nothing.
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
    /// Object that it is attached to.
    pub object: SensorObject,
    /// Reference frame (`reftype`, `refname`), or the second of two objects.
    pub reference: SensorObject,
    /// MuJoCo's `sensor_intprm`. Contact: bit mask of the fields (found 1, force 2, torque 4, dist 8, pos 16, normal 32,
    /// tangent 64), reduction (0 none, 1 mindist, 2 maxforce, 3 netforce), number of contacts. Range finder: bit mask.
    pub intprm: [i32; 3],
    /// First value in the sensor vector.
    pub adr: usize,
    /// Number of values.
    pub dim: usize,
    /// Values are clamped to `+-cutoff` (or `[0, cutoff]` for touch) when positive.
    pub cutoff: f64,
}
