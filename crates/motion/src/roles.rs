//! Joints by what they are, under the names that skeletons of many makers give them.

use crate::skeleton::Skeleton;

/// A role without its side, and the names of joints that play it, most fitting first. Names are compared in lower case,
/// without a prefix such as `mixamorig:`, without their side and without punctuation.
///
/// Sources of the names: DeepMimic; Mixamo and Autodesk's HumanIK, whose names CMU's motions in BVH and LAFAN1 have; CMU's
/// ASF; Unity's and VRM's humanoid; Unreal's mannequin; Blender's Rigify and its deforming bones; 3ds Max's Biped; Poser and
/// Daz; Bandai Namco's motions; the bodies of Marathon's own models.
const ROLES: [(&str, &[&str]); 11] = [
    ("root", &["root", "hips", "hip", "pelvis", "butt", "spine"]),
    (
        "chest",
        &[
            "chest",
            "spine2",
            "spine3",
            "upperchest",
            "thorax",
            "spine003",
            "spine05",
            "spine04",
            "spine03",
            "spine02",
            "spine1",
            "spine01",
            "spine",
            "torso",
        ],
    ),
    ("neck", &["neck", "neck1", "neck01", "spine004", "head"]),
    ("hip", &["hip", "upleg", "upperleg", "thigh", "femur"]),
    ("knee", &["knee", "leg", "lowerleg", "shin", "calf", "tibia"]),
    ("ankle", &["ankle", "foot"]),
    ("toe", &["toe", "toebase", "toes", "toe0", "ball"]),
    ("shoulder", &["shoulder", "arm", "upperarm", "shldr", "humerus"]),
    ("elbow", &["elbow", "forearm", "lowerarm", "radius", "larm"]),
    ("wrist", &["wrist", "hand"]),
    ("head", &["head", "spine006"]),
];

/// What stands before all names of a skeleton: those of 3ds Max's Biped and of Rigify's deforming bones.
const PREFIXES: [&str; 5] = ["bip001", "bip01", "def-", "def_", "org-"];

/// Left or right of a figure.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Left,
    Right,
}

/// The joint of a name or, if no joint has it, of a role: `root`, `chest`, `neck`, `head`, or `left_` or `right_` and `hip`,
/// `knee`, `ankle`, `toe`, `shoulder`, `elbow`, `wrist`.
pub(crate) fn find(skeleton: &Skeleton, wanted: &str) -> Option<usize> {
    if let Some(exact) = skeleton.bones.iter().position(|bone| bone.name == wanted) {
        return Some(exact);
    }
    let (side, role) = split(wanted);
    let (_, names) = ROLES.iter().find(|(name, _)| *name == role)?;
    let joints: Vec<_> = skeleton.bones.iter().map(|bone| split(&bone.name)).collect();
    // where a clavicle is called a shoulder, the arm is called an arm
    let upper_arm = joints.iter().any(|(_, name)| name == "arm" || name == "upperarm");
    let fits = |name: &str| !(upper_arm && role == "shoulder" && name == "shoulder");
    (names.iter().filter(|name| fits(name)))
        .find_map(|name| joints.iter().position(|(their, joint)| *their == side && joint == name))
}

