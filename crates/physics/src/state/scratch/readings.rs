//! Quantities that a step does not need, measured on request.

use crate::algebra::spatial::{V3, V6};
use crate::lanes::Real;
use crate::sim::Sim;

/// Quantities that a step does not need, measured on request.
#[derive(Clone, Debug)]
pub(crate) struct Measured<T: Real> {
    /// Per body without a moving parent: vector from its center of mass to that of its subtree.
    pub tree_com: Vec<V3<T>>,
    /// Per body: external torque and force, about the center of mass of its tree.
    pub cfrc_ext: Vec<V6<T>>,
    /// Per degree of freedom: forces of actuators and constraints.
    pub qfrc_actuator: Vec<T>,
    pub qfrc_constraint: Vec<T>,
    /// Constraint forces on links, from which [`qfrc_constraint`](Measured::qfrc_constraint) is computed.
    pub link_force: Vec<V6<T>>,
    /// Touch sensor forces on the requested sites, N.
    pub touch_forces: Vec<T>,
}

impl<T: Real> Measured<T> {
    pub fn new(sim: &Sim<T>) -> Self {
        let z = T::zero();
        let nv = sim.model.nv;
        Measured {
            tree_com: vec![[z; 3]; sim.model.bodies.len()],
            cfrc_ext: vec![[z; 6]; sim.model.bodies.len()],
            qfrc_actuator: vec![z; nv],
            qfrc_constraint: vec![z; nv],
            link_force: vec![[z; 6]; sim.links.len()],
            touch_forces: Vec::new(),
        }
    }
}
