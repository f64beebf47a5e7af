//! A recording as its file has it: in the file's axes and unit.

use crate::clip::About;
use crate::rotation::{quat, wxyz};
use crate::skeleton::{Bone, Keyframe, Skeleton};
use glam::{DQuat, DVec3};

/// A recording in the file's axes and unit. Its first joint is the root.
pub(super) struct Raw {
    pub about: About,
    pub skeleton: Skeleton,
    pub dt: f64,
    pub keyframes: Vec<Keyframe>,
    /// How surely the format's y points up: what motion has to say against it, 0 to 1.
    pub trust_y: f64,
    /// What the reader has left out.
    pub notes: Vec<String>,
}

/// A joint's place in the frame of its parent.
#[derive(Clone, Copy)]
pub(super) struct Local {
    pub pos: DVec3,
    pub turn: DQuat,
}

impl Local {
    /// A frame within this one.
    pub fn then(self, inner: Local) -> Local {
        Local { pos: self.pos + self.turn * inner.pos, turn: self.turn * inner.turn }
    }
}

/// Cuts off what is above a joint: it is the root of the skeleton that is returned, with the old index of each joint. What is above carries it.
pub(super) fn cut(skeleton: &Skeleton, root: usize) -> (Skeleton, Vec<usize>) {
    let kept: Vec<usize> = (0..skeleton.bones.len()).filter(|joint| skeleton.hangs(*joint, root)).collect();
    let mut rest = Local { pos: DVec3::ZERO, turn: DQuat::IDENTITY };
    for joint in chain(skeleton, root) {
        rest = rest.then(Local { pos: DVec3::ZERO, turn: quat(&skeleton.bones[joint].rest) });
    }
    let bones = kept.iter().map(|joint| {
        let bone = &skeleton.bones[*joint];
        let parent = bone.parent.and_then(|parent| kept.iter().position(|other| *other == parent));
        match parent {
            Some(_) => Bone { parent, ..bone.clone() },
            None => Bone { name: bone.name.clone(), parent: None, offset: [0.0; 3], rest: wxyz(rest.turn) },
        }
    });
    (Skeleton { bones: bones.collect() }, kept)
}

/// The joints from the skeleton's root to a joint, both included.
pub(super) fn chain(skeleton: &Skeleton, joint: usize) -> Vec<usize> {
    let mut chain = vec![joint];
    while let Some(parent) = skeleton.bones[chain[chain.len() - 1]].parent {
        chain.push(parent);
    }
    chain.reverse();
    chain
}
