//! Where a model's parts should be, frame by frame: the model's own bones, turned as those of the skeleton.

use super::mapping::{Mapping, Part};
use crate::ground::Touch;
use crate::kinematics::Pose;
use crate::rotation::{about_z, log, quat, slerp};
use crate::skeleton::{Animation, SkeletonPose};
use glam::{DQuat, DVec3};
use marathon_physics::Model;
use marathon_physics::model::JointType;

/// Where the model's parts should be in one frame.
pub(super) struct Target {
    /// Orientation of each part's body.
    pub quat: Vec<DQuat>,
    /// Position of each part.
    pub pos: Vec<DVec3>,
    /// Point between the hips.
    pub hips: DVec3,
    /// Position and orientation of the first moving body.
    pub root: (DVec3, DQuat),
}

/// What stays the same over all frames.
pub(super) struct Targets<'a> {
    model: &'a Model,
    mapping: &'a Mapping,
    animation: &'a Animation,
    /// The model and the skeleton at rest.
    rest: Pose,
    source: SkeletonPose,
    /// Turns the skeleton's front to the model's.
    facing: DQuat,
    /// Turns each part's body from the model's reference pose to the skeleton's rest pose.
    align: Vec<DQuat>,
    /// Length of the model's legs over that of the skeleton's.
    scale: f64,
    /// Height of the hips over the ankles while both stand, m; of the model's and the skeleton's ankles over the ground.
    leg: f64,
    ankle: f64,
    source_ankle: f64,
}

impl<'a> Targets<'a> {
    pub fn new(model: &'a Model, mapping: &'a Mapping, animation: &'a Animation) -> Self {
        let rest = Pose::of(model, &model.qpos0);
        let source = animation.skeleton().rest();
        let [left, right] = mapping.hips.map(|hip| &mapping.parts[hip]);
        let angle = |v: DVec3| libm::atan2(v.y, v.x);
        let theirs = source.pos[left.joint] - source.pos[right.joint];
        let ours = place(&rest, left) - place(&rest, right);
        let both = [theirs, ours].iter().all(|v| v.truncate().length() > 1e-3);
        let facing = if both { about_z(angle(ours) - angle(theirs)) } else { DQuat::IDENTITY };

        let next: Vec<Option<usize>> = (0..mapping.parts.len()).map(|i| next_part(model, mapping, i)).collect();
        let align = (mapping.parts.iter().zip(&next))
            .map(|(part, next)| match (part.rest, next) {
                (Some(turn), _) => quat(&turn).normalize(),
                (None, Some(next)) if part.toward.is_none() => {
                    let next = &mapping.parts[*next];
                    let ours = place(&rest, next) - place(&rest, part);
                    let theirs = facing * (source.pos[next.joint] - source.pos[part.joint]);
                    between(ours, theirs)
                }
                _ => DQuat::IDENTITY,
            })
            .collect();

        let (mut leg, mut source_leg, mut foot) = (0.0, 0.0, mapping.hips[0]);
        while let Some(below) = next[foot] {
            let (a, b) = (&mapping.parts[foot], &mapping.parts[below]);
            leg += (place(&rest, b) - place(&rest, a)).length();
            source_leg += (source.pos[b.joint] - source.pos[a.joint]).length();
            foot = below;
        }
        let scale = if source_leg > 1e-3 { leg / source_leg } else { 1.0 };
        let foot_body = mapping.parts[foot].body;
        let low = |body: usize| {
            let touches = Touch::all(model);
            let below = touches.iter().filter(|touch| descends(model, touch.body, body));
            below.map(|touch| touch.lowest(&rest).z).fold(f64::INFINITY, f64::min)
        };
        let sole = low(foot_body);
        let ankle = if sole.is_finite() { place(&rest, &mapping.parts[foot]).z - sole } else { 0.0 };
        let mut heights: Vec<f64> = (0..animation.clip().frames() as i64)
            .flat_map(|i| {
                let pose = animation.pose(i);
                mapping.hips.map(|hip| pose.pos[mapping.parts[last(&next, hip)].joint].z)
            })
            .collect();
        heights.sort_by(f64::total_cmp);
        let source_ankle = heights[heights.len() / 20];
        Targets { model, mapping, animation, rest, source, facing, align, scale, leg, ankle, source_ankle }
    }

    /// A position of the skeleton in the model's world, but for its height.
    pub fn place(&self, pos: DVec3) -> DVec3 {
        self.scale * (self.facing * pos)
    }

