//! Finds an upright pose, with straight legs and arms out to the sides, for skeletons with another rest pose.
//!
//! Retargeting compares a recording with the skeleton's rest pose, so the rest pose has to be a standing pose. In some
//! skeletons, all bones point along one axis at rest. For those, the bones' axes are found from the motion:
//! - the direction to the next joint
//! - the axis about which the knee or the elbow bends
//! - the side of the other hip or shoulder
//! - for a foot, the direction that points up while the foot stands

use super::landmarks::{Landmarks, middle};
use super::up::Moment;
use crate::rotation::{log, quat, wxyz};
use crate::skeleton::{Skeleton, SkeletonPose};
use glam::{DMat3, DQuat, DVec3};

/// Largest bend of a hip or knee in a standing pose, degrees.
const BENT: f64 = 40.0;
/// Largest difference between the rest pose and the motion in the orientation of two neighboring bones, degrees.
const TWISTED: f64 = 50.0;
/// Weight of a bone's twist relative to its parent, compared with a bent knee or elbow.
const STRAIGHT: f64 = 0.15;
/// A foot stands if its ankle is slower than this, m/s, and less than this above its lowest height in the recording, m.
const FOOT_SPEED: f64 = 0.25;
const FOOT_HEIGHT: f64 = 0.08;

/// The up direction of a standing pose; `None` if the pose does not stand.
pub(super) fn upward(marks: &Landmarks, pose: &SkeletonPose) -> Option<DVec3> {
    let way = |from: usize, to: usize| (pose.pos[to] - pose.pos[from]).normalize_or_zero();
    let within = |a: DVec3, b: DVec3, degrees: f64| {
        a.length_squared() > 0.0 && b.length_squared() > 0.0 && angle(a, b) < degrees
    };
    let trunk = marks.trunk(pose).normalize_or_zero();
    let stands = (0..2).all(|side| {
        let (thigh, shin) = (way(marks.knees[side], marks.hips[side]), way(marks.ankles[side], marks.knees[side]));
        within(thigh, trunk, BENT) && within(shin, thigh, BENT)
    });
    let across = |[left, right]: [usize; 2]| way(right, left);
    let (hips, shoulders) = (across(marks.hips), across(marks.shoulders));
    let sides = within(hips, shoulders, BENT) && hips.dot(trunk).abs() < 0.5;
    (stands && sides).then_some(trunk)
}

/// Two axes of a bone in its own frame, and the world axes that they should point along.
struct Axes {
    own: [DVec3; 2],
    world: [DVec3; 2],
}

impl Axes {
    fn turn(&self) -> Option<DQuat> {
        let frame = |[a, b]: [DVec3; 2]| {
            let a = a.try_normalize()?;
            let b = (b - a.dot(b) * a).try_normalize()?;
            Some(DMat3::from_cols(a, b, a.cross(b)))
        };
        let turn = frame(self.world)? * frame(self.own)?.transpose();
        Some(DQuat::from_mat3(&turn).normalize())
    }
}

/// Finds the orientation of bones from the motion.
struct Look<'a> {
    marks: &'a Landmarks,
    moments: &'a [Moment],
    dt: f64,
}

