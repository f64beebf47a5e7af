//! The same motion in a `.glb` and in a BVH file gives the same clip. The `.glb` has bones with other rest frames, a
//! scaled and rotated node above them, and binary data.

use crate::common::model;
use glam::{DQuat, DVec3};
use marathon_motion::{Clip, Mapping, import, retarget};
use serde_json::json;

const FRAMES: usize = 31;
const NAMES: [&str; 15] = [
    "Hips",
    "LeftUpLeg",
    "LeftLeg",
    "LeftFoot",
    "RightUpLeg",
    "RightLeg",
    "RightFoot",
    "Spine2",
    "LeftArm",
    "LeftForeArm",
    "LeftHand",
    "RightArm",
    "RightForeArm",
    "RightHand",
    "Head",
];
const PARENTS: [Option<usize>; 15] = [
    None,
    Some(0),
    Some(1),
    Some(2),
    Some(0),
    Some(4),
    Some(5),
    Some(0),
    Some(7),
    Some(8),
    Some(9),
    Some(7),
    Some(11),
    Some(12),
    Some(7),
];
/// Offsets in centimeters, y up, in T-pose.
const OFFSETS: [[f64; 3]; 15] = [
    [0.0, 0.0, 0.0],
    [10.0, -5.0, 0.0],
    [0.0, -42.0, 0.0],
    [0.0, -42.0, 0.0],
    [-10.0, -5.0, 0.0],
    [0.0, -42.0, 0.0],
    [0.0, -42.0, 0.0],
    [0.0, 40.0, 0.0],
    [17.0, 12.0, 0.0],
    [27.0, 0.0, 0.0],
    [27.0, 0.0, 0.0],
    [-17.0, 12.0, 0.0],
    [-27.0, 0.0, 0.0],
    [-27.0, 0.0, 0.0],
    [0.0, 25.0, 0.0],
];

/// Degrees about z, x and y of each joint in a frame, and the position of the hips, cm.
fn pose(frame: usize) -> ([[f64; 3]; 15], [f64; 3]) {
    let share = frame as f64 / (FRAMES - 1) as f64;
    let mut turns = [[0.0; 3]; 15];
    turns[0] = [0.0, 5.0 * share, 20.0 * share];
    turns[1] = [0.0, -60.0 * share, 0.0];
    turns[2] = [0.0, 90.0 * share, 0.0];
    turns[8] = [-75.0, 0.0, 10.0 * share];
    turns[11] = [75.0, -40.0 * share, 0.0];
    turns[12] = [0.0, 0.0, 30.0 * share];
    (turns, [3.0 * share, 95.0, 20.0 * share])
}

fn turn([z, x, y]: [f64; 3]) -> DQuat {
    let [z, x, y] = [z, x, y].map(f64::to_radians);
    DQuat::from_rotation_z(z) * DQuat::from_rotation_x(x) * DQuat::from_rotation_y(y)
}

fn bvh() -> String {
    fn joint(i: usize, out: &mut String) {
        let [x, y, z] = OFFSETS[i];
        let (word, places) = if i == 0 { ("ROOT", "6 Xposition Yposition Zposition") } else { ("JOINT", "3") };
        out.push_str(&format!("{word} {} {{ OFFSET {x} {y} {z}\n", NAMES[i]));
        out.push_str(&format!("CHANNELS {places} Zrotation Xrotation Yrotation\n"));
        (0..15).filter(|k| PARENTS[*k] == Some(i)).for_each(|k| joint(k, out));
        out.push_str("}\n");
    }
    let mut out = String::from("HIERARCHY\n");
    joint(0, &mut out);
    out.push_str(&format!("MOTION\nFrames: {FRAMES}\nFrame Time: {}\n", 1.0 / 60.0));
    for frame in 0..FRAMES {
        let (turns, place) = pose(frame);
        let numbers: Vec<String> = place.iter().chain(turns.iter().flatten()).map(f64::to_string).collect();
        out.push_str(&numbers.join(" "));
        out.push('\n');
    }
    out
}

