//! Springs and dampers of joints and tendons.

use crate::algebra::spatial::{quat_conjugate, quat_mul, quat_to_rotvec};
use crate::lanes::Real;
use crate::model::JointType;
use crate::sim::{LinkJoint, Sim};
use crate::state::{Group, Work};

/// Springs and dampers of the joints.
#[inline(always)]
pub(crate) fn joint_passive<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    let forces = work.forces.qfrc_passive.iter_mut().zip(&mut work.forces.minus_qderiv);
    for ((force, minus_qderiv), (damping, vel)) in forces.zip(sim.damping.iter().zip(&group.qvel)) {
        let damping = T::splat(*damping);
        (*force, *minus_qderiv) = (-(damping * *vel), damping);
    }
    for (force, carried) in work.forces.qfrc_passive.iter_mut().zip(&work.forces.gravcomp[0]) {
        *force += *carried;
    }
    for joint in &sim.joints {
        if !joint.has_spring {
            continue;
        }
        let (k, d) = (T::splat(joint.stiffness), joint.dof);
        match joint.kind {
            JointType::Hinge | JointType::Slide => {
                let stretch = group.qpos[joint.qpos] - T::splat(joint.spring[0]);
                work.forces.qfrc_passive[d] = stretch.neg_mul_add(k, work.forces.qfrc_passive[d]);
            }
            JointType::Ball => add_ball_spring(joint, group, work, joint.qpos, d, k),
            JointType::Free => {
                for i in 0..3 {
                    let stretch = group.qpos[joint.qpos + i] - T::lit(sim.model.qpos_spring[joint.qpos + i]);
                    work.forces.qfrc_passive[d + i] = stretch.neg_mul_add(k, work.forces.qfrc_passive[d + i]);
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
        work.forces.qfrc_passive[d + i] = r[i].neg_mul_add(k, work.forces.qfrc_passive[d + i]);
    }
}

/// Lengths and velocities of the tendons.
#[inline(always)]
pub(crate) fn measure_tendons<T: Real>(sim: &Sim<T>, group: &Group<T>, work: &mut Work<T>) {
    let Work { forces, strings, .. } = work;
    forces.tendon_moments.copy_from_slice(&strings.moments);
    for (i, t) in sim.tendons.iter().enumerate() {
        if t.spatial {
            (forces.tendon_length[i], forces.tendon_velocity[i]) = (strings.length[i], strings.velocity[i]);
            continue;
        }
        let (mut length, mut velocity) = (T::zero(), T::zero());
        for term in &t.terms {
            length = T::splat(term.coef).mul_add(group.qpos[term.qpos], length);
            velocity = T::splat(term.coef).mul_add(group.qvel[term.dof], velocity);
        }
        forces.tendon_length[i] = length;
        forces.tendon_velocity[i] = velocity;
    }
}

/// Forces of the tendons' springs and dampers, added to those of the joints.
#[inline(always)]
pub(crate) fn tendon_passive<T: Real>(sim: &Sim<T>, work: &mut Work<T>) {
    let z = T::zero();
    let forces = &mut work.forces;
    for (i, t) in sim.tendons.iter().enumerate() {
        let length = forces.tendon_length[i];
        // zero between the slack lengths
        let below = (T::splat(t.slack[0]) - length).max(z);
        let above = (T::splat(t.slack[1]) - length).min(z);
        let force = (below + above) * T::splat(t.stiffness) - T::splat(t.damping) * forces.tendon_velocity[i];
        for (dof, arm) in t.arms(&forces.tendon_moments) {
            forces.qfrc_passive[dof] = arm.mul_add(force, forces.qfrc_passive[dof]);
        }
    }
    if let Some(matrix) = &sim.tree_matrix {
        for t in &matrix.tendons {
            forces.minus_tendon_deriv[*t] = T::splat(sim.tendons[*t].damping);
        }
    }
}
