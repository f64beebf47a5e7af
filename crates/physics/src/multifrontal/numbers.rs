//! The numbers of one agent's factorization: matrices, factors and vectors.

use super::plan::Plan;
use super::tie::Tie;
use crate::algebra::spatial::*;
use crate::lanes::Real;

/// A row over joints.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointRow<S> {
    pub block: usize,
    pub w: S,
    pub u0: S,
}

/// Matrix, factors and vectors of one agent.
#[derive(Clone, Debug)]
pub(crate) struct Numbers<S> {
    /// By link: stiffness with its inertia and static contacts; whether the front must be recomputed.
    pub stiffness: Vec<Sym6<S>>,
    pub stale: Vec<bool>,
    /// By degree of freedom.
    pub axis: Vec<V6<S>>,
    pub diag: Vec<S>,
    pub rhs: Vec<S>,
    pub ties: Vec<Tie<S>>,
    pub rows: Vec<JointRow<S>>,
    /// By link: the force that the motion needs, and the resulting acceleration; the same for the rows.
    pub force: Vec<V6<S>>,
    pub acc: Vec<V6<S>>,
    pub row_force: Vec<S>,
    pub row_acc: Vec<S>,
    /// Acceleration of the degrees of freedom, and their share of it before the outward pass.
    pub next: Vec<S>,
    pub(super) drive: Vec<S>,
    pub(super) pivot: Vec<S>,
    pub matrix: Vec<S>,
    pub(super) gains: Vec<S>,
    /// Scratch: columns of the current front.
    pub(super) u: Vec<S>,
}

impl<S: Real> Numbers<S> {
    pub fn new() -> Self {
        Numbers {
            stiffness: Vec::new(),
            stale: Vec::new(),
            axis: Vec::new(),
            diag: Vec::new(),
            rhs: Vec::new(),
            ties: Vec::new(),
            rows: Vec::new(),
            force: Vec::new(),
            acc: Vec::new(),
            row_force: Vec::new(),
            row_acc: Vec::new(),
            next: Vec::new(),
            drive: Vec::new(),
            pivot: Vec::new(),
            matrix: Vec::new(),
            gains: Vec::new(),
            u: Vec::new(),
        }
    }

    /// Allocates memory for a model.
    pub fn resize(&mut self, links: usize, nv: usize) {
        let z = S::zero();
        self.stiffness.resize(links, [z; 21]);
        self.stale.resize(links, true);
        self.force.resize(links, [z; 6]);
        self.acc.resize(links, [z; 6]);
        self.axis.resize(nv, [z; 6]);
        for v in [&mut self.diag, &mut self.rhs, &mut self.next, &mut self.drive, &mut self.pivot] {
            v.resize(nv, z);
        }
    }

    /// Allocates memory for a plan.
    pub fn follow(&mut self, plan: &Plan<S>) {
        let z = S::zero();
        if self.matrix.len() < plan.matrix_len {
            self.matrix.resize(plan.matrix_len, z);
        }
        if self.gains.len() < plan.gains_len {
            self.gains.resize(plan.gains_len, z);
        }
        self.row_force.resize(self.rows.len(), z);
        self.row_acc.resize(self.rows.len(), z);
    }
}
