//! Names of files and folders that are not UTF-8, or contain quotes and spaces, work everywhere. JSON shows replacement
//! characters for their invalid bytes.

#![cfg(target_os = "linux")]

use crate::common::*;
use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::process::{Command, Output};

/// A name that is not UTF-8.
fn odd(ending: &str) -> OsString {
    OsStr::from_bytes(&[b"it's \xff ", ending.as_bytes()].concat()).into()
}

fn call(folder: &Path, words: &[&OsStr]) -> Output {
    let output = marathon(folder, &[]).args(words).output().unwrap();
    assert!(!stderr(&output).contains("panicked"), "{words:?}: {}", stderr(&output));
    output
}

fn works(folder: &Path, words: &[&OsStr]) -> String {
    let output = call(folder, words);
    assert!(output.status.success(), "{words:?}: {}", stderr(&output));
    String::from_utf8(output.stdout).expect("stdout is text")
}

#[test]
fn every_command_takes_any_path() {
    let temp = tempfile::tempdir().unwrap();
    let (path, run) = (temp.path(), odd("run"));
    fn text(words: &[&'static str]) -> Vec<&'static OsStr> {
        words.iter().map(|word| OsStr::new(*word)).collect()
    }
    let mut train: Vec<&OsStr> = text(&SMALL);
    train.extend([OsStr::new("1"), OsStr::new("--steps"), OsStr::new("8k"), OsStr::new("--out"), &run]);
    train.push(OsStr::new("--json"));
    let summary = json(&works(path, &train));
    assert_eq!(summary["folder"], "it's \u{fffd} run");
    assert_eq!(read_json(&path.join(&run).join("summary.json")), summary);

    let resume = [OsStr::new("train"), OsStr::new("--resume"), &run, OsStr::new("--steps"), OsStr::new("12,288")];
    works(path, &resume);
    let again = call(path, &resume);
    assert_eq!(again.status.code(), Some(2), "complete: {}", stderr(&again));
    assert_eq!(
        json(&works(path, &[&text(&["eval", "--json", "--episodes", "2"])[..], &[&run]].concat()))["episodes"],
        2
    );
    works(path, &[&text(&["eval", "--episodes", "2"])[..], &[&run]].concat());

    for (command, ending) in [("export", ".onnx"), ("render", ".gif"), ("render", ".png"), ("record-demo", ".demo")] {
        for json_too in [true, false] {
            let out = odd(ending);
            let mut words = vec![OsStr::new(command), &run, OsStr::new("--out"), &out];
            match command {
                "render" => words.extend(text(&["--seconds", "0.1", "--width", "32"])),
                "record-demo" => words.extend(text(&["--episodes", "1"])),
                _ => {}
            }
            if json_too {
                words.push(OsStr::new("--json"));
            }
            let said = works(path, &words);
            assert!(path.join(&out).is_file(), "{words:?}");
            if json_too {
                assert_eq!(json(&said)["out"], format!("it's \u{fffd} {ending}"));
            }
            std::fs::rename(path.join(&out), path.join(format!("x{ending}"))).unwrap();
        }
    }
    let (network, out) = (odd("net.onnx"), odd("net.safetensors"));
    std::fs::copy(path.join("x.onnx"), path.join(&network)).unwrap();
    works(path, &[OsStr::new("import"), &network, OsStr::new("--json")]);
    assert!(path.join(out).is_file());
    assert_no_leftovers(path);
}

/// The command that an interrupted run prints can be pasted, whatever the name of the folder.
#[test]
fn printed_commands_can_be_pasted() {
    let temp = tempfile::tempdir().unwrap();
    let run = odd("run");
    let mut words: Vec<&OsStr> = SMALL.iter().map(OsStr::new).collect();
    words.extend([OsStr::new("1"), OsStr::new("--steps"), OsStr::new("300k"), OsStr::new("--out"), &run]);
    let child = marathon(temp.path(), &[]).args(&words).stderr(std::process::Stdio::piped()).spawn().unwrap();
    wait_for_lines(&temp.path().join(&run).join("progress.csv"), 3);
    let sent = Command::new("sh").args(["-c", &format!("kill -INT {}", child.id())]).status().unwrap();
    assert!(sent.success());
    let output = child.wait_with_output().unwrap();
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(130), "{text}");
    let command = text.rsplit_once("continue with `").and_then(|(_, rest)| rest.split_once('`')).expect("a command").0;
    let pasted = Command::new("bash").args(["-c", command]).current_dir(temp.path()).output().unwrap();
    assert!(pasted.status.success(), "{command}: {}", stderr(&pasted));
}
