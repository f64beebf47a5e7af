//! `marathon motion` converts a recording to a checked clip in one command, draws it, retargets it to another
//! character, and reports the problems of bad recordings.

use crate::common::{assert_no_leftovers, fail, json, recording, run, succeed};
use std::path::{Path, PathBuf};

/// One of Marathon's clips.
fn shipped(name: &str) -> String {
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/motions").join(name);
    path.to_string_lossy().into_owned()
}

#[test]
fn a_recording_becomes_a_checked_clip() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("bend.txt"), recording()).unwrap();
    let import =
        ["motion", "import", "bend.txt", "--model", "humanoid", "--out", "bend.motion", "--license", "CC0-1.0"];
    let text = succeed(temp.path(), &import);
    assert!(text.starts_with("wrote bend.motion: 39 frames, 0.63 s; stands in 100 % of it"), "{text}");
    let fit = text.lines().nth(1).expect("a second line");
    assert!(fit.starts_with("  its parts are 1.3 cm") && fit.contains("degrees from the recording's"), "{text}");
    assert_eq!(text.lines().count(), 2, "no warning: {text}");
    let file = std::fs::read_to_string(temp.path().join("bend.motion")).unwrap();
    for line in ["\"name\": \"bend\"", "\"model\": \"humanoid\"", "\"license\": \"CC0-1.0\"", "\"loop\": \"none\""] {
        assert!(file.contains(line), "{line}");
    }
    // the clip names the model
    let report = json(&succeed(temp.path(), &["--json", "motion", "check", "bend.motion"]));
    assert_eq!(report["clips"][0]["warnings"], serde_json::json!([]));
    assert_eq!(report["clips"][0]["report"]["frames"], 39);
    assert_no_leftovers(temp.path());
}

#[test]
fn a_clip_is_drawn() {
    let temp = tempfile::tempdir().unwrap();
    let (clip, out) = (shipped("walker2d/run.motion"), temp.path().join("run.png"));
    let args = ["--json", "motion", "render", &clip, "--out", "run.png", "--frames", "3", "--width", "60"];
    let report = json(&succeed(temp.path(), &args));
    assert_eq!((&report["frames"], &report["width"], &report["height"]), (&3.into(), &60.into(), &80.into()));
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(out).unwrap()));
    let reader = decoder.read_info().unwrap();
    assert_eq!((reader.info().width, reader.info().height), (3 * 60 + 2, 80));
}

#[test]
fn a_clip_of_one_character_becomes_one_of_another() {
    let temp = tempfile::tempdir().unwrap();
    let clip = shipped("humanoid/walk.motion");
    let text = succeed(temp.path(), &["motion", "retarget", &clip, "--model", "walker2d", "--out", "walk.motion"]);
    assert!(text.starts_with("wrote walk.motion: 76 frames, 1.27 s"), "{text}");
    // the source of the recording is kept
    let file = std::fs::read_to_string(temp.path().join("walk.motion")).unwrap();
    assert!(file.contains("DeepMimic") && file.contains("\"model\": \"walker2d\""), "{file}");
    succeed(temp.path(), &["motion", "check", "walk.motion"]);
}

#[test]
fn a_clip_that_comes_with_marathon_has_a_name() {
    let temp = tempfile::tempdir().unwrap();
    let by_name = json(&succeed(temp.path(), &["--json", "motion", "check", "walk"]));
    let by_file = json(&succeed(temp.path(), &["--json", "motion", "check", &shipped("marathon_man/walk.motion")]));
    assert_eq!(by_name["clips"][0]["report"], by_file["clips"][0]["report"]);
    let text = fail(temp.path(), 1, &["motion", "check", "wakl"]);
    assert!(text.contains("wakl: clip: found no such file") && text.contains("did you mean 'walk'?"), "{text}");
    std::fs::write(temp.path().join("mine.motion"), "").unwrap();
    let text = fail(temp.path(), 1, &["motion", "check", "min.motion"]);
    assert!(text.contains("did you mean 'mine.motion'?"), "{text}");
    // a file takes precedence over a name
    std::fs::copy(shipped("marathon_man/run.motion"), temp.path().join("walk")).unwrap();
    let file = json(&succeed(temp.path(), &["--json", "motion", "check", "walk"]));
    assert_eq!(file["clips"][0]["report"]["frames"], 48);
}

