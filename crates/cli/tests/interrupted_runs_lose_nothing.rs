//! A resumed run ends with the bits of an uninterrupted run, and with its rows and events.

#![cfg(unix)]

use crate::common;
use crate::common::*;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

const STEPS: &str = "400k";

fn start(folder: &Path, args: &[&str]) -> Child {
    marathon(folder, args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the command starts")
}

fn interrupt(child: &Child) {
    signal("INT", child);
}

fn signal(name: &str, child: &Child) {
    let sent = Command::new("sh").args(["-c", &format!("kill -{name} {}", child.id())]).status().expect("sh runs");
    assert!(sent.success());
}

fn finish(child: Child) -> Output {
    child.wait_with_output().expect("the command ends")
}

/// Steps and values of every scalar of a run over all its files, without times.
fn events(run: &Path) -> Vec<(u64, String, u32)> {
    let mut all = Vec::new();
    for path in event_files(run) {
        let bytes = std::fs::read(&path).unwrap();
        let mut rest = &bytes[..];
        while let Some((length, after)) = rest.split_first_chunk::<8>() {
            let (event, after) = after[4..].split_at(u64::from_le_bytes(*length) as usize);
            rest = &after[4..];
            let fields = fields(event);
            let step = fields.iter().find(|f| f.0 == 2).map_or(0, |f| f.1);
            for (_, _, summary) in fields.iter().filter(|f| f.0 == 5) {
                for (_, _, value) in self::fields(summary) {
                    let value = self::fields(value);
                    let tag = String::from_utf8(value[0].2.to_vec()).unwrap();
                    if !tag.contains("Second") {
                        all.push((step, tag, value[1].1 as u32));
                    }
                }
            }
        }
    }
    all
}

/// Fields of a protocol buffer message: number, value, bytes.
fn fields(mut message: &[u8]) -> Vec<(u64, u64, &[u8])> {
    fn varint(bytes: &mut &[u8]) -> u64 {
        let (mut x, mut shift) = (0, 0);
        loop {
            let byte = bytes[0];
            *bytes = &bytes[1..];
            x |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return x;
            }
            shift += 7;
        }
    }
    let mut all = Vec::new();
    while !message.is_empty() {
        let key = varint(&mut message);
        let (value, length) = match key & 7 {
            0 => (varint(&mut message), 0),
            1 => (u64::from_le_bytes(message[..8].try_into().unwrap()), 8),
            2 => (0, varint(&mut message) as usize),
            5 => (u64::from(u32::from_le_bytes(message[..4].try_into().unwrap())), 4),
            kind => panic!("wire type {kind}"),
        };
        let (bytes, after) = message.split_at(length);
        message = after;
        all.push((key >> 3, value, bytes));
    }
    all
}

