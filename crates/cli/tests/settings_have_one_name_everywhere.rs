//! A setting has one name in files, in `--set`, in `config show` and in `run.json`.

use crate::common::*;
use std::path::Path;

/// A file that comes with Marathon.
fn file(name: &str) -> String {
    format!("{}/../../assets/configs/{name}", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn a_setting_of_the_command_line_is_that_of_the_run() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    std::fs::write(path.join("mine.yaml"), "run: {agents: 32, total_steps: 1}\nppo: {epochs: 2, lr: 1e-4}\n").unwrap();
    let words = ["--set", "ppo.lr=2e-4", "--set", "network.hidden=[8]", "--set", "ppo.action_std.min.to=0.02"];
    let train = ["train", "hopper", "--config", "mine.yaml", "--set", "run.horizon=16", "--out", "a"];
    succeed(path, &[&train[..], &words].concat());
    let config = &read_json(&path.join("a/run.json"))["config"];
    let (run, ppo) = (&config["run"], &config["ppo"]);
    assert_eq!((&run["agents"], &run["horizon"], &run["total_steps"]), (&32.into(), &16.into(), &1.into()));
    assert_eq!((&ppo["lr"], &ppo["epochs"], &config["network"]["hidden"]), (&2e-4.into(), &2.into(), &[8].into()));
    // what neither names is the preset's
    assert_eq!((&ppo["action_std"]["min"]["from"], &ppo["action_std"]["min"]["to"]), (&0.42.into(), &0.02.into()));

    for (set, part) in [
        ("ppo.lrr=1", "--set: ppo.lrr: unknown key; did you mean 'lr'?"),
        ("lr=1", "--set: lr: unknown key; did you mean 'ppo.lr'?"),
        ("ppo.lr", "--set: ppo.lr: found nothing, expected a positive number"),
        ("ppo.epochs=2.5", "--set: ppo.epochs: found '2.5', expected a whole number between 1 and 1000"),
        ("ppo.minibatches=1000", "--set: ppo.minibatches: found 1000, expected at most 512"),
        ("sac.lr=1e-3", "--set: sac.lr: found sac, expected ppo, the algorithm of this configuration"),
        ("run.agents=100", "--set: run.agents: found 100, expected a multiple of 16, such as 96"),
    ] {
        let text = fail(path, 1, &["train", "hopper", "--set", set, "--out", "b"]);
        assert!(text.contains(part), "{set}: {text}");
    }
    assert!(!path.join("b").exists());
    let text = fail(path, 2, &["train", "--resume", "a", "--set", "ppo.lr=1e-3"]);
    assert!(text.contains("--set is for new runs"), "{text}");
}

#[test]
fn what_is_shown_is_a_file_of_the_same_settings() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    let shown = |words: &[&str]| json(&succeed(path, &[&["config", "show", "--json"], words].concat()));
    for task in ["hopper", "MarathonManSteer", "TerrainWalker2d"] {
        let text = succeed(path, &["config", "show", task]);
        std::fs::write(path.join("shown.yaml"), format!("preset: false\n{text}")).unwrap();
        assert_eq!(shown(&[task, "--config", "shown.yaml"]), shown(&[task]), "{text}");
    }
    assert_eq!(shown(&["hopper", "--set", "ppo.lr=3e-4"])["ppo"]["lr"], 3e-4);
    assert_eq!(shown(&["hopper", "--algo", "sac"])["sac"]["batch"], 256);
    assert!(fail(path, 1, &["config", "show", "hoper"]).contains("did you mean 'Hopper-v0'?"));
}

#[test]
fn a_converted_file_of_ml_agents_says_what_it_said() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    let shown = |task: &str, file: &str| json(&succeed(path, &["config", "show", "--json", task, "--config", file]));
    for (name, tasks) in [
        ("paper-appendix-b.yaml", &["hopper", "walker", "humanoid", "ant"][..]),
        ("paper-appendix-c.yaml", &["hopper"]),
        ("hopper-mlagents.yaml", &["hopper"]),
    ] {
        succeed(path, &["config", "convert", &file(name), "--out", "native.yaml"]);
        let text = std::fs::read_to_string(path.join("native.yaml")).unwrap();
        assert!(text.contains("tasks:") && !text.contains("buffer_size"), "{text}");
        for task in tasks {
            assert_eq!(shown(task, "native.yaml"), shown(task, &file(name)), "{name} {task}: {text}");
        }
    }
    let (printed, written) = (succeed(path, &["config", "convert", &file("hopper-mlagents.yaml")]), "native.yaml");
    assert_eq!(printed, std::fs::read_to_string(path.join(written)).unwrap());
    let text = fail(path, 1, &["config", "convert", &file("hopper-fast.yaml")]);
    assert!(text.contains("expected a file of ML-Agents"), "{text}");
    let text = fail(path, 2, &["config", "convert", &file("hopper-mlagents.yaml"), "--out", "native.txt"]);
    assert!(text.contains("--out") && !Path::new("native.txt").exists(), "{text}");
}