#[test]
fn a_clip_with_a_foot_in_the_ground_fails_the_check() {
    let temp = tempfile::tempdir().unwrap();
    let good = std::fs::read_to_string(shipped("walker2d/walk.motion")).unwrap();
    let row = good.lines().find(|line| line.starts_with("    [0, ")).expect("the first frame");
    let numbers: Vec<&str> = row.trim().trim_matches(['[', ']', ',']).split(", ").collect();
    let low = (numbers[1].parse::<f64>().unwrap() - 0.05).to_string();
    let bad = good.replacen(row, &row.replacen(numbers[1], &low, 1), 1);
    std::fs::write(temp.path().join("edited.motion"), &bad).unwrap();
    let text = fail(temp.path(), 1, &["motion", "check", "edited.motion"]);
    assert!(text.contains("edited.motion: checksum: found ") && text.contains("remove this entry"), "{text}");
    // after an intended edit, `import` adds a new checksum
    let bare: String = bad.lines().filter(|line| !line.contains("checksum")).map(|line| format!("{line}\n")).collect();
    std::fs::write(temp.path().join("edited.motion"), bare).unwrap();
    let text = fail(temp.path(), 1, &["motion", "check", "edited.motion"]);
    assert!(text.contains("`marathon motion import edited.motion --out NEW.motion` writes one"), "{text}");
    succeed(temp.path(), &["motion", "import", "edited.motion", "--out", "bad.motion"]);
    let output = run(temp.path(), &["--json", "motion", "check", "bad.motion"]);
    assert_eq!(output.status.code(), Some(1));
    let report = json(&String::from_utf8(output.stdout).unwrap());
    let depth = report["clips"][0]["report"]["depth"]["value"].as_f64().unwrap();
    assert!((0.045..=0.05).contains(&depth), "{depth}");
    let warning = report["clips"][0]["warnings"][0].as_str().unwrap();
    assert!(warning.contains("foot is 4") && warning.contains("mm below the ground"), "{warning}");
}

#[test]
fn errors_say_what_to_do() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("bend.txt"), recording()).unwrap();
    std::fs::write(temp.path().join("dance.fbx"), "").unwrap();
    let import = |file: &str, model: &str, out: &str, code: i32| {
        fail(temp.path(), code, &["motion", "import", file, "--model", model, "--out", out])
    };
    let text = import("dance.fbx", "humanoid", "a.motion", 1);
    assert!(
        text.contains("dance.fbx: a recording with the ending \"fbx\" is not supported; expected .bvh, .glb"),
        "{text}"
    );
    let text = import("bend.txt", "ant", "a.motion", 1);
    assert!(text.contains("there is no built-in mapping for it, only for marathon_man, humanoid, walker2d"), "{text}");
    let text = import("bend.txt", "humanoid", "a.json", 2);
    assert!(text.contains("--out is a.json, expected a name that ends with .motion"), "{text}");
    for balance in ["-1", "101", "nan"] {
        let balance = format!("--balance={balance}");
        let options = ["motion", "import", "none.bvh", "--model", "humanoid", "--out", "a.motion", &balance];
        let text = fail(temp.path(), 2, &options);
        assert!(text.contains("--balance is ") && text.contains("expected a factor from 0 to 100"), "{text}");
    }
    // invalid options are reported before a long file is read
    let text = import("none.bvh", "humanoid", "a.json", 2);
    assert!(text.contains("--out is a.json"), "{text}");
    let text = import("none.bvh", "humanoid", "a.motion", 1);
    assert!(text.contains("none.bvh"), "{text}");
    assert!(!temp.path().join("a.motion").exists());
}

#[test]
fn a_clip_never_replaces_what_it_is_made_from() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::copy(shipped("humanoid/walk.motion"), temp.path().join("walk.motion")).unwrap();
    let before = std::fs::read(temp.path().join("walk.motion")).unwrap();
    for args in [
        ["motion", "retarget", "walk.motion", "--model", "humanoid", "--out", "walk.motion"],
        ["motion", "retarget", "walk.motion", "--model", "humanoid", "--out", "./walk.motion"],
        ["motion", "import", "walk.motion", "--model", "humanoid", "--out", "walk.motion"],
    ] {
        let text = fail(temp.path(), 2, &args);
        assert!(text.contains("walk.motion, which is also the input; expected another file"), "{text}");
    }
    assert_eq!(std::fs::read(temp.path().join("walk.motion")).unwrap(), before);
}

/// Two frames of DeepMimic's character, and of a BVH character.
#[test]
fn motions_too_short_to_loop_are_refused() {
    let temp = tempfile::tempdir().unwrap();
    let mut document: serde_json::Value = serde_json::from_str(&recording()).unwrap();
    document["Loop"] = "wrap".into();
    document["Frames"].as_array_mut().unwrap().truncate(2);
    std::fs::write(temp.path().join("two.txt"), document.to_string()).unwrap();
    let text = fail(temp.path(), 1, &["motion", "import", "two.txt", "--model", "MarathonMan", "--out", "a.motion"]);
    assert!(text.contains("two.txt: frames of a loop: found 2, expected three or more"), "{text}");
    let text = fail(temp.path(), 1, &["train", "MarathonMan", "--option", "clip=two.txt", "--out", "run"]);
    assert!(text.contains("two.txt: frames of a loop: found 2, expected three or more"), "{text}");
    let bvh = "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zrotation\nJOINT LeftUpLeg\n{\n\
               OFFSET 0 -80 0\nCHANNELS 1 Xrotation\n}\n}\nMOTION\nFrames: 2\nFrame Time: 0.01\n0 90 0 0\n0 90 0 5\n";
    std::fs::write(temp.path().join("two.bvh"), bvh).unwrap();
    let import = ["motion", "import", "two.bvh", "--model", "MarathonMan", "--out", "a.motion"];
    let text = fail(temp.path(), 1, &import);
    assert!(
        text.contains("two.bvh: length: found 2 frames, 0.0100 s, expected two steps of 0.0167 s or more"),
        "{text}"
    );
    let text = fail(temp.path(), 1, &[&import[..], &["--loop", "wrap"]].concat());
    assert!(text.contains("frames of a loop: found 2"), "{text}");
    assert!(!temp.path().join("a.motion").exists() && !temp.path().join("run/run.json").exists());
}

