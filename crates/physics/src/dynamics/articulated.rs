//! The articulated-body recursion: solves `(M + sum_b K_b + diag) x = rhs - bias + wrenches` in linear time.
//!
//! It is equivalent to a factorization `L D L'`. The inward pass over the links, [`factorize`], finds three values per
//! degree of freedom: the pivot (`D`), the gain of outer forces on the inside (`L`), and the acceleration from its own
//! share of the forces (`drive`). The outward pass, [`accelerate`], completes the solution. Featherstone's recursion
//! with rank-one updates per degree of freedom is exact for joints with several degrees of freedom.
//!
//! [`factorize`] only recomputes links marked in `work.solver.stale`, and their ancestors. Toward the end of an
//! iteration few lanes still change, and most of the tree keeps its factors.

use crate::algebra::planar::Space;
use crate::algebra::spatial::*;
use crate::lanes::Real;
use crate::sim::Sim;
use crate::state::{DofWork, Solver, Work, net_bias_force};

/// Factorizes the stale links and propagates their forces inward.
///
/// `M` without armature comes from the links' inertias. [`DofWork::diag`] is added to its diagonal (armature, limit
/// stiffness, implicit damping). `with_stiffness` adds the contact stiffness of touching links. Their wrench is applied
/// in either case.
#[inline(always)]
pub(crate) fn factorize<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>, with_stiffness: bool) {
    let links = &sim.links[..];
    let n = links.len();
    let Work { motion, forces, dofs, solver, .. } = work;
    let Solver { stale, in_contact, stiffness, wrench, art, art_force, root_factor, .. } = solver;
    // slices of known length need no check per link
    let (stale, in_contact, inertia) = (&mut stale[..n], &in_contact[..n], &motion.inertia[..n]);
    let (stiffness, wrench) = (&stiffness[..n], &wrench[..n]);
    let (art, art_force) = (&mut art[..n], &mut art_force[..n]);
    let (bias_force, applied) = (&motion.bias_force[..n], &forces.link_applied[..]);
    for l in (0..n).rev() {
        if !stale[l] {
            continue;
        }
        let link = &links[l];
        let mut k: Sym6<T> = sym6_of_inertia(&inertia[l]);
        let mut f: V6<T> = net_bias_force(bias_force, applied, l);
        if in_contact[l] {
            if with_stiffness {
                S::add_sym(&mut k, &stiffness[l]);
            }
            S::sub(&mut f, &wrench[l]);
        }
        let mut child = link.last_child;
        while let Some(c) = child {
            S::add_sym(&mut k, &art[c]);
            S::add(&mut f, &art_force[c]);
            child = links[c].sibling;
        }
        if let Some(p) = link.parent {
            stale[p] = true;
        }
        let dofs = &mut dofs[link.dofs.clone()];
        if link.free_block {
            let (root, dofs) = (&mut root_factor[link.tree], six(dofs));
            *root = factor_free_root(dofs, &k);
            drive_free_root(root, dofs, &f);
            continue;
        }
        for dof in dofs.iter_mut().rev() {
            let u = S::mul(&k, &dof.axis);
            let pivot = (S::dot(&dof.axis, &u) + dof.diag).recip();
            let force = dof.rhs - S::dot(&dof.axis, &f);
            let v = S::scale(&u, pivot);
            S::sub_outer(&mut k, &u, &v);
            f = S::axpy(&v, force, &f);
            S::copy(&mut dof.gain, &v);
            (dof.pivot, dof.drive) = (pivot, force * pivot);
        }
        S::copy_sym(&mut art[l], &k);
        S::copy(&mut art_force[l], &f);
    }
}

/// Propagates other joint forces ([`DofWork::rhs`]) and link forces (`link_force`) inward with the existing factors.
/// This is only the vector half of [`factorize`], at a fraction of its cost.
#[inline(always)]
pub(crate) fn bring_inward<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>) {
    let links = &sim.links[..];
    let n = links.len();
    let Work { dofs, solver, .. } = work;
    let (link_force, art_force) = (&solver.link_force[..n], &mut solver.art_force[..n]);
    for l in (0..n).rev() {
        let link = &links[l];
        let mut f = link_force[l];
        let mut child = link.last_child;
        while let Some(c) = child {
            S::add(&mut f, &art_force[c]);
            child = links[c].sibling;
        }
        let dofs = &mut dofs[link.dofs.clone()];
        if link.free_block {
            drive_free_root(&solver.root_factor[link.tree], six(dofs), &f);
            continue;
        }
        for dof in dofs.iter_mut().rev() {
            let force = dof.rhs - S::dot(&dof.axis, &f);
            f = S::axpy(&dof.gain, force, &f);
            dof.drive = force * dof.pivot;
        }
        S::copy(&mut art_force[l], &f);
    }
}