#[test]
fn a_resumed_run_equals_one_never_interrupted() {
    let temp = tempfile::tempdir().unwrap();
    let args = |out: &'static str| [&SMALL[..], &["5", "--steps", STEPS, "--out", out]].concat();
    succeed(temp.path(), &args("whole"));

    // interrupted after some iterations, resumed, interrupted again, resumed
    let run = temp.path().join("parts");
    let child = start(temp.path(), &[&args("parts")[..], &["--json"]].concat());
    wait_for_lines(&run.join("progress.csv"), 8);
    interrupt(&child);
    let output = finish(child);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(130), "{text}");
    assert!(text.contains("train --resume parts"), "{text}");
    assert!(text.contains("Ctrl-C again"), "{text}");
    let summary = json(&String::from_utf8(output.stdout).unwrap());
    assert_eq!((&summary["interrupted"], &summary["eval"]), (&true.into(), &serde_json::Value::Null));
    assert_eq!(summary, read_json(&run.join("summary.json")));
    let steps = summary["steps"].as_u64().unwrap();
    assert!(steps < 400_000, "it was interrupted after {steps} steps");
    // the files so far are usable
    assert_no_leftovers(&run);
    succeed(temp.path(), &["eval", "parts", "--episodes", "2"]);

    let rows = timeless_rows(&run.join("progress.csv")).len();
    assert_eq!(rows as u64, 1 + steps / 4096);
    let child = start(temp.path(), &["train", "--resume", "parts", "--threads", "1"]);
    wait_for_lines(&run.join("progress.csv"), rows + 5);
    interrupt(&child);
    assert_eq!(finish(child).status.code(), Some(130));
    // rows and events beyond the checkpoint, as a killed process leaves them
    let mut table = std::fs::read_to_string(run.join("progress.csv")).unwrap();
    let last = table.lines().last().unwrap().split_once(',').unwrap();
    let next = format!("{},{}\n1", last.0.parse::<u64>().unwrap() + 1, last.1);
    table.push_str(&next);
    std::fs::write(run.join("progress.csv"), table).unwrap();
    let events_file = event_files(&run).pop().unwrap();
    let mut bytes = std::fs::read(&events_file).unwrap();
    bytes.extend([1, 2, 3]);
    std::fs::write(&events_file, bytes).unwrap();

    succeed(temp.path(), &["train", "hopper", "--resume", "parts", "--threads", "2"]);
    let whole = temp.path().join("whole");
    assert_eq!(tensors(&run.join("policy.safetensors")), tensors(&whole.join("policy.safetensors")));
    assert_eq!(timeless_rows(&run.join("progress.csv")), timeless_rows(&whole.join("progress.csv")));
    assert_eq!(events(&run), events(&whole));
    assert!(!events(&run).is_empty());
    let eval = |run: &Path| read_json(&run.join("summary.json"))["eval"].clone();
    assert_eq!(eval(&run), eval(&whole));
}

#[test]
fn a_complete_run_goes_on_with_more_steps_only() {
    let temp = tempfile::tempdir().unwrap();
    succeed(temp.path(), &[&SMALL[..], &["5", "--steps", "20k"]].concat());
    let text = fail(temp.path(), 2, &["train", "--resume", "runs/hopper-1"]);
    assert!(text.contains("the run is complete with 20,480 steps") && text.contains("--steps 40,960"), "{text}");
    let text = fail(temp.path(), 2, &["train", "--resume", "runs/hopper-1", "--steps", "8192"]);
    assert!(text.contains("--steps is 8,192, but 20,480 steps are done"), "{text}");
    let text = fail(temp.path(), 1, &["train", "ant", "--resume", "runs/hopper-1", "--steps", "40k"]);
    assert!(text.contains("found Hopper-v0, expected Ant-v0"), "{text}");

    succeed(temp.path(), &["train", "--resume", "runs/hopper-1", "--steps", "40,960"]);
    let rows = timeless_rows(&temp.path().join("runs/hopper-1/progress.csv"));
    let iterations: Vec<&str> = rows[1..].iter().map(|row| row[0].as_str()).collect();
    assert_eq!(iterations, ["1", "2", "3", "4", "5", "6", "7", "8", "9", "10"]);
    assert_eq!(read_json(&temp.path().join("runs/hopper-1/summary.json"))["steps"], 40_960);
}

/// A run that was killed between its last checkpoint and its summary is not complete. The same command finishes it.
#[test]
fn a_run_killed_at_its_end_is_finished_by_the_same_command() {
    let temp = tempfile::tempdir().unwrap();
    let run = temp.path().join("a");
    succeed(temp.path(), &[&SMALL[..], &["5", "--steps", "20k", "--out", "a"]].concat());
    let early = ["summary.json", "curve.png"].map(|name| (name, std::fs::read(run.join(name)).unwrap()));
    let extend = ["train", "--resume", "a", "--steps", "40,960"];
    succeed(temp.path(), &extend);
    let (whole, policy) = (read_json(&run.join("summary.json")), tensors(&run.join("policy.safetensors")));
    assert_eq!(whole["steps"], 40_960);

    // the state after a kill that follows the checkpoint
    early.iter().for_each(|(name, bytes)| std::fs::write(run.join(name), bytes).unwrap());
    succeed(temp.path(), &extend);
    assert_eq!(read_json(&run.join("summary.json")), whole);
    assert_eq!(tensors(&run.join("policy.safetensors")), policy);
    // before the curve was drawn
    std::fs::remove_file(run.join("curve.png")).unwrap();
    succeed(temp.path(), &["train", "--resume", "a"]);
    assert!(run.join("curve.png").is_file());
    let text = fail(temp.path(), 2, &extend);
    assert!(text.contains("the run is complete with 40,960 steps"), "{text}");
}

