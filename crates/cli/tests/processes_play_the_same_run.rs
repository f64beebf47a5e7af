//! A run whose rollouts are played by processes has the bits of one that plays them itself, for any number of
//! processes. The processes end with the run. If a process dies, the run ends within seconds and can be resumed with
//! the same bits. Runs that processes cannot play are refused before anything is written.

use crate::common::*;

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
    // four blocks of agents: at most four processes have work
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

/// A process is killed at some moment, or while the other one cannot send its answer. The learner sees both as dead.
#[cfg(target_os = "linux")]
#[test]
fn a_killed_process_ends_the_run_which_goes_on_with_the_same_bits() {
    use std::io::Read;
    use std::process::Stdio;
    use std::time::{Duration, Instant};

    let temp = tempfile::tempdir().unwrap();
    let path = temp.path();
    let words = |out: &'static str| [&SMALL[..], &["7", "--steps", "300k", "--threads", "1", "--out", out]].concat();
    succeed(path, &words("whole"));
    let policy = |run: &str| tensors(&path.join(run).join("policy.safetensors"));

    for (out, victim, freeze) in [("a", 0, false), ("b", 1, false), ("c", 0, true), ("d", 0, true)] {
        let mut learner = marathon(path, &[&words(out)[..], &["--processes", "2"]].concat());
        let mut learner = learner.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        wait_for_lines(&path.join(out).join("progress.csv"), 4);
        let players = children(learner.id());
        assert_eq!(players.len(), 2, "{out}: {players:?}");
        if freeze {
            // the other one fills its pipe meanwhile
            signal("STOP", players[victim]);
            std::thread::sleep(Duration::from_millis(300));
        }
        signal("KILL", players[victim]);
        let killed = Instant::now();
        let status = loop {
            if let Some(status) = learner.try_wait().unwrap() {
                break status;
            }
            if killed.elapsed() > Duration::from_secs(5) {
                players.iter().filter(|id| alive(**id)).for_each(|id| signal("KILL", *id));
                learner.kill().unwrap();
                panic!("{out}: the learner waits for ever");
            }
            std::thread::sleep(Duration::from_millis(5));
        };
        let mut text = String::new();
        learner.stderr.take().unwrap().read_to_string(&mut text).unwrap();
        assert_eq!(status.code(), Some(1), "{out}: {text}");
        assert!(text.contains("of 2, which plays, has ended"), "{text}");
        assert!(text.contains(&format!("continue with `{} train --resume {out}`", program())), "{text}");
        assert!(!text.contains("panicked"), "{text}");
        assert!(players.iter().all(|id| !alive(*id)), "{out}: a player outlives the learner");

        succeed(path, &["train", "--resume", out, "--processes", "2"]);
        assert_eq!(policy(out), policy("whole"), "{out}");
    }
}

/// The child processes of a process, in the order of their start.
#[cfg(target_os = "linux")]
fn children(parent: u32) -> Vec<u32> {
    let of = |entry: std::io::Result<std::fs::DirEntry>| {
        let id: u32 = entry.ok()?.file_name().to_str()?.parse().ok()?;
        let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).ok()?;
        // the name before it may contain anything
        let fields = stat.rsplit_once(')')?.1;
        (fields.split_whitespace().nth(1)? == parent.to_string()).then_some(id)
    };
    let mut all: Vec<u32> = std::fs::read_dir("/proc").unwrap().filter_map(of).collect();
    all.sort();
    all
}

#[cfg(target_os = "linux")]
fn alive(id: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
    stat.contains("(marathon)") && !stat.contains(") Z ")
}

#[cfg(target_os = "linux")]
fn signal(name: &str, id: u32) {
    let sent = std::process::Command::new("sh").args(["-c", &format!("kill -{name} {id}")]).status().unwrap();
    assert!(sent.success());
}
