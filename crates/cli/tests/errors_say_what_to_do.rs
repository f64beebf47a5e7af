//! Every error names the item and the place, the valid values, and the nearest valid choice.

use crate::common::{self, SMALL, fail, json, run, succeed};

#[track_caller]
fn says(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "no '{part}' in: {text}");
    }
    assert!(text.starts_with("error: "), "{text}");
    assert!(!text.contains("panicked"), "{text}");
}

#[test]
fn unknown_names_come_with_the_nearest() {
    let temp = tempfile::tempdir().unwrap();
    says(&fail(temp.path(), 1, &["train", "hoper"]), &["agent 'hoper' does not exist", "did you mean 'Hopper-v0'?"]);
    assert!(!temp.path().join("runs").exists(), "an error leaves no folder");
    says(&fail(temp.path(), 2, &["trian", "hopper"]), &["trian", "'train'"]);
    says(&fail(temp.path(), 2, &["study", "table1"]), &["'study'", "-p marathon-studies"]);
    says(&fail(temp.path(), 2, &["train", "hopper", "--sede", "3"]), &["--sede", "--seed"]);
    says(&fail(temp.path(), 2, &["train"]), &["<AGENT>"]);
    says(&fail(temp.path(), 2, &["train", "hopper", "--steps", "lots"]), &["lots", "4M"]);
    says(&fail(temp.path(), 2, &["train", "hopper", "--steps", "1.5"]), &["1.5", "whole number of steps"]);
    let text = fail(temp.path(), 2, &["train", "hopper", "--steps", "-5"]);
    says(&text, &["'-5'", "--steps", "4M"]);
    assert!(!text.contains("tip:"), "{text}");
    says(&fail(temp.path(), 2, &["eval", "a", "--episodes", "1e8"]), &["1e8", "1 to 10000000"]);
    says(
        &fail(temp.path(), 2, &["skin", "ant", "--triangles", "1e9", "--out", "a.glb"]),
        &["--triangles is 1000000000"],
    );
    let text = fail(temp.path(), 1, &["train", "hopper", "--option", "foo=1"]);
    says(&text, &["takes no option 'foo'; it has no options"]);
}

#[test]
fn a_broken_configuration_names_key_and_line() {
    let temp = tempfile::tempdir().unwrap();
    let config = "run:\n  agents: 64\nppo:\n  epochs: 4\n  lr_rang: [1e-4, 1e-3]\n";
    std::fs::write(temp.path().join("bad.yaml"), config).unwrap();
    let text = fail(temp.path(), 1, &["train", "hopper", "--config", "bad.yaml"]);
    says(&text, &["bad.yaml:5: ppo.lr_rang: unknown key; did you mean 'lr_range'?"]);
    says(&fail(temp.path(), 1, &["train", "hopper", "--config", "none.yaml"]), &["none.yaml"]);
    says(&fail(temp.path(), 1, &["train", "hopper", "--agents", "100"]), &["agents is 100", "multiple of 16", "96"]);
    assert!(!temp.path().join("runs").exists(), "an error leaves no folder");

    // a task of the file that does not exist, options and roles: also where settings are only shown
    std::fs::write(temp.path().join("tasks.yaml"), "tasks:\n  Hoper: {run: {seed: 1}}\n").unwrap();
    for command in [&["train"][..], &["config", "show"]] {
        let with = |words: &[&str]| fail(temp.path(), 1, &[command, &["ant"], words].concat());
        let text = with(&["--config", "tasks.yaml"]);
        says(&text, &["tasks.yaml:2: tasks.Hoper: found 'Hoper'", "did you mean 'Hopper-v0'?"]);
        says(&with(&["--set", "options.fall_penalt=3"]), &["takes no option 'fall_penalt'"]);
        says(&with(&["--set", "roles.bulder.ppo.lr=3"]), &["roles is bulder, expected none"]);
    }
    let imitation = fail(temp.path(), 1, &["train", "ant", "--set", "rewards.gail={}"]);
    assert!(!imitation.contains("results in"), "{imitation}");
    says(&imitation, &["rewards.gail.demonstrations is null, expected a .demo file: Ant-v0 has no motion clips"]);
    let roles = ["train", "TerrainHopper", "--option", "course=adversary", "--set", "roles.bulder.ppo.lr=3"];
    says(&fail(temp.path(), 1, &roles), &["roles is bulder, expected runner, builder; did you mean 'builder'?"]);
    assert!(!temp.path().join("runs").exists(), "an error leaves no folder");
}

