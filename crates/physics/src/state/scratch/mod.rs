//! Scratch memory of a step.

mod adhesion;
mod capped;
mod contacts;
mod dof;
mod drives;
mod forces;
mod implicit;
mod motion;
mod readings;
mod rk4;
mod slip;
mod solver;
mod strings;

pub(crate) use adhesion::Adhesion;
pub(crate) use capped::Capped;
pub(crate) use contacts::GeomContacts;
pub(crate) use dof::DofWork;
pub(crate) use drives::Drives;
pub(crate) use forces::Forces;
pub(crate) use implicit::Implicit;
pub(crate) use motion::Motion;
pub(crate) use readings::Measured;
pub(crate) use rk4::Rk4;
pub(crate) use slip::{Law, MOST_ROWS, Patch, Place, Slip, SlipLane};
pub(crate) use solver::Solver;
pub(crate) use strings::Strings;

use super::stats::SolverStats;
use crate::algebra::spatial::V6;
use crate::lanes::Real;
use crate::rows::ConstraintRows;
use crate::sim::Sim;

/// Scratch memory of a step, with the readings of the group stepped last. One per thread.
#[derive(Clone, Debug)]
pub struct Work<T: Real> {
    pub(crate) motion: Motion<T>,
    /// Per degree of freedom.
    pub(crate) dofs: Vec<DofWork<T>>,
    pub(crate) forces: Forces<T>,
    pub(crate) strings: Strings<T>,
    pub(crate) drives: Drives<T>,
    pub(crate) adhesion: Adhesion<T>,
    pub(crate) implicit: Implicit<T>,
    pub(crate) solver: Solver<T>,
    pub(crate) contacts: GeomContacts<T>,
    pub(crate) readings: Measured<T>,
    /// Rows of the last evaluation of the forces.
    pub(crate) rows: ConstraintRows<T>,
    /// Rows of the previous evaluation, if the current one [continues](Work::continues) it; else none. Active rows
    /// mostly stay active. (The previous accelerations are a worse guide: they suggest that a contact that was slowing
    /// something down is about to open.)
    pub(crate) past: ConstraintRows<T>,
    /// Whether the last evaluation of the forces was of the same group, a fraction of a step ago. That holds within a
    /// call of `Sim::advance`, and allows to reuse much of it.
    pub(crate) continues: bool,
    pub(crate) rk4: Rk4<T>,
    pub(crate) stats: SolverStats,
}

impl<T: Real> Work<T> {
    /// Scratch memory for a model.
    // not inlined, and so compiled once for all crates
    #[inline(never)]
    pub fn new(sim: &Sim<T>) -> Self {
        Work {
            motion: Motion::new(sim),
            dofs: vec![DofWork::new(); sim.model.nv],
            forces: Forces::new(sim),
            strings: Strings::new(sim),
            drives: Drives::new(sim),
            adhesion: Adhesion::new(sim),
            implicit: Implicit::new(sim),
            solver: Solver::new(sim),
            contacts: GeomContacts::new(sim),
            readings: Measured::new(sim),
            rows: ConstraintRows::with_capacity(sim.contacts.floor.len(), 2 * sim.limits.len(), sim.dry.len()),
            past: ConstraintRows::new(),
            continues: false,
            rk4: Rk4::new(sim),
            stats: SolverStats::default(),
        }
    }

    /// Makes room for new rows. The current ones become the [past](Work::past).
    #[inline(always)]
    pub(crate) fn put_rows_aside(&mut self) {
        std::mem::swap(&mut self.rows, &mut self.past);
        self.rows.clear();
        if !self.continues {
            self.past.clear();
        }
    }

    /// Counts of the constraint solver's work.
    pub fn stats(&self) -> SolverStats {
        self.stats
    }
}

/// The part of a link's bias force that remains for joints and constraints after external forces on the link: gravity
/// compensation, fluid and pushes. `applied` has these forces, and is empty if there are none.
#[inline(always)]
pub(crate) fn net_bias_force<T: Real>(bias_force: &[V6<T>], applied: &[V6<T>], link: usize) -> V6<T> {
    let mut f = bias_force[link];
    if let Some(applied) = applied.get(link) {
        for i in 0..6 {
            f[i] -= applied[i];
        }
    }
    f
}