/// The end of a run reports agents whose simulation became non-finite, including those of the run's earlier parts.
#[test]
fn breakdowns_are_counted_over_all_parts() {
    let temp = tempfile::tempdir().unwrap();
    let run = temp.path().join("a");
    let output = common::run(temp.path(), &[&SMALL[..], &["5", "--steps", "20k", "--out", "a"]].concat());
    assert!(!stderr(&output).contains("broke down"), "{}", stderr(&output));
    assert_eq!(read_json(&run.join("summary.json"))["diverged"], 0);

    // no user action makes these agents fail, so a row says that three did
    let rows = std::fs::read_to_string(run.join("progress.csv")).unwrap();
    let column = rows.lines().next().unwrap().split(',').position(|name| name == "diverged").unwrap();
    let marked = |(i, row): (usize, &str)| {
        let mut cells: Vec<&str> = row.split(',').collect();
        if i == 2 {
            cells[column] = "3";
        }
        cells.join(",") + "\n"
    };
    std::fs::write(run.join("progress.csv"), rows.lines().enumerate().map(marked).collect::<String>()).unwrap();
    let output = common::run(temp.path(), &["train", "--resume", "a", "--steps", "30k"]);
    assert!(stderr(&output).contains("note: 3 times the simulation of an agent broke down"), "{}", stderr(&output));
    assert_eq!(read_json(&run.join("summary.json"))["diverged"], 3);
}

#[test]
fn a_second_interruption_ends_at_once_and_breaks_nothing() {
    let temp = tempfile::tempdir().unwrap();
    // half a million steps on one thread take long enough for two signals
    let args = ["train", "hopper", "--agents", "8192", "--threads", "1", "--steps", "100M", "--out", "a"];
    let mut child = start(temp.path(), &args);
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    assert!(lines.any(|line| line.starts_with("training Hopper-v0")), "it listens to signals before it says so");
    interrupt(&child);
    assert!(lines.any(|line| line.contains("Ctrl-C again")));
    interrupt(&child);
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(lines.any(|line| line == "aborted"));
    // nothing was learned yet, so it starts again
    assert!(!temp.path().join("a/policy.safetensors").exists());
    assert_no_leftovers(&temp.path().join("a"));
    succeed(temp.path(), &["train", "--resume", "a", "--steps", "500k"]);
    assert_eq!(timeless_rows(&temp.path().join("a/progress.csv"))[1][0], "1");
}

/// `nohup` makes a command ignore the end of its terminal. The command keeps ignoring it.
#[test]
fn an_ignored_hangup_stays_ignored() {
    let temp = tempfile::tempdir().unwrap();
    let mut shell = Command::new("bash");
    shell.args(["-c", "trap '' HUP; exec \"$0\" \"$@\"", program()]).args(SMALL);
    shell.args(["5", "--steps", "200k", "--out", "a"]).current_dir(temp.path());
    let child = shell.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    wait_for_lines(&temp.path().join("a/progress.csv"), 3);
    signal("HUP", &child);
    let output = finish(child);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(read_json(&temp.path().join("a/summary.json"))["interrupted"], false);
    if ignores_hangups() {
        return;
    }
    // without `nohup`, the signal ends a run normally
    let child = start(temp.path(), &[&SMALL[..], &["5", "--steps", "10M", "--out", "c"]].concat());
    wait_for_lines(&temp.path().join("c/progress.csv"), 3);
    signal("HUP", &child);
    assert_eq!(finish(child).status.code(), Some(130));
}

