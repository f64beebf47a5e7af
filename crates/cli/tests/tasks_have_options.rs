//! A task's options are given once. The run, its policy in every format, its processes and its summary store them, so
//! evaluating or resuming uses the same task. A clip in a file is one of them, and is stored with the run and the
//! policy.

use crate::common::*;
use serde_json::Value;
use std::path::Path;

/// A run of one iteration.
const TRAIN: [&str; 9] = ["train", "MarathonMan", "--agents", "16", "--seed", "5", "--steps", "512", "--out"];
const EVAL: [&str; 4] = ["--episodes", "16", "--json", "eval"];

fn train(folder: &Path, out: &str, options: &[&str]) -> Vec<(String, Vec<usize>, Vec<u8>)> {
    let options = options.iter().flat_map(|option| ["--option", option]);
    let words: Vec<&str> = TRAIN.into_iter().chain([out]).chain(options).collect();
    succeed(folder, &words);
    tensors(&folder.join(out).join("policy.safetensors"))
}

fn eval(folder: &Path, words: &[&str]) -> Value {
    let [episodes, n, json_flag, eval] = EVAL;
    json(&succeed(folder, &[&[json_flag, eval], words, &[episodes, n]].concat()))
}

fn walk() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/motions/marathon_man/walk.motion");
    std::fs::read_to_string(path).unwrap()
}

#[test]
fn options_are_recorded_and_obeyed() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    train(path, "a", &["clip=run", "future=1"]);
    for file in ["run.json", "summary.json"] {
        let options = read_json(&path.join("a").join(file))["options"].clone();
        // the task's default configuration sets the starts
        let expected = ("run".into(), 1.0.into(), "adaptive".into());
        assert_eq!((&options["clip"], &options["future"], &options["start"]), (&expected.0, &expected.1, &expected.2));
    }
    // observations of another length would be refused
    let own = eval(path, &["a"]);
    assert_eq!(own, eval(path, &["a", "--option", "start=adaptive", "--option", "clip=run"]));
    assert_ne!(own, eval(path, &["a", "--option", "start=first"]));
    assert_ne!(own, eval(path, &["a", "--option", "clip=walk"]));
    let text = fail(path, 1, &["eval", "a", "--option", "future=0"]);
    assert!(text.contains("observation length") && text.contains("119") && text.contains("89"), "{text}");

    succeed(path, &["export", "a", "--out", "a.onnx"]);
    let exported = eval(path, &["a.onnx"]);
    assert_eq!((&exported["falls"], &exported["episodes"]), (&own["falls"], &own["episodes"]));
    succeed(path, &["record-demo", "a", "--out", "a.demo", "--episodes", "1", "--option", "start=first"]);
    succeed(path, &["render", "a", "--out", "a.png", "--frames", "2", "--seconds", "0.1", "--width", "40"]);
}

#[test]
fn what_only_helps_to_learn_plays_along_if_it_is_asked_for() {
    let temp = tempfile::tempdir().unwrap();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/policies");
    let policy = folder.join("MarathonManController.safetensors");
    let told = |words: &[&str], option: &str, number: &str| {
        let words = [&["--json", words[0], policy.to_str().unwrap()], &words[1..], &["--option", option]].concat();
        json(&succeed(temp.path(), &words))[number].as_f64().unwrap()
    };
    let video = ["render", "--out", "a.png", "--frames", "2", "--seconds", "0.5", "--width", "40"];
    let demo = ["record-demo", "--out", "a.demo", "--episodes", "1"];
    for (words, number) in [(&video[..], "distance_mean"), (&demo, "return_mean")] {
        assert_ne!(told(words, "start_pushed_prob=1", number), told(words, "start_pushed_prob=0", number), "{words:?}");
    }
}

#[test]
fn a_configuration_has_options_and_the_command_line_wins() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    let write = |options: &str| {
        std::fs::write(path.join("c.yaml"), format!("options: {options}")).unwrap();
    };
    write("{clip: run, future: 2, start: first}");
    let words = ["--config", "c.yaml", "--option", "start=random"];
    succeed(path, &[&TRAIN[..], &["a"], &words].concat());
    let options = read_json(&path.join("a").join("run.json"))["options"].clone();
    assert_eq!((&options["clip"], &options["future"]), (&"run".into(), &2.0.into()));
    assert_eq!(options["start"], "random");

    write("{strat: first}");
    let text = fail(path, 1, &[&TRAIN[..], &["b", "--config", "c.yaml"]].concat());
    assert!(text.contains("c.yaml") && text.contains("options.strat"), "{text}");
    assert!(text.contains("did you mean 'start'?"), "{text}");
    write("[first]");
    let text = fail(path, 1, &[&TRAIN[..], &["b", "--config", "c.yaml"]].concat());
    assert!(text.contains("c.yaml:1") && text.contains("expected a mapping"), "{text}");
    assert!(!path.join("b").exists());
}

