//! A recipe that is stopped or killed anywhere ends with the bits of one that was not. Stages that are done are skipped, and
//! changed ones are refused.

#![cfg(unix)]

use crate::common::*;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const RECIPE: &str = include_str!("small-recipe.yaml");
const STAGES: [&str; 6] = ["01-runs", "02-follows", "03-races", "04-both", "05-learns", "06-mean"];

/// A folder with the recipe.
fn folder() -> tempfile::TempDir {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("small.yaml"), RECIPE).unwrap();
    temp
}

fn policies(run: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let is_policy = |path: &PathBuf| path.ends_with("policy.safetensors");
    let mut all: Vec<PathBuf> = files(run).into_iter().filter(is_policy).collect();
    all.sort();
    let named = |path: PathBuf| {
        let bytes = std::fs::read(&path).unwrap();
        (path.strip_prefix(run).unwrap().to_path_buf(), bytes)
    };
    all.into_iter().map(named).collect()
}

/// The summary without times.
fn summary(run: &Path) -> serde_json::Value {
    let mut summary = read_json(&run.join("summary.json"));
    summary["folder"] = serde_json::Value::Null;
    summary["cpu_seconds"] = serde_json::Value::Null;
    summary["stages"]
        .as_array_mut()
        .unwrap()
        .iter_mut()
        .for_each(|stage| stage["cpu_seconds"] = serde_json::Value::Null);
    summary
}

/// A generator of pseudorandom numbers.
fn next(state: &mut u64) -> u64 {
    *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    *state >> 33
}

#[test]
fn a_killed_recipe_ends_with_the_bits_of_a_whole_one() {
    let temp = folder();
    let path = temp.path();
    let begun = Instant::now();
    let text = succeed(path, &["train", "small.yaml", "--out", "whole", "--threads", "1"]);
    let whole = begun.elapsed();
    assert!(text.contains("6 stages") && text.contains("races: train HopperController-v0, seed "), "{text}");
    let expected = policies(&path.join("whole"));
    assert_eq!(expected.len(), 6 + 3 + 1, "{expected:?}");
    for stage in STAGES {
        assert!(path.join("whole").join(stage).join("done").exists(), "{stage}");
    }

    // killed at random points, with another number of threads
    let (mut state, mut kills) = (20_261_129, 0);
    let args = ["train", "small.yaml", "--out", "parts", "--threads", "2"];
    loop {
        let mut child =
            marathon(path, &args).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the command starts");
        // the first kills come early, so that starts are hit, too
        let most = (whole.as_millis() as u64 / 3).max(50) * (1 + kills.min(9)) / 10;
        std::thread::sleep(Duration::from_millis(next(&mut state) % most.max(1)));
        if let Some(status) = child.try_wait().unwrap() {
            assert!(status.success());
            break;
        }
        child.kill().unwrap();
        child.wait().unwrap();
        kills += 1;
        if kills == 40 {
            succeed(path, &args);
            break;
        }
    }
    assert!(kills >= 3, "{kills} kills");
    assert_eq!(policies(&path.join("parts")), expected, "after {kills} kills");
    assert_eq!(summary(&path.join("parts")), summary(&path.join("whole")));
    assert_no_leftovers(&path.join("parts").join(STAGES[4]));

    // the policy knows where it comes from, and every stage is a run like any other
    let shown = succeed(path, &["eval", "parts", "--episodes", "2"]);
    for part in [
        "runs: train Hopper-v0, seed 1, 6,144 steps",
        "both: distill HopperController",
        "mean: average HopperController",
    ] {
        assert!(shown.contains(part), "{part}: {shown}");
    }
    succeed(path, &["eval", "parts/05-learns", "--episodes", "2"]);
    // a complete recipe does nothing again
    let begun = Instant::now();
    succeed(path, &["train", "--resume", "parts"]);
    assert!(begun.elapsed() < whole / 2 + Duration::from_secs(2));
    assert_eq!(policies(&path.join("parts")), expected);
}

#[test]
fn an_interrupted_recipe_says_where_it_is_and_goes_on() {
    let temp = folder();
    let path = temp.path();
    let child = marathon(path, &["train", "small.yaml"]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait_for_lines(&path.join("runs/small/02-follows/progress.csv"), 3);
    let sent = Command::new("sh").args(["-c", &format!("kill -INT {}", child.id())]).status().unwrap();
    assert!(sent.success());
    let output = child.wait_with_output().unwrap();
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(130), "{text}");
    assert!(text.contains("stage 1 of 6, runs: training Hopper-v0"), "{text}");
    assert!(text.contains("of 6, ") && text.contains("train --resume runs/small"), "{text}");

    let list = succeed(path, &["train", "small.yaml", "--list-stages"]);
    assert!(list.contains(" 1 of 6  runs: train Hopper-v0, done, 6,144 steps"), "{list}");
    assert!(list.contains("mean: average HopperController-v0, waiting"), "{list}");
    assert!(list.contains("marathon train Hopper-v0 --set"), "{list}");
    assert!(list.contains("--teacher runs/small/03-races/policy.safetensors"), "{list}");

    succeed(path, &["train", "small.yaml"]);
    succeed(path, &["train", "small.yaml", "--out", "whole"]);
    assert_eq!(policies(&path.join("runs/small")), policies(&path.join("whole")));
}

