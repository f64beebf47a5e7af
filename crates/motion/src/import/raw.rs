//! A recording in the axes and unit of its file.

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
    /// Prior trust that y points up, 0 to 1. The motion has to outweigh it.
    pub trust_y: f64,
    /// Notes on parts that the reader ignored.
    pub notes: Vec<String>,
}

/// Position and rotation of a joint in its parent's frame.
#[derive(Clone, Copy)]
pub(super) struct Local {
    pub pos: DVec3,
    pub turn: DQuat,
}

impl Local {
    /// Composes this frame with a frame inside it.
    pub fn then(self, inner: Local) -> Local {
        Local { pos: self.pos + self.turn * inner.pos, turn: self.turn * inner.turn }
    }
}

/// Removes the joints above `root`. Returns the skeleton that starts there, and the old index of each joint. The
/// removed joints' rest rotations are folded into the new root.
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
