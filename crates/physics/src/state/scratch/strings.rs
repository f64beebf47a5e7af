//! Measures of the strings.

use crate::lanes::Real;
use crate::sim::Sim;

/// Measures of the strings for the positions and velocities of the bodies. Empty for models without strings.
#[derive(Clone, Debug)]
pub(crate) struct Strings<T: Real> {
    /// Per tendon; 0 for fixed tendons.
    pub length: Vec<T>,
    pub velocity: Vec<T>,
    /// Moment arms, one string after the other: derivatives of the length by the positions of its degrees of freedom.
    pub moments: Vec<T>,
    /// Acceleration of the length without accelerations of the joints, for tendons with armature.
    pub drift: Vec<T>,
}

impl<T: Real> Strings<T> {
    pub fn new(sim: &Sim<T>) -> Self {
        let z = T::zero();
        Strings {
            length: vec![z; sim.tendons.len()],
            velocity: vec![z; sim.tendons.len()],
            moments: vec![z; sim.tendons.iter().map(|t| t.dofs.len()).sum()],
            drift: vec![z; sim.tendons.len()],
        }
    }
}
