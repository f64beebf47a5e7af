//! The articulated-body recursion: solves `(M + sum_b K_b + diag) x = rhs - bias + wrenches` in linear time.

use crate::lanes::Real;
use crate::sim::{Link, Sim};
use crate::spatial::*;
use crate::work::Work;

/// Solves for joint accelerations, into `next`, and the links' accelerations without bias, into `link_acc`.
///
/// `M` without armature comes from the links' inertias; `work.diag` is added to its diagonal (armature, limit stiffness,
/// implicit damping). `with_stiffness` adds the contact stiffness of the links that are in contact; their wrench is
/// applied in either case. Featherstone's recursion with rank-one updates per degree of freedom; exact for joints of
/// several degrees of freedom.
#[inline(always)]
pub(crate) fn articulated_solve<T: Real>(sim: &Sim<T>, work: &mut Work<T>, with_stiffness: bool) {
    let z = T::zero();
    for l in (0..sim.links.len()).rev() {
        let link = &sim.links[l];
        let mut k: Sym6<T> = if link.has_children { work.art[l] } else { [z; 21] };
        let mut f: V6<T> = work.bias_force[l];
        sym6_add_inertia(&mut k, &work.inertia[l]);
        if work.in_contact[l] {
            if with_stiffness {
                for i in 0..21 {
                    k[i] += work.stiffness[l][i];
                }
            }
            for i in 0..6 {
                f[i] -= work.wrench[l][i];
            }
        }
        if link.has_children {
            for i in 0..6 {
                f[i] += work.art_force[l][i];
            }
        }
        if link.free_block {
            factor_free_root(link.dofs.start, link.tree, &k, work);
            solve_free_root(link.dofs.start, link.tree, l, &f, work);
            continue;
        }
        for d in link.dofs.clone().rev() {
            let s = work.axis[d];
            let u = sym6_mul(&k, &s);
            let pivot = (dot6(&s, &u) + work.diag[d]).recip();
            let force = work.rhs[d] - dot6(&s, &f);
            let v = [u[0] * pivot, u[1] * pivot, u[2] * pivot, u[3] * pivot, u[4] * pivot, u[5] * pivot];
            sym6_sub_outer(&mut k, &u, &v);
            f = axpy6(&v, force, &f);
            work.gain[d] = v;
            work.pivot[d] = pivot;
            work.next[d] = force * pivot;
        }
        if let Some(p) = link.parent {
            if link.first_to_parent {
                work.art[p] = k;
            } else {
                for i in 0..21 {
                    work.art[p][i] += k[i];
                }
            }
        }
        hand_down(link, &f, work);
    }
    accelerate(sim, work);
}

/// Solves again with the matrix of the last [`articulated_solve`] for other joint forces (`rhs`) and link forces: only
/// the vector half of the recursion, a fraction of the cost.
#[inline(always)]
pub(crate) fn articulated_resolve<T: Real>(sim: &Sim<T>, work: &mut Work<T>) {
    for l in (0..sim.links.len()).rev() {
        let link = &sim.links[l];
        let mut f = work.link_force[l];
        if link.has_children {
            for i in 0..6 {
                f[i] += work.art_force[l][i];
            }
        }
        if link.free_block {
            solve_free_root(link.dofs.start, link.tree, l, &f, work);
            continue;
        }
        for d in link.dofs.clone().rev() {
            let force = work.rhs[d] - dot6(&work.axis[d], &f);
            f = axpy6(&work.gain[d], force, &f);
            work.next[d] = force * work.pivot[d];
        }
        hand_down(link, &f, work);
    }
    accelerate(sim, work);
}

/// Adds a link's force to its parent's.
#[inline(always)]
fn hand_down<T: Real>(link: &Link<T::Scalar>, f: &V6<T>, work: &mut Work<T>) {
    if let Some(p) = link.parent {
        if link.first_to_parent {
            work.art_force[p] = *f;
        } else {
            for i in 0..6 {
                work.art_force[p][i] += f[i];
            }
        }
    }
}

/// Outward pass: joint accelerations given the links' accelerations below them.
#[inline(always)]
fn accelerate<T: Real>(sim: &Sim<T>, work: &mut Work<T>) {
    let z = T::zero();
    for l in 0..sim.links.len() {
        let link = &sim.links[l];
        if link.free_block {
            continue;
        }
        let mut a = match link.parent {
            Some(p) => work.link_acc[p],
            None => [z; 6],
        };
        for d in link.dofs.clone() {
            let x = work.next[d] - dot6(&work.gain[d], &a);
            work.next[d] = x;
            a = axpy6(&work.axis[d], x, &a);
        }
        work.link_acc[l] = a;
    }
}

/// Factorizes the symmetric 6x6 system of a free root.
#[inline(always)]
fn factor_free_root<T: Real>(d: usize, tree: usize, k: &Sym6<T>, work: &mut Work<T>) {
    let mut k = *k;
    for i in 0..3 {
        k[i] += work.diag[d + 3 + i];
        k[15 + i] += work.diag[d + i];
    }
    let mut a = [
        [k[0], k[3], k[4], k[6], k[7], k[8]],
        [k[3], k[1], k[5], k[9], k[10], k[11]],
        [k[4], k[5], k[2], k[12], k[13], k[14]],
        [k[6], k[9], k[12], k[15], k[18], k[19]],
        [k[7], k[10], k[13], k[18], k[16], k[20]],
        [k[8], k[11], k[14], k[19], k[20], k[17]],
    ];
    // eliminate the linear part first: its pivots are masses and well conditioned
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
    work.root_factor[tree] = a;
}

/// Solves the six degrees of freedom of a free root together.
#[inline(always)]
fn solve_free_root<T: Real>(d: usize, tree: usize, l: usize, f: &V6<T>, work: &mut Work<T>) {
    // torques are given along the body's axes, forces along the world's
    let (x, r, a) = (&work.rhs, &work.axis, &work.root_factor[tree]);
    let mut y = [T::zero(); 6];
    for i in 0..3 {
        let torque = r[d + 3][i].mul_add(x[d + 3], r[d + 4][i].mul_add(x[d + 4], r[d + 5][i] * x[d + 5]));
        y[i] = torque - f[i];
        y[3 + i] = x[d + i] - f[3 + i];
    }
    for p in (0..6).rev() {
        for i in (0..p).rev() {
            y[i] = a[p][i].neg_mul_add(y[p], y[i]);
        }
    }
    for p in 0..6 {
        let mut v = y[p] * a[p][p];
        for i in 0..p {
            v = a[p][i].neg_mul_add(y[i], v);
        }
        y[p] = v;
    }
    let spin = [y[0], y[1], y[2]];
    for i in 0..3 {
        work.next[d + i] = y[3 + i];
        let s = &work.axis[d + 3 + i];
        work.next[d + 3 + i] = dot(&[s[0], s[1], s[2]], &spin);
    }
    work.link_acc[l] = y;
}
