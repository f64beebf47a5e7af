//! Applied joint forces: springs, dampers and actuators.

use crate::lanes::Real;
use crate::model::JointType;
use crate::sim::{LinkJoint, Sim};
use crate::spatial::quat_to_rotvec;
use crate::work::{Group, Work};

/// Passive and actuator forces, into `tau`.
#[inline(always)]
pub(crate) fn applied_forces<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    passive(sim, group, work);
    actuation(sim, group, work);
}

/// Springs and dampers.
#[inline(always)]
pub(crate) fn passive<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    for d in 0..sim.model.nv {
        work.tau[d] = -(T::splat(sim.damping[d]) * group.qvel[d]);
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
    // conj(rest) * q
    let [a, b, c, e] = [T::splat(s[0]), -T::splat(s[1]), -T::splat(s[2]), -T::splat(s[3])];
    let [w, x, y, z] = [group.qpos[q], group.qpos[q + 1], group.qpos[q + 2], group.qpos[q + 3]];
    let turn = [
        a * w - b * x - c * y - e * z,
        a * x + b * w + c * z - e * y,
        a * y - b * z + c * w + e * x,
        a * z + b * y - c * x + e * w,
    ];
    let r = quat_to_rotvec(&turn);
    for i in 0..3 {
        work.tau[d + i] = r[i].neg_mul_add(k, work.tau[d + i]);
    }
}

/// Actuator forces through their gears.
#[inline(always)]
pub(crate) fn actuation<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    for (i, motor) in sim.motors.iter().enumerate() {
        let mut u = group.ctrl[i];
        if let Some((low, high)) = motor.ctrl {
            u = u.max(T::splat(low)).min(T::splat(high));
        }
        let mut force = u * T::splat(motor.gain[0]);
        if !motor.plain {
            let gear = T::splat(motor.gear[0]);
            let (length, rate) = (gear * group.qpos[motor.qpos], gear * group.qvel[motor.dofs.start]);
            let gain =
                T::splat(motor.gain[2]).mul_add(rate, T::splat(motor.gain[1]).mul_add(length, T::splat(motor.gain[0])));
            let bias =
                T::splat(motor.bias[2]).mul_add(rate, T::splat(motor.bias[1]).mul_add(length, T::splat(motor.bias[0])));
            force = u.mul_add(gain, bias);
        }
        if let Some((low, high)) = motor.force {
            force = force.max(T::splat(low)).min(T::splat(high));
        }
        work.actuator_force[i] = force;
        for (k, d) in motor.dofs.clone().enumerate() {
            work.tau[d] = force.mul_add(T::splat(motor.gear[k]), work.tau[d]);
        }
    }
}
