//! The parts of the iteration that loop over all rows.

use crate::lanes::{Real, kernel_fn};
use crate::rows::{Block, Jacobian, RowCost, Source};
use crate::sim::Sim;
use crate::state::{Capped, Work};

kernel_fn! {
    /// Marks the links that blocks act on.
    pub(super) fn mark_links<'a, T>(work: &'a mut Work<T>) {
        for b in work.rows.blocks.iter() {
            if let Jacobian::Points { sides, .. } = &b.jacobian {
                for (link, _) in sides.iter().flat_map(|s| &s.links) {
                    work.solver.in_contact[*link] = true;
                }
            }
        }
    }
}

kernel_fn! {
    /// Computes the row values for the accelerations `qacc` and `link_acc`, and their total cost.
    pub(super) fn measure<'a, T>(work: &'a mut Work<T>) -> T {
        let mut cost = T::zero();
        for row in work.rows.contacts.iter_mut() {
            let ja = row.of_motion(&work.solver.link_acc[row.link]);
            for i in 0..3 {
                row.u[i] = ja[i] + row.u0[i];
            }
            cost += row.cost();
        }
        for row in work.rows.limits.iter_mut() {
            row.u = row.sign.mul_add(work.solver.qacc[row.dof], row.u0);
            cost += row.cost();
        }
        for row in work.rows.dry.iter_mut() {
            row.u = work.solver.qacc[row.dof] + row.u0;
            cost += row.cost();
        }
        for b in work.rows.blocks.iter_mut() {
            let ja = b.of_motion(&work.solver.link_acc, &work.solver.qacc);
            for k in 0..b.dim {
                b.u[k] = ja[k] + b.u0[k];
            }
            cost += b.cost();
        }
        cost
    }
}

kernel_fn! {
    /// Stores the row values for [`choose`].
    pub(super) fn keep<'a, T>(work: &'a mut Work<T>) {
        for row in work.rows.contacts.iter_mut() {
            row.next = row.u;
        }
        for row in work.rows.limits.iter_mut() {
            row.next = row.u;
        }
        for row in work.rows.dry.iter_mut() {
            row.next = row.u;
        }
        for b in work.rows.blocks.iter_mut() {
            b.next = b.u;
        }
    }
}

kernel_fn! {
    /// Restores the stored row values in the lanes `kept`.
    pub(super) fn choose<'a, T>(work: &'a mut Work<T>, kept: T::Mask) {
        for row in work.rows.contacts.iter_mut() {
            for i in 0..3 {
                row.u[i] = T::select(kept, row.next[i], row.u[i]);
            }
        }
        for row in work.rows.limits.iter_mut() {
            row.u = T::select(kept, row.next, row.u);
        }
        for row in work.rows.dry.iter_mut() {
            row.u = T::select(kept, row.next, row.u);
        }
        for b in work.rows.blocks.iter_mut() {
            for k in 0..b.dim {
                b.u[k] = T::select(kept, b.next[k], b.u[k]);
            }
        }
    }
}

kernel_fn! {
    /// Updates the zones and forces of the rows at the current point.
    pub(super) fn push<'a, T>(work: &'a mut Work<T>) {
        let all = T::not(T::none());
        for row in work.rows.contacts.iter_mut() {
            row.activate(all);
            row.force = row.true_force(&row.u);
        }
        for row in work.rows.limits.iter_mut() {
            row.activate(all);
            row.force = row.true_force(row.u);
        }
        for row in work.rows.dry.iter_mut() {
            row.activate(all);
            row.force = row.true_force(row.u);
        }
        for b in work.rows.blocks.iter_mut() {
            b.activate(all);
            b.moved = all;
            // the force of inertia is one of the masses
            b.force = if b.source == Source::TendonInertia { [T::zero(); 6] } else { b.true_force(&b.u) };
        }
    }
}

