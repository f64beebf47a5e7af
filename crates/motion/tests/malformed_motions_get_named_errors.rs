//! Files that are not what they should be are refused with their name and the line, entry or frame, never with a panic.

mod common;

use common::{file, model, shipped};
use marathon_motion::{Clip, Mapping, import};

/// A text with one change.
fn changed(text: &str, from: &str, to: &str) -> Vec<u8> {
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1).into_bytes()
}

#[test]
fn of_clips() {
    let good = String::from_utf8(shipped("marathon_man", "kick").to_bytes()).unwrap();
    let frame = good.lines().find(|line| line.starts_with("    [0, 0,")).expect("the first frame");
    let cases = [
        ("\"motion\": 1", "\"motion\": 7", "bad.motion: motion: found 7, expected version 1 of the format"),
        ("\"dt\": 0.01", "\"dt\": -0.01", "bad.motion: dt: found -0.01"),
        ("\"dt\"", "\"dtt\"", "bad.motion:8:7: unknown field `dtt`"),
        ("\"none\"", "\"wrap\"", "bad.motion: cycle: found nothing, expected [x, y, yaw] of a cycle"),
        ("\"none\"", "\"never\"", "bad.motion:7:17: unknown variant `never`, expected `wrap` or `none`"),
        ("[\"root\", \"free\"]", "[\"root\", \"hinge\"]", "bad.motion: frame 0: found 28 numbers, expected 22"),
        (frame, "    [0, 0, 1],", "bad.motion: frame 0: found 3 numbers, expected 28"),
        ("    [0, 0, 1", "    [0, 0, 1e999", "bad.motion:34:"),
        ("    [0, 0, 1.", "    [0, 0, 1234567", "bad.motion: frame 0: number 2 is 1234567"),
        ("    [0, 0, 1.", "    [0, 0, \"1.\", ", "bad.motion:34:"),
        ("]\n  ]\n}", "]\n  ]\n", "bad.motion:129:0: EOF while parsing an object"),
    ];
    for (from, to, expected) in cases {
        let error = Clip::parse("bad.motion".as_ref(), &changed(&good, from, to)).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{from} -> {to}: {error}");
    }
    let turned = format!("    [0, 0, 1, 0.5, 0, 0, 0{}],", ", 0".repeat(21));
    let error = Clip::parse("bad.motion".as_ref(), &changed(&good, frame, &turned)).unwrap_err().to_string();
    assert_eq!(error, "bad.motion: frame 0: the quaternion of \"root\" is 0.500 long, expected unit length");
}

#[test]
fn of_clips_of_other_models() {
    let clip = shipped("marathon_man", "walk");
    let error = clip.check_model("walk.motion".as_ref(), &model("humanoid")).unwrap_err().to_string();
    assert!(
        error.starts_with("walk.motion: not a motion of the model humanoid: joint 4 is \"right_hip_y\""),
        "{error}"
    );
}

#[test]
fn of_deepmimic() {
    let frame = |dt: f64| {
        let mut numbers = vec![dt, 0.0, 0.9, 0.0];
        for width in [4, 4, 4, 4, 1, 4, 4, 1, 4, 1, 4, 4, 1] {
            numbers.extend((0..width).map(|i| if width == 4 && i == 0 { 1.0 } else { 0.0 }));
        }
        serde_json::to_string(&numbers).unwrap()
    };
    let good = format!("{{\"Loop\": \"none\",\n\"Frames\": [\n{},\n{},\n{}]}}", frame(0.1), frame(0.1), frame(0.0));
    assert_eq!(import::deepmimic("m.txt".as_ref(), good.as_bytes()).unwrap().clip().frames(), 3);
    let cases = [
        ("none", "maybe", "m.txt: Loop: found \"maybe\", expected \"wrap\" or \"none\""),
        ("[0.1,", "[", "m.txt: frame 0: found 43 numbers, expected 44"),
        ("[0.1,", "[0.0,", "m.txt: frame 0: lasts 0 s, expected 0.0001 to 10"),
        ("[0.1,", "[0.0005,", "m.txt: frame 1: lasts 0.1 s, expected up to 100 times the first frame's 0.0005 s"),
        ("0.9,0.0,1.0", "0.9,0.0,0.1", "m.txt: frame 0: the quaternion that ends at number 8 is 0.100 long"),
        ("[0.1,", "[true,", "m.txt:3:5: invalid type: boolean `true`, expected f64"),
        ("]}", "", "m.txt:5:"),
    ];
    for (from, to, expected) in cases {
        let error = import::deepmimic("m.txt".as_ref(), &changed(&good, from, to)).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{from} -> {to}: {error}");
    }
}

