//! Recorded motions before retargeting: a skeleton of joints, and its motion.

use crate::clip::{About, Clip, Cycle};
use crate::error::MotionError;
use crate::kinematics::Pose;
use crate::layout::{JointKind, Layout};
use crate::rotation::{log, quat, slerp, wxyz};
use glam::{DQuat, DVec3};
use marathon_physics::Model;
use marathon_physics::model::JointType;
use std::path::Path;

/// A joint of a skeleton.
#[derive(Clone, Debug, PartialEq)]
pub struct Bone {
    /// Name.
    pub name: String,
    /// Index of its parent, which is lower than its own. `None` for the root.
    pub parent: Option<usize>,
    /// Position in the frame of its parent, m.
    pub offset: [f64; 3],
    /// Rotation in the frame of its parent in the rest pose, `[w, x, y, z]`.
    pub rest: [f64; 4],
}

/// Joints from the root to the tips. Lengths are in meters, z points up, axes are right-handed.
#[derive(Clone, Debug, PartialEq)]
pub struct Skeleton {
    /// The joints. Parents come before their children, and the first joint is the root.
    pub bones: Vec<Bone>,
}

/// World poses of the joints of a skeleton.
#[derive(Clone, Debug)]
pub(crate) struct SkeletonPose {
    pub pos: Vec<DVec3>,
    pub quat: Vec<DQuat>,
}

/// A motion of a skeleton. The root's position and the joints' rotations are kept as a clip whose first joint is free and
/// whose other joints are balls.
#[derive(Clone, Debug, PartialEq)]
pub struct Animation {
    skeleton: Skeleton,
    clip: Clip,
    wraps: bool,
}

/// One instant of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Keyframe {
    /// Position of the root, m.
    pub root: [f64; 3],
    /// Rotation of each joint in the frame of its parent, `[w, x, y, z]`.
    pub rotations: Vec<[f64; 4]>,
}

/// Difference between the last pose of a motion and the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seam {
    /// Height of the last root above the first, m.
    pub height: f64,
    /// Tilt between the two roots, without rotation about the vertical, rad.
    pub tilt: f64,
    /// Mean difference of the joints, rad.
    pub joints: f64,
}

impl Seam {
    /// Whether the seam would be visible in a loop.
    pub fn shows(&self) -> bool {
        self.height.abs() > 0.1 || self.tilt > 0.35 || self.joints > 0.35
    }

    /// Whether the two poses are too different for a loop, which would float, sink or tumble.
    pub fn gapes(&self) -> bool {
        self.height.abs() > 0.25 || self.tilt > 1.0 || self.joints > 1.0
    }
}

impl Keyframe {
    /// Interpolates between two keyframes.
    pub(crate) fn blended(&self, to: &Keyframe, share: f64) -> Keyframe {
        let root = [0, 1, 2].map(|i| self.root[i] + share * (to.root[i] - self.root[i]));
        let rotations = self.rotations.iter().zip(&to.rotations);
        Keyframe { root, rotations: rotations.map(|(a, b)| wxyz(slerp(quat(a), quat(b), share))).collect() }
    }
}

impl Skeleton {
    /// Whether a joint is another joint or its descendant.
    pub(crate) fn hangs(&self, mut joint: usize, from: usize) -> bool {
        while joint != from {
            match self.bones[joint].parent {
                Some(parent) => joint = parent,
                None => return false,
            }
        }
        true
    }

    /// The skeleton in its rest pose, with its root at the origin.
    pub(crate) fn rest(&self) -> SkeletonPose {
        let rotations: Vec<DQuat> = self.bones.iter().map(|bone| quat(&bone.rest)).collect();
        self.pose(DVec3::ZERO, &rotations)
    }

    pub(crate) fn pose(&self, root: DVec3, rotations: &[DQuat]) -> SkeletonPose {
        let mut pose = SkeletonPose { pos: Vec::new(), quat: Vec::new() };
        for (bone, rotation) in self.bones.iter().zip(rotations) {
            let (pos, turn) = match bone.parent {
                Some(parent) => {
                    let turn = pose.quat[parent];
                    (pose.pos[parent] + turn * DVec3::from_array(bone.offset), turn * *rotation)
                }
                None => (root, *rotation),
            };
            pose.pos.push(pos);
            pose.quat.push(turn);
        }
        pose
    }
}

impl Animation {
    /// Creates an animation of these keyframes, `dt` seconds apart. `wraps`: its last pose is meant to repeat the first
    /// one, farther on. The path is for messages.
    ///
    /// # Errors
    /// As [`Clip::new`].
    pub fn new(
        path: &Path,
        about: About,
        skeleton: Skeleton,
        dt: f64,
        wraps: bool,
        keyframes: &[Keyframe],
    ) -> Result<Self, MotionError> {
        let kinds = std::iter::once(JointKind::Free).chain(std::iter::repeat(JointKind::Ball));
        let layout = Layout::new(skeleton.bones.iter().map(|bone| bone.name.clone()).zip(kinds));
        let rows: Vec<Vec<f64>> = keyframes
            .iter()
            .map(|frame| frame.root.into_iter().chain(frame.rotations.iter().flatten().copied()).collect())
            .collect();
        let clip = Clip::new(path, about, layout, dt, None, &rows)?;
        Ok(Animation { skeleton, clip, wraps })
    }

