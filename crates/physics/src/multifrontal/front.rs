//! The numerical factorization of a crowd: one agent, in scalar arithmetic.
//!
//! A front is stored as the rows of its upper triangle. The six rows of its own link are complete. Eliminating a degree
//! of freedom with axis s takes `u = F s`, the pivot `1 / (s' u + diag)`, the gains `v = u pivot`, and leaves `F - u
//! v'`. This is the articulated-body recursion with more than one body.

use super::assembly::assemble;
use super::numbers::Numbers;
use super::plan::{Front, NONE, Plan};
use crate::algebra::spatial::*;
use crate::lanes::{Real, kernel_fn};
use crate::sim::Link;

kernel_fn! {
    /// Factorizes the stale fronts, and those that receive their remainders. Returns the number of computed entries of
    /// the factors.
    pub(crate) fn factorize<'a, S>(links: &'a [Link<S>], plan: &'a Plan<S>, n: &'a mut Numbers<S>) -> u64 {
        let mut entries = 0;
        for l in &plan.order {
            if !std::mem::replace(&mut n.stale[*l], false) {
                continue;
            }
            let front = &plan.fronts[*l];
            if front.target != NONE {
                n.stale[front.target] = true;
            }
            entries += (links[*l].dofs.len() * front.size) as u64;
            assemble(links, plan, n, *l);
            eliminate(&links[*l], plan, n, front);
        }
        entries
    }
}

kernel_fn! {
    /// Solves for the forces in `rhs`, `force` and `row_force`, into `next` and `acc`.
    pub(crate) fn solve<'a, S>(links: &'a [Link<S>], plan: &'a Plan<S>, n: &'a mut Numbers<S>) {
        for l in &plan.order {
            inward(&links[*l], plan, n, *l);
        }
        n.row_acc.fill(S::zero());
        for l in plan.order.iter().rev() {
            outward(&links[*l], plan, n, *l);
        }
    }
}

/// Eliminates the degrees of freedom of a link from its front.
#[inline(always)]
fn eliminate<S: Real>(link: &Link<S>, plan: &Plan<S>, n: &mut Numbers<S>, front: &Front) {
    let (size, stride) = (front.size, front.stride);
    let f = &mut n.matrix[front.matrix..front.matrix + size * stride];
    let count = link.dofs.len();
    let gains = &mut n.gains[front.gains..front.gains + count * stride];
    if n.u.len() < count * stride {
        n.u.resize(count * stride, S::zero());
    }
    let by_coordinates = link.free_block && !front.own_rows;
    for k in (0..count).rev() {
        let d = link.dofs.start + k;
        let (u, v) = (&mut n.u[k * stride..(k + 1) * stride], &mut gains[k * stride..(k + 1) * stride]);
        let pivot = if by_coordinates {
            // linear coordinates first: their pivots are masses and well-conditioned
            u.copy_from_slice(&f[k * stride..(k + 1) * stride]);
            u[k] + n.diag[if k < 3 { d + 3 } else { d - 3 }]
        } else {
            let s = &n.axis[d];
            combine(&f[..6 * stride], s, u);
            let mut sum = n.diag[d];
            if front.own_rows {
                for i in 0..front.row_count {
                    let c = plan.coefficients[front.coefficients + i * count + k];
                    let place = 6 * (1 + front.links) + i;
                    for j in 0..size {
                        let entry = f[j.min(place) * stride + j.max(place)];
                        u[j] = c.mul_add(entry, u[j]);
                    }
                }
                for i in 0..front.row_count {
                    let c = plan.coefficients[front.coefficients + i * count + k];
                    sum = c.mul_add(u[6 * (1 + front.links) + i], sum);
                }
            }
            for j in 0..6 {
                sum = s[j].mul_add(u[j], sum);
            }
            sum
        };
        let pivot = pivot.recip();
        n.pivot[d] = pivot;
        for (v, u) in v.iter_mut().zip(&*u) {
            *v = *u * pivot;
        }
        let rows = if front.own_rows { size } else { 6 };
        for i in 0..rows {
            let from = if i < 6 { 0 } else { i };
            subtract(&mut f[i * stride + from..(i + 1) * stride], [u[i]], [&v[from..]]);
        }
    }
    if front.own_rows || size == 6 {
        return;
    }
    match count {
        1 => trailing::<S, 1>(f, stride, &n.u, gains),
        2 => trailing::<S, 2>(f, stride, &n.u, gains),
        3 => trailing::<S, 3>(f, stride, &n.u, gains),
        6 => trailing::<S, 6>(f, stride, &n.u, gains),
        _ => (0..count).for_each(|k| trailing::<S, 1>(f, stride, &n.u[k * stride..], &gains[k * stride..])),
    }
}

/// `out = s' F` over six rows.
#[inline(always)]
fn combine<S: Real>(rows: &[S], s: &V6<S>, out: &mut [S]) {
    let n = out.len();
    let row = |i: usize| &rows[i * n..(i + 1) * n];
    let r = [row(0), row(1), row(2), row(3), row(4), row(5)];
    for c in 0..n {
        let mut x = s[0] * r[0][c];
        for i in 1..6 {
            x = s[i].mul_add(r[i][c], x);
        }
        out[c] = x;
    }
}