/// Outward pass: joint accelerations into `solution`, and the links' accelerations without bias into `link_acc`.
#[inline(always)]
pub(crate) fn accelerate<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>) {
    let links = &sim.links[..];
    let Work { dofs, solver, .. } = work;
    let (link_acc, solution) = (&mut solver.link_acc[..links.len()], &mut solver.solution[..]);
    for (l, link) in links.iter().enumerate() {
        let (dofs, solution) = (&dofs[link.dofs.clone()], &mut solution[link.dofs.clone()]);
        if link.free_block {
            link_acc[l] = accelerate_free_root(&solver.root_factor[link.tree], dofs, solution);
            continue;
        }
        let mut a = match link.parent {
            Some(p) => link_acc[p],
            None => [T::zero(); 6],
        };
        for (dof, solution) in dofs.iter().zip(solution) {
            let x = dof.drive - S::dot(&dof.gain, &a);
            *solution = x;
            a = S::axpy(&dof.axis, x, &a);
        }
        link_acc[l] = a;
    }
}

/// Links' accelerations without bias for the joint accelerations `qacc`.
#[inline(always)]
pub(crate) fn link_accelerations<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>) {
    let links = &sim.links[..];
    let (link_acc, qacc) = (&mut work.solver.link_acc[..links.len()], &work.solver.qacc[..]);
    for (l, link) in links.iter().enumerate() {
        let mut a = match link.parent {
            Some(p) => link_acc[p],
            None => [T::zero(); 6],
        };
        for (dof, x) in work.dofs[link.dofs.clone()].iter().zip(&qacc[link.dofs.clone()]) {
            a = S::axpy(&dof.axis, *x, &a);
        }
        link_acc[l] = a;
    }
}

/// The degrees of freedom of a free root as an array.
#[inline(always)]
fn six<T: Real>(dofs: &mut [DofWork<T>]) -> &mut [DofWork<T>; 6] {
    dofs.try_into().expect("a free joint has six degrees of freedom")
}

/// Factorizes the symmetric 6x6 system of a free root.
#[inline(always)]
fn factor_free_root<T: Real>(dofs: &[DofWork<T>; 6], k: &Sym6<T>) -> [[T; 6]; 6] {
    let mut k = *k;
    for i in 0..3 {
        k[i] += dofs[3 + i].diag;
        k[15 + i] += dofs[i].diag;
    }
    let mut a = [
        [k[0], k[3], k[4], k[6], k[7], k[8]],
        [k[3], k[1], k[5], k[9], k[10], k[11]],
        [k[4], k[5], k[2], k[12], k[13], k[14]],
        [k[6], k[9], k[12], k[15], k[18], k[19]],
        [k[7], k[10], k[13], k[18], k[16], k[20]],
        [k[8], k[11], k[14], k[19], k[20], k[17]],
    ];
    // eliminate the linear part first: its pivots are masses and well-conditioned
    for p in (0..6).rev() {
        let pivot = a[p][p].recip();
        for i in (0..p).rev() {
            let m = a[p][i] * pivot;
            for j in 0..=i {
                a[i][j] = m.neg_mul_add(a[p][j], a[i][j]);
            }
            a[p][i] = m;
        }
        a[p][p] = pivot;
    }
    a
}

/// Inward half of the six degrees of freedom of a free root with the factor `a`. The pivots are on its diagonal.
#[inline(always)]
fn drive_free_root<T: Real>(a: &[[T; 6]; 6], dofs: &mut [DofWork<T>; 6], f: &V6<T>) {
    let rhs = [dofs[0].rhs, dofs[1].rhs, dofs[2].rhs, dofs[3].rhs, dofs[4].rhs, dofs[5].rhs];
    let y = reduce_free_root(a, dofs, &rhs, f);
    for p in 0..6 {
        dofs[p].pivot = a[p][p];
        dofs[p].drive = y[p] * a[p][p];
    }
}

/// Propagates joint forces `rhs` and the force `f` that the motion needs inward through a free root's factor `a`.
#[inline(always)]
pub(crate) fn reduce_free_root<T: Real>(a: &[[T; 6]; 6], dofs: &[DofWork<T>; 6], rhs: &V6<T>, f: &V6<T>) -> V6<T> {
    // torques are along the body's axes, forces along the world's
    let axis = [&dofs[3].axis, &dofs[4].axis, &dofs[5].axis];
    let mut y = [T::zero(); 6];
    for i in 0..3 {
        let torque = axis[0][i].mul_add(rhs[3], axis[1][i].mul_add(rhs[4], axis[2][i] * rhs[5]));
        y[i] = torque - f[i];
        y[3 + i] = rhs[i] - f[3 + i];
    }
    for p in (0..6).rev() {
        for i in (0..p).rev() {
            y[i] = a[p][i].neg_mul_add(y[p], y[i]);
        }
    }
    y
}

/// Outward half of a free root with the factor `a`. Returns the link's acceleration.
#[inline(always)]
fn accelerate_free_root<T: Real>(a: &[[T; 6]; 6], dofs: &[DofWork<T>], solution: &mut [T]) -> V6<T> {
    let mut y = [T::zero(); 6];
    for p in 0..6 {
        let mut v = dofs[p].drive;
        for i in 0..p {
            v = a[p][i].neg_mul_add(y[i], v);
        }
        y[p] = v;
    }
    let spin = ang(&y);
    for i in 0..3 {
        solution[i] = y[3 + i];
        solution[3 + i] = dot(&ang(&dofs[3 + i].axis), &spin);
    }
    y
}
