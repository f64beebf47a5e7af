//! Applied joint forces: springs, dampers and actuators.

use crate::lanes::Real;
use crate::model::{Actuator, Dynamics, JointType, Model, Transmission};
use crate::sim::{LinkJoint, Sim};
use crate::spatial::{quat_conjugate, quat_mul, quat_to_rotvec};
use crate::tendon::{measure_tendons, tendon_springs};
use crate::work::{Group, Work};

/// Passive and actuator forces, into `tau`.
#[inline(always)]
pub(crate) fn applied_forces<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    measure_tendons(sim, group, work);
    passive(sim, group, work);
    tendon_springs(sim, work);
    actuation(sim, group, work);
}

/// Springs and dampers.
#[inline(always)]
pub(crate) fn passive<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    for d in 0..sim.model.nv {
        let damping = T::splat(sim.damping[d]);
        work.tau[d] = -(damping * group.qvel[d]);
        work.rate[d] = damping;
    }
    for joint in &sim.joints {
        if !joint.has_spring {
            continue;
        }
        let (k, d) = (T::splat(joint.stiffness), joint.dof);
        match joint.kind {
            JointType::Hinge | JointType::Slide => {
                let stretch = group.qpos[joint.qpos] - T::splat(joint.spring[0]);
                work.tau[d] = stretch.neg_mul_add(k, work.tau[d]);
            }
            JointType::Ball => add_ball_spring(joint, group, work, joint.qpos, d, k),
            JointType::Free => {
                for i in 0..3 {
                    let stretch = group.qpos[joint.qpos + i] - T::lit(sim.model.qpos_spring[joint.qpos + i]);
                    work.tau[d + i] = stretch.neg_mul_add(k, work.tau[d + i]);
                }
                add_ball_spring(joint, group, work, joint.qpos + 3, d + 3, k);
            }
        }
    }
}

/// Torque of a rotational spring: stiffness times the rotation vector from the rest orientation.
#[inline(always)]
fn add_ball_spring<T: Real>(
    joint: &LinkJoint<T::Scalar>,
    group: &Group<T>,
    work: &mut Work<T>,
    q: usize,
    d: usize,
    k: T,
) {
    let s = joint.spring;
    let rest = [T::splat(s[0]), T::splat(s[1]), T::splat(s[2]), T::splat(s[3])];
    let now = [group.qpos[q], group.qpos[q + 1], group.qpos[q + 2], group.qpos[q + 3]];
    let r = quat_to_rotvec(&quat_mul(&quat_conjugate(&rest), &now));
    for i in 0..3 {
        work.tau[d + i] = r[i].neg_mul_add(k, work.tau[d + i]);
    }
}

/// What an actuator pulls at.
#[derive(Clone, Debug)]
pub(crate) enum Pull<C> {
    /// Degrees of freedom and their gears; `qpos` is the coordinate of a scalar joint, for affine gains and biases.
    Joint { dofs: std::ops::Range<usize>, qpos: usize, gear: [C; 6] },
    /// A tendon, and the gear.
    Tendon { index: usize, gear: C },
}

/// An actuator.
#[derive(Clone, Debug)]
pub(crate) struct Motor<C> {
    pub pull: Pull<C>,
    pub ctrl: Option<(C, C)>,
    pub force: Option<(C, C)>,
    pub gain: [C; 3],
    pub bias: [C; 3],
    /// Plain motor: force = gain * input.
    pub plain: bool,
    pub activation: Option<Activation<C>>,
}

/// How an actuator's activation follows its control.
#[derive(Clone, Debug)]
pub(crate) struct Activation<C> {
    /// Index in `act`.
    index: usize,
    /// Rate of change per unit of distance from the control; `None` integrates the control.
    rate: Option<C>,
    /// Seconds by which the rate of change is multiplied over a step.
    reach: C,
    range: Option<(C, C)>,
    /// The force follows the activation at the end of the step.
    early: bool,
}

