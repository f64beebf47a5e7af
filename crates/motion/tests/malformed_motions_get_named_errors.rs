//! Invalid files are refused with their name and the line, entry or frame, without a panic.

use crate::common::{file, model, shipped};
use marathon_motion::import::{self, Reading};
use marathon_motion::{About, Animation, Clip, Mapping, MotionError};

/// A text with one change.
fn changed(text: &str, from: &str, to: &str) -> Vec<u8> {
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1).into_bytes()
}

/// The text of a clip without its checksum.
fn bare(clip: &Clip) -> String {
    let text = String::from_utf8(clip.to_bytes()).unwrap();
    text.lines().filter(|line| !line.contains("\"checksum\"")).map(|line| format!("{line}\n")).collect()
}

fn unsealed(bytes: &[u8]) -> Result<Clip, MotionError> {
    Clip::parse_without_checksum("bad.motion".as_ref(), bytes)
}

#[test]
fn of_clips() {
    let kick = shipped("marathon_man", "kick");
    let good = bare(&kick.clone().with_about(About { fit: None, ..kick.about().clone() }));
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
        let error = unsealed(&changed(&good, from, to)).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{from} -> {to}: {error}");
    }
    let turned = format!("    [0, 0, 1, 0.5, 0, 0, 0{}],", ", 0".repeat(21));
    let error = unsealed(&changed(&good, frame, &turned)).unwrap_err().to_string();
    assert_eq!(error, "bad.motion: frame 0: the quaternion of \"root\" is 0.500 long, expected unit length");
}

#[test]
fn a_clip_without_its_checksum_or_with_another_number_is_refused() {
    let clip = shipped("marathon_man", "kick");
    let parse = |bytes: &[u8]| Clip::parse("kick.motion".as_ref(), bytes);
    let good = String::from_utf8(clip.to_bytes()).unwrap();
    assert_eq!(parse(good.as_bytes()).unwrap(), clip);
    // formatting does not change the checksum
    let spelled: String = good.split_whitespace().collect::<Vec<_>>().join("").replace(",0,", ",0.0,");
    let spaced =
        spelled.replace("DeepMimic(Pengetal.,2018),frompybullet3.2.7;retargetedbyMarathon", &clip.about().source);
    assert_eq!(parse(spaced.as_bytes()).unwrap(), clip);
    let error = parse(bare(&clip).as_bytes()).unwrap_err().to_string();
    assert_eq!(
        error,
        "kick.motion: checksum: found nothing, expected a checksum; \
         `marathon motion import kick.motion --out NEW.motion` writes one"
    );
    assert_eq!(Clip::parse_without_checksum("kick.motion".as_ref(), bare(&clip).as_bytes()).unwrap(), clip);
    // every digit and every word counts
    let changes =
        [("0.01", "0.02"), ("Zlib", "Zlip"), ("\"kick\"", "\"kack\""), ("right_knee", "right_knie"), ("4", "5")];
    for (from, to) in changes {
        let bytes = changed(&good, from, to);
        for result in [parse(&bytes), Clip::parse_without_checksum("kick.motion".as_ref(), &bytes)] {
            let error = result.unwrap_err().to_string();
            assert!(
                error.starts_with("kick.motion: checksum: found ") && error.contains("damaged or was edited"),
                "{error}"
            );
        }
    }
    let (mut bytes, mut refused) = (good.clone().into_bytes(), 0);
    for at in (0..bytes.len()).step_by(97) {
        bytes[at] ^= 1;
        match parse(&bytes) {
            Ok(read) => assert_eq!(read, clip, "byte {at}"),
            Err(_) => refused += 1,
        }
        bytes[at] ^= 1;
    }
    assert!(refused > 100, "{refused}");
}

