//! The solver's stages over all [`Block`]s.
//!
//! Many models have no blocks. Separate functions keep the solver's inner loop small.

use crate::algebra::spatial::*;
use crate::lanes::{Real, kernel_fn};
use crate::rows::{Block, Jacobian, NewtonStep, Row, Side, at};
use crate::sim::Sim;
use crate::state::Work;

/// Whether some block does not fit the tree.
pub(super) fn any_coupled<T: Real>(work: &Work<T>) -> bool {
    work.rows.blocks.iter().any(|b| b.coupled)
}

kernel_fn! {
    /// Marks the touched links and recalls zones. Returns whether all zones are known.
    pub(crate) fn recall<'a, T>(work: &'a mut Work<T>) -> bool {
        let Work { rows, past, solver, .. } = work;
        let mut known = true;
        let mut at = 0;
        for b in rows.blocks.iter_mut() {
            if let Jacobian::Points { sides, .. } = &b.jacobian {
                for (link, _) in sides.iter().flat_map(|s| &s.links) {
                    solver.in_contact[*link] = true;
                }
            }
            b.recall(&past.blocks, &mut at);
            known &= !T::any(T::and(b.on, T::not(b.recalled)));
        }
        known
    }
}

kernel_fn! {
    /// Values and zones at the warm start, for blocks without recalled zones.
    pub(crate) fn start<'a, T>(work: &'a mut Work<T>, known: bool) {
        for b in work.rows.blocks.iter_mut() {
            if !known {
                let ja = b.of_motion(&work.solver.link_acc, &work.solver.qacc);
                for k in 0..b.dim {
                    b.u[k] = ja[k] + b.u0[k];
                }
            }
            b.force = [T::zero(); 6];
            b.activate(T::not(b.recalled));
        }
    }
}

kernel_fn! {
    /// The blocks' share of the system: everything if they fit the tree, only constant forces if they are coupled.
    pub(crate) fn assemble<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>) {
        for b in work.rows.blocks.iter() {
            match &b.jacobian {
                Jacobian::Joints(terms) => {
                    for (dof, coefficient) in terms {
                        if work.solver.stale[sim.dof_link[*dof]] {
                            let rhs = &mut work.dofs[*dof].rhs;
                            *rhs = coefficient.mul_add(b.hold, *rhs);
                        }
                    }
                }
                Jacobian::Points { sides, .. } if !b.coupled => {
                    if sides[1].links.iter().any(|(l, _)| work.solver.stale[*l]) {
                        let (side, stale) = (&sides[1], &work.solver.stale);
                        let sums = (&mut work.solver.stiffness[..], &mut work.solver.wrench[..]);
                        match b.dim {
                            1 => add_to_links::<T, 1>(b, side, stale, sums),
                            3 => add_to_links::<T, 3>(b, side, stale, sums),
                            4 => add_to_links::<T, 4>(b, side, stale, sums),
                            _ => add_to_links::<T, 6>(b, side, stale, sums),
                        }
                    }
                }
                Jacobian::Points { .. } => {}
            }
        }
    }
}

/// Adds the stiffness and right-hand side of a block of `N` rows to the links that carry its second side.
#[inline(always)]
fn add_to_links<T: Real, const N: usize>(
    b: &Block<T>,
    side: &Side<T>,
    stale: &[bool],
    (stiffness, wrench): (&mut [Sym6<T>], &mut [V6<T>]),
) {
    // G W G' for the motion directions G of the rows
    let mut k = [T::zero(); 21];
    let mut columns = [[T::zero(); 6]; N];
    for i in 0..N {
        columns[i] = b.wrench(i, &side.r);
    }
    for i in 0..N {
        let mut h = [T::zero(); 6];
        for j in 0..N {
            let w = if j <= i { b.stiffness[at(i, j)] } else { b.stiffness[at(j, i)] };
            h = axpy6(&columns[j], -w, &h);
        }
        // the sum over all rows is symmetric, and only one triangle is stored
        sym6_sub_outer(&mut k, &columns[i], &h);
    }
    let w = b.total_wrench(&b.linear_force(&b.u0), &side.r);
    for (link, lanes) in &side.links {
        if stale[*link] {
            for i in 0..21 {
                stiffness[*link][i] += T::masked(*lanes, k[i]);
            }
            for i in 0..6 {
                wrench[*link][i] += T::masked(*lanes, w[i]);
            }
        }
    }
}

