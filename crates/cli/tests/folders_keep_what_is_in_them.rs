//! Training uses a new or empty folder, and never overwrites or deletes other files. A failed start leaves everything
//! as it was, so that the corrected command works.

use crate::common::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// All files under a folder with their contents.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    files(folder).into_iter().map(|path| (path.clone(), std::fs::read(path).unwrap())).collect()
}

fn train(out: &str) -> Vec<&str> {
    [&SMALL[..], &["1", "--steps", "8k", "--out", out]].concat()
}

#[test]
fn a_folder_of_something_else_is_refused_and_stays_whole() {
    for (name, found) in [
        ("events.out.tfevents.1700000000.host.1", "'events.out.tfevents.1700000000.host.1'"),
        ("policies/policy-100.safetensors", "'policies'"),
        ("notes.txt", "'notes.txt'"),
        (".hidden", "'.hidden'"),
        (".precious.tmp", "'.precious.tmp'"),
        ("run.json", "'run.json'"),
        ("progress.csv", "'progress.csv'"),
        ("checkpoint/mine", "'checkpoint'"),
    ] {
        let temp = tempfile::tempdir().unwrap();
        let file = temp.path().join("a").join(name);
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        std::fs::write(&file, "precious").unwrap();
        let before = contents(temp.path());
        let text = fail(temp.path(), 2, &train("a"));
        assert!(text.contains("--out a holds") && text.contains(found), "{text}");
        assert!(text.contains("expected a new or empty folder"), "{text}");
        assert_eq!(contents(temp.path()), before);
    }
    // what is not a folder
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("a"), "precious").unwrap();
    let text = fail(temp.path(), 2, &train("a"));
    assert!(text.contains("--out is a: found a file, expected a folder"), "{text}");
    assert_eq!(std::fs::read(temp.path().join("a")).unwrap(), b"precious");
}

#[test]
fn new_and_empty_folders_are_taken() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::create_dir(temp.path().join("empty")).unwrap();
    for out in ["empty", "new", "deep/er/new", "new/"] {
        if out == "new/" {
            let text = fail(temp.path(), 2, &train(out));
            assert!(text.contains("--out new/ already holds a run"), "{text}");
        } else {
            succeed(temp.path(), &train(out));
        }
    }
}

#[test]
fn a_failed_start_leaves_nothing() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    let refused = ["train", "hopper", "--algo", "sac", "--processes", "2", "--out", "deep/a"];
    let text = fail(path, 2, &refused);
    assert!(text.contains("--processes is 2, expected 0 with sac"), "{text}");
    assert_eq!(std::fs::read_dir(path).unwrap().count(), 0, "{:?}", files(path));
    fail(path, 2, &refused[..6]);
    assert_eq!(std::fs::read_dir(path).unwrap().count(), 0, "{:?}", files(path));
    // an existing folder stays
    std::fs::create_dir(path.join("mine")).unwrap();
    fail(path, 2, &[&refused[..6], &["--out", "mine"]].concat());
    assert_eq!(std::fs::read_dir(path.join("mine")).unwrap().count(), 0);

    // the corrected command
    succeed(path, &train("deep/a"));
    succeed(path, &train("mine"));
}

/// A start killed before it wrote its description leaves temporary files, which do not block a new run.
#[test]
fn a_start_that_was_killed_early_does_not_block_the_same_command() {
    let temp = tempfile::tempdir().unwrap();
    let run = temp.path().join("a");
    std::fs::create_dir(&run).unwrap();
    for (name, content) in [(".lock", ""), (".x.1.tmp", ""), (".0123456789abcdef-0.4711.tmp", "{\"format\"")] {
        std::fs::write(run.join(name), content).unwrap();
    }
    succeed(temp.path(), &train("a"));
    assert_no_leftovers(&run);
    // similar names belong to the user
    for name in [".precious.tmp", ".1.tmp", ".x.1a.tmp", "x.1.tmp", ".x..tmp"] {
        let folder = temp.path().join("b");
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join(name), "precious").unwrap();
        let text = fail(temp.path(), 2, &train("b"));
        assert!(text.contains(&format!("--out b holds '{name}'")), "{text}");
        assert_eq!(std::fs::read(folder.join(name)).unwrap(), b"precious");
        std::fs::remove_file(folder.join(name)).unwrap();
    }
}

/// More memory than available, by a limit or by numbers that no computer has.
#[cfg(target_os = "linux")]
#[test]
fn a_run_that_does_not_fit_into_memory_is_an_error_and_leaves_nothing() {
    let temp = tempfile::tempdir().unwrap();
    let wide = "
behaviors:
  Hopper:
    trainer_type: ppo
    network_settings: { hidden_units: 65536, num_layers: 2 }
";
    std::fs::write(temp.path().join("wide.yaml"), wide).unwrap();
    let limited = ["train", "hopper", "--agents", "65536", "--steps", "1", "--threads", "1", "--out", "a"];
    for (limit, words, part) in [
        ("-v 800000", &limited[..], "fewer agents (now 65536)"),
        (
            "-v unlimited",
            &["train", "hopper", "--config", "wide.yaml", "--out", "a"],
            "narrower networks (now [65536, 65536]",
        ),
    ] {
        let mut shell = std::process::Command::new("bash");
        let script = format!("ulimit {limit}; exec \"$0\" \"$@\"");
        let output = shell.args(["-c", &script, program()]).args(words).current_dir(temp.path()).output().unwrap();
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{text}");
        assert!(text.contains("GB of memory, more than is available") && text.contains(part), "{text}");
        assert!(!temp.path().join("a").exists());
    }
    succeed(temp.path(), &train("a"));
}

/// A program that could not clean up, such as one killed before its first iteration, does not block a new run either.
#[test]
fn a_run_without_an_iteration_is_begun_anew() {
    let temp = tempfile::tempdir().unwrap();
    let run = temp.path().join("a");
    succeed(temp.path(), &train("whole"));
    succeed(temp.path(), &train("a"));
    for name in ["policy.safetensors", "summary.json", "curve.png", "checkpoint/checkpoint.json"] {
        std::fs::remove_file(run.join(name)).unwrap();
    }
    let rows = std::fs::read_to_string(run.join("progress.csv")).unwrap();
    let text = fail(temp.path(), 2, &train("a"));
    assert!(text.contains("--out a already holds a run"), "the rows are worth something: {text}");

    std::fs::remove_dir_all(run.join("checkpoint")).unwrap();
    std::fs::write(run.join("progress.csv"), &rows[..=rows.find('\n').unwrap()]).unwrap();
    std::fs::write(run.join(".policy.safetensors.77.tmp"), "half").unwrap();
    let lock = std::fs::File::create(run.join(".lock")).unwrap();
    lock.lock().unwrap();
    let text = fail(temp.path(), 1, &train("a"));
    assert!(text.contains("a: run: found another process"), "{text}");
    drop(lock);

    succeed(temp.path(), &train("a"));
    assert_no_leftovers(&run);
    assert_eq!(event_files(&run).len(), 1);
    let [whole, anew] = ["whole", "a"].map(|run| timeless_rows(&temp.path().join(run).join("progress.csv")));
    assert_eq!(whole, anew);
}
