//! A skeleton of a skin is the model's own: its joints move exactly as the bodies do. Bending a joint bends the surface there,
//! and leaves the far side of it in place.

use crate::common::models;
use glam::{DQuat, DVec3};
use marathon_motion::kinematics::Pose;
use marathon_motion::{Bone, Mapping, Skeleton, SkeletonPoser};
use marathon_physics::Model;
use marathon_physics::model::JointType;
use marathon_skin::{Options, Skin, skin};

/// The skeleton as the game reads it: z up instead of glTF's y.
fn skeleton(skin: &Skin) -> Skeleton {
    let at = |i: usize| DVec3::from_array(skin.skeleton[i].position.map(f64::from));
    let bone = |i: usize| {
        let joint = &skin.skeleton[i];
        let way = joint.parent.map_or(DVec3::ZERO, |parent| at(i) - at(parent));
        Bone {
            name: joint.name.clone(),
            parent: joint.parent,
            offset: [way.x, -way.z, way.y],
            rest: [1.0, 0.0, 0.0, 0.0],
        }
    };
    Skeleton { bones: (0..skin.skeleton.len()).map(bone).collect() }
}

/// A pose with all joints turned and the root moved. Slides above other joints stay, since bones keep their length.
fn bent(model: &Model, seed: usize) -> Vec<f64> {
    let mut qpos = model.qpos0.clone();
    let wave = |i: usize| libm::sin((i * 7 + seed * 13) as f64);
    for (i, joint) in model.joints.iter().enumerate() {
        let q = &mut qpos[joint.qpos_adr..];
        let turn = DQuat::from_xyzw(wave(i), wave(i + 1), wave(i + 2), 1.5).normalize();
        let turn = [turn.w, turn.x, turn.y, turn.z];
        match joint.kind {
            JointType::Free => {
                (0..3).for_each(|k| q[k] += wave(i + k));
                q[3..7].copy_from_slice(&turn);
            }
            JointType::Ball => q[..4].copy_from_slice(&turn),
            JointType::Hinge => q[0] += wave(i),
            JointType::Slide if model.bodies[joint.body].parent == 0 => q[0] += wave(i),
            JointType::Slide => {}
        }
    }
    qpos
}

/// Whether all joints of a body turn about one point. If not, the first one moves a little in the parent, and bones cannot.
fn one_anchor(model: &Model, body: usize) -> bool {
    let body = &model.bodies[body];
    let joints = &model.joints[body.joint_start..][..body.joint_count];
    body.parent == 0 || joints.iter().all(|joint| joint.pos == joints[0].pos)
}

fn quat(q: [f64; 4]) -> DQuat {
    DQuat::from_xyzw(q[1], q[2], q[3], q[0])
}

#[test]
fn joints_move_as_their_bodies_do() {
    let mut exact = 0;
    for (name, model) in models() {
        let skin = skin(&model, &Options { triangles: 500 }).expect("a skin");
        let skeleton = skeleton(&skin);
        let named = (skin.skeleton.iter()).all(|joint| model.bodies.iter().any(|body| body.name == joint.name));
        if !named || model.joints.is_empty() {
            continue;
        }
        let mapping = Mapping::own(&skeleton, &model).unwrap_or_else(|| panic!("{name}: the skeleton is its own"));
        let poser = SkeletonPoser::new(&model, &mapping, &skeleton);
        assert!((poser.scale() - 1.0).abs() < 1e-5, "{name}: {}", poser.scale());
        let rest = Pose::of(&model, &model.qpos0);
        for seed in 0..5 {
            let pose = Pose::of(&model, &bent(&model, seed));
            let bodies: Vec<([f64; 3], [f64; 4])> =
                (pose.pos.iter().zip(&pose.quat)).map(|(at, q)| (at.to_array(), [q.w, q.x, q.y, q.z])).collect();
            let frame = poser.pose(&bodies);
            let mut joints: Vec<(DVec3, DQuat)> = Vec::new();
            for (i, bone) in skeleton.bones.iter().enumerate() {
                let own = quat(frame.rotations[i]);
                joints.push(match bone.parent.map(|parent| joints[parent]) {
                    Some((at, turn)) => (at + turn * DVec3::from_array(bone.offset), turn * own),
                    None => (DVec3::from_array(frame.root), own),
                });
                let body = model.bodies.iter().position(|body| body.name == bone.name).expect("a body");
                let [y, z, x] = skin.skeleton[i].position.map(f64::from);
                let local = rest.quat[body].conjugate() * (DVec3::new(x, y, z) - rest.pos[body]);
                let expected = pose.point(body, local);
                let mut up =
                    std::iter::successors(Some(body), |at| Some(model.bodies[*at].parent)).take_while(|at| *at > 0);
                let most = if up.all(|at| one_anchor(&model, at)) { 1e-5 } else { 0.05 };
                let apart = joints[i].0.distance(expected);
                assert!(apart < most, "{name}: {} is {apart} m from its body", bone.name);
                exact += usize::from(most < 1e-4);
                // glTF's front is -y of the skeleton, the model's is +x
                let theirs = joints[i].1 * DVec3::NEG_Y;
                let ours = pose.quat[body] * rest.quat[body].conjugate() * DVec3::X;
                assert!(theirs.distance(ours) < 1e-5, "{name}: {} faces {theirs}, not {ours}", bone.name);
            }
        }
    }
    assert!(exact > 500, "{exact}");
}

