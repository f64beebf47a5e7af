//! Forward kinematics: poses of the bodies of a model from `qpos` alone, like MuJoCo's `mj_kinematics`.

use crate::rotation::quat;
use glam::{DQuat, DVec3};
use marathon_physics::model::{JointType, Model};

/// World poses of a model's bodies, and the axes of its joints.
#[derive(Clone, Debug)]
pub struct Pose {
    /// Origin of each body, m.
    pub pos: Vec<DVec3>,
    /// Orientation of each body.
    pub quat: Vec<DQuat>,
    /// Anchor of each joint, m.
    pub anchors: Vec<DVec3>,
    /// Axis of each joint.
    pub axes: Vec<DVec3>,
}

impl Pose {
    /// The pose at `qpos`.
    ///
    /// # Panics
    /// If `qpos` is shorter than the model's.
    pub fn of(model: &Model, qpos: &[f64]) -> Self {
        let mut pose = Pose {
            pos: vec![DVec3::ZERO; model.bodies.len()],
            quat: vec![DQuat::IDENTITY; model.bodies.len()],
            anchors: Vec::with_capacity(model.joints.len()),
            axes: Vec::with_capacity(model.joints.len()),
        };
        for (i, body) in model.bodies.iter().enumerate().skip(1) {
            let parent = pose.quat[body.parent];
            let mut at = pose.pos[body.parent] + parent * DVec3::from_array(body.pos);
            let mut turn = parent * quat(&body.quat);
            for joint in &model.joints[body.joint_start..body.joint_start + body.joint_count] {
                let q = &qpos[joint.qpos_adr..];
                let local = DVec3::from_array(joint.pos);
                let axis = DVec3::from_array(joint.axis);
                let anchor = at + turn * local;
                pose.anchors.push(anchor);
                pose.axes.push(turn * axis);
                match joint.kind {
                    JointType::Free => {
                        at = DVec3::from_slice(q);
                        turn = unit(quat(&q[3..]));
                    }
                    JointType::Slide => at += (q[0] - model.qpos0[joint.qpos_adr]) * (turn * axis),
                    JointType::Ball => {
                        turn *= unit(quat(q));
                        at = anchor - turn * local;
                    }
                    JointType::Hinge => {
                        // the platforms' sin and cos differ, libm's do not
                        let half = 0.5 * (q[0] - model.qpos0[joint.qpos_adr]);
                        let sin = libm::sin(half) * axis;
                        turn *= DQuat::from_xyzw(sin.x, sin.y, sin.z, libm::cos(half));
                        at = anchor - turn * local;
                    }
                }
            }
            pose.pos[i] = at;
            pose.quat[i] = turn.normalize();
        }
        pose
    }

    /// World position of a point of a body.
    pub fn point(&self, body: usize, local: DVec3) -> DVec3 {
        self.pos[body] + self.quat[body] * local
    }

    /// Motion of a body with each of its degrees of freedom. Calls `each` with the index of the degree of freedom, the
    /// body's angular velocity, and the velocity of the given world point of the body. Free and ball joints rotate
    /// about the world's axes here.
    pub fn motions(&self, model: &Model, body: usize, point: DVec3, mut each: impl FnMut(usize, DVec3, DVec3)) {
        let mut at = body;
        while at != 0 {
            let here = &model.bodies[at];
            for (k, joint) in model.joints.iter().enumerate().skip(here.joint_start).take(here.joint_count) {
                let mut turns = |first: usize, anchor: DVec3| {
                    for (i, axis) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
                        each(first + i, axis, axis.cross(point - anchor));
                    }
                };
                match joint.kind {
                    JointType::Free => {
                        turns(joint.dof_adr + 3, self.pos[at]);
                        for (i, axis) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
                            each(joint.dof_adr + i, DVec3::ZERO, axis);
                        }
                    }
                    JointType::Ball => turns(joint.dof_adr, self.anchors[k]),
                    JointType::Slide => each(joint.dof_adr, DVec3::ZERO, self.axes[k]),
                    JointType::Hinge => {
                        each(joint.dof_adr, self.axes[k], self.axes[k].cross(point - self.anchors[k]));
                    }
                }
            }
            at = here.parent;
        }
    }
}

/// Normalizes a quaternion. A zero quaternion becomes the identity, as in MuJoCo's `mju_normalize4`.
fn unit(q: DQuat) -> DQuat {
    let norm = q.length();
    if norm < 1e-15 { DQuat::IDENTITY } else { q / norm }
}
