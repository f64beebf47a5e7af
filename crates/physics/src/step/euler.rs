//! Semi-implicit Euler: new velocities, and positions that move with them.

use crate::algebra::spatial::{V3, integrate_quat};
use crate::dynamics::advance_activations;
use crate::lanes::{Real, kernel_fn};
use crate::model::JointType;
use crate::sim::Sim;
use crate::state::{Group, Work};

kernel_fn! {
    /// Advances the state with the acceleration at the start of the step.
    pub(super) fn euler<'a, T>(sim: &'a Sim<T>, group: &'a mut Group<T>, work: &'a mut Work<T>) {
        integrate(sim, group, work, &work.solver.qacc);
    }
}

/// Velocities, activations and positions at the end of a step with the acceleration `qacc`.
#[inline(always)]
pub(super) fn integrate<T: Real>(sim: &Sim<T>, group: &mut Group<T>, work: &Work<T>, qacc: &[T]) {
    let dt = T::splat(sim.dt);
    group.qacc_warmstart.copy_from_slice(&work.solver.qacc);
    for (v, a) in group.qvel.iter_mut().zip(qacc) {
        *v = a.mul_add(dt, *v);
    }
    advance_activations(sim, &mut group.act, &work.forces.act_dot);
    integrate_positions(sim, &mut group.qpos, &group.qvel, dt);
}

/// Moves `qpos` along `qvel` for `h` seconds. Quaternions stay normalized.
#[inline(always)]
pub(super) fn integrate_positions<T: Real>(sim: &Sim<T>, qpos: &mut [T], qvel: &[T], h: T) {
    for joint in &sim.joints {
        let (q, d) = (joint.qpos, joint.dof);
        match joint.kind {
            JointType::Hinge | JointType::Slide => qpos[q] = qvel[d].mul_add(h, qpos[q]),
            JointType::Ball => turn(&mut qpos[q..q + 4], &[qvel[d], qvel[d + 1], qvel[d + 2]], h),
            JointType::Free => {
                for i in 0..3 {
                    qpos[q + i] = qvel[d + i].mul_add(h, qpos[q + i]);
                }
                turn(&mut qpos[q + 3..q + 7], &[qvel[d + 3], qvel[d + 4], qvel[d + 5]], h);
            }
        }
    }
}

#[inline(always)]
fn turn<T: Real>(q: &mut [T], w: &V3<T>, h: T) {
    let r = integrate_quat(&[q[0], q[1], q[2], q[3]], w, h);
    q.copy_from_slice(&r);
}
