//! Reads glTF as Blender, gltfpack, VRM tools and the Khronos samples write it: scenes without nodes, integer
//! rotations, external data, compressed meshes, several animations.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use marathon_motion::import::{self, Reading, Recording};
use marathon_motion::{Animation, MotionError};
use serde_json::{Value, json};

const NAMES: [&str; 6] = ["Hips", "Spine", "LeftUpLeg", "LeftLeg", "RightUpLeg", "RightLeg"];
const PARENTS: [Option<usize>; 6] = [None, Some(0), Some(0), Some(2), Some(0), Some(4)];
const OFFSETS: [[f64; 3]; 6] =
    [[0.0, 0.9, 0.0], [0.0, 0.5, 0.0], [0.1, 0.0, 0.0], [0.0, -0.4, 0.0], [-0.1, 0.0, 0.0], [0.0, -0.4, 0.0]];

/// Encodings of rotations in a file.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Float,
    Short,
    Byte,
}

/// The left knee bends by `angle` within a second.
fn parts(kind: Kind, angles: &[f64]) -> (Value, Vec<u8>) {
    let mut bytes: Vec<u8> = [0f32, 0.5, 1.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let mut views = vec![json!({ "buffer": 0, "byteOffset": 0, "byteLength": 12 })];
    let mut accessors = vec![json!({
        "bufferView": 0, "componentType": 5126, "count": 3, "type": "SCALAR", "min": [0], "max": [1]
    })];
    let mut animations = Vec::new();
    for (i, angle) in angles.iter().enumerate() {
        let start = bytes.len();
        for share in [0.0, 0.5, 1.0] {
            let half = 0.5 * angle * share;
            for x in [half.sin(), 0.0, 0.0, half.cos()] {
                match kind {
                    Kind::Float => bytes.extend((x as f32).to_le_bytes()),
                    Kind::Short => bytes.extend(((x * 32767.0).round() as i16).to_le_bytes()),
                    Kind::Byte => bytes.push((x * 127.0).round() as i8 as u8),
                }
            }
        }
        views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": bytes.len() - start }));
        let component = [5126, 5122, 5120][kind as usize];
        accessors.push(json!({
            "bufferView": i + 1, "componentType": component, "count": 3, "type": "VEC4", "normalized": kind != Kind::Float
        }));
        animations.push(json!({
            "name": format!("bend {i}"),
            "samplers": [{ "input": 0, "output": i + 1 }],
            "channels": [{ "sampler": 0, "target": { "node": 3, "path": "rotation" } }],
        }));
    }
    let nodes: Vec<Value> = (0..6)
        .map(|i| {
            let children: Vec<usize> = (0..6).filter(|k| PARENTS[*k] == Some(i)).collect();
            let mut node = json!({ "name": NAMES[i], "translation": OFFSETS[i] });
            if !children.is_empty() {
                node["children"] = json!(children);
            }
            node
        })
        .collect();
    let document = json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": nodes,
        "skins": [{ "joints": [0, 1, 2, 3, 4, 5] }], "buffers": [{ "byteLength": bytes.len() }],
        "bufferViews": views, "accessors": accessors, "animations": animations,
    });
    (document, bytes)
}

fn glb(document: &Value, bytes: &[u8]) -> Vec<u8> {
    let (mut text, mut data) = (document.to_string().into_bytes(), bytes.to_vec());
    text.resize(text.len().next_multiple_of(4), b' ');
    data.resize(data.len().next_multiple_of(4), 0);
    let length = 28 + text.len() + data.len();
    let words = |words: &[u32]| words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>();
    let mut out = words(&[0x4654_6C67, 2, length as u32, text.len() as u32, 0x4E4F_534A]);
    out.extend(text);
    out.extend(words(&[data.len() as u32, 0x004E_4942]));
    out.extend(data);
    out
}

fn read(name: &str, bytes: &[u8], reading: &Reading) -> Result<Recording, MotionError> {
    import::read(name.as_ref(), bytes, reading)
}

fn plain(name: &str, bytes: &[u8]) -> Animation {
    read(name, bytes, &Reading::default()).unwrap_or_else(|error| panic!("{error}")).animation
}