#[test]
fn runs_are_not_overwritten() {
    let temp = tempfile::tempdir().unwrap();
    let train = [&SMALL[..], &["1", "--steps", "8k", "--out", "a"]].concat();
    succeed(temp.path(), &train);
    let policy = std::fs::read(temp.path().join("a/policy.safetensors")).unwrap();
    says(&fail(temp.path(), 2, &train), &["--out a already holds a run", "train --resume a"]);
    assert_eq!(std::fs::read(temp.path().join("a/policy.safetensors")).unwrap(), policy);

    says(&fail(temp.path(), 1, &["train", "--resume", "b"]), &["b: --resume", "no such folder", "did you mean 'a'?"]);
    says(&fail(temp.path(), 2, &["train", "--resume", "a", "--seed", "2"]), &["--seed", "--resume"]);

    // two writers would mix their rows
    let lock = std::fs::File::create(temp.path().join("a/.lock")).unwrap();
    lock.lock().unwrap();
    says(&fail(temp.path(), 1, &["train", "--resume", "a", "--steps", "1M"]), &["a: run", "another process"]);
}

/// `run.json` describes the run. A changed description is another run.
#[test]
fn a_changed_description_is_refused() {
    let temp = tempfile::tempdir().unwrap();
    succeed(temp.path(), &[&SMALL[..], &["1", "--steps", "8k", "--out", "a"]].concat());
    let path = temp.path().join("a/run.json");
    let whole = std::fs::read_to_string(&path).unwrap();
    let resume = ["train", "--resume", "a", "--steps", "12,288"];
    let refused = |text: &str, parts: &[&str]| {
        std::fs::write(&path, text).unwrap();
        says(&fail(temp.path(), 1, &resume), parts);
    };
    refused(&whole.replacen("\"lr\": 0.00", "\"lr\": 0.01", 1), &["a/run.json: checksum: found "]);

    // a description edited by hand has no checksum, but its values are checked
    let mut run = json(&whole);
    run.as_object_mut().unwrap().remove("checksum").expect("a checksum");
    let with = |run: &serde_json::Value, pointer: &str, value: serde_json::Value| {
        let mut run = run.clone();
        *run.pointer_mut(pointer).expect(pointer) = value;
        run.to_string()
    };
    for (pointer, value, text) in [
        (
            "/format",
            "marathon-policy".into(),
            "a/run.json: format: found \"marathon-policy\", expected \"marathon-run\"",
        ),
        ("/version", 2.into(), "a/run.json: version: found 2, expected 3, which this program supports"),
        ("/config/ppo/lr", (-1.0).into(), "config.ppo.lr: found -1, expected a positive number"),
        ("/config/run/horizon", 0.into(), "config.run.horizon: found 0, expected at least 1"),
        ("/config/run/horizon", 32.into(), "config.run.horizon: found 32, expected 64, as in checkpoint"),
        ("/config/rewards/task/gamma", 0.5.into(), "config.rewards.task.gamma: found 0.5, expected 0.9"),
        ("/config/run/seed", (-1).into(), "config.run.seed: found 'invalid value: integer `-1`"),
        (
            "/config/run/total_steps",
            (1_u64 << 63).into(),
            "config.run.total_steps: found 9223372036854775808, expected at most",
        ),
        ("/summary_freq", 0.into(), "summary_freq: found 0, expected at least 1"),
        ("/checkpoint_interval", 0.into(), "checkpoint_interval: found 0, expected at least 1"),
        ("/keep_checkpoints", (-1).into(), "keep_checkpoints: found 'invalid value: integer `-1`"),
        ("/agent", "Hoper-v0".into(), "did you mean 'Hopper-v0'?"),
    ] {
        std::fs::write(&path, with(&run, pointer, value)).unwrap();
        says(&fail(temp.path(), 1, &resume), &[text]);
    }
    // the largest numbers work
    for key in ["summary_freq", "checkpoint_interval", "keep_checkpoints"] {
        run[key] = u64::MAX.into();
    }
    std::fs::write(&path, run.to_string()).unwrap();
    succeed(temp.path(), &resume);
}

