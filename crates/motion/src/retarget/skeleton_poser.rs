//! Poses of a skeleton that moves like a model, with the skeleton's bone lengths. Skinned meshes need them.

use super::align::{Alignment, place};
use super::mapping::Mapping;
use crate::kinematics::Pose;
use crate::rotation::{quat, slerp, wxyz};
use crate::skeleton::{Keyframe, Skeleton, SkeletonPose};
use glam::{DQuat, DVec3};
use marathon_physics::Model;

/// Poses a skeleton like a model.
#[derive(Clone, Debug)]
pub struct SkeletonPoser {
    skeleton: Skeleton,
    /// Orientation of each bone at rest, with the skeleton's front turned to the model's.
    rest: Vec<DQuat>,
    follows: Vec<Follows>,
    /// For each hip: the body, the position on it of the thigh's joint, and the skeleton's joint.
    hips: [(usize, DVec3, usize); 2],
    scale: f64,
    /// Offset of the skeleton's hips from the model's, in the frame of the body that carries the thighs.
    shift: (usize, DVec3),
}

/// Largest relative difference between the scale of the legs and the scale of the whole skeleton. Above it, the whole
/// skeleton sets the scale.
const OUT_OF_PROPORTION: f64 = 0.3;

/// Source of a bone's rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Follows {
    /// A body. Its orientation times this quaternion is the bone's orientation.
    Body(usize, DQuat),
    /// Two other bones: the fraction from the rotation of the first to that of the second.
    Between(usize, usize, f64),
    /// Its parent.
    Parent,
}

impl SkeletonPoser {
    /// Creates a poser for a skeleton and a model. The parts of a mapping rotate their joints. Joints between two
    /// joints of one part, such as those of a spine, share the rotation. All others keep their rest pose.
    pub fn new(model: &Model, mapping: &Mapping, skeleton: &Skeleton) -> Self {
        let Alignment { rest: model_rest, source, facing, align, scale, leg, .. } =
            Alignment::new(model, mapping, skeleton);
        let rest: Vec<DQuat> = source.quat.iter().map(|turn| facing * *turn).collect();
        let mut follows = vec![Follows::Parent; skeleton.bones.len()];
        for (part, align) in mapping.parts.iter().zip(&align).filter(|(part, _)| part.whole && part.toward.is_none()) {
            if follows[part.joint] == Follows::Parent {
                let turn = model_rest.quat[part.body].conjugate() * align.conjugate() * rest[part.joint];
                follows[part.joint] = Follows::Body(part.body, turn);
            }
        }
        for part in &mapping.parts {
            let Some((other, _)) = part.toward else { continue };
            let between = chain(skeleton, part.joint, other);
            let count = between.len() as f64 + 1.0;
            for (i, bone) in between.into_iter().enumerate() {
                if follows[bone] == Follows::Parent {
                    follows[bone] = Follows::Between(part.joint, other, (i + 1) as f64 / count);
                }
            }
        }
        let hips = mapping.hips.map(|hip| {
            let part = &mapping.parts[hip];
            (part.body, DVec3::from_array(part.local), part.joint)
        });
        let ratio = figure(model, mapping, &model_rest, &source).unwrap_or(scale);
        let proportionate = (ratio / scale - 1.0).abs() <= OUT_OF_PROPORTION;
        let pelvis = model.bodies[hips[0].0].parent;
        // shorter legs than the model's still reach the ground
        let lower = if proportionate { 0.0 } else { leg * (1.0 - ratio / scale) };
        let down = model_rest.quat[pelvis].conjugate() * DVec3::new(0.0, 0.0, -lower);
        let scale = if proportionate { scale } else { ratio };
        SkeletonPoser { skeleton: skeleton.clone(), rest, follows, hips, scale, shift: (pelvis, down) }
    }

