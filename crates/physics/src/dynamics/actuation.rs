//! Forces of the actuators.

use crate::lanes::Real;
use crate::sim::{Activation, ActuatorSpec, Sim, TransmissionSpec};
use crate::state::{Forces, Group, Work};

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
    for a in sim.actuators.iter().filter_map(|a| a.activation.as_ref()) {
        act[a.index] = a.next(act[a.index], rates[a.index]);
    }
}

/// Force of an actuator before its gear and its bounds, and its derivative with respect to the velocity of the
/// transmission. Stores the rate of change of its activation.
#[inline(always)]
fn force_and_slope<T: Real>(
    group: &Group<T>,
    forces: &mut Forces<T>,
    i: usize,
    actuator: &ActuatorSpec<T::Scalar>,
) -> (T, T) {
    let u = clamp(group.ctrl[i], actuator.ctrl);
    let input = match &actuator.activation {
        None => u,
        Some(a) => {
            let act = group.act[a.index];
            let rate = match (&a.rate, &a.muscle) {
                (Some(r), _) => (u - act) * T::splat(*r),
                (None, Some(muscle)) => muscle.rate(u, act),
                (None, None) => u,
            };
            forces.act_dot[a.index] = rate;
            if a.early { a.next(act, rate) } else { act }
        }
    };
    let mut force = input * T::splat(actuator.gain[0]);
    let mut slope = T::zero();
    if !actuator.plain {
        let (mut length, velocity) = match &actuator.transmission {
            TransmissionSpec::Joint { dofs, qpos, gear } => {
                let gear = T::splat(gear[0]);
                (gear * group.qpos[*qpos], gear * group.qvel[dofs.start])
            }
            TransmissionSpec::Tendon { index, gear } => {
                let gear = T::splat(*gear);
                (gear * forces.tendon_length[*index], gear * forces.tendon_velocity[*index])
            }
            TransmissionSpec::Drive(drive) => (forces.drives.length[*drive], forces.drives.velocity[*drive]),
            // nothing is fed back, but the bias may be constant
            TransmissionSpec::Adhesion => (T::zero(), T::zero()),
        };
        if let Some([turn, inverse]) = actuator.turn {
            let turns = ((input - length) * T::splat(inverse)).round();
            length = turns.mul_add(T::splat(turn), length);
        }
        let (g, b) = (&actuator.gain, &actuator.bias);
        let gain = T::splat(g[2]).mul_add(velocity, T::splat(g[1]).mul_add(length, T::splat(g[0])));
        let bias = T::splat(b[2]).mul_add(velocity, T::splat(b[1]).mul_add(length, T::splat(b[0])));
        force = input.mul_add(gain, bias);
        slope = T::splat(g[2]).mul_add(input, T::splat(b[2]));
        if let Some(muscle) = &actuator.gain_muscle {
            let (gain, gain_slope) = muscle.gain(length, velocity);
            force = input.mul_add(gain, force);
            slope = gain_slope.mul_add(input, slope);
        }
        if let Some(muscle) = &actuator.bias_muscle {
            force += muscle.bias(length);
        }
    }
    (force, slope)
}

/// The same within the bounds of the actuator.
#[inline(always)]
fn bounded<T: Real>(
    group: &Group<T>,
    i: usize,
    actuator: &ActuatorSpec<T::Scalar>,
    (mut force, mut slope): (T, T),
) -> (T, T) {
    if let Some((low, high)) = actuator.force {
        let (low, high) = (T::splat(low), T::splat(high));
        // a force at its bound does not change with the velocity
        slope = T::masked(T::and(low.lt(force), force.lt(high)), slope);
        force = force.max(low).min(high);
    }
    if let Some(varied) = &group.varied {
        force *= varied.strength[i];
        slope *= varied.strength[i];
    }
    (force, slope)
}