#[test]
fn a_loop_is_found_in_a_recording() {
    let temp = tempfile::tempdir().unwrap();
    // stands for a moment, then bends and straightens three times, 38 frames each
    let mut document: serde_json::Value = serde_json::from_str(&recording()).unwrap();
    document["Loop"] = "none".into();
    let bend = document["Frames"].as_array().unwrap().clone();
    let there_and_back = bend.iter().chain(bend.iter().rev().skip(1));
    let still = std::iter::repeat_n(&bend[0], 8);
    document["Frames"] = still.chain((0..3).flat_map(|_| there_and_back.clone().skip(1))).cloned().collect();
    std::fs::write(temp.path().join("bends.txt"), document.to_string()).unwrap();
    let import = ["motion", "import", "bends.txt", "--model", "humanoid", "--trim", "0.1", "10", "--loop", "find"];
    let text = succeed(temp.path(), &[&import[..], &["--out", "bends.motion"]].concat());
    let times = text.split("note: loops from ").nth(1).and_then(|rest| rest.split(" s of the recording").next());
    let times: Vec<f64> = times.expect("a note").split(" to ").map(|time| time.parse().unwrap()).collect();
    assert!(times[0] >= 0.1 && (times[1] - times[0] - 38.0 * 0.0333).abs() < 0.002, "{text}");
    let file = std::fs::read_to_string(temp.path().join("bends.motion")).unwrap();
    assert!(file.contains("\"loop\": \"wrap\""));
}

#[test]
fn a_loop_whose_ends_differ_is_refused() {
    let temp = tempfile::tempdir().unwrap();
    // the hips sink by half a meter
    let mut document: serde_json::Value = serde_json::from_str(&recording()).unwrap();
    document["Loop"] = "none".into();
    let frames = document["Frames"].as_array_mut().unwrap();
    let count = frames.len() as f64;
    for (i, frame) in frames.iter_mut().enumerate() {
        frame[2] = (frame[2].as_f64().unwrap() - 0.5 * i as f64 / count).into();
    }
    std::fs::write(temp.path().join("sink.txt"), document.to_string()).unwrap();
    let import = ["motion", "import", "sink.txt", "--model", "MarathonMan", "--out", "a.motion", "--floor", "0"];
    let text = fail(temp.path(), 2, &[&import[..], &["--loop", "wrap"]].concat());
    assert!(
        text.contains("sink.txt: its ends differ by 0.4") && text.contains("--trim FROM TO selects them"),
        "{text}"
    );
    assert!(!temp.path().join("a.motion").exists());
}

#[test]
fn the_file_beside_a_gltf_is_read_and_no_other() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::create_dir(temp.path().join("in")).unwrap();
    std::fs::write(temp.path().join("secret.bin"), [0; 64]).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink("../secret.bin", temp.path().join("in/link.bin")).unwrap();
    let document = |uri: &str| {
        serde_json::json!({
            "asset": { "version": "2.0" }, "nodes": [{ "name": "Hips" }],
            "buffers": [{ "uri": uri, "byteLength": 64 }],
            "bufferViews": [{ "buffer": 0, "byteLength": 8 }, { "buffer": 0, "byteLength": 32 }],
            "accessors": [
                { "bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR" },
                { "bufferView": 1, "componentType": 5126, "count": 2, "type": "VEC4" }],
            "animations": [{ "samplers": [{ "input": 0, "output": 1 }],
                "channels": [{ "sampler": 0, "target": { "node": 0, "path": "rotation" } }] }],
        })
        .to_string()
    };
    for (uri, found) in [
        ("../secret.bin", "it is not in the folder of the recording"),
        ("%2e%2e/secret.bin", "it is not in the folder of the recording"),
        ("/etc/hostname", "it is not in the folder of the recording"),
        ("link.bin", "it is not in the folder of the recording"),
        ("none.bin", "No such file"),
    ] {
        std::fs::write(temp.path().join("in/m.gltf"), document(uri)).unwrap();
        let text =
            fail(temp.path(), 1, &["motion", "import", "in/m.gltf", "--model", "MarathonMan", "--out", "a.motion"]);
        assert!(text.contains(found), "{uri}: {text}");
    }
}