#[test]
fn a_place_that_cannot_be_written_is_found_before_training() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("file"), "").unwrap();
    let train = |out: &'static str| [&SMALL[..], &["1", "--steps", "100G", "--out", out]].concat();
    says(&fail(temp.path(), 1, &train("file/a")), &["file/a", "create folder"]);
    says(&fail(temp.path(), 2, &train("file")), &["--out is file: found a file, expected a folder"]);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("nowhere", temp.path().join("link")).unwrap();
        says(&fail(temp.path(), 2, &train("link")), &["--out is link: found a link to nothing, expected a folder"]);
    }
    std::fs::write(temp.path().join("runs"), "").unwrap();
    says(&fail(temp.path(), 1, &["train", "hopper"]), &["runs", "create folder"]);
}

#[test]
fn policies_must_fit_their_agent() {
    let temp = tempfile::tempdir().unwrap();
    succeed(temp.path(), &[&SMALL[..], &["1", "--steps", "8k", "--out", "a"]].concat());
    let wrong = "agent: found Hopper-v0, expected Ant-v0";
    says(&fail(temp.path(), 1, &["eval", "a", "--agent", "ant"]), &["policy.safetensors", wrong]);
    says(&fail(temp.path(), 1, &["render", "a", "--agent", "ant", "--out", "x.gif"]), &[wrong]);
    says(&fail(temp.path(), 1, &["eval", "aa"]), &["aa: policy", "no such file", "did you mean 'a'?"]);
    // a folder without a policy is no correction of itself
    std::fs::create_dir(temp.path().join("half")).unwrap();
    std::fs::copy(temp.path().join("a/run.json"), temp.path().join("half/run.json")).unwrap();
    for half in ["half", "./half", "half/"] {
        let text = fail(temp.path(), 1, &["eval", half]);
        says(&text, &["policy: found no policy.safetensors"]);
        assert!(!text.contains("did you mean 'half"), "{text}");
    }
    says(&fail(temp.path(), 1, &["serve", "aa"]), &["aa: policy", "did you mean 'a'?"]);
    let distill = fail(temp.path(), 1, &["distill", "hopper", "--teacher", "aa", "--out", "x.safetensors"]);
    says(&distill, &["aa: policy", "did you mean 'a'?"]);
    says(&fail(temp.path(), 1, &["eval", "a/polcy.safetensors"]), &["did you mean 'a/policy.safetensors'?"]);
    std::fs::write(temp.path().join("junk"), "junk").unwrap();
    says(&fail(temp.path(), 1, &["eval", "junk"]), &["junk", "a safetensors file"]);
    says(&fail(temp.path(), 2, &["eval", "a", "--episodes", "0"]), &["--episodes", "1 to 10000000"]);
    assert!(!temp.path().join("x.gif").exists());

    // damaged numbers are found before they are used
    let path = temp.path().join("a/checkpoint");
    let state = common::files(&path).into_iter().find(|f| f.extension().is_some_and(|e| e == "safetensors")).unwrap();
    let mut bytes = std::fs::read(&state).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    std::fs::write(&state, bytes).unwrap();
    says(&fail(temp.path(), 1, &["train", "--resume", "a", "--steps", "1M"]), &["state-", "checksum"]);
}

