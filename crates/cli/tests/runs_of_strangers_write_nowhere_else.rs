//! A run's folder may come from another person. The program does not follow links in it, so nothing outside the folder
//! is written, emptied or deleted.

#![cfg(unix)]

use crate::common::*;
use std::os::unix::fs::symlink;
use std::path::Path;

fn train(folder: &Path, out: &str) {
    succeed(folder, &[&SMALL[..], &["1", "--steps", "8k", "--out", out]].concat());
}

/// The files outside the run's folder.
fn outside(temp: &Path) -> Vec<(std::path::PathBuf, Vec<u8>)> {
    let mut all = Vec::new();
    for name in ["victim.txt", "victims"] {
        let path = temp.join(name);
        let found = if path.is_dir() { files(&path) } else { vec![path] };
        all.extend(found.into_iter().map(|file| (file.clone(), std::fs::read(&file).unwrap())));
    }
    all.sort();
    all
}

#[test]
fn links_in_a_folder_are_refused_by_name() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    train(path, "mine");
    std::fs::write(path.join("victim.txt"), "precious").unwrap();
    // names that the program deletes in its own folders
    std::fs::create_dir(path.join("victims")).unwrap();
    for name in ["policy-999999999.safetensors", "state-1-12345678.safetensors", ".x.1.tmp"] {
        std::fs::write(path.join("victims").join(name), "precious").unwrap();
    }
    let before = outside(path);
    let clip = "clip.motion";
    let event = "events.out.tfevents.0000000001.marathon.0000";
    let files_of_a_run = [
        ".lock",
        "run.json",
        "progress.csv",
        "policy.safetensors",
        "summary.json",
        "curve.png",
        event,
        clip,
        ".x.2.tmp",
    ];
    let run = path.join("run");
    for (name, target) in files_of_a_run.into_iter().map(|name| (name, "victim.txt")).chain([
        ("policies", "victims"),
        ("checkpoint", "victims"),
        ("policies", "nowhere"),
        (".lock", "nowhere"),
    ]) {
        let _ = std::fs::remove_dir_all(&run);
        let copied = std::process::Command::new("cp").args(["-r", "mine", "run"]).current_dir(path).status().unwrap();
        assert!(copied.success());
        let link = run.join(name);
        if link.is_dir() {
            std::fs::remove_dir_all(&link).unwrap();
        } else {
            let _ = std::fs::remove_file(&link);
        }
        symlink(path.join(target), &link).unwrap();
        let error = fail(path, 1, &["train", "--resume", "run", "--steps", "20k"]);
        let expected =
            if name == "run.json" && target == "nowhere" { "no run.json" } else { "found a link, expected a " };
        assert!(error.contains(name) && error.contains(expected), "{name}: {error}");
        assert!(error.contains("of the run's own"), "{name}: {error}");
        assert_eq!(outside(path), before, "{name}");
        assert!(!path.join("nowhere").exists());
    }
    // a new run does not write through a linked lock file
    std::fs::create_dir(path.join("new")).unwrap();
    symlink(path.join("victim.txt"), path.join("new/.lock")).unwrap();
    let error = fail(path, 1, &[&SMALL[..], &["1", "--steps", "8k", "--out", "new"]].concat());
    assert!(error.contains("new/.lock: kind: found a link, expected a file of the run's own"), "{error}");
    assert_eq!(outside(path), before);
    // reading a pipe would block
    let made = std::process::Command::new("mkfifo").arg(path.join("mine/.lock.pipe")).status().unwrap();
    assert!(made.success());
    std::fs::rename(path.join("mine/.lock.pipe"), path.join("mine/.lock")).unwrap();
    let error = fail(path, 1, &["train", "--resume", "mine", "--steps", "20k"]);
    assert!(error.contains(".lock: kind: found a device, pipe or socket"), "{error}");
}

/// Resuming a run does not change a copy of it that consists of hard links, as backup tools make them.
#[test]
fn a_copy_by_hard_links_does_not_change() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    train(path, "a");
    let copied = std::process::Command::new("cp").args(["-al", "a", "copy"]).current_dir(path).status().unwrap();
    assert!(copied.success());
    let of = |folder: &str| {
        let mut all: Vec<_> =
            files(&path.join(folder)).into_iter().map(|file| (file.clone(), std::fs::read(&file).unwrap())).collect();
        all.sort();
        all
    };
    let before = of("copy");
    succeed(path, &["train", "--resume", "a", "--steps", "16k"]);
    assert_eq!(of("copy"), before);
}

/// A linked lock file keeps its content.
#[test]
fn a_refused_resume_changes_nothing() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    train(path, "a");
    std::fs::write(path.join("a/.lock"), "precious").unwrap();
    let error = fail(path, 2, &["train", "--resume", "a", "--steps", "4096"]);
    assert!(error.contains("but 8,192 steps are done"), "{error}");
    assert_eq!(std::fs::read(path.join("a/.lock")).unwrap(), b"precious");
}
