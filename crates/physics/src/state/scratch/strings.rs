//! Measures of the strings, and memory of the integrator that takes their damping at the end of the step.

use crate::algebra::spatial::Inertia;
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
}

impl<T: Real> Strings<T> {
    pub fn new(sim: &Sim<T>) -> Self {
        let z = T::zero();
        Strings {
            length: vec![z; sim.tendons.len()],
            velocity: vec![z; sim.tendons.len()],
            moments: vec![z; sim.tendons.iter().map(|t| t.dofs.len()).sum()],
        }
    }
}

/// Memory of `implicitfast` for models in which tendons or drives have a share in its matrix. Empty for other models.
#[derive(Clone, Debug)]
pub(crate) struct DampedTendons<T: Real> {
    /// Inertia of each link with everything that it carries.
    pub composite: Vec<Inertia<T>>,
    /// The mass matrix, and the negative derivative of the forces by the velocities.
    pub mass: Vec<T>,
    pub damping: Vec<T>,
    /// Factors of the mass matrix with the damping over a step.
    pub factor: Vec<T>,
    /// Moment arms of one tendon by degree of freedom.
    pub arms: Vec<T>,
    /// Right-hand side, then the change of the accelerations.
    pub change: Vec<T>,
}

impl<T: Real> DampedTendons<T> {
    pub fn new(sim: &Sim<T>) -> Self {
        let z = T::zero();
        let (len, nv, nl) = match &sim.damped_tendons {
            Some(matrix) => (matrix.len, sim.model.nv, sim.links.len()),
            None => (0, 0, 0),
        };
        DampedTendons {
            composite: vec![[z; 10]; nl],
            mass: vec![z; len],
            damping: vec![z; len],
            factor: vec![z; len],
            arms: vec![z; nv],
            change: vec![z; nv],
        }
    }
}
