//! Joint roles, and the names that common skeletons use for them.

use crate::skeleton::Skeleton;

/// A role without its side, and the joint names that match it, best first. Names are compared in lower case, without
/// prefixes such as `mixamorig:`, side and punctuation.
///
/// Sources of the names: DeepMimic; Mixamo and Autodesk's HumanIK (also used by CMU's motions in BVH and LAFAN1); CMU's
/// ASF; Unity's and VRM's humanoid; Unreal's mannequin; Blender's Rigify and its deforming bones; 3ds Max's Biped;
/// Poser and Daz; Bandai Namco's motions; the bodies of Marathon's models.
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

/// Prefixes of all names in a skeleton: 3ds Max's Biped, Rigify's deforming bones and VRoid.
const PREFIXES: [&str; 7] = ["bip001", "bip01", "def-", "def_", "org-", "j_bip_c_", "j_bip_"];

/// Side of a character.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Left,
    Right,
}

/// The joint with this name or, if there is none, with this role: `root`, `chest`, `neck`, `head`, or `left_` or
/// `right_` and `hip`, `knee`, `ankle`, `toe`, `shoulder`, `elbow`, `wrist`.
pub(crate) fn find(skeleton: &Skeleton, wanted: &str) -> Option<usize> {
    if wanted == "root" {
        return pelvis(skeleton);
    }
    exact(skeleton, wanted).or_else(|| by_role(skeleton, wanted))
}

fn exact(skeleton: &Skeleton, wanted: &str) -> Option<usize> {
    skeleton.bones.iter().position(|bone| bone.name == wanted)
}

/// The joint above both thighs, found by its name. In some skeletons, "root" is a joint on the ground instead.
fn pelvis(skeleton: &Skeleton) -> Option<usize> {
    let named = exact(skeleton, "root").or_else(|| by_role(skeleton, "root"));
    let thighs = ["left_hip", "right_hip"].map(|name| exact(skeleton, name).or_else(|| by_role(skeleton, name)));
    let [Some(left), Some(right)] = thighs else { return named };
    let fork = fork(skeleton, left, right);
    match (named, fork) {
        (Some(named), Some(fork)) if named != fork && skeleton.hangs(fork, named) => Some(fork),
        (Some(named), _) => Some(named),
        (None, fork) => fork,
    }
}

/// The joint that carries the skeleton: the lowest one above both legs and arms. `None` if the names do not identify
/// it.
pub(crate) fn carrier(skeleton: &Skeleton) -> Option<usize> {
    let joint = |role: &str| find(skeleton, role);
    let legs = fork(skeleton, joint("left_hip")?, joint("right_hip")?)?;
    let arms = fork(skeleton, joint("left_shoulder")?, joint("right_shoulder")?)?;
    if skeleton.hangs(arms, legs) { Some(legs) } else { fork(skeleton, arms, legs) }
}

/// The lowest common ancestor of two joints.
pub(crate) fn fork(skeleton: &Skeleton, a: usize, b: usize) -> Option<usize> {
    let mut at = skeleton.bones[a].parent;
    while let Some(joint) = at.filter(|joint| !skeleton.hangs(b, *joint)) {
        at = skeleton.bones[joint].parent;
    }
    at
}

fn by_role(skeleton: &Skeleton, wanted: &str) -> Option<usize> {
    let (side, role) = split(wanted);
    let (_, names) = ROLES.iter().find(|(name, _)| *name == role)?;
    let prefix = common_prefix(skeleton);
    let bare = |name: &str| name.get(prefix.len()..).filter(|_| name.starts_with(&*prefix)).unwrap_or(name).to_string();
    // try the names as they are, then without common prefixes and suffixes
    let mut readings: [&dyn Fn(&str) -> String; 4] =
        [&|name| name.to_string(), &|name| bare(name), &|name| without_number(name).to_string(), &|name| {
            without_number(&bare(name)).to_string()
        }];
    // Sketchfab numbers all joints: Spine_2 is not a second spine joint
    let numbered = skeleton.bones.iter().filter(|bone| without_number(&bone.name) != bone.name).count();
    if 5 * numbered >= 3 * skeleton.bones.len() {
        readings.rotate_left(2);
    }
    readings.iter().find_map(|reading| {
        let joints: Vec<_> = skeleton.bones.iter().map(|bone| split(&reading(&bone.name))).collect();
        // if the clavicle is called a shoulder, the upper arm is called an arm
        let upper_arm = joints.iter().any(|(_, name)| name == "arm" || name == "upperarm");
        let fits = |name: &str| !(upper_arm && role == "shoulder" && name == "shoulder");
        (names.iter().filter(|name| fits(name)))
            .find_map(|name| joints.iter().position(|(their, joint)| *their == side && joint == name))
    })
}

