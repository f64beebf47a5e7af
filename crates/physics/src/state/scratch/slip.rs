//! Memory of the second solver for friction (`noslip_iterations`).

use crate::algebra::spatial::{Inertia, V6};
use crate::lanes::Real;
use crate::sim::Sim;

/// Maximum number of friction rows of a contact.
pub(crate) const MOST_ROWS: usize = 5;

/// Memory of the second solver for friction. Empty for models without it.
#[derive(Clone, Debug)]
pub(crate) struct Slip<T: Real> {
    /// Unit force along one row: on joints and on links, and the links whose joints it can move.
    pub rhs: Vec<T>,
    pub link_force: Vec<V6<T>>,
    pub on_path: Vec<bool>,
    /// Inward passes of the rows of one patch: `nv` numbers each.
    pub columns: Vec<T>,
    /// Inward pass of the changes of all forces.
    pub change: Vec<T>,
    /// Inertia of each link with all links that it carries.
    pub composite: Vec<Inertia<T>>,
    /// Lanes with constraints.
    pub held: T::Mask,
    pub lanes: Vec<SlipLane>,
}

/// The rows of one lane.
#[derive(Clone, Debug, Default)]
pub(crate) struct SlipLane {
    /// In the order of the sweeps.
    pub patches: Vec<Patch>,
    /// Degrees of freedom that move each patch, and the inward passes of its rows there: one number per row.
    pub dofs: Vec<usize>,
    pub columns: Vec<f64>,
    /// Per degree of freedom: its pivot, and the inward pass of the changes of the forces.
    pub pivots: Vec<f64>,
    pub change: Vec<f64>,
    /// By tree: the first tree of its island, the sum of its diagonal of the mass matrix, the cost of its constraints'
    /// softness, the improvement of the last sweep, and whether the island has more sweeps. An island's first tree has
    /// the sums of the island.
    pub island: Vec<usize>,
    pub mass: Vec<f64>,
    pub softness: Vec<f64>,
    pub improvement: Vec<f64>,
    pub live: Vec<bool>,
}

/// The friction rows of one constraint in one lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    pub place: Place,
    pub law: Law,
    /// Key of the order of the sweeps.
    pub order: [usize; 6],
    /// A tree that it acts on.
    pub tree: usize,
    /// Number of rows.
    pub dim: usize,
    /// First entries in [`SlipLane::dofs`] and [`SlipLane::columns`], and the number of degrees of freedom.
    pub dof: usize,
    pub column: usize,
    pub dofs: usize,
    /// Forces of the rows. For a pyramid: half the differences of opposing edges.
    pub force: [f64; MOST_ROWS],
    /// Bounds of the forces, as far as the law has them. For an ellipsoid, the first is the normal force.
    pub bound: [f64; MOST_ROWS],
    pub mu: [f64; MOST_ROWS],
    /// Accelerations of the rows relative to their references, with the forces of the first solver.
    pub residual: [f64; MOST_ROWS],
    /// Responses of the rows to their own forces: `J inv(M) J'`.
    pub matrix: [[f64; MOST_ROWS]; MOST_ROWS],
}

/// The row of a patch: an index into the list of its kind.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Place {
    Floor(usize),
    Dry(usize),
    Block(usize),
}

/// The bound of the forces of a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Law {
    /// Dry friction: a constant.
    Dry,
    /// Opposing edges share a constant force.
    Pyramid,
    /// The squares of the forces, each divided by its coefficient, sum up to that of the normal force.
    Ellipsoid,
}

impl<T: Real> Default for Slip<T> {
    fn default() -> Self {
        Slip {
            rhs: Vec::new(),
            link_force: Vec::new(),
            on_path: Vec::new(),
            columns: Vec::new(),
            change: Vec::new(),
            composite: Vec::new(),
            held: T::none(),
            lanes: Vec::new(),
        }
    }
}

impl<T: Real> Slip<T> {
    pub fn new(sim: &Sim<T>) -> Self {
        if sim.no_slip.is_none() {
            return Slip::default();
        }
        let (z, nl, nv) = (T::zero(), sim.links.len(), sim.model.nv);
        let lane = SlipLane {
            pivots: vec![0.0; nv],
            change: vec![0.0; nv],
            island: vec![0; sim.trees],
            mass: vec![0.0; sim.trees],
            softness: vec![0.0; sim.trees],
            improvement: vec![0.0; sim.trees],
            live: vec![false; sim.trees],
            ..SlipLane::default()
        };
        Slip {
            rhs: vec![z; nv],
            link_force: vec![[z; 6]; nl],
            on_path: vec![false; nl],
            columns: vec![z; MOST_ROWS * nv],
            change: vec![z; nv],
            composite: vec![[z; 10]; nl],
            held: T::none(),
            lanes: vec![lane; T::LANES],
        }
    }
}

impl SlipLane {
    /// Removes all rows.
    pub fn clear(&mut self) {
        self.patches.clear();
        self.dofs.clear();
        self.columns.clear();
        self.change.fill(0.0);
        self.mass.fill(0.0);
        self.softness.fill(0.0);
        for (i, root) in self.island.iter_mut().enumerate() {
            *root = i;
        }
    }

    /// The first tree of a tree's island.
    pub fn root(&self, mut tree: usize) -> usize {
        while self.island[tree] != tree {
            tree = self.island[tree];
        }
        tree
    }

    /// Merges the islands of two trees.
    pub fn unite(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.island[a.max(b)] = a.min(b);
    }
}
