//! A run writes all documented files, and they agree with each other.

use crate::common::{self, SMALL, assert_no_leftovers, event_files, json, read_json, run, stderr, succeed, tensors};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

fn train(folder: &Path, more: &[&str]) -> String {
    succeed(folder, &[&SMALL[..], &["1", "--steps", "60k"], more].concat())
}

#[test]
fn a_run_leaves_every_file() {
    let temp = tempfile::tempdir().unwrap();
    let printed = json(&train(temp.path(), &["--json"]));
    let folder = temp.path().join("runs/hopper-1");
    assert_no_leftovers(temp.path());

    let summary = read_json(&folder.join("summary.json"));
    assert_eq!(printed, summary, "--json prints summary.json");
    assert_eq!(summary["agent"], "Hopper-v0");
    // the first rollout that reaches 60,000
    assert_eq!(summary["steps"], 61_440);
    assert_eq!(summary["interrupted"], false);
    let [steps, wall, cpu, rate] =
        ["steps", "wall_seconds", "cpu_seconds", "steps_per_cpu_second"].map(|k| summary[k].as_f64().unwrap());
    assert!(wall > 0.0 && cpu > 0.0);
    assert!((rate - steps / cpu).abs() < 1e-6 * rate);
    let eval = &summary["eval"];
    for key in ["return_mean", "return_std", "speed_mean", "length_mean"] {
        assert!(eval[key].as_f64().unwrap().is_finite(), "{key}");
    }
    assert_eq!(eval["episodes"], 100);
    assert!(eval["falls"].as_u64().unwrap() <= 100);

    // rows: one per iteration, terms add up in number
    let rows = std::fs::read_to_string(folder.join("progress.csv")).unwrap();
    let rows: Vec<Vec<&str>> = rows.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 1 + 15);
    assert_eq!(rows[0][..2], ["iteration", "steps"]);
    assert!(rows[0].contains(&"reward/velocity") && rows[0].contains(&"reward/termination"));
    for (i, row) in rows[1..].iter().enumerate() {
        assert_eq!(row[..2], [(i + 1).to_string(), (4096 * (i + 1)).to_string()]);
        assert_eq!(row.len(), rows[0].len());
    }

    let curve = std::fs::read(folder.join("curve.png")).unwrap();
    assert!(curve.starts_with(b"\x89PNG") && curve.len() > 5_000, "the curve has {} bytes", curve.len());
    assert!(folder.join("checkpoint/checkpoint.json").is_file());
    assert_eq!(read_json(&folder.join("run.json"))["config"]["run"]["agents"], 64);
    assert_eq!(event_files(&folder).len(), 1);
}

#[test]
fn an_evaluation_agrees_with_the_summary() {
    let temp = tempfile::tempdir().unwrap();
    let text = train(temp.path(), &[]);
    for line in ["steps per processor second", "  distance", "  speed", "  return", "  falls"] {
        assert!(text.contains(line), "{line} in {text}");
    }
    assert!(text.contains("render runs/hopper-1 --out hopper.gif"), "{text}");

    let eval = read_json(&temp.path().join("runs/hopper-1/summary.json"))["eval"].clone();
    assert_eq!(json(&succeed(temp.path(), &["eval", "runs/hopper-1", "--json"])), eval, "the folder");
    let file = ["eval", "runs/hopper-1/policy.safetensors", "--json", "--threads", "1", "--agent", "hopper"];
    assert_eq!(json(&succeed(temp.path(), &file)), eval, "the file, on one thread");
    let few = json(&succeed(temp.path(), &["eval", "runs/hopper-1", "--json", "--episodes", "3"]));
    assert_eq!(few["episodes"], 3);
    assert!(succeed(temp.path(), &["eval", "runs/hopper-1"]).contains("of 100 episodes"));
}

#[test]
fn the_same_command_gives_the_same_policy_in_a_new_folder() {
    let temp = tempfile::tempdir().unwrap();
    train(temp.path(), &["--threads", "1"]);
    train(temp.path(), &["--threads", "2"]);
    train(temp.path(), &["--out", "elsewhere/b"]);
    let policy = |run: &str| tensors(&temp.path().join(run).join("policy.safetensors"));
    assert_eq!(policy("runs/hopper-1"), policy("runs/hopper-2"));
    assert_eq!(policy("runs/hopper-1"), policy("elsewhere/b"));
    // the whole file, so that its checksum tells equal policies
    let file = |run: &str| std::fs::read(temp.path().join(run).join("policy.safetensors")).unwrap();
    assert!(file("runs/hopper-1") == file("runs/hopper-2") && file("runs/hopper-1") == file("elsewhere/b"));
}