#[test]
fn edits_beyond_what_a_clip_holds_are_refused() {
    let (path, man) = ("far.motion".as_ref(), model("marathon_man"));
    let still = shipped("marathon_man", "stand");
    let rows = |travel: f64, count: usize| -> Vec<Vec<f64>> {
        (0..count)
            .map(|i| {
                let mut row = still.frame(0).to_vec();
                row[0] = travel * (i as f64 / (count - 1) as f64 - 0.5);
                row
            })
            .collect()
    };
    let clip = |travel: f64, count: usize| {
        Clip::new(path, still.about().clone(), still.layout().clone(), 0.1, None, &rows(travel, count)).unwrap()
    };
    let error = clip(1.0, 2).looped(path, 0.1).unwrap_err().to_string();
    assert_eq!(
        error,
        "far.motion: frames of a loop: found 2, expected three or more, of which the last repeats the first"
    );
    assert_eq!(clip(1.0, 3).looped(path, 0.1).unwrap().frames(), 2);
    let far = clip(1.9e6, 20);
    let error = far.looped(path, 0.1).unwrap_err().to_string();
    assert!(error.starts_with("far.motion: cycle: found [1900000, 0, 0], expected numbers from"), "{error}");
    let error = far.at_origin(path).unwrap_err().to_string();
    assert!(error.starts_with("far.motion: frame 11: number 0 is 1"), "{error}");
    let animation = Animation::of_clip(path, &man, &far).unwrap();
    assert!(animation.looped(path).is_err());
    assert!(clip(1.0, 2).resample(path, 1.0).unwrap_err().to_string().contains("length: found 2 frames, 0.1000 s"));
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
    for (count, frames) in [(0, String::new()), (1, frame(0.1))] {
        let short = format!("{{\"Loop\": \"none\", \"Frames\": [{frames}]}}");
        let error = import::deepmimic("m.txt".as_ref(), short.as_bytes()).unwrap_err().to_string();
        assert_eq!(error, format!("m.txt: Frames: found {count} frames, expected two or more"));
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
        ("Yposition", "Xposition", "m.bvh:5:"),
        ("3 Xposition Yposition Z", "3 Xposition Zrotation Z", "m.bvh:5:"),
        ("  JOINT", "  JOIN", "m.bvh:6:3: found \"JOIN\", expected OFFSET, CHANNELS, JOINT, End Site or }"),
        ("Frames: 2", "Frames: 3", "m.bvh: frame 2: the file ends; expected 3 frames"),
        ("Frames: 2", "Frames: 0", "m.bvh:17:9: found 0 frames, expected a whole number from 2 to 1e7"),
        ("Frames: 2", "Frame: 2", "m.bvh:17:1: found \"Frame:\", expected Frames:"),
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
    let one = changed(&good.replace("Frames: 2", "Frames: 1"), "0 90 0 0\n", "");
    let error = import::bvh("m.bvh".as_ref(), &one).unwrap_err().to_string();
    assert!(error.starts_with("m.bvh:") && error.ends_with("found 1 frames, expected two or more"), "{error}");
    let error = import::bvh("m.bvh".as_ref(), b"HIERARCHY\nROOT \xff").unwrap_err().to_string();
    assert_eq!(error, "m.bvh:2:1: found bytes that are not UTF-8");
}

#[test]
fn bvh_as_programs_write_it_is_read() {
    let good = "HIERARCHY\nROOT Hips\n{\n  OFFSET 0 0 0\n  CHANNELS 3 Xposition Yposition Zrotation\n  JOINT Leg\n  {\n    \
                OFFSET 0 -80 0\n    CHANNELS 1 Xrotation\n    End Site\n    {\n      OFFSET 0 -10 0\n    }\n  }\n}\n\
                MOTION\nFrames: 2\nFrame Time: 0.1\n0 90 0 0\n0 90 0 5\n";
    let read = |text: &str| import::read("m.bvh".as_ref(), text.as_bytes(), &Reading::default()).unwrap();
    let expected = read(good).animation;
    let cases = [
        ("HIERARCHY", "\u{feff}HIERARCHY"),
        ("Frames: 2", "Frames:2"),
        ("Frames: 2", "Frames:\t2"),
        ("Frames: 2", "Frames : 2"),
        ("Frame Time: 0.1", "FrameTime: 0.1"),
        ("Frame Time: 0.1", "Frame Time:0.1"),
        ("Frame Time: 0.1", "frame time: 0.1"),
        ("End Site\n", "End Site Toe End\n"),
        ("\n", "\r\n"),
    ];
    for (from, to) in cases {
        let text = good.replace(from, to);
        assert_ne!(text, good);
        assert_eq!(read(&text).animation, expected, "{from:?} -> {to:?}");
    }
    // more rows than the file declares
    let more = read(&format!("{good}0 90 0 6\n"));
    assert_eq!(more.animation.clip().frames(), 3);
    assert_eq!(more.notes, ["the file says 2 frames and has more; all are read"]);
}

/// A small file must not cause hours of motion or gigabytes of memory.
#[test]
fn motions_beyond_the_budget_are_refused_before_they_are_made() {
    let start = std::time::Instant::now();
    let bvh = |frames: usize, step: f64, channels: &str| {
        format!(
            "HIERARCHY ROOT Hips {{ OFFSET 0 0 0 CHANNELS {channels} JOINT A {{ OFFSET 0 1 0 CHANNELS 0 }} }} \
             MOTION Frames: {frames} Frame Time: {step} "
        )
    };
    let error = |name: &str, text: &str| import::any(name.as_ref(), text.as_bytes()).unwrap_err().to_string();
    let long = bvh(5000, 1.0, "0");
    assert!(error("m.bvh", &long).starts_with("m.bvh: the motion asks for 5000 s; the limit 'recording_seconds'"));
    let huge = bvh(10_000_000, 1e-4, "0");
    assert!(error("m.bvh", &huge).starts_with("m.bvh: the motion asks for 3.60 GB; the limit 'memory' is 2 GB"));
    let frame = |dt: f64| {
        let numbers: Vec<String> = (0..44).map(|i| if i == 0 { dt.to_string() } else { one(i) }).collect();
        format!("[{}]", numbers.join(","))
    };
    let frames = vec![frame(10.0); 400].join(",");
    let deepmimic = format!("{{\"Frames\": [{frames}]}}");
    assert!(error("m.txt", &deepmimic).starts_with("m.txt: the motion asks for 3990 s"));
    // a motion of several hours
    let man = model("marathon_man");
    let still = shipped("marathon_man", "stand");
    let rows = vec![still.frame(0).to_vec(); 60];
    let slow = Clip::new("m".as_ref(), still.about().clone(), still.layout().clone(), 10.0, None, &rows).unwrap();
    let animation = Animation::of_clip("m".as_ref(), &man, &slow).unwrap();
    let fine = animation.with_clip(animation.clip().resample("m".as_ref(), 1.0 / 120.0).unwrap());
    let mapping = Mapping::by_name("m".as_ref(), fine.skeleton(), &man, ["left_thigh", "right_thigh"]).unwrap();
    let error = marathon_motion::retarget("m".as_ref(), &fine, &man, &mapping).unwrap_err().to_string();
    assert!(error.starts_with("m: the motion asks for") && error.contains("'memory'"), "{error}");
    assert!(animation.clip().resample("m".as_ref(), 1e-4).unwrap_err().to_string().contains("'memory'"));
    assert!(start.elapsed().as_secs_f64() < 60.0, "it is refused before it is made");
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
    assert!(
        error.contains("there is no built-in mapping for it, only for marathon_man, humanoid, walker2d"),
        "{error}"
    );
}

/// The number of a DeepMimic frame at rest at this position.
fn one(at: usize) -> String {
    let quaternions = [4, 8, 12, 16, 21, 25, 30, 35, 39];
    (if quaternions.contains(&at) { "1" } else { "0" }).into()
}