/// Starts at the clip's beginning and anywhere, for each clip of the task. Nothing for tasks without clips.
#[test]
fn a_policy_tells_how_well_it_follows_each_clip() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    train(path, "a", &["clip=walk,kick"]);
    let of_run = read_json(&path.join("a/summary.json"))["imitation"].clone();
    let of_eval = eval(path, &["a"])["imitation"].clone();
    for (i, (clip, seconds)) in [("walk", 20.0), ("kick", 1.6)].into_iter().enumerate() {
        let found = &of_eval[i];
        assert_eq!(
            (&found["clip"], &found["episodes"], &of_run[i]["episodes"]),
            (&clip.into(), &16.into(), &100.into())
        );
        for start in ["first", "random"] {
            let number = |name: &str| found[start][name].as_f64().unwrap();
            // hardly trained: falls within seconds, not at once
            assert!(number("seconds") > 0.1 && number("seconds") < seconds, "{found}");
            assert!(number("joint_error") > 0.01 && number("joint_error") < 1.0, "{found}");
            assert!(number("pose_error") > 0.005 && number("pose_error") < 0.5, "{found}");
            assert!(number("completed") <= 16.0 && number("flips") == 0.0, "{found}");
        }
    }
    // the task's own starts do not matter
    assert_eq!(eval(path, &["a", "--option", "start=first"])["imitation"], of_eval);
    let text = succeed(path, &["eval", "a", "--episodes", "4"]);
    assert!(text.contains("the clip walk:\n  from its beginning"), "{text}");

    succeed(path, &["train", "hopper", "--agents", "16", "--steps", "512", "--out", "h"]);
    assert!(read_json(&path.join("h/summary.json")).get("imitation").is_none());
    assert!(eval(path, &["h"]).get("imitation").is_none());
}

#[test]
fn a_resumed_run_and_its_processes_play_the_same_task() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    let options = ["clip=run", "future=1"];
    assert_eq!(train(path, "a", &options), train(path, "b", &options));
    succeed(path, &["train", "--resume", "a", "--steps", "1536", "--processes", "1"]);
    succeed(path, &["train", "--resume", "b", "--steps", "1536"]);
    let policy = |run: &str| tensors(&path.join(run).join("policy.safetensors"));
    assert_eq!(policy("a"), policy("b"));
}

#[test]
fn a_run_without_options_still_loads() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    train(path, "a", &[]);
    let own = eval(path, &["a"]);
    let file = path.join("a/run.json");
    let mut run = read_json(&file);
    let keys = run.as_object_mut().unwrap();
    keys.remove("options").expect("options");
    keys.remove("checksum").expect("a checksum");
    std::fs::write(&file, run.to_string()).unwrap();
    succeed(path, &["train", "--resume", "a", "--steps", "1024"]);
    assert_eq!(eval(path, &["a"])["episodes"], own["episodes"]);
    assert_eq!(read_json(&file)["agent"], "MarathonMan-v0");
}

#[test]
fn wrong_options_are_refused_by_name_with_the_nearest() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    std::fs::write(path.join("mine.motion"), walk()).unwrap();
    let refused = |option: &str, code: i32, parts: &[&str]| {
        let words = [&TRAIN[..], &["a", "--option", option]].concat();
        let text = fail(path, code, &words);
        parts.iter().for_each(|part| assert!(text.contains(part), "no '{part}' in: {text}"));
        assert!(!path.join("a").exists(), "an error leaves no folder");
    };
    refused("clp=run", 1, &["clp", "'clip'", "future"]);
    refused("start=frist", 1, &["start", "'frist'", "random, first or adaptive"]);
    refused("action_scale=-1", 1, &["action_scale", "-1", "0 or more"]);
    refused("clip=runn", 1, &["clip is 'runn'", "did you mean 'run'?", "backflip"]);
    refused("clip", 2, &["--option", "NAME=VALUE"]);
    refused("clip=mime.motion", 1, &["mime.motion", "no such file", "did you mean 'mine.motion'?", "backflip"]);
    refused("clip=walk,dance.bvh", 1, &["dance.bvh", "no such file"]);

    std::fs::write(path.join("bad.motion"), walk().replacen("\"marathon_man\"", "\"marathon_man", 1)).unwrap();
    refused("clip=bad.motion", 1, &["bad.motion:"]);
    let text = fail(path, 1, &["train", "hopper", "--option", "clip=mine.motion", "--out", "a"]);
    assert!(text.contains("takes no option 'clip'; it has no options"), "{text}");
    train(path, "b", &[]);
    let text = fail(path, 2, &["train", "--resume", "b", "--option", "clip=run"]);
    assert!(text.contains("--option") && text.contains("--resume"), "{text}");
}