/// `row -= sum of u v`.
#[inline(always)]
fn subtract<S: Real, const K: usize>(row: &mut [S], u: [S; K], v: [&[S]; K]) {
    let n = row.len();
    let v = v.map(|v| &v[..n]);
    for c in 0..n {
        let mut x = row[c];
        for k in 0..K {
            x = u[k].neg_mul_add(v[k][c], x);
        }
        row[c] = x;
    }
}

/// Eliminates `K` degrees of freedom from the rows below a front's own six.
#[inline(always)]
fn trailing<S: Real, const K: usize>(f: &mut [S], stride: usize, u: &[S], v: &[S]) {
    for (i, row) in f.chunks_exact_mut(stride).enumerate().skip(6) {
        // whole vectors: entries below the diagonal are never read
        let from = i - i % 8;
        let u = std::array::from_fn::<S, K, _>(|k| u[k * stride + i]);
        let v = std::array::from_fn::<&[S], K, _>(|k| &v[k * stride + from..(k + 1) * stride]);
        subtract(&mut row[from..], u, v);
    }
}

/// Propagates the forces on a link inward.
#[inline(always)]
fn inward<S: Real>(link: &Link<S>, plan: &Plan<S>, n: &mut Numbers<S>, l: usize) {
    let front = &plan.fronts[l];
    let mut f = n.force[l];
    let (first, count) = (link.dofs.start, link.dofs.len());
    let by_coordinates = link.free_block && !front.own_rows;
    let others = &plan.others[front.others..front.others + front.links];
    let rows = &plan.rows[front.rows..front.rows + front.row_count];
    for k in (0..count).rev() {
        let d = first + k;
        let mut force = if by_coordinates {
            // torques are along the body's axes, forces along the world's
            let applied = if k < 3 {
                let (s, t) = (&n.axis[first + 3..], &n.rhs[first + 3..]);
                s[0][k].mul_add(t[0], s[1][k].mul_add(t[1], s[2][k] * t[2]))
            } else {
                n.rhs[d - 3]
            };
            applied - f[k]
        } else {
            n.rhs[d] - dot6(&n.axis[d], &f)
        };
        if front.own_rows {
            for (i, row) in rows.iter().enumerate() {
                let c = plan.coefficients[front.coefficients + i * count + k];
                force = c.neg_mul_add(n.row_force[*row], force);
            }
        }
        n.drive[d] = force * n.pivot[d];
        let gains = &n.gains[front.gains + k * front.stride..][..front.size];
        let (own, rest) = gains.split_at(6);
        for i in 0..6 {
            f[i] = own[i].mul_add(force, f[i]);
        }
        for (other, gain) in others.iter().zip(rest.chunks_exact(6)) {
            let sink = &mut n.force[*other];
            for i in 0..6 {
                sink[i] = gain[i].mul_add(force, sink[i]);
            }
        }
        for (row, gain) in rows.iter().zip(&rest[6 * front.links..]) {
            n.row_force[*row] = gain.mul_add(force, n.row_force[*row]);
        }
    }
    if let Some(p) = link.parent {
        for i in 0..6 {
            n.force[p][i] += f[i];
        }
    }
}

/// Accelerations of a link's joints, and its own.
#[inline(always)]
fn outward<S: Real>(link: &Link<S>, plan: &Plan<S>, n: &mut Numbers<S>, l: usize) {
    let front = &plan.fronts[l];
    let mut a = link.parent.map_or([S::zero(); 6], |p| n.acc[p]);
    let (first, count) = (link.dofs.start, link.dofs.len());
    let by_coordinates = link.free_block && !front.own_rows;
    let others = &plan.others[front.others..front.others + front.links];
    let rows = &plan.rows[front.rows..front.rows + front.row_count];
    for k in 0..count {
        let d = first + k;
        let gains = &n.gains[front.gains + k * front.stride..][..front.size];
        let (own, rest) = gains.split_at(6);
        let mut x = n.drive[d];
        for i in 0..6 {
            x = own[i].neg_mul_add(a[i], x);
        }
        for (other, gain) in others.iter().zip(rest.chunks_exact(6)) {
            let acc = &n.acc[*other];
            for i in 0..6 {
                x = gain[i].neg_mul_add(acc[i], x);
            }
        }
        for (row, gain) in rows.iter().zip(&rest[6 * front.links..]) {
            x = gain.neg_mul_add(n.row_acc[*row], x);
        }
        if by_coordinates {
            a[k] = x;
            continue;
        }
        n.next[d] = x;
        a = axpy6(&n.axis[d], x, &a);
        if front.own_rows {
            for (i, row) in rows.iter().enumerate() {
                let c = plan.coefficients[front.coefficients + i * count + k];
                n.row_acc[*row] = c.mul_add(x, n.row_acc[*row]);
            }
        }
    }
    if by_coordinates {
        for i in 0..3 {
            n.next[first + i] = a[3 + i];
            let s = &n.axis[first + 3 + i];
            n.next[first + 3 + i] = dot(&[s[0], s[1], s[2]], &[a[0], a[1], a[2]]);
        }
    }
    n.acc[l] = a;
}
