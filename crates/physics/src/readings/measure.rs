//! Measures quantities that a step does not need, in one call and in the order that the frames require.
//!
//! Forces belong to the frames from which the step computed them. All force readings therefore come before the frames
//! are updated to the current state.

use super::Readings;
use crate::lanes::{Kernel, Real};
use crate::sim::Sim;
use crate::state::{Group, Work};

/// Quantities to measure for a group besides positions and velocities.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MeasurePlan {
    /// After a step, keep the frames and velocities of bodies, geoms and sites of the last physics step, as MuJoCo's
    /// `mj_step` does: those of the state before it, or of the last stage of RK4. Otherwise they are updated to the
    /// current state.
    pub of_last_step: bool,
    /// [`Readings::cinert`], [`Readings::cvel`] and [`Readings::center_of_mass`].
    pub centers: bool,
    /// [`Readings::cfrc_ext`] after a step (MuJoCo's `mj_rnePostConstraint`). Includes `centers`.
    pub bodies: bool,
    /// [`Readings::qfrc_actuator`].
    pub actuators: bool,
    /// [`Readings::qfrc_constraint`]. Includes `actuators`.
    pub joints: bool,
    /// Sites for which [`Readings::touch_forces`] is measured.
    pub touch_sites: Vec<usize>,
}

impl<T: Real> Sim<T> {
    /// Measures a group after [`Sim::advance`] or [`Sim::forward`].
    pub fn measure(&self, work: &mut Work<T>, group: &Group<T>, plan: &MeasurePlan) {
        self.measure_forces(work, group, plan);
        if plan.bodies {
            self.measure_bodies(work, group);
        }
        if !plan.of_last_step {
            self.refresh(work, group);
        }
        // the centers for forces on bodies are those of the last step
        let measured = plan.bodies && plan.of_last_step;
        if (plan.centers || plan.bodies) && !measured {
            self.measure_centers(work, group);
        }
    }

    /// Measures a group in a state that was not reached by a step. The forces are those of this state, and are only
    /// evaluated as far as the plan needs them. [`Readings::cfrc_ext`] is not measured.
    pub fn measure_start(&self, work: &mut Work<T>, group: &Group<T>, plan: &MeasurePlan) {
        if plan.joints || !plan.touch_sites.is_empty() {
            self.forward(work, group);
        } else if plan.actuators {
            self.refresh_actuators(work, group);
        } else {
            self.refresh(work, group);
        }
        self.measure_forces(work, group, plan);
        if plan.centers || plan.bodies {
            self.measure_centers(work, group);
        }
    }

    /// Forces on joints and at touch sites.
    fn measure_forces(&self, work: &mut Work<T>, group: &Group<T>, plan: &MeasurePlan) {
        if plan.joints {
            self.measure_joints(work);
        } else if plan.actuators {
            self.measure_actuators(work);
        }
        work.readings.touch_forces.clear();
        if !plan.touch_sites.is_empty() {
            T::enter(TouchForces { sim: self, group, work, sites: &plan.touch_sites });
        }
    }
}

/// Normal forces at touch sites.
struct TouchForces<'a, T: Real> {
    sim: &'a Sim<T>,
    group: &'a Group<T>,
    work: &'a mut Work<T>,
    sites: &'a [usize],
}

impl<T: Real> Kernel<T> for TouchForces<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let TouchForces { sim, group, work, sites } = self;
        let mut out = std::mem::take(&mut work.readings.touch_forces);
        let readings = Readings::new(sim, group, work);
        for site in sites {
            out.push(readings.site_touch(*site));
        }
        work.readings.touch_forces = out;
    }
}

impl<'a, T: Real> Readings<'a, T> {
    /// Touch sensor forces on the plan's [`touch_sites`](MeasurePlan::touch_sites), N: the normal forces of the
    /// contacts of the site's body in the site's volume. A contact counts if the ray from its point against the force
    /// on the body hits the volume. A ray from inside always does.
    #[inline(always)]
    pub fn touch_forces(&self) -> &'a [T] {
        &self.work.readings.touch_forces
    }
}
