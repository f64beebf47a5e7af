//! The inertia of tendons with armature, a part of the masses. Its blocks are the first ones.

use crate::lanes::Real;
use crate::rows::Block;
use crate::sim::Sim;
use crate::solver::coupled;
use crate::state::{Capped, Work};

/// Rate of the tendon for the rates `x` of the degrees of freedom.
#[inline(always)]
fn rate<T: Real>(block: &Block<T>, x: impl Fn(usize) -> T) -> T {
    block.joint_terms().iter().fold(T::zero(), |sum, (dof, arm)| arm.mul_add(x(*dof), sum))
}

/// Corrects the solution of the tree's factors for the inertia, with their drift at the unconstrained acceleration.
pub(super) fn factorize<T: Real>(sim: &Sim<T>, work: &mut Work<T>) {
    let all = work.rows.blocks.show(sim.inertia_blocks);
    for block in work.rows.blocks.iter_mut() {
        block.activate(T::not(T::none()));
    }
    work.solver.crowded = T::none();
    coupled::factorize(sim, work, true);
    coupled::correct(sim, work, true);
    work.rows.blocks.show(all);
}

/// Twice the cost of a motion away from the unconstrained acceleration.
#[inline(always)]
pub(super) fn twice_cost<T: Real>(sim: &Sim<T>, work: &Work<T>, c: &Capped<T>) -> T {
    let mut sum = T::zero();
    for block in &work.rows.blocks[..sim.inertia_blocks] {
        let away = rate(block, |d| work.solver.qacc[d] - c.smooth[d]);
        sum = (block.d[0] * away).mul_add(away, sum);
    }
    sum
}

/// Adds the derivatives of the cost by the accelerations.
#[inline(always)]
pub(super) fn add_gradient<T: Real>(sim: &Sim<T>, work: &Work<T>, c: &mut Capped<T>) {
    for block in &work.rows.blocks[..sim.inertia_blocks] {
        let force = block.d[0] * rate(block, |d| work.solver.qacc[d] - c.smooth[d]);
        for (dof, arm) in block.joint_terms() {
            c.gradient[*dof] = arm.mul_add(force, c.gradient[*dof]);
        }
    }
}

/// Adds the cost of moving along the direction.
#[inline(always)]
pub(super) fn add_way<T: Real>(sim: &Sim<T>, work: &Work<T>, c: &mut Capped<T>) {
    for block in &work.rows.blocks[..sim.inertia_blocks] {
        // all of its degrees of freedom are in one tree
        let Some((dof, _)) = block.joint_terms().first() else { continue };
        let tree = sim.links[sim.dof_link[*dof]].tree;
        let away = rate(block, |d| work.solver.qacc[d] - c.smooth[d]);
        let way = rate(block, |d| c.direction[d]);
        let momentum = block.d[0] * way;
        c.masses[tree][0] = momentum.mul_add(away, c.masses[tree][0]);
        c.masses[tree][1] = momentum.mul_add(way, c.masses[tree][1]);
    }
}

/// Adds its share of the diagonal of the mass matrix to the sums of the trees.
#[inline(always)]
pub(super) fn add_diagonal<T: Real>(sim: &Sim<T>, work: &Work<T>, c: &mut Capped<T>) {
    for block in &work.rows.blocks[..sim.inertia_blocks] {
        for (dof, arm) in block.joint_terms() {
            let sum = &mut c.sums[sim.links[sim.dof_link[*dof]].tree][0];
            *sum = (block.d[0] * *arm).mul_add(*arm, *sum);
        }
    }
}
