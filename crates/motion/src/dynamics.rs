//! Inverse dynamics: the generalized forces of a motion, like MuJoCo's `mj_inverse` without constraints.

use crate::kinematics::Pose;
use crate::rotation::{exp, quat};
use glam::{DMat3, DQuat, DVec3};
use marathon_physics::Model;
use marathon_physics::model::{Joint, JointType};

/// Motion of the bodies of a model: world axes, SI units.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Center of mass of each body, m.
    pub com: Vec<DVec3>,
    /// Its velocity, m/s.
    pub velocity: Vec<DVec3>,
    /// Its acceleration, m/s^2.
    pub acceleration: Vec<DVec3>,
    /// Angular velocity, rad/s.
    pub spin: Vec<DVec3>,
    /// Angular acceleration, rad/s^2.
    pub spin_rate: Vec<DVec3>,
    /// Inertia about the center of mass, kg m^2.
    pub inertia: Vec<DMat3>,
    /// Orientation after each joint.
    behind: Vec<DQuat>,
}

/// Motion of a rigid body at one of its points.
#[derive(Clone, Copy, Default)]
struct Rigid {
    at: DVec3,
    turn: DQuat,
    velocity: DVec3,
    acceleration: DVec3,
    spin: DVec3,
    spin_rate: DVec3,
}

impl Rigid {
    /// The same motion at another point.
    fn moved(self, at: DVec3) -> Self {
        let way = at - self.at;
        Rigid {
            at,
            velocity: self.velocity + self.spin.cross(way),
            acceleration: self.acceleration + self.spin_rate.cross(way) + self.spin.cross(self.spin.cross(way)),
            ..self
        }
    }

    /// The body after a joint about the point, which rotates with this angular velocity and acceleration.
    fn turned(self, by: DQuat, spin: DVec3, rate: DVec3) -> Self {
        let spin_rate = self.spin_rate + rate + self.spin.cross(spin);
        Rigid { turn: self.turn * by, spin: self.spin + spin, spin_rate, ..self }
    }

    /// The body after a joint.
    fn beyond(self, model: &Model, joint: &Joint, [qpos, qvel, qacc]: [&[f64]; 3]) -> Self {
        let (q, v) = (joint.qpos_adr, joint.dof_adr);
        let local = DVec3::from_array(joint.pos);
        let axis = DVec3::from_array(joint.axis);
        let world = self.turn * axis;
        let three = |of: &[f64], at: usize| DVec3::from_slice(&of[at..]);
        match joint.kind {
            JointType::Free => {
                let turn = quat(&qpos[q + 3..]).normalize();
                Rigid {
                    at: three(qpos, q),
                    turn,
                    velocity: three(qvel, v),
                    acceleration: three(qacc, v),
                    spin: turn * three(qvel, v + 3),
                    spin_rate: turn * three(qacc, v + 3),
                }
            }
            JointType::Slide => {
                let there = self.moved(self.at + (qpos[q] - model.qpos0[q]) * world);
                Rigid {
                    velocity: there.velocity + qvel[v] * world,
                    acceleration: there.acceleration + qacc[v] * world + 2.0 * qvel[v] * there.spin.cross(world),
                    ..there
                }
            }
            JointType::Hinge => {
                let hinge = self.moved(self.at + self.turn * local);
                let by = exp((qpos[q] - model.qpos0[q]) * axis);
                let behind = hinge.turned(by, qvel[v] * world, qacc[v] * world);
                behind.moved(behind.at - behind.turn * local)
            }
            JointType::Ball => {
                let socket = self.moved(self.at + self.turn * local);
                let by = quat(&qpos[q..]).normalize();
                let turn = self.turn * by;
                let behind = socket.turned(by, turn * three(qvel, v), turn * three(qacc, v));
                behind.moved(behind.at - behind.turn * local)
            }
        }
    }
}

impl Motion {
    /// Computes the motion at these positions, velocities and accelerations in MuJoCo's layout.
    ///
    /// # Panics
    /// If one of them is too short for the model.
    pub fn of(model: &Model, qpos: &[f64], qvel: &[f64], qacc: &[f64]) -> Self {
        let count = model.bodies.len();
        let mut rigids = vec![Rigid { turn: DQuat::IDENTITY, ..Rigid::default() }; count];
        let zeros = vec![DVec3::ZERO; count];
        let mut motion = Motion {
            com: zeros.clone(),
            velocity: zeros.clone(),
            acceleration: zeros.clone(),
            spin: zeros.clone(),
            spin_rate: zeros,
            inertia: vec![DMat3::ZERO; count],
            behind: Vec::with_capacity(model.joints.len()),
        };
        for (i, body) in model.bodies.iter().enumerate().skip(1) {
            let parent = rigids[body.parent];
            let mut rigid = parent.moved(parent.at + parent.turn * DVec3::from_array(body.pos));
            rigid.turn = parent.turn * quat(&body.quat);
            for joint in &model.joints[body.joint_start..][..body.joint_count] {
                rigid = rigid.beyond(model, joint, [qpos, qvel, qacc]);
                motion.behind.push(rigid.turn);
            }
            rigid.turn = rigid.turn.normalize();
            rigids[i] = rigid;
            let center = rigid.moved(rigid.at + rigid.turn * DVec3::from_array(body.ipos));
            let axes = DMat3::from_quat(rigid.turn * quat(&body.iquat));
            motion.com[i] = center.at;
            motion.velocity[i] = center.velocity;
            motion.acceleration[i] = center.acceleration;
            motion.spin[i] = center.spin;
            motion.spin_rate[i] = center.spin_rate;
            motion.inertia[i] = axes * DMat3::from_diagonal(DVec3::from_array(body.inertia)) * axes.transpose();
        }
        motion
    }