/// The angle of the left knee in the last frame, rad.
fn bent(animation: &Animation) -> f64 {
    let knee =
        animation.skeleton().bones.iter().position(|bone| bone.name.contains("LowerLeg") || bone.name == "LeftLeg");
    let last = animation.clip().frame(animation.clip().frames() - 1);
    2.0 * last[3 + 4 * knee.expect("a knee")].clamp(-1.0, 1.0).acos()
}

#[test]
fn integers_stand_for_rotations() {
    for (kind, precision) in [(Kind::Float, 1e-6), (Kind::Short, 1e-3), (Kind::Byte, 2e-2)] {
        let (document, bytes) = parts(kind, &[1.2]);
        let animation = plain("m.glb", &glb(&document, &bytes));
        assert_eq!(animation.clip().frames(), 61);
        assert!((bent(&animation) - 1.2).abs() < precision, "{}", bent(&animation));
    }
}

#[test]
fn what_does_not_move_the_skeleton_is_not_read() {
    let (document, bytes) = parts(Kind::Float, &[1.2]);
    let expected = plain("m.glb", &glb(&document, &bytes));
    let changes = [
        // Blender writes scenes without nodes
        ("/scenes", json!([{ "name": "Face" }, { "nodes": [0] }])),
        ("/extensionsRequired", json!(["KHR_mesh_quantization", "KHR_draco_mesh_compression", "KHR_texture_basisu"])),
        (
            "/meshes",
            json!([{ "primitives": [{ "attributes": { "POSITION": 0 }, "extensions":
            { "KHR_draco_mesh_compression": { "bufferView": 0, "attributes": { "POSITION": 0 } } } }] }]),
        ),
        ("/materials", json!([{ "extensions": { "KHR_materials_unlit": {} } }])),
        ("/cameras", json!([{ "type": "unknown" }])),
    ];
    for (key, value) in changes {
        let mut changed = document.clone();
        changed[&key[1..]] = value;
        assert_eq!(plain("m.glb", &glb(&changed, &bytes)), expected, "{key}");
    }
    // channels of a node that is not a joint
    let mut changed = document.clone();
    let channels = changed["animations"][0]["channels"].as_array_mut().unwrap();
    channels
        .push(json!({ "sampler": 0, "target": { "path": "pointer", "extensions": { "KHR_animation_pointer": {} } } }));
    channels.push(json!({ "sampler": 7, "target": { "node": 3, "path": "weights" } }));
    assert_eq!(plain("m.glb", &glb(&changed, &bytes)), expected);
}

#[test]
fn an_unknown_extension_that_a_file_requires_is_noted() {
    let (mut document, bytes) = parts(Kind::Float, &[1.2]);
    let notes = |document: &Value| read("m.glb", &glb(document, &bytes), &Reading::default()).unwrap().notes;
    document["extensionsRequired"] = json!(["VRMC_vrm", "KHR_texture_basisu"]);
    assert_eq!(notes(&document), Vec::<String>::new());
    document["extensionsRequired"] = json!(["ACME_node_motion"]);
    let note = notes(&document).concat();
    assert!(note.contains("requires the glTF extension \"ACME_node_motion\""), "{note}");
}

#[test]
fn data_lies_within_a_gltf_or_beside_it() {
    let (document, bytes) = parts(Kind::Float, &[1.2]);
    let expected = plain("m.glb", &glb(&document, &bytes));
    let mut within = document.clone();
    within["buffers"][0]["uri"] = json!(format!("data:application/octet-stream;base64,{}", STANDARD.encode(&bytes)));
    assert_eq!(plain("m.gltf", within.to_string().as_bytes()), expected);

    let mut beside = document.clone();
    beside["buffers"][0]["uri"] = json!("my%20data.bin");
    let folder = |name: &str| if name == "my data.bin" { Ok(bytes.clone()) } else { Err("no such file".to_string()) };
    let reading = Reading { beside: Some(&folder), ..Reading::default() };
    assert_eq!(read("m.gltf", beside.to_string().as_bytes(), &reading).unwrap().animation, expected);
    let error = |document: &Value, reading: &Reading| {
        read("m.gltf", document.to_string().as_bytes(), reading).unwrap_err().to_string()
    };
    assert_eq!(
        error(&beside, &Reading::default()),
        "m.gltf: buffers[0]: found the file \"my data.bin\", expected data within this file; export as .glb"
    );
    beside["buffers"][0]["uri"] = json!("other.bin");
    assert_eq!(
        error(&beside, &reading),
        "m.gltf: buffers[0]: found the file \"other.bin\": no such file, expected a file beside this one"
    );
    within["buffers"][0]["uri"] = json!("data:application/octet-stream;base64,!!");
    assert!(error(&within, &reading).starts_with("m.gltf: buffers[0]: found Invalid symbol"));
}