/// A rotation of each joint's own rest frame.
fn own_frame(joint: usize) -> DQuat {
    DQuat::from_euler(glam::EulerRot::XYZ, 0.3 * joint as f64, -0.2 * joint as f64, 0.5)
}

fn glb() -> Vec<u8> {
    // Blender's node above a skeleton
    let armature = DQuat::from_rotation_x(-90f64.to_radians());
    let above = |i: usize| PARENTS[i].map_or(armature, own_frame);
    let numbers = |q: DQuat| q.to_array().to_vec();
    let mut nodes = vec![
        json!({ "name": "Armature", "children": [1], "rotation": numbers(armature), "scale": [0.01, 0.01, 0.01] }),
    ];
    for i in 0..15 {
        let place =
            above(i).conjugate() * if i == 0 { DVec3::new(0.0, 95.0, 0.0) } else { DVec3::from_array(OFFSETS[i]) };
        let children: Vec<usize> = (0..15).filter(|k| PARENTS[*k] == Some(i)).map(|k| k + 1).collect();
        let mut node = json!({
            "name": format!("mixamorig:{}", NAMES[i]), "translation": place.to_array(),
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
        let mut accessor = json!({
            "bufferView": views.len() - 1, "componentType": 5126, "count": values.len() / width, "type": kind,
        });
        if width == 1 {
            accessor["min"] = json!([values[0]]);
            accessor["max"] = json!([values[values.len() - 1]]);
        }
        accessors.push(accessor);
        accessors.len() - 1
    };
    let times = data((0..FRAMES).map(|i| i as f64 / 60.0).collect(), 1, "SCALAR");
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    for i in 0..15 {
        let turns = (0..FRAMES).flat_map(|frame| {
            let (turns, _) = pose(frame);
            // a rotation in the axes of the T-pose, in the joint's own frame
            let local = above(i).conjugate() * turn(turns[i]) * own_frame(i);
            numbers(local)
        });
        let output = data(turns.collect(), 4, "VEC4");
        samplers.push(json!({ "input": times, "output": output }));
        channels.push(json!({ "sampler": samplers.len() - 1, "target": { "node": i + 1, "path": "rotation" } }));
    }
    let places = (0..FRAMES).flat_map(|frame| (armature.conjugate() * DVec3::from_array(pose(frame).1)).to_array());
    let output = data(places.collect(), 3, "VEC3");
    samplers.push(json!({ "input": times, "output": output }));
    channels.push(json!({ "sampler": 15, "target": { "node": 1, "path": "translation" } }));

    let document = json!({
        "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }], "nodes": nodes,
        "skins": [{ "joints": (1..16).collect::<Vec<_>>() }],
        "buffers": [{ "byteLength": bytes.len() }], "bufferViews": views, "accessors": accessors,
        "animations": [{ "samplers": samplers, "channels": channels }],
    });
    chunks(&document, &bytes)
}

/// A `.glb` file from its two parts.
fn chunks(document: &serde_json::Value, bytes: &[u8]) -> Vec<u8> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut out = Vec::new();
    let length = 12 + 8 + text.len() + 8 + bytes.len();
    for word in [0x4654_6C67, 2, length as u32, text.len() as u32, 0x4E4F_534A] {
        out.extend(u32::to_le_bytes(word));
    }
    out.extend(text);
    out.extend((bytes.len() as u32).to_le_bytes());
    out.extend(0x004E_4942u32.to_le_bytes());
    out.extend(bytes);
    out
}

fn clip(name: &str, bytes: &[u8]) -> Clip {
    let humanoid = model("humanoid");
    let animation = import::any(name.as_ref(), bytes).unwrap_or_else(|error| panic!("{error}"));
    let mapping = Mapping::built_in(name.as_ref(), animation.skeleton(), &humanoid).unwrap_or_else(|e| panic!("{e}"));
    retarget(name.as_ref(), &animation, &humanoid, &mapping).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn both_files_give_the_same_clip() {
    let (a, b) = (clip("m.bvh", bvh().as_bytes()), clip("m.glb", &glb()));
    assert_eq!(a.frames(), b.frames());
    let mut moved = 0.0_f64;
    for i in 0..a.frames() {
        for (k, (x, y)) in a.frame(i).iter().zip(b.frame(i)).enumerate() {
            assert!((x - y).abs() < 2e-3, "frame {i}, number {k}: {x} and {y}");
            moved = moved.max((x - a.frame(0)[k]).abs());
        }
    }
    assert!(moved > 1.0, "the figure moves: {moved}");
}

#[test]
fn damaged_glb_files_are_read_or_refused_by_name() {
    let good = glb();
    let mut state = 1u64;
    let mut below = |end: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % end
    };
    let (mut read, mut refused) = (0, 0);
    for _ in 0..20_000 {
        let mut bytes = good.clone();
        for _ in 0..1 + below(3) {
            let at = below(bytes.len());
            match below(4) {
                0 => bytes[at] = below(256) as u8,
                // digits of the JSON
                1 => {
                    let digits: Vec<usize> =
                        (20..30_000.min(bytes.len())).filter(|i| bytes[*i].is_ascii_digit()).collect();
                    if !digits.is_empty() {
                        bytes[digits[below(digits.len())]] = b'0' + below(10) as u8;
                    }
                }
                2 => bytes[at] ^= 1 << below(8),
                _ => bytes.truncate(at + 1),
            }
        }
        match import::any("m.glb".as_ref(), &bytes) {
            Ok(_) => read += 1,
            Err(error) => {
                refused += 1;
                assert!(error.to_string().starts_with("m.glb"), "{error}");
            }
        }
    }
    assert!(read > 100 && refused > 500, "{read} read, {refused} refused");
}

/// A kilobyte must not allocate gigabytes: keys at both ends of an hour, and a thousand joints.
#[test]
fn more_than_fits_is_refused_before_it_is_made() {
    let good = glb();
    let length = |at: usize| u32::from_le_bytes(good[at..at + 4].try_into().unwrap()) as usize;
    let mut document: serde_json::Value = serde_json::from_slice(&good[20..20 + length(12)]).unwrap();
    let nodes = document["nodes"].as_array_mut().unwrap();
    let (first, last) = (nodes.len(), nodes.len() + 1000);
    nodes.extend((first..last).map(|i| json!({ "name": format!("bead {i}") })));
    nodes[1]["children"].as_array_mut().unwrap().extend((first..last).map(|i| json!(i)));
    document["skins"][0]["joints"].as_array_mut().unwrap().extend((first..last).map(|i| json!(i)));
    let mut data = good[20 + length(12) + 8..].to_vec();
    data[4 * (FRAMES - 1)..4 * FRAMES].copy_from_slice(&3600f32.to_le_bytes());
    let bytes = chunks(&document, &data);
    let start = std::time::Instant::now();
    let error = import::any("m.glb".as_ref(), &bytes).unwrap_err().to_string();
    assert!(error.starts_with("m.glb: the motion asks for 21.1 GB; the limit 'memory' is 2 GB"), "{error}");
    assert!(start.elapsed().as_secs_f64() < 60.0, "it is refused before it is made");
}

#[test]
fn what_is_no_animation_is_refused_by_name() {
    let error = |bytes: &[u8]| import::any("m.glb".as_ref(), bytes).unwrap_err().to_string();
    assert!(
        error(b"glTF").starts_with("m.glb: glTF: found a length of 0 bytes, expected the file's, 4"),
        "{}",
        error(b"glTF")
    );
    // less than the header itself
    let mut short = glb();
    short[8..12].copy_from_slice(&4u32.to_le_bytes());
    assert!(
        error(&short).starts_with("m.glb: glTF: found a length of 4 bytes, expected the file's, "),
        "{}",
        error(&short)
    );
    let text = r#"{"asset": {"version": "2.0"}}"#;
    assert_eq!(error(text.as_bytes()), "m.glb: animations: found none, expected an animation; export the file with it");
}
