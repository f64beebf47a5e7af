//! World poses and the motions of degrees of freedom, in the reference configuration and others.

use super::math::*;
use crate::model::{JointType, Model, Vec3};

/// World poses in the reference configuration.
#[derive(Debug)]
pub(crate) struct Pose {
    /// Body frames.
    pub body: Vec<Frame>,
    /// Centers of mass.
    pub com: Vec<Vec3>,
}

impl Pose {
    pub fn new(model: &Model) -> Self {
        Pose::at(model, &model.qpos0)
    }

    /// World poses in another configuration of the hinges and slides.
    pub fn at(model: &Model, qpos: &[f64]) -> Self {
        let mut body: Vec<Frame> = Vec::with_capacity(model.bodies.len());
        for (i, b) in model.bodies.iter().enumerate() {
            let own = Frame { pos: b.pos, quat: b.quat };
            let mut frame = if i == 0 { own } else { body[b.parent].compose(&own) };
            for joint in &model.joints[b.joint_start..b.joint_start + b.joint_count] {
                let away = qpos[joint.qpos_adr] - model.qpos0[joint.qpos_adr];
                match joint.kind {
                    _ if away == 0.0 => {}
                    JointType::Slide => frame.pos = add(frame.pos, scale(rotate(frame.quat, joint.axis), away)),
                    JointType::Hinge => {
                        let anchor = frame.point(joint.pos);
                        frame.quat = normalized(mul_quat(frame.quat, from_axis_angle(joint.axis, away)));
                        frame.pos = sub(anchor, rotate(frame.quat, joint.pos));
                    }
                    JointType::Ball | JointType::Free => {}
                }
            }
            body.push(frame);
        }
        let com = body.iter().enumerate().map(|(i, frame)| frame.point(model.inertial_frame(i).0)).collect();
        Pose { body, com }
    }

    /// World position of a joint's anchor.
    pub fn anchor(&self, model: &Model, joint: usize) -> Vec3 {
        let joint = &model.joints[joint];
        self.body[joint.body].point(joint.pos)
    }
}

/// Motion axis of one dof: angular velocity, and linear velocity at the tree's reference point.
#[derive(Clone, Copy)]
pub(crate) struct Motion {
    pub angular: Vec3,
    pub linear: Vec3,
}

impl Motion {
    /// Linear velocity at a point `r` away from the reference point.
    pub fn at(&self, r: Vec3) -> Vec3 {
        add(self.linear, cross(self.angular, r))
    }
}

/// Free joints: three world axes, then the body's axes. Ball joints: the body's axes. Others: the joint's axis.
pub(crate) fn motion(model: &Model, pose: &Pose, dof: usize, origin: Vec3) -> Motion {
    let joint_index = model.dofs[dof].joint;
    let joint = &model.joints[joint_index];
    let k = dof - joint.dof_adr;
    let frame = &pose.body[joint.body];
    let turning = |axis: Vec3| {
        let arm = sub(origin, pose.anchor(model, joint_index));
        Motion { angular: axis, linear: cross(axis, arm) }
    };
    let sliding = |axis: Vec3| Motion { angular: [0.0; 3], linear: axis };
    match joint.kind {
        JointType::Free if k < 3 => sliding([0, 1, 2].map(|i| if i == k { 1.0 } else { 0.0 })),
        JointType::Free => turning(axes(frame.quat)[k - 3]),
        JointType::Ball => turning(axes(frame.quat)[k]),
        JointType::Slide => sliding(rotate(frame.quat, joint.axis)),
        JointType::Hinge => turning(rotate(frame.quat, joint.axis)),
    }
}