kernel_fn! {
    /// Computes the changes of the rows' values along the direction, stored instead of their Newton points.
    pub(super) fn measure_way<'a, T>(work: &'a mut Work<T>, c: &'a Capped<T>) {
        for row in work.rows.contacts.iter_mut() {
            row.next = row.of_motion(&c.way[row.link]);
        }
        for row in work.rows.limits.iter_mut() {
            row.next = row.sign * c.direction[row.dof];
        }
        for row in work.rows.dry.iter_mut() {
            row.next = c.direction[row.dof];
        }
        for b in work.rows.blocks.iter_mut() {
            b.next = b.of_motion(&c.way, &c.direction);
        }
    }
}

kernel_fn! {
    /// By tree, the cost at the fractions `alpha` of the step minus the cost at its start, with its derivatives.
    pub(super) fn evaluate<'a, T>(sim: &'a Sim<T>, work: &'a Work<T>, c: &'a mut Capped<T>) {
        let half = T::lit(0.5);
        for tree in 0..sim.trees {
            let (alpha, [first, second]) = (c.alpha[tree], c.masses[tree]);
            let rise = alpha * (half * alpha).mul_add(second, first);
            c.sums[tree] = [rise, alpha.mul_add(second, first), second];
        }
        for row in &work.rows.contacts {
            let tree = sim.links[row.link].tree;
            add(&mut c.sums[tree], row, c.alpha[tree]);
        }
        for row in &work.rows.limits {
            let tree = sim.links[row.link].tree;
            add(&mut c.sums[tree], row, c.alpha[tree]);
        }
        for row in &work.rows.dry {
            let tree = sim.links[row.link].tree;
            add(&mut c.sums[tree], row, c.alpha[tree]);
        }
        for (i, b) in work.rows.blocks.iter().enumerate() {
            let homes = &c.homes[c.first_home[i]..c.first_home[i + 1]];
            let mut alpha = T::zero();
            for (tree, lanes) in homes {
                alpha = T::select(*lanes, c.alpha[*tree], alpha);
            }
            let mut sums = [T::zero(); 3];
            add(&mut sums, b, alpha);
            for (tree, lanes) in homes {
                for k in 0..3 {
                    c.sums[*tree][k] += T::masked(*lanes, sums[k]);
                }
            }
        }
    }
}

#[inline(always)]
fn add<T: Real>(sums: &mut [T; 3], row: &impl RowCost<T>, alpha: T) {
    let along = row.along(alpha);
    for k in 0..3 {
        sums[k] += along[k];
    }
}

kernel_fn! {
    /// Moves the rows of unfinished islands.
    pub(super) fn advance<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>, c: &'a Capped<T>) {
        for row in work.rows.contacts.iter_mut() {
            let tree = sim.links[row.link].tree;
            let (alpha, live) = (c.alpha[tree], T::from_bits(c.live[tree]));
            for i in 0..3 {
                row.u[i] = step(alpha, live, row.u[i], row.next[i]);
            }
        }
        for row in work.rows.limits.iter_mut() {
            let tree = sim.links[row.link].tree;
            row.u = step(c.alpha[tree], T::from_bits(c.live[tree]), row.u, row.next);
        }
        for row in work.rows.dry.iter_mut() {
            let tree = sim.links[row.link].tree;
            row.u = step(c.alpha[tree], T::from_bits(c.live[tree]), row.u, row.next);
        }
        for (i, b) in work.rows.blocks.iter_mut().enumerate() {
            for (tree, lanes) in &c.homes[c.first_home[i]..c.first_home[i + 1]] {
                move_block(b, c.alpha[*tree], T::and(*lanes, T::from_bits(c.live[*tree])));
            }
        }
    }
}

#[inline(always)]
fn move_block<T: Real>(b: &mut Block<T>, alpha: T, live: T::Mask) {
    for k in 0..b.dim {
        b.u[k] = step(alpha, live, b.u[k], b.next[k]);
    }
}

#[inline(always)]
fn step<T: Real>(alpha: T, live: T::Mask, here: T, way: T) -> T {
    T::select(live, alpha.mul_add(way, here), here)
}