#[test]
fn of_bvh() {
    let good = "HIERARCHY\nROOT Hips\n{\n  OFFSET 0 0 0\n  CHANNELS 3 Xposition Yposition Zrotation\n  JOINT Leg\n  {\n    \
                OFFSET 0 -80 0\n    CHANNELS 1 Xrotation\n    End Site\n    {\n      OFFSET 0 -10 0\n    }\n  }\n}\n\
                MOTION\nFrames: 2\nFrame Time: 0.1\n0 90 0 0\n0 90 0 5\n";
    assert_eq!(import::bvh("m.bvh".as_ref(), good.as_bytes()).unwrap().clip().frames(), 2);
    let cases = [
        ("HIERARCHY", "HIERARCHIE", "m.bvh:1:1: found \"HIERARCHIE\", expected HIERARCHY"),
        ("OFFSET 0 -80 0", "OFFSET 0 x 0", "m.bvh:8:14: found \"x\", expected a number"),
        ("Xrotation", "Wrotation", "m.bvh:9:16: found \"Wrotation\", expected a channel such as"),
        ("CHANNELS 1 X", "CHANNELS 9 X", "m.bvh:9:14: found 9 channels, expected 0 to 6"),
        ("  JOINT", "  JOIN", "m.bvh:6:3: found \"JOIN\", expected OFFSET, CHANNELS, JOINT, End Site or }"),
        ("Frames: 2", "Frames: 3", "m.bvh: frame 2: the file ends; expected 3 frames"),
        ("Frames: 2", "Frames: 1", "m.bvh:17:9: found 1 frames, expected two or more"),
        ("0 90 0 5", "0 90 0 nan", "m.bvh:20:8: found \"nan\", expected a number"),
        ("0 90 0 5\n", "0 90 0 5\n7", "m.bvh:21:"),
        ("Time: 0.1", "Time: 0", "m.bvh: dt: found 0, expected a number of seconds"),
        ("Time: 0.1", "Time: 16.67", "m.bvh:18:13: found a frame time of 16.67, expected seconds, up to 1"),
        ("-80", "0", "m.bvh: HIERARCHY: found joints that all lie in one point"),
        ("}\nMOTION", "}\n}\nMOTION", "m.bvh:16:1: found \"}\", expected MOTION"),
    ];
    for (from, to, expected) in cases {
        let error = import::bvh("m.bvh".as_ref(), &changed(good, from, to)).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{from} -> {to}: {error}");
    }
    let error = import::bvh("m.bvh".as_ref(), b"HIERARCHY\nROOT \xff").unwrap_err().to_string();
    assert_eq!(error, "m.bvh:2:1: found bytes that are not UTF-8");
}

#[test]
fn of_recordings_of_unknown_kind() {
    let error = import::any("dance.fbx".as_ref(), b"").unwrap_err().to_string();
    assert!(
        error.starts_with("dance.fbx: a recording with the ending \"fbx\" is not supported; expected .bvh"),
        "{error}"
    );
}

#[test]
fn of_mappings() {
    let humanoid = model("humanoid");
    let good = std::fs::read_to_string(file("assets/motions/mappings/humanoid.json")).unwrap();
    let deepmimic = {
        let frame: String = (0..44).map(|i| if i == 0 { "0.1".into() } else { one(i) }).collect::<Vec<_>>().join(",");
        let text = format!("{{\"Frames\": [[{frame}], [{frame}]]}}");
        import::deepmimic("m.txt".as_ref(), text.as_bytes()).unwrap()
    };
    let cases = [
        ("\"mapping\": 1", "\"mapping\": 2", "m.json: mapping: found 2, expected version 1 of the format"),
        ("\"model\": \"humanoid\"", "\"model\": \"ant\"", "m.json: model: found \"ant\", expected \"humanoid\""),
        (
            "\"torso\":",
            "\"torzo\":",
            "m.json: parts: found \"torzo\", expected a body, geom or site of humanoid; did you mean 'torso'?",
        ),
        (
            "\"left_hip\"",
            "\"left_hipp\"",
            "m.json: parts.left_thigh.joint: found \"left_hipp\", expected a joint of the skeleton; did you mean 'left_hip'?",
        ),
        (
            "\"rotation\": 0.3",
            "\"rotation\": -1",
            "m.json: parts.lower_waist.rotation: found -1, expected a weight from 0 to 1000",
        ),
        ("\"share\": 0.5", "\"share\": 2", "m.json: parts.lower_waist.share: found 2, expected a number from 0 to 1"),
        (
            "\"hips\": [\"left_thigh\"",
            "\"hips\": [\"left_tigh\"",
            "m.json: hips: found left_tigh, expected bodies that are among the parts; did you mean 'left_thigh'?",
        ),
        (
            "\"soles\": [\"left_foot\"",
            "\"soles\": [\"left_fot\"",
            "m.json: soles: found left_fot, expected bodies of the model; did you mean 'left_foot'?",
        ),
        ("\"position\": 3", "\"positon\": 3", "m.json:"),
    ];
    for (from, to, expected) in cases {
        let bytes = changed(&good, from, to);
        let error = Mapping::parse("m.json".as_ref(), &bytes, deepmimic.skeleton(), &humanoid).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{from} -> {to}: {error}");
    }
    let ant = model("ant");
    let error = Mapping::built_in("m.txt".as_ref(), deepmimic.skeleton(), &ant).unwrap_err().to_string();
    assert!(error.contains("there is no mapping for it, only for marathon_man, humanoid, walker2d"), "{error}");
}

/// The number of a DeepMimic frame that stands still at this place.
fn one(at: usize) -> String {
    let quaternions = [4, 8, 12, 16, 21, 25, 30, 35, 39];
    (if quaternions.contains(&at) { "1" } else { "0" }).into()
}
