//! Integrators for models with tendons, or actuators at sites, that have a share in the integrator's matrix:
//! `implicitfast` if their forces depend on their velocities, and every implicit integrator if tendons have armature.
//!
//! Such a tendon adds `J' b J` to the matrix that the integrator solves with, where `b` is its damping with that of its
//! actuators. As in MuJoCo, only entries of degrees of freedom of which one carries the other count. A tendon across
//! branches has others, so the matrix does not fit the recursion over the tree. It is factorized as `L' D L`, entry by
//! entry. The other damping of the integrator is in the same matrix.
//!
//! The unknown is the change of the constrained acceleration `a`: `(M + dt B) da = r - dt B a`. The residual `r` is zero
//! if the solver has converged.

use crate::algebra::spatial::*;
use crate::lanes::{Real, kernel_fn};
use crate::sim::{Sim, TreeMatrix};
use crate::state::{Forces, Work};

kernel_fn! {
    /// Solves for the acceleration with all damping at the end of the step, into `solution`.
    pub(super) fn implicit_tendons<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>, matrix: &'a TreeMatrix) {
        mass_matrix(sim, work, matrix);
        damping_matrix(sim, work, matrix);
        right_hand_side(sim, work, matrix);
        let dt = T::splat(sim.dt);
        let separate = |l: usize| sim.implicit_fast && sim.links[l].alone;
        for l in 0..sim.links.len() {
            if separate(l) {
                free_body(sim, work, matrix, l);
            }
        }
        let c = &mut work.implicit;
        for ((factor, mass), damping) in c.factor.iter_mut().zip(&c.mass).zip(&c.damping) {
            *factor = damping.mul_add(dt, *mass);
        }
        factorize(matrix, &mut c.factor);
        solve(matrix, &c.factor, &mut c.change);
        for (_, link) in sim.links.iter().enumerate().filter(|(l, _)| !separate(*l)) {
            for d in link.dofs.clone() {
                work.solver.solution[d] = work.solver.qacc[d] + c.change[d];
            }
        }
    }
}

/// The mass matrix, from the inertias of each link with everything that it carries.
#[inline(always)]
pub(super) fn mass_matrix<T: Real>(sim: &Sim<T>, work: &mut Work<T>, matrix: &TreeMatrix) {
    let Work { motion, dofs, forces, implicit: c, .. } = work;
    c.composite.copy_from_slice(&motion.inertia);
    for (l, link) in sim.links.iter().enumerate().rev() {
        for d in link.dofs.clone() {
            let momentum = inertia_mul(&c.composite[l], &dofs[d].axis);
            let (mut at, mut next) = (matrix.start[d], Some(d));
            while let Some(i) = next {
                c.mass[at] = dot6(&dofs[i].axis, &momentum);
                (at, next) = (at + 1, matrix.parent[i]);
            }
            c.mass[matrix.start[d]] += T::splat(sim.armature[d]);
        }
        if let Some(p) = link.parent {
            for i in 0..10 {
                let x = c.composite[l][i];
                c.composite[p][i] += x;
            }
        }
    }
    for t in &matrix.heavy {
        let tendon = &sim.tendons[*t];
        let arms = || tendon.arms(&forces.tendon_moments);
        add_product(matrix, &mut c.arms, &mut c.mass, T::splat(tendon.armature), arms);
    }
}

/// The negative derivative of the forces by the velocities: the diagonal, and the entries of tendons and drives.
#[inline(always)]
fn damping_matrix<T: Real>(sim: &Sim<T>, work: &mut Work<T>, matrix: &TreeMatrix) {
    let Work { forces, implicit: c, .. } = work;
    c.damping.fill(T::zero());
    for (start, x) in matrix.start.iter().zip(&forces.minus_qderiv) {
        c.damping[*start] = *x;
    }
    add_couplings(sim, forces, matrix, &mut c.arms, &mut c.damping);
}

/// Adds the entries of tendons and drives to one side of the matrix. Rows of simple bodies have no entries.
#[inline(always)]
pub(super) fn add_couplings<T: Real>(
    sim: &Sim<T>,
    forces: &Forces<T>,
    matrix: &TreeMatrix,
    by_dof: &mut [T],
    sums: &mut [T],
) {
    for t in &matrix.tendons {
        let arms = || sim.tendons[*t].arms(&forces.tendon_moments);
        add_product(matrix, by_dof, sums, forces.minus_tendon_deriv[*t], arms);
    }
    for d in &matrix.drives {
        let arms = || forces.drives.arms(sim, *d);
        add_product(matrix, by_dof, sums, forces.minus_drive_deriv[*d], arms);
    }
    for row in &matrix.dropped {
        sums[row.clone()].fill(T::zero());
    }
}

/// Adds `J' b J` to a matrix, for the moment arms `J`.
#[inline(always)]
fn add_product<T: Real, I: Iterator<Item = (usize, T)>>(
    matrix: &TreeMatrix,
    by_dof: &mut [T],
    sums: &mut [T],
    rate: T,
    arms: impl Fn() -> I,
) {
    by_dof.fill(T::zero());
    for (dof, arm) in arms() {
        by_dof[dof] = arm;
    }
    for (d, arm) in arms() {
        let force = rate * arm;
        let (mut at, mut next) = (matrix.start[d], Some(d));
        while let Some(i) = next {
            sums[at] = force.mul_add(by_dof[i], sums[at]);
            (at, next) = (at + 1, matrix.parent[i]);
        }
    }
}

