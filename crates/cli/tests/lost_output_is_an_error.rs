//! A result that cannot be written to stdout is an error, like one that cannot be written to a file. A reader that
//! closes the pipe is not an error.

#![cfg(target_os = "linux")]

use crate::common::*;
use std::path::Path;
use std::process::{Command, Output};

fn shell(folder: &Path, script: &str) -> Output {
    Command::new("bash").args(["-c", script, program()]).current_dir(folder).output().unwrap()
}

#[test]
fn a_full_disk_behind_stdout_is_an_error() {
    let temp = tempfile::tempdir().unwrap();
    succeed(temp.path(), &[&SMALL[..], &["1", "--steps", "8k", "--out", "a"]].concat());
    for words in [
        "list",
        "list --json",
        "--help",
        "--version",
        "train --help",
        "eval a --episodes 2",
        "eval a --episodes 2 --json",
        "export a --json",
        "train hoper --json",
        "completions bash",
    ] {
        let output = shell(temp.path(), &format!("\"$0\" {words} > /dev/full"));
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{words}: {text}");
        assert!(text.contains("error: stdout: write: No space left on device"), "{words}: {text}");
        assert!(!text.contains("panicked"), "{words}: {text}");
    }
    // the written file is complete
    succeed(temp.path(), &["eval", "a/policy.onnx", "--episodes", "1"]);
}

#[test]
fn a_reader_that_leaves_is_none() {
    let temp = tempfile::tempdir().unwrap();
    for words in ["list", "list --json", "--help"] {
        let output = shell(temp.path(), &format!("\"$0\" {words} | true; exit ${{PIPESTATUS[0]}}"));
        assert!(output.status.success(), "{words}: {}", stderr(&output));
        assert!(output.stderr.is_empty(), "{words}: {}", stderr(&output));
    }
}
