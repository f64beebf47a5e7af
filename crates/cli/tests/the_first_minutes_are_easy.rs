//! The first minutes of a newcomer:
//!
//! - Training ends with a video, and a longer run says which schedules change.
//! - `doctor` reports the computer, and shells complete commands.
//! - The help of the game needs no game, and a misspelled task gets few names.

use crate::common::{self, SMALL, fail, json, marathon, run, succeed};

#[test]
fn training_ends_with_a_video() {
    let temp = tempfile::tempdir().unwrap();
    let args = [&SMALL[..], &["1", "--steps", "4096", "--video"]].concat();
    let text = succeed(temp.path(), &args);
    let video = std::fs::read(temp.path().join("runs/hopper-1/hopper.gif")).unwrap();
    assert!(video.starts_with(b"GIF89a") && text.contains("hopper.gif"), "{text}");
    // without a terminal there is none, and the command to make one is printed
    let args = [&SMALL[..], &["1", "--steps", "4096"]].concat();
    let text = succeed(temp.path(), &args);
    assert!(!temp.path().join("runs/hopper-2/hopper.gif").exists() && text.contains("render"), "{text}");
    // a run with a video can be resumed
    succeed(temp.path(), &["train", "--resume", "runs/hopper-1", "--steps", "8192"]);
}

#[test]
fn a_longer_run_says_which_schedules_change() {
    let temp = tempfile::tempdir().unwrap();
    succeed(temp.path(), &[&SMALL[..], &["1", "--steps", "8192"]].concat());
    let output = run(temp.path(), &["train", "--resume", "runs/hopper-1", "--steps", "16384"]);
    let text = common::stderr(&output);
    assert!(output.status.success() && text.contains("ppo.action_std.min from 0.01 to 0.2"), "{text}");
}

#[test]
fn the_doctor_reports_the_computer() {
    let temp = tempfile::tempdir().unwrap();
    let report = json(&succeed(temp.path(), &["doctor", "--json"]));
    let names: Vec<_> = report["findings"].as_array().unwrap().iter().map(|f| f["name"].as_str().unwrap()).collect();
    for name in ["processor", "instruction set", "speed", "Python", "game"] {
        assert!(names.contains(&name), "{names:?}");
    }
    // a computer without any other program still gets a report, with advice
    let output =
        marathon(temp.path(), &["doctor"]).env("PATH", "").env("MARATHON_PYTHON", "/nowhere").output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && text.contains("ffmpeg.org") && text.contains("python.org"), "{text}");
}

#[test]
fn shells_complete_the_commands() {
    let temp = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = succeed(temp.path(), &["completions", shell]);
        assert!(script.contains("train") && script.contains("doctor"), "{shell}");
    }
}

#[test]
fn the_help_of_the_game_needs_no_game() {
    let temp = tempfile::tempdir().unwrap();
    let command = temp.path().join("marathon");
    std::fs::copy(common::program(), &command).unwrap();
    let output = std::process::Command::new(&command).args(["play", "--help"]).env("PATH", "").output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && text.contains("--agents") && text.contains("Usage"), "{text}");
}

#[test]
fn a_misspelled_task_gets_five_names() {
    let temp = tempfile::tempdir().unwrap();
    let text = fail(temp.path(), 1, &["train", "hoper"]);
    assert!(text.contains("did you mean 'Hopper-v0'?") && text.len() < 250, "{text}");
}