/// Positions of the vertices after one joint has turned about an axis of the file.
fn turned(skin: &Skin, joint: &str, turn: DQuat) -> Vec<DVec3> {
    let first = skin.skeleton.iter().position(|other| other.name == joint).expect("a joint");
    let at = DVec3::from_array(skin.skeleton[first].position.map(f64::from));
    let mut below = vec![false; skin.skeleton.len()];
    for (i, joint) in skin.skeleton.iter().enumerate() {
        below[i] = i == first || joint.parent.is_some_and(|parent| below[parent]);
    }
    let moved = |(i, p): (usize, &[f32; 3])| {
        let p = DVec3::from_array(p.map(f64::from));
        let row = skin.joints[i].iter().zip(&skin.weights[i]);
        let share: u32 = row.filter(|(joint, _)| below[usize::from(**joint)]).map(|(_, w)| u32::from(*w)).sum();
        p.lerp(at + turn * (p - at), f64::from(share) / 255.0)
    };
    skin.positions.iter().enumerate().map(moved).collect()
}

#[test]
fn a_bent_knee_moves_the_shin_only() {
    let (_, model) =
        models().into_iter().find(|(name, _)| name.ends_with("agents/marathon_man.xml")).expect("the model");
    let skin = skin(&model, &Options::default()).expect("a skin");
    let knee = skin.skeleton.iter().find(|joint| joint.name == "left_shin").expect("a knee").position;
    let bent = turned(&skin, "left_shin", DQuat::from_xyzw(0.6, 0.0, 0.0, 0.8));
    let (mut still, mut swung) = (0, 0);
    for (before, after) in skin.positions.iter().zip(&bent) {
        let way = DVec3::from_array(before.map(f64::from)).distance(*after);
        let below = before[0] > 0.0 && before[1] < knee[1] - 0.12;
        let elsewhere = before[0] < 0.0 || before[1] > knee[1] + 0.12;
        assert!(!elsewhere || way < 5e-3, "{before:?} is not the shin and moves {way} m");
        assert!(!below || way > 0.05, "{before:?} is the shin and moves {way} m");
        still += usize::from(elsewhere);
        swung += usize::from(below);
    }
    assert!(still > 1000 && swung > 300, "{still} {swung}");
}

/// Both legs of Gymnasium's walker are in the same place at rest. No vertex follows both.
#[test]
fn legs_in_one_place_move_apart() {
    let (_, model) =
        models().into_iter().find(|(name, _)| name.ends_with("gymnasium/walker2d.xml")).expect("the model");
    let skin = skin(&model, &Options::default()).expect("a skin");
    let mut seen = [0, 0];
    for (joints, weights) in skin.joints.iter().zip(&skin.weights) {
        let follows = |left: bool| {
            let leg = |joint: &u8| {
                let name = &skin.skeleton[usize::from(*joint)].name;
                name != "torso" && name.ends_with("_left") == left
            };
            joints.iter().zip(weights).any(|(joint, weight)| *weight > 0 && leg(joint))
        };
        let sides = [follows(false), follows(true)];
        assert_ne!(sides, [true; 2], "{joints:?} {weights:?}");
        (0..2).for_each(|i| seen[i] += usize::from(sides[i]));
    }
    assert!(seen.iter().all(|count| *count > 500), "{seen:?}");
}
