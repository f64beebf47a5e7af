//! `marathon average`: every number of the written policy is the mean over the policies of a run. The policy is for the
//! user's task, and has no evaluation. Policies that do not match are refused by name.

use crate::common::{assert_no_leftovers, fail, read_json, shipped, succeed, tensors};
use marathon_envs::options::Value;
use marathon_learn::Policy;
use std::path::{Path, PathBuf};

/// A run of the hopper that keeps three policies, of 4096, 8192 and 12288 steps.
fn run(folder: &Path) -> Vec<PathBuf> {
    let config = "
        behaviors:
          Hopper-v0:
            trainer_type: ppo
            network_settings: {normalize: true, hidden_units: 24, num_layers: 2}
            time_horizon: 64
            checkpoint_interval: 4096
            keep_checkpoints: 3
            max_steps: 12288
            hyperparameters: {buffer_size: 4096, batch_size: 1024}";
    std::fs::write(folder.join("small.yaml"), config).unwrap();
    succeed(folder, &["train", "hopper", "--config", "small.yaml", "--seed", "1", "--out", "run"]);
    let kept = [4096, 8192, 12288].map(|steps| folder.join(format!("run/policies/policy-{steps}.safetensors")));
    kept.iter().for_each(|path| assert!(path.exists(), "{} is kept", path.display()));
    kept.into()
}

fn numbers(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
}

#[test]
fn every_number_is_the_mean() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let kept = run(folder);
    let text = succeed(folder, &["average", "run", "--out", "mean.safetensors"]);
    assert!(text.starts_with("wrote mean.safetensors: Hopper-v0, 31 -> 24 -> 24 -> 4"), "{text}");

    let rows: Vec<_> = kept.iter().map(|path| tensors(path)).collect();
    let mean = tensors(&folder.join("mean.safetensors"));
    assert_eq!(mean.len(), 9, "statistics of observations, deviations, three layers");
    for (i, (name, shape, bytes)) in mean.iter().enumerate() {
        assert_eq!((name, shape), (&rows[0][i].0, &rows[0][i].1));
        let of: Vec<Vec<f32>> = rows.iter().map(|row| numbers(&row[i].2)).collect();
        let means = (0..of[0].len()).map(|k| ((of.iter().map(|row| f64::from(row[k])).sum::<f64>()) / 3.0) as f32);
        assert_eq!(numbers(bytes), means.collect::<Vec<f32>>(), "{name}");
        assert_ne!(bytes, &rows[2][i].2, "{name} differs from the last policy's");
    }
    let [last, mean] = ["run/policies/policy-12288", "mean"]
        .map(|name| Policy::load(&folder.join(format!("{name}.safetensors"))).unwrap().meta().clone());
    assert_eq!(mean.training, last.training);
    assert!(mean.evaluation.is_none());

    // the same files by name; the order only sets whose description is kept
    let named = ["average", "run/policies/policy-4096.safetensors", "run/policies/policy-8192.safetensors"];
    succeed(folder, &[&named[..], &["run/policies/policy-12288.safetensors", "--out", "named.safetensors"]].concat());
    let bytes = |name: &str| std::fs::read(folder.join(name)).unwrap();
    assert!(bytes("named.safetensors") == bytes("mean.safetensors"));
    succeed(folder, &["eval", "mean.safetensors", "--episodes", "4"]);
    // the run's own files do not change
    assert_eq!(read_json(&folder.join("run/summary.json"))["steps"], 12288);
    assert_no_leftovers(folder);
}

#[test]
fn the_mean_is_for_the_task_that_the_user_says() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let walk = shipped("MarathonManWalk");
    succeed(folder, &["average", &walk, &walk, "--option", "start=first", "--out", "walk.safetensors"]);
    let [before, after] = [Path::new(&walk), &folder.join("walk.safetensors")].map(|path| Policy::load(path).unwrap());
    assert_eq!(before.params(), after.params());
    let start = |policy: &Policy| policy.meta().options.get("start").cloned();
    assert_eq!(start(&after), Some(Value::Text("first".into())));
    assert_ne!(start(&before), start(&after));

    let error = fail(folder, 1, &["average", &walk, &walk, "--option", "strat=first", "--out", "x.safetensors"]);
    assert!(error.contains("did you mean 'start'?"), "{error}");
    let error = fail(folder, 1, &["average", &shipped("hopper"), &walk, "--out", "x.safetensors"]);
    assert!(error.contains("hopper.safetensors: agent: found Hopper-v0, expected MarathonManWalk-v0"), "{error}");
    assert!(!folder.join("x.safetensors").exists());
}

#[test]
fn what_has_no_mean_is_refused() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let kept = run(folder);
    let hopper = shipped("hopper");
    let cases: [(&[&str], i32, &str); 5] = [
        (
            &["run/policies/policy-4096.safetensors"],
            1,
            "policy-4096.safetensors: policies: found one, expected two or more",
        ),
        (
            &["run/policies", "run"],
            1,
            "run/policies/policies: policies: found none, expected those that a run has kept",
        ),
        (&[&hopper, "run"], 1, "hopper.safetensors: hidden layers: found [32, 32], expected [24, 24]"),
        (&["run", "run/polices.safetensors"], 1, "run/polices.safetensors: policy: found no such file"),
        (
            &["run", "--out", "./run/policies/policy-8192.safetensors"],
            2,
            "which is also an input; expected another file",
        ),
    ];
    let before: Vec<_> = kept.iter().map(|path| std::fs::read(path).unwrap()).collect();
    for (words, code, expected) in cases {
        let out: &[&str] = if words.contains(&"--out") { &[] } else { &["--out", "x.safetensors"] };
        let error = fail(folder, code, &[&["average"], words, out].concat());
        assert!(error.contains(expected), "{error}");
    }
    assert!(!folder.join("x.safetensors").exists());
    // the policy of a run is not overwritten by its own mean
    let error = fail(folder, 2, &["import", "run", "--out", "run/policy.safetensors"]);
    assert!(error.contains("which is also an input; expected another file"), "{error}");
    assert!(before == kept.iter().map(|path| std::fs::read(path).unwrap()).collect::<Vec<_>>());
    assert_no_leftovers(folder);
}