/// Whether the tests were started with hangups ignored.
fn ignores_hangups() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    ignored.is_some_and(|mask| u64::from_str_radix(mask.trim(), 16).is_ok_and(|mask| mask & 1 == 1))
}

/// A small run whose events need more space than its other files, with a checkpoint every few iterations.
const TINY: &str = "
behaviors:
  Hopper:
    trainer_type: ppo
    hyperparameters: { batch_size: 256, buffer_size: 256, learning_rate: 3.0e-4, num_epoch: 1 }
    network_settings: { hidden_units: 8, num_layers: 1, normalize: true }
    max_steps: 60000
    summary_freq: 20000
    checkpoint_interval: 2560
    keep_checkpoints: 3
";

/// A row or event that could not be written is written when the iteration is repeated.
#[test]
fn a_full_disk_loses_no_row_and_no_event() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("tiny.yaml"), TINY).unwrap();
    let words = |out: &'static str| ["train", "hopper", "--config", "tiny.yaml", "--out", out];
    succeed(temp.path(), &words("whole"));
    let (whole, run) = (temp.path().join("whole"), temp.path().join("a"));
    let length = |path: &Path| std::fs::metadata(path).unwrap().len();
    let grows = |path: &Path| path.ends_with("progress.csv") || path.to_string_lossy().contains("tfevents");
    let largest = files(&whole).iter().filter(|path| !grows(path)).map(|path| length(path)).max().unwrap();
    let events_file = event_files(&whole).remove(0);
    let limit = largest / 1024 + 3;
    assert!(length(&events_file) > (limit + 4) * 1024, "the events are what fills the disk");

    let script = format!("trap '' XFSZ; ulimit -f {limit}; exec \"$0\" \"$@\"");
    let mut shell = Command::new("bash");
    let output = shell.args(["-c", &script, program()]).args(words("a")).current_dir(temp.path()).output().unwrap();
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("write: File too large") && text.contains("the last complete checkpoint has"), "{text}");
    succeed(temp.path(), &["train", "--resume", "a"]);
    assert_eq!(timeless_rows(&run.join("progress.csv")), timeless_rows(&whole.join("progress.csv")));
    assert_eq!(events(&run), events(&whole));
    assert_eq!(tensors(&run.join("policy.safetensors")), tensors(&whole.join("policy.safetensors")));
}

/// A run that was killed at any moment has the intermediate policies of its checkpoint, and in the end those of a run
/// that was never killed.
#[test]
fn a_kill_loses_no_policy_on_the_way() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("tiny.yaml"), TINY.replace("2560", "1")).unwrap();
    let run = temp.path().join("a");
    let kept = |run: &Path| {
        let mut names: Vec<_> =
            files(&run.join("policies")).iter().map(|f| f.file_name().unwrap().to_owned()).collect();
        names.sort();
        names
    };
    let mut first = true;
    for _ in 0..12 {
        let words = ["train", "hopper", "--config", "tiny.yaml", "--out", "a"];
        let mut child = start(temp.path(), if first { &words } else { &["train", "--resume", "a"] });
        let rows = || std::fs::read_to_string(run.join("progress.csv")).unwrap_or_default().lines().count();
        // resuming cuts rows first, so what counts is that there are more than before
        let before = if first { 1 } else { rows() };
        first = false;
        wait_for_lines(&run.join("progress.csv"), before + 6);
        child.kill().unwrap();
        child.wait().unwrap();
        let checkpoint = read_json(&run.join("checkpoint/checkpoint.json"))["steps"].clone();
        assert!(
            run.join(format!("policies/policy-{checkpoint}.safetensors")).is_file(),
            "{checkpoint}: {:?}",
            kept(&run)
        );
    }
    // the state after a kill before the old ones are removed, or before the checkpoint
    let newest = files(&run.join("policies")).pop().unwrap();
    for more in ["policy-1.safetensors", "policy-59999999.safetensors"] {
        std::fs::copy(&newest, run.join("policies").join(more)).unwrap();
    }
    succeed(temp.path(), &["train", "--resume", "a"]);
    succeed(temp.path(), &["train", "hopper", "--config", "tiny.yaml", "--out", "whole"]);
    assert_eq!(kept(&run), kept(&temp.path().join("whole")));
    assert_eq!(kept(&run).len(), 3);
}

