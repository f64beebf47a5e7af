//! Recordings of a foreign character: 2 s of walking of a taller person with longer legs and arms out at rest. One
//! skeleton with the names, units and axes of several programs.

use glam::{DQuat, DVec3, EulerRot};
use marathon_envs::registry;
use marathon_motion::Clip;
use marathon_motion::kinematics::Pose;
use marathon_physics::Model;
use serde_json::json;
use std::path::Path;

/// Seconds of the recordings.
const SECONDS: f64 = 2.0;
/// The person's legs by Marathon Man's.
const LEGS: f64 = 1.16;
/// Height of the hips at rest: the person's, cm, and Marathon Man's, m.
const HIPS: [f64; 2] = [100.0, 0.8643];

/// A joint: its name in Mixamo's skeletons, its parent, its rest offset from there, and the body of Marathon Man that
/// rotates like it. In centimeters; x to the left, y up, z forward.
struct Joint(&'static str, Option<usize>, [f64; 3], &'static str);

const JOINTS: [Joint; 21] = [
    Joint("Hips", None, [0.0, 0.0, 0.0], "butt"),
    Joint("LeftUpLeg", Some(0), [9.5, -6.0, 0.0], "left_thigh"),
    Joint("LeftLeg", Some(1), [0.0, -44.0, 0.0], "left_shin"),
    Joint("LeftFoot", Some(2), [0.0, -43.0, 0.0], "left_foot"),
    Joint("LeftToeBase", Some(3), [0.0, -7.0, 14.0], "left_foot"),
    Joint("RightUpLeg", Some(0), [-9.5, -6.0, 0.0], "right_thigh"),
    Joint("RightLeg", Some(5), [0.0, -44.0, 0.0], "right_shin"),
    Joint("RightFoot", Some(6), [0.0, -43.0, 0.0], "right_foot"),
    Joint("RightToeBase", Some(7), [0.0, -7.0, 14.0], "right_foot"),
    Joint("Spine", Some(0), [0.0, 11.0, 0.0], "lower_waist"),
    Joint("Spine2", Some(9), [0.0, 14.0, 0.0], "torso"),
    Joint("Neck", Some(10), [0.0, 26.0, 0.0], "torso"),
    Joint("Head", Some(11), [0.0, 10.0, 1.0], "torso"),
    Joint("LeftShoulder", Some(10), [3.0, 20.0, 0.0], "torso"),
    Joint("LeftArm", Some(13), [14.0, 0.0, 0.0], "left_upper_arm"),
    Joint("LeftForeArm", Some(14), [28.0, 0.0, 0.0], "left_larm"),
    Joint("LeftHand", Some(15), [26.0, 0.0, 0.0], "left_larm"),
    Joint("RightShoulder", Some(10), [-3.0, 20.0, 0.0], "torso"),
    Joint("RightArm", Some(17), [-14.0, 0.0, 0.0], "right_upper_arm"),
    Joint("RightForeArm", Some(18), [-28.0, 0.0, 0.0], "right_larm"),
    Joint("RightHand", Some(19), [-26.0, 0.0, 0.0], "right_larm"),
];

/// Position of the hips, cm, and rotation of each joint from rest in the world's axes.
struct Instant {
    hips: DVec3,
    turns: Vec<DQuat>,
}

/// Rotations of the joints, at a number of instants per second.
fn walking(rate: f64) -> Vec<Instant> {
    let model = registry::agent("MarathonMan").unwrap().model().unwrap();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/motions/marathon_man/walk.motion");
    let clip = Clip::parse(&file, &std::fs::read(&file).unwrap()).unwrap();
    let rest = Pose::of(&model, &model.qpos0);
    let body = |name: &str| model.bodies.iter().position(|body| body.name == name).unwrap();
    let mut qpos = vec![0.0; model.nq];
    (0..=(SECONDS * rate) as usize)
        .map(|i| {
            clip.qpos(i as f64 / rate, &mut qpos);
            let pose = Pose::of(&model, &qpos);
            let turn = |joint: &Joint| {
                let body = body(joint.3);
                axes(pose.quat[body] * rest.quat[body].conjugate() * lowered(&model, joint))
            };
            let hips = pose.pos[body("butt")];
            let place = 100.0 * LEGS * DVec3::new(hips.y, hips.z - HIPS[1], hips.x);
            Instant { hips: place + HIPS[0] * DVec3::Y, turns: JOINTS.iter().map(turn).collect() }
        })
        .collect()
}

/// A rotation in the axes of the recordings instead of Marathon's, where x is forward, y to the left and z up.
fn axes(q: DQuat) -> DQuat {
    DQuat::from_xyzw(q.y, q.z, q.x, q.w)
}

/// Rotation from arms that are out to those of Marathon Man at rest.
fn lowered(model: &Model, joint: &Joint) -> DQuat {
    let side = if joint.0.starts_with("Left") { DVec3::Y } else { -DVec3::Y };
    let down = match joint.3 {
        name if name.ends_with("upper_arm") => {
            let below = name.replace("upper_arm", "larm");
            model.bodies.iter().find(|body| body.name == below).unwrap().pos
        }
        name if name.ends_with("larm") => {
            let hand = name.replace("larm", "hand");
            model.geoms.iter().find(|geom| geom.name == hand).unwrap().pos
        }
        _ => return DQuat::IDENTITY,
    };
    DQuat::from_rotation_arc(side, DVec3::from_array(down).normalize())
}