    /// Scale of the skeleton's lengths. It makes the legs as long as the model's. If the legs are unusually long or
    /// short for the skeleton, it instead fits trunk, arms and legs together.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// The skeleton.
    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    /// The body whose rotation a bone follows; `None` for bones that follow other bones.
    pub fn body_of(&self, bone: usize) -> Option<usize> {
        match self.follows.get(bone)? {
            Follows::Body(body, _) => Some(*body),
            Follows::Between(..) | Follows::Parent => None,
        }
    }

    /// The pose of the skeleton, with its lengths times [`SkeletonPoser::scale`], for these poses of the model's
    /// bodies: position, m, and orientation, `[w, x, y, z]`. The skeleton's hips coincide with the model's, except for
    /// a height offset if its legs are shorter or longer.
    ///
    /// # Panics
    /// If there are fewer poses than the model has bodies.
    pub fn pose(&self, bodies: &[([f64; 3], [f64; 4])]) -> Keyframe {
        let bones = &self.skeleton.bones;
        let body = |i: usize| (DVec3::from_array(bodies[i].0), quat(&bodies[i].1).normalize());
        let own = |bone: usize| match self.follows[bone] {
            Follows::Body(i, turn) => body(i).1 * turn,
            _ => self.rest[bone],
        };
        let turned = |bone: usize| own(bone) * self.rest[bone].conjugate();
        let (mut turns, mut places) = (Vec::with_capacity(bones.len()), Vec::with_capacity(bones.len()));
        let mut rotations = Vec::with_capacity(bones.len());
        for (i, bone) in bones.iter().enumerate() {
            let parent: Option<(DVec3, DQuat)> = bone.parent.map(|parent| (places[parent], turns[parent]));
            let turn = match (self.follows[i], parent) {
                (Follows::Between(a, b, share), _) => slerp(turned(a), turned(b), share) * self.rest[i],
                (Follows::Parent, Some((_, turn))) => turn * quat(&bone.rest),
                _ => own(i),
            };
            let offset = self.scale * DVec3::from_array(bone.offset);
            places.push(parent.map_or(DVec3::ZERO, |(place, turn)| place + turn * offset));
            rotations.push(wxyz(parent.map_or(turn, |(_, above)| above.conjugate() * turn)));
            turns.push(turn);
        }
        let mut root = DVec3::ZERO;
        for (i, local, joint) in self.hips {
            let (place, turn) = body(i);
            root += 0.5 * (place + turn * local - places[joint]);
        }
        let (pelvis, shift) = self.shift;
        if shift != DVec3::ZERO {
            root += body(pelvis).1 * shift;
        }
        Keyframe { root: root.to_array(), rotations }
    }
}

/// Ratio of the model's lengths to the skeleton's, summed over parts and the parts above them; `None` without such
/// lengths.
fn figure(model: &Model, mapping: &Mapping, rest: &Pose, source: &SkeletonPose) -> Option<f64> {
    let parts = || mapping.parts.iter().filter(|part| part.whole && part.toward.is_none());
    let (mut ours, mut theirs) = (0.0, 0.0);
    for part in parts() {
        let up = std::iter::successors(Some(model.bodies[part.body].parent), |body| {
            (*body != 0).then(|| model.bodies[*body].parent)
        });
        let above = up.take_while(|body| *body != 0).find_map(|body| parts().find(|part| part.body == body));
        if let Some(above) = above {
            ours += place(rest, part).distance(place(rest, above));
            theirs += source.pos[part.joint].distance(source.pos[above.joint]);
        }
    }
    (ours > 1e-3 && theirs > 1e-3).then(|| ours / theirs)
}

/// The bones between a bone and its ancestor or descendant, starting after `from`. Empty if neither is above the other.
fn chain(skeleton: &Skeleton, from: usize, to: usize) -> Vec<usize> {
    let up = |from: usize, to: usize| {
        let mut bones = Vec::new();
        let mut at = skeleton.bones[from].parent;
        while let Some(bone) = at.filter(|bone| *bone != to) {
            bones.push(bone);
            at = skeleton.bones[bone].parent;
        }
        at.map(|_| bones)
    };
    let down = || up(to, from).map(|bones| bones.into_iter().rev().collect());
    up(from, to).or_else(down).unwrap_or_default()
}