/// If an intermediate policy could not be written, repeating the iteration writes it.
#[test]
fn a_policy_on_the_way_that_failed_is_written_again() {
    let temp = tempfile::tempdir().unwrap();
    std::fs::write(temp.path().join("tiny.yaml"), TINY).unwrap();
    let policies = |run: &str| {
        let mut all: Vec<_> = files(&temp.path().join(run).join("policies"))
            .iter()
            .map(|path| (path.file_name().unwrap().to_owned(), tensors(path)))
            .collect();
        all.sort();
        all
    };
    for run in ["whole", "a"] {
        succeed(temp.path(), &["train", "hopper", "--config", "tiny.yaml", "--steps", "2560", "--out", run]);
    }
    succeed(temp.path(), &["train", "--resume", "whole", "--steps", "9000"]);
    // a folder has the name of the policy file
    let in_the_way = temp.path().join("a/policies/policy-5120.safetensors");
    std::fs::create_dir(&in_the_way).unwrap();
    let text = fail(temp.path(), 1, &["train", "--resume", "a", "--steps", "9000"]);
    assert!(text.contains("policy-5120.safetensors: write") && text.contains("checkpoint has 2,560 of"), "{text}");
    std::fs::remove_dir(&in_the_way).unwrap();
    succeed(temp.path(), &["train", "--resume", "a", "--steps", "9000"]);
    assert_eq!(policies("a"), policies("whole"));
    assert_eq!(policies("a").len(), 3);
    let table = |run: &str| timeless_rows(&temp.path().join(run).join("progress.csv"));
    assert_eq!(table("a"), table("whole"));
}

/// A full disk, imitated by a limit on the size of files.
#[test]
fn a_full_disk_stops_the_run_and_keeps_the_last_checkpoint() {
    let temp = tempfile::tempdir().unwrap();
    let run = temp.path().join("a");
    succeed(temp.path(), &[&SMALL[..], &["5", "--steps", "40k", "--out", "a"]].concat());
    let before = tensors(&run.join("policy.safetensors"));

    // blocks of 1024 bytes: less than the policy and the checkpoint need
    let script = "trap '' XFSZ; ulimit -f 12; exec \"$0\" train --resume a --steps 400k";
    let command = |script: &str| {
        let mut shell = Command::new("bash");
        shell.args(["-c", script, env!("CARGO_BIN_EXE_marathon")]).current_dir(temp.path());
        shell.output().expect("bash runs")
    };
    let output = command(script);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    // the table or the events, whichever reaches the limit first
    assert!(text.contains("error: a/") && text.contains(": write: File too large"), "{text}");
    assert!(text.contains("the last complete checkpoint has 40,960") && text.contains("train --resume a"), "{text}");
    assert_eq!(tensors(&run.join("policy.safetensors")), before, "the old policy is whole");
    assert_no_leftovers(&run);

    // with free space it continues, and nothing is missing
    succeed(temp.path(), &["train", "--resume", "a", "--steps", "80k"]);
    let rows = timeless_rows(&run.join("progress.csv"));
    let iterations: Vec<String> = rows[1..].iter().map(|row| row[0].clone()).collect();
    assert_eq!(iterations, (1..=20).map(|i| i.to_string()).collect::<Vec<_>>());
}

/// A closed stdout does not end a run.
#[test]
fn a_closed_pipe_does_not_end_a_run() {
    let temp = tempfile::tempdir().unwrap();
    let mut child = start(temp.path(), &[&SMALL[..], &["5", "--steps", "100k", "--out", "a"]].concat());
    drop((child.stdout.take(), child.stderr.take()));
    assert!(child.wait().unwrap().success());
    assert!(temp.path().join("a/summary.json").is_file());
}