#[test]
fn a_changed_stage_is_refused_until_it_may_be_made_again() {
    let temp = folder();
    let path = temp.path();
    let short = RECIPE.split("  both:").next().unwrap();
    std::fs::write(path.join("small.yaml"), short).unwrap();
    succeed(path, &["train", "small.yaml"]);
    let run = path.join("runs/small");
    let before = policies(&run);

    // more of a later stage leaves the earlier ones alone
    let changed = short.replace("fall_penalty: 30", "fall_penalty: 20");
    std::fs::write(path.join("small.yaml"), &changed).unwrap();
    let text = fail(path, 1, &["train", "small.yaml"]);
    let part =
        "02-follows: settings.options.fall_penalty: found 20.0, expected 30.0, which the stage 'follows' was made with";
    assert!(text.contains(part) && text.contains("--redo follows"), "{text}");
    assert_eq!(policies(&run), before);
    let list = succeed(path, &["train", "small.yaml", "--list-stages"]);
    assert!(
        list.contains("follows: train HopperController-v0, changed")
            && list.contains("races: train HopperController-v0, waiting"),
        "{list}"
    );
    let text = fail(path, 2, &["train", "small.yaml", "--redo", "folows"]);
    assert!(
        text.contains("--redo is 'folows', expected a stage: runs, follows, races; did you mean 'follows'?"),
        "{text}"
    );

    // the stages that use it are made again, too
    succeed(path, &["train", "small.yaml", "--redo", "follows"]);
    let after = policies(&run);
    succeed(path, &["train", "small.yaml", "--out", "fresh"]);
    assert_eq!(after, policies(&path.join("fresh")));
    assert_ne!(after, before);

    // a policy that is not what its stage has made
    std::fs::write(run.join("01-runs/policy.safetensors"), "other").unwrap();
    let text = fail(path, 1, &["train", "small.yaml"]);
    assert!(text.contains("01-runs: checksum of policy.safetensors"), "{text}");
}

#[test]
fn options_that_do_not_go_with_stages_are_refused() {
    let temp = folder();
    let path = temp.path();
    let begun = Instant::now();
    for (args, part) in [
        (&["small.yaml", "--steps", "5"][..], "--steps is for a single run, not for the stages of small.yaml"),
        (&["small.yaml", "--set", "ppo.lr=1"], "--set is for a single run"),
        (&["hopper", "--redo", "x"], "--redo is for recipes, and hopper has none"),
        (&["hopper", "--list-stages"], "--list-stages is for recipes"),
        (&["WalkerController", "--list-stages", "--steps", "5"], "--steps is for a single run"),
    ] {
        let text = fail(path, 2, &[&["train"], args].concat());
        assert!(text.contains(part), "{args:?}: {text}");
    }
    for (text, part) in [
        ("until: fals < 1", "a.yaml: stages.a.until: found 'fals', expected one of steps, return_mean"),
        ("options: {x: 5}", "a.yaml: stages.a.options.x: found 5, expected no option, because Hopper-v0 has none"),
        (
            "task: MarathonManSteer, options: {comands: even}",
            "stages.a.options.comands: found 'even', expected an option of MarathonManSteer-v0",
        ),
        ("initialize_from: none.safetensors", "none.safetensors"),
        ("config: none.yaml", "none.yaml"),
        ("run: {agents: 7}", "agents"),
    ] {
        std::fs::write(path.join("a.yaml"), format!("task: hopper\nstages: {{b: {{}}, a: {{{text}}}}}")).unwrap();
        let found = fail(path, 1, &["train", "a.yaml"]);
        assert!(found.contains(part), "{text}: {found}");
    }
    std::fs::create_dir(path.join("mine")).unwrap();
    std::fs::write(path.join("mine/notes.txt"), "").unwrap();
    let text = fail(path, 2, &["train", "small.yaml", "--out", "mine"]);
    assert!(text.contains("holds 'notes.txt', expected a new or empty folder"), "{text}");
    assert!(!path.join("runs").exists());
    assert!(begun.elapsed() < Duration::from_secs(60), "nothing is trained");

    // the stages of a task's recipe
    let list = succeed(path, &["train", "MarathonManController", "--list-stages"]);
    assert!(list.contains(" 9 of 16  skills: distill MarathonManController-v0, waiting"), "{list}");
    assert!(
        list.contains(
            "--option commands=sharp --option gait_max_target=1 --option max_target=3 --option start=adaptive"
        ),
        "{list}"
    );
    let json = json(&succeed(path, &["--json", "train", "HopperController", "--list-stages"]));
    assert_eq!(json["stages"].as_array().unwrap().len(), 4);
}

#[test]
fn a_stage_that_must_reach_its_measure_fails_without_it() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    let text = "task: hopper\nstages:\n  a: {steps: 2048, run: {agents: 16, horizon: 32}, until: return_mean > 1e6, or_fail: true, \
                episodes: 2}\n";
    std::fs::write(path.join("a.yaml"), text).unwrap();
    for _ in 0..2 {
        let text = fail(path, 1, &["train", "a.yaml"]);
        assert!(text.contains("a.yaml: stages.a.until: found return_mean = ") && text.contains("or_fail"), "{text}");
    }
    assert!(!path.join("runs/a/policy.safetensors").exists());
}
