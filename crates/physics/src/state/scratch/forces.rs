//! Forces on joints and links that do not come from constraints.

use super::Drives;
use crate::algebra::spatial::{V3, V6, cross_add};
use crate::lanes::Real;
use crate::sim::Sim;

/// Forces on joints and links that do not come from constraints.
#[derive(Clone, Debug)]
pub(crate) struct Forces<T: Real> {
    /// Springs and dampers of joints and tendons.
    pub qfrc_passive: Vec<T>,
    /// `qfrc_passive + qfrc_actuator` in one sum: each actuator adds to what is there, in the model's order.
    pub qfrc_passive_actuator: Vec<T>,
    /// Negative derivative of these forces with respect to the velocities, on its diagonal (MuJoCo's `qDeriv`): the
    /// part that `implicitfast` takes at the end of the step.
    pub minus_qderiv: Vec<T>,
    /// Rate of change of the activations.
    pub act_dot: Vec<T>,
    pub tendon_length: Vec<T>,
    pub tendon_velocity: Vec<T>,
    /// Moment arms of the strings at the last evaluation of the forces, one string after the other.
    pub tendon_moments: Vec<T>,
    /// Negative derivative of each tendon's force with respect to its velocity, with `implicitfast`.
    pub minus_tendon_deriv: Vec<T>,
    /// Measures of the drives at the last evaluation of the forces.
    pub drives: Drives<T>,
    /// The same derivative of each drive's force.
    pub minus_drive_deriv: Vec<T>,
    /// Factors of the actuator forces on each tendon and of their derivatives: not 1 if the sum is out of bounds.
    pub tendon_share: Vec<[T; 2]>,
    /// External torque and force on every link: gravity compensation, fluid, and pushes (`xfrc_applied`). Empty for
    /// none.
    pub link_applied: Vec<V6<T>>,
    /// Gravity compensation of the degrees of freedom, as passive and as actuator forces. Empty if the latter are.
    pub gravcomp: [Vec<T>; 2],
    /// Force of each actuator.
    pub actuator_force: Vec<T>,
}

impl<T: Real> Forces<T> {
    pub fn new(sim: &Sim<T>) -> Self {
        let z = T::zero();
        let (nl, nv) = (sim.links.len(), sim.model.nv);
        Forces {
            qfrc_passive: vec![z; nv],
            qfrc_passive_actuator: vec![z; nv],
            minus_qderiv: vec![z; nv],
            act_dot: vec![z; sim.model.na],
            tendon_length: vec![z; sim.tendons.len()],
            tendon_velocity: vec![z; sim.tendons.len()],
            tendon_moments: vec![z; sim.tendons.iter().map(|t| t.dofs.len()).sum()],
            minus_tendon_deriv: vec![z; sim.tendons.len()],
            drives: Drives::new(sim),
            minus_drive_deriv: vec![z; sim.drives.len()],
            tendon_share: vec![[T::lit(1.0); 2]; sim.tendons.len()],
            link_applied: Vec::with_capacity(nl),
            gravcomp: [vec![z; sim.actuated_gravcomp.len()], vec![z; sim.actuated_gravcomp.len()]],
            actuator_force: vec![z; sim.model.nu],
        }
    }

    /// Adds a force at a point of a link, and a torque, to [`link_applied`](Forces::link_applied).
    #[inline(always)]
    pub fn push(&mut self, link: usize, r: &V3<T>, force: &V3<T>, torque: &V3<T>) {
        let t = cross_add(r, force, torque);
        for i in 0..3 {
            self.link_applied[link][i] += t[i];
            self.link_applied[link][3 + i] += force[i];
        }
    }
}
