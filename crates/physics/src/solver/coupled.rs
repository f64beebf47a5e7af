//! Blocks that connect branches of the tree.
//!
//! The articulated-body factors are those of `H0 = M + (what fits the tree)`. Blocks between moving bodies add `B' W
//! B`, with few rows B: three per contact, and an agent has one or two such contacts. Beyond
//! [`MOST_COUPLED_ROWS`](crate::sim::MOST_COUPLED_ROWS), another factorization is used, lane by lane. With `W = R' R`,
//! the matrix identity of Sherman, Morrison and Woodbury gives the exact Newton point from the factors of `H0`:
//!
//! `f = -R' (1 + R B inv(H0) B' R')^-1 R (B inv(H0) b + u0)`,  `a = inv(H0) (b + B' f)`.
//!
//! The recursion is `inv(H0) = P' D P`, where P is the inward pass. So only the inward pass of each row is needed (a
//! *column*, one number per degree of freedom). Every product with `inv(H0)` is a sum over the degrees of freedom, and
//! the correction is added to `drive` before the outward pass. The small matrix is at least the identity, so its
//! Cholesky factors always exist. In lanes without a block the column is zero and the factor's row is that of the
//! identity, so nothing changes there, to the bit.
//!
//! There are two alternatives. Splitting `|j2 - j1|^2 <= 2 |j1|^2 + 2 |j2|^2` keeps the tree and needs no small matrix,
//! but costs several times as many iterations: 3.4 us for a step of the humanoid with self-collision, against 1.4 us. A
//! dense factorization of H costs about twice the recursion for 27 degrees of freedom, before the first contact.

use crate::algebra::planar::{Full, Planar, Space};
use crate::algebra::spatial::V6;
use crate::dynamics::reduce_free_root;
use crate::lanes::{Real, kernel_fn};
use crate::rows::{Block, Jacobian, at};
use crate::sim::Sim;
use crate::state::{Coupling, Work};

kernel_fn! {
    /// Computes the columns of all coupled blocks and factorizes. `fresh`: the factors of the tree changed.
    pub(crate) fn factorize<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>, fresh: bool) {
        if sim.planar {
            factorize_in::<T, Planar>(sim, work, fresh);
        } else {
            factorize_in::<T, Full>(sim, work, fresh);
        }
    }
}

#[inline(always)]
fn factorize_in<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>, fresh: bool) {
    let nv = sim.model.nv;
    let mut c = std::mem::replace(&mut work.solver.coupling, Coupling::new(0, 0));
    // blocks that exist only in crowded lanes are skipped: in the other lanes they are zero
    let trees = T::not(work.solver.crowded);
    let corrects = |b: &Block<T>| b.coupled && (T::all(trees) || T::any(T::and(b.on, trees)));
    c.rows = work.rows.blocks.iter().filter(|b| corrects(b)).map(|b| b.dim).sum();
    let (n, z) = (c.rows, T::zero());
    c.columns.resize(n * nv, z);
    c.scaled.resize(n * nv, z);
    c.offset.resize(n, z);
    c.y.resize(n, z);
    c.factor.resize(n * (n + 1) / 2, z);
    let mut first = 0;
    for b in 0..work.rows.blocks.len() {
        if !corrects(&work.rows.blocks[b]) {
            continue;
        }
        let dim = work.rows.blocks[b].dim;
        if fresh {
            mark_path(sim, &work.rows.blocks[b], &mut c.on_path);
            for k in 0..dim {
                let from = (first + k) * nv;
                let unit = (&mut c.rhs[..], &mut c.link_force[..]);
                inward::<T, S>(sim, work, b, k, unit, &c.on_path, &mut c.columns[from..from + nv]);
            }
        }
        scale_rows(&work.rows.blocks[b], &mut c, first, nv);
        first += dim;
    }
    // 1 + sum over the degrees of freedom
    for i in 0..n {
        for j in 0..=i {
            let (a, b) = (&c.scaled[i * nv..(i + 1) * nv], &c.scaled[j * nv..(j + 1) * nv]);
            let mut sum = if i == j { T::lit(1.0) } else { z };
            for ((a, b), dof) in a.iter().zip(b).zip(&work.dofs) {
                sum = (*a * dof.pivot).mul_add(*b, sum);
            }
            c.factor[at(i, j)] = sum;
        }
    }
    for j in 0..n {
        let mut pivot = c.factor[at(j, j)];
        for k in 0..j {
            pivot = c.factor[at(j, k)].neg_mul_add(c.factor[at(j, k)], pivot);
        }
        let inverse = pivot.max(T::lit(1e-20)).sqrt().recip();
        c.factor[at(j, j)] = inverse;
        for i in j + 1..n {
            let mut x = c.factor[at(i, j)];
            for k in 0..j {
                x = c.factor[at(i, k)].neg_mul_add(c.factor[at(j, k)], x);
            }
            c.factor[at(i, j)] = x * inverse;
        }
    }
    work.solver.coupling = c;
}