    /// The motion of a model's bodies: a joint per body with the body's name, at the anchor of the body's first joint.
    /// The path is for messages.
    ///
    /// # Errors
    /// If the clip is for another model, or the model has no moving body.
    pub fn of_clip(path: &Path, model: &Model, clip: &Clip) -> Result<Self, MotionError> {
        clip.check_model(path, model)?;
        let Some(first) = model.joints.first().map(|joint| joint.body) else {
            return Err(MotionError::model(path, &model.name, "it has no joints"));
        };
        // the bodies of the first tree
        let tree = model.bodies[first].root_id;
        let bodies: Vec<usize> =
            (1..model.bodies.len()).filter(|i| *i >= first && model.bodies[*i].root_id == tree).collect();
        let anchor = |body: usize| {
            let body = &model.bodies[body];
            let joints = &model.joints[body.joint_start..body.joint_start + body.joint_count];
            let joint = joints.first().filter(|joint| joint.kind != JointType::Free);
            joint.map_or(DVec3::ZERO, |joint| DVec3::from_array(joint.pos))
        };
        let rest = Pose::of(model, &model.qpos0);
        let parent = |body: usize| bodies.iter().position(|other| *other == model.bodies[body].parent);
        let local = |pose: &Pose, body: usize| {
            let to = model.bodies[body].parent;
            if body == first { pose.quat[body] } else { pose.quat[to].conjugate() * pose.quat[body] }
        };
        let bones = bodies.iter().map(|body| {
            let up = model.bodies[*body].parent;
            let offset = match parent(*body) {
                Some(_) => {
                    let way = rest.point(*body, anchor(*body)) - rest.point(up, anchor(up));
                    rest.quat[up].conjugate() * way
                }
                None => DVec3::ZERO,
            };
            Bone {
                name: model.bodies[*body].name.clone(),
                parent: parent(*body),
                offset: offset.to_array(),
                rest: wxyz(local(&rest, *body)),
            }
        });
        let skeleton = Skeleton { bones: bones.collect() };
        let count = clip.frames() + usize::from(clip.cycle().is_some());
        let keyframes: Vec<Keyframe> = (0..count as i64)
            .map(|i| {
                let pose = Pose::of(model, &clip.frame_at(i));
                let rotations = bodies.iter().map(|body| wxyz(local(&pose, *body))).collect();
                Keyframe { root: pose.point(first, anchor(first)).to_array(), rotations }
            })
            .collect();
        Animation::new(path, clip.about().clone(), skeleton, clip.dt(), clip.cycle().is_some(), &keyframes)
    }

    /// The joints.
    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    /// Root position and rotations over time.
    pub fn clip(&self) -> &Clip {
        &self.clip
    }

    /// Whether its last pose is meant to repeat the first one, farther on.
    pub fn wraps(&self) -> bool {
        self.wraps
    }

    /// The motion as a loop. Recordings never close exactly; the remainder is spread over the whole cycle, where it is
    /// least visible. The path is for messages.
    ///
    /// # Errors
    /// As [`Clip::looped`].
    pub fn looped(&self, path: &Path) -> Result<Self, MotionError> {
        Ok(self.with_clip(self.clip.looped(path, self.clip.duration())?))
    }

    /// The difference between the last pose and the first.
    pub fn seam(&self) -> Seam {
        let (first, last) = (self.clip.frame(0), self.clip.frame(self.clip.frames() - 1));
        let up = |frame: &[f64]| quat(&frame[3..]) * (quat(&first[3..]).conjugate() * DVec3::Z);
        let (a, b) = (up(first), up(last));
        let bones = self.skeleton.bones.len();
        let angle = |i: usize| {
            let at = 3 + 4 * i;
            log(quat(&first[at..]).conjugate() * quat(&last[at..])).length()
        };
        let joints: f64 = (1..bones).map(angle).sum();
        Seam {
            height: last[2] - first[2],
            tilt: libm::atan2(a.cross(b).length(), a.dot(b)),
            joints: joints / (bones - 1).max(1) as f64,
        }
    }

    /// The same skeleton with another motion, for edits of its [`Clip`].
    pub fn with_clip(&self, clip: Clip) -> Self {
        Animation { skeleton: self.skeleton.clone(), clip, wraps: self.wraps }
    }

    /// Displacement per cycle, if the motion loops.
    pub fn cycle(&self) -> Option<Cycle> {
        self.clip.cycle()
    }

    /// World poses of the joints in a frame, which may belong to another cycle.
    pub(crate) fn pose(&self, frame: i64) -> SkeletonPose {
        let qpos = self.clip.frame_at(frame);
        let rotations: Vec<DQuat> = (0..self.skeleton.bones.len()).map(|i| quat(&qpos[3 + 4 * i..])).collect();
        self.skeleton.pose(DVec3::from_slice(&qpos), &rotations)
    }
}