/// Factors that bring the sums of the actuator forces on tendons into their bounds, and whether the sums change with the
/// velocity.
#[inline(always)]
fn share_tendons<T: Real>(sim: &Sim<T>, group: &Group<T>, forces: &mut Forces<T>) {
    let one = T::lit(1.0);
    for range in &sim.tendon_force_ranges {
        let mut sum = T::zero();
        for i in &range.actuators {
            sum += force_and_slope(group, forces, *i, &sim.actuators[*i]).0;
        }
        let (low, high) = (T::splat(range.low), T::splat(range.high));
        let (below, above) = (sum.lt(low), high.lt(sum));
        let outside = T::or(below, above);
        let share = T::select(below, low, high).div(T::select(outside, sum, one));
        let share = T::select(outside, share, one);
        // a sum at its bound or beyond does not change with the velocity, and the actuators' own bounds may move it there
        let mut bounded_sum = T::select(below, low, sum.min(high));
        for i in range.actuators.iter().filter(|i| sim.actuators[**i].force.is_some()) {
            let force = force_and_slope(group, forces, *i, &sim.actuators[*i]).0 * share;
            bounded_sum += clamp(force, sim.actuators[*i].force) - force;
        }
        let free = T::masked(T::and(low.lt(bounded_sum), bounded_sum.lt(high)), one);
        forces.tendon_share[range.tendon] = [share, free];
    }
}

/// Forces of the actuators, and, through their gears, of the joints.
#[inline(always)]
pub(crate) fn actuation<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    let forces = &mut work.forces;
    if !sim.drives.is_empty() {
        forces.drives.copy_from(&work.drives);
    }
    share_tendons(sim, group, forces);
    let limited = !sim.joint_force_ranges.is_empty();
    if limited {
        // the sum of the actuator forces has its own bounds
        forces.qfrc_passive_actuator.fill(T::zero());
    } else {
        forces.qfrc_passive_actuator.copy_from_slice(&forces.qfrc_passive);
    }
    for (i, actuator) in sim.actuators.iter().enumerate() {
        let (mut force, mut slope) = force_and_slope(group, forces, i, actuator);
        if let (false, TransmissionSpec::Tendon { index, .. }) =
            (sim.tendon_force_ranges.is_empty(), &actuator.transmission)
        {
            let [share, free] = forces.tendon_share[*index];
            force *= share;
            slope *= free;
        }
        let (force, slope) = bounded(group, i, actuator, (force, slope));
        forces.actuator_force[i] = force;
        let qfrc = &mut forces.qfrc_passive_actuator;
        match &actuator.transmission {
            TransmissionSpec::Joint { dofs, gear, .. } => {
                for (k, d) in dofs.clone().enumerate() {
                    let gear = T::splat(gear[k]);
                    qfrc[d] = force.mul_add(gear, qfrc[d]);
                    if sim.implicit_fast && k == 0 {
                        forces.minus_qderiv[d] = (gear * gear).neg_mul_add(slope, forces.minus_qderiv[d]);
                    }
                }
            }
            TransmissionSpec::Tendon { index, gear } => {
                let gear = T::splat(*gear);
                let pull = force * gear;
                for (dof, arm) in sim.tendons[*index].arms(&forces.tendon_moments) {
                    qfrc[dof] = pull.mul_add(arm, qfrc[dof]);
                }
                if sim.implicit_fast && sim.tree_matrix.is_some() {
                    let sum = &mut forces.minus_tendon_deriv[*index];
                    *sum = (gear * gear).neg_mul_add(slope, *sum);
                }
            }
            TransmissionSpec::Drive(drive) => {
                for (dof, arm) in forces.drives.arms(sim, *drive) {
                    qfrc[dof] = force.mul_add(arm, qfrc[dof]);
                }
                forces.minus_drive_deriv[*drive] = -slope;
            }
            // the contacts are not known yet
            TransmissionSpec::Adhesion => {}
        }
    }
    for (force, carried) in forces.qfrc_passive_actuator.iter_mut().zip(&forces.gravcomp[1]) {
        *force += *carried;
    }
    if limited {
        for (dof, low, high) in &sim.joint_force_ranges {
            let (low, high, force) = (T::splat(*low), T::splat(*high), forces.qfrc_passive_actuator[*dof]);
            // a force at its bound does not change with the velocity
            let inside = T::and(low.lt(force), force.lt(high));
            forces.minus_qderiv[*dof] = T::select(inside, forces.minus_qderiv[*dof], T::splat(sim.damping[*dof]));
            forces.qfrc_passive_actuator[*dof] = force.max(low).min(high);
        }
        for (sum, passive) in forces.qfrc_passive_actuator.iter_mut().zip(&forces.qfrc_passive) {
            *sum += *passive;
        }
    }
}
