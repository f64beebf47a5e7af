//! Forces of the actuators.

use crate::lanes::Real;
use crate::sim::{Activation, Pull, Sim};
use crate::state::{Group, Work};

#[inline(always)]
fn clamp<T: Real>(x: T, range: Option<(T::Scalar, T::Scalar)>) -> T {
    match range {
        Some((low, high)) => x.max(T::splat(low)).min(T::splat(high)),
        None => x,
    }
}

impl<C: Real<Scalar = C>> Activation<C> {
    /// Activation after a step.
    #[inline(always)]
    fn next<T: Real<Scalar = C>>(&self, act: T, rate: T) -> T {
        clamp(rate.mul_add(T::splat(self.reach), act), self.range)
    }
}

/// Activations after a step at the rates of the last actuation.
#[inline(always)]
pub(crate) fn advance_activations<T: Real>(sim: &Sim<T>, act: &mut [T], rates: &[T]) {
    for a in sim.motors.iter().filter_map(|m| m.activation.as_ref()) {
        act[a.index] = a.next(act[a.index], rates[a.index]);
    }
}

/// Actuator forces through their gears.
#[inline(always)]
pub(crate) fn actuation<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    let bounded = !sim.joint_force_ranges.is_empty();
    if bounded {
        // what the actuators add is bounded on its own
        work.solver.rhs.copy_from_slice(&work.forces.tau);
        work.forces.tau.fill(T::zero());
    }
    for (i, motor) in sim.motors.iter().enumerate() {
        let u = clamp(group.ctrl[i], motor.ctrl);
        let input = match &motor.activation {
            None => u,
            Some(a) => {
                let act = group.act[a.index];
                let rate = a.rate.map_or(u, |r| (u - act) * T::splat(r));
                work.forces.act_dot[a.index] = rate;
                if a.early { a.next(act, rate) } else { act }
            }
        };
        let mut force = input * T::splat(motor.gain[0]);
        let mut slope = T::zero();
        if !motor.plain {
            let (length, velocity) = match &motor.pull {
                Pull::Joint { dofs, qpos, gear } => {
                    let gear = T::splat(gear[0]);
                    (gear * group.qpos[*qpos], gear * group.qvel[dofs.start])
                }
                Pull::Tendon { index, gear } => {
                    let gear = T::splat(*gear);
                    (gear * work.forces.tendon_length[*index], gear * work.forces.tendon_velocity[*index])
                }
            };
            let (g, b) = (&motor.gain, &motor.bias);
            let gain = T::splat(g[2]).mul_add(velocity, T::splat(g[1]).mul_add(length, T::splat(g[0])));
            let bias = T::splat(b[2]).mul_add(velocity, T::splat(b[1]).mul_add(length, T::splat(b[0])));
            force = input.mul_add(gain, bias);
            slope = T::splat(g[2]).mul_add(input, T::splat(b[2]));
        }
        if let Some((low, high)) = motor.force {
            let (low, high) = (T::splat(low), T::splat(high));
            // a force at its bound does not change with the velocity
            slope = T::masked(T::and(low.lt(force), force.lt(high)), slope);
            force = force.max(low).min(high);
        }
        if let Some(varied) = &group.varied {
            force *= varied.strength[i];
            slope *= varied.strength[i];
        }
        work.forces.actuator_force[i] = force;
        match &motor.pull {
            Pull::Joint { dofs, gear, .. } => {
                for (k, d) in dofs.clone().enumerate() {
                    let gear = T::splat(gear[k]);
                    work.forces.tau[d] = force.mul_add(gear, work.forces.tau[d]);
                    if sim.implicit_fast && k == 0 {
                        work.forces.rate[d] = (gear * gear).neg_mul_add(slope, work.forces.rate[d]);
                    }
                }
            }
            Pull::Tendon { index, gear } => {
                let pull = force * T::splat(*gear);
                for term in &sim.tendons[*index].terms {
                    work.forces.tau[term.dof] = pull.mul_add(T::splat(term.coef), work.forces.tau[term.dof]);
                }
            }
        }
    }
    if bounded {
        for (dof, low, high) in &sim.joint_force_ranges {
            let (low, high, force) = (T::splat(*low), T::splat(*high), work.forces.tau[*dof]);
            // a force at its bound does not change with the velocity
            let inside = T::and(low.lt(force), force.lt(high));
            work.forces.rate[*dof] = T::select(inside, work.forces.rate[*dof], T::splat(sim.damping[*dof]));
            work.forces.tau[*dof] = force.max(low).min(high);
        }
        for (t, passive) in work.forces.tau.iter_mut().zip(&work.solver.rhs) {
            *t += *passive;
        }
    }
}
