//! Classical Runge-Kutta over the whole dynamics.

use super::euler::integrate_positions;
use crate::algebra::spatial::{cross, dot};
use crate::dynamics::advance_activations;
use crate::lanes::{Kernel, Real};
use crate::model::JointType;
use crate::sim::Sim;
use crate::state::{Group, Work};

impl<T: Real> Sim<T> {
    /// A step of four stages.
    pub(super) fn rk4(&self, work: &mut Work<T>, group: &mut Group<T>) {
        work.rk4.qpos.copy_from_slice(&group.qpos);
        work.rk4.qvel.copy_from_slice(&group.qvel);
        work.rk4.act.copy_from_slice(&group.act);
        let tableau = [(1.0, 0.0, 0.5), (2.0, 0.5, 0.5), (2.0, 0.5, 1.0), (1.0, 1.0, 0.0)];
        for (stage, (weight, reach_before, reach)) in tableau.into_iter().enumerate() {
            self.forward_again(work, group);
            T::enter(RkStage { sim: self, work, group, first: stage == 0, weight, reach_before, reach });
        }
    }
}

/// Adds one stage's derivatives to the weighted sums and moves to the next stage's state, or to the end of the step.
struct RkStage<'a, T: Real> {
    sim: &'a Sim<T>,
    work: &'a mut Work<T>,
    group: &'a mut Group<T>,
    first: bool,
    weight: f64,
    /// Fraction of the step at which this stage was taken.
    reach_before: f64,
    /// Fraction of the step at which the next stage is taken; 0 after the last.
    reach: f64,
}
impl<T: Real> Kernel<T> for RkStage<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let RkStage { sim, work, group, first, weight, reach_before, reach } = self;
        let Work { rk4: rk, solver, forces, .. } = work;
        let (qacc, act_dot) = (&solver.qacc, &forces.act_dot);
        let dt = T::splat(sim.dt);
        let w = T::lit(weight);
        // velocities in the coordinates of the start's tangent space
        rk.rate.copy_from_slice(&group.qvel);
        if !first {
            correct_rotations(sim, &rk.rate_before, &mut rk.rate, dt * T::lit(reach_before));
        }
        for d in 0..sim.model.nv {
            let (v, a) = (rk.rate[d] * w, qacc[d] * w);
            rk.qvel_sum[d] = if first { v } else { rk.qvel_sum[d] + v };
            rk.qacc_sum[d] = if first { a } else { rk.qacc_sum[d] + a };
        }
        for (s, rate) in rk.act_dot_sum.iter_mut().zip(act_dot) {
            *s = if first { *rate * w } else { rate.mul_add(w, *s) };
        }
        // if the solver's path matters, all stages start from the last step's acceleration, as in MuJoCo
        if sim.capped.is_none() || reach == 0.0 {
            group.qacc_warmstart.copy_from_slice(qacc);
        }
        group.qpos.copy_from_slice(&rk.qpos);
        if reach > 0.0 {
            let h = dt * T::lit(reach);
            for i in 0..group.act.len() {
                group.act[i] = act_dot[i].mul_add(h, rk.act[i]);
            }
            integrate_positions(sim, &mut group.qpos, &rk.rate, h);
            for d in 0..sim.model.nv {
                group.qvel[d] = qacc[d].mul_add(h, rk.qvel[d]);
            }
            rk.rate_before.copy_from_slice(&rk.rate);
        } else {
            let h = dt * T::lit(1.0 / 6.0);
            for s in rk.act_dot_sum.iter_mut() {
                *s *= T::lit(1.0 / 6.0);
            }
            group.act.copy_from_slice(&rk.act);
            advance_activations(sim, &mut group.act, &rk.act_dot_sum);
            integrate_positions(sim, &mut group.qpos, &rk.qvel_sum, h);
            for d in 0..sim.model.nv {
                group.qvel[d] = rk.qacc_sum[d].mul_add(h, rk.qvel[d]);
            }
        }
    }
}

/// Converts angular velocities of rotated stages to rates of the rotation vector from the start (Munthe-Kaas: the
/// inverse of the exponential's differential). This makes the method fourth-order for quaternions.
///
/// `rate` holds the stage's velocities, `before` the rates of the stage that led here in `h` seconds.
#[inline(always)]
fn correct_rotations<T: Real>(sim: &Sim<T>, before: &[T], rate: &mut [T], h: T) {
    for joint in &sim.joints {
        let d = match joint.kind {
            JointType::Free => joint.dof + 3,
            JointType::Ball => joint.dof,
            _ => continue,
        };
        let u = [before[d] * h, before[d + 1] * h, before[d + 2] * h];
        let w = [rate[d], rate[d + 1], rate[d + 2]];
        let once = cross(&u, &w);
        let twice = cross(&u, &once);
        // (1 - t/2 cot(t/2)) / t^2 for the angle t, as a series
        let t2 = dot(&u, &u);
        let c = T::lit(1.0 / 1_209_600.0).mul_add(t2, T::lit(1.0 / 30_240.0));
        let c = c.mul_add(t2, T::lit(1.0 / 720.0)).mul_add(t2, T::lit(1.0 / 12.0));
        for i in 0..3 {
            rate[d + i] = c.mul_add(twice[i], T::lit(0.5).mul_add(once[i], w[i]));
        }
    }
}
