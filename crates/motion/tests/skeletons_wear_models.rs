//! A skeleton that follows a model moves like the model. The model's own bones move exactly alike. Another character's
//! limbs stay parallel to the model's and its hips coincide, whatever its lengths, unit and rest pose.

use crate::common::{file, model, shipped};
use glam::{DQuat, DVec3};
use marathon_motion::kinematics::Pose;
use marathon_motion::{Animation, Bone, Keyframe, Mapping, Skeleton, SkeletonPoser};
use marathon_physics::Model;
use std::path::Path;

fn quat(q: &[f64; 4]) -> DQuat {
    DQuat::from_xyzw(q[1], q[2], q[3], q[0])
}

/// Poses of all bodies.
fn bodies(model: &Model, qpos: &[f64]) -> Vec<([f64; 3], [f64; 4])> {
    let pose = Pose::of(model, qpos);
    pose.pos.iter().zip(&pose.quat).map(|(at, q)| (at.to_array(), [q.w, q.x, q.y, q.z])).collect()
}

/// Positions of a skeleton's joints.
fn joints(skeleton: &Skeleton, scale: f64, frame: &Keyframe) -> Vec<DVec3> {
    let mut poses: Vec<(DVec3, DQuat)> = Vec::new();
    for (bone, turn) in skeleton.bones.iter().zip(&frame.rotations) {
        let pose = match bone.parent {
            Some(parent) => {
                let (at, above) = poses[parent];
                (at + above * (scale * DVec3::from_array(bone.offset)), above * quat(turn))
            }
            None => (DVec3::from_array(frame.root), quat(turn)),
        };
        poses.push(pose);
    }
    poses.into_iter().map(|(at, _)| at).collect()
}

#[test]
fn the_models_own_skeleton_moves_exactly_so() {
    let model = model("marathon_man");
    let clip = shipped("marathon_man", "cartwheel");
    let own = Animation::of_clip("cartwheel".as_ref(), &model, &clip).expect("its own clip");
    let hips = ["left_thigh", "right_thigh"];
    let mapping = Mapping::by_name("own".as_ref(), own.skeleton(), &model, hips).expect("its own names");
    let poser = SkeletonPoser::new(&model, &mapping, own.skeleton());
    assert!((poser.scale() - 1.0).abs() < 1e-12);
    for i in 0..clip.frames() {
        let frame = poser.pose(&bodies(&model, clip.frame(i)));
        let theirs = own.clip().frame(i);
        for k in 0..3 {
            assert!((frame.root[k] - theirs[k]).abs() < 1e-9, "frame {i}: root {:?}, {:?}", frame.root, &theirs[..3]);
        }
        for (bone, turn) in frame.rotations.iter().enumerate() {
            let expected = DQuat::from_xyzw(
                theirs[4 + 4 * bone],
                theirs[5 + 4 * bone],
                theirs[6 + 4 * bone],
                theirs[3 + 4 * bone],
            );
            assert!(quat(turn).angle_between(expected) < 1e-6, "frame {i}, bone {bone}");
        }
    }
}

/// A character in centimeters and T-pose that faces -y, with names of another program.
fn figure() -> Skeleton {
    let rows: [(&str, Option<usize>, [f64; 3]); 17] = [
        ("mixamorig:Hips", None, [0.0, 0.0, 0.0]),
        ("mixamorig:LeftUpLeg", Some(0), [9.0, 0.0, -6.0]),
        ("mixamorig:LeftLeg", Some(1), [1.0, 0.0, -45.0]),
        ("mixamorig:LeftFoot", Some(2), [0.0, 2.0, -43.0]),
        ("mixamorig:RightUpLeg", Some(0), [-9.0, 0.0, -6.0]),
        ("mixamorig:RightLeg", Some(4), [-1.0, 0.0, -45.0]),
        ("mixamorig:RightFoot", Some(5), [0.0, 2.0, -43.0]),
        ("mixamorig:Spine", Some(0), [0.0, 0.0, 10.0]),
        ("mixamorig:Spine1", Some(7), [0.0, 0.0, 12.0]),
        ("mixamorig:Spine2", Some(8), [0.0, 0.0, 14.0]),
        ("mixamorig:LeftShoulder", Some(9), [5.0, 0.0, 12.0]),
        ("mixamorig:LeftArm", Some(10), [12.0, 0.0, 0.0]),
        ("mixamorig:LeftForeArm", Some(11), [28.0, 0.0, 0.0]),
        ("mixamorig:LeftHand", Some(12), [26.0, 0.0, 0.0]),
        ("mixamorig:RightArm", Some(9), [-17.0, 0.0, 12.0]),
        ("mixamorig:RightForeArm", Some(14), [-28.0, 0.0, 0.0]),
        ("mixamorig:RightHand", Some(15), [-26.0, 0.0, 0.0]),
    ];
    let bone = |(name, parent, offset): (&str, Option<usize>, [f64; 3])| Bone {
        name: name.into(),
        parent,
        offset,
        rest: [1.0, 0.0, 0.0, 0.0],
    };
    Skeleton { bones: rows.map(bone).into() }
}