impl Look<'_> {
    /// The mean of a direction, in the frame of a joint.
    fn mean(&self, joint: usize, direction: impl Fn(&SkeletonPose) -> DVec3) -> DVec3 {
        self.moments.iter().map(|moment| moment.now.quat[joint].conjugate() * direction(&moment.now)).sum()
    }

    /// The axis, in a joint's frame, about which the second of two bones bends: knees to the rear, elbows to the front.
    /// For straight limbs it is the given axis of the bone above, with the smallest possible rotation.
    fn hinge(&self, joint: usize, bend: [usize; 3], above: impl Fn(&SkeletonPose) -> [DVec3; 2]) -> DVec3 {
        let [a, b, c] = bend;
        self.mean(joint, |pose| {
            let first = (pose.pos[b] - pose.pos[a]).normalize_or_zero();
            let second = (pose.pos[c] - pose.pos[b]).normalize_or_zero();
            let [along, axis] = above(pose);
            let own = if joint == a { first } else { second };
            first.cross(second) + STRAIGHT * (between(along, own) * axis)
        })
    }

    /// The direction, in an ankle's frame, that points up while the foot stands.
    fn foot_up(&self, ankle: usize) -> Option<DVec3> {
        let lowest = self.moments.iter().map(|moment| moment.now.pos[ankle].z).fold(f64::INFINITY, f64::min);
        let stands = |moment: &&Moment| {
            let (now, next) = (moment.now.pos[ankle], moment.next.pos[ankle]);
            (next - now).length() < FOOT_SPEED * self.dt && now.z < lowest + FOOT_HEIGHT
        };
        let sum: DVec3 =
            self.moments.iter().filter(stands).map(|moment| moment.now.quat[ankle].conjugate() * DVec3::Z).sum();
        // without a clear direction, as for a foot on its toes, return `None`
        sum.try_normalize()
    }

    /// The direction from the pelvis up along the trunk, in the pelvis's frame.
    fn spine(&self, skeleton: &Skeleton) -> DVec3 {
        let mut chain = vec![self.marks.chest];
        while let Some(parent) = skeleton.bones[chain[chain.len() - 1]].parent.filter(|p| *p != self.marks.pelvis) {
            chain.push(parent);
        }
        let long = |joint: &&usize| DVec3::from_array(skeleton.bones[**joint].offset).length() > 0.02;
        let first = chain.iter().rev().find(long).copied().unwrap_or(self.marks.chest);
        let from = self.marks.pelvis;
        self.mean(from, |pose| pose.pos[first] - pose.pos[from])
    }

    /// The direction up from the chest, in the chest's frame.
    fn chest_up(&self) -> DVec3 {
        let chest = self.marks.chest;
        let neck = self.marks.neck.or(self.marks.head).filter(|neck| *neck != chest);
        let up = self.mean(chest, |pose| match neck {
            Some(neck) => pose.pos[neck] - pose.pos[chest],
            None => middle(pose, self.marks.shoulders) - pose.pos[chest],
        });
        if up.length() > 0.02 * self.moments.len() as f64 {
            return up;
        }
        self.mean(chest, |pose| self.marks.trunk(pose))
    }

    /// The rotation of each landmark's joint in the standing pose.
    fn turns(&self, skeleton: &Skeleton) -> Option<Vec<(usize, DQuat)>> {
        let marks = self.marks;
        let across =
            |pose: &SkeletonPose, [left, right]: [usize; 2]| (pose.pos[left] - pose.pos[right]).normalize_or_zero();
        let mut turns = Vec::new();
        let mut add = |joint: usize, own: [DVec3; 2], world: [DVec3; 2]| {
            let turn = Axes { own, world }.turn()?;
            turns.push((joint, turn));
            Some(turn)
        };
        let (pelvis, chest) = (marks.pelvis, marks.chest);
        let (up, left) = (DVec3::Z, DVec3::Y);
        let hips = self.mean(pelvis, |pose| across(pose, marks.hips));
        let of_pelvis = add(pelvis, [hips, self.spine(skeleton)], [left, up])?;
        let shoulders = self.mean(chest, |pose| across(pose, marks.shoulders));
        let of_chest = add(chest, [shoulders, self.chest_up()], [left, up])?;
        for side in 0..2 {
            let [hip, knee, ankle] = [marks.hips[side], marks.knees[side], marks.ankles[side]];
            let leg = [hip, knee, ankle];
            let along = |joint: usize, from: usize, to: usize| self.mean(joint, |pose| pose.pos[to] - pose.pos[from]);
            let thigh = self.hinge(hip, leg, |pose| {
                let pelvis = pose.quat[pelvis] * of_pelvis.conjugate();
                [pelvis * -up, pelvis * left]
            });
            let of_thigh = add(hip, [along(hip, hip, knee), thigh], [-up, left])?;
            let shin = self.hinge(knee, leg, |pose| {
                let thigh = pose.quat[hip] * of_thigh.conjugate();
                [thigh * -up, thigh * left]
            });
            let of_shin = add(knee, [along(knee, knee, ankle), shin], [-up, left])?;
            let beside = self.mean(ankle, |pose| pose.quat[knee] * of_shin.conjugate() * left);
            let shin_up = self.mean(ankle, |pose| pose.pos[knee] - pose.pos[ankle]);
            let foot_up = self.foot_up(ankle).filter(|up| up.dot(shin_up.normalize_or_zero()) > 0.3).unwrap_or(shin_up);
            match marks.toes[side] {
                Some(toe) => {
                    let front = self.mean(ankle, |pose| pose.pos[toe] - pose.pos[ankle]);
                    let flat = front - foot_up.normalize_or_zero() * front.dot(foot_up.normalize_or_zero());
                    let known = flat.length() > 0.3 * front.length() && flat.length() > 1e-3;
                    if known {
                        add(ankle, [foot_up, front], [up, DVec3::X])?
                    } else {
                        add(ankle, [foot_up, beside], [up, left])?
                    }
                }
                None => add(ankle, [foot_up, beside], [up, left])?,
            };

            let [shoulder, elbow] = [marks.shoulders[side], marks.elbows[side]];
            let out = if side == 0 { left } else { -left };
            // an elbow bends to the front: about -z on the left, about z on the right
            let axis = if side == 0 { -up } else { up };
            let hand = marks.wrists[side].unwrap_or(elbow);
            let arm = [shoulder, elbow, hand];
            let upper = self.hinge(shoulder, arm, |pose| {
                let chest = pose.quat[chest] * of_chest.conjugate();
                [chest * out, chest * axis]
            });
            let of_arm = add(shoulder, [along(shoulder, shoulder, elbow), upper], [out, axis])?;
            if hand != elbow {
                let fore = self.hinge(elbow, arm, |pose| {
                    let arm = pose.quat[shoulder] * of_arm.conjugate();
                    [arm * out, arm * axis]
                });
                add(elbow, [along(elbow, elbow, hand), fore], [out, axis])?;
            }
        }
        Some(turns)
    }
}

