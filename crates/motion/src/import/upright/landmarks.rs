//! The joints that show a character's posture, found by their names.

use crate::roles::{find, fork};
use crate::skeleton::{Skeleton, SkeletonPose};
use glam::DVec3;
use std::collections::BTreeMap;

/// Joints of a character, by index.
#[derive(Clone, Debug)]
pub(super) struct Landmarks {
    pub pelvis: usize,
    pub chest: usize,
    pub neck: Option<usize>,
    pub head: Option<usize>,
    /// The left and the right hip.
    pub hips: [usize; 2],
    pub knees: [usize; 2],
    pub ankles: [usize; 2],
    pub toes: [Option<usize>; 2],
    pub shoulders: [usize; 2],
    pub elbows: [usize; 2],
    pub wrists: [Option<usize>; 2],
}

impl Landmarks {
    /// Finds the landmarks of a skeleton. `None` if it lacks a trunk, legs or arms. `known_as` maps joints to other
    /// names, such as the bodies that follow them.
    pub fn of(skeleton: &Skeleton, known_as: &BTreeMap<String, String>) -> Option<Self> {
        let mut named = skeleton.clone();
        for bone in &mut named.bones {
            if let Some(name) = known_as.get(&bone.name) {
                bone.name.clone_from(name);
            }
        }
        let joint = |role: &str| find(&named, role);
        let both = |role: &str| Some([joint(&format!("left_{role}"))?, joint(&format!("right_{role}"))?]);
        let each = |role: &str| ["left", "right"].map(|side| joint(&format!("{side}_{role}")));
        let (hips, knees, ankles) = (both("hip")?, both("knee")?, both("ankle")?);
        let (shoulders, elbows) = (both("shoulder")?, both("elbow")?);
        let pelvis = fork(skeleton, hips[0], hips[1])?;
        let top = fork(skeleton, shoulders[0], shoulders[1])?;
        let chest = joint("chest")
            .filter(|chest| shoulders.iter().all(|shoulder| skeleton.hangs(*shoulder, *chest)) && *chest != pelvis);
        let below = |upper: [usize; 2], lower: [usize; 2]| {
            (0..2).all(|i| upper[i] != lower[i] && skeleton.hangs(lower[i], upper[i]))
        };
        let sound = below(hips, knees) && below(knees, ankles) && below(shoulders, elbows);
        let marks = Landmarks {
            pelvis,
            chest: chest.unwrap_or(top),
            neck: joint("neck"),
            head: joint("head"),
            hips,
            knees,
            ankles,
            toes: each("toe"),
            shoulders,
            elbows,
            wrists: each("wrist"),
        };
        (sound && skeleton.hangs(marks.chest, pelvis) && marks.chest != pelvis).then_some(marks)
    }

    /// Length along the bones from an ankle to the top of the skeleton. It does not depend on the pose.
    pub fn stature(&self, skeleton: &Skeleton) -> f64 {
        let length = |from: usize, to: usize| {
            let (mut way, mut at) = (0.0, from);
            while at != to {
                way += DVec3::from_array(skeleton.bones[at].offset).length();
                match skeleton.bones[at].parent {
                    Some(parent) => at = parent,
                    None => break,
                }
            }
            way
        };
        let leg = 0.5 * (length(self.ankles[0], self.pelvis) + length(self.ankles[1], self.pelvis));
        let top = [self.head, self.neck].into_iter().flatten().find(|top| skeleton.hangs(*top, self.pelvis));
        leg + top.map_or_else(|| 1.2 * length(self.shoulders[0], self.pelvis), |top| length(top, self.pelvis))
    }

    /// Vector from the midpoint of the hips to the midpoint of the shoulders.
    pub fn trunk(&self, pose: &SkeletonPose) -> DVec3 {
        middle(pose, self.shoulders) - middle(pose, self.hips)
    }

    /// Joints that can touch the ground, each with its usual height above the ground as a share of the stature.
    pub fn touching(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let with = |height: f64| move |joint: usize| (joint, height);
        (self.ankles.into_iter().map(with(0.05)))
            .chain(self.toes.into_iter().flatten().map(with(0.015)))
            .chain(self.knees.into_iter().map(with(0.035)))
            .chain(self.wrists.into_iter().flatten().map(with(0.03)))
            .chain(self.elbows.into_iter().map(with(0.03)))
            .chain([(self.pelvis, 0.07), (self.chest, 0.07)])
            .chain(self.head.map(with(0.05)))
    }
}

/// The midpoint of two joints.
pub(super) fn middle(pose: &SkeletonPose, [a, b]: [usize; 2]) -> DVec3 {
    0.5 * (pose.pos[a] + pose.pos[b])
}