#[test]
fn limbs_of_another_figure_are_parallel_to_the_models() {
    let (model, skeleton) = (model("marathon_man"), figure());
    let mapping = Mapping::built_in("figure.glb".as_ref(), &skeleton, &model).expect("names that are understood");
    let poser = SkeletonPoser::new(&model, &mapping, &skeleton);
    assert!((0.007..0.011).contains(&poser.scale()), "centimeters: {}", poser.scale());
    let anchor = |pose: &Pose, name: &str| {
        let body = model.bodies.iter().position(|body| body.name == name).expect("a body");
        let first = &model.joints[model.bodies[body].joint_start];
        pose.point(body, first.pos.into())
    };
    let limbs = [
        (1, 2, "left_thigh", "left_shin"),
        (2, 3, "left_shin", "left_foot"),
        (4, 5, "right_thigh", "right_shin"),
        (5, 6, "right_shin", "right_foot"),
        (11, 12, "left_upper_arm", "left_larm"),
        (14, 15, "right_upper_arm", "right_larm"),
    ];
    for name in ["walk", "backflip", "cartwheel", "getup_faceup"] {
        let clip = shipped("marathon_man", name);
        for i in (0..clip.frames()).step_by(7) {
            let pose = Pose::of(&model, clip.frame(i));
            let frame = poser.pose(&bodies(&model, clip.frame(i)));
            let at = joints(&skeleton, poser.scale(), &frame);
            let hips = 0.5 * (at[1] + at[4]);
            let ours = 0.5 * (anchor(&pose, "left_thigh") + anchor(&pose, "right_thigh"));
            assert!(hips.distance(ours) < 1e-9, "{name}, frame {i}: hips at {hips}, the model's at {ours}");
            for (a, b, above, below) in limbs {
                let (theirs, ours) = (at[b] - at[a], anchor(&pose, below) - anchor(&pose, above));
                let length = poser.scale() * DVec3::from_array(skeleton.bones[b].offset).length();
                assert!((theirs.length() - length).abs() < 1e-9, "{name}, frame {i}: {above} keeps its length");
                let angle = theirs.angle_between(ours);
                assert!(angle < 1e-6, "{name}, frame {i}: {above} is off by {angle} rad");
            }
            // the joints of the spine share its bend
            let [hip, low, high, chest] = [0, 7, 8, 9].map(|bone| turn_in_world(&skeleton, &frame, bone));
            let whole = hip.angle_between(chest);
            for (a, b) in [(hip, low), (low, high), (high, chest)] {
                assert!((a.angle_between(b) - whole / 3.0).abs() < 1e-6, "{name}, frame {i}: the spine bends evenly");
            }
        }
    }
}

