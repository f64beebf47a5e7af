//! Memory of the constraint solver and of the recursion that it runs.

use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::multifrontal::Crowd;
use crate::sim::Sim;
use crate::state::coupling::Coupling;
use crate::state::{Capped, Slip};

/// Memory of the constraint solver and of the recursion that it runs.
#[derive(Clone, Debug)]
pub(crate) struct Solver<T: Real> {
    /// Joint accelerations.
    pub qacc: Vec<T>,
    /// Solution of the last linear solve: accelerations at a Newton point or at the end of the step, or a correction.
    pub solution: Vec<T>,
    /// Spatial acceleration (without bias) of each link for the last accelerations or solution.
    pub link_acc: Vec<V6<T>>,
    /// Contact stiffness and wrench of each link.
    pub stiffness: Vec<Sym6<T>>,
    pub wrench: Vec<V6<T>>,
    pub in_contact: Vec<bool>,
    /// Articulated inertias and forces.
    pub art: Vec<Sym6<T>>,
    pub art_force: Vec<V6<T>>,
    /// Links whose matrix or forces changed since their last factorization.
    pub stale: Vec<bool>,
    /// Per tree with a free root: triangular factor, inverse pivots on the diagonal.
    pub root_factor: Vec<[[T; 6]; 6]>,
    /// Forces that links need, for `bring_inward`: a residual.
    pub link_force: Vec<V6<T>>,
    pub coupling: Coupling<T>,
    pub capped: Capped<T>,
    pub slip: Slip<T>,
    /// Per lane, once it has had a crowd: its factorization.
    pub crowds: Vec<Crowd<T::Scalar>>,
    /// Lanes that use it in the current step.
    pub crowded: T::Mask,
}

impl<T: Real> Solver<T> {
    pub fn new(sim: &Sim<T>) -> Self {
        let z = T::zero();
        let (nl, nv) = (sim.links.len(), sim.model.nv);
        Solver {
            qacc: vec![z; nv],
            solution: vec![z; nv],
            link_acc: vec![[z; 6]; nl],
            stiffness: vec![[z; 21]; nl],
            wrench: vec![[z; 6]; nl],
            in_contact: vec![false; nl],
            art: vec![[z; 21]; nl],
            art_force: vec![[z; 6]; nl],
            stale: vec![true; nl],
            root_factor: vec![[[z; 6]; 6]; sim.trees],
            link_force: vec![[z; 6]; nl],
            coupling: Coupling::new(nl, nv),
            capped: Capped::new(sim),
            slip: Slip::new(sim),
            crowds: Vec::new(),
            crowded: T::none(),
        }
    }
}