kernel_fn! {
    /// Corrects `drive` for the coupled blocks: `with_offset` at a Newton point, without it for a residual.
    pub(crate) fn correct<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>, with_offset: bool) {
        let nv = sim.model.nv;
        let Work { dofs, solver, .. } = work;
        let c = &mut solver.coupling;
        let n = c.rows;
        for i in 0..n {
            let column = &c.scaled[i * nv..(i + 1) * nv];
            let mut sum = if with_offset { c.offset[i] } else { T::zero() };
            for (x, dof) in column.iter().zip(dofs.iter()) {
                sum = x.mul_add(dof.drive, sum);
            }
            for k in 0..i {
                sum = c.factor[at(i, k)].neg_mul_add(c.y[k], sum);
            }
            c.y[i] = sum * c.factor[at(i, i)];
        }
        for i in (0..n).rev() {
            let mut sum = c.y[i];
            for k in i + 1..n {
                sum = c.factor[at(k, i)].neg_mul_add(c.y[k], sum);
            }
            c.y[i] = sum * c.factor[at(i, i)];
        }
        for i in 0..n {
            let column = &c.scaled[i * nv..(i + 1) * nv];
            for (x, dof) in column.iter().zip(dofs.iter_mut()) {
                dof.drive = (*x * dof.pivot).neg_mul_add(c.y[i], dof.drive);
            }
        }
    }
}

/// Marks the links whose joints a block can move, up to the roots.
pub(super) fn mark_path<T: Real>(sim: &Sim<T>, block: &Block<T>, on_path: &mut [bool]) {
    on_path.fill(false);
    match &block.jacobian {
        Jacobian::Points { sides, .. } => {
            for (link, _) in sides.iter().flat_map(|s| &s.links) {
                on_path[*link] = true;
            }
        }
        Jacobian::Joints(terms) => {
            for (dof, _) in terms {
                on_path[sim.dof_link[*dof]] = true;
            }
        }
    }
    mark_up(sim, on_path);
}

/// Marks the links below marked ones, down to the roots.
pub(super) fn mark_up<T: Real>(sim: &Sim<T>, on_path: &mut [bool]) {
    for l in (0..sim.links.len()).rev() {
        if let (true, Some(p)) = (on_path[l], sim.links[l].parent) {
            on_path[p] = true;
        }
    }
}

/// Inward pass of a unit force along row `k` of a block.
#[inline(always)]
fn inward<T: Real, S: Space>(
    sim: &Sim<T>,
    work: &Work<T>,
    b: usize,
    k: usize,
    (rhs, link_force): (&mut [T], &mut [V6<T>]),
    on_path: &[bool],
    out: &mut [T],
) {
    clear(sim, rhs, link_force, on_path);
    exert(&work.rows.blocks[b], k, rhs, link_force);
    carry_inward::<T, S>(sim, work, (rhs, link_force), on_path, out);
}

/// Removes all forces from the joints and from the links on the path.
#[inline(always)]
pub(super) fn clear<T: Real>(sim: &Sim<T>, rhs: &mut [T], link_force: &mut [V6<T>], on_path: &[bool]) {
    let z = T::zero();
    rhs.fill(z);
    for l in 0..sim.links.len() {
        if on_path[l] {
            link_force[l] = [z; 6];
        }
    }
}

