//! `integrator="implicit"`, and `implicitfast` in a medium: the matrix of the integrator is not symmetric.
//!
//! The derivative of the forces by the velocities is found link by link. The force that the motion of a link needs is
//! `F = I A + V x* I V`, with its velocity V and its acceleration A at resting joints. For a degree of freedom `s` that
//! moves the link, with the velocities V- before and V+ after its joint, `dA/dv = (V- + V+) x s - V x s`. So
//!
//! `dF/dv = I ((V- + V+) x s) + (V x* I + (I V) x* - I V x) s`.
//!
//! Both matrices are sums over the links that a link carries, like composite inertias. The medium adds its own derivative
//! to the second. (The same terms in another order: Singh, Russo and Wensing, "Efficient Analytical
//! Derivatives of Rigid-Body Dynamics using Spatial Vector Algebra", 2022.)
//!
//! The matrix has entries between degrees of freedom of which one carries the other. Elimination from the leaves to the
//! roots adds no others. The matrix is that of the masses but for a step's changes, so it needs no pivoting.

use super::implicit_tendons::{add_couplings, mass_matrix, right_hand_side};
use crate::algebra::spatial::*;
use crate::dynamics::add_fluid_derivatives;
use crate::lanes::{Real, kernel_fn};
use crate::model::JointType;
use crate::sim::{Sim, TreeMatrix};
use crate::state::{Group, Work};

kernel_fn! {
    /// Solves for the acceleration with the forces at the end of the step, into `solution`.
    pub(super) fn implicit<'a, T>(
        sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>, matrix: &'a TreeMatrix,
    ) {
        mass_matrix(sim, work, matrix);
        link_derivatives(sim, work, matrix);
        bends(sim, &group.qvel, work, matrix);
        damping_matrix(sim, work, matrix);
        right_hand_side(sim, work, matrix);
        let (dt, c) = (T::splat(sim.dt), &mut work.implicit);
        for at in 0..matrix.len {
            c.factor[at] = c.damping[at].mul_add(dt, c.mass[at]);
            c.full.factor[at] = c.full.damping[at].mul_add(dt, c.mass[at]);
        }
        solve(matrix, [&mut c.factor, &mut c.full.factor], &mut c.full.path, &mut c.change);
        let accelerations = work.solver.solution.iter_mut().zip(&work.solver.qacc);
        for ((x, a), change) in accelerations.zip(&c.change) {
            *x = *a + *change;
        }
    }
}

/// Derivatives of the links' forces.
#[inline(always)]
fn link_derivatives<T: Real>(sim: &Sim<T>, work: &mut Work<T>, matrix: &TreeMatrix) {
    let (z, one) = (T::zero(), T::lit(1.0));
    let links = &mut work.implicit.full.links;
    links.fill([[z; 6]; 6]);
    for (l, link) in sim.links.iter().enumerate() {
        if !(matrix.bias || link.alone) {
            continue;
        }
        let (inertia, v) = (&work.motion.inertia[l], &work.motion.vel[l]);
        let momentum = inertia_mul(inertia, v);
        for k in 0..6 {
            let mut e = [z; 6];
            e[k] = one;
            let carried = cross_force(v, &inertia_mul(inertia, &e));
            let turned = cross_force(&e, &momentum);
            let bent = inertia_mul(inertia, &cross_motion(v, &e));
            for i in 0..6 {
                links[l][i][k] = carried[i] + turned[i] - bent[i];
            }
        }
    }
    add_fluid_derivatives(sim, &work.motion, !matrix.bias, links);
    for (l, link) in sim.links.iter().enumerate().rev() {
        let Some(p) = link.parent else { continue };
        for i in 0..6 {
            for k in 0..6 {
                let x = links[l][i][k];
                links[p][i][k] += x;
            }
        }
    }
}

