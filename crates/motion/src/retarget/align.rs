//! Alignment of a skeleton at rest with a model at rest: heading, directions of bones, length of legs.

use super::mapping::{Mapping, Part};
use crate::kinematics::Pose;
use crate::rotation::{about_z, log, quat};
use crate::skeleton::{Skeleton, SkeletonPose};
use glam::{DQuat, DVec3};
use marathon_physics::Model;

/// A skeleton and a model, both at rest.
#[derive(Clone, Debug)]
pub(super) struct Alignment {
    /// The model and the skeleton at rest.
    pub rest: Pose,
    pub source: SkeletonPose,
    /// Rotates the skeleton's front to the model's.
    pub facing: DQuat,
    /// Rotates each part's body from the model's reference pose to the skeleton's rest pose.
    pub align: Vec<DQuat>,
    /// The only child part of each part.
    pub next: Vec<Option<usize>>,
    /// Length of the model's legs divided by that of the skeleton's.
    pub scale: f64,
    /// Height of the model's hips above its ankles while it stands, m.
    pub leg: f64,
    /// The last part of a leg.
    pub foot: usize,
}

impl Alignment {
    pub fn new(model: &Model, mapping: &Mapping, skeleton: &Skeleton) -> Self {
        let rest = Pose::of(model, &model.qpos0);
        let source = skeleton.rest();
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
        Alignment { rest, source, facing, align, next, scale, leg, foot }
    }
}

/// World position of a part.
pub(super) fn place(pose: &Pose, part: &Part) -> DVec3 {
    pose.point(part.body, DVec3::from_array(part.local))
}

/// The only child part of another part, directly or through bodies that are not parts. `None` if there are several.
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

/// The smallest rotation from one direction to another.
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