/// The prefix of the pelvis's name that most other joints share, such as `mixamorig1` or `Character1_`.
fn common_prefix(skeleton: &Skeleton) -> String {
    let most = |prefix: &str| {
        let with = skeleton.bones.iter().filter(|bone| bone.name.starts_with(prefix)).count();
        5 * with >= 3 * skeleton.bones.len()
    };
    let prefixes = skeleton.bones.iter().filter_map(|bone| {
        let name = without_number(&bone.name);
        let lower = name.to_ascii_lowercase();
        let stem = ["hips", "pelvis", "hip"].iter().find_map(|pelvis| lower.strip_suffix(pelvis))?;
        Some(name[..stem.len()].to_string())
    });
    prefixes.filter(|prefix| !prefix.is_empty()).find(|prefix| most(prefix)).unwrap_or_default()
}

/// Removes the number that distinguishes copies: `Hips.001` in Blender, `Hips_8` in Sketchfab.
fn without_number(name: &str) -> &str {
    let stem = name.trim_end_matches(|letter: char| letter.is_ascii_digit());
    match stem.strip_suffix(['.', '_']) {
        Some(bare) if stem.len() < name.len() && !bare.is_empty() => bare,
        _ => name,
    }
}

/// A joint's side, and its name without side, prefix and punctuation.
fn split(name: &str) -> (Option<Side>, String) {
    let name = name.rsplit([':', '|']).next().unwrap_or(name);
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
    // Biped's Bip01 L Thigh, whose prefix may vary
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
    fn what_programs_put_around_names_does_not_hide_them() {
        let wanted = ["root", "chest", "left_hip", "left_knee", "left_ankle", "right_shoulder", "right_elbow"];
        let plain = ["Hips", "Spine2", "LeftUpLeg", "LeftLeg", "LeftFoot", "RightArm", "RightForeArm"];
        type Around = dyn Fn(usize, &str) -> String;
        let around: [&Around; 9] = [
            &|_, name| format!("mixamorig{name}"),
            &|_, name| format!("mixamorig1{name}"),
            &|_, name| format!("mixamorig12:{name}"),
            &|_, name| format!("Character1_{name}"),
            &|_, name| format!("{name}.001"),
            &|i, name| format!("{name}_{i}"),
            &|i, name| format!("{name}_0{}", 8 + i),
            &|_, name| format!("Armature|{name}"),
            &|i, name| format!("mixamorig:{name}_{i}"),
        ];
        for around in around {
            let names: Vec<String> = plain.iter().enumerate().map(|(i, name)| around(i, name)).collect();
            let skeleton = skeleton(&names.iter().map(String::as_str).collect::<Vec<_>>());
            for (i, wanted) in wanted.iter().enumerate() {
                assert_eq!(find(&skeleton, wanted), Some(i), "{wanted} among {names:?}");
            }
        }
        // a number can belong to the name: Rigify's spine.003 is the chest
        let mut rigify = skeleton(&["spine", "spine.001", "spine.002", "spine.003", "thigh.L", "thigh.R"]);
        rigify.bones[4].parent = Some(0);
        rigify.bones[5].parent = Some(0);
        assert_eq!(find(&rigify, "chest"), Some(3));
        assert_eq!(find(&rigify, "root"), Some(0));
        let mut vroid = skeleton(&["J_Bip_C_Hips", "J_Bip_C_Chest", "J_Bip_L_UpperLeg", "J_Bip_R_UpperArm"]);
        vroid.bones[2].parent = Some(0);
        assert_eq!(
            ["root", "chest", "left_hip", "right_shoulder"].map(|role| find(&vroid, role)),
            [0, 1, 2, 3].map(Some)
        );
    }

    #[test]
    fn the_root_is_the_joint_that_the_thighs_hang_from() {
        let names = ["root", "pelvis", "thigh_l", "thigh_r", "ik_foot_root"];
        let parents = [None, Some(0), Some(1), Some(1), Some(0)];
        let bones = names.into_iter().zip(parents).map(|(name, parent)| Bone {
            name: name.into(),
            parent,
            offset: [0.0; 3],
            rest: [1.0, 0.0, 0.0, 0.0],
        });
        assert_eq!(find(&Skeleton { bones: bones.collect() }, "root"), Some(1));
    }

    #[test]
    fn a_clavicle_is_no_shoulder() {
        let skeleton = skeleton(&["Hips", "LeftShoulder", "LeftArm", "LeftForeArm"]);
        assert_eq!(find(&skeleton, "left_shoulder"), Some(2));
        assert_eq!(find(&skeleton, "right_shoulder"), None);
    }
}