kernel_fn! {
    /// Moves to the Newton point. Returns lanes where some block's linear model does not hold there.
    pub(crate) fn newton_point<'a, T>(work: &'a mut Work<T>) -> T::Mask {
        let mut changed = T::none();
        for b in work.rows.blocks.iter_mut() {
            changed = T::or(changed, b.newton_point(&work.solver.link_acc, &work.solver.solution));
        }
        changed
    }
}

kernel_fn! {
    /// Moves the lanes and marks the links whose system changed.
    pub(crate) fn advance<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>, step: NewtonStep<T>) {
        for b in work.rows.blocks.iter_mut() {
            let changed = b.advance(&step);
            if !T::any(changed) {
                continue;
            }
            b.moved = T::or(b.moved, changed);
            match &b.jacobian {
                Jacobian::Points { sides, .. } if !b.coupled => {
                    for (link, lanes) in &sides[1].links {
                        work.solver.stale[*link] |= T::any(T::and(*lanes, changed));
                    }
                }
                Jacobian::Joints(terms) => {
                    for (dof, _) in terms {
                        work.solver.stale[sim.dof_link[*dof]] = true;
                    }
                }
                Jacobian::Points { .. } => {}
            }
        }
    }
}

kernel_fn! {
    /// Sums of [`Row::ends`].
    pub(crate) fn ends<'a, T>(work: &'a Work<T>) -> [T; 3] {
        let mut sums = [T::zero(); 3];
        for b in work.rows.blocks.iter() {
            let e = b.ends();
            for i in 0..3 {
                sums[i] += e[i];
            }
        }
        sums
    }
}

kernel_fn! {
    /// Sums of [`Row::slope`].
    pub(crate) fn slope<'a, T>(work: &'a Work<T>, alpha: T) -> [T; 2] {
        let mut sums = [T::zero(); 2];
        for b in work.rows.blocks.iter() {
            let s = b.slope(alpha);
            sums[0] += s[0];
            sums[1] += s[1];
        }
        sums
    }
}

kernel_fn! {
    /// True forces at the current point.
    pub(crate) fn true_forces<'a, T>(work: &'a mut Work<T>) {
        for b in work.rows.blocks.iter_mut() {
            b.force = b.true_force(&b.u);
        }
    }
}

kernel_fn! {
    /// Adds the refinement's accelerations to the row values of the lanes in `arrived`.
    pub(crate) fn add_refinement<'a, T>(work: &'a mut Work<T>, arrived: T::Mask) {
        for b in work.rows.blocks.iter_mut() {
            let du = b.of_motion(&work.solver.link_acc, &work.solver.solution);
            for k in 0..b.dim {
                b.u[k] += T::masked(arrived, du[k]);
            }
        }
    }
}

kernel_fn! {
    /// Applies the blocks' forces to links and joints.
    pub(crate) fn apply_forces<'a, T>(work: &'a mut Work<T>) {
        for b in work.rows.blocks.iter() {
            b.exert_on_links(&mut work.solver.wrench);
            for (dof, coefficient) in b.joint_terms() {
                let rhs = &mut work.dofs[*dof].rhs;
                *rhs = coefficient.mul_add(b.force[0], *rhs);
            }
        }
    }
}

kernel_fn! {
    /// Adds the normal forces of contacts with the static world to their geoms.
    pub(crate) fn report_forces<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>) {
        for b in work.rows.blocks.iter().filter(|b| !b.coupled) {
            for (pair, lanes) in &b.members {
                let geom = sim.contacts.pair(&sim.geoms, *pair).moving();
                work.contacts.normal_force[geom] += T::masked(*lanes, b.force[0]);
            }
        }
    }
}