/// Whether an upright rest pose agrees with the motion on trunk and legs, within the rotations that people can make.
pub(super) fn agrees(skeleton: &Skeleton, marks: &Landmarks, moments: &[Moment], dt: f64, rest: &SkeletonPose) -> bool {
    let Some(turns) = (Look { marks, moments, dt }).turns(skeleton) else { return true };
    let off = |joint: usize| {
        let (_, turn) = turns.iter().find(|(known, _)| *known == joint).copied().unwrap_or((joint, rest.quat[joint]));
        rest.quat[joint] * turn.conjugate()
    };
    let pairs = [(marks.pelvis, marks.chest), (marks.pelvis, marks.hips[0]), (marks.pelvis, marks.hips[1])];
    let pairs = pairs.into_iter().chain((0..2).map(|side| (marks.hips[side], marks.knees[side])));
    pairs.into_iter().all(|(a, b)| log(off(a) * off(b).conjugate()).length().to_degrees() < TWISTED)
}

/// The skeleton with the standing pose as its rest pose; `None` if the motion does not show enough. The moments are
/// upright, in meters.
pub(super) fn standing(skeleton: &Skeleton, marks: &Landmarks, moments: &[Moment], dt: f64) -> Option<Skeleton> {
    let turns = Look { marks, moments, dt }.turns(skeleton)?;
    let mut standing = skeleton.clone();
    let mut world: Vec<DQuat> = Vec::with_capacity(skeleton.bones.len());
    for (i, bone) in standing.bones.iter_mut().enumerate() {
        let above = bone.parent.map_or(DQuat::IDENTITY, |parent| world[parent]);
        let known = turns.iter().find(|(joint, _)| *joint == i).map(|(_, turn)| *turn);
        let local = match known {
            Some(turn) => above.conjugate() * turn,
            None => mean_turn(moments, i, bone.parent).unwrap_or_else(|| quat(&bone.rest)),
        };
        bone.rest = wxyz(local.normalize());
        world.push(above * local);
    }
    Some(standing)
}

/// The mean rotation of a joint in its parent's frame.
fn mean_turn(moments: &[Moment], joint: usize, parent: Option<usize>) -> Option<DQuat> {
    let local =
        |pose: &SkeletonPose| parent.map_or(pose.quat[joint], |up| pose.quat[up].conjugate() * pose.quat[joint]);
    let first = local(&moments.first()?.now);
    let sum = moments
        .iter()
        .map(|moment| local(&moment.now))
        .fold(first * 0.0, |sum, turn| if turn.dot(first) < 0.0 { sum - turn } else { sum + turn });
    (sum.length() > 1e-3 * moments.len() as f64).then(|| sum.normalize())
}

/// The angle between two directions, degrees.
fn angle(a: DVec3, b: DVec3) -> f64 {
    libm::atan2(a.cross(b).length(), a.dot(b)).to_degrees()
}

/// The smallest rotation from one direction to another.
fn between(from: DVec3, to: DVec3) -> DQuat {
    match (from.try_normalize(), to.try_normalize()) {
        (Some(from), Some(to)) => DQuat::from_rotation_arc(from, to),
        _ => DQuat::IDENTITY,
    }
}