/// The clip is one of Marathon's under another name: the policies are the same.
#[test]
fn a_clip_of_a_file_goes_with_its_run_and_its_policy() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    std::fs::create_dir(path.join("clips")).unwrap();
    std::fs::write(path.join("clips/mine.motion"), walk()).unwrap();
    let own = train(path, "a", &["clip=clips/mine.motion"]);
    assert_eq!(own, train(path, "shipped", &["clip=walk"]));
    std::fs::remove_dir_all(path.join("clips")).unwrap();

    let run = read_json(&path.join("a/run.json"));
    assert_eq!(run["options"]["clip"], "mine.motion");
    assert_eq!(std::fs::read_to_string(path.join("a/mine.motion")).unwrap(), walk());
    let of_shipped = eval(path, &["shipped"]);
    let mut of_file = eval(path, &["a"]);
    assert_eq!(of_file["imitation"][0]["clip"], "mine.motion");
    of_file["imitation"][0]["clip"] = "walk".into();
    assert_eq!(of_file, of_shipped);
    // also only the policy, in both formats
    std::fs::copy(path.join("a/policy.safetensors"), path.join("p.safetensors")).unwrap();
    assert_eq!(eval(path, &["p.safetensors"]), eval(path, &["a"]));
    succeed(path, &["export", "p.safetensors", "--out", "p.onnx"]);
    succeed(path, &["import", "p.onnx", "--out", "again.safetensors"]);
    assert_eq!(eval(path, &["again.safetensors"])["falls"], of_shipped["falls"]);

    // a changed clip is another one
    let file = path.join("a/mine.motion");
    std::fs::write(&file, walk().replacen("0.", "0.0", 1)).unwrap();
    let text = fail(path, 1, &["train", "--resume", "a", "--steps", "1536"]);
    assert!(text.contains("a/mine.motion: checksum") && text.contains("has changed"), "{text}");
    std::fs::write(&file, walk()).unwrap();
    succeed(path, &["train", "--resume", "a", "--steps", "1536", "--processes", "1"]);
    succeed(path, &["train", "--resume", "shipped", "--steps", "1536"]);
    let policy = |run: &str| tensors(&path.join(run).join("policy.safetensors"));
    assert_eq!(policy("a"), policy("shipped"));
    assert_no_leftovers(path);
}

#[test]
fn a_recording_becomes_the_clip_that_import_makes_of_it() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    std::fs::write(path.join("bend.txt"), recording()).unwrap();
    succeed(path, &["motion", "import", "bend.txt", "--model", "MarathonMan", "--out", "bend.motion"]);
    train(path, "a", &["clip=bend.txt"]);
    let text = |file: &str| std::fs::read_to_string(path.join(file)).unwrap();
    assert_eq!(text("a/bend.motion"), text("bend.motion"));

    // joints that no mapping knows: the message names the command that makes a clip
    let strange = "HIERARCHY\nROOT blob\n{\n OFFSET 0 0 0\n CHANNELS 3 Xposition Yposition Zposition\n End Site\n {\n  \
                   OFFSET 0 1.7 0\n }\n}\nMOTION\nFrames: 2\nFrame Time: 0.1\n0 0 0\n0 0 0\n";
    std::fs::write(path.join("blob.bvh"), strange).unwrap();
    let error = fail(path, 1, &[&TRAIN[..], &["b", "--option", "clip=blob.bvh"]].concat());
    assert!(error.contains("marathon motion import blob.bvh --model MarathonMan-v0 --mapping"), "{error}");
}
