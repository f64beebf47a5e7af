//! The new forces and accelerations.

use crate::algebra::planar::{Full, Planar, Space};
use crate::dynamics::accelerate;
use crate::lanes::{Real, kernel_fn};
use crate::sim::Sim;
use crate::state::{Law, MOST_ROWS, Patch, Place, Slip, Work};

/// Writes the new forces into the rows, and moves the accelerations.
pub(super) fn apply<T: Real>(sim: &Sim<T>, work: &mut Work<T>, slip: &mut Slip<T>) {
    let Slip { lanes, change, .. } = slip;
    for (index, lane) in lanes.iter().enumerate() {
        for p in &lane.patches {
            write(work, index, p);
        }
        for (to, from) in change.iter_mut().zip(&lane.change) {
            to.set(index, T::scalar(*from));
        }
    }
    if sim.planar {
        planar_move(sim, work, slip);
    } else {
        full_move(sim, work, slip);
    }
}

/// Writes the forces of a patch into its row.
fn write<T: Real>(work: &mut Work<T>, lane: usize, p: &Patch) {
    let mut force = p.force;
    if p.law == Law::Pyramid {
        for k in 0..MOST_ROWS {
            force[k] *= 2.0 * p.mu[k];
        }
    }
    let rows = &mut work.rows;
    let (to, from) = match p.place {
        Place::Dry(i) => (std::slice::from_mut(&mut rows.dry[i].force), 0),
        Place::Floor(i) => (&mut rows.contacts[i].force[..], 1),
        Place::Block(i) => (&mut rows.blocks[i].force[..], usize::from(p.law != Law::Dry)),
    };
    for (to, from) in to[from..].iter_mut().zip(force).take(p.dim) {
        to.set(lane, T::scalar(from));
    }
}

kernel_fn! {
    fn full_move<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>, slip: &'a Slip<T>) {
        move_lanes::<T, Full>(sim, work, slip);
    }
}
kernel_fn! {
    fn planar_move<'a, T>(sim: &'a Sim<T>, work: &'a mut Work<T>, slip: &'a Slip<T>) {
        move_lanes::<T, Planar>(sim, work, slip);
    }
}

/// Adds the effect of the forces' changes to the accelerations.
#[inline(always)]
fn move_lanes<T: Real, S: Space>(sim: &Sim<T>, work: &mut Work<T>, slip: &Slip<T>) {
    for (dof, change) in work.dofs.iter_mut().zip(&slip.change) {
        dof.drive = *change * dof.pivot;
    }
    accelerate::<T, S>(sim, work);
    let solver = &mut work.solver;
    for (a, x) in solver.qacc.iter_mut().zip(&solver.solution) {
        *a = T::select(slip.held, *a + *x, *a);
    }
}
