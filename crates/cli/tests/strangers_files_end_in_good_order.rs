//! Files from another person may contain anything. The program uses them or reports the problem, within limits on time
//! and memory. No text from a file reaches the terminal as a command.

use crate::common::*;
use marathon_envs::options::{Options, Value};
use marathon_learn::{Policy, PolicyMeta};
use marathon_runs::TaskConfig;
use std::path::Path;
use std::time::{Duration, Instant};

/// A policy for a task with options that the task may refuse.
fn policy(folder: &Path, agent: &str, options: &[(&str, Value)], change: impl Fn(&mut PolicyMeta)) {
    let spec = TaskConfig::named(agent).unwrap().factory().unwrap().spec().clone();
    let mut meta = PolicyMeta::of(&spec, vec![4], marathon_learn::Activation::Tanh);
    let all = options.iter().fold(Options::new(), |all, (name, value)| all.with(name, value.clone()));
    meta.options = all;
    change(&mut meta);
    let (obs, act) = (meta.obs, meta.act);
    let params = vec![0.0; (obs + 1) * 4 + 5 * act];
    let policy = Policy::from_parts(meta, params, (vec![0.0; obs], vec![1.0; obs]), vec![0.0; act]).unwrap();
    policy.save(&folder.join("p.safetensors")).unwrap();
}

/// The output of `eval` for the policy, limited to 2 GB of memory and a few seconds.
#[track_caller]
fn refusal(folder: &Path) -> String {
    let begun = Instant::now();
    let mut shell = std::process::Command::new("bash");
    let script = "ulimit -v 4000000; exec timeout 60 \"$0\" eval p.safetensors --episodes 2";
    let output = shell.args(["-c", script, program()]).current_dir(folder).output().unwrap();
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(begun.elapsed() < Duration::from_secs(30), "{text}");
    text
}

#[test]
fn arguments_beyond_measure_are_refused_by_name() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    let number = |x: f64| Value::Number(x);
    for (agent, name, value, part) in [
        ("MarathonMan", "seconds", number(1e300), "option seconds"),
        ("MarathonManSteer", "seconds", number(1e300), "option seconds"),
        ("TerrainHopper", "difficulty", number(1e18), "option difficulty"),
        ("Hopper-v5", "frame_skip", number(1e15), "frame_skip"),
        ("Hopper-v5", "xml_file", "none.xml".into(), "none.xml"),
    ] {
        policy(path, agent, &[(name, value)], |_| {});
        let text = refusal(path);
        assert!(text.contains(part), "{agent} {name}: {text}");
    }
    // training options, which playing does not need
    let text = fail(path, 1, &["train", "MarathonManSteer", "--option", "replay_falls_prob=1e18"]);
    assert!(text.contains("option replay_falls_prob") && text.contains("a number from 0 to 1"), "{text}");
    let names = vec!["walk"; 100_000].join(",");
    policy(path, "MarathonMan", &[("clip", names.as_str().into())], |_| {});
    let text = refusal(path);
    assert!(text.contains("option clip has 100000 clips, expected at most 1000"), "{text}");
}

#[cfg(unix)]
#[test]
fn models_that_never_end_are_refused() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    let made = std::process::Command::new("mkfifo").arg(path.join("pipe.xml")).status().unwrap();
    assert!(made.success());
    for model in ["/dev/zero", "pipe.xml", "/"] {
        policy(path, "Hopper-v5", &[("xml_file", model.into())], |_| {});
        let text = refusal(path);
        assert!(text.contains(model) && text.contains("expected a regular file"), "{text}");
    }
    // files of other kinds
    for (words, name) in [
        (&["train", "hopper", "--config", "pipe.xml"][..], "pipe.xml"),
        (&["train", "hopper", "--config", "/dev/zero"], "/dev/zero"),
        (&["eval", "/dev/zero"], "/dev/zero"),
        (&["eval", "pipe.xml"], "pipe.xml"),
        (&["import", "pipe.xml", "--out", "x.safetensors"], "pipe.xml"),
    ] {
        let mut shell = std::process::Command::new("bash");
        let script = "ulimit -v 4000000; exec timeout 60 \"$0\" \"$@\"";
        let output = shell.args(["-c", script, program()]).args(words).current_dir(path).output().unwrap();
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{words:?}: {text}");
        assert!(text.contains(name) && text.contains("expected a regular file"), "{words:?}: {text}");
    }
}