    /// Center of mass of all bodies, m, its velocity, m/s, and the angular momentum about it, kg m^2/s.
    pub fn momentum(&self, model: &Model) -> (DVec3, DVec3, DVec3) {
        let moving: Vec<usize> = (1..model.bodies.len()).filter(|i| model.bodies[*i].weld_id != 0).collect();
        let mass: f64 = moving.iter().map(|i| model.bodies[*i].mass).sum();
        let mean = |of: &[DVec3]| moving.iter().map(|i| model.bodies[*i].mass * of[*i]).sum::<DVec3>() / mass.max(1e-9);
        let (com, velocity) = (mean(&self.com), mean(&self.velocity));
        let about = moving.iter().map(|i| {
            let (arm, way) = (self.com[*i] - com, self.velocity[*i] - velocity);
            model.bodies[*i].mass * arm.cross(way) + self.inertia[*i] * self.spin[*i]
        });
        (com, velocity, about.sum())
    }
}

/// A feature of the model that inverse dynamics does not support, if any.
pub fn unsupported(model: &Model) -> Option<&'static str> {
    let springs = model.joints.iter().filter(|joint| matches!(joint.kind, JointType::Free | JointType::Ball));
    let found = [
        (!model.tendons.is_empty(), "tendons"),
        (!model.equalities.is_empty(), "equality constraints"),
        (model.opt.density != 0.0 || model.opt.viscosity != 0.0, "a medium with drag"),
        (springs.clone().any(|joint| joint.stiffness != 0.0), "springs in ball joints"),
    ];
    found.iter().find(|(found, _)| *found).map(|(_, what)| *what)
}

/// The generalized forces of motors and contacts for a motion: `M qacc + bias - passive`, N or N m per degree of
/// freedom. They equal those of MuJoCo's `mj_inverse` for a model without tendons, constraints and drag.
///
/// # Panics
/// If an argument is too short for the model.
pub fn inverse(model: &Model, qpos: &[f64], qvel: &[f64], qacc: &[f64]) -> Vec<f64> {
    let (motion, pose) = (Motion::of(model, qpos, qvel, qacc), Pose::of(model, qpos));
    let gravity = if model.opt.flags.gravity { DVec3::from_array(model.opt.gravity) } else { DVec3::ZERO };
    let mut out = vec![0.0; model.nv];
    for (i, body) in model.bodies.iter().enumerate().skip(1).filter(|(_, body)| body.weld_id != 0) {
        let force = body.mass * (motion.acceleration[i] - (1.0 - body.gravcomp) * gravity);
        let spin = motion.inertia[i] * motion.spin[i];
        let torque = motion.inertia[i] * motion.spin_rate[i] + motion.spin[i].cross(spin);
        pose.motions(model, i, motion.com[i], |dof, turn, shift| out[dof] += shift.dot(force) + turn.dot(torque));
    }
    for (joint, behind) in model.joints.iter().zip(&motion.behind) {
        to_body_axes(joint, *behind, &mut out);
        let hinged = matches!(joint.kind, JointType::Hinge | JointType::Slide);
        if model.opt.flags.spring && hinged {
            let off = qpos[joint.qpos_adr] - model.qpos_spring[joint.qpos_adr];
            let [a, b] = joint.stiffness_poly;
            out[joint.dof_adr] += (joint.stiffness + a * off + b * off * off) * off;
        }
    }
    for (out, (dof, (v, a))) in out.iter_mut().zip(model.dofs.iter().zip(qvel.iter().zip(qacc))) {
        *out += dof.armature * a;
        if model.opt.flags.damper {
            let [first, second] = dof.damping_poly;
            *out += (dof.damping + first * v.abs() + second * v * v) * v;
        }
    }
    out
}

/// Converts torques of a free or ball joint from world axes, as in [`Pose::motions`], to the body's axes.
pub(crate) fn to_body_axes(joint: &Joint, behind: DQuat, forces: &mut [f64]) {
    let first = match joint.kind {
        JointType::Free => joint.dof_adr + 3,
        JointType::Ball => joint.dof_adr,
        JointType::Hinge | JointType::Slide => return,
    };
    let torque = behind.conjugate() * DVec3::from_slice(&forces[first..]);
    forces[first..first + 3].copy_from_slice(&torque.to_array());
}
