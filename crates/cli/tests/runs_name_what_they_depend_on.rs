//! A run lists the outside files that it depends on. It resumes from any folder, and refuses files that have changed.
//! The task in `run.json` takes precedence over the command line.

use crate::common::*;
use std::path::Path;

/// A small run of Gymnasium's hopper.
const TINY: &str = "
behaviors:
  Hopper-v5:
    trainer_type: ppo
    hyperparameters: { batch_size: 256, buffer_size: 256, num_epoch: 1 }
    network_settings: { hidden_units: 8, num_layers: 1, normalize: true }
    max_steps: 1024
    checkpoint_interval: 512
";

fn asset(path: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets").join(path)).unwrap()
}

/// The folders `here`, which has the run's files, and `elsewhere`.
fn folders(temp: &Path) -> [std::path::PathBuf; 2] {
    let folders = ["here", "elsewhere"].map(|name| temp.join(name));
    folders.iter().for_each(|folder| std::fs::create_dir(folder).unwrap());
    std::fs::write(folders[0].join("tiny.yaml"), TINY).unwrap();
    folders
}

/// Creates the files of a start that was killed before its first iteration.
fn forget_iterations(run: &Path) {
    std::fs::remove_dir_all(run.join("checkpoint")).unwrap();
    let _ = std::fs::remove_dir_all(run.join("policies"));
    for name in ["progress.csv", "policy.safetensors", "summary.json", "curve.png"] {
        std::fs::remove_file(run.join(name)).unwrap();
    }
}

#[test]
fn a_model_is_found_from_anywhere_and_may_not_change() {
    let temp = tempfile::tempdir().unwrap();
    let [here, elsewhere] = folders(temp.path());
    // the model consists of two files
    let model = asset("gymnasium/hopper.xml");
    let (head, rest) = model.split_once("<worldbody>").unwrap();
    let (world, tail) = rest.split_once("</worldbody>").unwrap();
    std::fs::create_dir(here.join("parts")).unwrap();
    std::fs::write(here.join("parts/world.xml"), format!("<mujoco><worldbody>{world}</worldbody></mujoco>")).unwrap();
    std::fs::write(here.join("my.xml"), format!("{head}<include file=\"parts/world.xml\"/>{tail}")).unwrap();
    let train = ["train", "Hopper-v5", "--config", "tiny.yaml", "--option", "xml_file=my.xml", "--out"];
    for out in ["whole", "run"] {
        succeed(&here, &[&train[..], &[out]].concat());
    }
    succeed(&here, &["train", "--resume", "whole", "--steps", "2048"]);
    succeed(&elsewhere, &["train", "--resume", "../here/run", "--steps", "2048"]);
    let policy = |run: &str| tensors(&here.join(run).join("policy.safetensors"));
    assert_eq!(policy("run"), policy("whole"));
    // a policy stores the path of its model, too
    succeed(&elsewhere, &["eval", "../here/run", "--episodes", "2"]);

    for name in ["my.xml", "parts/world.xml"] {
        let file = here.join(name);
        let text = std::fs::read_to_string(&file).unwrap();
        std::fs::write(&file, format!("{text}<!-- -->")).unwrap();
        let error = fail(&here, 1, &["train", "--resume", "run", "--steps", "4096"]);
        assert!(error.contains(&format!("{name}: checksum: found")), "{error}");
        assert!(error.contains("as in run.json; the file has changed since the run began"), "{error}");
        std::fs::remove_file(&file).unwrap();
        let error = fail(&here, 1, &["train", "--resume", "run", "--steps", "4096"]);
        assert!(error.contains(&format!("{name}: read: No such file")), "{error}");
        std::fs::write(&file, text).unwrap();
    }
    assert_eq!(policy("run"), policy("whole"));
    succeed(&here, &["train", "--resume", "run", "--steps", "4096"]);
}

#[test]
fn demonstrations_are_found_from_anywhere_and_may_not_change() {
    let temp = tempfile::tempdir().unwrap();
    let [here, elsewhere] = folders(temp.path());
    let config = TINY.replace("Hopper-v5", "Hopper-v0").replace(
        "max_steps",
        "reward_signals: { extrinsic: { strength: 1.0, gamma: 0.99 }, gail: { strength: 0.1, demo_path: hop.demo } }\n    max_steps",
    );
    std::fs::write(here.join("gail.yaml"), config).unwrap();
    succeed(&here, &["record-demo", &shipped("hopper"), "--episodes", "1", "--out", "hop.demo"]);
    for out in ["whole", "run"] {
        succeed(&here, &["train", "hopper", "--config", "gail.yaml", "--out", out]);
    }
    succeed(&here, &["train", "--resume", "whole", "--steps", "2048"]);
    succeed(&elsewhere, &["train", "--resume", "../here/run", "--steps", "2048"]);
    let policy = |run: &str| tensors(&here.join(run).join("policy.safetensors"));
    assert_eq!(policy("run"), policy("whole"));
    succeed(&here, &["record-demo", &shipped("hopper"), "--episodes", "1", "--seed", "9", "--out", "hop.demo"]);
    let error = fail(&here, 1, &["train", "--resume", "run", "--steps", "4096"]);
    assert!(error.contains("hop.demo: checksum: found") && error.contains("as in run.json"), "{error}");
}

