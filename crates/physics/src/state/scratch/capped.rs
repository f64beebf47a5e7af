//! Memory of the solver for models whose iteration cap stops it before it converges.

use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::sim::Sim;

/// Memory of the solver for models whose iteration cap stops it before it converges.
#[derive(Clone, Debug)]
pub(crate) struct Capped<T: Real> {
    /// The unconstrained acceleration, and the links' accelerations for it.
    pub smooth: Vec<T>,
    pub smooth_acc: Vec<V6<T>>,
    /// Accelerations of the links at the current point, and their change from there to the Newton point.
    pub here: Vec<V6<T>>,
    pub way: Vec<V6<T>>,
    /// The direction of the step.
    pub direction: Vec<T>,
    /// Derivative of the cost by the accelerations.
    pub gradient: Vec<T>,
    /// For conjugate gradients: the gradient before the last step, and the preconditioned gradient.
    pub old_gradient: Vec<T>,
    pub old_descent: Vec<T>,
    /// Inertia of each link with all links that it carries.
    pub composite: Vec<Inertia<T>>,
    /// By tree: fraction of the step; derivatives of the cost of moving the masses.
    pub alpha: Vec<T>,
    pub masses: Vec<[T; 2]>,
    /// By tree: sums over its degrees of freedom or rows. An island's first tree has the sums of the island.
    pub sums: Vec<[T; 3]>,
    /// By tree and lane: the first tree of its island.
    pub island: Vec<usize>,
    /// By tree, as bits: lanes where a constraint acts on it, and lanes where it is not finished.
    pub constrained: Vec<u32>,
    pub live: Vec<u32>,
    /// Trees whose islands each block belongs to, with their lanes; the first entry of each block.
    pub homes: Vec<(usize, T::Mask)>,
    pub first_home: Vec<usize>,
    /// By tree and lane, at an island's first tree: 1 / (the sum of its diagonal of the mass matrix), and the last
    /// improvement of the cost.
    pub scale: Vec<f64>,
    pub improvement: Vec<f64>,
}

impl<T: Real> Default for Capped<T> {
    fn default() -> Self {
        Capped {
            smooth: Vec::new(),
            smooth_acc: Vec::new(),
            here: Vec::new(),
            way: Vec::new(),
            direction: Vec::new(),
            gradient: Vec::new(),
            old_gradient: Vec::new(),
            old_descent: Vec::new(),
            composite: Vec::new(),
            alpha: Vec::new(),
            masses: Vec::new(),
            sums: Vec::new(),
            island: Vec::new(),
            constrained: Vec::new(),
            live: Vec::new(),
            homes: Vec::new(),
            first_home: Vec::new(),
            scale: Vec::new(),
            improvement: Vec::new(),
        }
    }
}

impl<T: Real> Capped<T> {
    /// Memory for a model; `None` if its solver is not of this kind.
    pub fn new(sim: &Sim<T>) -> Self {
        if sim.capped.is_none() {
            return Capped::default();
        }
        let z = T::zero();
        let (nl, nv, trees) = (sim.links.len(), sim.model.nv, sim.trees);
        Capped {
            smooth: vec![z; nv],
            smooth_acc: vec![[z; 6]; nl],
            here: vec![[z; 6]; nl],
            way: vec![[z; 6]; nl],
            direction: vec![z; nv],
            gradient: vec![z; nv],
            old_gradient: vec![z; nv],
            old_descent: vec![z; nv],
            composite: vec![[z; 10]; nl],
            alpha: vec![z; trees],
            masses: vec![[z; 2]; trees],
            sums: vec![[z; 3]; trees],
            island: vec![0; trees * T::LANES],
            constrained: vec![0; trees],
            live: vec![0; trees],
            homes: Vec::new(),
            first_home: Vec::new(),
            scale: vec![0.0; trees * T::LANES],
            improvement: vec![0.0; trees * T::LANES],
        }
    }
}