/// `r - dt B a`, into `change`.
#[inline(always)]
pub(super) fn right_hand_side<T: Real>(sim: &Sim<T>, work: &mut Work<T>, matrix: &TreeMatrix) {
    let dt = T::splat(sim.dt);
    let Work { solver, implicit: c, .. } = work;
    // the entries above the diagonal
    let upper = if matrix.full { &c.full.damping } else { &c.damping };
    c.change.fill(T::zero());
    for d in 0..sim.model.nv {
        let (mut at, mut next) = (matrix.start[d] + 1, matrix.parent[d]);
        let mut sum = c.damping[matrix.start[d]] * solver.qacc[d];
        while let Some(i) = next {
            sum = c.damping[at].mul_add(solver.qacc[i], sum);
            c.change[i] = (upper[at] * solver.qacc[d]).neg_mul_add(dt, c.change[i]);
            (at, next) = (at + 1, matrix.parent[i]);
        }
        c.change[d] = sum.neg_mul_add(dt, c.change[d]);
    }
    if sim.capped.is_some() {
        for (x, gradient) in c.change.iter_mut().zip(&solver.capped.gradient) {
            *x -= *gradient;
        }
    }
}

/// Eliminates each degree of freedom from those that carry it.
#[inline(always)]
fn factorize<T: Real>(matrix: &TreeMatrix, a: &mut [T]) {
    for d in (0..matrix.start.len()).rev() {
        let row = matrix.start[d];
        let inverse = a[row].recip();
        let (mut at, mut next) = (row + 1, matrix.parent[d]);
        while let Some(i) = next {
            let part = a[at] * inverse;
            // the ancestors of an ancestor are the rest of the row
            let (mut from, mut to, mut above) = (at, matrix.start[i], Some(i));
            while let Some(j) = above {
                a[to] = part.neg_mul_add(a[from], a[to]);
                (from, to, above) = (from + 1, to + 1, matrix.parent[j]);
            }
            (at, next) = (at + 1, matrix.parent[i]);
        }
        let (mut at, mut next) = (row + 1, matrix.parent[d]);
        while let Some(i) = next {
            a[at] *= inverse;
            (at, next) = (at + 1, matrix.parent[i]);
        }
        a[row] = inverse;
    }
}

/// Solves with the factors in place.
#[inline(always)]
fn solve<T: Real>(matrix: &TreeMatrix, a: &[T], x: &mut [T]) {
    for d in (0..x.len()).rev() {
        let (mut at, mut next) = (matrix.start[d] + 1, matrix.parent[d]);
        while let Some(i) = next {
            x[i] = a[at].neg_mul_add(x[d], x[i]);
            (at, next) = (at + 1, matrix.parent[i]);
        }
    }
    for d in 0..x.len() {
        let mut sum = x[d] * a[matrix.start[d]];
        let (mut at, mut next) = (matrix.start[d] + 1, matrix.parent[d]);
        while let Some(i) = next {
            sum = a[at].neg_mul_add(x[i], sum);
            (at, next) = (at + 1, matrix.parent[i]);
        }
        x[d] = sum;
    }
}

/// Solves for the acceleration of a free body without moving children, into `solution`. The derivative of its bias force
/// counts, too. It is not symmetric.
#[inline(always)]
fn free_body<T: Real>(sim: &Sim<T>, work: &mut Work<T>, matrix: &TreeMatrix, l: usize) {
    let (first, dt, z) = (sim.links[l].dofs.start, T::splat(sim.dt), T::zero());
    let Work { motion, dofs, solver, implicit: c, .. } = work;
    // derivative of the bias force
    let mut bias = [[z; 6]; 6];
    let [_, x, y, zz, jxx, jyy, jzz, jxy, jxz, jyz] = motion.inertia[l];
    let (moment, w) = ([x, y, zz], ang(&motion.vel[l]));
    let inertia = [[jxx, jxy, jxz], [jxy, jyy, jyz], [jxz, jyz, jzz]];
    let spin = rotate(&inertia, &w);
    for k in 0..3 {
        // torques and rates are along the body's axes
        let axis = ang(&dofs[first + 3 + k].axis);
        let (across, along) = (dot(&axis, &moment), dot(&w, &moment));
        let turn = sub3(&cross(&w, &rotate(&inertia, &axis)), &cross(&spin, &axis));
        for i in 0..3 {
            let lean = w[i].mul_add(across, T::lit(-2.0) * (moment[i] * dot(&w, &axis)));
            bias[i][3 + k] = axis[i].mul_add(along, lean);
            bias[3 + i][3 + k] = dot(&ang(&dofs[first + 3 + i].axis), &turn);
        }
    }
    let mut a = [[z; 6]; 6];
    let mut rhs = [z; 6];
    for i in 0..6 {
        rhs[i] = c.change[first + i];
        for j in 0..=i {
            let at = matrix.start[first + i] + i - j;
            a[i][j] = c.damping[at].mul_add(dt, c.mass[at]);
            a[j][i] = a[i][j];
        }
    }
    for i in 0..6 {
        for j in 0..6 {
            let x = bias[i][j] * dt;
            rhs[i] = x.neg_mul_add(solver.qacc[first + j], rhs[i]);
            a[i][j] += x;
        }
    }
    // the matrix is that of the masses but for a step's changes, so it needs no pivoting
    for p in 0..6 {
        let inverse = a[p][p].recip();
        for i in p + 1..6 {
            let part = a[i][p] * inverse;
            for j in p + 1..6 {
                a[i][j] = part.neg_mul_add(a[p][j], a[i][j]);
            }
            rhs[i] = part.neg_mul_add(rhs[p], rhs[i]);
        }
        a[p][p] = inverse;
    }
    for p in (0..6).rev() {
        for j in p + 1..6 {
            rhs[p] = a[p][j].neg_mul_add(rhs[j], rhs[p]);
        }
        rhs[p] *= a[p][p];
        solver.solution[first + p] = solver.qacc[first + p] + rhs[p];
    }
}