/// A joint's side, and its name without side, prefix and punctuation.
fn split(name: &str) -> (Option<Side>, String) {
    let name = name.rsplit(':').next().unwrap_or(name);
    let lower = name.to_ascii_lowercase();
    let lower = PREFIXES.iter().find_map(|prefix| lower.strip_prefix(prefix)).unwrap_or(&lower);
    let lower = lower.trim_start_matches(['_', '.', '-', ' ']);
    for (word, side) in [("left", Side::Left), ("right", Side::Right)] {
        if let Some(at) = lower.find(word) {
            return (Some(side), plain(&format!("{}{}", &lower[..at], &lower[at + word.len()..])));
        }
    }
    for (letter, side) in [("l", Side::Left), ("r", Side::Right)] {
        for mark in ['_', '.', '-', ' '] {
            if let Some(stem) = lower.strip_suffix(&format!("{mark}{letter}")) {
                return (Some(side), plain(stem));
            }
            if let Some(stem) = lower.strip_prefix(&format!("{letter}{mark}")) {
                return (Some(side), plain(stem));
            }
        }
    }
    // Biped's Bip01 L Thigh, whose prefix may be another
    for (letter, side) in [(" l ", Side::Left), (" r ", Side::Right)] {
        if let Some((_, stem)) = lower.split_once(letter) {
            return (Some(side), plain(stem));
        }
    }
    // CMU's lfemur, Poser's lThigh
    for (letter, side) in [("l", Side::Left), ("r", Side::Right)] {
        let stem = lower.strip_prefix(letter).map(plain);
        let known = |stem: &String| ROLES[3..10].iter().any(|(_, names)| names.contains(&stem.as_str()));
        if let Some(stem) = stem.filter(|stem| known(stem)) {
            return (Some(side), stem);
        }
    }
    (None, plain(lower))
}

fn plain(name: &str) -> String {
    name.chars().filter(char::is_ascii_alphanumeric).collect()
}

#[cfg(test)]
mod tests {
    use super::find;
    use crate::skeleton::{Bone, Skeleton};

    fn skeleton(names: &[&str]) -> Skeleton {
        let bone = |(i, name): (usize, &&str)| Bone {
            name: (*name).into(),
            parent: i.checked_sub(1),
            offset: [0.0; 3],
            rest: [1.0, 0.0, 0.0, 0.0],
        };
        Skeleton { bones: names.iter().enumerate().map(bone).collect() }
    }

    #[test]
    fn joints_of_many_makers_are_recognized() {
        let wanted = ["root", "left_hip", "left_knee", "left_ankle", "right_shoulder", "right_elbow", "right_wrist"];
        let makers: [[&str; 7]; 10] = [
            ["pelvis", "thigh_l", "calf_l", "foot_l", "upperarm_r", "lowerarm_r", "hand_r"],
            ["hip", "lThigh", "lShin", "lFoot", "rShldr", "rForeArm", "rHand"],
            [
                "Bip01 Pelvis",
                "Bip01 L Thigh",
                "Bip01 L Calf",
                "Bip01 L Foot",
                "Bip01 R UpperArm",
                "Bip01 R Forearm",
                "Bip01 R Hand",
            ],
            ["DEF-spine", "DEF-thigh.L", "DEF-shin.L", "DEF-foot.L", "DEF-upper_arm.R", "DEF-forearm.R", "DEF-hand.R"],
            ["Hips", "LeftUpLeg", "LeftLeg", "LeftFoot", "RightArm", "RightForeArm", "RightHand"],
            [
                "mixamorig:Hips",
                "mixamorig:LeftUpLeg",
                "mixamorig:LeftLeg",
                "mixamorig:LeftFoot",
                "mixamorig:RightArm",
                "mixamorig:RightForeArm",
                "mixamorig:RightHand",
            ],
            ["root", "lfemur", "ltibia", "lfoot", "rhumerus", "rradius", "rhand"],
            ["pelvis", "thigh.L", "shin.L", "foot.L", "upper_arm.R", "forearm.R", "hand.R"],
            ["Hips", "UpperLeg_L", "LowerLeg_L", "Foot_L", "UpperArm_R", "LowerArm_R", "Hand_R"],
            ["hips", "leftUpperLeg", "leftLowerLeg", "leftFoot", "rightUpperArm", "rightLowerArm", "rightHand"],
        ];
        for names in makers {
            let skeleton = skeleton(&names);
            for (i, wanted) in wanted.iter().enumerate() {
                assert_eq!(find(&skeleton, wanted), Some(i), "{wanted} among {names:?}");
            }
        }
    }

    #[test]
    fn a_clavicle_is_no_shoulder() {
        let skeleton = skeleton(&["Hips", "LeftShoulder", "LeftArm", "LeftForeArm"]);
        assert_eq!(find(&skeleton, "left_shoulder"), Some(2));
        assert_eq!(find(&skeleton, "right_shoulder"), None);
    }
}