/// A character with legs of a third of the usual length is as large as the model, not three times as large. It stands
/// on the ground.
#[test]
fn a_figure_with_short_legs_is_no_giant() {
    let model = model("marathon_man");
    let poser = |skeleton: &Skeleton| {
        let mapping = Mapping::built_in("figure.glb".as_ref(), skeleton, &model).expect("names that are understood");
        SkeletonPoser::new(&model, &mapping, skeleton)
    };
    let (usual, mut short) = (figure(), figure());
    for bone in [2, 3, 5, 6] {
        short.bones[bone].offset = short.bones[bone].offset.map(|x| x / 3.0);
    }
    let (own, shrunk) = (poser(&usual), poser(&short));
    let larger = shrunk.scale() / own.scale();
    assert!((1.2..2.0).contains(&larger), "{larger} times as large as with usual legs");
    let heights = |skeleton: &Skeleton, poser: &SkeletonPoser| {
        let frame = poser.pose(&bodies(&model, &model.qpos0));
        joints(skeleton, poser.scale(), &frame).iter().map(|at| at.z).collect::<Vec<_>>()
    };
    let (a, b) = (heights(&usual, &own), heights(&short, &shrunk));
    assert!((a[3] - b[3]).abs() < 0.03 && (a[6] - b[6]).abs() < 0.03, "feet at {} and {} m", a[3], b[3]);
    let tall = |heights: &[f64]| heights[11] - heights[3];
    assert!((tall(&b) / tall(&a) - 1.0).abs() < 0.25, "shoulders {} and {} m above the feet", tall(&a), tall(&b));
}

/// The skeleton of a skin with unrotated rest frames, z up instead of glTF's y.
fn skin(path: &Path) -> Skeleton {
    let gltf = gltf::Gltf::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let joints: Vec<gltf::Node> = gltf.skins().next().expect("a skin").joints().collect();
    let parent =
        |node: &gltf::Node| joints.iter().position(|above| above.children().any(|child| child.index() == node.index()));
    let bone = |node: &gltf::Node| {
        let (at, turn, scale) = node.transform().decomposed();
        assert_eq!((turn, scale), ([0.0, 0.0, 0.0, 1.0], [1.0; 3]));
        let name = node.name().expect("a name").into();
        Bone { name, parent: parent(node), offset: [at[0], -at[2], at[1]].map(f64::from), rest: [1.0, 0.0, 0.0, 0.0] }
    };
    Skeleton { bones: joints.iter().map(bone).collect() }
}

/// Marathon's own skin has the model's limbs: its joints stay at the model's.
#[test]
fn the_skin_of_marathon_man_fits_him() {
    let (model, path) = (model("marathon_man"), file("assets/skins/marathon_man.glb"));
    assert!(std::fs::metadata(&path).expect("the skin").len() < 300_000);
    let skeleton = skin(&path);
    let mapping = Mapping::built_in(&path, &skeleton, &model).expect("names that are understood");
    let poser = SkeletonPoser::new(&model, &mapping, &skeleton);
    assert!((poser.scale() - 1.0).abs() < 1e-4, "as large as he is: {}", poser.scale());
    let find = |name: &str| skeleton.bones.iter().position(|bone| bone.name == name).expect("a bone");
    let clip = shipped("marathon_man", "cartwheel");
    let rest = std::iter::once(model.qpos0.as_slice());
    for qpos in rest.chain((0..clip.frames()).map(|i| clip.frame(i))) {
        let frame = poser.pose(&bodies(&model, qpos));
        let at = joints(&skeleton, poser.scale(), &frame);
        // the arms hang from a spine that bends elsewhere
        for (bone, body, most) in [
            ("LeftUpLeg", "left_thigh", 1e-3),
            ("RightLeg", "right_shin", 1e-3),
            ("LeftFoot", "left_foot", 1e-3),
            ("RightArm", "right_upper_arm", 0.05),
            ("LeftForeArm", "left_larm", 0.05),
        ] {
            let i = model.bodies.iter().position(|other| other.name == body).expect("a body");
            let apart = at[find(bone)].distance(Pose::of(&model, qpos).pos[i]);
            assert!(apart < most, "{bone} is {apart} m from {body}");
        }
    }
}

/// Orientation of a bone with an unrotated rest frame.
fn turn_in_world(skeleton: &Skeleton, frame: &Keyframe, bone: usize) -> DQuat {
    let own = quat(&frame.rotations[bone]);
    skeleton.bones[bone].parent.map_or(own, |parent| turn_in_world(skeleton, frame, parent) * own)
}