#[test]
fn policies_on_the_way_are_kept() {
    let temp = tempfile::tempdir().unwrap();
    let config = "
behaviors:
  Hopper:
    trainer_type: ppo
    hyperparameters: { batch_size: 512, buffer_size: 4096, learning_rate: 3.0e-4, num_epoch: 2 }
    network_settings: { hidden_units: 32, num_layers: 2, normalize: true }
    max_steps: 60000
    time_horizon: 64
    summary_freq: 20000
    checkpoint_interval: 10000
    keep_checkpoints: 2
";
    std::fs::write(temp.path().join("small.yaml"), config).unwrap();
    let output = run(temp.path(), &["train", "hopper", "--config", "small.yaml", "--out", "a"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let kept = common::files(&temp.path().join("a/policies"));
    assert_eq!(kept.len(), 2, "{kept:?}");
    for policy in &kept {
        succeed(temp.path(), &["eval", policy.to_str().unwrap(), "--episodes", "1"]);
    }
}

/// The real TensorBoard reads the events.
#[test]
fn tensorboard_reads_the_events() {
    let temp = tempfile::tempdir().unwrap();
    train(temp.path(), &[]);
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let python = common::python();
    let script = workspace.join("tests/oracle/tensorboard_events.py");
    let output = Command::new(&python).arg(script).arg(temp.path().join("runs/hopper-1")).output();
    let output = output.unwrap_or_else(|e| panic!("{}: {e}: run ./test.sh, which sets up .venv", python.display()));
    assert!(output.status.success(), "run ./test.sh, which sets up .venv; {}", stderr(&output));
    let scalars: Value = json(&String::from_utf8(output.stdout).unwrap());

    // every cell of the table is there under its tag
    let mut reader = csv::Reader::from_path(temp.path().join("runs/hopper-1/progress.csv")).unwrap();
    let names: Vec<String> = reader.headers().unwrap().iter().map(String::from).collect();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let pairs = [
        ("Environment/Cumulative Reward", "return_mean"),
        ("Environment/Episode Length", "length_mean"),
        ("Environment/Speed", "speed_mean"),
        ("Environment/Falls", "fall_fraction"),
        ("Losses/Policy Loss", "policy_loss"),
        ("Losses/Value Loss", "value_loss"),
        ("Policy/Entropy", "entropy"),
        ("Policy/Learning Rate", "lr"),
        ("Performance/Steps Per Second", "steps_per_second"),
        ("Reward/velocity", "reward/velocity"),
        ("Reward/effort", "reward/effort"),
    ];
    for (tag, column) in pairs {
        let column = names.iter().position(|name| name == column).unwrap();
        let cells = rows.iter().filter(|row| !row[column].is_empty());
        let expected: Vec<(u64, f32)> =
            cells.map(|row| (row[1].parse().unwrap(), row[column].parse::<f64>().unwrap() as f32)).collect();
        let pair = |p: &Value| (p[0].as_u64().unwrap(), p[1].as_f64().unwrap() as f32);
        let found: Vec<(u64, f32)> = scalars[tag].as_array().expect(tag).iter().map(pair).collect();
        assert_eq!(found, expected, "{tag}");
    }
}

#[test]
fn another_number_of_agents_keeps_the_buffer() {
    let folder = tempfile::tempdir().unwrap();
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/configs/hopper-mlagents.yaml");
    succeed(folder.path(), &["train", "hopper", "--config", file, "--agents", "16", "--steps", "1", "--out", "x"]);
    let config = &read_json(&folder.path().join("x/run.json"))["config"];
    assert_eq!((&config["run"]["agents"], &config["run"]["horizon"]), (&16.into(), &640.into()));
    assert_eq!(config["ppo"]["minibatches"], 5);
}

/// Metrics of the task, with the task's names.
#[test]
fn metrics_have_columns_and_tags() {
    let temp = tempfile::tempdir().unwrap();
    let words = ["train", "walker-walk-v0", "--steps", "20k", "--agents", "16", "--out", "a"];
    let output = run(temp.path(), &words);
    assert!(output.status.success(), "{}", stderr(&output));
    let text = std::fs::read_to_string(temp.path().join("a/progress.csv")).unwrap();
    let (head, row) = (text.lines().next().unwrap(), text.lines().next_back().unwrap());
    // `forward` has its own column, the speed
    let metrics: Vec<_> = head.split(',').zip(row.split(',')).filter(|(name, _)| name.starts_with("metric/")).collect();
    let [("metric/speed", speed)] = metrics[..] else { panic!("{metrics:?}") };
    let speed: f64 = speed.parse().unwrap();
    assert!(speed != 0.0 && speed.abs() < 5.0, "{speed} m/s");
    let events = std::fs::read_dir(temp.path().join("a")).unwrap().filter_map(|entry| {
        let path = entry.unwrap().path();
        path.file_name().unwrap().to_str().unwrap().contains("tfevents").then(|| std::fs::read(path).unwrap())
    });
    let tag = b"Metric/speed";
    assert!(events.into_iter().any(|bytes| bytes.windows(tag.len()).any(|part| part == tag)));
}
