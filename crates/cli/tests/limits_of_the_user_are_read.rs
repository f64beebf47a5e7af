//! `MARATHON_LIMITS` refuses what exceeds it, and nothing else. A value that is wrong ends the command with its name.

use crate::common::*;
use std::process::Output;

fn with(limits: &str, words: &[&str]) -> Output {
    let temp = tempfile::tempdir().unwrap();
    marathon(temp.path(), words).env("MARATHON_LIMITS", limits).output().expect("the command starts")
}

#[test]
fn a_wrong_limit_is_named() {
    for (limits, part) in [
        ("foo=1", "found 'foo', expected the name of a limit; known: memory"),
        ("memry=1GB", "found 'memry', expected the name of a limit; did you mean 'memory'?"),
        ("memory", "found 'memory', expected NAME=VALUE"),
        ("memory=0", "found '0', expected a positive number for memory"),
        ("config_file=1B", "found '1B', expected a positive number for config_file"),
    ] {
        for words in [&["list"][..], &["doctor"], &["config", "show", "hopper"], &["train", "ant"]] {
            let output = with(limits, words);
            let text = stderr(&output);
            assert_eq!(output.status.code(), Some(2), "{limits} {words:?}: {text}");
            assert!(text.starts_with("error: MARATHON_LIMITS: ") && text.contains(part), "{limits} {words:?}: {text}");
        }
    }
}

#[test]
fn a_small_limit_refuses_only_what_exceeds_it() {
    for limits in ["memory=1kB", "config_file=1", "model_file=1", "clip_file=1", "recording_seconds=1", "memory=100kB"]
    {
        let commands = [&["doctor"][..], &["config", "show", "hopper"], &["config", "show", "MarathonManSteer"]];
        for words in commands {
            let output = with(limits, words);
            assert!(output.status.success(), "{limits} {words:?}: {}", stderr(&output));
        }
        let list = with(limits, &["list"]);
        let text = stderr(&list);
        match limits.starts_with("memory") {
            true => {
                assert!(text.contains("the limit 'memory' is ") && list.status.code() == Some(1), "{limits}: {text}")
            }
            false => assert!(list.status.success(), "{limits}: {text}"),
        }
    }
}
