//! Target poses of a model's parts for each frame: the model's own bones, rotated like the skeleton's.

use super::align::{Alignment, place};
use super::mapping::{Mapping, Part};
use crate::ground::Touch;
use crate::kinematics::Pose;
use crate::rotation::slerp;
use crate::skeleton::Animation;
use glam::{DQuat, DVec3};
use marathon_physics::Model;
use marathon_physics::model::JointType;

/// Target poses of the model's parts in one frame.
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

/// Data that is the same for all frames.
pub(super) struct Targets<'a> {
    model: &'a Model,
    mapping: &'a Mapping,
    animation: &'a Animation,
    fits: Alignment,
    /// Height of the model's and of the skeleton's ankles above the ground, m.
    ankle: f64,
    source_ankle: f64,
}

impl<'a> Targets<'a> {
    pub fn new(model: &'a Model, mapping: &'a Mapping, animation: &'a Animation) -> Self {
        let fits = Alignment::new(model, mapping, animation.skeleton());
        let (rest, next, foot) = (&fits.rest, &fits.next, fits.foot);
        let foot_body = mapping.parts[foot].body;
        let low = |body: usize| {
            let touches = Touch::all(model);
            let below = touches.iter().filter(|touch| descends(model, touch.body, body));
            below.map(|touch| touch.lowest(rest).z).fold(f64::INFINITY, f64::min)
        };
        let sole = low(foot_body);
        let ankle = if sole.is_finite() { place(rest, &mapping.parts[foot]).z - sole } else { 0.0 };
        let mut heights: Vec<f64> = (0..animation.clip().frames() as i64)
            .flat_map(|i| {
                let pose = animation.pose(i);
                mapping.hips.map(|hip| pose.pos[mapping.parts[last(next, hip)].joint].z)
            })
            .collect();
        heights.sort_by(f64::total_cmp);
        let source_ankle = heights[heights.len() / 20];
        Targets { model, mapping, animation, fits, ankle, source_ankle }
    }

    /// Converts a position of the skeleton to the model's world, except for its height.
    pub fn place(&self, pos: DVec3) -> DVec3 {
        self.fits.scale * (self.fits.facing * pos)
    }

    /// The targets of a frame, which may belong to another cycle.
    pub fn at(&self, frame: i64) -> Target {
        let pose = self.animation.pose(frame);
        let parts = &self.mapping.parts;
        let Alignment { rest, source, align, .. } = &self.fits;
        let Alignment { facing, scale, leg, .. } = self.fits;
        let quats: Vec<DQuat> = (parts.iter().zip(align))
            .map(|(part, align)| {
                let turned = |joint: usize| pose.quat[joint] * source.quat[joint].conjugate();
                let turn = match part.toward {
                    Some((other, share)) => slerp(turned(part.joint), turned(other), share),
                    None => turned(part.joint),
                };
                facing * turn * facing.conjugate() * *align * rest.quat[part.body]
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
        // the taller ankle counts in proportion to how upright the character stands
        let upright = (height * scale / leg.max(1e-3)).clamp(0.0, 1.0);
        hips.z = scale * height + self.ankle * upright + scale * self.source_ankle * (1.0 - upright);
        let shift = hips - middle;
        let pos = parts
            .iter()
            .map(|part| bodies.0[part.body] + shift + bodies.1[part.body] * DVec3::from_array(part.local))
            .collect();
        let first = self.model.joints.first().map_or(0, |joint| joint.body);
        Target { quat: quats, pos, hips, root: (bodies.0[first] + shift, bodies.1[first]) }
    }

    /// The bones whose position both the model and the skeleton have, as the parts at their two ends. The trunk leads
    /// from the midpoint of the hips to another part of the trunk, so its first end is `None`.
    pub fn bones(&self) -> Vec<(Option<usize>, usize)> {
        let parts = &self.mapping.parts;
        let limbs = self.fits.next.iter().enumerate().filter_map(|(i, next)| Some((Some(i), (*next)?)));
        let limbs = limbs.filter(|(i, next)| i.is_none_or(|i| parts[i].joint != parts[*next].joint));
        let at = |part: usize| place(&self.fits.rest, &parts[part]);
        let hips = 0.5 * (at(self.mapping.hips[0]) + at(self.mapping.hips[1]));
        let trunk = (0..parts.len()).filter(|i| {
            let way = at(*i) - hips;
            parts[*i].whole && parts[*i].toward.is_none() && way.y.abs() < 0.02 && way.z > 0.1
        });
        let trunk = trunk.max_by(|a, b| at(*a).z.total_cmp(&at(*b).z));
        limbs.chain(trunk.map(|trunk| (None, trunk))).collect()
    }

    /// The direction of each of these bones in the model's pose, and in a frame of the recording.
    pub fn directions(&self, bones: &[(Option<usize>, usize)], frame: i64, pose: &Pose) -> Vec<(DVec3, DVec3)> {
        let source = self.animation.pose(frame);
        let parts = &self.mapping.parts;
        let ours = |part: usize| place(pose, &parts[part]);
        let theirs = |part: usize| self.fits.facing * source.pos[parts[part].joint];
        let middle = |at: &dyn Fn(usize) -> DVec3| 0.5 * (at(self.mapping.hips[0]) + at(self.mapping.hips[1]));
        let end = |at: &dyn Fn(usize) -> DVec3, from: Option<usize>| from.map_or_else(|| middle(at), at);
        bones.iter().map(|(from, to)| (ours(*to) - end(&ours, *from), theirs(*to) - end(&theirs, *from))).collect()
    }

    /// The model with its parts' bodies in these orientations, regardless of joint limits. The first moving body is at
    /// the origin.
    fn bodies(&self, quats: &[DQuat]) -> (Vec<DVec3>, Vec<DQuat>) {
        let count = self.model.bodies.len();
        let (mut pos, mut turn) = (vec![DVec3::ZERO; count], self.fits.rest.quat.clone());
        for (i, body) in self.model.bodies.iter().enumerate().skip(1) {
            let parent = body.parent;
            let back = self.fits.rest.quat[parent].conjugate();
            turn[i] = match self.mapping.parts.iter().position(|part| part.whole && part.body == i) {
                Some(part) => quats[part],
                None => turn[parent] * back * self.fits.rest.quat[i],
            };
            let joints = &self.model.joints[body.joint_start..body.joint_start + body.joint_count];
            if parent == 0 {
                continue;
            }
            // a body rotates about its joint
            let hinge = joints.first().filter(|joint| joint.kind != JointType::Free);
            let local = hinge.map_or(DVec3::ZERO, |joint| DVec3::from_array(joint.pos));
            let anchor = self.fits.rest.point(i, local) - self.fits.rest.pos[parent];
            pos[i] = pos[parent] + turn[parent] * (back * anchor) - turn[i] * local;
        }
        (pos, turn)
    }
}

/// The end of a chain of parts.
fn last(next: &[Option<usize>], mut part: usize) -> usize {
    while let Some(below) = next[part] {
        part = below;
    }
    part
}

/// Whether a body is a descendant of another, or the same.
fn descends(model: &Model, mut body: usize, from: usize) -> bool {
    while body != from && body != 0 {
        body = model.bodies[body].parent;
    }
    body == from
}