    /// The targets of a frame, which may be one of another cycle.
    pub fn at(&self, frame: i64) -> Target {
        let pose = self.animation.pose(frame);
        let parts = &self.mapping.parts;
        let quats: Vec<DQuat> = (parts.iter().zip(&self.align))
            .map(|(part, align)| {
                let turned = |joint: usize| pose.quat[joint] * self.source.quat[joint].conjugate();
                let turn = match part.toward {
                    Some((other, share)) => slerp(turned(part.joint), turned(other), share),
                    None => turned(part.joint),
                };
                self.facing * turn * self.facing.conjugate() * *align * self.rest.quat[part.body]
            })
            .collect();

        let bodies = self.bodies(&quats);
        let middle = {
            let at = |part: &Part| bodies.0[part.body] + bodies.1[part.body] * DVec3::from_array(part.local);
            let [a, b] = self.mapping.hips.map(|hip| at(&parts[hip]));
            0.5 * (a + b)
        };
        let [a, b] = self.mapping.hips.map(|hip| pose.pos[parts[hip].joint]);
        let mut hips = self.place(0.5 * (a + b));
        let height = 0.5 * (a.z + b.z) - self.source_ankle;
        // the taller ankle counts as far as the figure stands
        let upright = (height * self.scale / self.leg.max(1e-3)).clamp(0.0, 1.0);
        hips.z = self.scale * height + self.ankle * upright + self.scale * self.source_ankle * (1.0 - upright);
        let shift = hips - middle;
        let pos = parts
            .iter()
            .map(|part| bodies.0[part.body] + shift + bodies.1[part.body] * DVec3::from_array(part.local))
            .collect();
        let first = self.model.joints.first().map_or(0, |joint| joint.body);
        Target { quat: quats, pos, hips, root: (bodies.0[first] + shift, bodies.1[first]) }
    }

    /// The model with its parts' bodies turned so, whether its joints allow it or not. The first moving body is at the origin.
    fn bodies(&self, quats: &[DQuat]) -> (Vec<DVec3>, Vec<DQuat>) {
        let count = self.model.bodies.len();
        let (mut pos, mut turn) = (vec![DVec3::ZERO; count], self.rest.quat.clone());
        for (i, body) in self.model.bodies.iter().enumerate().skip(1) {
            let parent = body.parent;
            let back = self.rest.quat[parent].conjugate();
            turn[i] = match self.mapping.parts.iter().position(|part| part.whole && part.body == i) {
                Some(part) => quats[part],
                None => turn[parent] * back * self.rest.quat[i],
            };
            let joints = &self.model.joints[body.joint_start..body.joint_start + body.joint_count];
            if parent == 0 {
                continue;
            }
            // a body turns about its joint
            let hinge = joints.first().filter(|joint| joint.kind != JointType::Free);
            let local = hinge.map_or(DVec3::ZERO, |joint| DVec3::from_array(joint.pos));
            let anchor = self.rest.point(i, local) - self.rest.pos[parent];
            pos[i] = pos[parent] + turn[parent] * (back * anchor) - turn[i] * local;
        }
        (pos, turn)
    }
}

/// Where a part is.
fn place(pose: &Pose, part: &Part) -> DVec3 {
    pose.point(part.body, DVec3::from_array(part.local))
}

/// The only part that hangs from another, directly or by bodies that are no parts; none if there are several.
fn next_part(model: &Model, mapping: &Mapping, of: usize) -> Option<usize> {
    if !mapping.parts[of].whole {
        return None;
    }
    let mut hanging = (0..mapping.parts.len()).filter(|i| {
        let part = &mapping.parts[*i];
        let mut body = if part.whole { model.bodies[part.body].parent } else { part.body };
        while body != 0 && !mapping.parts.iter().any(|part| part.whole && part.body == body) {
            body = model.bodies[body].parent;
        }
        *i != of && body == mapping.parts[of].body
    });
    let first = hanging.next();
    first.filter(|_| hanging.next().is_none())
}

/// The end of a chain of parts.
fn last(next: &[Option<usize>], mut part: usize) -> usize {
    while let Some(below) = next[part] {
        part = below;
    }
    part
}

/// Whether a body hangs from another, or is it.
fn descends(model: &Model, mut body: usize, from: usize) -> bool {
    while body != from && body != 0 {
        body = model.bodies[body].parent;
    }
    body == from
}

/// The smallest turn from one direction to another.
fn between(from: DVec3, to: DVec3) -> DQuat {
    if from.length() < 1e-2 || to.length() < 1e-2 {
        return DQuat::IDENTITY;
    }
    let (from, to) = (from.normalize(), to.normalize());
    let axis = from.cross(to);
    if axis.length() < 1e-9 {
        if from.dot(to) > 0.0 {
            return DQuat::IDENTITY;
        }
        let side = from.any_orthonormal_vector();
        return DQuat::from_xyzw(side.x, side.y, side.z, 0.0);
    }
    let q = DQuat::from_xyzw(axis.x, axis.y, axis.z, 1.0 + from.dot(to)).normalize();
    debug_assert!(log(q).is_finite());
    q
}