/// Adds a unit force along row `k` of a block.
#[inline(always)]
pub(super) fn exert<T: Real>(block: &Block<T>, k: usize, rhs: &mut [T], link_force: &mut [V6<T>]) {
    match &block.jacobian {
        Jacobian::Points { sides, .. } => {
            for (s, side) in sides.iter().enumerate() {
                let w = block.wrench(k, &side.r);
                for (link, lanes) in &side.links {
                    for i in 0..6 {
                        // link forces are what the motion needs: the negative applied forces
                        let x = T::masked(*lanes, w[i]);
                        link_force[*link][i] += if s == 0 { x } else { -x };
                    }
                }
            }
        }
        Jacobian::Joints(terms) => {
            for (dof, coefficient) in terms {
                rhs[*dof] += *coefficient;
            }
        }
    }
}

/// Inward pass of forces on joints and links, along the path.
#[inline(always)]
pub(super) fn carry_inward<T: Real, S: Space>(
    sim: &Sim<T>,
    work: &Work<T>,
    (rhs, link_force): (&[T], &mut [V6<T>]),
    on_path: &[bool],
    out: &mut [T],
) {
    out.fill(T::zero());
    for l in (0..sim.links.len()).rev() {
        if !on_path[l] {
            continue;
        }
        let link = &sim.links[l];
        let mut f = link_force[l];
        let (dofs, rhs) = (&work.dofs[link.dofs.clone()], &rhs[link.dofs.clone()]);
        let out = &mut out[link.dofs.clone()];
        if link.free_block {
            let six = "a free joint has six degrees of freedom";
            let (dofs, rhs) = (dofs.try_into().expect(six), rhs.try_into().expect(six));
            out.copy_from_slice(&reduce_free_root(&work.solver.root_factor[link.tree], dofs, rhs, &f));
            continue;
        }
        for ((dof, rhs), out) in dofs.iter().zip(rhs).zip(out).rev() {
            let force = *rhs - S::dot(&dof.axis, &f);
            f = S::axpy(&dof.gain, force, &f);
            *out = force;
        }
        if let Some(p) = link.parent {
            S::add(&mut link_force[p], &f);
        }
    }
}

/// Multiplies a block's columns and offset by R, the triangular root of its stiffness (`W = R' R`).
#[inline(always)]
fn scale_rows<T: Real>(block: &Block<T>, c: &mut Coupling<T>, first: usize, nv: usize) {
    let (z, dim) = (T::zero(), block.dim);
    // lower triangle L with L L' = W, so R = L'; a direction without stiffness gets a zero column
    let mut l = [z; 21];
    for j in 0..dim {
        let mut pivot = block.stiffness[at(j, j)];
        for k in 0..j {
            pivot = l[at(j, k)].neg_mul_add(l[at(j, k)], pivot);
        }
        // the remainder of a direction after rounding
        let enough = (block.stiffness[at(j, j)] * T::lit(8.0 * T::EPSILON)).lt(pivot);
        let root = T::masked(enough, pivot.max(z).sqrt());
        let inverse = T::masked(enough, T::select(enough, root, T::lit(1.0)).recip());
        l[at(j, j)] = root;
        for i in j + 1..dim {
            let mut x = block.stiffness[at(i, j)];
            for k in 0..j {
                x = l[at(i, k)].neg_mul_add(l[at(j, k)], x);
            }
            l[at(i, j)] = x * inverse;
        }
    }
    for i in 0..dim {
        let mut sum = z;
        for j in i..dim {
            sum = l[at(j, i)].mul_add(block.u0[j], sum);
        }
        c.offset[first + i] = sum;
        for d in 0..nv {
            let mut sum = z;
            for j in i..dim {
                sum = l[at(j, i)].mul_add(c.columns[(first + j) * nv + d], sum);
            }
            c.scaled[(first + i) * nv + d] = sum;
        }
    }
}
