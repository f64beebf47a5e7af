//! Memory of the integrators that solve with a matrix of their own.

use crate::algebra::spatial::{Inertia, V6};
use crate::lanes::Real;
use crate::sim::Sim;

/// Memory of the integrators that solve with a [`TreeMatrix`](crate::sim::TreeMatrix). Empty for other models.
#[derive(Clone, Debug)]
pub(crate) struct Implicit<T: Real> {
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
    /// For a matrix that is not symmetric; empty for others.
    pub full: FullMatrix<T>,
}

/// Memory for a matrix that is not symmetric.
#[derive(Clone, Debug)]
pub(crate) struct FullMatrix<T: Real> {
    /// The entries above the diagonal, in the order of those below it: of the damping, and of the factors.
    pub damping: Vec<T>,
    pub factor: Vec<T>,
    /// Derivative of the forces that the links with everything that they carry need, by their velocities.
    pub links: Vec<[[T; 6]; 6]>,
    /// Share of each degree of freedom's velocity in the bias acceleration of the links that it moves, while they all
    /// stand still relative to each other.
    pub bend: Vec<V6<T>>,
    /// Degrees of freedom that carry one of them.
    pub path: Vec<usize>,
}

impl<T: Real> Implicit<T> {
    pub fn new(sim: &Sim<T>) -> Self {
        let z = T::zero();
        let (len, nv, nl) = match &sim.tree_matrix {
            Some(matrix) => (matrix.len, sim.model.nv, sim.links.len()),
            None => (0, 0, 0),
        };
        Implicit {
            composite: vec![[z; 10]; nl],
            mass: vec![z; len],
            damping: vec![z; len],
            factor: vec![z; len],
            arms: vec![z; nv],
            change: vec![z; nv],
            full: FullMatrix::new(sim),
        }
    }
}

impl<T: Real> FullMatrix<T> {
    fn new(sim: &Sim<T>) -> Self {
        let z = T::zero();
        let (len, nv, nl) = match &sim.tree_matrix {
            Some(matrix) if matrix.full => (matrix.len, sim.model.nv, sim.links.len()),
            _ => (0, 0, 0),
        };
        FullMatrix {
            damping: vec![z; len],
            factor: vec![z; len],
            links: vec![[[z; 6]; 6]; nl],
            bend: vec![[z; 6]; nv],
            path: Vec::with_capacity(nv),
        }
    }
}
