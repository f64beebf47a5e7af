//! A run whose rollouts are played by processes has the bits of one that plays them itself, whatever their number; they
//! leave with it. What cannot be played elsewhere is refused before anything is written.

mod common;

use common::*;

#[test]
fn processes_change_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let train = |out: &str, more: &[&str]| {
        let words = [&SMALL[..], &["7", "--steps", "20k", "--out", out], more].concat();
        succeed(folder.path(), &words);
        tensors(&folder.path().join(out).join("policy.safetensors"))
    };
    let alone = train("alone", &[]);
    assert_eq!(train("two", &["--processes", "2"]), alone);
    // four blocks of agents: no more than four processes have work
    assert_eq!(train("many", &["--processes", "9", "--threads", "2"]), alone);
}

#[test]
fn a_resumed_run_can_have_processes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    succeed(path, &[&SMALL[..], &["7", "--steps", "8k", "--out", "short"]].concat());
    succeed(path, &["train", "--resume", "short", "--steps", "20k", "--processes", "2"]);
    succeed(path, &[&SMALL[..], &["7", "--steps", "8k", "--out", "other"]].concat());
    succeed(path, &["train", "--resume", "other", "--steps", "20k"]);
    let policy = |run: &str| tensors(&path.join(run).join("policy.safetensors"));
    assert_eq!(policy("short"), policy("other"));
}

#[test]
fn sac_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let error = fail(folder.path(), 2, &["train", "hopper", "--algo", "sac", "--processes", "2", "--out", "x"]);
    assert!(error.contains("--processes is 2, expected 0 with sac"), "{error}");
}
