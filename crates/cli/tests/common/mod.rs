//! Runs the command in its own folder and reads the results.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

/// A short run: 64 agents make 4096 steps per iteration.
pub const SMALL: [&str; 5] = ["train", "hopper", "--agents", "64", "--seed"];

/// The command, to be run in `folder`.
pub fn marathon(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_marathon"));
    command.current_dir(folder).args(args);
    command
}

/// The command under its usual name.
pub fn program() -> &'static str {
    env!("CARGO_BIN_EXE_marathon")
}

/// Waits until a file has at least this many lines.
pub fn wait_for_lines(path: &Path, lines: usize) {
    let deadline = Instant::now() + Duration::from_secs(60);
    while std::fs::read_to_string(path).unwrap_or_default().lines().count() < lines {
        assert!(Instant::now() < deadline, "{} does not grow", path.display());
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Runs the command to completion.
pub fn run(folder: &Path, args: &[&str]) -> Output {
    marathon(folder, args).output().expect("the command starts")
}

/// Runs the command, which must succeed. Returns its stdout.
pub fn succeed(folder: &Path, args: &[&str]) -> String {
    let output = run(folder, args);
    assert!(output.status.success(), "{args:?}: {}", stderr(&output));
    String::from_utf8(output.stdout).expect("stdout is text")
}

/// Runs the command, which must fail with `code`. Returns its stderr.
pub fn fail(folder: &Path, code: i32, args: &[&str]) -> String {
    let output = run(folder, args);
    assert_eq!(output.status.code(), Some(code), "{args:?}: {}", stderr(&output));
    assert!(output.stdout.is_empty(), "{args:?} writes on stdout: {}", String::from_utf8_lossy(&output.stdout));
    stderr(&output)
}

pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Parses the one JSON object on stdout.
pub fn json(stdout: &str) -> Value {
    serde_json::from_str(stdout).unwrap_or_else(|e| panic!("{e} in {stdout}"))
}

pub fn read_json(path: &Path) -> Value {
    json(&std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display())))
}

/// Tensors of a policy, without the metadata, which contain times: `(name, shape, bytes)`.
pub fn tensors(path: &Path) -> Vec<(String, Vec<usize>, Vec<u8>)> {
    let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let file = safetensors::SafeTensors::deserialize(&bytes).expect("a safetensors file");
    let mut all: Vec<_> =
        file.iter().map(|(name, view)| (name.to_string(), view.shape().to_vec(), view.data().to_vec())).collect();
    all.sort();
    all
}

/// Rows of a CSV file without the columns of time, header included.
pub fn timeless_rows(path: &Path) -> Vec<Vec<String>> {
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_path(path).expect("a CSV file");
    let rows: Vec<csv::StringRecord> = reader.records().map(|row| row.expect("a row")).collect();
    let timeless = |name: &str| !name.contains("second") && !name.ends_with("share");
    let kept: Vec<usize> = (0..rows[0].len()).filter(|i| timeless(&rows[0][*i])).collect();
    rows.iter().map(|row| kept.iter().map(|i| row[*i].to_string()).collect()).collect()
}

/// Event files of a run, in order.
pub fn event_files(run: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = files(run).into_iter().filter(|f| f.to_string_lossy().contains("tfevents")).collect();
    files.sort();
    files
}

/// The Python with the oracles: that of `MARATHON_PYTHON`, else that of `.venv` at the root of the workspace.
pub fn python() -> PathBuf {
    let venv = concat!(env!("CARGO_MANIFEST_DIR"), "/../../.venv/bin/python");
    let python = std::env::var_os("MARATHON_PYTHON").map_or(PathBuf::from(venv), PathBuf::from);
    assert!(python.exists(), "{}: no such file; run ./test.sh, which sets up .venv", python.display());
    python
}

/// One of Marathon's policies.
pub fn shipped(name: &str) -> String {
    format!("{}/../../assets/policies/{name}.safetensors", env!("CARGO_MANIFEST_DIR"))
}

/// All files under a folder.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
        let path = entry.expect("an entry").path();
        if path.is_dir() { all.extend(files(&path)) } else { all.push(path) }
    }
    all
}

/// No file under a temporary name is left.
pub fn assert_no_leftovers(folder: &Path) {
    let left: Vec<_> = files(folder).into_iter().filter(|f| f.extension().is_some_and(|e| e == "tmp")).collect();
    assert!(left.is_empty(), "left behind: {left:?}");
}

/// A recording in DeepMimic's format: a person stands, then bends the right elbow.
pub fn recording() -> String {
    let frame = |elbow: f64| {
        let turns = |count: usize| ",1,0,0,0".repeat(count);
        let [four, two, one] = [4, 2, 1].map(turns);
        format!("[0.0333,0,0.88,0{four},0{two},{elbow}{one},0{two},0]")
    };
    let frames: Vec<String> = (0..20).map(|i| frame(0.05 * f64::from(i))).collect();
    format!("{{\"Loop\": \"none\", \"Frames\": [{}]}}", frames.join(",\n"))
}
