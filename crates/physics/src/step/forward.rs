//! The acceleration of a state, stage by stage.

use crate::algebra::planar::{Full, Planar};
use crate::collision::{adhere, collide_floor, collide_pairs};
use crate::constraint::{equality_blocks, joint_rows, tendon_blocks, tendon_inertia};
use crate::dynamics::*;
use crate::lanes::{Real, kernel_fn};
use crate::sim::Sim;
use crate::solver::{prevent_slip, solve, solve_capped};
use crate::state::{Group, Work};

/// Frames, axes, inertias.
#[inline(always)]
fn fwd_position<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    kinematics(sim, group, work);
}

/// Velocities, and the bias forces that they and gravity need.
#[inline(always)]
fn fwd_velocity<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    velocities(sim, group, work);
}

/// Springs and dampers of joints and tendons, which MuJoCo assigns to `fwd_velocity`.
#[inline(always)]
fn passive<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    measure_tendons(sim, group, work);
    joint_passive(sim, group, work);
    tendon_passive(sim, work);
}

/// Forces of the actuators.
#[inline(always)]
fn fwd_actuation<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    actuation(sim, group, work);
}

// stages that always follow each other share a kernel, which speeds up small models
kernel_fn! {
    /// Positions and velocities of bodies.
    fn motion<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        fwd_position(sim, group, work);
        fwd_velocity(sim, group, work);
    }
}
kernel_fn! {
    /// Forces of joints, tendons and actuators.
    fn joint_forces<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        passive(sim, group, work);
        fwd_actuation(sim, group, work);
    }
}
kernel_fn! {
    /// Rows of points above a level floor, of limits and of dry friction.
    fn common_rows<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        work.put_rows_aside();
        collide_floor(sim, group, work);
        joint_rows(sim, group, work);
    }
}
kernel_fn! {
    /// Contacts that are not points above a level floor.
    fn pair_rows<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        collide_pairs(sim, group, work);
    }
}
kernel_fn! {
    /// Constrained acceleration.
    fn fwd_constraint<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        solve::<T, Full>(sim, group, work);
    }
}
kernel_fn! {
    /// The same for a planar model.
    fn planar_fwd_constraint<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        solve::<T, Planar>(sim, group, work);
    }
}

kernel_fn! {
    /// Forward dynamics with MuJoCo's own iteration, for models with a low cap.
    fn capped_fwd_constraint<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        solve_capped::<T, Full>(sim, group, work);
    }
}
kernel_fn! {
    /// The same for a planar model.
    fn planar_capped_fwd_constraint<'a, T>(sim: &'a Sim<T>, group: &'a Group<T>, work: &'a mut Work<T>) {
        solve_capped::<T, Planar>(sim, group, work);
    }
}

/// A part of [`Sim::forward`]. Public for benchmarks of single stages.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub enum Stage {
    /// Frames, velocities, passive and actuator forces, forces on links.
    Smooth,
    /// Collision detection and the rows of all constraints: `make_constraint`.
    MakeConstraint,
    /// Constrained acceleration: `fwd_constraint`.
    FwdConstraint,
}

impl<T: Real> Sim<T> {
    /// Computes accelerations and constraint forces at the current state. The state does not change.
    pub fn forward(&self, work: &mut Work<T>, group: &Group<T>) {
        work.continues = false;
        self.forward_again(work, group);
    }

    /// Like [`Sim::forward`], for a group that was advanced a little since the last evaluation if [`Work::continues`]
    /// says so.
    pub(super) fn forward_again(&self, work: &mut Work<T>, group: &Group<T>) {
        self.smooth(work, group);
        self.make_constraint(work, group);
        self.fwd_constraint(work, group);
        work.continues = true;
    }

    /// One part of [`Sim::forward`], after the parts before it.
    #[doc(hidden)]
    pub fn run_stage(&self, stage: Stage, work: &mut Work<T>, group: &Group<T>) {
        work.continues = false;
        match stage {
            Stage::Smooth => self.smooth(work, group),
            Stage::MakeConstraint => self.make_constraint(work, group),
            Stage::FwdConstraint => self.fwd_constraint(work, group),
        }
    }

    fn smooth(&self, work: &mut Work<T>, group: &Group<T>) {
        self.refresh(work, group);
        self.joint_forces(work, group);
        work.forces.link_applied.clear();
        let medium = !self.drags.is_empty() || !self.ellipsoid_drags.is_empty();
        if !self.gravcomp.is_empty() || medium || !group.xfrc_applied.is_empty() {
            link_forces(self, group, work);
        }
    }

    fn joint_forces(&self, work: &mut Work<T>, group: &Group<T>) {
        if !self.actuated_gravcomp.is_empty() {
            joint_gravity_compensation(self, group, work);
        }
        joint_forces(self, group, work);
    }

    fn make_constraint(&self, work: &mut Work<T>, group: &Group<T>) {
        common_rows(self, group, work);
        if self.inertia_blocks > 0 {
            tendon_inertia(self, work);
        }
        if !self.equalities.is_empty() {
            equality_blocks(self, group, work);
        }
        if !self.tendons.is_empty() || !self.ball_limits.is_empty() {
            tendon_blocks(self, group, work);
        }
        if !self.contacts.pairs.is_empty() {
            pair_rows(self, group, work);
        }
        if !self.adhesions.is_empty() {
            adhere(self, work);
        }
    }

    fn fwd_constraint(&self, work: &mut Work<T>, group: &Group<T>) {
        match (self.planar, self.capped.is_some()) {
            (false, false) => fwd_constraint(self, group, work),
            (true, false) => planar_fwd_constraint(self, group, work),
            (false, true) => capped_fwd_constraint(self, group, work),
            (true, true) => planar_capped_fwd_constraint(self, group, work),
        }
        if self.no_slip.is_some() {
            prevent_slip(self, work);
        }
    }

    /// Recomputes positions and velocities of bodies at the current state.
    pub fn refresh(&self, work: &mut Work<T>, group: &Group<T>) {
        motion(self, group, work);
        if !self.strings.is_empty() {
            measure_strings(self, group, work);
        }
        if !self.drives.is_empty() {
            measure_drives(self, group, work);
        }
    }

    /// Like [`Sim::refresh`], including the forces of the actuators.
    pub(crate) fn refresh_actuators(&self, work: &mut Work<T>, group: &Group<T>) {
        self.refresh(work, group);
        self.joint_forces(work, group);
        if !self.adhesions.is_empty() {
            work.continues = false;
            self.make_constraint(work, group);
        }
    }
}
