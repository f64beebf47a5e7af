//! Forces on joints and links that do not come from constraints.

use crate::algebra::spatial::V6;
use crate::lanes::Real;
use crate::sim::Sim;

/// Forces on joints and links that do not come from constraints.
#[derive(Clone, Debug)]
pub(crate) struct Forces<T: Real> {
    /// Applied joint forces: springs, dampers, actuators.
    pub tau: Vec<T>,
    /// Derivative of the damping forces, negative: what `implicitfast` takes at the end of the step.
    pub rate: Vec<T>,
    /// Rate of change of the activations.
    pub act_dot: Vec<T>,
    pub tendon_length: Vec<T>,
    pub tendon_velocity: Vec<T>,
    /// Forces on links from outside; empty: none.
    pub external: Vec<V6<T>>,
    /// They have been taken off `bias_force`.
    pub bias_is_net: bool,
    /// Force of each actuator.
    pub actuator_force: Vec<T>,
}

impl<T: Real> Forces<T> {
    pub fn new(sim: &Sim<T>) -> Self {
        let z = T::zero();
        let (nl, nv) = (sim.links.len(), sim.model.nv);
        Forces {
            tau: vec![z; nv],
            rate: vec![z; nv],
            act_dot: vec![z; sim.model.na],
            tendon_length: vec![z; sim.tendons.len()],
            tendon_velocity: vec![z; sim.tendons.len()],
            external: Vec::with_capacity(nl),
            bias_is_net: false,
            actuator_force: vec![z; sim.model.nu],
        }
    }
}
