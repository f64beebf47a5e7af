//! One step, with MuJoCo's names for its stages: [`forward`] computes the acceleration, and an integrator ([`euler`],
//! [`implicitfast`], [`rk4`]) advances the state. [`implicit_tendons`] is the part of `implicitfast` for tendons, [`implicit`]
//! that of the integrator `implicit` and of media.

mod euler;
mod forward;
mod implicit;
mod implicit_tendons;
mod implicitfast;
mod rk4;

pub use forward::Stage;

use crate::lanes::Real;
use crate::sim::Sim;
use crate::state::{Group, Work};

impl<T: Real> Sim<T> {
    /// Advances every agent of a group by `substeps` steps with its current controls, then updates the readings
    /// (positions and velocities).
    pub fn step(&self, work: &mut Work<T>, group: &mut Group<T>, substeps: usize) {
        self.advance(work, group, substeps);
        self.refresh(work, group);
    }

    /// Like [`Sim::step`], without updating the readings. They show the state from which the last physics step computed
    /// its forces, as after MuJoCo's `mj_step` (with RK4, the state of its last stage).
    ///
    /// Within one call, a step reuses results of the previous step, so one call is faster than several calls of one
    /// step each. The results are the same up to rounding. Equal bits require equal calls.
    pub fn advance(&self, work: &mut Work<T>, group: &mut Group<T>, substeps: usize) {
        for touched in work.contacts.touched.iter_mut() {
            *touched = T::none();
        }
        work.continues = false;
        group.swap_places(self, work);
        for _ in 0..substeps {
            if self.rk4 {
                self.rk4(work, group);
            } else {
                self.forward_again(work, group);
                self.finish_step(work, group);
            }
            group.move_obstacles(self.dt);
        }
        group.swap_places(self, work);
    }

    /// The end of a step after [`Sim::forward`], by [`euler`] or [`implicitfast`].
    #[doc(hidden)]
    pub fn finish_step(&self, work: &mut Work<T>, group: &mut Group<T>) {
        if self.implicit_damping {
            self.implicitfast(work, group);
        } else {
            euler::euler(self, group, work);
        }
    }
}