/// A BVH file like CMU's motions, in centimeters, at 120 Hz; optionally with other joint names.
pub fn bvh(name: impl Fn(&str) -> String) -> String {
    fn joint(i: usize, name: &impl Fn(&str) -> String, out: &mut String) {
        let Joint(own, parent, [x, y, z], _) = JOINTS[i];
        let word = if parent.is_some() { "JOINT" } else { "ROOT" };
        let channels = if parent.is_some() { "3" } else { "6 Xposition Yposition Zposition" };
        out.push_str(&format!("{word} {}\n{{\nOFFSET {x} {y} {z}\n", name(own)));
        out.push_str(&format!("CHANNELS {channels} Zrotation Yrotation Xrotation\n"));
        let children: Vec<usize> = (0..JOINTS.len()).filter(|k| JOINTS[*k].1 == Some(i)).collect();
        children.iter().for_each(|k| joint(*k, name, out));
        if children.is_empty() {
            out.push_str("End Site\n{\nOFFSET 0 5 0\n}\n");
        }
        out.push_str("}\n");
    }
    let instants = walking(120.0);
    let mut out = String::from("HIERARCHY\n");
    joint(0, &name, &mut out);
    out.push_str(&format!("MOTION\nFrames: {}\nFrame Time: 0.0083333\n", instants.len()));
    for Instant { hips, turns } in &instants {
        let mut row: Vec<String> = hips.to_array().map(|number| format!("{number:.4}")).into();
        for (turn, joint) in turns.iter().zip(&JOINTS) {
            let local = joint.1.map_or(*turn, |parent| turns[parent].conjugate() * *turn);
            let (z, y, x) = local.to_euler(EulerRot::ZYX);
            row.extend([z, y, x].map(|angle| format!("{:.4}", angle.to_degrees())));
        }
        out.push_str(&row.join(" "));
        out.push('\n');
    }
    out
}

/// A rotation of a joint's own rest frame, as in Blender's bones.
fn own_frame(joint: usize) -> DQuat {
    DQuat::from_euler(EulerRot::XYZ, 0.3 * joint as f64, -0.2 * joint as f64, 0.5)
}

/// A `.glb` file of one of Mixamo's characters as exported by Blender: an armature in centimeters that lies on its
/// back, with 30 keys per second.
pub fn glb() -> Vec<u8> {
    let armature = DQuat::from_rotation_x(-90f64.to_radians());
    let above = |i: usize| JOINTS[i].1.map_or(armature, own_frame);
    let numbers = |q: DQuat| q.to_array().to_vec();
    let mut nodes = vec![
        json!({ "name": "Armature", "children": [1], "rotation": numbers(armature), "scale": [0.01, 0.01, 0.01] }),
    ];
    for (i, Joint(name, parent, offset, _)) in JOINTS.iter().enumerate() {
        let rest = if parent.is_some() { DVec3::from_array(*offset) } else { HIPS[0] * DVec3::Y };
        let children: Vec<usize> = (0..JOINTS.len()).filter(|k| JOINTS[*k].1 == Some(i)).map(|k| k + 1).collect();
        let mut node = json!({
            "name": format!("mixamorig:{name}"), "translation": (above(i).conjugate() * rest).to_array(),
            "rotation": numbers(above(i).conjugate() * own_frame(i)),
        });
        if !children.is_empty() {
            node["children"] = json!(children);
        }
        nodes.push(node);
    }
    let (mut bytes, mut views, mut accessors) = (Vec::new(), Vec::new(), Vec::new());
    let mut data = |values: Vec<f64>, width: usize, kind: &str| {
        let start = bytes.len();
        values.iter().for_each(|value| bytes.extend((*value as f32).to_le_bytes()));
        views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": bytes.len() - start }));
        let (count, ends) = (values.len() / width, [values[0], values[values.len() - 1]]);
        let mut accessor =
            json!({ "bufferView": views.len() - 1, "componentType": 5126, "count": count, "type": kind });
        if width == 1 {
            (accessor["min"], accessor["max"]) = (json!([ends[0]]), json!([ends[1]]));
        }
        accessors.push(accessor);
        accessors.len() - 1
    };
    let instants = walking(30.0);
    let times = data((0..instants.len()).map(|i| i as f64 / 30.0).collect(), 1, "SCALAR");
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    for (i, joint) in JOINTS.iter().enumerate() {
        let turns = instants.iter().flat_map(|Instant { turns, .. }| {
            let local = joint.1.map_or(turns[i], |parent| turns[parent].conjugate() * turns[i]);
            // a rotation in the axes of the rest pose, in the joint's own frame
            numbers(above(i).conjugate() * local * own_frame(i))
        });
        let output = data(turns.collect(), 4, "VEC4");
        samplers.push(json!({ "input": times, "output": output }));
        channels.push(json!({ "sampler": i, "target": { "node": i + 1, "path": "rotation" } }));
    }
    let places = instants.iter().flat_map(|instant| (armature.conjugate() * instant.hips).to_array());
    let output = data(places.collect(), 3, "VEC3");
    samplers.push(json!({ "input": times, "output": output }));
    channels.push(json!({ "sampler": JOINTS.len(), "target": { "node": 1, "path": "translation" } }));

    let document = json!({
        "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }], "nodes": nodes,
        "skins": [{ "joints": (1..=JOINTS.len()).collect::<Vec<_>>() }],
        "buffers": [{ "byteLength": bytes.len() }], "bufferViews": views, "accessors": accessors,
        "animations": [{ "name": "mixamo.com", "samplers": samplers, "channels": channels }],
    });
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let length = 12 + 8 + text.len() + 8 + bytes.len();
    let mut out = Vec::new();
    for word in [0x4654_6C67, 2, length as u32, text.len() as u32, 0x4E4F_534A] {
        out.extend(u32::to_le_bytes(word));
    }
    out.extend(text);
    out.extend((bytes.len() as u32).to_le_bytes());
    out.extend(0x004E_4942u32.to_le_bytes());
    out.extend(bytes);
    out
}
