//! The legs of a robot: the joints between its root and its feet.

use glam::DVec3;
use marathon_motion::kinematics::Pose;
use marathon_physics::model::{JointType, Model};

use super::stance::Foot;

/// Joints from a body up to the root, without those of the root.
fn joints_to(model: &Model, mut body: usize, root: usize) -> Vec<usize> {
    let mut joints = Vec::new();
    while body != 0 && body != root {
        let here = &model.bodies[body];
        joints.extend(here.joint_start..here.joint_start + here.joint_count);
        body = here.parent;
    }
    joints
}

/// The joints of each leg, from the root to the foot, without those that several legs share.
pub fn legs(model: &Model, feet: &[Foot], root: usize) -> Vec<Vec<usize>> {
    let paths: Vec<_> = feet.iter().map(|foot| joints_to(model, foot.body, root)).collect();
    let users = |joint: &usize| paths.iter().filter(|path| path.contains(joint)).count();
    paths.iter().map(|path| path.iter().rev().copied().filter(|joint| users(joint) == 1).collect()).collect()
}

/// Whether a joint of a leg moves its foot to a side.
pub fn moves_sideways(model: &Model, pose: &Pose, foot: &Foot, root: usize) -> bool {
    joints_to(model, foot.body, root).into_iter().any(|joint| {
        let arm = DVec3::from_array(foot.place) - pose.anchors[joint];
        match model.joints[joint].kind {
            JointType::Hinge => pose.axes[joint].cross(arm).y.abs() > 0.2 * arm.length(),
            JointType::Slide => pose.axes[joint].y.abs() > 0.2,
            JointType::Ball => true,
            JointType::Free => false,
        }
    })
}