#[test]
fn vrm_says_which_bone_is_which() {
    let (mut document, bytes) = parts(Kind::Float, &[1.2]);
    let bones = ["hips", "spine", "leftUpperLeg", "leftLowerLeg", "rightUpperLeg", "rightLowerLeg"];
    for (i, node) in document["nodes"].as_array_mut().unwrap().iter_mut().enumerate() {
        node["name"] = json!(format!("bone{i}"));
    }
    let new: serde_json::Map<String, Value> =
        bones.iter().enumerate().map(|(i, name)| ((*name).to_string(), json!({ "node": i }))).collect();
    let old: Vec<Value> = bones.iter().enumerate().map(|(i, name)| json!({ "bone": name, "node": i })).collect();
    for (name, extension) in [
        ("m.vrm", json!({ "VRM": { "humanoid": { "humanBones": old } } })),
        ("m.vrm", json!({ "VRMC_vrm": { "humanoid": { "humanBones": new } } })),
        ("m.vrma", json!({ "VRMC_vrm_animation": { "humanoid": { "humanBones": new } } })),
    ] {
        document["extensions"] = extension;
        let animation = plain(name, &glb(&document, &bytes));
        let names: Vec<&str> = animation.skeleton().bones.iter().map(|bone| bone.name.as_str()).collect();
        assert_eq!(names, bones, "{name}");
        assert!(names[3].eq_ignore_ascii_case("leftLowerLeg"));
    }
}

#[test]
fn an_animation_is_chosen_by_name_or_index() {
    let (document, bytes) = parts(Kind::Float, &[0.3, 0.6, 0.9]);
    let file = glb(&document, &bytes);
    let choose = |animation: Option<&str>| {
        let reading = Reading { animation: animation.map(String::from), ..Reading::default() };
        read("m.glb", &file, &reading)
    };
    for (asked, angle) in [(None, 0.3), (Some("bend 1"), 0.6), (Some("2"), 0.9), (Some("0"), 0.3)] {
        let found = bent(&choose(asked).unwrap().animation);
        assert!((found - angle).abs() < 1e-6, "{asked:?}: {found}");
    }
    let notes = choose(None).unwrap().notes;
    assert_eq!(
        notes[0],
        "animation 0 of 3 is read; --animation NAME|INDEX chooses among 0 \"bend 0\", 1 \"bend 1\", 2 \"bend 2\""
    );
    assert_eq!(
        choose(Some("bent 1")).unwrap_err().to_string(),
        "m.glb: animation: found \"bent 1\", expected one of 0 \"bend 0\", 1 \"bend 1\", 2 \"bend 2\"; did you mean 'bend 1'?"
    );
    assert!(choose(Some("3")).is_err());
    let error = read("m.bvh", b"", &Reading { animation: Some("a".into()), ..Reading::default() }).unwrap_err();
    assert!(error.to_string().contains("only glTF files have several"), "{error}");
}

#[test]
fn compressed_animations_are_refused_with_a_remedy() {
    let (mut document, bytes) = parts(Kind::Float, &[1.2]);
    document["bufferViews"][1]["extensions"] = json!({ "EXT_meshopt_compression": { "buffer": 0 } });
    let error = read("m.glb", &glb(&document, &bytes), &Reading::default()).unwrap_err().to_string();
    assert_eq!(
        error,
        "m.glb: an animation compressed with EXT_meshopt_compression is not supported; export the file without \
         compression; with gltfpack, leave out -c and -cc"
    );
}