#[test]
fn the_policy_that_a_run_starts_from_may_not_change_before_the_first_checkpoint() {
    let temp = tempfile::tempdir().unwrap();
    let [here, elsewhere] = folders(temp.path());
    for (seed, out) in [("1", "one"), ("2", "two")] {
        succeed(&here, &["train", "Hopper-v5", "--config", "tiny.yaml", "--seed", seed, "--out", out]);
        std::fs::copy(here.join(out).join("policy.safetensors"), here.join(format!("{out}.safetensors"))).unwrap();
    }
    std::fs::copy(here.join("one.safetensors"), here.join("start.safetensors")).unwrap();
    let train =
        ["train", "Hopper-v5", "--config", "tiny.yaml", "--initialize-from", "start.safetensors", "--out", "run"];
    succeed(&here, &train);
    let whole = tensors(&here.join("run/policy.safetensors"));
    forget_iterations(&here.join("run"));
    std::fs::copy(here.join("two.safetensors"), here.join("start.safetensors")).unwrap();
    let error = fail(&elsewhere, 1, &["train", "--resume", "../here/run"]);
    assert!(error.contains("start.safetensors: checksum: found") && error.contains("as in run.json"), "{error}");
    std::fs::copy(here.join("one.safetensors"), here.join("start.safetensors")).unwrap();
    succeed(&elsewhere, &["train", "--resume", "../here/run"]);
    assert_eq!(tensors(&here.join("run/policy.safetensors")), whole);
    // a run with a checkpoint no longer needs the policy
    std::fs::remove_file(here.join("start.safetensors")).unwrap();
    succeed(&elsewhere, &["train", "--resume", "../here/run", "--steps", "2048"]);
}

/// The agent's name together with `--resume` does not set any options: the run keeps its own.
#[test]
fn a_named_agent_goes_on_with_the_arguments_of_the_run() {
    let temp = tempfile::tempdir().unwrap();
    let [here, _] = folders(temp.path());
    for out in ["a", "b"] {
        let option = ["--option", "ctrl_cost_weight=2", "--out", out];
        succeed(&here, &[&["train", "Hopper-v5", "--config", "tiny.yaml"][..], &option].concat());
    }
    succeed(&here, &["train", "--resume", "a", "--steps", "2048"]);
    succeed(&here, &["train", "Hopper-v5", "--resume", "b", "--steps", "2048"]);
    let [a, b] = ["a", "b"].map(|run| tensors(&here.join(run).join("policy.safetensors")));
    assert_eq!(a, b);
}

/// A run killed between writing its description and its clip can resume. Killed earlier, it does not block a new run.
#[test]
fn a_run_that_was_killed_before_its_clip_was_in_place_goes_on() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    let clip = asset("motions/marathon_man/kick.motion");
    std::fs::write(path.join("my.motion"), &clip).unwrap();
    let config = TINY.replace("Hopper-v5", "MarathonMan-v0");
    std::fs::write(path.join("tiny.yaml"), config).unwrap();
    let train = ["train", "MarathonMan", "--config", "tiny.yaml", "--option", "clip=my.motion", "--out"];
    succeed(path, &[&train[..], &["whole"]].concat());
    let whole = tensors(&path.join("whole/policy.safetensors"));

    let run = path.join("run");
    succeed(path, &[&train[..], &["run"]].concat());
    forget_iterations(&run);
    event_files(&run).iter().for_each(|file| std::fs::remove_file(file).unwrap());
    std::fs::rename(run.join("my.motion"), run.join(".clip-0.77.tmp")).unwrap();
    let description = std::fs::read(run.join("run.json")).unwrap();
    succeed(path, &["train", "--resume", "run"]);
    assert_eq!(tensors(&run.join("policy.safetensors")), whole);
    assert_eq!(std::fs::read_to_string(run.join("my.motion")).unwrap(), clip);
    assert_no_leftovers(&run);

    // before the description has its final name
    let run = path.join("early");
    std::fs::create_dir(&run).unwrap();
    std::fs::write(run.join(".lock"), "").unwrap();
    std::fs::write(run.join(".clip-0.77.tmp"), &clip[..100]).unwrap();
    std::fs::write(run.join(".0123456789abcdef-0.77.tmp"), &description[..50]).unwrap();
    succeed(path, &[&train[..], &["early"]].concat());
    assert_eq!(tensors(&run.join("policy.safetensors")), whole);
    assert_no_leftovers(&run);
}
