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
use crate::state::{Work, net_bias_force};

/// Factorizes the stale links and propagates their forces inward.
///
/// `M` without armature comes from the links' inertias. `work.solver.diag` is added to its diagonal (armature, limit
/// stiffness, implicit damping). `with_stiffness` adds the contact stiffness of touching links. Their wrench is applied
/// in either case.
#[inline(always)]
pub(crate) fn factorize<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>, with_stiffness: bool) {
    let applied = work.forces.acts_on_links();
    for l in (0..sim.links.len()).rev() {
        if !work.solver.stale[l] {
            continue;
        }
        let link = &sim.links[l];
        let mut k: Sym6<T> = sym6_of_inertia(&work.motion.inertia[l]);
        let mut f: V6<T> = net_bias_force(&work.motion, &work.forces, applied, l);
        if work.solver.in_contact[l] {
            if with_stiffness {
                S::add_sym(&mut k, &work.solver.stiffness[l]);
            }
            S::sub(&mut f, &work.solver.wrench[l]);
        }
        let mut child = link.last_child;
        while let Some(c) = child {
            S::add_sym(&mut k, &work.solver.art[c]);
            S::add(&mut f, &work.solver.art_force[c]);
            child = sim.links[c].sibling;
        }
        if let Some(p) = link.parent {
            work.solver.stale[p] = true;
        }
        if link.free_block {
            factor_free_root(link.dofs.start, link.tree, &k, work);
            drive_free_root(link.dofs.start, link.tree, &f, work);
            continue;
        }
        for d in link.dofs.clone().rev() {
            let s = work.motion.axis[d];
            let u = S::mul(&k, &s);
            let pivot = (S::dot(&s, &u) + work.solver.diag[d]).recip();
            let force = work.solver.rhs[d] - S::dot(&s, &f);
            let v = S::scale(&u, pivot);
            S::sub_outer(&mut k, &u, &v);
            f = S::axpy(&v, force, &f);
            work.solver.gain[d] = v;
            work.solver.pivot[d] = pivot;
            work.solver.drive[d] = force * pivot;
        }
        work.solver.art[l] = k;
        work.solver.art_force[l] = f;
    }
}

/// Propagates other joint forces (`rhs`) and link forces (`link_force`) inward with the existing factors. This is only
/// the vector half of [`factorize`], at a fraction of its cost.
#[inline(always)]
pub(crate) fn bring_inward<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>) {
    for l in (0..sim.links.len()).rev() {
        let link = &sim.links[l];
        let mut f = work.solver.link_force[l];
        let mut child = link.last_child;
        while let Some(c) = child {
            S::add(&mut f, &work.solver.art_force[c]);
            child = sim.links[c].sibling;
        }
        if link.free_block {
            drive_free_root(link.dofs.start, link.tree, &f, work);
            continue;
        }
        for d in link.dofs.clone().rev() {
            let force = work.solver.rhs[d] - S::dot(&work.motion.axis[d], &f);
            f = S::axpy(&work.solver.gain[d], force, &f);
            work.solver.drive[d] = force * work.solver.pivot[d];
        }
        work.solver.art_force[l] = f;
    }
}

/// Outward pass: joint accelerations into `next`, and the links' accelerations without bias into `link_acc`.
#[inline(always)]
pub(crate) fn accelerate<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>) {
    let z = T::zero();
    for l in 0..sim.links.len() {
        let link = &sim.links[l];
        if link.free_block {
            accelerate_free_root(link.dofs.start, link.tree, l, work);
            continue;
        }
        let mut a = match link.parent {
            Some(p) => work.solver.link_acc[p],
            None => [z; 6],
        };
        for d in link.dofs.clone() {
            let x = work.solver.drive[d] - S::dot(&work.solver.gain[d], &a);
            work.solver.solution[d] = x;
            a = S::axpy(&work.motion.axis[d], x, &a);
        }
        work.solver.link_acc[l] = a;
    }
}

/// Links' accelerations without bias for the joint accelerations `acc`.
#[inline(always)]
pub(crate) fn link_accelerations<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>) {
    for (l, link) in sim.links.iter().enumerate() {
        let mut a = link.parent.map_or([T::zero(); 6], |p| work.solver.link_acc[p]);
        for d in link.dofs.clone() {
            a = S::axpy(&work.motion.axis[d], work.solver.qacc[d], &a);
        }
        work.solver.link_acc[l] = a;
    }
}

/// Factorizes the symmetric 6x6 system of a free root.
#[inline(always)]
fn factor_free_root<T: Real>(d: usize, tree: usize, k: &Sym6<T>, work: &mut Work<T>) {
    let mut k = *k;
    for i in 0..3 {
        k[i] += work.solver.diag[d + 3 + i];
        k[15 + i] += work.solver.diag[d + i];
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
    work.solver.root_factor[tree] = a;
}

/// Inward half of the six degrees of freedom of a free root: the pivots are on the factor's diagonal.
#[inline(always)]
fn drive_free_root<T: Real>(d: usize, tree: usize, f: &V6<T>, work: &mut Work<T>) {
    let y = reduce_free_root(d, &work.solver.root_factor[tree], &work.motion.axis, &work.solver.rhs, f);
    for p in 0..6 {
        work.solver.pivot[d + p] = work.solver.root_factor[tree][p][p];
        work.solver.drive[d + p] = y[p] * work.solver.pivot[d + p];
    }
}

/// Propagates joint forces `rhs` and the force `f` that the motion needs inward through a free root's factor `a`.
#[inline(always)]
pub(crate) fn reduce_free_root<T: Real>(d: usize, a: &[[T; 6]; 6], axis: &[V6<T>], rhs: &[T], f: &V6<T>) -> V6<T> {
    // torques are along the body's axes, forces along the world's
    let mut y = [T::zero(); 6];
    for i in 0..3 {
        let torque =
            axis[d + 3][i].mul_add(rhs[d + 3], axis[d + 4][i].mul_add(rhs[d + 4], axis[d + 5][i] * rhs[d + 5]));
        y[i] = torque - f[i];
        y[3 + i] = rhs[d + i] - f[3 + i];
    }
    for p in (0..6).rev() {
        for i in (0..p).rev() {
            y[i] = a[p][i].neg_mul_add(y[p], y[i]);
        }
    }
    y
}

/// Outward half of a free root.
#[inline(always)]
fn accelerate_free_root<T: Real>(d: usize, tree: usize, l: usize, work: &mut Work<T>) {
    let a = &work.solver.root_factor[tree];
    let mut y = [T::zero(); 6];
    for p in 0..6 {
        let mut v = work.solver.drive[d + p];
        for i in 0..p {
            v = a[p][i].neg_mul_add(y[i], v);
        }
        y[p] = v;
    }
    let spin = [y[0], y[1], y[2]];
    for i in 0..3 {
        work.solver.solution[d + i] = y[3 + i];
        let s = &work.motion.axis[d + 3 + i];
        work.solver.solution[d + 3 + i] = dot(&[s[0], s[1], s[2]], &spin);
    }
    work.solver.link_acc[l] = y;
}
