//! Quantities that can be read of all agents at once, and the contacts that are kept for them.

use crate::lanes::Real;
use crate::model::Model;
use crate::state::Work;

/// A quantity that [`Batch::gather`](super::Batch::gather) can write. World axes and SI units; indices are those of the
/// [`Model`].
///
/// Positions and velocities are those of the current state. Contacts are those of the last
/// [`Batch::step`](super::Batch::step) with the static world. An agent whose state was set since then has none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Configuration, `[nq]`.
    Qpos,
    /// Velocity, `[nv]`.
    Qvel,
    /// Origins of the bodies' frames, m, `[body][3]`.
    BodyPos,
    /// Directions of the bodies' x, y and z axes, `[body][axis][3]`.
    BodyAxes,
    /// Velocities of the origins of the bodies' frames, m/s, `[body][3]`.
    BodyVelocity,
    /// Angular velocities of the bodies, rad/s, `[body][3]`.
    BodyAngularVelocity,
    /// Centers of the geoms, m, `[geom][3]`.
    GeomPos,
    /// Velocities of the geoms' centers, m/s, `[geom][3]`.
    GeomVelocity,
    /// 1 for a geom that touched the static world at the last physics step, else 0, `[geom]`.
    Touching,
    /// 1 for a geom that touched the static world at any physics step of the last call, else 0, `[geom]`.
    Touched,
    /// Normal force of a geom's contacts at the last physics step, N, `[geom]`.
    NormalForce,
    /// Sensors as in [`Batch::sensors`](super::Batch::sensors), in the model's order.
    Sensors,
    /// Activations of the actuators that have one, `[na]`.
    Act,
    /// Positions of the mocap bodies, m, `[mocap][3]`.
    MocapPos,
    /// Orientations of the mocap bodies, quaternions, `[mocap][4]`.
    MocapQuat,
    /// Acceleration at the present state and controls, `[nv]`.
    Qacc,
    /// Forces of contacts, limits, dry friction and equalities on the joints, N or N m, `[nv]`.
    QfrcConstraint,
    /// Forces of the actuators, N or N m, `[nu]`.
    ActuatorForce,
}

impl Quantity {
    /// Numbers per agent.
    pub fn width(self, model: &Model) -> usize {
        match self {
            Quantity::Qpos => model.nq,
            Quantity::Qvel => model.nv,
            Quantity::BodyPos | Quantity::BodyVelocity | Quantity::BodyAngularVelocity => 3 * model.bodies.len(),
            Quantity::BodyAxes => 9 * model.bodies.len(),
            Quantity::GeomPos | Quantity::GeomVelocity => 3 * model.geoms.len(),
            Quantity::Touching | Quantity::Touched | Quantity::NormalForce => model.geoms.len(),
            Quantity::Sensors => model.sensors.iter().map(|s| s.dim).sum(),
            Quantity::Act => model.na,
            Quantity::MocapPos => 3 * model.mocap_bodies().count(),
            Quantity::MocapQuat => 4 * model.mocap_bodies().count(),
            Quantity::Qacc | Quantity::QfrcConstraint => model.nv,
            Quantity::ActuatorForce => model.nu,
        }
    }

    /// Whether it needs the dynamics of the current state and controls.
    pub(super) fn is_dynamic(self) -> bool {
        matches!(self, Quantity::Sensors | Quantity::Qacc | Quantity::QfrcConstraint | Quantity::ActuatorForce)
    }

    /// Whether it needs the frames of the current state.
    pub(super) fn is_frame(self) -> bool {
        use Quantity as Q;
        matches!(
            self,
            Q::BodyPos | Q::BodyAxes | Q::BodyVelocity | Q::BodyAngularVelocity | Q::GeomPos | Q::GeomVelocity
        )
    }
}

/// Contacts of a group in the last call of [`Batch::step`](super::Batch::step), by geom.
#[derive(Clone, Debug)]
pub(super) struct Felt<T: Real> {
    pub(super) touching: Vec<T::Mask>,
    pub(super) touched: Vec<T::Mask>,
    pub(super) normal_force: Vec<T>,
}

impl<T: Real> Felt<T> {
    pub(super) fn new(model: &Model) -> Self {
        let n = model.geoms.len();
        Felt { touching: vec![T::none(); n], touched: vec![T::none(); n], normal_force: vec![T::zero(); n] }
    }

    /// Keeps the contacts of the group that was stepped last with `work`.
    pub(super) fn keep(&mut self, work: &Work<T>) {
        self.touching.copy_from_slice(&work.contacts.touching);
        self.touched.copy_from_slice(&work.contacts.touched);
        self.normal_force.copy_from_slice(&work.contacts.normal_force);
    }

    /// Clears the contacts of an agent whose state was set.
    pub(super) fn forget(&mut self, lane: usize) {
        let others = T::from_bits(!(1 << lane) & ((1 << T::LANES) - 1));
        for mask in self.touching.iter_mut().chain(&mut self.touched) {
            *mask = T::and(*mask, others);
        }
        for force in &mut self.normal_force {
            force.set(lane, T::scalar(0.0));
        }
    }
}