/// Control characters such as escape sequences and carriage returns are printed in escaped form.
#[test]
fn no_text_of_a_file_commands_the_terminal() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    let evil = "\u{1b}]0;owned\u{7}\u{1b}[2J\r\u{9b}31m\u{202e}x";
    let harmless = |bytes: &[u8]| {
        let text = String::from_utf8(bytes.to_vec()).unwrap();
        let bad = text.chars().find(|c| (c.is_control() && *c != '\n') || *c == '\u{202e}');
        assert_eq!(bad, None, "{text:?}");
        text
    };
    // names of tasks, options and roles
    policy(path, "Hopper-v0", &[], |meta| meta.agent = evil.into());
    let text = harmless(&run(path, &["eval", "p.safetensors"]).stderr);
    assert!(text.contains(r"\u{1b}]0;owned\u{7}\u{1b}[2J\u{d}\u{9b}31m\u{202e}x"), "{text}");
    let output = run(path, &["eval", "p.safetensors", "--json"]);
    harmless(&output.stderr);
    let text = harmless(&output.stdout);
    assert!(json(&text)["error"].as_str().unwrap().contains(evil), "JSON says the same: {text}");
    policy(path, "Hopper-v5", &[(evil, 1.0.into())], |_| {});
    harmless(&run(path, &["eval", "p.safetensors"]).stderr);
    // a configuration file
    std::fs::write(path.join("evil.yaml"), "behaviors:\n  Hopper:\n    \"a\\e[2J\\x9b\": 1\n").unwrap();
    let text = harmless(&run(path, &["train", "hopper", "--config", "evil.yaml"]).stderr);
    assert!(text.contains("unknown key") || text.contains("expected"), "{text}");
    // success messages: names of tasks on stdout
    policy(path, "Hopper-v0", &[], |_| {});
    let name = "p\u{1b}[2J.safetensors";
    std::fs::copy(path.join("p.safetensors"), path.join(name)).unwrap();
    let output = run(path, &["eval", name, "--episodes", "1"]);
    assert!(output.status.success(), "{}", stderr(&output));
    harmless(&output.stdout);
    let output = run(path, &["import", name, "--out", "q\u{1b}[2J.safetensors"]);
    assert!(output.status.success(), "{}", stderr(&output));
    harmless(&output.stdout);
}

/// Tables and numbers that no run writes.
#[test]
fn a_table_of_any_numbers_is_drawn_or_refused() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    succeed(path, &[&SMALL[..], &["1", "--steps", "8k", "--out", "a"]].concat());
    let table = path.join("a/progress.csv");
    let whole = std::fs::read_to_string(&table).unwrap();
    let (head, rows) = whole.split_once('\n').unwrap();
    let names: Vec<&str> = head.split(',').collect();
    for value in ["1e308", "-1e308", "inf", "-inf", "nan", "1e-320", "1e16", ""] {
        let changed: Vec<String> = rows
            .lines()
            .map(|row| {
                let cells =
                    row.split(',').zip(&names).map(|(cell, name)| if *name == "iteration" { cell } else { value });
                cells.collect::<Vec<_>>().join(",")
            })
            .collect();
        std::fs::write(&table, format!("{head}\n{}\n", changed.join("\n"))).unwrap();
        let _ = std::fs::remove_file(path.join("a/curve.png"));
        let begun = Instant::now();
        let output = run(path, &["train", "--resume", "a"]);
        assert!(output.status.success(), "{value}: {}", stderr(&output));
        assert!(path.join("a/curve.png").is_file() && begun.elapsed() < Duration::from_secs(30), "{value}");
    }
    // a pipe named like the events file or the table
    #[cfg(unix)]
    for name in ["progress.csv", "events.out.tfevents.1.marathon.0001", "summary.json"] {
        let file = path.join("a").join(name);
        let before = std::fs::read(&file).ok();
        let _ = std::fs::remove_file(&file);
        assert!(std::process::Command::new("mkfifo").arg(&file).status().unwrap().success());
        let text = fail(path, 1, &["train", "--resume", "a", "--steps", "16k"]);
        assert!(text.contains("found a device, pipe or socket"), "{name}: {text}");
        std::fs::remove_file(&file).unwrap();
        before.iter().for_each(|bytes| std::fs::write(&file, bytes).unwrap());
    }
}

#[test]
fn pictures_beyond_measure_are_refused() {
    let temp = tempfile::tempdir().unwrap();
    let hopper = shipped("hopper");
    for (words, part) in [
        (&["--out", "x.png", "--width", "60000", "--height", "60000"][..], "--width is 60000, expected 1 to 16384"),
        (&["--out", "x.png", "--frames", "1000", "--width", "3000", "--height", "3000"], "asks for"),
        (&["--out", "x.gif", "--width", "18446744073709551615"], "--width is 18446744073709551615"),
        (&["--out", "x.gif", "--seconds", "1e300"], "--seconds asks for"),
        (&["--out", "x.gif", "--start", "1e9"], "--start asks for"),
        (&["--out", "x.gif", "--seconds", "nan"], "--seconds is NaN"),
    ] {
        let text = fail(temp.path(), 2, &[&["render", &hopper], words].concat());
        assert!(text.contains(part), "{words:?}: {text}");
    }
}