/// `(V- + V+) x s` of every degree of freedom; zero where the bias force has no share in the matrix.
#[inline(always)]
fn bends<T: Real>(sim: &Sim<T>, qvel: &[T], work: &mut Work<T>, matrix: &TreeMatrix) {
    let Work { motion, dofs, implicit, .. } = work;
    let bend = &mut implicit.full.bend;
    bend.fill([T::zero(); 6]);
    for link in sim.links.iter().filter(|link| matrix.bias || link.alone) {
        let mut vel = link.parent.map_or([T::zero(); 6], |p| motion.vel[p]);
        for joint in &sim.joints[link.joints.clone()] {
            let first = match joint.kind {
                JointType::Free => {
                    // translations do not bend
                    for d in joint.dof..joint.dof + 3 {
                        vel = axpy6(&dofs[d].axis, qvel[d], &vel);
                    }
                    joint.dof + 3
                }
                _ => joint.dof,
            };
            let own = first..joint.dof + joint.kind.dofs();
            let before = vel;
            for d in own.clone() {
                vel = axpy6(&dofs[d].axis, qvel[d], &vel);
            }
            let mut both = before;
            for i in 0..6 {
                both[i] += vel[i];
            }
            for d in own {
                bend[d] = cross_motion(&both, &dofs[d].axis);
            }
        }
    }
}

/// The negative derivative of the forces by the velocities, below and above the diagonal.
#[inline(always)]
fn damping_matrix<T: Real>(sim: &Sim<T>, work: &mut Work<T>, matrix: &TreeMatrix) {
    let Work { dofs, forces, implicit: c, .. } = work;
    for (l, link) in sim.links.iter().enumerate() {
        let (inertia, turn) = (&c.composite[l], &c.full.links[l]);
        for d in link.dofs.clone() {
            let s = &dofs[d].axis;
            // forces by the velocity of `d`, and forces on `d` by other velocities
            let mut by = inertia_mul(inertia, &c.full.bend[d]);
            let (momentum, mut on) = (inertia_mul(inertia, s), [T::zero(); 6]);
            for i in 0..6 {
                for k in 0..6 {
                    by[i] = turn[i][k].mul_add(s[k], by[i]);
                    on[k] = turn[i][k].mul_add(s[i], on[k]);
                }
            }
            let (mut at, mut next) = (matrix.start[d], Some(d));
            while let Some(i) = next {
                c.damping[at] = dot6(&momentum, &c.full.bend[i]) + dot6(&on, &dofs[i].axis);
                c.full.damping[at] = dot6(&dofs[i].axis, &by);
                (at, next) = (at + 1, matrix.parent[i]);
            }
        }
    }
    for (start, x) in matrix.start.iter().zip(&forces.minus_qderiv) {
        c.damping[*start] += *x;
    }
    for sums in [&mut c.damping, &mut c.full.damping] {
        add_couplings(sim, forces, matrix, &mut c.arms, sums);
    }
}

/// Solves for `x` in place, given the entries below and on the diagonal, and those above it.
#[inline(always)]
fn solve<T: Real>(matrix: &TreeMatrix, [lower, upper]: [&mut [T]; 2], path: &mut Vec<usize>, x: &mut [T]) {
    for d in (0..x.len()).rev() {
        let row = matrix.start[d];
        path.clear();
        let mut next = matrix.parent[d];
        while let Some(i) = next {
            path.push(i);
            next = matrix.parent[i];
        }
        let inverse = lower[row].recip();
        lower[row] = inverse;
        for (p, i) in path.iter().enumerate() {
            let part = upper[row + 1 + p] * inverse;
            x[*i] = part.neg_mul_add(x[d], x[*i]);
            for (q, j) in path.iter().enumerate() {
                // the entry of row `i` and column `j`
                let by = lower[row + 1 + q];
                let entry =
                    if q < p { &mut upper[matrix.start[*j] + p - q] } else { &mut lower[matrix.start[*i] + q - p] };
                *entry = part.neg_mul_add(by, *entry);
            }
        }
    }
    for d in 0..x.len() {
        let (mut at, mut next) = (matrix.start[d] + 1, matrix.parent[d]);
        let mut sum = x[d];
        while let Some(i) = next {
            sum = lower[at].neg_mul_add(x[i], sum);
            (at, next) = (at + 1, matrix.parent[i]);
        }
        x[d] = sum * lower[matrix.start[d]];
    }
}