/// Prepares the actuators.
pub(crate) fn motors<T: Real>(model: &Model) -> Vec<Motor<T::Scalar>> {
    let c = T::scalar;
    let flags = &model.opt.flags;
    let range = |on: bool, r: &[f64; 2]| on.then(|| (c(r[0]), c(r[1])));
    let motor = |a: &Actuator| {
        let pull = match a.transmission {
            Transmission::Joint(j) | Transmission::JointInParent(j) => {
                let joint = &model.joints[j];
                let dofs = joint.dof_adr..joint.dof_adr + joint.kind.dofs();
                Pull::Joint { dofs, qpos: joint.qpos_adr, gear: a.gear.map(c) }
            }
            Transmission::Tendon(index) => Pull::Tendon { index, gear: c(a.gear[0]) },
        };
        let (dt, tiny) = (model.opt.timestep, 1e-15);
        let rate = match a.dynamics {
            Dynamics::None | Dynamics::Integrator => None,
            Dynamics::Filter { time_constant } | Dynamics::FilterExact { time_constant } => {
                Some(c(1.0 / f64::max(time_constant, tiny)))
            }
        };
        let reach = match a.dynamics {
            Dynamics::FilterExact { time_constant } => {
                let t = f64::max(time_constant, tiny);
                t * (1.0 - libm::exp(-dt / t))
            }
            _ => dt,
        };
        Motor {
            pull,
            ctrl: range(a.ctrl_limited && flags.clampctrl, &a.ctrl_range),
            force: range(a.force_limited, &a.force_range),
            gain: a.gain.map(c),
            bias: a.bias.map(c),
            plain: a.gain[1..] == [0.0; 2] && a.bias == [0.0; 3],
            activation: a.act.map(|index| Activation {
                index,
                rate,
                reach: c(reach),
                range: range(a.act_limited, &a.act_range),
                early: a.act_early,
            }),
        }
    };
    if flags.actuation { model.actuators.iter().map(motor).collect() } else { Vec::new() }
}

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
        work.rhs.copy_from_slice(&work.tau);
        work.tau.fill(T::zero());
    }
    for (i, motor) in sim.motors.iter().enumerate() {
        let u = clamp(group.ctrl[i], motor.ctrl);
        let input = match &motor.activation {
            None => u,
            Some(a) => {
                let act = group.act[a.index];
                let rate = a.rate.map_or(u, |r| (u - act) * T::splat(r));
                work.act_dot[a.index] = rate;
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
                    (gear * work.tendon_length[*index], gear * work.tendon_velocity[*index])
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
        work.actuator_force[i] = force;
        match &motor.pull {
            Pull::Joint { dofs, gear, .. } => {
                for (k, d) in dofs.clone().enumerate() {
                    let gear = T::splat(gear[k]);
                    work.tau[d] = force.mul_add(gear, work.tau[d]);
                    if sim.implicit_fast && k == 0 {
                        work.rate[d] = (gear * gear).neg_mul_add(slope, work.rate[d]);
                    }
                }
            }
            Pull::Tendon { index, gear } => {
                let pull = force * T::splat(*gear);
                for term in &sim.tendons[*index].terms {
                    work.tau[term.dof] = pull.mul_add(T::splat(term.coef), work.tau[term.dof]);
                }
            }
        }
    }
    if bounded {
        for (dof, low, high) in &sim.joint_force_ranges {
            let (low, high, force) = (T::splat(*low), T::splat(*high), work.tau[*dof]);
            // a force at its bound does not change with the velocity
            let inside = T::and(low.lt(force), force.lt(high));
            work.rate[*dof] = T::select(inside, work.rate[*dof], T::splat(sim.damping[*dof]));
            work.tau[*dof] = force.max(low).min(high);
        }
        for (t, passive) in work.tau.iter_mut().zip(&work.rhs) {
            *t += *passive;
        }
    }
}
