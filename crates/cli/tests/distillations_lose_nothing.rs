//! `marathon distill` checks its output before it starts. After an interruption it resumes and writes the same bits as
//! a distillation that was never interrupted.

use crate::common::*;
use std::path::Path;
use std::time::{Duration, Instant};

/// The arguments of a distillation that would take an hour.
fn long<'a>(teacher: &'a str, out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["distill", "hopper", "--teacher", teacher, "--out", out, "--steps", "1G"], more].concat()
}

#[test]
fn what_cannot_be_kept_is_refused_before_the_first_step() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    let teacher = path.join("teacher.safetensors");
    std::fs::copy(shipped("hopper"), &teacher).unwrap();
    std::fs::create_dir(path.join("folder.safetensors")).unwrap();
    let bytes = std::fs::read(&teacher).unwrap();
    let begun = Instant::now();
    for (out, more, part) in [
        ("a.pt", &[][..], "--out is a.pt, expected a name that ends with .safetensors or .onnx"),
        ("a", &[], "--out is a, expected a name that ends with"),
        ("folder.safetensors", &[], "--out is folder.safetensors, a folder; expected a file"),
        ("none/a.safetensors", &[], "--out is none/a.safetensors, but there is no folder none"),
        ("./teacher.safetensors", &[], "--out is ./teacher.safetensors, which is also an input; expected another file"),
        ("a.safetensors", &["--lr", "nan"], "--lr is NaN, expected a positive number"),
        ("a.safetensors", &["--lr", "inf"], "--lr is inf, expected a positive number"),
        ("a.safetensors", &["--lr=-1"], "--lr is -1, expected a positive number"),
        ("a.safetensors", &["--lr", "1e60"], "--lr is 1"),
        ("a.safetensors", &["--agents", "0"], "--agents is 0, expected at least 1"),
        ("a.safetensors", &["--agents", "100000000"], "--agents asks for"),
        ("a.safetensors", &["--agents", "18446744073709551615"], "--agents asks for"),
        ("a.safetensors", &["--hidden", "100000,100000"], "--hidden asks for"),
        ("a.safetensors", &["--hidden", "70000"], "expected 1 to 65536"),
        ("a.safetensors", &["--hidden", "0"], "--hidden is [0], expected positive widths"),
    ] {
        let error = fail(path, 2, &long("teacher.safetensors", out, more));
        assert!(error.contains(part), "{out} {more:?}: {error}");
        assert_eq!(std::fs::read(&teacher).unwrap(), bytes, "{out} {more:?}");
        assert!(!path.join("a.safetensors").exists());
    }
    std::fs::copy(&teacher, path.join("start.safetensors")).unwrap();
    let initial = ["--initialize-from", "start.safetensors"];
    let error = fail(path, 2, &long("teacher.safetensors", "./start.safetensors", &initial));
    assert!(error.contains("which is also an input; expected another file"), "{error}");
    assert!(begun.elapsed() < Duration::from_secs(60), "no step is made");
    assert_no_leftovers(path);
}

/// A learning rate that is far too large stops the distillation at the first non-finite number. No unusable file is
/// left.
#[test]
fn a_rate_that_is_too_large_leaves_no_policy() {
    let temp = tempfile::tempdir().unwrap();
    let teacher = shipped("hopper");
    let error = fail(temp.path(), 2, &long(&teacher, "a.safetensors", &["--lr", "1e30", "--agents", "4"]));
    assert!(error.contains("--lr is 1") && error.contains("numbers do not stay finite"), "{error}");
    assert_eq!(files(temp.path()), Vec::<std::path::PathBuf>::new());
}

#[cfg(unix)]
#[test]
fn an_interrupted_distillation_goes_on_with_the_same_bits() {
    use std::io::{BufRead, BufReader};
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    let teacher = shipped("hopper");
    let words = |out: &'static str, seed: &'static str| {
        let own = ["distill", "hopper", "--teacher", &teacher, "--teacher", &teacher, "--out", out, "--seed", seed];
        let size = ["--steps", "3M", "--agents", "16", "--hidden", "16,16"];
        own.iter().chain(&size).map(|word| word.to_string()).collect::<Vec<_>>()
    };
    let finish = |words: Vec<String>| {
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        run(path, &words)
    };
    let mut child = marathon(path, &[]);
    child
        .args(words("parts.safetensors", "3"))
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped());
    let mut child = child.spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    // after a third of the rounds
    assert!(lines.any(|line| line.contains(" of 3,000,000 decisions")));
    let sent = std::process::Command::new("sh").args(["-c", &format!("kill -INT {}", child.id())]).status().unwrap();
    assert!(sent.success());
    let rest: Vec<String> = lines.collect();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{rest:?}");
    assert!(rest.iter().any(|line| line.contains("the same command continues")), "{rest:?}");
    let notes = path.join("parts.safetensors.unfinished");
    assert!(notes.exists());
    // the policy written so far is usable
    succeed(path, &["eval", "parts.safetensors", "--episodes", "2"]);

    // a different distillation cannot resume from this state, and a damaged file is refused
    let error = stderr(&finish(words("parts.safetensors", "4")));
    assert!(error.contains("parts.safetensors.unfinished: seed: found 3, expected 4"), "{error}");
    let whole_notes = std::fs::read(&notes).unwrap();
    let mut damaged = whole_notes.clone();
    *damaged.last_mut().unwrap() ^= 1;
    std::fs::write(&notes, damaged).unwrap();
    let error = stderr(&finish(words("parts.safetensors", "3")));
    assert!(error.contains("the file has changed since it was written"), "{error}");
    std::fs::write(&notes, whole_notes).unwrap();

    let resumed = finish([words("parts.safetensors", "3"), vec!["--threads".into(), "2".into()]].concat());
    assert!(resumed.status.success(), "{}", stderr(&resumed));
    assert!(stderr(&resumed).contains("continuing Hopper-v0"), "{}", stderr(&resumed));
    assert!(!notes.exists());
    let whole = finish(words("whole.safetensors", "3"));
    assert!(whole.status.success(), "{}", stderr(&whole));
    assert_eq!(tensors(Path::new(&path.join("parts.safetensors"))), tensors(&path.join("whole.safetensors")));
    assert_no_leftovers(path);
}