#[test]
fn pictures_need_a_name_that_says_what_they_are() {
    let temp = tempfile::tempdir().unwrap();
    succeed(temp.path(), &[&SMALL[..], &["1", "--steps", "8k", "--out", "a"]].concat());
    says(&fail(temp.path(), 1, &["render", "a", "--out", "x.gfi"]), &["x.gfi", "did you mean 'gif'?"]);
    says(&fail(temp.path(), 2, &["render", "a", "--out", "x.gif", "--frames", "3"]), &["--frames is for .png"]);
    says(
        &fail(temp.path(), 2, &["render", "a", "--out", "x.png", "--width", "0"]),
        &["--width is 0, expected 1 to 16384"],
    );
    says(&fail(temp.path(), 2, &["render", "a", "--out", "x.gif", "--seconds", "-1"]), &["--seconds"]);
    says(&fail(temp.path(), 2, &["render", "a", "--out", "none/x.gif"]), &["none/x.gif", "there is no folder none"]);
}

#[test]
fn json_carries_errors_too() {
    let temp = tempfile::tempdir().unwrap();
    let output = run(temp.path(), &["train", "hoper", "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let error = json(&String::from_utf8(output.stdout).unwrap());
    assert!(error["error"].as_str().unwrap().contains("did you mean 'Hopper-v0'?"));
    // errors of the command line itself
    for (words, part) in [
        (&["train", "hopper", "--sede", "3", "--json"][..], "--seed"),
        (&["--json", "trian"], "'train'"),
        (&["train", "hopper", "--json", "--steps", "lots"], "4M"),
        (&["eval", "--json"], "<POLICY>"),
        (&["--json"], "completions, help]"),
    ] {
        let output = run(temp.path(), words);
        assert_eq!(output.status.code(), Some(2), "{words:?}");
        let error = json(&String::from_utf8(output.stdout.clone()).unwrap());
        assert!(error["error"].as_str().unwrap().contains(part), "{words:?}: {error}");
        says(&common::stderr(&output), &[part]);
    }
}

/// A run whose checkpoint is gone does not start over and overwrite its results.
#[test]
fn a_lost_checkpoint_is_told() {
    let temp = tempfile::tempdir().unwrap();
    succeed(temp.path(), &[&SMALL[..], &["1", "--steps", "8k", "--out", "a"]].concat());
    let policy = std::fs::read(temp.path().join("a/policy.safetensors")).unwrap();
    std::fs::remove_file(temp.path().join("a/checkpoint/checkpoint.json")).unwrap();
    let text = fail(temp.path(), 1, &["train", "--resume", "a", "--steps", "20k"]);
    says(&text, &["a/checkpoint/checkpoint.json: checkpoint: found no such file", "before policy.safetensors"]);
    assert_eq!(std::fs::read(temp.path().join("a/policy.safetensors")).unwrap(), policy);
}

/// Extremely large learning rates: no invalid policy is written, and skipped minibatches are reported.
#[test]
fn a_training_that_diverges_says_so() {
    let temp = tempfile::tempdir().unwrap();
    let config = |rate: &str| {
        let text = format!(
            "behaviors:\n  Hopper:\n    trainer_type: ppo\n    max_steps: 100000\n    hyperparameters:\n      \
             batch_size: 512\n      buffer_size: 4096\n      learning_rate: {rate}\n"
        );
        std::fs::write(temp.path().join("rate.yaml"), text).unwrap();
    };
    config("1.0e38");
    let text = fail(temp.path(), 1, &["train", "hopper", "--config", "rate.yaml", "--out", "a"]);
    for part in ["error: training has diverged", "parameters are not finite", "a smaller learning rate (lr is 1e38"] {
        assert!(text.contains(part), "{text}");
    }
    assert!(!temp.path().join("a/policy.safetensors").exists());
    config("1.0e39");
    says(
        &fail(temp.path(), 1, &["train", "hopper", "--config", "rate.yaml"]),
        &["rate.yaml:8: ", "learning_rate: found '1.0e39', expected a positive number"],
    );

    config("1.0e3");
    let output = run(temp.path(), &["train", "hopper", "--config", "rate.yaml", "--out", "b"]);
    assert!(output.status.success(), "{}", common::stderr(&output));
    let skipped = common::read_json(&temp.path().join("b/summary.json"))["skipped_minibatches"].as_u64().unwrap();
    let note = format!("note: {skipped} minibatches were left out because the gradient was not finite");
    assert!(skipped > 1 && common::stderr(&output).contains(&note), "{skipped}: {}", common::stderr(&output));
}

/// The longest possible names.
#[test]
fn names_may_be_as_long_as_names_can_be() {
    let temp = tempfile::tempdir().unwrap();
    let long = |ending: &str| format!("{}{ending}", "n".repeat(255 - ending.len()));
    let run = long("");
    succeed(temp.path(), &[&SMALL[..], &["1", "--steps", "4096", "--out", &run]].concat());
    succeed(temp.path(), &["export", &run, "--out", &long(".onnx")]);
    succeed(temp.path(), &["record-demo", &run, "--episodes", "1", "--out", &long(".demo")]);
    succeed(temp.path(), &["render", &run, "--out", &long(".png"), "--frames", "1", "--seconds", "0.1"]);
    succeed(temp.path(), &["render", &run, "--out", &long(".gif"), "--width", "32", "--seconds", "0.1"]);
}

#[test]
fn help_is_worth_reading() {
    let temp = tempfile::tempdir().unwrap();
    for (args, parts) in [
        (&["--help"][..], &["Examples:", "marathon train hopper", "--json"][..]),
        (&["train", "--help"], &["--resume", "policy.safetensors", "Ctrl-C", "ML-Agents"]),
        (&["render", "--help"], &[".gif", "--seconds", "[default"]),
    ] {
        let text = succeed(temp.path(), args);
        for part in parts {
            assert!(text.contains(part), "{part} in {args:?}");
        }
    }
    let text = succeed(temp.path(), &["list"]);
    for id in ["Hopper-v0", "Walker2d-v1", "Humanoid-v0", "Ant-v1"] {
        assert!(text.contains(id), "{text}");
    }
    let text = succeed(temp.path(), &["list", "humanoid-run"]);
    for line in ["0..21  joint_angles", "22..34  extremities", "-1..1  abdomen_y", "forward, speed"] {
        assert!(text.lines().any(|found| found.trim() == line), "'{line}' in {text}");
    }
    let agents = json(&succeed(temp.path(), &["list", "hopper", "--json"]))["agents"].clone();
    assert_eq!((agents.as_array().map(Vec::len), &agents[0]["id"]), (Some(1), &"Hopper-v0".into()));
    assert_eq!(agents[0]["observations"][3], serde_json::json!({ "name": "touch", "range": [9, 10] }));
    let agents = json(&succeed(temp.path(), &["list", "--json"]))["agents"].clone();
    assert_eq!(agents[0]["id"], "Hopper-v0");
    assert_eq!(agents[0]["observation"], 31);
    let humanoid = agents.as_array().unwrap().iter().find(|agent| agent["id"] == "Humanoid-v5").unwrap();
    assert_eq!(
        (humanoid["action_range"][16][1].as_f64(), humanoid["info"].as_array().map(Vec::len)),
        (Some(0.4_f32.into()), Some(5))
    );
    let option = humanoid["options"].as_array().unwrap().iter().find(|o| o["name"] == "healthy_z_range").unwrap();
    assert_eq!(
        (option["default"].as_str(), option["expected"].as_str()),
        (Some("(1, 2)"), Some("two numbers, the lower one first"))
    );
}
