//! Islands: trees that constraints connect. MuJoCo solves each island separately, with its own line search and its own
//! convergence check.

use crate::lanes::{Real, kernel_fn};
use crate::rows::{Jacobian, Source};
use crate::sim::Sim;
use crate::state::{Capped, Work};

/// Degrees of freedom from which on MuJoCo stores sparse Jacobians (`mj_isSparse`).
const SPARSE: usize = 60;

kernel_fn! {
    /// Finds the islands of every lane, and the trees of every row.
    pub(super) fn find<'a, T>(sim: &'a Sim<T>, work: &'a Work<T>, c: &'a mut Capped<T>) {
        let tree_of_dof = |d: usize| sim.links[sim.dof_link[d]].tree;
        // MuJoCo stores the Jacobian of a larger model as its possible entries, that of others as numbers
        let dense = sim.model.nv < SPARSE;
        let alone = sim.capped.as_ref().is_some_and(|x| x.islands);
        for (i, root) in c.island.iter_mut().enumerate() {
            *root = if alone { i / T::LANES } else { 0 };
        }
        c.constrained.fill(0);
        for row in &work.rows.contacts {
            c.constrained[sim.links[row.link].tree] |= T::bits(row.on);
        }
        for row in &work.rows.limits {
            c.constrained[tree_of_dof(row.dof)] |= T::bits(row.on);
        }
        for row in &work.rows.dry {
            c.constrained[tree_of_dof(row.dof)] |= T::bits(T::not(T::none()));
        }
        c.homes.clear();
        c.first_home.clear();
        for b in work.rows.blocks.iter() {
            c.first_home.push(c.homes.len());
            // inertia is no constraint
            if b.source == Source::TendonInertia {
                continue;
            }
            let on = T::bits(b.on);
            match &b.jacobian {
                Jacobian::Points { sides, .. } => {
                    for (link, lanes) in &sides[1].links {
                        let (tree, bits) = (sim.links[*link].tree, T::bits(*lanes) & on);
                        c.homes.push((tree, *lanes));
                        c.constrained[tree] |= bits;
                        for (other, others) in &sides[0].links {
                            unite::<T>(&mut c.island, sim.links[*other].tree, tree, bits & T::bits(*others));
                            c.constrained[sim.links[*other].tree] |= bits & T::bits(*others);
                        }
                    }
                }
                Jacobian::Joints(terms) => {
                    // lanes in which no tree is known yet, and the first trees of the others
                    let mut unknown = T::bits(T::not(T::none()));
                    let first = c.homes.len();
                    for (dof, coefficient) in terms {
                        let moves = if dense { T::bits(T::zero().lt(coefficient.abs())) } else { u32::MAX };
                        let tree = tree_of_dof(*dof);
                        c.constrained[tree] |= on & moves;
                        for (home, lanes) in &c.homes[first..] {
                            unite::<T>(&mut c.island, *home, tree, on & moves & T::bits(*lanes));
                        }
                        if unknown & moves != 0 {
                            c.homes.push((tree, T::from_bits(unknown & moves)));
                            unknown &= !moves;
                        }
                    }
                }
            }
        }
        c.first_home.push(c.homes.len());
        for i in 0..c.island.len() {
            // earlier trees already have their roots
            c.island[i] = c.island[c.island[i] * T::LANES + i % T::LANES];
        }
        if !alone {
            let all = c.constrained.iter().fold(0, |a, b| a | b);
            c.constrained.fill(all);
        }
        c.live.copy_from_slice(&c.constrained);
    }
}

/// Merges the islands of two trees, in some lanes.
fn unite<T: Real>(island: &mut [usize], a: usize, b: usize, lanes: u32) {
    for lane in (0..T::LANES).filter(|lane| lanes >> lane & 1 == 1) {
        let root = |mut tree: usize| {
            while island[tree * T::LANES + lane] != tree {
                tree = island[tree * T::LANES + lane];
            }
            tree
        };
        let (a, b) = (root(a), root(b));
        island[a.max(b) * T::LANES + lane] = a.min(b);
    }
}

/// Adds the sums of trees to the first tree of their island.
pub(super) fn gather<T: Real>(island: &[usize], sums: &mut [[T; 3]]) {
    for tree in 1..sums.len() {
        for lane in 0..T::LANES {
            let root = island[tree * T::LANES + lane];
            if root != tree {
                for k in 0..3 {
                    let x = T::widen(sums[root][k].get(lane)) + T::widen(sums[tree][k].get(lane));
                    sums[root][k].set(lane, T::scalar(x));
                }
            }
        }
    }
}

impl<T: Real> Capped<T> {
    /// Trees and lanes that are the first of an island that is not finished.
    pub(super) fn leads(&self, tree: usize, lane: usize) -> bool {
        self.live[tree] >> lane & 1 == 1 && self.island[tree * T::LANES + lane] == tree
    }

    /// Marks the island of this first tree as finished.
    pub(super) fn stop(&mut self, tree: usize, lane: usize) {
        for other in tree..self.live.len() {
            if self.island[other * T::LANES + lane] == tree {
                self.live[other] &= !(1 << lane);
            }
        }
    }
}
