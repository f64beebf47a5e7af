//! `marathon motion render --policy` and `marathon render --ghost` draw a policy together with the clip that it
//! follows, and report the distance between them.

use crate::common::{assert_no_leftovers, fail, json, succeed};
use marathon_envs::{Autoreset, VecEnvOptions};
use marathon_runs::{Play, PolicySource};
use serde_json::Value;
use std::path::Path;

fn clip(name: &str) -> String {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/motions/marathon_man").join(name);
    file.to_string_lossy().into_owned()
}

/// A run of one iteration.
fn trained(task: &str) -> tempfile::TempDir {
    let temp = tempfile::tempdir().unwrap();
    succeed(temp.path(), &["train", task, "--agents", "16", "--seed", "5", "--steps", "512", "--out", "a"]);
    temp
}

/// The report of a small picture, and the picture.
fn drawn(folder: &Path, words: &[&str]) -> (Value, Vec<u8>) {
    let small = ["--out", "x.png", "--frames", "3", "--width", "60", "--json"];
    let report = json(&succeed(folder, &[words, &small].concat()));
    (report, std::fs::read(folder.join("x.png")).unwrap())
}

#[test]
fn a_policy_is_drawn_with_its_clip() {
    let temp = trained("MarathonMan");
    let (walk, path) = (clip("walk.motion"), temp.path());
    let follow = ["motion", "render", &walk, "--policy", "a"];
    let (report, inside) = drawn(path, &follow);
    assert_eq!((&report["agent"], &report["frames"]), (&"MarathonMan-v0".into(), &3.into()));
    let seconds = report["seconds"].as_f64().unwrap();
    assert!((seconds - 1.27).abs() < 0.02, "as long as the clip: {seconds}");
    assert_eq!(drawn(path, &[&follow[..], &["--ghost", "inside"]].concat()).1, inside);
    let (same, beside) = drawn(path, &[&follow[..], &["--ghost", "beside"]].concat());
    assert_eq!(same["joint_error"], report["joint_error"], "the ghost's place changes the picture alone");
    assert_ne!(beside, inside);

    // the same with the other command, without and with the ghost
    let play = ["render", "a", "--option", "start=first", "--seconds", "1.27"];
    let (alone, without) = drawn(path, &play);
    assert!(alone.get("joint_error").is_none() && without != inside);
    let (with, picture) = drawn(path, &[&play[..], &["--ghost"]].concat());
    assert_eq!((&with["joint_error"], &picture), (&report["joint_error"], &inside));
    assert_no_leftovers(path);
}

#[test]
fn a_video_begins_where_the_clip_does() {
    let temp = trained("MarathonMan");
    let (run, path) = (clip("run.motion"), temp.path());
    let follow = ["motion", "render", &run, "--policy", "a"];
    // start noise of up to 0.01 rad, and one decision
    let (report, _) = drawn(path, &[&follow[..], &["--seconds", "0.001"]].concat());
    let error = report["joint_error"].as_f64().unwrap();
    assert!((0.002..0.01).contains(&error), "{error}");
    let (_, first) = drawn(path, &follow);
    let (_, elsewhere) = drawn(path, &[&follow[..], &["--option", "start=random"]].concat());
    let (_, walk) = drawn(path, &["motion", "render", &clip("walk.motion"), "--policy", "a"]);
    assert!(first != elsewhere && first != walk);
}

/// The library reports the same agent's error, except for that of its start.
#[test]
fn the_error_is_the_one_that_the_task_reports() {
    let temp = trained("MarathonManRun");
    let path = temp.path();
    let (report, _) = drawn(path, &["render", "a", "--ghost", "--seconds", "0.25", "--seed", "7"]);
    let drawn = report["joint_error"].as_f64().unwrap();

    let source = PolicySource { policy: path.join("a"), ..Default::default() };
    let (policy, factory) = source.load().unwrap();
    let column = factory.spec().info.iter().position(|name| name == "joint_error").expect("a metric");
    let options = VecEnvOptions { agents: 1, seed: 7, autoreset: Autoreset::Disabled, ..Default::default() };
    let mut play = Play::new(&policy, &options).unwrap();
    let mut sum = 0.0;
    for _ in 0..10 {
        play.decide();
        sum += f64::from(play.step().unwrap().info[column]);
    }
    let start = 11.0 * drawn - sum;
    assert!((0.002..0.01).contains(&start), "the noise of a start is up to 0.01 rad: {start}; drawn {drawn}");
}

#[test]
fn what_cannot_be_compared_is_refused_by_name() {
    let temp = trained("MarathonManRun");
    let (walk, run, path) = (clip("walk.motion"), clip("run.motion"), temp.path());
    let refused = |words: &[&str], parts: &[&str]| {
        let text = fail(path, 2, &[words, &["--out", "x.png"]].concat());
        parts.iter().for_each(|part| assert!(text.contains(part), "no '{part}' in: {text}"));
        assert!(!path.join("x.png").exists());
    };
    refused(&["motion", "render", &walk, "--policy", "a"], &["walk.motion", "MarathonManRun-v0", "\"run\""]);
    refused(&["motion", "render", &walk, "--ghost", "beside"], &["--policy"]);
    refused(&["motion", "render", &walk, "--option", "future=1"], &["--option future", "--policy"]);
    refused(&["motion", "render", &run, "--policy", "a", "--ghost", "above"], &["above", "inside, beside"]);
    succeed(path, &["train", "hopper", "--agents", "64", "--steps", "4k", "--out", "b"]);
    refused(&["render", "b", "--ghost"], &["Hopper-v0 follows no clip"]);
    refused(&["motion", "render", &run, "--policy", "b"], &["Hopper-v0 follows no clip"]);
    succeed(path, &["train", "MarathonMan", "--agents", "16", "--steps", "512", "--out", "c"]);
    refused(&["motion", "render", &run, "--policy", "c", "--option", "clip=walk"], &["--option clip", "run.motion"]);
    let text = fail(path, 2, &["motion", "check", "walk.bvh"]);
    assert!(text.contains("walk.bvh is a recording") && text.contains("motion import walk.bvh"), "{text}");
}
